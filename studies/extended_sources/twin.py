"""The magnification of a disc by an adaptive sum over rays: coarse, and independent of curves and images.

Cells in position angle about the hole and e-foldings of the distance from the shadow edge, on either side of it, are
halved until the light through each comes from the disc all over, or from nowhere in it. Across the smallest cells the
distance from the limb is taken as bilinear.
"""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY, End
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
    sums = [_summed(viewer, centre, size, max_index, end, side) for end in ends for side in sides]
    return sum(fine for fine, _ in sums) / area, sum(abs(fine - coarse) for fine, coarse in sums) / area


def _summed(
    viewer: kc.Camera | kc.Observer, centre: Array, radius: float, max_index: int, surface: End, side: str
) -> tuple[float, float]:
    """The area on one side of the shadow edge, by one arrival, and that before the last two halvings."""
    sky = search_sky(viewer)
    camera = sky.search_camera
    chart = chart_of(camera)
    phi, depth = (
        x.ravel() for x in np.meshgrid(np.arange(96) * 2 * math.pi / 96, np.arange(64) * _DEEPEST / 64, indexing="ij")
    )
    size, beyond = np.full(len(phi), 2 * math.pi / 96), np.full(len(phi), _DEEPEST / 64)
    total, sums = 0.0, [math.inf]
    lost = 0.0
    scale = float(lengths(centre))

    def distances(ends: Array, place: Array) -> Array:
        return lengths(ends - place) if len(centre) == 2 else angle_between(ends, place)

    def place(phi: Array, depth: Array) -> Array:
        shape = np.shape(phi)
        if side == "inside":
            flat = np.stack([np.ravel(phi), -np.expm1(-np.ravel(depth))], axis=-1)
            return chart.from_polar(flat).reshape(*shape, 3)
        flat = np.stack([np.ravel(phi), np.ravel(depth), 0 * np.ravel(phi)], axis=-1)
        return chart.sky(np.ones(len(flat), int), flat).reshape(*shape, 3)

    def density(phi: Array, depth: Array) -> Array:
        """Area on the viewer's sky by that in (phi, depth)."""
        flat = [np.ravel(phi), np.maximum(np.ravel(depth), 1e-9)]
        # Next to the direction opposite to the hole depths are small.
        step = 1e-5
        deep = np.minimum(step, flat[1] / 2)
        along = (place(flat[0] + step, flat[1]) - place(flat[0] - step, flat[1])) / (2 * step)
        down = (place(flat[0], flat[1] + deep) - place(flat[0], flat[1] - deep)) / (2 * deep[:, None])
        area = lengths(np.cross(along, down)) * sky.lengths(place(*flat)) ** 2
        return area.reshape(np.shape(phi))

    for level in range(_LEVELS + 1):
        x = np.stack([phi + a * size for a, _ in _CORNERS], axis=1)
        y = np.stack([np.maximum(depth + b * beyond, 1e-9) for _, b in _CORNERS], axis=1)
        beams = kc.trace_beams(
            camera, place(x, y).reshape(-1, 3), "auto", 1e-10, end=surface, crossings=False, redshift=False
        )
        reached = np.isfinite(beams.delta_plus).reshape(x.shape)
        ends = surface.ends(beams).reshape(*x.shape, -1)
        away = np.where(reached, distances(ends, centre) - radius, np.nan)
        # The rim of what is reached has its own test.
        away = np.where(reached, away, np.nan_to_num(np.nanmin(np.where(reached, away, np.inf), axis=1))[:, None])
        away = np.where(reached.any(axis=1)[:, None], away, math.inf)
        index = np.where(reached, np.reshape(beams.index, x.shape), 99)
        with np.errstate(invalid="ignore"):
            ratio = np.where(reached, np.abs(beams.delta_minus / beams.delta_plus).reshape(x.shape), 1)
        # Positive up to the highest index, and 0 on its critical curve.
        counted = np.select(
            [index == max_index, index == max_index + 1], [ratio, -ratio], np.where(index < max_index, 1, -1)
        )
        across = lengths(np.diff(place(np.stack([phi, phi + size], 1), np.stack([depth + beyond / 2] * 2, 1)), axis=1))
        down = lengths(np.diff(place(np.stack([phi + size / 2] * 2, 1), np.stack([depth, depth + beyond], 1)), axis=1))
        # How far the ends of a cell reach is known where they lie close together.
        stretch = np.where(reached, beams.delta_plus.reshape(x.shape), 0).max(axis=1)
        spread = distances(ends, ends[:, 4:]).max(axis=1)
        known = reached.all(axis=1) & (spread < _NARROW * scale)
        reach = np.where(known, 2 * spread, 2 * stretch * (across + down)[:, 0])
        close = (np.abs(away) < reach[:, None]).any(axis=1)
        if len(centre) == 2:
            # Toward the rim at infinity radii grow, and no disc is met any more.
            far = np.where(reached, lengths(ends), math.inf).min(axis=1) > _FAR * (scale + radius)
            close &= reached.all(axis=1) | ~far
        mixed = (counted > 0).any(axis=1) & (counted < 0).any(axis=1)
        inside = (away < 0).any(axis=1) & (counted > 0).any(axis=1)
        split = (close | (mixed & inside)) & (counted > 0).any(axis=1)
        whole = ~split & (away[:, 4] < 0) & (counted[:, 4] > 0)
        total += _area(density, phi[whole], depth[whole], size[whole], beyond[whole])
        partial = _partial(density, phi[split], depth[split], size[split], beyond[split], away[split], counted[split])
        if level == _LEVELS or not split.any() or (level > 8 and split.sum() > _MOST_CELLS):
            total += partial
            # Discs may slip through cells whose ends reach farther.
            rough = known & split & (spread > _NARROW * radius)
            part = np.minimum((radius / spread[rough]) ** 2, 1)
            middle = density(phi[rough] + size[rough] / 2, depth[rough] + beyond[rough] / 2)
            lost = float(part @ (middle * size[rough] * beyond[rough]))
            break
        sums.append(total + partial)
        # The side with the longer image is halved.
        wide, long = (
            np.fmax(*(distances(ends[:, i], ends[:, j]) for i, j in pairs))
            for pairs in (((0, 1), (2, 3)), ((0, 2), (1, 3)))
        )
        halved = np.where(known, wide > long, across[:, 0] > down[:, 0])[split]
        phi, depth, size, beyond = phi[split], depth[split], size[split], beyond[split]
        size, beyond = np.where(halved, size / 2, size), np.where(halved, beyond, beyond / 2)
        phi = np.concatenate([phi, phi + halved * size])
        depth = np.concatenate([depth, depth + ~halved * beyond])
        size, beyond = np.tile(size, 2), np.tile(beyond, 2)
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
