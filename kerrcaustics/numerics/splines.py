"""Cubic splines through points of a curve, in NumPy.

The slopes at the nodes follow from the steps by a tridiagonal system, in which each unknown outweighs its neighbours by
a factor of two. Every round of cyclic reduction squares that factor, so that a few rounds solve it to the last digit.
"""

from typing import Any

import numpy as np

from kerrcaustics.shapes import Float

Array = np.ndarray

# Neighbours count for nothing below this part of the unknown itself.
_NOTHING = 1e-18
# Derivatives of the powers of a cubic, by order: their factors, highest power first.
_FACTORS = {0: (1, 1, 1, 1), 1: (3, 2, 1), 2: (6, 2), 3: (6,)}


class Spline:
    """Cubic spline through values at nodes, with two continuous derivatives.

    At the ends the third derivative is continuous too, from the first piece to the second and from the last but one to
    the last; or the spline is periodic, and repeats beyond its ends. Others go on beyond them as their last pieces.
    """

    def __init__(self, nodes: Float[Array, " n"], values: Float[Array, " n *axes"], *, periodic: bool = False) -> None:
        """Rising nodes, two or more; of a periodic spline the last value is the first."""
        self.x, self.periodic = np.asarray(nodes, float), periodic
        values = np.asarray(values, float)
        self._powers = cubics(self.x, values, slopes(self.x, values, periodic=periodic))

    def __call__(self, at: Float[Array, "*batch"] | float, derivative: int = 0) -> Float[Array, "..."]:
        """Values at places (*batch, *axes), or derivatives there of an order of 1 to 3."""
        place = np.ravel(at).astype(float)
        if self.periodic:
            place = self.x[0] + (place - self.x[0]) % (self.x[-1] - self.x[0])
        piece = _pieces(self.x, place)
        factors, powers = _FACTORS[derivative], self._powers[piece]
        ahead, total = _as_column(place - self.x[piece], powers[:, 0]), factors[0] * powers[:, 0]
        for k, factor in enumerate(factors[1:], 1):
            total = total * ahead + factor * powers[:, k]
        return total.reshape(np.shape(at) + total.shape[1:])


def cubics(
    nodes: Float[Array, " n"], values: Float[Array, " n *axes"], slope: Float[Array, " n *axes"]
) -> Float[Array, " pieces 4 *axes"]:
    """Powers, the highest first, of the cubics between each node and the next: of the distance from the first."""
    width = _as_column(np.diff(nodes), values)
    rate = np.diff(values, axis=0) / width
    bend = (slope[:-1] + slope[1:] - 2 * rate) / width
    return np.stack([bend / width, (rate - slope[:-1]) / width - bend, slope[:-1], values[:-1]], axis=1)


def slopes(
    nodes: Float[Array, " n"], values: Float[Array, " n *axes"], *, periodic: bool = False
) -> Float[Array, " n *axes"]:
    """Slopes of a spline at its nodes; through two or three points it is a line or a parabola."""
    if len(nodes) < 4 and not periodic:
        return np.gradient(values, nodes, axis=0, edge_order=1 if len(nodes) < 3 else 2)
    width = np.diff(nodes)
    rate = np.diff(values, axis=0) / _as_column(width, values)
    if periodic:
        slope = _solved(*_inner(np.roll(width, 1), width, np.roll(rate, 1, axis=0), rate))
        return np.concatenate([slope, slope[:1]])
    low, middle, high, right = _inner(width[:-1], width[1:], rate[:-1], rate[1:])
    first, last = _end(width[0], width[1], rate[0], rate[1]), _end(width[-1], width[-2], rate[-1], rate[-2])
    # The slopes at the ends are sums of two terms, one of which is the slope beside them.
    for place, neighbour, (known, share) in ((0, low, first), (-1, high, last)):
        right[place] -= neighbour[place] * known
        middle[place] -= neighbour[place] * share
        neighbour[place] = 0
    slope = _solved(low, middle, high, right)
    return np.concatenate([[first[0] - first[1] * slope[0]], slope, [last[0] - last[1] * slope[-1]]])


def _inner(before: Array, after: Array, rate_before: Array, rate_after: Array) -> tuple[Array, Array, Array, Array]:
    """Rows of the system, by which the second derivative is continuous: factors of three slopes, and the right side."""
    right = 3 * (_as_column(after, rate_after) * rate_before + _as_column(before, rate_after) * rate_after)
    return after.copy(), 2 * (before + after), before.copy(), right


def _end(width: float, beside: float, rate: Any, rate_beside: Any) -> tuple[Any, float]:
    """The slope at an end is the first less the second times that beside it: the third derivative is continuous."""
    whole = width + beside
    known = ((2 * whole + width) * beside * rate + width**2 * rate_beside) / (whole * beside)
    return known, whole / beside


def _solved(low: Array, middle: Array, high: Array, right: Array) -> Array:
    """Solution of a tridiagonal system that goes on around its ends unless their outer factors are 0."""
    here, step = np.arange(len(middle)), 1
    while np.any(np.abs(low) + np.abs(high) > _NOTHING * np.abs(middle)):
        back, ahead = (here - step) % len(here), (here + step) % len(here)
        before, after = -low / middle[back], -high / middle[ahead]
        middle = middle + before * high[back] + after * low[ahead]
        right = right + _as_column(before, right) * right[back] + _as_column(after, right) * right[ahead]
        low, high, step = before * low[back], after * high[ahead], 2 * step
    return right / _as_column(middle, right)


def _pieces(nodes: Array, at: Array) -> Array:
    """Number of the piece that each place lies on, or is nearest to."""
    # `np.clip` takes several times as long for few.
    return np.minimum(np.maximum(np.searchsorted(nodes, at, side="right") - 1, 0), len(nodes) - 2)


def _as_column(numbers: Array, values: Array) -> Array:
    """Numbers along the first axis of values, to be multiplied with these."""
    return numbers.reshape(-1, *[1] * (values.ndim - 1))
