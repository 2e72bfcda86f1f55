"""The sky map next to a critical curve, to second order: where the images of a star close to the caustic lie.

On a line of sky_lines.py that leaves the caustic at c, n' moves along the caustic's tangent T, and bends off along its
normal N: n' = c + a s T + e s^2 N for a step s in depth. A star's images lie on the lines where it fits this.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.curves.winding import Winding
from kerrcaustics.lens_map.sky_lines import periodic
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Float, Int, Num

Array = np.ndarray
_Guesses = tuple[Num[Array, " guesses"], ...]
_Around = tuple[Array, Array, Array, Array]
"""The star of each place; numbers of the four points around it, their misses, and the steps in depth."""
_Places = tuple[Float[Array, " found"], Int[Array, " found"]]
"""Edge phases of places, and the row of the four points around each."""

# Step in depth of the derivatives, and the longest step for which they serve.
_STEP, _LONGEST = 1e-3, 0.5
# Stars at a time.
_ROWS = 128
# Miss of a star, in errors of the points, below which it may lie on the caustic.
_ERRORS = 20.0
# Places along the curve at which its images are then sought, in units of the reach of this error.
_PLACES = np.array([-4.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 4.0])


def fold_derivatives(mapped: Callable[[Array, Array], Array], points: Points) -> Spline:
    """First and second derivatives (6,) of n' with respect to depth on a critical curve, as a function of edge phase.

    Parameters: mapped (edge phase, depth) gives n'; points: of the curve.
    """
    outer, inner = mapped(points.edge_phase, np.stack([np.maximum(points.depth - _STEP, 0), points.depth + _STEP]))
    first, second = (inner - outer) / (2 * _STEP), (inner + outer - 2 * points.direction) / _STEP**2
    return periodic(points.edge_phase, np.concatenate([first, second], axis=1))


def fold_guesses(derivatives: Spline, points: Points, star: Float[Array, "stars 3"], winding: Winding) -> _Guesses:
    """Numbers of stars, edge phase and depth on the critical curve, and the step in depth to an image of each.

    Parameters: points: of the curve; winding: of its caustic round the stars, which knows more points close to some.
    """
    known = points.joined(winding.points)
    fold = _FoldExpansion.from_points(known, derivatives(known.edge_phase))
    curve, close = np.arange(len(points)), np.unique(winding.star)
    far = np.setdiff1d(np.arange(len(star)), close)
    groups = [(far[i : i + _ROWS], curve) for i in range(0, len(far), _ROWS)]
    for i in close:
        number = np.append(curve, len(points) + np.flatnonzero(winding.star == i))
        groups.append((np.array([i]), number[np.argsort(known.edge_phase[number], kind="stable")]))
    fits = [_fits(fold, which, number, star[which]) for which, number in groups]
    parts = []
    for places, around in zip((_roots, _touching), zip(*fits, strict=True), strict=True):
        which, number, miss, step = (np.concatenate(values) for values in zip(*around, strict=True))
        edge_phase, row = places(known, number, miss)
        phases, depth, step = _unrolled(known, number)[row], known.depth[number[row]], step[row]
        parts.append((which[row], edge_phase, *(_cubic(edge_phase, *phases.T, *v.T) for v in (depth, step))))
    return tuple(np.concatenate(values) for values in zip(*parts, strict=True))


class _FoldExpansion(NamedTuple):
    """The map next to points of a critical curve, to second order.

    place: Ends c of the rays, unit vectors.
    tangent: Unit vectors T along the caustic.
    normal: Unit vectors N across it.
    speed: a, radians per unit of depth.
    bend: e, radians per unit of depth squared.
    error: Errors of the points, radians.
    """

    place: Array
    tangent: Array
    normal: Array
    speed: Array
    bend: Array
    error: Array

    @classmethod
    def from_points(cls, points: Points, derivatives: Float[Array, "points 6"]) -> "_FoldExpansion":
        sign = np.where(np.einsum("ij,ij->i", points.major, derivatives[:, :3]) < 0, -1.0, 1.0)
        tangent = points.major * sign[:, None]
        normal = np.cross(points.direction, tangent)
        speed = np.einsum("ij,ij->i", tangent, derivatives[:, :3])
        bend = np.einsum("ij,ij->i", normal, derivatives[:, 3:]) / 2
        return cls(points.direction, tangent, normal, speed, bend, points.error)


def _fits(
    fold: _FoldExpansion, which: Int[Array, " stars"], number: Int[Array, " points"], star: Float[Array, "stars 3"]
) -> tuple[_Around, _Around]:
    """The four points around each place at which the miss of a star changes its sign, or may vanish within its error.

    Parameters: which: names of the stars; number: the points round the curve, as close to each other as they need.
    """
    place, tangent, normal, speed, bend, error = (values[number] for values in fold)
    away = star[:, None] - place
    step = np.einsum("nij,ij->ni", away, tangent) / speed
    miss = np.einsum("nij,ij->ni", away, normal) - bend * step**2
    near = (np.einsum("nij,ij->ni", away, place) > -1) & (np.abs(step) < _LONGEST)
    before, after = np.roll(miss, 1, axis=1), np.roll(miss, -1, axis=1)
    crossed = (np.sign(miss) != np.sign(after)) & near & np.roll(near, -1, axis=1)
    back = (np.abs(miss) <= np.minimum(np.abs(before), np.abs(after))) & (np.sign(before) == np.sign(after))
    touched = back & near & (np.abs(miss) < _ERRORS * error)
    fits = []
    for row, i in (np.nonzero(crossed), np.nonzero(touched)):
        around = (i[:, None] + np.arange(-1, 3)) % len(number)
        fits.append((which[row], number[around], miss[row[:, None], around], step[row[:, None], around]))
    return fits[0], fits[1]


def _roots(points: Points, number: Int[Array, "places 4"], miss: Float[Array, "places 4"]) -> _Places:
    """Sign changes of `miss` along the curve, between the second and the third of four points."""
    known = _unrolled(points, number)
    bracket = known[:, 1], known[:, 2]
    root = bracketed_roots(_cubic, bracket, (*known.T, *miss.T), relative=1e-14)
    return root.x, np.arange(len(number))


def _touching(points: Points, number: Int[Array, "places 4"], miss: Float[Array, "places 4"]) -> _Places:
    """Roots where `miss` comes within the points' errors of 0 and turns back: a few places on both sides."""
    edge_phase, error = _unrolled(points, number), points.error[number[:, 1]]
    slopes = np.diff(miss, axis=1) / np.diff(edge_phase, axis=1)
    bend = np.abs((slopes[:, 1] - slopes[:, 0]) / (edge_phase[:, 2] - edge_phase[:, 0]))
    width = np.sqrt(error / np.where(bend == 0, np.inf, bend))
    places = edge_phase[:, 1:2] + width[:, None] * _PLACES
    return places.ravel(), np.repeat(np.arange(len(number)), len(_PLACES))


def _unrolled(points: Points, around: Int[Array, "places 4"]) -> Float[Array, "places 4"]:
    """Edge phases of neighbouring points, by their numbers, without the jump by a whole turn."""
    edge_phase = points.edge_phase[around]
    second = edge_phase[:, 1:2]
    return second + (edge_phase - second + np.pi) % (2 * np.pi) - np.pi


def _cubic(at: Float[Array, " places"], *known: Float[Array, " places"]) -> Float[Array, " places"]:
    """The cubic through four places, given first, and the values there, at other places."""
    places, values = known[:4], known[4:]
    total = np.zeros_like(at)
    for k in range(4):
        other_nodes = [j for j in range(4) if j != k]
        total += values[k] * np.prod([(at - places[j]) / (places[k] - places[j]) for j in other_nodes], axis=0)
    return total
