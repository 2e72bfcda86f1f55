"""Rays and beams in closed form: elliptic integrals for r, theta functions for theta and phi.

The path is that of integrator/integrated.py: n' is a point m of the unit sphere, at the Mino time of arrival, turned
about the spin axis by psi. Time and psi are Carlson integrals, to infinity (radial_motion.py) or to a finite radius
(radial_leg.py); in the equatorial plane the time comes first, and the radius from it (finite_end.py). m is a quotient
of theta functions of the polar phase z, proportional to Mino time, with no singular point (polar_motion.py). The
coordinate time comes from the same integrals and two more, and the logarithmic derivative of theta_3. Beams are the
first variation of all but the time in two directions of the camera sky, by forward differentiation; the Morse index
follows from z and the sign of det J.

This holds for k = q + b^2 >= LEAST_K. Escaping rays below that leave close to the outward principal null direction:
they are short, and have formulas of their own for r, theta and phi (small_k.py), compiled apart.

All functions work elementwise on JAX arrays of one shape, one entry a ray.
"""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.closed_form import finite_end, small_k
from kerrcaustics.beams.closed_form.polar_motion import Arrival, Swing, polar_motion, polar_swing, time_to_plane
from kerrcaustics.beams.closed_form.radial_motion import Travel, close_to_roots, horizons, radial_motion
from kerrcaustics.beams.ends import Aim, Goal, aim_at
from kerrcaustics.beams.geometry import dot, length
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.camera import Frame, Photon, doppler, photon
from kerrcaustics.spacetime.sphere import polar_basis, tangent_basis

Array = Any

# The parameter of the polar elliptic functions is then at most 1/3, and there are no vortical rays. Escaping rays of
# smaller k start outward, meet no turning point and no conjugate point, and take a Mino time of 1.2 at most.
LEAST_K = 2.0
# The polar phase is known to 1e-14; conjugate points that lie at a multiple of pi (a = 0) must not be counted twice.
_PHASE_MARGIN = 1e-9


class End(NamedTuple):
    """A ray at its end, as in integrator/landing.py. What was not asked for is None.

    noise, the part of the error that is round-off of these formulas, and time_noise, that of the time's; certified,
    False where they do not hold.
    """

    direction: tuple[Array, Array, Array]
    azimuth: Array
    error: Array
    noise: Array
    captured: Array
    certified: Array
    jacobian: tuple[tuple[Array, ...], ...] | None = None
    jacobian_error: Array | None = None
    conjugate_points: Array | None = None
    crossings: Array | None = None
    missed: Array | None = None
    radius: Array | None = None
    time: Array | None = None
    time_error: Array | None = None
    time_noise: Array | None = None


class _Way(NamedTuple):
    """What is known of a ray beside its direction n' and its radius at the end.

    lost, it does not reach its end; spread, of a ray traced alone; rate, that of the end by Mino time, in radians, and
    turning, the part of psi in it, both per radian of arc; lever, the time that goes with a radian; sense, the sign
    that det J has where no conjugate point was passed.
    """

    azimuth: Array
    phase: Array
    crossings: Array
    captured: Array
    lost: Array
    certified: Array
    spread: Array
    noise: Array
    jacobian_noise: Array
    motion: Array
    turning: Array
    lever: Array
    sense: Array
    time: Array | None
    time_noise: Array | None


