"""The base of all surfaces on which rays end.

An end is a surface around the hole with something that shines on it (emitters.py). The methods of its class define it:
those here take places on the surface, those of its counterpart in traced_ends.py the photons and paths of the engines.
`End` has the common ones. A new end is one more class in both.
"""

import math
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.emitters import Emitter, Light, radial_momentum
from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.arrays import Reals
from kerrcaustics.spacetime.checks import if_degrees, numbers, quoted, real_number
from kerrcaustics.spacetime.sphere import flattened, from_angles, polar_angle, polar_basis
from kerrcaustics.spacetime.viewer import Viewer

Columns = list[Any]

TURN = 2 * math.pi


class Coordinate(NamedTuple):
    """A coordinate of places on a surface; period: infinite if it has none."""

    name: str
    symbol: str
    unit: str
    period: float = math.inf


class End(Shown):
    """A surface on which rays end; the methods here are those of a sphere of finite radius.

    kernel: its name in the names of kernels; finite: it lies at a finite radius; in_plane: it is the equatorial plane,
    and no sphere; axes: rows from whose third theta' and from whose first phi' is counted on spheres; coordinates:
    those of places on it.
    """

    kernel: ClassVar[str]
    finite: ClassVar[bool] = True
    in_plane: ClassVar[bool] = False
    axes: ClassVar[np.ndarray] = np.eye(3)
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

    def numbers(self) -> tuple[Any, ...]:
        """The numbers that rays depend on, as the counterpart in traced_ends.py has them."""
        return ()

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

    @property
    def has_second_arrivals(self) -> bool:
        """True if it stands for the second arrival of rays, or of some of them."""
        return False

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


def shape_error(name: str, shape: str, places: Any, one: bool) -> ValueError:
    """The error for places, or one place, of another shape."""
    must = f"{shape}, but is {quoted(places)}" if one else f"an array of finite numbers {shape}"
    return ValueError(f"Argument `{name}` must be {must}.")
