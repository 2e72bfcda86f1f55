"""Where a star, on its way round the sky of an orbiting camera, crosses caustics, and the image counts in between.

A star keeps its theta', so the crossings are the points of the caustics with that theta'. Between two of them, in the
order of their azimuth, the number of images of each index does not change: it is read off the winding of the caustics.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from scipy.interpolate import CubicSpline
from scipy.optimize import elementwise

from kerrcaustics.curves.critical import Points
from kerrcaustics.curves.follow import Course, between
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.stars.sheets import Sheets

Array = np.ndarray

_TURN = 2 * math.pi
# Steps of Newton's method along a caustic, with the slope of a spline; and halvings that find a first guess on it.
_NEWTON_STEPS, _HALVINGS = 5, 40
# A fold is taken for a cusp where their heights differ by less than so many errors; looked at where the caustic is as
# level as this.
_CUSP_ERRORS, _LEVEL = 10.0, 0.03
# Nodes of a piece of a caustic around an extreme of theta'.
_NODES = 17
# Events closer in azimuth (radians) than this, or than so many of their errors, count as simultaneous.
_SAME, _SAME_ERRORS = 1e-10, 4.0
# Simultaneous events that are told apart by counts, at most.
_MOST_TOGETHER = 8


@dataclass(frozen=True)
class Meetings:
    """Where images of a star meet on critical curves: one entry each, in the order of azimuth within one turn.

    order; points: of the critical curves; azimuth: in [0, 2 pi); error: of it; at_cusp; side: +1 where the pair lies at
    larger azimuth, -1 at smaller; known: True where the counts bear this out. boundary: entries of one boundary are
    simultaneous. gap_low, gap_high: azimuth of the ends of the gaps between the boundaries, gap i above boundary i; and
    counts (gaps, indices): images there.
    """

    order: Array
    points: Points
    azimuth: Array
    error: Array
    at_cusp: Array
    side: Array
    known: Array
    boundary: Array
    gap_low: Array
    gap_high: Array
    counts: Array
    remarks: tuple[str, ...]


def meetings(sheets: Sheets, theta: float) -> Meetings:
    """All points of the caustics that bound the sheets at the height of a star, and the counts between them."""
    courses = [Course(edge.order, edge.points, True, ()) for edge in sheets.edges[: len(sheets.sheets)]]
    remarks = [_grazed(c.order) for c in courses if c.is_point and _near_point(c, theta)]
    wide = {course.order: course.around() for course in courses if not course.is_point}
    added, doubts = _extremes(sheets, wide, theta)
    wide = {k: _merged(points, added[k]) for k, points in wide.items()}
    order, turn = _roots(sheets, wide, theta)
    points = _polished(sheets, wide, order, turn) if len(order) else sheets.edges[0].points[:0]
    good = points.on_curve()
    remarks += [f"an event of order {k} could not be refined" for k in order[~good].tolist()]
    error, at_cusp = _azimuth_error(wide, order[good], points[good], theta)
    return _arranged(sheets, theta, order[good], points[good], error, at_cusp, [*remarks, *doubts])


def _grazed(order: int) -> str:
    return f"the star grazes the caustic of order {order}: two events there that undo each other cannot be told"


def _near_point(course: Course, theta: float) -> bool:
    heights = course.points.theta - theta
    return bool(heights.min() <= 3 * course.points.error.max() and heights.max() >= -3 * course.points.error.max())


def _merged(points: Points, more: Points | None) -> Points:
    if more is None:
        return points
    points = points.joined(more)
    return points[np.argsort(points.turn, kind="stable")]


def _extremes(sheets: Sheets, wide: dict[int, Points], theta: float) -> tuple[dict[int, Points | None], list[str]]:
    """Points at extremes of theta' where the caustic may reach the star's height between its points."""
    added: dict[int, Points | None] = dict.fromkeys(wide)
    remarks = []
    nodes = chebyshev.chebpts1(_NODES)
    for k, points in wide.items():
        height = points.theta - theta
        before, here, after = height[:-2], height[1:-1], height[2:]
        turned = (np.abs(here) <= np.abs(before)) & (np.abs(here) <= np.abs(after))
        turned &= (here * before > 0) & (here * after > 0)
        turned &= np.abs(here) < np.maximum(np.abs(after - here), np.abs(before - here))
        inner = (points.turn[1:-1] >= 0) & (points.turn[1:-1] < _TURN)
        for i in 1 + np.flatnonzero(turned & inner):
            low, high = points.turn[i - 1], points.turn[i + 1]
            traced = between(sheets.search, {k: points}, {k: (low + high) / 2 + (high - low) / 2 * nodes})[k]
            if len(traced) < _NODES:
                remarks.append(_grazed(k))
                continue
            values = chebyshev.chebfit(nodes, traced.theta - theta, _NODES - 1)
            roots = chebyshev.chebroots(chebyshev.chebder(values))
            places = roots.real[(np.abs(roots.imag) < 1e-7) & (np.abs(roots.real) < 1)]
            best = places[np.argmin(chebyshev.chebval(places, values) * np.sign(height[i]))] if places.size else 0.0
            top = float(chebyshev.chebval(best, values))
            if abs(top) <= 4 * traced.error.max() + np.abs(values[-3:]).max():
                remarks.append(_grazed(k))
            elif top * height[i] < 0:
                turn = np.array([(low + high) / 2 + (high - low) / 2 * best])
                peak = _polished(sheets, wide, np.array([k]), turn)
                more = peak.joined(peak.shifted(1), peak.shifted(-1))
                added[k] = _merged(more, added[k])
    return added, remarks


def _roots(sheets: Sheets, wide: dict[int, Points], theta: float) -> tuple[Array, Array]:
    """Order and parameter of the points of the caustics where theta' passes through the star's."""
    found = [_brackets(k, points, theta) for k, points in wide.items()]
    if sum(len(part[0]) for part in found) == 0:
        return np.empty(0, int), np.empty(0)
    orders, start, end = (np.concatenate(parts) for parts in zip(*found, strict=True))

    def height(turn: Array, which: Array) -> Array:
        return _polished(sheets, wide, which, turn).theta - theta

    turn = _guessed(wide, orders, start, end, theta)
    lost = np.ones(len(turn), bool)
    for _ in range(_NEWTON_STEPS):
        points = _polished(sheets, wide, orders[lost], turn[lost])
        miss = points.theta - theta
        far = np.abs(miss) > 2 * points.error
        lost[lost] = far
        if not far.any():
            break
        slope = np.array([_heights(wide[k])(t, 1) for k, t in zip(orders[lost].tolist(), turn[lost], strict=True)])
        turn[lost] -= miss[far] / np.where(slope == 0, 1, slope)
        turn[lost] = np.clip(turn[lost], start[lost], end[lost])
    lost &= start < end
    if lost.any():
        bracket = (start[lost], end[lost])
        root = elementwise.find_root(height, bracket, args=(orders[lost],), tolerances={"xatol": 1e-15, "xrtol": 4e-16})
        turn[lost] = np.asarray(root.x)
    return orders, turn


def _brackets(order: int, points: Points, theta: float) -> tuple[Array, Array, Array]:
    """Order, and pairs of parameters between which the caustic passes through the height.

    Both are the same where a point has that height: of several neighbours that do, within their error, the closest.
    """
    height = points.theta - theta
    level = np.flatnonzero(np.abs(height) <= points.error)
    runs = np.split(level, np.flatnonzero(np.diff(level) > 1) + 1)
    roots = np.array([run[np.argmin(np.abs(height[run]))] for run in runs if run.size], int)
    kept = np.setdiff1d(np.arange(len(height)), level)
    i, j = kept[:-1], kept[1:]
    passed = (height[i] > 0) != (height[j] > 0)
    i, j = i[passed], j[passed]
    # A level run between both ends holds the root.
    for root in roots.tolist():
        inside = (i < root) & (root < j)
        i, j = np.where(inside, root, i), np.where(inside, root, j)
    within = (points.turn[i] >= 0) & (points.turn[i] < _TURN)
    return np.full(within.sum(), order), points.turn[i[within]], points.turn[j[within]]


def _heights(points: Points) -> CubicSpline:
    return CubicSpline(points.turn, points.theta)


def _guessed(wide: dict[int, Points], order: Array, low: Array, high: Array, theta: float) -> Array:
    """Parameters (n,) where splines through the points have the height theta, by halving."""
    turn = (low + high) / 2
    for k in np.unique(order).tolist():
        here = order == k
        height = _heights(wide[k])
        below, above = low[here], high[here]
        rising = height(above) > height(below)
        for _ in range(_HALVINGS):
            middle = (below + above) / 2
            passed = (height(middle) >= theta) == rising
            below, above = np.where(passed, below, middle), np.where(passed, middle, above)
        turn[here] = (below + above) / 2
    return turn


def _polished(sheets: Sheets, wide: dict[int, Points], order: Array, turn: Array) -> Points:
    """Critical points of the given orders on the given lines."""
    depth = np.empty(len(turn))
    for k in np.unique(order).tolist():
        here = order == k
        depth[here] = CubicSpline(wide[k].turn, wide[k].depth)(turn[here])
    return sheets.search.polished(turn, order, depth)


def _azimuth_error(wide: dict[int, Points], order: Array, points: Points, theta: float) -> tuple[Array, Array]:
    """Errors (n,) of the azimuth at which the caustic passes through the height theta, and where that is at a cusp.

    Where the caustic runs along the star's path its azimuth is uncertain, but for a cusp that points along it: there,
    with the parameter s, the azimuth changes by A s^2, the height by B s^3, so that their ratio is 1.5 B s / A.
    """
    sine, cosine = np.sin(points.theta), np.cos(points.theta)
    phi = np.arctan2(points.direction[:, 1], points.direction[:, 0])
    east = points.major[:, 1] * np.cos(phi) - points.major[:, 0] * np.sin(phi)
    south = cosine * (points.major[:, 0] * np.cos(phi) + points.major[:, 1] * np.sin(phi)) - sine * points.major[:, 2]
    at_cusp, aside = np.zeros(len(order), bool), np.zeros(len(order))
    for i in np.flatnonzero(np.abs(south) < _LEVEL):
        around, turn = wide[order[i]], points.turn[i]
        a = float(CubicSpline(around.turn, around.azimuth)(turn, 2)) / 2
        b = float(_heights(around)(turn, 3)) / 6
        s = south[i] / (east[i] * sine[i]) * a / (1.5 * b) if b else np.inf
        at_cusp[i], aside[i] = abs(b * s**3) < _CUSP_ERRORS * points.error[i], abs(a * s**2)
    slope = np.abs(east / np.where(at_cusp, 1, south))
    fold = (points.error * np.hypot(1, slope) + np.abs(points.theta - theta) * slope) / np.maximum(sine, points.error)
    return np.where(at_cusp, points.angle_error + aside, fold), at_cusp


def _arranged(
    sheets: Sheets, theta: float, order: Array, points: Points, error: Array, at_cusp: Array, remarks: list[str]
) -> Meetings:
    """Meetings in the order of azimuth, with the gaps between them and the counts there."""
    azimuth = points.azimuth % _TURN
    way = np.argsort(azimuth)
    order, points, azimuth, error, at_cusp = order[way], points[way], azimuth[way], error[way], at_cusp[way]
    same = np.maximum(_SAME, _SAME_ERRORS * error)
    apart = np.diff(azimuth) > np.maximum(same[1:], same[:-1])
    boundary = np.concatenate([[0], np.cumsum(apart)]) if len(azimuth) else np.empty(0, int)
    first = np.flatnonzero(np.concatenate([[True], apart])) if len(azimuth) else np.empty(0, int)
    last = np.append(first[1:] - 1, len(azimuth) - 1) if len(azimuth) else first
    if len(azimuth):
        low, high = azimuth[last], np.append(azimuth[first[1:]], azimuth[0] + _TURN)
    else:
        low, high = np.array([0.0]), np.array([_TURN])
    counts, touching = sheets.expected(from_angles(np.full(len(low), theta), (low + high) / 2))
    if touching.any():
        remarks = [*remarks, "some image counts could not be told: a caustic runs along the star's path"]
    side, known = np.zeros(len(azimuth), int), np.zeros(len(azimuth), bool)
    for i in range(len(first)):
        members = np.flatnonzero(boundary == i)
        side[members], known[members] = _sides(order[members], counts[i] - counts[i - 1])
    return Meetings(order, points, azimuth, error, at_cusp, side, known, boundary, low, high, counts, tuple(remarks))


def _sides(order: Array, change: Array) -> tuple[Array, bool]:
    """On which side each of several simultaneous pairs lies, from the change of the counts toward larger azimuth."""
    pairs = np.zeros((len(order), len(change) + 1), int)
    pairs[np.arange(len(order)), order - 1] = 1
    pairs[np.arange(len(order)), order] = 1
    pairs = pairs[:, : len(change)]
    if len(order) > _MOST_TOGETHER:
        return np.ones(len(order), int), False
    signs = np.array(list(itertools.product((1, -1), repeat=len(order))))
    miss = np.abs(signs @ pairs - change).sum(axis=1)
    best = int(np.argmin(miss))
    return signs[best], bool(miss[best] == 0 and (miss == 0).sum() == 1)
