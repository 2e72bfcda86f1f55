"""The two methods for the images of a disc, which know nothing of each other: the same areas, and honest errors."""

import math

import numpy as np
import problems
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.ends import Sphere, end_of
from kerrcaustics.extended_sources.arcs.area import flat_from_hole, winding
from kerrcaustics.extended_sources.charts.chart_method import disc_images_on_charts
from kerrcaustics.extended_sources.sheets.sheet_method import disc_images_on_sheets
from kerrcaustics.spacetime.sphere import from_angles

# Relative difference of both areas that rounding explains, where the errors are smaller still.
ROUNDING = 1e-11


def assert_methods_agree(viewer, surface, centre, size, max_index):
    """Both methods certify the disc, and agree to rounding or to the sum of their errors, whichever is larger."""
    sheets = disc_images_on_sheets(viewer, surface, centre, size, max_index, None)
    charts = disc_images_on_charts(viewer, surface, centre, size, max_index)
    assert sheets.certified and charts.certified, (sheets.remarks, charts.remarks)
    most = np.maximum(ROUNDING * np.abs(sheets.shares), sheets.share_errors + charts.share_errors)
    assert (np.abs(sheets.shares - charts.shares) <= most).all()
    difference = abs(sheets.area - charts.area)
    assert difference <= max(ROUNDING * sheets.area, sheets.error + charts.error)
    return difference / sheets.area


@problems.each(problems.DISCS, lambda problem: problem.end == math.inf, slow=("beside the hole", "behind the hole"))
def test_sheets_and_charts_agree(problem):
    surface = end_of(problem.viewer, math.inf)
    assert_methods_agree(problem.viewer, surface, from_angles(*problem.place), problem.size, problem.max_index)


@pytest.mark.slow
def test_sheets_and_charts_agree_on_a_sphere_of_the_viewers_radius():
    problem = problems.DISCS["sphere of the viewer"]
    size = problem.size / problem.end
    assert_methods_agree(problem.viewer, Sphere(problem.end), from_angles(*problem.place), size, problem.max_index)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sphere of the viewer, about it", "sphere of the viewer, at it"])
def test_disc_about_the_viewer_is_left_to_the_charts(name):
    """The sky is cut off where rays leave horizontally: the charts have this edge."""
    problem = problems.DISCS[name]
    viewer, size, surface = problem.viewer, problem.size / problem.end, Sphere(problem.end)
    sheets = disc_images_on_sheets(viewer, surface, from_angles(*problem.place), size, problem.max_index, None)
    assert problems.magnified(problem).certified and sheets.remarks == ("the viewer lies within the disc",)


@pytest.mark.slow
def test_sheets_and_charts_agree_on_random_discs():
    chance, differences = np.random.default_rng(1), []
    for _ in range(60):
        spin = float(chance.choice([0.0, 0.999])) if chance.uniform() < 0.2 else float(chance.uniform(0, 0.999))
        radius = 6 * 10 ** float(chance.uniform(0, 4.5))
        viewer = kc.Camera(spin, radius, math.acos(float(chance.uniform(-0.99, 0.99))), "fiducial")
        if chance.uniform() < 0.1:
            viewer = kc.Observer(spin=spin, inclination=viewer.inclination)
        surface = end_of(viewer, math.inf)
        if isinstance(viewer, kc.Camera) and chance.uniform() < 0.3:
            surface = Sphere(radius * 20 ** float(chance.uniform(0.05, 1)))
        centre = from_angles(math.acos(float(chance.uniform(-1, 1))), float(chance.uniform(0, 2 * math.pi)))
        size, max_index = 10 ** float(chance.uniform(-3, math.log10(0.5))), int(chance.integers(0, 3))
        differences.append(assert_methods_agree(viewer, surface, centre, size, max_index))
    # Most differences are far below the errors: these are bounds.
    assert np.median(differences) < ROUNDING


@pytest.mark.slow
def test_disc_that_the_sheets_leave_in_doubt_is_left_to_the_charts():
    viewer, place, size, max_index = kc.Camera(0.505, 31.88, 1.508, "fiducial"), (1.727435402, 8.451490241), 4.29e-5, 2
    sheets = disc_images_on_sheets(viewer, end_of(viewer, math.inf), from_angles(*place), size, max_index, None)
    seen = kc.magnification(viewer, place, size, max_index=max_index)
    assert not sheets.certified and seen.certified and seen.error < 1e-6 * seen.total
    # The light of a disc between others of nearly its size.
    beside = [kc.magnification(viewer, place, size * (1 + step), max_index=max_index) for step in (-1e-3, 1e-3)]
    assert beside[0].total * (1 - 1e-3) ** 2 < seen.total < beside[1].total * (1 + 1e-3) ** 2


@pytest.mark.parametrize("hole", [(0.0, 0.0, -1.0), (3.0, 0.0)], ids=["sphere", "plane"])
def test_place_of_the_hole_lies_at_no_finite_place_of_the_plane(hole):
    places = np.array([hole, np.roll(hole, 1)])
    with np.errstate(all="raise"):
        plane = flat_from_hole(places, np.array(hole))
        about = winding(plane[None, [0] + 8 * [1]], np.ones(1), plane[1:] + 1)
    assert np.isnan(plane[0]) and np.isfinite(plane[1]) and np.isnan(about).all()
