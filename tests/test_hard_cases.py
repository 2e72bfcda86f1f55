"""Directions at the extremes whose truth another program knows, against all that is claimed; see data/README.md."""

import json
import math
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scripts import STUDIES

CASES = json.loads((Path(__file__).parent / "data" / "hard_cases.json").read_text(encoding="utf-8"))["cases"]
claims = STUDIES.module("adversary.claims")
# The true error is at most this many times the reported one.
HONEST = 10.0


def request(case: dict) -> str:
    """The settings that cases share which are traced together."""
    return json.dumps([case[name] for name in ("engine", "spin", "radius", "inclination", "velocity", "end")])


def ends(cases: list[dict]):
    """The true ends as the study adversary has them; the other program knows no times, and no columns of J."""
    found = claims.ends_in_truth([None] * len(cases))
    for i, truth in enumerate(case["truth"] for case in cases):
        if truth["arrives"]:
            found.status[i], found.direction[i], found.azimuth[i] = 0, truth["direction"], truth["azimuth"]
            found.index[i], found.crossings[i] = truth["index"], truth["crossings"]
            found.radius[i] = truth["radius"] or math.inf
            found.diameters[i] = truth.get("delta_plus", math.nan), truth.get("delta_minus", math.nan)
        elif truth["arrives"] is not None:
            found.status[i] = truth["oracle_status"]
    return found


def broken(cases: list[dict], trace) -> list[str]:
    """The claims that do not hold of cases traced together, in words."""
    first = cases[0]
    velocity = first["velocity"] if isinstance(first["velocity"], str) else tuple(first["velocity"])
    camera = kc.Camera(first["spin"], first["radius"], first["inclination"], velocity)
    end = first["end"]
    end = math.inf if end is None else kc.EquatorialPlane(end["plane"]) if isinstance(end, dict) else end
    result = trace(camera, [case["N"] for case in cases], first["engine"], end=end)
    found = claims.ratios(result, ends(cases), end, 1e-10)
    return [
        f"{first['engine']} {trace.__name__} {camera}, {cases[i]['N']}, end={end}: {claim} {ratio[i]:.3g}"
        for claim, ratio in found.items()
        for i in np.flatnonzero(ratio > (1 if claim == claims.TOLERANCE else HONEST))
    ]


@pytest.mark.parametrize("trace", [kc.trace_rays, kc.trace_beams])
@pytest.mark.parametrize("engine", ["auto", "closed-form", "integrated"])
def test_no_claim_is_broken(engine, trace):
    chosen = sorted((case for case in CASES if case["engine"] == engine), key=request)
    requests = [list(group) for _, group in groupby(chosen, request)]
    assert requests and not [words for cases in requests for words in broken(cases, trace)]


def test_the_cases_are_those_of_the_other_program():
    assert len(CASES) == 473
    unknown = [case for case in CASES if case["truth"]["arrives"] is None]
    assert len(unknown) == 13 and all(case["end"] == case["radius"] for case in unknown)
