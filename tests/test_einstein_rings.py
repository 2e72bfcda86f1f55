"""Stars in line with the camera and a hole that is round about that line: their images are rings."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

import kerrcaustics as kc

SPIN, RADIUS, THETA = 0.0, 10.0, 1.2
CAMERA = kc.Camera(SPIN, RADIUS, THETA, (0, 0, 0.3))
REST = kc.Camera(SPIN, RADIUS, THETA, "fiducial")
BEHIND, OPPOSITE = (math.pi - THETA, math.pi), (THETA, 0.0)


def swept(radius, angle):
    """Angle about a hole without spin from a camera at rest to infinity, of a ray that far from the hole's centre."""
    square = (radius * math.sin(angle)) ** 2 / (1 - 2 / radius)
    lowest = min(r.real for r in np.roots([2, -1, 0, 1 / square]) if abs(r.imag) < 1e-12 and r.real > 0)
    # 1 / b^2 - u^2 + 2 u^3 over (lowest - u), by division.
    rest = np.polydiv([2, -1, 0, 1 / square], [-1, lowest])[0]

    def legs(first):
        return quad(lambda s: 2 / math.sqrt(np.polyval(rest, lowest - s * s)), 0, math.sqrt(lowest - first))[0]

    return legs(0.0) + legs(1 / radius)


def radii(remarks):
    return [float(line.split(" rad (within")[0].split()[-1]) for line in remarks]


@pytest.mark.slow
@pytest.mark.parametrize(("star", "orders", "left"), [(BEHIND, (1, 3), 0), (OPPOSITE, (2,), 1)])
def test_a_star_in_line_is_seen_as_rings_of_the_right_size(star, orders, left):
    images = kc.star_images(REST, star)
    assert len(images) == left and images.on_caustic == orders and not images.certified
    found = radii(images.remarks)
    assert len(found) == len(orders)
    for order, radius in zip(orders, found, strict=True):
        assert swept(RADIUS, radius) == pytest.approx(order * math.pi, abs=1e-7)
    assert all("one ring" in line for line in images.remarks)


@pytest.mark.slow
def test_a_moving_camera_sees_the_ring_smaller_or_larger():
    resting, moving = (radii(kc.star_images(camera, BEHIND).remarks)[0] for camera in (REST, CAMERA))
    curve = kc.caustics(CAMERA, 1).curves[0].sky
    # A circle: all its points are as far from one direction.
    centre = np.linalg.lstsq(curve, np.ones(len(curve)), rcond=None)[0]
    size = math.acos(1 / np.linalg.norm(centre))
    assert moving == pytest.approx(min(size, math.pi - size), abs=1e-9) and abs(moving - resting) > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("off", [1e-11, 1e-8])
def test_beside_the_line_images_are_on_the_ring_within_their_errors(off):
    """The line, the star and its images lie in one plane with the camera."""
    images = kc.star_images(REST, (BEHIND[0] + off, math.pi), 1)
    assert len(images) == 2 and images.certified
    # That plane holds e_r and e_z.
    assert (np.abs(images.sky[:, 1]) < 2 * images.error).all() and (images.error < 1e-13 / off).all()


@pytest.mark.slow
def test_stars_within_rounding_of_the_line_are_rings():
    offsets = np.array([0, 1e-16, -3e-16, 1e-15])
    stars = [(BEHIND[0] + off, math.pi) for off in offsets]
    counts = kc.image_counts(REST, [*stars, (1.0, 1.0)], 1)
    assert counts.on_caustic.tolist() == [True] * 4 + [False] and counts.counts[:4].sum() == 0
    assert counts.certified.tolist() == [False] * 4 + [True]


@pytest.mark.slow
@pytest.mark.parametrize("theta", [0.0, math.pi])
def test_a_star_on_the_spin_axis_is_a_ring_to_a_camera_there(theta):
    images = kc.star_images(kc.Camera(0.9, RADIUS, 0.0, "fiducial"), (theta, 0.7), 1)
    assert len(images) == (theta == 0) and "one ring" in images.remarks[0] and not images.certified


@pytest.mark.slow
def test_a_nearer_star_in_line_is_a_ring_too():
    images = kc.star_images(REST, BEHIND, 1, end=7.0)
    assert len(images) == 0 and images.on_caustic == (1,) and "one ring" in images.remarks[0]


@pytest.mark.slow
@pytest.mark.parametrize(("theta", "whole"), [(BEHIND[0], ()), (THETA, (0,))])
def test_tracks_end_at_rings(theta, whole):
    tracks = kc.star_tracks(CAMERA, theta, 1)
    assert not tracks.certified and len(tracks.tracks) == 2 and all("one ring" in line for line in tracks.remarks)
    for track in tracks.tracks:
        (index,) = set(track.index.tolist())
        assert track.closed == (index in whole) and track.error.max() < 1e-7
        assert np.linalg.norm(np.diff(track.sky, axis=0), axis=1).max() < 0.05
        # All but 1e-4 on both sides of the ring.
        assert np.ptp(track.azimuth) > 2 * math.pi - (3e-4 if index not in whole else 0.2)


@pytest.mark.slow
def test_a_great_circle_through_the_line_is_cut_at_rings():
    circle = kc.circle_images(REST, (THETA + math.pi / 2, 0.0), 1)
    assert not circle.certified and all("one ring" in line for line in circle.remarks)
    assert all(curve.error < 1e-7 and not curve.closed for curve in circle.curves)
    assert circle.per_index == {0: 1, 1: 2}


@pytest.mark.slow
def test_seen_from_infinity_the_first_ring_is_infinite():
    images = kc.star_images(kc.Observer(spin=SPIN, inclination=THETA), BEHIND, 1)
    assert len(images) == 0 and images.remarks[1].endswith("index 0 and 1 are one ring at infinite (alpha, beta)")


@pytest.mark.slow
def test_a_track_within_rounding_of_the_line_ends_at_rings_too():
    tracks = kc.star_tracks(CAMERA, BEHIND[0] + 3e-14, 1)
    assert len(tracks.tracks) == 2 and all("one ring" in line for line in tracks.remarks) and not tracks.certified
