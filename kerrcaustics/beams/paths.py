"""Rays in space: places along each ray with their times, and its conjugate points."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.bundles import COORDINATES, conjugate_points, places, sign_changes
from kerrcaustics.beams.directions import as_vectors, normalised
from kerrcaustics.beams.ends import End, Sphere, Wherever, end_of
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.kernels.trees import leaves, mapped
from kerrcaustics.beams.path_beams import PathBeams, beams_along
from kerrcaustics.beams.ray_state import Aim, Bundle, BundleState, Constants, Path
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import differing_digits, flags, quoted, real_array, real_number, whole_number
from kerrcaustics.spacetime.frame import Frame, Photon
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

# Rays advanced together: what they hold at all times is in memory at once.
_CHUNK = 512
# Radians of arc between two values of the beam's area: its zeros lie about pi apart.
_LONGEST_ARC = 0.8
_MOST_POINTS = 100_000
# Error above which a path is called inaccurate, in radians.
_WANTED = 1e-9
# Round-off of an orbit on a sphere, for each radian of arc; relative, of its time.
_OF_ORBIT, _OF_ORBIT_TIME = 1e-15, 2e-15


@result("space-points/1", kw_only=True)
class SpacePoints(Shown):
    """Events around the hole, in Boyer-Lindquist coordinates. Arrays of one shape (..., n)."""

    spin: float = quantity("", "1", "spin of the hole")
    mino_time: np.ndarray = quantity("ray... place", "M^-1", "Mino time since the start, of rays since the viewer")
    radius: np.ndarray = quantity("ray... place", "GM/c^2", "radius, infinite on the celestial sphere")
    theta: np.ndarray = quantity("ray... place", "rad", "polar angle")
    azimuth: np.ndarray = quantity(
        "ray... place", "rad", "phi, unwrapped: continuous along a ray, 0 at the viewer", json="phi_deg"
    )
    time: np.ndarray = quantity(
        "ray... place",
        "GM/c^3",
        "coordinate time between the place and the start; of rays from the place to the camera, to an Observer less "
        "r + 2 ln r of the observer; of places at infinity the limit of t - r - 2 ln r, as of `Rays`",
    )
    error: np.ndarray = quantity(
        "ray... place", "rad", "estimated error of the direction, and of 1 / radius", json="error_rad"
    )
    time_error: np.ndarray = quantity(
        "ray... place",
        "GM/c^3",
        "estimated error of time: of a place on a ray that at its radius, of a conjugate point with that of its radius",
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
        return cartesian(self.spin, self.radius, self.direction)


def cartesian(
    spin: float, radius: Float[Array, "*batch"], direction: Float[Array, "*batch 3"]
) -> Float[Array, "*batch 3"]:
    """Cartesian Boyer-Lindquist coordinates (..., 3) of places, from unit vectors with their angles."""
    across = np.hypot(radius, spin)
    scale = np.stack([across, across, radius], axis=-1)
    with np.errstate(invalid="ignore"):
        return scale * direction


@result("ray-paths/1", kw_only=True)
class RayPaths(SpacePoints):
    """Rays followed backward from a viewer: `n` events of each, in their order from the viewer.

    The first one is the viewer, or the place where the ray comes to the radius `start`; from infinity, where there is
    no place in space, it lies a step of Mino time on the way in.

    NaN, and an index of -1, for photons that cannot come from infinity (inside the ergosphere), within round-off of the
    shadow edge, where they wind for ever, and for rays that do not come to `start` before they end.
    """

    status: np.ndarray = quantity("ray...", "1", "`Status` values, INACCURATE where the error at the end is above 1e-9")
    conjugate: SpacePoints = quantity(
        "ray... conjugate", "", "conjugate points in the order of the ray, NaN where there are no more"
    )
    index: np.ndarray = quantity("ray...", "1", "how many conjugate points there are, from the viewer on")
    turning_points: np.ndarray = quantity(
        "ray...", "1", "how many turning points theta has, from the viewer on; the axis is one for rays over it"
    )
    beams: PathBeams | None = quantity("", "", "the beams at the places; None unless requested", default=None)


@usual_warnings
def ray_paths(
    camera: Viewer,
    sky: ArrayLike,
    n: int = 200,
    *,
    end: Wherever | End = math.inf,
    start: float = math.inf,
    beams: bool = False,
) -> RayPaths:
    """The rays that a viewer sees, in space: places and times along each, and its conjugate points.

    Parameters
    ----------
    camera : Camera or Observer
    sky : (..., 3) array
        Unit vectors N on the camera sky. They are normalised here. Of an Observer (..., 2), places (alpha, beta).
    n : int
        Number of places on each ray, from its start to its end, evenly spaced in Mino time.
    end : float, Sphere or EquatorialPlane
        Where a ray ends: math.inf, the celestial sphere; a radius, at its first arrival there; an `EquatorialPlane`,
        at its n-th crossing.
    start : float
        Radius at which places begin, on the way in; the viewer's own if that is less. From infinity the first place
        lies a step on the way in, about n / pi times as far out as rays pass by the hole.
    beams : bool
        True to have the diameters of the beam at each place, and their directions: `RayPaths.beams`.

    Returns
    -------
    RayPaths
        Of shape (..., n). A ray that does not reach its end is followed to the celestial sphere, with status MISSED,
        or to just above the horizon, with status CAPTURED. One that does not come to `start` before it ends has no
        places, and status MISSED.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `RayPaths.error` and `RayPaths.time_error`; of conjugate points, too, with the rate at which the beam's area passes
    through zero there; `PathBeams.jacobian_error`.

    Notes
    -----
    Close to a critical curve the last conjugate point is close to infinity, and round-off decides whether it is there;
    likewise for a turning point at the viewer or at the end.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> paths = kc.ray_paths(camera, [[-0.6, 0.5, 0.4]], n=50)
    >>> paths.position.shape
    (1, 50, 3)
    >>> observer = kc.Observer(spin=0.9, inclination=1.0)
    >>> float(kc.ray_paths(observer, [6.0, 2.0], start=100.0).radius[0])
    100.0
    """
    check_viewer(camera)
    flags(beams=beams)
    paths = paths_of_directions(camera, camera.directions(sky), n, end=end, start=start, beams=beams)
    if paths.beams is None:
        return paths
    by_places = camera.by_places(real_array("sky", sky)[..., None, :], paths.beams.jacobian)
    return replace(paths, beams=replace(paths.beams, jacobian=by_places))


def paths_of_directions(
    camera: Viewer,
    directions: ArrayLike,
    n: int,
    *,
    end: Wherever | End = math.inf,
    start: float = math.inf,
    beams: bool = False,
) -> RayPaths:
    """Paths of directions (..., 3) as engines take them, of an Observer too; all else as for `ray_paths`."""
    surface, begin = end_of(camera, end), min(_checked_start(camera, start), camera.radius)
    n = whole_number("n", n, 2, _MOST_POINTS)
    vectors, shape = as_vectors(directions)
    vectors = normalised(vectors)
    starts = range(0, max(len(vectors), 1), _CHUNK)
    parts = [_fields(camera, vectors[i : i + _CHUNK], n, surface, begin, beams=beams) for i in starts]
    fields = {name: np.concatenate([part[0][name] for part in parts]) for name in parts[0][0]}
    most = max(part[1]["radius"].shape[1] for part in parts)
    points = {name: np.concatenate([_widened(part[1][name], most) for part in parts]) for name in COORDINATES}
    along = {name: np.concatenate([part[2][name] for part in parts]) for name in parts[0][2]}
    fields, points, along = (
        {name: values.reshape((*shape, *values.shape[1:])) for name, values in part.items()}
        for part in (fields, points, along)
    )
    opened = PathBeams(**along) if along else None
    paths: Any = fields | {"conjugate": SpacePoints(spin=camera.spin, **points), "beams": opened}
    return RayPaths(spin=camera.spin, **paths)


def _checked_start(camera: Viewer, start: object) -> float:
    """The radius where places begin; a ValueError unless it is one outside the horizon."""
    radius, horizon = real_number("start", start), kerr.horizon(camera.spin)
    if not radius > horizon:
        value, least = differing_digits(radius, horizon)
        raise ValueError(f"Argument `start` must be larger than the horizon radius {least}, but is {value}.")
    return radius


def _widened(values: Float[Array, "rays k"], most: int) -> Float[Array, "rays most"]:
    """Rows filled up with NaN."""
    return np.pad(values, ((0, 0), (0, most - values.shape[1])), constant_values=np.nan)


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
    # Without the radial potential the radius is constant.
    constants = Constants(0.0, 0.0, 0.0, q + impact**2, impact)
    ray = Path((1 / radius, 1.0, 0.0, 0.0), (0.0, 0.0, -impact, math.sqrt(q)), 0.0)
    still = mapped(lambda part: 0 * part, (constants, ray))
    bundle = Bundle(constants, [still[0]] * 2, 0.0, 1.0, 1.0, False, False, 1.0, ray)
    # Of the clock the quadrature alone is used.
    clock = Path((1.0,), (0.0,), 0.0)
    state = BundleState((ray, still[1], still[1], clock), 0.0, 0.0, 0.0)
    frame = Camera(spin, radius).frame()
    photon = Photon(impact, q + impact**2, q + (impact - spin) ** 2, q, (0, 0, 0, 0.0), (0, 0, 0, 1.0), 1.0)
    period = 2 * float(kernel("time_to_plane")(frame, photon, 1))
    times = np.linspace(0, periods * period, n)
    after = kernel("advanced")(spin, bundle, state, times)
    fields = places(frame, bundle, after, times, np.zeros(n, bool))
    fields["time"] = (radius + 2) * radius * times + after.paths[-1].psi
    fields["error"] += _OF_ORBIT * (np.abs(fields["azimuth"]) + times * math.sqrt(q + impact**2))
    fields["time_error"] = _OF_ORBIT_TIME * fields["time"] + radius**2 * fields["error"]
    # Backward and forward in time differ by the sense of the azimuth alone.
    return SpacePoints(spin=spin, **fields | {"azimuth": -fields["azimuth"]})


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


def _fields(
    camera: Viewer, sky: np.ndarray, n: int, end: End, begin: float, *, beams: bool
) -> tuple[dict[str, np.ndarray], ...]:
    """The fields of a result, of its conjugate points and of its beams, for the rays of one chunk, or fewer."""
    frame = camera.frame()
    bundle, state, (way_in, aim) = kernel(f"departing_{end.kernel}")(frame, tuple(sky.T), end.numbers(), begin)
    track, times, shown = _track(frame, bundle, state, n, math.isinf(begin))
    if begin < camera.radius:
        _settle(frame, bundle, (Sphere(begin), way_in), track, shown.start)
    off = _settle(frame, bundle, (end, aim), track, -1)
    last = mapped(lambda leaf: leaf[-1], track.paths[0])
    lost, radius, theta = kernel(f"end_place_{end.kernel}")(frame.spin, bundle, end.numbers(), aim, last)
    at_infinity = np.zeros(times[shown].shape, bool)
    at_infinity[-1] = np.isinf(radius)
    shown_track = mapped(lambda leaf: leaf[shown], track)
    fields, along = places(frame, bundle, shown_track, times[shown], at_infinity), {}
    # The end is known beforehand: the miss shows the error of the time, close to the shadow edge.
    fields["error"][-1] += off
    # The exact first and last places.
    if not math.isinf(begin):
        fields["radius"][0] = begin
    if begin == camera.radius:
        fields["theta"][0] = camera.inclination
    fields["radius"][-1], fields["theta"][-1] = radius, theta
    conjugate, index = conjugate_points(frame, bundle, track, times)
    unknown = np.isnan(bundle.end_time)
    fields = {name: np.where(unknown, np.nan, values).T for name, values in fields.items()}
    if beams:
        along = beams_along(frame, bundle, shown_track, fields["error"].T)
        along = {name: np.swapaxes(values, 0, 1) for name, values in along.items()}
        along = {name: np.where(_broadcast_flags(unknown, values), np.nan, values) for name, values in along.items()}
    with np.errstate(invalid="ignore"):
        status = np.where(fields["error"][:, -1] > _WANTED, Status.INACCURATE, Status.ESCAPED)
    status = np.where(lost | unknown, np.where(bundle.captured, Status.CAPTURED, Status.MISSED), status)
    turns = sign_changes(np.array(track.paths[0].rate[3])).sum(axis=0)
    fields |= {"status": status.astype(np.int8)}
    fields |= {name: np.where(unknown, -1, n) for name, n in (("index", index), ("turning_points", turns))}
    return fields, conjugate, along


def _polar_rapidity(constants: Constants) -> Array:
    """Radians of arc along the sphere of m in a unit of Mino time, as integrator/equations.py has it."""
    return np.sqrt(np.maximum(constants.k, 0) + 3)


def _broadcast_flags(flags: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Flags of the first axis of values, for all of them."""
    return flags.reshape(-1, *[1] * (values.ndim - 1))


