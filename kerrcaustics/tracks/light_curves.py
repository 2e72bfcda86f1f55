"""Light curves of a small spot on a circular orbit: all images of its orbit are known curves (isoradials.py).

While the spot circles, its images run along them. Light that is seen at the time t left the point with the azimuth phi
at t - T, when the spot was at Omega (t - T): so the flux is an integral along each curve,

    F(t) = integral of g^4 w(phi - Omega (t - T)) |dN| / |dr / dN| dr,

with w the spot's profile. It is smooth, also where images are created and destroyed, at extremes of phi + Omega T. With
N or T under the integral it gives the centroid and the mean travel time of that light.
"""

import math
from dataclasses import replace
from typing import NamedTuple, get_args

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.special import ndtr

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.choices import SpotMotion, event_kind
from kerrcaustics.lens_map.crossing_lines import CrossingLines
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.spacetime.checks import numbers, one_of, quoted, real_number, whole_number
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.isoradials import Isoradial, check_circles, curves_on

Array = np.ndarray

# Pieces of a curve between its points, for integrals, and deviations of the spot that are heeded.
_PIECES, _DEVIATIONS = 16, 7
# Points of an image are so close in phase (radians), unless that takes more lines or rounds than these.
_LONGEST, _MOST_LINES, _ROUNDS = 0.03, 20_000, 6
_MOST_TIMES = 1_000_000


@result("spot-event/1")
class SpotEvent:
    """The creation, or annihilation, of two images of a spot."""

    kind: str = quantity("", "", '"creation" or "annihilation"')
    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    time: float = quantity("", "GM/c^3", "of the camera, within the first orbit")
    azimuth: float = quantity("", "rad", "of the spot when the light left it", json="azimuth_deg")
    sky: Array = quantity("axis", "1", "N where it is seen")
    error: float = quantity("", "GM/c^3", "estimated error of time")
    sky_error: float = quantity("", "rad", "estimated error of sky", json="sky_error_rad")


@result(
    "light-curve/1",
    record="radius size power period events",
    points="time flux error shares centroid centroid_error travel_time",
)
class LightCurve:
    """The light of a spot that circles the hole, as a camera receives it."""

    camera: Viewer = quantity("", "", "the camera", json="", column="")
    radius: float = quantity("", "GM/c^2", "of the orbit", json="orbit")
    size: float = quantity("", "GM/c^2", "deviation of the spot along its orbit")
    period: float = quantity("", "GM/c^3", "of the orbit")
    time: Array = quantity("time", "GM/c^3", "of the camera; at 0 the spot's own azimuth is 0")
    flux: Array = quantity("time", "1", "solid angle times g^power, for a spot of unit intensity and area")
    error: Array = quantity("time", "1", "estimated error of the flux, of all its crossings")
    shares: Array = quantity("crossing time", "1", "what each crossing adds to the flux")
    power: float = quantity("", "1", "of the frequency ratio g, by which intensity goes")
    centroid: Array = quantity("time axis", "1", "mean direction N of the light, a unit vector")
    centroid_error: Array = quantity("time", "rad", "estimated error of the centroid")
    travel_time: Array = quantity("crossing time", "GM/c^3", "mean, of the light of each crossing; NaN without light")
    events: tuple[SpotEvent, ...] = quantity("event", "", "creations and annihilations of images, in order of time")


class _SplinedCurve(NamedTuple):
    """An isoradial as smooth functions of the parameter of the shadow edge: N, phi, phi + Omega T, and light along it.

    winds: what both angles gain with the parameter, in whole turns; it is left out of them.
    """

    crossing: int
    sky: CubicSpline
    azimuth: CubicSpline
    phase: CubicSpline
    light: CubicSpline
    winds: int


