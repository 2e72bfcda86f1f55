"""Caustics next to a disc: sampled so finely there that none is missed, and their distance from its centre."""

from dataclasses import replace

import numpy as np

from kerrcaustics.curves.critical_curves import CriticalCurve, CriticalCurves, points_between
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.numerics.parts import inner_parts
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.sphere import angle_between, lengths

Array = np.ndarray

# Longest step along a caustic that reaches the disc, as a part of its radius or of the distance from its limb.
_PART = 0.25
# Most parts into which a step is divided in one round.
_MOST_PARTS = 16
# Length of a step, in errors of its points, below which it is not divided.
_ERRORS = 30.0
# Rounds of division.
_MOST_ROUNDS = 20


def refined_near(sheets: Sheets, circle: Circle) -> Sheets:
    """Sheets with more points on their caustics next to a circle of the surface."""
    return replace(sheets, curves=curves_near(sheets.curves, circle))


def curves_near(curves: CriticalCurves, circle: Circle) -> CriticalCurves:
    """Curves with more points on their caustics next to a circle of the surface."""
    refined = tuple(curve if curve.is_point else _refined(curves, curve, circle) for curve in curves)
    return replace(curves, curves=refined)


def distance(curve: CriticalCurve, centre: Float[Array, " 3"]) -> float:
    """A lower bound for the distance of a place from a caustic, radians."""
    if curve.is_point:
        return float(lengths(curve.points.direction - centre).min() - curve.blur)
    points = _closed(curve.points)
    away = lengths(points.direction - centre)
    # A caustic that is sampled finely enough leaves its chords by less than half of their length.
    return float((np.minimum(away[1:], away[:-1]) - 0.75 * lengths(np.diff(points.direction, axis=0))).min())


def _refined(curves: CriticalCurves, curve: CriticalCurve, circle: Circle) -> CriticalCurve:
    search, points = curves.search(), curve.points
    for _ in range(_MOST_ROUNDS):
        closed = _closed(points)
        parts = _parts(closed, circle)
        divided = parts > 1
        if not divided.any():
            break
        start, step, parts = closed.edge_phase[:-1][divided], np.diff(closed.edge_phase)[divided], parts[divided]
        which, part = inner_parts(parts)
        new = start[which] + step[which] * part
        around = replace(curve, points=points).over_three_turns()
        more = points_between(search, {curve.order: around}, {curve.order: new})[curve.order]
        if not len(more):
            break
        points = points.joined(more)
        points = points[np.argsort(points.edge_phase, kind="stable")]
    return replace(curve, points=points)


def _closed(points: Points) -> Points:
    return points.joined(points[:1].shifted(1))


def _parts(closed: Points, circle: Circle) -> Array:
    """The number of parts into which each step should be divided."""
    height = np.abs(circle.height(closed.direction))
    step = lengths(np.diff(closed.direction, axis=0))
    away = np.minimum(height[1:], height[:-1])
    longest = _PART * np.maximum(circle.angle, away - step)
    reaching = (away < circle.angle + 2 * step) & (step > _ERRORS * np.maximum(closed.error[1:], closed.error[:-1]))
    return np.where(reaching, np.clip(np.ceil(step / longest), 1, _MOST_PARTS), 1).astype(int)


def touching_radii(sheets: Sheets, centre: Float[Array, " 3"], angle: float) -> Float[Array, " radii"]:
    """Approximate radii of discs about a centre whose limb touches a caustic or passes a cusp."""
    sheets = refined_near(sheets, Circle.from_centre(centre, angle))
    radii = [np.empty(0)]
    for curve in sheets.curves:
        away = angle_between(curve.points.direction, centre)
        if curve.is_point:
            radii.append(away.mean(keepdims=True))
            continue
        turned = np.flatnonzero((away - np.roll(away, 1)) * (away - np.roll(away, -1)) > 0)
        radii.append(_extreme(curve.points.direction, away, turned))
    return np.sort(np.concatenate(radii))


def _extreme(
    place: Float[Array, "n 3"], away: Float[Array, " n"], at: Int[Array, " extremes"]
) -> Float[Array, " extremes"]:
    """Distances at extremes along a closed curve, from the parabola of their squares beside points.

    On a straight line the square of the distance is one.
    """
    before, after = (at - 1) % len(place), (at + 1) % len(place)
    low, high = lengths(place[at] - place[before]), lengths(place[after] - place[at])
    square = away[at] ** 2
    fall, rise = (away[before] ** 2 - square) / low, (away[after] ** 2 - square) / high
    curved = (fall + rise) / (low + high)
    slope = (rise * low - fall * high) / (low + high)
    return np.sqrt(np.maximum(square - slope**2 / (4 * curved), 0))
