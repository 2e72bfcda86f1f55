"""Rays in space, for pictures: places along each ray, and its conjugate points.

The path and its variations are those of integrated.py, advanced by its pair from one Mino time to the next. Conjugate
points are zeros of the beam's signed area; each is bracketed between two neighbouring times and refined there.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.compile_cache import Program
from kerrcaustics.beams.directions import as_vectors, normalised
from kerrcaustics.beams.ends import Spherical, end_of
from kerrcaustics.beams.geometry import area, azimuth_step, first_azimuth, length, turned
from kerrcaustics.beams.integrator.equations import Constants, polar_rapidity, rapidity, rates_with_variation, ray_rates
from kerrcaustics.beams.integrator.integrated import DENSEST, start, with_variations
from kerrcaustics.beams.integrator.journey import local_error
from kerrcaustics.beams.integrator.nystroem import Path, nystroem_step
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.camera import Camera, check_camera
from kerrcaustics.spacetime.checks import quoted, real_number, whole_number
from kerrcaustics.spacetime.frame import Frame, Photon
from kerrcaustics.spacetime.polar import mino_time_to_plane
from kerrcaustics.spacetime.settings import own_settings
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

# Rays advanced together; one compiled size serves all.
_CHUNK = 512
# Radians of arc between two looks at the beam's area: its zeros lie about pi apart.
_LONGEST_ARC = 0.8
# Arc beyond which a ray winds for ever, and more steps than are needed between two looks.
_MOST_ARC, _MOST_STEPS = 60.0, 300
# A captured ray ends a little above the horizon, where the azimuth is infinite; closer where the camera is close.
_ABOVE_HORIZON = 0.01
# Steps of the search for a zero of the area, by false position.
_MOST_TRIALS = 30
_MOST_POINTS = 100_000
# Error above which a path is called inaccurate, in radians.
_WANTED = 1e-9
# Part of the summed local errors that is left in the better of the two orders, and round-off of N in a beam.
_STEP_GAIN, _ROUND_OFF = 0.02, 3e-15
_COORDINATES: tuple[str, ...] = ("mino_time", "radius", "theta", "azimuth")


@result("space-points/1", kw_only=True)
class SpacePoints:
    """Events around the hole, in Boyer-Lindquist coordinates. Arrays of one shape (..., n)."""

    spin: float = quantity("", "1", "spin of the hole")
    mino_time: np.ndarray = quantity("ray... place", "M^-1", "Mino time since the camera")
    radius: np.ndarray = quantity("ray... place", "GM/c^2", "radius, infinite on the celestial sphere")
    theta: np.ndarray = quantity("ray... place", "rad", "polar angle")
    azimuth: np.ndarray = quantity(
        "ray... place", "rad", "phi, unwrapped: continuous along a ray, 0 at the camera", json="phi_deg"
    )

    def __repr__(self) -> str:
        """One line: what, and how many."""
        return f"<{type(self).__name__} of shape {self.radius.shape}>"

    @property
    def direction(self) -> np.ndarray:
        """Unit vectors (..., n, 3) with polar angle theta and azimuth phi."""
        return from_angles(self.theta, self.azimuth)

    @property
    def position(self) -> np.ndarray:
        """Cartesian Boyer-Lindquist coordinates (..., n, 3) in units of M.

        x, y = sqrt(r^2 + a^2) sin theta (cos phi, sin phi), z = r cos theta: in them a surface of constant r is an
        oblate spheroid, and space without mass is flat. Not finite on the celestial sphere.
        """
        across = np.hypot(self.radius, self.spin)
        scale = np.stack([across, across, self.radius], axis=-1)
        with np.errstate(invalid="ignore"):
            return scale * self.direction


@result("ray-paths/1", kw_only=True)
class RayPaths(SpacePoints):
    """Rays followed backward from a camera: `n` events of each, the first one the camera.

    NaN, and an index of -1, for photons that cannot come from infinity (inside the ergosphere), and within round-off of
    the shadow edge, where they wind for ever.
    """

    error: np.ndarray = quantity(
        "ray... place", "rad", "estimated error of the direction, and of 1 / radius", json="error_rad"
    )
    status: np.ndarray = quantity("ray...", "1", "`Status` values, INACCURATE where the error at the end is above 1e-9")
    conjugate: SpacePoints = quantity(
        "ray... conjugate", "", "conjugate points in the order of the ray, NaN where there are no more"
    )
    index: np.ndarray = quantity("ray...", "1", "how many conjugate points there are")


class _State(NamedTuple):
    """A batch of rays at one time: the ray and its two variations, the azimuth of m, errors of the steps."""

    paths: tuple[Path, ...]
    azimuth: Reals
    local_error: Reals


class _Beam(NamedTuple):
    """Constants along a batch of rays.

    end_time, of Mino, NaN for rays that are not followed; end_u, 1 / r there; lost, that end is not the one wanted;
    captured; opening, the rate in Mino time at which the beam opens at the camera.
    """

    constants: Constants
    variations: list[Constants]
    end_time: Reals
    end_u: Reals
    lost: Flags
    captured: Flags
    opening: Reals


@own_settings()
@usual_warnings
def ray_paths(camera: Viewer, sky: ArrayLike, n: int = 200, *, end: float = math.inf) -> RayPaths:
    """The rays that the camera sees, in space: places along each, and its conjugate points.

    Parameters
    ----------
    camera : Camera
    sky : (..., 3) array
        Unit vectors N on the camera sky. They are normalised here.
    n : int
        How many places on each ray, from the camera (the first) to its end (the last), evenly spaced in Mino time.
    end : float
        math.inf, the celestial sphere, or a radius: where it first arrives there, a ray ends.

    Returns
    -------
    RayPaths
        Of shape (..., n). A ray that does not come to its end is followed to where it does come: to the celestial
        sphere, with status MISSED, or to just above the horizon, with status CAPTURED.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `RayPaths.error`. The k-th conjugate point is in error by about as much, divided by the rate at which the beam's
    area passes through zero there.

    Notes
    -----
    Close to a critical curve the last conjugate point is close to infinity, and round-off decides whether it is there.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> paths = kc.ray_paths(camera, [[-0.6, 0.5, 0.4]], n=50)
    >>> paths.position.shape
    (1, 50, 3)
    """
    check_camera(camera)
    surface = end_of(camera, end)
    if not isinstance(surface, Spherical):
        raise ValueError(f"Argument `end` must be a radius or math.inf, but is {quoted(end)}.")
    n = whole_number("n", n, 2, _MOST_POINTS)
    directions, shape = as_vectors(sky)
    directions = normalised(directions)
    starts = range(0, max(len(directions), 1), _CHUNK)
    parts = [_followed(camera, directions[i : i + _CHUNK], n, surface) for i in starts]
    most = max(part["conjugate"].shape[1] for part in parts)
    for part in parts:
        missing = most - part["conjugate"].shape[1]
        part["conjugate"] = np.pad(part["conjugate"], ((0, 0), (0, missing), (0, 0)), constant_values=np.nan)
    fields = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    fields = {name: values.reshape((*shape, *values.shape[1:])) for name, values in fields.items()}
    found = dict(zip(_COORDINATES, np.moveaxis(fields.pop("conjugate"), -1, 0), strict=True))
    return RayPaths(spin=camera.spin, conjugate=SpacePoints(spin=camera.spin, **found), **fields)


@own_settings()
@usual_warnings
def trapped_orbit(spin: float, impact: float, n: int = 1000, *, oscillations: float = 6.0) -> SpacePoints:
    """A photon on a spherical orbit, followed forward in time from the equatorial plane, which it leaves northward.

    Parameters
    ----------
    spin : float
        Of the hole, 0 < spin < 1.
    impact : float
        Axial angular momentum b per unit energy, between those of the two equatorial photon orbits.
    n : int
        How many places, evenly spaced in Mino time.
    oscillations : float
        How many periods of the polar motion.

    Returns
    -------
    SpacePoints
        Of shape (n,), all of one radius.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    About 1e-13 rad: the radius is kept, so that nothing grows.

    References
    ----------
    JTFT A.1 for the orbits and figure 11 for the picture.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.trapped_orbit(spin=0.9, impact=0.0, n=50).radius.shape
    (50,)
    """
    spin, impact, periods = _checked_orbit(spin, impact, oscillations)
    n = whole_number("n", n, 2, _MOST_POINTS)
    radius, q = (float(part) for part in kerr.spherical_orbit_of_impact(spin, impact))
    one = np.ones(_CHUNK)
    # Without the radial potential the radius stays what it is.
    constants = Constants(0 * one, 0 * one, 0 * one, (q + impact**2) * one, impact * one)
    ray = Path((one / radius, one, 0 * one, 0 * one), (0 * one, 0 * one, -impact * one, math.sqrt(q) * one), 0 * one)
    still = jax.tree.map(lambda part: 0 * part, (constants, ray))
    beam = _Beam(constants, [still[0]] * 2, one, one, one, one, one)
    state = _State((ray, still[1], still[1]), 0 * one, 0 * one)
    photon = Photon(impact, q + impact**2, q + (impact - spin) ** 2, q, (0, 0, 0, 0.0), (0, 0, 0, 1.0), 1.0)
    period = 2 * float(mino_time_to_plane(Camera(spin, radius).frame(), photon, 1))
    times = np.linspace(0, periods * period, n)
    found = []
    for first in range(0, n, _CHUNK):
        some = times[first : first + _CHUNK]
        after = _advanced(spin, beam, state, np.pad(some, (0, _CHUNK - len(some))))
        found.append(
            np.stack(_coordinates(jax.tree.map(np.asarray, after), np.pad(some, (0, _CHUNK - len(some)))))[
                :, : len(some)
            ]
        )
    time, r, theta, azimuth = np.concatenate(found, axis=1)
    # Backward and forward in time differ by the sense of the azimuth alone.
    return SpacePoints(spin=spin, mino_time=time, radius=r, theta=theta, azimuth=-azimuth)


def _checked_orbit(spin: object, impact: object, oscillations: object) -> tuple[float, float, float]:
    """The arguments of `trapped_orbit` as numbers; a ValueError unless there is such an orbit."""
    a, b, periods = (
        real_number(name, value) for name, value in (("spin", spin), ("impact", impact), ("oscillations", oscillations))
    )
    if not 0 < a < 1:
        raise ValueError(f"Argument `spin` must lie in (0, 1), but is {quoted(spin)}.")
    inner, outer = kerr.photon_orbits(a)
    low, high = kerr.spherical_orbit_impact(a, outer), kerr.spherical_orbit_impact(a, inner)
    if not low < b < high:
        raise ValueError(f"Argument `impact` must lie between {low:.9g} and {high:.9g}, but is {quoted(impact)}.")
    if not 0 < periods < math.inf:
        raise ValueError(f"Argument `oscillations` must be a positive, finite number, but is {quoted(oscillations)}.")
    return a, b, periods


def _followed(camera: Viewer, sky: np.ndarray, n: int, end: Spherical) -> dict[str, np.ndarray]:
    """The fields of a result for up to so many rays as are advanced together."""
    count = len(sky)
    # Filled up with the first ray, or any, so that one compiled size serves all.
    sky = np.concatenate([sky, np.repeat(sky[:1] if count else np.eye(3)[:1], _CHUNK - count, axis=0)])
    frame = camera.frame()
    beam, state = jax.tree.map(np.asarray, _begun(frame, tuple(sky.T), end))
    end_time = np.asarray(beam.end_time)
    arc = np.nanmax(end_time * np.asarray(polar_rapidity(beam.constants)), initial=0.0)
    part = max(1, math.ceil(arc / ((n - 1) * _LONGEST_ARC)))
    step = np.nan_to_num(end_time) / ((n - 1) * part)
    states = [state]
    for _ in range((n - 1) * part):
        states.append(_advanced(frame.spin, beam, states[-1], step))
    track = jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *states)
    times = np.arange(len(states))[:, None] * step
    unknown = np.isnan(end_time)
    kept = jax.tree.map(lambda leaf: leaf[::part], track)
    fields: dict[str, np.ndarray] = dict(zip(_COORDINATES, _coordinates(kept, times[::part]), strict=True))
    fields["error"] = np.array(_errors(beam, kept))
    # The end is known beforehand: missing it shows what the time is worth, close to the shadow edge.
    fields["error"][-1] += np.abs(kept.paths[0].position[0][-1] - beam.end_u) * np.asarray(
        polar_rapidity(beam.constants)
    )
    conjugate, index = _conjugate_points(frame.spin, beam, track, times)
    captured, lost = np.asarray(beam.captured), np.asarray(beam.lost)
    _set_ends(fields, end, camera, captured, lost)
    for name in fields:
        fields[name] = np.where(unknown, np.nan, fields[name]).T
    with np.errstate(invalid="ignore"):
        status = np.where(fields["error"][:, -1] > _WANTED, Status.INACCURATE, Status.ESCAPED)
    status = np.where(lost | unknown, np.where(captured, Status.CAPTURED, Status.MISSED), status).astype(np.int8)
    fields |= {"status": status, "conjugate": conjugate, "index": np.where(unknown, -1, index)}
    return {name: values[:count] for name, values in fields.items()}


def _set_ends(
    fields: dict[str, np.ndarray], end: Spherical, camera: Viewer, captured: np.ndarray, lost: np.ndarray
) -> None:
    """Write what is known of the first and the last place of each ray."""
    fields["radius"][0], fields["theta"][0] = camera.radius, camera.inclination
    fields["radius"][-1, ~captured & lost] = np.inf
    fields["radius"][-1, ~lost] = end.radius


@Program
def _begun(frame: Frame, sky: Components, end: Spherical) -> tuple[_Beam, _State]:
    """Rays at the camera."""
    constants, ray, photon = start(frame, sky)
    paths, variations = with_variations(frame, sky, ray)
    quartic = radial.factor(frame, photon)
    aim = end.aim(frame, photon, quartic)
    horizon = radial.horizon(frame.spin)
    stop = horizon + _ABOVE_HORIZON * jnp.minimum(1.0, frame.radius - horizon)
    falling = radial.mino_time_to(frame, photon, quartic, stop, jnp.zeros_like(aim.captured))
    elsewhere = jnp.where(aim.captured, falling, radial.mino_time(frame, photon, quartic))
    end_time = jnp.where(aim.lost, elsewhere, aim.mino_time)
    known = (photon.energy_ratio > 0) & (end_time * polar_rapidity(constants) < _MOST_ARC)
    end_time = jnp.where(known, end_time, jnp.nan)
    end_u = jnp.where(aim.lost, jnp.where(aim.captured, 1 / stop, 0.0), 1 / end.radius)
    opening = length((*paths[1].rate[1:], *paths[2].rate[1:]))
    beam = _Beam(constants, variations, end_time, end_u, aim.lost, aim.captured, opening)
    return beam, _State(paths, first_azimuth(frame, ray.rate), 0 * photon.b)


@Program
def _advanced(spin: Reals, beam: _Beam, state: _State, duration: Reals) -> _State:
    """The rays a Mino time later, each by steps of its own that keep the local error at round-off."""
    constants = beam.constants

    def rates(positions: list[tuple[Reals, ...]]) -> tuple[list[tuple[Reals, ...]], list[Reals]]:
        return rates_with_variation(
            spin, constants, positions[0], list(zip(beam.variations, positions[1:], strict=True))
        )

    def step(now: tuple[Reals, Reals, _State]) -> tuple[Reals, Reals, _State]:
        left, steps, state = now
        count = jnp.ceil(left * DENSEST * rapidity(spin, constants, state.paths[0]))
        h = left / jnp.maximum(count, 1)
        paths, gaps = nystroem_step(rates, state.paths, h)
        turn = azimuth_step(constants.b, state.paths[0].position, paths[0].position)
        gap = local_error(constants, gaps[0])
        after = _State(paths, state.azimuth + turn, state.local_error + gap)
        return jnp.where(count <= 1, 0.0, left - h), steps + 1, after

    def going(now: tuple[Reals, Reals, _State]) -> Reals:
        return jnp.any(now[0] > 0) & (now[1] < _MOST_STEPS)

    return jax.lax.while_loop(going, step, (duration, 0, state))[2]


@Program
def _area(spin: Reals, constants: Constants, state: _State) -> Reals:
    return area(ray_rates(spin, constants, state.paths[0].position)[1], state.paths)


def _coordinates(state: _State, times: np.ndarray) -> list[np.ndarray]:
    """Mino time, radius, theta, azimuth of states."""
    u, x, y, z = state.paths[0].position
    with np.errstate(divide="ignore"):
        found = [times, 1 / np.abs(u), np.arctan2(np.hypot(x, y), z), state.azimuth + state.paths[0].psi]
    return [np.asarray(part) for part in found]


@Program
def _errors(beam: _Beam, state: _State) -> Reals:
    """Errors of the direction and of 1 / r by those of the steps and round-off in N: (time, ray)."""
    m = state.paths[0].position[1:]
    spread = length(
        [part for path in state.paths[1:] for part in (path.position[0], *turned(m, path.position[1:], path.psi))]
    )
    growth = spread * polar_rapidity(beam.constants) / beam.opening
    return _STEP_GAIN * state.local_error * (1 + growth) + _ROUND_OFF * (1 + spread)


def _conjugate_points(spin: float, beam: _Beam, track: _State, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (ray, most, 4) of the zeros of the area, and how many each ray has."""
    value = np.array(_area(spin, beam.constants, track))
    # An area of exactly zero belongs to what came before it.
    for i in range(1, len(value)):
        value[i] = np.where(value[i] == 0, value[i - 1], value[i])
    passed = value[1:] * value[:-1] < 0
    index = passed.sum(axis=0)
    found = np.full((len(index), index.max(initial=0), len(_COORDINATES)), np.nan)
    number = np.cumsum(passed, axis=0)
    for k in range(found.shape[1]):
        here = np.flatnonzero(index > k)
        low = np.zeros(len(index), int)
        low[here] = np.argmax(passed & (number == k + 1), axis=0)[here]
        found[here, k] = _zero(spin, beam, track, times, value, low)[here]
    return found, index