def trace(
    frame: Frame,
    sky: tuple[Array, Array, Array],
    goal: Goal,
    *,
    on_equator: bool,
    beams: bool,
    index: bool = False,
    crossings: bool = False,
    time: bool = False,
    short: bool = False,
) -> End:
    """Rays, or beams, from camera-sky directions to their end.

    Parameters: sky, three arrays N_x, N_y, N_z; goal, where rays end; on_equator, whether the camera is exactly
    there, which is cheaper; beams, index, crossings, time: what to compute beside n'; short, whether to take the
    formulas of small_k.py, which hold for escaping rays of k < MOST_K and ends beyond the camera.
    """

    def ray(*n: Array) -> tuple[tuple[tuple[Array, Array, Array], Array | None], _Way]:
        if short:
            return _short_ray(frame, n, goal, time=time)
        return _ray(frame, n, goal, on_equator=on_equator, time=time)

    if not beams:
        (direction, radius), way = ray(*sky)
        return _end(way, goal, direction, radius, way.spread, crossings=crossings)
    (direction, radius), vary, way = jax.linearize(ray, *sky, has_aux=True)
    basis = jnp.stack(tangent_basis(jnp.stack(sky, axis=-1), jnp))
    columns, in_radius = jax.vmap(lambda change: vary(*(change[..., i] for i in range(3))))(basis)
    rows = [tuple(e[..., i] for i in range(3)) for e in polar_basis(jnp.stack(direction, axis=-1), jnp)]
    jacobian = tuple(tuple(dot(row, [c[j] for c in columns]) for j in range(2)) for row in rows)
    if goal.kind == "plane":
        jacobian = (tuple(in_radius[j] for j in range(2)), tuple(radius * entry for entry in jacobian[1]))
    spread = length([entry for row in jacobian for entry in row])
    if goal.kind == "plane":
        spread = spread / radius
    end = _end(way, goal, direction, radius, spread + way.motion, crossings=crossings)
    hidden = 0 * end.error
    determinant = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0]
    jacobian_error = (way.jacobian_noise + end.error) * (1 + way.turning) / jnp.minimum(spread, 1)
    if goal.kind == "infinity":
        jacobian_error = way.jacobian_noise / jnp.minimum(spread, 1) + end.error
    return end._replace(
        jacobian=tuple(tuple(entry + hidden for entry in row) for row in jacobian),
        jacobian_error=jnp.minimum(jacobian_error, 1.0),
        certified=end.certified & (way.lost | jnp.isfinite(spread)),
        conjugate_points=_conjugate_points(way.phase, way.sense * determinant) if index else None,
    )


def _end(
    way: _Way,
    goal: Goal,
    direction: tuple[Array, Array, Array],
    radius: Array | None,
    spread: Array,
    *,
    crossings: bool,
) -> End:
    hidden = jnp.where(way.lost, jnp.nan, 0.0)
    finite = goal.kind != "infinity"
    error = jnp.minimum(way.noise + 2e-15 * spread * (1 + 0.3 * way.phase), math.pi) + hidden
    end = End(
        direction=tuple(n + hidden for n in direction),
        azimuth=way.azimuth + hidden,
        error=error,
        noise=way.noise,
        captured=way.captured & way.lost,
        certified=way.certified,
        crossings=way.crossings if crossings else None,
        missed=way.lost & ~way.captured if finite else None,
        radius=None if radius is None else radius + hidden,
    )
    if way.time is None:
        return end
    # An end displaced by some angle is late by at most the lever times that.
    return end._replace(
        time=way.time + hidden,
        time_error=way.lever * error + way.time_noise,
        time_noise=way.lever * way.noise + way.time_noise,
        certified=end.certified & (way.lost | jnp.isfinite(way.time)),
    )


def _conjugate_points(phase: Array, determinant: Array) -> Array:
    """The Morse index: the k-th conjugate point lies in the k-th half turn of the polar phase.

    So the index is the number of half turns or one more, and the sign of det J tells which. (Found, not
    proved: no exception among millions of rays, see docs/accuracy.md.)
    """
    turns = jnp.floor(phase / math.pi - _PHASE_MARGIN)
    odd = jnp.mod(turns, 2) == 1
    return turns + (odd != (determinant < 0))


def _ray(
    frame: Frame, sky: tuple[Array, ...], goal: Goal, *, on_equator: bool, time: bool
) -> tuple[tuple[tuple[Array, Array, Array], Array | None], _Way]:
    light = photon(frame, sky)
    quartic = radial.factor(*radial.potential_coefficients(frame.spin, light))
    swing = polar_swing(frame, light, on_equator=on_equator)
    arrival, aim = None, None
    if goal.kind == "infinity":
        travel = radial_motion(frame, light, quartic, clock=time)
        known, lost = True, travel.captured
    else:
        arrival, aim = _arrival(frame, light, quartic, swing, goal, clock=time)
        travel, known, lost = arrival.travel, arrival.certified, aim.lost
    m = polar_motion(frame, light, swing, travel.time, on_equator=on_equator, clock=time)
    direction, azimuth = _turned(travel, m)
    in_plane = goal.kind == "plane"
    if in_plane:
        direction = (*direction[:2], jnp.zeros_like(m.z))
    # Off the equator the azimuth is a difference of two phases, each of which changes with N by about the radius.
    start = 0.0 if on_equator else 3e-15 * frame.cylindrical_scale
    holds = (light.k >= LEAST_K) & jnp.isfinite(length(direction))
    way = _Way(
        azimuth=azimuth,
        phase=m.phase,
        crossings=jnp.full_like(m.phase, goal.value) if in_plane else m.crossings,
        captured=travel.captured,
        lost=lost,
        certified=known & (lost | holds),
        spread=_spread(frame, sky, light, quartic),
        noise=_noise(frame, light, quartic, m.phase),
        jacobian_noise=1e-15 * jnp.sqrt(jnp.maximum(light.k, 0)) + start,
        motion=0.0,
        turning=0.0,
        lever=jnp.sqrt(jnp.maximum(light.k, 0) + 3),
        sense=1.0,
        time=None if travel.clock is None or m.clock is None else travel.clock + m.clock,
        time_noise=_time_noise(frame, goal) if time else None,
    )
    radius = None
    if arrival is not None and aim is not None:
        way = _at_finite_end(frame, light, goal, arrival, aim, way)
        radius = 1 / arrival.u
    way = way._replace(jacobian_noise=9 * way.noise + way.jacobian_noise)
    return (direction, radius), jax.lax.stop_gradient(way)


