"""Tolerances of analyses: errors are honest at each, and a looser one takes fewer beams."""

import math
import time
from functools import partial

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scripts import STUDIES

STAGES = STUDIES.module("cost.stages")
NEAR = kc.Camera(0.9, 20.0, 1.1, "static")
BINS = np.linspace(0.3, 1.4, 41)
LOOSE = 0.1, 1e-2, 1e-3


def with_beams(call, **settings):
    """What a call returns, and the number of rays and beams that it takes."""
    with STAGES.watched(time.process_time) as stages:
        found = call(**settings)
    return found, sum(stages.traced.values())


@pytest.fixture(scope="module")
def fine_profile():
    return kc.line_profile(NEAR, 3.0, 12.0, bins=BINS, radii=32, turns=256)


def test_profiles_reach_their_tolerance(fine_profile):
    taken = []
    for tolerance in LOOSE:
        found, beams = with_beams(partial(kc.line_profile, NEAR, 3.0, 12.0), bins=BINS, tolerance=tolerance)
        taken.append(beams)
        highest = fine_profile.flux.max()
        assert found.error.max() <= tolerance * highest and not found.remarks
        assert (np.abs(found.flux - fine_profile.flux) <= found.error + fine_profile.error).all()
    assert taken[0] < taken[2] / 2 and taken == sorted(taken)
    assert kc.line_profile(NEAR, 3.0, 12.0, bins=BINS) == found


def test_errors_hold_the_horns_in_which_a_narrow_ring_ends():
    observer = kc.Observer(spin=0.0, inclination=1.0)
    found = kc.line_profile(observer, 6.0, 6.06, bins=50)
    fine = kc.line_profile(observer, 6.0, 6.06, bins=found.edges, radii=32, turns=1024)
    off = np.abs(found.flux - fine.flux)
    assert (off <= found.error + fine.error).all() and off[-1] > 0.3 * found.error[-1]


def test_errors_of_a_spot_hold_at_every_time():
    """With 256 points they are small by chance at some times."""
    camera, times = kc.Camera(0.0, 50.0, 1.0, "static"), np.linspace(100.0, 240.0, 100)
    rough, fine = (
        kc.light_curve(camera, 8.0, times, source=kc.Spot(0.1, crossings=3, points=points)) for points in (256, 4096)
    )
    assert (np.abs(rough.flux - fine.flux) <= rough.error + fine.error).all()


def test_profiles_are_those_of_their_intervals(fine_profile):
    """Nodes that are known are not traced again."""
    found = kc.line_profile(NEAR, 3.0, 12.0, bins=BINS, tolerance=1e-3)
    fixed = kc.line_profile(NEAR, 3.0, 12.0, bins=BINS, radii=16, turns=128)
    assert (found.flux == fixed.flux).all() and (found.error == fixed.error).all()
    assert found.rays == pytest.approx(fixed.rays, rel=0.05)
    half = kc.line_profile(NEAR, 3.0, 12.0, bins=BINS, tolerance=1e-3, radii=16)
    assert (np.abs(half.flux - fine_profile.flux) <= half.error + fine_profile.error).all()


@pytest.mark.slow
def test_profiles_say_what_they_do_not_reach():
    found = kc.line_profile(NEAR, 3.0, 12.0, bins=BINS, tolerance=1e-6, radii=8)
    (remark,) = found.remarks
    assert "above the tolerance 1e-06" in remark and found.error.max() > 1e-6 * found.flux.max()


@pytest.mark.slow
@pytest.mark.parametrize(("profile", "on_caustic"), [("uniform", True), (("gaussian", 0.3), False)])
def test_discs_reach_their_tolerance(profile, on_caustic):
    camera = kc.Camera(0.9, 10.0, 1.2)
    place = kc.caustics(camera, 1)[0].place[30] if on_caustic else (1.4, 2.9)
    light = partial(kc.magnification, camera, place, 0.01, profile=profile, max_index=int(on_caustic))
    best = light()
    taken = []
    for tolerance in (0.1, 1e-3, 1e-6):
        found, beams = with_beams(light, tolerance=tolerance)
        taken.append(beams)
        assert found.certified and found.error <= tolerance * found.total
        assert abs(found.total - best.total) <= found.error + best.error
    assert taken == sorted(taken) and taken[1] < 0.8 * taken[2]
    assert found == best


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: kc.line_profile(NEAR, 3.0, 12.0, tolerance=0.2), "must lie in [1e-06, 0.1], but is 0.2"),
        (lambda: kc.line_profile(NEAR, 3.0, 12.0, tolerance=math.nan), "must lie in [1e-06, 0.1], but is nan"),
        (
            lambda: kc.line_profile(NEAR, 3.0, 12.0, tolerance=0.1, radii=8, turns=8),
            "must be left out beside `radii` and `turns`, which fix the accuracy",
        ),
        (lambda: kc.magnification(NEAR, (1.4, 2.9), 0.01, tolerance=0), "must lie in [1e-09, 0.1], but is 0"),
        (lambda: kc.magnification(NEAR, (1.4, 2.9), 0.01, tolerance="low"), "must lie in [1e-09, 0.1]"),
    ],
)
def test_bad_tolerances_are_one_line(call, words):
    with pytest.raises(ValueError) as caught:
        call()
    assert str(caught.value).startswith(f"Argument `tolerance` {words}") and "\n" not in str(caught.value)
