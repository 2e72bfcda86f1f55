"""Orbits: circles that stay circles, falls with honest errors, velocities with a name."""

import math
import re

import numpy as np
import pytest
from marks import few

import kerrcaustics as kc
from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.orbits.geodesics import circular_velocity, free_fall
from kerrcaustics.orbits.motions import BodyPlaces, circling
from kerrcaustics.orbits.orbit import checked_places, orbit_of
from kerrcaustics.scripts import STUDIES

unstable = STUDIES.module("adversary.unstable_orbits")
Release = STUDIES.module("adversary.true_orbits").Release
EQUATOR = math.pi / 2
CIRCLE = kc.Camera(0.0, 4.0, velocity="circular").fido_velocity()


@pytest.mark.parametrize(("spin", "radius"), [(0.0, 3.5), (0.0, 4.0), (0.9, 2.0), (0.998, 1.15), (0.5, 1e5)])
def test_circles_in_the_plane_repeat_with_their_period(spin, radius):
    period = 2 * math.pi * (radius**1.5 + spin)
    times = 80 + period * np.array([0, 1, 7, 200])
    motion = orbit_of("orbit", radius).motion_about(spin, (0.0, times[-1]))
    places, error = motion.places(times), motion.errors(times).place
    assert (places.radius == radius).all() and (places.vector[:, 2] == 0).all()
    away = np.linalg.norm(places.vector - places.vector[0], axis=1)
    assert (away <= error + error[0] + 2 * math.pi * np.spacing(times) / period).all()
    assert error[-1] < 1e-11


@pytest.mark.parametrize("heading", few((0.0, 0.7, 2.0, -1.2, math.pi), (0.7, math.pi)))
@pytest.mark.parametrize("theta", few((EQUATOR, 1.1, 2.4, 0.0, math.pi), (EQUATOR, 1.1, 0.0)))
def test_circular_orbits_are_falls_that_keep_their_radius(theta, heading):
    """Where they are stable the integration, which is another way, goes with them."""
    spin, radius, begin = 0.9, 8.0, 2.0
    circle = circling(spin, radius, theta, 0.3, heading, begin)
    camera = kc.Camera(spin, radius, theta, circular_velocity(spin, radius, theta, heading))
    fall = free_fall(camera, 0.3, begin, (-60.0, 90.0))
    times = np.array([-50.0, begin, 20.0, 85.0])
    places, (radii, vectors, _, rates) = circle.places(times), fall.vectors(times)
    assert (places.radius == radius).all() and np.abs(radii - radius).max() < 1e-10
    assert np.abs(places.vector - vectors).max() < 1e-10 and np.abs(places.rate - rates).max() < 1e-11
    for time, vector in zip(times.tolist(), places.vector, strict=True):
        place = circle.place(time)
        n = math.sin(place.theta) * math.cos(place.phi), math.sin(place.theta) * math.sin(place.phi)
        assert (*n, math.cos(place.theta)) == pytest.approx(vector.tolist(), abs=1e-14)
        if 0 < theta < math.pi:
            # The azimuth counts rounds as that of a fall.
            assert place == pytest.approx(fall.place(time), abs=1e-10)
    start = circle.place(begin)
    # On the axis the azimuth is that of the motion.
    azimuth = 0.3 if 0 < theta < math.pi else fall.place(begin).phi
    assert start.theta == pytest.approx(theta, abs=1e-14)
    assert math.remainder(start.phi - azimuth, 2 * math.pi) == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("word", ["circular", "retrograde"])
@pytest.mark.parametrize("theta", [EQUATOR, 0.9, 2.0])
def test_unstable_circular_orbits_keep_their_radius_and_latitude(theta, word):
    release = Release(0.5, 4.6, theta, (0.0, 0.0, 0.0))
    claim = unstable.circle_claim(release, 1e4, word)
    assert claim.off <= claim.error < 1e-10


# Vectors of circular orbits inside the ISCO, orbits that whirl and turn back, or fall in; stable ones; of both senses.
HARD = {
    "circular vector": (Release(0.0, 4.0, EQUATOR, CIRCLE), 200.0),
    "circular vector, backward": (Release(0.0, 4.0, EQUATOR, CIRCLE), -170.0),
    "circular vector, spin": (Release(0.9, 2.0, EQUATOR, kc.Camera(0.9, 2.0).fido_velocity()), 60.0),
    "falls in": (Release(0.0, 4.0, EQUATOR, (0.0, 0.0, CIRCLE[2] * (1 - 1e-9))), 135.0),
    "zoom and whirl": (Release(0.0, 20.0, EQUATOR, (0.0, 0.0, 0.1941)), 330.0),
    "stable": (Release(0.6, 10.0, EQUATOR, (0.03, 0.0, 0.3)), 250.0),
    "stable, inclined": (Release(0.6, 9.0, 1.2, (-0.03, 0.1, -0.3)), 60.0),
    "through the middle of a step": (Release(0.999, 4.9, 0.7, (0.0, 0.0, 0.478)), 5.4),
}


SLOW = {"circular vector, backward", "falls in", "stable, inclined"}


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in HARD])
def test_errors_of_falls_hold_the_truth(name):
    claim = unstable.fall_claim(*HARD[name])
    assert claim.off <= claim.error
    # Nor are they needlessly large: so much is left for the growth of rounding, of which no single case is typical.
    assert claim.error <= max(1e6 * claim.off, 1e-10)
    if "stable" in name:
        assert claim.error < 1e-9