@usual_warnings
def light_curve(
    camera: Viewer,
    orbit: float,
    times: ArrayLike | int = 200,
    *,
    size: float = 0.1,
    crossings: int = 4,
    motion: str = "circular",
    power: float = 4.0,
    points: int = 720,
) -> LightCurve:
    """The light of a small spot on a circular orbit in the equatorial plane, image by image.

    Parameters
    ----------
    camera : Camera
        At rest in Boyer-Lindquist coordinates, or anything else that stays at its place while the spot circles.
    orbit : float
        Its radius, in units of the mass: one where there is a circular orbit.
    times : (t,) array or int
        Times of the camera (units of the mass); a number: so many over one orbit.
    size : float
        Deviation of the spot's Gaussian profile along its orbit, in units of the mass. Across the orbit it is small.
    crossings : int
        How many crossings of the plane add to the light.
    motion : str
        "circular" (prograde) or "retrograde".
    power : float
        Intensity goes by the frequency ratio g to this power: 4 for all light together, 3 + alpha in one band for a
        spectrum that falls as the frequency to the power of -alpha.
    points : int
        Points at which each image of the orbit is found at first; more follow where the azimuth changes fast along it.

    Returns
    -------
    LightCurve
        The flux of a spot of intensity I and area A, as r dr dphi in the frame that circles with it, is I A times its
        `flux`. Times are even for the camera, and coordinate times.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `LightCurve.error`, `centroid_error`, and those of events: by what half of the points give instead, and the points'
    own errors.

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
    """
    one_of("motion", motion, get_args(SpotMotion))
    if not math.isfinite(real_number("power", power)):
        raise ValueError(f"Argument `power` must be a finite number, but is {quoted(power)}.")
    if not 0 < real_number("size", size) < math.inf:
        raise ValueError(f"Argument `size` must be a positive, finite length, but is {quoted(size)}.")
    crossings, points = whole_number("crossings", crossings, 1, 12), whole_number("points", points, 16, 100_000)
    radius = float(check_circles(camera, "orbit", real_number("orbit", orbit))[0])
    found = EMITTERS[motion](camera.spin, radius, 0.0)
    if not found.slowness > 0:
        raise ValueError(f"Argument `orbit` must be the radius of a circular orbit, but is {radius:g}.")
    orbital = float(found.orbital)
    period = 2 * math.pi / abs(orbital)
    clock = _clock(times, period)
    fine, coarse = np.zeros((2, crossings, len(clock), 5))
    events: list[SpotEvent] = []
    for crossing in range(1, crossings + 1):
        curve = _image(camera, radius, EquatorialPlane(crossing, motion), orbital, points)
        ring, sparse = (_ring(curve, orbital, power, step) for step in (1, 2))
        for of, total in ((ring, fine), (sparse, coarse)):
            total[crossing - 1] = _received(of, orbital, clock, size / radius) / radius
        events += _events(ring, sparse, orbital, period)
    shares = fine[..., 0]
    flux = shares.sum(axis=0)
    # Of half of the points the splines are off by the fourth power of two as much.
    error = np.abs(shares - coarse[..., 0]).sum(axis=0) / 8 + 1e-12 * flux
    centroid, other = (_mean_direction(part) for part in (fine, coarse))
    off = np.linalg.norm(centroid - other, axis=-1) / 8 + 1e-12
    with np.errstate(invalid="ignore"):
        late = fine[..., 4] / shares
    ordered = tuple(sorted(events, key=lambda event: event.time))
    of_light = float(power), centroid, off, late
    return LightCurve(camera, float(radius), float(size), period, clock, flux, error, shares, *of_light, ordered)


def _clock(times: ArrayLike, period: float) -> Float[Array, " t"]:
    """The times of an argument, or so many of them over one orbit."""
    if isinstance(times, int | np.integer):
        count = whole_number("times", times, 1, _MOST_TIMES)
        return np.arange(count) * (period / count)
    clock = numbers("times", times).ravel()
    if not (len(clock) and np.isfinite(clock).all()):
        raise ValueError(f"Argument `times` must be a whole number, or finite times, but is {quoted(times)}.")
    return clock


# For an orbit through the camera itself, which is refused in the end.
@np.errstate(over="ignore", invalid="ignore")
def _image(camera: Viewer, radius: float, end: EquatorialPlane, orbital: float, points: int) -> Isoradial:
    """The image of an orbit, on as many lines as it takes that its phase changes little from one to the next."""
    found = _on_lines(camera, radius, end, 2 * math.pi * np.arange(points) / points)
    for _ in range(_ROUNDS):
        parts = _parts(found, orbital)
        if parts.max() == 1 or parts.sum() > _MOST_LINES:
            break
        width = np.diff(found.edge_phase, append=found.edge_phase[0] + 2 * math.pi)
        between = [t + w * np.arange(1, n) / n for t, w, n in zip(found.edge_phase, width, parts, strict=True)]
        found = _joined(found, _on_lines(camera, radius, end, np.concatenate(between)))
    return found


def _joined(one: Isoradial, other: Isoradial) -> Isoradial:
    """The points of both, in order."""
    order = np.argsort(np.concatenate([one.edge_phase, other.edge_phase]))
    names = "sky", "azimuth", "error", "redshift", "width", "edge_phase", "time"
    both = {name: np.concatenate([getattr(one, name), getattr(other, name)])[order] for name in names}
    return replace(one, **both | {"azimuth": np.unwrap(both["azimuth"])})


def _on_lines(camera: Viewer, radius: float, end: EquatorialPlane, edge_phase: Array) -> Isoradial:
    found = curves_on(CrossingLines(camera, edge_phase, end), radius, time=True)
    if len(found) != 1 or not found[0].closed:
        raise ValueError(
            "Argument `orbit` must be the radius of one whose images are closed curves, but at crossing "
            f"{end.crossing} they are not."
        )
    return found[0]


def _parts(curve: Isoradial, orbital: float) -> Int[Array, " points"]:
    """Into how many parts the ways from each point to the next must be divided."""
    assert curve.time is not None
    phase = curve.azimuth + orbital * curve.time
    change = np.diff(phase, append=phase[0])
    change -= 2 * math.pi * np.round(change / (2 * math.pi))
    return np.clip(np.ceil(np.abs(change) / _LONGEST), 1, 8).astype(int)


