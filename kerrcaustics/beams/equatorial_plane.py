"""The equatorial plane as the end of rays, at a crossing of each."""

import math
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.emitters import EMITTERS, Emitter, Light
from kerrcaustics.beams.integrator.equations import Constants
from kerrcaustics.beams.integrator.nystroem import Path
from kerrcaustics.beams.surface import TURN, Aim, Arriving, Coordinate, End, Jacobian, Row, reliability, shape_error
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.checks import apart, numbers, one_of, quoted, real_number, whole_number
from kerrcaustics.spacetime.frame import Frame, Photon
from kerrcaustics.spacetime.polar import mino_time_to_plane
from kerrcaustics.spacetime.viewer import Viewer

# Radii of a map of the plane: from so many horizon radii to so many camera radii, and the largest.
_LOWEST, _HIGHEST, _FROM_AFAR = 1.05, 2.0, 100.0
MOST_CROSSINGS = 1_000_000
"""Largest number of a crossing."""


@jax.tree_util.register_pytree_node_class
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
    coordinate: ClassVar[int] = 3
    coordinates: ClassVar[tuple[Coordinate, Coordinate]] = (
        Coordinate("radius", "r", "GM/c^2"),
        Coordinate("phi", "phi", "rad", TURN),
    )

    def __post_init__(self) -> None:
        """Raise ValueError unless there are such a crossing and such an emitter."""
        object.__setattr__(self, "crossing", whole_number("crossing", self.crossing, 1, MOST_CROSSINGS))
        one_of("emitter", self.emitter, EMITTERS)

    def tree_flatten(self) -> tuple[tuple[int], None]:
        """The crossing alone: rays do not depend on the emitter, and one program serves all."""
        return (self.crossing,), None

    @classmethod
    def tree_unflatten(cls, _: None, children: tuple[Any]) -> "EquatorialPlane":
        """The end in compiled code, where the crossing may be unknown."""
        plane = object.__new__(cls)
        object.__setattr__(plane, "crossing", children[0])
        return plane

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
            radius, limit = apart(float(least), horizon)
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
