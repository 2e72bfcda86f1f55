"""Events of a star on its way round a circle of the celestial sphere, at caustics, and the image counts in between.

Between two crossings, in the order of their longitude, the number of images of each index does not change: it is read
off the winding of the caustics.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from kerrcaustics.curves.critical_curves import CriticalCurve, CriticalCurves, points_between
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.images.search import on_rings, ring_remark
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.circles import Circle

Array = np.ndarray
# Of path_events, one entry each.
_Orders = Int[Array, " events"]
_Angles = Float[Array, " events"]
_Marks = Bool[Array, " events"]

_TURN = 2 * math.pi
# Steps of Newton's method along a caustic, with the slope of a spline.
_NEWTON_STEPS = 5
# A fold is taken for a cusp where their heights differ by less than so many errors; looked at where the caustic is as
# level as this.
_CUSP_ERRORS, _LEVEL = 10.0, 0.03
# Nodes of a piece of a caustic around an extreme of the height.
_NODES = 17
# Events closer in longitude (radians) than this, or than so many of their errors, count as simultaneous.
_SAME, _SAME_ERRORS = 1e-10, 4.0
# Simultaneous events that counts distinguish, at most.
_MOST_TOGETHER = 8
# How far on both sides of a caustic that is a point, radians of longitude, images are not followed. On a circle smaller
# than this (radians) a star stands still.
_BESIDE_RING, STILL = 1e-4, 1e-12


@dataclass(frozen=True)
class PathEvents:
    """Events, where images of a star meet on critical curves, in the order of longitude within one turn.

    order: order of the critical curve.
    points: points of the critical curves.
    longitude: longitude of the star in [0, 2 pi).
    error: error of the longitude, radians.
    at_cusp: True where the star passes a cusp.
    side: +1 where the pair lies at larger longitude, -1 at smaller.
    known: True where the counts bear this out.
    boundary: number of the boundary, whose events are simultaneous.
    gap_low: longitude of the lower end of gap i, above boundary i.
    gap_high: longitude of the upper end of gap i.
    counts: numbers of images in the gaps.
    ring: by boundary and index, True where images are part of a ring, as the star passes a caustic that is a point.
    remarks: remarks on what is in doubt.
    second_arrival: True for second arrivals, at a sphere within the camera's radius.
    """

    order: Int[Array, " events"]
    points: Points
    longitude: Float[Array, " events"]
    error: Float[Array, " events"]
    at_cusp: Bool[Array, " events"]
    side: Int[Array, " events"]
    known: Bool[Array, " events"]
    boundary: Int[Array, " events"]
    gap_low: Float[Array, " gaps"]
    gap_high: Float[Array, " gaps"]
    counts: Int[Array, "gaps indices"]
    ring: Bool[Array, "gaps indices"]
    remarks: tuple[str, ...]
    second_arrival: Bool[Array, " events"]

    @property
    def none(self) -> bool:
        """True where all images are followed through the whole turn."""
        return len(self.order) == 0 and not self.ring.any()


def path_events(sheets: Sheets, circle: Circle) -> PathEvents:
    """All points of the caustics that bound the sheets on a star's circle, and the counts between them."""
    curves = sheets.curves
    passed = [curve for curve in curves if curve.is_point and _near_point(curve, circle)]
    remarks = [f"{ring_remark(sheets.camera, sheets.surface, curve, 'passes')} to a camera at rest" for curve in passed]
    wide = {curve.order: curve.over_three_turns() for curve in curves if not curve.is_point}
    added, doubts = _extremes(curves, wide, circle)
    wide = {k: _merged(points, added[k]) for k, points in wide.items()}
    order, edge_phase = _roots(curves, wide, circle)
    points = _polished(curves, wide, order, edge_phase) if len(order) else curves.curves[0].points[:0]
    good = points.on_curve()
    remarks += [f"an event of order {k} could not be refined" for k in order[~good].tolist()]
    error, at_cusp = _longitude_error(wide, order[good], points[good], circle)
    events = order[good], points[good], error, at_cusp
    return _arranged(sheets, circle, events, _ringed(passed, circle), [*remarks, *doubts])


def _grazed(order: int) -> str:
    return f"the star grazes the caustic of order {order}: a pair of events there may be missing"


def _near_point(curve: CriticalCurve, circle: Circle) -> bool:
    heights = circle.height(curve.points.direction)
    return bool(heights.min() <= curve.blur and heights.max() >= -curve.blur)


def _ringed(passed: list[CriticalCurve], circle: Circle) -> tuple[Float[Array, " rings"], Int[Array, " rings"]]:
    """Longitudes at which the star passes caustics that are points, and their orders; none where it stands still."""
    if math.sin(circle.angle) < STILL or not passed:
        return np.empty(0), np.empty(0, int)
    middle = np.array([curve.points.direction.mean(axis=0) for curve in passed])
    return circle.longitude(middle) % _TURN, np.array([curve.order for curve in passed])


def _merged(points: Points, more: Points | None) -> Points:
    if more is None:
        return points
    points = points.joined(more)
    return points[np.argsort(points.edge_phase, kind="stable")]


