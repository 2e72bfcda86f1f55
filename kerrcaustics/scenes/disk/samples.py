"""Samples of a disk in the parts of pixels, and the protocol of an emission."""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from kerrcaustics.shapes import Float, Int

Array = np.ndarray


class DiskSamples(NamedTuple):
    """Samples of a disk in n parts of pixels.

    radius (n,); azimuth (n,) in the pattern, which circles with the disk, or as it is for an emission that keeps its
    shape; across (n,), 0 at the inner rim and 1 at the outer one; matrix (n, 2, 2), dr and r dphi (rows) along the two
    sides of the part (columns); redshift (n,), nu_camera / nu_emitter, NaN where nothing can circle; width, from rim to
    rim; spin of the hole, negative where the disk is retrograde; time (n,), when the light left; orbital, dphi / dt at
    radii; opposite, a function of samples, which returns those of matter that circles the other way.
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


class Emission(Protocol):
    """The emission of a disk."""

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3), as intensity, toward the camera, averaged over the parts."""
        ...

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """Numbers of parts, in each direction, into which pixels must be divided for `light` to average well.

        low, high (n, 2): between which across and azimuth lie; size (n, 2), how far these go in a pixel.
        """
        ...
