"""Charts of the whole camera sky, for what a picture's own pixels are too coarse to resolve.

Next to the shadow edge the map to the celestial sphere is smooth in the e-foldings of the distance to it: there an
`EdgeChart` has as many pixels in each of them. Opposite to the hole, where its lines meet, lies a `CapChart`. Both are
of the sky of a camera at rest, and look where the camera itself sees what lies there.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.lens_map.sky_chart import edge_size
from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.frame import Frame, doppler, line_of_sight_from_sky, sky_from_line_of_sight
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

ROOT = 16
"""Pixels of the largest cells: both charts have whole numbers of them."""
# Pixels of the edge chart: in a circle round the hole, and in an e-folding.
_ROUND, _FINE = 384, 64
# Where the charts meet: e-foldings from the direction opposite to the hole. Of the cap so much more is covered.
_CAP, _BEYOND = 0.35, 1.05
_CAP_PIXELS = 128
# No closer to the edge (radians) a direction in doubles is known well.
_NEAREST = 1e-9


class EdgeChart:
    """A chart whose columns are angles round the hole, and whose rows lead to a strip beside the shadow edge."""

    def __init__(self, camera: Viewer, strip: float, widest: float) -> None:
        """strip: its width, as a part of the size of the shadow, or of the sky outside it; widest: radians."""
        self._frame, self._size = camera.frame(), edge_size(camera)
        sizes = self._size(np.linspace(0, 2 * math.pi, _ROUND))
        self.widest = math.pi - float(sizes.min())
        scale = min(float(sizes.mean()), math.pi - float(sizes.mean()))
        self._scale = scale
        self._strip = max(min(strip * scale, widest), _NEAREST)
        deepest = max(math.log(self.widest / self._strip), _CAP)
        self.width, self.height = _ROUND, max(math.ceil((deepest - _CAP) * _FINE / ROOT), 1) * ROOT
        # So large is a pixel next to the edge, along it.
        self.pixel = 2 * math.pi / _ROUND * max(math.sin(float(sizes.mean())), 1e-6)

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions N (..., 3) on the camera sky, and their steps (..., 3, 2) per pixel."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        angle, depth = (x + 0.5) * (2 * math.pi / _ROUND), _CAP + (y + 0.5) / _FINE
        size, slope, part = self._size(angle), self._size(angle, 1), np.exp(-depth)
        distance = size + (math.pi - size) * part
        (c, s), (cos, sin) = ((np.cos(p), np.sin(p)) for p in (distance, angle))
        line_of_sight = np.stack([-c, s * cos, s * sin], axis=-1)
        outward = np.stack([s, c * cos, c * sin], axis=-1)
        around = np.stack([np.zeros_like(s), -s * sin, s * cos], axis=-1)
        turn = (outward * (slope * (1 - part))[..., None] + around) * (2 * math.pi / _ROUND)
        fall = outward * (-(math.pi - size) * part / _FINE)[..., None]
        return _aberrated(self._frame, line_of_sight, np.stack([turn, fall], axis=-1))

    def distance(self, x: Float[Array, " n"], y: Float[Array, " n"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Angles (n,) round the hole of places, and their distances (n,) from the shadow edge, both in radians."""
        angle = (x + 0.5) * (2 * math.pi / _ROUND)
        return angle, (math.pi - self._size(angle)) * np.exp(-_CAP - (y + 0.5) / _FINE)

    def places(self, sky: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """Places (n, 2) of directions N; below the chart for what lies in the shadow."""
        line_of_sight = line_of_sight_from_sky(self._frame, sky)
        angle = np.arctan2(line_of_sight[:, 2], line_of_sight[:, 1]) % (2 * math.pi)
        size = self._size(angle)
        away = np.arctan2(np.hypot(line_of_sight[:, 1], line_of_sight[:, 2]), -line_of_sight[:, 0]) - size
        depth = np.log((math.pi - size) / np.maximum(away, self._strip * 1e-3))
        return np.stack([angle * (_ROUND / (2 * math.pi)) - 0.5, (depth - _CAP) * _FINE - 0.5], axis=-1)


class CapChart:
    """A chart of the sky opposite to the hole, as a fisheye sees it."""

    def __init__(self, camera: Viewer, edge: EdgeChart) -> None:
        """edge: the chart of the rest."""
        self._frame = camera.frame()
        angle = 2 * _BEYOND * (1 - math.exp(-_CAP)) * edge.widest
        self._view = View(_CAP_PIXELS, _CAP_PIXELS, angle, "fisheye", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        self.width = self.height = _CAP_PIXELS
        self.pixel = self._view.pixel_angle

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
        """Directions N and their steps, as for `EdgeChart`."""
        return _aberrated(self._frame, *self._view.directions(x, y))

    def places(self, sky: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """Places (n, 2) of directions N."""
        return self._view.pixels(line_of_sight_from_sky(self._frame, sky))


def _aberrated(
    frame: Frame, line_of_sight: Float[Array, "*batch 3"], steps: Float[Array, "*batch 3 2"]
) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3 2"]]:
    """Directions N on the camera sky of what lies in directions of the fiducial observer, and the steps there."""
    basis = np.asarray(frame.basis)
    along, change = -(line_of_sight @ basis.T), -(basis @ steps)
    boost, aberration = doppler(frame, (along[..., 0], along[..., 1], along[..., 2]))
    shrink, boost = -math.sqrt(frame.slowness), boost[..., None]
    # N is a fraction, whose denominator is the boost.
    value = np.stack([shrink * along[..., 0], aberration, shrink * along[..., 2]], axis=-1) / boost
    over = np.stack([shrink * change[..., 0, :], -change[..., 1, :], shrink * change[..., 2, :]], axis=-2)
    slower = -frame.speed * change[..., 1:2, :]
    return sky_from_line_of_sight(frame, line_of_sight), (over - value[..., None] * slower) / boost[..., None]
