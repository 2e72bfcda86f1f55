"""All images of stars in cells of a map (sky_cells.py): its inverse, by Newton's method for all of them at once.

Cells are divided into parts, about as long as wide on the sky, and finer where the map bends. A search
starts in each part that a star may lie in.
"""

import math
from collections.abc import Iterator
from concurrent.futures import Executor

import numpy as np

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.scenes.coons_patches import weights_at
from kerrcaustics.scenes.footprint import bend, major_axis
from kerrcaustics.scenes.points import Imaged, PointLights, distinct
from kerrcaustics.scenes.sky_cells import SkyCells
from kerrcaustics.scenes.star_bins import StarBins, item_numbers
from kerrcaustics.scenes.unresolved_stars import last_seen
from kerrcaustics.shapes import Bool, Float, Int

Array = np.ndarray

# Number of searches that a core works on together: they fit in its cache.
_TOGETHER = 1 << 14
NEAREST = 0.05
"""Distance from a critical curve below which the brightness of images stays constant, pixels of the picture."""
# Margin of the search in neighbouring cells, cells: no image is lost where they meet.
_OVER = 1e-3


class CellSearch:
    """The search for images in some cells, prepared once for all stars."""

    def __init__(self, cells: SkyCells, nearest: float = NEAREST, over: float = _OVER) -> None:
        """cells: cells to search; nearest: as `NEAREST`, in their pixels; over: margin in neighbouring cells, cells."""
        self.cells, self._nearest, self._over = cells, nearest, over
        rates = _polynomials(cells.rates) if cells.moving else np.zeros((1, 36))
        self._maps = _polynomials(cells.data), rates
        self._parts = _parts(*self._maps)

    def images(
        self,
        lights: PointLights,
        moment: Float[Array, " stars"],
        pool: Executor,
        least: Float[Array, " n"] | None = None,
    ) -> Imaged:
        """All images in the cells, of each star at a moment of the exposure, from -1/2 to 1/2.

        least: (n,) smallest solid angles that pixels see in the cells; cells are left out where all images have faded.
        """
        stars = np.column_stack([lights.direction, moment])
        columns = pool.map(lambda near: self._images_in_parts(stars, *near), self._near_stars(lights, least))
        cell, star, at, steps, positive = (np.concatenate(column) for column in zip(_NO_IMAGE, *columns, strict=True))
        size = self.cells.size[cell, None]
        place = np.stack([self.cells.x[cell], self.cells.y[cell]], axis=-1) + at * size - 0.5
        kept = distinct(star, place, positive)
        own_steps = steps[kept] / size[kept, None]
        return self._imaged(cell[kept], star[kept], at[kept], place[kept], own_steps, positive[kept])

    def _near_stars(
        self, lights: PointLights, least: Float[Array, " n"] | None
    ) -> Iterator[tuple[StarBins, Int[Array, " m"], Int[Array, " m"], Int[Array, " m"]]]:
        """Bins, and runs (m,) of stars in them that may lie in parts, some thousand stars at a time."""
        ends = [last_seen(limit) for limit, _ in lights.bins]
        angles = np.zeros(len(self.cells.x)) if least is None else least
        kind = np.searchsorted(ends, angles, side="right")[self._parts[:, 0].astype(int)]
        for number, (_, bins) in enumerate(lights.bins):
            part = np.flatnonzero(kind == number)
            runs = bins.runs(self._parts[part, 3:6], self._parts[part, 6], part)
            pieces = np.searchsorted(np.cumsum(runs.length), np.arange(_TOGETHER, runs.length.sum(), _TOGETHER))
            for piece in zip(*(np.split(column, pieces) for column in runs), strict=True):
                yield bins, *piece

    def _images_in_parts(
        self,
        stars: Float[Array, "s 4"],
        bins: StarBins,
        part: Int[Array, " n"],
        first: Int[Array, " n"],
        count: Int[Array, " n"],
    ) -> tuple[Int[Array, " m"], Int[Array, " m"], Float[Array, "m 2"], Float[Array, "m 2 3"], Bool[Array, " m"]]:
        """Images of stars by searches from some parts.

        Returns their cells, their stars, places in the cells, steps of n' for the sides of the cells, and True for
        images that are not mirrored.
        """
        run, number = item_numbers(count)
        part, star = part[run], bins.star[first[run] + number]
        near = np.flatnonzero(kernel("star_near").on_rays((), (part, star), tables=(self._parts, stars)))
        part, star = part[near], star[near]
        tables = *self._maps, self._parts, stars
        is_found, at, steps, positive = kernel("star_image").on_rays([self._over], (part, star), tables=tables)
        hits = np.flatnonzero(is_found)
        return self._parts[part[hits], 0].astype(int), star[hits], at[hits], steps[hits], positive[hits]

    def _imaged(
        self,
        cell: Int[Array, " m"],
        star: Int[Array, " m"],
        at: Float[Array, "m 2"],
        place: Float[Array, "m 2"],
        steps: Float[Array, "m 2 3"],
        positive: Bool[Array, " m"],
    ) -> Imaged:
        """Images at places `at` in cells, which are places of the picture."""
        curving, rate = self.cells.curving[cell], np.zeros((len(cell), 3, 3))
        if self.cells.moving:
            where, size = weights_at(*at.T), self.cells.size[cell]
            rows = np.stack([where.value, *(part / size for part in (where.along_x, where.along_y))])
            rate = np.einsum("rkn,nkc->nrc", rows, self.cells.rates[cell])
        return Imaged(place, star, areas(steps, curving, self._nearest), steps, curving, rate, positive)


def areas(steps: Float[Array, "m 2 3"], curving: Float[Array, "m 3 3"], nearest: float) -> Float[Array, " m"]:
    """Solid angles (m,) that pixels see, constant within `nearest` pixels of a critical curve; as in `Imaged`."""
    first, second = steps[:, 0], steps[:, 1]
    area = np.cross(first, second)
    size = np.sqrt((area**2).sum(axis=-1))
    # The pixel is thin across its major axis, and widens away from the critical curve by its bend.
    major, along = major_axis(first, second)
    middle = area / np.maximum(size, 1e-300)[:, None]
    return np.maximum(size, major * nearest * math.sqrt(8) * bend(curving, np.cross(middle, along)))


_NO_IMAGE = np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2, 3)), np.zeros(0, bool)


def _polynomials(data: Float[Array, "n 12 3"]) -> Float[Array, "n 36"]:
    """Coefficients of patches, by places in the unit square."""
    nothing, size = np.zeros((2, len(data))), np.ones(len(data))
    columns = *nothing, size, data.reshape(-1, 36), np.zeros((len(data), 9))
    return np.ascontiguousarray(kernel("cell_polynomials").on_rays((), columns)[:, 2:38])


def _parts(maps: Float[Array, "n 36"], rates: Float[Array, "_r 36"]) -> Float[Array, "m 11"]:
    """All parts of some cells, rows as by the formula `bounds`."""
    if not len(maps):
        return np.zeros((0, 11))
    cells = np.arange(len(maps))
    counts = kernel("cell_division").on_rays((), [cells], tables=[maps])
    columns, rows = 2 ** np.round(np.log2(np.maximum(counts, 1))).astype(int).T
    count = columns * rows
    cell, number = item_numbers(count)
    width, height = 1 / columns[cell], 1 / rows[cell]
    y, x = np.divmod(number, columns[cell])
    places = cell, (x + 0.5) * width, (y + 0.5) * height, width / 2, height / 2
    return kernel("part_bounds").on_rays((), places, tables=[maps, rates])
