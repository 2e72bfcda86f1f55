"""Samples of a disk in the parts of pixels, and the base class of all emissions."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.scenes.scene_checks import checked_source_light
from kerrcaustics.scenes.sky import Shifts
from kerrcaustics.shapes import Float, Int

Array = np.ndarray


# Largest part of a pixel on the disk: relative to its width, and in azimuth, radians.
_LARGEST_PART = np.array([0.02, 0.1])
# Largest number of parts in each direction.
_MOST_PARTS = 16


class DiskSamples(NamedTuple):
    """Samples of a disk in n parts of pixels, as the method `light` of an emission gets them.

    radius: (n,) radii.
    azimuth: (n,) azimuths in the pattern, which circles with the disk; those at which light leaves, for `keeps_shape`.
    across: (n,) places between the rims: 0 at the inner one, 1 at the outer one.
    matrix: (n, 2, 2) changes dr and r dphi (rows) along the two sides of the part (columns).
    redshift: (n,) ratios nu_camera / nu_emitter, NaN if the motion is impossible.
    width: distance from rim to rim.
    spin: spin of the hole, negative where the disk is retrograde.
    time: (n,) coordinate times at which the light left.
    orbital: function of radii, dphi / dt of the disk's matter there.
    opposite: function of samples that returns those for the opposite motion.
    """

    radius: Array
    azimuth: Array
    across: Array
    matrix: Array
    redshift: Array
    width: float
    spin: float
    time: Array
    orbital: Callable[[Array], Array]
    opposite: Callable[[Any], Any] = lambda samples: samples

    def box(self) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Half sides (n,), along across and azimuth, of the box with the deviations of the part."""
        across, along = (np.sqrt(row[:, 0] ** 2 + row[:, 1] ** 2) / 2 for row in np.moveaxis(self.matrix, 1, 0))
        return across / self.width, along / self.radius


class Emission(ABC):
    """The emission of a disk: the base class of everything that makes a disk shine.

    A subclass has a method `light`; the other members are optional.

    Attributes
    ----------
    keeps_shape : bool
        True for a pattern with a motion of its own: `samples.azimuth` is the azimuth at which light leaves the disk.
        False for a pattern that circles with the matter: the azimuth is that of the matter at time 0.
    symmetric : bool
        True if the light is the same at all azimuths: nothing on the disk then moves during an exposure.

    Raises
    ------
    ValueError
        When the picture is made, if `light` returns anything else.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> class Glow(kc.disks.Emission):
    ...     symmetric = True
    ...     def light(self, samples, beaming, colour_shift):
    ...         return np.repeat(samples.radius[:, None] ** -3.0, 3, axis=1)
    >>> kc.disks.Disk(6.0, 20.0, Glow()).opaque
    True
    """

    keeps_shape: bool = False
    symmetric: bool = False

    @abstractmethod
    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3) toward the camera, averaged over parts of pixels.

        Parameters
        ----------
        samples : DiskSamples
            Samples of the disk in the parts.
        beaming : bool
            Multiply the intensity by the fourth power of `samples.redshift`.
        colour_shift : bool
            Shift spectra by `samples.redshift`.

        Returns
        -------
        (n, 3) array
            Intensity in any unit, finite and not negative. If the redshift is NaN, a shifted intensity is ignored: the
            disk is dark there.
        """

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """Numbers of parts, in each direction, into which pixels must be divided for `light` to average well.

        Two, or more for pixels that see much of the disk.

        Parameters
        ----------
        low, high : (n, 2) arrays
            Limits of across (0 at the inner rim, 1 at the outer one) and azimuth (radians) in each pixel.
        size : (n, 2) array
            Their changes over a pixel.

        Returns
        -------
        (n,) array of int
            Powers of two up to 16.
        """
        return np.maximum(smooth_parts(size), 2)

    def own_opacity(self, inner: Any, outer: float) -> Any:
        """The default opacity of a disk with these rims; None for an opaque disk."""
        return None


def smooth_parts(size: Float[Array, "n 2"]) -> Int[Array, " n"]:
    """Numbers of parts (n,) of pixels in each direction, so that each sees little of the disk; size as for `parts`.

    A part is a linear image, with one ratio of frequencies.
    """
    needed = (size / _LARGEST_PART).max(axis=1)
    return (2 ** np.ceil(np.log2(np.clip(needed, 1, _MOST_PARTS)))).astype(int)


def emitted_light(emission: Emission, samples: DiskSamples, shifts: Shifts) -> Float[Array, "n 3"]:
    """The light (n, 3) of an emission; ValueError if its method `light` returns no light.

    Shifted light is 0 where the motion of the disk is impossible.
    """
    light = emission.light(samples, *shifts)
    if any(shifts) and np.shape(light) == (len(samples.radius), 3):
        light = np.where(np.isfinite(samples.redshift)[:, None], light, 0.0)
    return checked_source_light("emission", emission, light, len(samples.radius))
