"""Stars in pixels that see many of them: their mean light over the footprint in place of images.

Brighter stars are fewer, and are resolved in larger footprints: stars are divided into layers by their brightness.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.lens_map.sky_chart import edge_size
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.panorama import Panorama
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.frame import line_of_sight_from_sky, sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import polar_angle
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Number of stars in the first layer.
_BRIGHTEST = 2048
# Ratio of the numbers of stars up to a layer and up to the layer before.
_TIMES = 4
# Number of stars of a layer, and of those before, in a pixel at which their images begin to fade.
_MANY = 2
# Number of stars up to which a sky has the limit `_MOST` instead.
_FEW = 100
# Solid angle of a pixel at which images of few stars begin to fade, in whole skies.
_MOST = 32.0
# Ratio of the solid angles at which images are gone and at which they begin to fade.
_FADING = 4.0
BRIGHTEST = 4 * math.pi * _MANY / _BRIGHTEST
"""Solid angle of a pixel at which images of the brightest of many stars begin to fade, steradian."""
# Width of a pixel in the picture of a layer, as a part of the width that a pixel sees where images fade.
_FINER = 0.25
# Smallest and largest number of rows of that picture.
_FEWEST_ROWS, _MOST_ROWS = 16, 2048
# Ratio of the axes above which footprints are widened, as for skies with little detail.
_ASPECT = 2.0
# Number of angles round the shadow edge at which beams give the width of footprints.
_ROUND = 192
# Number of these beams over one e-folding of the distance to the edge.
_DEEP = 12
# Start of that e-folding if less than a pixel, as a part of the size of the shadow or of the sky outside it.
_CLOSE = 0.02
# Tolerance of these beams, radians.
_TOLERANCE = 1e-7
# Part of the distance at which images have faded, by the mean width of footprints, within which no image is searched.
_SAFE = 0.3
# Largest distance without a search, as a part of the same size: footprints change beyond.
_NEAR = 0.25


def limits(flux: Float[Array, "stars 3"]) -> Float[Array, " stars"]:
    """Solid angles (n,) of a pixel at which images of stars begin to fade."""
    rank = np.empty(len(flux))
    rank[np.argsort(-flux.sum(axis=1), kind="stable")] = np.arange(1, len(flux) + 1)
    last = max(round(math.log(max(len(flux) / _BRIGHTEST, 1)) / math.log(_TIMES)), 0)
    layer = np.minimum(np.ceil(np.log(np.maximum(rank / _BRIGHTEST, 1)) / math.log(_TIMES)), last)
    count = np.where(layer == last, len(flux), _BRIGHTEST * _TIMES**layer)
    return np.full(len(flux), 4 * math.pi * _MOST) if len(flux) <= _FEW else 4 * math.pi * _MANY / count


class PixelSolidAngles:
    """Solid angles of the celestial sphere that pixels of a picture see.

    Footprints of pixels beside the shadow edge are long and thin. Their width vanishes on critical curves, which lie
    close together there, so it is replaced by its mean at the same angle round the shadow.
    """

    def __init__(self, camera: Viewer, pixel: float) -> None:
        """Trace some beams beside the shadow edge; pixel: angle between pixels (radians)."""
        self._frame = camera.frame()
        angle = np.arange(_ROUND)[:, None] * (2 * math.pi / _ROUND)
        size = edge_size(camera)(angle)
        scale = np.minimum(size, math.pi - size)
        nearest = min(pixel, _CLOSE * float(scale.mean()))
        away = size + nearest * np.exp(np.arange(_DEEP) / _DEEP)
        c, s = np.cos(away), np.sin(away)
        line_of_sight = np.stack([-c, s * np.cos(angle), s * np.sin(angle)], axis=-1)
        sky = sky_from_line_of_sight(self._frame, line_of_sight)
        beams = beams_of_directions(camera, sky, "auto", _TOLERANCE, index=False, crossings=False, redshift=False)
        width, turn = pixel * np.abs(beams.delta_minus), pixel * beams.delta_plus * (away - size)
        width, turn = (np.sqrt(np.nanmean(part**2, axis=1)) for part in (width, turn))
        self._angle, self._width = angle[:, 0], np.nan_to_num(width, nan=np.inf)
        self._turn, self._scale = np.nan_to_num(turn, nan=np.inf), scale[:, 0]

    def values(self, major: Float[Array, " n"], sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Solid angles (n,) of pixels with a major axis (n,) of their footprints, in directions N (n, 3)."""
        _, y, z = np.moveaxis(line_of_sight_from_sky(self._frame, sky), -1, 0)
        width = np.interp(np.arctan2(z, y), self._angle, self._width, period=2 * math.pi)
        return np.asarray(major * np.minimum(major, width))

    def nearest(self, angle: Float[Array, " n"], limit: float) -> Float[Array, " n"]:
        """Distances (n,) from the shadow edge that lie safely within the zone in which images have faded away.

        angle: (n,) angles round the shadow, radians. The length of footprints is inverse to the distance.
        """
        width, turn, scale = (
            np.interp(angle, self._angle, part, period=2 * math.pi) for part in (self._width, self._turn, self._scale)
        )
        last = last_seen(limit)
        # A pixel sees the product of length and width, or the square of the length if less.
        return np.asarray(np.minimum(_SAFE * turn * np.minimum(width / last, 1 / math.sqrt(last)), _NEAR * scale))


