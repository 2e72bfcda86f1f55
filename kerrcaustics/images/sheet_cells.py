"""Cells of the grids of all sheets, and the search for those that a star may lie in."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from kerrcaustics.images.sheet_grids import Sheet, spaced
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.sphere import lengths, tangent_basis

if TYPE_CHECKING:
    from scipy.spatial import KDTree

Array = np.ndarray

# Nodes next to a sheet's edge that are corners of cells, counted from it.
_NEAR_EDGE = np.array([1, 2, 4, 8])
# Radius of circles that cover a cell's image, over the least that covers its corners.
_REACH = 1.25
# Most circles for a cell.
_MOST_BALLS = 12
# Bend of a cell's image, in parts of its length, that the circles cover.
_SAG = 0.05
# Error of the linear model of the map, in parts of a cell: the margin beside a cell grows by it.
_LINEAR = 0.25
# Ratio of radii below which circles count as equal: they are searched together.
_ALIKE = 1.5
# Pairs of a star and a circle up to which a table of all distances is faster than a tree.
_FEW_PAIRS = 2_000_000
# Round-off of the squares of distances in the table.
_ROUND_OFF = 4e-15


@dataclass(frozen=True, eq=False)
class _CellCircles:
    """Circles on the celestial sphere: their centres, the cells that they cover, the radii."""

    centre: Float[Array, "circles 3"]
    cell: Int[Array, " circles"]
    radius: Float[Array, " circles"]

    def pairs(self, star: Float[Array, "stars 3"], wider: float) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Pairs of a star and a circle that holds it, its radius multiplied by a factor: by all distances."""
        square = self._square_plus_one - 2 * star @ self.centre.T
        which, circle = np.nonzero(square <= (wider * self.radius) ** 2 + _ROUND_OFF)
        return which, circle

    def pairs_of_many(self, star: "KDTree", wider: float) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Pairs as by `pairs`, with a tree of the stars, for circles of one radius."""
        reach = wider * float(self.radius[0])
        pairs = star.sparse_distance_matrix(self._tree, reach, output_type="ndarray")
        return pairs["i"], pairs["j"]

    @cached_property
    def _square_plus_one(self) -> Float[Array, " circles"]:
        return 1 + np.einsum("ni,ni->n", self.centre, self.centre)

    @cached_property
    def _tree(self) -> "KDTree":
        from scipy.spatial import KDTree

        return KDTree(self.centre)


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of all grids, flat.

    sheet: Morse index of the sheet.
    edge_phase: edge phases of two opposite corners, radians.
    part: positions of these corners across the sheet, 0 to 1.
    corners: images of all four corners.
    linear: linear map from a direction, followed by 1, to the place in the cell, whose middle is 0.
    """

    sheet: Int[Array, " cells"]
    edge_phase: Float[Array, "cells 2"]
    part: Float[Array, "cells 2"]
    corners: Float[Array, "cells 4 3"]
    linear: Float[Array, "2 4 cells"]

    @cached_property
    def circles(self) -> _CellCircles:
        """Circles that cover the images of the cells."""
        return _circles(self.corners)

    @cached_property
    def circles_by_size(self) -> tuple[_CellCircles, ...]:
        """The circles in groups of one radius."""
        every = self.circles
        groups = [np.flatnonzero(every.radius == one) for one in np.unique(every.radius)]
        return tuple(_CellCircles(every.centre[group], every.cell[group], every.radius[group]) for group in groups)

    def candidates(
        self, star: Float[Array, "stars 3"], margin: float
    ) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
        """Pairs of a star and a cell that it may lie in, by a linear map."""
        numbers = []
        for which, cell in self._within_circles(star, 1 + margin):
            near = _linearly_inside(self, cell, star, which, margin)
            numbers.append(which[near] * len(self.sheet) + cell[near])
        # `np.unique` takes several times as long.
        every = np.sort(np.concatenate(numbers))
        return np.divmod(every[np.diff(every, prepend=-1) > 0], len(self.sheet))

    def _within_circles(self, star: Float[Array, "stars 3"], wider: float) -> Iterator[tuple[Array, Array]]:
        """Pairs of a star and a cell one of whose circles holds it, its radius multiplied by a factor."""
        if len(star) * len(self.circles.cell) <= _FEW_PAIRS:
            which, circle = self.circles.pairs(star, wider)
            yield which, self.circles.cell[circle]
            return
        from scipy.spatial import KDTree

        stars = KDTree(star)
        for circles in self.circles_by_size:
            which, circle = circles.pairs_of_many(stars, wider)
            yield which, circles.cell[circle]


