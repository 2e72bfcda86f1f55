"""The magnification of a disc by an adaptive sum over rays: coarse, and independent of curves and images.

Cells in position angle about the hole and e-foldings of the distance from the shadow edge, on either side of it, are
halved until the light through each comes from the disc all over, or from nowhere in it. Across the smallest cells the
distance from the limb is taken as bilinear.
"""

import math
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.lens_map.domains import OneLeaf, TwoLeaves, domain_of
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.lens_map.sky_chart import chart_of
from kerrcaustics.spacetime.sphere import angle_between, lengths

Array = np.ndarray

_SUB = (np.arange(16) + 0.5) / 16
_DEEPEST = 16.0
# Of a cell, in parts of its sides, and its middle.
_CORNERS = ((0, 0), (1, 0), (0, 1), (1, 1), (0.5, 0.5))
# Halvings, from cells of some degrees, and cells that are halved once more, at most.
_LEVELS, _MOST_CELLS = 60, 16000
# Ends of a cell (radians, or by their distance from the hole) that stand for all of it, where they lie within that.
_NARROW = 0.5
# Radii of the plane that are far, by that of the disc.
_FAR = 3.0


def summed(
    viewer: kc.Camera | kc.Observer,
    centre: Array,
    size: float,
    max_index: int,
    *,
    surface: End = SKY,
) -> tuple[float, float]:
    """The area of the images by that of the disc, and its difference from the sum over cells of twice the sides.

    centre, size: a vector of the surface, and an angle or in the plane a length. Sources within the viewer's radius are
    seen inside the shadow edge too, and by two arrivals.
    """
    near = domain_of(surface, search_sky(viewer).search_camera)
    sides = ("beyond",) if type(near) is OneLeaf else ("beyond", "inside")
    area = math.pi * size**2 if len(centre) == 2 else 4 * math.pi * math.sin(size / 2) ** 2
    ends = surface.arrivals() if isinstance(near, TwoLeaves) else (surface,)
    disc = centre, size
    sums = [_summed(_Side(viewer, disc, end, side), max_index) for end in ends for side in sides]
    return sum(fine for fine, _ in sums) / area, sum(abs(fine - coarse) for fine, coarse in sums) / area


class _Cells(NamedTuple):
    """Cells in position angle and depth, flat arrays: a corner, and the sides from it."""

    phi: Array
    depth: Array
    size: Array
    beyond: Array

    @classmethod
    def first(cls) -> "_Cells":
        """The cells to begin with."""
        phi, depth = np.meshgrid(np.arange(96) * 2 * math.pi / 96, np.arange(64) * _DEEPEST / 64, indexing="ij")
        count = phi.size
        return cls(phi.ravel(), depth.ravel(), np.full(count, 2 * math.pi / 96), np.full(count, _DEEPEST / 64))

    def some(self, chosen: Array) -> "_Cells":
        """Chosen cells."""
        return _Cells(*(part[chosen] for part in self))

    def halves(self, across: Array) -> "_Cells":
        """Halves of all cells; across: true where position angles are halved."""
        size, beyond = np.where(across, self.size / 2, self.size), np.where(across, self.beyond, self.beyond / 2)
        phi = np.concatenate([self.phi, self.phi + across * size])
        depth = np.concatenate([self.depth, self.depth + ~across * beyond])
        return _Cells(phi, depth, np.tile(size, 2), np.tile(beyond, 2))


class _Traced(NamedTuple):
    """Cells whose corners and middles were traced."""

    # Distances of their ends from the limb, negative inside the disc.
    away: Array
    # Positive up to the highest index, and 0 on its critical curve.
    counted: Array
    # Distances between ends, of all corners from the middle.
    spread: Array
    # True where all corners reach the surface, and their ends lie close together.
    known: Array
    # True where the limb may pass through the cell.
    close: Array
    # True where the longer image is that of the side in position angle.
    wide: Array


