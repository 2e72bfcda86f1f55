"""The base of all surfaces on which rays end, and the description of a ray on its way to one.

An end is a surface around the hole with something that shines on it (emitters.py). The methods of its class, here and
nowhere else, define it; `End` has the common ones. A new end is one more class. Engines use the methods that take
photons and paths, all other code those that take places on the surface.
"""

import math
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.emitters import Emitter, Light, radial_momentum
from kerrcaustics.beams.integrator.equations import Constants
from kerrcaustics.beams.integrator.nystroem import Path
from kerrcaustics.results.declared import Shown
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.checks import if_degrees, numbers, quoted, real_number
from kerrcaustics.spacetime.frame import Frame, Photon
from kerrcaustics.spacetime.sphere import flattened, from_angles, polar_angle, polar_basis
from kerrcaustics.spacetime.viewer import Viewer

Row = tuple[Reals, ...]
Jacobian = tuple[Row, ...]
Columns = list[Any]

TURN = 2 * math.pi


class Coordinate(NamedTuple):
    """A coordinate of places on a surface; period: infinite if it has none."""

    name: str
    symbol: str
    unit: str
    period: float = math.inf


class Aim(NamedTuple):
    """The aim of a ray, by roots and elliptic integrals alone.

    captured: followed on, it falls in; lost: it does not reach its end; mino_time to the end, 0 if lost; rising: it
    arrives with growing radius (for spheres); plane_rate, |z'| in the equatorial plane (if that is the end);
    conditioning, the factor by which it magnifies round-off in N: deep in the field the energy at infinity is a small
    difference of large numbers; certain: double precision determines the first two.
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


class End(Shown):
    """A surface on which rays end, for compiled code too; the methods here are those of a sphere of finite radius.

    finite: it lies at a finite radius; axes: rows from whose third theta' and from whose first phi' is counted on
    spheres; coordinate: the index in (u, x, y, z) of the constant one; coordinates: those of places on it.
    """

    finite: ClassVar[bool] = True
    axes: ClassVar[np.ndarray] = np.eye(3)
    coordinate: ClassVar[int] = 0
    coordinates: ClassVar[tuple[Coordinate, Coordinate]] = (
        Coordinate("theta", "theta'", "rad"),
        Coordinate("phi", "phi'", "rad", TURN),
    )

    def emitter_motion(self) -> Emitter | None:
        """The motion of the sources there; None for sources at rest at infinity."""
        return None

    def normal_momentum(self, spin: float, light: Light, place: tuple[Reals, Reals]) -> Reals:
        """The momentum of photons of unit energy along the normal: all that move along the surface measure the same.

        Parameters: light, b and q; place, radius and cosine of theta.
        """
        radius, cosine = place
        sigma, delta = radius**2 + (spin * cosine) ** 2, kerr.horizon_product(spin, radius)
        return radial_momentum(spin, light, radius) * np.sqrt(delta / sigma)

    def bare(self) -> "End":
        """The surface without its sources: rays do not depend on them."""
        return self

    def by_ray(self) -> "tuple[Columns, Callable[[Columns], End]]":
        """Arrays (n,) that differ from ray to ray, and the surface with others of them; something of `Spheres`."""
        return [], lambda _: self

    def rows(self, chosen: Any) -> "End":
        """The surface of some of the rays, chosen as entries of arrays."""
        columns, with_columns = self.by_ray()
        return with_columns([column[chosen] for column in columns])

    def in_words(self) -> str:
        """The surface as named in texts."""
        raise NotImplementedError

    def arrivals(self) -> "tuple[End, ...]":
        """The surface, once for each arrival that a ray may have there."""
        return (self,)

    def at_second_arrival(self) -> "End":
        """The surface at the second arrival of rays."""
        raise ValueError(f"Argument `end` must be a sphere for a second arrival, but is {self!r}.")

    def checked(self, name: str, places: Any, viewer: Viewer, *, one: bool = False) -> np.ndarray:
        """Places (n, 2) on the surface, or one (2,), in the argument `name`; raise ValueError if they are invalid."""
        pairs = numbers(name, places)
        if pairs.shape != (2,) if one else (pairs.ndim != 2 or pairs.shape[-1] != 2 or not np.isfinite(pairs).all()):
            shape = "two numbers (theta', phi') in radians" if one else "of shape (n, 2): theta', phi' in radians"
            raise shape_error(name, shape, places, one)
        if not ((pairs[..., 0] >= 0) & (pairs[..., 0] <= math.pi) & np.isfinite(pairs[..., 1])).all():
            but = f" and a finite phi', but is {quoted(places)}" if one else ""
            end = if_degrees(pairs[..., 0].max(initial=0))
            raise ValueError(f"Argument `{name}` must have theta' in [0, pi] radians (0 to 180 degrees){but}{end}")
        self.check_apart(name, pairs.reshape(-1, 2), viewer)
        return pairs

    def checked_level(self, name: str, level: object, viewer: Viewer) -> float:
        """The first coordinate of a circle on the surface, which the user gave as the argument `name`."""
        number = real_number(name, level)
        if not 0 <= number <= math.pi:
            raise ValueError(
                f"Argument `{name}` must be a theta' in [0, pi] radians (0 to 180 degrees), but is {quoted(level)}"
                f"{if_degrees(level)}"
            )
        return number

    def levels(self, viewer: Viewer, rows: int) -> np.ndarray:
        """First coordinates of the rows of a map of the surface."""
        return (np.arange(rows) + 0.5) * math.pi / rows

    def check_apart(self, name: str, places: np.ndarray, viewer: Viewer) -> None:
        """Raise ValueError if a place (n, 2) is within rounding of the viewer's own, and so seen in no direction."""

    def vectors(self, places: np.ndarray) -> np.ndarray:
        """Places (n, 2) as vectors (n, axes) that are close where the places are."""
        return from_angles(places[:, 0], places[:, 1])

    def tangents(self, places: np.ndarray) -> np.ndarray:
        """Changes of the vectors of places (n, 2) with the first and with the second coordinate, (n, axes, 2)."""
        e_theta, e_phi = polar_basis(self.vectors(places))
        return np.stack([e_theta, np.sin(places[:, :1]) * e_phi], axis=-1)

    def angles(self, direction: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (theta', phi') of directions n', phi' unwrapped; azimuth: about the spin axis, unwrapped."""
        return polar_angle(direction), azimuth

    def ends(self, rays: Rays) -> np.ndarray:
        """The ends of rays as such vectors."""
        return rays.direction

    def displacement(self, rays: Rays, vectors: np.ndarray) -> np.ndarray:
        """Displacements (n, 2) from the ends of rays to places (n, axes), in the rows of the Jacobian."""
        return flattened(rays.direction, vectors - rays.direction)

    def scale(self, rays: Rays) -> np.ndarray | float:
        """The size of a unit of `Rays.error` in the rows of the Jacobian."""
        return 1.0

    def is_beyond(self, camera: Viewer) -> bool:
        """True if rays that escape outward without a turning point meet it once, on their way out."""
        raise NotImplementedError

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


def shape_error(name: str, shape: str, places: Any, one: bool) -> ValueError:
    """The error for places, or one place, of another shape."""
    must = f"{shape}, but is {quoted(places)}" if one else f"an array of finite numbers {shape}"
    return ValueError(f"Argument `{name}` must be {must}.")


def reliability(frame: Frame, photon: Photon, quartic: radial.Quartic) -> tuple[Reals, Flags]:
    """The conditioning of a ray, and True if rounding does not decide its fate."""
    return radial.conditioning(frame, photon), radial.capture_is_certain(frame, photon, quartic)
