"""The camera sky cut along its critical curves: one sheet for every Morse index.

On a sheet the sky map has no fold: every image of a star there is a regular root, and their number is known from the
sheet's edges alone (winding.py). A sheet is covered by a grid in `edge_phase`, the parameter of the lines of
sky_lines.py, and `part`, 0 on the outer critical curve (or opposite to the hole) and 1 on the inner one. The grid is
traced as rays; a star's images are sought in the cells whose images surround it.

Sheets lie on the sky of a camera at rest: neither caustics nor the order of images depend on the velocity.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.curves.critical_curves import CriticalCurves, check_index, critical_curves, with_ring_at_infinity
from kerrcaustics.curves.winding import CausticPolygon, Winding, degrees
from kerrcaustics.images.fold import fold_derivatives, fold_guesses
from kerrcaustics.images.sheet_cells import Cells, bilinear_root, cells_of
from kerrcaustics.images.sheet_grids import Sheet, traced_sheet
from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.lens_map.search_sky import search_camera
from kerrcaustics.lens_map.sky_lines import periodic
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.results.progress import report
from kerrcaustics.shapes import Bool, Float, Int, Num
from kerrcaustics.spacetime.arrays import HostParts, HostVectors
from kerrcaustics.spacetime.frame import Frame, sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

# Most places at which the images of one star are searched for.
_MOST_STARTS = 1000
NARROW, WIDE = 0.05, 0.5
"""Margins beside a cell, in parts of it, within which the bilinear map may place a star: first and second search."""
# Least distance from the critical curves at which Newton's method starts, in parts of a sheet.
_INSIDE = 0.002
# Tolerance of the rays of the grids, radians: larger than the round-off of the closed form next to an extremal hole.
_OF_GRID = 1e-8
# Directions at which images are counted on the grids: generic ones.
_REFERENCES = from_angles([0.4, 0.9, 1.3, 2.1, 2.6], [1.0, 4.0, 2.5, 5.5, 0.3])


Starts = tuple[Num[Array, "guesses ..."], ...]
"""Guesses of images, an entry each: which star, which sheet, and the direction N (n, 3) on the sky at rest."""


@dataclass(frozen=True, eq=False)
class Counted:
    """Image counts of stars by the winding of caustics, one entry for each star.

    expected: number of images on each sheet.
    on_caustic: True where a star cannot be distinguished from the caustic of that order.
    distance: distance from the nearest known point of a caustic, radians.
    windings: winding of each caustic about the stars.
    """

    expected: Int[Array, "stars sheets"]
    on_caustic: Bool[Array, "stars orders"]
    distance: Float[Array, " stars"]
    windings: tuple[Winding, ...]


@dataclass(frozen=True, eq=False)
class Grids:
    """The grids of all sheets; first: number of the first one that is not empty."""

    sheets: tuple[Sheet, ...]
    first: int

    @cached_property
    def cells(self) -> Cells:
        """The cells of the grids."""
        return cells_of(self.sheets[self.first :])


@dataclass(frozen=True, eq=False)
class Sheets:
    """The sheets of index 0 to max_index at one event, their edges, and the image counts that follow from these.

    An observer at infinity sees no images of index 0 of stars at infinity: that sheet is empty, and the first edge is
    the ring at infinity. frame: of the camera at rest; pole_counts: how many images the north pole has on each sheet.
    """

    curves: CriticalCurves
    frame: Frame
    polygons: tuple[CausticPolygon, ...]
    grids: Grids
    pole_counts: Int[Array, " sheets"]

    @property
    def sheets(self) -> tuple[Sheet, ...]:
        """The sheets, by index."""
        return self.grids.sheets

    @property
    def map(self) -> SearchMap:
        """The map of the sky at rest to the sphere of the sources."""
        return self.curves.map

    @property
    def camera(self) -> Viewer:
        """The camera at rest at the event."""
        return self.map.camera

    @property
    def surface(self) -> End:
        """The sphere of the sources."""
        return self.map.surface

    @property
    def _first(self) -> int:
        """Number of the first sheet, and of the first edge: nothing lies beyond the ring at infinity."""
        return self.grids.first

    @cached_property
    def folds(self) -> tuple[Spline, ...]:
        """The map next to each edge but the ring at infinity, for few stars alone."""
        mapped, edges = partial(_mapped, self.curves), self.curves.curves[self._first :]
        return tuple(fold_derivatives(mapped, curve.points) for curve in edges)

    @property
    def coarse(self) -> tuple[float, ...]:
        """Steps of the grids that are coarser than the search is made for, radians, by index; else 0."""
        return tuple(sheet.step if sheet.is_coarse else 0.0 for sheet in self.sheets)

    def sky(self, line_of_sight: HostVectors) -> HostVectors:
        """Directions N on the sky at rest for directions of the FIDO."""
        return sky_from_line_of_sight(self.frame, line_of_sight)

    def line_of_sight(self, edge_phase: HostParts, depth: HostParts) -> HostVectors:
        """Directions of the FIDO on the lines of the map."""
        return self.curves.domain.line_of_sight(edge_phase, depth)[0]

    def expected_counts(self, star: Float[Array, "stars 3"]) -> Counted:
        """Image counts of stars by the caustics alone."""
        windings = tuple(polygon.winding(star) for polygon in self.polygons)
        return Counted(
            self.pole_counts + _changes(windings),
            np.stack([winding.on_caustic for winding in windings], axis=-1),
            np.min([winding.distance for winding in windings], axis=0),
            windings,
        )

    def starts(self, star: Float[Array, "stars 3"], margin: float) -> Starts:
        """Guesses for all images of the stars; margin: NARROW or WIDE, the margin beside a cell."""
        cells = self.grids.cells
        which, cell = cells.candidates(star, margin)
        u, v = bilinear_root(cells.corners[cell], star[which])
        near = np.maximum(np.abs(u - 0.5), np.abs(v - 0.5)) <= 0.5 + margin
        near[near] = _among_first(which[near], _MOST_STARTS)
        which, cell = which[near], cell[near]
        corner = np.stack([cells.edge_phase[cell, 0], cells.part[cell, 0]], axis=1)
        size = np.stack([cells.edge_phase[cell, 1], cells.part[cell, 1]], axis=1) - corner
        place = corner + np.clip(np.stack([u[near], v[near]], axis=1), 0, 1) * size
        index = cells.sheet[cell]
        place[:, 1] = np.clip(place[:, 1], _INSIDE, 1 - _INSIDE)
        depth = np.empty(len(cell))
        for sheet in self.sheets[self._first :]:
            here = np.flatnonzero(index == sheet.index)
            depth[here] = sheet.depth(*place[here].T)
        return which, index, self.sky(self.line_of_sight(place[:, 0], depth))

    def fold_starts(self, star: Float[Array, "stars 3"], windings: tuple[Winding, ...]) -> Starts:
        """Guesses for images of stars next to critical curves, on both sides of each."""
        parts = []
        polygons, around = self.polygons[self._first :], windings[self._first :]
        for polygon, fold, winding in zip(polygons, self.folds, around, strict=True):
            order = polygon.curve.order
            which, edge_phase, depth, step = fold_guesses(fold, polygon.curve.points, star, winding)
            index = np.where(step < 0, order - 1, order)
            known = (index < len(self.sheets)) & (depth + step > 0)
            line_of_sight = self.line_of_sight(edge_phase[known], (depth + step)[known])
            parts.append((which[known], index[known], self.sky(line_of_sight)))
        return tuple(np.concatenate(values) for values in zip(*parts, strict=True))


@lru_cache(maxsize=4)
def _sheets_at_rest(camera: Viewer, max_index: int, surface: End) -> Sheets:
    """Find the critical curves, trace the grids."""
    curves = bounding_curves(camera, max_index, surface)
    domain = curves.domain
    report("rays all over the sky", 0.2)
    polygons = tuple(CausticPolygon.of_curve(curves, curve) for curve in curves)
    coarsely = partial(_mapped, curves, tolerance=_OF_GRID)
    depths = [domain.first, *(periodic(curve.points.edge_phase, curve.points.depth) for curve in curves)]
    sheets = tuple(
        traced_sheet(coarsely, curve.order - 1, (depths[curve.order - 1], depths[curve.order]), curve.points)
        for curve in curves
    )
    return Sheets(
        curves=curves,
        frame=camera.frame(),
        polygons=polygons,
        grids=Grids(sheets, int(domain.unbounded)),
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
    edge_phase: Float[Array, "*#batch"],
    depth: Float[Array, "*#batch"],
    tolerance: float | None = None,
) -> HostVectors:
    """Directions n' of light from places on the lines of sky_lines.py; edge phase and depth are broadcast."""
    return curves.map.directions(*curves.domain.line_of_sight(edge_phase, depth), tolerance)


