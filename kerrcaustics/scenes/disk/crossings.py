"""The map of a picture to the equatorial plane: the n-th crossing of every ray, from few beams.

Over a picture the radius, the azimuth and the travel time of the n-th crossing are smooth functions, also across the
shadow edge. So beams are traced at the corners of square cells, and coons_patches.py joins them. Cells are halved where
the patch may be off by a hundredth of a pixel, and where some of the corners' rays no longer cross, down to a
sixteenth of a pixel: so images of the disk that are thinner than a pixel are found too. Cells that see nothing between
the rims are left out.
"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.beam import Rays, Status
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.beams.trace import beams_of_directions, rays_of_directions
from kerrcaustics.scenes.coons_patches import doubt
from kerrcaustics.scenes.footprint import pixel_matrix
from kerrcaustics.scenes.quadtree import Division, Level, Squares, fill, find, joined, merged
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.frame import photon_of, redshift as sky_redshift
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Tolerance of rays and beams, radians: far less than a pixel.
_TOLERANCE = 1e-7
FINEST = 16
"""Number of finest cells along a pixel: the lattice of crossings has this step."""
LARGEST = 8
"""Side of the largest cells, pixels."""
# Rays each way in a finest cell on which the map is not smooth.
_RAYS = 2
# Shifts of these rays from cell to cell, a sequence of low discrepancy in two dimensions.
_SHIFTS = ((0.7548776662466927, 0.5698402909980532), (0.5698402909980532, 0.7548776662466927))
# Error of patches that is always accepted, as a part of the disk's width in 1 / r.
_OF_WIDTH = 1e-5
# Error of the azimuth that is always accepted, radians.
_OF_AZIMUTH = 1e-6
# Largest difference of the azimuths in a cell, radians: they are known modulo 2 pi.
_WIDEST_TURN = 1.5
# Largest number of halvings that a lattice of one of several moments leaves out.
_MOST_HALVINGS = 2
# Shift of the rays from moment to moment: the golden ratio less 1.
_GOLDEN = 0.6180339887498949
MOST_CROSSINGS = 12
"""Largest number of crossings: rays that cross more often are too close to the shadow edge to be visible."""


class Fineness(NamedTuple):
    """Fineness of a map.

    least: size of the smallest cells on the finest lattice, less than a pixel.
    of_pixel: largest error of patches, pixels.
    widest: size of the largest cells, radians; constants of the photon and travel times are linear in them.
    faintest: part of every pixel below which later crossings are left out.
    """

    least: int
    of_pixel: float
    widest: float
    faintest: float


# The faintest part of a pixel is less than a screen resolves.
FINE = Fineness(least=1, of_pixel=0.0015, widest=0.02, faintest=1 / 340)
DRAFT = Fineness(least=8, of_pixel=0.02, widest=0.04, faintest=1 / 30)


class Corners(NamedTuple):
    """Crossings of the plane by rays at corners of cells.

    key: (n,) numbers of the places on the finest lattice, ascending.
    place: (n, 2) 1 / r and phi.
    slope: (n, 2, 2) changes of 1 / r and phi (rows) per pixel along x and y (columns).
    extra: (n, 5) nu_camera / nu_infinity, b and q of the photon, 1 if it moves outward, and the travel time, M.
    side: (n,) 0 if the ray crosses the plane, 1 if it escapes before, -1 if it falls in.
    outward: (n,) True if it moves outward at the crossing.
    """

    key: Array
    place: Array
    slope: Array
    extra: Array
    side: Array
    outward: Array


class DiskCells(NamedTuple):
    """Square cells of a picture that see the plane, at one crossing.

    x, y: (n,) upper left corners on the finest lattice, 0 at the corner of the picture.
    size: (n,) lengths of the sides on the lattice.
    data: (n, 12, 2) 1 / r and phi and their derivatives at the corners, as for `coons_patches`.
    extra: (n, 4, 5) extra values at the corners, as of `Corners`.
    low, high: (n, 2) limits of 1 / r and phi.
    cover: (n,) parts of the cells that see the disk.
    """

    x: Array
    y: Array
    size: Array
    data: Array
    extra: Array
    low: Array
    high: Array
    cover: Array


class Lattice(NamedTuple):
    """The finest lattice of a picture.

    A picture that is the mean of several moments has as many rays in a pixel as a picture of one moment if the least
    cells of its lattices are larger and their phases differ.

    camera: the viewer.
    view: its picture.
    timed: True if travel times are computed.
    least: size of the smallest cells for images that are smooth nowhere.
    phase: shift of the rays in these cells, 0 to 1.
    fineness: fineness of the map.
    """

    camera: Viewer
    view: Raster
    timed: bool
    least: int = 1
    phase: float = 0.0
    fineness: Fineness = FINE

    @classmethod
    def draft(cls, camera: Viewer, view: Raster, timed: bool) -> "Lattice":
        """The lattice of a draft."""
        return cls(camera, view, timed, DRAFT.least, fineness=DRAFT)

    @classmethod
    def at_moment(cls, camera: Viewer, view: Raster, timed: bool, number: int, moments: int) -> "Lattice":
        """The lattice of one of several moments, each with rays of its own."""
        least = 2 ** min(int(math.log2(moments) / 2), _MOST_HALVINGS)
        return cls(camera, view, timed, least, number * _GOLDEN % 1.0)

    @property
    def columns(self) -> int:
        """A number larger than that of corners from left to right."""
        return (self.view.width + 2 * LARGEST) * FINEST

    def roots(self) -> Squares:
        """The largest cells, which cover the picture."""
        size = FINEST * LARGEST
        most = self.fineness.widest / self.view.pixel_angle * FINEST
        while size > 1 and size > most:
            size //= 2
        return Squares.over(self.view.width * FINEST, self.view.height * FINEST, size)

    def key(self, x: Array, y: Array) -> Array:
        """The key of a place."""
        return y * self.columns + x

    def trace(self, key: Array, crossing: int) -> Corners:
        """Trace the rays at some places."""
        y, x = np.divmod(key, self.columns)
        sky, steps = self._directions(x, y)
        end = EquatorialPlane(crossing)
        without = {"index": False, "crossings": False, "redshift": False}
        beams = beams_of_directions(self.camera, sky, "auto", _TOLERANCE, end=end, time=self.timed, **without)
        radius, per_pixel = beams.radius, pixel_matrix(beams, sky, steps)
        slope = np.stack([-per_pixel[:, 0] / radius[:, None] ** 2, per_pixel[:, 1] / radius[:, None]], axis=1)
        crosses = np.isfinite(slope.sum(axis=(1, 2)))
        side = np.where(crosses, 0, np.where(beams.status == Status.CAPTURED, -1, 1)).astype(np.int8)
        place = np.stack([1 / radius, beams.azimuth], axis=-1)
        return Corners(key, place, slope, self._extra(sky, beams), side, beams.outward)

    def rays(self, x: Array, y: Array, crossing: int) -> tuple[Float[Array, "n 2"], Float[Array, "n 5"]]:
        """1 / r and phi (n, 2), and the extra values (n, 5), of rays on the lattice; NaN without a crossing."""
        sky, _ = self._directions(x, y)
        end = EquatorialPlane(crossing)
        rays = rays_of_directions(self.camera, sky, "auto", _TOLERANCE, end=end, time=self.timed)
        return np.stack([1 / rays.radius, rays.azimuth], axis=-1), self._extra(sky, rays)

    def _directions(self, x: Array, y: Array) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 2"]]:
        return self.view.directions(x / FINEST - 0.5, y / FINEST - 0.5)

    def _extra(self, sky: Float[Array, "n 3"], rays: Rays) -> Float[Array, "n 5"]:
        photon = photon_of(self.camera.frame(), tuple(sky.T))
        time = np.zeros(len(sky)) if rays.time is None else rays.time
        assert rays.outward is not None
        return np.stack(
            [sky_redshift(self.camera.frame(), sky, photon), photon.b, photon.q, rays.outward, time], axis=-1
        )


class DiskCrossings(NamedTuple):
    """All crossings of a picture.

    cells: cells of each crossing, from the first one on.
    beams: number of beams traced to each crossing.
    """

    cells: tuple[DiskCells, ...]
    beams: tuple[int, ...]


def crossings(lattice: Lattice, inner: float, outer: float, opaque: bool) -> DiskCrossings:
    """The crossings between two radii, nearest first, up to the last one that can contribute.

    opaque: True if the plane between the radii hides everything behind it.
    """
    x, y, size = lattice.roots()
    rims = 1 / outer, 1 / inner
    layers, beams, before = [], [], _NONE
    for crossing in range(1, MOST_CROSSINGS + 1):
        if not len(x):
            break
        # The first image that is not smooth is partly smooth in the finest cells; later ones are thinner, and nowhere.
        thin = bool(layers) and bool((layers[-1].cover < 1).any())
        finer = lattice if thin else lattice._replace(least=lattice.fineness.least)
        cells, corners, traced = _crossing(finer, crossing, Squares(x, y, size), rims, before)
        beams.append(traced)
        if crossing > 1 and not len(cells.x):
            break
        layers.append(cells)
        if _faint(layers, lattice):
            break
        x, y = _continuing(lattice, corners, Squares(x, y, size), rims, opaque)
        before = corners
    return DiskCrossings(tuple(layers), tuple(beams))


def _crossing(
    lattice: Lattice, crossing: int, roots: Squares, rims: tuple[float, float], before: Corners
) -> tuple[DiskCells, Corners, int]:
    trace, accept = partial(_corners, lattice, crossing, before), partial(_accepted, lattice, rims)
    cells, level, split = Division(lattice.columns, trace, accept, lattice.least).divide(roots, _NONE)
    traced = len(level.corners.key) - len(_lost(before, level.corners.key).key)
    if split.any():
        sampled, count = _sampled(lattice, crossing, level.squares.x[split], level.squares.y[split], rims)
        cells, traced = joined([cells, sampled]), traced + count
    return cells, level.corners, traced


def _accepted(
    lattice: Lattice, rims: tuple[float, float], level: Level[Corners]
) -> tuple[DiskCells, Bool[Array, " n"]]:
    """The good cells of a level, and the mask of those to be divided."""
    pixels = level.squares.size / FINEST
    side = level.corners.side[level.number]
    whole = (side == 0).all(axis=1)
    low, high = _range(level.corners, level.number, pixels)
    empty = _empty(side, low[:, 0], high[:, 0], rims)
    data = _data(level.corners, level.number, pixels)
    good = whole & ~empty & _smooth(data, low, high, pixels, rims, lattice.fineness.of_pixel)
    split = ~empty & ~good
    if level.squares.size >= FINEST:
        # A thin image may bulge into a cell without reaching its corners.
        split |= ~whole & ~good & level.beside(split)
    return _cells(level, data, low, high, good), split


_NONE = Corners(
    np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 5)), np.zeros(0, np.int8), np.zeros(0, bool)
)


def _corners(lattice: Lattice, crossing: int, before: Corners, key: Int[Array, " n"]) -> Corners:
    """Corners at some keys: rays without the last crossing have no further one, the others are traced."""
    lost = _lost(before, key)
    new = key[~find(lost.key, key)[1]]
    return merged(lost, lattice.trace(new, crossing)) if len(new) else lost


def _lost(before: Corners, key: Int[Array, " n"]) -> Corners:
    """Corners at some keys whose rays have no crossing any more."""
    number, is_known = find(before.key, key)
    number = number[is_known]
    return Corners(*(part[number[before.side[number] != 0]] for part in before))


def _range(corners: Corners, number: Array, pixels: float) -> tuple[Float[Array, "cells 2"], Float[Array, "cells 2"]]:
    """Limits of 1 / r and phi in cells, from the corners that cross, each extrapolated over its quarter."""
    place = _aligned(corners.place[number])
    reach = np.abs(corners.slope[number]).sum(axis=-1) * (pixels / 2)
    crosses = (corners.side[number] == 0)[..., None]
    low = np.where(crosses, place - reach, np.inf).min(axis=1)
    high = np.where(crosses, place + reach, -np.inf).max(axis=1)
    return low, high


def _aligned(place: Float[Array, "cells some 2"]) -> Float[Array, "cells some 2"]:
    """Places with the azimuths of a cell shifted by multiples of 2 pi to lie close to each other."""
    place = place.copy()
    phi = place[..., 1]
    first = np.where(np.isnan(phi[:, :1]), np.nanmin(np.where(np.isnan(phi), np.inf, phi), axis=1)[:, None], phi[:, :1])
    first = np.where(np.isfinite(first), first, 0.0)
    place[..., 1] = phi - 2 * np.pi * np.round((phi - first) / (2 * np.pi))
    return place


def _empty(side: Array, low: Array, high: Array, rims: tuple[float, float]) -> Bool[Array, " cells"]:
    """True for cells that see nothing between the rims: all of their rays pass beyond the same rim."""
    farthest, nearest = rims
    beyond = (high < farthest) & (side >= 0).all(axis=1)
    within = (low > nearest) & (side <= 0).all(axis=1)
    return beyond | within


def _data(corners: Corners, number: Array, pixels: float) -> Float[Array, "cells 12 2"]:
    slope = corners.slope[number] * pixels
    return np.concatenate([_aligned(corners.place[number]), slope[..., 0], slope[..., 1]], axis=1)


def _smooth(
    data: Array, low: Array, high: Array, pixels: float, rims: tuple[float, float], of_pixel: float
) -> Bool[Array, " cells"]:
    """True for patches whose errors are small enough for a picture."""
    per_pixel = np.hypot(data[:, 4:8], data[:, 8:]).max(axis=1) / pixels
    least = np.array([_OF_WIDTH * (rims[1] - rims[0]), _OF_AZIMUTH])
    close = doubt(data) <= np.maximum(of_pixel * per_pixel, least)
    return close.all(axis=1) & (high[:, 1] - low[:, 1] < _WIDEST_TURN)


def _cells(level: Level[Corners], data: Array, low: Array, high: Array, good: Array) -> DiskCells:
    (x, y, size), extra = level.squares, level.corners.extra[level.number[good]]
    sizes = np.full(good.sum(), size)
    return DiskCells(x[good], y[good], sizes, data[good], extra, low[good], high[good], np.ones(len(sizes)))


def _sampled(lattice: Lattice, crossing: int, x: Array, y: Array, rims: tuple[float, float]) -> tuple[DiskCells, int]:
    """Finest cells on which the map is not smooth, by a few rays each: the part that sees the disk, and a sample of it.

    The places of the rays, and the ray of the sample, change from cell to cell, as a regular pattern would beat with a
    thin image.
    """
    size = lattice.least
    column, row = x // size, y // size
    shifts = [((column * ray + row * column_ray + lattice.phase) % 1.0)[:, None, None] for ray, column_ray in _SHIFTS]
    step, part = np.arange(_RAYS) * (size / _RAYS), size / _RAYS
    across, down = np.broadcast_arrays(
        x[:, None, None] + step + shifts[0] * part, y[:, None, None] + step[:, None] + shifts[1] * part
    )
    place, extra = lattice.rays(across.ravel(), down.ravel(), crossing)
    place, extra = place.reshape(len(x), -1, 2), extra.reshape(len(x), -1, 5)
    on_disk = (place[..., 0] >= rims[0]) & (place[..., 0] <= rims[1])
    count = on_disk.sum(axis=1)
    which = np.flatnonzero(count)
    # Rays that see the disk are sorted first.
    chosen = (column + 3 * row)[which] % count[which]
    ray = np.argsort(~on_disk[which], axis=1, kind="stable")[np.arange(len(which)), chosen]
    sample = place[which, ray]
    data = np.zeros((len(which), 12, 2))
    data[:, :4] = sample[:, None]
    four = np.repeat(extra[which, ray][:, None], 4, axis=1)
    sizes, cover = np.full(len(which), size), count[which] / on_disk.shape[1]
    return DiskCells(x[which], y[which], sizes, data, four, sample, sample, cover), across.size


def covered(layers: tuple[DiskCells, ...], shape: tuple[int, int], inner: float, outer: float) -> Bool[Array, "h w"]:
    """True for pixels (h, w) that see nothing but the plane between two radii at one crossing."""
    mask = np.zeros(shape, bool)
    for cells in layers:
        full = (cells.low[:, 0] >= 1 / outer) & (cells.high[:, 0] <= 1 / inner) & (cells.size >= FINEST)
        fill(mask, *(part[full] // FINEST for part in (cells.x, cells.y, cells.size)), value=True)
    return mask


def _faint(layers: list[DiskCells], lattice: Lattice) -> bool:
    """True if the next crossing, by the last two, will cover less of any pixel than a screen can show."""
    if len(layers) < 2 or not len(layers[-2].x):
        return False
    before, last = (float((cells.cover * cells.size**2).sum()) for cells in layers[-2:])
    return _most(layers[-1], lattice) * last / before < lattice.fineness.faintest


def _most(cells: DiskCells, lattice: Lattice) -> float:
    """The largest part of any pixel that cells cover."""
    if not len(cells.x) or cells.size.max() >= FINEST:
        return 1.0
    pixel = cells.y // FINEST * lattice.columns + cells.x // FINEST
    _, number = np.unique(pixel, return_inverse=True)
    return float(np.bincount(number, cells.cover * (cells.size / FINEST) ** 2).max())


def _continuing(
    lattice: Lattice, corners: Corners, roots: Squares, rims: tuple[float, float], opaque: bool
) -> tuple[Int[Array, " roots"], Int[Array, " roots"]]:
    """The largest cells in which rays may cross between the rims again."""
    x, y, size = roots
    u = corners.place[:, 0]
    continuing = (corners.side == 0) & ~((u < rims[0]) & corners.outward)
    if opaque:
        continuing &= ~((u >= rims[0]) & (u <= rims[1]))
    row, column = np.divmod(corners.key[continuing], lattice.columns)
    keys = [lattice.key((column - i) // size * size, (row - j) // size * size) for i in (0, 1) for j in (0, 1)]
    chosen = np.isin(lattice.key(x, y), np.concatenate(keys))
    return x[chosen], y[chosen]
