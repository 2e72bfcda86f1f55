"""Cells of a picture's map to the celestial sphere, with n' joined by coons_patches.py, and their pixels."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.scenes.coons_patches import weights
from kerrcaustics.scenes.footprint import bend, major_axis, singular_values
from kerrcaustics.scenes.quadtree import in_chunks
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.sphere import polar_basis

Array = np.ndarray

# Cells that see more of the sky than this (radians) are divided, pixels that do into two parts each way, and those
# that see more than that, or lie on the shadow edge, into more.
WIDE, _WIDEST, PARTS = 0.2, 0.5, 4
# Pixels whose places are worked out together: they fit in a core's cache.
_TOGETHER = 1 << 15


class SkyCells(NamedTuple):
    """Square cells of a picture that see the celestial sphere.

    x, y (n,): upper left corner, pixels; size (n,); data (n, 12, 3), n' for `patches`; curving (n, 3, 3), the second
    derivatives of n' along xx, xy and yy; error (n,): that of the patch, estimated, in pixels; rates
    (n, 12, 3): how the data change over an exposure, (n, 0, 3) where nothing moves.
    """

    x: Array
    y: Array
    size: Array
    data: Array
    curving: Array
    error: Array
    rates: Array

    @property
    def moving(self) -> bool:
        """True if they change while the picture is exposed."""
        return self.rates.shape[1] > 0

    def at(self, moment: float) -> "SkyCells":
        """Return the cells at a moment of the exposure, from -1/2 to 1/2."""
        return self._replace(data=self.data + moment * self.rates) if self.moving else self

    def pixels_moved(self, turn: float) -> Float[Array, " n"]:
        """Motion (n,) of the sky in their middles, pixels, over an exposure in which it turns by an angle."""
        scale = CellScale(self.data, self.curving, self.size)
        motion = turn * turning(scale.middle)
        if self.moving:
            motion -= np.einsum("nkc,k->nc", self.rates, weights(0.5, 0.5, 0.0, 1).value[:, 0])
        return scale.pixels(motion)


def turning(direction: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    """Displacements (..., 3), per radian, of directions that turn about the spin axis."""
    x, y, _ = np.moveaxis(direction, -1, 0)
    return np.stack([-y, x, np.zeros_like(x)], axis=-1)


class CellScale:
    """The maps in the middles of cells, to turn errors of n' into pixels."""

    def __init__(self, data: Float[Array, "n 12 3"], curving: Float[Array, "n 3 3"], size: Any) -> None:
        """Parameters as in `SkyCells`."""
        where = weights(0.5, 0.5, 0.0, 1)
        value, *columns = (
            np.einsum("nkc,k->nc", data, part[:, 0]) for part in (where.value, where.along_x, where.along_y)
        )
        self.middle = value / np.linalg.norm(value, axis=-1, keepdims=True)
        basis = np.stack(polar_basis(self.middle), axis=-2)
        matrix = basis @ np.stack(columns, axis=-1) / np.reshape(size, (-1, 1, 1))
        self._major, minor, angle = singular_values(matrix)
        axis = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
        self._along = (axis @ basis)[:, 0]
        self._across = np.cross(self.middle, self._along)
        # A pixel on a critical curve is folded over a strip of the sky: there an error counts by its width.
        self._minor = np.hypot(np.minimum(minor, _least_minor(data) / size), bend(curving, self._across))

    def pixels(self, miss: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Displacements (n,) on the picture by errors (n, 3) of n'."""
        along, across = (np.vecdot(miss, axis) for axis in (self._along, self._across))
        return np.hypot(along / self._major, across / self._minor)


def _least_minor(data: Float[Array, "n 12 3"]) -> Float[Array, " n"]:
    """The smallest minor axis (n,) at the corners, for the whole cell; 0 where a critical curve passes between."""
    first, second = data[:, 4:8], data[:, 8:]
    area = np.vecdot(np.cross(first, second), data[:, :4])
    minor = area / major_axis(first, second)[0]
    return np.where(minor.min(axis=1) * minor.max(axis=1) > 0, np.abs(minor).min(axis=1), 0.0)


def parts_of(cells: SkyCells) -> Int[Array, " n"]:
    """Numbers of parts, each way, into which pixels are divided: the linear map of a beam does not reach far."""
    return parts_for(extent_of(cells))


def extent_of(cells: SkyCells) -> Float[Array, " n"]:
    """Angles (n,) of the sky, radians, that cells see along a side."""
    return np.asarray(np.sqrt((cells.data[:, 4:] ** 2).sum(axis=-1)).max(axis=1))


def resolved(cells: SkyCells, extent: float) -> Bool[Array, " n"]:
    """True for cells (n,) whose pixels see less of the sky than an extent, and are not to be divided."""
    return (extent_of(cells) < extent * cells.size) & (parts_of(cells) == 1)


def parts_for(extent: Float[Array, " n"]) -> Int[Array, " n"]:
    """Numbers of parts, each way, into which pixels that see so much of the sky (n,), radians, are divided."""
    return np.where(extent < WIDE, 1, np.where(extent < _WIDEST, 2, PARTS))


class Pixels(NamedTuple):
    """Squares of a picture.

    place x, y (2, m), pixels; side; direction n' (3, m), and its steps along x and y (2, 3, m); cell (m,).
    """

    place: Array
    side: float
    direction: Array
    steps: Array
    cell: Array


def places(cells: SkyCells, which: Int[Array, " n"], parts: int) -> Iterator[Pixels]:
    """All pixels of some cells, each in parts x parts squares, some at a time."""
    for rows in in_chunks(cells.size[which], lambda size: _TOGETHER // (size * parts) ** 2):
        yield _places(cells, which[rows], parts)


def _places(cells: SkyCells, which: Int[Array, " n"], parts: int) -> Pixels:
    count = int(cells.size[which[0]]) * parts
    where = weights(0.0, 0.0, 1.0, count)
    within = (np.arange(count) + 0.5) / parts - 0.5
    x = np.broadcast_to(cells.x[which, None, None] + within, (len(which), count, count))
    y = np.broadcast_to(cells.y[which, None, None] + within[:, None], (len(which), count, count))
    data = np.moveaxis(cells.data[which], -1, 0)
    direction, along_x, along_y = ((data @ part).reshape(3, -1) for part in (where.value, where.along_x, where.along_y))
    direction /= np.sqrt((direction**2).sum(axis=0))
    steps = np.stack([along_x, along_y]) / count
    return Pixels(np.stack([x.ravel(), y.ravel()]), 1 / parts, direction, steps, np.repeat(which, count * count))
