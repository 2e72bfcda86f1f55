"""Where rays may end: the celestial sphere, a sphere of finite radius, a crossing of the equatorial plane.

An end is a surface around the hole with something that shines on it (emitters.py). What is special about one is told by
the methods of its class, here and nowhere else; `End` has what holds for most. A new end is one more class.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.emitters import EMITTERS, Emitter, static
from kerrcaustics.beams.integrator.equations import Constants, radial_pull
from kerrcaustics.beams.integrator.nystroem import Path
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.camera import Camera, Frame, Photon
from kerrcaustics.spacetime.checks import apart, one_of, quoted, real_number, whole_number
from kerrcaustics.spacetime.polar import mino_time_to_plane

# Round-off of the radius of an end, relative, as it enters the distance from a turning point.
_OF_RADIUS = 4e-16

Row = tuple[Reals, ...]
Jacobian = tuple[Row, ...]


class Aim(NamedTuple):
    """Where a ray is going, by roots and elliptic integrals alone.

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
    """How a ray arrives: u = 1 / r, the sizes of u' and psi', and the radians of arc in a unit of Mino time."""

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

    finite, whether it lies at a finite radius; coordinate, which of (u, x, y, z) is constant on it.
    """

    finite: ClassVar[bool] = True
    coordinate: ClassVar[int] = 0

    def source(self) -> Emitter | None:
        """What shines there; None for a source at rest at infinity."""
        return None

    def is_beyond(self, camera: Camera) -> bool:
        """Whether rays that escape outward without a turning point meet it once, on their way out."""
        raise NotImplementedError

    def aim(self, frame: Frame, light: Photon, quartic: radial.Quartic) -> Aim:
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

    def orientation(self, light: Photon, u_rate: Reals) -> Reals:
        """The sign that det J has for rays that passed no conjugate point."""
        return jnp.where(u_rate < 0, 1.0, -1.0)

    def jacobian(self, angles: Jacobian, radius: Reals, in_radius: Row) -> Jacobian:
        """The Jacobian in the surface from that of the angles (theta', phi') and of the radius."""
        return angles

    def spread(self, size: Reals, radius: Reals) -> Reals:
        """The size of that Jacobian in radians, or in ln r."""
        return size

    def motion(self, at: Arriving) -> Reals:
        """How fast the end moves in the surface if the ray arrives later, per radian of arc."""
        return 1 + at.turning

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """How far a ray is displaced in the surface that is displaced by `growth` in u, in its path."""
        return growth * (1 + at.turning) / at.rate

    def delayed(self, delay: Reals, at: Arriving) -> Reals:
        """How far a ray is displaced in the surface that is late, by so many radians of arc, in radius alone."""
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
        """How far a ray is displaced in the surface whose height over the plane is off by a radian, by its time."""
        return 0.0

    def lever(self, at: Arriving, depth: Reals) -> Reals:
        """The time by which an end is late, at most, that is displaced by a radian."""
        return at.speed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class CelestialSphere(End):
    """Infinity, where u = 0 exactly."""

    finite: ClassVar[bool] = False
    radius: ClassVar[float] = math.inf

    def is_beyond(self, camera: Camera) -> bool:
        """Always."""
        return True

    def aim(self, frame: Frame, light: Photon, quartic: radial.Quartic) -> Aim:
        """Rays reach it that are not captured."""
        captured = radial.is_captured(frame, light, quartic)
        time = jnp.where(captured, 0.0, radial.mino_time(frame, light, quartic))
        return Aim(captured, captured, time, *_known(frame, light, quartic))

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """The path is straight there."""
        return -path.position[0] / path.rate[0]

    def radius_at(self, u: Reals) -> float:
        """Infinite."""
        return math.inf

    def orientation(self, light: Photon, u_rate: Reals) -> float:
        """Rays leave outward."""
        return 1.0

    def motion(self, at: Arriving) -> float:
        """The end stands still: all motion there is outward."""
        return 0.0

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """As much as in u."""
        return growth


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Sphere(End):
    """The first arrival at a radius; returning: the second one, within the camera's radius. What shines is static."""

    radius: Any
    returning: Any = False

    def source(self) -> Emitter:
        """At rest."""
        return static

    def is_beyond(self, camera: Camera) -> bool:
        """Where its radius is larger than the camera's."""
        return self.radius > camera.radius

    def aim(self, frame: Frame, light: Photon, quartic: radial.Quartic) -> Aim:
        """A turning point stops a ray only where it comes before the sphere."""
        captured = radial.is_captured(frame, light, quartic)
        inward = light.rate[0] > 0
        rising = (self.radius > frame.radius) | ((self.radius == frame.radius) & inward) | self.returning
        # Where this is negative the sphere lies between the outer roots.
        square = radial.outer_square(quartic, radial.outer_start(frame, light, quartic), self.radius)
        side = self.radius - 1 - quartic.lift
        above = ~captured | (~inward & (side <= 0) & (square >= 0))
        turned = inward & (side >= 0) & (square >= 0)
        reached = jnp.where(rising, above & (~jnp.asarray(self.returning) | turned), captured | turned)
        lost = ~reached | (light.energy_ratio <= 0)
        time = radial.mino_time_to(frame, light, quartic, self.radius, rising)
        conditioning, certain = _known(frame, light, quartic)
        # Of the radius too, which may be that of the turning point.
        doubt = radial.arrival_doubt(frame, light, quartic, self.radius) + _OF_RADIUS * self.radius * jnp.abs(side)
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
@dataclass(frozen=True)
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
        Where an argument cannot be; the message names it, and what it must be.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> rays = kc.trace_rays(camera, [[-0.6, 0.5, 0.4]], end=kc.EquatorialPlane(1))
    >>> rays.radius.shape
    (1,)
    """

    crossing: int = 1
    emitter: str = "circular"
    coordinate: ClassVar[int] = 3

    def __post_init__(self) -> None:
        """Refuse what is no crossing or no emitter."""
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

    def source(self) -> Emitter:
        """Its emitter."""
        return EMITTERS[self.emitter]

    def is_beyond(self, camera: Camera) -> bool:
        """Never."""
        return False

    def aim(self, frame: Frame, light: Photon, quartic: radial.Quartic) -> Aim:
        """Rays reach it before they reach the horizon, or infinity."""
        captured = radial.is_captured(frame, light, quartic)
        horizon = radial.horizon(frame.spin)
        to_horizon = radial.mino_time_to(frame, light, quartic, horizon, jnp.zeros_like(captured))
        time = mino_time_to_plane(frame, light, self.crossing)
        most = jnp.where(captured, to_horizon, radial.mino_time(frame, light, quartic))
        lost = ~(time < most) | (light.energy_ratio <= 0)
        plane_rate = jnp.sqrt(jnp.maximum(light.q, 0))
        conditioning, certain = _known(frame, light, quartic)
        certain = certain & (jnp.abs(time - most) > radial.time_doubt(frame, light, quartic) * most)
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

    def orientation(self, light: Photon, u_rate: Reals) -> Reals:
        """Above the plane first, a ray meets it from above for the odd crossings."""
        above = jnp.where(light.position[3] == 0, light.rate[3], light.position[3]) > 0
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


Wherever = float | EquatorialPlane


def end_of(camera: Camera, end: object) -> End:
    """The end that `end=` means: math.inf, a radius, or an end itself; what is none is refused with one ValueError."""
    if isinstance(end, End):
        return end
    radius = real_number("end", end)
    if math.isnan(radius):
        raise ValueError(f"Argument `end` must be a radius, math.inf or an EquatorialPlane, but is {quoted(end)}.")
    horizon = kerr.horizon(camera.spin)
    if not radius > horizon:
        given, least = apart(radius, horizon)
        raise ValueError(f"Argument `end` must be larger than the horizon radius {least}, but is {given}.")
    return SKY if math.isinf(radius) else Sphere(radius)


def _known(frame: Frame, light: Photon, quartic: radial.Quartic) -> tuple[Reals, Flags]:
    """The conditioning of a ray, and whether its fate is certain."""
    return radial.conditioning(frame, light), radial.capture_is_certain(frame, light, quartic)
