"""All images of stars in cells of a map (sky_cells.py): its inverse, by Newton's method for all of them at once.

Cells are divided into parts, about as long as wide where they lie on the sky, and finer where the map bends. A search
starts in each part that a star may lie in.
"""

import math
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from kerrcaustics.scenes.coons_patches import weights_at
from kerrcaustics.scenes.footprint import bend, major_axis
from kerrcaustics.scenes.points import Imaged, PointLights, once
from kerrcaustics.scenes.quadtree import in_chunks
from kerrcaustics.scenes.sky_cells import SkyCells
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.sphere import polar_basis

Array = np.ndarray

# Samples of cells, and of parts, in each direction. A part lies within bounds by its samples, and so much more.
_SAMPLES, _SLACK = 3, 1.3
# A map bends where its determinant varies by more than this factor; cells where it does, and those that it folds, have
# at least so many parts each way; none has more than this because it is long.
_BENT, _PARTS_OF_BENT, _PARTS_OF_FOLDED, _LONGEST = 3.0, 16, 64, 16.0
# Samples that are looked at together, and searches that are made together: they fit in a core's cache.
_SAMPLES_TOGETHER, _TOGETHER = 1 << 16, 1 << 12
# A search ends with a step that is shorter than the first of these, in units of the cell, and has found an image if its
# last one was shorter than the second.
_STEPS, _LAST, _SOLVED = 20, 1e-4, 1e-3
# No image is brighter than one so far from its critical curve (pixels of the picture).
NEAREST = 0.05
# Cells reach so far into their neighbours, in units of their size: no image is lost where they meet.
_OVER = 1e-3
# By how much the radii of discs that are searched together differ at most.
_ALIKE = 1.5


class CellSearch:
    """The search for images in some cells, prepared once for all stars."""

    def __init__(self, cells: SkyCells, nearest: float = NEAREST, over: float = _OVER) -> None:
        """cells: those that are searched, so far into their neighbours; nearest: in their pixels."""
        self.cells, self._nearest, self._over = cells, nearest, over
        self._data, self._rates = (_polynomials(part) for part in (cells.data, cells.rates))
        self._parts = _CellParts(*(np.concatenate(column) for column in zip(_NO_PART, *_parts(cells), strict=True)))

    def images(
        self,
        lights: PointLights,
        moment: Float[Array, " stars"],
        pool: Executor,
        within: Bool[Array, " n"] | None = None,
    ) -> Imaged:
        """All images in the cells, of each star at a moment of the exposure, from -1/2 to 1/2.

        within (n,): True for the cells that are searched.
        """
        parts = np.arange(len(self._parts.cell)) if within is None else np.flatnonzero(within[self._parts.cell])
        part, star = _within(self._parts.middle[parts], self._parts.radius[parts], lights)
        part = parts[part]
        close = np.abs(np.vecdot(self._parts.across[part], lights.direction[star])) <= self._parts.width[part]
        part, star = part[close], star[close]
        blocks = [slice(first, first + _TOGETHER) for first in range(0, len(part), _TOGETHER)]
        found = pool.map(lambda block: self._found(lights, moment, part[block], star[block]), blocks)
        return once(Imaged(*(np.concatenate(column) for column in zip(_NO_IMAGE, *found, strict=True))))

    def _found(
        self,
        lights: PointLights,
        moment: Float[Array, " stars"],
        part: Int[Array, " n"],
        star: Int[Array, " n"],
    ) -> Imaged:
        """The images at which searches from the middles of some parts end."""
        target, cell, at = lights.direction[star], self._parts.cell[part], self._parts.at[part]
        data = self._data.take(cell, axis=2)
        if self.cells.moving:
            data += moment[star] * self._rates.take(cell, axis=2)
        across = polar_basis(target)
        # Both are zero where n' is the star's direction.
        miss = np.stack([np.einsum("kcn,nc->kn", data, axis) for axis in across], axis=1)
        which, place, slopes = _solved(miss, at.T, self._over)
        steps = np.einsum("xkm,kmc->mxc", slopes, np.stack(across)[:, which])
        return self._imaged(cell[which], star[which], place.T, steps)

    def _imaged(
        self, cell: Int[Array, " m"], star: Int[Array, " m"], at: Float[Array, "m 2"], columns: Float[Array, "m 2 3"]
    ) -> Imaged:
        cells = self.cells
        size = cells.size[cell, None]
        place = np.stack([cells.x[cell], cells.y[cell]], axis=-1) + at * size - 0.5
        steps, curving = columns / size[..., None], cells.curving[cell]
        rate = np.zeros((len(cell), 3, 3))
        if cells.moving:
            where = weights_at(*at.T)
            rows = np.stack([where.value, *(part / size[:, 0] for part in (where.along_x, where.along_y))])
            rate = np.einsum("rkn,nkc->nrc", rows, cells.rates[cell])
        return Imaged(place, star, areas(steps, curving, self._nearest), steps, curving, rate)


