"""Caustic tubes in space: conjugate points, the caustic far out, narrow near the hole."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.curves import tubes
from kerrcaustics.spacetime import kerr

CAMERA = kc.Camera(spin=0.999, radius=6.03)
RADII = np.array([math.inf, 3e4, 300.0, 30.0, 10.0, 5.0, 3.0])


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
