"""A sky of point stars with a galactic band: each star gives its light to every beam whose footprint holds it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from kerrcaustics.scenes.catalogue import StarCatalogue, galactic_axes, hipparcos, tilted_galaxy
from kerrcaustics.scenes.colour import DAYLIGHT, black_body, luminance, shifted_light, star_temperature
from kerrcaustics.scenes.footprint import Footprint, singular_values
from kerrcaustics.scenes.panorama import Panorama, rotation
from kerrcaustics.spacetime.checks import real_number
from kerrcaustics.spacetime.sphere import from_angles, polar_basis

Array = np.ndarray

# A pixel's weight for a star reaches one and a half pixels to each side; its corners are so far from the middle.
_REACH = 1.5 * math.sqrt(2)
# Radians above which the footprint of a pixel is cut, for stars.
_LONGEST = 0.08
# Below this part of the major axis a minor axis is widened: thinner footprints hold no star but by chance.
_THINNEST = 1e-4
# Next to the shadow, where footprints are strongly bent, so much of it is heeded: many stars would make no difference.
_MOST_BEND = 5e-3
# Discs that are searched together.
_DISCS = 1 << 13
_ALIKE = 1.5
# Moments in which a moving star is looked at while it crosses a pixel's reach.
_MOMENTS = 6
_BAND_ROWS = 512
# Light of one star of magnitude 0 on a square degree, per steradian.
_SQUARE_DEGREES = (180 / math.pi) ** 2


@dataclass(frozen=True, eq=False)
class StarField:
    """A sky of stars and of the diffuse light of a galactic plane.

    Parameters
    ----------
    catalogue : StarCatalogue
        Left out, the Hipparcos-2 stars up to magnitude 8 that come with the package.
    orientation : (3, 3) array
        Rotation from the catalogue's directions to the celestial sphere. Left out, the galactic plane is inclined by 25
        degrees to the hole's equatorial plane.
    band : float
        Brightness of the galactic band, 1 for about that of our own from outside the Earth's air, 0 for none. It
        needs a catalogue in ICRS directions.
    white : float
        Temperature (K) of a star that looks white.
    sweep : float
        Angle (radians) by which the stars turn about the spin axis while the picture is exposed, half of it on either
        side: motion blur. The band is too smooth to need any.
    response : str
        "cie" or "film", as for `black_body`; the band's shifts go by the CIE functions.

    Notes
    -----
    Light is in units of a star of magnitude 0 per steradian. Stars have the colour of a black body for their B - V.

    A star at x, y pixels from the middle of a pixel, by the inverse of the beam's linear map, gives it the part
    B(x) B(y) of its light, with the quadratic B-spline B: over all pixels the parts add up to 1, wherever the star is.
    The light of an image is therefore that of the star times the magnification, and its size that of a pixel. Within a
    few pixels of a critical curve, where the map is not linear over a pixel, it is spread over these. JTFT take a
    Gaussian over round beams, cut off, in place of B(x) B(y).
    """

    catalogue: StarCatalogue = field(default_factory=hipparcos)
    orientation: Any = None
    band: float = 1.0
    white: float = DAYLIGHT
    sweep: float = 0.0
    response: str = "cie"

    def __post_init__(self) -> None:
        """Refuse what is no star field."""
        if not isinstance(self.catalogue, StarCatalogue):
            raise ValueError(f"Argument `catalogue` must be a StarCatalogue, but is {type(self.catalogue).__name__}.")
        if not 0 <= real_number("band", self.band) < math.inf:
            raise ValueError(f"Argument `band` must be a number that is not negative, but is {self.band!r}.")
        if not 0 <= real_number("sweep", self.sweep) <= math.pi:
            raise ValueError(f"Argument `sweep` must be an angle from 0 to pi radians, but is {self.sweep!r}.")
        turn = tilted_galaxy(math.radians(25), math.radians(-60), math.radians(60))
        object.__setattr__(self, "orientation", turn if self.orientation is None else rotation(self.orientation))
        black_body(DAYLIGHT, self.white, self.response)

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels, stars of magnitude 0 per steradian."""
        light = np.zeros((len(footprint), 3))
        if self.band:
            light += self._band.light(footprint, beaming, colour_shift)
        matrix, density = _usable(footprint)
        for pixel, star, weight in self._pairs(footprint.direction, matrix):
            flux = self._flux[star] * (weight * density[pixel])[:, None]
            if beaming or colour_shift:
                about = self._temperature[star], self.response
                flux *= shifted_light(footprint.redshift[pixel], beaming, colour_shift, *about)
            for channel in range(3):
                light[:, channel] += np.bincount(pixel, flux[:, channel], minlength=len(footprint))
        return light

    @cached_property
    def _stars(self) -> Float[Array, "stars 3"]:
        """Directions n' (n, 3)."""
        return self.catalogue.direction @ self.orientation.T

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self._stars)

    @cached_property
    def _temperature(self) -> Float[Array, " stars"]:
        return star_temperature(self.catalogue.colour_index)

    @cached_property
    def _flux(self) -> Float[Array, "stars 3"]:
        """Linear sRGB light (n, 3) with the luminance of the magnitude."""
        colour = black_body(self._temperature, self.white, self.response)
        return colour * (10 ** (-0.4 * self.catalogue.magnitude) / luminance(colour))[:, None]

    @cached_property
    def _band(self) -> Panorama:
        rows = _BAND_ROWS
        theta = (np.arange(rows) + 0.5)[:, None] * math.pi / rows
        light = milky_way(from_angles(theta, (np.arange(2 * rows) + 0.5) * math.pi / rows))
        tint = black_body(4800.0, self.white, self.response)
        light = self.band * light[..., None] * (tint / luminance(tint))
        return Panorama(light, self.orientation @ galactic_axes().T)

    def _pairs(
        self, direction: Float[Array, "pixels 3"], matrix: Float[Array, "pixels 2 2"]
    ) -> Iterator[tuple[Int[Array, " m"], Int[Array, " m"], Float[Array, " m"]]]:
        """Pixels, stars and weights (m,) of every star in every footprint that holds it, some pixels at a time."""
        pixel, centre, radius, place, half = _discs(direction, matrix, len(self.catalogue))
        # As chords, of which the tree is made.
        chord = 2 * np.sin(np.minimum(radius + self.sweep / 2, math.pi) / 2)
        rows = _rows(direction, matrix)
        for part in _alike(chord):
            found = KDTree(centre[part]).sparse_distance_matrix(self._tree, chord[part].max(), output_type="ndarray")
            disc, star = part[found["i"]], found["j"]
            near = found["v"] <= chord[disc]
            disc, star = disc[near], star[near]
            which = pixel[disc]
            weight, along = self._weight(direction[which], rows[which], self._stars[star])
            # Where discs of one pixel overlap, a star belongs to that in whose part of the major axis it is.
            along = along - place[disc]
            inside = (weight > 0) & (along >= -half[disc]) & (along < half[disc])
            yield which[inside], star[inside], weight[inside]

    def _weight(
        self, direction: Float[Array, "m 3"], rows: Float[Array, "m 3 3"], star: Float[Array, "m 3"]
    ) -> tuple[Float[Array, " m"], Float[Array, " m"]]:
        """Part of each star's light that a pixel gets, and the star's place (radians) along the pixel's major axis."""
        offset = _offsets(direction, rows, star)
        if not self.sweep:
            return _spline(offset[:, 0]) * _spline(offset[:, 1]), offset[:, 2]
        x, y, _ = star.T
        motion = np.einsum("nij,nj->ni", rows, self.sweep * np.stack([-y, x, np.zeros_like(x)], axis=-1))
        weight, moment = _swept(offset, motion)
        return weight, (offset + moment[:, None] * motion)[:, 2]


