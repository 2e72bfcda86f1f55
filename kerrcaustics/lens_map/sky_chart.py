"""Coordinates in which images move smoothly: on the sky itself for index 0, along the shadow edge for the others.

The images of higher index lie in ever thinner layers around the shadow. In the e-foldings of the distance from its
edge, as in sky_lines.py, all layers are of about one thickness. Opposite to the hole such coordinates have a pole, so
that the sheet of index 0 is described by N instead.
"""

from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from kerrcaustics.lens_map import newton_limits as limits
from kerrcaustics.lens_map.sky_lines import DEEPEST, periodic
from kerrcaustics.numerics.splines import Spline, cubics
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.shadow import edge_photons, even_phases
from kerrcaustics.spacetime.sphere import lengths, moved, unit
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_TABLE = 4096
# Even pieces of the shadow edge, and how far off (radians) they may be.
_EVEN_PIECES, _SAME_EDGE = 8192, 1e-10

Step = tuple[Float[Array, "images 3"], Float[Array, " images"]]
"""Directions reached, and the parts of the steps that were taken."""


class _AboutHole(NamedTuple):
    """Directions by distance and position angle about the direction to the hole.

    toward: lines of sight (n, 3) along r, theta, phi.
    across: part of the lines of sight across r.
    angle: position angle, radians.
    distance: distance from the direction to the hole.
    size: distance of the shadow edge at that angle.
    """

    toward: Array
    across: Array
    angle: Array
    distance: Array
    size: Array

    @property
    def edge_distance(self) -> Array:
        """Distance from the shadow edge."""
        return np.maximum(self.distance - self.size, limits.NEAREST)


