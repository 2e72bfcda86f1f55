"""Spheres on which rays end: the celestial sphere, and spheres of finite radius."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.emitters import Emitter, Light, static
from kerrcaustics.beams.integrator.equations import Constants, radial_pull
from kerrcaustics.beams.integrator.nystroem import Path
from kerrcaustics.beams.surface import Aim, Arriving, Columns, End, reliability
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Reals
from kerrcaustics.spacetime.frame import Frame, Photon
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

# A source closer to the viewer than this part of its radius has no direction: rounding leaves a radian of it open.
_AT_VIEWER = 1e-14
# Round-off of the radius of an end, relative, as it enters the distance from a turning point.
_OF_RADIUS = 4e-16


@jax.tree_util.register_dataclass
@result("celestial-sphere/1", record="radius", eq=True)
class CelestialSphere(End):
    """The celestial sphere: infinity, where u = 0 exactly. Sources there are at rest.

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
        """The name of the celestial sphere."""
        return "the celestial sphere"

    def is_beyond(self, camera: Viewer) -> bool:
        """True: the celestial sphere is beyond all viewers."""
        return True

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

    def normal_momentum(self, spin: float, light: Light, place: tuple[Reals, Reals]) -> Reals:
        """1: light comes straight inward."""
        return np.ones_like(place[1])

    def motion(self, at: Arriving) -> float:
        """0: all motion there is outward."""
        return 0.0

    def opened(self, growth: Reals, at: Arriving) -> Reals:
        """The displacement in u."""
        return growth


@jax.tree_util.register_dataclass
@result("sphere/1", record="radius", eq=True)
class Sphere(End):
    """A sphere around the hole: places where rays, followed backward, first arrive at a radius. Its sources are static.

    Parameters
    ----------
    radius : float
        Boyer-Lindquist radius, outside the horizon.
    second_arrival : bool
        True for the second arrival of rays that meet a sphere within the viewer's radius twice.

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
        """The motion of sources at rest."""
        return static

    def in_words(self) -> str:
        """The sphere with its radius."""
        return f"the sphere r = {float(self.radius):.12g}"

    def arrivals(self) -> "tuple[Sphere, ...]":
        """The first and the second arrival."""
        return self, self.at_second_arrival()

    def at_second_arrival(self) -> "Sphere":
        """The sphere at the second arrival."""
        return Sphere(self.radius, second_arrival=True)

    def check_apart(self, name: str, places: np.ndarray, viewer: Viewer) -> None:
        """Raise ValueError if a place (n, 2) is within rounding of the viewer's own."""
        if math.isinf(viewer.radius):
            return
        own = from_angles(viewer.inclination, 0.0)
        aside = np.linalg.norm(self.vectors(places) - own, axis=1)
        if (np.hypot(self.radius / viewer.radius - 1, aside) < _AT_VIEWER).any():
            raise ValueError(
                f"Argument `{name}` must keep the star away from the camera, but at r = {float(self.radius):.12g}, "
                f"theta = {viewer.inclination:.12g}, phi = 0 both coincide within rounding: it has no direction."
            )

    def is_beyond(self, camera: Viewer) -> bool:
        """True if its radius is larger than the camera's."""
        return self.radius > camera.radius

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
@dataclass(frozen=True, eq=False)
class Spheres(Sphere):
    """A sphere for each ray: radius and second_arrival are arrays (n,)."""

    def by_ray(self) -> tuple[Columns, Callable[[Columns], End]]:
        """The radii, and which arrivals are the second."""
        return [self.radius, self.second_arrival], lambda columns: Spheres(*columns)

    def is_beyond(self, camera: Viewer) -> bool:
        """True if all of them are."""
        return bool(np.all(self.radius > camera.radius))


Spherical = CelestialSphere | Sphere
SKY = CelestialSphere()
