"""Surfaces on which rays end: the celestial sphere, a sphere of finite radius, a crossing of the equatorial plane.

An end is a surface around the hole with something that shines on it (emitters.py). What is special about one is told by
the methods of its class, here and nowhere else; `End` has what holds for most. A new end is one more class. Engines use
the methods that take photons and paths, all else those that take places on the surface.
"""

import math
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.emitters import EMITTERS, Emitter, static
from kerrcaustics.beams.integrator.equations import Constants, radial_pull
from kerrcaustics.beams.integrator.nystroem import Path
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.checks import apart, numbers, one_of, quoted, real_number, whole_number
from kerrcaustics.spacetime.frame import Frame, Photon
from kerrcaustics.spacetime.polar import mino_time_to_plane
from kerrcaustics.spacetime.sphere import flattened, from_angles, polar_angle
from kerrcaustics.spacetime.viewer import Viewer

# A source closer to the viewer than this part of its radius has no direction: rounding leaves a radian of it open.
_AT_VIEWER = 1e-14
# Round-off of the radius of an end, relative, as it enters the distance from a turning point.
_OF_RADIUS = 4e-16
# Radii of a map of the plane: from so many horizon radii to so many camera radii, and the largest.
_LOWEST, _HIGHEST, _FROM_AFAR = 1.05, 2.0, 100.0

Row = tuple[Reals, ...]
Jacobian = tuple[Row, ...]

_TURN = 2 * math.pi


class Coordinate(NamedTuple):
    """One of the two coordinates of places on a surface; period: infinite where it has none."""

    name: str
    symbol: str
    unit: str
    period: float = math.inf


class Aim(NamedTuple):
    """The aim of a ray, by roots and elliptic integrals alone.

    captured: followed on, it falls in; lost: it does not reach its end; mino_time to the end, 0 if lost; rising,
    whether it arrives with growing radius (for spheres); plane_rate, |z'| in the equatorial plane (where that is the
    end); conditioning, how much it magnifies round-off in N: deep in the field the energy at infinity is a small
    difference of large numbers; certain, whether double precision knows the first two.
    """

    captured: Flags
    lost: Flags
    mino_time: Reals
    conditioning: Reals
    certain: Flags
    rising: Flags = False
    plane_rate: Reals = math.inf


class Arriving(NamedTuple):
    """The arrival of a ray: u = 1 / r, the sizes of u' and psi', and the radians of arc in a unit of Mino time."""

    u: Reals
    rate: Reals
    psi_rate: Reals
    speed: Reals

    @property
    def turning(self) -> Reals:
        """The part of psi in the rate of the end, per radian of arc."""
        return self.psi_rate / self.speed