def _settle(frame: Frame, bundle: Bundle, aimed: tuple[End, Aim], track: BundleState, time: int) -> np.ndarray:
    """Move the rays, at the time of a number, onto the surface at which they aim; radians by which they were off."""
    end, aim = aimed
    before = mapped(lambda leaf: leaf[time], track)
    now, off = kernel(f"settled_{end.kernel}")(frame.spin, bundle, end.numbers(), aim, before)
    for leaf, row in zip(leaves(track), leaves(now), strict=True):
        leaf[time] = row
    return off


def _track(
    frame: Frame, bundle: Bundle, state: BundleState, n: int, endless: bool
) -> tuple[BundleState, Float[Array, "times rays"], slice]:
    """The rays from the viewer on at all times of interest, these times of Mino, and which of them are the places.

    endless: the viewer has no place.
    """
    rapidity, end = _polar_rapidity(bundle.constants), np.nan_to_num(bundle.end_time)
    begin = end / n if endless else np.minimum(np.nan_to_num(bundle.begin_time), end)
    step = (end - begin) / (n - 1)
    lead, part = (math.ceil(np.max(time * rapidity, initial=0.0) / _LONGEST_ARC) for time in (begin, step))
    part = max(part, 1)
    before = np.arange(lead)[:, None] / max(lead, 1) * begin
    times = np.concatenate([before, begin + np.arange((n - 1) * part + 1)[:, None] / part * step])
    advanced, states = kernel("advanced"), [state]
    for duration in np.diff(times, axis=0):
        states.append(advanced(frame.spin, bundle, states[-1], duration))
    return mapped(lambda *parts: np.stack(parts), *states), times, slice(lead, None, part)