def _changes(windings: Sequence[Winding]) -> Int[Array, "stars sheets"]:
    """Counts less those at the north pole."""
    inside = np.stack([np.zeros_like(windings[0].count), *(winding.count for winding in windings)], axis=-1)
    return np.diff(inside, axis=-1) * (-1) ** np.arange(len(windings))


def _counts_at_pole(sheets: Sequence[Sheet], polygons: Sequence[CausticPolygon]) -> Int[Array, " sheets"]:
    """Numbers of images of the north pole on each sheet, the median over a few directions.

    The degree of the map on the grid gives the count at a direction, and the caustics the difference from the pole.
    """
    known = np.stack([(-1) ** sheet.index * degrees(sheet.direction, _REFERENCES) for sheet in sheets], axis=1)
    changes = _changes([polygon.winding(_REFERENCES) for polygon in polygons])
    return np.median(known - changes, axis=0).astype(int)


def _among_first(which: Int[Array, " pairs"], most: int) -> Bool[Array, " pairs"]:
    """True for the first `most` pairs of each star; which: the star of each pair, in order."""
    return np.arange(len(which)) - np.searchsorted(which, which) < most


def checked_sheets(camera: Viewer, max_index: object, surface: End = SKY) -> Sheets:
    """The sheets of a camera; ValueError unless the arguments are valid."""
    check_viewer(camera)
    return sheets_of(camera, checked_index(max_index), surface)
