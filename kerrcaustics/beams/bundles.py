"""Bundles of rays in space: advanced in Mino time with their variations, and searched for conjugate points.

The path and its variations are those of integrator/integrated.py, advanced by its pair from one Mino time to the next.
Conjugate points are zeros of the beam's signed area; each is bracketed by two neighbouring times and refined there.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.compile_cache import Program
from kerrcaustics.beams.ends import Spherical
from kerrcaustics.beams.geometry import area, azimuth_step, first_azimuth, length, turned
from kerrcaustics.beams.integrator.equations import Constants, polar_rapidity, rapidity, ray_rates
from kerrcaustics.beams.integrator.integrated import DENSEST, all_rates, start, with_variations
from kerrcaustics.beams.integrator.journey import local_error
from kerrcaustics.beams.integrator.nystroem import Path, nystroem_step
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame

# Arc beyond which a ray winds for ever; more steps than are needed from one time to the next.
_MOST_ARC, _MOST_STEPS = 60.0, 300
# A captured ray ends a little above the horizon, where the azimuth is infinite; closer if the camera is close.
_ABOVE_HORIZON = 0.01
# Steps of the search for a zero of the area, by false position.
_MOST_TRIALS = 30
# Part of the summed local errors that is left in the better of the two orders, and round-off of N in a beam.
_STEP_GAIN, _ROUND_OFF = 0.02, 3e-15
COORDINATES: tuple[str, ...] = ("mino_time", "radius", "theta", "azimuth")


class BundleState(NamedTuple):
    """A bundle of rays at one time: the rays and their two variations, the azimuth of m, errors of the steps."""

    paths: tuple[Path, ...]
    azimuth: Reals
    local_error: Reals


class Bundle(NamedTuple):
    """Constants along a bundle of rays.

    end_time, of Mino, NaN for rays that are not followed; end_u, 1 / r there; lost: that end is not the requested one;
    captured; opening, the rate in Mino time at which the beam opens at the camera.
    """

    constants: Constants
    variations: list[Constants]
    end_time: Reals
    end_u: Reals
    lost: Flags
    captured: Flags
    opening: Reals


@Program
def departing(frame: Frame, sky: Components, end: Spherical) -> tuple[Bundle, BundleState]:
    """The constants and the state of rays at the camera."""
    constants, ray, photon = start(frame, sky)
    paths, variations = with_variations(frame, sky, ray)
    quartic = radial.factor(frame, photon)
    aim = end.aim(frame, photon, quartic)
    horizon = radial.horizon(frame.spin)
    stop = horizon + _ABOVE_HORIZON * jnp.minimum(1.0, frame.radius - horizon)
    to_horizon = radial.mino_time_to(frame, photon, quartic, stop, jnp.zeros_like(aim.captured))
    other_time = jnp.where(aim.captured, to_horizon, radial.mino_time(frame, photon, quartic))
    end_time = jnp.where(aim.lost, other_time, aim.mino_time)
    is_followed = (photon.energy_ratio > 0) & (end_time * polar_rapidity(constants) < _MOST_ARC)
    end_time = jnp.where(is_followed, end_time, jnp.nan)
    end_u = jnp.where(aim.lost, jnp.where(aim.captured, 1 / stop, 0.0), 1 / end.radius)
    opening = length((*paths[1].rate[1:], *paths[2].rate[1:]))
    bundle = Bundle(constants, variations, end_time, end_u, aim.lost, aim.captured, opening)
    return bundle, BundleState(paths, first_azimuth(frame, ray.rate), 0 * photon.b)


@Program
def advanced(spin: Reals, bundle: Bundle, state: BundleState, duration: Reals) -> BundleState:
    """The rays a Mino time later, each by steps of its own that keep the local error at round-off."""
    constants = bundle.constants
    rates = partial(all_rates, spin, constants, bundle.variations)

    def step(now: tuple[Reals, Reals, BundleState]) -> tuple[Reals, Reals, BundleState]:
        time_left, steps, state = now
        count = jnp.ceil(time_left * DENSEST * rapidity(spin, constants, state.paths[0]))
        h = time_left / jnp.maximum(count, 1)
        paths, gaps = nystroem_step(rates, state.paths, h)
        turn = azimuth_step(constants.b, state.paths[0].position, paths[0].position)
        gap = local_error(constants, gaps[0])
        after = BundleState(paths, state.azimuth + turn, state.local_error + gap)
        return jnp.where(count <= 1, 0.0, time_left - h), steps + 1, after

    def goes_on(now: tuple[Reals, Reals, BundleState]) -> Reals:
        return jnp.any(now[0] > 0) & (now[1] < _MOST_STEPS)

    return jax.lax.while_loop(goes_on, step, (duration, 0, state))[2]


@Program
def _area(spin: Reals, constants: Constants, state: BundleState) -> Reals:
    return area(ray_rates(spin, constants, state.paths[0].position)[1], state.paths)


def coordinates(state: BundleState, times: np.ndarray) -> list[np.ndarray]:
    """Mino time, radius, theta, azimuth of states."""
    u, x, y, z = state.paths[0].position
    with np.errstate(divide="ignore"):
        parts = [times, 1 / np.abs(u), np.arctan2(np.hypot(x, y), z), state.azimuth + state.paths[0].psi]
    return [np.asarray(part) for part in parts]


@Program
def errors_of(bundle: Bundle, state: BundleState) -> Reals:
    """Errors (time, ray) of the direction and of 1 / r, from those of the steps and round-off in N."""
    m = state.paths[0].position[1:]
    spread = length(
        [part for path in state.paths[1:] for part in (path.position[0], *turned(m, path.position[1:], path.psi))]
    )
    growth = spread * polar_rapidity(bundle.constants) / bundle.opening
    return _STEP_GAIN * state.local_error * (1 + growth) + _ROUND_OFF * (1 + spread)


def conjugate_points(
    spin: float, bundle: Bundle, track: BundleState, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (ray, most, 4) of the zeros of the area, and their number for each ray."""
    value = np.array(_area(spin, bundle.constants, track))
    # An area of exactly zero has the sign of the value before it.
    for i in range(1, len(value)):
        value[i] = np.where(value[i] == 0, value[i - 1], value[i])
    crosses = value[1:] * value[:-1] < 0
    index = crosses.sum(axis=0)
    points = np.full((len(index), index.max(initial=0), len(COORDINATES)), np.nan)
    number = np.cumsum(crosses, axis=0)
    for k in range(points.shape[1]):
        rays = np.flatnonzero(index > k)
        low = np.zeros(len(index), int)
        low[rays] = np.argmax(crosses & (number == k + 1), axis=0)[rays]
        points[rays, k] = _zero(spin, bundle, track, times, value, low)[rays]
    return points, index


