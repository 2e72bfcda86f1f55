"""Caustic tubes in space: conjugate points, the caustic far out, narrow near the hole."""

import math
from functools import cache

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.curves import tubes
from kerrcaustics.curves.tubes import CausticTube
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import from_angles

CAMERA = kc.Camera(spin=0.999, radius=6.03)
RADII = np.array([math.inf, 3e4, 300.0, 30.0, 10.0, 5.0, 3.0])
OBSERVERS = {radius: kc.Observer(spin=0.9, inclination=1.2, radius=radius) for radius in (1e3, 1e6, math.inf)}


@cache
def tubes_of(radius: float) -> tuple[CausticTube, ...]:
    return kc.caustic_tubes(OBSERVERS[radius], 2, RADII)


@pytest.fixture(scope="module")
def tube():
    return kc.caustic_tubes(CAMERA, 1, RADII)[0]


@pytest.fixture(scope="module")
def caustic() -> kc.Caustic:
    return kc.caustics(CAMERA, 1)[0]


@pytest.mark.slow
def test_far_out_the_section_is_the_caustic(tube, caustic):
    """Every point of the section at r = 3e4 is within 1e-4 rad of the caustic, and all the caustic is covered."""
    section = np.stack([tube.points.theta[1], tube.points.azimuth[1]], axis=-1)
    assert np.all(np.abs(tube.points.radius[1] / RADII[1] - 1) < 0.05)
    gap = np.linalg.norm(section[:, None] - caustic.celestial[None], axis=-1)
    # The size of the caustic is 7e-3 rad; its sections move by about 1 / r.
    assert gap.min(axis=1).max() < 1.5e-4
    assert gap.min(axis=0).max() < 3e-4
    assert np.ptp(section[:, 0]) == pytest.approx(caustic.theta_extent, rel=2e-3)
    assert np.ptp(section[:, 1]) == pytest.approx(caustic.phi_extent, rel=2e-3)


@pytest.mark.slow
def test_the_first_row_is_the_caustic_itself(tube, caustic):
    assert np.all(tube.points.radius[0] == math.inf)
    rays = kc.trace_rays(CAMERA, tube.sky[0])
    assert np.abs(rays.direction - tube.points.direction[0]).max() < 1e-10
    assert np.ptp(tube.points.theta[0]) == pytest.approx(caustic.theta_extent, rel=2e-3)


@pytest.mark.slow
def test_points_are_conjugate_points_of_their_rays(tube):
    # Their rays, traced in closed form to a little below and a little above.
    for row, line in ((2, 10), (3, 60), (4, 90)):
        radius, sky = tube.points.radius[row, line], tube.sky[row, line]
        below, above = (kc.trace_beams(CAMERA, sky, end=radius * (1 + s)) for s in (-1e-7, 1e-7))
        assert (int(below.index), int(above.index)) == (0, 1)
        turns = (below.azimuth - tube.points.azimuth[row, line]) / (2 * math.pi)
        assert turns == pytest.approx(round(float(turns)), abs=1e-6)


@pytest.mark.slow
def test_the_tube_narrows_toward_the_hole(tube):
    """Its height across the plane, in units of M, falls on the way in, and stays at a fifth near the hole."""
    height = np.ptp(tube.points.radius[1:] * np.cos(tube.points.theta[1:]), axis=1)
    assert np.all(np.diff(height[:5]) < 0)
    assert np.all(height[3:] < 0.25)
    assert height[0] > 100
    # The section is the one of its radius, and symmetric in the plane.
    assert np.all(np.abs(tube.points.radius[1:] / RADII[1:, None] - 1) < 0.1)
    assert np.abs(tube.points.theta.max(axis=1) + tube.points.theta.min(axis=1) - math.pi).max() < 1e-3


def test_wrong_arguments_are_named():
    with pytest.raises(ValueError, match="Argument `radii` must"):
        kc.caustic_tubes(CAMERA, 1, np.array([10.0, 5.0]))
    with pytest.raises(ValueError, match="Argument `orders` must"):
        kc.caustic_tubes(CAMERA, 0)


@pytest.mark.slow
def test_tubes_reach_from_the_sky_to_the_hole():
    for tube in kc.caustic_tubes(CAMERA, 2):
        assert tube.closed
        assert np.all(tube.points.radius[0] == math.inf)
        assert np.all(tube.points.radius[-1] < kerr.horizon(0.999) + 0.5)
        assert tubes.usual_radii(0.999)[-1] == pytest.approx(kerr.horizon(0.999) + 0.4)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [50.0, 3000.0, 1e5])
