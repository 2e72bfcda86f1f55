"""Points of light on the celestial sphere, and all their images on a picture.

The map of a picture (sky_cells.py) is inverted for every star: each image is drawn where it is, as large as a pixel,
with the light that its magnification gives it.
"""

import math
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.scenes.colour import ResponseLike
from kerrcaustics.scenes.coons_patches import weights_at
from kerrcaustics.scenes.footprint import bend, major_axis, turned
from kerrcaustics.scenes.quadtree import in_chunks
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky_cells import SkyCells
from kerrcaustics.shapes import Bool, Float, Int

if TYPE_CHECKING:
    from scipy.spatial import KDTree

Array = np.ndarray

# Cells that are searched together.
_CELLS = 1 << 12
# A cell's image lies within the disc about its middle that holds so many points of it in each direction, and more.
_SAMPLES, _SLACK = 3, 1.3
# Cells whose map turns over, or bends more than this from one place to another, are searched from so many starts.
_BENT, _STARTS = 3.0, 8
_GRID = np.stack(np.meshgrid(*2 * [(np.arange(_STARTS) + 0.5) / _STARTS]), axis=-1).reshape(-1, 2)
# Half the diagonal of a start's part of a cell, and somewhat more.
_PART = 1.0 / _STARTS
# A search ends with a step that is shorter than the first of these, in units of the cell, and has found an image if its
# last one was shorter than the second.
_STEPS, _LAST, _SOLVED = 20, 1e-5, 1e-4
# Searches that are made together: their patches fit in a core's cache.
_TOGETHER = 1 << 12
Starts = tuple[Int[Array, " s"], Float[Array, "s 2"]]
# Images this close (pixels) are one, where cells meet; none is brighter than one so far from its critical curve.
_SAME, _NEAREST = 0.02, 0.05
# Cells reach so far into their neighbours, in units of their size: no image is lost where they meet.
_OVER = 1e-3
# By how much the radii of discs that are searched together differ at most.
_ALIKE = 1.5


@dataclass(frozen=True, eq=False)
class PointLights:
    """Stars: directions n' (n, 3), linear sRGB light (n, 3), temperatures (n,).

    response: that for which their colours are shifted, as in `black_body`.
    """

    direction: Array
    flux: Array
    temperature: Array
    response: ResponseLike = "cie"

    @cached_property
    def tree(self) -> "KDTree":
        """A tree of the directions, for searches by distance."""
        from scipy.spatial import KDTree

        return KDTree(self.direction)

    def some(self, which: Int[Array, " m"], turn: ArrayLike) -> "PointLights":
        """The chosen lights, turned about the spin axis by angles, (m,) or one."""
        direction = turned(self.direction[which], turn)
        return PointLights(direction, self.flux[which], self.temperature[which], self.response)


class Imaged(NamedTuple):
    """Images on a picture.

    place (m, 2), pixels; star (m,); area (m,), the solid angle that a pixel sees; steps (m, 2, 3) of n' for one, and
    how these change (m, 3, 3), along xx, xy, yy; rate (m, 3, 3): how n' moves over an exposure, and how that changes
    per pixel along x and y.
    """

    place: Array
    star: Array
    area: Array
    steps: Array
    curving: Array
    rate: Array


class CellSearch:
    """The search for images in some cells, prepared once for all stars."""

    def __init__(self, cells: SkyCells, at_once: int = _CELLS) -> None:
        """cells: those that are searched; at_once: number of cells that are searched together."""
        self.cells = cells
        self._chunks = in_chunks(cells.size, lambda _: at_once)
        self._reaches = [_Reach(cells.data[which], cells.rates[which]) for which in self._chunks]

    def images(self, lights: PointLights, moment: Float[Array, " stars"], pool: Executor) -> Imaged:
        """All images in the cells, of each star at a moment of the exposure, from -1/2 to 1/2."""
        parts = list(pool.map(partial(_images, self.cells, lights, moment), self._chunks, self._reaches))
        return once(Imaged(*(np.concatenate(parts) for parts in zip(_NONE, *parts, strict=True))))


_NONE = Imaged(np.zeros((0, 2)), np.zeros(0, int), np.zeros(0), np.zeros((0, 2, 3)), *2 * [np.zeros((0, 3, 3))])


