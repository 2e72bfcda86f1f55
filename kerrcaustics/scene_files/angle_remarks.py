"""Remarks on the angles of a scene: degrees that may be radians, and steps that may have the wrong sense."""

from collections.abc import Iterator

import msgspec
import numpy as np

from kerrcaustics.choices import if_radians
from kerrcaustics.scene_files.camera_motion import Splined
from kerrcaustics.scene_files.contents import Contents
from kerrcaustics.shapes import Float
from kerrcaustics.toml_files import numbers_in

Array = np.ndarray

# Half a turn and a whole turn, degrees: a longer step than half a turn has a shorter one in the other sense.
_HALF, _WHOLE = 180.0, 360.0


def angle_remarks(contents: Contents, motion: object) -> Iterator[str]:
    """Lines on angles in the tables, in values at times, and along the camera's path."""
    for entry, number in numbers_in(msgspec.to_builtins(contents)):
        if entry.endswith("_deg") and (line := if_radians(entry, number)):
            yield line
    yield from azimuth_remarks(motion)
    for key in ("tilt_deg", "yaw_deg", "pitch_deg"):
        values = getattr(contents.view, key)
        if isinstance(values, tuple):
            rows = np.array([(at.time, at.value) for at in values])
            yield from _turns_back(f"view.{key}", rows[:, 0], rows[:, 1])


def azimuth_remarks(motion: object) -> Iterator[str]:
    """A line on the azimuths of a path through places, if a step between two of them may have the wrong sense."""
    if isinstance(motion, Splined):
        yield from _turns_back("camera.path: azimuth_deg", motion.times, np.degrees(motion.curve(motion.times)[:, 2]))


def _turns_back(entry: str, times: Float[Array, " n"], degrees: Float[Array, " n"]) -> Iterator[str]:
    """A line on the first step of more than half a turn; whole turns count as intended."""
    steps = np.diff(degrees)
    # The azimuths of a path have been radians.
    short = steps - _WHOLE * np.rint(steps / _WHOLE)
    wide = np.flatnonzero((np.abs(steps) > _HALF * (1 + 1e-12)) & (np.abs(short) > 1e-9))
    if len(wide):
        i = wide[0]
        first = f" It is the first of {len(wide)} such steps." if len(wide) > 1 else ""
        yield (
            f"{entry} goes from {degrees[i]:.6g} at t = {times[i]:.6g} to {degrees[i + 1]:.6g} at t = "
            f"{times[i + 1]:.6g}, through {abs(steps[i]):.6g} degrees: the short way round ends at "
            f"{degrees[i] + short[i]:.6g}.{first}"
        )
