"""Cells of a picture's map to the celestial sphere, with n' joined by coons_patches.py, and their pixels."""

from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.scenes.coons_patches import weights
from kerrcaustics.scenes.footprint import Footprint, widest_aspect
from kerrcaustics.scenes.quadtree import fill
from kerrcaustics.shapes import Bool, Float, Int

Array = np.ndarray

WIDE = 0.2
"""Angle (radians) of the sky above which cells are divided, and pixels are divided into two parts each way."""
# Angle (radians) of the sky above which pixels are divided into `PARTS`.
_WIDEST = 0.5
PARTS = 4
"""Parts each way of pixels that see a wide part of the sky, or lie on the shadow edge."""


class SkyCells(NamedTuple):
    """Square cells of a picture that see the celestial sphere.

    x, y: (n,) upper left corners, pixels.
    size: (n,) lengths of the sides, pixels.
    data: (n, 12, 3) n' and its derivatives at the corners, for `Patches`.
    curving: (n, 3, 3) second derivatives of n' along xx, xy and yy, per pixel^2.
    extent: (n,) angles of the sky that they see along a side, radians.
    error: (n,) estimated errors of the patches, pixels.
    rates: (n, 12, 3) changes of the data over an exposure; (n, 0, 3) if nothing moves.
    """

    x: Array
    y: Array
    size: Array
    data: Array
    curving: Array
    extent: Array
    error: Array
    rates: Array

    @property
    def moving(self) -> bool:
        """True if they change while the picture is exposed."""
        return self.rates.shape[1] > 0

    def at_moment(self, moment: float) -> "SkyCells":
        """Return the cells at a moment of the exposure, from -1/2 to 1/2."""
        return self._replace(data=self.data + moment * self.rates) if self.moving else self

    def pixels_moved(self, turn: float) -> Float[Array, " n"]:
        """Motion (n,) of the sky in their middles, pixels, over an exposure in which it turns by an angle."""
        columns = self.size, self.data.reshape(-1, 36), self.curving.reshape(-1, 9)
        scale, middle = kernel("cell_scale").on_rays((), columns)
        motion = turn * turning(middle)
        if self.moving:
            motion -= np.einsum("nkc,k->nc", self.rates, weights(0.5, 0.5, 0.0, 1).value[:, 0])
        return pixels(scale, motion[:, None])[:, 0]


def turning(direction: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    """Displacements (..., 3), per radian, of directions that turn about the spin axis."""
    x, y, _ = np.moveaxis(direction, -1, 0)
    return np.stack([-y, x, np.zeros_like(x)], axis=-1)


def pixels(scale: Float[Array, "n 2 3"], miss: Float[Array, "n k 3"]) -> Float[Array, "n k"]:
    """Displacements (n, k) on the picture by errors (n, k, 3) of n', by scales of map_formulas.py."""
    along, across = (np.einsum("nj,nkj->nk", scale[:, row], miss) for row in range(2))
    return np.asarray(np.hypot(along, across))


def parts_of(cells: SkyCells) -> Int[Array, " n"]:
    """Numbers of parts, each way, into which pixels are divided, as the map of a beam is linear only close to it."""
    return parts_for(cells.extent)


def resolved(cells: SkyCells, extent: float) -> Bool[Array, " n"]:
    """True for cells (n,) whose pixels see less of the sky than an extent, and need no division."""
    return (cells.extent < extent * cells.size) & (parts_of(cells) == 1)


def parts_for(extent: Float[Array, " n"]) -> Int[Array, " n"]:
    """Numbers of parts, each way, into which pixels that see an angle (n,) of the sky, radians, are divided."""
    return np.where(extent < WIDE, 1, np.where(extent < _WIDEST, 2, PARTS))


class CellPlaces(NamedTuple):
    """Equal squares within pixels.

    x, y: (m,) middles, pixels.
    cell: (m,) numbers of the cells that contain them.
    side: length of the sides, pixels.
    """

    x: Array
    y: Array
    cell: Array
    side: float

    @classmethod
    def pixel_parts(cls, pixel: Int[Array, " n"], covering: Int[Array, "h w"], parts: int) -> "CellPlaces":
        """All parts x parts squares of pixels, by their numbers in reading order, pixel by pixel."""
        within = (np.arange(parts) + 0.5) / parts - 0.5
        y, x = (place[:, None, None] for place in np.divmod(pixel, covering.shape[1]))
        x, y, cell = np.broadcast_arrays(x + within, y + within[:, None], covering.ravel()[pixel][:, None, None])
        return cls(x.ravel(), y.ravel(), cell.ravel(), 1 / parts)


class Patches:
    """The patches of cells, as kernels read them."""

    def __init__(self, cells: SkyCells, data: Float[Array, "n 12 3"] | None = None) -> None:
        """Parameters: data, in place of the data of the cells."""
        columns = [
            part.reshape(-1, size) for part, size in ((cells.data if data is None else data, 36), (cells.curving, 9))
        ]
        table = kernel("cell_polynomials").on_rays((), (cells.x, cells.y, cells.size, *columns))
        # Kernels need tables with a row; without cells it is never read.
        self._table = table if len(table) else np.zeros((1, table.shape[1]))

    def values(self, places: CellPlaces) -> Float[Array, "m 3"]:
        """The values (m, 3) of the patches."""
        return np.asarray(kernel("drift").on_rays((), places[:3], tables=[self._table]))

    def footprint(self, places: CellPlaces, redshift: Float[Array, " m"]) -> Footprint:
        """The footprints of squares, as linear images of them, widened by `widest_aspect`."""
        numbers = places.side, widest_aspect(places.side)
        direction, matrix, bend = kernel("square_footprint").on_rays(numbers, places[:3], tables=[self._table])
        return Footprint(direction, matrix, bend, redshift)


def covering_cells(cells: SkyCells, shape: tuple[int, int]) -> Int[Array, "h w"]:
    """The number of the cell that covers each pixel of a picture; -1 without one."""
    covering = np.full(shape, -1, np.int32)
    fill(covering, cells.x, cells.y, cells.size, np.arange(len(cells.x), dtype=np.int32))
    return covering


def covered_pixels(covering: Int[Array, "h w"], which: Bool[Array, " n"]) -> Int[Array, " m"]:
    """Pixels that some cells cover, by their numbers in reading order."""
    # Pixels without a cell have the number -1, which selects the appended False.
    return np.flatnonzero(np.append(which, False)[covering.ravel()]).astype(np.int32)