def _rows(direction: Float[Array, "pixels 3"], matrix: Float[Array, "pixels 2 2"]) -> Float[Array, "pixels 3 3"]:
    """Rows of displacements in space: two for pixels along x and y, one for radians along the major axis."""
    tangents = np.stack(polar_basis(direction), axis=-2)
    angle = singular_values(matrix)[2]
    axis = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None] @ tangents
    return np.concatenate([np.linalg.inv(matrix) @ tangents, axis], axis=1)


def _discs(
    direction: Float[Array, "pixels 3"], matrix: Float[Array, "pixels 2 2"], stars: int
) -> tuple[Int[Array, " m"], Float[Array, "m 3"], Float[Array, " m"], Float[Array, " m"], Float[Array, " m"]]:
    """Discs that cover footprints, several along the major axis of a long one.

    Of each disc: pixel, centre (m, 3), radius, place on the major axis, and half of the part of it that is its own.
    """
    major, minor, angle = singular_values(matrix)
    # More discs are more searches, fewer hold more stars in vain: measured, this many take the least time.
    number = np.minimum(np.ceil(0.2 * math.sqrt(stars) * major), np.ceil(major / minor)).astype(int)
    pixel = np.repeat(np.arange(len(direction)), number)
    first = np.cumsum(number) - number
    half = (_REACH * major / number)[pixel]
    place = half * (2 * (np.arange(len(pixel)) - first[pixel]) + 1 - number[pixel])
    e_theta, e_phi = polar_basis(direction)
    tangent = e_theta * np.cos(angle)[:, None] + e_phi * np.sin(angle)[:, None]
    turn = place[:, None]
    centre = direction[pixel] * np.cos(turn) + tangent[pixel] * np.sin(turn)
    return pixel, centre, np.hypot(half, _REACH * minor[pixel]), place, half


