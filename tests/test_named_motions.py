"""Motions that have a name, of cameras and of emitters, against 60 digits: next to extremal holes too."""

import math

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from offenders import for_each

import kerrcaustics as kc
from kerrcaustics.beams import differentiable
from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.beams.moving import motion_of
from kerrcaustics.orbits.orbit import BodyPlaces, clock_rates
from kerrcaustics.spacetime import kerr

SPINS = [0.0, 0.5, 0.9, 0.999, 1 - 1e-6, 1 - 1e-9, 1 - 1e-12, 1 - 1.3e-14]
# Above the innermost of its radii, by this part of it.
ABOVE = [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 30.0]


class Exact:
    """The metric at a place, in long arithmetic."""

    def __init__(self, spin: float, radius: float, inclination: float = math.pi / 2):
        self.a, self.r = mpf(spin), mpf(radius)
        cosine = mpf(0) if inclination == math.pi / 2 else mpmath.cos(mpf(inclination))
        self.sigma, delta = self.r**2 + (self.a * cosine) ** 2, self.r**2 - 2 * self.r + self.a**2
        square = (self.r**2 + self.a**2) ** 2 - self.a**2 * delta * (1 - cosine**2)
        self.lapse, self.shift = mpmath.sqrt(self.sigma * delta / square), 2 * self.a * self.r / square
        self.varpi = mpmath.sqrt(square / self.sigma * (1 - cosine**2))

    def circular(self, sense: int = 1) -> mpf:
        """The angular velocity of a circular orbit."""
        return sense / (sense * self.a + self.r * mpmath.sqrt(self.r))

    def speed(self, orbital: mpf) -> mpf:
        return self.varpi * (orbital - self.shift) / self.lapse

    def slowness(self, orbital: mpf) -> mpf:
        """(dtau / dt)^2."""
        return self.lapse**2 * (1 - self.speed(orbital) ** 2)


def off(found: float, true: mpf) -> float:
    return float(abs(mpf(float(found)) / true - 1))


def circular_radii(spin: float) -> list[float]:
    orbit = kerr.photon_orbits(spin)[0]
    return [kc.isco(spin), *(orbit * (1 + part) for part in ABOVE)]


@pytest.mark.parametrize("spin", SPINS)
def test_circular_cameras(spin):
    with mpmath.workdps(60):
        for radius in circular_radii(spin):
            camera, at = kc.Camera(spin, radius, velocity="circular"), Exact(spin, radius)
            speed, slowness = at.speed(at.circular()), at.slowness(at.circular())
            assert off(camera.fido_velocity()[2], speed) < 1e-15
            assert off(camera.frame().slowness, 1 - speed**2) < 2e-15
            assert off(camera.clock_rate, 1 / mpmath.sqrt(slowness)) < 1e-15


@for_each(spin=SPINS, inclination=[math.pi / 2, 1.0, 1e-3])
def test_static_cameras(spin, inclination):
    limit = kerr.ergosphere(spin, 0.0 if inclination == math.pi / 2 else math.cos(inclination))
    with mpmath.workdps(60):
        for part in ABOVE:
            camera = kc.Camera(spin, limit * (1 + part), inclination, "static")
            at = Exact(spin, camera.radius, inclination)
            clock = 1 / mpmath.sqrt(at.slowness(mpf(0)))
            allowed = 1e-15 if inclination == math.pi / 2 else 2e-16 * (5 + float(clock) ** 2)
            assert off(camera.clock_rate, clock) < allowed
            if spin:
                assert off(camera.fido_velocity()[2], at.speed(mpf(0))) < 1e-15


def test_circular_cameras_are_refused_just_where_light_is_no_slower():
    for spin in SPINS:
        orbit = kerr.photon_orbits(spin)[0]
        for radius in (math.nextafter(orbit, 0), orbit, math.nextafter(orbit, 9)):
            with mpmath.workdps(60):
                at = Exact(spin, radius)
                exists = radius > orbit and at.slowness(at.circular()) > 1e-50
            if exists:
                assert kc.Camera(spin, radius).velocity == "circular"
            else:
                assert kc.Camera(spin, radius).velocity == "fiducial"
                with pytest.raises(ValueError, match="at or inside the photon orbit"):
                    kc.Camera(spin, radius, velocity="circular")


def exact_emitter(name: str, spin: float, radius: float) -> mpf:
    """(dtau / dt)^2 of an emitter in the plane."""
    at, sense = Exact(spin, radius), -1 if name.startswith("retrograde") else 1
    innermost = kc.isco(spin, prograde=sense > 0)
    if not name.endswith("plunging") or radius >= innermost:
        return at.slowness({"static": mpf(0), "fiducial": at.shift}.get(name, at.circular(sense)))
    last = Exact(spin, innermost)
    clock, orbital = 1 / mpmath.sqrt(last.slowness(last.circular(sense))), last.circular(sense)
    # E and L of the last orbit, from its four-velocity.
    v = last.speed(orbital)
    momentum = clock * last.lapse * last.varpi * v
    energy = clock * last.lapse**2 + last.shift * momentum
    return (at.lapse**2 / (energy - at.shift * momentum)) ** 2


@for_each(name=EMITTERS, spin=SPINS)
def test_clocks_of_emitters(name, spin):
    """As exact as radii in double precision are: where clocks nearly stop they depend on them the more."""
    low = {"static": 2.0, "circular": kerr.photon_orbits(spin)[0], "retrograde": kerr.photon_orbits(spin)[1]}
    first = low.get(name, kerr.horizon(spin))
    innermost = kc.isco(spin, prograde=not name.startswith("retrograde"))
    radius = np.array([innermost, *(first * (1 + part) for part in ABOVE[2:])])
    radius = radius[radius > first]
    found = EMITTERS[name](spin, radius, np.zeros_like(radius)).slowness
    with mpmath.workdps(60):
        for value, r in zip(found, radius, strict=True):
            true = exact_emitter(name, spin, r)
            beside = exact_emitter(name, spin, r * (1 + 1e-13))
            assert off(value, true) < 2e-15 + 5e-3 * off(float(beside), true)


def test_clocks_of_bodies():
    """Limited by the angular velocity as a double, relative to the fiducial observer there."""
    for spin in SPINS:
        radius = kc.isco(spin)
        with mpmath.workdps(60):
            at = Exact(spin, radius)
            rate = float(at.circular())
            body = BodyPlaces(np.array([radius]), np.eye(3)[:1], np.zeros(1), rate * np.eye(3)[1:2])
            assert off(clock_rates(spin, body)[0], at.slowness(at.circular())) < 1e-15 / float(at.lapse) + 1e-15


@pytest.mark.parametrize("velocity", ["circular", "static"])
def test_frames_that_are_differentiated_are_those_of_cameras(velocity):
    for spin in SPINS:
        radius = 1.000001 * kc.isco(spin) if velocity == "circular" else 2.1
        camera = kc.Camera(spin, radius, velocity=velocity)
        motion = motion_of(velocity)
        with differentiable.float64():
            found = differentiable.frame_of(spin, radius, math.pi / 2, motion)
        for name in ("lapse", "speed", "slowness", "root_sigma_delta"):
            assert float(getattr(found, name)) == pytest.approx(getattr(camera.frame(), name), rel=1e-14), name
