"""The equatorial plane as the end of rays, at a crossing of each."""

import math
from typing import Any, ClassVar

import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.emitters import EMITTERS, Emitter, Light
from kerrcaustics.beams.surface import TURN, Coordinate, End, shape_error
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.arrays import Reals
from kerrcaustics.spacetime.checks import differing_digits, numbers, one_of, quoted, real_number, whole_number
from kerrcaustics.spacetime.viewer import Viewer

# Least radius of a map of the plane, in horizon radii.
_LOWEST = 1.05
# Largest radius of the map, in radii of the camera.
_HIGHEST = 2.0
# Largest radius of the map wherever the camera is, in M.
_FROM_AFAR = 100.0
MOST_CROSSINGS = 1_000_000
"""Largest number of a crossing."""


@result("equatorial-plane/1", eq=True)
class EquatorialPlane(End):
    """The n-th place where a ray, followed backward from the camera, crosses the equatorial plane.

    Parameters
    ----------
    crossing : int
        Number of the crossing, from 1. The start of a ray is none, also for a camera in the plane.
    emitter : str
        Motion of the sources, for the redshift: "circular" (prograde circular geodesic), "retrograde" (the other
        sense), "static" (at rest in Boyer-Lindquist coordinates), "fiducial" (at rest with respect to the FIDO),
        "plunging" (circular down to the ISCO, and from there falling with its energy and angular momentum),
        "retrograde-plunging" (the same in the other sense).

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
    kernel: ClassVar[str] = "plane"
    in_plane: ClassVar[bool] = True
    coordinates: ClassVar[tuple[Coordinate, Coordinate]] = (
        Coordinate("radius", "r", "GM/c^2"),
        Coordinate("phi", "phi", "rad", TURN),
    )

    def __post_init__(self) -> None:
        """Raise ValueError unless there are such a crossing and such an emitter."""
        object.__setattr__(self, "crossing", whole_number("crossing", self.crossing, 1, MOST_CROSSINGS))
        one_of("emitter", self.emitter, EMITTERS)

    def numbers(self) -> tuple[int]:
        """The crossing alone: rays do not depend on the emitter."""
        return (self.crossing,)

    def emitter_motion(self) -> Emitter:
        """The motion of its emitter."""
        return EMITTERS[self.emitter]

    def normal_momentum(self, spin: float, light: Light, place: tuple[Reals, Reals]) -> Reals:
        """|p_theta| / r."""
        return np.sqrt(np.maximum(light[1], 0)) / place[0]

    def in_words(self) -> str:
        """The crossing with its number."""
        return f"crossing {self.crossing} of the equatorial plane"

    def bare(self) -> "EquatorialPlane":
        """The crossing with the default emitter."""
        return EquatorialPlane(self.crossing)

    def checked(self, name: str, places: Any, viewer: Viewer, *, one: bool = False) -> np.ndarray:
        """Places (n, 2) = (r, phi) in the plane, or one (2,)."""
        values = numbers(name, places)
        if values.ndim != 2 - one or values.shape[-1:] != (2,) or not np.isfinite(values).all():
            shape = "two finite numbers (r, phi), phi in radians" if one else "of shape (n, 2): r, phi"
            raise shape_error(name, shape, places, one)
        horizon, least = kerr.horizon(viewer.spin), values[..., 0].min(initial=math.inf)
        if not least > horizon:
            radius, limit = differing_digits(float(least), horizon)
            raise ValueError(f"Argument `{name}` must have an r larger than the horizon's {limit}, but is {radius}.")
        return values

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
        """Places as (r cos phi, r sin phi)."""
        radius, phi = places.T
        return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=-1)

    def tangents(self, places: np.ndarray) -> np.ndarray:
        """Changes of them with r and with phi."""
        radius, phi = places.T
        c, s = np.cos(phi), np.sin(phi)
        return np.stack([np.stack([c, s], axis=-1), np.stack([-radius * s, radius * c], axis=-1)], axis=-1)

    def ends(self, rays: Rays) -> np.ndarray:
        """The ends of rays as (r cos phi, r sin phi)."""
        return rays.direction[..., :2] * rays.radius[..., None]

    def displacement(self, rays: Rays, vectors: np.ndarray) -> np.ndarray:
        """Displacements (dr, r dphi)."""
        radius = rays.radius
        turn = (np.arctan2(vectors[:, 1], vectors[:, 0]) - rays.azimuth + math.pi) % TURN - math.pi
        return np.stack([np.linalg.norm(vectors, axis=-1) - radius, radius * turn], axis=-1)

    def scale(self, rays: Rays) -> np.ndarray:
        """The radius: errors are relative to it."""
        return rays.radius

    def is_beyond(self, camera: Viewer) -> bool:
        """False: rays that escape may meet the plane never, or more than once."""
        return False
