"""Ends of rays as the engines trace them: the methods that take photons and paths, on JAX arrays.

Each surface of `ends.py` has its counterpart here, which holds its numbers alone. A new end is one more class in both.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp

from kerrcaustics.beams.integrator.equations import radial_pull
from kerrcaustics.beams.ray_state import Aim, Arriving, Constants, Jacobian, Path, Row
from kerrcaustics.beams.surface import End
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon
from kerrcaustics.spacetime.polar import mino_time_to_plane

# Round-off of the radius of an end, relative, as it enters the distance from a turning point.
_OF_RADIUS = 4e-16


class TracedEnd:
    """A surface on which rays end; the methods here are those of a sphere of finite radius.

    finite: it lies at a finite radius; coordinate: the index in (u, x, y, z) of the constant one.
    """

    finite: ClassVar[bool] = True
    coordinate: ClassVar[int] = 0

    @property
    def in_plane(self) -> bool:
        """True for the equatorial plane, on which no radius is constant."""
        return self.coordinate != 0

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """The aim of rays at the surface. Rays with no positive energy at infinity are not followed."""
        raise NotImplementedError

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """Mino time from a point close to the surface to it, from the path itself."""
        raise NotImplementedError

    def lost(self, aim: Aim, spin: Reals, u: Reals) -> Flags:
        """True for rays that do not reach it, from u = 1 / r there."""
        return aim.lost

    def radius_at(self, u: Reals) -> Reals:
        """Radius of the end of a ray."""
        raise NotImplementedError

    def direction(self, n: Components) -> Components:
        """The direction of the end, put back on the surface after round-off."""
        return n

    def crossings(self, counted: Reals) -> Reals:
        """Crossings of the equatorial plane, from those counted on the way."""
        return counted

    def is_across(self, either: Flags) -> Flags:
        """True for rays that may end on either side of the equatorial plane; either: their errors allow it."""
        return either

    def orientation(self, photon: Photon, u_rate: Reals) -> Reals:
        """The sign of det J for rays that passed no conjugate point."""
        return jnp.where(u_rate < 0, 1.0, -1.0)

    def jacobian(self, angles: Jacobian, radius: Reals, in_radius: Row) -> Jacobian:
        """The Jacobian in the surface from that of the angles (theta', phi') and of the radius."""
        return angles

    def spread(self, size: Reals, radius: Reals) -> Reals:
        """The size of that Jacobian in radians, or in ln r."""
        return size

    def motion(self, at: Arriving) -> Reals:
        """The speed of the end in the surface as the ray arrives later, per radian of arc."""
        return 1 + at.turning

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """The displacement in the surface of a ray that is displaced by `growth` in u, in its path."""
        return growth * (1 + at.turning) / at.rate

    def delayed(self, delay: Reals, at: Arriving) -> Reals:
        """The displacement in the surface of a ray that is late by `delay` radians of arc, in radius alone."""
        return delay * (1 + at.turning)

    def unsettled(self, constants: Constants, at: Arriving) -> tuple[Reals, Reals]:
        """The uncertainty by rounding of the integrator's arrival in Mino time; the relative rate of change of u'."""
        return 0.0, 0.0

    def least_growth(self, at: Arriving) -> Reals:
        """The least growth of errors made on the way."""
        return 1.0

    def lateness(self, height: Reals, aim: Aim, at: Arriving) -> Reals:
        """The delay of a ray that starts at a height over the equatorial plane, by an error of its inclination."""
        return 0.0

    def weighed(self, m: Row, aim: Aim, speed: Reals) -> Row:
        """A change of m as it displaces the end: a component that fixes the arrival acts through the time."""
        return m

    def slip(self, aim: Aim, at: Arriving) -> Reals:
        """The displacement in the surface, by its time, of a ray whose height over the plane is off by a radian."""
        return 0.0

    def lever(self, at: Arriving, depth: Reals) -> Reals:
        """The largest delay of an end that is displaced by a radian."""
        return at.speed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TracedSky(TracedEnd):
    """The celestial sphere, where u = 0 exactly."""

    finite: ClassVar[bool] = False
    radius: ClassVar[float] = math.inf

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """The aim of rays: all that are not captured reach it."""
        captured = radial.is_captured(frame, photon, quartic)
        time = jnp.where(captured, 0.0, radial.mino_time(frame, photon, quartic))
        return Aim(captured, captured, time, *reliability(frame, photon, quartic))

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """Mino time to infinity along the path, which is straight there."""
        return -path.position[0] / path.rate[0]

    def radius_at(self, u: Reals) -> float:
        """Infinite."""
        return math.inf

    def orientation(self, photon: Photon, u_rate: Reals) -> float:
        """1: rays arrive outward."""
        return 1.0

    def motion(self, at: Arriving) -> float:
        """0: all motion there is outward."""
        return 0.0

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """The displacement in u."""
        return growth


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TracedSphere(TracedEnd):
    """A sphere, at the first or at the second arrival of rays."""

    radius: Any
    second_arrival: Any = False

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """The aim of rays: a turning point stops a ray only if it comes before the sphere."""
        captured = radial.is_captured(frame, photon, quartic)
        inward = photon.rate[0] > 0
        rising = (self.radius > frame.radius) | ((self.radius == frame.radius) & inward) | self.second_arrival
        # Negative if the sphere lies between the outer roots.
        square = radial.outer_square(quartic, radial.outer_start(frame, photon, quartic), self.radius)
        side = self.radius - 1 - quartic.lift
        above = ~captured | (~inward & (side <= 0) & (square >= 0))
        turned = inward & (side >= 0) & (square >= 0)
        reached = jnp.where(rising, above & (~jnp.asarray(self.second_arrival) | turned), captured | turned)
        lost = ~reached | (photon.energy_ratio <= 0)
        time = radial.mino_time_to(frame, photon, quartic, self.radius, rising)
        conditioning, certain = reliability(frame, photon, quartic)
        # Of the radius too, which may be that of the turning point.
        doubt = radial.arrival_doubt(frame, photon, quartic, self.radius) + _OF_RADIUS * self.radius * jnp.abs(side)
        certain = certain & (jnp.abs(square) > doubt)
        return Aim(captured, lost, jnp.where(lost, 0.0, time), conditioning, certain, rising=rising)

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """Mino time by the parabola through u and the known sign of u' at the end: close to a turning point too."""
        u, w = path.position[0], path.rate[0]
        pull = radial_pull(constants, u)
        gap = 1 / self.radius - u
        sense = jnp.where(aim.rising, -1.0, 1.0)
        final = sense * jnp.sqrt(jnp.maximum(w * w + 2 * pull * gap, 0))
        agrees = sense * w > 0
        return jnp.where(agrees, 2 * gap / jnp.where(agrees, w + final, 1), (final - w) / jnp.where(pull == 0, 1, pull))

    def unsettled(self, constants: Constants, at: Arriving) -> tuple[Reals, Reals]:
        """Rounding of u over its rate; of a ray that only grazes the sphere, by the parabola through u."""
        pull = jnp.abs(radial_pull(constants, at.u))
        rounding = _OF_RADIUS * at.u
        rate = jnp.maximum(jnp.maximum(at.rate, jnp.sqrt(rounding * pull)), 1e-300)
        return rounding / rate, pull / rate

    def radius_at(self, u: Reals) -> Reals:
        """The radius of the sphere."""
        return self.radius + jnp.zeros_like(u)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TracedPlane(TracedEnd):
    """The equatorial plane, at a crossing of each ray."""

    crossing: Any
    coordinate: ClassVar[int] = 3

    def aim(self, frame: Frame, photon: Photon, quartic: radial.Quartic) -> Aim:
        """The aim of rays: they reach it before the horizon or infinity, or not at all."""
        captured = radial.is_captured(frame, photon, quartic)
        horizon = radial.horizon(frame.spin)
        to_horizon = radial.mino_time_to(frame, photon, quartic, horizon, jnp.zeros_like(captured))
        time = mino_time_to_plane(frame, photon, self.crossing)
        most = jnp.where(captured, to_horizon, radial.mino_time(frame, photon, quartic))
        lost = ~(time < most) | (photon.energy_ratio <= 0)
        plane_rate = jnp.sqrt(jnp.maximum(photon.q, 0))
        conditioning, certain = reliability(frame, photon, quartic)
        certain = certain & (jnp.abs(time - most) > radial.time_doubt(frame, photon, quartic) * most)
        return Aim(captured, lost, jnp.where(lost, 0.0, time), conditioning, certain, plane_rate=plane_rate)

    def time_left(self, constants: Constants, aim: Aim, path: Path) -> Reals:
        """Mino time along the path, which is straight there: z'' vanishes in the plane."""
        return -path.position[3] / path.rate[3]

    def lost(self, aim: Aim, spin: Reals, u: Reals) -> Flags:
        """True for rays that do not reach it, or only at the horizon or at infinity within rounding."""
        return aim.lost | (u <= 0) | (u * radial.horizon(spin) >= 1)

    def radius_at(self, u: Reals) -> Reals:
        """The radius of the ray."""
        return 1 / u

    def direction(self, n: Components) -> Components:
        """The direction with the height set to 0."""
        return n[0], n[1], jnp.zeros_like(n[2])

    def crossings(self, counted: Reals) -> Reals:
        """The number of the crossing at the end, on whichever side of it round-off has left z."""
        return jnp.full_like(counted, self.crossing)

    def is_across(self, either: Flags) -> Flags:
        """False: the end is a crossing itself."""
        return jnp.zeros_like(either)

    def orientation(self, photon: Photon, u_rate: Reals) -> Reals:
        """The sign of det J: a ray that starts above the plane meets it from above at odd crossings."""
        above = jnp.where(photon.position[3] == 0, photon.rate[3], photon.position[3]) > 0
        return jnp.where(above == (jnp.mod(self.crossing, 2) == 1), -1.0, 1.0)

    def jacobian(self, angles: Jacobian, radius: Reals, in_radius: Row) -> Jacobian:
        """The Jacobian with rows (dr, r dphi)."""
        return in_radius, tuple(radius * entry for entry in angles[1])

    def spread(self, size: Reals, radius: Reals) -> Reals:
        """The size relative to the radius."""
        return size / radius

    def motion(self, at: Arriving) -> Reals:
        """The speed of the end, in ln r too."""
        return 1 + at.turning + at.rate / at.u / at.speed

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """The displacement in ln r, with the change of psi that follows."""
        return growth * (1 / at.u + at.psi_rate) / at.speed

    def delayed(self, delay: Reals, at: Arriving) -> Reals:
        """The displacement by the delay in ln r."""
        return self.opened(delay * at.rate, at)

    def least_growth(self, at: Arriving) -> Reals:
        """The motion of the end: an error of the time moves it."""
        return self.motion(at)

    def lateness(self, height: Reals, aim: Aim, at: Arriving) -> Reals:
        """The delay z0 dz0' / z'^2 of a ray that leaves off the plane at a small inclination."""
        return jnp.abs(height) * (at.speed / aim.plane_rate) ** 2

    def weighed(self, m: Row, aim: Aim, speed: Reals) -> Row:
        """A change of m with the height, which fixes the arrival, weighed by its effect on the time."""
        x, y, z = m
        return x, y, jnp.maximum(speed / aim.plane_rate, 1) * z

    def slip(self, aim: Aim, at: Arriving) -> Reals:
        """The displacement by an error of the height, which fixes the arrival."""
        return self.motion(at) * at.speed / aim.plane_rate

    def lever(self, at: Arriving, depth: Reals) -> Reals:
        """The largest delay, with the time in which the radius changes."""
        return at.speed + depth


Spherical = TracedSky | TracedSphere
PLACES: dict[str, type[TracedEnd]] = {"sky": TracedSky, "sphere": TracedSphere, "plane": TracedPlane}
"""Ends by the names that `End.kernel` has."""


def traced_end(end: End) -> TracedEnd:
    """The counterpart of a surface."""
    return PLACES[end.kernel](*end.numbers())


def reliability(frame: Frame, photon: Photon, quartic: radial.Quartic) -> tuple[Reals, Flags]:
    """The conditioning of a ray, and True if rounding does not decide its fate."""
    return radial.conditioning(frame, photon), radial.capture_is_certain(frame, photon, quartic)
