"""The map of a picture to the celestial sphere, or to a sphere of finite radius: n' of every pixel, from few beams.

Away from the shadow edge n' is a smooth function of the place on the picture. So beams are traced at the corners of
square cells, and coons_patches.py joins them. Rays check the patch of each cell; cells with large errors are
divided, down to single pixels. Pixels on the shadow edge, and the few next to it without a good patch, stay uncovered.

While the camera moves, n' of a cell moves along a straight line; cells where it does not, and cells that the shadow
edge passes over, are divided.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import SKY, Spherical
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.trace import beams_of_directions, cores, rays_of_directions
from kerrcaustics.scenes.footprint import rotated_about_axis
from kerrcaustics.scenes.motion import ExposedMoment, Exposure
from kerrcaustics.scenes.quadtree import Division, Level, Squares, joined
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky_cells import PARTS, WIDE, SkyCells, parts_for, pixels
from kerrcaustics.scenes.sky_charts import CapChart, EdgeChart
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Plane = Raster | EdgeChart | CapChart
"""A rectangle of pixels, each with a direction: it is divided into cells."""

TOLERANCE = 1e-7
"""Tolerance of beams, radians: far less than a hundredth of a pixel."""
# Side of the largest cells, pixels.
_LARGEST = 32
# Side of the largest cells, radians.
_LARGEST_ANGLE = 0.05
# Pixels beyond the border of a picture from which stars shine into it.
_MARGIN = 1
# Places where rays check patches, in units of the cell, as in map_formulas.py: its middle, and those of two edges.
_CHECKS = ((0.5, 0.5), (0.5, 0.0), (0.0, 0.5))
# Points of the shadow edge: cells that contain one are divided.
_EDGE_POINTS = 1440
CROOKED = 0.25
"""Largest deviation of n' from straight motion at the ends of an exposure, pixels."""
# Number of moments at which a moving shadow edge is evaluated.
_EDGES = 16
# Steps to the neighbouring pixels of a moving edge, and to the pixel itself.
_BESIDE = np.stack(np.meshgrid(*2 * [np.arange(-1, 2)]), axis=-1).reshape(-1, 2)
Rows = TypeVar("Rows", "SkyCorners", SkyCells)


class SkyCorners(NamedTuple):
    """Beams at corners of cells.

    key: (n,) numbers of the places, ascending.
    place: (n, 3) n'.
    slope: (n, 3, 2) changes of n' per pixel along x and y.
    moved: (n, 4, 3) changes of n' and of both slopes over an exposure, and the deviation of n' from straight motion;
        (n, 0, 3) if nothing moves.
    """

    key: Array
    place: Array
    slope: Array
    moved: Array

    @property
    def escaped(self) -> Bool[Array, " n"]:
        """True for beams that reach the celestial sphere."""
        return np.isfinite(self.slope[:, 0, 0] + self.moved.sum(axis=(1, 2)))


class SkyMap(NamedTuple):
    """The map of a picture to the celestial sphere.

    cells: cells of the map.
    uncovered: (m,) numbers of the pixels that no cell covers, in reading order.
    parts: (m,) numbers of parts each way into which these pixels are to be divided.
    beams: number of beams traced.
    """

    cells: SkyCells
    uncovered: Int[Array, " m"]
    parts: Int[Array, " m"]
    beams: int


class Cut(NamedTuple):
    """The division of a chart into cells.

    root: size of the largest cells, a power of two that divides width and height.
    wide: largest angle of the sky that a cell sees, radians.
    """

    root: int
    wide: float


