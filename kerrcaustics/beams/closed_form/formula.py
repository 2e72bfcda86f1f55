"""Rays and beams in closed form: elliptic integrals for r, theta functions for theta and phi.

The path is that of integrator/integrated.py: n' is a point m of the unit sphere, at the Mino time of arrival, turned
about the spin axis by psi. Time and psi are Carlson integrals, to infinity (radial_motion.py) or to a finite radius
(radial_leg.py); in the equatorial plane the time comes first, and the radius from it (finite_end.py). m is a quotient
of theta functions of the polar phase z, proportional to Mino time, with no singular point (polar_motion.py). The
coordinate time comes from the same integrals and two more, and the logarithmic derivative of theta_3. Beams are the
first variation of all but the time in two directions of the camera sky (variation.py); the Morse index follows from z
and the sign of det J.

This holds for k = q + b^2 >= LEAST_K. Escaping rays below that leave close to the outward principal null direction:
they are short, and have formulas of their own for r, theta and phi (small_k.py), varied by forward differentiation.

All functions work elementwise on JAX arrays of one shape, one entry a ray.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams import certainty, errors
from kerrcaustics.beams.closed_form import finite_end, round_off, small_k, variation
from kerrcaustics.beams.closed_form.polar_motion import Polar, Swing, polar_motion, polar_swing, time_to_plane
from kerrcaustics.beams.closed_form.radial_motion import Travel, radial_motion
from kerrcaustics.beams.geometry import length
from kerrcaustics.beams.ray_end import RayEnd, RayOutputs
from kerrcaustics.beams.ray_state import LEAST_K, MOST_K, Aim, Arriving, Jacobian, Row
from kerrcaustics.beams.traced_ends import Spherical, TracedEnd, TracedPlane, TracedSky, TracedSphere
from kerrcaustics.beams.traced_results import stacked, status_of
from kerrcaustics.beams.vectors import dot
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon, frequency_ratio, photon_of
from kerrcaustics.spacetime.sphere import polar_basis, tangent_basis

# The polar phase is known to 1e-14; conjugate points that lie at a multiple of pi (a = 0) must not be counted twice.
_PHASE_MARGIN = 1e-9


Ends = RayEnd[Reals | Flags]


class _Values(NamedTuple):
    """Values of a ray beside its direction n' and its radius at the end.

    photon: constants of the ray.
    quartic: factors of R, of rays that are not short.
    azimuth: azimuth of the end, radians.
    polar: the polar motion.
    travel: the radial motion.
    at: the arrival.
    lost: True if the ray does not reach its end.
    certain: True if rounding does not decide that.
    certified: True if the formulas hold.
    spread: spread of a ray traced alone.
    noise: round-off of the end, radians.
    jacobian_noise: round-off of the Jacobian, relative to its size, and absolute.
    sense: sign of det J if no conjugate point was passed.
    """

    photon: Photon
    quartic: radial.Quartic | None
    azimuth: Reals
    polar: Polar
    travel: Travel
    at: Arriving
    lost: Flags
    certain: Flags
    certified: Flags
    spread: Reals
    noise: Reals
    jacobian_noise: tuple[Reals, Reals]
    sense: Reals


Ray = tuple[tuple[Components, Reals], _Values]


def trace(
    frame: Frame, sky: Components, end: TracedEnd, outputs: RayOutputs, *, on_equator: bool, short: bool = False
) -> Ends:
    """Rays, or beams, from camera-sky directions to their end.

    Parameters: sky, three arrays N_x, N_y, N_z; end, that of the rays; outputs, the quantities beside n';
    on_equator: the camera is exactly there, which is cheaper; short: take the formulas of small_k.py, which hold for
    escaping rays of k < MOST_K and ends beyond the camera.
    """

    def ray(x: Reals, y: Reals, z: Reals) -> Ray:
        if short and isinstance(end, Spherical):
            return _short_ray(frame, (x, y, z), end, with_time=outputs.time)
        return _ray(frame, (x, y, z), end, outputs, on_equator=on_equator)

    if not outputs.beams:
        (direction, radius), values = ray(*sky)
        return _ray_end(frame, sky, end, direction, radius, values, values.spread, outputs)
    if short:
        (direction, radius), vary, values = jax.linearize(ray, *sky, has_aux=True)
        angles, in_radius = _forward(sky, direction, vary)
    else:
        (direction, radius), values = ray(*sky)
        assert values.quartic is not None
        way = variation.Way(values.quartic, values.travel, values.polar, direction, radius)
        angles, in_radius = variation.columns(frame, sky, values.photon, way, end, on_equator=on_equator)
    jacobian = end.jacobian(angles, radius, in_radius)
    spread = end.spread(length([entry for row in jacobian for entry in row]), radius)
    ends = _ray_end(frame, sky, end, direction, radius, values, spread + end.motion(values.at), outputs)
    return _with_beam(ends, end, jacobian, spread, values, outputs)


def _forward(sky: Components, direction: Components, vary: Any) -> tuple[Jacobian, Row]:
    """The variation of the angles (theta', phi') and of the radius, by forward differentiation."""
    basis = jnp.stack(tangent_basis(jnp.stack(sky, axis=-1), jnp))
    columns, in_radius = jax.vmap(lambda change: vary(*(change[..., i] for i in range(3))))(basis)
    rows = [tuple(e[..., i] for i in range(3)) for e in polar_basis(jnp.stack(direction, axis=-1), jnp)]
    return tuple(tuple(dot(row, [c[j] for c in columns]) for j in range(2)) for row in rows), tuple(in_radius)


def _ray_end(
    frame: Frame,
    sky: Components,
    end: TracedEnd,
    direction: Components,
    radius: Reals,
    values: _Values,
    spread: Reals,
    outputs: RayOutputs,
) -> Ends:
    hidden = jnp.where(values.lost, jnp.nan, 0.0)
    rounded = round_off.ROUNDING * spread * (1 + round_off.PER_PHASE * values.polar.phase)
    unlimited = values.noise + rounded
    error = jnp.minimum(unlimited, math.pi) + hidden
    rate, turn = values.photon.rate, values.polar.azimuth
    certified = values.certified & (values.lost | jnp.isfinite(error))
    time, time_errors = None, (None, None)
    if values.travel.clock is not None and values.polar.clock is not None:
        time = values.travel.clock + values.polar.clock
        certified = certified & (values.lost | jnp.isfinite(time))
        rounding = round_off.of_time(frame, values.travel)
        time_errors = tuple(part + rounding for part in errors.of_time(frame, end, values.at, error, values.noise))
        time = time + hidden
    crossings, crossings_certain = None, None
    if outputs.crossings:
        polar, place = values.polar, (direction[2], error)
        crossings, crossings_certain = certainty.crossings(frame, end, polar.crossings, place, polar.leaving, rate)
    return RayEnd(
        direction=stacked(direction, hidden),
        azimuth=values.azimuth + hidden,
        azimuth_error=certainty.azimuth_error(frame, values.photon, direction, unlimited, turn, rate) + hidden,
        status=status_of(values.lost, values.travel.captured),
        status_certain=values.certain,
        error=error,
        noise=values.noise,
        closed_form=certified,
        redshift=frequency_ratio(frame, sky, values.photon.energy_ratio) + hidden,
        radius=radius + hidden if end.finite else None,
        outward=values.travel.rate < jnp.zeros_like(radius) if end.finite else None,
        time=time,
        time_error=time_errors[0],
        time_noise=time_errors[1],
        crossings=crossings,
        crossings_certain=crossings_certain,
    )


def _with_beam(
    ends: RayEnd[Any], end: TracedEnd, jacobian: Jacobian, spread: Reals, values: _Values, outputs: RayOutputs
) -> Ends:
    hidden = jnp.where(values.lost, jnp.nan, 0.0)
    determinant = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0]
    own, far = values.jacobian_noise
    error = errors.of_jacobian(end, own + far / jnp.maximum(spread, 1), ends.error, values.at.turning, spread)
    n_x, n_y, n_z = (ends.direction[..., i] for i in range(3))
    return replace(
        ends,
        jacobian=stacked(jacobian, hidden),
        jacobian_error=errors.of_entries((n_x, n_y, n_z), error, ends.error),
        diameter_error=jnp.minimum(error, 1.0),
        closed_form=ends.closed_form & (values.lost | jnp.isfinite(spread)),
        index=_morse_index(values.polar.phase, values.sense * determinant) if outputs.index else None,
        index_certain=certainty.index_is_certain(jacobian, error) if outputs.index else None,
    )


def _morse_index(phase: Reals, determinant: Reals) -> Reals:
    """The Morse index: the k-th conjugate point lies in the k-th half turn of the polar phase.

    So the index is the number of half turns or one more, as the sign of det J shows. (An observation, not
    proved: no exception among millions of rays, see docs/accuracy.md.)
    """
    turns = jnp.maximum(jnp.floor(phase / math.pi - _PHASE_MARGIN), 0)
    odd = jnp.mod(turns, 2) == 1
    return turns + (odd != (determinant < 0))


def _ray(frame: Frame, sky: Components, end: TracedEnd, outputs: RayOutputs, *, on_equator: bool) -> Ray:
    photon = photon_of(frame, sky)
    quartic = radial.factor(frame, photon)
    swing = polar_swing(frame, photon, on_equator=on_equator)
    travel, aim = _travelled(frame, photon, quartic, swing, end, with_time=outputs.time)
    polar = polar_motion(
        frame, photon, swing, travel.time, on_equator=on_equator, with_time=outputs.time, varied=outputs.beams
    )
    direction, azimuth = _end_direction(travel, polar)
    direction = end.direction(direction)
    at = _arriving(photon, travel)
    if aim is None:
        lost, certain = travel.captured, radial.capture_is_certain(frame, photon, quartic)
        noise = round_off.at_infinity(frame, photon, quartic, polar.phase)
        spread = round_off.spread_alone(frame, sky, photon, quartic)
    else:
        lost, certain = aim.lost, aim.certain
        noise, spread = round_off.at_finite_end(frame, sky, photon, quartic, end, travel, aim, at, polar.phase)
    holds = (photon.k >= LEAST_K) & jnp.isfinite(length(direction))
    values = _Values(
        photon=photon,
        quartic=quartic,
        azimuth=azimuth,
        polar=polar,
        travel=travel,
        at=at,
        lost=lost,
        certain=certain,
        certified=travel.holds & (lost | holds),
        spread=spread,
        noise=noise,
        jacobian_noise=round_off.of_jacobian(frame, sky, photon, quartic, noise, travel.clearance),
        sense=end.orientation(photon, travel.rate),
    )
    return (direction, end.radius_at(travel.u)), jax.lax.stop_gradient(values)


def _travelled(
    frame: Frame, photon: Photon, quartic: radial.Quartic, swing: Swing, end: TracedEnd, *, with_time: bool
) -> tuple[Travel, Aim | None]:
    """The radial motion to the end, and the aim there: None at infinity, as the motion holds the captured rays."""
    if isinstance(end, TracedSky):
        return radial_motion(frame, photon, quartic, with_time=with_time), None
    aim = end.aim(frame, *jax.lax.stop_gradient((photon, quartic)))
    if isinstance(end, TracedSphere):
        return finite_end.to_sphere(frame, photon, quartic, end.radius, aim, with_time=with_time), aim
    if isinstance(end, TracedPlane):
        # A time within the length of every ray, for rays that do not reach the plane.
        brief = 0.01 / (frame.radius * jnp.sqrt(photon.k + 3))
        time = jnp.where(aim.lost, brief, time_to_plane(frame, swing, end.crossing))
        return finite_end.travel_over_time(frame, photon, quartic, time, aim, with_time=with_time), aim
    raise NotImplementedError(f"There is no closed form of the way to {end!r}.")


def _short_ray(frame: Frame, sky: Components, end: Spherical, *, with_time: bool) -> Ray:
    """The same as `_ray`, for rays of small k."""
    photon = photon_of(frame, sky)
    travel = small_k.radial_motion(frame, photon, end, with_time=with_time)
    polar = small_k.polar_motion(frame, photon, travel.time, with_time=with_time)
    direction, azimuth = _end_direction(travel, polar)
    noise = round_off.of_small_k(frame, end, travel.psi)
    values = _Values(
        photon=photon,
        quartic=None,
        azimuth=azimuth,
        polar=polar,
        travel=travel,
        at=_arriving(photon, travel),
        lost=travel.captured,
        # Short rays are far from the shadow edge.
        certain=jnp.ones_like(travel.captured),
        certified=(photon.rate[0] < 0) & (photon.k < MOST_K) & jnp.isfinite(length(direction)),
        spread=round_off.spread_of_small_k(frame, sky, photon, travel.time),
        noise=noise,
        jacobian_noise=(9 * noise, 0.0 * noise),
        sense=1.0,
    )
    return (direction, end.radius_at(travel.u)), jax.lax.stop_gradient(values)


def _arriving(photon: Photon, travel: Travel) -> Arriving:
    speed = jnp.sqrt(jnp.maximum(photon.k, 0) + 3)
    return Arriving(jnp.abs(travel.u), jnp.abs(travel.rate), jnp.abs(travel.psi_rate), speed)


def _end_direction(travel: Travel, m: Polar) -> tuple[Components, Reals]:
    """n', and its azimuth: m turned about the spin axis."""
    c, s = jnp.cos(travel.psi + m.turn), jnp.sin(travel.psi + m.turn)
    return (c * m.x - s * m.y, s * m.x + c * m.y, m.z), travel.psi + m.azimuth
