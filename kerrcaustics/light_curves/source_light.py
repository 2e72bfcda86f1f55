"""The light of a source as a viewer receives it: the results, and how they are made of images at their times."""

import math
from collections.abc import Callable

import numpy as np

from kerrcaustics.choices import event_kind
from kerrcaustics.interop.row_tables import TimeTable
from kerrcaustics.light_curves.arrivals import Source
from kerrcaustics.light_curves.ball_light import BallShares
from kerrcaustics.light_curves.image_curves import ImageCurves, Turn
from kerrcaustics.light_curves.seen_images import SeenImages
from kerrcaustics.orbits.orbit import UNSTABLE, Orbit
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


@result("source-event/1", record="kind order moment emission_time radius theta phi sky error sky_error")
class SourceEvent(Shown):
    """The creation, or annihilation, of two images of a moving source."""

    camera: Viewer = quantity("", "", "the viewer", column="")
    kind: str = quantity("", "", '"creation" or "annihilation"')
    order: int = quantity("", "1", "order of the caustic that the source crosses, on the sphere of the source")
    moment: float = quantity("", "GM/c^3", "time of the camera")
    emission_time: float = quantity("", "GM/c^3", "time when the light left the source")
    radius: float = quantity("", "GM/c^2", "radius of the source then")
    theta: float = quantity("", "rad", "theta' of the source then", json="theta_deg")
    phi: float = quantity("", "rad", "phi' of the source then", json="phi_deg")
    sky: Array = quantity("axis", "1", "direction N where it is seen; of an Observer (alpha, beta)")
    error: float = quantity("", "GM/c^3", "estimated error of moment")
    sky_error: float = quantity("", "sky", "estimated error of sky")


@result(
    "source-light/1",
    record="camera orbit size certified remarks index events",
    points="time flux error shares emission_time emission_time_error redshift sky sky_error centroid centroid_error",
)
class SourceLightCurve(TimeTable):
    """The light of a source on an orbit, as a viewer receives it: all of its images of index 0 to a highest one."""

    camera: Viewer = quantity("", "", "the viewer that receives it", json="", column="")
    orbit: str = quantity("", "", "the orbit, in words")
    size: float = quantity("", "GM/c^2", "radius of a ball; 0 for a point")
    time: Array = quantity("time", "GM/c^3", "coordinate time of the camera; for an Observer, that of a plane wave")
    flux: Array = quantity(
        "time",
        "light",
        "flux of a source of luminosity 1 that shines equally in all directions in its own frame; for an Observer, "
        "times the squared distance; of the images up to max_index alone; NaN where unknown",
    )
    error: Array = quantity("time", "light", "estimated error of flux")
    index: Array = quantity("image", "1", "Morse index of each image; an image that exists for a while counts once")
    shares: Array = quantity("image time", "light", "contribution of each image to the flux; 0 while it does not exist")
    emission_time: Array = quantity(
        "image time", "GM/c^3", "time when the light left the source; NaN while the image does not exist"
    )
    emission_time_error: Array = quantity("image time", "GM/c^3", "estimated error of emission_time")
    redshift: Array = quantity("image time", "1", "nu_camera / nu_source")
    sky: Array = quantity("image time axis", "1", "directions N of the images; of an Observer (alpha, beta)")
    sky_error: Array = quantity("image time", "sky", "estimated error of sky")
    centroid: Array = quantity(
        "time axis", "1", "mean direction N of the light, a unit vector; of an Observer the mean (alpha, beta)"
    )
    centroid_error: Array = quantity("time", "sky", "estimated error of centroid")
    events: tuple[SourceEvent, ...] = quantity("event", "", "creations and annihilations of images, in order of time")
    certified: bool = quantity(
        "",
        "1",
        "True if the images are certified at all moments of complete search, and each of them is followed to an image "
        "at the next moment or to a pair event; pairs that exist only between two moments may be missing",
    )
    remarks: tuple[str, ...] = quantity("", "", "remarks on what is in doubt; empty when certified")

    @property
    @derived("image time", "GM/c^3")
    def travel_time(self) -> Array:
        """Time from the emission to the arrival of the light of each image."""
        return self.time - self.emission_time

    def __repr__(self) -> str:
        """Summary in one line: the orbit, images and events."""
        note = "" if self.certified else ", not certified"
        return f"<SourceLightCurve of {self.orbit}: {len(self.index)} images, {len(self.events)} events{note}>"


