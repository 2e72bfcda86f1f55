"""Pictures of a sky itself, with no hole."""

import math

import numpy as np

from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.points import draw_points
from kerrcaustics.scenes.sky import UNSHIFTED, Sky, check_sky, light_of_sky
from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import flags, whole_number
from kerrcaustics.spacetime.sphere import from_angles, polar_angle

Array = np.ndarray


@usual_warnings
def celestial_picture(sky: Sky, height: int, *, mirror: bool = False) -> Float[Array, "height 2*height 3"]:
    """Light (height, 2 height, 3) of a sky itself, with no hole, as a photograph of it: a `Panorama` of it is this sky.

    The north pole is above, and phi' grows to the left, from 0 at the right edge to 2 pi at the left one.

    Parameters
    ----------
    sky : Sky
    height : int
        Rows of the picture, 2 to 8192.
    mirror : bool
        True for a chart, on which phi' grows to the right; also the `mirror` of its `Panorama`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.skies.celestial_picture(kc.skies.Checkerboard(), 90).shape
    (90, 180, 3)
    """
    check_sky(sky, needed=True)
    flags(mirror=mirror)
    height = whole_number("height", height, 2, 8192)
    pixel = math.pi / height
    theta = (np.arange(height) + 0.5)[:, None] * pixel
    phi = (np.arange(2 * height) + 0.5) * pixel
    direction = from_angles(theta, phi).reshape(-1, 3)
    matrix = np.zeros((len(direction), 2, 2))
    matrix[:, 0, 0] = pixel
    matrix[:, 1, 1] = pixel * np.repeat(np.sin(theta[:, 0]), 2 * height)
    footprint = Footprint(direction, matrix, np.zeros(len(direction)), np.ones(len(direction)))
    light = light_of_sky(sky, footprint, UNSHIFTED).reshape(height, 2 * height, 3)
    points = sky.points
    if points is not None:
        x, y, _ = points.direction.T
        turn, down = np.arctan2(y, x) % (2 * math.pi), polar_angle(points.direction)
        # Rows of a picture that looks outward: its columns may run to either side.
        whole = View(2 * height, height, 2 * math.pi, "equirectangular")
        draw_points(light, whole, np.stack([turn, down], axis=-1) / pixel - 0.5, points.flux)
    return light if mirror else light[:, ::-1]
