"""Footprints: the parts of the celestial sphere that the beams of pixels cover, and averages over them."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.sphere import polar_basis, tangent_basis

Array = np.ndarray

LONGEST = 1.0
"""Axis at which footprints are cut, radians: the map of a beam is not linear that far."""
DEVIATION = 0.5
"""Standard deviation of a pixel's filter along each side, pixels: that of a box convolved with a tent."""
ASPECT = 16.0
"""Ratio of the axes above which footprints are widened, for skies with detail."""


@result("footprint/1")
class Footprint(Shown):
    """Parts of the celestial sphere that n pixels see."""

    direction: Array = quantity("pixel axis", "1", "n' of the middle")
    matrix: Array = quantity(
        "pixel end_axis pixel_axis",
        "rad",
        "displacements along e_theta', e_phi' (rows) per pixel along x and y (columns)",
        json="matrix_rad",
    )
    bend: Array = quantity(
        "pixel",
        "rad",
        "spread of the beam's neighbours that the matrix does not describe, along the minor axis",
        json="bend_rad",
    )
    redshift: Array = quantity("pixel", "1", "nu_camera / nu_source, 1 where light is not shifted")

    def __len__(self) -> int:
        """Number of pixels."""
        return len(self.direction)

    def part(self, which: slice | Array) -> "Footprint":
        """The footprints of some of the pixels."""
        return Footprint(self.direction[which], self.matrix[which], self.bend[which], self.redshift[which])

    def turned_by(self, angle: float) -> "Footprint":
        """The footprints turned about the spin axis: their ellipses, along e_theta' and e_phi', turn with them."""
        return replace(self, direction=rotated_about_axis(self.direction, angle))

    @cached_property
    def axes(self) -> tuple[Float[Array, " pixels"], Float[Array, " pixels"], Float[Array, " pixels"]]:
        """Major and minor axis (n,), radians for one pixel, and the angle (n,) from e_theta' to the major one.

        Singular values of the matrix; the minor axis with the bend, both cut at `LONGEST`.
        """
        major, minor, angle = singular_values(self.matrix)
        return np.minimum(major, LONGEST), np.minimum(_length(minor, self.bend), LONGEST), angle

    @property
    def major_axis(self) -> Float[Array, "pixels 3"]:
        """Unit tangents (n, 3) of the celestial sphere along the major axes."""
        e_theta, e_phi = polar_basis(self.direction)
        angle = self.axes[2][:, None]
        return e_theta * np.cos(angle) + e_phi * np.sin(angle)


def widest_aspect(side: float) -> float:
    """The ratio of the axes beyond which footprints of parts of pixels with a side are widened.

    Footprints of whole pixels are not widened here, but by the skies.
    """
    return ASPECT * side if side < 1 else np.inf


def rotated_about_axis(vectors: Float[Array, "*batch 3"], angle: ArrayLike) -> Float[Array, "*batch 3"]:
    """Vectors (..., 3) turned about the spin axis toward larger phi' by angles (...,), or by one angle."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)


def bend(curving: Float[Array, "n 3 3"], across: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """Contribution of second derivatives (n, 3, 3) along xx, xy, yy to a footprint's minor axis, along `across`.

    A pixel on a critical curve has a minor axis of zero, but its neighbourhood is folded over a strip of the sky. With
    second derivatives H along the minor axis and a deviation of 1/2 pixel, the deviation of x H x / 2 is
    |H| / (4 sqrt 2), as for a minor axis of |H| / sqrt 8.
    """
    xx, xy, yy = ((curving[:, k] * across).sum(axis=-1) for k in range(3))
    return np.sqrt((xx**2 + 2 * xy**2 + yy**2) / 8)


def singular_values(
    matrix: Float[Array, "*batch 2 2"],
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"], Float[Array, "*batch"]]:
    """Larger and smaller singular value of matrices (..., 2, 2), and the angle of the larger one's axis."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    even, odd = _length(a + d, c - b), _length(a - d, c + b)
    angle = np.arctan2(c - b, a + d) + np.arctan2(c + b, a - d)
    return (even + odd) / 2, np.abs(even - odd) / 2, angle / 2


def _length(x: Float[Array, "*shape"], y: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    # Nothing overflows; this is ten times as fast as `hypot`.
    return np.sqrt(x * x + y * y)


def major_axis(
    first: Float[Array, "*batch 3"], second: Float[Array, "*batch 3"]
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch 3"]]:
    """Length (...,) of the major axis of the ellipse that steps (..., 3) along x and y span, and its unit vector."""
    a, b, c = _products(first, second)
    length = longest(first, second)
    turn = np.arctan2(2 * b, a - c) / 2
    return length, (first * np.cos(turn)[..., None] + second * np.sin(turn)[..., None]) / length[..., None]


def longest(first: Float[Array, "*batch 3"], second: Float[Array, "*batch 3"]) -> Float[Array, "*batch"]:
    """Length (...,) of the major axis of the ellipse that steps (..., 3) along x and y span."""
    a, b, c = _products(first, second)
    return np.asarray(np.sqrt((a + c + _length(a - c, 2 * b)) / 2))


def _products(first: Float[Array, "*batch 3"], second: Float[Array, "*batch 3"]) -> tuple[Array, Array, Array]:
    return np.vecdot(first, first), np.vecdot(first, second), np.vecdot(second, second)


def inverse(first: Float[Array, "n 3"], second: Float[Array, "n 3"]) -> Float[Array, "n 2 3"]:
    """Inverses (n, 2, 3), by least squares, of matrices with two columns."""
    a, b, c = (product[:, None] for product in _products(first, second))
    rows = np.stack([c * first - b * second, a * second - b * first], axis=1)
    return np.asarray(rows / np.maximum(a * c - b * b, 1e-300)[..., None])


def pixel_matrix(
    beams: Beams, sky: Float[Array, "*batch 3"], steps: Float[Array, "*batch 3 2"]
) -> Float[Array, "*batch 2 2"]:
    """Matrices (..., 2, 2) of the footprints of pixels with directions N (..., 3) and steps (..., 3, 2)."""
    basis = np.stack(tangent_basis(sky), axis=-2)
    return beams.jacobian @ (basis @ steps)


def averaged(
    sky: str,
    numbers: Sequence[float],
    tables: Sequence[Array],
    footprint: Footprint,
    finest: float,
    aspect: float = ASPECT,
    longest: float = LONGEST,
) -> Float[Array, "pixels channels"]:
    """Light (n, channels) of a sky, averaged over footprints by probes along their major axes.

    Parameters
    ----------
    sky : str
        Name of a kernel of sky_formulas.py.
    numbers, tables : sequence
        Numbers and tables of the sky, as in its formula.
    footprint : Footprint
    finest : float
        Size (radians) below which the sky has no detail.
    aspect : float
        Ratio of the axes beyond which footprints are widened: they would need too many probes.
    longest : float
        Length (radians) at which axes are cut.
    """
    columns = footprint.direction, footprint.matrix.reshape(-1, 4), footprint.bend
    return kernel(sky).on_rays((*numbers, finest, aspect, longest, DEVIATION), columns, tables=tables)