def source_light_curve(
    source: Source,
    orbit: Orbit,
    times: Float[Array, " t"],
    curves: ImageCurves,
    wanted: list[Array],
    point_images: list[SeenImages],
    ball: BallShares | None,
    size: float,
) -> SourceLightCurve:
    """The result, from the images at their times."""
    searched_sky = source.searched
    kept = [k for k, which in enumerate(wanted) if len(which) or (ball is not None and ball.flux[k].any())]
    axes = searched_sky.to_viewer(np.array([[-1.0, 0.0, 0.0]])).shape[1]

    def table(value: Callable[[SeenImages], Array], empty: float, *shape: int) -> Array:
        rows = np.full((len(kept), len(times), *shape), empty)
        for row, k in enumerate(kept):
            rows[row, wanted[k]] = value(point_images[k])
        return rows

    shares, off = table(lambda s: s.flux, 0.0), table(lambda s: s.error, 0.0)
    sky = table(lambda s: searched_sky.to_viewer(s.sky), math.nan, axes)
    sky_error = table(lambda s: s.sky_error, math.nan)
    if ball is not None:
        shares, off = ball.flux[kept], ball.error[kept]
        there = np.isfinite(ball.sky[kept, :, 0])
        sky[there] = searched_sky.to_viewer(ball.sky[kept][there])
    remarks = _remarks(source, curves, point_images, ball)
    # Without any image nothing is known but that all of them are missing.
    flux = shares.sum(axis=0) if kept or not remarks else np.full(len(times), math.nan)
    centroid, centroid_error = _centroid(shares, off, np.nan_to_num(sky), np.nan_to_num(sky_error), flux)
    turns = [turn for turn in curves.turns if times.min() <= turn.point.arrival[0] <= times.max()]
    return SourceLightCurve(
        camera=searched_sky.viewer,
        orbit=orbit.words,
        size=size,
        time=times,
        flux=flux,
        error=off.sum(axis=0),
        index=np.array([curves.branches[k].index for k in kept], int),
        shares=shares,
        emission_time=table(lambda s: s.emitted, math.nan),
        emission_time_error=table(lambda s: s.emitted_error, math.nan),
        redshift=table(lambda s: s.redshift, math.nan),
        sky=sky,
        sky_error=sky_error,
        centroid=centroid,
        centroid_error=centroid_error,
        events=tuple(_event(source, turn) for turn in sorted(turns, key=lambda turn: turn.point.arrival[0])),
        certified=not remarks,
        remarks=remarks,
    )


def _centroid(
    shares: Float[Array, "image t"],
    off: Float[Array, "image t"],
    places: Float[Array, "image t axes"],
    place_error: Float[Array, "image t"],
    flux: Float[Array, " t"],
) -> tuple[Float[Array, "t axes"], Float[Array, " t"]]:
    """Mean places of the light, directions as unit vectors, and their errors; off: errors of the shares."""
    mean = (shares[:, :, None] * places).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = mean / (lengths(mean) if mean.shape[1] == 3 else flux)[:, None]
        return mean, (off * lengths(places - mean) + shares * place_error).sum(axis=0) / flux


def _remarks(
    source: Source, curves: ImageCurves, point_images: list[SeenImages], ball: BallShares | None
) -> tuple[str, ...]:
    """Remarks on what is in doubt."""
    remarks = [*curves.remarks, *(() if ball is None else ball.remarks)]
    unknown = max((source.motion.errors(s.emitted).place.max(initial=0.0) for s in point_images), default=0.0)
    if unknown > UNSTABLE:
        remarks.append(f"the orbit is unstable: rounding grows to {unknown:.1g} of its radius")
    unreached = sum(int((~s.reached).sum()) for s in point_images)
    if unreached:
        remarks.append(f"{unreached} images at some of the times are known roughly")
    return tuple(remarks)


def _event(source: Source, turn: Turn) -> SourceEvent:
    point, searched_sky = turn.point, source.searched
    rays = source.arrivals(point.sky, point.time, point.second)
    theta, phi = rays.places.angles[0].tolist()
    return SourceEvent(
        camera=searched_sky.viewer,
        kind=event_kind(1.0 if turn.creates else -1.0),
        order=turn.order,
        moment=float(point.arrival[0]),
        emission_time=float(point.time[0]),
        radius=float(rays.places.radius[0]),
        theta=theta,
        phi=phi,
        sky=searched_sky.to_viewer(point.sky)[0],
        error=turn.error * float(point.rate[0]) + float((rays.beams.time_error + rays.orbit_errors.late)[0]),
        sky_error=float(searched_sky.errors(point.sky, np.array([turn.sky_error]))[0]),
    )
