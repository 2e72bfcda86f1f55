"""Round-off of the formulas of the closed form, beside that of N, which all engines share.

All factors were measured: studies/accuracy/error_estimates.py. psi is a difference of two integrals divided by r_+ -
r_-. Close to the hole, photons that move with its horizon, 2 r_+ = a b, are the worst. Rounding b and q moves the
outer roots.
"""

import jax
import jax.numpy as jnp

from kerrcaustics.beams import errors
from kerrcaustics.beams.closed_form import finite_end, small_k
from kerrcaustics.beams.closed_form.radial_motion import Travel
from kerrcaustics.beams.ray_state import Aim, Arriving
from kerrcaustics.beams.traced_ends import Spherical, TracedEnd
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon, doppler

# Of a function of the polar phase, and for each radian of the phase relative to that.
ROUNDING, PER_PHASE = 2e-15, 0.3
# Radians of arc of a way on which the variation of Weierstrass' function loses its digits.
_LONG = 6.0
# The least square of a distance of roots, relative to their own; the errors of rays that linger for ever are unknown.
_TINY = 1e-30
# Of the values of the radial integrals.
_INTEGRALS = 3e-16
# Round-off of the Jacobian over that of the end, as the derivatives of psi lose more digits.
_IN_DERIVATIVE = 9
# Round-off of the Jacobian by the derivatives of k, per root of k.
_OF_RAPIDITY = 1e-15
# Round-off of the Jacobian by the derivatives of the outer roots, times the clearance from them.
_OF_CLEARANCE = 5e-14
_OF_DIRECTION, _FAR = 1e-15, 6
# The part of the same loss in psi, beside its own.
_IN_TURN = 2e-2
# The part of a distance from the outer roots that is lost in the time.
_OF_CLOCK = 2e-16
# What psi loses on a way that begins and ends closer to the outer roots than this, as a part of round-off elsewhere.
_AT_ROOTS, _CLOSE = 0.25, 0.1


def at_infinity(frame: Frame, photon: Photon, quartic: radial.Quartic, phase: Reals) -> Reals:
    """Round-off in radians for a beam of unit spread."""
    gap = _gap_to_infinity(frame, photon, quartic)
    moved = _moved(frame, photon, quartic, gap)
    return ROUNDING * (1 + PER_PHASE * phase) + _of_turn(frame, photon, frame.radius)[0] + _INTEGRALS * moved


def at_finite_end(
    frame: Frame,
    sky: Components,
    photon: Photon,
    quartic: radial.Quartic,
    end: TracedEnd,
    travel: Travel,
    aim: Aim,
    at: Arriving,
    phase: Reals,
) -> tuple[Reals, Reals]:
    """Round-off in radians, and the spread of a ray traced alone: rates at the end magnify errors of the Mino time."""
    turns = (photon.rate[0] > 0) != (travel.rate > 0)
    gap, motion = gap_to_end(frame, photon, quartic, turns, travel.u), end.motion(at)
    turn, rest = _of_turn(frame, photon, jnp.minimum(1 / at.u, frame.radius))
    close = jnp.sqrt(_clearance(quartic, frame.radius) * _clearance(quartic, 1 / at.u))
    turn = turn + _AT_ROOTS * jnp.maximum(1 / close - 1 / _CLOSE, 0.0) * (turn + ROUNDING)
    opened = end.opened(_grown(frame, photon, travel.time, at), at)
    noise = (
        ROUNDING * (1 + PER_PHASE * phase + _wide(frame, quartic)) * motion
        + turn * (1 + rest + 0.1 * errors.depth(frame.spin, at.u) * at.u + _IN_TURN * _deep(frame, at.u))
        + _INTEGRALS * (opened + end.delayed(_moved(frame, photon, quartic, gap), at))
    )
    return noise, spread_to_end(frame, sky, photon, quartic, end, aim, at, travel.time, gap)


