"""The camera sky cut along its critical curves: one sheet for every Morse index.

On a sheet the sky map has no fold: every image of a star there is a regular root, and their number is known from the
sheet's edges alone (winding.py). A sheet is covered by a grid in `edge_phase`, the parameter of the lines of
sky_lines.py, and `part`, 0 on the outer critical curve (or opposite to the hole) and 1 on the inner one. The grid is
traced as rays; a star's images are looked for in the cells whose images lie around it.

All of it lives on the sky of a camera at rest: neither caustics nor the order of images depend on the velocity.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
import scipy
from jaxtyping import Bool, Float, Int, Num

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.beams.warm_up import warm_up
from kerrcaustics.curves.critical_curves import CriticalCurves, check_index, critical_curves, with_ring_at_infinity
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.curves.winding import CausticPolygon, Winding, degree
from kerrcaustics.images.fold import fold_derivatives, fold_guesses
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.lens_map.search_sky import search_camera
from kerrcaustics.lens_map.sky_lines import periodic
from kerrcaustics.results.progress import report
from kerrcaustics.spacetime.arrays import HostReals, HostVectors, Spline
from kerrcaustics.spacetime.frame import Frame, sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import from_angles, tangent_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Depth = Callable[[Array], Array]
Mapped = Callable[[Array, Array], Array]

HIGHEST_INDEX = 6
# Longest step of the grid's image on the celestial sphere, and of the grid on the sky, where it need not be longer.
_STEP = math.radians(10.0)
# Nodes next to a sheet's edge that are corners of cells, counted from it.
_NEAR_EDGE = np.array([1, 2, 4, 8])
# Most nodes of one grid, kept to by longer steps; and the longest with which the grid still counts images.
MOST_NODES, _COARSE = 1_000_000, math.radians(40.0)
# Most places at which the images of one star are searched for.
_MOST_STARTS = 1000
# Lines on which the length of a sheet's image is measured, and points on each.
_PROBES, _PROBE_POINTS = 24, 129
# Circles that cover a cell's image: how much larger than its corners ask for, most of them, and how far, in parts of
# its length, the image may bend.
_REACH, _MOST_BALLS, _SAG = 1.25, 12, 0.05
# How far outside a cell, in parts of it, the bilinear model of the map may put the star: at first, and when searching
# again. And the distance from the critical curves, in parts of a sheet, at which Newton's method starts at least.
NARROW, WIDE = 0.05, 0.5
_INSIDE = 0.002
# Steps toward a star on the smooth map through the nodes of a grid.
_POLISHES = 2
# The same for a linear model, and for a smooth one through all nodes, beside that.
_LINEAR, _SMOOTH = 0.25, 0.25
# Circles whose radii differ by less than this factor share a tree.
_ALIKE = 1.5
# Wanted error of the rays of the grids, radians, which show where to look: what the closed form loses next to an
# extremal hole is less.
_OF_GRID = 1e-8
# Directions where images are counted on the grids, in no special place.
_REFERENCES = from_angles([0.4, 0.9, 1.3, 2.1, 2.6], [1.0, 4.0, 2.5, 5.5, 0.3])


@dataclass(frozen=True)
class Sheet:
    """The part of the camera sky with one Morse index, as a grid.

    edge_phase: the last one a whole turn after the first; part: 0 to 1; direction: the grid's image on the celestial
    sphere, empty as long as it is not traced. outer, inner: depth of the critical curves on a line, as functions of
    edge phase. step: approximate length of the image's longest step, radians.
    """

    index: int
    step: float
    outer: Depth
    inner: Depth
    edge_phase: Float[Array, " lines"]
    part: Float[Array, " parts"]
    direction: Float[Array, "lines parts 3"] | Float[Array, " 0"]

    @property
    def is_coarse(self) -> bool:
        """True where a grid of acceptable size has longer steps than the search is made for."""
        return self.step > _STEP

    def depth(self, edge_phase: Float[Array, "*batch"], part: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Depth on the lines of sky_lines.py."""
        low = self.outer(edge_phase)
        return low + part * (self.inner(edge_phase) - low)

    @cached_property
    def smooth(self) -> Callable[..., Array]:
        """The map between the nodes of the grid: image as a function of (edge phase, part)."""
        degrees = [min(3, len(nodes) - 1) for nodes in (self.edge_phase, self.part)]
        across = scipy.interpolate.make_interp_spline(self.part, self.direction, degrees[1], axis=1)
        both = scipy.interpolate.make_interp_spline(self.edge_phase, np.moveaxis(across.c, 0, 1), degrees[0])
        return scipy.interpolate.NdBSpline((both.t, across.t), both.c, degrees)

    def polished(
        self, star: Float[Array, "stars 3"], place: Float[Array, "stars 2"], longest: Float[Array, "stars 2"]
    ) -> Float[Array, "stars 2"]:
        """Places (edge phase, part) nearer to where the smooth map shows stars; longest: steps that may be taken."""
        # Vectors of the tangent plane at each star as complex numbers.
        east, north = tangent_basis(star)
        plane, low, high = east + 1j * north, (self.edge_phase[0], 0.0), (self.edge_phase[-1], 1.0)
        away = np.full(len(star), np.inf)
        for _ in range(_POLISHES):
            off, along, across = (
                np.einsum("ni,ni->n", plane, self.smooth(place, nu=nu)) for nu in ((0, 0), (1, 0), (0, 1))
            )
            before, away = away, np.abs(off)
            area = (along.conj() * across).imag
            step = np.stack([(off.conj() * across).imag, (along.conj() * off).imag], axis=1)
            step = np.clip(step / np.where(area == 0, 1.0, area)[:, None], -longest, longest)
            place = np.clip(place - np.where((away < before)[:, None], step, 0), low, high)
        return place


