"""A sky that turns about the spin axis, as a camera sees it that orbits the hole."""

from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.render import Sky

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class TurnedSky:
    """A sky turned about the spin axis by some angles (radians, toward larger phi'): their mean is seen, motion blur."""

    sky: Sky
    angles: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse no angles, and those that are not finite."""
        if not self.angles or not np.isfinite(self.angles).all():
            raise ValueError(f"Argument `angles` must be one finite number or more, but is {self.angles!r}.")

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Array:
        """Linear sRGB light (n, 3) of pixels."""
        # The beams are turned back instead: their ellipses, along e_theta' and e_phi', turn with them.
        lights = (
            self.sky.light(replace(footprint, direction=_turned(footprint.direction, -angle)), beaming, colour_shift)
            for angle in self.angles
        )
        return sum(lights, np.zeros((len(footprint), 3))) / len(self.angles)


def _turned(direction: Array, angle: float) -> Array:
    x, y, z = np.moveaxis(direction, -1, 0)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)
