"""The forward and the upward direction of a camera's picture."""

import math
from collections.abc import Sequence

import numpy as np

from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_line_of_sight

Array = np.ndarray

# Sine of the angle below which two directions are parallel.
_SAME = 1e-9


def axes_of(
    camera: Camera, look: str | tuple[float, float, float], turns: Sequence[float]
) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Directions N forward and up.

    Parameters
    ----------
    camera : Camera
    look : str or (float, float, float)
        "hole", the middle of the shadow; "forward", where the camera moves to, and along e_phi when it is at rest; or a
        direction (r, theta, phi) of the fiducial observer, as it would look without aberration at rest.
    turns : (3,)
        Degrees: roll, clockwise as the camera sees it; yaw, to the right; pitch, upward. Yaw is first, roll last.
    """
    up = -np.asarray(camera.frame().basis)[:, 1]
    if look == "hole":
        forward = View.toward_hole(camera, 2, 2, 1.0).forward
    elif look == "forward":
        forward = np.array([0.0, -1.0 if camera.frame().speed < 0 else 1.0, 0.0])
    else:
        forward = sky_from_line_of_sight(camera.frame(), np.asarray(look, float) / np.linalg.norm(look))
    return _turned_axes(forward, up, *(math.radians(turn) for turn in turns))


def _turned_axes(forward: Array, up: Array, roll: float, yaw: float, pitch: float) -> tuple[Array, Array]:
    up = up - (up @ forward) * forward
    if np.linalg.norm(up) < _SAME:
        # Along the spin axis the upward direction is arbitrary.
        up = np.cross(forward, [0.0, 1.0, 0.0])
    up = up / np.linalg.norm(up)
    right = np.cross(forward, up)
    forward, right = math.cos(yaw) * forward + math.sin(yaw) * right, math.cos(yaw) * right - math.sin(yaw) * forward
    forward, up = math.cos(pitch) * forward + math.sin(pitch) * up, math.cos(pitch) * up - math.sin(pitch) * forward
    return forward, math.cos(roll) * up + math.sin(roll) * right
