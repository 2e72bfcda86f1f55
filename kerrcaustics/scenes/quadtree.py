"""A quadtree of square cells of a picture; corners have one number each, in sets that grow as cells are split."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from jaxtyping import Bool, Int

Array = np.ndarray
CornerSet = TypeVar("CornerSet", bound=tuple[Any, ...])


def merged(one: CornerSet, other: CornerSet) -> CornerSet:
    """Two sets of corners as one: named tuples of arrays, the first of which is the key, sorted."""
    key = np.concatenate([one[0], other[0]])
    order = np.argsort(key)
    return type(one)(*(np.concatenate(pair)[order] for pair in zip(one, other, strict=True)))


def find(keys: Int[Array, " n"], key: Int[Array, "*shape"]) -> tuple[Int[Array, "*shape"], Bool[Array, "*shape"]]:
    """Indices of keys among sorted ones, and the mask of those that are there."""
    if not len(keys):
        return np.zeros(key.shape, int), np.zeros(key.shape, bool)
    number = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
    return number, keys[number] == key


def in_chunks(values: Int[Array, " n"], most: Callable[[int], int]) -> list[Int[Array, " _m"]]:
    """Numbers of values that are equal, in chunks of at most so many."""
    chunks = []
    for value in np.unique(values):
        rows, step = np.flatnonzero(values == value), max(most(int(value)), 1)
        chunks += [rows[start : start + step] for start in range(0, len(rows), step)]
    return chunks


def fill(mask: Array, x: Int[Array, " n"], y: Int[Array, " n"], size: Int[Array, " n"], value: float) -> None:
    """Set the pixels of squares, as far as they lie in a picture."""
    corners = (np.maximum(corner, 0) for corner in (x, y, x + size, y + size))
    for left, top, right, below in zip(*corners, strict=True):
        mask[top:below, left:right] = value


class Squares(NamedTuple):
    """Square cells: upper left corners x, y (n,) on a lattice, and one size, the power of two that all of them have."""

    x: Int[Array, " n"]
    y: Int[Array, " n"]
    size: int

    @classmethod
    def over(cls, width: int, height: int, size: int) -> "Squares":
        """Those that cover a rectangle."""
        x, y = np.meshgrid(np.arange(-(-width // size)) * size, np.arange(-(-height // size)) * size)
        return cls(x.ravel(), y.ravel(), size)

    def quarters(self, chosen: Bool[Array, " n"]) -> "Squares":
        """Four cells in place of each of the chosen ones."""
        size = self.size // 2
        x, y = (
            np.concatenate([place[chosen] + step * size for step in steps])
            for place, steps in ((self.x, (0, 1, 0, 1)), (self.y, (0, 0, 1, 1)))
        )
        return Squares(x, y, size)