def _arrival(
    frame: Frame, light: Photon, quartic: radial.Quartic, swing: Swing, goal: Goal, *, clock: bool
) -> tuple[finite_end.FiniteEnd, Aim]:
    aim = aim_at(goal, frame, *jax.lax.stop_gradient((light, quartic)))
    if goal.kind == "sphere":
        return finite_end.to_sphere(frame, light, quartic, goal, aim, clock=clock), aim
    # Some time that every ray lasts, where there is none.
    brief = 0.01 / (frame.radius * jnp.sqrt(light.k + 3))
    time = jnp.where(aim.lost, brief, time_to_plane(frame, swing, goal.value))
    return finite_end.after(frame, light, quartic, time, aim, clock=clock), aim


def _at_finite_end(frame: Frame, light: Photon, goal: Goal, arrival: finite_end.FiniteEnd, aim: Aim, way: _Way) -> _Way:
    """What is known of a ray, with what a finite end makes of it: rates there magnify errors of the Mino time."""
    u, rate, psi_rate = (jnp.abs(part) for part in (arrival.u, arrival.rate, arrival.psi_rate))
    speed = jnp.sqrt(jnp.maximum(light.k, 0) + 3)
    turning = psi_rate / speed
    grown = finite_end.growth(frame, *jax.lax.stop_gradient((light, arrival.travel.time)))
    depth = 1 / (u * radial.horizon_function(frame.spin, u))
    motion, lever = 1 + turning, speed
    if goal.kind == "sphere":
        sense = jnp.where(arrival.rate < 0, 1.0, -1.0)
        spread = grown * (1 + turning) / rate
    else:
        # Above the plane first, a ray meets it from above for the odd crossings.
        above = jnp.where(light.position[3] == 0, light.rate[3], light.position[3]) > 0
        sense = jnp.where(above == (jnp.mod(goal.value, 2) == 1), -1.0, 1.0)
        spread = grown * (1 / u + psi_rate) / speed
        motion = motion + rate / u / speed
        lever = lever + depth
    noise = (
        2e-15 * (1 + 0.3 * way.phase) * motion
        + _turn_noise(frame, light, jnp.minimum(1 / u, frame.radius)) * (1 + 0.1 * depth * u)
        + 3e-16 * spread
    )
    # Rounding N changes b, and the root of k, by the distance from the axis times that.
    spread = (spread + motion) * aim.conditioning * (1 + frame.cylindrical_scale * arrival.travel.time)
    if aim.plane_rate is not None:
        # A ray that leaves off the plane at a small inclination is late by z0 dz0' / z'^2.
        spread = spread + motion * jnp.abs(frame.cos_theta) * (speed / aim.plane_rate) ** 2 * aim.conditioning
    time_noise = None if way.time_noise is None else way.time_noise + 1e-15 * depth
    return way._replace(
        spread=spread,
        noise=noise,
        # Close to the outer roots the variations of psi and of the Mino time cancel.
        jacobian_noise=way.jacobian_noise + 5e-14 / arrival.clearance,
        motion=motion,
        turning=turning,
        lever=lever,
        sense=sense,
        time_noise=time_noise,
    )