def cells_of(sheets: Sequence[Sheet]) -> Cells:
    """A row of cells between each pair of neighbouring lines, as long as the sheet's step allows."""
    strips = [_strips(sheet) for sheet in sheets]
    return _with_linear_maps(*(np.concatenate(values) for values in zip(*strips, strict=True)))


def _strips(sheet: Sheet) -> tuple[Array, Array, Array, Array]:
    """Of the cells of one sheet the sheet, the edge phases and parts of two opposite corners, and the corners."""
    steps = lengths(np.diff(sheet.direction, axis=1))
    chosen = spaced(np.maximum(steps[:-1], steps[1:]), sheet.step)
    # Finer next to the critical curves, where the map is no longer nearly linear.
    last = len(sheet.part) - 1
    chosen[:, np.clip([_NEAR_EDGE, last - _NEAR_EDGE], 0, last)] = True
    strip, node = np.nonzero(chosen)
    within = strip[1:] == strip[:-1]
    line, low, high = strip[1:][within], node[:-1][within], node[1:][within]
    corners = [sheet.direction[line + beside, part] for part in (low, high) for beside in (0, 1)]
    return (
        np.full(len(line), sheet.index),
        np.stack([sheet.edge_phase[line], sheet.edge_phase[line + 1]], axis=1),
        np.stack([sheet.part[low], sheet.part[high]], axis=1),
        np.stack(corners, axis=1),
    )


def _with_linear_maps(sheet: Array, edge_phase: Array, part: Array, corners: Array) -> Cells:
    inverse = _linear_inverse(corners)
    offset = np.einsum("nij,nj->ni", inverse, _centres(corners))
    linear = np.moveaxis(np.concatenate([inverse, -offset[..., None]], axis=2), 0, 2)
    return Cells(sheet, edge_phase, part, corners, np.ascontiguousarray(linear))


def _centres(corners: Float[Array, "cells 4 3"]) -> Float[Array, "cells 3"]:
    middle = corners.sum(axis=1)
    return middle / np.linalg.norm(middle, axis=1, keepdims=True)


def _circles(corners: Float[Array, "cells 4 3"]) -> _CellCircles:
    """Circles that cover the cells' images, mostly long and thin, along their longer axes."""
    centre = _centres(corners)
    away = corners - centre[:, None]
    east, north = tangent_basis(centre)
    x, y = (np.einsum("nci,ni->nc", away, one) for one in (east, north))
    turn = np.arctan2(2 * (x * y).sum(axis=1), (x * x - y * y).sum(axis=1)) / 2
    axis = np.cos(turn)[:, None] * east + np.sin(turn)[:, None] * north
    along = np.einsum("nci,ni->nc", away, axis)
    across = lengths(away - along[..., None] * axis[:, None]).max(axis=1)
    low, length = along.min(axis=1), np.ptp(along, axis=1)
    width = 2 * across + _SAG * length
    count = np.clip(np.ceil(length / np.maximum(width, 1e-12)), 1, _MOST_BALLS).astype(int)
    owner = np.repeat(np.arange(len(corners)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    place = low[owner] + (number + 0.5) / count[owner] * length[owner]
    radius = _REACH * np.hypot(length / count, width)[owner] / 2
    middle = centre[owner] + place[:, None] * axis[owner]
    # Those of about one radius have the largest of them.
    _, group = np.unique(np.floor(np.log(np.maximum(radius, 1e-12)) / np.log(_ALIKE)), return_inverse=True)
    largest = np.zeros(group.max(initial=-1) + 1)
    np.maximum.at(largest, group, radius)
    return _CellCircles(middle, owner, largest[group])


def _linear_inverse(corners: Float[Array, "cells 4 3"]) -> Float[Array, "cells 2 3"]:
    """Pseudo-inverses of the mean steps along edge phase and part."""
    along = (corners[:, 1] + corners[:, 3] - corners[:, 0] - corners[:, 2]) / 2
    across = (corners[:, 2] + corners[:, 3] - corners[:, 0] - corners[:, 1]) / 2
    normal = np.cross(along, across)
    square = np.einsum("ij,ij->i", normal, normal)[:, None]
    square = np.where(square == 0, 1, square)
    return np.stack([np.cross(across, normal), np.cross(normal, along)], axis=1) / square[..., None]


def _linearly_inside(
    cells: Cells, cell: Int[Array, " pairs"], star: Float[Array, "stars 3"], which: Int[Array, " pairs"], margin: float
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


def bilinear_root(
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
