"""Cells on a chart, halved where the limb of a disc or a critical curve passes; they follow drawn-out images."""

import math
from copy import copy

import numpy as np

from kerrcaustics.extended_sources.charts.charts import DiscChart
from kerrcaustics.numerics.matching import component_of
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

_TURN = 2 * math.pi
# First cells in edge phase.
_PHASES = 96
# First cells in height.
_HEIGHTS = 24
# Longest image of a side of a cell, in radii of the limb.
_LONGEST = 0.4
# Distance from the limb, in diagonals of its image, within which a cell counts as one on the limb.
_REACH = 1.0
# Edge phase of the first line, radians: no line lies on the equator, where lines are less accurate.
_FIRST = 0.0123
CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
"""Corners of a cell, in numbers of cells."""
SIDES = np.array([(0, 1), (1, 2), (3, 2), (0, 3)])
"""Sides of a cell, from corner to corner."""
# Cells of a connected piece above which long cells may replace them.
_MANY = 60
# Fewest long cells along the longer side of a piece.
_ACROSS = 8
# Corners at the ends of the two parallel sides of a cell, along its first axis and along the second one.
_EDGES = ((0, 1, 3, 2), (0, 3, 1, 2))
# Numbers of these sides.
_MIDDLES = ((0, 2), (3, 1))
# Places all over a cell.
_SAMPLES = np.stack(np.meshgrid(*[np.linspace(0, 1, 5)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
# Numbers of a cell and its neighbours.
_NEIGHBOURS = np.stack(np.meshgrid(*[np.arange(-1, 2)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)


class ChartGrid:
    """Cells of one size and shape; the first ones cover a chart that closes after a turn.

    cells: Numbers of the cells, (cells, 2).
    origin: Place of cell (0, 0) on the chart.
    axes: Rows, both sides of a cell on the chart.
    oblique: True for cells over a part of the chart whose sides follow a drawn-out image.
    tried: Number of cells above which such sides are sought.
    retries: Number of times that curves in the cells were in doubt.
    """

    def __init__(self, chart: DiscChart) -> None:
        self.chart, self.count = chart, np.array([_PHASES, _HEIGHTS])
        self.origin = np.array([_FIRST, chart.low])
        self.axes = np.diag(np.array([_TURN, chart.high - chart.low]) / self.count)
        self.oblique, self.tried, self.retries = False, _MANY, 0
        self.cells = np.stack(np.meshgrid(*(np.arange(n) for n in self.count), indexing="ij"), axis=-1).reshape(-1, 2)
        self.trace_corners()

    def place(self, number: Array) -> Float[Array, "*batch 2"]:
        """Places on the chart of corners by number."""
        return self.origin + number @ self.axes

    def trace_corners(self) -> None:
        """Trace all corners, each once."""
        corners = self.cells[:, None] + CORNERS
        if not self.oblique:
            corners[..., 0] %= self.count[0]
        flat, back = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        self.corners, self.which = flat, back.reshape(-1, 4)
        self.rays = self.chart.rays(*self.place(flat).T)
        if self.oblique:
            twice = (2 * self.cells[:, None] + CORNERS[SIDES].sum(axis=1)).reshape(-1, 2)
            flat, back = np.unique(twice, axis=0, return_inverse=True)
            self.middle, self.which_middle = self.chart.rays(*self.place(flat / 2).T).place, back.reshape(-1, 4)

    def near(self) -> Bool[Array, " cells"]:
        """True for cells on the limb, and those within the disc that a critical curve passes."""
        height, index = self.rays.height[self.which], self.rays.index[self.which]
        highest = self.chart.max_index
        along, across = self.sides()
        reach = _REACH * np.hypot(along, across)
        known = np.isfinite(height).all(axis=1)
        limb = np.abs(height).min(axis=1) < reach
        limb |= (height.min(axis=1) < 0) & (height.max(axis=1) >= 0)
        mixed = (index.max(axis=1) > index.min(axis=1)) & (height.min(axis=1) < reach)
        return known & (limb | mixed) & (index.min(axis=1) <= highest)

    def sides(self) -> tuple[Float[Array, " cells"], Float[Array, " cells"]]:
        """Lengths of the images of cells, along their first side and along the second one."""
        place = self.rays.place[self.which]
        if not self.oblique:
            return tuple(
                np.maximum(lengths(place[:, a] - place[:, b]), lengths(place[:, c] - place[:, d]))
                for a, b, c, d in _EDGES
            )
        # Long sides may lead over a critical curve and back.
        middle = self.middle[self.which_middle]
        return tuple(
            np.maximum(
                lengths(place[:, a] - middle[:, i]) + lengths(middle[:, i] - place[:, b]),
                lengths(place[:, c] - middle[:, j]) + lengths(middle[:, j] - place[:, d]),
            )
            for (a, b, c, d), (i, j) in zip(_EDGES, _MIDDLES, strict=True)
        )

    def halve(self, directions: Bool[Array, " 2"]) -> None:
        """Halve all cells."""
        parts = 1 + directions.astype(int)
        offsets = np.stack(np.meshgrid(*(np.arange(n) for n in parts), indexing="ij"), axis=-1).reshape(-1, 2)
        self.cells = (self.cells[:, None] * parts + offsets).reshape(-1, 2)
        self.count, self.axes = self.count * parts, self.axes / parts[:, None]
        self.trace_corners()

    def groups(self) -> "list[tuple[ChartGrid, Bool[Array, ' 2']]]":
        """The cells that curves pass, in groups to be halved in the same directions."""
        near = np.flatnonzero(self.near())
        if not len(near):
            return []
        label = self._labels(near)
        along, across = (np.zeros(label.max() + 1) for _ in range(2))
        for most, side in zip((along, across), self.sides(), strict=True):
            np.maximum.at(most, label, side[near])
        parts = []
        for one in np.flatnonzero(np.bincount(label) > self.tried).tolist():
            better = self._along_curve(near[label == one])
            if better is not None:
                parts += better.groups()
                near, label = near[label != one], label[label != one]
        longest = _LONGEST * self.chart.disc.smaller
        wide, high = along > np.maximum(longest, across / 2), across > np.maximum(longest, along / 2)
        kind = (2 * wide + high)[label]
        for one in np.unique(kind).tolist():
            part = self._selection(near[kind == one])
            parts.append((part, np.array([one >= 2, one % 2 == 1])))
        return parts

    def _selection(self, chosen: Int[Array, " chosen"]) -> "ChartGrid":
        """The grid of some cells."""
        part = copy(self)
        part.cells, part.which = self.cells[chosen], self.which[chosen]
        if self.oblique:
            part.which_middle = self.which_middle[chosen]
        return part

    def _labels(self, near: Int[Array, " near"]) -> Int[Array, " near"]:
        """Numbers of the pieces that are connected by corners."""
        which = self.which[near]
        cells, corners = np.repeat(np.arange(len(near)), 4), len(near) + which.ravel()
        lowest = component_of(cells, corners, len(near) + len(self.corners))[: len(near)]
        return np.unique(lowest, return_inverse=True)[1]

    def _along_curve(self, piece: Int[Array, " cells"]) -> "ChartGrid | None":
        """Cells over the same piece, long in the direction in which the map hardly changes; None unless fewer."""
        number = self.cells[piece] - self.cells[piece[0]]
        if not self.oblique:
            number[:, 0] = (number[:, 0] + self.count[0] // 2) % self.count[0] - self.count[0] // 2
            if np.ptp(number[:, 0]) > self.count[0] / 3:
                return None
        corner = self.rays.place[self.which[piece]]
        along, across = (corner[:, b] - corner[:, a] + corner[:, d] - corner[:, c] for a, b, c, d in _EDGES)
        rates = np.stack([along, across], axis=1) / 2
        square, vectors = np.linalg.eigh(np.einsum("nix,njx->ij", rates, rates) / len(piece))
        short, long = vectors[:, 1], vectors[:, 0]
        if short[0] * long[1] < short[1] * long[0]:
            long = -long
        extent = np.ptp(number @ long) + 1
        stretch = min(math.sqrt(square[1] / max(square[0], 1e-300)), extent / _ACROSS)
        self.tried = len(piece) * 2
        if stretch < 2:
            return None
        better = copy(self)
        better.oblique, better.tried = True, _MANY
        better.origin = self.place(self.cells[piece[0]].astype(float))
        oblique_axes = np.stack([short, stretch * long])
        better.axes = oblique_axes @ self.axes
        inner = (number[:, None] + _SAMPLES).reshape(-1, 2) @ np.linalg.inv(oblique_axes)
        covered = np.floor(inner).astype(int)
        better.cells = np.unique((np.unique(covered, axis=0)[:, None] + _NEIGHBOURS).reshape(-1, 2), axis=0)
        height = better.place(better.cells[:, None] + CORNERS)[..., 1]
        if not self.chart.open_ended and (height.min() <= self.chart.low or height.max() >= self.chart.high):
            return None
        better.trace_corners()
        return better if better.near().sum() < len(piece) / 2 else None
