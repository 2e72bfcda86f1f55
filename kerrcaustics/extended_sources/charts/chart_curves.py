"""Places on the limb of a disc, or on a critical curve, next to chords on a chart: the curve as a graph over these."""

from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.extended_sources.charts.charts import ChartRays, DiscChart
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# Steps of the secant method; its first one, the longest way, and the shortest one that measures a slope, in lengths of
# the chord. A place is on a curve within so many errors, and off it beyond so many and so far.
_MOST_STEPS, _FIRST, _FARTHEST, _SHORTEST = 15, 1e-3, 1.0, 1e-7
_ERRORS, _MOST_ERRORS, _SMALL = 3.0, 10.0, 1e-9
# Ways along a line between which the curve is looked for where the secant method fails: how many, as far as so many
# sides of a cell, and the shortest one in lengths of the chord, about. Where more lines than this need it, the curve is
# lost anyway.
_WAYS, _REACH, _LEAST, _MOST_ASTRAY = np.linspace(-1, 1, 41), 1.5, 0.1, 500
_TIGHT = {"absolute": 1e-15, "relative": 1e-15}


@dataclass(frozen=True)
class OnCurves:
    """Places on curves, at parts of chords.

    place: on the chart; rays: the rays there, one after another; slope: growth of the quantity that vanishes on the
    curve, to the left and over the length of the chord; error: of the directions across the curve, radians, infinite
    where it is lost.
    """

    place: Float[Array, "chords parts 2"]
    rays: ChartRays
    slope: Float[Array, "chords parts"]
    error: Float[Array, "chords parts"]


@dataclass(frozen=True)
class _Lines(Rows):
    """Lines across chords.

    base: on the chord; left: across it, as long as it is; limb: True where that is looked for, else a critical curve;
    reach: how many lengths of the chord the curve may be away.
    """

    base: Float[Array, "lines 2"]
    left: Float[Array, "lines 2"]
    limb: Bool[Array, " lines"]
    reach: Float[Array, " lines"]

    def at(self, chart: DiscChart, way: Float[Array, " lines"]) -> tuple[ChartRays, Float[Array, " lines"], Array]:
        """Rays on the lines, what vanishes on the curve, and its error."""
        rays = chart.rays(*(self.base + way[:, None] * self.left).T)
        return (
            rays,
            np.where(self.limb, rays.height, rays.ratio),
            np.where(self.limb, rays.error, rays.ratio_error),
        )


@dataclass(frozen=True)
class _Search(Rows):
    """The secant method on lines.

    way_0, way: two ways along each, the second one the better; value_0, value: there; error: of the second value;
    slope: of the values.
    """

    way_0: Float[Array, " lines"]
    way: Float[Array, " lines"]
    value_0: Float[Array, " lines"]
    value: Float[Array, " lines"]
    error: Float[Array, " lines"]
    slope: Float[Array, " lines"]

    @property
    def ahead(self) -> Float[Array, " lines"]:
        """The next way."""
        with np.errstate(divide="ignore", invalid="ignore"):
            step = self.value * (self.way - self.way_0) / (self.value - self.value_0)
        return np.clip(self.way - np.nan_to_num(step), -_FARTHEST, _FARTHEST)

    def moved(self, way: Array, value: Array, error: Array) -> "_Search":
        """The search after a step, which may have led away from the curve."""
        step, better = way - self.way, np.abs(value) < np.abs(self.value)
        rate = (value - self.value) / np.where(step == 0, 1, step)
        slope = np.where(np.abs(step) > _SHORTEST, rate, self.slope)
        return _Search(
            np.where(better, self.way, way),
            np.where(better, way, self.way),
            np.where(better, self.value, value),
            np.where(better, value, self.value),
            np.where(better, error, self.error),
            slope,
        )

    def updated(self, rows: Int[Array, " rows"], new: "_Search") -> "_Search":
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
    """Places at parts of chords, led across them to the limb, where the order is 0, or to critical curves.

    rising: 1 where the quantity that vanishes there grows to the left of the chord, -1 where it falls, 0 where unknown.
    axes: rows, two vectors on the chart that are taken to be equally long and normal to each other.
    """
    chord = np.einsum("ni,nij->nj", stop - start, np.linalg.inv(axes))
    left = np.einsum("ni,nij->nj", np.stack([-chord[:, 1], chord[:, 0]], axis=-1), axes)
    base = start[:, None] + part[..., None] * (stop - start)[:, None]
    count = part.shape[1]
    reach = np.maximum(_FARTHEST, _REACH / np.maximum(lengths(chord), 1e-300))
    columns = (np.repeat(column, count, axis=0) for column in (left, order == 0, reach))
    lines = _Lines(base.reshape(-1, 2), *columns)
    wanted = np.repeat(rising, count)
    search, lever = _begun(chart, lines)
    active = np.arange(len(lines.base))
    for _ in range(_MOST_STEPS):
        active = active[~(np.abs(search.value[active]) <= _ERRORS * search.error[active])]
        if not len(active):
            break
        here = search[active]
        way = here.ahead
        search = search.updated(active, here.moved(way, *lines[active].at(chart, way)[1:]))
    astray = ~(search.slope * wanted >= 0) | ~(np.abs(search.value) <= _MOST_ERRORS * search.error)
    here = np.flatnonzero(astray & (wanted != 0))
    if 0 < len(here) <= _MOST_ASTRAY:
        search = search.updated(here, _bracketed(chart, lines[here], wanted[here], search[here]))
    rays, value, error = lines.at(chart, search.way)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        off = (np.abs(value) + error) / np.abs(search.slope)
        lost = (np.abs(value) > _MOST_ERRORS * error) & (off > _SMALL)
        lost |= search.slope * wanted < 0
        off = np.where(lost | ~np.isfinite(off), np.inf, off * lever)
    place = (lines.base + search.way[:, None] * lines.left).reshape(*part.shape, 2)
    return OnCurves(place, rays, search.slope.reshape(part.shape), off.reshape(part.shape))