@dataclass(frozen=True)
class _Cells:
    """The cells of all grids, flat.

    sheet; edge_phase and part of two opposite corners; corners: images of all four; linear: from a direction, with a 1
    behind it, to the place in the cell, the middle at 0, by a linear map.
    """

    sheet: Int[Array, " cells"]
    edge_phase: Float[Array, "cells 2"]
    part: Float[Array, "cells 2"]
    corners: Float[Array, "cells 4 3"]
    linear: Float[Array, "2 4 cells"]


# Circles of about one radius on the celestial sphere: centres as a tree, the cells that they cover, the radius.
_Circles = tuple[Any, Int[Array, " _circles"], float]
Starts = tuple[Num[Array, "guesses ..."], ...]
"""Guesses of images, an entry each: which star, which sheet, and the direction N (n, 3) on the sky at rest."""


@dataclass(frozen=True, eq=False)
class Counted:
    """Image counts of stars by the winding of caustics, one entry for each star.

    expected: number of images on each sheet; on_caustic: True where a star cannot be distinguished from that caustic;
    distance: from the nearest known point of one; windings: by caustic.
    """

    expected: Int[Array, "stars sheets"]
    on_caustic: Bool[Array, "stars orders"]
    distance: Float[Array, " stars"]
    windings: tuple[Winding, ...]


