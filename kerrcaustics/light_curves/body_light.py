"""The light curve of a point or a ball, from its images at their times."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from kerrcaustics.choices import event_kind
from kerrcaustics.light_curves.arrivals import Source
from kerrcaustics.light_curves.ball_light import BallShares
from kerrcaustics.light_curves.image_curves import ImageCurves, Turn
from kerrcaustics.light_curves.results import LightCurve, SourceEvent
from kerrcaustics.light_curves.seen_images import SeenImages
from kerrcaustics.orbits.orbit import UNSTABLE, Orbit
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray


def body_light_curve(
    source: Source,
    orbit: Orbit,
    times: Float[Array, " t"],
    curves: ImageCurves,
    branch_times: list[Array],
    point_images: list[SeenImages],
    ball: BallShares | None,
    size: float,
) -> LightCurve:
    """The light curve, from the images at their times."""
    sky = source.searched
    kept = [k for k, which in enumerate(branch_times) if len(which) or (ball is not None and ball.flux[k].any())]

    def table(value: Callable[[SeenImages], Array], empty: float, *shape: int) -> Array:
        rows = np.full((len(kept), len(times), *shape), empty)
        for row, k in enumerate(kept):
            rows[row, branch_times[k]] = value(point_images[k])
        return rows

    shares, off = table(lambda s: s.flux, 0.0), table(lambda s: s.error, 0.0)
    places, sky_error = (
        table(lambda s: sky.to_viewer(s.sky), math.nan, sky.to_viewer(-np.eye(1, 3)).shape[1]),
        table(lambda s: s.sky_error, math.nan),
    )
    if ball is not None:
        shares, off = ball.flux[kept], ball.error[kept]
        visible = np.isfinite(ball.sky[kept, :, 0])
        places[visible] = sky.to_viewer(ball.sky[kept][visible])
    remarks = _remarks(source, curves, point_images, ball)
    # If no image was found, the flux is unknown unless there are no doubts.
    flux = shares.sum(axis=0) if kept or not remarks else np.full(len(times), math.nan)
    centroid, centroid_error = _centroid(shares, off, np.nan_to_num(places), np.nan_to_num(sky_error), flux)
    return LightCurve(
        camera=sky.viewer,
        **_on_orbit(orbit, sky.viewer.spin, size),
        time=times,
        flux=flux,
        error=off.sum(axis=0),
        index=np.array([curves.branches[k].index for k in kept], int),
        crossing=np.zeros(len(kept), int),
        shares=shares,
        emission_time=table(lambda s: s.emitted, math.nan),
        emission_time_error=table(lambda s: s.emitted_error, math.nan),
        redshift=table(lambda s: s.redshift, math.nan),
        sky=places,
        sky_error=sky_error,
        centroid=centroid,
        centroid_error=centroid_error,
        events=_events(source, curves, times),
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
    """Remarks, one for each doubt."""
    remarks = [*curves.remarks, *(() if ball is None else ball.remarks)]
    unknown = max((source.motion.errors(s.emitted).place.max(initial=0.0) for s in point_images), default=0.0)
    if unknown > UNSTABLE:
        remarks.append(f"the orbit is unstable: rounding grows to {unknown:.1g} of its radius")
    unreached = sum(int((~s.reached).sum()) for s in point_images)
    if unreached:
        remarks.append(f"{unreached} images at some of the times are known roughly")
    return tuple(remarks)


def _on_orbit(orbit: Orbit, spin: float, size: float) -> dict[str, Any]:
    """The fields of a light curve that describe the source and its orbit."""
    period = math.nan if orbit.period is None else orbit.period(spin)
    about = {"orbit": orbit.words, "radius": orbit.radius, "period": period}
    return {**about, "source": "ball" if size else "point", "size": size, "motion": "", "power": 4.0}


def _events(source: Source, curves: ImageCurves, times: Float[Array, " t"]) -> tuple[SourceEvent, ...]:
    """The events within the times, in order."""
    turns = [turn for turn in curves.turns if times.min() <= turn.point.arrival[0] <= times.max()]
    return tuple(_event(source, turn) for turn in sorted(turns, key=lambda turn: turn.point.arrival[0]))


def _event(source: Source, turn: Turn) -> SourceEvent:
    point, sky = turn.point, source.searched
    rays = source.arrivals(point.sky, point.time, point.second)
    theta, phi = rays.places.angles[0].tolist()
    return SourceEvent(
        camera=sky.viewer,
        kind=event_kind(1.0 if turn.creates else -1.0),
        order=turn.order,
        moment=float(point.arrival[0]),
        emission_time=float(point.time[0]),
        radius=float(rays.places.radius[0]),
        theta=theta,
        phi=phi,
        sky=sky.to_viewer(point.sky)[0],
        error=turn.error * float(point.rate[0]) + float((rays.beams.time_error + rays.orbit_errors.delay)[0]),
        sky_error=float(sky.errors(point.sky, np.array([turn.sky_error]))[0]),
    )
