"""Coordinates on the camera sky that follow the shadow edge.

A line leaves the shadow edge at curve parameter `turn` and runs straight away from the hole, to the direction
opposite to it. Along it `depth` counts e-foldings of the distance to the edge: distance = reach exp(-depth),
where reach is the distance from the edge to the antipode. Critical curves of every order are smooth curves
depth(turn), about evenly spaced in depth.

All of it lives on the sky of the fiducial observer: caustics do not depend on the camera's velocity.
"""

import numpy as np

from kerrcaustics.spacetime.arrays import HostReals, HostVectors
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.shadow import edge_photons

# Below this distance from the edge, reach exp(-DEEPEST), a direction in double precision has no digits left.
DEEPEST = 32.0


def looking(camera: Camera, turn: HostReals, depth: HostReals) -> HostVectors:
    """Looking directions at (turn, depth), in FIDO components (r, theta, phi).

    A looking direction is minus the direction of motion of the photon seen there.

    Errors: about 1e-16 rad; the distance from the edge keeps its relative accuracy down to 1e-15 rad.
    """
    return beside_edge(camera, turn, np.exp(-np.asarray(depth, float)))


def line_reach(camera: Camera, turn: HostReals) -> HostReals:
    """Length of the lines (radians), from the edge to the direction opposite to the hole."""
    photons = edge_photons(camera, turn)
    return np.pi - np.arctan2(np.hypot(photons[..., 1], photons[..., 2]), photons[..., 0])


def beside_edge(camera: Camera, turn: HostReals, part: HostReals) -> HostVectors:
    """Looking directions on the lines at a part of the reach from the edge, negative inside the shadow.

    Parameters and errors as for `looking`, whose part is exp(-depth).
    """
    edge = -edge_photons(camera, turn)
    radial = -edge[..., :1]
    across = np.hypot(edge[..., 1:2], edge[..., 2:])
    # Tangent to the sky at the edge, away from the hole, whose centre lies at (-1, 0, 0).
    away = np.concatenate([across, radial * edge[..., 1:] / across], axis=-1)
    distance = line_reach(camera, turn)[..., None] * np.asarray(part, float)[..., None]
    direction = edge * np.cos(distance) + away * np.sin(distance)
    return direction / np.linalg.norm(direction, axis=-1, keepdims=True)
