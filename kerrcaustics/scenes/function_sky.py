"""A celestial sphere whose light is a function of the direction, averaged over the beams of pixels."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from kerrcaustics.scenes.colour import shifted_light
from kerrcaustics.scenes.footprint import DEVIATION, Footprint
from kerrcaustics.scenes.scene_checks import check_light_function, checked_light
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.shapes import Float, Int

Array = np.ndarray

# Largest number of points along each side of a footprint, a power of two.
_MOST_POINTS = 16
# Largest number of points in a call of a user's function.
_TOGETHER = 1 << 18


@dataclass(frozen=True, eq=False)
class FunctionSky(Sky):
    """A sky given by a function of the direction: a procedural texture, a model of the sky, a test pattern.

    Parameters
    ----------
    function : callable
        Of directions n' (m, 3), unit vectors: linear sRGB light (m, 3), finite and not negative.
    detail : float
        Angle (radians) over which it changes: the size of its smallest features.

    Raises
    ------
    ValueError
        If an argument is invalid; when the picture is made, if the function returns anything else.

    Errors
    ------
    A pixel gets the mean over a Gaussian with the deviations of its footprint, by points no further apart than
    `detail` along both axes, at most 16 along each: features finer than a sixteenth of a footprint appear as noise.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> stripes = kc.skies.FunctionSky(lambda n: np.repeat(0.5 + 0.5 * np.sin(40 * n[:, 2:]), 3, axis=1), detail=0.02)
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> kc.render(camera, kc.pictures.View.toward_hole(camera, 32, 18, 1.0), stripes).light.shape
    (18, 32, 3)
    """

    function: Callable[[Array], Any]
    detail: float

    def __post_init__(self) -> None:
        """Raise ValueError unless the arguments are valid."""
        check_light_function(self.function, "directions (m, 3)", self.detail, "angle")

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels."""
        light = means(np.stack(footprint.axes[:2], axis=-1) / self.detail, partial(self._mean, footprint))
        return light * shifted_light(footprint.redshift, beaming, colour_shift)

    def _mean(self, whole: Footprint, which: Int[Array, " m"], along: int, across: int) -> Float[Array, "m 3"]:
        """Means over along x across points of footprints, along both of their axes."""
        footprint = whole.part(which)
        major, minor, _ = footprint.axes
        first, normal = footprint.major_axis, footprint.direction
        second = np.cross(normal, first)
        u, v = (part.ravel() for part in np.meshgrid(_quantiles(along), _quantiles(across), indexing="ij"))
        sizes = DEVIATION * major[:, None] * u, DEVIATION * minor[:, None] * v
        offsets = sizes[0][..., None] * first[:, None] + sizes[1][..., None] * second[:, None]
        angle = np.linalg.norm(offsets, axis=-1, keepdims=True)
        places = np.cos(angle) * normal[:, None] + np.sinc(angle / np.pi) * offsets
        return checked_light(self.function, places.reshape(-1, 3)).reshape(len(normal), -1, 3).mean(axis=1)


def means(extents: Float[Array, "n 2"], mean: Callable[[Array, int, int], Float[Array, "m 3"]]) -> Float[Array, "n 3"]:
    """Light (n, 3) of parts with extents in units of the detail.

    mean: function of numbers of parts, and of numbers of points along both sides, that returns their mean light.
    """
    light, counts = np.empty((len(extents), 3)), 2 ** np.ceil(np.log2(np.clip(extents, 1, _MOST_POINTS))).astype(int)
    for first, second in np.unique(counts, axis=0).tolist():
        which = np.flatnonzero((counts == (first, second)).all(axis=1))
        for some in np.array_split(which, -(-len(which) * first * second // _TOGETHER)):
            light[some] = mean(some, first, second)
    return light


def _quantiles(count: int) -> Float[Array, " count"]:
    """Points of equal weight with the mean and the variance of a normal distribution."""
    if count == 1:
        return np.zeros(1)
    from scipy.special import ndtri

    points = ndtri((np.arange(count) + 0.5) / count)
    return points / points.std()