@dataclass(frozen=True, eq=False)
class Sheets:
    """The sheets of index 0 to max_index at one event, their edges, and the image counts that follow from these.

    An observer at infinity sees no images of index 0 of stars at infinity: that sheet is empty, and the first edge is
    the ring at infinity. frame: of the camera at rest; folds: of all edges but that one; pole_counts: how many images
    the north pole has on each sheet.
    """

    curves: CriticalCurves
    frame: Frame
    polygons: tuple[CausticPolygon, ...]
    folds: tuple[Spline, ...]
    sheets: tuple[Sheet, ...]
    cells: _Cells
    circles: tuple[_Circles, ...]
    pole_counts: Int[Array, " sheets"]

    @property
    def camera(self) -> Viewer:
        """The camera at rest at the event."""
        return self.curves.map.camera

    @property
    def surface(self) -> End:
        """The sphere of the sources."""
        return self.curves.map.surface

    @property
    def coarse(self) -> tuple[float, ...]:
        """Steps of the grids that are coarser than the search is made for, radians, by index; else 0."""
        return tuple(sheet.step if sheet.is_coarse else 0.0 for sheet in self.sheets)

    def sky(self, line_of_sight: HostVectors) -> HostVectors:
        """Directions N on the sky at rest for directions of the FIDO."""
        return sky_from_line_of_sight(self.frame, line_of_sight)

    def line_of_sight(self, edge_phase: HostReals, depth: HostReals) -> HostVectors:
        """Directions of the FIDO on the lines of the map."""
        return self.curves.domain.line_of_sight(edge_phase, depth)[0]

    def counted(self, star: Float[Array, "stars 3"]) -> Counted:
        """Image counts of stars by the caustics alone."""
        windings = tuple(polygon.winding(star) for polygon in self.polygons)
        return Counted(
            self.pole_counts + _changes(windings),
            np.stack([winding.on_caustic for winding in windings], axis=-1),
            np.min([winding.distance for winding in windings], axis=0),
            windings,
        )

    def starts(self, star: Float[Array, "stars 3"], margin: float) -> Starts:
        """Guesses for all images of the stars; margin, NARROW or WIDE, how far outside a cell they may lie."""
        cells = self.cells
        which, cell = self._around(star, margin)
        u, v = _bilinear_root(cells.corners[cell], star[which])
        near = np.maximum(np.abs(u - 0.5), np.abs(v - 0.5)) <= 0.5 + margin
        near[near] = _among_first(which[near], _MOST_STARTS)
        which, cell = which[near], cell[near]
        corner = np.stack([cells.edge_phase[cell, 0], cells.part[cell, 0]], axis=1)
        size = np.stack([cells.edge_phase[cell, 1], cells.part[cell, 1]], axis=1) - corner
        place = corner + np.clip(np.stack([u[near], v[near]], axis=1), 0, 1) * size
        depth = np.empty(len(cell))
        for index in np.unique(cells.sheet[cell]).tolist():
            sheet, here = self.sheets[index], np.flatnonzero(cells.sheet[cell] == index)
            better = sheet.polished(star[which[here]], place[here], size[here])
            inside = (np.abs((better - corner[here]) / size[here] - 0.5) <= 0.5 + margin + _SMOOTH).all(axis=1)
            place[here[inside]] = better[inside]
            place[here, 1] = np.clip(place[here, 1], _INSIDE, 1 - _INSIDE)
            depth[here] = sheet.depth(*place[here].T)
        return which, cells.sheet[cell], self.sky(self.line_of_sight(place[:, 0], depth))

    def fold_starts(self, star: Float[Array, "stars 3"], windings: tuple[Winding, ...]) -> Starts:
        """Guesses for images of stars next to critical curves, on both sides of each."""
        parts = []
        last = len(self.folds)
        for polygon, fold, winding in zip(self.polygons[-last:], self.folds, windings[-last:], strict=True):
            order = polygon.curve.order
            which, edge_phase, depth, step = fold_guesses(fold, polygon.curve.points, star, winding)
            index = np.where(step < 0, order - 1, order)
            known = (index < len(self.sheets)) & (depth + step > 0)
            line_of_sight = self.line_of_sight(edge_phase[known], (depth + step)[known])
            parts.append((which[known], index[known], self.sky(line_of_sight)))
        return tuple(np.concatenate(values) for values in zip(*parts, strict=True))

    def _around(
        self, star: Float[Array, "stars 3"], margin: float
    ) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Pairs of a star and a cell that it may lie in, by a linear map."""
        stars, numbers = scipy.spatial.cKDTree(star), []
        for tree, cells, radius in self.circles:
            pairs = stars.sparse_distance_matrix(tree, (1 + margin) * radius, output_type="ndarray")
            which, cell = pairs["i"], cells[pairs["j"]]
            near = _linearly_inside(self.cells, cell, star, which, margin)
            numbers.append(which[near] * len(self.cells.sheet) + cell[near])
        return np.divmod(np.unique(np.concatenate(numbers)), len(self.cells.sheet))


@lru_cache(maxsize=4)
def _sheets_at_rest(camera: Viewer, max_index: int, surface: End) -> Sheets:
    """Find the critical curves, trace the grids."""
    if surface == SKY:
        warm_up(camera)
    curves = bounding_curves(camera, max_index, surface)
    domain = curves.domain
    report("sheets of the sky", 0.2)
    polygons = tuple(CausticPolygon.of(curves, curve) for curve in curves)
    mapped, coarsely = partial(_mapped, curves), partial(_mapped, curves, tolerance=_OF_GRID)
    depths = [domain.first, *(periodic(curve.points.edge_phase, curve.points.depth) for curve in curves)]
    sheets = tuple(
        _sheet(coarsely, curve.order - 1, (depths[curve.order - 1], depths[curve.order]), curve.points)
        for curve in curves
    )
    # Nothing lies beyond the ring at infinity.
    cells = _cells(sheets[int(domain.unbounded) :])
    return Sheets(
        curves=curves,
        frame=camera.frame(),
        polygons=polygons,
        folds=tuple(fold_derivatives(mapped, curve.points) for curve in curves.curves[int(domain.unbounded) :]),
        sheets=sheets,
        cells=cells,
        circles=tuple(_circles(cells.corners)),
        pole_counts=_counts_at_pole(sheets, polygons),
    )


def bounding_curves(camera: Viewer, max_index: int, surface: End) -> CriticalCurves:
    """The critical curves that bound images up to an index; ValueError unless each is whole. camera: at rest."""
    check_index(domain_of(surface, camera), max_index)
    curves = with_ring_at_infinity(critical_curves(camera, max_index + 1, surface=surface))
    if not curves.unbroken:
        raise ValueError(
            "Argument `end` must be a surface on which the critical curve of order 1 can be followed all the way "
            f"round, but on {surface.in_words()} it cannot for this camera: try one farther from the photon orbits."
        )
    if curves.unbroken <= max_index:
        raise ValueError(
            f"Argument `max_index` must be less than {curves.unbroken} for this camera: of the critical curves that "
            f"bound the images, only those up to order {curves.unbroken} could be followed all the way round."
        )
    return curves


def sheets_of(camera: Viewer, max_index: int, surface: End = SKY) -> Sheets:
    """The sheets of a camera, kept for the next star: they depend on its place alone."""
    return _sheets_at_rest(search_camera(camera), max_index, surface.bare())


def _mapped(
    curves: CriticalCurves,
    edge_phase: Float[Array, "*batch"],
    depth: Float[Array, "*batch"],
    tolerance: float | None = None,
) -> HostVectors:
    """Directions n' of light from places on the lines of sky_lines.py."""
    return curves.map.directions(*curves.domain.line_of_sight(edge_phase, depth), tolerance)