class _Side:
    """One side of the shadow edge, and one arrival at the surface of a disc."""

    def __init__(self, viewer: kc.Camera | kc.Observer, disc: tuple[Array, float], surface: End, side: str) -> None:
        (self.centre, self.radius), self.surface, self.side = disc, surface, side
        self.sky = search_sky(viewer)
        self.chart = chart_of(self.sky.search_camera)
        self.in_plane, self.scale = len(self.centre) == 2, float(lengths(self.centre))

    def distances(self, ends: Array, place: Array) -> Array:
        """Distances on the surface."""
        return lengths(ends - place) if self.in_plane else angle_between(ends, place)

    def place(self, phi: Array, depth: Array) -> Array:
        """Directions of the search sky."""
        shape = np.shape(phi)
        if self.side == "inside":
            flat = np.stack([np.ravel(phi), -np.expm1(-np.ravel(depth))], axis=-1)
            return self.chart.from_polar(flat).reshape(*shape, 3)
        flat = np.stack([np.ravel(phi), np.ravel(depth), 0 * np.ravel(phi)], axis=-1)
        return self.chart.sky(np.ones(len(flat), int), flat).reshape(*shape, 3)

    def density(self, phi: Array, depth: Array) -> Array:
        """Area on the viewer's sky by that in (phi, depth)."""
        flat = [np.ravel(phi), np.maximum(np.ravel(depth), 1e-9)]
        # Next to the direction opposite to the hole depths are small.
        step = 1e-5
        deep = np.minimum(step, flat[1] / 2)
        along = (self.place(flat[0] + step, flat[1]) - self.place(flat[0] - step, flat[1])) / (2 * step)
        down = (self.place(flat[0], flat[1] + deep) - self.place(flat[0], flat[1] - deep)) / (2 * deep[:, None])
        area = lengths(np.cross(along, down)) * self.sky.lengths(self.place(*flat)) ** 2
        return area.reshape(np.shape(phi))

    def traced(self, cells: _Cells, max_index: int) -> _Traced:
        """The cells, with what their corners and middles say of them."""
        phi, depth, size, beyond = cells
        x = np.stack([phi + a * size for a, _ in _CORNERS], axis=1)
        y = np.stack([np.maximum(depth + b * beyond, 1e-9) for _, b in _CORNERS], axis=1)
        options = {"end": self.surface, "crossings": False, "redshift": False}
        sky = self.place(x, y).reshape(-1, 3)
        beams = beams_of_directions(self.sky.search_camera, sky, "auto", 1e-10, **options)
        reached = np.isfinite(beams.delta_plus).reshape(x.shape)
        ends = self.surface.ends(beams).reshape(*x.shape, -1)
        across, down = self._sides(cells)
        spread = self.distances(ends, ends[:, 4:]).max(axis=1)
        known = reached.all(axis=1) & (spread < _NARROW * self.scale)
        # How far the ends of a cell reach is known where they lie close together.
        stretch = np.where(reached, beams.delta_plus.reshape(x.shape), 0).max(axis=1)
        away = self._distances_from_limb(ends, reached)
        reach = np.where(known, 2 * spread, 2 * stretch * (across + down))
        close = (np.abs(away) < reach[:, None]).any(axis=1) & self._may_meet_disc(ends, reached)
        # The side with the longer image.
        sides = (((0, 1), (2, 3)), ((0, 2), (1, 3)))
        wide, long = (np.fmax(*(self.distances(ends[:, i], ends[:, j]) for i, j in pairs)) for pairs in sides)
        wide = np.where(known, wide > long, across > down)
        return _Traced(away, _counted(beams, reached, max_index), spread, known, close, wide)

    def _sides(self, cells: _Cells) -> tuple[Array, Array]:
        """Lengths of both sides of cells on the search sky."""
        phi, depth, size, beyond = cells
        across = self.place(np.stack([phi, phi + size], 1), np.stack([depth + beyond / 2] * 2, 1))
        down = self.place(np.stack([phi + size / 2] * 2, 1), np.stack([depth, depth + beyond], 1))
        return lengths(np.diff(across, axis=1))[:, 0], lengths(np.diff(down, axis=1))[:, 0]

    def _distances_from_limb(self, ends: Array, reached: Array) -> Array:
        away = np.where(reached, self.distances(ends, self.centre) - self.radius, np.nan)
        # The rim of what is reached has its own test.
        away = np.where(reached, away, np.nan_to_num(np.nanmin(np.where(reached, away, np.inf), axis=1))[:, None])
        return np.where(reached.any(axis=1)[:, None], away, math.inf)

    def _may_meet_disc(self, ends: Array, reached: Array) -> Array:
        """False for cells of the plane's rim at infinity: toward it radii grow, and no disc is met any more."""
        if not self.in_plane:
            return np.ones(len(ends), bool)
        far = np.where(reached, lengths(ends), math.inf).min(axis=1) > _FAR * (self.scale + self.radius)
        return reached.all(axis=1) | ~far


