"""Image curves: the images of a moving source, followed along it, through folds where two of them meet.

Images are curves in (N, t), direction and emission time (arrivals.py). Their parameter is the arc length, so that folds
are regular points: the emission time has an extreme there, and a pair of images appears or vanishes.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from kerrcaustics.lens_map.sky_chart import Chart
from kerrcaustics.light_curves.arrivals import Arrivals, Source, solutions
from kerrcaustics.light_curves.bent_steps import bent_step, bent_way, carried
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths, tangent_basis

Array = np.ndarray
Kind = TypeVar("Kind", bound=Rows)

# The first step, in radians of the source's sphere.
_FIRST = 0.1
# The longest step, radians.
_LONGEST = 0.3
# The shortest step, radians.
_SHORTEST = 1e-7
# The shortest step across the turning point of a ray, radians.
_BEYOND = 0.03
# The largest number of steps.
_MOST_STEPS = 400
# Newton steps to the curve.
_NEWTON = 5
# Longest Newton correction, as a part of the step: a longer one requires a shorter step.
_LONG_CORRECTION = 0.3
# Least cosine of the turn of the curve in a step: a smaller one requires a shorter step.
_STRAIGHT = 0.95
# Distance at which a ray may miss the source, over the radius.
_CLOSE = 1e-11
# The same distance in errors of the ray.
_ERRORS = 4.0
# Steps of the search for a fold.
_BISECTIONS = 40
# Component of the curve's direction along time below which a point is a fold.
_LEVEL = 1e-11


@dataclass(frozen=True)
class CurvePoints(Rows):
    """Points of image curves.

    Steps dN along `tangent_basis(N)` and dt have the length |(metric dN, dt / time_per_radian)|, radians at the hole.

    sky: direction N on the search sky.
    time: emission time, GM/c^3.
    second: True if the ray arrives at the sphere for the second time.
    index: Morse index.
    arrival: time when the light arrives, GM/c^3.
    rate: change of arrival with time.
    metric: lengths of steps on the sky.
    time_per_radian: the time that counts as one radian, GM/c^3.
    along: change of sky per step of length 1 on the curve.
    along_time: change of time per step of length 1 on the curve.
    """

    sky: Float[Array, "n 3"]
    time: Float[Array, " n"]
    second: Bool[Array, " n"]
    index: Int[Array, " n"]
    arrival: Float[Array, " n"]
    rate: Float[Array, " n"]
    metric: Float[Array, "n 2 2"]
    time_per_radian: Float[Array, " n"]
    along: Float[Array, "n 3"]
    along_time: Float[Array, " n"]

    @classmethod
    def from_rays(
        cls, rays: Arrivals, longest: Float[Array, " n"] | float, toward: "CurvePoints | Float[Array, ' n']"
    ) -> "CurvePoints":
        """Points where rays arrive at the source.

        longest: longest step in time, GM/c^3; toward: the points before these, or signs of the change of time.
        """
        metric = _metric(rays)
        time_per_radian = 1 / np.maximum(lengths(rays.by_time), 1 / longest)
        rows = np.concatenate(
            [rays.by_sky @ np.linalg.inv(metric), (rays.by_time * time_per_radian[:, None])[:, :, None]], axis=2
        )
        across = np.cross(rows[:, 0], rows[:, 1])
        across /= lengths(across)[:, None]
        flat = np.linalg.solve(metric, across[:, :2, None])[:, :, 0]
        first, second = tangent_basis(rays.sky)
        along, along_time = flat[:, :1] * first + flat[:, 1:] * second, time_per_radian * across[:, 2]
        if isinstance(toward, CurvePoints):
            before = toward.seen_from(rays.source.chart, rays.sky, metric, time_per_radian)
            same = (before * across).sum(axis=1)
        else:
            same = along_time * toward
        sense = np.where(same < 0, -1.0, 1.0)
        return cls(
            sky=rays.sky,
            time=rays.time,
            second=rays.second,
            index=np.asarray(rays.beams.index, int),
            arrival=rays.arrival,
            rate=rays.rate,
            metric=metric,
            time_per_radian=time_per_radian,
            along=along * sense[:, None],
            along_time=along_time * sense,
        )

    def seen_from(
        self, chart: Chart, sky: Float[Array, "n 3"], metric: Float[Array, "n 2 2"], time_per_radian: Float[Array, " n"]
    ) -> Float[Array, "n 3"]:
        """The directions of the curve here, in the units of a metric at other directions."""
        return _metric_steps(metric, time_per_radian, sky, carried(chart, self.sky, self.along, sky), self.along_time)


def _metric(rays: Arrivals) -> Float[Array, "n 2 2"]:
    """The metric of steps on the sky, from their lengths at the source and their parts of the distance to the hole."""
    away = lengths(rays.sky + np.array([1.0, 0.0, 0.0]))
    square = np.swapaxes(rays.by_sky, 1, 2) @ rays.by_sky
    square = square + (1 / np.maximum(away, 1e-12) ** 2)[:, None, None] * np.eye(2)
    square[~np.isfinite(square).all(axis=(1, 2))] = np.eye(2)
    return np.swapaxes(np.linalg.cholesky(square), 1, 2)


def _metric_steps(
    metric: Float[Array, "n 2 2"],
    time_per_radian: Float[Array, " n"],
    sky: Float[Array, "n 3"],
    step: Float[Array, "n 3"],
    step_time: Float[Array, " n"],
) -> Float[Array, "n 3"]:
    """Steps from directions and times, in the units of a metric there."""
    first, second = tangent_basis(sky)
    flat = np.stack([(step * first).sum(axis=1), (step * second).sum(axis=1)], axis=-1)
    return np.concatenate([(metric @ flat[:, :, None])[:, :, 0], (step_time / time_per_radian)[:, None]], axis=1)


@dataclass(frozen=True)
class FollowedCurve:
    """A part of a curve that begins at a moment of the source.

    points: Points along it.
    landed: True if it ends at the same moment or at another one.
    """

    points: CurvePoints
    landed: bool


def follow(
    source: Source, start: CurvePoints, low: Float[Array, " n"], high: Float[Array, " n"]
) -> list[FollowedCurve]:
    """Follow curves from points at the time `low` or `high`, in their direction, until they reach `low` or `high`."""
    n, gap = len(start), high - low
    now = record = start
    tracks = [[i] for i in range(n)]
    step, toward_second = np.full(n, _FIRST), np.zeros(n, bool)
    active, landed = np.arange(n), np.zeros(n, bool)
    for _ in range(_MOST_STEPS):
        here = now[active]
        # Beyond the turning point of its ray an image is one by the other arrival: the next step leads well beyond.
        h = np.where(toward_second[active], np.clip(4 * step[active], _BEYOND, _LONGEST), step[active])
        ahead = here.time + h * here.along_time
        bound = np.where(here.along_time > 0, high[active], low[active])
        lands = np.where(here.along_time > 0, ahead >= bound, ahead <= bound) & (here.along_time != 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = np.where(lands, (bound - here.time) / here.along_time, h)
        trial, good = _stepped(source, here, reach, lands, here.second ^ toward_second[active], gap[active])
        # The time may have an extreme before a curve reaches the bound; points beyond the bound are rejected.
        good &= lands | ((trial.time > low[active]) & (trial.time < high[active]))
        taken = active[good]
        first = len(record)
        record = record.joined(trial[good])
        for k, i in enumerate(taken.tolist()):
            tracks[i].append(first + k)
        now = replaced(now, taken, trial[good])
        landed[active[good & lands]] = True
        step[taken] = np.minimum(np.maximum(1.6 * reach[good], step[taken] * 0.8), _LONGEST)
        # A step that fails is tried with the other arrival at the sphere, then shortened.
        failed = active[~good]
        shorten = toward_second[failed]
        step[failed] = np.where(shorten, step[failed] / 2, reach[~good])
        toward_second[failed] = ~shorten
        toward_second[taken] = False
        active = active[(~landed & ((step > _SHORTEST) | toward_second))[active]]
        if not len(active):
            break
    return [FollowedCurve(record[np.array(track)], bool(landed[i])) for i, track in enumerate(tracks)]


def replaced(points: Kind, which: Int[Array, " some"], replacement: Kind) -> Kind:
    """Rows, some of which are replaced by others."""
    order = np.arange(len(points))
    order[which] = len(points) + np.arange(len(which))
    return points.joined(replacement)[order]


def _stepped(
    source: Source,
    here: CurvePoints,
    h: Float[Array, " n"],
    lands: Bool[Array, " n"],
    second: Bool[Array, " n"],
    gap: Float[Array, " n"],
) -> tuple[CurvePoints, Bool[Array, " n"]]:
    """Points a step on, and whether they continue the curve; lands: their time is fixed."""
    sky = bent_step(source.chart, here.sky, h[:, None] * here.along)
    time = here.time + h * here.along_time
    rays = source.arrivals(sky, time, second)
    moved, close = np.zeros(len(h)), np.zeros(len(h), bool)
    for _ in range(_NEWTON):
        change, change_time = _correction(rays, here, lands)
        flat = (here.metric @ change[:, :, None])[:, :, 0]
        moved += np.sqrt((flat**2).sum(axis=1) + (change_time / here.time_per_radian) ** 2)
        with np.errstate(invalid="ignore"):
            bad = ~np.isfinite(moved) | (moved > 1)
        change[bad], change_time[bad] = 0.0, 0.0
        rays = source.arrivals(rays.stepped(change), rays.time + change_time, second)
        with np.errstate(invalid="ignore"):
            close = ~bad & rays.reach & (lengths(rays.miss) < _CLOSE + _ERRORS * rays.beams.error)
        if (close | bad).all():
            break
    with np.errstate(invalid="ignore", divide="ignore"):
        trial = CurvePoints.from_rays(rays, gap, here)
        before = here.seen_from(source.chart, trial.sky, trial.metric, trial.time_per_radian)
        after = _metric_steps(trial.metric, trial.time_per_radian, trial.sky, trial.along, trial.along_time)
        straight = (before * after).sum(axis=1) > _STRAIGHT * lengths(before) * lengths(after)
        folds = trial.along_time * here.along_time < 0
        index = np.where(folds, np.abs(trial.index - here.index) == 1, trial.index == here.index)
    good = close & (moved < _LONG_CORRECTION * np.abs(h) + 1e-9) & straight & index
    return trial, good


def _correction(
    rays: Arrivals, here: CurvePoints, lands: Bool[Array, " n"]
) -> tuple[Float[Array, "n 2"], Float[Array, " n"]]:
    """The Newton step to the curve, at right angles to it or at a fixed time."""
    matrix = np.zeros((len(lands), 3, 3))
    unit = np.linalg.inv(here.metric)
    matrix[:, :2, :2] = rays.by_sky @ unit
    matrix[:, :2, 2] = rays.by_time * here.time_per_radian[:, None]
    ahead = here.seen_from(rays.source.chart, rays.sky, here.metric, here.time_per_radian)
    matrix[:, 2] = np.where(lands[:, None], np.array([0.0, 0.0, 1.0]), ahead)
    step = solutions(matrix, np.concatenate([-rays.miss, np.zeros((len(lands), 1))], axis=1))
    return (unit @ step[:, :2, None])[:, :, 0], step[:, 2] * here.time_per_radian


def turning_points(
    source: Source, first: CurvePoints, second: CurvePoints
) -> tuple[CurvePoints, Float[Array, " n"], Float[Array, " n"]]:
    """The folds between neighbours on a curve: points, errors of their emission times, errors of their directions.

    The time has an extreme there, so that an error of the direction along the curve changes it in second order.
    """
    chart = source.chart
    way = bent_way(chart, first.sky, second.sky)
    span = lengths(_metric_steps(first.metric, first.time_per_radian, first.sky, way, second.time - first.time))
    same = first.seen_from(chart, first.sky, first.metric, first.time_per_radian) * second.seen_from(
        chart, first.sky, first.metric, first.time_per_radian
    )
    base, left = first, span.copy()
    value, far = _time_slope(first), _time_slope(second) * np.sign(same.sum(axis=1))
    best = first
    for _ in range(_BISECTIONS):
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.clip(np.nan_to_num(value / (value - far), nan=0.5), 0.02, 0.98)
        trial, good = _stepped(
            source, base, part * left, np.zeros(len(first), bool), base.second, np.full(len(first), 1e3)
        )
        lean = _time_slope(trial)
        before = good & (lean * value > 0)
        after = good & ~before
        better = good & ~(np.abs(lean) > np.abs(_time_slope(best)))
        best = replaced(best, np.flatnonzero(better), trial[better])
        left = np.where(before, (1 - part) * left, np.where(after, part * left, left / 2))
        far = np.where(after, lean, far)
        # Illinois: an end that stays counts half, so that both close in.
        value, far = np.where(before, lean, np.where(after, value / 2, value)), np.where(before, far / 2, far)
        base = replaced(base, np.flatnonzero(before), trial[before])
        value = np.where(before, _time_slope(base), value)
        if (np.abs(_time_slope(best)) < _LEVEL).all():
            break
    rays = source.arrivals(best.sky, best.time, best.second)
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = np.abs(_time_slope(second) - _time_slope(first)) / span
        miss = rays.beams.error + rays.orbit_errors.place
        off = (rays.beams.diameter_error + miss + np.abs(_time_slope(best))) / bend
        time_error = miss / lengths(rays.by_time) + off**2 * bend * best.time_per_radian
    return best, time_error, off * lengths(best.along)


def _time_slope(points: CurvePoints) -> Float[Array, " n"]:
    """The component of the curve's direction along time."""
    return points.along_time / points.time_per_radian
