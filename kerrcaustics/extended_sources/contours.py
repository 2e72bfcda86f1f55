"""The limb of a disc and critical curves on a chart, in short steps: contours on a grid that is finer next to them.

The grid is halved, in the direction in which its image is longer, until cells on the limb, and those within the disc
that a critical curve passes, are small against the disc. Where curves pass the sides of cells is found to round-off;
within a cell each step leads from one of these nodes to another, or where curves meet on the limb to an event.
"""

import math
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy
from jaxtyping import Bool, Float, Int
from scipy.optimize import elementwise

from kerrcaustics.extended_sources.chart_curves import meetings
from kerrcaustics.extended_sources.patches import Patch
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

_TURN = 2 * math.pi
# Cells in edge phase, and in height, at first; longest image of a side of a cell in radii of the limb; most cells, and
# in one direction; how far from the limb, in diagonals of its image, a cell is looked at more closely.
_PHASES, _HEIGHTS, _LONGEST, _MOST_CELLS, _FINEST, _REACH = 96, 24, 0.4, 20_000, 1 << 48, 1.0
_TIGHT = {"xatol": 1e-15, "xrtol": 1e-15}
# Corners of a cell, and its sides from corner to corner, in (phase, height).
_CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
_SIDES = np.array([(0, 1), (1, 2), (3, 2), (0, 3)])


@dataclass(frozen=True)
class Nodes(Rows):
    """Places where the limb (order 0), or the critical curve of an order, passes sides of cells.

    number; place: on the chart; index: of the rays there.
    """

    number: Int[Array, " nodes"]
    order: Int[Array, " nodes"]
    place: Float[Array, "nodes 2"]
    index: Int[Array, " nodes"]


@dataclass(frozen=True)
class Steps(Rows):
    """Steps along curves, from node to node, each within a cell.

    order: 0 along the limb, else of the critical curve; index: of the images on the limb; left, right: numbers of the
    nodes; start, stop: places on the chart, edge phases not more than a cell apart; scale: sides of the cell.
    """

    order: Int[Array, " steps"]
    index: Int[Array, " steps"]
    left: Int[Array, " steps"]
    right: Int[Array, " steps"]
    start: Float[Array, "steps 2"]
    stop: Float[Array, "steps 2"]
    scale: Float[Array, "steps 2"]


@dataclass(frozen=True, eq=False)
class Contours:
    """The curves on a chart; remarks: what is in doubt."""

    nodes: Nodes
    steps: Steps
    remarks: tuple[str, ...]

    @property
    def last_node(self) -> int:
        """The highest number of a node, -1 if there is none."""
        numbers = (self.nodes.number, self.steps.left, self.steps.right)
        return int(max(number.max(initial=-1) for number in numbers))


