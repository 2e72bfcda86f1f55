"""Bundles of rays in space: their places, and the search for their conjugate points.

Kernels advance them from one Mino time to the next (bundle_formulas.py). Conjugate points are zeros of the signed area
of the beam; each is bracketed by two neighbouring times and refined there.
"""

import numpy as np

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.kernels.trees import mapped
from kerrcaustics.beams.ray_state import Bundle, BundleState
from kerrcaustics.spacetime.frame import Frame

# Steps of the search for a zero of the area, by false position.
_MOST_TRIALS = 30
# Part of a step by which the rate of change of the area is found.
_SLOPE_PART = 1e-4
COORDINATES: tuple[str, ...] = ("mino_time", "radius", "theta", "azimuth", "time", "error", "time_error")
"""Fields of `SpacePoints` that describe a place on a ray."""


def places(
    frame: Frame, bundle: Bundle, state: BundleState, times: np.ndarray, at_infinity: np.ndarray
) -> dict[str, np.ndarray]:
    """Places of states by the names of `COORDINATES`. at_infinity: where the time is that of an end there."""
    u, x, y, z = state.paths[0].position
    with np.errstate(divide="ignore"):
        parts = [times, 1 / np.abs(u), np.arctan2(np.hypot(x, y), z), state.azimuth + state.paths[0].psi]
    parts += kernel("timed")(frame, bundle, state, at_infinity)
    # Copies that can be written to.
    return {name: np.array(part) for name, part in zip(COORDINATES, parts, strict=True)}


def conjugate_points(
    frame: Frame, bundle: Bundle, track: BundleState, times: np.ndarray
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Places (ray, most) of the zeros of the area by the names of `COORDINATES`, and their number for each ray."""
    value = kernel("beam_area")(frame.spin, bundle.constants, track)
    crosses = sign_changes(value)
    index = crosses.sum(axis=0)
    points = {name: np.full((len(index), index.max(initial=0)), np.nan) for name in COORDINATES}
    number = np.cumsum(crosses, axis=0)
    for k in range(index.max(initial=0)):
        rays = np.flatnonzero(index > k)
        low = np.zeros(len(index), int)
        low[rays] = np.argmax(crosses & (number == k + 1), axis=0)[rays]
        for name, values in _zero(frame, bundle, track, times, value, low).items():
            points[name][rays, k] = values[rays]
    return points, index


def sign_changes(values: np.ndarray) -> np.ndarray:
    """True (times - 1, rays) where values change sign from a time to the next.

    One of exactly zero becomes that of the time before; at the first time it has no sign.
    """
    for i in range(1, len(values)):
        values[i] = np.where(values[i] == 0, values[i - 1], values[i])
    return values[1:] * values[:-1] < 0


def _zero(
    frame: Frame, bundle: Bundle, track: BundleState, times: np.ndarray, value: np.ndarray, low: np.ndarray
) -> dict[str, np.ndarray]:
    """Places (ray) of the zero of the area between the times `low` and `low` + 1: false position (Illinois)."""
    advanced, area, lane = kernel("advanced"), kernel("beam_area"), np.arange(len(low))
    begin = mapped(lambda leaf: leaf[low, lane], track)
    lower, upper = np.zeros(len(low)), times[low + 1, lane] - times[low, lane]
    at_lower, at_upper = value[low, lane], value[low + 1, lane]
    whole, crosses = upper, at_lower * at_upper < 0
    best, least, was_lower = lower, np.full(len(low), np.inf), np.full(len(low), -1)
    for _ in range(_MOST_TRIALS):
        with np.errstate(invalid="ignore", divide="ignore"):
            trial = (lower * at_upper - upper * at_lower) / (at_upper - at_lower)
        trial = np.where(np.isfinite(trial), np.clip(trial, lower, upper), lower)
        at_trial = area(frame.spin, bundle.constants, advanced(frame.spin, bundle, begin, trial))
        # Once at the zero, further trials move away from it again.
        best, least = np.where(np.abs(at_trial) < least, trial, best), np.fmin(np.abs(at_trial), least)
        is_lower = at_trial * at_lower > 0
        # The value at an end that stays a second time is halved.
        shrunk = np.where(is_lower == was_lower, 0.5, 1.0)
        at_upper = np.where(is_lower, shrunk * at_upper, at_trial)
        at_lower = np.where(is_lower, at_trial, shrunk * at_lower)
        was_lower = is_lower
        moved = np.minimum(trial - lower, upper - trial)
        lower, upper = np.where(is_lower, trial, lower), np.where(is_lower, upper, trial)
        if np.all((moved <= 1e-13 * whole) | (at_trial == 0) | ~crosses):
            break
    state = advanced(frame.spin, bundle, begin, best)
    points = places(frame, bundle, state, times[low, lane] + best, np.zeros(len(low), bool))
    further = advanced(frame.spin, bundle, state, _SLOPE_PART * whole)
    before, after = (area(frame.spin, bundle.constants, one) for one in (state, further))
    in_area, pace, clock_rate = kernel("doubt")(frame.spin, bundle, state)
    with np.errstate(invalid="ignore", divide="ignore"):
        zero_error = in_area * _SLOPE_PART * whole / np.abs(after - before)
        points["error"] += pace * zero_error
        # With that of the radius, which is not known beforehand: far out 1 / r changes in Mino time by 1.
        points["time_error"] += clock_rate * points["error"]
    return points
