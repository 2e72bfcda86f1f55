"""A new surface costs one class: the celestial sphere in coordinates about a tilted axis."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.sphere import from_angles, polar_angle

VIEWER = kc.Observer(spin=0.9, radius=50.0, inclination=1.2)
# The axis of the coordinates, and the directions from which phi is counted: east of it, and at right angles.
AXES = Circle.great(0.7, 0.4).axes


class TiltedSky(kc.CelestialSphere):
    """The celestial sphere, theta counted from a tilted axis."""

    axes = AXES

    def bare(self):
        return SKY

    def vectors(self, places):
        return from_angles(places[:, 0], places[:, 1]) @ AXES

    def angles(self, direction, azimuth):
        turned = direction @ AXES.T
        return polar_angle(turned), np.arctan2(turned[..., 1], turned[..., 0])


TILTED = TiltedSky()


def place_of(theta, phi):
    """A place in the tilted coordinates."""
    turned = AXES @ from_angles(theta, phi)
    return float(polar_angle(turned)), float(np.arctan2(turned[1], turned[0]))


def test_images_are_those_of_the_same_star():
    star = (1.7, 3.1)
    plain, tilted = kc.star_images(VIEWER, star, 1), kc.star_images(VIEWER, place_of(*star), 1, end=TILTED)
    assert tilted.certified and tilted.surface is TILTED and len(tilted) == len(plain) > 1
    np.testing.assert_allclose(tilted.sky, plain.sky, atol=1e-12)
    np.testing.assert_allclose(tilted.magnification, plain.magnification, rtol=1e-9)
    turns = (tilted.azimuth - tilted.star[1]) / (2 * math.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
    counts = kc.image_counts(VIEWER, [place_of(*star)], 1, end=TILTED)
    assert counts.counts[0].tolist() == list(plain.per_index.values()) and counts.certified.all()


def test_caustics_have_extremes_in_its_coordinates():
    (plain,), (tilted,) = kc.caustics(VIEWER, 1), kc.caustics(VIEWER, 1, end=TILTED)
    assert (tilted.kind, len(tilted.cusps), tilted.surface) == ("astroid", 4, TILTED)
    np.testing.assert_array_equal(tilted.sky, plain.sky)
    there = TILTED.vectors(tilted.place)
    np.testing.assert_allclose(there, from_angles(*plain.celestial.T), atol=1e-14)
    for cusp, other in zip(tilted.cusps, plain.cusps, strict=True):
        np.testing.assert_allclose(TILTED.vectors(cusp.celestial[None])[0], from_angles(*other.celestial), atol=1e-12)
    # A fine sampling comes as close to the extremes as its steps allow.
    step = np.linalg.norm(np.diff(there, axis=0), axis=1).max()
    assert 0 <= tilted.place[:, 0].min() - tilted.theta_min < step
    assert 0 <= tilted.theta_max - tilted.place[:, 0].max() < step
    assert abs(tilted.theta_extent / plain.theta_extent - 1) > 0.05


@pytest.mark.slow
def test_tracks_are_circles_about_its_axis():
    level = math.pi / 2
    tracks = kc.star_tracks(VIEWER, level, 1, end=TILTED)
    circle = kc.circle_images(VIEWER, (0.7, 0.4), 1)
    assert tracks.certified and circle.certified and tracks.tracks
    for track in tracks.tracks:
        plain = track.index == 0
        rays = kc.trace_rays(VIEWER, track.sky[plain])
        theta, phi = TILTED.angles(rays.direction, rays.azimuth)
        np.testing.assert_allclose(theta, level, atol=1e-9)
        np.testing.assert_allclose(np.exp(1j * phi), np.exp(1j * track.azimuth[plain]), atol=1e-9)
    moment = tracks.images_at(azimuth=0.8)
    searched = kc.star_images(VIEWER, (level, 0.8), 1, end=TILTED)
    np.testing.assert_allclose(moment.sky, searched.sky, atol=1e-9)
    events = kc.pair_events(VIEWER, level, 1, end=TILTED)
    assert events == tracks.events
    # The same great circle, followed about its normal.
    assert [e.longitude for e in events] == pytest.approx([e.longitude for e in circle.events])
    for event in events:
        assert event.star == pytest.approx((level, event.longitude % (2 * math.pi)))