def spread_to_end(
    frame: Frame,
    sky: Components,
    photon: Photon,
    quartic: radial.Quartic,
    end: TracedEnd,
    aim: Aim,
    at: Arriving,
    time: Reals,
    gap: Reals,
) -> Reals:
    """The estimate of `spread_alone` at a finite end: rates there magnify errors of the Mino time.

    Parameters: time, the Mino time to the end; gap, that of `gap_to_end`.
    """
    motion, opened = end.motion(at), end.opened(_grown(frame, photon, time, at), at)
    # Rounding N changes b, and the root of k, by the distance from the axis times that.
    spread = (opened + motion) * (1 + frame.cylindrical_scale * time)
    spread = (spread + motion * end.lateness(frame.cos_theta, aim, at)) * aim.conditioning
    return spread + end.delayed(_lingering(frame, sky, photon, quartic, gap), at)


def _grown(frame: Frame, photon: Photon, time: Reals, at: Arriving) -> Reals:
    """The growth of an error in the rate of u on a short way; on a long one it is that by the outer roots."""
    grown = finite_end.growth(frame, *jax.lax.stop_gradient((photon, time)))
    return jnp.where((at.speed * time < _LONG) & jnp.isfinite(grown), grown, 1.0)


def of_small_k(frame: Frame, end: Spherical, psi: Reals) -> Reals:
    """Round-off in radians of the rays of small k: of psi, on brief ways alone relative to it."""
    turned = frame.spin / (2 * radial.horizon_lift(frame.spin))
    return ROUNDING * (1 + jnp.where(small_k.is_brief(frame, end), jnp.minimum(jnp.abs(psi), turned), turned))


def of_jacobian(
    frame: Frame, sky: Components, photon: Photon, quartic: radial.Quartic, noise: Reals, clearance: Reals | None
) -> tuple[Reals, Reals]:
    """Round-off of the Jacobian, from that of the end: relative to its size where that is small, and absolute.

    Close to the outer roots the variations of psi and of the Mino time cancel. Far from the hole all variations do, as
    much as the direction at the end depends on b less than b on N; and rounding of N changes b, relative to it, more.
    """
    own = _IN_DERIVATIVE * noise + _OF_RAPIDITY * jnp.sqrt(jnp.minimum(jnp.maximum(photon.k, 0), 100.0))
    lever = _energy(frame, sky, photon) * frame.cylindrical_scale / jnp.sqrt(jnp.maximum(photon.k, 1))
    own, far = own + _OF_DIRECTION * lever, _FAR * noise * lever
    if clearance is not None:
        own = own + _OF_CLEARANCE / clearance + ROUNDING * _wide(frame, quartic) ** 2
    return own, far


def of_time(frame: Frame, travel: Travel) -> Reals:
    """Round-off of the time to a finite end: of one close to the outer roots, of a way all next to the horizon."""
    if travel.clearance is None or travel.clock is None:
        return 0.0
    return _OF_CLOCK * jnp.abs(travel.clock) / travel.clearance + _INTEGRALS * _deep(frame, jnp.abs(travel.u))


def _wide(frame: Frame, quartic: radial.Quartic) -> Reals:
    """The outer roots' middle over the radius of a camera close to the lower one, which is a small difference then."""
    return jnp.maximum(quartic.h / frame.radius - 1, 0.0)


def _clearance(quartic: radial.Quartic, radius: Reals) -> Reals:
    """The distance of a radius from the outer roots, relative to it."""
    apart = (radius - 1 - quartic.lift) / radius
    return jnp.sqrt(apart**2 + jnp.abs(apart**2 - quartic.d / radius**2)) + _TINY


def _deep(frame: Frame, u: Reals) -> Reals:
    """The loss on a way all next to the horizon, up from a place there and back, to 1 / r = u."""
    return jnp.minimum(errors.depth(frame.spin, 1 / frame.radius), errors.depth(frame.spin, u)) ** 1.5


def spread_alone(frame: Frame, sky: Components, photon: Photon, quartic: radial.Quartic) -> Reals:
    """An estimate of the beam's major diameter for a ray that is traced alone, mostly one to ten times too large."""
    gap = _gap_to_infinity(frame, photon, quartic)
    return _energy(frame, sky, photon) + _lingering(frame, sky, photon, quartic, gap)