def areas(steps: Float[Array, "m 2 3"], curving: Float[Array, "m 3 3"], nearest: float) -> Float[Array, " m"]:
    """Solid angles (m,) that pixels see, not less than so many pixels from their critical curve; as in `Imaged`."""
    first, second = steps[:, 0], steps[:, 1]
    area = np.cross(first, second)
    size = np.sqrt((area**2).sum(axis=-1))
    # The direction in which the pixel is thin, and how fast it opens away from the critical curve.
    major, along = major_axis(first, second)
    middle = area / np.maximum(size, 1e-300)[:, None]
    return np.maximum(size, major * nearest * math.sqrt(8) * bend(curving, np.cross(middle, along)))


_NO_PART = np.zeros(0, int), np.zeros((0, 2)), *(2 * [np.zeros((0, 3)), np.zeros(0)])
_NO_IMAGE = Imaged(np.zeros((0, 2)), np.zeros(0, int), np.zeros(0), np.zeros((0, 2, 3)), *2 * [np.zeros((0, 3, 3))])


def _polynomials(data: Float[Array, "n k 3"]) -> Float[Array, "k 3 n"]:
    """Patches as coefficients of x^i y^j: i = 0 to 3, for j = 0 and 1; and i = 0, 1 for j = 2, 3."""
    if not data.shape[1]:
        return np.zeros((0, 3, len(data)))
    x, y = np.random.default_rng(0).uniform(0, 1, (2, 24))
    powers = [(i, j) for j in (0, 1) for i in range(4)] + [(i, j) for j in (2, 3) for i in (0, 1)]
    terms = np.stack([x**i * y**j for i, j in powers])
    change = weights_at(x, y).value @ np.linalg.pinv(terms)
    return np.ascontiguousarray(np.einsum("nkc,kt->tcn", data, change))


class _CellParts(NamedTuple):
    """Parts of cells: the cell (n,), the middle (n, 2) in it, and n' (n, 3) there.

    radius (n,) of a disc about n' that holds the part, and half the width (n,) of a strip across (n, 3) that does.
    """

    cell: Array
    at: Array
    middle: Array
    radius: Array
    across: Array
    width: Array


