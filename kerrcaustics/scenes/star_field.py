"""A sky of point stars with a galactic band, and a picture of nebulae."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from kerrcaustics.results.shown import Shown
from kerrcaustics.scenes.catalogue import StarCatalogue, galactic_axes, hipparcos, tilted_galaxy
from kerrcaustics.scenes.colour import DAYLIGHT, ResponseLike, black_body, luminance, star_temperature
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.panorama import Panorama, rotation
from kerrcaustics.scenes.points import PointLights
from kerrcaustics.scenes.scene_checks import check_number, not_negative
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import instance_of, quoted
from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

# Number of rows of the picture of the galactic band.
_BAND_ROWS = 512
# Ratio of the axes above which footprints of the band are widened: it has little detail.
_BAND_ASPECT = 4.0
BAND = 0.15
"""Default brightness of the galactic band."""
NEBULAE = 100.0
"""Default light of white in pictures of nebulae."""
# Square degrees in a steradian.
_SQUARE_DEGREES = (180 / math.pi) ** 2


@dataclass(frozen=True, eq=False, repr=False)
class StarField(Shown, Sky):
    """A sky of stars and of the diffuse light of a galactic plane.

    Parameters
    ----------
    catalogue : StarCatalogue
        If omitted, the Hipparcos-2 stars up to magnitude 8 that come with the package.
    orientation : (3, 3) array
        Rotation from the catalogue's directions to the celestial sphere. If omitted, the galactic plane is inclined by
        25 degrees to the hole's equatorial plane.
    band : float
        Brightness of the galactic band, about 1 for the Milky Way seen from space, 0 for none; 0.15 leaves the sky
        between the stars dark. It needs a catalogue in ICRS directions.
    white : float
        Temperature (K) of a star that looks white.
    sweep : float
        Angle (radians) by which the sky turns about the spin axis during the exposure, half of it on either side, for
        motion blur of stars and nebulae. The smooth band is not blurred.
    response : str or MeasuredResponse
        "cie", "film" or measured curves, as for `black_body`; the band's shifts go by the CIE functions.
    nebulae : Panorama, Checkerboard or any other sky without stars, optional
        Further light of the sky, in the unit of the stars; white of 100 is as bright as the Milky Way.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Light is in units of a star of magnitude 0 per steradian. Stars have the colour of a black body for their B - V.

    Each image of a star is a quadratic B-spline of a pixel's size about its place; its parts in the pixels add up to 1.
    Its light is that of the star times the magnification, which is cut where an
    image is within 0.05 pixels of a critical curve. JTFT take a Gaussian over round beams, cut off.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> sky = kc.skies.StarField(band=0.5)
    >>> len(sky.catalogue)
    37622
    """

    catalogue: StarCatalogue = field(default_factory=hipparcos)
    orientation: Any = None
    band: float = BAND
    white: float = DAYLIGHT
    sweep: float = 0.0
    response: ResponseLike = "cie"
    nebulae: Sky | None = None
    smooth: bool = field(init=False)

    def __post_init__(self) -> None:
        """Raise ValueError unless the star field is valid."""
        instance_of("catalogue", self.catalogue, StarCatalogue)
        check_number("band", self.band, "be a finite number that is not negative", not_negative)
        check_number("sweep", self.sweep, "be an angle from 0 to pi radians", lambda angle: 0 <= angle <= math.pi)
        turn = tilted_galaxy(math.radians(25), math.radians(-60), math.radians(60))
        object.__setattr__(self, "orientation", turn if self.orientation is None else rotation(self.orientation))
        black_body(DAYLIGHT, self.white, self.response)
        _check_nebulae(self.nebulae)
        # The band alone needs no motion blur.
        object.__setattr__(self, "smooth", self.nebulae is None)

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels, stars of magnitude 0 per steradian: that of the band and the nebulae."""
        light = np.zeros((len(footprint), 3))
        if self.band:
            light = self._band.light(footprint, beaming, colour_shift) * self._tint
        return light if self.nebulae is None else light + self.nebulae.light(footprint, beaming, colour_shift)

    @property
    def galaxy(self) -> Float[Array, "3 3"]:
        """The `orientation` of a `Panorama` of the stars' own Galaxy: a rotation (3, 3).

        For a picture with the galactic centre in its middle and the galactic north pole above.
        """
        return self.orientation @ galactic_axes().T @ np.diag([-1.0, -1.0, 1.0])

    @cached_property
    def points(self) -> PointLights:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The stars."""
        direction = self.catalogue.direction @ self.orientation.T
        colour = black_body(self._temperature, self.white, self.response)
        flux = colour * (10 ** (-0.4 * self.catalogue.magnitude) / luminance(colour))[:, None]
        return PointLights(direction, flux, self._temperature, self.response)

    @cached_property
    def _temperature(self) -> Float[Array, " stars"]:
        return star_temperature(self.catalogue.colour_index)

    @cached_property
    def _tint(self) -> Float[Array, "3"]:
        """The colour of the band, of luminance 1."""
        tint = black_body(4800.0, self.white, self.response)
        return tint / luminance(tint)

    @cached_property
    def _band(self) -> Panorama:
        rows = _BAND_ROWS
        theta = (np.arange(rows) + 0.5)[:, None] * math.pi / rows
        light = milky_way(from_angles(theta, (np.arange(2 * rows) + 0.5) * math.pi / rows))
        grey = np.repeat(self.band * light[..., None], 3, axis=2)
        # The band has no detail that thin footprints would resolve.
        return Panorama(grey, self.orientation @ galactic_axes().T, aspect=_BAND_ASPECT, mirror=True)


def _check_nebulae(sky: Any) -> None:
    """Raise ValueError unless nebulae are a sky without points, or None."""
    if sky is not None and not (isinstance(sky, Sky) and sky.points is None):
        must = "be a sky without points of light, as a Panorama"
        raise ValueError(f"Argument `nebulae` must {must}, but is {quoted(sky)}.")


def milky_way(galactic: Float[Array, "*batch 3"]) -> Float[Array, "*batch"]:
    """Diffuse light (...,) of a galactic plane in galactic directions (..., 3), stars of magnitude 0 per steradian.

    A model of this package, for pictures: a disc that fades with latitude and away from the centre, a bulge, a lane of
    dust, and a faint light everywhere. Its scale is that of the brightness of the Milky Way in visible light, about 300
    stars of magnitude 10 per square degree toward the centre.
    """
    latitude = np.degrees(np.arcsin(np.clip(galactic[..., 2], -1, 1)))
    longitude = np.degrees(np.arctan2(galactic[..., 1], galactic[..., 0]))
    turn = np.radians(longitude)
    inward = np.exp(-((longitude / 70) ** 2))
    disc = (70 + 130 * inward) * np.exp(-np.sqrt(latitude**2 + 4) / (9 + 3 * inward))
    bulge = 260 * np.exp(-((longitude / 16) ** 2 + (latitude / 9) ** 2))
    lane = 1.2 * np.sin(2 * turn + 0.7) + 0.8 * np.sin(7 * turn + 2.0) + 0.5 * np.sin(17 * turn)
    depth = (0.55 + 0.25 * inward) * (1 + 0.25 * np.sin(5 * turn + 1.0) + 0.15 * np.sin(23 * turn))
    dust = 1 - np.clip(depth, 0, 0.9) * np.exp(-(((latitude - lane) / 2.6) ** 2))
    return ((disc + bulge) * dust + 6) * 1e-4 * _SQUARE_DEGREES
