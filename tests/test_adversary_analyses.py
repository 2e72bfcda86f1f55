"""The adversary's kinds of analyses: a broken claim is seen, and none is broken in a few cases of each kind."""

import math
from dataclasses import replace

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scripts import STUDIES

claim, driver, kinds = (STUDIES.module(f"adversary.analyses.{name}") for name in ("claim", "driver", "kinds"))
KINDS = kinds.all_kinds()
# Cases of each kind. A true error may be so many times the reported one.
CASES, HONEST = 2, 10.0


def refusing(rng):
    raise ValueError("Argument `radius` must be larger.")


def crashing(rng):
    raise ValueError("setting an array element with a sequence")


def numbered(rng):
    return [claim.Claim("number", float(rng.uniform(0, 0.5)), "kept"), claim.Claim("unknown", math.nan, "NaN")]


def test_what_is_broken_is_seen_and_a_refusal_is_not():
    made = {"refusing": refusing, "crashing": crashing, "numbered": numbered, "silent": lambda rng: []}
    heard = []
    found = driver.try_cases(made, 3, 7, hear=lambda number, kind, worst: heard.append((number, kind, worst)))
    assert [kind for _, kind, _ in heard[:4]] == list(made)
    assert {(one.name, one.ratio) for one in found.broken()} == {("no crash", math.inf), ("unknown", math.inf)}
    assert 'all_kinds()["crashing"](np.random.default_rng((7, 0)))' in found.broken()[0].code
    heads, rows = found.table()
    counts = {row[1]: row[heads.index("> 10")] for row in rows}
    assert counts == {"no crash": "3", "number": "0", "unknown": "3"}
    assert (found.refused["refusing"], found.silent["silent"], found.cases["numbered"]) == (3, 3, 3)
    # A case does not depend on those before it.
    alone = driver.case_claims("numbered", numbered, 7, 2)[0]
    assert alone == numbered(np.random.default_rng((7, 2)))[0] and alone.ratio == found.ratios["numbered", "number"][2]


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_no_claim_is_broken_in_a_few_cases(name):
    found = driver.try_cases({name: KINDS[name]}, CASES, 73)
    assert not found.broken(HONEST) and found.cases[name] == CASES


def shifted(found):
    return replace(found, isoradials=tuple(replace(one, azimuth=one.azimuth + 1e-4) for one in found))


def larger(rings):
    return replace(rings, bands=tuple(replace(one, solid_angle=one.solid_angle * (1 + 1e-4)) for one in rings))


# By kind: the function of the package that is made to lie, how, and a case that claims what is false then.
LIES = {
    "isoradials": ("isoradials", shifted, 1),
    "line profiles": ("line_profile", lambda found: replace(found, flux=found.flux * 1.02), 5),
    "spots": ("light_curve", lambda found: replace(found, shares=found.shares * 1.001), 5),
    "photon rings": ("photon_rings", larger, 4),
    "ring visibility": ("ring_visibility", lambda found: replace(found, real=found.real + 1e-3 * found.flux.max()), 0),
    "moving points": ("light_curve", lambda found: replace(found, emission_time=found.emission_time + 1e-3), 0),
    "discs": ("magnification", lambda found: replace(found, total=found.total * 1.1), 0),
    "balls": ("light_curve", lambda found: replace(found, shares=found.shares * 1.01), 0),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LIES)
def test_a_result_that_lies_is_found_out(name, monkeypatch):
    function, lie, number = LIES[name]
    honest = getattr(kc, function)
    monkeypatch.setattr(kc, function, lambda *values, **options: lie(honest(*values, **options)))
    claims = driver.case_claims(name, KINDS[name], 73, number)
    assert max(one.ratio for one in claims) > HONEST
    assert not any(one.name == driver.CRASH for one in claims)