def _begun(chart: DiscChart, lines: _Lines) -> tuple[_Search, Float[Array, " lines"]]:
    """The search on the chord and next to it; by how much directions change over the length of the chord."""
    zero, first = np.zeros(len(lines.base)), np.full(len(lines.base), _FIRST)
    (here, value, error), (beside, other, _) = lines.at(chart, zero), lines.at(chart, first)
    lever = lengths(beside.sky - here.sky) / _FIRST
    return _Search(first, zero, other, value, error, (other - value) / _FIRST), lever


def _bracketed(chart: DiscChart, lines: _Lines, rising: Float[Array, " lines"], search: _Search) -> _Search:
    """The search where the secant method led to another branch of the curve, or nowhere: the nearest that will do."""
    count = len(lines.base)
    ways = np.sign(_WAYS) * _LEAST * np.expm1(np.abs(_WAYS) * np.log1p(lines.reach / _LEAST)[:, None])
    value = lines[np.repeat(np.arange(count), len(_WAYS))].at(chart, ways.ravel())[1].reshape(count, -1)
    value = value * rising[:, None]
    passes = (value[:, :-1] < 0) & (value[:, 1:] >= 0)
    away = np.where(passes, np.abs(ways[:, 1:] + ways[:, :-1]), np.inf)
    best = np.argmin(away, axis=1)
    rows = np.flatnonzero(np.isfinite(away[np.arange(count), best]))
    if not len(rows):
        return search
    low, high = ways[rows, best[rows]], ways[rows, best[rows] + 1]
    root = bracketed_roots(lambda way, row: lines[row].at(chart, way)[1], (low, high), (rows,), **_TIGHT)
    way = np.where(np.isfinite(root.x), root.x, (low + high) / 2)
    step = 1e-3 * (high - low)
    (_, here, error), (_, beside, _) = (lines[rows].at(chart, w) for w in (way, way + step))
    slope = (beside - here) / step
    return search.updated(rows, _Search(way + step, way, beside, here, error, slope))


def limb_folds(
    chart: DiscChart,
    axes: Float[Array, "steps 2 2"],
    start: Float[Array, "steps 2"],
    stop: Float[Array, "steps 2"],
    rising: Float[Array, " steps"],
) -> Float[Array, "steps 2"]:
    """Places on the limb, between ends of steps along it, where beams are flat."""
    if not len(start):
        return start

    def place(part: Array, *ends: Array) -> Array:
        a, b, *sides = (np.stack(ends[i : i + 2], axis=-1) for i in (0, 2, 4, 6))
        order, axes = np.zeros(len(a), int), np.stack(sides, axis=1)
        return on_curves(chart, axes, a, b, part[:, None], order, ends[8]).place[:, 0]

    def value(part: Array, *ends: Array) -> Array:
        return chart.rays(*place(part, *ends).T).ratio

    args = (*start.T, *stop.T, *axes.reshape(-1, 4).T, rising)
    root = bracketed_roots(value, (np.zeros(len(start)), np.ones(len(start))), args, **_TIGHT)
    return place(np.where(np.isfinite(root.x), root.x, 0.5), *args)
