"""Points of light on the celestial sphere, and all their images on a picture.

The map of a picture (sky_cells.py) is inverted for every star: each image is drawn where it is, as large as a pixel,
with the light that its magnification gives it.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.scenes.colour import ResponseLike, shifted_light
from kerrcaustics.scenes.footprint import Footprint, rotated_about_axis
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.scene_checks import check_light
from kerrcaustics.scenes.star_bins import StarBins, star_bins
from kerrcaustics.scenes.unresolved_stars import StarLayer, faded_fraction, limits
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.checks import real_array

Array = np.ndarray

# Images this close (pixels) are one, where cells meet.
_SAME = 0.02


@dataclass(frozen=True, eq=False)
class PointLights:
    """Points of light on a sky.

    Parameters
    ----------
    direction : (n, 3) array
        Unit vectors n' toward them.
    flux : (n, 3) array
        Linear sRGB light: a sky's unit times steradian.
    temperature : (n,) array
        Kelvin, for a shift of their colours.
    response : str or MeasuredResponse
        That for which their colours are shifted, as in `black_body`.
    limit : (n,) array, optional
        Solid angles that a pixel sees where their images begin to fade, given for some points of many.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> star = kc.skies.PointLights(np.array([[-1.0, 0.0, 0.0]]), np.ones((1, 3)), np.array([6504.0]))
    >>> star.flux.tolist()
    [[1.0, 1.0, 1.0]]
    """

    direction: Array
    flux: Array
    temperature: Array
    response: ResponseLike = "cie"
    limit: Array | None = None

    def __post_init__(self) -> None:
        """Raise ValueError unless the points are valid."""
        columns = {"direction": (3,), "flux": (3,), "temperature": ()} | ({} if self.limit is None else {"limit": ()})
        values = {name: real_array(name, getattr(self, name)) for name in columns}
        count = np.shape(values["direction"])[:1]
        for name, rest in columns.items():
            if values[name].shape != (*count, *rest):
                must = f"have the shape {(*count, *rest)}" if count else "have the shape (n, 3)"
                raise ValueError(f"Argument `{name}` must {must}, but has {values[name].shape}.")
            object.__setattr__(self, name, values[name])
        check_light("flux", values["flux"])

    @cached_property
    def limits(self) -> Float[Array, " stars"]:
        """Solid angles (n,) that a pixel sees where their images begin to fade."""
        return limits(self.flux) if self.limit is None else self.limit

    @cached_property
    def bins(self) -> list[tuple[float, StarBins]]:
        """For each limit, where images of some stars begin to fade: those that fade there or later, by their places."""
        found = []
        for limit in np.unique(self.limits).tolist():
            which = np.flatnonzero(self.limits >= limit)
            found.append((limit, star_bins(self.direction[which], which)))
        return found

    @cached_property
    def layers(self) -> list[StarLayer]:
        """The layers of stars, for their mean light where images have faded."""
        found = []
        for limit in np.unique(self.limits).tolist():
            which = self.limits == limit
            found.append(StarLayer.from_stars(self.direction[which], self.flux[which], self.temperature[which], limit))
        return found

    def some(self, which: Int[Array, " m"] | Bool[Array, " n"], turn: ArrayLike) -> "PointLights":
        """The chosen lights, turned about the spin axis by angles, (m,) or one; they fade as among all."""
        direction = rotated_about_axis(self.direction[which], turn)
        return PointLights(direction, self.flux[which], self.temperature[which], self.response, self.limits[which])

    def mean_light(
        self, seen: Float[Array, " m"], footprint: Footprint, beaming: bool, colour_shift: bool
    ) -> Float[Array, "m 3"]:
        """Light (m, 3) in place of images that have faded, where pixels see solid angles (m,) of the sky."""
        light = np.zeros((len(footprint), 3))
        for layer in self.layers:
            which = np.flatnonzero(seen > layer.limit)
            part, some = faded_fraction(seen[which], layer.limit), footprint.part(which)
            shift = shifted_light(some.redshift, beaming, colour_shift, layer.temperature, self.response)
            light[which] += part[:, None] * layer.light(some) * shift
        return light


class Imaged(NamedTuple):
    """Images of stars on a picture.

    place: (m, 2) places, pixels.
    star: (m,) numbers of the stars.
    area: (m,) solid angles that a pixel sees, steradian.
    steps: (m, 2, 3) changes of n' per pixel along x and y.
    curving: (m, 3, 3) second derivatives of n' along xx, xy and yy.
    rate: (m, 3, 3) change of n' over an exposure, and the change of that per pixel along x and y.
    positive: (m,) True if the cross product of the steps is along n'.
    """

    place: Array
    star: Array
    area: Array
    steps: Array
    curving: Array
    rate: Array
    positive: Array

    def part(self, which: Array) -> "Imaged":
        """The chosen images."""
        return Imaged(*(part[which] for part in self))


def steps_to(
    columns: Float[Array, "n 2 3"], miss: Float[Array, "n 3"], floor: Float[Array, " n"] | None = None
) -> Float[Array, "n 2"]:
    """Steps (n, 2) with columns @ step = miss, least squares; floor: of the determinant, where they are parallel."""
    first, second = columns[:, 0], columns[:, 1]
    a, b, c = np.vecdot(first, first), np.vecdot(first, second), np.vecdot(second, second)
    p, q = np.vecdot(first, miss), np.vecdot(second, miss)
    det = np.maximum(a * c - b * b, 1e-12 * (a + c) ** 2 if floor is None else floor)
    return np.stack([c * p - b * q, a * q - b * p], axis=-1) / det[:, None]


def distinct(star: Int[Array, " n"], place: Float[Array, "n 2"], positive: Bool[Array, " n"]) -> Int[Array, " m"]:
    """Numbers (m,) of images without duplicates, from two starts or from two cells where they meet, by their stars.

    positive: as of `Imaged`, on which side of critical curves they are.
    """
    x, y = place.T
    left = x.min(initial=0.0)
    # One number to sort by, that of the star before the place: it is good to much less than what is the same.
    order = np.argsort(star * (x.max(initial=0.0) - left + 1) + (x - left))
    star, x, y, positive = star[order], x[order], y[order], positive[order]
    dropped, first, ahead = np.zeros(len(order), bool), np.arange(len(order)), 0
    while len(first):
        ahead, first = ahead + 1, first[: np.searchsorted(first, len(order) - ahead - 1)]
        second = first + ahead
        beside = (star[second] == star[first]) & (x[second] - x[first] < _SAME)
        first, second = first[beside], second[beside]
        same = (np.abs(y[second] - y[first]) < _SAME) & (positive[second] == positive[first])
        dropped[second[same & ~dropped[first]]] = True
    return order[~dropped]


def displacements(images: Any, motion: Float[Array, "m 3"]) -> Float[Array, "m 2"]:
    """Displacements, in pixels, of images (`Imaged` or `PictureImages`) whose stars move by (m, 3)."""
    # No steeper than where brightness is cut, too.
    return steps_to(images.steps, motion, np.maximum(images.area**2, 1e-300))


def draw_points(
    light: Float[Array, "h w 3"], view: Raster, place: Float[Array, "m 2"], power: Float[Array, "m 3"]
) -> None:
    """Add images to a picture, whose light times solid angle is to be (m, 3): each is a quadratic B-spline.

    Its parts add up to 1. Any part beyond a side of a picture of the whole sky comes in where it belongs.
    """
    (left, x_parts), (top, y_parts) = (_spline_parts(along) for along in place.T)
    flat, channels = light.reshape(-1, 3), np.ascontiguousarray(power.T)
    for i in range(3):
        for j in range(3):
            x, y, inside = _pixels(view, left + i, top + j)
            # What lies outside adds nothing to the first pixel.
            weight = np.where(inside, x_parts[i] * y_parts[j], 0) / view.pixel_sizes(x, y)
            for channel, part in enumerate(channels):
                np.add.at(flat[:, channel], y * view.width + x, (weight * part).astype(light.dtype))


def _pixels(
    view: Raster, x: Int[Array, " m"], y: Int[Array, " m"]
) -> tuple[Int[Array, " m"], Int[Array, " m"], Bool[Array, " m"]]:
    """Pixels of a picture where those at some places lie, the first one for those outside, and the mask of the rest."""
    inside = (x >= 0) & (y >= 0) & (x < view.width) & (y < view.height)
    if view.closed:
        beyond = np.flatnonzero(~inside)
        x[beyond], y[beyond] = np.round(view.pixels(view.directions(x[beyond], y[beyond])[0])).astype(int).T
        inside = (x >= 0) & (y >= 0) & (x < view.width) & (y < view.height)
    return x * inside, y * inside, inside


def _spline_parts(place: Float[Array, " m"]) -> tuple[Int[Array, " m"], tuple[Array, Array, Array]]:
    """Pixels before the nearest ones to places; shares in an image there of these, of the nearest ones, and the next.

    All along one side of the picture.
    """
    nearest = np.round(place)
    offset = place - nearest
    return nearest.astype(int) - 1, ((0.5 - offset) ** 2 / 2, 0.75 - offset**2, (0.5 + offset) ** 2 / 2)
