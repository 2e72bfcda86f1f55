"""Question 2: star images on both sides of caustics."""

from dataclasses import dataclass

import numpy as np

import kerrcaustics as kc
from kerrcaustics.curves.critical_curves import points_between
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.spacetime.sphere import angle_between, tangent_basis

Array = np.ndarray

_TOLERANCE = 1e-12
# Step on the sky over which the fold's curvature is taken, in parts of the distance from the shadow edge.
_STEP = 1e-3
# Newton's method starts where the pair is expected, and at these parts of the way to it.
_PARTS = (1.0, 0.7, 1.4, 0.4)
# Images farther from the critical point than so many times the fold's own distance are not of the pair.
_REACH = 3.0


@dataclass(frozen=True)
class Crossings:
    """Two stars at a distance (radians) on either side of points of the caustic of one order: one entry a point.

    Inner is the star to whose side the sky map folds over. winding (n, orders): how many more pairs the caustics'
    winding gives for it than for the outer one, by order; inside, outside (n, 2): whether Newton's method finds an
    image of index order - 1, and of index order, next to the critical point, for the inner and the outer star; away
    (n, 2): their distances from it on the sky, radians; fold (n,): that expected of a fold,
    sqrt(2 distance / curvature).
    """

    order: int
    distance: float
    winding: Array
    inside: Array
    outside: Array
    away: Array
    fold: Array

    @property
    def alone(self) -> Array:
        """True (n,) where the caustics' winding changes for this order alone: no other piece runs between the stars."""
        others = np.delete(self.winding, self.order - 1, axis=1)
        return (np.abs(self.winding[:, self.order - 1]) == 1) & (others == 0).all(axis=1)

    @property
    def is_pair(self) -> Array:
        """True (n,) where the winding gives a pair more inside, both images are there, and neither outside."""
        return self.alone & (self.winding[:, self.order - 1] == 1) & self.inside.all(axis=1) & ~self.outside.any(axis=1)


def crossings_of(sheets: Sheets, order: int, count: int, distances: tuple, rng: np.random.Generator) -> list[Crossings]:
    """Crossings at `count` random points of the caustic of one order, for distances in parts of the caustic's size."""
    points = random_points(sheets, order, count, rng)
    null, curvature, normal = _folds(sheets, order, points)
    centre = points.direction.mean(axis=0)
    size = np.linalg.norm(points.direction - centre, axis=1).max()
    found = []
    for distance in size * np.asarray(distances):
        fold = np.sqrt(2 * distance / curvature)
        stars = [points.direction * np.cos(distance) + side * normal * np.sin(distance) for side in (1, -1)]
        winding = _pairs(sheets, stars[0]) - _pairs(sheets, stars[1])
        parts = (_PARTS, _PARTS[:1])
        near = [_images(sheets, s, order, points, null * fold[:, None], p) for s, p in zip(stars, parts, strict=True)]
        near = [np.where(away < _REACH * fold[:, None], away, np.nan) for away in near]
        inside, outside = (np.isfinite(away) for away in near)
        found.append(Crossings(order, distance, winding, inside, outside, near[0], fold))
    return found


def random_points(sheets: Sheets, order: int, count: int, rng: np.random.Generator) -> Points:
    """Points of the caustic of one order, spread evenly along its length."""
    points = sheets.curves.curves[order - 1].points
    around = points.shifted(-1).joined(points, points.shifted(1))
    length = np.linalg.norm(np.diff(around.direction, axis=0), axis=1)
    # From the first point of the middle turn to that of the next one.
    n = len(points)
    run = np.concatenate([[0], np.cumsum(length[n : 2 * n])])
    edge_phase = np.interp(rng.uniform(0, run[-1], count), run, around.edge_phase[n : 2 * n + 1])
    return points_between(sheets.curves.search(), {order: around}, {order: np.sort(edge_phase)})[order]


def _pairs(sheets: Sheets, star: Array) -> Array:
    """Pairs (n, orders) of images that each caustic gives the stars, from its winding about them; 0 at the pole."""
    signs = (-1) ** np.arange(len(sheets.polygons))
    return signs * np.stack([polygon.winding(star).count for polygon in sheets.polygons], axis=-1)


def _folds(sheets: Sheets, order: int, points: Points) -> tuple[Array, Array, Array]:
    """Null directions (n, 2) as changes of `_beside`, curvature (n,) of the folds, and normals (n, 3) to the inside."""
    sky = sheets.sky(points.line_of_sight)
    jacobian = kc.trace_beams(
        sheets.camera, sky, "auto", _TOLERANCE, index=False, crossings=False, redshift=False
    ).jacobian
    shortest = np.linalg.svd(jacobian)[2][:, 1]
    small = _STEP * np.eye(2)
    ways = [(_beside(sheets, order, points, e) - _beside(sheets, order, points, -e)) / (2 * _STEP) for e in small]
    basis = tangent_basis(sky)
    matrix = np.stack([[np.einsum("ij,ij->i", e, way) for way in ways] for e in basis])
    null = np.linalg.solve(np.moveaxis(matrix, -1, 0), shortest[..., None])[..., 0]
    # The step on the sky that changes turn and depth by _STEP at most.
    step = _STEP / np.abs(null).max(axis=1)
    sides = [_beside(sheets, order, points, sign * null * step[:, None]) for sign in (1, -1)]
    images = kc.trace_rays(sheets.camera, np.concatenate(sides), "auto", _TOLERANCE).direction
    n = len(points)
    across = np.cross(points.direction, points.major)
    bend = np.einsum("ij,ij->i", images[:n] + images[n:] - 2 * points.direction, across) / step**2
    return null, np.abs(bend), across * np.sign(bend)[:, None]


def _beside(sheets: Sheets, order: int, points: Points, change: Array) -> Array:
    """Directions N (n, 3) beside critical points, by a change (2,) or (n, 2) of turn, and of depth from the curve."""
    edge_phase = points.edge_phase + change[..., 0]
    curve = sheets.sheets[order - 1].inner
    depth = points.depth + curve(edge_phase) - curve(points.edge_phase) + change[..., 1]
    return sheets.sky(sky_lines.line_of_sight(sheets.camera, edge_phase, depth))


def _images(sheets: Sheets, star: Array, order: int, points: Points, change: Array, parts: tuple) -> Array:
    """Distances (n, 2) from critical points of the images of index order - 1 and order next to them; NaN if none."""
    away = np.full((len(star), 2), np.nan)
    critical = sheets.sky(points.line_of_sight)
    for part in parts:
        # The fold's null direction leads to the one sheet on one side, to the other sheet on the other side.
        inner = np.sign(change[:, 1:])
        for k, side in enumerate((-inner, inner)):
            missing = np.flatnonzero(np.isnan(away[:, k]))
            start = _beside(sheets, order, points[missing], (part * side * change)[missing])
            which, near, _ = find_roots(sheets.camera, star[missing], np.full(len(missing), order - 1 + k), start)
            distance = angle_between(near, critical[missing[which]])
            away[missing[which], k] = distance
    return away
