"""Places on the limb of a disc, or on a critical curve, next to chords on a chart: the curve as a graph over these."""

from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.extended_sources.charts.charts import ChartRays, DiscChart
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# Steps of the secant method.
_MOST_STEPS = 15
# Its first step, in lengths of the chord.
_FIRST = 1e-3
# Largest offset from the chord, in lengths of the chord: farther away lie other branches.
_FARTHEST = 1.0
# Shortest step that gives a slope, in lengths of the chord: differences over shorter ones are round-off.
_SHORTEST = 1e-7
# Errors within which a place lies on the curve.
_ERRORS = 3.0
# Errors beyond which a place may lie off the curve.
_MOST_ERRORS = 10.0
# Offset from the curve, in lengths of the chord, beyond which such a place does.
_SMALL = 1e-9
# Offsets between which roots are bracketed if the secant method fails: the sinh-like grid runs over (-1, 1).
_GRID = np.linspace(-1, 1, 41)
# Farthest of these offsets, in sides of a cell.
_REACH = 1.5
# Offset at which their spacing begins to grow, in lengths of the chord.
_LEAST = 0.1
# Most lines that are bracketed: if more fail, the curve is lost.
_MOST_ASTRAY = 500
TIGHT = {"absolute": 1e-15, "relative": 1e-15}
"""Accuracy of roots along lines and sides of cells, as parts of them."""


@dataclass(frozen=True)
class OnCurves:
    """Places on curves, at parts of chords.

    place: Places on the chart.
    rays: Their rays, in a row.
    slope: Growth of the quantity that vanishes on the curve, to the left over the length of the chord.
    error: Errors of the directions across the curve, radians; infinite where it is lost.
    """

    place: Float[Array, "chords parts 2"]
    rays: ChartRays
    slope: Float[Array, "chords parts"]
    error: Float[Array, "chords parts"]


@dataclass(frozen=True)
class _CrossLines(Rows):
    """Lines across chords.

    base: Places on the chords.
    left: Vectors across the chords, as long as these.
    limb: True for lines to the limb, False for those to a critical curve.
    reach: Largest offset of the curve, in lengths of the chord.
    """

    base: Float[Array, "lines 2"]
    left: Float[Array, "lines 2"]
    limb: Bool[Array, " lines"]
    reach: Float[Array, " lines"]

    def rays_and_values(
        self, chart: DiscChart, offset: Float[Array, " lines"]
    ) -> tuple[ChartRays, Float[Array, " lines"], Array]:
        """Rays at offsets from the chords, the quantity that vanishes on the curve, and its error."""
        rays = chart.rays(*(self.base + offset[:, None] * self.left).T)
        return (
            rays,
            np.where(self.limb, rays.height, rays.ratio),
            np.where(self.limb, rays.error, rays.ratio_error),
        )


@dataclass(frozen=True)
class _SecantSearch(Rows):
    """The secant method on lines.

    worse, offset: Two offsets from each chord, in its lengths; the second one is the better.
    worse_value, value: The quantity that vanishes on the curve at these offsets.
    error: Error of `value`.
    slope: Rate of change of the values with the offset.
    """

    worse: Float[Array, " lines"]
    offset: Float[Array, " lines"]
    worse_value: Float[Array, " lines"]
    value: Float[Array, " lines"]
    error: Float[Array, " lines"]
    slope: Float[Array, " lines"]

    @property
    def next_offset(self) -> Float[Array, " lines"]:
        """The next offset."""
        with np.errstate(divide="ignore", invalid="ignore"):
            step = self.value * (self.offset - self.worse) / (self.value - self.worse_value)
        return np.clip(self.offset - np.nan_to_num(step), -_FARTHEST, _FARTHEST)

    def moved(self, offset: Array, value: Array, error: Array) -> "_SecantSearch":
        """The search after a step, whose offset is the worse one unless it is nearer to the curve."""
        step, better = offset - self.offset, np.abs(value) < np.abs(self.value)
        rate = (value - self.value) / np.where(step == 0, 1, step)
        slope = np.where(np.abs(step) > _SHORTEST, rate, self.slope)
        return _SecantSearch(
            np.where(better, self.offset, offset),
            np.where(better, offset, self.offset),
            np.where(better, self.value, value),
            np.where(better, value, self.value),
            np.where(better, error, self.error),
            slope,
        )

    def updated(self, rows: Int[Array, " rows"], new: "_SecantSearch") -> "_SecantSearch":
        """The search with some lines replaced."""
        columns = {name: values.copy() for name, values in vars(self).items()}
        for name, values in columns.items():
            values[rows] = getattr(new, name)
        return replace(self, **columns)


