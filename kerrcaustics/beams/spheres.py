"""Spheres on which rays end: the celestial sphere, and spheres of finite radius."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from kerrcaustics.beams.emitters import Emitter, Light, static
from kerrcaustics.beams.surface import Columns, End
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime.arrays import Reals
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

# A source closer to the viewer than this part of its radius has no direction: rounding leaves a radian of it open.
_AT_VIEWER = 1e-14


@result("celestial-sphere/1", record="radius", eq=True)
class CelestialSphere(End):
    """The celestial sphere: infinity, where u = 0 exactly. Sources there are at rest.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.CelestialSphere().radius
    inf
    """

    kernel: ClassVar[str] = "sky"
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

    def normal_momentum(self, spin: float, light: Light, place: tuple[Reals, Reals]) -> Reals:
        """1: light comes straight inward."""
        return np.ones_like(place[1])


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

    kernel: ClassVar[str] = "sphere"
    radius: Any = quantity("", "GM/c^2", "Boyer-Lindquist radius", json="source_radius", column="source_radius")
    second_arrival: Any = quantity("", "1", "True for the second arrival", default=False)

    def emitter_motion(self) -> Emitter:
        """The motion of sources at rest."""
        return static

    def in_words(self) -> str:
        """The sphere with its radius."""
        return f"the sphere r = {float(self.radius):.12g}"

    def numbers(self) -> tuple[Any, ...]:
        """The radius, and whether the arrival is the second one."""
        return self.radius, self.second_arrival

    def arrivals(self) -> "tuple[Sphere, ...]":
        """The first and the second arrival."""
        return self, self.at_second_arrival()

    @property
    def has_second_arrivals(self) -> bool:
        """True if it stands for the second arrival of rays, or of some of them."""
        return bool(np.any(self.second_arrival))

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
                f"Argument `{name}` must keep the star away from the camera, but at r = {float(self.radius):.12g} both "
                "coincide within rounding: it has no direction."
            )

    def is_beyond(self, camera: Viewer) -> bool:
        """True if its radius is larger than the camera's."""
        return self.radius > camera.radius


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
