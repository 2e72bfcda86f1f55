"""A sky that turns about the spin axis, as a camera sees it that orbits the hole."""

from dataclasses import dataclass, field

import numpy as np

from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.points import PointLights
from kerrcaustics.scenes.scene_checks import check_number
from kerrcaustics.scenes.sky import Sky, check_sky
from kerrcaustics.shapes import Float

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class TurnedSky(Sky):
    """A sky turned about the spin axis by an angle (radians, toward larger phi').

    Parameters
    ----------
    sky : Sky
    angle : float
        Radians, toward larger phi'.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.skies.TurnedSky(kc.skies.Checkerboard(), angle=0.1).angle
    0.1
    """

    sky: Sky
    angle: float
    sweep: float = field(init=False)
    smooth: bool = field(init=False)

    def __post_init__(self) -> None:
        """Raise ValueError unless the sky is valid and the angle finite."""
        check_sky(self.sky, needed=True)
        check_number("angle", self.angle, "be a finite number")
        object.__setattr__(self, "sweep", self.sky.sweep)
        object.__setattr__(self, "smooth", self.sky.smooth)

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels."""
        # The beams are turned back instead.
        return self.sky.light(footprint.turned_by(-self.angle), beaming, colour_shift)

    @property
    def points(self) -> PointLights | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The points of light of the sky, turned."""
        points = self.sky.points
        return None if points is None else points.some(np.arange(len(points.direction)), self.angle)
