"""Sources in the equatorial plane, seen at the n-th crossing, and where caustics meet it."""

import math

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.beams.ends import Sphere
from kerrcaustics.scripts import STUDIES

TWIN = STUDIES.module("near_sources.twin")
CAMERA = kc.Camera(0.9, 10.0, 1.2, "fiducial")


@pytest.mark.parametrize(
    ("camera", "star", "complaint"),
    [
        (CAMERA, (1.2, 0.0), "`star` must have an r larger than the horizon"),
        (CAMERA, (math.inf, 0.0), "`star` must be two finite numbers"),
        (CAMERA, (1.0, 2.0, 3.0), "`star` must be two finite numbers"),
        (kc.Camera(0.9, 10.0), (6.0, 0.0), "`camera` must not lie in the equatorial plane"),
    ],
)
def test_sources_that_are_none(camera, star, complaint):
    with pytest.raises(ValueError, match=complaint):
        kc.star_images(camera, star, end=kc.EquatorialPlane(2))


def test_planes_that_other_analyses_refuse():
    for function in (kc.star_tracks, kc.pair_events):
        with pytest.raises(ValueError, match=r"`end` must be a radius or math\.inf"):
            function(kc.Camera(0.9, 10.0), 1.2, end=kc.EquatorialPlane(1))


def test_command_line_refuses_bad_planes(capsys):
    camera = ["--spin", "0.9", "--radius", "10", "--inclination", "70"]
    for options in (["--plane", "0"], ["--plane", "1", "--source-radius", "20"]):
        code, out, err = run(capsys, "images", "--star", "6", "45", *camera, *options)
        assert code == 2 and out == "" and err.count("\n") == 1 and "--plane" in err
    code, _, err = run(capsys, "images", "--star", "1.2", "45", *camera, "--plane", "1")
    assert code == 2 and "--star must have an r larger than the horizon" in err


def _random_camera(rng):
    spin = rng.choice([0.0, 0.3, 0.7, 0.9, 0.99])
    return kc.Camera(spin, rng.uniform(4.5, 30), rng.uniform(0.15, 1.45), "fiducial")


def _lacking(twin, images):
    """Images of the twin that are not among those found."""
    pairs = list(zip(images.sky, images.index, strict=True))
    return [one for one in twin if not any(np.linalg.norm(one[:3] - n) < 1e-5 and one[3] == k for n, k in pairs)]


@pytest.mark.slow
@pytest.mark.parametrize("crossing", [1, 2, 3])
def test_plane_images_against_a_dense_grid(crossing):
    rng, end = np.random.default_rng(crossing), kc.EquatorialPlane(crossing)
    for _ in range(3):
        camera = _random_camera(rng)
        source = (1 + math.sqrt(1 - camera.spin**2)) * math.exp(rng.uniform(0.05, 3)), rng.uniform(0, 6)
        images = kc.star_images(camera, source, 3, end=end)
        assert images.certified
        assert not _lacking(TWIN.Twin(camera, end).images(source, 3), images)
        beams = kc.trace_beams(camera, images.sky, "integrated", end=end, time=True)
        np.testing.assert_allclose(beams.radius, source[0], rtol=1e-6)
        np.testing.assert_allclose(np.cos(beams.azimuth), math.cos(source[1]), atol=1e-6)
        np.testing.assert_array_equal(beams.index, images.index)
        np.testing.assert_allclose(beams.time, images.time, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("crossing", [1, 2, 3])
def test_cameras_below_the_plane_see_what_those_above_it_see(crossing):
    """Mirrored, certified."""
    cameras = [CAMERA, kc.Camera(CAMERA.spin, CAMERA.radius, math.pi - CAMERA.inclination, "fiducial")]
    for source in ((3.3, 2.8), (6.0, 0.4)):
        above, below = (kc.star_images(camera, source, 3, end=kc.EquatorialPlane(crossing)) for camera in cameras)
        assert above.certified and below.certified and len(above) == len(below) > 0
        for n, index in zip(above.sky * [1, 1, -1], above.index, strict=True):
            i = int(np.argmin(np.linalg.norm(below.sky - n, axis=1)))
            assert below.index[i] == index and np.linalg.norm(below.sky[i] - n) < 1e-12


@pytest.mark.slow
def test_sphere_images_against_a_dense_grid():
    rng = np.random.default_rng(7)
    for factor in (0.6, 0.9, 1.4, 20.0):
        camera, star = _random_camera(rng), (rng.uniform(0.1, 3.04), rng.uniform(0, 6))
        radius = factor * camera.radius
        images = kc.star_images(camera, star, 2, end=radius)
        assert images.certified
        assert not _lacking(TWIN.Twin(camera, Sphere(radius)).images(star, 2), images)


@pytest.mark.slow
def test_plane_caustics_are_flat_and_bound_the_counts():
    """By the integrator the beams are flat there; across the curve the count changes by two."""
    end = kc.EquatorialPlane(2)
    caustics = kc.caustics(CAMERA, 3, end=end)
    assert [curve.order for curve in caustics] == [2, 2] and caustics.crossing == 2
    curve = caustics[0]
    middle = curve.place[(curve.place[:, 0] > 2) & (curve.place[:, 0] < 50)]
    beams = kc.trace_beams(CAMERA, curve.sky[::9], "integrated", end=end)
    assert np.abs(beams.delta_minus / beams.delta_plus).max() < 1e-7
    np.testing.assert_allclose(beams.radius, curve.place[::9, 0], rtol=1e-6)
    for r, phi in middle[::12]:
        sides = kc.image_counts(CAMERA, [(r, phi - 1e-3), (r, phi + 1e-3)], 3, end=end)
        assert sides.certified.all()
        assert sorted(np.diff(sides.counts, axis=0)[0].tolist()) in ([0, 0, 1, 1], [-1, -1, 0, 0])


@pytest.mark.slow
def test_sections_of_tubes_are_the_curves_found_directly():
    """The points of `caustic_tubes`, by another engine, lie on the caustic of the sphere through them."""
    tube = kc.caustic_tubes(CAMERA, 2, np.array([math.inf, 30.0, 12.0, 6.0]))[1]
    for row, line in ((1, 10), (2, 60), (3, 100)):
        radius = float(tube.points.radius[row, line])
        section = kc.caustics(CAMERA, 2, end=radius)[1]
        place = np.array([tube.points.theta[row, line], tube.points.azimuth[row, line]])
        away = section.celestial - place
        away[:, 1] = (away[:, 1] + math.pi) % (2 * math.pi) - math.pi
        i = int(np.argmin(np.linalg.norm(away, axis=1)))
        ahead = away[(i + 1) % len(away)] - away[i - 1]
        across = abs(ahead[0] * away[i, 1] - ahead[1] * away[i, 0]) / np.linalg.norm(ahead)
        assert across < 2e-5
