"""The sky map next to a critical curve, to second order: where the images of a star close to the caustic lie.

On a line of sky_lines.py that leaves the caustic at c, n' moves along the caustic's tangent T, and bends off along its
normal N: n' = c + a s T + e s^2 N for a step s in depth. A star's images lie on the lines where it fits this.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Int, Num

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.curves.winding import Winding
from kerrcaustics.lens_map.sky_lines import periodic
from kerrcaustics.spacetime.arrays import Spline

Array = np.ndarray
_Guesses = tuple[Num[Array, " guesses"], ...]
_Places = tuple[Int[Array, " places"], Float[Array, " places"], Int[Array, "places 4"]]

# Step in depth of the derivatives, and the longest step for which they serve.
_STEP, _LONGEST = 1e-3, 0.5
# Stars at a time.
_ROWS = 128
# A star within so many errors may be on the caustic: its images are looked for at these places along the curve, in
# units of the error's reach.
_ERRORS = 20.0
_PLACES = np.array([-4.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 4.0])


def fold_derivatives(mapped: Callable[[Array, Array], Array], points: Points) -> Spline:
    """First and second derivatives (6,) of n' by depth along a critical curve, as a function of the edge phase.

    Parameters: mapped (edge phase, depth) gives n'; points: of the curve.
    """
    outer = mapped(points.edge_phase, np.maximum(points.depth - _STEP, 0))
    inner = mapped(points.edge_phase, points.depth + _STEP)
    first, second = (inner - outer) / (2 * _STEP), (inner + outer - 2 * points.direction) / _STEP**2
    return periodic(points.edge_phase, np.concatenate([first, second], axis=1))


def fold_guesses(derivatives: Spline, points: Points, star: Float[Array, "stars 3"], winding: Winding) -> _Guesses:
    """Numbers of stars, edge phase and depth on the critical curve, and the step in depth to an image of each.

    Parameters: points: of the curve; winding: of its caustic round the stars, which knows more points close to some.
    """
    close = np.unique(winding.star)
    far = np.setdiff1d(np.arange(len(star)), close)
    groups = [(far[i : i + _ROWS], points) for i in range(0, len(far), _ROWS)]
    for i in close:
        merged = points.joined(winding.points[winding.star == i])
        groups.append((np.array([i]), merged[np.argsort(merged.edge_phase, kind="stable")]))
    parts = [(which, *_guesses(derivatives(known.edge_phase), known, star[which])) for which, known in groups]
    found = [(which[row], *values) for which, row, *values in parts]
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _guesses(derivatives: Float[Array, "points 6"], points: Points, star: Float[Array, "stars 3"]) -> _Guesses:
    """As `fold_guesses`, with points as close to each other as the stars are to the caustic."""
    sign = np.where(np.einsum("ij,ij->i", points.major, derivatives[:, :3]) < 0, -1.0, 1.0)
    tangent = points.major * sign[:, None]
    normal = np.cross(points.direction, tangent)
    speed = np.einsum("ij,ij->i", tangent, derivatives[:, :3])
    bend = np.einsum("ij,ij->i", normal, derivatives[:, 3:]) / 2
    away = star[:, None] - points.direction
    step = np.einsum("nij,ij->ni", away, tangent) / speed
    miss = np.einsum("nij,ij->ni", away, normal) - bend * step**2
    near = (np.einsum("nij,ij->ni", away, points.direction) > -1) & (np.abs(step) < _LONGEST)
    parts = []
    for which, edge_phase, around in (_roots(points, miss, near), _touching(points, miss, near)):
        known, values = _unrolled(points, around), (points.depth[around], step[which[:, None], around])
        parts.append((which, edge_phase, *(_cubic(edge_phase, *known.T, *value.T) for value in values)))
    return tuple(np.concatenate(values) for values in zip(*parts, strict=True))


def _roots(points: Points, miss: Float[Array, "stars points"], near: Bool[Array, "stars points"]) -> _Places:
    """Sign changes of `miss` along the curve: the row, the edge phase, and the four points around."""
    from scipy.optimize import elementwise

    which, i = np.nonzero((np.sign(miss) != np.sign(np.roll(miss, -1, axis=1))) & near & np.roll(near, -1, axis=1))
    around = (i[:, None] + np.arange(-1, 3)) % len(points)
    values = miss[which[:, None], around]
    known = _unrolled(points, around)
    bracket = known[:, 1], known[:, 2]
    root = elementwise.find_root(_cubic, bracket, args=(*known.T, *values.T), tolerances={"xrtol": 1e-14})
    return which, np.asarray(root.x), around


def _touching(points: Points, miss: Float[Array, "stars points"], near: Bool[Array, "stars points"]) -> _Places:
    """As `_roots`, where `miss` comes within the points' errors of 0 and turns back: a few places on both sides."""
    before, after = np.roll(miss, 1, axis=1), np.roll(miss, -1, axis=1)
    back = (np.abs(miss) <= np.minimum(np.abs(before), np.abs(after))) & (np.sign(before) == np.sign(after))
    which, i = np.nonzero(back & near & (np.abs(miss) < _ERRORS * points.error))
    around = (i[:, None] + np.arange(-1, 3)) % len(points)
    edge_phase = _unrolled(points, around)
    values = miss[which[:, None], around]
    slopes = np.diff(values, axis=1) / np.diff(edge_phase, axis=1)
    bend = np.abs((slopes[:, 1] - slopes[:, 0]) / (edge_phase[:, 2] - edge_phase[:, 0]))
    width = np.sqrt(points.error[i] / np.where(bend == 0, np.inf, bend))
    places = edge_phase[:, 1:2] + width[:, None] * _PLACES
    count = len(_PLACES)
    return np.repeat(which, count), places.ravel(), np.repeat(around, count, axis=0)


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