def test_tubes_of_far_cameras_meet_the_radii(radius):
    camera = kc.Camera(0.9, radius, 1.2, velocity="fiducial")
    tubes_found = kc.caustic_tubes(camera, 2, RADII)
    for found in tubes_found:
        assert np.abs(np.log(found.points.radius[1:-1] / RADII[1:-1, None])).max() < 0.1
    if radius > 1000:
        # In units of (a sin i / r)^2, at r = 30, for an observer at infinity: studies/far_camera/tube.py. A camera
        # at D is closer by the factor 1 + r / D in angle, and the section may be 1 % off its radius.
        height = np.ptp(tubes_found[0].points.theta[3]) * (30 / (0.9 * math.sin(1.2))) ** 2
        assert height == pytest.approx(0.336680 * (1 + 30 / radius) ** 2, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("radius", OBSERVERS)
def test_points_of_observers_are_caustics_where_the_closed_form_has_them(radius):
    """Beams along the rays of a tube, to the radius of each point: they have no width there, and arrive then."""
    observer = OBSERVERS[radius]
    for tube in tubes_of(radius):
        assert tube.closed and tube.sky.shape == (*tube.points.radius.shape, 2)
        for row, line in ((2, 3), (3, 50), (4, 30), (5, 60)):
            places, sky = tube.points, tube.sky[row, line]
            r = float(places.radius[row, line])
            # A source within the observer's radius, behind the hole.
            beam = kc.trace_beams(observer, sky, "closed-form", end=kc.Sphere(r, True), time=True)
            below, above = (kc.trace_beams(observer, sky, end=kc.Sphere(r * (1 + s), True)) for s in (-1e-6, 1e-6))
            assert (int(below.index), int(above.index)) == (tube.order - 1, tube.order)
            assert abs(beam.delta_minus / beam.delta_plus) < 1e-8
            assert np.linalg.norm(beam.direction - places.direction[row, line]) <= 1e-10
            turns = (float(beam.azimuth) - places.azimuth[row, line]) / (2 * math.pi)
            assert turns == pytest.approx(round(turns), abs=1e-9)
            assert abs(beam.time - places.time[row, line]) <= places.time_error[row, line] + beam.time_error
            assert places.error[row, line] < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1e3, math.inf])
def test_sections_are_caustics_of_spheres(radius):
    """As far as the radius of a section is met, to a few hundredths, and the width goes with its square."""
    for row, end in ((3, 30.0), (4, 10.0)):
        for tube, caustic in zip(tubes_of(radius), kc.caustics(OBSERVERS[radius], 2, end=end), strict=True):
            off = np.abs(np.log(tube.points.radius[row] / end)).max()
            assert off < 0.03
            section = np.stack([tube.points.theta[row], tube.points.azimuth[row]], axis=-1)
            turns = np.round((section[:, 1].mean() - caustic.celestial[:, 1].mean()) / (2 * math.pi))
            section[:, 1] -= 2 * math.pi * turns
            gap = np.linalg.norm(section[:, None] - caustic.celestial[None], axis=-1).min(axis=1)
            # The whole of it moves with the radius, by the dragging of a / r or so.
            assert gap.max() < 3 * off * max(caustic.phi_extent, 1 / end) + 0.02 * caustic.phi_extent


@pytest.mark.slow
def test_the_primary_tube_seen_from_infinity_ends_opposite_to_the_observer():
    tube = tubes_of(math.inf)[0]
    assert tube.order == 1 and any("opposite" in remark for remark in tube.remarks)
    assert np.all(tube.points.theta[0] == math.pi - 1.2) and np.all(tube.points.azimuth[0] == math.pi)
    assert np.all(np.isnan(tube.sky[0])) and np.all(np.isnan(tube.points.time[0]))
    # Far out the rays are those of Einstein's ring, b = 2 sqrt(r), whose section shrinks as 1 / r^2.
    size = np.linalg.norm(tube.sky[1:3], axis=-1) / (2 * np.sqrt(tube.points.radius[1:3]))
    assert np.abs(size - 1).max() < 0.1 and np.abs(size[0] - 1).max() < 0.01
    heights = np.ptp(tube.points.theta[1:3], axis=1) * RADII[1:3] ** 2
    assert heights[0] == pytest.approx(heights[1], rel=0.06)
    # In units of (a sin i / r)^2: studies/far_camera/tube.py.
    height = np.ptp(tube.points.theta[3]) * (30 / (0.9 * math.sin(1.2))) ** 2
    assert height == pytest.approx(0.336680, rel=0.01)
    # Light arrives at the same time along all of the ring: r + a constant, as b^2 / r and ln(r / b^2) do not change.
    lag = tube.points.time[1:3] - tube.points.radius[1:3]
    assert np.ptp(lag[0]) < 1e-4 and np.ptp(lag[1]) < 0.02 and np.abs(lag[0].mean() - lag[1].mean()) < 0.5


@pytest.mark.slow
def test_tubes_of_far_cameras_are_those_of_observers():
    camera = kc.Camera(0.9, 1e6, 1.2, velocity="fiducial")
    for seen, own in zip(kc.caustic_tubes(camera, 2, RADII), tubes_of(1e6), strict=True):
        for name in ("radius", "theta", "azimuth", "error"):
            assert np.array_equal(getattr(seen.points, name), getattr(own.points, name))
        late = seen.points.time - own.points.time - (1e6 + 2 * math.log(1e6))
        assert np.abs(late).max() < 4e-10 and np.all(seen.points.time_error > own.points.time_error)
        assert np.abs(1e6 * seen.sky[..., 1:] - own.sky).max() < 1e-5 * np.abs(own.sky).max()


@pytest.mark.slow
@pytest.mark.parametrize("viewer", [kc.Observer(spin=0.0, inclination=1.0), kc.Camera(0.0, 1e6, 1.0, "fiducial")])
def test_without_spin_the_tube_is_the_line_behind_the_hole(viewer):
    for tube in kc.caustic_tubes(viewer, 2, np.array([math.inf, 1e4, 30.0, 8.0])):
        # Odd orders lie behind the hole, even ones before it.
        goal = from_angles(viewer.inclination, 0.0) * (1 if tube.order % 2 == 0 else -1)
        off = np.linalg.norm(tube.points.direction - goal, axis=-1)
        assert np.all(off <= 2 * tube.points.error + 1e-14) and off.max() < 1e-9
        # Round the line all is the same.
        for values in (tube.points.radius[1:], tube.points.time[1:]):
            assert np.all(np.ptp(values, axis=1) < 1e-6 * tube.points.radius[1:, 0])