class Chart:
    """Places of directions N on the sky at rest: N itself for index 0, else (angle, depth, 0).

    angle: position angle about the direction to the hole; depth: e-foldings of the distance to the shadow edge, along
    great circles through that direction.
    """

    def __init__(self, camera: Viewer) -> None:
        """Tabulate the distance of the shadow edge from the direction to the hole; camera: at rest."""
        # On the sky at rest, lines of sight are N in other axes.
        self._axes = np.array(camera.frame().basis)
        self._size = edge_size(camera)

    @cached_property
    def even_edge(self) -> Float[Array, "pieces 4"] | None:
        """The distance of the shadow edge in even pieces, as newton_formulas.py has it.

        None where that is not the same: the edge of the fastest holes has corners, seen from close by.
        """
        nodes = np.linspace(-np.pi, np.pi, _EVEN_PIECES + 1)
        edge = cubics(nodes, self._size(nodes), self._size(nodes, 1))
        # Where the edge is known best, the piece and what of it lies ahead.
        turn = (self._size.x + np.pi) % (2 * np.pi)
        piece = np.minimum((turn / (2 * np.pi) * _EVEN_PIECES).astype(int), _EVEN_PIECES - 1)
        (a, b, c, d), ahead = edge[piece].T, turn - (nodes[piece] + np.pi)
        off = ((a * ahead + b) * ahead + c) * ahead + d - self._size(self._size.x)
        return edge if np.abs(off).max() < _SAME_EDGE else None

    def place(self, index: Int[Array, " images"], sky: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Coordinates of directions N on sheets of the given index."""
        return np.where((index == 0)[:, None], sky, self._place(self._about_hole(sky)))

    def sky(self, index: Int[Array, " images"], place: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Directions N at the given coordinates."""
        unit = place / np.maximum(lengths(place)[:, None], 1e-300)
        return np.where((index == 0)[:, None], unit, self._sky(place))

    def scaled(self, sky: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Coordinates (x, y, 0) of directions N: angles from the hole in units of that to the shadow edge."""
        about = self._about_hole(sky)
        part, angle = about.distance / about.size, about.angle
        return part[:, None] * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)

    def unscaled(self, place: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Directions N at such coordinates."""
        angle = np.arctan2(place[:, 1], place[:, 0])
        distance = np.minimum(lengths(place) * self._size(angle), np.pi)
        return self._directions(angle, distance)

    def rate(
        self, index: Int[Array, " images"], sky: Float[Array, "images 3"], drift: Float[Array, "images 3"]
    ) -> Float[Array, "images 3"]:
        """Rates of the coordinates of images that drift along tangents of the sky."""
        return np.where((index == 0)[:, None], drift, self._rate(self._about_hole(sky), drift))

    def blur(
        self, index: Int[Array, " images"], sky: Float[Array, "images 3"], error: Float[Array, " images"]
    ) -> Float[Array, " images"]:
        """Errors of coordinates of images whose places on the sky have errors (radians), mostly along the edge."""
        _, theta, phi = (sky @ self._axes).T
        across = np.hypot(theta, phi)
        return error / np.where(index == 0, 1, np.maximum(across, limits.NEAREST))

    def stepped(
        self, sky: Float[Array, "images 3"], step: Float[Array, "images 3"], part: Float[Array, " images"]
    ) -> Step:
        """Directions reached by parts of tangent steps (radians), and the parts: less where steps are too long.

        Close to the hole a step keeps its angle and depth rates, so that it bends with the layers of images; elsewhere
        it runs along a great circle.
        """
        about = self._about_hole(sky)
        place, rate = self._place(about), self._rate(about, step)
        bent = (place[:, 1] > limits.DEEP) & (lengths(step) > limits.STRAIGHT)
        turns, depths = np.abs(rate[:, :2].T)
        short = part / np.maximum(np.maximum(turns / limits.LONGEST_TURN, depths / limits.LONGEST_DEPTH), 1)
        along = self._sky(place + rate * short[:, None])
        straight_step, part = straight(sky, step, part)
        return np.where(bent[:, None], along, straight_step), np.where(bent, short, part)

    def polar(self, sky: Float[Array, "images 3"]) -> Float[Array, "images 2"]:
        """(angle, part) of directions N: part, the distance from the hole's direction by that of the shadow edge."""
        about = self._about_hole(sky)
        return np.stack([about.angle, about.distance / about.size], axis=-1)

    def from_polar(self, place: Float[Array, "images 2"]) -> Float[Array, "images 3"]:
        """Directions N at such coordinates."""
        return self._directions(place[:, 0], place[:, 1] * self._size(place[:, 0]))

    def polar_rate(self, sky: Float[Array, "images 3"], drift: Float[Array, "images 3"]) -> Float[Array, "images 2"]:
        """Rates of (angle, part) along tangents of the sky."""
        about = self._about_hole(sky)
        turning, outward = self._turning(about, drift)
        part = about.distance / about.size
        return np.stack([turning, (outward - part * self._size(about.angle, 1) * turning) / about.size], axis=-1)

    def drift(self, sky: Float[Array, "images 3"], rate: Float[Array, "images 2"]) -> Float[Array, "images 3"]:
        """Tangents of the sky along which (angle, part) have given rates: the inverse of `polar_rate`."""
        about = self._about_hole(sky)
        turning, part = rate[:, 0], about.distance / about.size
        outward = about.size * rate[:, 1] + part * self._size(about.angle, 1) * turning
        c, s, across, along = np.cos(about.angle), np.sin(about.angle), np.sin(about.distance), np.cos(about.distance)
        parts = [
            across * outward,
            along * c * outward - across * s * turning,
            along * s * outward + across * c * turning,
        ]
        return np.stack(parts, axis=-1) @ self._axes.T

    def _about_hole(self, sky: Float[Array, "images 3"]) -> _AboutHole:
        toward = sky @ self._axes
        r, theta, phi = toward.T
        across, angle = np.hypot(theta, phi), np.arctan2(phi, theta)
        return _AboutHole(toward, across, angle, np.arctan2(across, -r), self._size(angle))

    def _place(self, about: _AboutHole) -> Float[Array, "images 3"]:
        """(angle, depth, 0)."""
        depth = np.log((np.pi - about.size) / about.edge_distance)
        return np.stack([about.angle, depth, np.zeros_like(depth)], axis=-1)

    def _rate(self, about: _AboutHole, drift: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Rates of (angle, depth, 0) along tangents of the sky."""
        turning, outward = self._turning(about, drift)
        slope = self._size(about.angle, 1)
        deepening = -slope * turning / (np.pi - about.size) - (outward - slope * turning) / about.edge_distance
        return np.stack([turning, deepening, np.zeros_like(turning)], axis=-1)

    def _turning(self, about: _AboutHole, drift: Float[Array, "images 3"]) -> tuple[Array, Array]:
        """Rates of the position angle and of the distance along tangents of the sky."""
        (r, theta, phi), (along_r, along_theta, along_phi) = about.toward.T, (drift @ self._axes).T
        across = np.maximum(about.across, 1e-150)
        outward = along_r * across - r * (theta * along_theta + phi * along_phi) / across
        return (theta * along_phi - phi * along_theta) / across**2, outward

    def _sky(self, place: Float[Array, "images 3"]) -> Float[Array, "images 3"]:
        """Directions N at (angle, depth)."""
        angle, size = place[:, 0], self._size(place[:, 0])
        return self._directions(angle, size + (np.pi - size) * np.exp(-np.clip(place[:, 1], 0, DEEPEST)))

    def _directions(
        self, angle: Float[Array, " images"], distance: Float[Array, " images"]
    ) -> Float[Array, "images 3"]:
        """Directions N at distances from the direction to the hole."""
        across = np.sin(distance)
        line_of_sight = np.stack([-np.cos(distance), across * np.cos(angle), across * np.sin(angle)], axis=-1)
        sky = line_of_sight @ self._axes.T
        return unit(sky)


def edge_size(camera: Viewer) -> Spline:
    """Distance (radians) of the shadow edge from the direction to the hole, for a camera at rest: by position angle."""
    edge = -edge_photons(camera, even_phases(camera, np.arange(_TABLE) / _TABLE))
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
    part = part / np.maximum(lengths(step) / limits.LONGEST, 1)
    return moved(sky, step * part[:, None]), part


def chart_difference(
    index: Int[Array, "*#steps"], start: Float[Array, "*#steps 3"], end: Float[Array, "*#steps 3"]
) -> Float[Array, "*#steps 3"]:
    """Steps from places to places on the sheets of the given index, the short way round in angle."""
    step = end - start
    angle = np.where(index == 0, step[..., 0], (step[..., 0] + np.pi) % (2 * np.pi) - np.pi)
    return np.concatenate([angle[..., None], step[..., 1:]], axis=-1)
