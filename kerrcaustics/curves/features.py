"""Cusps and extremes of caustics, from a polynomial model of a short piece of the curve around each.

Around a cusp or an extreme the curve is traced at Chebyshev nodes of its parameter. All that is read off is a
smooth function there, so the interpolating polynomial is as accurate as the beams themselves.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from kerrcaustics.curves.critical_curves import CriticalCurve, between
from kerrcaustics.curves.critical_points import Points, Search
from kerrcaustics.shapes import Float

Array = np.ndarray

NODES = chebyshev.chebpts1(17)
_TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(NODES, len(NODES) - 1))
"""Places of the points on a piece, from -1 to 1."""
_EXTREMES = {
    "theta_min": ("theta", -1),
    "theta_max": ("theta", 1),
    "phi_min": ("azimuth", -1),
    "phi_max": ("azimuth", 1),
}


@dataclass
class Features:
    """The features of one caustic.

    extremes: value and error of those that were found, by name; cusps: their points, with the error of (theta',
    azimuth) of each, radians; lost_cusps: how many could not be traced.
    """

    extremes: dict[str, tuple[float, float]]
    cusps: list[tuple[Points, float]]
    lost_cusps: int


# A short piece of one curve: its order, what is looked for in it, its middle and half-width in `edge_phase`.
_Piece = tuple[int, str, float, float]
# Order, parameter and depth of a cusp, and the error of its place that comes from the parameter.
_Root = tuple[int, float, float, float]


def find_features(search: Search, curves: Iterable[CriticalCurve]) -> dict[int, Features]:
    """The cusps and the four extremes of each curve, by order.

    Curves that are not much larger than their error have none: the search would find only noise.
    """
    features = {curve.order: Features({}, [], 0) for curve in curves}
    roots: list[_Root] = []
    for piece, points in _models(search, curves, (*_EXTREMES, "cusps")):
        order, what, _, half = piece
        if points is None:
            features[order].lost_cusps += what == "cusps"
        elif what == "cusps":
            roots += [r for r in _cusp(piece, points) if not any(_same_root(r, known, half) for known in roots)]
        else:
            features[order].extremes[what] = _extreme(points, *_EXTREMES[what])
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
    models = _models(search, curves, tuple(_EXTREMES))
    places = {(order, name): points for (order, name, *_), points in models if points is not None}
    return {key: (points, _place(points, *_EXTREMES[key[1]])) for key, points in places.items()}


def _same_root(first: _Root, second: _Root, half: float) -> bool:
    """True for a root that two neighbouring pieces share."""
    return bool(first[0] == second[0] and abs(first[1] - second[1]) < 1e-3 * half)


def _pieces(curve: CriticalCurve, around: Points) -> list[_Piece]:
    points, n = curve.points, len(curve.points)
    pieces = []
    for name, (field, sign) in _EXTREMES.items():
        pieces.append(_piece(curve.order, name, around, n + int(np.argmax(sign * getattr(points, field)))))
    for i in _reversals(points):
        pieces.append(_piece(curve.order, "cusps", around, n + i))
    return pieces


def _piece(order: int, what: str, around: Points, i: int) -> _Piece:
    """The piece from the point before point i to the one after it."""
    low, high = around.edge_phase[i - 1], around.edge_phase[i + 1]
    return order, what, (low + high) / 2, (high - low) / 2


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


def _oriented(axes: Float[Array, "points 3"]) -> Float[Array, "points 3"]:
    """Axes with signs chosen so that each agrees with the one before."""
    agree = np.sign(np.einsum("ij,ij->i", axes[1:], axes[:-1]))
    return axes * np.concatenate([[1.0], np.cumprod(np.where(agree == 0, 1.0, agree))])[:, None]


def _models(
    search: Search, curves: Iterable[CriticalCurve], features: tuple[str, ...]
) -> list[tuple[_Piece, Points | None]]:
    """The pieces of resolved curves around these features, each with its points at its Chebyshev nodes: in one go."""
    around = {curve.order: curve.around() for curve in curves if curve.is_resolved}
    every = [_pieces(curve, around[curve.order]) for curve in curves if curve.is_resolved]
    pieces = [piece for of_curve in every for piece in of_curve if piece[1] in features]
    if not pieces:
        return []
    edge_phases = {
        order: np.unique(np.concatenate([middle + half * NODES for k, _, middle, half in pieces if k == order]))
        for order in around
    }
    traced = between(search, around, edge_phases)
    models: list[tuple[_Piece, Points | None]] = []
    for piece in pieces:
        order, _, middle, half = piece
        points = traced[order]
        wanted = middle + half * NODES
        at = np.searchsorted(points.edge_phase, wanted)
        whole = (at < len(points)).all() and np.array_equal(points.edge_phase[np.minimum(at, len(points) - 1)], wanted)
        models.append((piece, points[at] if whole else None))
    return models


def fitted(values: Float[Array, " nodes *axes"]) -> Float[Array, " nodes *axes"]:
    """The Chebyshev coefficients of values at `NODES`."""
    return np.asarray(np.tensordot(_TO_COEFFICIENTS, values, axes=1))


def _roots(coefficients: Float[Array, " powers"]) -> Float[Array, " roots"]:
    """Real roots in [-1, 1], a little round-off allowed."""
    if not np.abs(coefficients[1:]).max() > 0:
        return np.empty(0)
    roots = chebyshev.chebroots(coefficients)
    real = roots.real[np.abs(roots.imag) < 1e-7]
    return real[np.abs(real) <= 1 + 1e-9]


def _tail(coefficients: Float[Array, " powers"]) -> float:
    """The distance of a polynomial from convergence: its last coefficients."""
    return float(np.abs(coefficients[-3:]).max())


def _extreme(points: Points, field: str, sign: int) -> tuple[float, float]:
    """The largest value of sign * field on the piece, as the value of the field, and its error."""
    samples = getattr(points, field)
    values = fitted(samples)
    best = float(chebyshev.chebval(_place(points, field, sign), values))
    noise, tail = points.angle_error.max(), _tail(values)
    # A polynomial through values that are mostly noise overshoots: then the sample is as good as it.
    overshoot = abs(best - samples[np.argmax(sign * samples)]) if tail > 3 * noise else 0.0
    return best, float(noise + tail + overshoot)


def _place(points: Points, field: str, sign: int) -> float:
    """The place of that on the piece, from -1 to 1."""
    values = fitted(getattr(points, field))
    places = np.concatenate([_roots(chebyshev.chebder(values)), [-1.0, 1.0]])
    return float(places[np.argmax(sign * chebyshev.chebval(places, values))])


def _cusp(piece: _Piece, points: Points) -> list[_Root]:
    """The place where the caustic's speed along its tangent changes sign, if it does on this piece.

    The caustic's velocity is along the major axis everywhere; at a cusp its component there vanishes.
    """
    velocity = chebyshev.chebval(NODES, chebyshev.chebder(fitted(points.direction))).T
    speed = fitted(np.einsum("ij,ij->i", velocity, _oriented(points.major)))
    roots = _roots(speed)
    if roots.size == 0:
        return []
    place = float(roots[np.argmin(np.abs(roots))])
    slope = abs(float(chebyshev.chebval(place, chebyshev.chebder(speed))))
    depth = float(chebyshev.chebval(place, fitted(points.depth)))
    # The tip moves with the square of the parameter's error, _tail / slope.
    order, _, middle, half = piece
    return [(order, middle + half * place, depth, _tail(speed) ** 2 / slope)]
