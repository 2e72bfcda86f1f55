"""The map of a picture to the celestial sphere: the direction n' of every pixel, from few beams.

Away from the shadow edge n' is a smooth function of the place on the picture. So beams are traced at the corners of
square cells, and patches.py joins them. Rays check the patch of each cell; cells that are off are
divided, down to single pixels. Pixels on the shadow edge, and the few next to it where no patch is good, are left over.

While the camera moves, n' of a cell moves straight on: what does not, and what the shadow edge passes over, is divided.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.trace import cores, trace_beams, trace_rays
from kerrcaustics.scenes.footprint import bend, major_axis, pixel_matrix, singular_values, turned
from kerrcaustics.scenes.motion import ExposedMoment, Exposure
from kerrcaustics.scenes.patches import CORNERS, doubts, weights
from kerrcaustics.scenes.quadtree import Squares, find, merged
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.sphere import polar_basis

Array = np.ndarray

# A hundredth of a pixel is visible: beams need not be better.
TOLERANCE = 1e-7
# The largest cells: pixels, and radians.
_LARGEST, _LARGEST_ANGLE = 32, 0.05
# Stars shine into a picture from so many pixels beyond its border.
_MARGIN = 1
# Cells that see more of the sky than this (radians) are divided, pixels that do into two parts each way, and those
# that see more than that, or lie on the shadow edge, into more.
_WIDE, _WIDEST, PARTS = 0.2, 0.5, 4
# Where patches are checked by rays, in units of the cell: its middle, and those of two edges.
_CHECKS = ((0.5, 0.5), (0.5, 0.0), (0.0, 0.5))
# Points of the shadow edge that no cell may hide.
_EDGE_POINTS = 1440
# How far, in pixels, n' may be off when an exposure begins and ends.
CROOKED = 0.25
# Of a shadow edge that moves, so many moments are looked at, and the pixels beside it.
_EDGES = 16
# Pixels whose places are worked out together: they fit in a core's cache.
_TOGETHER = 1 << 15


class SkyCorners(NamedTuple):
    """Beams at corners of cells: key, sorted; place (n, 3), n'; slope (n, 3, 2), its change per pixel along x and y.

    moved (n, 4, 3): over an exposure how much these three change, and how far n' is off from moving straight on;
    (n, 0, 3) where nothing moves.
    """

    key: Array
    place: Array
    slope: Array
    moved: Array

    @property
    def there(self) -> Bool[Array, " n"]:
        """True for those that reach the celestial sphere."""
        return np.isfinite(self.slope[:, 0, 0] + self.moved.sum(axis=(1, 2)))


class SkyCells(NamedTuple):
    """Square cells of a picture that see the celestial sphere.

    x, y (n,): upper left corner, pixels; size (n,); data (n, 12, 3), n' for `patches`; curving (n, 3, 3), the second
    derivatives of n' along xx, xy and yy; error (n,): that of the patch, estimated, in pixels; rates
    (n, 12, 3): how the data change over an exposure, (n, 0, 3) where nothing moves.
    """

    x: Array
    y: Array
    size: Array
    data: Array
    curving: Array
    error: Array
    rates: Array

    @property
    def moving(self) -> bool:
        """True if they change while the picture is exposed."""
        return self.rates.shape[1] > 0

    def at(self, moment: float) -> "SkyCells":
        """Return them at a moment of the exposure, from -1/2 to 1/2."""
        return self._replace(data=self.data + moment * self.rates) if self.moving else self

    def pixels_moved(self, turn: float) -> Float[Array, " n"]:
        """Motion (n,) of the sky in their middles, pixels, over an exposure in which it turns by an angle."""
        scale = _Scale(self.data, self.curving, self.size)
        motion = turn * turning(scale.middle)
        if self.moving:
            motion -= np.einsum("nkc,k->nc", self.rates, weights(0.5, 0.5, 0.0, 1).value[:, 0])
        return scale.pixels(motion)


def turning(direction: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    """Displacements (..., 3), per radian, of directions that turn about the spin axis."""
    x, y, _ = np.moveaxis(direction, -1, 0)
    return np.stack([-y, x, np.zeros_like(x)], axis=-1)


Rows = TypeVar("Rows", SkyCorners, SkyCells)


class SkyMap(NamedTuple):
    """A picture's map to the celestial sphere: its cells, and how many beams it took.

    left: the pixels left over, by their numbers in reading order; parts: into how many each way they are to be divided.
    """

    cells: SkyCells
    left: Int[Array, " m"]
    parts: Int[Array, " m"]
    beams: int


class Plane(Protocol):
    """A rectangle of pixels, each with a direction, as those of a `View`: it is divided into cells."""

    @property
    def width(self) -> int:
        """Pixels from left to right."""
        ...

    @property
    def height(self) -> int:
        """Pixels from top to bottom."""
        ...

    def directions(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        """Directions N (..., 3) on the camera sky of places, and their steps (..., 3, 2) per pixel along x and y."""
        ...


class Cut(NamedTuple):
    """The division of a chart into cells.

    root: the size of the largest ones, a power of two that divides width and height; wide: radians of the sky that a
    cell may see.
    """

    root: int
    wide: float


class _SkyLattice(NamedTuple):
    """Corners of cells, in whole pixels from the upper left corner of the first one.

    size: of the largest cells; margin: pixels beyond each side that cells cover too.
    """

    camera: Camera
    view: View | Plane
    exposure: Exposure | None
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

    def pixel_counts(self, hidden: Bool[Array, "h w"]) -> Int[Array, "h+1 w+1"]:
        """Number of visible pixels above and left of each corner; those of the margin as their neighbours."""
        x, y = self.origin
        beyond = np.pad(~hidden, self.margin, mode="edge")
        lattice = np.pad(beyond, ((y - self.margin, self.size), (x - self.margin, self.size)))
        return np.pad(lattice.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))

    def key(self, x: Array, y: Array) -> Array:
        return y * self.columns + x

    def on_picture(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Pixels of places of the lattice."""
        return x - self.origin[0], y - self.origin[1]

    def trace(self, key: Array) -> SkyCorners:
        y, x = np.divmod(key, self.columns)
        x, y = self.on_picture(x, y)
        if self.exposure is None:
            place, slope = _beams(self.camera, self.view, x, y)
            return SkyCorners(key, place, slope, np.zeros((len(key), 0, 3)))
        # The sky is at rest, and the camera goes round.
        first, now, last = (_columns(moment, x, y) for moment in self.exposure)
        off = (first[:, :1] + last[:, :1]) / 2 - now[:, :1]
        moved = np.concatenate([last - first, off], axis=1)
        return SkyCorners(key, now[:, 0], np.swapaxes(now[:, 1:], 1, 2), moved)

    def checks(self, squares: Squares, chosen: Array) -> Float[Array, "n checks 3"]:
        """n' of rays within cells, where their patches are checked."""
        x, y = np.array(_CHECKS).T * squares.size - 0.5
        left, top = self.on_picture(squares.x[chosen, None], squares.y[chosen, None])
        sky, _ = self.view.directions(left + x, top + y)
        azimuth = 0.0 if self.exposure is None else self.exposure.middle.azimuth
        return turned(trace_rays(self.camera, sky, "auto", TOLERANCE).direction, azimuth)

    def edge(self) -> tuple[Array, Array]:
        """Pixels on the shadow edge, some of them, on the lattice."""
        if not isinstance(self.view, View):
            return np.zeros(0, int), np.zeros(0, int)
        if self.exposure is None:
            points = self.view.pixels(shadow_edge(self.camera, _EDGE_POINTS))
        else:
            moments = [self.exposure.at(float(moment)) for moment in np.linspace(-0.5, 0.5, _EDGES)]
            edges = [one.view.pixels(shadow_edge(one.camera, _EDGE_POINTS)) for one in moments]
            points = np.concatenate([edge + step for edge in edges for step in _BESIDE])
        x, y = (points + 0.5).T
        near = (x >= -1) & (y >= -1) & (x < self.view.width + 1) & (y < self.view.height + 1)
        return (x[near] + self.origin[0]).astype(int), (y[near] + self.origin[1]).astype(int)


