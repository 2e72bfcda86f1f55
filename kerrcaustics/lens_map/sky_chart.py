"""Coordinates in which images move smoothly: on the sky itself for index 0, along the shadow edge for the others.

The images of higher index lie in ever thinner layers around the shadow. In the e-foldings of the distance from its
edge, as in sky_lines.py, all layers are of about one thickness. Opposite to the hole such coordinates have a pole, so
that the sheet of index 0 is described by N instead.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from kerrcaustics.lens_map.sky_lines import DEEPEST, periodic
from kerrcaustics.spacetime.arrays import Spline
from kerrcaustics.spacetime.frame import line_of_sight_from_sky, sky_from_line_of_sight
from kerrcaustics.spacetime.shadow import edge_photons
from kerrcaustics.spacetime.sphere import moved
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_TABLE = 4096
# Closer to the shadow edge (radians) than this nothing is distinguished.
_NEAREST = 1e-15
# Steps along the shadow edge: where depth is larger than this; longest in angle (radians) and in depth; and so short
# (radians) that a great circle leaves the edge by less than round-off.
_DEEP, _LONGEST_TURN, _LONGEST_DEPTH, _STRAIGHT = 0.3, 0.5, 1.0, 1e-8
# Longest step elsewhere, radians.
_LONGEST = 0.3


Step = tuple[Float[Array, "images 3"], Float[Array, " images"]]
"""Directions reached, and the parts of the steps that were taken."""


class Chart:
    """Places of directions N on the sky at rest: N itself for index 0, else (angle, depth, 0).

    angle: position angle about the direction to the hole; depth: e-foldings of the distance to the shadow edge, along
    great circles through that direction.
    """

    def __init__(self, camera: Viewer) -> None:
        """Tabulate the distance of the shadow edge from the direction to the hole; camera: at rest."""
        self._frame = camera.frame()
        self._size = edge_size(camera)
        self._slope = self._size.derivative()

    def place(self, index: Int[Array, " images"], sky: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Coordinates of directions N on sheets of the given index."""
        line_of_sight = self._line_of_sight(sky)
        angle = np.arctan2(line_of_sight[:, 2], line_of_sight[:, 1])
        size = self._size(angle)
        depth = np.log((np.pi - size) / np.maximum(_from_hole(line_of_sight) - size, _NEAREST))
        return np.where((index == 0)[:, None], sky, np.stack([angle, depth, 0 * angle], axis=-1))

    def sky(self, index: Int[Array, " images"], place: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Directions N at the given coordinates."""
        angle, size = place[:, 0], self._size(place[:, 0])
        distance = size + (np.pi - size) * np.exp(-np.clip(place[:, 1], 0, DEEPEST))
        across = np.sin(distance)
        line_of_sight = np.stack([-np.cos(distance), across * np.cos(angle), across * np.sin(angle)], axis=-1)
        unit = place / np.maximum(np.linalg.norm(place, axis=1, keepdims=True), 1e-300)
        return np.where((index == 0)[:, None], unit, sky_from_line_of_sight(self._frame, line_of_sight))

    def scaled(self, sky: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Coordinates (x, y, 0) of directions N: angles from the hole in units of that to the shadow edge."""
        line_of_sight = self._line_of_sight(sky)
        angle = np.arctan2(line_of_sight[:, 2], line_of_sight[:, 1])
        part = _from_hole(line_of_sight) / self._size(angle)
        return part[:, None] * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)

    def unscaled(self, place: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Directions N at such coordinates."""
        angle = np.arctan2(place[:, 1], place[:, 0])
        distance = np.minimum(np.linalg.norm(place, axis=1) * self._size(angle), np.pi)
        across = np.sin(distance)
        line_of_sight = np.stack([-np.cos(distance), across * np.cos(angle), across * np.sin(angle)], axis=-1)
        return sky_from_line_of_sight(self._frame, line_of_sight)

    def rate(
        self, index: Int[Array, " images"], sky: Float[Array, "images 3"], drift: Float[Array, "images 3"]
    ) -> Float[Array, "images 3"]:
        """Rates of the coordinates of images that drift along tangents of the sky."""
        # On the sky at rest, lines of sight are N in other axes.
        line_of_sight, drifting = self._line_of_sight(sky), self._line_of_sight(drift)
        r, theta, phi = line_of_sight.T
        across = np.maximum(theta**2 + phi**2, 1e-300)
        turning = (theta * drifting[:, 2] - phi * drifting[:, 1]) / across
        outward = drifting[:, 0] * np.sqrt(across) - r * (theta * drifting[:, 1] + phi * drifting[:, 2]) / np.sqrt(
            across
        )
        angle = np.arctan2(phi, theta)
        size, slope = self._size(angle), self._slope(angle)
        distance = np.maximum(_from_hole(line_of_sight) - size, _NEAREST)
        deepening = -slope * turning / (np.pi - size) - (outward - slope * turning) / distance
        return np.where((index == 0)[:, None], drift, np.stack([turning, deepening, 0 * turning], axis=-1))

    def blur(
        self, index: Int[Array, " images"], sky: Float[Array, "images 3"], error: Float[Array, " images"]
    ) -> Float[Array, " images"]:
        """Errors of coordinates of images whose places on the sky have errors (radians), mostly along the edge."""
        line_of_sight = self._line_of_sight(sky)
        across = np.hypot(line_of_sight[:, 1], line_of_sight[:, 2])
        return error / np.where(index == 0, 1, np.maximum(across, _NEAREST))

    def stepped(
        self, sky: Float[Array, "images 3"], step: Float[Array, "images 3"], part: Float[Array, " images"]
    ) -> Step:
        """Directions reached by parts of tangent steps (radians), and the parts: less where steps are too long.

        Close to the hole a step keeps its angle and depth rates, so that it bends with the layers of images; elsewhere
        it runs along a great circle.
        """
        ones = np.ones(len(sky), int)
        place, rate = self.place(ones, sky), self.rate(ones, sky, step)
        bent = (place[:, 1] > _DEEP) & (np.linalg.norm(step, axis=1) > _STRAIGHT)
        turns, depths = np.abs(rate[:, :2].T)
        short = part / np.maximum(np.maximum(turns / _LONGEST_TURN, depths / _LONGEST_DEPTH), 1)
        along = self.sky(ones, place + rate * short[:, None])
        other, part = straight(sky, step, part)
        return np.where(bent[:, None], along, other), np.where(bent, short, part)

    def _line_of_sight(self, sky: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Vectors of the sky at rest in components along r, theta, phi."""
        return line_of_sight_from_sky(self._frame, sky)


def edge_size(camera: Viewer) -> Spline:
    """Distance (radians) of the shadow edge from the direction to the hole, for a camera at rest: by position angle."""
    edge = -edge_photons(camera, 2 * np.pi * np.arange(_TABLE) / _TABLE)
    angle = np.arctan2(edge[:, 2], edge[:, 1])
    angle, first = np.unique(angle, return_index=True)
    size = np.arctan2(np.hypot(edge[:, 1], edge[:, 2]), -edge[:, 0])[first]
    # Round-off may have put neighbours too close for a spline.
    kept = np.concatenate([[True], np.diff(angle) > 1e-7])
    return periodic(angle[kept], size[kept])


@lru_cache(maxsize=8)
def chart_of(camera: Viewer) -> Chart:
    """The chart of a camera at rest, kept for the next call."""
    return Chart(camera)


def straight(sky: Float[Array, "images 3"], step: Float[Array, "images 3"], part: Float[Array, " images"]) -> Step:
    """`Chart.stepped` along great circles alone: on the sky of a camera that moves."""
    part = part / np.maximum(np.linalg.norm(step, axis=1) / _LONGEST, 1)
    return moved(sky, step * part[:, None]), part


def _from_hole(line_of_sight: Float[Array, "images 3"]) -> Float[Array, " images"]:
    """Angles from the direction to the hole, radians."""
    return np.arctan2(np.hypot(line_of_sight[:, 1], line_of_sight[:, 2]), -line_of_sight[:, 0])


def apart(
    index: Int[Array, "*#steps"], start: Float[Array, "*#steps 3"], end: Float[Array, "*#steps 3"]
) -> Float[Array, "*#steps 3"]:
    """Steps from places to places on the sheets of the given index, the short way round in angle."""
    step = end - start
    angle = np.where(index == 0, step[..., 0], (step[..., 0] + np.pi) % (2 * np.pi) - np.pi)
    return np.concatenate([angle[..., None], step[..., 1:]], axis=-1)