@lru_cache(maxsize=8)
def pixel_solid_angles(camera: Viewer, pixel: float) -> PixelSolidAngles:
    """The solid angles of a camera, cached."""
    return PixelSolidAngles(camera, pixel)


def faded_fraction(seen: Float[Array, "*batch"], limit: Float[Array, "*batch"] | float) -> Float[Array, "*batch"]:
    """The part (...,) of the light of stars that their images lack if a pixel sees a solid angle (...,)."""
    with np.errstate(divide="ignore"):
        part = np.clip(np.log(seen / limit) / math.log(_FADING), 0, 1)
    return np.asarray(part * part * (3 - 2 * part))


def last_seen(limit: float) -> float:
    """The solid angle of a pixel at which images have faded away."""
    return limit * _FADING


class StarLayer(NamedTuple):
    """Stars of about one brightness.

    limit: solid angle of a pixel at which their images begin to fade, steradian.
    picture: their mean light.
    temperature: their mean temperature, weighted by light, kelvin.
    """

    limit: float
    picture: Panorama
    temperature: float

    @classmethod
    def from_stars(
        cls, direction: Float[Array, "n 3"], flux: Float[Array, "n 3"], temperature: Float[Array, " n"], limit: float
    ) -> "StarLayer":
        """The layer of some stars."""
        doublings = math.ceil(math.log2(math.pi / (_FINER * math.sqrt(limit))))
        rows = int(np.clip(2**doublings, _FEWEST_ROWS, _MOST_ROWS))
        row = np.minimum((polar_angle(direction) * (rows / math.pi)).astype(int), rows - 1)
        turn = np.arctan2(direction[:, 1], direction[:, 0]) / (2 * math.pi)
        column = np.minimum(((turn - np.floor(turn)) * (2 * rows)).astype(int), 2 * rows - 1)
        edges = np.cos(np.arange(rows + 1) * (math.pi / rows))
        size = (edges[:-1] - edges[1:]) * (math.pi / rows)
        light = [np.bincount(row * 2 * rows + column, part, 2 * rows**2).reshape(rows, -1) for part in flux.T]
        mean = np.average(temperature, weights=np.maximum(flux.sum(axis=1), 1e-300))
        return cls(
            limit, Panorama(np.stack(light, axis=-1) / size[:, None, None], mirror=True, aspect=_ASPECT), float(mean)
        )

    def light(self, footprint: Footprint) -> Float[Array, "pixels 3"]:
        """Mean light (n, 3) about footprints, without shifts."""
        return self.picture.light(footprint, False, False)
