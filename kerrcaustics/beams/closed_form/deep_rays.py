"""Rays next to the shadow edge, by their place on the sky and by d, which a unit vector of doubles does not hold.

See images/deep_images.py.
"""

from typing import NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams import errors
from kerrcaustics.beams.closed_form import round_off
from kerrcaustics.beams.closed_form.finite_end import to_sphere
from kerrcaustics.beams.closed_form.polar_motion import polar_motion, polar_swing
from kerrcaustics.beams.closed_form.radial_motion import Travel, radial_motion
from kerrcaustics.beams.ray_state import LEAST_K, Aim, Arriving
from kerrcaustics.beams.traced_ends import Spherical, TracedSky
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Reals
from kerrcaustics.spacetime.frame import Frame, Photon, photon_of

# Rounding of N.
_OF_SKY = 4e-16


def depth(frame: Frame, sky: Components) -> Reals:
    """d as a function of N."""
    return radial.factor(frame, photon_of(frame, sky)).d


def ends(frame: Frame, sky: Components, d: Reals, end: Spherical, *, on_equator: bool) -> tuple[Reals, ...]:
    """Ends of rays on a sphere that leave in direction N and have this d.

    n' (3), the time, radians of the way; what the formulas lose of n', of its azimuth, and of the time.
    """
    photon = photon_of(frame, sky)
    quartic = radial.factor(frame, photon)._replace(d=d)
    if isinstance(end, TracedSky):
        aim, travel = None, radial_motion(frame, photon, quartic, with_time=True)
    else:
        aim = end.aim(frame, photon, quartic)
        travel = to_sphere(frame, photon, quartic, end.radius, aim, with_time=True)
    lost = travel.captured if aim is None else aim.lost
    swing = polar_swing(frame, photon, on_equator=on_equator)
    polar = polar_motion(frame, photon, swing, travel.time, on_equator=on_equator, with_time=True)
    c, s = jnp.cos(travel.psi + polar.turn), jnp.sin(travel.psi + polar.turn)
    hidden = jnp.where(travel.holds & (photon.k >= LEAST_K) & ~lost, 0.0, jnp.nan)
    direction = jnp.stack([c * polar.x - s * polar.y, s * polar.x + c * polar.y, polar.z + hidden], axis=-1)
    assert travel.clock is not None and polar.clock is not None
    noise = _noise(frame, sky, _RayMotion(photon, quartic, travel, aim, polar.phase), end)
    return direction, travel.clock + polar.clock, polar.phase, *noise


class _RayMotion(NamedTuple):
    """The way of rays: their photons, the factors of R, the radial motion, the aim at a sphere, radians of it."""

    photon: Photon
    quartic: radial.Quartic
    travel: Travel
    aim: Aim | None
    phase: Reals


def _noise(frame: Frame, sky: Components, way: _RayMotion, end: Spherical) -> tuple[Reals, Reals, Reals]:
    """Losses of the formulas in n', in its azimuth and in the time, but by the rounding of d, which is exact here.

    Close to an extremal hole that is far more than the round-off of the phase: psi and the time are differences of
    integrals, divided by the distance of the horizons.
    """
    photon, travel = way.photon, way.travel
    # The outer roots do not move; that of d = inf is what is left where they are far apart.
    fixed = way.quartic._replace(d=jnp.full_like(way.quartic.d, jnp.inf))
    at = Arriving(
        jnp.abs(travel.u), jnp.abs(travel.rate), jnp.abs(travel.psi_rate), jnp.sqrt(jnp.maximum(photon.k, 0) + 3)
    )
    if way.aim is None:
        noise = round_off.at_infinity(frame, photon, fixed, way.phase)
    else:
        noise, _ = round_off.at_finite_end(frame, sky, photon, fixed, end, travel, way.aim, at, way.phase)
    plain = round_off.ROUNDING * (2 + round_off.PER_PHASE * way.phase) + _OF_SKY / at.rate
    time_noise = errors.of_time(frame, end, at, noise, noise)[1] + round_off.of_time(frame, travel)
    return plain, jnp.maximum(noise - plain, 0), time_noise
