"""The base class of all skies, and the check of the light that they return."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.scene_checks import checked_source_light
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import quoted

if TYPE_CHECKING:
    from kerrcaustics.scenes.points import PointLights

Array = np.ndarray


class Sky(ABC):
    """A celestial sphere that can be seen: the base class of every sky.

    A subclass has a method `light`; the attributes are optional.

    Attributes
    ----------
    points : PointLights or None
        Points of light on it, which are drawn at their images.
    sweep : float
        Angle (radians) by which it turns about the spin axis during the exposure, half of it on either side.
    smooth : bool
        True if its light changes so little with the direction that only its points need motion blur.

    Raises
    ------
    ValueError
        When the picture is made, if `light` returns anything else.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> class Grey(kc.skies.Sky):
    ...     def light(self, footprint, beaming, colour_shift):
    ...         return np.full((len(footprint), 3), 0.5)
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> kc.render(camera, kc.pictures.View.toward_hole(camera, 32, 18, 1.0), Grey()).light.shape
    (18, 32, 3)
    """

    points: "PointLights | None" = None
    sweep: float = 0.0
    smooth: bool = False

    @abstractmethod
    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) that n pixels receive from the sky without its points.

        Parameters
        ----------
        footprint : Footprint
            The parts of the sky that the pixels see: the light is its mean over each of them.
        beaming : bool
            Multiply the intensity by the fourth power of `footprint.redshift`.
        colour_shift : bool
            Shift spectra by `footprint.redshift`.

        Returns
        -------
        (n, 3) array
            Intensity in any unit, finite and not negative. The picture, and the flux of points per steradian, have the
            same unit.
        """


class Shifts(NamedTuple):
    """Shifts of light by nu_camera / nu_source.

    beaming: True for a shift of its intensity.
    colour_shift: True for a shift of its colours.
    """

    beaming: bool
    colour_shift: bool


UNSHIFTED = Shifts(False, False)
"""Light as its source sends it out."""


def check_sky(sky: Any, *, needed: bool = False) -> None:
    """Raise ValueError unless an object is a sky, or None and not needed."""
    if (needed or sky is not None) and not isinstance(sky, Sky):
        raise ValueError(f"Argument `sky` must be a `kerrcaustics.skies.Sky`, but is {quoted(sky)}.")


def light_of_sky(sky: Sky, footprint: Footprint, shifts: Shifts) -> Float[Array, "pixels 3"]:
    """The light (n, 3) of a sky without its points; ValueError if its method `light` returns no light."""
    return checked_source_light("sky", sky, sky.light(footprint, *shifts), len(footprint))
