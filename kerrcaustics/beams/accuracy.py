"""The use of errors: rays that are to be traced again, and by which engine."""

import numpy as np

from kerrcaustics.beams.ray_end import RayEnd

# The integrator is tried if this part of an error, or more, is round-off that it does not share: it gains a digit.
_MOSTLY = 0.9


def excess(ends: RayEnd[np.ndarray], tolerance: float, noises: float = 2) -> np.ndarray:
    """Errors, that of the time too, relative to the tolerance or, if larger, to `noises` times the round-off."""
    ratio = ends.error / np.maximum(tolerance, noises * _or_none(ends.noise))
    if ends.time is None or ends.time_error is None or ends.time_noise is None:
        return ratio
    limit = np.maximum(tolerance * np.maximum(1, np.abs(ends.time)), noises * ends.time_noise)
    return np.maximum(ratio, ends.time_error / limit)


def is_mostly_noise(ends: RayEnd[np.ndarray], tolerance: float) -> np.ndarray:
    """True if an error exceeds the tolerance by round-off of the engine; all engines share that of the direction."""
    unsure = (ends.error > tolerance) & (_or_none(ends.noise) > _MOSTLY * ends.error)
    if ends.time is None or ends.time_error is None or ends.time_noise is None:
        return unsure
    inaccurate_time = ends.time_error > tolerance * np.maximum(1, np.abs(ends.time))
    return unsure | inaccurate_time & (ends.time_noise > _MOSTLY * ends.time_error)


def _or_none(noise: np.ndarray | None) -> np.ndarray:
    """The round-off, or 0 if it is not recorded any more."""
    return np.zeros(()) if noise is None else noise
