"""The light curve of a source on any orbit: its images, their light and their events, as a viewer receives them."""

import math
from dataclasses import replace
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.light_curves.arrivals import Source
from kerrcaustics.light_curves.ball_light import ball_shares
from kerrcaustics.light_curves.balls import MovingBall
from kerrcaustics.light_curves.image_curves import image_curves, searched
from kerrcaustics.light_curves.seen_images import seen_images
from kerrcaustics.light_curves.source_light import SourceLightCurve, source_light_curve
from kerrcaustics.light_curves.sources import Ball, Spot
from kerrcaustics.light_curves.spot_curve import LightCurve, clock_of, spot_light_curve
from kerrcaustics.orbits.motions import BodyMotion, Path
from kerrcaustics.orbits.orbit import Orbit, checked_places, ending, orbit_of
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import left_out, one_of, whole_number
from kerrcaustics.spacetime.sphere import from_angles, lengths
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

# A complete search for every so many radians that the source goes, and so many at least and at most.
_BETWEEN, _FEWEST, _MOST = 0.25, 6, 400
# Light of each further index is late by about half of a turn on the photon orbit.
_HALF_TURN = 17.0
# The span of emission times is found to this part of the span of times, in so many steps.
_SLACK, _SHIFTS = 0.05, 8
# An orbit comes from the horizon where it is within this factor of its radius, and cannot be followed so far back.
_LEAVES, _LONG_AGO = 1.05, 1000.0
# Highest Morse index, if nothing is said.
_HIGHEST = 2
# A ball is smaller than this part of its radius from the hole.
_LARGEST = 0.1
# Places at which the orbit is checked, and the sine of an angle from an axis that is rounding.
_CHECKED, _ON_AXIS = 500, 1e-12
# Kinds of sources by name: what each is if nothing else is said.
_KINDS: dict[str, type[Ball | Spot] | None] = {"point": None, "ball": Ball, "spot": Spot}


@overload
def light_curve(
    camera: Viewer,
    orbit: float,
    times: ArrayLike | int = 200,
    *,
    source: Literal["spot"] | Spot | None = None,
    size: float | None = None,
    crossings: int | None = None,
    progress: Progress | bool | None = None,
) -> LightCurve: ...


