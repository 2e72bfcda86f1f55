"""The sky map next to a critical curve, to second order: where the images of a star close to the caustic lie."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from kerrcaustics.curves.critical import Points

Array = np.ndarray

# Step in depth of the derivatives, and the longest step for which they serve.
_STEP, _LONGEST = 1e-3, 0.5
# Stars at a time.
_ROWS = 128
_BISECTIONS = 50
# A star within so many errors may be on the caustic: its images are looked for at these places along the curve, in
# units of the error's reach.
_ERRORS = 20.0
_PLACES = np.array([-4.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 4.0])


class Fold:
    """First and second derivatives of n' across a critical curve, along the lines of sky_lines.py.

    On a line that leaves the caustic at c, n' moves along the caustic's tangent T, and bends off along its normal N:
    n' = c + a s T + e s^2 N for a step s in depth. A star's images lie on the lines where it fits this.
    """

    def __init__(self, mapped: Callable[[Array, Array], Array], points: Points) -> None:
        """Derivatives at the points of a critical curve; mapped (turn, depth) gives n'."""
        outer, inner = (
            mapped(points.turn, np.maximum(points.depth - _STEP, 0)),
            mapped(points.turn, points.depth + _STEP),
        )
        first, second = (inner - outer) / (2 * _STEP), (inner + outer - 2 * points.direction) / _STEP**2
        derivatives = np.concatenate([first, second], axis=1)
        self._derivatives = CubicSpline(
            np.append(points.turn, points.turn[0] + 2 * np.pi),
            np.concatenate([derivatives, derivatives[:1]]),
            bc_type="periodic",
        )

    def guesses(self, points: Points, star: Array) -> tuple[Array, Array, Array, Array]:
        """Which of the stars (n, 3), turn and depth on the curve, and the step in depth to an image of it.

        points: of the curve, as close to each other as the stars are to the caustic.
        """
        derivatives = self._derivatives(points.turn)
        sign = np.where(np.einsum("ij,ij->i", points.major, derivatives[:, :3]) < 0, -1.0, 1.0)
        tangent = points.major * sign[:, None]
        normal = np.cross(points.direction, tangent)
        speed = np.einsum("ij,ij->i", tangent, derivatives[:, :3])
        bend = np.einsum("ij,ij->i", normal, derivatives[:, 3:]) / 2
        parts = []
        for first in range(0, len(star), _ROWS):
            away = star[first : first + _ROWS, None] - points.direction
            step = np.einsum("nij,ij->ni", away, tangent) / speed
            miss = np.einsum("nij,ij->ni", away, normal) - bend * step**2
            near = (np.einsum("nij,ij->ni", away, points.direction) > -1) & (np.abs(step) < _LONGEST)
            for which, turn, around in (_roots(points, miss, near), _touching(points, miss, near)):
                values = (points.depth[around], step[which[:, None], around])
                depth, steps = (_interpolated(points, around, value, turn) for value in values)
                parts.append((which + first, turn, depth, steps))
        which, turn, depth, step = (np.concatenate(values) for values in zip(*parts, strict=True))
        return which, turn, depth, step


def _roots(points: Points, miss: Array, near: Array) -> tuple[Array, Array, Array]:
    """Where `miss` (n, m) changes its sign along the curve: the row, the turn, and the four points around (.., 4)."""
    which, i = np.nonzero((np.sign(miss) != np.sign(np.roll(miss, -1, axis=1))) & near & np.roll(near, -1, axis=1))
    around = (i[:, None] + np.arange(-1, 3)) % len(points)
    values = miss[which[:, None], around]
    low, high = (_unrolled(points, around)[:, k] for k in (1, 2))
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        beyond = np.sign(_interpolated(points, around, values, middle)) != np.sign(values[:, 1])
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return which, (low + high) / 2, around


def _touching(points: Points, miss: Array, near: Array) -> tuple[Array, Array, Array]:
    """As `_roots`, where `miss` comes within the points' errors of 0 and turns back: a few places on both sides."""
    before, after = np.roll(miss, 1, axis=1), np.roll(miss, -1, axis=1)
    back = (np.abs(miss) <= np.minimum(np.abs(before), np.abs(after))) & (np.sign(before) == np.sign(after))
    which, i = np.nonzero(back & near & (np.abs(miss) < _ERRORS * points.error))
    around = (i[:, None] + np.arange(-1, 3)) % len(points)
    turn = _unrolled(points, around)
    values = miss[which[:, None], around]
    slopes = np.diff(values, axis=1) / np.diff(turn, axis=1)
    bend = np.abs((slopes[:, 1] - slopes[:, 0]) / (turn[:, 2] - turn[:, 0]))
    width = np.sqrt(points.error[i] / np.where(bend == 0, np.inf, bend))
    places = turn[:, 1:2] + width[:, None] * _PLACES
    count = len(_PLACES)
    return np.repeat(which, count), places.ravel(), np.repeat(around, count, axis=0)


def _unrolled(points: Points, around: Array) -> Array:
    """Turns of neighbouring points (n, 4), without the jump by a whole turn."""
    turn = points.turn[around]
    second = turn[:, 1:2]
    return second + (turn - second + np.pi) % (2 * np.pi) - np.pi


def _interpolated(points: Points, around: Array, values: Array, turn: Array) -> Array:
    """The cubic through four neighbouring points (n, 4), at turn (n,)."""
    known = _unrolled(points, around)
    total = np.zeros(len(turn))
    for k in range(4):
        others = [j for j in range(4) if j != k]
        weight = np.prod([(turn - known[:, j]) / (known[:, k] - known[:, j]) for j in others], axis=0)
        total += weight * values[:, k]
    return total
