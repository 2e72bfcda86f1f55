"""The study adversary: its truth at every kind of end, its hard cases, and that nothing in them lies."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from marks import few
from random_rays import hard, hard_cases

import kerrcaustics as kc
from kerrcaustics.scripts import STUDIES

claims, hunt, tally, trials, truth = (
    STUDIES.module(f"adversary.{name}") for name in ("claims", "hunt", "tally", "trials", "truth")
)
places, true_images = (STUDIES.module(f"adversary.{name}") for name in ("places", "true_images"))
TRUTH = json.loads((Path(__file__).parents[1] / "studies" / "truth" / "truth.json").read_text(encoding="utf-8"))
HARD = json.loads((Path(__file__).parent / "data" / "hard_cases.json").read_text(encoding="utf-8"))["cases"]
FINITE = [case for case in HARD if case["end"] and case["truth"]["arrives"]][::13]
PLACE = truth.Place(0.9, 6.0, 1.2, (0.1, -0.2, 0.3))
SKY = [-0.5, 0.8, 0.3]
# The true error is at most this many times the reported one.
HONEST = 10.0


@pytest.mark.parametrize("ray", TRUTH["rays"][::99], ids=lambda ray: ray["family"])
def test_truth_at_infinity_is_that_of_the_other_program(ray):
    place = truth.Place(**TRUTH["cameras"][ray["camera"]])
    found = truth.known(place, ray["sky"], math.inf)
    assert np.allclose(found.direction, np.array(ray["direction"], float), atol=1e-15, rtol=0)
    assert found.azimuth == pytest.approx(float(ray["azimuth"]), abs=1e-14)
    assert found.time == pytest.approx(float(ray["delay"]), abs=1e-13)
    size = float(ray["delta_plus"])
    assert np.allclose(found.columns, np.array(ray["columns"], float), atol=1e-14 * size, rtol=0)
    assert found.index == ray["index"]


@pytest.mark.parametrize("case", few(FINITE, ()), ids=lambda c: c["class"])
def test_truth_at_finite_ends_is_that_of_another_program(case):
    end = case["end"]["plane"] if isinstance(case["end"], dict) else case["end"]
    velocity = case["velocity"] if isinstance(case["velocity"], str) else tuple(case["velocity"])
    place = truth.Place(case["spin"], case["radius"], case["inclination"], velocity)
    found, true = truth.known(place, case["N"], end), case["truth"]
    # So well the other program knows a beam that opens by its major diameter.
    allowed = 1e-14 + 1e-21 * np.linalg.norm(found.columns)
    assert np.linalg.norm(found.direction - true["direction"]) < allowed
    assert found.azimuth == pytest.approx(true["azimuth"], rel=1e-15, abs=1e-15 + allowed)
    assert found.radius == pytest.approx(true["radius"], rel=1e-14)
    assert (found.index, found.crossings) == (true["index"], true["crossings"])


@pytest.mark.slow
@pytest.mark.parametrize("end", [math.inf, 5.0, 40.0, 6.0, 1])
def test_truth_does_not_depend_on_its_digits(end):
    one, two = (truth.known(PLACE, SKY, end, digits) for digits in (50, 64))
    for name in ("direction", "azimuth", "time", "columns"):
        assert np.allclose(getattr(one, name), getattr(two, name), rtol=1e-15, atol=1e-15)
    assert (one.index, one.crossings) == (two.index, two.crossings)


def test_what_never_arrives_is_lost():
    inward, outward = [-1.0, 0.0, 0.05], [1.0, 0.0, 0.05]
    assert truth.known(PLACE, inward, math.inf) == truth.Lost(captured=True)
    assert truth.known(PLACE, inward, 10.0) == truth.Lost(captured=True)
    assert truth.known(PLACE, outward, 3.0) == truth.Lost(captured=False)
    assert truth.known(PLACE, outward, 3) == truth.Lost(captured=False)
    assert isinstance(truth.known(PLACE, inward, 3.0), truth.Known)


@pytest.mark.slow
def test_a_result_that_lies_is_found_out():
    camera = kc.Camera(0.9, 6.0, 1.2, "fiducial")
    case = hard.Case(camera, np.array([[0.2, 0.9, 0.3], [-0.1, 0.95, 0.3]]), ["whole sky"] * 2, math.inf)
    trial = trials.Trial("closed-form", 1e-10, beams=True, timed=False)
    (good,) = trials.judge(case, (trial,), 1.0, np.random.default_rng(0))
    assert good.by_truth.all() and all(np.nan_to_num(ratio).max() < 1 for ratio in good.ratios.values())
    ends = claims.ends_in_truth(good.truths)
    lies = {
        "direction": {"direction": good.result.direction + 1e-11},
        "azimuth": {"azimuth": good.result.azimuth + 2 * math.pi},
        "Jacobian": {"jacobian": good.result.jacobian + 1e-9},
        "index": {"index": good.result.index + 1},
        "crossings": {"crossings": good.result.crossings + 1},
        "no NaN": {"jacobian_error": np.full(2, math.nan)},
        "arrival": {"status": np.full(2, kc.Status.CAPTURED)},
        claims.TOLERANCE: {"direction": good.result.direction + 1e-9},
    }
    for claim, changed in lies.items():
        result = type(good.result)(**{**vars(good.result), **changed})
        assert (claims.ratios(result, ends, math.inf, 1e-10)[claim] > 1).all(), claim


@pytest.mark.slow
@settings(max_examples=4, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(case=hard_cases(ends=False))
def test_hard_cases_are_directions_whose_ends_are_directions(case):
    assert np.allclose(np.linalg.norm(case.sky, axis=1), 1, atol=1e-15, rtol=0)
    beams = kc.trace_beams(case.camera, case.sky)
    assert np.allclose(np.linalg.norm(beams.direction[beams.escaped], axis=1), 1, atol=1e-14, rtol=0)
    assert (beams.error[beams.escaped] > 0).all() and np.isnan(beams.error[~beams.escaped]).all()


def broken(found: list, asked: tuple) -> str:
    """Claims that do not hold, as Python."""
    counted = hunt.hunt(found, 0.02, trials=asked)
    return "\n".join(str(one) for one in counted.broken(HONEST))


def test_nothing_lies_in_a_few_hard_cases():
    asked = tuple(trial._replace(timed=False) for trial in trials.TRIALS if trial.tolerance == 1e-10 and trial.beams)
    assert not broken([case._replace(end=math.inf) for case in hard.cases(6, 14, 18)], asked)


@pytest.mark.slow
def test_nothing_lies_in_many_hard_cases():
    assert not broken(list(hard.cases(20, 1970, 63)), trials.TRIALS)


def test_a_true_image_is_where_its_ray_leads_to_the_star():
    """From a direction whose end is the star, and from one beside it."""
    sky, star = np.array(SKY) / np.linalg.norm(SKY), truth.known(PLACE, SKY, 40.0).direction
    angles = (math.atan2(math.hypot(star[0], star[1]), star[2]), math.atan2(star[1], star[0]))
    beside = sky + np.array([3e-9, -2e-9, 4e-9])
    beside /= np.linalg.norm(beside)
    found = true_images.true_image(PLACE, beside.tolist(), angles, 40.0)
    assert np.allclose(found.away, sky - beside, atol=3e-15, rtol=0)
    assert found.blur < 1e-15


@pytest.mark.slow
def test_refined_images_next_to_extremal_holes_report_their_errors():
    rng, cameras = np.random.default_rng(7), places.fast_holes(7)
    claims = [claim for _ in range(6) for claim in places.refined_claims(*next(cameras), rng, most=4)]
    assert len(claims) > 12 and not places.broken(claims)


@pytest.mark.slow
def test_images_of_moving_cameras_lie_within_their_errors():
    cameras = places.moving_cameras(11)
    claims = [claim for _ in range(6) for claim in places.moving_claims(*next(cameras))]
    assert len(claims) > 30 and not places.broken(claims)