def _short_ray(
    frame: Frame, sky: tuple[Array, ...], goal: Goal, *, time: bool
) -> tuple[tuple[tuple[Array, Array, Array], Array | None], _Way]:
    """As `_ray`, for rays of small k."""
    light = photon(frame, sky)
    travel = small_k.radial_motion(frame, light, goal, clock=time)
    m = small_k.polar_motion(frame, light, travel.time, clock=time)
    direction, azimuth = _turned(travel, m)
    # psi is a difference of two integrals divided by r_+ - r_-.
    outer, inner = horizons(frame.spin)
    noise = 2e-15 + 2e-15 * frame.spin / (outer - inner) + jnp.zeros_like(light.k)
    # That of flat space, but for the energy and the way: at most three times too large.
    energy = frame.slowness**0.5 / (doppler(frame, sky)[0] * light.energy_ratio)
    way = _Way(
        azimuth=azimuth,
        phase=m.phase,
        crossings=m.crossings,
        captured=travel.captured,
        lost=travel.captured,
        certified=(light.rate[0] < 0) & (light.k < small_k.MOST_K) & jnp.isfinite(length(direction)),
        spread=1.5 * energy * frame.cylindrical_scale * travel.time,
        noise=noise,
        jacobian_noise=9 * noise,
        motion=0.0,
        turning=0.0,
        lever=jnp.sqrt(jnp.maximum(light.k, 0) + 3),
        sense=1.0,
        time=None if travel.clock is None or m.clock is None else travel.clock + m.clock,
        time_noise=_time_noise(frame, goal) if time else None,
    )
    radius = None if goal.kind == "infinity" else goal.value + jnp.zeros_like(light.k)
    return (direction, radius), jax.lax.stop_gradient(way)


def _turned(travel: Travel, m: Arrival) -> tuple[tuple[Array, Array, Array], Array]:
    """n', and its azimuth: m turned about the spin axis."""
    c, s = jnp.cos(travel.psi + m.turn), jnp.sin(travel.psi + m.turn)
    return (c * m.x - s * m.y, s * m.x + c * m.y, m.z), travel.psi + m.azimuth


def _noise(frame: Frame, light: Photon, quartic: radial.Quartic, phase: Array) -> Array:
    """Round-off of the formulas, in radians for a beam of unit spread; the factors were measured.

    psi is a difference of two integrals divided by r_+ - r_-. Close to the hole, photons that move with its horizon,
    2 r_+ = a b, are the worst. Rounding b and q moves the outer roots: the last term is what that does to the time.
    It moves them less where the rate at the camera tells their distance.
    """
    distance = 3 * (jnp.abs(frame.radius - quartic.h) + jnp.sqrt(jnp.abs(quartic.d))) / quartic.h
    known = jnp.where(close_to_roots(frame, quartic), jnp.minimum(distance, 1.0), 1.0)
    moved = known * light.k**1.5 * quartic.h**2 * _time_slope(frame, light, quartic)
    return 2e-15 * (1 + 0.3 * phase) + _turn_noise(frame, light, frame.radius) + 3e-16 * moved


def _turn_noise(frame: Frame, light: Photon, radius: Array) -> Array:
    """Round-off of psi for a ray whose lower end, or camera, is at some radius."""
    outer, inner = horizons(frame.spin)
    corotation = jnp.abs(2 * outer - frame.spin * light.b) * (1 + 40 * (radius - outer) ** 2)
    # Next to a = 1 the outer roots come close to the horizons too.
    extremal = 1 + 2e-5 / (outer - inner)
    return 4e-15 * extremal * frame.spin / (outer - inner) * (1 + 0.3 / corotation + 0.01 / corotation**2)


def _time_noise(frame: Frame, goal: Goal) -> Array:
    """Round-off of the time beside what comes with that of the end: of the radii, and of the horizon between them."""
    u = 1 / frame.radius
    depth = 1 / (u * radial.horizon_function(frame.spin, u))
    return 1e-15 * (frame.radius + (goal.value if goal.kind == "sphere" else 0)) + 3e-16 * depth


def _time_slope(frame: Frame, light: Photon, quartic: radial.Quartic) -> Array:
    """How much the Mino time changes with the potential R where the ray lingers, near the outer roots."""
    # A ray that leaves outward from above the roots does not linger there.
    away = (light.rate[0] < 0) & (frame.radius > quartic.h)
    gap = jnp.abs(quartic.d) + jnp.where(away, (frame.radius - quartic.h) ** 2, 0.0)
    return 1 / (jnp.abs(4 * quartic.h**2 - quartic.e) ** 1.5 * gap)


def _spread(frame: Frame, sky: tuple[Array, ...], light: Photon, quartic: radial.Quartic) -> Array:
    """An estimate of the beam's major diameter for a ray that is traced alone, mostly one to ten times too large."""
    a, h = frame.spin, quartic.h
    momentum = jnp.sqrt(light.k + a * a)
    slope = 2 * momentum * (jnp.abs(h * (h - 2) + a * a) + 0.1 * h) + 2 * a * jnp.abs(h * h + a * a - a * light.b)
    energy = frame.slowness**0.5 / (doppler(frame, sky)[0] * jnp.abs(light.energy_ratio))
    return energy * (1 + frame.cylindrical_scale * momentum * slope * _time_slope(frame, light, quartic))