def _ring(curve: Isoradial, orbital: float, power: float, step: int) -> _SplinedCurve:
    """An isoradial by every so many of its points."""
    assert curve.time is not None
    part = slice(None, None, step)
    edge_phase = curve.edge_phase[part]

    def spline(values: Array) -> CubicSpline:
        return CubicSpline(np.append(edge_phase, edge_phase[0] + 2 * math.pi), [*values, values[0]], bc_type="periodic")

    gained = curve.azimuth[-1] - curve.azimuth[0]
    winds = round((gained + np.angle(np.exp(1j * (curve.azimuth[0] - curve.azimuth[-1])))) / (2 * math.pi))
    azimuth = curve.azimuth[part] - winds * edge_phase
    sky = spline(curve.sky[part])
    along = np.linalg.norm(sky(edge_phase, 1), axis=-1)
    light = spline(curve.redshift[part] ** power * curve.width[part] * along)
    return _SplinedCurve(
        curve.crossing, sky, spline(azimuth), spline(azimuth + orbital * curve.time[part]), light, winds
    )


def _received(ring: _SplinedCurve, orbital: float, time: Array, deviation: float) -> Float[Array, "times 5"]:
    """Light at some times of a spot with a Gaussian profile of unit area in azimuth; the same times N, times T.

    The curve is a chain of short pieces on which the phase is linear and the light is the same: each is integrated
    exactly, however long it is beside the spot.
    """
    knots = ring.phase.x
    edge_phase = np.append(
        (knots[:-1, None] + np.diff(knots)[:, None] * np.arange(_PIECES) / _PIECES).ravel(), knots[-1]
    )
    phase = ring.phase(edge_phase) + ring.winds * edge_phase
    inside = (edge_phase[1:] + edge_phase[:-1]) / 2
    late = (ring.phase(inside) - ring.azimuth(inside)) / orbital
    light = (ring.light(inside) * np.diff(edge_phase))[:, None] * np.column_stack(
        [np.ones_like(late), ring.sky(inside), late]
    )
    middle, half = (phase[1:] + phase[:-1]) / 2, np.maximum(np.abs(np.diff(phase)) / 2, 1e-6 * deviation)
    order = np.argsort(np.mod(middle, 2 * math.pi))
    place = (np.mod(middle, 2 * math.pi)[order] + 2 * math.pi * np.arange(-1, 2)[:, None]).ravel()
    reach = min(half.max() + _DEVIATIONS * deviation, math.pi)
    total = np.zeros((len(time), 5))
    for i, now in enumerate(np.mod(orbital * time, 2 * math.pi)):
        first, last = np.searchsorted(place, (now - reach, now + reach))
        near = order[np.arange(first, last) % len(order)]
        low, high = ((place[first:last] - now + side * half[near]) / deviation for side in (-1, 1))
        total[i] = ((ndtr(high) - ndtr(low)) / (2 * half[near])) @ light[near]
    return total


def _mean_direction(light: Float[Array, "crossings times 5"]) -> Float[Array, "times 3"]:
    total = light[..., 1:4].sum(axis=0)
    with np.errstate(invalid="ignore"):
        return np.asarray(total / np.linalg.norm(total, axis=-1, keepdims=True))


class _Extreme(NamedTuple):
    """An extreme of phi + Omega T along a curve: there two images of the spot are one."""

    edge_phase: float
    creation: bool
    time: float
    azimuth: float
    sky: Array


def _extremes(ring: _SplinedCurve, orbital: float) -> list[_Extreme]:
    slope = ring.phase.derivative()
    found = []
    for edge_phase in np.unique(np.mod(slope.solve(-ring.winds, extrapolate=False), 2 * math.pi)):
        phase, azimuth = (float(angle(edge_phase)) + ring.winds * edge_phase for angle in (ring.phase, ring.azimuth))
        sky = ring.sky(edge_phase)
        # A least value comes first: after it there are two points.
        creation = bool(slope(edge_phase, 1) * orbital > 0)
        found.append(_Extreme(edge_phase, creation, phase / orbital, azimuth, sky / np.linalg.norm(sky)))
    return found


def _events(ring: _SplinedCurve, sparse: _SplinedCurve, orbital: float, period: float) -> list[SpotEvent]:
    """The extremes of a ring; their errors are the distance to those of the sparse one, several times the true ones."""
    others = _extremes(sparse, orbital)
    events = []
    for one in _extremes(ring, orbital):
        same = [other for other in others if other.creation == one.creation]
        other = min(same, key=lambda other: abs(math.sin((other.edge_phase - one.edge_phase) / 2)), default=None)
        late = math.inf if other is None else abs((other.time - one.time + period / 2) % period - period / 2)
        off = math.inf if other is None else float(np.linalg.norm(other.sky - one.sky))
        kind = event_kind(1 if one.creation else -1)
        errors = late + 1e-12 * (period + abs(one.time)), off + 1e-12
        events.append(SpotEvent(kind, ring.crossing, one.time % period, one.azimuth, one.sky, *errors))
    return events
