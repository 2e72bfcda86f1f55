"""Distances between rays and a source that moves, across the rays, to the second order of the offset.

Half of the square of a distance is Synge's function sigma(x, z): of an event x of the ray and z of the source it is
g(d, d) / 2 with d = x - z and the metric at the middle between both, up to terms of the fourth order. Source and ray
are seen at once if sigma is stationary along the ray; then x may be any event of the ray. Parallel transport
from z to x is -d^2 sigma / dx dz.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kerrcaustics.light_curves.arrivals import Arrivals
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.kerr import horizon_product
from kerrcaustics.spacetime.sphere import polar_basis

Array = np.ndarray

# Step of derivatives of the metric, over the radius.
_STEP = 1e-4
# Steps to the event of the source that is seen with the ray.
_STEPS = 2

_Events = Float[Array, "n 4"]


@dataclass(frozen=True)
class Separation:
    """Distances of rays from a source.

    distance: in units of the mass.
    delay: by which the source is seen later than `Arrivals.arrival` says, GM/c^3.
    rate: change of the arrival with the emission, -k.v, with the momentum k of the ray and the source's velocity v.
    """

    distance: Float[Array, " n"]
    delay: Float[Array, " n"]
    rate: Float[Array, " n"]


def separation(rays: Arrivals) -> Separation:
    """The distances of rays from their source; coordinates are t and the radius times the direction."""
    places, spin = rays.places, rays.source.spin
    source = places.radius[:, None] * places.vector
    ray = rays.beams.radius[:, None] * rays.beams.direction
    middle = (source + ray) / 2
    early = (np.stack(rays.momentum, axis=-1) * rays.offset).sum(axis=1)
    away, light = _event(early, ray - source), _wave_vector(rays)
    velocity = _event(1.0, places.radius_rate[:, None] * places.vector + places.radius[:, None] * places.rate)

    def product(first: _Events, second: _Events) -> Float[Array, " n"]:
        return _product(spin, middle, first, second)

    def change(along: _Events, first: _Events, second: _Events) -> Float[Array, " n"]:
        return _change(lambda place: _product(spin, place, first, second), middle, along[:, 1:])

    for _ in range(_STEPS):
        away[:, 0] += product(away, light) + change(light, away, away) / 4
    turned = (change(light, velocity, away) - change(velocity, light, away)) / 2
    return Separation(
        distance=np.sqrt(np.maximum(product(away, away), 0.0)),
        delay=away[:, 0] - early,
        rate=-product(light, velocity) - turned,
    )


def _event(time: Float[Array, " n"] | float, place: Float[Array, "n 3"]) -> _Events:
    return np.concatenate([np.broadcast_to(time, len(place))[:, None], place], axis=1)


def _wave_vector(rays: Arrivals) -> _Events:
    """The light's dt, dx, dy, dz per affine length, toward the camera, of unit energy."""
    a, r, n = rays.source.spin, rays.beams.radius, rays.beams.direction
    (p_r, p_theta, around), b = rays.momentum, np.asarray(rays.beams.impact)
    square = n[:, 0] ** 2 + n[:, 1] ** 2
    sigma, delta = r * r + (a * n[:, 2]) ** 2, horizon_product(a, r)
    lead = (r * r + a * a - a * b) / delta
    time = (r * r + a * a) * lead + a * (b - a * square)
    turn = around + a * (lead - 1) * np.sqrt(square)
    e_theta, e_phi = polar_basis(n)
    place = (delta * p_r)[:, None] * n + r[:, None] * (p_theta[:, None] * e_theta + turn[:, None] * e_phi)
    return _event(time, place) / sigma[:, None]


def _product(spin: float, place: Float[Array, "n 3"], first: _Events, second: _Events) -> Float[Array, " n"]:
    """The product of two vectors in the metric at places: that of Boyer and Lindquist, regular on the axis."""
    r = np.sqrt((place**2).sum(axis=1))
    n = place / r[:, None]
    sigma, delta = r * r + (spin * n[:, 2]) ** 2, horizon_product(spin, r)
    outward = [(part[:, 1:] * n).sum(axis=1) for part in (first, second)]
    aside = [(part[:, 1:] - out[:, None] * n) / r[:, None] for part, out in zip((first, second), outward, strict=True)]
    # sin^2 theta dphi.
    around = [n[:, 0] * part[:, 1] - n[:, 1] * part[:, 0] for part in aside]
    t, s = first[:, 0], second[:, 0]
    return (
        (2 * r / sigma - 1) * t * s
        + sigma / delta * outward[0] * outward[1]
        + sigma * (aside[0] * aside[1]).sum(axis=1)
        + spin**2 * (1 + 2 * r / sigma) * around[0] * around[1]
        - 2 * spin * r / sigma * (t * around[1] + s * around[0])
    )


def _change(
    value: Callable[[Float[Array, "n 3"]], Float[Array, " n"]], place: Float[Array, "n 3"], along: Float[Array, "n 3"]
) -> Float[Array, " n"]:
    """The change of a function of the place along vectors."""
    step = _STEP * np.sqrt((place**2).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300))
    before, after = (value(place + sign * step[:, None] * along) for sign in (-1.0, 1.0))
    return (after - before) / (2 * step)
