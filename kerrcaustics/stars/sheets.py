"""The camera sky cut along its critical curves: one sheet for every Morse index.

On a sheet the sky map has no fold: every image of a star there is a regular root, and their number is known from the
sheet's edges alone (winding.py). A sheet is covered by a grid in `turn`, the parameter of the lines of sky_lines.py,
and `part`, 0 on the outer critical curve (or opposite to the hole) and 1 on the inner one. The grid is traced as rays;
a star's images are looked for in the cells whose images lie around it.

All of it lives on the sky of a camera at rest: neither caustics nor the order of images depend on the velocity.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from kerrcaustics.beams.trace import trace_rays
from kerrcaustics.curves import sky_lines
from kerrcaustics.curves.critical import Points, Search
from kerrcaustics.curves.follow import Course, follow
from kerrcaustics.spacetime.camera import Camera, sky_from_fido
from kerrcaustics.spacetime.sphere import from_angles, tangent_basis
from kerrcaustics.stars.fold import Fold
from kerrcaustics.stars.winding import Edge, degree

Array = np.ndarray

HIGHEST_INDEX = 6
# Longest step of the grid's image on the celestial sphere, and of the grid on the sky.
_STEP = np.radians(10.0)
# Nodes next to a sheet's edge that are corners of cells, counted from it.
_NEAR_EDGE = np.array([1, 2, 4, 8])
# Lines on which the length of a sheet's image is measured, and points on each.
_PROBES, _PROBE_POINTS = 24, 129
# Circles that cover a cell's image: how much larger than its corners ask for, most of them, and how far, in parts of
# its length, the image may bend.
_REACH, _MOST_BALLS, _SAG = 1.25, 12, 0.05
# How far outside a cell, in parts of it, the bilinear model of the map may put the star: at first, and when searching
# again. And the distance from the critical curves, in parts of a sheet, at which Newton's method starts at least.
NARROW, WIDE = 0.05, 0.5
_INSIDE = 0.002
# The same for a linear model, beside that.
_LINEAR = 0.25
# Circles whose radii differ by less than this factor share a tree.
_ALIKE = 1.5
_TOLERANCE = 1e-12
# Directions where images are counted on the grids, in no special place.
_REFERENCES = from_angles([0.4, 0.9, 1.3, 2.1, 2.6], [1.0, 4.0, 2.5, 5.5, 0.3])


@dataclass(frozen=True)
class Sheet:
    """The part of the camera sky with one Morse index, as a grid.

    turn (m,), the last one a whole turn after the first; part (n,), 0 to 1; direction (m, n, 3): the grid's image on
    the celestial sphere. outer, inner: depth of the critical curves on a line, as functions of turn.
    """

    index: int
    outer: Callable[[Array], Array]
    inner: Callable[[Array], Array]
    turn: Array
    part: Array
    direction: Array

    def depth(self, turn: Array, part: Array) -> Array:
        """Depth on the lines of sky_lines.py."""
        low = self.outer(turn)
        return low + part * (self.inner(turn) - low)


@dataclass(frozen=True)
class _Cells:
    """The cells of all grids, flat.

    sheet; turn and part (n, 2) of two opposite corners; corners (n, 4, 3): images of all four; linear (n, 2, 4): from a
    direction, with a 1 behind it, to the place in the cell, the middle at 0, by a linear map.
    """

    sheet: Array
    turn: Array
    part: Array
    corners: Array
    linear: Array


@dataclass(frozen=True)
class _Circles:
    """Circles of about one radius on the celestial sphere: centres as a tree, the cells that they cover, the radius."""

    tree: cKDTree
    cell: Array
    radius: float


@dataclass(frozen=True)
class Starts:
    """Where images may lie, one entry a guess: which star, which sheet, and the direction N on the sky at rest."""

    star: Array
    sheet: Array
    sky: Array


class Sheets:
    """The sheets of index 0 to max_index of one camera, their edges, and the star counts that these tell."""

    def __init__(self, camera: Camera, max_index: int) -> None:
        """Find the critical curves, trace the grids."""
        self.search = Search(camera, "auto", _TOLERANCE)
        self.camera = self.search.camera
        self.frame = self.camera.frame()
        courses = follow(self.search, max_index + 1, lambda _what, _part: None)
        whole = _unbroken(courses, max_index + 1)
        if whole <= max_index:
            raise ValueError(
                f"Argument `max_index` must be less than {whole} for this camera: of the critical curves that bound "
                f"the images, only those to order {whole} could be followed all the way round."
            )
        self.edges = [Edge(self.search, course) for course in courses]
        depths = [_no_depth, *(_depth_of(course.points) for course in courses)]
        points = [course.points for course in courses]
        self.folds = [Fold(self._at, course.points) for course in courses]
        self.sheets = [self._sheet(k, depths[k], depths[k + 1], points[k]) for k in range(max_index + 1)]
        self.cells = _cells(self.sheets)
        self.circles = _circles(self.cells.corners)
        self.pole_counts = self._counts_at_pole()

    def sky(self, looking: Array) -> Array:
        """Directions N on the sky of the camera at rest."""
        return sky_from_fido(self.frame, -looking)

    def mapped(self, sky: Array) -> Array:
        """Directions n' (..., 3) of the light seen in directions N (..., 3) of the camera at rest."""
        return trace_rays(self.camera, sky, "auto", _TOLERANCE).direction

    def expected(self, star: Array) -> tuple[Array, Array]:
        """How many images a star (n, 3) has on each sheet, from the caustics alone; and how close it lies to them.

        Returns the counts (n, sheets), and True (n, edges) where a star cannot be told from a caustic.
        """
        changes, touching = self._changes(star)
        return self.pole_counts + changes, touching

    def distance_to_caustics(self, star: Array) -> Array:
        """Distance (n,) of stars (n, 3) from the nearest known point of a caustic; `expected` refines those around."""
        return np.min([edge.nearest(star)[2] for edge in self.edges], axis=0)

    def _changes(self, star: Array) -> tuple[Array, Array]:
        """As `expected`, the counts less those at the north pole."""
        inside = [edge.winding(star) for edge in self.edges]
        windings = [np.zeros(len(star), int), *(winding for winding, _ in inside)]
        changes = [(-1) ** sheet.index * (windings[sheet.index + 1] - windings[sheet.index]) for sheet in self.sheets]
        return np.stack(changes, axis=-1), np.stack([touching for _, touching in inside], axis=-1)

    def _counts_at_pole(self) -> Array:
        """How many images the north pole has on each sheet: what most of a few directions tell.

        There the degree of the map that the grid stands for gives the count, and the caustics give the difference.
        """
        known = [[(-1) ** sheet.index * degree(sheet.direction, star) for sheet in self.sheets] for star in _REFERENCES]
        return np.median(np.array(known) - self._changes(_REFERENCES)[0], axis=0).astype(int)

    def starts(self, star: Array, margin: float) -> Starts:
        """Guesses for all images of the stars (n, 3); margin, NARROW or WIDE, how far outside a cell they may lie."""
        cells = self.cells
        which, cell = self._around(star, margin)
        u, v = _bilinear_root(cells.corners[cell], star[which])
        near = np.maximum(np.abs(u - 0.5), np.abs(v - 0.5)) <= 0.5 + margin
        which, cell, u, v = which[near], cell[near], np.clip(u[near], 0, 1), np.clip(v[near], 0, 1)
        turn = cells.turn[cell, 0] + u * (cells.turn[cell, 1] - cells.turn[cell, 0])
        part = cells.part[cell, 0] + v * (cells.part[cell, 1] - cells.part[cell, 0])
        part, depth = np.clip(part, _INSIDE, 1 - _INSIDE), np.empty_like(turn)
        for sheet in self.sheets:
            here = cells.sheet[cell] == sheet.index
            depth[here] = sheet.depth(turn[here], part[here])
        return Starts(which, cells.sheet[cell], self.sky(sky_lines.looking(self.camera, turn, depth)))

    def fold_starts(self, star: Array) -> Starts:
        """Guesses for images of stars (n, 3) next to critical curves, on both sides of each."""
        parts = []
        for order, (edge, fold) in enumerate(zip(self.edges, self.folds, strict=True), 1):
            which, turn, depth, step = fold.guesses(edge.points, star)
            index = np.where(step < 0, order - 1, order)
            known = (index < len(self.sheets)) & (depth + step > 0)
            looking = sky_lines.looking(self.camera, turn[known], (depth + step)[known])
            parts.append((which[known], index[known], self.sky(looking)))
        return Starts(*(np.concatenate(values) for values in zip(*parts, strict=True)))

    def _around(self, star: Array, margin: float) -> tuple[Array, Array]:
        """Pairs of a star and a cell that it may lie in, by a linear map."""
        stars, found = cKDTree(star), []
        for circles in self.circles:
            pairs = stars.sparse_distance_matrix(circles.tree, (1 + margin) * circles.radius, output_type="ndarray")
            which, cell = pairs["i"], circles.cell[pairs["j"]]
            near = _linearly_inside(self.cells, cell, star[which], margin)
            found.append(which[near] * len(self.cells.sheet) + cell[near])
        return np.divmod(np.unique(np.concatenate(found)), len(self.cells.sheet))

    def _sheet(self, index: int, outer: Callable, inner: Callable, edge: Points) -> Sheet:
        turn = _thinned(edge)
        blank = Sheet(index, outer, inner, turn, np.linspace(0, 1, _PROBE_POINTS), np.empty(0))
        probes = self._grid(blank, turn[:: max(1, len(turn) // _PROBES)], blank.part)
        lengths = np.linalg.norm(np.diff(probes, axis=1), axis=-1).sum(axis=1)
        part = np.linspace(0, 1, int(np.ceil(lengths.max() / _STEP)) + 2)
        turn = np.append(turn, turn[0] + 2 * np.pi)
        return Sheet(index, outer, inner, turn, part, self._grid(blank, turn, part))

    def _grid(self, sheet: Sheet, turn: Array, part: Array) -> Array:
        turn, part = np.meshgrid(turn, part, indexing="ij")
        return self._at(turn, sheet.depth(turn, part))

    def _at(self, turn: Array, depth: Array) -> Array:
        """Directions n' of light from places on the lines of sky_lines.py."""
        return self.mapped(self.sky(sky_lines.looking(self.camera, turn, depth)))


@lru_cache(maxsize=8)
def _sheets_at_rest(camera: Camera, max_index: int) -> Sheets:
    return Sheets(camera, max_index)


def sheets_of(camera: Camera, max_index: int) -> Sheets:
    """The sheets of a camera, kept for the next star: they depend on its place alone."""
    return _sheets_at_rest(camera.at_rest(), max_index)


def _no_depth(turn: Array) -> Array:
    return np.zeros_like(turn)


def _depth_of(points: Points) -> CubicSpline:
    """Depth of a critical curve, as a periodic function of turn."""
    turn, depth = (
        np.append(values, values[0] + period) for values, period in ((points.turn, 2 * np.pi), (points.depth, 0))
    )
    return CubicSpline(turn, depth, bc_type="periodic")


def _unbroken(courses: list[Course], orders: int) -> int:
    """How many critical curves, from the primary on, were followed all the way round."""
    closed = {course.order for course in courses if course.closed}
    return next((k - 1 for k in range(1, orders + 1) if k not in closed), orders)


def _thinned(points: Points) -> Array:
    """Parameters of points of a curve, no further apart than _STEP, in turn and on either sphere, if samples allow it.

    Far from the hole the whole curve is small on the sky.
    """
    lengths = [np.linalg.norm(np.diff(p, axis=0), axis=1) for p in (points.direction, points.looking)]
    return points.turn[_spaced(np.maximum.reduce([*lengths, np.diff(points.turn)]))]


def _spaced(steps: Array) -> Array:
    """Indices of the first node, the last, and between them as few as keep sums of steps below _STEP."""
    run = np.concatenate([[0], np.cumsum(steps)])
    chosen = np.unique(np.floor(run / _STEP), return_index=True)[1]
    return np.union1d(chosen, [len(run) - 1])


def _cells(sheets: list[Sheet]) -> _Cells:
    """One row of cells between each pair of neighbouring lines, as long as _STEP allows."""
    strips = []
    for sheet in sheets:
        lengths = np.linalg.norm(np.diff(sheet.direction, axis=1), axis=-1)
        for i in range(len(sheet.turn) - 1):
            last = len(sheet.part) - 1
            chosen = _spaced(lengths[i : i + 2].max(axis=0))
            # Finer next to the critical curves, where the map is no longer nearly linear.
            chosen = np.union1d(chosen, np.clip([_NEAR_EDGE, last - _NEAR_EDGE], 0, last))
            left, right = sheet.direction[i, chosen], sheet.direction[i + 1, chosen]
            corners = np.stack([left[:-1], right[:-1], left[1:], right[1:]], axis=1)
            count = len(corners)
            strips.append(
                (
                    np.full(count, sheet.index),
                    np.tile(sheet.turn[i : i + 2], (count, 1)),
                    np.stack([sheet.part[chosen][:-1], sheet.part[chosen][1:]], axis=1),
                    corners,
                )
            )
    return _cells_of(*(np.concatenate(values) for values in zip(*strips, strict=True)))


def _cells_of(sheet: Array, turn: Array, part: Array, corners: Array) -> _Cells:
    inverse = _linear_inverse(corners)
    offset = np.einsum("nij,nj->ni", inverse, _centres(corners))
    return _Cells(sheet, turn, part, corners, np.concatenate([inverse, -offset[..., None]], axis=2))


def _centres(corners: Array) -> Array:
    middle = corners.sum(axis=1)
    return middle / np.linalg.norm(middle, axis=1, keepdims=True)


def _circles(corners: Array) -> list[_Circles]:
    """Circles that cover the cells' images, mostly long and thin, along their longer axes; ordered by size."""
    centre = _centres(corners)
    away = corners - centre[:, None]
    axis = np.linalg.eigh(np.einsum("nci,ncj->nij", away, away))[1][..., -1]
    along = np.einsum("nci,ni->nc", away, axis)
    across = np.linalg.norm(away - along[..., None] * axis[:, None], axis=2).max(axis=1)
    low, length = along.min(axis=1), np.ptp(along, axis=1)
    width = 2 * across + _SAG * length
    count = np.clip(np.ceil(length / np.maximum(width, 1e-12)), 1, _MOST_BALLS).astype(int)
    owner = np.repeat(np.arange(len(corners)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    place = low[owner] + (number + 0.5) / count[owner] * length[owner]
    radius = _REACH * np.hypot(length / count, width)[owner] / 2
    middle = centre[owner] + place[:, None] * axis[owner]
    size = np.floor(np.log(np.maximum(radius, 1e-12)) / np.log(_ALIKE))
    alike = [np.flatnonzero(size == one) for one in np.unique(size)]
    return [_Circles(cKDTree(middle[these]), owner[these], radius[these].max()) for these in alike]


def _linear_inverse(corners: Array) -> Array:
    """Pseudo-inverses (n, 2, 3) of the mean steps along turn and part."""
    along = (corners[:, 1] + corners[:, 3] - corners[:, 0] - corners[:, 2]) / 2
    across = (corners[:, 2] + corners[:, 3] - corners[:, 0] - corners[:, 1]) / 2
    normal = np.cross(along, across)
    square = np.einsum("ij,ij->i", normal, normal)[:, None]
    square = np.where(square == 0, 1, square)
    return np.stack([np.cross(across, normal), np.cross(normal, along)], axis=1) / square[..., None]


def _linearly_inside(cells: _Cells, cell: Array, star: Array, margin: float) -> Array:
    """True where a star (n, 3), not far from a cell (n,), may lie in it, by a linear map."""
    linear = cells.linear[cell]
    place = np.einsum("nij,nj->ni", linear[..., :3], star) + linear[..., 3]
    return np.abs(place).max(axis=1) <= 0.5 + _LINEAR + margin


def _bilinear_root(corners: Array, star: Array) -> tuple[Array, Array]:
    """Place (u, v) of stars (n, 3) in cells with images (n, 4, 3), if the map were bilinear in the tangent plane."""
    axes = np.stack(tangent_basis(star), axis=-1)
    flat = (corners @ axes) / np.maximum(np.einsum("nci,ni->nc", corners, star), 0.2)[..., None]
    p, pu, pv = flat[:, 0], flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    puv = flat[:, 3] - flat[:, 1] - pv
    u, v = np.full((2, len(star)), 0.5)
    for _ in range(4):
        value = p + pu * u[:, None] + pv * v[:, None] + puv * (u * v)[:, None]
        du, dv = pu + puv * v[:, None], pv + puv * u[:, None]
        area = du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0]
        area = np.where(area == 0, 1.0, area)
        u = np.clip(u - (value[:, 0] * dv[:, 1] - value[:, 1] * dv[:, 0]) / area, -1, 2)
        v = np.clip(v - (du[:, 0] * value[:, 1] - du[:, 1] * value[:, 0]) / area, -1, 2)
    return u, v
