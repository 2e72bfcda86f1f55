"""The sky map next to a critical curve, to second order: where the images of a star close to the caustic lie.

On a line of sky_lines.py that leaves the caustic at c, n' moves along the caustic's tangent T, and bends off along its
normal N: n' = c + a s T + e s^2 N for a step s in depth. A star's images lie on the lines where it fits this.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Num
from scipy.interpolate import CubicSpline
from scipy.optimize import elementwise

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.curves.winding import Winding
from kerrcaustics.lens_map.sky_lines import periodic

Array = np.ndarray
_Guesses = tuple[Num[Array, " guesses"], ...]
_Places = tuple[Float[Array, " places"], Int[Array, "places 4"]]

# Step in depth of the derivatives, and the longest step for which they serve.
_STEP, _LONGEST = 1e-3, 0.5
# Stars at a time.
_ROWS = 128
# A star within so many errors may be on the caustic: its images are looked for at these places along the curve, in
# units of the error's reach.
_ERRORS = 20.0
_PLACES = np.array([-4.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 4.0])


def fold_derivatives(mapped: Callable[[Array, Array], Array], points: Points) -> CubicSpline:
    """First and second derivatives (6,) of n' by depth along a critical curve, as a function of the edge phase.

    Parameters: mapped (edge phase, depth) gives n'; points: of the curve.
    """
    outer = mapped(points.edge_phase, np.maximum(points.depth - _STEP, 0))
    inner = mapped(points.edge_phase, points.depth + _STEP)
    first, second = (inner - outer) / (2 * _STEP), (inner + outer - 2 * points.direction) / _STEP**2
    return periodic(points.edge_phase, np.concatenate([first, second], axis=1))


def fold_guesses(derivatives: CubicSpline, points: Points, star: Float[Array, "stars 3"], winding: Winding) -> _Guesses:
    """Numbers of stars, edge phase and depth on the critical curve, and the step in depth to an image of each.

    Parameters: points: of the curve; winding: of its caustic round the stars, which knows more points close to some.
    """
    known = points.joined(winding.points)
    fold = _Fold.at(known, derivatives(known.edge_phase))
    count, extra = len(points), np.arange(len(points), len(known))
    parts = []
    for first in range(0, max(len(star), 1), _ROWS):
        some = np.arange(first, min(first + _ROWS, len(star)))
        theirs = (first <= winding.star) & (winding.star < first + _ROWS)
        which = np.concatenate([np.repeat(some, count), winding.star[theirs]])
        number = np.concatenate([np.tile(np.arange(count), len(some)), extra[theirs]])
        order = np.lexsort((known.edge_phase[number], which))
        parts.append(_guesses(fold, _Rings.of(which[order], number[order]), star))
    return tuple(np.concatenate(values) for values in zip(*parts, strict=True))


class _Fold(NamedTuple):
    """The map next to points of a critical curve: its directions T and N there, the speed a and the bend e."""

    points: Points
    tangent: Array
    normal: Array
    speed: Array
    bend: Array

    @classmethod
    def at(cls, points: Points, derivatives: Float[Array, "points 6"]) -> "_Fold":
        sign = np.where(np.einsum("ij,ij->i", points.major, derivatives[:, :3]) < 0, -1.0, 1.0)
        tangent = points.major * sign[:, None]
        normal = np.cross(points.direction, tangent)
        speed = np.einsum("ij,ij->i", tangent, derivatives[:, :3])
        return cls(points, tangent, normal, speed, np.einsum("ij,ij->i", normal, derivatives[:, 3:]) / 2)


class _Rings(NamedTuple):
    """Points round the curve for one star after the other, as close to each other as the star is to the caustic.

    which: the star of each row; number: its point; first, count: of the star's rows.
    """

    which: Array
    number: Array
    first: Array
    count: Array

    @classmethod
    def of(cls, which: Int[Array, " rows"], number: Int[Array, " rows"]) -> "_Rings":
        first = np.searchsorted(which, which)
        return cls(which, number, first, np.searchsorted(which, which, side="right") - first)

    def beside(self, row: Int[Array, " rows"], steps: int) -> Int[Array, " rows"]:
        """Rows so many steps further round."""
        first = self.first[row]
        return np.asarray(first + (row - first + steps) % self.count[row])

    def around(self, row: Int[Array, " places"]) -> Int[Array, "places 4"]:
        """The rows before and after the way from some to the next ones."""
        return np.stack([self.beside(row, steps) for steps in range(-1, 3)], axis=1)


def _guesses(fold: _Fold, rings: _Rings, star: Float[Array, "stars 3"]) -> _Guesses:
    """As `fold_guesses`, from points round the curve."""
    points, number = fold.points, rings.number
    away = star[rings.which] - points.direction[number]
    step = np.einsum("ij,ij->i", away, fold.tangent[number]) / fold.speed[number]
    miss = np.einsum("ij,ij->i", away, fold.normal[number]) - fold.bend[number] * step**2
    near = (np.einsum("ij,ij->i", away, points.direction[number]) > -1) & (np.abs(step) < _LONGEST)
    parts = []
    for edge_phase, around in (_roots(points, rings, miss, near), _touching(points, rings, miss, near)):
        known, values = _unrolled(points, number[around]), (points.depth[number[around]], step[around])
        which = rings.which[around[:, 0]]
        parts.append((which, edge_phase, *(_cubic(edge_phase, *known.T, *value.T) for value in values)))
    return tuple(np.concatenate(values) for values in zip(*parts, strict=True))


def _roots(points: Points, rings: _Rings, miss: Float[Array, " rows"], near: Bool[Array, " rows"]) -> _Places:
    """Sign changes of `miss` along the curve: the edge phase, and the four rows around."""
    rows = np.arange(len(miss))
    after = rings.beside(rows, 1)
    around = rings.around(np.flatnonzero((np.sign(miss) != np.sign(miss[after])) & near & near[after]))
    known = _unrolled(points, rings.number[around])
    bracket = known[:, 1], known[:, 2]
    root = elementwise.find_root(_cubic, bracket, args=(*known.T, *miss[around].T), tolerances={"xrtol": 1e-14})
    return np.asarray(root.x), around


def _touching(points: Points, rings: _Rings, miss: Float[Array, " rows"], near: Bool[Array, " rows"]) -> _Places:
    """As `_roots`, where `miss` comes within the points' errors of 0 and turns back: a few places on both sides."""
    rows = np.arange(len(miss))
    before, after = miss[rings.beside(rows, -1)], miss[rings.beside(rows, 1)]
    error = points.error[rings.number]
    back = (np.abs(miss) <= np.minimum(np.abs(before), np.abs(after))) & (np.sign(before) == np.sign(after))
    row = np.flatnonzero(back & near & (np.abs(miss) < _ERRORS * error))
    around = rings.around(row)
    edge_phase = _unrolled(points, rings.number[around])
    slopes = np.diff(miss[around], axis=1) / np.diff(edge_phase, axis=1)
    bend = np.abs((slopes[:, 1] - slopes[:, 0]) / (edge_phase[:, 2] - edge_phase[:, 0]))
    width = np.sqrt(error[row] / np.where(bend == 0, np.inf, bend))
    places = edge_phase[:, 1:2] + width[:, None] * _PLACES
    return places.ravel(), np.repeat(around, len(_PLACES), axis=0)


def _unrolled(points: Points, around: Int[Array, "places 4"]) -> Float[Array, "places 4"]:
    """Edge phases of neighbouring points, without the jump by a whole turn."""
    edge_phase = points.edge_phase[around]
    second = edge_phase[:, 1:2]
    return second + (edge_phase - second + np.pi) % (2 * np.pi) - np.pi


def _cubic(at: Float[Array, " places"], *known: Float[Array, " places"]) -> Float[Array, " places"]:
    """The cubic through four places, given first, and the values there, at other places."""
    places, values = known[:4], known[4:]
    total = np.zeros_like(at)
    for k in range(4):
        others = [j for j in range(4) if j != k]
        total += values[k] * np.prod([(at - places[j]) / (places[k] - places[j]) for j in others], axis=0)
    return total
