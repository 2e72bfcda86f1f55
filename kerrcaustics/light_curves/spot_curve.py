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
from kerrcaustics.images.circle_arcs import Arcs
from kerrcaustics.interop.row_tables import TimeTable
from kerrcaustics.lens_map.domains import Ring
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.light_curves.sources import Spot
from kerrcaustics.light_curves.spot_light import CirclingSpot, orbit_image, received, splined
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.results.progress import in_steps
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers, quoted, whole_number
from kerrcaustics.spacetime.viewer import Viewer, finite_number
from kerrcaustics.tracks.arc_tracks import node_errors
from kerrcaustics.tracks.events import arc_events
from kerrcaustics.tracks.isoradials import arcs_seen, check_circles

Array = np.ndarray

_MOST_TIMES = 1_000_000
# Relative rounding of a centroid.
_ROUNDING = 1e-12


@result("spot-event/1", record="kind crossing moment azimuth sky error sky_error")
class SpotEvent(Shown):
    """The creation, or annihilation, of two images of a spot."""

    camera: Viewer = quantity("", "", "the viewer", column="")
    kind: str = quantity("", "", '"creation" or "annihilation"')
    crossing: int = quantity("", "1", "number of the crossing of the plane, from 1")
    moment: float = quantity("", "GM/c^3", "time of the camera, within the first orbit")
    azimuth: float = quantity("", "rad", "azimuth of the spot when the light left it", json="azimuth_deg")
    sky: Array = quantity("axis", "1", "direction N where it is seen; of an Observer (alpha, beta)")
    error: float = quantity("", "GM/c^3", "estimated error of moment")
    sky_error: float = quantity("", "sky", "estimated error of sky, along the image of the orbit")


@result(
    "light-curve/1",
    record="radius size power period certified remarks events",
    points="time flux error shares centroid centroid_error travel_time travel_time_error",
)
class LightCurve(TimeTable):
    """The light of a spot that circles the hole, as a viewer receives it."""

    camera: Viewer = quantity("", "", "the viewer that receives it", json="", column="")
    radius: float = quantity("", "GM/c^2", "radius of the orbit", json="orbit")
    size: float = quantity("", "GM/c^2", "standard deviation of the spot along its orbit")
    period: float = quantity("", "GM/c^3", "period of the orbit")
    time: Array = quantity(
        "time",
        "GM/c^3",
        "time of the camera, 0 when the spot's own azimuth is 0; an Observer's is later by r + 2 ln r of the observer",
    )
    flux: Array = quantity(
        "time",
        "solid angle",
        "solid angle times g^power, for a spot of unit intensity and unit area; NaN where unknown",
    )
    error: Array = quantity("time", "solid angle", "estimated error of the flux, of all its crossings")
    shares: Array = quantity("crossing time", "solid angle", "contribution of each crossing to the flux")
    power: float = quantity("", "1", "power of the frequency ratio g with which the intensity scales")
    centroid: Array = quantity(
        "time axis", "1", "mean direction N of the light, a unit vector; of an Observer the mean (alpha, beta)"
    )
    centroid_error: Array = quantity("time", "sky", "estimated error of the centroid")
    travel_time: Array = quantity(
        "crossing time",
        "GM/c^3",
        "mean travel time of the light of each crossing; for an Observer, that of a plane wave, minus r + 2 ln r of "
        "the observer; NaN without light",
    )
    travel_time_error: Array = quantity("crossing time", "GM/c^3", "estimated error of travel_time")
    events: tuple[SpotEvent, ...] = quantity("event", "", "creations and annihilations of images, in order of time")
    certified: bool = quantity(
        "",
        "1",
        "True when no image of the orbit, and no event, is missing at the requested crossings: each is one "
        "closed curve round the shadow, along which the azimuth runs as the Morse index says, once round in all",
    )
    remarks: tuple[str, ...] = quantity("", "", "remarks on what is in doubt; empty when certified")


