"""Bundles of rays in space: advanced in Mino time with their variations and clocks.

The path and its variations are those of integrator/integrated.py, the clock that of integrator/clock.py, advanced by
their pair from one Mino time to the next.
"""

from functools import partial

import jax
import jax.numpy as jnp

from kerrcaustics.beams import errors
from kerrcaustics.beams.geometry import area, azimuth_step, first_azimuth, length
from kerrcaustics.beams.integrator import clock
from kerrcaustics.beams.integrator.equations import polar_rapidity, rapidity, ray_rates
from kerrcaustics.beams.integrator.integrated import aim_at, all_rates, start, with_variations
from kerrcaustics.beams.integrator.journey import local_error
from kerrcaustics.beams.integrator.landing import OF_TURN, horizon_noise, short_step
from kerrcaustics.beams.integrator.nystroem import Rates, nystroem_step
from kerrcaustics.beams.ray_state import DENSEST, Aim, Arriving, Bundle, BundleState, Constants, Path
from kerrcaustics.beams.traced_ends import TracedEnd, TracedSky, TracedSphere
from kerrcaustics.beams.vectors import with_small_turn
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon

# Arc beyond which a ray winds for ever; more steps than are needed from one time to the next.
_MOST_ARC, _MOST_STEPS = 60.0, 300
# A captured ray ends a little above the horizon, where the azimuth is infinite; closer if the camera is close.
_ABOVE_HORIZON = 0.01
# Part of the summed local errors that is left in the better of the two orders: see integrator/landing.py.
_STEP_GAIN = 0.02
# Round-off of N as it enters a beam: see the same.
_ROUND_OFF = 3e-15
# Round-off of N as it enters the area of a beam through the angular momentum.
_IN_AREA = 4e-15


def departing(
    frame: Frame, sky: Components, end: TracedEnd, begin: Reals
) -> tuple[Bundle, BundleState, tuple[Aim, Aim]]:
    """The constants and the state of rays at the viewer, and their aims at the begin and at the end of places.

    begin: the radius at which places begin, at the viewer if that is nearer.
    """
    constants, ray, photon = start(frame, sky)
    paths, variations = with_variations(frame, sky, ray)
    aim = aim_at(end, frame, photon)
    stop, other_time = _end_without_surface(frame, photon, aim)
    end_time = jnp.where(aim.lost, other_time, aim.mino_time)
    way_in = aim_at(TracedSphere(begin), frame, photon)
    at_once = begin >= frame.radius
    begin_time = jnp.where(at_once, 0.0, way_in.mino_time)
    comes = at_once | (~way_in.lost & (begin_time < end_time))
    is_followed = comes & (photon.energy_ratio > 0) & (end_time * polar_rapidity(constants) < _MOST_ARC)
    end_time = jnp.where(is_followed, end_time, jnp.nan)
    end_u = jnp.where(aim.captured, 1 / stop, 0.0)
    opening = length((*paths[1].rate[1:], *paths[2].rate[1:]))
    bundle = Bundle(
        constants, variations, begin_time, end_time, end_u, aim.lost, aim.captured & comes, opening, paths[0]
    )
    none = 0 * photon.b
    paths = (*paths, clock.started(constants, ray))
    return bundle, BundleState(paths, first_azimuth(frame, ray.rate), none, none), (way_in, aim)


def _end_without_surface(frame: Frame, photon: Photon, aim: Aim) -> tuple[Reals, Reals]:
    """Radius just above the horizon, and Mino time to there or to infinity, where rays are left that have no end."""
    quartic, horizon = radial.factor(frame, photon), radial.horizon(frame.spin)
    stop = horizon + _ABOVE_HORIZON * jnp.minimum(1.0, frame.radius - horizon)
    to_horizon = radial.mino_time_to(frame, photon, quartic, stop, jnp.zeros_like(aim.captured))
    return stop, jnp.where(aim.captured, to_horizon, radial.mino_time(frame, photon, quartic))


def advanced(spin: Reals, bundle: Bundle, state: BundleState, duration: Reals) -> BundleState:
    """The rays a Mino time later, each by steps of its own that keep the local error at round-off."""
    constants = bundle.constants
    rates = _rates(spin, bundle)

    def step(now: tuple[Reals, Reals, BundleState]) -> tuple[Reals, Reals, BundleState]:
        time_left, steps, state = now
        count = jnp.ceil(time_left * DENSEST * rapidity(spin, constants, state.paths[0]))
        h = time_left / jnp.maximum(count, 1)
        paths, gaps = nystroem_step(rates, state.paths, h, (0, len(state.paths) - 1))
        turn = azimuth_step(constants.b, state.paths[0].position, paths[0].position)
        gap, time_gap = local_error(constants, gaps[0]), clock.local_error(constants, paths[-1], gaps[1])
        after = BundleState(paths, state.azimuth + turn, state.local_error + gap, state.clock_error + time_gap)
        return jnp.where(count <= 1, 0.0, time_left - h), steps + 1, after

    def goes_on(now: tuple[Reals, Reals, BundleState]) -> Reals:
        return jnp.any(now[0] > 0) & (now[1] < _MOST_STEPS)

    return jax.lax.while_loop(goes_on, step, (duration, 0, state))[2]


def _rates(spin: Reals, bundle: Bundle) -> Rates:
    return clock.with_clock(partial(all_rates, spin, bundle.constants, bundle.variations), spin, bundle.constants)


