"""The images of a moving source at times of the viewer: their places on the branches, and their light.

The flux of a source of luminosity 1 that is isotropic in its own frame is

    F = g^4 / (4 pi sqrt(R) |det J|),

with R the radial potential of its light and J the beam to its sphere: sqrt(R) |det J| is the area across the ray per
solid angle, the same for all observers, so that the motion of the source enters through g alone.
"""

import math
from dataclasses import dataclass

import numpy as np

from kerrcaustics.light_curves.arrivals import Arrivals, Source, solutions
from kerrcaustics.light_curves.bent_steps import bent_way, directions_on_cubics
from kerrcaustics.light_curves.curve_following import CurvePoints
from kerrcaustics.light_curves.image_curves import Branch
from kerrcaustics.orbits.orbit import clock_rates
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.cubic_curves import Cubics
from kerrcaustics.spacetime.frame import redshift
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# Bisections for a place on a cubic.
_HALVINGS = 50
# Newton steps to the image.
_STEPS = 8
# Distance at which a ray may miss the source, in errors of the ray.
_ERRORS = 3.0
# The least such distance, over the radius.
_CLOSE = 1e-13
# The longest step, as a part of the distance between the points on both sides.
_FARTHEST = 0.5
# Rounding of a frequency ratio.
_OF_RATIO = 1e-13


@dataclass(frozen=True)
class SeenImages:
    """An image at the times at which it exists, as the viewer sees it.

    sky: direction on the search sky.
    second: True if the ray arrives at the sphere for the second time.
    emitted: emission time, GM/c^3.
    emitted_error: its error.
    redshift: frequency ratio, viewer over source.
    flux: for luminosity 1.
    error: error of flux.
    sky_error: error of the direction on the viewer's sky.
    reached: True where the image itself was found.
    """

    sky: Float[Array, "n 3"]
    second: Bool[Array, " n"]
    emitted: Float[Array, " n"]
    emitted_error: Float[Array, " n"]
    redshift: Float[Array, " n"]
    flux: Float[Array, " n"]
    error: Float[Array, " n"]
    sky_error: Float[Array, " n"]
    reached: Bool[Array, " n"]


def seen_images(source: Source, branches: list[Branch], times: list[Float[Array, " _"]]) -> list[SeenImages]:
    """The images of branches at times of the viewer, for each branch some within its life."""
    if not branches:
        return []
    starts = [_on_curve(source, branch.points, time) for branch, time in zip(branches, times, strict=True)]
    sky, emitted, second, room = (np.concatenate([start[i] for start in starts]) for i in range(4))
    arrival = np.concatenate(times)
    rays, done = _solved(source, source.arrivals(sky, emitted, second), arrival, room)
    if not done.all():
        # Next to the turning point of its ray an image may belong to the other arrival.
        rest = np.flatnonzero(~done)
        second_images = source.arrivals(sky[rest], emitted[rest], ~second[rest])
        second_images, converged = _solved(source, second_images, arrival[rest], room[rest])
        sky, emitted, second = rays.sky.copy(), rays.time.copy(), rays.second.copy()
        for mine, theirs in ((sky, second_images.sky), (emitted, second_images.time), (second, second_images.second)):
            mine[rest[converged]] = theirs[converged]
        rays, done[rest] = source.arrivals(sky, emitted, second), converged
    parts, first = [], 0
    for branch, time in zip(branches, times, strict=True):
        rows = np.arange(first, first + len(time))
        parts.append(_with_errors(rays, rows, branch, time, done[rows]))
        first += len(time)
    return parts


def _on_curve(
    source: Source, points: CurvePoints, time: Float[Array, " n"]
) -> tuple[Float[Array, "n 3"], Float[Array, " n"], Bool[Array, " n"], Float[Array, " n"]]:
    """Directions, emission times and arrivals by cubics between points, and the distances of the points, radians."""
    i = np.clip(np.searchsorted(points.arrival, time) - 1, 0, len(points) - 2)
    start, stop = points[i], points[i + 1]
    way = lengths(bent_way(source.chart, start.sky, stop.sky))
    rise, fall = (_span(point, start, stop, way) for point in (start, stop))
    slopes = start.along * rise[:, None], stop.along * fall[:, None]
    begin, end, slow, fast = (
        np.stack(columns, axis=-1)
        for columns in (
            (start.arrival, start.time),
            (stop.arrival, stop.time),
            (start.rate * start.along_time * rise, start.along_time * rise),
            (stop.rate * stop.along_time * fall, stop.along_time * fall),
        )
    )
    times = Cubics(begin, end - begin, slow, fast)
    low, high, part = np.zeros(len(time)), np.ones(len(time)), np.zeros(len(time))
    for _ in range(_HALVINGS):
        part = (low + high) / 2
        early = times.points(part)[:, 0] < time
        low, high = np.where(early, part, low), np.where(early, high, part)
    emitted = times.points(part)[:, 1]
    sky = directions_on_cubics(source.chart, (start.sky, stop.sky), slopes, part)
    second = np.where(part < 0.5, start.second, stop.second)
    return sky, emitted, second, np.maximum(way, 1e-12)