_BESIDE = np.stack(np.meshgrid(*2 * [np.arange(-1, 2)]), axis=-1).reshape(-1, 2)


def _beams(camera: Camera, view: Plane, x: Array, y: Array) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 2"]]:
    """n' at upper left corners of pixels, and its slopes."""
    sky, steps = view.directions(x - 0.5, y - 0.5)
    beams = trace_beams(camera, sky, "auto", TOLERANCE, index=False, crossings=False, redshift=False)
    return beams.direction, slopes(beams, sky, steps)


def _columns(moment: ExposedMoment, x: Array, y: Array) -> Float[Array, "n 3 3"]:
    """n' and its two slopes (n, 3, 3), one in each row, at a moment, for a sky at rest."""
    place, slope = _beams(moment.camera, moment.view, x, y)
    return turned(np.concatenate([place[:, None], np.swapaxes(slope, 1, 2)], axis=1), moment.azimuth)


def ray_directions(moment: ExposedMoment, x: ArrayLike, y: ArrayLike) -> Float[Array, "*batch 3"]:
    """n' (..., 3) of rays at places of a view at a moment, for a sky at rest."""
    rays = trace_rays(moment.camera, moment.view.directions(x, y)[0], "auto", TOLERANCE)
    return turned(rays.direction, moment.azimuth)