def _extremes(
    curves: CriticalCurves, wide: dict[int, Points], circle: Circle
) -> tuple[dict[int, Points | None], list[str]]:
    """Points at extremes of the height where the caustic may reach the circle between its points."""
    added: dict[int, Points | None] = dict.fromkeys(wide)
    remarks = []
    nodes = chebyshev.chebpts1(_NODES)
    for k, points in wide.items():
        height = circle.height(points.direction)
        before, here, after = height[:-2], height[1:-1], height[2:]
        turned = (np.abs(here) <= np.abs(before)) & (np.abs(here) <= np.abs(after))
        turned &= (here * before > 0) & (here * after > 0)
        turned &= np.abs(here) < np.maximum(np.abs(after - here), np.abs(before - here))
        inner = (points.edge_phase[1:-1] >= 0) & (points.edge_phase[1:-1] < _TURN)
        for i in 1 + np.flatnonzero(turned & inner):
            low, high = points.edge_phase[i - 1], points.edge_phase[i + 1]
            traced = points_between(curves.search(), {k: points}, {k: (low + high) / 2 + (high - low) / 2 * nodes})[k]
            if len(traced) < _NODES:
                remarks.append(_grazed(k))
                continue
            values = chebyshev.chebfit(nodes, circle.height(traced.direction), _NODES - 1)
            roots = chebyshev.chebroots(chebyshev.chebder(values))
            places = roots.real[(np.abs(roots.imag) < 1e-7) & (np.abs(roots.real) < 1)]
            best = places[np.argmin(chebyshev.chebval(places, values) * np.sign(height[i]))] if places.size else 0.0
            top = float(chebyshev.chebval(best, values))
            if abs(top) <= 4 * traced.error.max() + np.abs(values[-3:]).max():
                remarks.append(_grazed(k))
            elif top * height[i] < 0:
                edge_phase = np.array([(low + high) / 2 + (high - low) / 2 * best])
                peak = _polished(curves, wide, np.array([k]), edge_phase)
                more = peak.joined(peak.shifted(1), peak.shifted(-1))
                added[k] = _merged(more, added[k])
    return added, remarks


def _roots(curves: CriticalCurves, wide: dict[int, Points], circle: Circle) -> tuple[_Orders, _Angles]:
    """Order and parameter of the points of the caustics that lie on the circle."""
    brackets = [_brackets(k, points, circle) for k, points in wide.items()]
    if sum(len(part[0]) for part in brackets) == 0:
        return np.empty(0, int), np.empty(0)
    orders, start, end = (np.concatenate(parts) for parts in zip(*brackets, strict=True))

    def height(edge_phase: _Angles, which: _Orders) -> _Angles:
        return circle.height(_polished(curves, wide, which, edge_phase).direction)

    edge_phase = _guessed(wide, orders, start, end, circle)
    lost = np.ones(len(edge_phase), bool)
    for _ in range(_NEWTON_STEPS):
        points = _polished(curves, wide, orders[lost], edge_phase[lost])
        miss = circle.height(points.direction)
        far = np.abs(miss) > 2 * points.error
        lost[lost] = far
        if not far.any():
            break
        slope = np.array(
            [_heights(wide[k], circle)(t, 1) for k, t in zip(orders[lost].tolist(), edge_phase[lost], strict=True)]
        )
        edge_phase[lost] -= miss[far] / np.where(slope == 0, 1, slope)
        edge_phase[lost] = np.clip(edge_phase[lost], start[lost], end[lost])
    lost &= start < end
    if lost.any():
        bracket = (start[lost], end[lost])
        root = bracketed_roots(height, bracket, (orders[lost],), absolute=1e-15, relative=4e-16)
        edge_phase[lost] = root.x
    return orders, edge_phase


def _brackets(order: int, points: Points, circle: Circle) -> tuple[_Orders, _Angles, _Angles]:
    """Order, and pairs of parameters between which the caustic passes through the circle.

    Both are the same where a point lies on it: of several neighbours that do, within their error, the closest.
    """
    height = circle.height(points.direction)
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
    within = (points.edge_phase[i] >= 0) & (points.edge_phase[i] < _TURN)
    return np.full(within.sum(), order), points.edge_phase[i[within]], points.edge_phase[j[within]]


def _heights(points: Points, circle: Circle) -> Spline:
    return Spline(points.edge_phase, circle.height(points.direction))


def _guessed(wide: dict[int, Points], order: _Orders, low: _Angles, high: _Angles, circle: Circle) -> _Angles:
    """Parameters where splines through the points have the height 0."""
    edge_phase = (low + high) / 2
    for k in np.unique(order).tolist():
        here = (order == k) & (low < high)
        if here.any():
            root = bracketed_roots(_heights(wide[k], circle), (low[here], high[here]))
            edge_phase[here] = np.where(root.found, root.x, edge_phase[here])
    return edge_phase


def _polished(curves: CriticalCurves, wide: dict[int, Points], order: _Orders, edge_phase: _Angles) -> Points:
    """Critical points of the given orders on the given lines."""
    depth = np.empty(len(edge_phase))
    for k in np.unique(order).tolist():
        here = order == k
        depth[here] = Spline(wide[k].edge_phase, wide[k].depth)(edge_phase[here])
    return curves.search().polished(edge_phase, order, depth)


