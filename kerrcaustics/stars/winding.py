"""How often the images of critical curves wind round a star: image counts without looking for images.

The sky map takes a sheet of the camera sky to the celestial sphere without folds, so the number of images of a star on
it changes only where the star crosses the image of an edge of the sheet: a caustic. Counted along the meridian from the
star to the north pole, the signed crossings of both edges give the count at the star from that at the pole.

A caustic is held as a polygon of great circles, refined where a star is so close that the polygon could be on its other
side.
"""

from threading import Lock

import numpy as np
from scipy.spatial import cKDTree

from kerrcaustics.curves.critical import Points, Search
from kerrcaustics.curves.follow import Course, between

Array = np.ndarray

# A polygon is close to a star if the distance is below so many times the height of the arcs over its sides.
_CAUTION = 4.0
_MOST_HALVINGS = 45
# Stars within so many errors of a caustic cannot be told from it.
_ERRORS = 10.0
# For so many stars a table of all distances is quicker than a tree.
_FEW_STARS = 16


class _Polygon:
    """A closed polygon of great circles through points of a caustic, with what every count needs of its sides."""

    def __init__(self, points: Points) -> None:
        self.points = points
        self.start, self.end = points.direction, np.roll(points.direction, -1, axis=0)
        chord = np.linalg.norm(self.end - self.start, axis=1)
        self.height = _heights(points, chord)
        # No further than the error of the points themselves.
        self.error = _ERRORS * np.maximum(points.error, np.roll(points.error, -1))
        self.margin = _CAUTION * self.height + _ERRORS * points.error
        self.middle, self.reach = (self.start + self.end) / 2, chord / 2 + self.margin
        # A side that runs east counts +1. Each side covers its range of azimuth without its western end.
        (x, y, _), (x_end, y_end, _) = self.start.T, self.end.T
        azimuth, change = np.arctan2(y, x), np.arctan2(x * y_end - y * x_end, x * x_end + y * y_end)
        # The azimuth of the end itself, not a sum, so that neighbouring sides leave no gap.
        other = np.roll(azimuth, -1)
        other = other + 2 * np.pi * np.round((azimuth + change - other) / (2 * np.pi))
        self.west, self.east = np.minimum(azimuth, other), np.maximum(azimuth, other)
        self.sign = np.sign(change).astype(int)
        # To the south of the great circle of the side. Short sides ask for differences, not products of unit vectors.
        normal = np.cross(self.start, self.end - self.start)
        self.south = normal * np.where(normal[:, 2:] < 0, 1, -1)

    def close(self, star: Array) -> tuple[Array, Array]:
        """Pairs of a side and a star (n, 3) that is close to it."""
        if len(star) <= _FEW_STARS:
            away = np.linalg.norm(self.middle[:, None] - star, axis=2)
            sides, stars = np.nonzero(away <= self.reach[:, None])
        else:
            found = cKDTree(star).query_ball_point(self.middle, self.reach)
            sides = np.repeat(np.arange(len(found)), [len(stars) for stars in found])
            stars = np.concatenate([np.asarray(stars, int) for stars in found])
        near = _distance(self.start[sides], self.end[sides], star[stars])[0] <= self.margin[sides]
        return sides[near], stars[near]

    def crossings(self, star: Array) -> Array:
        """Signed crossings (n,) of the meridians from stars (n, 3) to the north pole."""
        phi = np.arctan2(star[:, 1], star[:, 0])
        order = np.argsort(phi)
        count = np.zeros(len(star), int)
        for turn in (-2 * np.pi, 0.0, 2 * np.pi):
            first, last = (np.searchsorted(phi[order] + turn, edge, side="right") for edge in (self.west, self.east))
            number = np.maximum(last - first, 0)
            side = np.repeat(np.arange(len(first)), number)
            place = np.arange(len(side)) - np.repeat(np.cumsum(number) - number, number) + np.repeat(first, number)
            which = order[place]
            above = np.einsum("ij,ij->i", self.south[side], star[which] - self.start[side]) > 0
            np.add.at(count, which[above], self.sign[side[above]])
        return count


