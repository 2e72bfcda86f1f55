"""The light curve of a source on any orbit: its images, their light and their events, as a viewer receives them."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.light_curves.ball_light import ball_shares
from kerrcaustics.light_curves.balls import MovingBall
from kerrcaustics.light_curves.body_light import body_light_curve
from kerrcaustics.light_curves.emission_span import emission_span, search_moments
from kerrcaustics.light_curves.image_curves import image_curves, images_at_moments
from kerrcaustics.light_curves.results import LightCurve
from kerrcaustics.light_curves.seen_images import seen_images
from kerrcaustics.light_curves.sources import Ball, Spot
from kerrcaustics.light_curves.spot_curve import clock_of, spot_light_curve
from kerrcaustics.orbits.motions import Path
from kerrcaustics.orbits.orbit import Orbit, orbit_of
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import left_out, one_of, whole_number
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

# Highest Morse index by default.
_HIGHEST = 2
# Kinds of sources by name, with their default properties.
_KINDS: dict[str, type[Ball | Spot] | None] = {"point": None, "ball": Ball, "spot": Spot}


@usual_warnings
@with_progress
def light_curve(
    camera: Viewer,
    orbit: float | Orbit | Path,
    times: ArrayLike | int = 200,
    *,
    source: str | Ball | Spot | None = None,
    max_index: int | None = None,
    searches: int | None = None,
    size: float | None = None,
    crossings: int | None = None,
    progress: Progress | bool | None = None,
) -> LightCurve:
    """The light of a source on an orbit, image by image: a point or a ball on any orbit, or a small spot in a disk.

    Parameters
    ----------
    camera : Camera or Observer
        At rest in Boyer-Lindquist coordinates, or otherwise fixed at its place for that time; for a spot, off the
        equatorial plane. If it lies exactly in that plane, and so does the orbit, images are not followed through cusps
        of caustics, and the light is not certified: an inclination that differs by 1e-10 is enough.
    orbit : float, Orbit or function
        A radius: a circle in the equatorial plane. For a point or a ball also an `Orbit`, or a function of the
        coordinate time that returns (r, theta, phi).
    times : (t,) array or int
        Times of the camera (units of the mass); a whole number is the number of times over one orbit, if it has a
        period.
    source : str, Ball or Spot, optional
        "point", "ball" or "spot", or a `Ball` or a `Spot` with properties of its own. By default a spot if `orbit` is a
        radius, else a point.
    max_index : int, optional
        For a point or a ball: highest Morse index of its images, at most 6; 2 by default.
    searches : int, optional
        For a point or a ball: number of moments at which all images are searched for, 2 to 2000; by default one for
        every 14 degrees of its path.
    size : float, optional
        For "ball" and "spot": as of `Ball` and `Spot`, 0.1 by default.
    crossings : int, optional
        For "spot": as of `Spot`, 4 by default.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    LightCurve
        For a point or a ball: its flux for the luminosity 1, equal in all directions in its own frame, with emission
        times, frequency ratios and places of all images, and all pair events of its centre. A pair that shows only the
        edge of a ball, at a caustic that its centre does not cross, is not searched for. For a spot of intensity I and
        area A, as r dr dphi in the frame that circles with it, the flux is I A times its `flux`: in M^2, as areas of
        (alpha, beta), for an Observer; its images are those of each crossing of the plane. Times are evenly spaced for
        the camera, and are coordinate times; an Observer's are relative to a plane wave.

    Raises
    ------
    ValueError
        If an argument is invalid, or is for another kind of source; if the source stays on the axis through hole and
        viewer, or reaches the horizon or moves faster than light before the light of the last time leaves it.

    Errors
    ------
    Point: from the errors of the beams and of the orbit, and near an event from that of its time. On unstable orbits
    rounding grows exponentially; beyond 1e-6 of the radius nothing is certified. Ball: from the difference from coarser
    sums, and (size / r)^2, by which spacetime bends within it. Spot: all errors from the difference from half of the
    points, at that time and on average over all times. Events lie where beams are flat, and are as accurate as rays.

    Notes
    -----
    A point is infinitely bright at its events, as 1 over the root of the time to them; a ball is not, and images that
    merge share their light equally. For a Camera a spot's `flux` is in steradians. The light of each further crossing
    is fainter by e^-pi or so without spin, and by less on the prograde side of a spinning hole.

    References
    ----------
    Cunningham & Bardeen 1973, ApJ 183, 237: a star that circles a Kerr hole.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=30, inclination=1.2)
    >>> light = kc.light_curve(camera, 8.0)
    >>> round(light.period, 3), len(light.events)
    (147.827, 6)
    >>> fall = kc.Orbit.geodesic(9.0, 1.4, velocity=(-0.1, 0.0, 0.3))
    >>> kc.light_curve(camera, fall, [30.0, 60.0], max_index=1).certified
    True
    """
    shining = _shining(source, isinstance(orbit, Orbit) or callable(orbit), size, crossings)
    if isinstance(shining, Spot):
        for name, value in (("max_index", max_index), ("searches", searches)):
            left_out(name, value, "for a spot, as only a point or a ball has it")
        radius: Any = orbit
        return spot_light_curve(camera, radius, times, shining)
    highest = _HIGHEST if max_index is None else max_index
    return _light_of_body(camera, orbit, times, highest, searches, 0.0 if shining is None else shining.size)


def _shining(source: Any, free: bool, size: float | None, crossings: int | None) -> Ball | Spot | None:
    """What shines: None for a point; ValueError for arguments that the source has no use for.

    free: True for an orbit that is no circle in the plane.
    """
    given = {"size": size, "crossings": crossings}
    if isinstance(source, Ball | Spot):
        for name, value in given.items():
            left_out(name, value, f"beside `source={source}`, which has its own")
        return source
    name = ("point" if free else "spot") if source is None else source
    one_of("source", name, _KINDS)
    kind = _KINDS[name]
    fields = () if kind is None else kind.__dataclass_fields__
    users = {"size": "a ball or a spot", "crossings": "a spot"}
    for setting, value in given.items():
        if setting not in fields:
            left_out(setting, value, f"for a {name}, as only {users[setting]} has it")
    return None if kind is None else kind(**{setting: value for setting, value in given.items() if value is not None})


def _light_of_body(
    camera: Viewer,
    orbit: float | Orbit | Path,
    times: ArrayLike | int,
    max_index: int,
    searches: int | None,
    size: float,
) -> LightCurve:
    """The light curve of a point, size 0, or of a ball, after the checks of the arguments."""
    check_viewer(camera)
    way, highest = orbit_of("orbit", orbit), checked_index(max_index)
    count = None if searches is None else whole_number("searches", searches, 2, 2000)
    if isinstance(times, int | np.integer) and way.period is None:
        raise ValueError("Argument `times` must be an array of times, as this orbit has no period.")
    clock = clock_of(times, math.nan if way.period is None else way.period(camera.spin))
    return _light_of_orbit(camera, way, clock, highest, count, size)


def _light_of_orbit(
    camera: Viewer, orbit: Orbit, times: Float[Array, " t"], highest: int, searches: int | None, size: float
) -> LightCurve:
    """The light curve of a point, or of a ball; searches: moments at which all images are searched for."""
    source, span = emission_span(camera, orbit, times, highest, size)
    moments = images_at_moments(source, search_moments(source.motion, span, searches), highest)
    curves = image_curves(source, moments, highest)
    branch_times = [_within_life(branch.points.arrival, times) for branch in curves.branches]
    point_images = seen_images(source, list(curves.branches), [times[which] for which in branch_times])
    ball = ball_shares(MovingBall(source, size, highest), curves, times, branch_times, point_images) if size else None
    return body_light_curve(source, orbit, times, curves, branch_times, point_images, ball, size)


def _within_life(arrival: Float[Array, " points"], times: Float[Array, " t"]) -> Array:
    """The times within the life of an image."""
    return np.flatnonzero((times > arrival[0]) & (times < arrival[-1]))
