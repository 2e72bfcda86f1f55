"""Patches: a smooth map of the picture, joined from values and derivatives at the corners of square cells.

On each cell the map is the Coons patch of four cubic edges, twelve numbers a component: exact for cubics, continuous
from cell to cell, and off by the fourth power of the cell's size.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kerrcaustics.shapes import Float

Array = np.ndarray

CORNERS = ((0, 0), (1, 0), (0, 1), (1, 1))
"""Corners (x, y) of a cell, in the order of all arrays over them."""


class Weights(NamedTuple):
    """Weights of the data at the corners, for the map and its derivatives at m places of a cell.

    The data are four values, four derivatives along x, and four along y, times the cell's size.

    value: (12, m) weights of the value.
    along_x, along_y: (12, m) weights of the derivatives along x and y, in units of the cell.
    mean, mean_x, mean_y: (4, m) the same of the bilinear map of the values.
    """

    value: Array
    along_x: Array
    along_y: Array
    mean: Array
    mean_x: Array
    mean_y: Array


@lru_cache(maxsize=4096)
def weights(start_x: float, start_y: float, side: float, count: int) -> Weights:
    """Weights at the middles of count x count parts of a square within a cell, in units of the cell; row by row."""
    within = (np.arange(count) + 0.5) / count * side
    return weights_at(*np.meshgrid(start_x + within, start_y + within))


def weights_at(x: Array, y: Array) -> Weights:
    """Weights at places of a cell, in units of the cell."""
    x, y = np.ravel(x), np.ravel(y)
    (lx, hx), (ly, hy) = _linear(x), _linear(y)
    (vx, dx), (vy, dy) = _cubic(x), _cubic(y)
    value, along_x, along_y = np.zeros((3, 12, x.size))
    mean, mean_x, mean_y = np.zeros((3, 4, x.size))
    for corner, (i, j) in enumerate(CORNERS):
        mean[corner], mean_x[corner], mean_y[corner] = lx[i] * ly[j], hx[i] * ly[j], lx[i] * hy[j]
        value[corner] = vx[i] * ly[j] + lx[i] * vy[j] - mean[corner]
        along_x[corner] = dx[i] * ly[j] + hx[i] * vy[j] - mean_x[corner]
        along_y[corner] = vx[i] * hy[j] + lx[i] * dy[j] - mean_y[corner]
        for rows, by_x, by_y in (
            (value, vx[2 + i] * ly[j], lx[i] * vy[2 + j]),
            (along_x, dx[2 + i] * ly[j], hx[i] * vy[2 + j]),
            (along_y, vx[2 + i] * hy[j], lx[i] * dy[2 + j]),
        ):
            rows[4 + corner], rows[8 + corner] = by_x, by_y
    return Weights(value, along_x, along_y, mean, mean_x, mean_y)


def _linear(s: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Linear functions with the value 1 at either end, and their derivatives."""
    return (1 - s, s), (-np.ones_like(s), np.ones_like(s))


def _cubic(s: Array) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Cubics with the value 1 at either end, then with the derivative 1 at either end, and their derivatives."""
    values = (1 - (3 - 2 * s) * s * s, (3 - 2 * s) * s * s, s * (1 - s) ** 2, s * s * (s - 1))
    slopes = (6 * s * (s - 1), 6 * s * (1 - s), (1 - s) * (1 - 3 * s), s * (3 * s - 2))
    return values, slopes


def doubt(data: Float[Array, "cells 12 parts"]) -> Float[Array, "cells parts"]:
    """Estimated errors of the patches: the range of their middles by the edges, and by either diagonal.

    All three are off by the fourth power of the size, each by another multiple of it.
    """
    first, second = doubts(data)
    return np.maximum(np.maximum(first, second), 0) - np.minimum(np.minimum(first, second), 0)


def doubts(data: Float[Array, "cells 12 parts"]) -> tuple[Float[Array, "cells parts"], Float[Array, "cells parts"]]:
    """Differences of the middle by either diagonal from the middle by the edges."""
    value, x, y = data[:, :4], data[:, 4:8], data[:, 8:]
    middle = np.tensordot(data, weights(0.5, 0.5, 0.0, 1).value[:, 0], ((1,), (0,)))

    def difference(first: int, second: int, sign: int) -> Array:
        change = sign * (x[:, first] - x[:, second]) + y[:, first] - y[:, second]
        return (value[:, first] + value[:, second]) / 2 + change / 8 - middle

    return difference(0, 3, 1), difference(1, 2, -1)