def spread_of_small_k(frame: Frame, sky: Components, photon: Photon, time: Reals) -> Reals:
    """The same for rays of small k: that of flat space, but for energy and way; at most three times too large."""
    return 1.5 * _energy(frame, sky, photon) * frame.cylindrical_scale * time


def _of_turn(frame: Frame, photon: Photon, radius: Reals) -> tuple[Reals, Reals]:
    """Round-off of psi for a ray whose lower end, or camera, is at some radius; the part by photons at rest there."""
    lift = radial.horizon_lift(frame.spin)
    corotation = jnp.abs(radial.corotation(frame, photon)) * (1 + 40 * (radius - 1 - lift) ** 2)
    return 2e-15 * frame.spin / lift * (1 + 0.3 / corotation), 0.03 / corotation


def _energy(frame: Frame, sky: Components, photon: Photon) -> Reals:
    """Energy at the camera per energy at infinity, inverse."""
    return frame.slowness**0.5 / (doppler(frame, sky)[0] * jnp.abs(photon.energy_ratio))


def _lingering(frame: Frame, sky: Components, photon: Photon, quartic: radial.Quartic, gap: Reals) -> Reals:
    """The displacement of the end, radians per radian of N, as the ray lingers longer."""
    a, h = frame.spin, quartic.h
    momentum = jnp.sqrt(jnp.maximum(photon.k, 0) + a * a)
    slope = 2 * momentum * (jnp.abs(h * (h - 2) + a * a) + 0.1 * h) + 2 * a * jnp.abs(h * h + a * a - a * photon.b)
    away = _away(frame, photon, quartic)
    return _energy(frame, sky, photon) * frame.cylindrical_scale * momentum * slope * away * _time_slope(quartic, gap)


def _moved(frame: Frame, photon: Photon, quartic: radial.Quartic, gap: Reals) -> Reals:
    """The change of the time as the outer roots move."""
    away = _away(frame, photon, quartic)
    return away * jnp.maximum(photon.k, 0) ** 1.5 * quartic.h**2 * _time_slope(quartic, gap)


def _away(frame: Frame, photon: Photon, quartic: radial.Quartic) -> Reals:
    """1, and less for a camera so close to the outer roots that the rate there gives their distance: that, times 3."""
    distance = 3 * (jnp.abs(frame.radius - quartic.h) + jnp.sqrt(_half_distance_squared(quartic))) / quartic.h
    return jnp.where(radial.rate_knows_roots(frame, photon, quartic), jnp.minimum(distance, 1.0), 1.0)


def _gap_to_infinity(frame: Frame, photon: Photon, quartic: radial.Quartic) -> Reals:
    """The distance of a ray from the outer roots: (r - h)^2 + |d|."""
    # A ray that leaves outward from above the roots does not linger there.
    away = (photon.rate[0] < 0) & (frame.radius > quartic.h)
    return _half_distance_squared(quartic) + jnp.where(away, (frame.radius - quartic.h) ** 2, 0.0)


def gap_to_end(frame: Frame, photon: Photon, quartic: radial.Quartic, turns: Flags, u: Reals) -> Reals:
    """The distance from the outer roots, (r - h)^2 + |d|, on the way to 1 / r = u; turns: through a turning point."""
    first, last = frame.radius - 1 - quartic.lift, 1 / u - 1 - quartic.lift
    nearest = jnp.where(turns | (first * last < 0), 0.0, jnp.minimum(jnp.abs(first), jnp.abs(last)))
    return _half_distance_squared(quartic) + nearest**2


def _half_distance_squared(quartic: radial.Quartic) -> Reals:
    """The square of half the distance of the outer roots, never 0."""
    return jnp.abs(quartic.d) + _TINY * quartic.h**2


def _time_slope(quartic: radial.Quartic, gap: Reals) -> Reals:
    """The change of the Mino time with the potential R where the ray lingers, near the outer roots."""
    return 1 / (jnp.abs(4 * quartic.h**2 - quartic.e) ** 1.5 * gap)