def _zero(
    spin: float, bundle: Bundle, track: BundleState, times: np.ndarray, value: np.ndarray, low: np.ndarray
) -> np.ndarray:
    """Coordinates (ray, 4) of the zero of the area between the times `low` and `low` + 1: false position (Illinois)."""
    lane = np.arange(len(low))
    begin = jax.tree.map(lambda leaf: leaf[low, lane], track)
    lower, upper = np.zeros(len(low)), times[low + 1, lane] - times[low, lane]
    at_lower, at_upper = value[low, lane], value[low + 1, lane]
    whole, trial, state = upper, lower, begin
    for _ in range(_MOST_TRIALS):
        with np.errstate(invalid="ignore", divide="ignore"):
            trial = (lower * at_upper - upper * at_lower) / (at_upper - at_lower)
        trial = np.where(np.isfinite(trial), np.clip(trial, lower, upper), lower)
        state = advanced(spin, bundle, begin, trial)
        at_trial = np.asarray(_area(spin, bundle.constants, state))
        is_lower = at_trial * at_lower > 0
        at_upper = np.where(is_lower, at_upper / 2, at_trial)
        at_lower = np.where(is_lower, at_trial, at_lower / 2)
        moved = np.minimum(trial - lower, upper - trial)
        lower, upper = np.where(is_lower, trial, lower), np.where(is_lower, upper, trial)
        if np.all((moved <= 1e-13 * whole) | (at_trial == 0)):
            break
    state = jax.tree.map(np.asarray, state)
    return np.stack(coordinates(state, times[low, lane] + trial), axis=-1)