def slopes(
    beams: Beams, sky: Float[Array, "*batch 3"], steps: Float[Array, "*batch 3 2"]
) -> Float[Array, "*batch 3 2"]:
    """Changes (..., 3, 2) of n' for pixels with directions N (..., 3) and steps (..., 3, 2)."""
    return np.stack(polar_basis(beams.direction), axis=-1) @ pixel_matrix(beams, sky, steps)


def chart_cells(camera: Camera, chart: Plane, close: float, hidden: Bool[Array, "h w"], cut: Cut) -> SkyCells:
    """Cells of the map of a chart, in all of which no more of the sky is seen than the cut allows, and their errors.

    The smallest cells are as good as they can be. Parameters else as for `sky_map`.
    """
    return _mapped(_SkyLattice(camera, chart, None, cut.root, 0), close, hidden, cut.wide).cells


def sky_map(
    camera: Camera, view: View, close: float, hidden: Bool[Array, "h w"], exposure: Exposure | None = None
) -> SkyMap:
    """The map of a view, and of a pixel beyond each side of it.

    close: how far, in pixels, patches may be off; hidden: pixels that are left out; exposure: during which the
    camera moves, with this view in its middle.
    """
    return _mapped(_SkyLattice(camera, view, exposure, _root_size(view), _MARGIN), close, hidden)


def _mapped(lattice: _SkyLattice, close: float, hidden: Bool[Array, "h w"], wide: float | None = None) -> SkyMap:
    """The map of what a lattice covers; wide: of the sky that cells may see, in a chart; None in a picture."""
    view, exposure = lattice.view, lattice.exposure
    squares, edge = lattice.roots(), lattice.edge()
    corners, accepted = lattice.trace(np.zeros(0, int)), []
    left = parts = np.zeros(0, int)
    counts = lattice.pixel_counts(hidden)
    while len(squares.x):
        squares = _visible_squares(squares, counts)
        x, y, size = squares
        keys = np.stack([lattice.key(x + i * size, y + j * size) for i, j in CORNERS], axis=-1)
        new = np.unique(keys)
        new = new[~find(corners.key, new)[1]]
        corners = merged(corners, _on_cores(lattice.trace, new)) if len(new) else corners
        number, _ = find(corners.key, keys)
        reached = corners.there[number]
        mixed = (reached.any(axis=1) & ~reached.all(axis=1)) | _contain(squares, edge)
        whole = reached.all(axis=1) & ~mixed
        if size > 1:
            whole &= ~_next_to(mixed, number, len(corners.key))
        joined = partial(_cells, lattice, corners, squares, number, close)
        cells = _on_cores(joined, np.flatnonzero(whole))
        good = (cells.error <= close) & ((size == 1 and exposure is None) | (_extent(cells) < (wide or _WIDE)))
        good |= size == 1 and wide is not None
        accepted.append(SkyCells(*(part[good] for part in cells)))
        split = mixed | reached.all(axis=1)
        split[np.flatnonzero(whole)[good]] = False
        if size == 1:
            x, y = lattice.on_picture(x, y)
            split &= (x >= 0) & (y >= 0) & (x < view.width) & (y < view.height)
            extent = np.sqrt((corners.slope[number[split]] ** 2).sum(axis=(2, 3))).max(axis=1)
            parts = np.where(mixed[split], PARTS, _parts_for(extent))
            left = y[split] * view.width + x[split]
            break
        squares = squares.quarters(split)
    cells = SkyCells(*(np.concatenate(parts) for parts in zip(*accepted, strict=True)))
    x, y = lattice.on_picture(cells.x, cells.y)
    cells = cells._replace(x=x, y=y)
    return SkyMap(cells, left, parts, len(corners.key) * (1 if exposure is None else 3))


