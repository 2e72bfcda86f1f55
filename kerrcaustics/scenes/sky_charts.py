"""Charts of the whole camera sky, finer than the pixels of a picture.

Next to the shadow edge the map to the celestial sphere is smooth in the e-foldings of the distance to it: there an
`EdgeChart` has as many pixels in each of them. A `CapChart` covers the sky opposite to the hole, where its lines meet.
Both are laid out on the sky of a camera at rest; their directions are those of the camera itself.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.lens_map.sky_chart import edge_size
from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.frame import line_of_sight_from_sky
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

ROOT = 16
"""Side of the largest cells, pixels: it divides the sides of both charts."""
# Pixels of the edge chart in a circle round the hole.
_ROUND = 384
# Pixels of the edge chart in an e-folding of the distance to the edge.
_FINE = 64
# Border of both charts, e-foldings from the direction opposite to the hole.
_CAP = 0.35
# Factor by which the cap chart extends beyond the border.
_BEYOND = 1.05
# Side of the cap chart, pixels.
_CAP_PIXELS = 128
# Smallest distance from the edge, radians: closer directions lose their digits in double precision.
_NEAREST = 1e-9


class EdgeChart:
    """A chart whose columns are angles round the hole, and whose rows lead to a strip beside the shadow edge."""

    def __init__(self, camera: Viewer, strip: float, widest: float) -> None:
        """strip: width of the strip, as a part of the size of shadow or outer sky; widest: its limit, radians."""
        self._frame, self._size = camera.frame(), edge_size(camera)
        sizes = self._size(np.linspace(0, 2 * math.pi, _ROUND))
        self.widest = math.pi - float(sizes.min())
        scale = min(float(sizes.mean()), math.pi - float(sizes.mean()))
        self._scale = scale
        self._strip = max(min(strip * scale, widest), _NEAREST)
        deepest = max(math.log(self.widest / self._strip), _CAP)
        self.width, self.height = _ROUND, max(math.ceil((deepest - _CAP) * _FINE / ROOT), 1) * ROOT
        # Size of a pixel along the edge, next to it.
        self.pixel = 2 * math.pi / _ROUND * max(math.sin(float(sizes.mean())), 1e-6)

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions N (..., 3) on the camera sky, and their steps (..., 3, 2) per pixel."""
        angle = (np.asarray(x, float) + 0.5) * (2 * math.pi / _ROUND)
        numbers = self._frame, (_ROUND, _FINE, _CAP)
        return kernel("beside_edge")(*numbers, x, y, self._size(angle), self._size(angle, 1))

    def distance(self, x: Float[Array, " n"], y: Float[Array, " n"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Angles (n,) round the hole of places, and their distances (n,) from the shadow edge, both in radians."""
        angle = (x + 0.5) * (2 * math.pi / _ROUND)
        return angle, (math.pi - self._size(angle)) * np.exp(-_CAP - (y + 0.5) / _FINE)

    def places(self, sky: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """Places (n, 2) of directions N; directions in the shadow lie below the chart."""
        line_of_sight = line_of_sight_from_sky(self._frame, sky)
        angle = np.arctan2(line_of_sight[:, 2], line_of_sight[:, 1]) % (2 * math.pi)
        size = self._size(angle)
        away = np.arctan2(np.hypot(line_of_sight[:, 1], line_of_sight[:, 2]), -line_of_sight[:, 0]) - size
        depth = np.log((math.pi - size) / np.maximum(away, self._strip * 1e-3))
        return np.stack([angle * (_ROUND / (2 * math.pi)) - 0.5, (depth - _CAP) * _FINE - 0.5], axis=-1)


class CapChart:
    """A chart of the sky opposite to the hole, in the fisheye projection."""

    def __init__(self, camera: Viewer, edge: EdgeChart) -> None:
        """edge: the chart of the rest of the sky."""
        self._frame = camera.frame()
        angle = 2 * _BEYOND * (1 - math.exp(-_CAP)) * edge.widest
        self._view = View(_CAP_PIXELS, _CAP_PIXELS, angle, "fisheye", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        self.width = self.height = _CAP_PIXELS
        self.pixel = self._view.pixel_angle

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions N and their steps, as for `EdgeChart`."""
        line_of_sight, steps = self._view.directions(x, y)
        columns = [*np.moveaxis(line_of_sight, -1, 0)], *np.moveaxis(steps, (-2, -1), (0, 1)).reshape(6, *np.shape(x))
        return kernel("aberrated")(self._frame, *columns)

    def places(self, sky: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """Places (n, 2) of directions N."""
        return self._view.pixels(line_of_sight_from_sky(self._frame, sky))
