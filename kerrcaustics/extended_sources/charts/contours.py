"""The limb of a disc and critical curves on a chart, in short steps: contours on a grid that is finer next to them.

The grid is halved, in the direction in which its image is longer, until cells on the limb, and those within the disc
that a critical curve passes, are small against the disc. Where curves pass the sides of cells is found to round-off;
within a cell each step leads from one of these nodes to another, or where curves meet on the limb to an event.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.extended_sources.charts.chart_curves import TIGHT, limb_folds
from kerrcaustics.extended_sources.charts.chart_grid import CORNERS, SIDES, ChartGrid
from kerrcaustics.extended_sources.charts.charts import DiscChart
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.results.progress import report
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

MOST_RAYS = 1_000_000
"""Rays after which a chart is given up."""
GIVEN_UP = f"the limb and the critical curves need more than {MOST_RAYS} rays, and are not followed"
"""Remark on such a chart."""
_TURN = 2 * math.pi
# Most cells of a group.
_MOST_CELLS = 20_000
# Most cells over the chart in one direction: their numbers are exact in floating point.
_FINEST = 1 << 48
# Times that cells are halved again because curves in them are in doubt.
_MOST_RETRIES = 3


@dataclass(frozen=True)
class ContourNodes(Rows):
    """Crossings of curves with sides of cells.

    number: Number of the node.
    order: 0 on the limb, else the order of the critical curve.
    place: Place on the chart.
    index: Morse index of the ray.
    """

    number: Int[Array, " nodes"]
    order: Int[Array, " nodes"]
    place: Float[Array, "nodes 2"]
    index: Int[Array, " nodes"]


@dataclass(frozen=True)
class ContourSteps(Rows):
    """Steps along curves, from node to node, each within a cell.

    order: 0 along the limb, else the order of the critical curve.
    index: Morse index of the images on the limb, else the order.
    left, right: Numbers of the nodes at both ends.
    start, stop: Places of the nodes on the chart; their edge phases differ by at most a cell.
    axes: Rows, both sides of the cell on the chart.
    disc_side: 1 if the disc lies to the right of the limb, -1 if to the left, 0 along critical curves.
    """

    order: Int[Array, " steps"]
    index: Int[Array, " steps"]
    left: Int[Array, " steps"]
    right: Int[Array, " steps"]
    start: Float[Array, "steps 2"]
    stop: Float[Array, "steps 2"]
    axes: Float[Array, "steps 2 2"]
    disc_side: Float[Array, " steps"]


@dataclass(frozen=True, eq=False)
class Contours:
    """The curves on a chart; remarks: one for each kind of doubt."""

    nodes: ContourNodes
    steps: ContourSteps
    remarks: tuple[str, ...]

    @property
    def last_node(self) -> int:
        """The highest number of a node, -1 if there is none."""
        numbers = (self.nodes.number, self.steps.left, self.steps.right)
        return int(max(number.max(initial=-1) for number in numbers))


def contours(chart: DiscChart) -> Contours:
    """The limb of the disc of a chart, and the critical curves within the disc."""
    grids, parts = [ChartGrid(chart)], [Contours(_no_nodes(), _no_steps(), ())]
    rays = 0
    while grids:
        rays += len(grids[-1].corners)
        report(f"limb and critical curves, {rays} rays", min(rays / MOST_RAYS, 1.0))
        if rays > MOST_RAYS:
            parts.append(Contours(_no_nodes(), _no_steps(), (GIVEN_UP,)))
            break
        for grid, directions in grids.pop().groups():
            within_limits = len(grid.cells) <= _MOST_CELLS and grid.count.max() <= _FINEST
            if not within_limits:
                parts.append(Contours(_no_nodes(), _no_steps(), ("the limb is too long to be followed",)))
            elif directions.any():
                grid.halve(directions)
                grids.append(grid)
            else:
                linked = _linked(grid, 1 + max(part.last_node for part in parts))
                if linked.remarks and grid.retries < _MOST_RETRIES:
                    # A curve that passes a cell twice appears to end in it.
                    grid.retries += 1
                    grid.halve(np.array([True, True]))
                    grids.append(grid)
                else:
                    parts.append(linked)
    remarks = dict.fromkeys(remark for part in parts for remark in part.remarks)
    nodes, steps = [part.nodes for part in parts], [part.steps for part in parts]
    return Contours(nodes[0].joined(*nodes[1:]), steps[0].joined(*steps[1:]), tuple(remarks))


def _linked(grid: ChartGrid, first: int) -> Contours:
    """The curves within cells; first: number of the first node."""
    crossed = _side_crossings(grid)
    steps, doubts = _steps(grid, crossed)
    nodes = replace(crossed.nodes, number=crossed.nodes.number + first)
    steps = replace(steps, left=steps.left + first, right=steps.right + first)
    return Contours(nodes, steps, (*crossed.remarks, *doubts))


def _no_nodes() -> ContourNodes:
    number = np.empty(0, int)
    return ContourNodes(number, number, np.empty((0, 2)), number)


def _no_steps() -> ContourSteps:
    number, place = np.empty(0, int), np.empty((0, 2))
    return ContourSteps(number, number, number, number, place, place, np.empty((0, 2, 2)), np.empty(0))


@dataclass(frozen=True, eq=False)
class _SideCrossings:
    """Crossings of curves with the sides of cells.

    nodes: The nodes, each once.
    limb, critical: Number of the node on each side of each cell, -1 if there is none.
    remarks: One for each kind of doubt.
    """

    nodes: ContourNodes
    limb: Int[Array, "cells 4"]
    critical: Int[Array, "cells 4"]
    remarks: tuple[str, ...]


def _side_crossings(grid: ChartGrid) -> _SideCrossings:
    """The nodes on all sides of cells, each side once."""
    ends = grid.which[:, SIDES].reshape(-1, 2)
    sides, back = np.unique(ends, axis=0, return_inverse=True)
    height, index = grid.rays.height[sides], grid.rays.index[sides]
    low = grid.place(grid.corners[sides[:, 0]])
    step = _wrapped(grid.place(grid.corners[sides[:, 1]]) - low)
    jump = np.abs(index[:, 0] - index[:, 1])
    limb = np.flatnonzero((height[:, 0] < 0) != (height[:, 1] < 0))
    critical = np.flatnonzero(jump == 1)
    places = [
        _roots(grid.chart, low[limb], step[limb], "height"),
        _roots(grid.chart, low[critical], step[critical], "ratio"),
    ]
    on_limb, on_curve = (grid.chart.rays(*place.T) for place in places)
    inside = on_curve.height < 0
    count = len(limb) + int(inside.sum())
    nodes = ContourNodes(
        np.arange(count),
        np.concatenate([np.zeros(len(limb), int), index[critical].max(axis=1)[inside]]),
        np.concatenate([places[0], places[1][inside]]),
        np.concatenate([on_limb.index, on_curve.index[inside]]),
    )
    numbers = np.full((2, len(sides)), -1)
    numbers[0, limb] = np.arange(len(limb))
    numbers[1, critical[inside]] = np.arange(len(limb), count)
    wide = int(((jump > 1) & (height.min(axis=1) < 0) & (index.min(axis=1) <= grid.chart.max_index)).sum())
    remarks = (f"{wide} sides of cells between images whose indices differ by more than one",) if wide else ()
    limb_nodes, curve_nodes = numbers[:, back.reshape(-1, 4)]
    return _SideCrossings(nodes, limb_nodes, curve_nodes, remarks)


def _wrapped(step: Float[Array, "*batch 2"]) -> Float[Array, "*batch 2"]:
    """Differences of places of a chart, the short way round."""
    around = (step[..., 0] + math.pi) % _TURN - math.pi
    return np.stack([around, step[..., 1]], axis=-1)


def _roots(chart: DiscChart, low: Array, step: Array, field: str) -> Float[Array, "sides 2"]:
    """Places on sides where a field of the rays vanishes."""
    if not len(low):
        return low

    def value(part: Array, a: Array, b: Array, c: Array, d: Array) -> Array:
        return getattr(chart.rays(a + part * c, b + part * d), field)

    bracket = np.zeros(len(low)), np.ones(len(low))
    root = bracketed_roots(value, bracket, (*low.T, *step.T), **TIGHT)
    return low + np.where(np.isfinite(root.x), root.x, 0.5)[:, None] * step


def _steps(grid: ChartGrid, crossed: _SideCrossings) -> tuple[ContourSteps, tuple[str, ...]]:
    """Steps within cells, and remarks."""
    nodes, highest = crossed.nodes, grid.chart.max_index
    cell, left, right, corner_beside = _pairs(grid, crossed.limb)
    first, second = nodes.index[left], nodes.index[right]
    requested = np.minimum(first, second) <= highest
    base = grid.place(grid.cells[cell])
    ends = [_unwrapped(base, nodes.place[i]) for i in (left, right)]
    disc_side = _disc_side(grid, cell, ends, corner_beside)
    along = ContourSteps(
        np.zeros(len(cell), int), first, left, right, ends[0], ends[1], _cell_sides(grid, cell), disc_side
    )
    folded = np.flatnonzero(requested & (np.abs(first - second) == 1))
    place = limb_folds(grid.chart, _cell_sides(grid, folded), ends[0][folded], ends[1][folded], disc_side[folded])
    event = len(nodes.order) + np.arange(len(folded))
    steps = along[requested & (first == second)].joined(
        replace(along[folded], right=event, stop=place),
        replace(along[folded], index=second[folded], left=event, start=place),
    )
    here = _CriticalNodes(cell[folded], np.maximum(first, second)[folded], event, place)
    critical, doubts = _critical(grid, crossed, here)
    if lost := int((requested & (np.abs(first - second) > 1)).sum()):
        doubts = (*doubts, f"{lost} steps along the limb between images whose indices differ by more than one")
    return steps[steps.index <= highest].joined(critical), doubts


@dataclass(frozen=True)
class _CriticalNodes(Rows):
    """Nodes of critical curves, by cell and order: their numbers and places."""

    cell: Int[Array, " nodes"]
    order: Int[Array, " nodes"]
    number: Int[Array, " nodes"]
    place: Float[Array, "nodes 2"]


def _cell_sides(grid: ChartGrid, cell: Int[Array, " n"]) -> Float[Array, "n 2 2"]:
    """The sides of cells."""
    return np.tile(grid.axes, (len(cell), 1, 1))


def _unwrapped(base: Float[Array, "n 2"], place: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """Places with edge phases within half a turn of that at `base`."""
    return base + _wrapped(place - base)


def _pairs(grid: ChartGrid, at: Int[Array, "cells 4"]) -> tuple[Array, Array, Array, Array]:
    """Cells through which the limb passes, the nodes at both ends of each step, and a corner beside it.

    In some cells there are two steps.
    """
    count = (at >= 0).sum(axis=1)
    two = np.flatnonzero(count == 2)
    ends = np.sort(np.where(at[two] >= 0, np.arange(4), 9), axis=1)[:, :2]
    rows = [(two, *ends.T)] if len(two) else []
    four = np.flatnonzero(count == 4)
    if len(four):
        middle = grid.chart.rays(*grid.place(grid.cells[four] + 0.5).T).height < 0
        # The corners that are like the middle are joined through it; sides run below, right, above, left.
        joined = middle == (grid.rays.height[grid.which[four, 0]] < 0)
        rows += [
            (four, np.zeros(len(four), int), np.where(joined, 1, 3)),
            (four, np.where(joined, 2, 1), np.where(joined, 3, 2)),
        ]
    if not rows:
        none = np.empty(0, int)
        return none, none, none, none
    cells, first, second = (np.concatenate(column) for column in zip(*rows, strict=True))
    # Neighbouring sides share the corner that the step cuts off.
    corner_beside = np.where((first == 0) & (second == 3), 0, second)
    return cells, at[cells, first], at[cells, second], corner_beside


def _disc_side(
    grid: ChartGrid,
    cell: Int[Array, " steps"],
    ends: list[Float[Array, "steps 2"]],
    beside: Int[Array, " steps"],
) -> Float[Array, " steps"]:
    """1 where the disc lies to the right of a step, else -1; beside: a corner beside it."""
    chord, corner = ends[1] - ends[0], grid.place(grid.cells[cell] + CORNERS[beside]) - ends[0]
    to_left = chord[:, 0] * corner[:, 1] > chord[:, 1] * corner[:, 0]
    inside = grid.rays.height[grid.which[cell, beside]] < 0
    return np.where(to_left == inside, -1.0, 1.0)


def _critical(grid: ChartGrid, crossed: _SideCrossings, events: _CriticalNodes) -> tuple[ContourSteps, tuple[str, ...]]:
    """Steps along critical curves within the disc; events: where they meet the limb."""
    cell, side = np.nonzero(crossed.critical >= 0)
    number = crossed.critical[cell, side]
    place = _unwrapped(grid.place(grid.cells[cell]), crossed.nodes.place[number])
    every = _CriticalNodes(cell, crossed.nodes.order[number], number, place).joined(events)
    every = every[np.lexsort((every.order, every.cell))]
    apart = (np.diff(every.cell) != 0) | (np.diff(every.order) != 0)
    pairs, odd = [np.empty((0, 2), int)], 0
    for group in np.split(np.arange(len(every.cell)), np.flatnonzero(apart) + 1):
        left = group.tolist()
        odd += len(left) % 2
        while len(left) > 1:
            first = left.pop(0)
            away = lengths((every.place[first] - every.place[left]) @ np.linalg.inv(grid.axes))
            pairs.append(np.array([[first, left.pop(int(np.argmin(away)))]]))
    first, second = (every[side] for side in np.concatenate(pairs).T)
    steps = ContourSteps(
        first.order,
        first.order,
        first.number,
        second.number,
        first.place,
        second.place,
        _cell_sides(grid, first.cell),
        np.zeros(len(first)),
    )
    return steps, ((f"{odd} steps along critical curves end nowhere",) if odd else ())