class End:
    """A surface on which rays end, for compiled code too; the methods here are those of a sphere of finite radius.

    finite, whether it lies at a finite radius; axes, rows from whose third theta' and from whose first phi' is counted
    on spheres; coordinate, which of (u, x, y, z) is constant on it; coordinates, those of places on it.
    """

    finite: ClassVar[bool] = True
    axes: ClassVar[np.ndarray] = np.eye(3)
    coordinate: ClassVar[int] = 0
    coordinates: ClassVar[tuple[Coordinate, Coordinate]] = (
        Coordinate("theta", "theta'", "rad"),
        Coordinate("phi", "phi'", "rad", _TURN),
    )

    def emitter_motion(self) -> Emitter | None:
        """The motion of what shines there; None for sources at rest at infinity."""
        return None

    def bare(self) -> "End":
        """The surface, whatever shines on it: rays do not depend on that."""
        return self

    def in_words(self) -> str:
        """The surface as texts name it."""
        raise NotImplementedError

    def arrivals(self) -> "tuple[End, ...]":
        """The surface, for each of the arrivals that a ray may have there."""
        return (self,)

    def at_second_arrival(self) -> "End":
        """The surface where rays meet it for the second time."""
        raise ValueError(f"Argument `end` must be a sphere for a second arrival, but is {self!r}.")

    def checked(self, name: str, places: Any, viewer: Viewer, *, one: bool = False) -> np.ndarray:
        """Places (n, 2) on the surface, or one (2,), which the user gave as the argument `name`."""
        given = numbers(name, places)
        if given.shape != (2,) if one else (given.ndim != 2 or given.shape[-1] != 2 or not np.isfinite(given).all()):
            shape = "two numbers (theta', phi') in radians" if one else "of shape (n, 2): theta', phi' in radians"
            raise ValueError(_must_be(name, shape, places, one))
        if not ((given[..., 0] >= 0) & (given[..., 0] <= math.pi) & np.isfinite(given[..., 1])).all():
            but = f" and a finite phi', but is {quoted(places)}" if one else ""
            raise ValueError(f"Argument `{name}` must have theta' in [0, pi] radians (0 to 180 degrees){but}.")
        self.check_apart(name, given.reshape(-1, 2), viewer)
        return given

    def checked_level(self, name: str, level: object, viewer: Viewer) -> float:
        """The first coordinate of a circle on the surface, which the user gave as the argument `name`."""
        number = real_number(name, level)
        if not 0 <= number <= math.pi:
            raise ValueError(
                f"Argument `{name}` must be a theta' in [0, pi] radians (0 to 180 degrees), but is {quoted(level)}."
            )
        return number

    def levels(self, viewer: Viewer, rows: int) -> np.ndarray:
        """First coordinates of the rows of a map of the surface."""
        return (np.arange(rows) + 0.5) * math.pi / rows

    def check_apart(self, name: str, places: np.ndarray, viewer: Viewer) -> None:
        """Raise ValueError if a place (n, 2) cannot be told from the viewer's own, and is seen in no direction."""

    def vectors(self, places: np.ndarray) -> np.ndarray:
        """Places (n, 2) as vectors (n, axes) that are close where the places are."""
        return from_angles(places[:, 0], places[:, 1])

    def angles(self, direction: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (theta', phi') of directions n', phi' unwrapped; azimuth: about the spin axis, unwrapped."""
        return polar_angle(direction), azimuth

    def ends(self, rays: Rays) -> np.ndarray:
        """The ends of rays as such vectors."""
        return rays.direction

    def displacement(self, rays: Rays, vectors: np.ndarray) -> np.ndarray:
        """From the ends of rays to places (n, axes), as (n, 2) in the rows of the Jacobian."""
        return flattened(rays.direction, vectors - rays.direction)

    def scale(self, rays: Rays) -> np.ndarray | float:
        """The size of a unit of `Rays.error` in the rows of the Jacobian."""
        return 1.0

    def is_beyond(self, camera: Viewer) -> bool:
        """Whether rays that escape outward without a turning point meet it once, on their way out."""
        raise NotImplementedError

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """Whether a ray reaches it, and when. Rays with no positive energy at infinity are not followed."""
        raise NotImplementedError

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """Mino time from a point close by to it, from the path itself."""
        raise NotImplementedError

    def lost(self, aim: Aim, spin: Reals, u: Reals) -> Flags:
        """Which rays do not reach it, u = 1 / r there being known."""
        return aim.lost

    def radius_at(self, u: Reals) -> Reals:
        """Radius of the end of a ray."""
        raise NotImplementedError

    def direction(self, n: Components) -> Components:
        """The direction of the end, where round-off may have moved it."""
        return n

    def crossings(self, counted: Reals) -> Reals:
        """Crossings of the equatorial plane, from those counted on the way."""
        return counted

    def is_across(self, either: Flags) -> Flags:
        """Whether a ray may end on the other side of the equatorial plane, where errors allow either."""
        return either

    def orientation(self, photon: Photon, u_rate: Reals) -> Reals:
        """The sign that det J has for rays that passed no conjugate point."""
        return jnp.where(u_rate < 0, 1.0, -1.0)

    def jacobian(self, angles: Jacobian, radius: Reals, in_radius: Row) -> Jacobian:
        """The Jacobian in the surface from that of the angles (theta', phi') and of the radius."""
        return angles

    def spread(self, size: Reals, radius: Reals) -> Reals:
        """The size of that Jacobian in radians, or in ln r."""
        return size

    def motion(self, at: Arriving) -> Reals:
        """The speed of the end in the surface if the ray arrives later, per radian of arc."""
        return 1 + at.turning

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """The displacement in the surface of a ray that is displaced by `growth` in u, in its path."""
        return growth * (1 + at.turning) / at.rate

    def delayed(self, delay: Reals, at: Arriving) -> Reals:
        """The displacement in the surface of a ray that is late by so many radians of arc, in radius alone."""
        return delay * (1 + at.turning)

    def unsettled(self, constants: Constants, at: Arriving) -> tuple[Reals, Reals]:
        """The Mino time that rounding leaves open, of the integrator's arrival; the relative rate of change of u'."""
        return 0.0, 0.0

    def least_growth(self, at: Arriving) -> Reals:
        """By how much, at least, errors made on the way grow."""
        return 1.0

    def lateness(self, height: Reals, aim: Aim, at: Arriving) -> Reals:
        """By how much a ray that starts at a height over the equatorial plane is late if its inclination is wrong."""
        return 0.0

    def weighed(self, m: Row, aim: Aim, speed: Reals) -> Row:
        """A change of m, as it displaces the end: what tells the arrival counts through its time."""
        return m

    def slip(self, aim: Aim, at: Arriving) -> Reals:
        """The displacement in the surface, by its time, of a ray whose height over the plane is off by a radian."""
        return 0.0

    def lever(self, at: Arriving, depth: Reals) -> Reals:
        """The time by which an end is late, at most, that is displaced by a radian."""
        return at.speed


@jax.tree_util.register_dataclass
@result("celestial-sphere/1", record="radius", eq=True)
class CelestialSphere(End):
    """The celestial sphere: infinity, where u = 0 exactly. What shines there is at rest.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.CelestialSphere().radius
    inf
    """

    finite: ClassVar[bool] = False

    @property
    @derived("", "GM/c^2", json="source_radius", column="source_radius")
    def radius(self) -> float:
        """Infinite."""
        return math.inf

    def in_words(self) -> str:
        """By its name."""
        return "the celestial sphere"

    def is_beyond(self, camera: Viewer) -> bool:
        """Always."""
        return True

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """Rays reach it that are not captured."""
        captured = radial.is_captured(frame, photon, quartic)
        time = jnp.where(captured, 0.0, radial.mino_time(frame, photon, quartic))
        return Aim(captured, captured, time, *_known(frame, photon, quartic))

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """The path is straight there."""
        return -path.position[0] / path.rate[0]

    def radius_at(self, u: Reals) -> float:
        """Infinite."""
        return math.inf

    def orientation(self, photon: Photon, u_rate: Reals) -> float:
        """Rays leave outward."""
        return 1.0

    def motion(self, at: Arriving) -> float:
        """The end stands still: all motion there is outward."""
        return 0.0

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """As much as in u."""
        return growth


@jax.tree_util.register_dataclass
@result("sphere/1", record="radius", eq=True)
class Sphere(End):
    """A sphere around the hole: places where rays, followed backward, first arrive at a radius. What shines is static.

    Parameters
    ----------
    radius : float
        Boyer-Lindquist radius, outside the horizon.
    second_arrival : bool
        Whether the second arrival is meant, of rays that meet a sphere within the viewer's radius twice.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> kc.trace_rays(camera, [[-0.6, 0.5, 0.4]], end=kc.Sphere(20.0)).radius.tolist()
    [20.0]
    """

    radius: Any = quantity("", "GM/c^2", "Boyer-Lindquist radius", json="source_radius", column="source_radius")
    second_arrival: Any = quantity("", "1", "True for the second arrival", default=False)

    def emitter_motion(self) -> Emitter:
        """At rest."""
        return static

    def in_words(self) -> str:
        """With its radius."""
        return f"the sphere r = {float(self.radius):.12g}"

    def arrivals(self) -> "tuple[Sphere, ...]":
        """The first one and the second."""
        return self, self.at_second_arrival()

    def at_second_arrival(self) -> "Sphere":
        """The second arrival."""
        return Sphere(self.radius, second_arrival=True)

    def check_apart(self, name: str, places: np.ndarray, viewer: Viewer) -> None:
        """Compare them with the place of the viewer."""
        if math.isinf(viewer.radius):
            return
        own = from_angles(viewer.inclination, 0.0)
        aside = np.linalg.norm(self.vectors(places) - own, axis=1)
        if (np.hypot(self.radius / viewer.radius - 1, aside) < _AT_VIEWER).any():
            raise ValueError(
                f"Argument `{name}` must keep the star away from the camera, but at r = {float(self.radius):.12g}, "
                f"theta = {viewer.inclination:.12g}, phi = 0 it cannot be told from that, and is seen in no direction."
            )

    def is_beyond(self, camera: Viewer) -> bool:
        """True if its radius is larger than the camera's."""
        return self.radius > camera.radius

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """A turning point stops a ray only where it comes before the sphere."""
        captured = radial.is_captured(frame, photon, quartic)
        inward = photon.rate[0] > 0
        rising = (self.radius > frame.radius) | ((self.radius == frame.radius) & inward) | self.second_arrival
        # Where this is negative the sphere lies between the outer roots.
        square = radial.outer_square(quartic, radial.outer_start(frame, photon, quartic), self.radius)
        side = self.radius - 1 - quartic.lift
        above = ~captured | (~inward & (side <= 0) & (square >= 0))
        turned = inward & (side >= 0) & (square >= 0)
        reached = jnp.where(rising, above & (~jnp.asarray(self.second_arrival) | turned), captured | turned)
        lost = ~reached | (photon.energy_ratio <= 0)
        time = radial.mino_time_to(frame, photon, quartic, self.radius, rising)
        conditioning, certain = _known(frame, photon, quartic)
        # Of the radius too, which may be that of the turning point.
        doubt = radial.arrival_doubt(frame, photon, quartic, self.radius) + _OF_RADIUS * self.radius * jnp.abs(side)
        certain = certain & (jnp.abs(square) > doubt)
        return Aim(captured, lost, jnp.where(lost, 0.0, time), conditioning, certain, rising=rising)

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """By the parabola through u, arriving with the known sign of u': close to a turning point too."""
        u, w = path.position[0], path.rate[0]
        pull = radial_pull(constants, u)
        gap = 1 / self.radius - u
        sense = jnp.where(aim.rising, -1.0, 1.0)
        final = sense * jnp.sqrt(jnp.maximum(w * w + 2 * pull * gap, 0))
        agrees = sense * w > 0
        return jnp.where(agrees, 2 * gap / jnp.where(agrees, w + final, 1), (final - w) / jnp.where(pull == 0, 1, pull))

    def unsettled(self, constants: Constants, at: Arriving) -> tuple[Reals, Reals]:
        """Rounding of u over its rate, and where the ray only grazes the sphere, by the parabola through u."""
        pull = jnp.abs(radial_pull(constants, at.u))
        rounding = _OF_RADIUS * at.u
        rate = jnp.maximum(jnp.maximum(at.rate, jnp.sqrt(rounding * pull)), 1e-300)
        return rounding / rate, pull / rate

    def radius_at(self, u: Reals) -> Reals:
        """Its own."""
        return self.radius + jnp.zeros_like(u)


@jax.tree_util.register_pytree_node_class
@result("equatorial-plane/1", eq=True)
class EquatorialPlane(End):
    """The n-th place where a ray, followed backward from the camera, crosses the equatorial plane.

    Parameters
    ----------
    crossing : int
        Which crossing, from 1. The start of a ray is none, also for a camera in the plane.
    emitter : str
        What shines there, for the redshift: "circular" (prograde circular geodesic), "retrograde" (the other
        sense), "static" (at rest in Boyer-Lindquist coordinates), "fiducial" (at rest with respect to the FIDO),
        "plunging" (circular down to the ISCO, and from there falling with its energy and angular momentum).

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> rays = kc.trace_rays(camera, [[-0.6, 0.5, 0.4]], end=kc.EquatorialPlane(1))
    >>> rays.radius.shape
    (1,)
    """

    crossing: int = quantity("", "1", "which crossing of the plane, from 1", default=1)
    emitter: str = quantity("", "", "what shines there", default="circular")
    coordinate: ClassVar[int] = 3
    coordinates: ClassVar[tuple[Coordinate, Coordinate]] = (
        Coordinate("radius", "r", "GM/c^2"),
        Coordinate("phi", "phi", "rad", _TURN),
    )

    def __post_init__(self) -> None:
        """Raise ValueError unless there are such a crossing and such an emitter."""
        object.__setattr__(self, "crossing", whole_number("crossing", self.crossing, 1))
        one_of("emitter", self.emitter, EMITTERS)

    def tree_flatten(self) -> tuple[tuple[int], None]:
        """The crossing alone: rays do not know what shines at their end, and one program serves every emitter."""
        return (self.crossing,), None

    @classmethod
    def tree_unflatten(cls, _: None, children: tuple[Any]) -> "EquatorialPlane":
        """The end in compiled code, where the crossing may be unknown."""
        plane = object.__new__(cls)
        object.__setattr__(plane, "crossing", children[0])
        return plane

    def emitter_motion(self) -> Emitter:
        """Its emitter's."""
        return EMITTERS[self.emitter]

    def in_words(self) -> str:
        """With its number."""
        return f"crossing {self.crossing} of the equatorial plane"

    def bare(self) -> "EquatorialPlane":
        """The crossing, with the emitter of all."""
        return EquatorialPlane(self.crossing)

    def checked(self, name: str, places: Any, viewer: Viewer, *, one: bool = False) -> np.ndarray:
        """Places (n, 2) = (r, phi) in the plane, or one (2,)."""
        given = numbers(name, places)
        if given.ndim != 2 - one or given.shape[-1:] != (2,) or not np.isfinite(given).all():
            shape = "two finite numbers (r, phi), phi in radians" if one else "of shape (n, 2): r, phi"
            raise ValueError(_must_be(name, shape, places, one))
        horizon, least = kerr.horizon(viewer.spin), given[..., 0].min(initial=math.inf)
        if not least > horizon:
            told, limit = apart(float(least), horizon)
            raise ValueError(f"Argument `{name}` must have an r larger than the horizon's {limit}, but is {told}.")
        return given

    def checked_level(self, name: str, level: object, viewer: Viewer) -> float:
        """The radius of a circle in the plane."""
        number, horizon = real_number(name, level), kerr.horizon(viewer.spin)
        if not horizon < number < math.inf:
            raise ValueError(
                f"Argument `{name}` must be, in the equatorial plane, a finite radius larger than the horizon's "
                f"{horizon:.12g}, but is {quoted(level)}."
            )
        return number

    def levels(self, viewer: Viewer, rows: int) -> np.ndarray:
        """Radii in equal ratios, from next to the horizon to beyond the camera, or as far as most disks reach."""
        return np.geomspace(_LOWEST * kerr.horizon(viewer.spin), min(_FROM_AFAR, _HIGHEST * viewer.radius), rows)

    def vectors(self, places: np.ndarray) -> np.ndarray:
        """(r cos phi, r sin phi)."""
        radius, phi = places.T
        return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=-1)

    def ends(self, rays: Rays) -> np.ndarray:
        """The same of rays."""
        return rays.direction[..., :2] * np.asarray(rays.radius)[..., None]

    def displacement(self, rays: Rays, vectors: np.ndarray) -> np.ndarray:
        """(dr, r dphi)."""
        radius = np.asarray(rays.radius)
        turn = (np.arctan2(vectors[:, 1], vectors[:, 0]) - rays.azimuth + math.pi) % _TURN - math.pi
        return np.stack([np.linalg.norm(vectors, axis=-1) - radius, radius * turn], axis=-1)

    def scale(self, rays: Rays) -> np.ndarray:
        """Errors are relative to the radius."""
        return np.asarray(rays.radius)

    def is_beyond(self, camera: Viewer) -> bool:
        """Never."""
        return False

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """Rays reach it before they reach the horizon, or infinity."""
        captured = radial.is_captured(frame, photon, quartic)
        horizon = radial.horizon(frame.spin)
        to_horizon = radial.mino_time_to(frame, photon, quartic, horizon, jnp.zeros_like(captured))
        time = mino_time_to_plane(frame, photon, self.crossing)
        most = jnp.where(captured, to_horizon, radial.mino_time(frame, photon, quartic))
        lost = ~(time < most) | (photon.energy_ratio <= 0)
        plane_rate = jnp.sqrt(jnp.maximum(photon.q, 0))
        conditioning, certain = _known(frame, photon, quartic)
        certain = certain & (jnp.abs(time - most) > radial.time_doubt(frame, photon, quartic) * most)
        return Aim(captured, lost, jnp.where(lost, 0.0, time), conditioning, certain, plane_rate=plane_rate)

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """The path is straight there: z'' vanishes in the plane."""
        return -path.position[3] / path.rate[3]

    def lost(self, aim: Aim, spin: Reals, u: Reals) -> Flags:
        """Crossings that cannot be told from infinity, or from the horizon, are none."""
        return aim.lost | (u <= 0) | (u * radial.horizon(spin) >= 1)

    def radius_at(self, u: Reals) -> Reals:
        """That of the ray."""
        return 1 / u

    def direction(self, n: Components) -> Components:
        """In the plane."""
        return n[0], n[1], jnp.zeros_like(n[2])

    def crossings(self, counted: Reals) -> Reals:
        """The end is a crossing itself, on whichever side of it round-off has left z."""
        return jnp.full_like(counted, self.crossing)

    def is_across(self, either: Flags) -> Flags:
        """The end is a crossing itself."""
        return jnp.zeros_like(either)

    def orientation(self, photon: Photon, u_rate: Reals) -> Reals:
        """Above the plane first, a ray meets it from above for the odd crossings."""
        above = jnp.where(photon.position[3] == 0, photon.rate[3], photon.position[3]) > 0
        return jnp.where(above == (jnp.mod(self.crossing, 2) == 1), -1.0, 1.0)

    def jacobian(self, angles: Jacobian, radius: Reals, in_radius: Row) -> Jacobian:
        """Rows (dr, r dphi)."""
        return in_radius, tuple(radius * entry for entry in angles[1])

    def spread(self, size: Reals, radius: Reals) -> Reals:
        """Relative to the radius."""
        return size / radius

    def motion(self, at: Arriving) -> Reals:
        """In ln r too."""
        return 1 + at.turning + at.rate / at.u / at.speed

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """As much as in ln r, and what that makes of psi."""
        return growth * (1 / at.u + at.psi_rate) / at.speed

    def delayed(self, delay: Reals, at: Arriving) -> Reals:
        """As much as it lags behind in ln r."""
        return self.opened(delay * at.rate, at)

    def least_growth(self, at: Arriving) -> Reals:
        """An error of the time moves the end."""
        return self.motion(at)

    def lateness(self, height: Reals, aim: Aim, at: Arriving) -> Reals:
        """A ray that leaves off the plane at a small inclination is late by z0 dz0' / z'^2."""
        return jnp.abs(height) * (at.speed / aim.plane_rate) ** 2

    def weighed(self, m: Row, aim: Aim, speed: Reals) -> Row:
        """The height tells the arrival."""
        x, y, z = m
        return x, y, jnp.maximum(speed / aim.plane_rate, 1) * z

    def slip(self, aim: Aim, at: Arriving) -> Reals:
        """The height tells the arrival."""
        return self.motion(at) * at.speed / aim.plane_rate

    def lever(self, at: Arriving, depth: Reals) -> Reals:
        """Time goes by too while the radius changes."""
        return at.speed + depth


