"""Cusps and extremes of caustics, from a polynomial model of a short piece of the curve around each.

Around a cusp or an extreme the curve is traced at Chebyshev nodes of its parameter. All that is read off is a
smooth function there, so the interpolating polynomial is as accurate as the beams themselves. All pieces of all curves
are read at once.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from kerrcaustics.curves.critical_curves import CriticalCurve, points_between
from kerrcaustics.curves.critical_points import Points, Search
from kerrcaustics.shapes import Bool, Float, Int

Array = np.ndarray

NODES = chebyshev.chebpts1(17)
"""Places of the points on a piece, from -1 to 1."""
_POWERS = len(NODES)
_TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(NODES, _POWERS - 1))
# From coefficients to those of the derivative.
_DERIVED = np.pad(chebyshev.chebder(np.eye(_POWERS)), ((0, 1), (0, 0)))
_SPEEDS = chebyshev.chebvander(NODES, _POWERS - 1) @ _DERIVED @ _TO_COEFFICIENTS
"""From values at the nodes to derivatives there."""
# Where a polynomial is looked at first; a root may lie a little beyond the ends, by round-off.
_GRID = np.linspace(-1, 1, 129) * (1 + 1e-9)
_ON_GRID = chebyshev.chebvander(_GRID, _POWERS - 1)
# Newton steps from there: each squares what is left.
_STEPS = 5
_EXTREMES = {
    "theta_min": ("theta", -1),
    "theta_max": ("theta", 1),
    "phi_min": ("azimuth", -1),
    "phi_max": ("azimuth", 1),
}


@dataclass
class Features:
    """The features of one caustic.

    extremes: value and error of the extremes that were found, by name.
    cusps: points of each cusp, and the error of its (theta', azimuth), radians.
    lost_cusps: number of cusps that could not be traced.
    """

    extremes: dict[str, tuple[float, float]]
    cusps: list[tuple[Points, float]]
    lost_cusps: int


class _CurveSection(NamedTuple):
    """A short piece of one curve: its order, what is looked for, its middle and half-width in `edge_phase`."""

    order: int
    what: str
    middle: float
    half: float


class _SectionPoints(NamedTuple):
    """A piece with its points at `NODES`."""

    piece: _CurveSection
    points: Points


class _Root(NamedTuple):
    """Order, parameter and depth of a cusp, and the error of its place that comes from the parameter."""

    order: int
    edge_phase: float
    depth: float
    error: float


def find_features(search: Search, curves: Iterable[CriticalCurve]) -> dict[int, Features]:
    """The cusps and the four extremes of each curve, by order.

    Curves that are not much larger than their error have none: the search would find only noise.
    """
    features = {curve.order: Features({}, [], 0) for curve in curves}
    models, lost = _sections(search, curves, (*_EXTREMES, "cusps"))
    for piece in lost:
        features[piece.order].lost_cusps += piece.what == "cusps"
    for (order, what), extreme in _extremes(models).items():
        features[order].extremes[what] = extreme
    roots = _cusps([model for model in models if model.piece.what == "cusps"])
    if roots:
        order, edge_phase, depth, error = (np.array(column) for column in zip(*roots, strict=True))
        for k, point, missed in zip(order, search.polished(edge_phase, order, depth).each(), error, strict=True):
            features[k].cusps.append((point, float(point.angle_error[0] + missed / np.sin(point.theta[0]))))
    return features


def extreme_places(search: Search, curves: Iterable[CriticalCurve]) -> dict[tuple[int, str], tuple[Points, float]]:
    """The four extremes of each curve, by order and name: points at the nodes of a piece, and the place on it.

    The points are those at `NODES`, and the place is on the same scale, -1 to 1. The extremes of curves that are not
    much larger than their error are missing, and so are those whose piece could not be traced.
    """
    models, _ = _sections(search, curves, tuple(_EXTREMES))
    places = _peaks(_heights(models))[0].tolist()
    return {model.piece[:2]: (model.points, at) for model, at in zip(models, places, strict=True)}


def _pieces(curve: CriticalCurve, around: Points) -> list[_CurveSection]:
    points, n = curve.points, len(curve.points)
    places = [(name, int(np.argmax(sign * getattr(points, field)))) for name, (field, sign) in _EXTREMES.items()]
    places += [("cusps", i) for i in _reversals(points)]
    pieces = []
    for what, i in places:
        # From the point before to the one after it.
        low, high = around.edge_phase[n + i - 1], around.edge_phase[n + i + 1]
        pieces.append(_CurveSection(curve.order, what, (low + high) / 2, (high - low) / 2))
    return pieces


def _reversals(points: Points) -> list[int]:
    """Points next to which the caustic turns back on itself against its continuous tangent, the major axis."""
    n = len(points)
    major = _oriented(np.concatenate([points.major, points.major[:1]]))
    chord = np.diff(np.concatenate([points.direction, points.direction[:1]]), axis=0)
    along = np.einsum("ij,ij->i", chord, major[:-1] + major[1:]) > 0
    # The axis may come back reversed after one turn: the last chord meets the first one with that sign.
    flipped = np.dot(major[-1], major[0]) < 0
    turned = along[1:] != along[:-1]
    reversals = [i + 1 for i in range(n - 1) if turned[i]]
    if (along[0] != along[-1]) != flipped:
        reversals.insert(0, 0)
    return reversals


def _oriented(axes: Float[Array, "*rows points 3"]) -> Float[Array, "*rows points 3"]:
    """Axes with signs chosen so that each agrees with the one before."""
    agree = np.sign(np.vecdot(axes[..., 1:, :], axes[..., :-1, :]))
    signs = np.cumprod(np.where(agree == 0, 1.0, agree), axis=-1)
    return axes * np.concatenate([np.ones((*axes.shape[:-2], 1)), signs], axis=-1)[..., None]


def _sections(
    search: Search, curves: Iterable[CriticalCurve], features: tuple[str, ...]
) -> tuple[list[_SectionPoints], list[_CurveSection]]:
    """The pieces of resolved curves around these features with their points, in one go; those that were not traced."""
    around = {curve.order: curve.over_three_turns() for curve in curves if curve.is_resolved}
    every = [_pieces(curve, around[curve.order]) for curve in curves if curve.is_resolved]
    pieces = [piece for of_curve in every for piece in of_curve if piece.what in features]
    if not pieces:
        return [], []
    edge_phases = {
        order: np.unique(np.concatenate([p.middle + p.half * NODES for p in pieces if p.order == order]))
        for order in around
    }
    traced = points_between(search, around, edge_phases)
    models, lost = [], []
    for piece in pieces:
        points, node_phases = traced[piece.order], piece.middle + piece.half * NODES
        at = np.searchsorted(points.edge_phase, node_phases)
        whole = (at < len(points)).all() and np.array_equal(
            points.edge_phase[np.minimum(at, len(points) - 1)], node_phases
        )
        if whole:
            models.append(_SectionPoints(piece, points[at]))
        else:
            lost.append(piece)
    return models, lost


def _fitted(values: Float[Array, "pieces nodes *axes"]) -> Float[Array, "pieces powers *axes"]:
    """The Chebyshev coefficients of values at `NODES`."""
    return np.asarray(np.einsum("kn,pn...->pk...", _TO_COEFFICIENTS, values))


def _polynomial_values(
    place: Float[Array, " pieces"], coefficients: Float[Array, "pieces powers"]
) -> Float[Array, " pieces"]:
    """Values of polynomials, each at a place of its own."""
    return np.vecdot(chebyshev.chebvander(place, _POWERS - 1), coefficients)


def _tails(coefficients: Float[Array, "pieces powers"]) -> Float[Array, " pieces"]:
    """The distance of polynomials from convergence: their last coefficients."""
    return np.asarray(np.abs(coefficients[:, -3:]).max(axis=1))


def _heights(models: list[_SectionPoints]) -> Float[Array, "pieces nodes"]:
    """What is largest at the extreme of each piece, at its nodes."""
    if not models:
        return np.empty((0, _POWERS))
    rows = []
    for (_, what, _, _), points in models:
        field, sign = _EXTREMES[what]
        rows.append(sign * getattr(points, field))
    return np.stack(rows)


def _peaks(heights: Float[Array, "pieces nodes"]) -> tuple[Float[Array, " pieces"], Float[Array, "pieces powers"]]:
    """Where polynomials through values at `NODES` are largest, from -1 to 1, and their coefficients."""
    values = _fitted(heights)
    slopes = values @ _DERIVED.T
    at = np.argmax(values @ _ON_GRID.T, axis=1)
    # At an end of a piece that is an extreme, the slope has no root.
    low, high = (_GRID[np.clip(at + beside, 0, len(_GRID) - 1)] for beside in (-1, 1))
    return np.clip(_polished(slopes, _GRID[at], low, high), -1, 1), values


def _polished(
    coefficients: Float[Array, "pieces powers"],
    place: Float[Array, " pieces"],
    low: Float[Array, " pieces"],
    high: Float[Array, " pieces"],
) -> Float[Array, " pieces"]:
    """Roots of polynomials by Newton's method from places, each within bounds of its own."""
    slopes = coefficients @ _DERIVED.T
    for _ in range(_STEPS):
        slope = _polynomial_values(place, slopes)
        step = np.divide(_polynomial_values(place, coefficients), slope, out=np.zeros_like(place), where=slope != 0)
        place = np.clip(place - step, low, high)
    return place


def _extremes(models: list[_SectionPoints]) -> dict[tuple[int, str], tuple[float, float]]:
    """By order and name the largest or least value on each piece, and its error."""
    models = [model for model in models if model.piece.what != "cusps"]
    heights = _heights(models)
    place, values = _peaks(heights)
    best, tail = _polynomial_values(place, values), _tails(values)
    noise = np.array([model.points.angle_error.max() for model in models])
    # A polynomial through values that are mostly noise overshoots: then the sample is as good as it.
    overshoot = np.where(tail > 3 * noise, np.abs(best - heights.max(axis=1, initial=-np.inf)), 0.0)
    error = noise + tail + overshoot
    return {
        model.piece[:2]: (_EXTREMES[model.piece.what][1] * value, doubt)
        for model, value, doubt in zip(models, best.tolist(), error.tolist(), strict=True)
    }


def _cusps(models: list[_SectionPoints]) -> list[_Root]:
    """Places where the caustic's speed along its tangent changes sign, on each piece the one next to its middle.

    The caustic's velocity is along the major axis everywhere; at a cusp its component there vanishes.
    """
    if not models:
        return []
    direction, major, depth = (
        np.stack([getattr(model.points, field) for model in models]) for field in ("direction", "major", "depth")
    )
    speed = np.vecdot(_SPEEDS @ direction, _oriented(major))
    values = _fitted(speed)
    which, place = _next_root(values)
    values = values[which]
    slope = np.abs(_polynomial_values(place, values @ _DERIVED.T))
    # The tip moves with the square of the parameter's error, the tail over the slope.
    with np.errstate(divide="ignore"):
        error = _tails(values) ** 2 / slope
    depth = _polynomial_values(place, _fitted(depth)[which])
    roots: list[_Root] = []
    for i, *numbers in zip(which.tolist(), place.tolist(), depth.tolist(), error.tolist(), strict=True):
        order, _, middle, half = models[i].piece
        root = _Root(order, middle + half * numbers[0], *numbers[1:])
        # Neighbouring pieces may share one.
        if not any(known.order == order and abs(known.edge_phase - root.edge_phase) < 1e-3 * half for known in roots):
            roots.append(root)
    return roots


def _next_root(coefficients: Float[Array, "pieces powers"]) -> tuple[Int[Array, " found"], Float[Array, " found"]]:
    """Polynomials that change sign, by their numbers, and for each the root next to 0."""
    on_grid = coefficients @ _ON_GRID.T
    changed: Bool[Array, "pieces steps"] = (on_grid[:, 1:] > 0) != (on_grid[:, :-1] > 0)
    which = np.flatnonzero(changed.any(axis=1))
    middle = np.abs(_GRID[1:] + _GRID[:-1])
    step = np.argmin(np.where(changed[which], middle, np.inf), axis=1)
    low, high = _GRID[step], _GRID[step + 1]
    before, after = on_grid[which, step], on_grid[which, step + 1]
    return which, _polished(coefficients[which], low + (high - low) * before / (before - after), low, high)