class _Grid:
    """Cells of one size, on a chart that closes after a turn; cells: numbers (phase, height)."""

    def __init__(self, patch: Patch) -> None:
        self.patch, self.count = patch, np.array([_PHASES, _HEIGHTS])
        self.cells = np.stack(np.meshgrid(*(np.arange(n) for n in self.count), indexing="ij"), axis=-1).reshape(-1, 2)
        self.traced()

    @property
    def size(self) -> Float[Array, " 2"]:
        return np.array([_TURN, self.patch.high - self.patch.low]) / self.count

    def place(self, number: Array) -> Float[Array, "*batch 2"]:
        return np.array([0.0, self.patch.low]) + number * self.size

    def traced(self) -> None:
        """Trace all corners, each once."""
        corners = self.cells[:, None] + _CORNERS
        corners[..., 0] %= self.count[0]
        flat, back = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        self.corners, self.which = flat, back.reshape(-1, 4)
        self.seen = self.patch.seen(*self.place(flat).T)

    def near(self) -> Bool[Array, " cells"]:
        """True for cells on the limb, and those within the disc that a critical curve passes."""
        height, index = self.seen.height[self.which], self.seen.index[self.which]
        highest = self.patch.max_index
        along, across = self.sides()
        reach = _REACH * np.hypot(along, across)
        known = np.isfinite(height).all(axis=1)
        limb = np.abs(height).min(axis=1) < reach
        limb |= (height.min(axis=1) < 0) & (height.max(axis=1) >= 0)
        mixed = (index.max(axis=1) > index.min(axis=1)) & (height.min(axis=1) < reach)
        return known & (limb | mixed) & (index.min(axis=1) <= highest)

    def sides(self) -> tuple[Float[Array, " cells"], Float[Array, " cells"]]:
        """Lengths of the images of cells, along the phase and along the height."""
        place = self.seen.place[self.which]
        return tuple(
            np.maximum(lengths(place[:, a] - place[:, b]), lengths(place[:, c] - place[:, d]))
            for a, b, c, d in ((0, 1, 3, 2), (0, 3, 1, 2))
        )

    def halved(self, directions: Bool[Array, " 2"]) -> None:
        """Halve all cells."""
        parts = 1 + directions.astype(int)
        offsets = np.stack(np.meshgrid(*(np.arange(n) for n in parts), indexing="ij"), axis=-1).reshape(-1, 2)
        self.cells = (self.cells[:, None] * parts + offsets).reshape(-1, 2)
        self.count = self.count * parts
        self.traced()

    def groups(self) -> "list[tuple[_Grid, Bool[Array, ' 2']]]":
        """The cells in which curves lie, apart where they do not touch and should be halved in other directions."""
        near = np.flatnonzero(self.near())
        if not len(near):
            return []
        which, longest = self.which[near], _LONGEST * self.patch.disc.smaller
        entries = np.ones(which.size), (np.repeat(np.arange(len(near)), 4), len(near) + which.ravel())
        graph = scipy.sparse.coo_matrix(entries, shape=(len(near) + len(self.corners),) * 2)
        label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][: len(near)]
        along, across = (np.zeros(label.max() + 1) for _ in range(2))
        for most, side in zip((along, across), self.sides(), strict=True):
            np.maximum.at(most, label, side[near])
        wide, high = along > np.maximum(longest, across / 2), across > np.maximum(longest, along / 2)
        kind = (2 * wide + high)[label]
        parts = []
        for one in np.unique(kind).tolist():
            part = copy(self)
            part.cells, part.which = self.cells[near[kind == one]], self.which[near[kind == one]]
            parts.append((part, np.array([one >= 2, one % 2 == 1])))
        return parts


def contours(patch: Patch) -> Contours:
    """The limb of the disc of a chart, and the critical curves within the disc."""
    grids, parts = [_Grid(patch)], [Contours(_no_nodes(), _no_steps(), ())]
    while grids:
        for grid, directions in grids.pop().groups():
            fine = len(grid.cells) <= _MOST_CELLS and grid.count.max() <= _FINEST
            if not fine:
                parts.append(Contours(_no_nodes(), _no_steps(), ("the limb is too long to be followed",)))
            elif directions.any():
                grid.halved(directions)
                grids.append(grid)
            else:
                parts.append(_linked(grid, 1 + max(part.last_node for part in parts)))
    remarks = dict.fromkeys(remark for part in parts for remark in part.remarks)
    nodes, steps = [part.nodes for part in parts], [part.steps for part in parts]
    return Contours(nodes[0].joined(*nodes[1:]), steps[0].joined(*steps[1:]), tuple(remarks))


def _linked(grid: _Grid, first: int) -> Contours:
    """The curves in cells; first: number of the first node."""
    crossed = _crossed(grid)
    steps, doubts = _steps(grid, crossed)
    nodes = replace(crossed.nodes, number=crossed.nodes.number + first)
    steps = replace(steps, left=steps.left + first, right=steps.right + first)
    return Contours(nodes, steps, (*crossed.remarks, *doubts))


def _no_nodes() -> Nodes:
    number = np.empty(0, int)
    return Nodes(number, number, np.empty((0, 2)), number)