@overload
def light_curve(
    camera: Viewer,
    orbit: float | Orbit | Path,
    times: ArrayLike | int = 200,
    *,
    source: Literal["point", "ball"] | Ball | None = None,
    max_index: int | None = None,
    searches: int | None = None,
    size: float | None = None,
    progress: Progress | bool | None = None,
) -> SourceLightCurve: ...


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
) -> SourceLightCurve | LightCurve:
    """The light of a source on an orbit, image by image: a point or a ball on any orbit, or a small spot in a disk.

    Parameters
    ----------
    camera : Camera or Observer
        At rest in Boyer-Lindquist coordinates, or otherwise fixed at its place for that time; for a spot, off the
        equatorial plane.
    orbit : float, Orbit or function
        A radius: a circle in the equatorial plane. An `Orbit`, or a function of the coordinate time that returns (r,
        theta, phi), for a point only.
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
    SourceLightCurve or LightCurve
        For a point or a ball: its flux for the luminosity 1, equal in all directions in its own frame, with emission
        times, frequency ratios and places of all images, and all pair events of its centre. A pair that shows only the
        edge of a ball, at a caustic that its centre does not cross, is not searched for. For a spot of intensity I and
        area A, as r dr dphi in the frame that circles with it, the flux is I A times its `flux`: in M^2, as areas of
        (alpha, beta), for an Observer. Times are evenly spaced for the camera, and are coordinate times; an Observer's
        are relative to a plane wave.

    Raises
    ------
    ValueError
        If an argument is invalid, or is for another kind of source; if the source stays on the axis through hole and
        viewer, or reaches the horizon or moves faster than light before the light of the last time leaves it.

    Errors
    ------
    Point: `SourceLightCurve.error`, from the errors of the beams and of the orbit, and near an event from that of its
    time. On unstable orbits rounding grows exponentially; beyond 1e-6 of the radius nothing is certified. Ball: from
    the difference from coarser sums, and (size / r)^2, by which spacetime bends within it. Spot: `LightCurve.error`,
    `centroid_error` and `travel_time_error`, from the difference from half of the points, at that time and on average
    over all times. Events lie where beams are flat, and are as accurate as rays.

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
) -> SourceLightCurve:
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
) -> SourceLightCurve:
    """The light curve of a point, or of a ball; searches: moments at which all images are searched for."""
    source, span = _span(camera, orbit, times, highest, size)
    moments = searched(source, _moments(source.motion, span, searches), highest)
    curves = image_curves(source, moments, highest)
    wanted = [_lived(branch.points.arrival, times) for branch in curves.branches]
    point_images = seen_images(source, list(curves.branches), [times[which] for which in wanted])
    ball = ball_shares(MovingBall(source, size, highest), curves, times, wanted, point_images) if size else None
    return source_light_curve(source, orbit, times, curves, wanted, point_images, ball, size)


def _lived(arrival: Float[Array, " points"], times: Float[Array, " t"]) -> Array:
    """The times within the life of an image."""
    return np.flatnonzero((times > arrival[0]) & (times < arrival[-1]))


def _span(
    camera: Viewer, orbit: Orbit, times: Float[Array, " t"], max_index: int, size: float
) -> tuple[Source, tuple[float, float]]:
    """The source, and the first and last emission time of the light of all images at times."""
    start = orbit.about(camera.spin, (orbit.when, orbit.when))
    there = checked_places(camera.spin, start, np.array([orbit.when]))
    late, radius = _straight_time(camera, there.vector[0], float(there.radius[0])), float(there.radius[0])
    ends = float(times.min()), float(times.max())
    slack = _SLACK * (ends[1] - ends[0]) + 1.0
    emitted = [ends[0] - late - _HALF_TURN * max_index, ends[1] - late]
    room = 2 * radius + 2 * _HALF_TURN * (max_index + 1)
    longer = radius + _HALF_TURN
    known = min(*emitted, orbit.when) - room, max(*emitted, orbit.when) + room
    source = Source(search_sky(camera), orbit.about(camera.spin, known))
    _check_off_axis(camera, source.motion, known, size)
    for end, latest in ((1, False), (0, True)):
        for _ in range(_SHIFTS):
            if not known[0] <= emitted[end] <= known[1]:
                known = min(emitted[end] - room, known[0]), max(emitted[end] + room, known[1])
                source = replace(source, motion=orbit.about(camera.spin, known))
            emitted[end] = _within(source.motion, emitted[end], ends[end], known)
            arrival = _arrivals(source, emitted[end], max_index)
            if not len(arrival):
                break
            ahead = ends[end] - (arrival.max() if latest else arrival.min())
            # All light of the first moment comes before the times, that of images that are gone by then too, which may
            # take longer ways; and all of the last one after them.
            low, high = (longer, longer + slack) if latest else (-slack, 0.0)
            begins = latest and _begins(source, orbit, emitted[end], ends[end], ahead)
            if begins or low <= ahead <= high:
                break
            emitted[end] += ahead - (low + high) / 2
    span = emitted[0], emitted[1]
    places = checked_places(camera.spin, source.motion, np.linspace(*span, _CHECKED))
    most = _LARGEST * places.radius.min()
    if not size < most:
        raise ValueError(
            f"Argument `size` must be below a tenth of the orbit's least radius, {most:.4g}, but is {size:g}."
        )
    return source, span


def _begins(source: Source, orbit: Orbit, emitted: float, time: float, ahead: float) -> bool:
    """True for an emission time before which no other light is needed: an orbit may not reach further back.

    Of an orbit that comes from the horizon all light of long before arrives at about one time. ahead: by how much all
    light of the emission time arrives before `time`; ValueError if it does not.
    """
    radius = float(source.motion.at(np.array([emitted])).radius[0])
    early = emitted - _LONG_AGO
    near = radius < _LEAVES * kerr.horizon(source.spin)
    from_horizon = near and orbit.about(source.spin, (early, emitted)).span[0] > early
    if from_horizon and ahead < 0:
        raise ValueError(
            f"Argument `orbit` must stay outside the hole within `times`, but the light that arrives at t = {time:.6g} "
            f"left it before r = {radius:.4g}, as it came from the horizon: give later times."
        )
    return ahead >= 0 and (from_horizon or emitted == source.motion.span[0])


def _check_off_axis(camera: Viewer, motion: BodyMotion, known: tuple[float, float], size: float) -> None:
    """Raise ValueError for a source that stays where all images but the direct one are rings."""
    ends = max(known[0], motion.span[0]), min(known[1], motion.span[1])
    places = motion.at(np.linspace(*ends, _CHECKED))
    axis = from_angles(camera.inclination, 0.0)
    symmetric = camera.spin == 0 or math.hypot(axis[0], axis[1]) < _ON_AXIS
    if symmetric and (lengths(np.cross(places.vector, axis)) < _ON_AXIS).all():
        seen = (
            "a ball there is seen as rings, of finite light: `magnification` has that of a disc of its size"
            if size
            else "a point there is seen as rings, and is infinitely bright"
        )
        raise ValueError(f"Argument `orbit` must leave the axis through hole and viewer, but stays on it: {seen}.")


def _within(motion: BodyMotion, emitted: float, time: float, known: tuple[float, float]) -> float:
    """An emission time within the span of a motion; ValueError if the light of a time would have left after it."""
    first, last = motion.span
    if emitted > last and last < known[1]:
        raise ValueError(
            f"Argument `orbit` must stay outside the hole within `times`, but {ending(motion, last)}, before the light "
            f"that arrives at t = {time:.6g} leaves."
        )
    return min(max(emitted, first), last)


def _straight_time(camera: Viewer, vector: Float[Array, " 3"], radius: float) -> float:
    """About the travel time of the direct light from a place."""
    toward = from_angles(camera.inclination, 0.0)
    if camera.sky_unit != "rad":
        return -radius * float(vector @ toward)
    return float(np.linalg.norm(radius * vector - camera.radius * toward))


def _arrivals(source: Source, emitted: float, max_index: int) -> Float[Array, " images"]:
    """Arrival times of all images whose light leaves at one time."""
    images = searched(source, np.array([emitted]), max_index)[0].images
    if not len(images):
        return np.empty(0)
    return source.arrivals(images.sky, np.full(len(images), emitted), images.second_arrival).arrival


def _moments(motion: BodyMotion, span: tuple[float, float], searches: int | None) -> Float[Array, " n"]:
    """Emission times of complete searches: evenly along the way."""
    time = np.linspace(*span, _CHECKED)
    places = motion.at(time)
    way = lengths(np.diff(places.vector, axis=0)) + np.abs(np.diff(np.log(places.radius)))
    way = np.concatenate([[0.0], np.cumsum(way + 1e-6)])
    count = searches or min(max(math.ceil(way[-1] / _BETWEEN), _FEWEST), _MOST)
    return np.interp(np.linspace(0, way[-1], count + 1), way, time)
