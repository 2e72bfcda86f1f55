"""Arcs of critical curves whose caustics lie within a disc: they separate its images of different Morse index."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.curves.critical_curves import CriticalCurve, points_between
from kerrcaustics.extended_sources.arcs.boundary_arcs import NODES, BoundaryArcs
from kerrcaustics.extended_sources.arcs.known_curves import arcs_of_parametric_curve, at_places
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.circles import Circle

Array = np.ndarray

_TURN = 2 * math.pi
# Longest arcs at first, radians of edge phase.
_LONGEST = 0.5


@dataclass(frozen=True)
class LimbCrossings:
    """Crossings of caustics with the limb of a disc: orders, and edge phases of the critical curves, radians."""

    order: Int[Array, " crossings"]
    edge_phase: Float[Array, " crossings"]

    @classmethod
    def empty(cls) -> "LimbCrossings":
        """Crossings of a limb that no caustic crosses."""
        return cls(np.empty(0, int), np.empty(0))


def critical_arcs(
    sheets: Sheets, circle: Circle, crossings: LimbCrossings, curve: CriticalCurve, first: int, tolerance: float
) -> tuple[BoundaryArcs, tuple[str, ...]]:
    """The arcs of a critical curve whose caustic lies within a circle, toward larger edge phase.

    Parameters
    ----------
    sheets : Sheets
        Refined near the circle.
    circle : Circle
        The circle that the limb of the disc is on its surface.
    crossings : LimbCrossings
        Crossings of caustics with it: nodes are numbered like these.
    curve : CriticalCurve
        One of the sheets.
    first : int
        Number of the first node that is not a crossing.
    tolerance : float
        Error of the area, square radians.

    Returns
    -------
    arcs : BoundaryArcs
        Their index is the order of the curve.
    remarks : tuple of str
        One for each doubt.
    """
    phase = crossings.edge_phase % _TURN
    here = np.flatnonzero(crossings.order == curve.order)
    here = here[np.argsort(phase[here])]
    if len(here):
        low = phase[here]
        high, left, right = np.append(low[1:], low[0] + _TURN), here, np.roll(here, -1)
    else:
        low, high, left, right = np.zeros(1), np.full(1, _TURN), np.array([first]), np.array([first])
        first += 1
    inside = _inside(curve, circle, low, high)
    low, high, left, right = low[inside], high[inside], left[inside], right[inside]
    if not len(low):
        return _no_arcs(), ()
    parts = np.ceil((high - low) / _LONGEST).astype(int).tolist()
    ends = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, parts, strict=True)]
    numbers = []
    for a, b, n in zip(left, right, parts, strict=True):
        numbers.append(np.concatenate([[a], first + np.arange(n - 1), [b]]))
        first += n - 1
    low, high = (np.concatenate([e[s] for e in ends]) for s in (slice(None, -1), slice(1, None)))
    left, right = (np.concatenate([e[s] for e in numbers]) for s in (slice(None, -1), slice(1, None)))
    order = np.full(len(low), curve.order)
    arcs = arcs_of_parametric_curve(partial(_trace, sheets, curve), order, low, high, left, right, first, tolerance)
    if arcs is None:
        return _no_arcs(), (f"points of the critical curve of order {curve.order} could not be found",)
    return arcs, ()


def _no_arcs() -> BoundaryArcs:
    number, place = np.empty(0, int), np.empty((0, 3))
    return BoundaryArcs(number, number, number, place, place, np.empty((0, len(NODES), 3)), np.empty(0))


def _inside(
    curve: CriticalCurve, circle: Circle, low: Float[Array, " parts"], high: Float[Array, " parts"]
) -> Bool[Array, " parts"]:
    """True for parts of a caustic that lie within the circle, by the point of each that is farthest from the limb."""
    points = curve.over_three_turns()
    height = circle.height(points.direction)
    inside = np.zeros(len(low), bool)
    for i, (a, b) in enumerate(zip(low, high, strict=True)):
        within = height[(points.edge_phase > a) & (points.edge_phase < b)]
        inside[i] = len(within) > 0 and within[np.argmax(np.abs(within))] > 0
    return inside


def _trace(
    sheets: Sheets, curve: CriticalCurve, low: Float[Array, " arcs"], high: Float[Array, " arcs"]
) -> tuple[Float[Array, "arcs places 3"], Float[Array, " arcs"]] | None:
    """Directions at `PLACES` of arcs, and errors across the curve; None where some are lost."""
    phase = at_places(low, high)
    requested, back = np.unique(phase, return_inverse=True)
    points = points_between(sheets.curves.search(), {curve.order: curve.over_three_turns()}, {curve.order: requested})[
        curve.order
    ]
    if len(points) < len(requested):
        return None
    sky = sheets.sky(points.line_of_sight)
    beams = beams_of_directions(
        sheets.camera, sky, "auto", TOLERANCE, end=sheets.surface.bare(), crossings=False, redshift=False
    )
    # The minor diameter grows by about the major one over an e-folding of the distance from the shadow edge.
    across = np.pi * np.exp(-points.depth) * beams.diameter_error
    shape = phase.shape
    back = back.reshape(-1)
    return sky[back].reshape(*shape, 3), across[back].reshape(shape).max(axis=1)
