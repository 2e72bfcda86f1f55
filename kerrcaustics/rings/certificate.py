"""Checks of the edges of lensing bands: they are met once by each line, and rays beside them end on the right sides."""

import numpy as np

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.lens_map.plane_edges import (
    CrossingCircles,
    PlaneEdges,
    crossing_gap,
    edge_phase_of,
    interpolated,
    lines_on,
)
from kerrcaustics.lens_map.plane_map import plane_rays
from kerrcaustics.lens_map.sky_lines import lines_across
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Lines that are looked at all along, places on each side of the shadow edge, and the first and the last of them.
_LINES, _PLACES = 32, 50
_CLOSEST, _FARTHEST = 1e-15, 0.999999
# Rays beside each curve.
_RAYS = 48
# Least and largest distance of them from it, relative to its distance from the shadow edge.
_NEAREST, _FARTHEST_RAY = 1e-9, 1e-2
_SEED = 5


def met_once(camera: Viewer, circles: CrossingCircles) -> Bool[Array, " circles"]:
    """True for circles that each of some lines meets once, by the sign of the gap at places along them."""
    lines = lines_on(camera, _LINES)
    inward, outward = (np.geomspace(_CLOSEST, _FARTHEST * far, _PLACES, axis=1) for far in (-lines.first, lines.last))
    sky = lines.sky(np.concatenate([-inward[:, ::-1], outward], axis=1))
    gap = crossing_gap(camera, np.repeat(sky[:, :, None], len(circles.radius), axis=2), *circles) > 0
    return ((gap[:, 1:] != gap[:, :-1]).sum(axis=1) == 1).all(axis=0)


def wrong_rays(camera: Viewer, circles: CrossingCircles, edges: PlaneEdges) -> Int[Array, " circles"]:
    """The number of rays beside each curve that end on the wrong side of its circle, farther from it than its error.

    Rays are traced, in random directions on both sides, and cross the plane at a radius that has its own error.
    """
    random = np.random.default_rng(_SEED)
    count = len(circles.radius)
    chi = random.uniform(0, 2 * np.pi, _RAYS)
    lines = lines_across(camera, edge_phase_of(camera, chi))
    offset = random.choice([-1, 1], (_RAYS, count)) * np.exp(
        random.uniform(np.log(_NEAREST), np.log(_FARTHEST_RAY), (_RAYS, count))
    )
    curve = interpolated(edges.distance, chi)
    # A curve that crosses the shadow edge has no distance there to which others are relative.
    apart = offset * np.maximum(np.abs(curve), edges.error.max(axis=0) / _NEAREST)
    distance = np.clip(curve + apart, _FARTHEST * lines.first[:, None], _FARTHEST * lines.last[:, None])
    sky, outside = lines.sky(distance), distance > curve
    wrong = np.empty((_RAYS, count), bool)
    for crossing in np.unique(circles.crossing):
        columns = circles.crossing == crossing
        side, known = _sides(camera, sky[:, columns], int(crossing), circles.radius[columns])
        wrong[:, columns] = known & (side != outside[:, columns])
    return (wrong & (np.abs(distance - curve) > _errors(edges, curve))).sum(axis=0)


def _errors(edges: PlaneEdges, curve: Float[Array, "rays circles"]) -> Float[Array, "rays circles"]:
    """Errors of points between lines, as at the lines."""
    relative = (edges.error / np.abs(edges.distance)).min(axis=0)
    return np.minimum(edges.error.max(axis=0), np.maximum(relative * np.abs(curve), edges.error.min(axis=0)))


def _sides(
    camera: Viewer, sky: Float[Array, "rays circles 3"], crossing: int, radius: Float[Array, " circles"]
) -> tuple[Bool[Array, "rays circles"], Bool[Array, "rays circles"]]:
    """True for rays that cross the plane beyond circles; True where that is known."""
    rays = plane_rays(camera, sky, EquatorialPlane(crossing))
    crosses = np.isfinite(rays.radius)
    beyond = np.where(crosses, rays.radius > radius, rays.status != Status.CAPTURED)
    with np.errstate(invalid="ignore"):
        doubtful = crosses & (np.abs(rays.radius / radius - 1) < 10 * rays.error)
    return beyond, (rays.status != Status.INACCURATE) & ~doubtful