@pytest.mark.slow
def test_errors_grow_away_from_the_release():
    motion = kc.Orbit.geodesic(4.0, velocity=CIRCLE, time=50.0).motion_about(0.0, (-60.0, 130.0))
    times = np.linspace(-59, 129, 41)
    error = motion.errors(times).place
    later, earlier = error[times >= 50], error[times <= 50][::-1]
    assert (np.diff(later) >= 0).all() and (np.diff(earlier) >= 0).all()
    # They grow as displacements do at r = 4: by a factor of e in 8 sqrt(2) r / M, the period over 2 pi times sqrt(2).
    rise = np.log(later[14] / later[8]) / (times[times >= 50][14] - times[times >= 50][8])
    assert rise == pytest.approx(math.sqrt(6 / 4 - 1) / 8, rel=0.15)


@pytest.mark.slow
def test_a_fall_that_rounding_decides_is_named_so():
    slower = (0.0, 0.0, CIRCLE[2] * (1 - 1e-13))
    motion = kc.Orbit.geodesic(4.0, velocity=slower).motion_about(0.0, (0.0, 400.0))
    assert motion.span[1] < 400
    with pytest.raises(ValueError, match=r"`orbit` must .* but is unstable, so that rounding decides whether it falls"):
        checked_places(0.0, motion, np.array([400.0]))
    fall = kc.Orbit.geodesic(6.0, velocity=(-0.3, 0.0, 0.1)).motion_about(0.0, (0.0, 400.0))
    with pytest.raises(ValueError, match=r"`orbit` must .* but is at the horizon at t = "):
        checked_places(0.0, fall, np.array([400.0]))


@pytest.mark.parametrize(("spin", "radius"), [(0.0, 8.0), (0.9, 5.0), (0.998, 40.0)])
def test_retrograde_is_a_word_for_orbits_and_a_vector_for_cameras(spin, radius):
    orbital = EMITTERS["retrograde"](spin, radius, 0.0).orbital
    motion = kc.Orbit.geodesic(radius, velocity="retrograde").motion_about(spin, (0.0, 1.0))
    assert motion.places(np.zeros(1)).rate[0] == pytest.approx((0.0, radius and orbital, 0.0), rel=1e-13)
    with pytest.raises(ValueError, match="Argument `velocity` must be") as error:
        kc.Camera(spin, radius, velocity="retrograde")
    vector = re.search(r"the retrograde circular orbit there has \((.*)\)\.", str(error.value))[1]
    camera = kc.Camera(spin, radius, velocity=tuple(map(float, vector.split(","))))
    assert camera.orbital_velocity() == pytest.approx(float(orbital), rel=1e-14)


def test_where_nothing_can_circle_no_vector_is_offered():
    for camera in ((0.9, 3.9, EQUATOR), (0.9, 8.0, 1.0)):
        with pytest.raises(ValueError, match="`velocity` must be circular, fiducial") as error:
            kc.Camera(*camera, "retrograde")
        assert "orbit there has" not in str(error.value)


class Displaced:
    """A circle whose radius is off by a part of it that is known."""

    span = (-math.inf, math.inf)

    def __init__(self, off, error):
        self.off, self.error = off, error

    def places(self, time):
        """The places at times."""
        turn = 0.4 + time / 8.0**1.5
        c, s, zero = np.cos(turn), np.sin(turn), 0 * time
        rate = np.stack([-s, c, zero], axis=-1) / 8.0**1.5
        return BodyPlaces(8.0 * (1 + self.off) + zero, np.stack([c, s, zero], axis=-1), zero, rate)

    def errors(self, time):
        """The errors of places at times."""
        return type(orbit_of("orbit", 8.0).motion_about(0.0, (0.0, 1.0)).errors(time))(self.error + 0 * time, 0 * time)


@pytest.mark.slow
def test_errors_of_light_hold_those_of_the_orbit():
    observer, times, off = kc.Observer(spin=0.9, inclination=1.0), np.array([10.0, 60.0, 120.0]), 1e-7
    here, there = (
        kc.light_curve(observer, kc.Orbit("displaced", lambda spin, span, m=motion: m), times, max_index=1)
        for motion in (Displaced(0.0, off), Displaced(off, off))
    )
    assert here.certified and there.certified
    for name in ("emission_time", "sky"):
        apart = np.abs(getattr(there, name) - getattr(here, name))
        apart = np.linalg.norm(apart, axis=-1) if name == "sky" else apart
        error = getattr(here, f"{name}_error")
        assert (apart <= error).all() and (error < 100 * apart).all()
    apart = np.abs(there.flux - here.flux)
    assert (apart <= here.error).all() and (here.error < 1e-4 * here.flux).all()


@pytest.mark.slow
def test_light_of_unstable_orbits_repeats_or_says_that_it_is_not_known():
    observer, times = kc.Observer(spin=0.0, inclination=1.0), 80 + 16 * math.pi * np.array([0, 3, 5, 6, 7])
    circle = kc.light_curve(observer, 4.0, times, source="point", max_index=0)
    away = np.abs(circle.flux / circle.flux[0] - 1)
    assert circle.certified and (away * circle.flux[0] <= circle.error + circle.error[0]).all() and away.max() < 1e-9
    vector = kc.light_curve(observer, kc.Orbit.geodesic(4.0, velocity=CIRCLE), times, max_index=0)
    assert not vector.certified and "the orbit is unstable" in vector.remarks[0]
    assert (np.abs(vector.flux - circle.flux) <= vector.error + circle.error).all()
    assert (np.abs(vector.emission_time - circle.emission_time) <= vector.emission_time_error + 1e-9).all()
