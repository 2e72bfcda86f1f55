"""Random viewers and radii where analyses of the plane are hard."""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.viewer import Viewer

Random = np.random.Generator


def one_of(rng: Random, *values: float) -> float:
    """One of some values."""
    return float(values[int(rng.integers(len(values)))])


def power(rng: Random, low: float, high: float) -> float:
    """A number from 10^low to 10^high, even in its logarithm."""
    return float(10 ** rng.uniform(low, high))


def hard_spin(rng: Random) -> float:
    """0, from 1e-12 on, any, and to 1 - 1e-9."""
    return one_of(rng, 0.0, power(rng, -12, -2), rng.uniform(0, 0.999), 1 - power(rng, -5, -1), 1 - power(rng, -9, -5))


def hard_inclination(rng: Random, least: float = -9.0) -> float:
    """Anywhere, on the axis and beside it, and 10^least to 0.1 from the plane."""
    north = one_of(
        rng,
        math.acos(rng.uniform(0, 1)),
        0.0,
        power(rng, -9, -1),
        math.pi / 2 - power(rng, least, -1),
        math.acos(rng.uniform(0, 1)),
    )
    return one_of(rng, north, math.pi - north)


def hard_radius(spin: float, rng: Random, least: float = 1e-4) -> float:
    """Of a circle: next to the horizon (by a part of it), the photon orbits and the ISCO, near, and far."""
    horizon, orbits, isco = kerr.horizon(spin), kerr.photon_orbits(spin), kerr.isco(spin)
    return one_of(
        rng,
        horizon * (1 + power(rng, math.log10(least), 0)),
        max(orbits[int(rng.integers(2))] * (1 + rng.choice([-1, 1]) * power(rng, -6, -1)), horizon * (1 + least)),
        isco * (1 + power(rng, -9, -1)),
        horizon + power(rng, -1, 1.5),
        power(rng, 1.3, 4),
    )


def hard_viewer(rng: Random, least: float = -9.0, near: float = 2.05) -> Viewer:
    """At infinity, far, near and among the photon orbits, outside the ergosphere and off the plane.

    least: power of ten of the smallest angle from the plane; near: the smallest radius.
    """
    spin, inclination = hard_spin(rng), hard_inclination(rng, least)
    kind = int(rng.integers(4))
    if kind == 0:
        return kc.Observer(spin=spin, inclination=inclination)
    if kind == 1:
        return kc.Observer(spin=spin, inclination=inclination, radius=power(rng, 1.5, 8))
    radius = near + one_of(rng, power(rng, -3, 0), power(rng, -1, 1.5), power(rng, 1, 5))
    return kc.Camera(spin, radius, inclination, "fiducial" if kind == 2 else _velocity(rng))


def _velocity(rng: Random) -> tuple[float, float, float]:
    way = rng.normal(size=3)
    speed = one_of(rng, rng.uniform(0, 0.9), 1 - power(rng, -4, -1))
    v_r, v_theta, v_phi = (speed * way / np.linalg.norm(way)).tolist()
    return v_r, v_theta, v_phi