def _root_size(view: View) -> int:
    size = _LARGEST
    while size > 1 and size * view.pixel > _LARGEST_ANGLE:
        size //= 2
    return size


def _on_cores(work: Callable[[Array], Rows], rows: Int[Array, " n"]) -> Rows:
    """Results of work on rows, shared out among the cores: named tuples of arrays."""
    with ThreadPoolExecutor(cores()) as pool:
        parts = list(pool.map(work, np.array_split(rows, cores())))
    return type(parts[0])(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _visible_squares(squares: Squares, total: Int[Array, "h+1 w+1"]) -> Squares:
    """Squares with a pixel of the picture that is not hidden; total: their number above and left of each corner."""
    x, y, size = squares
    height, width = total.shape[0] - 1, total.shape[1] - 1
    right, below = np.minimum(x + size, width), np.minimum(y + size, height)
    x_in, y_in = np.minimum(x, width), np.minimum(y, height)
    visible = total[below, right] - total[y_in, right] - total[below, x_in] + total[y_in, x_in] > 0
    return Squares(x[visible], y[visible], size)


def _contain(squares: Squares, edge: tuple[Array, Array]) -> Bool[Array, " n"]:
    """True for cells that contain one of some pixels."""
    x, y, size = squares
    columns = 1 + max(x.max(initial=0), edge[0].max(initial=0)) // size
    held = np.unique(edge[1] // size * columns + edge[0] // size)
    return np.isin(y // size * columns + x // size, held)


def _next_to(mixed: Bool[Array, " n"], number: Int[Array, "n 4"], corners: int) -> Bool[Array, " n"]:
    """True for cells with a corner that belongs to a mixed one too: the shadow edge may bulge into them."""
    near = np.zeros(corners, bool)
    near[number[mixed]] = True
    return np.asarray(near[number].any(axis=1))


def _cells(
    lattice: _SkyLattice, corners: SkyCorners, squares: Squares, number: Array, close: float, chosen: Int[Array, " m"]
) -> SkyCells:
    """Some cells, with their errors: NaN where not even the corners agree."""
    x, y, size = squares
    place, slope = corners.place[number[chosen]], corners.slope[number[chosen]]
    data = np.concatenate([place, slope[..., 0] * size, slope[..., 1] * size], axis=1)
    curving = _curving(slope, size)
    scale = _Scale(data, curving, size)
    error = np.max([scale.pixels(doubt) for doubt in doubts(data)], axis=0)
    with np.errstate(invalid="ignore"):
        error[~(error <= close)] = np.nan
    rates = np.zeros((len(chosen), 0, 3))
    if lattice.exposure is not None:
        moved = np.moveaxis(corners.moved[number[chosen]], 2, 0)
        rates = np.concatenate([moved[0], moved[1] * size, moved[2] * size], axis=1)
        error[np.max([scale.pixels(off) for off in moved[3].swapaxes(0, 1)], axis=0) > CROOKED] = np.nan
    checked = np.flatnonzero(np.isfinite(error))
    rays = lattice.checks(squares, chosen[checked])
    for check, (right, down) in enumerate(_CHECKS):
        value = np.einsum("nkc,k->nc", data[checked], weights(right, down, 0.0, 1).value[:, 0])
        miss = np.zeros((len(chosen), 3))
        miss[checked] = rays[:, check] - value / np.linalg.norm(value, axis=-1, keepdims=True)
        error = np.maximum(error, scale.pixels(miss))
    return SkyCells(x[chosen], y[chosen], np.full(len(chosen), size), data, curving, error, rates)


def _curving(slope: Float[Array, "n 4 3 2"], size: int) -> Float[Array, "n 3 3"]:
    """Second derivatives (n, 3, 3) of n', along xx, xy and yy, from the slopes at the corners."""
    along_x = (slope[:, 1] - slope[:, 0] + slope[:, 3] - slope[:, 2]) / (2 * size)
    along_y = (slope[:, 2] - slope[:, 0] + slope[:, 3] - slope[:, 1]) / (2 * size)
    return np.stack([along_x[..., 0], (along_x[..., 1] + along_y[..., 0]) / 2, along_y[..., 1]], axis=1)


class _Scale:
    """The maps in the middles of cells, to turn errors of n' into pixels."""

    def __init__(self, data: Float[Array, "n 12 3"], curving: Float[Array, "n 3 3"], size: Any) -> None:
        """Parameters as in `SkyCells`."""
        where = weights(0.5, 0.5, 0.0, 1)
        value, *columns = (
            np.einsum("nkc,k->nc", data, part[:, 0]) for part in (where.value, where.along_x, where.along_y)
        )
        self.middle = value / np.linalg.norm(value, axis=-1, keepdims=True)
        basis = np.stack(polar_basis(self.middle), axis=-2)
        matrix = basis @ np.stack(columns, axis=-1) / np.reshape(size, (-1, 1, 1))
        self._major, minor, angle = singular_values(matrix)
        axis = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
        self._along = (axis @ basis)[:, 0]
        self._across = np.cross(self.middle, self._along)
        # A pixel on a critical curve is folded over a strip of the sky: there an error counts by its width.
        self._minor = np.hypot(np.minimum(minor, _least_minor(data) / size), bend(curving, self._across))

    def pixels(self, miss: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Displacements (n,) on the picture by errors (n, 3) of n'."""
        along, across = (np.vecdot(miss, axis) for axis in (self._along, self._across))
        return np.hypot(along / self._major, across / self._minor)


def _least_minor(data: Float[Array, "n 12 3"]) -> Float[Array, " n"]:
    """The smallest minor axis (n,) at the corners, for the whole cell; 0 where a critical curve passes between."""
    one, other = data[:, 4:8], data[:, 8:]
    area = np.vecdot(np.cross(one, other), data[:, :4])
    minor = area / major_axis(one, other)[0]
    return np.where(minor.min(axis=1) * minor.max(axis=1) > 0, np.abs(minor).min(axis=1), 0.0)


def parts_of(cells: SkyCells) -> Int[Array, " n"]:
    """Numbers of parts each way of pixels: the linear map of a beam does not reach far."""
    return _parts_for(_extent(cells))


def _extent(cells: SkyCells) -> Float[Array, " n"]:
    """Angles (n,) of the sky, radians, that cells see along a side."""
    return np.asarray(np.sqrt((cells.data[:, 4:] ** 2).sum(axis=-1)).max(axis=1))


def resolved(cells: SkyCells, extent: float) -> Bool[Array, " n"]:
    """True for cells (n,) whose pixels see less of the sky than an extent, and are not to be divided."""
    return (_extent(cells) < extent * cells.size) & (parts_of(cells) == 1)


def undivided(cells: SkyCells) -> SkyCells:
    """Cells whose pixels are not to be divided."""
    one = parts_of(cells) == 1
    return SkyCells(*(part[one] for part in cells))


def _parts_for(extent: Float[Array, " n"]) -> Int[Array, " n"]:
    return np.where(extent < _WIDE, 1, np.where(extent < _WIDEST, 2, PARTS))


class Pixels(NamedTuple):
    """Squares of a picture.

    place x, y (2, m), pixels; side; direction n' (3, m), and its steps along x and y (2, 3, m); cell (m,).
    """

    place: Array
    side: float
    direction: Array
    steps: Array
    cell: Array


def places(cells: SkyCells, which: Int[Array, " n"], parts: int) -> Iterator[Pixels]:
    """All pixels of some cells, each in parts x parts squares, some at a time."""
    for size in np.unique(cells.size[which]):
        same = which[cells.size[which] == size]
        at_once = max(_TOGETHER // (int(size) * parts) ** 2, 1)
        for start in range(0, len(same), at_once):
            yield _places(cells, same[start : start + at_once], int(size), parts)


def _places(cells: SkyCells, which: Int[Array, " n"], size: int, parts: int) -> Pixels:
    count = size * parts
    where = weights(0.0, 0.0, 1.0, count)
    within = (np.arange(count) + 0.5) / parts - 0.5
    x = np.broadcast_to(cells.x[which, None, None] + within, (len(which), count, count))
    y = np.broadcast_to(cells.y[which, None, None] + within[:, None], (len(which), count, count))
    data = np.moveaxis(cells.data[which], -1, 0)
    direction, along_x, along_y = ((data @ part).reshape(3, -1) for part in (where.value, where.along_x, where.along_y))
    direction /= np.sqrt((direction**2).sum(axis=0))
    steps = np.stack([along_x, along_y]) / count
    return Pixels(np.stack([x.ravel(), y.ravel()]), 1 / parts, direction, steps, np.repeat(which, count * count))