def _longitude_error(wide: dict[int, Points], order: _Orders, points: Points, circle: Circle) -> tuple[_Angles, _Marks]:
    """Errors of the longitude at which the caustic passes through the circle, and where that is at a cusp.

    Where the caustic runs along the circle its longitude is uncertain, but for a cusp that points along it: there,
    with the parameter s, the longitude changes by A s^2, the height by B s^3, so that their ratio is 1.5 B s / A.
    """
    height = circle.height(points.direction)
    sine = np.sin(circle.angle - height)
    up, right = (np.einsum("ij,ij->i", points.major, e) for e in circle.upward_and_east(points.direction))
    at_cusp, aside = np.zeros(len(order), bool), np.zeros(len(order))
    for i in np.flatnonzero(np.abs(up) < _LEVEL):
        around, edge_phase = wide[order[i]], points.edge_phase[i]
        east = circle.upward_and_east(points.direction[i])[1]
        # Second derivative of the longitude where the caustic stands still.
        a = float(Spline(around.edge_phase, around.direction @ east)(edge_phase, 2)) / sine[i] / 2
        b = float(_heights(around, circle)(edge_phase, 3)) / 6
        s = up[i] / (right[i] * sine[i]) * a / (1.5 * b) if b else np.inf
        at_cusp[i], aside[i] = abs(b * s**3) < _CUSP_ERRORS * points.error[i], abs(a * s**2)
    slope = np.abs(right / np.where(at_cusp, 1, up))
    fold = (points.error * np.hypot(1, slope) + np.abs(height) * slope) / np.maximum(sine, points.error)
    return np.where(at_cusp, points.error / np.maximum(sine, points.error) + aside, fold), at_cusp


def _arranged(
    sheets: Sheets,
    circle: Circle,
    events: tuple[_Orders, Points, _Angles, _Marks],
    rings: tuple[Float[Array, " rings"], Int[Array, " rings"]],
    remarks: list[str],
) -> PathEvents:
    """PathEvents in the order of longitude, with the gaps between them and the counts there.

    Parameters: events, their order, points, errors, and which are cusps; rings, longitudes and orders.
    """
    order, points, error, at_cusp = events
    longitude = circle.longitude(points.direction) % _TURN
    way = np.argsort(longitude)
    order, points, longitude, error, at_cusp = order[way], points[way], longitude[way], error[way], at_cusp[way]
    boundary, ringed, low, high = _boundaries(longitude, np.maximum(_SAME, _SAME_ERRORS * error), rings[0])
    counted = sheets.expected_counts(circle.place((low + high) / 2))
    counts = counted.expected
    if counted.on_caustic.any():
        remarks = [*remarks, "some image counts are not known: a caustic runs along the star's path"]
    ring = np.zeros_like(counted.on_caustic)
    ring[ringed, rings[1] - 1] = True
    side, known = np.zeros(len(longitude), int), np.zeros(len(longitude), bool)
    for i in np.unique(boundary).tolist():
        members = np.flatnonzero(boundary == i)
        side[members], known[members] = _sides(order[members], counts[i] - counts[i - 1])
    of_events = order, points, longitude, error, at_cusp, side, known, boundary
    _, second_arrival = sheets.curves.domain.line_of_sight(points.edge_phase, points.depth)
    return PathEvents(*of_events, low, high, counts, on_rings(ring), tuple(remarks), second_arrival)


def _boundaries(
    events: _Angles, same: _Angles, rings: Float[Array, " rings"]
) -> tuple[Int[Array, " events"], Int[Array, " rings"], Float[Array, " gaps"], Float[Array, " gaps"]]:
    """The boundary that each event and each ring belongs to, and the lower and upper ends of the gaps in between.

    Parameters: events, longitudes, rising; same, how close to them others belong to them; rings, longitudes.
    """
    if len(events) + len(rings) == 0:
        return np.empty(0, int), np.empty(0, int), np.array([0.0]), np.array([_TURN])
    longitude = np.concatenate([events, rings])
    beside = np.concatenate([np.zeros(len(events)), np.full(len(rings), _BESIDE_RING)])
    reach = np.concatenate([same, np.full(len(rings), 2 * _BESIDE_RING)])
    way = np.argsort(longitude, kind="stable")
    apart = np.diff(longitude[way]) > np.maximum(reach[way][1:], reach[way][:-1])
    boundary = np.empty(len(way), int)
    boundary[way] = np.concatenate([[0], np.cumsum(apart)])
    last, first = np.full((2, boundary.max() + 1), -np.inf)
    np.maximum.at(last, boundary, longitude + beside)
    np.maximum.at(first, boundary, beside - longitude)
    return boundary[: len(events)], boundary[len(events) :], last, np.append(-first[1:], _TURN - first[0])


def _sides(order: Int[Array, " pairs"], change: Int[Array, " indices"]) -> tuple[Int[Array, " pairs"], bool]:
    """The side of each of several simultaneous pairs, from the change of the counts toward larger longitude."""
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
