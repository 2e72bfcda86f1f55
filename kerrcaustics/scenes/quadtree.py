"""A quadtree of square cells of a picture, whose corners are shared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.scenes.coons_patches import CORNERS
from kerrcaustics.shapes import Bool, Int, Real

Array = np.ndarray
CornerSet = TypeVar("CornerSet", bound=tuple[Any, ...])
Cells = TypeVar("Cells", bound=tuple[Any, ...])


def joined(parts: Sequence[Cells]) -> Cells:
    """Named tuples of arrays, concatenated."""
    return type(parts[0])(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def merged(first: CornerSet, second: CornerSet) -> CornerSet:
    """Two sets of corners merged: named tuples of arrays, sorted by the first one, the key."""
    corners = joined([first, second])
    order = np.argsort(corners[0])
    return type(first)(*(part[order] for part in corners))


def find(keys: Int[Array, " n"], key: Int[Array, "*shape"]) -> tuple[Int[Array, "*shape"], Bool[Array, "*shape"]]:
    """Indices of keys among sorted keys, and the mask of those that occur."""
    if not len(keys):
        return np.zeros(key.shape, int), np.zeros(key.shape, bool)
    number = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
    return number, keys[number] == key


def in_chunks(values: Real[Array, " n"], most: Callable[[int], int]) -> list[Int[Array, " _m"]]:
    """Numbers of equal values, in chunks; most: function of a value that returns the largest size of a chunk."""
    chunks = []
    for value in np.unique(values):
        rows, step = np.flatnonzero(values == value), max(most(int(value)), 1)
        chunks += [rows[start : start + step] for start in range(0, len(rows), step)]
    return chunks


def fill(mask: Array, x: Int[Array, " n"], y: Int[Array, " n"], size: Int[Array, " n"], value: ArrayLike) -> None:
    """Set the pixels of squares within a picture to values (n,), or to one value."""
    # Pixels outside are written to a margin.
    whole, values = np.pad(mask, 1), np.broadcast_to(value, x.shape)
    for side_length in np.unique(size):
        same = np.flatnonzero(size == side_length)
        rows, columns = (
            np.clip(place[same, None] + np.arange(side_length), -1, side) + 1
            for place, side in zip((y, x), mask.shape, strict=True)
        )
        whole[rows[:, :, None], columns[:, None, :]] = values[same, None, None]
    mask[:] = whole[1:-1, 1:-1]


class Squares(NamedTuple):
    """Square cells of one size.

    x, y: (n,) upper left corners on a lattice.
    size: length of the sides, a power of two.
    """

    x: Int[Array, " n"]
    y: Int[Array, " n"]
    size: int

    @classmethod
    def over(cls, width: int, height: int, size: int) -> "Squares":
        """Squares that cover a rectangle."""
        x, y = np.meshgrid(np.arange(-(-width // size)) * size, np.arange(-(-height // size)) * size)
        return cls(x.ravel(), y.ravel(), size)

    def quarters(self, chosen: Bool[Array, " n"]) -> "Squares":
        """The four quarters of each of the chosen cells."""
        size = self.size // 2
        x, y = (
            np.concatenate([place[chosen] + step * size for step in steps])
            for place, steps in ((self.x, (0, 1, 0, 1)), (self.y, (0, 0, 1, 1)))
        )
        return Squares(x, y, size)


@dataclass(frozen=True)
class Level(Generic[CornerSet]):
    """Cells of one size in a division.

    squares: the cells.
    corners: all corners so far.
    number: (n, 4) numbers of the cells' own corners.
    """

    squares: Squares
    corners: CornerSet
    number: Int[Array, "n 4"]

    def beside(self, chosen: Bool[Array, " n"]) -> Bool[Array, " n"]:
        """True for cells that share a corner with a chosen cell."""
        near = np.zeros(len(self.corners[0]), bool)
        near[self.number[chosen]] = True
        return np.asarray(near[self.number].any(axis=1))


@dataclass(frozen=True)
class Division(Generic[CornerSet, Cells]):
    """Rules for the division of cells.

    columns: a number larger than that of corners from left to right.
    trace: function of keys that returns the corners.
    accept: function of a level that returns its good cells, and the mask of the cells to divide.
    least: smallest size of a cell.
    select: function of squares that returns those to examine.
    """

    columns: int
    trace: Callable[[Array], CornerSet]
    accept: Callable[[Level[CornerSet]], tuple[Cells, Array]]
    least: int = 1
    select: Callable[[Squares], Squares] = lambda squares: squares

    def divide(self, squares: Squares, corners: CornerSet) -> tuple[Cells, Level[CornerSet], Bool[Array, " n"]]:
        """Good cells, and the last level, with the mask of its cells that are not good."""
        good, squares = [], self.select(squares)
        while True:
            x, y, size = squares
            keys = np.stack([(y + j * size) * self.columns + x + i * size for i, j in CORNERS], axis=-1)
            # Several times as fast as `unique`.
            new = np.sort(keys, axis=None)
            new = new[np.diff(new, prepend=-1) != 0]
            new = new[~find(corners[0], new)[1]]
            corners = merged(corners, self.trace(new)) if len(new) else corners
            level = Level(squares, corners, find(corners[0], keys)[0])
            cells, split = self.accept(level)
            good.append(cells)
            if size <= self.least or not split.any():
                return joined(good), level, split
            squares = self.select(squares.quarters(split))
