"""The span of emission times of the light that arrives within a span of times, and the moments of searches in it."""

import math
from dataclasses import replace

import numpy as np

from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.light_curves.arrivals import Source
from kerrcaustics.light_curves.image_curves import images_at_moments
from kerrcaustics.orbits.motions import BodyMotion
from kerrcaustics.orbits.orbit import Orbit, checked_places, ending
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import from_angles, lengths
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Angle of the source's path between two complete searches, radians.
_BETWEEN = 0.25
# Fewest and most complete searches.
_FEWEST = 6
_MOST = 400
# Light of each further index is late by about half of a turn on the photon orbit (GM/c^3).
_HALF_TURN = 17.0
# Accuracy of the span of emission times, as a part of the span of times.
_SLACK = 0.05
# Steps of its search.
_SHIFTS = 8
# An orbit comes from the horizon where its radius is below this many horizon radii.
_LEAVES = 1.05
# Such an orbit cannot be followed so far back (GM/c^3).
_LONG_AGO = 1000.0
# A ball is smaller than this part of its radius from the hole.
_LARGEST = 0.1
# Places at which the orbit is checked.
_CHECKED = 500
# The sine of an angle from an axis that is rounding.
_ON_AXIS = 1e-12


def emission_span(
    camera: Viewer, orbit: Orbit, times: Float[Array, " t"], max_index: int, size: float
) -> tuple[Source, tuple[float, float]]:
    """The source, and the first and last emission time of the light of all images at times."""
    start = orbit.motion_about(camera.spin, (orbit.when, orbit.when))
    start_place = checked_places(camera.spin, start, np.array([orbit.when]))
    travel_time, radius = (
        _straight_time(camera, start_place.vector[0], float(start_place.radius[0])),
        float(start_place.radius[0]),
    )
    ends = float(times.min()), float(times.max())
    slack = _SLACK * (ends[1] - ends[0]) + 1.0
    emitted = [ends[0] - travel_time - _HALF_TURN * max_index, ends[1] - travel_time]
    room = 2 * radius + 2 * _HALF_TURN * (max_index + 1)
    longer = radius + _HALF_TURN
    known = min(*emitted, orbit.when) - room, max(*emitted, orbit.when) + room
    source = Source(search_sky(camera), orbit.motion_about(camera.spin, known))
    _check_off_axis(camera, source.motion, known, size)
    for end, latest in ((1, False), (0, True)):
        for _ in range(_SHIFTS):
            if not known[0] <= emitted[end] <= known[1]:
                known = min(emitted[end] - room, known[0]), max(emitted[end] + room, known[1])
                source = replace(source, motion=orbit.motion_about(camera.spin, known))
            emitted[end] = _clipped_to_span(source.motion, emitted[end], ends[end], known)
            arrival = _arrivals(source, emitted[end], max_index)
            if not len(arrival):
                break
            ahead = ends[end] - (arrival.max() if latest else arrival.min())
            # All light of the first moment must arrive before the times, and all of the last moment after them.
            # Images that have vanished may take longer paths than those found.
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
    """True for an emission time before which no light is needed, as the orbit does not reach further back.

    All earlier light of an orbit that comes from the horizon arrives at about one time. ahead: time by which all light
    of the emission time arrives before `time`; ValueError if it arrives later.
    """
    radius = float(source.motion.places(np.array([emitted])).radius[0])
    early = emitted - _LONG_AGO
    near = radius < _LEAVES * kerr.horizon(source.spin)
    from_horizon = near and orbit.motion_about(source.spin, (early, emitted)).span[0] > early
    if from_horizon and ahead < 0:
        raise ValueError(
            f"Argument `orbit` must stay outside the hole within `times`, but the light that arrives at t = {time:.6g} "
            f"left it before r = {radius:.4g}, as it came from the horizon: give later times."
        )
    return bool(ahead >= 0 and (from_horizon or emitted == source.motion.span[0]))


def _check_off_axis(camera: Viewer, motion: BodyMotion, known: tuple[float, float], size: float) -> None:
    """Raise ValueError for a source that stays where all images but the direct one are rings."""
    ends = max(known[0], motion.span[0]), min(known[1], motion.span[1])
    places = motion.places(np.linspace(*ends, _CHECKED))
    axis = from_angles(camera.inclination, 0.0)
    symmetric = camera.spin == 0 or math.hypot(axis[0], axis[1]) < _ON_AXIS
    if symmetric and (lengths(np.cross(places.vector, axis)) < _ON_AXIS).all():
        seen = (
            "a ball there is seen as rings, of finite light: `magnification` has that of a disc of its size"
            if size
            else "a point there is seen as rings, and is infinitely bright"
        )
        raise ValueError(f"Argument `orbit` must leave the axis through hole and viewer, but stays on it: {seen}.")


def _clipped_to_span(motion: BodyMotion, emitted: float, time: float, known: tuple[float, float]) -> float:
    """The emission time, moved into the span of a motion; ValueError if the motion ends before the light leaves."""
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
    images = images_at_moments(source, np.array([emitted]), max_index)[0].images
    if not len(images):
        return np.empty(0)
    return source.arrivals(images.sky, np.full(len(images), emitted), images.second_arrival).arrival


def search_moments(motion: BodyMotion, span: tuple[float, float], searches: int | None) -> Float[Array, " n"]:
    """Emission times of complete searches, evenly spaced along the path."""
    time = np.linspace(*span, _CHECKED)
    places = motion.places(time)
    way = lengths(np.diff(places.vector, axis=0)) + np.abs(np.diff(np.log(places.radius)))
    way = np.concatenate([[0.0], np.cumsum(way + 1e-6)])
    count = searches or min(max(math.ceil(way[-1] / _BETWEEN), _FEWEST), _MOST)
    return np.interp(np.linspace(0, way[-1], count + 1), way, time)
