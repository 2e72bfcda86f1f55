"""Grids on the sheets of the camera sky, in edge phase and part, fine enough to follow the images of the sheets."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kerrcaustics.curves.critical_points import Points
from kerrcaustics.shapes import Bool, Float

Array = np.ndarray
Depth = Callable[[Array], Array]
Mapped = Callable[[Array, Array], Array]

# Longest step of the grid's image on the celestial sphere, and of the grid on the sky, where it need not be longer.
_STEP = math.radians(10.0)
# Most nodes of one grid, kept to by longer steps; and the longest with which the grid still counts images.
MOST_NODES, _COARSE = 1_000_000, math.radians(40.0)
# Lines on which the length of a sheet's image is measured, and points on each.
_PROBES, _PROBE_POINTS = 24, 129


@dataclass(frozen=True)
class Sheet:
    """The part of the camera sky with one Morse index, as a grid.

    index: the Morse index.
    step: approximate length of the longest step of the grid's image, radians.
    outer: depth of the outer critical curve, a function of edge phase.
    inner: depth of the inner critical curve, a function of edge phase.
    edge_phase: lines of the grid, the last one a whole turn after the first, radians.
    part: places on each line, 0 to 1.
    direction: image of the grid on the celestial sphere, empty as long as it is not traced.
    """

    index: int
    step: float
    outer: Depth
    inner: Depth
    edge_phase: Float[Array, " lines"]
    part: Float[Array, " parts"]
    direction: Float[Array, "lines parts 3"] | Float[Array, " 0"]

    @property
    def is_coarse(self) -> bool:
        """True where a grid of acceptable size has longer steps than the search is made for."""
        return self.step > _STEP

    def depth(self, edge_phase: Float[Array, "*#batch"], part: Float[Array, "*#batch"]) -> Float[Array, "*batch"]:
        """Depth on the lines of sky_lines.py; edge phase and part are broadcast."""
        low = self.outer(edge_phase)
        return low + part * (self.inner(edge_phase) - low)


def traced_sheet(mapped: Mapped, index: int, depths: tuple[Depth, Depth], edge: Points) -> Sheet:
    """A sheet with a grid that is fine enough; edge: its inner one."""
    edge_phase = _thinned(edge, _STEP)
    blank = Sheet(index, _STEP, *depths, edge_phase, np.linspace(0, 1, _PROBE_POINTS), np.empty(0))
    probes = _grid(mapped, blank, edge_phase[:: max(1, len(edge_phase) // _PROBES)], blank.part)
    length = float(np.linalg.norm(np.diff(probes, axis=1), axis=-1).sum(axis=1).max())
    step = _STEP * max(1.0, math.sqrt(len(edge_phase) * length / _STEP / MOST_NODES))
    if step > _COARSE:
        raise ValueError(
            f"Argument `max_index` must be less than {index} for this camera: a grid that follows the images of index "
            f"{index} would take {len(edge_phase) * length / _STEP:.1g} rays."
        )
    edge_phase = _thinned(edge, step)
    part = np.linspace(0, 1, math.ceil(length / step) + 2)
    edge_phase = np.append(edge_phase, edge_phase[0] + 2 * np.pi)
    return Sheet(index, step, *depths, edge_phase, part, _grid(mapped, blank, edge_phase, part))


def _grid(mapped: Mapped, sheet: Sheet, edge_phase: Array, part: Array) -> Float[Array, "lines parts 3"]:
    line = edge_phase[:, None]
    return mapped(line, sheet.depth(line, part))


def _thinned(points: Points, step: float) -> Float[Array, " lines"]:
    """Edge phases of points of a curve, no further apart than a step in it and on either sphere, if samples allow.

    Far from the hole the whole curve is small on the sky.
    """
    lengths = [np.linalg.norm(np.diff(p, axis=0), axis=1) for p in (points.direction, points.line_of_sight)]
    return points.edge_phase[spaced(np.maximum.reduce([*lengths, np.diff(points.edge_phase)]), step)]


def spaced(steps: Float[Array, "*rows steps"], longest: float) -> Bool[Array, "*rows nodes"]:
    """True for the first node, the last, and between them as few as keep sums of steps below the longest."""
    run = np.cumsum(steps, axis=-1) / longest
    # Steps that are no numbers, and all behind them, are one step.
    passed = np.floor(np.where(np.isnan(run), np.inf, run))
    chosen = np.ones((*steps.shape[:-1], steps.shape[-1] + 1), bool)
    chosen[..., 1:-1] = passed[..., :-1] != np.concatenate([np.zeros_like(passed[..., :1]), passed[..., :-2]], axis=-1)
    return chosen