def _no_steps() -> Steps:
    number, place = np.empty(0, int), np.empty((0, 2))
    return Steps(number, number, number, number, place, place, place)


@dataclass(frozen=True, eq=False)
class _Crossed:
    """Where curves pass the sides of cells.

    limb, critical: the number of the node on each side of each cell, -1 where there is none; remarks.
    """

    nodes: Nodes
    limb: Int[Array, "cells 4"]
    critical: Int[Array, "cells 4"]
    remarks: tuple[str, ...]


def _crossed(grid: _Grid) -> _Crossed:
    """The nodes on all sides of cells, each side once."""
    ends = grid.which[:, _SIDES].reshape(-1, 2)
    sides, back = np.unique(ends, axis=0, return_inverse=True)
    height, index = grid.seen.height[sides], grid.seen.index[sides]
    low = grid.place(grid.corners[sides[:, 0]])
    step = _wrapped(grid.place(grid.corners[sides[:, 1]]) - low)
    jump = np.abs(index[:, 0] - index[:, 1])
    limb = np.flatnonzero((height[:, 0] < 0) != (height[:, 1] < 0))
    critical = np.flatnonzero(jump == 1)
    places = [
        _roots(grid.patch, low[limb], step[limb], "height"),
        _roots(grid.patch, low[critical], step[critical], "ratio"),
    ]
    on_limb, on_curve = (grid.patch.seen(*place.T) for place in places)
    inside = on_curve.height < 0
    count = len(limb) + int(inside.sum())
    nodes = Nodes(
        np.arange(count),
        np.concatenate([np.zeros(len(limb), int), index[critical].max(axis=1)[inside]]),
        np.concatenate([places[0], places[1][inside]]),
        np.concatenate([on_limb.index, on_curve.index[inside]]),
    )
    numbers = np.full((2, len(sides)), -1)
    numbers[0, limb] = np.arange(len(limb))
    numbers[1, critical[inside]] = np.arange(len(limb), count)
    wide = int(((jump > 1) & (height.min(axis=1) < 0) & (index.min(axis=1) <= grid.patch.max_index)).sum())
    remarks = (f"{wide} sides of cells between images whose indices differ by more than one",) if wide else ()
    limb_nodes, curve_nodes = numbers[:, back.reshape(-1, 4)]
    return _Crossed(nodes, limb_nodes, curve_nodes, remarks)


def _wrapped(step: Float[Array, "*batch 2"]) -> Float[Array, "*batch 2"]:
    """Differences of places of a chart, the short way round."""
    around = (step[..., 0] + math.pi) % _TURN - math.pi
    return np.stack([around, step[..., 1]], axis=-1)


def _roots(patch: Patch, low: Array, step: Array, field: str) -> Float[Array, "sides 2"]:
    """Places on sides where a field of the rays vanishes."""
    if not len(low):
        return low

    def value(part: Array, a: Array, b: Array, c: Array, d: Array) -> Array:
        return getattr(patch.seen(a + part * c, b + part * d), field)

    bracket = np.zeros(len(low)), np.ones(len(low))
    root = elementwise.find_root(value, bracket, args=(*low.T, *step.T), tolerances=_TIGHT)
    return low + np.where(np.isfinite(root.x), root.x, 0.5)[:, None] * step


