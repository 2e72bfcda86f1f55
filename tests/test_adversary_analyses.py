"""The adversary's kinds of analyses: a broken claim is seen, and none is broken in a few cases of each kind."""

import math

import numpy as np
import pytest

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
