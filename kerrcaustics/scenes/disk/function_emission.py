"""Emission of disks by a function of the place, averaged over the parts of pixels."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from kerrcaustics.scenes.colour import shifted_light
from kerrcaustics.scenes.disk.samples import DiskSamples, Emission, smooth_parts
from kerrcaustics.scenes.function_sky import means
from kerrcaustics.scenes.scene_checks import check_light_function, checked_light
from kerrcaustics.shapes import Float, Int

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class FunctionEmission(Emission):
    """Light by a function of radius and azimuth: a procedural texture, a model, a test pattern.

    Parameters
    ----------
    function : callable
        Of radii (m,) and azimuths (m,), which circle with the disk: linear sRGB light (m, 3), finite and not negative.
    detail : float
        Length, in units of the mass, over which it changes: the size of its smallest features.

    Raises
    ------
    ValueError
        If an argument is invalid; when the picture is made, if the function returns anything else.

    Errors
    ------
    A part of a pixel has the mean over its image on the disk, by points no further apart than `detail` along both
    sides, at most 16 along each. Features finer than a sixteenth of a part appear as noise.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> spiral = lambda r, phi: np.repeat(1 + np.cos(2 * phi - 4 * np.log(r))[:, None], 3, axis=1)
    >>> kc.disks.Disk(6.0, 20.0, kc.disks.FunctionEmission(spiral, detail=1.0)).outer
    20.0
    """

    function: Callable[[Array, Array], Any]
    detail: float

    def __post_init__(self) -> None:
        """Raise ValueError unless the arguments are valid."""
        check_light_function(self.function, "radii and azimuths (m,)", self.detail, "length")

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3); for a shift of colours it has the spectrum of daylight."""
        light = means(np.linalg.norm(samples.matrix, axis=1) / self.detail, partial(self._mean, samples))
        return light * shifted_light(samples.redshift, beaming, colour_shift)

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """One, whose light is the mean over points in it, or more for pixels that see much of the disk."""
        return smooth_parts(size)

    def _mean(self, samples: DiskSamples, which: Int[Array, " m"], first: int, second: int) -> Float[Array, "m 3"]:
        """Means over first x second points of parts of pixels."""
        places = np.stack([part.ravel() for part in np.meshgrid(_middles(first), _middles(second), indexing="ij")])
        across, along = np.moveaxis(samples.matrix[which] @ places, 1, 0)
        # Points beyond a rim count as on the rim: the coverage of the part is known separately.
        inner = samples.radius[which] - samples.across[which] * samples.width
        radius = np.clip((samples.radius[which, None] + across).T, inner, inner + samples.width).T
        azimuth = samples.azimuth[which, None] + along / samples.radius[which, None]
        light = checked_light(self.function, radius.ravel(), azimuth.ravel())
        return light.reshape(len(which), -1, 3).mean(axis=1)


def _middles(count: int) -> Float[Array, " count"]:
    """Middles of equal pieces of a side of 1 about 0."""
    return (np.arange(count) + 0.5) / count - 0.5