class _SkyLattice(NamedTuple):
    """Corners of cells, in whole pixels from the upper left corner of the first one.

    camera: the viewer.
    view: its picture, or a chart.
    exposure: the exposure if the camera moves.
    end: the sphere with the sky.
    size: size of the largest cells, pixels.
    margin: number of pixels beyond each side that cells cover too.
    """

    camera: Viewer
    view: Plane
    exposure: Exposure | None
    end: Spherical
    size: int
    margin: int

    @property
    def columns(self) -> int:
        return self.view.width + 4 * max(_LARGEST, self.size)

    @property
    def origin(self) -> tuple[int, int]:
        """Pixels from the first cell to the left side of the picture, and to its upper one."""
        over = 2 * self.margin
        across, down = (
            -(-(side + over) // self.size) * self.size - side for side in (self.view.width, self.view.height)
        )
        return across // 2, down // 2

    def roots(self) -> Squares:
        return Squares.over(self.view.width + 2 * self.margin, self.view.height + 2 * self.margin, self.size)

    def pixel_counts(self, hidden: Bool[Array, "h w"]) -> Int[Array, "rows columns"]:
        """Number of visible pixels above and left of each corner; the margin repeats the pixels beside it."""
        x, y = self.origin
        beyond = np.pad(~hidden, self.margin, mode="edge")
        lattice = np.pad(beyond, ((y - self.margin, self.size), (x - self.margin, self.size)))
        counts = np.pad(lattice, ((1, 0), (1, 0))).cumsum(axis=1, dtype=np.int32)
        # Much faster than `cumsum` of columns.
        for above, row in pairwise(counts):
            row += above
        return counts

    def on_picture(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Pixels of places of the lattice."""
        return x - self.origin[0], y - self.origin[1]

    def trace(self, key: Array) -> SkyCorners:
        y, x = np.divmod(key, self.columns)
        x, y = self.on_picture(x, y)
        if self.exposure is None:
            place, slope = _beams(self.camera, self.view, x, y, self.end)
            return SkyCorners(key, place, slope, np.zeros((len(key), 0, 3)))
        # In the frame in which the sky is at rest and the camera moves.
        first, middle, last = (_columns(moment, x, y, self.end) for moment in self.exposure.moments)
        bent = (first[:, :1] + last[:, :1]) / 2 - middle[:, :1]
        moved = np.concatenate([last - first, bent], axis=1)
        return SkyCorners(key, middle[:, 0], np.swapaxes(middle[:, 1:], 1, 2), moved)

    def checks(self, squares: Squares, chosen: Array) -> Float[Array, "n checks 3"]:
        """n' of rays within cells, where their patches are checked."""
        x, y = np.array(_CHECKS).T * squares.size - 0.5
        left, top = self.on_picture(squares.x[chosen, None], squares.y[chosen, None])
        sky, _ = self.view.directions(left + x, top + y)
        azimuth = 0.0 if self.exposure is None else self.exposure.middle.azimuth
        return rotated_about_axis(
            rays_of_directions(self.camera, sky, "auto", TOLERANCE, end=self.end).direction, azimuth
        )

    def edge(self) -> tuple[Array, Array]:
        """A sample of the pixels on the shadow edge, on the lattice."""
        if not isinstance(self.view, Raster):
            return np.zeros(0, int), np.zeros(0, int)
        if self.exposure is None:
            points = self.view.pixels(shadow_edge(self.camera, _EDGE_POINTS))
        else:
            moments = [self.exposure.moment_at(float(moment)) for moment in np.linspace(-0.5, 0.5, _EDGES)]
            edges = [moment.view.pixels(shadow_edge(moment.camera, _EDGE_POINTS)) for moment in moments]
            points = np.concatenate([edge + step for edge in edges for step in _BESIDE])
        x, y = (points + 0.5).T
        near = (x >= -1) & (y >= -1) & (x < self.view.width + 1) & (y < self.view.height + 1)
        return (x[near] + self.origin[0]).astype(int), (y[near] + self.origin[1]).astype(int)


def _beams(
    camera: Viewer, view: Plane, x: Array, y: Array, end: Spherical
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 2"]]:
    """n' at upper left corners of pixels, and its slopes."""
    sky, steps = view.directions(x - 0.5, y - 0.5)
    beams = beams_of_directions(camera, sky, "auto", TOLERANCE, index=False, crossings=False, redshift=False, end=end)
    return beams.direction, slopes(beams, sky, steps)


def _columns(moment: ExposedMoment, x: Array, y: Array, end: Spherical) -> Float[Array, "n 3 3"]:
    """n' and its two slopes (n, 3, 3), one in each row, at a moment, for a sky at rest."""
    place, slope = _beams(moment.camera, moment.view, x, y, end)
    return rotated_about_axis(np.concatenate([place[:, None], np.swapaxes(slope, 1, 2)], axis=1), moment.azimuth)


def ray_directions(moment: ExposedMoment, x: ArrayLike, y: ArrayLike, end: Spherical) -> Float[Array, "*batch 3"]:
    """n' (..., 3) of rays at places of a view at a moment, for a sky at rest."""
    rays = rays_of_directions(moment.camera, moment.view.directions(x, y)[0], "auto", TOLERANCE, end=end)
    return rotated_about_axis(rays.direction, moment.azimuth)


def slopes(
    beams: Beams, sky: Float[Array, "*batch 3"], steps: Float[Array, "*batch 3 2"]
) -> Float[Array, "*batch 3 2"]:
    """Changes (..., 3, 2) of n' for pixels with directions N (..., 3) and steps (..., 3, 2)."""
    batch, columns = sky.shape[:-1], ((beams.direction, 3), (beams.jacobian, 4), (sky, 3), (steps, 6))
    return np.asarray(kernel("slopes").on_rays((), [part.reshape(-1, size) for part, size in columns], batch))


def chart_cells(
    camera: Viewer, chart: Plane, close: float, hidden: Bool[Array, "h w"], cut: Cut, end: Spherical
) -> SkyCells:
    """Cells of the map of a chart, with their errors; none sees more of the sky than the cut allows.

    The smallest cells are accepted whatever their errors. Other parameters as for `sky_map`.
    """
    return _mapped(_SkyLattice(camera, chart, None, end, cut.root, 0), close, hidden, cut.wide).cells


def sky_map(
    camera: Viewer,
    view: Raster,
    close: float,
    hidden: Bool[Array, "h w"],
    exposure: Exposure | None = None,
    end: Spherical = SKY,
) -> SkyMap:
    """The map of a view, and of a pixel beyond each side of it.

    close: largest error of patches, pixels.
    hidden: True for pixels that need no map.
    exposure: the exposure if the camera moves, with this view in its middle.
    end: the sphere with the sky.
    """
    return _mapped(_SkyLattice(camera, view, exposure, end, _root_size(view), _MARGIN), close, hidden)


def _mapped(lattice: _SkyLattice, close: float, hidden: Bool[Array, "h w"], wide: float | None = None) -> SkyMap:
    """The map on a lattice; wide: largest angle of the sky that cells of a chart see; None for a picture."""
    edge, visible = lattice.edge(), partial(_visible_squares, total=lattice.pixel_counts(hidden))
    trace, accept = partial(_on_cores, lattice.trace), partial(_accepted, lattice, edge, close, wide)
    division = Division(lattice.columns, trace, accept, select=visible)
    cells, level, split = division.divide(lattice.roots(), lattice.trace(np.zeros(0, int)))
    uncovered, parts = _uncovered(lattice, edge, level, split)
    x, y = lattice.on_picture(cells.x, cells.y)
    beams = len(level.corners.key) * (1 if lattice.exposure is None else 3)
    return SkyMap(cells._replace(x=x, y=y), uncovered, parts, beams)


def _accepted(
    lattice: _SkyLattice, edge: tuple[Array, Array], close: float, wide: float | None, level: Level[SkyCorners]
) -> tuple[SkyCells, Bool[Array, " n"]]:
    """The good cells of a level, and the mask of those to be divided; parameters as for `_mapped`."""
    size, mixed = level.squares.size, _mixed(level, edge)
    reached = level.corners.escaped[level.number].all(axis=1)
    whole = reached & ~mixed
    if size > 1:
        # The shadow edge may bulge into neighbours of the cells that it crosses.
        whole &= ~level.beside(mixed)
    cells = _on_cores(partial(_cells, lattice, level, close), np.flatnonzero(whole))
    small = size == 1 and lattice.exposure is None
    good = (cells.error <= close) & (small | (cells.extent < (wide or WIDE)))
    good |= size == 1 and wide is not None
    split = mixed | reached
    split[np.flatnonzero(whole)[good]] = False
    return SkyCells(*(part[good] for part in cells)), split


def _uncovered(
    lattice: _SkyLattice, edge: tuple[Array, Array], level: Level[SkyCorners], split: Bool[Array, " n"]
) -> tuple[Int[Array, " m"], Int[Array, " m"]]:
    """The uncovered pixels, and their numbers of parts each way."""
    (x, y), view = lattice.on_picture(level.squares.x, level.squares.y), lattice.view
    split = split & (x >= 0) & (y >= 0) & (x < view.width) & (y < view.height)
    extent = np.sqrt((level.corners.slope[level.number[split]] ** 2).sum(axis=(2, 3))).max(axis=1)
    parts = np.where(_mixed(level, edge)[split], PARTS, parts_for(extent))
    return y[split] * view.width + x[split], parts


def _root_size(view: Raster) -> int:
    size = _LARGEST
    while size > 1 and size * view.pixel_angle > _LARGEST_ANGLE:
        size //= 2
    return size


def _on_cores(work: Callable[[Array], Rows], rows: Int[Array, " n"]) -> Rows:
    """Results of work on rows, distributed over the cores: named tuples of arrays."""
    with ThreadPoolExecutor(cores()) as pool:
        return joined(list(pool.map(work, np.array_split(rows, cores()))))


def _visible_squares(squares: Squares, total: Int[Array, "rows columns"]) -> Squares:
    """Squares with a pixel of the picture that is not hidden; total: their number above and left of each corner."""
    x, y, size = squares
    height, width = total.shape[0] - 1, total.shape[1] - 1
    right, below = np.minimum(x + size, width), np.minimum(y + size, height)
    x_in, y_in = np.minimum(x, width), np.minimum(y, height)
    visible = total[below, right] - total[y_in, right] - total[below, x_in] + total[y_in, x_in] > 0
    return Squares(x[visible], y[visible], size)


def _contain(squares: Squares, edge: tuple[Array, Array]) -> Bool[Array, " n"]:
    """True for cells that contain any of some pixels."""
    x, y, size = squares
    columns, rows = (
        1 + max(cells.max(initial=0), held.max(initial=0)) // size for cells, held in ((x, edge[0]), (y, edge[1]))
    )
    contain = np.zeros((rows, columns), bool)
    contain[edge[1] // size, edge[0] // size] = True
    return contain[y // size, x // size]


def _mixed(level: Level[SkyCorners], edge: tuple[Array, Array]) -> Bool[Array, " n"]:
    """True for cells on the shadow edge: some of their corners reach the sky, or they contain one of its pixels."""
    reached = level.corners.escaped[level.number]
    return (reached.any(axis=1) & ~reached.all(axis=1)) | _contain(level.squares, edge)


def _cells(lattice: _SkyLattice, level: Level[SkyCorners], close: float, chosen: Int[Array, " m"]) -> SkyCells:
    """The chosen cells, with their errors; NaN for cells rejected before the check by rays."""
    (x, y, size), corners, number = level.squares, level.corners, level.number[chosen]
    tables = corners.place, corners.slope.reshape(-1, 6)
    data, curving, extent, scale, error, checked = kernel("cell").on_rays((size,), [number], tables=tables)
    error[~(error <= close)] = np.nan
    rates = np.zeros((len(chosen), 0, 3))
    if lattice.exposure is not None:
        moved = np.moveaxis(corners.moved[number], 2, 0)
        rates = np.concatenate([moved[0], moved[1] * size, moved[2] * size], axis=1)
        error[pixels(scale, moved[3]).max(axis=1) > CROOKED] = np.nan
    some = np.flatnonzero(np.isfinite(error))
    miss = lattice.checks(level.squares, chosen[some]) - checked[some]
    error[some] = np.maximum(error[some], pixels(scale[some], miss).max(axis=1))
    return SkyCells(x[chosen], y[chosen], np.full(len(chosen), size), data, curving, extent, error, rates)