def _steps(grid: _Grid, crossed: _Crossed) -> tuple[Steps, tuple[str, ...]]:
    """Steps within cells, and what is in doubt."""
    nodes, highest = crossed.nodes, grid.patch.max_index
    cell, left, right = _pairs(grid, crossed.limb)
    one, other = nodes.index[left], nodes.index[right]
    used = np.minimum(one, other) <= highest
    base = grid.place(grid.cells[cell])
    ends = [_beside(base, nodes.place[i]) for i in (left, right)]
    along = Steps(np.zeros(len(cell), int), one, left, right, ends[0], ends[1], _sized(grid, cell))
    bent = np.flatnonzero(used & (np.abs(one - other) == 1))
    place = meetings(grid.patch, _sized(grid, bent), ends[0][bent], ends[1][bent])
    event = len(nodes.order) + np.arange(len(bent))
    steps = along[used & (one == other)].joined(
        replace(along[bent], right=event, stop=place),
        replace(along[bent], index=other[bent], left=event, start=place),
    )
    here = _OnCurve(cell[bent], np.maximum(one, other)[bent], event, place)
    critical, doubts = _critical(grid, crossed, here)
    if lost := int((used & (np.abs(one - other) > 1)).sum()):
        doubts = (*doubts, f"{lost} steps along the limb between images whose indices differ by more than one")
    return steps[steps.index <= highest].joined(critical), doubts


@dataclass(frozen=True)
class _OnCurve(Rows):
    """Nodes of critical curves, by cell and order: their numbers and places."""

    cell: Int[Array, " nodes"]
    order: Int[Array, " nodes"]
    number: Int[Array, " nodes"]
    place: Float[Array, "nodes 2"]


def _sized(grid: _Grid, cell: Int[Array, " n"]) -> Float[Array, "n 2"]:
    """The sides of cells."""
    return np.tile(grid.size, (len(cell), 1))


def _beside(base: Float[Array, "n 2"], place: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """Places with edge phases within a cell of that at `base`."""
    return base + _wrapped(place - base)


def _pairs(grid: _Grid, at: Int[Array, "cells 4"]) -> tuple[Array, Array, Array]:
    """Cells through which the limb passes, and the nodes at both ends of each step; in some there are two."""
    count = (at >= 0).sum(axis=1)
    two = np.flatnonzero(count == 2)
    ends = np.sort(np.where(at[two] >= 0, np.arange(4), 9), axis=1)[:, :2]
    rows = [(two, at[two, ends[:, 0]], at[two, ends[:, 1]])] if len(two) else []
    four = np.flatnonzero(count == 4)
    if len(four):
        middle = grid.patch.seen(*grid.place(grid.cells[four] + 0.5).T).height < 0
        # The corners that are like the middle are joined through it; sides run below, right, above, left.
        joined = middle == (grid.seen.height[grid.which[four, 0]] < 0)
        one = np.where(joined[:, None], [0, 1], [0, 3])
        other = np.where(joined[:, None], [2, 3], [1, 2])
        rows += [(four, at[four, pair[:, 0]], at[four, pair[:, 1]]) for pair in (one, other)]
    if not rows:
        none = np.empty(0, int)
        return none, none, none
    cells, left, right = (np.concatenate(column) for column in zip(*rows, strict=True))
    return cells, left, right


def _critical(grid: _Grid, crossed: _Crossed, events: _OnCurve) -> tuple[Steps, tuple[str, ...]]:
    """Steps along critical curves within the disc; events: where they meet the limb."""
    cell, side = np.nonzero(crossed.critical >= 0)
    number = crossed.critical[cell, side]
    place = _beside(grid.place(grid.cells[cell]), crossed.nodes.place[number])
    every = _OnCurve(cell, crossed.nodes.order[number], number, place).joined(events)
    every = every[np.lexsort((every.order, every.cell))]
    apart = (np.diff(every.cell) != 0) | (np.diff(every.order) != 0)
    pairs, odd = [np.empty((0, 2), int)], 0
    for group in np.split(np.arange(len(every.cell)), np.flatnonzero(apart) + 1):
        left = group.tolist()
        odd += len(left) % 2
        while len(left) > 1:
            one = left.pop(0)
            away = lengths((every.place[one] - every.place[left]) / grid.size)
            pairs.append(np.array([[one, left.pop(int(np.argmin(away)))]]))
    one, other = (every[side] for side in np.concatenate(pairs).T)
    steps = Steps(one.order, one.order, one.number, other.number, one.place, other.place, _sized(grid, one.cell))
    return steps, ((f"{odd} steps along critical curves end nowhere",) if odd else ())