def settled(spin: Reals, bundle: Bundle, surface: TracedEnd, aim: Aim, state: BundleState) -> tuple[BundleState, Reals]:
    """Rays that round-off keeps off the surface they aim at, moved onto it; radians by which they were off."""
    path = state.paths[0]
    rest = jnp.where(
        aim.lost, (bundle.end_u - path.position[0]) / path.rate[0], surface.time_left(bundle.constants, aim, path)
    )
    paths, _ = short_step(_rates(spin, bundle), state.paths, rest)
    return state._replace(paths=tuple(paths)), jnp.abs(rest) * polar_rapidity(bundle.constants)


def end_place(spin: Reals, bundle: Bundle, end: TracedEnd, aim: Aim, path: Path) -> tuple[Flags, Reals, Reals]:
    """The ends of rays: True where that is not the one requested; radius and theta, put onto the surface."""
    u, *m = path.position
    lost = end.lost(aim, spin, u)
    x, y, z = (jnp.where(lost, own, put) for own, put in zip(m, end.direction((m[0], m[1], m[2])), strict=True))
    radius = jnp.where(lost, jnp.where(aim.captured, 1 / jnp.abs(u), jnp.inf), end.radius_at(u))
    return lost, radius, jnp.arctan2(jnp.hypot(x, y), z)


def beam_area(spin: Reals, constants: Constants, state: BundleState) -> Reals:
    """Signed area of the beams, from their parts across the rays."""
    ray, *variations = state.paths[:3]
    motion = _motion(spin, constants, ray)
    return area(motion.psi, [ray, *(_transverse_part(ray, motion, by) for by in variations)])


def _displacement(path: Path, by: Path) -> list[Reals]:
    """A displacement of a path as a vector of 1 / r and of the direction."""
    return [by.position[0], *with_small_turn(path.position[1:], by.position[1:], by.psi)]


def _motion(spin: Reals, constants: Constants, ray: Path) -> Path:
    """The displacement of a ray in a unit of Mino time."""
    return Path(ray.rate, ray.rate, ray_rates(spin, constants, ray.position)[1])


def _transverse_part(ray: Path, motion: Path, by: Path) -> Path:
    """A variation less its part along the ray, which would cancel in the area."""
    beside, ahead = _displacement(ray, by), _displacement(ray, motion)
    along = sum(p * q for p, q in zip(beside, ahead, strict=True)) / sum(q * q for q in ahead)
    position = tuple(p - along * q for p, q in zip(by.position, motion.position, strict=True))
    return Path(position, by.rate, by.psi - along * motion.psi)


def timed(frame: Frame, bundle: Bundle, state: BundleState, at_infinity: Flags) -> tuple[Reals, Reals, Reals]:
    """Time, error of the direction and of 1 / r, error of the time."""
    ray, constants = state.paths[0], bundle.constants
    speed, psi_rate = polar_rapidity(constants), ray_rates(frame.spin, constants, ray.position)[1]
    at = Arriving(jnp.abs(ray.position[0]), jnp.abs(ray.rate[0]), jnp.abs(psi_rate), speed)
    turned_by = OF_TURN * (jnp.abs(state.azimuth) + jnp.abs(ray.psi))
    # The rate of psi is rounded in every step on the way, at both ends of which it may be fast.
    beside_horizon = 2 * (horizon_noise(frame.spin, 1 / frame.radius) + horizon_noise(frame.spin, at.u))
    rounded = _ROUND_OFF * (1 + _spread(state) + at.turning) + turned_by + beside_horizon
    error = _STEP_GAIN * state.local_error * (1 + _growth(bundle, state)) + rounded
    times = []
    for end in (TracedSky(), TracedSphere(1.0)):
        time = clock.reading(
            constants, bundle.first, ray, state.paths[-1], at_infinity=not end.finite, distant=frame.start == 0
        )
        times.append((time, errors.of_time(frame, end, at, error, error)[0] + _STEP_GAIN * state.clock_error))
    time, time_error = (jnp.where(at_infinity, far, near) for far, near in zip(*times, strict=True))
    return time, error, time_error


def _spread(state: BundleState) -> Reals:
    """Size of the beam at the places, per radian of N."""
    ray, *variations = state.paths[:3]
    return length([part for path in variations for part in _displacement(ray, path)])


def _growth(bundle: Bundle, state: BundleState) -> Reals:
    """The factor by which the beam has opened."""
    return _spread(state) * polar_rapidity(bundle.constants) / bundle.opening


def doubt(spin: Reals, bundle: Bundle, state: BundleState) -> tuple[Reals, Reals, Reals]:
    """Error of the area; rates in Mino time of the place and of the time.

    Each variation is in error by a part of its size, and spans the area with the part of the other across the ray.
    """
    ray, *variations = state.paths[:3]
    constants, (u, _, _, z) = bundle.constants, ray.position
    motion = _motion(spin, constants, ray)
    pace, *sizes = (length(_displacement(ray, by)) for by in (motion, *variations))
    widths = [length(_displacement(ray, _transverse_part(ray, motion, by))) for by in variations]
    rounding = _ROUND_OFF * (1 + _spread(state)) + _IN_AREA * bundle.opening / polar_rapidity(constants)
    relative = state.local_error * (1 + _growth(bundle, state)) + rounding
    clock_rate = clock.rate(spin, constants, u, z)
    return relative * pace * (sizes[0] * widths[1] + widths[0] * sizes[1]), pace, clock_rate