class Edge:
    """A caustic as a polygon, for counting stars inside it."""

    def __init__(self, search: Search, course: Course) -> None:
        """The polygon of the course's points; it gains points when stars ask for them."""
        self.order = course.order
        self._search = search
        self._point = course.is_point
        self._polygon = _Polygon(course.points)
        # Searches on several cores share the polygon.
        self._lock = Lock()

    def winding(self, star: Array) -> tuple[Array, Array]:
        """Signed crossings (n,) of the meridians from stars (n, 3) to the north pole, and whether a star lies on it.

        A caustic that is a point has no inside.
        """
        if self._point:
            return np.zeros(len(star), int), self._at_point(star)
        with self._lock:
            touching = self._refined(star)
            polygon = self._polygon
        return polygon.crossings(star), touching

    @property
    def points(self) -> Points:
        """The polygon's corners."""
        return self._polygon.points

    def nearest(self, star: Array) -> tuple[Array, Array, Array]:
        """Turn and depth (n,) of the polygon's place that is nearest to each star (n, 3), and its distance.

        Depths between points are those on straight lines: off by the square of a side's length.
        """
        polygon = self._polygon
        points, size = polygon.points, len(polygon.points)
        if len(star) <= _FEW_STARS:
            corner = np.linalg.norm(polygon.start[:, None] - star, axis=2).argmin(axis=0)
        else:
            corner = cKDTree(polygon.start).query(star)[1]
        sides = np.stack([corner - 1, corner]) % size
        distance, part = _distance(polygon.start[sides], polygon.end[sides], star)
        best, every = distance.argmin(axis=0), np.arange(len(star))
        side, part = sides[best, every], part[best, every]
        following = (side + 1) % size
        d_turn = (points.turn[following] - points.turn[side]) % (2 * np.pi)
        depth = points.depth[side] + part * (points.depth[following] - points.depth[side])
        return points.turn[side] + part * d_turn, depth, distance[best, every]

    def _at_point(self, star: Array) -> Array:
        centre = self.points.direction.mean(axis=0)
        size = np.linalg.norm(self.points.direction - centre, axis=1).max() + self.points.error.max()
        return np.linalg.norm(star - centre, axis=1) <= _ERRORS * size

    def _refined(self, star: Array) -> Array:
        """Refine the polygon around the stars; True for stars that cannot be told from the caustic."""
        touching = np.zeros(len(star), bool)
        for _ in range(_MOST_HALVINGS):
            polygon = self._polygon
            sides, stars = polygon.close(star)
            resolved = polygon.height[sides] <= polygon.error[sides]
            touching[stars[resolved]] = True
            split = np.unique(sides[~resolved & ~touching[stars]])
            if len(split) == 0 or not self._split(split):
                touching[stars[~resolved]] |= len(split) > 0
                break
        return touching

    def _split(self, sides: Array) -> bool:
        """Put a point of the caustic into the middle of the given sides; False when none could be found."""
        points = self.points
        following = np.append(points.turn[1:], points.turn[0] + 2 * np.pi)
        middle = (points.turn[sides] + following[sides]) / 2
        closed = points[-3:].shifted(-1).joined(points, points[:3].shifted(1))
        new = between(self._search, {self.order: closed}, {self.order: middle})[self.order]
        merged = points.joined(new)
        self._polygon = _Polygon(merged[np.argsort(merged.turn, kind="stable")])
        return len(new) > 0


def _heights(points: Points, chord: Array) -> Array:
    """Upper bounds (n,) for how far the caustic leaves the side from each point to the next.

    The caustic runs along the major axis of the image. Next to a cusp it turns back: there it leaves the side by no
    more than the sides around are long.
    """
    major = points.major
    bend = np.linalg.norm(np.cross(major, np.roll(major, -1, axis=0)), axis=1)
    step = np.roll(points.direction, -1, axis=0) - points.direction
    safe = np.where(chord == 0, 1, chord)
    along = np.einsum("ij,ij->i", step, major) / safe
    # A side at a large angle to the curve's own direction has a cusp on it, or next to it.
    lean = np.linalg.norm(np.cross(step / safe[:, None], major), axis=1)
    agree = np.sign(np.einsum("ij,ij->i", major, np.roll(major, -1, axis=0)))
    back = np.sign(along) * agree != np.sign(np.roll(along, -1))
    back |= np.roll(back, 1)
    longest = np.maximum(chord, np.maximum(np.roll(chord, 1), np.roll(chord, -1)))
    return np.where(back, longest, chord * np.maximum(bend, 2 * lean))


def _distance(start: Array, end: Array, star: Array) -> tuple[Array, Array]:
    """Distance of stars (..., 3) from straight sides, and the part of the side before the nearest place on it."""
    side, way = end - start, star - start
    length = (side * side).sum(axis=-1)
    part = np.clip((side * way).sum(axis=-1) / np.where(length == 0, 1, length), 0, 1)
    return np.linalg.norm(way - part[..., None] * side, axis=-1), part


def degree(grid: Array, star: Array) -> int:
    """How often the image (m, n, 3) of a grid covers a star (3,), with sign: a cell is two spherical triangles."""
    total = 0
    first, last = grid[:-1, :-1], grid[1:, 1:]
    for a, b, c in ((first, grid[1:, :-1], last), (first, last, grid[:-1, 1:])):
        # The star lies in the triangle where it is on the same side of all three sides.
        sides = [np.cross(x, y) @ star for x, y in ((a, b), (b, c), (c, a))]
        near = (a + b + c) @ star > 0
        inside = [np.logical_and.reduce([sign * side > 0 for side in sides]) & near for sign in (1, -1)]
        total += int(inside[0].sum()) - int(inside[1].sum())
    return total