def _images(
    cells: SkyCells, lights: PointLights, moment: Float[Array, " stars"], which: Int[Array, " n"], reach: "_Reach"
) -> Imaged:
    """All images in some cells of one size."""
    pair, star, away = reach.near(lights)
    if not len(pair):
        return _NONE
    parts = []
    for mask, start in ((~reach.bent, None), (reach.bent & ~reach.folded, _nearest), (reach.folded, _near)):
        chosen = np.flatnonzero(mask[pair])
        cell, target = pair[chosen], lights.direction[star[chosen]]
        data = cells.data[which[cell]]
        if cells.moving:
            data += moment[star[chosen], None, None] * cells.rates[which[cell]]
        if start is None:
            # There the axes are those of a step from the middle.
            starts = np.arange(len(chosen)), 0.5 + _shortened(away[chosen])
        else:
            starts = start(cells.data[which[mask]], (np.cumsum(mask) - 1)[cell], target)
        at, place, columns = _solved(data, target, *starts)
        rows = chosen[at]
        parts.append(_imaged(cells, which[pair[rows]], star[rows], place, columns))
    return Imaged(*(np.concatenate(parts) for parts in zip(*parts, strict=True)))


class _Reach:
    """Parts of the sky that cells cover, from samples: a parallelogram about a middle (n, 3), and a disc that holds it.

    folded (n,): cells whose map turns over; bent (n,): those, and cells whose map bends strongly.
    """

    def __init__(self, data: Float[Array, "n 12 3"], rates: Float[Array, "n _ 3"]) -> None:
        """data, rates: of the cells."""
        where = weights_at(*np.meshgrid(*2 * [np.linspace(0, 1, _SAMPLES)]))
        parts = np.moveaxis(data, -1, 0)
        place, along_x, along_y = (parts @ part for part in (where.value, where.along_x, where.along_y))
        middle = place[..., _SAMPLES**2 // 2]
        away = place - middle[..., None]
        self.middle = (middle / np.sqrt((middle**2).sum(axis=0))).T
        self.chord = _SLACK * np.sqrt((away**2).sum(axis=0)).max(axis=1)
        # Along the way from one corner to the farthest other, and across it.
        far = np.abs(away).sum(axis=0).argmax(axis=1)
        along = np.take_along_axis(away, far[None, :, None], axis=2)[..., 0].T
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
        area = (place * np.cross(along_x, along_y, axis=0)).sum(axis=0)
        least, most = np.abs(area).min(axis=1), np.abs(area).max(axis=1)
        self.folded = area.min(axis=1) * area.max(axis=1) <= 0
        self.bent = self.folded | (most > _BENT * least)
        side = np.stack([along, np.cross(self.middle, along)], axis=1)
        # Where the map is nearly linear, a place in the cell is the sharper bound.
        columns = np.stack([part[..., _SAMPLES**2 // 2].T for part in (along_x, along_y)], axis=-1)
        self._axes = np.where(self.bent[:, None, None], side, np.linalg.pinv(columns))
        spread = self._axes @ np.moveaxis(away, 0, 1)
        low, high = spread.min(axis=2), spread.max(axis=2)
        slack = (_SLACK - 1) * (high - low) + np.where(self.bent, self.chord**2, 0.0)[:, None]
        if rates.shape[1]:
            drift = np.einsum("nkc,ks->ncs", rates, where.value) / 2
            self.chord += np.sqrt((drift**2).sum(axis=1)).max(axis=1)
            slack += np.abs(self._axes @ drift).max(axis=2)
        self._low, self._high = low - slack, high + slack

    def near(self, lights: PointLights) -> tuple[Int[Array, " m"], Int[Array, " m"], Float[Array, "m 2"]]:
        """Pairs of cells (m,) and stars (m,) that may lie in them, and how far from their middles, by the axes."""
        cell, star = _within(self.middle, self.chord, lights)
        away = np.zeros((len(cell), 0))
        for axis in range(2):
            side = np.vecdot(self._axes[cell, axis], lights.direction[star] - self.middle[cell])
            inside = (side >= self._low[cell, axis]) & (side <= self._high[cell, axis])
            away = np.column_stack([away, side])[inside]
            cell, star = cell[inside], star[inside]
        return cell, star, away


def _nearest(data: Float[Array, "cells 12 3"], cell: Int[Array, " n"], target: Float[Array, "n 3"]) -> Starts:
    """Start searches at the nearest of a grid of places."""
    value = _at_starts(data, weights_at(*_GRID.T).value)
    miss = np.vecdot(value, value)[cell] - 2 * np.vecdot(value[cell], target[:, None])
    return np.arange(len(cell)), _GRID[miss.argmin(axis=1)]


def _near(data: Float[Array, "cells 12 3"], cell: Int[Array, " n"], target: Float[Array, "n 3"]) -> Starts:
    """Start searches at all places of the grid whose part of the cell may hold the target, by the slopes there."""
    where = weights_at(*_GRID.T)
    value, first, second = (_at_starts(data, rows) for rows in (where.value, where.along_x, where.along_y))
    length, along = major_axis(first, second)
    minor = np.linalg.norm(np.cross(first, second), axis=-1) / length
    slopes = data[:, 4:].reshape(len(data), 2, 4, 3)
    bending = np.sqrt(((slopes - slopes.mean(axis=2, keepdims=True)) ** 2).sum(axis=(1, 2, 3)))
    width = _PART * (minor + _PART * bending[:, None])
    miss = target[:, None] - value[cell]
    forward = np.vecdot(miss, along[cell])
    aside = np.vecdot(miss, miss) - forward**2
    rows, start = np.nonzero((np.abs(forward) < _PART * length[cell]) & (aside < width[cell] ** 2))
    return rows, _GRID[start]


def _at_starts(data: Float[Array, "n 12 3"], rows: Float[Array, "12 starts"]) -> Float[Array, "n starts 3"]:
    """Values of patches at the starts."""
    return rows.T @ data


def _solved(
    data: Float[Array, "n 12 3"], target: Float[Array, "n 3"], rows: Int[Array, " s"], at: Float[Array, "s 2"]
) -> tuple[Int[Array, " m"], Float[Array, "m 2"], Float[Array, "m 2 3"]]:
    """Solve for the places at which patches meet targets, from starts in some of them.

    Returns the patch (m,), the place in its cell (m, 2), and the slopes (m, 2, 3) there.
    """
    blocks = [slice(first, first + _TOGETHER) for first in range(0, max(len(rows), 1), _TOGETHER)]
    patch, place, columns = zip(*(_block_solved(data, target, rows[part], at[part]) for part in blocks), strict=True)
    return np.concatenate(patch), np.concatenate(place), np.concatenate(columns)


def _block_solved(
    data: Float[Array, "n 12 3"], target: Float[Array, "n 3"], rows: Int[Array, " s"], at: Float[Array, "s 2"]
) -> tuple[Int[Array, " m"], Float[Array, "m 2"], Float[Array, "m 2 3"]]:
    """Solve for the places from some of the starts, which move there; as `_solved`."""
    keep, columns, off = np.arange(len(rows)), np.zeros((len(rows), 2, 3)), np.full(len(rows), np.inf)
    for _ in range(_STEPS):
        if not len(keep):
            break
        value, slopes = _patch(data[rows[keep]], at[keep])
        # Between its corners a patch may leave the unit sphere.
        size = np.sqrt((value**2).sum(axis=-1, keepdims=True))
        move = steps_to(slopes, target[rows[keep]] * size - value)
        length = np.sqrt((move**2).sum(axis=-1))
        at[keep] += _shortened(move)
        off[keep], columns[keep] = length, slopes
        # Searches that are far outside will not come back.
        keep = keep[(length > _LAST) & (np.abs(at[keep] - 0.5).max(axis=1) < 1.0)]
    good = (np.abs(at - 0.5).max(axis=1) <= 0.5 + _OVER) & (off < _SOLVED)
    return rows[good], at[good], columns[good]


def _shortened(move: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """Steps within cells, no longer than half of one."""
    length = np.sqrt((move**2).sum(axis=-1))
    return move * np.minimum(1, 0.5 / np.maximum(length, 1e-300))[:, None]


def _patch(data: Float[Array, "n 12 3"], at: Float[Array, "n 2"]) -> tuple[Float[Array, "n 3"], Float[Array, "n 2 3"]]:
    """n' (n, 3), and its slopes (n, 2, 3) along the sides, at one place of each patch."""
    where = weights_at(*at.T)
    rows = np.stack([where.value, where.along_x, where.along_y]).transpose(2, 0, 1)
    values = rows @ data
    return values[:, 0], values[:, 1:]


def steps_to(
    columns: Float[Array, "n 2 3"], miss: Float[Array, "n 3"], floor: Float[Array, " n"] | None = None
) -> Float[Array, "n 2"]:
    """Steps (n, 2) with columns @ step = miss, least squares; floor: of the determinant, where they are parallel."""
    first, second = columns[:, 0], columns[:, 1]
    a, b, c = np.vecdot(first, first), np.vecdot(first, second), np.vecdot(second, second)
    p, q = np.vecdot(first, miss), np.vecdot(second, miss)
    det = np.maximum(a * c - b * b, 1e-12 * (a + c) ** 2 if floor is None else floor)
    return np.stack([c * p - b * q, a * q - b * p], axis=-1) / det[:, None]


def _imaged(cells: SkyCells, cell: Int[Array, " m"], star: Array, at: Float[Array, "m 2"], columns: Array) -> Imaged:
    size = cells.size[cell, None]
    place = np.stack([cells.x[cell], cells.y[cell]], axis=-1) + at * size - 0.5
    steps = columns / size[..., None]
    first, second = steps[:, 0], steps[:, 1]
    area = np.cross(first, second)
    size_of = np.sqrt((area**2).sum(axis=-1))
    # The direction in which the pixel is thin, and how fast it opens away from the critical curve.
    major, along = major_axis(first, second)
    middle = area / np.maximum(size_of, 1e-300)[:, None]
    least = _NEAREST * math.sqrt(8) * bend(cells.curving[cell], np.cross(middle, along))
    rate = np.zeros((len(cell), 3, 3))
    if cells.moving:
        value, columns = _patch(cells.rates[cell], at)
        rate = np.concatenate([value[:, None], columns / size[..., None]], axis=1)
    return Imaged(place, star, np.maximum(size_of, major * least), steps, cells.curving[cell], rate)


def once(images: Imaged) -> Imaged:
    """Drop duplicates of images, from two starts or from two cells where they meet."""
    # Images of one star on one side of a critical curve.
    order = np.lexsort((images.place[:, 1], images.place[:, 0], images.star))
    images = Imaged(*(part[order] for part in images))
    normal = np.cross(images.steps[:, 0], images.steps[:, 1])
    keep = np.ones(len(order), bool)
    for ahead in range(1, 9):
        near = (images.star[ahead:] == images.star[:-ahead]) & (
            np.abs(images.place[ahead:] - images.place[:-ahead]).max(axis=1) < _SAME
        )
        same = (normal[ahead:] * normal[:-ahead]).sum(axis=1) >= 0
        keep[ahead:] &= ~(near & same & keep[:-ahead])
    return Imaged(*(part[keep] for part in images))


def moved(images: Any, motion: Float[Array, "m 3"]) -> Float[Array, "m 2"]:
    """Displacements, in pixels, of images (`Imaged` or `PictureImages`) whose stars move by (m, 3)."""
    # No steeper than where brightness is cut, too.
    return steps_to(images.steps, motion, np.maximum(images.area**2, 1e-300))


def drawn(light: Float[Array, "h w 3"], view: Raster, place: Float[Array, "m 2"], power: Float[Array, "m 3"]) -> None:
    """Add images to a picture, whose light times solid angle is to be (m, 3): each is a quadratic B-spline.

    Its parts add up to 1. Any part beyond a side of a picture of the whole sky comes in where it belongs.
    """
    nearest = np.round(place).astype(int)
    parts = [_spline_parts(place[:, k] - nearest[:, k]) for k in (0, 1)]
    flat = light.reshape(-1, 3)
    for i in range(3):
        for j in range(3):
            pixel, inside = _numbers(view, nearest + np.array([i - 1, j - 1]))
            weight = (parts[0][i] * parts[1][j])[inside] / view.pixel_sizes(*np.divmod(pixel, view.width)[::-1])
            for channel, part in enumerate((weight[:, None] * power[inside]).T.astype(light.dtype)):
                np.add.at(flat[:, channel], pixel, part)


def _numbers(view: Raster, pixel: Int[Array, "m 2"]) -> tuple[Int[Array, " n"], Bool[Array, " m"]]:
    """Numbers (n,) in reading order of the pixels that lie in a picture, and the mask (m,) of those that do."""
    size = view.width, view.height
    if view.closed:
        beyond = np.flatnonzero(((pixel < 0) | (pixel >= size)).any(axis=1))
        pixel[beyond] = np.round(view.pixels(view.directions(*pixel[beyond].T)[0])).astype(int)
    inside = np.asarray(((pixel >= 0) & (pixel < size)).all(axis=1))
    return pixel[inside, 1] * view.width + pixel[inside, 0], inside


def _spline_parts(offset: Float[Array, " m"]) -> tuple[Array, Array, Array]:
    """Shares of the pixels before, at and after the nearest one in an image at an offset from it."""
    return (0.5 - offset) ** 2 / 2, 0.75 - offset**2, (0.5 + offset) ** 2 / 2


def _within(
    centre: Float[Array, "n 3"], chord: Float[Array, " n"], lights: PointLights
) -> tuple[Int[Array, " m"], Int[Array, " m"]]:
    """Discs (m,) and the stars (m,) in them."""
    from scipy.spatial import KDTree

    order = np.argsort(chord)
    kind = np.floor(np.log(chord[order]) / math.log(_ALIKE))
    pairs = [(np.zeros(0, int), np.zeros(0, int))]
    for group in np.split(order, np.flatnonzero(np.diff(kind)) + 1):
        tree = KDTree(centre[group], balanced_tree=False, compact_nodes=False)
        near = tree.sparse_distance_matrix(lights.tree, chord[group].max(initial=0.0), output_type="ndarray")
        close = near["v"] <= chord[group[near["i"]]]
        pairs.append((group[near["i"][close]], near["j"][close]))
    discs, stars = zip(*pairs, strict=True)
    return np.concatenate(discs), np.concatenate(stars)
