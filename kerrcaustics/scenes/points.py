"""Points of light on the celestial sphere, and all their images on a picture.

The map of a picture (sky_cells.py) is inverted for every star: each image is drawn at its place, as large as a pixel,
with the light of the star times its magnification.
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

# Distance (pixels) below which images of two cells are one.
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
        """For each limit at which images begin to fade, the bins of the stars that fade there or later."""
        bins = []
        for limit in np.unique(self.limits).tolist():
            which = np.flatnonzero(self.limits >= limit)
            bins.append((limit, star_bins(self.direction[which], which)))
        return bins

    @cached_property
    def layers(self) -> list[StarLayer]:
        """The layers of stars, for their mean light where images have faded."""
        layers = []
        for limit in np.unique(self.limits).tolist():
            which = self.limits == limit
            layers.append(StarLayer.from_stars(self.direction[which], self.flux[which], self.temperature[which], limit))
        return layers

    def some(self, which: Int[Array, " m"] | Bool[Array, " n"], turn: ArrayLike) -> "PointLights":
        """The chosen lights, turned about the spin axis by angles (m,) or by one angle; their limits are kept."""
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
    """Numbers (m,) of images without duplicates from two starts of the search or two cells, by their stars.

    positive: as of `Imaged`; images on different sides of a critical curve are different.
    """
    x, y = place.T
    least = x.min(initial=0.0)
    # A single key, star and place: its round-off is far below the distance of equal images.
    order = np.argsort(star * (x.max(initial=0.0) - least + 1) + (x - least))
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
    # The determinant is bounded as the brightness is.
    return steps_to(images.steps, motion, np.maximum(images.area**2, 1e-300))


def draw_points(
    light: Float[Array, "h w 3"], view: Raster, place: Float[Array, "m 2"], power: Float[Array, "m 3"]
) -> None:
    """Add images to a picture, each a quadratic B-spline whose light times solid angle is a row of `power` (m, 3).

    Parts of an image beyond a side of a picture of the whole sky are drawn at the opposite side.
    """
    (left, x_parts), (top, y_parts) = (_spline_parts(along) for along in place.T)
    flat, channels = light.reshape(-1, 3), np.ascontiguousarray(power.T)
    for i in range(3):
        for j in range(3):
            x, y, inside = _pixels(view, left + i, top + j)
            # Parts outside the picture add 0 to the first pixel.
            weight = np.where(inside, x_parts[i] * y_parts[j], 0) / view.pixel_sizes(x, y)
            for channel, part in enumerate(channels):
                np.add.at(flat[:, channel], y * view.width + x, (weight * part).astype(light.dtype))


def _pixels(
    view: Raster, x: Int[Array, " m"], y: Int[Array, " m"]
) -> tuple[Int[Array, " m"], Int[Array, " m"], Bool[Array, " m"]]:
    """Columns and rows of pixels in the picture, 0 for pixels outside, and the mask of those inside."""
    inside = (x >= 0) & (y >= 0) & (x < view.width) & (y < view.height)
    if view.closed:
        beyond = np.flatnonzero(~inside)
        x[beyond], y[beyond] = np.round(view.pixels(view.directions(x[beyond], y[beyond])[0])).astype(int).T
        inside = (x >= 0) & (y >= 0) & (x < view.width) & (y < view.height)
    return x * inside, y * inside, inside


def _spline_parts(place: Float[Array, " m"]) -> tuple[Int[Array, " m"], tuple[Array, Array, Array]]:
    """The pixels before the nearest ones along a side; the shares of these, of the nearest and of the next pixels."""
    nearest = np.round(place)
    offset = place - nearest
    return nearest.astype(int) - 1, ((0.5 - offset) ** 2 / 2, 0.75 - offset**2, (0.5 + offset) ** 2 / 2)
