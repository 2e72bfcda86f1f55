"""Winding of the images of critical curves about a star: image counts without a search for images.

The sky map takes a sheet of the camera sky to the celestial sphere without folds, so the number of images of a star on
it changes only where the star crosses the image of an edge of the sheet: a caustic. Counted along the meridian from the
star to the north pole, the signed crossings of both edges give the count at the star from that at the pole.

A caustic is held as a polygon of great circles. Where a star is so close to a side that the caustic could be on its
other side, that side is halved for this star alone, as often as it takes: what one star asks for changes no other
star's answer.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kerrcaustics.curves.critical_curves import BLUR_ERRORS, CriticalCurve, CriticalCurves, points_between
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# A side is close to a star if the distance is below so many times the height of the arc over it.
_CAUTION = 4.0
_MOST_HALVINGS = 45
# For so many stars a table of all distances is quicker than a tree.
_FEW_STARS = 16
_TURN = 2 * np.pi
_TURNS = np.array([-_TURN, 0.0, _TURN])


@dataclass(frozen=True)
class Winding:
    """The winding of a caustic about stars, one entry for each star, and the points that were added to the curve.

    count: signed crossings of the meridian from the star to the north pole.
    on_caustic: True where the star cannot be distinguished from the caustic.
    distance: distance of the star from the nearest known point of the caustic, radians.
    star: star for which each point was added.
    points: points added between those of the curve.
    """

    count: Int[Array, " stars"]
    on_caustic: Bool[Array, " stars"]
    distance: Float[Array, " stars"]
    star: Int[Array, " points"]
    points: Points

    def __getitem__(self, chosen: Int[Array, " chosen"]) -> "Winding":
        """The same of some of the stars."""
        number = np.full(len(self.count), -1)
        number[chosen] = np.arange(len(chosen))
        owner = number[self.star]
        stars = self.count[chosen], self.on_caustic[chosen], self.distance[chosen]
        return Winding(*stars, owner[owner >= 0], self.points[owner >= 0])


@dataclass(frozen=True)
class _Sides(Rows):
    """Sides of polygons, great circles from a point of a caustic to the next one.

    one: points at the starts.
    other: points at the ends.
    at_cusp: True on sides at a cusp or next to one, where the caustic reverses its direction.
    height: upper bound for the distance of the caustic from the side, radians.
    south: normal of the great circle, toward the south pole.
    """

    one: Points
    other: Points
    at_cusp: Bool[Array, " sides"]
    height: Float[Array, " sides"]
    south: Float[Array, "sides 3"]

    @property
    def error(self) -> Float[Array, " sides"]:
        """The error of the points, with some caution."""
        return BLUR_ERRORS * np.maximum(self.one.error, self.other.error)

    @property
    def margin(self) -> Float[Array, " sides"]:
        """A star closer than this may be on either side of the caustic."""
        return _CAUTION * self.height + self.error

    def distance(self, star: Float[Array, "*batch sides 3"]) -> Float[Array, "*batch sides"]:
        """Distance of stars from the sides, taken as straight."""
        return distance_from_sides(self.one.direction, self.other.direction, star)

    def azimuths(self) -> tuple[Array, Array, Array]:
        """Western and eastern end in azimuth, and +1 for a side that runs east, -1 west: it covers all but the west."""
        (x, y, _), (x_end, y_end, _) = self.one.direction.T, self.other.direction.T
        azimuth, change = np.arctan2(y, x), np.arctan2(x * y_end - y * x_end, x * x_end + y * y_end)
        # The azimuth of the end itself, not a sum, so that neighbouring sides leave no gap.
        azimuth_end = np.arctan2(y_end, x_end)
        azimuth_end = azimuth_end + _TURN * np.round((azimuth + change - azimuth_end) / _TURN)
        return np.minimum(azimuth, azimuth_end), np.maximum(azimuth, azimuth_end), np.sign(change).astype(int)

    def crossings(self, star: Float[Array, "sides 3"]) -> Int[Array, " sides"]:
        """Signed crossings of the meridian from a star to the north pole, one star for each side."""
        west, east, sign = self.azimuths()
        phi = np.arctan2(star[:, 1], star[:, 0])
        across = sum((west < phi + turn) & (phi + turn <= east) for turn in _TURNS)
        return sign * across * (np.einsum("ij,ij->i", self.south, star - self.one.direction) > 0)


@dataclass(frozen=True, eq=False)
class CausticPolygon:
    """A caustic as a closed polygon, for counting stars inside it, with what every count needs of its sides.

    middle, reach: circles that hold all that is close to a side; margin, azimuths: those of the sides.
    """

    curves: CriticalCurves
    curve: CriticalCurve
    sides: _Sides
    margin: Float[Array, " sides"]
    middle: Float[Array, "sides 3"]
    reach: Float[Array, " sides"]
    azimuths: tuple[Array, Array, Array]

    @classmethod
    def of_curve(cls, curves: CriticalCurves, curve: CriticalCurve) -> "CausticPolygon":
        """The polygon through the points of one of the curves."""
        sides = _closed_sides(curve.points)
        first, second = sides.one.direction, sides.other.direction
        margin = sides.margin
        reach = lengths(second - first) / 2 + margin
        return cls(curves, curve, sides, margin, (first + second) / 2, reach, sides.azimuths())

    def winding(self, star: Float[Array, "stars 3"]) -> Winding:
        """The winding of the caustic about stars. A caustic that is a point has no inside."""
        if self.curve.is_point:
            count, none = np.zeros(len(star), int), np.empty(0, int)
            return Winding(count, self._at_point(star), self.nearest(star), none, self.curve.points[none])
        return self._divided(star)

    def nearest(self, star: Float[Array, "stars 3"]) -> Float[Array, " stars"]:
        """Distance of stars from the sides around the nearest corner."""
        corners = self.curve.points.direction
        if len(star) <= _FEW_STARS:
            corner = lengths(corners[:, None] - star).argmin(axis=0)
        else:
            from scipy.spatial import KDTree

            corner = KDTree(corners).query(star)[1]
        before, after = corners[corner - 1], corners[(corner + 1) % len(corners)]
        return np.minimum(
            distance_from_sides(before, corners[corner], star), distance_from_sides(corners[corner], after, star)
        )

    @cached_property
    def _no_points(self) -> Points:
        return self.curve.points[:0]

    def _at_point(self, star: Float[Array, "stars 3"]) -> Bool[Array, " stars"]:
        return lengths(star - self.curve.points.direction.mean(axis=0)) <= self.curve.blur

    def _divided(self, star: Float[Array, "stars 3"]) -> Winding:
        """The winding, with the sides close to a star halved for it."""
        count, on_caustic, distance = self._crossings(star), np.zeros(len(star), bool), self.nearest(star)
        number, which = self._close(star)
        if not len(number):
            return Winding(count, on_caustic, distance, which, self._no_points)
        sides = self.sides[number]
        np.add.at(count, which, -sides.crossings(star[which]))
        points, owners = [self._no_points], [which[:0]]
        for _ in range(_MOST_HALVINGS):
            if not len(sides):
                break
            on_caustic[which[sides.height <= sides.error]] = True
            split = ~on_caustic[which]
            split[split], middle = self._middles(sides[split])
            np.add.at(count, which[~split], sides[~split].crossings(star[which[~split]]))
            sides, which = _halves(sides[split], middle), which[split]
            points.append(middle)
            owners.append(which)
            which = np.tile(which, 2)
            away = sides.distance(star[which])
            np.minimum.at(distance, which, away)
            near = away <= sides.margin
            np.add.at(count, which[~near], sides[~near].crossings(star[which[~near]]))
            sides, which = sides[near], which[near]
        # What no halving settled.
        on_caustic[which] = True
        np.add.at(count, which, sides.crossings(star[which]))
        return Winding(count, on_caustic, distance, np.concatenate(owners), points[0].joined(*points[1:]))

    def _middles(self, sides: _Sides) -> tuple[Bool[Array, " sides"], Points]:
        """True for sides with a point of the caustic halfway along their parameter; and the points."""
        points, order = self.curve.points, self.curve.order
        if not len(sides):
            return np.zeros(0, bool), self._no_points
        closed = points[-3:].shifted(-1).joined(points, points[:3].shifted(1))
        edge_phase = (sides.one.edge_phase + sides.other.edge_phase) / 2
        middles = points_between(self.curves.search(), {order: closed}, {order: np.unique(edge_phase)})[order]
        known = np.isin(edge_phase, middles.edge_phase)
        return known, middles[np.searchsorted(middles.edge_phase, edge_phase[known])]

    def _close(self, star: Float[Array, "stars 3"]) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Pairs of a side and a star that is close to it."""
        if len(star) <= _FEW_STARS:
            number, which = np.nonzero(lengths(self.middle[:, None] - star) <= self.reach[:, None])
        else:
            from scipy.spatial import KDTree

            nearby = KDTree(star).query_ball_point(self.middle, self.reach)
            number = np.repeat(np.arange(len(nearby)), [len(stars) for stars in nearby])
            which = np.concatenate([np.asarray(stars, int) for stars in nearby])
        start, end = self.sides.one.direction, self.sides.other.direction
        near = distance_from_sides(start[number], end[number], star[which]) <= self.margin[number]
        return number[near], which[near]

    def _crossings(self, star: Float[Array, "stars 3"]) -> Int[Array, " stars"]:
        """Signed crossings of the meridians from stars to the north pole, with the undivided sides."""
        side, which = self._below(np.arctan2(star[:, 1], star[:, 0]))
        start, south, sign = self.sides.one.direction, self.sides.south, self.azimuths[2]
        above = np.einsum("ij,ij->i", south[side], star[which] - start[side]) > 0
        count = np.zeros(len(star), int)
        np.add.at(count, which[above], sign[side[above]])
        return count

    def _below(self, phi: Float[Array, " stars"]) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Pairs of a side and a star with an azimuth that it covers."""
        west, east, _ = self.azimuths
        turned = phi + _TURNS[:, None]
        if len(phi) <= _FEW_STARS:
            _, side, which = np.nonzero((west[:, None] < turned[:, None]) & (turned[:, None] <= east[:, None]))
            return side, which
        order = np.argsort(phi)
        sides, stars = [], []
        for now in turned[:, order]:
            first, last = (np.searchsorted(now, edge, side="right") for edge in (west, east))
            number = np.maximum(last - first, 0)
            side = np.repeat(np.arange(len(first)), number)
            sides.append(side)
            stars.append(order[np.arange(len(side)) + (first - np.cumsum(number) + number)[side]])
        return np.concatenate(sides), np.concatenate(stars)


def distance_from_sides(
    start: Float[Array, "*batch 3"], end: Float[Array, "*batch 3"], star: Float[Array, "*batch 3"]
) -> Float[Array, "*batch"]:
    """Distance of stars from sides, taken as straight."""
    side, way = end - start, star - start
    length = (side * side).sum(axis=-1)
    part = np.clip((side * way).sum(axis=-1) / np.where(length == 0, 1, length), 0, 1)
    return lengths(way - part[..., None] * side)


def _closed_sides(points: Points) -> _Sides:
    """The sides of the polygon through points of a caustic.

    The caustic runs along the major axis of the image. Next to a cusp it turns back: there it leaves the side by no
    more than the sides around are long.
    """
    following = points[1:].joined(points[:1].shifted(1))
    step = following.direction - points.direction
    chord = lengths(step)
    along = np.einsum("ij,ij->i", step, points.major)
    agree = np.sign(np.einsum("ij,ij->i", points.major, following.major))
    at_cusp = np.sign(along) * agree != np.sign(np.roll(along, -1))
    at_cusp |= np.roll(at_cusp, 1)
    longest = np.maximum(chord, np.maximum(np.roll(chord, 1), np.roll(chord, -1)))
    return _sides(points, following, at_cusp, longest)


def _halves(sides: _Sides, middle: Points) -> _Sides:
    """The first halves of divided sides, then the second ones: at a cusp the caustic leaves them by a quarter."""
    at_cusp, height = np.tile(sides.at_cusp, 2), np.tile(sides.height / 4, 2)
    return _sides(sides.one.joined(middle), middle.joined(sides.other), at_cusp, height)


def _sides(first: Points, second: Points, at_cusp: Bool[Array, " sides"], height: Float[Array, " sides"]) -> _Sides:
    """Sides from points to points; height: upper bound for the distance of the caustic from the side at cusps."""
    step = second.direction - first.direction
    chord = lengths(step)
    bend = lengths(np.cross(first.major, second.major))
    # A side at a large angle to the curve's own direction has a cusp next to it.
    lean = lengths(np.cross(step / np.where(chord == 0, 1, chord)[:, None], first.major))
    height = np.where(at_cusp, height, chord * np.maximum(bend, 2 * lean))
    # Short sides ask for differences, not products of unit vectors.
    normal = np.cross(first.direction, step)
    return _Sides(first, second, at_cusp, height, normal * np.where(normal[:, 2:] < 0, 1, -1))


def degrees(grid: Float[Array, "rows columns 3"], star: Float[Array, "stars 3"]) -> Int[Array, " stars"]:
    """Signed numbers of times the image of a grid covers stars: a cell is two spherical triangles."""
    at = grid @ star.T
    sides = ((grid[:-1], grid[1:]), (grid[:, :-1], grid[:, 1:]), (grid[:-1, :-1], grid[1:, 1:]))
    down, along, over = (np.cross(first, last) @ star.T for first, last in sides)
    triangles = (
        (down[:, :-1], along[1:], -over, at[:-1, :-1] + at[1:, :-1] + at[1:, 1:]),
        (over, -down[:, 1:], -along[:-1], at[:-1, :-1] + at[1:, 1:] + at[:-1, 1:]),
    )
    total = np.zeros(len(star), int)
    for one, two, three, middle in triangles:
        # The star lies in the triangle where it is on the same side of all three sides.
        left = (one > 0) & (two > 0) & (three > 0) & (middle > 0)
        right = (one < 0) & (two < 0) & (three < 0) & (middle > 0)
        total += left.sum(axis=(0, 1)) - right.sum(axis=(0, 1))
    return total