def spot_light_curve(camera: Viewer, orbit: float, times: ArrayLike | int, source: Spot) -> LightCurve:
    """The light of a small spot on a circular orbit in the equatorial plane, for `kerrcaustics.light_curve`."""
    spot, points = _circling(camera, orbit, source), source.points
    clock = clock_of(times, spot.period)
    Ring(camera, EquatorialPlane(1)).check()
    crossings = in_steps("crossing", range(1, source.crossings + 1))
    images = [_seen(camera, spot, crossing, clock, points) for crossing in crossings]
    fine, coarse = (np.stack([image.received[i] for image in images]) for i in (0, 1))
    shares, late_error = fine[..., 0], [image.late_error for image in images]
    flux, (centroid, coarse_centroid) = shares.sum(axis=0), (_centroid(part) for part in (fine, coarse))
    late, late_coarse = (_mean_time(part) for part in (fine, coarse))
    remarks = tuple(f"crossing {n}: {remark}" for n, image in enumerate(images, 1) for remark in image.remarks)
    events = (event for image in images for event in image.events)
    return LightCurve(
        camera=camera,
        radius=spot.radius,
        size=spot.size,
        period=spot.period,
        time=clock,
        flux=flux,
        error=_doubt(np.abs(shares - coarse[..., 0]).sum(axis=0), flux) + _ROUNDING * flux,
        shares=shares,
        power=spot.power,
        centroid=centroid,
        centroid_error=_doubt(np.linalg.norm(centroid - coarse_centroid, axis=-1))
        + _ROUNDING * np.linalg.norm(centroid, axis=-1),
        travel_time=late,
        travel_time_error=_doubt(np.abs(late - late_coarse)) + np.array(late_error)[:, None],
        events=tuple(sorted(events, key=lambda event: event.moment)),
        certified=not remarks,
        remarks=remarks,
    )


def _circling(camera: Viewer, orbit: float, source: Spot) -> CirclingSpot:
    """A spot on its orbit; ValueError for a radius at which nothing circles."""
    radius = float(check_circles(camera, "orbit", finite_number("orbit", orbit))[0])
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
    """Light by a crossing: sums (times, columns) with all points and with half of them, and what else is known."""

    received: tuple[Array, Array]
    late_error: float
    events: list[SpotEvent]
    remarks: tuple[str, ...]


def _seen(viewer: Viewer, spot: CirclingSpot, crossing: int, clock: Float[Array, " t"], points: int) -> _Image:
    """The light of one crossing at times: of an image that could not be followed NaN."""
    lens_map = LensMap(viewer, EquatorialPlane(crossing, spot.motion))
    arcs = arcs_seen(viewer, crossing, spot.radius)
    image = None if arcs.distance is None else orbit_image(lens_map, arcs, spot, points)
    if image is None:
        axes = lens_map.sky.to_viewer(np.array([[-1.0, 0.0, 0.0]])).shape[1]
        unknown = np.full((len(clock), axes + 2), np.nan)
        return _Image((unknown, unknown), math.nan, [], arcs.remarks or ("parts of the image could not be found",))
    curves = (splined(image, spot, step) for step in (1, 2))
    full, half = (received(curve, spot.orbital, clock, spot.size / spot.radius) / spot.radius for curve in curves)
    return _Image((full, half), float(image.late_error.max()), _events(lens_map, arcs, spot), arcs.remarks)


def _doubt(change: Float[Array, "*batch times"], scale: Array | float = 1.0) -> Float[Array, "*batch times"]:
    """Errors of what changes so much with half of the points: pieces of a curve leave a third of it, splines less.

    At some times it is small by chance, so that the mean over all times, relative to a scale, is added.
    """
    mean = np.nanmean(change, axis=-1, keepdims=True) if np.isfinite(change).any(axis=-1).all() else np.nan
    return change + scale * mean / np.mean(scale)


def _centroid(light: Float[Array, "crossings times columns"]) -> Float[Array, "times axes"]:
    """The mean place on the sky; a direction is a unit vector."""
    total = light.sum(axis=0)
    places = total[:, 1:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.linalg.norm(places, axis=1) if places.shape[1] == 3 else total[:, 0]
        return places / size[:, None]


def _mean_time(light: Float[Array, "crossings times columns"]) -> Float[Array, "crossings times"]:
    with np.errstate(invalid="ignore", divide="ignore"):
        return light[..., -1] / light[..., 0]


def _events(lens_map: LensMap, arcs: Arcs, spot: CirclingSpot) -> list[SpotEvent]:
    """The folds of an image of the orbit, at which the azimuth turns back along it."""
    light = lens_map.light_at(arcs.low.sky)
    errors = lens_map.errors(arcs.low.sky, node_errors(arcs, light.beams))[arcs.folded]
    late, late_error = light.time[arcs.folded], light.time_error[arcs.folded]
    pairs = arc_events(lens_map.viewer, arcs, lens_map.surface)
    return [
        SpotEvent(
            camera=lens_map.viewer,
            kind=event_kind(arcs.sense[arc] * spot.orbital),
            crossing=arcs.circles.end.crossing,
            moment=float((pair.azimuth / spot.orbital + late[i]) % spot.period),
            azimuth=pair.azimuth,
            sky=pair.sky,
            error=float(pair.error / abs(spot.orbital) + late_error[i]),
            sky_error=float(errors[i]),
        )
        for i, (arc, pair) in enumerate(pairs.items())
    ]
