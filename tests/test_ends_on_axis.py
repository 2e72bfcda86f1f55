"""Ends on or next to the spin axis, cameras on it, circular cameras at extremal holes; see data/README.md."""

import json
import math
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scripts import STUDIES

CASES = json.loads((Path(__file__).parent / "data" / "axis_and_extremal.json").read_text(encoding="utf-8"))["cases"]
claims = STUDIES.module("adversary.claims")
directions = STUDIES.module("directions")
# The true error is at most this many times the reported one.
HONEST = 10.0


def camera_of(case: dict) -> kc.Camera:
    velocity = case["velocity"] if isinstance(case["velocity"], str) else tuple(case["velocity"])
    return kc.Camera(case["spin"], case["radius"], case["inclination"], velocity)


def ends(cases: list[dict]):
    """The true ends as the study adversary has them."""
    found = claims.ends_in_truth([None] * len(cases))
    found.status[:], found.radius[:] = 0, math.inf
    for i, truth in enumerate(case["truth"] for case in cases):
        found.direction[i], found.columns[i] = truth["direction"], truth["columns"]
        found.azimuth[i], found.index[i], found.crossings[i] = truth["azimuth"], truth["index"], truth["crossings"]
        plus = np.linalg.norm(found.columns[i], 2)
        determinant = found.direction[i] @ np.cross(found.columns[i][:, 0], found.columns[i][:, 1])
        found.diameters[i] = plus, determinant / plus
    return found


@pytest.mark.parametrize("engine", ["closed-form", "integrated"])
def test_all_that_is_claimed_holds(engine):
    wrong, number = [], 0
    for _, group in groupby(CASES, key=lambda case: [case[n] for n in ("spin", "radius", "inclination", "velocity")]):
        cases = list(group)
        beams = kc.trace_beams(camera_of(cases[0]), [case["N"] for case in cases], engine)
        number += beams.escaped.sum()
        for claim, ratio in claims.ratios(beams, ends(cases), math.inf, 1e-10).items():
            limit = 1 if claim == claims.TOLERANCE else HONEST
            wrong += [(claim, cases[i]["kind"], cases[i]["N"], ratio[i]) for i in np.flatnonzero(ratio > limit)]
    assert not wrong and number == len(CASES)


def test_the_jacobian_of_an_end_next_to_the_axis_is_as_uncertain_as_its_basis():
    """Its diameters are not."""
    camera, distance = kc.Camera(0.9, 8.0, 1.0, "fiducial"), np.repeat([1e-2, 1e-5, 1e-8, 1e-20], 8)
    sky = directions.ending_on_axis(camera, distance, np.random.default_rng(1))
    beams, other = (kc.trace_beams(camera, sky, engine) for engine in ("closed-form", "integrated"))
    across = np.hypot(beams.direction[:, 0], beams.direction[:, 1])
    near = beams.escaped & (across < 2 * np.maximum(distance, 1e-13)) & (beams.delta_plus < 100)
    assert all(near[distance == one].sum() > 3 for one in np.unique(distance))
    off = np.linalg.norm(beams.jacobian - other.jacobian, axis=(1, 2)) / beams.delta_plus
    assert np.all((off < beams.jacobian_error + other.jacobian_error)[near & (beams.jacobian_error < 1)])
    turn = np.minimum(beams.error / np.maximum(across, 1e-300), 1)
    assert np.all(beams.jacobian_error[near] < beams.diameter_error[near] + 2 * turn[near])
    assert np.all(beams.jacobian_error[near & (distance == 1e-20)] == 1) and np.all(beams.diameter_error[near] < 1e-9)
    # The position angle is as uncertain; the diameters of an ellipse are not.
    found = beams.from_ellipse(0.5, 0.3)
    assert np.all(found.angle_error[near & (beams.jacobian_error < 1)] >= 0.9 * turn[near & (beams.jacobian_error < 1)])
    assert np.all(found.error[near] < 1e-9 * found.delta_plus[near])


@pytest.mark.parametrize(("spin", "inclination"), [(0.0, 0.0), (0.9, math.pi), (0.998, 0.0)])
def test_engines_count_the_same_turns_of_a_ray_from_the_axis(spin, inclination):
    """It has b = 0 and, where it passes the axis again, goes half round it: both by the same convention."""
    camera = kc.Camera(spin, 8.0, inclination, "fiducial")
    sky = np.random.default_rng(2).normal(size=(400, 3))
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    formula, steps = (kc.trace_rays(camera, sky, engine) for engine in ("closed-form", "integrated"))
    assert np.isinf(formula.azimuth_error[formula.escaped]).sum() > 10
    np.testing.assert_allclose(formula.azimuth, steps.azimuth, atol=1e-8, rtol=0)
    # Those that do not pass it go straight from the azimuth in which they leave, dragged along alone.
    direct = formula.escaped & np.isfinite(formula.azimuth_error)
    assert direct.sum() > 50
    if spin == 0:
        leaving = math.atan2(0, 1) + np.arctan2(sky[direct, 1], -sky[direct, 2])
        gap = formula.azimuth[direct] - leaving
        assert np.ptp(gap - 2 * math.pi * np.round(gap / (2 * math.pi))) < 1e-12
        assert np.all(np.abs(formula.azimuth[direct]) <= math.pi)