def _changes(windings: Sequence[Winding]) -> Int[Array, "stars sheets"]:
    """Counts less those at the north pole."""
    inside = np.stack([np.zeros_like(windings[0].count), *(winding.count for winding in windings)], axis=-1)
    return np.diff(inside, axis=-1) * (-1) ** np.arange(len(windings))


def _counts_at_pole(sheets: Sequence[Sheet], polygons: Sequence[CausticPolygon]) -> Int[Array, " sheets"]:
    """Numbers of images of the north pole on each sheet, as most of a few directions give them.

    There the degree of the map that the grid stands for gives the count, and the caustics give the difference.
    """
    known = [[(-1) ** sheet.index * degree(sheet.direction, star) for sheet in sheets] for star in _REFERENCES]
    changes = _changes([polygon.winding(_REFERENCES) for polygon in polygons])
    return np.median(np.array(known) - changes, axis=0).astype(int)


def _sheet(mapped: Mapped, index: int, depths: tuple[Depth, Depth], edge: Points) -> Sheet:
    """A sheet with a grid that is fine enough; edge: its inner one."""
    edge_phase = _thinned(edge, _STEP)
    blank = Sheet(index, _STEP, *depths, edge_phase, np.linspace(0, 1, _PROBE_POINTS), np.empty(0))
    probes = _grid(mapped, blank, edge_phase[:: max(1, len(edge_phase) // _PROBES)], blank.part)
    length = float(np.linalg.norm(np.diff(probes, axis=1), axis=-1).sum(axis=1).max())
    step = _STEP * max(1.0, math.sqrt(len(edge_phase) * length / _STEP / MOST_NODES))
    if step > _COARSE:
        raise ValueError(
            f"Argument `max_index` must be less than {index} for this camera: a grid that follows the images of index "
            f"{index} would take {len(edge_phase) * length / _STEP:.1g} rays."
        )
    edge_phase = _thinned(edge, step)
    part = np.linspace(0, 1, math.ceil(length / step) + 2)
    edge_phase = np.append(edge_phase, edge_phase[0] + 2 * np.pi)
    return Sheet(index, step, *depths, edge_phase, part, _grid(mapped, blank, edge_phase, part))


def _grid(mapped: Mapped, sheet: Sheet, edge_phase: Array, part: Array) -> Float[Array, "lines parts 3"]:
    edge_phase, part = np.meshgrid(edge_phase, part, indexing="ij")
    return mapped(edge_phase, sheet.depth(edge_phase, part))


def _thinned(points: Points, step: float) -> Float[Array, " lines"]:
    """Edge phases of points of a curve, no further apart than a step in it and on either sphere, if samples allow.

    Far from the hole the whole curve is small on the sky.
    """
    lengths = [np.linalg.norm(np.diff(p, axis=0), axis=1) for p in (points.direction, points.line_of_sight)]
    return points.edge_phase[_spaced(np.maximum.reduce([*lengths, np.diff(points.edge_phase)]), step)]


def _spaced(steps: Float[Array, " steps"], longest: float) -> Int[Array, " nodes"]:
    """Indices of the first node, the last, and between them as few as keep sums of steps below the longest."""
    run = np.concatenate([[0], np.cumsum(steps)])
    chosen = np.unique(np.floor(run / longest), return_index=True)[1]
    return np.union1d(chosen, [len(run) - 1])


def _cells(sheets: Sequence[Sheet]) -> _Cells:
    """A row of cells between each pair of neighbouring lines, as long as the sheet's step allows."""
    strips = []
    for sheet in sheets:
        lengths = np.linalg.norm(np.diff(sheet.direction, axis=1), axis=-1)
        for i in range(len(sheet.edge_phase) - 1):
            last = len(sheet.part) - 1
            chosen = _spaced(lengths[i : i + 2].max(axis=0), sheet.step)
            # Finer next to the critical curves, where the map is no longer nearly linear.
            chosen = np.union1d(chosen, np.clip([_NEAR_EDGE, last - _NEAR_EDGE], 0, last))
            left, right = sheet.direction[i, chosen], sheet.direction[i + 1, chosen]
            corners = np.stack([left[:-1], right[:-1], left[1:], right[1:]], axis=1)
            count = len(corners)
            strips.append(
                (
                    np.full(count, sheet.index),
                    np.tile(sheet.edge_phase[i : i + 2], (count, 1)),
                    np.stack([sheet.part[chosen][:-1], sheet.part[chosen][1:]], axis=1),
                    corners,
                )
            )
    return _cells_of(*(np.concatenate(values) for values in zip(*strips, strict=True)))


def _cells_of(sheet: Array, edge_phase: Array, part: Array, corners: Array) -> _Cells:
    inverse = _linear_inverse(corners)
    offset = np.einsum("nij,nj->ni", inverse, _centres(corners))
    linear = np.moveaxis(np.concatenate([inverse, -offset[..., None]], axis=2), 0, 2)
    return _Cells(sheet, edge_phase, part, corners, np.ascontiguousarray(linear))


def _centres(corners: Float[Array, "cells 4 3"]) -> Float[Array, "cells 3"]:
    middle = corners.sum(axis=1)
    return middle / np.linalg.norm(middle, axis=1, keepdims=True)


def _circles(corners: Float[Array, "cells 4 3"]) -> list[_Circles]:
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
    return [(scipy.spatial.cKDTree(middle[group]), owner[group], radius[group].max()) for group in alike]


def _linear_inverse(corners: Float[Array, "cells 4 3"]) -> Float[Array, "cells 2 3"]:
    """Pseudo-inverses of the mean steps along edge phase and part."""
    along = (corners[:, 1] + corners[:, 3] - corners[:, 0] - corners[:, 2]) / 2
    across = (corners[:, 2] + corners[:, 3] - corners[:, 0] - corners[:, 1]) / 2
    normal = np.cross(along, across)
    square = np.einsum("ij,ij->i", normal, normal)[:, None]
    square = np.where(square == 0, 1, square)
    return np.stack([np.cross(across, normal), np.cross(normal, along)], axis=1) / square[..., None]


def _linearly_inside(
    cells: _Cells, cell: Int[Array, " pairs"], star: Float[Array, "stars 3"], which: Int[Array, " pairs"], margin: float
) -> Bool[Array, " pairs"]:
    """True where a star, not far from a cell, may lie in it, by a linear map: along edge phase, and along part."""
    components, most = np.ascontiguousarray(star.T), 0.5 + _LINEAR + margin
    near = np.abs(_combined(cells.linear[0], cell, components, which)) <= most
    near[near] = np.abs(_combined(cells.linear[1], cell[near], components, which[near])) <= most
    return near


def _combined(
    linear: Float[Array, "4 cells"], cell: Int[Array, " pairs"], star: Float[Array, "3 stars"], which: Array
) -> Float[Array, " pairs"]:
    """Values of linear functions. By components: pairs are many, and rows of them would not fit in the cache."""
    (a, b, c, shift), (x, y, z) = linear, star
    return a[cell] * x[which] + b[cell] * y[which] + c[cell] * z[which] + shift[cell]


def _among_first(which: Int[Array, " pairs"], most: int) -> Bool[Array, " pairs"]:
    """True for at most so many pairs of each star; which: the star of each, in order."""
    return np.arange(len(which)) - np.searchsorted(which, which) < most


def _bilinear_root(
    corners: Float[Array, "pairs 4 3"], star: Float[Array, "pairs 3"]
) -> tuple[Float[Array, " pairs"], Float[Array, " pairs"]]:
    """Place (u, v) of stars in cells with these images of corners, if the map were bilinear in the tangent plane."""
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