def _alike(chord: Float[Array, " discs"]) -> Iterator[Int[Array, " _"]]:
    """Numbers of discs in groups, of no more than _DISCS and of chords that differ by less than a factor of _ALIKE."""
    order = np.argsort(chord)
    kind = np.floor(np.log(chord[order]) / math.log(_ALIKE))
    for group in np.split(order, np.flatnonzero(np.diff(kind)) + 1):
        yield from np.split(group, range(_DISCS, len(group), _DISCS))


def _offsets(n: Float[Array, "m 3"], rows: Float[Array, "m 3 3"], star: Float[Array, "m 3"]) -> Float[Array, "m 3"]:
    """Products (m, 3) of rows (m, 3, 3) with displacements from directions n to stars, along great circles."""
    cosine = np.einsum("ni,ni->n", n, star)
    sine = np.sqrt(np.maximum(1 - cosine**2, 1e-30))
    return np.einsum("nij,nj->ni", rows, star) * (np.arctan2(sine, cosine) / sine)[:, None]


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


def _usable(footprint: Footprint) -> tuple[Float[Array, "n 2 2"], Float[Array, " n"]]:
    """Matrices (n, 2, 2) with the minor axis widened by the bend and the axes cut, and 1 / |det| (n,)."""
    u, s, v = np.linalg.svd(footprint.matrix)
    major = np.minimum(s[:, 0], _LONGEST)
    minor = np.minimum(
        np.maximum(np.hypot(s[:, 1], np.minimum(footprint.bend, _MOST_BEND)), _THINNEST * major), _LONGEST
    )
    axes = np.stack([major, minor], axis=-1)
    return (u * axes[:, None, :]) @ v, 1 / axes.prod(axis=1)


def _swept(offset: Float[Array, "m 3"], motion: Float[Array, "m 3"]) -> tuple[Float[Array, " m"], Float[Array, " m"]]:
    """Mean weights (m,) of stars that run from offset - motion / 2 to offset + motion / 2 (m, 3), and a middle moment.

    The moments in which a star is within the pixel's reach are from one time to another: Gauss's rule between them.
    """
    first, last = np.full(len(offset), -0.5), np.full(len(offset), 0.5)
    for place, speed in ((offset[:, k], motion[:, k]) for k in (0, 1)):
        still = np.abs(speed) < 1e-12
        ends = np.sort([(side * 1.5 - place) / np.where(still, 1, speed) for side in (-1, 1)], axis=0)
        inside = np.abs(place) < 1.5
        first = np.maximum(first, np.where(still, np.where(inside, -0.5, 0.5), ends[0]))
        last = np.minimum(last, np.where(still, np.where(inside, 0.5, -0.5), ends[1]))
    length, middle = np.maximum(last - first, 0), (first + last) / 2
    weight = np.zeros(len(offset))
    for node, share in zip(*np.polynomial.legendre.leggauss(_MOMENTS), strict=True):
        moment = middle + length * node / 2
        x, y = (offset[:, k] + moment * motion[:, k] for k in (0, 1))
        weight += share / 2 * _spline(x) * _spline(y)
    return weight * length, middle


def _spline(x: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """The quadratic B-spline (...,), 3/4 at 0 and 0 beyond 3/2: its values at whole steps add up to 1."""
    x = np.abs(x)
    return np.where(x < 0.5, 0.75 - x**2, np.maximum(1.5 - x, 0) ** 2 / 2)