def _parts(cells: SkyCells) -> list[_CellParts]:
    """All parts of some cells."""
    where = weights_at(*np.meshgrid(*2 * [np.linspace(0, 1, _SAMPLES)]))
    data = np.moveaxis(cells.data, -1, 0)
    place, along_x, along_y = (data @ part for part in (where.value, where.along_x, where.along_y))
    area = (place * np.cross(along_x, along_y, axis=0)).sum(axis=0)
    folded = area.min(axis=1) * area.max(axis=1) <= 0
    bent = np.abs(area).max(axis=1) > _BENT * np.abs(area).min(axis=1)
    sizes = [np.maximum(np.sqrt((part**2).sum(axis=0)).mean(axis=1), 1e-300) for part in (along_x, along_y)]
    # On the sky, parts are about as long as wide.
    ratio = np.clip(sizes[1] / sizes[0], 1 / _LONGEST, _LONGEST)
    count = np.maximum(
        np.where(folded, _PARTS_OF_FOLDED, np.where(bent, _PARTS_OF_BENT, 1)), np.maximum(ratio, 1 / ratio)
    )
    columns, rows = (
        2 ** np.round(np.log2(np.maximum(np.sqrt(count * longer), 1))).astype(int) for longer in (1 / ratio, ratio)
    )
    chunks = in_chunks(100 * columns + rows, lambda both: _SAMPLES_TOGETHER // ((both // 100) * (both % 100)))
    return [_parts_alike(cells, chunk, int(columns[chunk[0]]), int(rows[chunk[0]])) for chunk in chunks]


def _parts_alike(cells: SkyCells, which: Int[Array, " n"], columns: int, rows: int) -> _CellParts:
    """Parts of cells that are divided alike."""
    across, down = (np.arange(2 * count + 1) / (2 * count) for count in (columns, rows))
    weight = weights_at(*np.meshgrid(across, down)).value

    def sampled(data: Float[Array, "n 12 3"]) -> Float[Array, "3 n down across"]:
        return (np.moveaxis(data[which], -1, 0) @ weight).reshape(3, len(which), len(down), len(across))

    place = sampled(cells.data)
    middle = place[..., 1::2, 1::2]
    steps = [(i, j) for j in range(3) for i in range(3) if (i, j) != (1, 1)]
    away = np.stack([place[..., j : j + 2 * rows : 2, i : i + 2 * columns : 2] - middle for i, j in steps])
    square = (away**2).sum(axis=1)
    far = np.take_along_axis(away, square.argmax(axis=0)[None, None], axis=0)[0]
    side = np.cross(middle, far, axis=0)
    side /= np.maximum(np.sqrt((side**2).sum(axis=0)), 1e-300)
    radius, width = np.sqrt(square.max(axis=0)), np.abs((away * side).sum(axis=1)).max(axis=0)
    if cells.moving:
        drift = np.sqrt((sampled(cells.rates)[..., 1::2, 1::2] ** 2).sum(axis=0)) / 2
        radius, width = radius + drift, width + drift
    # Of a part that is short, but bent, samples do not tell the width.
    width = width + (_SLACK - 1) * radius**2
    at = np.stack(np.meshgrid(across[1::2], down[1::2]), axis=-1).reshape(-1, 2)
    cell, at = np.repeat(which, rows * columns), np.tile(at, (len(which), 1))
    middle, side = ((part / np.sqrt((part**2).sum(axis=0))).reshape(3, -1).T for part in (middle, side))
    return _CellParts(cell, at, middle, _SLACK * radius.ravel(), side, _SLACK * width.ravel())


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


def _solved(
    miss: Float[Array, "12 2 n"], at: Float[Array, "2 n"], over: float
) -> tuple[Int[Array, " m"], Float[Array, "2 m"], Float[Array, "2 2 m"]]:
    """Solve for zeros of pairs of polynomials in the unit square, and so far beyond it, from places in it.

    Returns the pair (m,), the place (2, m), and the slopes there (2, 2, m), along x and y of both.
    """
    place, slopes, off = np.array(at), np.zeros((2, 2, at.shape[1])), np.full(at.shape[1], np.inf)
    keep, at = np.arange(at.shape[1]), np.array(at)
    for _ in range(_STEPS):
        value, slope_x, slope_y = _values(miss, *at)
        det = slope_x[0] * slope_y[1] - slope_x[1] * slope_y[0]
        det = np.where(np.abs(det) > 1e-300, det, 1e-300)
        move = np.stack([slope_y[0] * value[1] - slope_y[1] * value[0], slope_x[1] * value[0] - slope_x[0] * value[1]])
        move /= det
        length = np.sqrt((move**2).sum(axis=0))
        # No longer than half of a cell.
        at += move * np.minimum(1, 0.5 / np.maximum(length, 1e-300))
        place[:, keep], off[keep], slopes[0][:, keep], slopes[1][:, keep] = at, length, slope_x, slope_y
        # Searches that are far outside will not come back.
        going = np.flatnonzero((length > _LAST) & (np.abs(at - 0.5).max(axis=0) < 1.0))
        if not len(going):
            break
        keep, at, miss = keep[going], at[:, going], miss.take(going, axis=2)
    which = np.flatnonzero((np.abs(place - 0.5).max(axis=0) <= 0.5 + over) & (off < _SOLVED))
    return which, place[:, which], slopes[..., which]


def _values(
    c: Float[Array, "12 k n"], x: Float[Array, " n"], y: Float[Array, " n"]
) -> tuple[Float[Array, "k n"], Float[Array, "k n"], Float[Array, "k n"]]:
    """Values of polynomials as of `_polynomials`, and their slopes along x and y."""
    by_y = [c[k] + x * (c[k + 1] + x * (c[k + 2] + x * c[k + 3])) for k in (0, 4)]
    by_y += [c[k] + x * c[k + 1] for k in (8, 10)]
    slopes = [c[k + 1] + x * (2 * c[k + 2] + x * (3 * c[k + 3])) for k in (0, 4)]
    value = by_y[0] + y * (by_y[1] + y * (by_y[2] + y * by_y[3]))
    along_y = by_y[1] + y * (2 * by_y[2] + y * (3 * by_y[3]))
    return value, slopes[0] + y * (slopes[1] + y * (c[9] + y * c[11])), along_y
