"""How far rays next to each other have come apart: of beams by their variations, of rays that have none by an estimate.

Both are in radians per radian of N, in the plane also in ln r.
"""

from typing import NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.closed_form import round_off
from kerrcaustics.beams.geometry import length
from kerrcaustics.beams.ray_state import LEAST_K, Aim, Arriving, Jacobian
from kerrcaustics.beams.traced_ends import Spherical, TracedEnd
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Reals
from kerrcaustics.spacetime.frame import Frame, Photon

# In the plane the estimate is down to a quarter of the size, where rays linger or arrive at small slopes.
_IN_PLANE = 2.0


class Ray(NamedTuple):
    """A ray at the camera: its direction N, its photon, and the factors of its radial potential."""

    sky: Components
    photon: Photon
    quartic: radial.Quartic


def of_beam(end: TracedEnd, at: Arriving, jacobian: Jacobian) -> Reals:
    """The size of a beam, from its Jacobian at the end."""
    return end.spread(length([entry for row in jacobian for entry in row]), 1 / at.u)


def size_alone(frame: Frame, ray: Ray, end: TracedEnd, aim: Aim, at: Arriving, rate: Reals) -> Reals:
    """The size of a beam around a ray that has no variations, as the closed form estimates it.

    Mostly one to ten times too large, in the plane up to twenty times. Parameters: rate, that of u at the end.
    """
    sky, photon, quartic = ray
    if end.in_plane:
        at = at._replace(rate=_least_rate(quartic, at.u))
    if end.finite:
        gap = round_off.gap_to_end(frame, photon, quartic, (photon.rate[0] > 0) != (rate > 0), at.u)
        size = round_off.spread_to_end(frame, sky, photon, quartic, end, aim, at, aim.mino_time, gap)
        size = _IN_PLANE * size if end.in_plane else size
    else:
        size = round_off.spread_alone(frame, sky, photon, quartic)
    if isinstance(end, Spherical):
        leaves = (photon.k < LEAST_K) & (photon.rate[0] < 0) & (rate < 0)
        size = jnp.where(leaves, round_off.spread_of_small_k(frame, sky, photon, aim.mino_time), size)
    return size


def _least_rate(quartic: radial.Quartic, u: Reals) -> Reals:
    """The size of u', and no less where the ray turns: there a ray of another N moves on."""
    outer = (1 - quartic.h * u) ** 2 + jnp.abs(quartic.d) * u * u
    return jnp.sqrt(outer * jnp.maximum((1 + quartic.h * u) ** 2 - quartic.e * u * u, 0))
