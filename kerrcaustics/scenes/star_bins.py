"""Bins of stars, for the stars that may lie in discs on the sphere: rows of equal height, divided by azimuth."""

import math
from typing import NamedTuple

import numpy as np

from kerrcaustics.shapes import Float, Int

Array = np.ndarray

# Number of rows, in units of the square root of the number of stars.
_ROWS = 0.7
# Number of bins in a row, in units of the number of rows.
_COLUMNS = 8


class Runs(NamedTuple):
    """Runs of neighbouring stars that may lie in discs.

    disc: (k,) numbers of the discs.
    first: (k,) numbers of the first stars, in the order of the bins.
    length: (k,) numbers of stars.
    """

    disc: Array
    first: Array
    length: Array


class StarBins(NamedTuple):
    """Stars by the bins in which they lie.

    star: (2 n,) numbers of the stars; those of a row occur twice, for two turns round the circle.
    first: (rows, columns + 1) numbers of the first stars in the bins of two turns, and of the end.
    """

    star: Array
    first: Array

    def runs(self, centre: Float[Array, "m 3"], radius: Float[Array, " m"], disc: Int[Array, " m"]) -> Runs:
        """Runs of stars that may lie in discs with centres, radii and numbers (m,)."""
        rows, columns = len(self.first), self.first.shape[1] // 2
        angle = 2 * np.arcsin(np.minimum(radius / 2, 1))
        polar = np.arccos(np.clip(centre[:, 2], -1, 1))
        # Discs about a pole have all azimuths.
        with np.errstate(divide="ignore", invalid="ignore"):
            half = np.arcsin(np.minimum(np.sin(angle) / np.sin(polar), 1)) / (2 * math.pi)
        half = np.where((angle < polar) & (angle < math.pi - polar), half, 0.5)
        top, bottom = np.maximum(polar - angle, 0), np.minimum(polar + angle, math.pi)
        upper, lower = _rows(np.cos(top), rows), _rows(np.cos(bottom), rows)
        west = (_turns(centre) - half) % 1.0
        start = np.minimum((west * columns).astype(int), columns - 1)
        # A whole circle ends at the bin before the first.
        end = np.minimum(((west + 2 * half) * columns).astype(int), start + columns - (half == 0.5)) + 1
        owner, number = item_numbers(lower - upper + 1)
        row = upper[owner] + number
        first = self.first[row, start[owner]]
        count = self.first[row, end[owner]] - first
        some = np.flatnonzero(count)
        return Runs(disc[owner[some]], first[some], count[some])


def star_bins(direction: Float[Array, "n 3"], star: Int[Array, " n"]) -> StarBins:
    """The bins of stars, which have numbers (n,)."""
    rows = math.ceil(_ROWS * math.sqrt(len(star)) + 1)
    columns = _COLUMNS * rows
    row, column = _rows(direction[:, 2], rows), (_turns(direction) * columns).astype(int) % columns
    places = np.concatenate([row * 2 * columns + column, row * 2 * columns + column + columns])
    order = np.argsort(places, kind="stable")
    edges = np.arange(rows)[:, None] * 2 * columns + np.arange(2 * columns + 1)
    return StarBins(np.tile(star, 2)[order], np.searchsorted(places[order], edges))


def item_numbers(count: Int[Array, " n"]) -> tuple[Int[Array, " m"], Int[Array, " m"]]:
    """For counts (n,) of items of n owners: the owner (m,) of each item, and its number (m,) among the owner's."""
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)


def _rows(z: Float[Array, " m"], rows: int) -> Int[Array, " m"]:
    return np.clip(((1 - z) * (rows / 2)).astype(int), 0, rows - 1)


def _turns(direction: Float[Array, "m 3"]) -> Float[Array, " m"]:
    """Azimuths as parts of a circle, from 0 to 1."""
    return (np.arctan2(direction[:, 1], direction[:, 0]) / (2 * math.pi)) % 1.0
