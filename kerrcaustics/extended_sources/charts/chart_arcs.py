"""Smooth arcs along the steps of contours, and along the rim: pieces of the boundaries of images."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

from kerrcaustics.extended_sources.arcs.boundary_arcs import (
    AT_ENDS,
    DERIVATIVE,
    GUESSED,
    NODES,
    WEIGHTS,
    Attempt,
    BoundaryArcs,
    arc_values,
    arcs_by_halving,
    values_at,
)
from kerrcaustics.extended_sources.charts.chart_curves import on_curves
from kerrcaustics.extended_sources.charts.charts import DiscChart
from kerrcaustics.extended_sources.charts.contours import Contours, ContourSteps
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

_TURN = 2 * math.pi
_PLACES = (1 + np.concatenate([NODES, GUESSED, [0.0]])) / 2
_TO_CHECK = values_at(NODES, GUESSED)
# Rounds of halving.
_MOST_HALVINGS = 14
# Most arcs halved in one round: more show that a curve is lost.
_MOST_ARCS = 4000
# Error of an arc over that of its points, below which halving gains nothing.
_ROUND_OFF = 3.0
# Error of an arc over the area of the image, below which the arc is not in doubt.
_SMALL = 1e-7
# Longest arc of the rim, radians of edge phase.
_LONGEST = 0.25
# Distance from the rim below which a node lies on it, as a part of the chart's height.
_CLOSE = 1e-12
# Places along a step, in (-1, 1), through which the distance of a caustic from the centre is interpolated.
_EXTREME_NODES = chebyshev.chebpts1(7)
# Imaginary part of a root below which the root is real.
_REAL = 1e-6
LIMB, RIM = 0, -1
"""Orders of arcs that belong to no critical curve."""


@dataclass(frozen=True)
class ChartArcs(Rows):
    """Arcs on the search sky.

    arcs: The arcs. Their index is that of the images beside them, or the order of a critical curve.
    order: Order of the critical curve, `LIMB` or `RIM`.
    sign: 1 if the images (at a critical curve those of lower index) lie to the left, else -1.
    doubtful: 1 where a curve is lost, else 0.
    """

    arcs: BoundaryArcs
    order: Int[Array, " arcs"]
    sign: Float[Array, " arcs"]
    doubtful: Int[Array, " arcs"]

    @property
    def last_node(self) -> int:
        """The highest number of a node, 0 if there is none."""
        return int(max(self.arcs.left.max(initial=0), self.arcs.right.max(initial=0)))


def arcs_along(chart: DiscChart, outline: Contours, tolerance: float) -> ChartArcs:
    """Arcs along the steps of contours; tolerance: approximate relative error of the area."""
    if not len(outline.steps):
        return _no_arcs()
    area = 0.0

    def attempt(steps: ContourSteps) -> Attempt[ContourSteps, ChartArcs]:
        nonlocal area
        arcs, off, noise, middle = _polynomials(chart, steps)
        size = lengths(arc_values(DERIVATIVE, arcs.arcs.points)) @ WEIGHTS
        area = area or float((size.sum() / 2) ** 2 / len(steps))
        good = (off <= tolerance * area / len(steps)) | (off <= _ROUND_OFF * noise)
        good &= noise < size**2
        doubtful = (~good & ~(arcs.arcs.error <= _SMALL * area)).astype(int)
        return Attempt(
            replace(arcs, doubtful=doubtful),
            good,
            lambda chosen, first: _halved(steps[chosen], middle[chosen], first),
        )

    return arcs_by_halving(outline.steps, attempt, outline.last_node + 1, _MOST_HALVINGS, _MOST_ARCS)[0]


def _polynomials(
    chart: DiscChart, steps: ContourSteps
) -> tuple[ChartArcs, Float[Array, " steps"], Float[Array, " steps"], Float[Array, "steps 2"]]:
    """Arcs along steps, their distances from the curve and its own errors, as areas, and places in the middle."""
    places = np.tile(_PLACES, (len(steps), 1))
    curve = on_curves(chart, steps.axes, steps.start, steps.stop, places, steps.order, steps.disc_side)
    sky = curve.rays.sky.reshape(*places.shape, 3)
    points, check = sky[:, : len(NODES)], sky[:, len(NODES) : -1]
    size = lengths(arc_values(DERIVATIVE, points)) @ WEIGHTS
    start, stop = (chart.rays(*ends.T).sky for ends in (steps.start, steps.stop))
    beside = lengths(arc_values(_TO_CHECK, points) - check).max(axis=1)
    # Arcs that meet at a node must reach it.
    apart = lengths(arc_values(AT_ENDS, points) - np.stack([start, stop], axis=1)).max(axis=1)
    off = np.maximum(beside, apart) * size
    noise = curve.error.max(axis=1) * size
    error = np.where(np.isfinite(off + noise), off + noise, np.inf)
    arcs = BoundaryArcs(steps.index, steps.left, steps.right, start, stop, points, error)
    sign = chart.sense * _side(chart, steps, curve.slope)
    return ChartArcs(arcs, steps.order, sign, np.zeros(len(steps), int)), off, noise, curve.place[:, -1]


def _side(chart: DiscChart, steps: ContourSteps, slope: Float[Array, "steps parts"]) -> Float[Array, " steps"]:
    """1 where the disc, or the images of lower index, lie to the left of a step on the chart, else -1."""
    rising = np.where(steps.disc_side == 0, np.sign(np.median(slope, axis=1)), steps.disc_side)
    parity = chart.parity * (1.0 - 2 * ((steps.order - 1) % 2))
    return np.where(steps.order == LIMB, -rising, parity * rising)


def _halved(steps: ContourSteps, middle: Float[Array, "steps 2"], first: int) -> ContourSteps:
    """Both halves of steps; first: number of the first new node."""
    new = first + np.arange(len(steps))
    return replace(steps, right=new, stop=middle).joined(replace(steps, left=new, start=middle))


def _no_arcs() -> ChartArcs:
    number, place, real = np.empty(0, int), np.empty((0, 3)), np.empty(0)
    points = np.empty((0, len(NODES), 3))
    return ChartArcs(BoundaryArcs(number, number, number, place, place, points, real), number, real, number)


def extremes(chart: DiscChart, outline: Contours) -> Float[Array, " extremes"]:
    """Extremes of the distance of caustics within a disc from its centre."""
    steps = outline.steps[outline.steps.order > 0]
    if not len(steps):
        return np.empty(0)
    parts = np.tile((1 + _EXTREME_NODES) / 2, (len(steps), 1))
    rays = on_curves(chart, steps.axes, steps.start, steps.stop, parts, steps.order, steps.disc_side).rays
    distance = chart.disc.distance(rays.place).reshape(parts.shape)
    values = []
    for row in chebyshev.chebfit(_EXTREME_NODES, distance.T, len(_EXTREME_NODES) - 1).T:
        roots = chebyshev.chebroots(chebyshev.chebder(row))
        places = roots.real[(np.abs(roots.imag) < _REAL) & (np.abs(roots.real) <= 1 + _REAL)]
        values.append(chebyshev.chebval(places, row))
    return np.concatenate(values)


def rim_arcs(chart: DiscChart, outline: Contours, first: int) -> ChartArcs:
    """Arcs of the rim of a chart that show places of the disc; first: number of the first new node."""
    if not chart.rim:
        return _no_arcs()
    height = chart.high if chart.rim > 0 else chart.low
    here = np.flatnonzero(np.abs(outline.nodes.place[:, 1] - height) <= _CLOSE * (chart.high - chart.low))
    phase = outline.nodes.place[here, 0] % _TURN
    order = np.argsort(phase)
    here, phase = outline.nodes.number[here][order], phase[order]
    if not len(here):
        here, phase, first = np.array([first]), np.zeros(1), first + 1
    low, high, left, right = phase, np.append(phase[1:], phase[0] + _TURN), here, np.roll(here, -1)
    middle = chart.rays((low + high) / 2, np.full(len(low), height))
    within = (middle.height < 0) & (middle.index <= chart.max_index)
    parts = [_no_arcs()]
    for a, b, i, j, k in zip(low[within], high[within], left[within], right[within], middle.index[within], strict=True):
        count = math.ceil((b - a) / _LONGEST)
        numbers = np.concatenate([[i], first + np.arange(count - 1), [j]])
        first += count - 1
        parts.append(_rim(chart, height, np.linspace(a, b, count + 1), numbers, int(k)))
    return parts[0].joined(*parts[1:])


def _rim(chart: DiscChart, height: float, phase: Array, numbers: Array, index: int) -> ChartArcs:
    """Arcs of the rim between edge phases."""
    count = len(numbers) - 1
    low, high = phase[:-1, None], phase[1:, None]
    at = low + (high - low) * np.append(_PLACES[:-1], [0.0, 1.0])
    sky = chart.lines(at.ravel(), np.full(at.size, height)).reshape(*at.shape, 3)
    points, check = sky[:, : len(NODES)], sky[:, len(NODES) : -2]
    size = lengths(arc_values(DERIVATIVE, points)) @ WEIGHTS
    off = (lengths(arc_values(_TO_CHECK, points) - check).max(axis=1) + chart.gap) * size
    arcs = BoundaryArcs(np.full(count, index), numbers[:-1], numbers[1:], sky[:, -2], sky[:, -1], points, off)
    # Above the lower side of a chart the disc lies to the left, below the upper one to the right.
    sign = np.full(count, -chart.rim * chart.sense)
    return ChartArcs(arcs, np.full(count, RIM), sign, np.zeros(count, int))
