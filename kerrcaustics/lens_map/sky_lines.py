"""Coordinates on the camera sky that follow the shadow edge.

A line leaves the shadow edge at a parameter, the edge phase, and runs straight away from the hole, to the direction
opposite to it. Along it `depth` counts e-foldings of the distance to the edge: distance = reach exp(-depth),
where reach is the distance from the edge to the antipode. Critical curves of every order are smooth curves
depth(edge phase), about evenly spaced in depth.

All of it lives on the sky of the fiducial observer: caustics do not depend on the camera's velocity.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kerrcaustics.lens_map import newton_limits
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.arrays import HostParts, HostReals, HostVectors
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.shadow import edge_photons
from kerrcaustics.spacetime.sphere import unit
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

DEEPEST = newton_limits.DEEPEST
"""Below this distance from the edge, reach exp(-DEEPEST), a direction in double precision has no digits left."""

# Edges of so many lines are kept at most.
_MOST_KEPT = 10_000


def line_of_sight(camera: Viewer, edge_phase: HostParts, depth: HostParts) -> HostVectors:
    """Lines of sight at (edge phase, depth), in FIDO components (r, theta, phi); both are broadcast.

    A line of sight is minus the direction of motion of the photon seen there.

    Errors: about 1e-16 rad; the distance from the edge keeps its relative accuracy down to 1e-15 rad.
    """
    return beside_edge(camera, edge_phase, np.exp(-np.asarray(depth, float)))


def line_reach(camera: Viewer, edge_phase: HostReals) -> HostReals:
    """Length of the lines (radians), from the edge to the direction opposite to the hole."""
    return _from_edge(camera, edge_phase)[2]


def wide_reach(camera: Viewer, edge_phase: HostReals, zoom: float) -> HostReals:
    """Length of the lines (radians) on a sky that is made smaller: see `on_wide_sky`."""
    reach = line_reach(camera, edge_phase)
    return reach if zoom == 1 else 2 * np.arctan(np.tan(reach / 2) / zoom)


def on_wide_sky(camera: Viewer, edge_phase: HostParts, distance: HostParts, zoom: float) -> HostVectors:
    """Lines of sight on the lines at a distance (radians) from the edge, as it is on a sky that is made smaller.

    On that sky the tangents of half the angles from the hole are `zoom` times those of the sky itself: where the hole
    is large and all else lies far out, lines show both. Errors as for `line_of_sight`.
    """
    if zoom == 1:
        return beside_edge(camera, edge_phase, distance / line_reach(camera, edge_phase))
    edge, step = 1 / np.tan(line_reach(camera, edge_phase) / 2), np.tan(np.asarray(distance, float) / 2)
    # The difference of both tangents, as a fraction, so that the distance keeps its digits.
    above, below = step * (1 + (zoom * edge) ** 2), np.maximum(zoom * (1 - zoom * edge * step), 0)
    away = 2 * np.arctan2(above, below * (1 + edge**2) + above * edge)
    return beside_edge(camera, edge_phase, away / line_reach(camera, edge_phase))


def beside_edge(camera: Viewer, edge_phase: HostParts, part: HostParts) -> HostVectors:
    """Lines of sight on the lines at a part of the reach from the edge, negative inside the shadow.

    Parameters and errors as for `line_of_sight`, whose part is exp(-depth); both are broadcast.
    """
    edge, away, reach = _from_edge(camera, edge_phase)
    distance = (reach * np.asarray(part, float))[..., None]
    direction = edge * np.cos(distance) + away * np.sin(distance)
    return unit(direction)


_Edge = tuple[HostVectors, HostVectors, HostReals]


def _from_edge(camera: Viewer, edge_phase: HostReals) -> _Edge:
    """Lines of sight of the shadow edge, tangents there away from the hole, and the reach of the lines.

    They are kept for a few sets of lines: searches come back to the same ones, at other depths.
    """
    phases = np.asarray(edge_phase, float)
    if phases.size > _MOST_KEPT:
        return _beside_hole(camera, phases)
    return _cached_edge(camera, phases.shape, phases.tobytes())


@lru_cache(maxsize=32)
def _cached_edge(camera: Viewer, shape: tuple[int, ...], phases: bytes) -> _Edge:
    parts = _beside_hole(camera, np.frombuffer(phases).reshape(shape))
    for part in parts:
        part.setflags(write=False)
    return parts


def _beside_hole(camera: Viewer, edge_phase: HostReals) -> _Edge:
    """`_from_edge`, computed."""
    edge = -edge_photons(camera, edge_phase)
    radial = -edge[..., :1]
    across = np.hypot(edge[..., 1:2], edge[..., 2:])
    # The centre of the hole lies at (-1, 0, 0).
    away = np.concatenate([across, radial * edge[..., 1:] / across], axis=-1)
    return edge, away, np.asarray(np.pi - np.arctan2(across[..., 0], radial[..., 0]))


@dataclass(frozen=True)
class Lines(Rows):
    """Great circles on the sky of a camera at rest, along which distances are radians.

    edge_phase: parameter of the shadow edge, or of another set of lines.
    start: N at distance 0.
    ahead: unit tangent at distance 0.
    first: distance of the first end.
    last: distance of the last end.
    """

    edge_phase: Float[Array, " lines"]
    start: Float[Array, "lines 3"]
    ahead: Float[Array, "lines 3"]
    first: Float[Array, " lines"]
    last: Float[Array, " lines"]

    def sky(self, distance: HostReals) -> HostVectors:
        """Directions N (lines, ..., 3) at distances (lines, ...) along each line."""
        start, ahead = (v.reshape(len(self), *[1] * (distance.ndim - 1), 3) for v in (self.start, self.ahead))
        sky = start * np.cos(distance)[..., None] + ahead * np.sin(distance)[..., None]
        return sky / np.linalg.norm(sky, axis=-1, keepdims=True)

    def tangent(self, distance: Float[Array, " lines"]) -> Float[Array, "lines 3"]:
        """The unit vectors along the lines at one distance on each."""
        return self.ahead * np.cos(distance)[:, None] - self.start * np.sin(distance)[:, None]


def lines_across(camera: Viewer, edge_phase: Float[Array, " lines"]) -> Lines:
    """Lines across the shadow edge, from the direction of the hole to the opposite one; distances are 0 at the edge."""
    edge, away, reach = _from_edge(camera, edge_phase)
    frame = camera.frame()
    start, ahead = (sky_from_line_of_sight(frame, part) for part in (edge, away))
    return Lines(edge_phase, start, ahead, reach - np.pi, reach)


def periodic(edge_phase: Float[Array, " lines"], values: Float[Array, " lines *axes"]) -> Spline:
    """A smooth function of the edge phase through values at rising phases of less than one turn."""
    closed = np.append(edge_phase, edge_phase[0] + 2 * np.pi), np.concatenate([values, values[:1]])
    return Spline(*closed, periodic=True)
