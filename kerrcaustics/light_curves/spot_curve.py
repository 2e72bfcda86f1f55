"""Light curves of a small spot on a circular orbit: all images of its orbit are known curves (isoradials.py).

While the spot circles, its images run along them. Light that is seen at the time t left the point with the azimuth phi
at t - T, when the spot was at Omega (t - T): so the flux is an integral along each curve,

    F(t) = integral of g^4 w(phi - Omega (t - T)) |dN| / |dr / dN| dr,

with w the spot's profile (spot_light.py). It is smooth, also where images are created and destroyed: at folds of the
curve, extremes of phi and, as dT = -b dphi on a circle, of phi + Omega T. With N or T under the integral it gives the
centroid and the mean travel time of that light.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.choices import event_kind
from kerrcaustics.images.circle_arcs import Arcs, circle_image
from kerrcaustics.images.circle_folds import fold_errors, fold_orders, node_errors
from kerrcaustics.lens_map.arguments import checked_radii
from kerrcaustics.lens_map.domains import Ring
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.light_curves.results import LightCurve, SpotEvent
from kerrcaustics.light_curves.sources import Spot
from kerrcaustics.light_curves.spot_light import CirclingSpot, orbit_image, received_light, splined_curve
from kerrcaustics.orbits.orbit import orbit_of
from kerrcaustics.results.progress import in_steps
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers, quoted, whole_number
from kerrcaustics.spacetime.viewer import Viewer, finite_number

Array = np.ndarray

_MOST_TIMES = 1_000_000
# Relative rounding of a centroid.
_ROUNDING = 1e-12


def spot_light_curve(camera: Viewer, orbit: float, times: ArrayLike | int, source: Spot) -> LightCurve:
    """The light of a small spot on a circular orbit in the equatorial plane, for `kerrcaustics.light_curve`."""
    spot, points = _circling(camera, orbit, source), source.points
    clock = clock_of(times, spot.period)
    Ring(camera, EquatorialPlane(1)).check()
    crossings = in_steps("crossing", range(1, source.crossings + 1))
    images = [_crossing_light(camera, spot, crossing, clock, points) for crossing in crossings]
    fine, coarse = (np.stack([image.received[i] for image in images]) for i in (0, 1))
    all_light, shares = fine.sum(axis=0), fine[..., 0]
    flux, (mean, coarse_mean) = shares.sum(axis=0), (_means(part) for part in (fine, coarse))
    centroid, coarse_centroid = _means(all_light).sky, _means(coarse.sum(axis=0)).sky
    light_error = np.array([image.light_error for image in images])
    travel_time_error = np.array([image.travel_time_error for image in images])[:, None]
    remarks = tuple(f"crossing {n}: {remark}" for n, image in enumerate(images, 1) for remark in image.remarks)
    events = (event for image in images for event in image.events)
    return LightCurve(
        camera=camera,
        source="spot",
        orbit=orbit_of("orbit", spot.radius).words,
        radius=spot.radius,
        size=spot.size,
        motion=spot.motion,
        power=spot.power,
        period=spot.period,
        time=clock,
        flux=flux,
        error=_doubt(np.abs(shares - coarse[..., 0]).sum(axis=0), flux) + light_error @ shares + _ROUNDING * flux,
        index=np.full(len(images), -1),
        crossing=np.arange(1, len(images) + 1),
        shares=shares,
        emission_time=clock - mean.travel_time,
        emission_time_error=_doubt(np.abs(mean.travel_time - coarse_mean.travel_time)) + travel_time_error,
        redshift=mean.redshift,
        sky=mean.sky,
        sky_error=_place_error(mean.sky, coarse_mean.sky),
        centroid=centroid,
        centroid_error=_place_error(centroid, coarse_centroid),
        events=tuple(sorted(events, key=lambda event: event.moment)),
        certified=not remarks,
        remarks=remarks,
    )


def _circling(camera: Viewer, orbit: float, source: Spot) -> CirclingSpot:
    """A spot on its orbit; ValueError for a radius at which nothing circles."""
    radius = float(checked_radii(camera, "orbit", finite_number("orbit", orbit))[0])
    emitter = EMITTERS[source.motion](camera.spin, radius, 0.0)
    if not emitter.slowness > 0:
        raise ValueError(f"Argument `orbit` must be the radius of a circular orbit, but is {radius:g}.")
    return CirclingSpot(radius, source.size, source.motion, float(emitter.orbital), source.power)


def clock_of(times: ArrayLike | int, period: float) -> Float[Array, " t"]:
    """The times of an argument, or so many of them over one orbit."""
    if isinstance(times, int | np.integer):
        count = whole_number("times", times, 1, _MOST_TIMES)
        return np.arange(count) * (period / count)
    clock = numbers("times", times).ravel()
    if not (len(clock) and np.isfinite(clock).all()):
        raise ValueError(f"Argument `times` must be a whole number, or finite times, but is {quoted(times)}.")
    return clock


class _Image(NamedTuple):
    """Light by one crossing.

    received: Sums over light (times, columns) with all points, and with half of them.
    travel_time_error: Largest error of travel times, GM/c^3.
    light_error: Largest error of the power of the frequency ratio, relative to it.
    events: Folds of the image.
    remarks: One for each doubt.
    """

    received: tuple[Array, Array]
    travel_time_error: float
    light_error: float
    events: list[SpotEvent]
    remarks: tuple[str, ...]


def _crossing_light(
    viewer: Viewer, spot: CirclingSpot, crossing: int, clock: Float[Array, " t"], points: int
) -> _Image:
    """The light of one crossing at times; NaN if its image could not be followed."""
    lens_map = LensMap(viewer, EquatorialPlane(crossing, spot.motion))
    arcs = circle_image(viewer, crossing, spot.radius)
    image = None if arcs.distance is None else orbit_image(lens_map, arcs, spot, points)
    if image is None:
        axes = lens_map.sky.to_viewer(np.array([[-1.0, 0.0, 0.0]])).shape[1]
        unknown = np.full((len(clock), axes + 3), np.nan)
        return _Image(
            (unknown, unknown), math.nan, math.nan, [], arcs.remarks or ("parts of the image could not be found",)
        )
    curves = (splined_curve(image, spot, step) for step in (1, 2))
    full, half = (received_light(curve, spot.orbital, clock, spot.size / spot.radius) / spot.radius for curve in curves)
    errors = float(image.travel_time_error.max()), float(image.light_error.max())
    return _Image((full, half), *errors, _events(lens_map, arcs, spot), arcs.remarks)


def _doubt(change: Float[Array, "*batch times"], scale: Array | float = 1.0) -> Float[Array, "*batch times"]:
    """Errors from the change with half of the points: that of pieces of a curve leaves a third of it, of splines less.

    The change is small by chance at some times, so that twice its mean over all times, relative to a scale, is added.
    """
    mean = np.nanmean(change, axis=-1, keepdims=True) if np.isfinite(change).any(axis=-1).all() else np.nan
    return change + 2 * scale * mean / np.mean(scale)


class _Means(NamedTuple):
    """Means over light; NaN without light.

    sky: place on the sky (..., axes), a direction as a unit vector.
    travel_time: travel time, GM/c^3.
    redshift: frequency ratio.
    """

    sky: Array
    travel_time: Array
    redshift: Array


def _means(light: Float[Array, "*batch columns"]) -> _Means:
    """The means over sums of light; NaN without light."""
    places = light[..., 1:-2]
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.linalg.norm(places, axis=-1) if places.shape[-1] == 3 else light[..., 0]
        return _Means(places / size[..., None], light[..., -2] / light[..., 0], light[..., -1] / light[..., 0])


def _place_error(
    places: Float[Array, "*batch times axes"], coarse: Float[Array, "*batch times axes"]
) -> Float[Array, "*batch times"]:
    """Errors of places, from those with half of the points."""
    return _doubt(np.linalg.norm(places - coarse, axis=-1)) + _ROUNDING * np.linalg.norm(places, axis=-1)


def _events(lens_map: LensMap, arcs: Arcs, spot: CirclingSpot) -> list[SpotEvent]:
    """The folds of an image of the orbit, at which the azimuth turns back along it."""
    light, azimuth = lens_map.light_at(arcs.low.sky), arcs.low.azimuth
    sky_error, error = lens_map.errors(arcs.low.sky, node_errors(arcs, light.beams)), fold_errors(arcs)
    orders = fold_orders(arcs)
    events = []
    for k, i in enumerate(np.flatnonzero(arcs.folded).tolist()):
        moment = float((azimuth[i] / spot.orbital + light.time[i]) % spot.period)
        events.append(
            SpotEvent(
                kind=event_kind(arcs.sense[i] * spot.orbital),
                order=int(orders[k]),
                moment=moment,
                emission_time=moment - float(light.time[i]),
                sky=light.sky[i],
                camera=lens_map.viewer,
                crossing=arcs.circles.end.crossing,
                azimuth=float(azimuth[i]),
                error=float(error[k] / abs(spot.orbital) + light.time_error[i]),
                sky_error=float(sky_error[i]),
            )
        )
    return events
