"""Arcs of critical curves whose caustics lie within a disc: they bound what is seen of it with each Morse index."""

import math

import numpy as np
from jaxtyping import Bool, Float

from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.curves.critical_curves import CriticalCurve, between
from kerrcaustics.extended_sources.arcs import DERIVATIVE, GUESSED, NODES, WEIGHTS, BoundaryArcs, along, values_at
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.tracks.level_curves.circle import Circle
from kerrcaustics.tracks.level_curves.path_events import PathEvents

Array = np.ndarray

_TURN = 2 * math.pi
# Longest arcs at first, radians of edge phase; rounds of halving.
_LONGEST, _MOST_HALVINGS = 0.5, 10
# An arc is not halved where its error is below so many times that of the curve.
_ROUND_OFF = 3.0
_PLACES = np.concatenate([NODES, GUESSED])
_TO_CHECK = values_at(NODES, GUESSED)


def critical_arcs(
    sheets: Sheets, circle: Circle, events: PathEvents, curve: CriticalCurve, first: int, wanted: float
) -> tuple[BoundaryArcs, tuple[str, ...]]:
    """The arcs of a critical curve whose caustic lies within a circle, toward larger edge phase.

    Parameters
    ----------
    sheets : Sheets
        Refined near the circle.
    circle : Circle
        The rim of the disc.
    events : PathEvents
        Where caustics cross it: nodes are numbered as they are.
    curve : CriticalCurve
        One of the sheets.
    first : int
        Number of the first node that is no event.
    wanted : float
        Error of the area, square radians.

    Returns
    -------
    arcs : BoundaryArcs
        Their index is the order of the curve.
    remarks : tuple of str
        What is in doubt.
    """
    here = np.flatnonzero(events.order == curve.order)
    here = here[np.argsort(events.points.edge_phase[here] % _TURN)]
    if len(here):
        low = events.points.edge_phase[here] % _TURN
        high, left, right = np.append(low[1:], low[0] + _TURN), here, np.roll(here, -1)
    else:
        low, high, left, right = np.zeros(1), np.full(1, _TURN), np.array([first]), np.array([first])
        first += 1
    inside = _inside(curve, circle, low, high)
    low, high, left, right = low[inside], high[inside], left[inside], right[inside]
    if not len(low):
        return _none(), ()
    parts = np.ceil((high - low) / _LONGEST).astype(int)
    ends = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, parts, strict=True)]
    numbers = []
    for a, b, n in zip(left, right, parts, strict=True):
        numbers.append(np.concatenate([[a], first + np.arange(n - 1), [b]]))
        first += n - 1
    low, high = (np.concatenate([e[s] for e in ends]) for s in (slice(None, -1), slice(1, None)))
    left, right = (np.concatenate([e[s] for e in numbers]) for s in (slice(None, -1), slice(1, None)))
    found: list[BoundaryArcs] = []
    for halving in range(_MOST_HALVINGS + 1):
        sky, noise = _traced(sheets, curve, low, high)
        if sky is None:
            return _none(), (f"points of the critical curve of order {curve.order} could not be found",)
        points, check = sky[:, : len(NODES)], sky[:, len(NODES) : -2]
        size = lengths(along(DERIVATIVE, points)) @ WEIGHTS
        miss = lengths(along(_TO_CHECK, points) - check).max(axis=1) * size
        floor = noise * size
        good = (miss <= wanted / len(low)) | (miss <= _ROUND_OFF * floor) | (halving == _MOST_HALVINGS)
        order = np.full(len(low), curve.order)
        arcs = BoundaryArcs(order, left, right, sky[:, -2], sky[:, -1], points, miss + floor)
        found.append(arcs[good])
        if good.all():
            break
        low, high, left, right = low[~good], high[~good], left[~good], right[~good]
        middle, new = (low + high) / 2, first + np.arange(len(low))
        first += len(low)
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        left, right = np.concatenate([left, new]), np.concatenate([new, right])
    return found[0].joined(*found[1:]), ()


def _none() -> BoundaryArcs:
    number, place = np.empty(0, int), np.empty((0, 3))
    return BoundaryArcs(number, number, number, place, place, np.empty((0, len(NODES), 3)), np.empty(0))


def _inside(
    curve: CriticalCurve, circle: Circle, low: Float[Array, " parts"], high: Float[Array, " parts"]
) -> Bool[Array, " parts"]:
    """True for parts of a caustic that lie within the circle, by the point of each that is farthest from the limb."""
    points = curve.around()
    height = circle.height(points.direction)
    inside = np.zeros(len(low), bool)
    for i, (a, b) in enumerate(zip(low, high, strict=True)):
        within = height[(points.edge_phase > a) & (points.edge_phase < b)]
        inside[i] = len(within) > 0 and within[np.argmax(np.abs(within))] > 0
    return inside


def _traced(
    sheets: Sheets, curve: CriticalCurve, low: Float[Array, " arcs"], high: Float[Array, " arcs"]
) -> tuple[Float[Array, "arcs places 3"] | None, Float[Array, " arcs"]]:
    """Directions at `_PLACES` of arcs and at their ends, None where some are lost; and errors across the curve."""
    part = (1 + np.concatenate([_PLACES, [-1.0, 1.0]])) / 2
    phase = low[:, None] + (high - low)[:, None] * part
    wanted, back = np.unique(phase, return_inverse=True)
    points = between(sheets.curves.search(), {curve.order: curve.around()}, {curve.order: wanted})[curve.order]
    if len(points) < len(wanted):
        return None, np.empty(0)
    sky = sheets.sky(points.line_of_sight)
    beams = trace_beams(
        sheets.camera, sky, "auto", TOLERANCE, end=sheets.surface.bare(), crossings=False, redshift=False
    )
    # The minor diameter grows by about the major one over an e-folding of the distance from the shadow edge.
    across = np.pi * np.exp(-points.depth) * beams.jacobian_error
    shape = phase.shape
    back = back.reshape(-1)
    return sky[back].reshape(*shape, 3), across[back].reshape(shape).max(axis=1)