def on_curves(
    chart: DiscChart,
    axes: Float[Array, "chords 2 2"],
    start: Float[Array, "chords 2"],
    stop: Float[Array, "chords 2"],
    part: Float[Array, "chords parts"],
    order: Int[Array, " chords"],
    rising: Float[Array, " chords"],
) -> OnCurves:
    """Places on the limb (order 0) or on critical curves, across parts of chords.

    axes: Rows, two vectors on the chart that count as orthogonal and of equal length.
    start, stop: Ends of the chords on the chart.
    part: Parts of the chords, 0 to 1.
    order: 0 for the limb, else the order of the critical curve.
    rising: 1 if the quantity that vanishes on the curve grows to the left of the chord, -1 if it falls, 0 if unknown.
    """
    chord = np.einsum("ni,nij->nj", stop - start, np.linalg.inv(axes))
    left = np.einsum("ni,nij->nj", np.stack([-chord[:, 1], chord[:, 0]], axis=-1), axes)
    base = start[:, None] + part[..., None] * (stop - start)[:, None]
    count = part.shape[1]
    reach = np.maximum(_FARTHEST, _REACH / np.maximum(lengths(chord), 1e-300))
    columns = (np.repeat(column, count, axis=0) for column in (left, order == 0, reach))
    lines = _CrossLines(base.reshape(-1, 2), *columns)
    signs = np.repeat(rising, count)
    search, lever = _first_search(chart, lines)
    active = np.arange(len(lines.base))
    for _ in range(_MOST_STEPS):
        active = active[~(np.abs(search.value[active]) <= _ERRORS * search.error[active])]
        if not len(active):
            break
        here = search[active]
        offset = here.next_offset
        search = search.updated(active, here.moved(offset, *lines[active].rays_and_values(chart, offset)[1:]))
    astray = ~(search.slope * signs >= 0) | ~(np.abs(search.value) <= _MOST_ERRORS * search.error)
    here = np.flatnonzero(astray & (signs != 0))
    if 0 < len(here) <= _MOST_ASTRAY:
        search = search.updated(here, _bracketed(chart, lines[here], signs[here], search[here]))
    rays, value, error = lines.rays_and_values(chart, search.offset)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        off = (np.abs(value) + error) / np.abs(search.slope)
        lost = (np.abs(value) > _MOST_ERRORS * error) & (off > _SMALL)
        lost |= search.slope * signs < 0
        off = np.where(lost | ~np.isfinite(off), np.inf, off * lever)
    place = (lines.base + search.offset[:, None] * lines.left).reshape(*part.shape, 2)
    return OnCurves(place, rays, search.slope.reshape(part.shape), off.reshape(part.shape))


def _first_search(chart: DiscChart, lines: _CrossLines) -> tuple[_SecantSearch, Float[Array, " lines"]]:
    """The first search, on the chord and next to it, and the change of direction per length of the chord, radians."""
    zero, first = np.zeros(len(lines.base)), np.full(len(lines.base), _FIRST)
    (here, value, error), (beside, other, _) = lines.rays_and_values(chart, zero), lines.rays_and_values(chart, first)
    lever = lengths(beside.sky - here.sky) / _FIRST
    return _SecantSearch(first, zero, other, value, error, (other - value) / _FIRST), lever


def _bracketed(
    chart: DiscChart, lines: _CrossLines, rising: Float[Array, " lines"], search: _SecantSearch
) -> _SecantSearch:
    """The search with the nearest root of the right slope, where the secant method found another branch or none."""
    count = len(lines.base)
    offsets = np.sign(_GRID) * _LEAST * np.expm1(np.abs(_GRID) * np.log1p(lines.reach / _LEAST)[:, None])
    value = lines[np.repeat(np.arange(count), len(_GRID))].rays_and_values(chart, offsets.ravel())[1].reshape(count, -1)
    value = value * rising[:, None]
    passes = (value[:, :-1] < 0) & (value[:, 1:] >= 0)
    away = np.where(passes, np.abs(offsets[:, 1:] + offsets[:, :-1]), np.inf)
    best = np.argmin(away, axis=1)
    rows = np.flatnonzero(np.isfinite(away[np.arange(count), best]))
    if not len(rows):
        return search
    low, high = offsets[rows, best[rows]], offsets[rows, best[rows] + 1]
    root = bracketed_roots(
        lambda offset, row: lines[row].rays_and_values(chart, offset)[1], (low, high), (rows,), **TIGHT
    )
    offset = np.where(np.isfinite(root.x), root.x, (low + high) / 2)
    step = 1e-3 * (high - low)
    (_, here, error), (_, beside, _) = (lines[rows].rays_and_values(chart, w) for w in (offset, offset + step))
    slope = (beside - here) / step
    return search.updated(rows, _SecantSearch(offset + step, offset, beside, here, error, slope))


def limb_folds(
    chart: DiscChart,
    axes: Float[Array, "steps 2 2"],
    start: Float[Array, "steps 2"],
    stop: Float[Array, "steps 2"],
    rising: Float[Array, " steps"],
) -> Float[Array, "steps 2"]:
    """Points of critical curves on the limb, between the ends of steps along it."""
    if not len(start):
        return start

    def place(part: Array, *ends: Array) -> Array:
        a, b, *sides = (np.stack(ends[i : i + 2], axis=-1) for i in (0, 2, 4, 6))
        order, axes = np.zeros(len(a), int), np.stack(sides, axis=1)
        return on_curves(chart, axes, a, b, part[:, None], order, ends[8]).place[:, 0]

    def value(part: Array, *ends: Array) -> Array:
        return chart.rays(*place(part, *ends).T).ratio

    args = (*start.T, *stop.T, *axes.reshape(-1, 4).T, rising)
    root = bracketed_roots(value, (np.zeros(len(start)), np.ones(len(start))), args, **TIGHT)
    return place(np.where(np.isfinite(root.x), root.x, 0.5), *args)