def _counted(beams: kc.Beams, reached: Array, max_index: int) -> Array:
    """Positive up to the highest index, and 0 on its critical curve."""
    index = np.where(reached, np.reshape(beams.index, reached.shape), 99)
    with np.errstate(invalid="ignore"):
        ratio = np.where(reached, np.abs(beams.delta_minus / beams.delta_plus).reshape(reached.shape), 1)
    return np.select([index == max_index, index == max_index + 1], [ratio, -ratio], np.where(index < max_index, 1, -1))


def _summed(side: _Side, max_index: int) -> tuple[float, float]:
    """The area on one side of the shadow edge, by one arrival, and that before the last two halvings."""
    cells, total, sums, lost = _Cells.first(), 0.0, [math.inf], 0.0
    for level in range(_LEVELS + 1):
        traced = side.traced(cells, max_index)
        away, counted = traced.away, traced.counted
        counts = (counted > 0).any(axis=1)
        mixed, inside = counts & (counted < 0).any(axis=1), (away < 0).any(axis=1) & counts
        split = (traced.close | (mixed & inside)) & counts
        whole = ~split & (away[:, 4] < 0) & (counted[:, 4] > 0)
        total += _area(side.density, *cells.some(whole))
        partial = _partial(side.density, *cells.some(split), away[split], counted[split])
        if level == _LEVELS or not split.any() or (level > 8 and split.sum() > _MOST_CELLS):
            total += partial
            # Discs may slip through cells whose ends reach farther.
            rough = traced.known & split & (traced.spread > _NARROW * side.radius)
            phi, depth, size, beyond = cells.some(rough)
            part = np.minimum((side.radius / traced.spread[rough]) ** 2, 1)
            lost = float(part @ (side.density(phi + size / 2, depth + beyond / 2) * size * beyond))
            break
        sums.append(total + partial)
        cells = cells.some(split).halves(traced.wide[split])
    # Each of two halvings is of one side.
    before = sums[-2] if len(sums) > 1 else total
    return total, total + abs(total - before) + lost


def _area(density, phi: Array, depth: Array, size: Array, beyond: Array) -> float:
    """The area of cells."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    part = (1 + nodes) / 2
    x = phi[:, None, None] + size[:, None, None] * part[:, None] + 0 * part
    y = depth[:, None, None] + beyond[:, None, None] * part + 0 * part[:, None]
    each = np.einsum("nij,i,j->n", density(x, y), weights, weights) if len(phi) else np.zeros(0)
    return float(each @ (size * beyond)) / 4


def _partial(density, phi: Array, depth: Array, size: Array, beyond: Array, away: Array, counted: Array) -> float:
    """The area of the parts of cells that are in the disc and of the indices that count."""
    if not len(phi):
        return 0.0
    # Lines along the side on which the distance changes more.
    along = np.abs(away[:, 1] + away[:, 3] - away[:, 0] - away[:, 2])
    turned = along > np.abs(away[:, 2] + away[:, 3] - away[:, 0] - away[:, 1])
    order = np.where(turned[:, None], [0, 2, 1, 3], [0, 1, 2, 3])

    def low_and_high(f: Array) -> Array:
        """At both ends of lines."""
        a, b, c, d = (x[:, None] for x in np.take_along_axis(f, order, axis=1).T)
        return np.stack([a + (b - a) * _SUB, c + (d - c) * _SUB])

    def positive(f: Array) -> tuple[Array, Array]:
        """Parts of lines from 0 to 1 where a linear function is positive, from and to."""
        low, high = low_and_high(f)
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.clip(low / (low - high), 0, 1)
        return np.where(low > 0, 0, np.where(high > 0, root, 1)), np.where(high > 0, 1, np.where(low > 0, root, 0))

    (from_limb, to_limb), (from_curve, to_curve) = positive(-away), positive(counted)
    part = np.maximum(np.minimum(to_limb, to_curve) - np.maximum(from_limb, from_curve), 0).mean(axis=1)
    return float(part @ (density(phi + size / 2, np.maximum(depth + beyond / 2, 1e-9)) * size * beyond))