def _span(point: CurvePoints, first: CurvePoints, second: CurvePoints, way: Float[Array, " n"]) -> Float[Array, " n"]:
    """The distance between neighbours in steps of the curve, at one of them."""
    return np.sqrt(
        (way**2 + ((second.time - first.time) / point.time_per_radian * _per_radian(point)) ** 2)
        / (lengths(point.along) ** 2 + (point.along_time / point.time_per_radian * _per_radian(point)) ** 2)
    )


def _per_radian(point: CurvePoints) -> Float[Array, " n"]:
    """Radians on the sky that count as much as a step of length 1 in time."""
    return 1 / np.sqrt(np.linalg.det(point.metric))


def _solved(
    source: Source, rays: Arrivals, arrival: Float[Array, " n"], room: Float[Array, " n"]
) -> tuple[Arrivals, Bool[Array, " n"]]:
    """Rays that meet the source and arrive at given times, by Newton's method; True where they converged."""
    done = np.zeros(len(arrival), bool)
    for _ in range(_STEPS):
        rays, done = _newton_step(source, rays, arrival, room)
        if done.all():
            break
    return rays, done


def _newton_step(
    source: Source, rays: Arrivals, arrival: Float[Array, " n"], room: Float[Array, " n"]
) -> tuple[Arrivals, Bool[Array, " n"]]:
    """Rays after a Newton step toward the source at arrival times; True where they had converged before it."""
    with np.errstate(invalid="ignore", divide="ignore"):
        delay = (arrival - rays.arrival) / rays.rate
        off = lengths(rays.miss)
        timed = np.abs(arrival - rays.arrival) <= 4 * (np.asarray(rays.beams.time_error) + np.spacing(np.abs(arrival)))
        done = rays.reach & (off <= _CLOSE + _ERRORS * rays.beams.error) & timed
        target = -rays.miss - rays.by_time * delay[:, None]
        step = solutions(rays.by_sky, target)
        step *= np.minimum(1, _FARTHEST * room / np.maximum(lengths(step), 1e-300))[:, None]
    still = done | ~np.isfinite(step).all(axis=1)
    step[still], delay[still] = 0.0, 0.0
    if done.all():
        return rays, done
    return source.arrivals(rays.stepped(step), rays.time + delay, rays.second), done


def size_and_ratio(rays: Arrivals) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Lengths, for the viewer, of a radian of the search sky, and g of the source's light, by direction."""
    searched = rays.source.searched
    stretch = searched.stretch(searched.to_viewer(rays.sky))
    at_infinity = redshift(searched.search_camera.frame(), rays.sky) / stretch
    clock = np.sqrt(clock_rates(rays.source.spin, rays.places))
    return searched.radian_at_rest(rays.sky) * stretch, at_infinity * clock / rays.rate


def _with_errors(
    rays: Arrivals, rows: Array, branch: Branch, time: Float[Array, " n"], done: Bool[Array, " n"]
) -> SeenImages:
    """The observed quantities of an image, with their errors."""
    searched, beams, sky = rays.source.searched, rays.beams, rays.sky[rows]
    plus, minus = beams.delta_plus[rows], np.abs(beams.delta_minus[rows])
    size, ratio = (part[rows] for part in size_and_ratio(rays))
    root, off_root = (part[rows] for part in rays.radial_root)
    place, later, off_ratio = (part[rows] for part in rays.orbit_errors)
    with np.errstate(divide="ignore", invalid="ignore"):
        magnification = size**2 / (plus * minus)
        flux = ratio**4 * magnification / (4 * math.pi * root)
        delay, off = np.asarray(beams.time_error)[rows] + later, beams.error[rows] + lengths(rays.miss[rows]) + place
        lost = 2 * beams.diameter_error[rows] * plus / minus + off * plus / minus + off_root + 4 * _OF_RATIO
        speed = lengths(rays.by_time[rows])
        for turn in (branch.born, branch.dies):
            if turn is not None:
                # The light goes by the root of the distance from the caustic, that is of the time from the event.
                away = np.abs(time - turn.point.arrival[0])
                lost = lost + (turn.error + delay + off / np.maximum(speed, 1e-300) * rays.rate[rows]) / (2 * away)
        error = (np.minimum(np.where(done, lost, 1.0), 1.0) + 4 * off_ratio) * flux
    return SeenImages(
        sky=sky,
        second=rays.second[rows],
        emitted=rays.time[rows],
        emitted_error=delay / rays.rate[rows] + np.abs(time - rays.arrival[rows]),
        redshift=ratio,
        flux=flux,
        error=error,
        sky_error=searched.errors(sky, off / minus),
        reached=done,
    )
