"""Rays in space, for pictures: places along each ray, and its conjugate points."""

import math

import jax
import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.bundles import (
    COORDINATES,
    Bundle,
    BundleState,
    advanced,
    conjugate_points,
    coordinates,
    departing,
    errors_of,
)
from kerrcaustics.beams.directions import as_vectors, normalised
from kerrcaustics.beams.ends import Spherical, end_of
from kerrcaustics.beams.integrator.equations import Constants, polar_rapidity
from kerrcaustics.beams.integrator.nystroem import Path
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera, check_camera
from kerrcaustics.spacetime.checks import quoted, real_number, whole_number
from kerrcaustics.spacetime.frame import Photon
from kerrcaustics.spacetime.polar import mino_time_to_plane
from kerrcaustics.spacetime.settings import own_settings
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

# Rays advanced together; one compiled size serves all.
_CHUNK = 512
# Radians of arc between two values of the beam's area: its zeros lie about pi apart.
_LONGEST_ARC = 0.8
_MOST_POINTS = 100_000
# Error above which a path is called inaccurate, in radians.
_WANTED = 1e-9


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
        """The class and the shape in one line."""
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
    """Rays followed backward from a camera: `n` events of each, the camera first.

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
        Number of places on each ray, from the camera to its end, evenly spaced in Mino time.
    end : float
        math.inf, the celestial sphere, or a radius: a ray ends at its first arrival there.

    Returns
    -------
    RayPaths
        Of shape (..., n). A ray that does not reach its end is followed to the celestial sphere, with status MISSED,
        or to just above the horizon, with status CAPTURED.

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
    parts = [_fields(camera, directions[i : i + _CHUNK], n, surface) for i in starts]
    most = max(part["conjugate"].shape[1] for part in parts)
    for part in parts:
        missing = most - part["conjugate"].shape[1]
        part["conjugate"] = np.pad(part["conjugate"], ((0, 0), (0, missing), (0, 0)), constant_values=np.nan)
    fields = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    fields = {name: values.reshape((*shape, *values.shape[1:])) for name, values in fields.items()}
    points = dict(zip(COORDINATES, np.moveaxis(fields.pop("conjugate"), -1, 0), strict=True))
    return RayPaths(spin=camera.spin, conjugate=SpacePoints(spin=camera.spin, **points), **fields)


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
        Number of places, evenly spaced in Mino time.
    oscillations : float
        Number of periods of the polar motion.

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
    # Without the radial potential the radius is constant.
    constants = Constants(0 * one, 0 * one, 0 * one, (q + impact**2) * one, impact * one)
    ray = Path((one / radius, one, 0 * one, 0 * one), (0 * one, 0 * one, -impact * one, math.sqrt(q) * one), 0 * one)
    still = jax.tree.map(lambda part: 0 * part, (constants, ray))
    bundle = Bundle(constants, [still[0]] * 2, one, one, one, one, one)
    state = BundleState((ray, still[1], still[1]), 0 * one, 0 * one)
    photon = Photon(impact, q + impact**2, q + (impact - spin) ** 2, q, (0, 0, 0, 0.0), (0, 0, 0, 1.0), 1.0)
    period = 2 * float(mino_time_to_plane(Camera(spin, radius).frame(), photon, 1))
    times = np.linspace(0, periods * period, n)
    parts = []
    for part in np.pad(times, (0, -n % _CHUNK)).reshape(-1, _CHUNK):
        after = jax.tree.map(np.asarray, advanced(spin, bundle, state, part))
        parts.append(np.stack(coordinates(after, part)))
    time, r, theta, azimuth = np.concatenate(parts, axis=1)[:, :n]
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


def _fields(camera: Viewer, sky: np.ndarray, n: int, end: Spherical) -> dict[str, np.ndarray]:
    """The fields of a result for the rays of one chunk, or fewer."""
    count = len(sky)
    # Filled up with the first ray, or any other, so that one compiled size serves all.
    sky = np.concatenate([sky, np.repeat(sky[:1] if count else np.eye(3)[:1], _CHUNK - count, axis=0)])
    frame = camera.frame()
    bundle, state = jax.tree.map(np.asarray, departing(frame, tuple(sky.T), end))
    end_time = np.asarray(bundle.end_time)
    rapidity = np.asarray(polar_rapidity(bundle.constants))
    arc = np.nanmax(end_time * rapidity, initial=0.0)
    part = max(1, math.ceil(arc / ((n - 1) * _LONGEST_ARC)))
    step = np.nan_to_num(end_time) / ((n - 1) * part)
    states = [state]
    for _ in range((n - 1) * part):
        states.append(advanced(frame.spin, bundle, states[-1], step))
    track = jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *states)
    times = np.arange(len(states))[:, None] * step
    unknown = np.isnan(end_time)
    shown = jax.tree.map(lambda leaf: leaf[::part], track)
    fields: dict[str, np.ndarray] = dict(zip(COORDINATES, coordinates(shown, times[::part]), strict=True))
    fields["error"] = np.array(errors_of(bundle, shown))
    # The end is known beforehand: the miss shows the error of the time, close to the shadow edge.
    fields["error"][-1] += np.abs(shown.paths[0].position[0][-1] - bundle.end_u) * rapidity
    conjugate, index = conjugate_points(frame.spin, bundle, track, times)
    captured, lost = np.asarray(bundle.captured), np.asarray(bundle.lost)
    # The exact first and last places.
    fields["radius"][0], fields["theta"][0] = camera.radius, camera.inclination
    fields["radius"][-1, ~captured & lost] = np.inf
    fields["radius"][-1, ~lost] = end.radius
    for name in fields:
        fields[name] = np.where(unknown, np.nan, fields[name]).T
    with np.errstate(invalid="ignore"):
        status = np.where(fields["error"][:, -1] > _WANTED, Status.INACCURATE, Status.ESCAPED)
    status = np.where(lost | unknown, np.where(captured, Status.CAPTURED, Status.MISSED), status).astype(np.int8)
    fields |= {"status": status, "conjugate": conjugate, "index": np.where(unknown, -1, index)}
    return {name: values[:count] for name, values in fields.items()}