Spherical = CelestialSphere | Sphere
SKY = CelestialSphere()
Wherever = float | Spherical | EquatorialPlane
"""Values of `end=`: math.inf, a radius, or a surface itself."""


def end_of(camera: Viewer, end: object) -> End:
    """The surface that `end=` means; a ValueError unless it is one outside the horizon."""
    if isinstance(end, End) and not isinstance(end, Sphere):
        return end
    radius = real_number("end", end.radius if isinstance(end, Sphere) else end)
    if math.isnan(radius):
        raise ValueError(f"Argument `end` must be a radius, math.inf or an EquatorialPlane, but is {quoted(end)}.")
    horizon = kerr.horizon(camera.spin)
    if not radius > horizon:
        given, least = apart(radius, horizon)
        raise ValueError(f"Argument `end` must be larger than the horizon radius {least}, but is {given}.")
    if isinstance(end, Sphere):
        return end
    return SKY if math.isinf(radius) else Sphere(radius)


def _must_be(name: str, shape: str, places: Any, one: bool) -> str:
    """The message for places of another shape."""
    if one:
        return f"Argument `{name}` must be {shape}, but is {quoted(places)}."
    return f"Argument `{name}` must be an array of finite numbers {shape}."


def _known(frame: Frame, photon: Photon, quartic: radial.Quartic) -> tuple[Reals, Flags]:
    """The conditioning of a ray, and whether its fate is certain."""
    return radial.conditioning(frame, photon), radial.capture_is_certain(frame, photon, quartic)