def _zero(spin: float, beam: _Beam, track: _State, times: np.ndarray, value: np.ndarray, low: np.ndarray) -> np.ndarray:
    """Coordinates (ray, 4) of the zero of the area between the times `low` and `low` + 1: false position (Illinois)."""
    lane = np.arange(len(low))
    begin = jax.tree.map(lambda leaf: leaf[low, lane], track)
    left, right = np.zeros(len(low)), times[low + 1, lane] - times[low, lane]
    at_left, at_right = value[low, lane], value[low + 1, lane]
    whole, trial, state = right, left, begin
    for _ in range(_MOST_TRIALS):
        with np.errstate(invalid="ignore", divide="ignore"):
            trial = (left * at_right - right * at_left) / (at_right - at_left)
        trial = np.where(np.isfinite(trial), np.clip(trial, left, right), left)
        state = _advanced(spin, beam, begin, trial)
        there = np.asarray(_area(spin, beam.constants, state))
        on_left = there * at_left > 0
        at_right = np.where(on_left, at_right / 2, there)
        at_left = np.where(on_left, there, at_left / 2)
        moved = np.minimum(trial - left, right - trial)
        left, right = np.where(on_left, trial, left), np.where(on_left, right, trial)
        if np.all((moved <= 1e-13 * whole) | (there == 0)):
            break
    state = jax.tree.map(np.asarray, state)
    return np.stack(_coordinates(state, times[low, lane] + trial), axis=-1)
