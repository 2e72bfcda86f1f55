"""The magnification of a disc by an adaptive sum over rays: slow, coarse, and independent of curves and images.

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


def summed(
    viewer: kc.Camera | kc.Observer,
    centre: Array,
    size: float,
    max_index: int,
    *,
    surface: End = SKY,
    levels: int = 9,
) -> float:
    """The area of the images by that of the disc.

    centre, size: a vector of the surface, and an angle or in the plane a length; levels: of halving, from cells of some
    degrees. Sources within the viewer's radius are seen inside the shadow edge too, and by two arrivals.
    """
    near = domain_of(surface, search_sky(viewer).search_camera)
    sides = ("beyond",) if type(near) is OneLeaf else ("beyond", "inside")
    area = math.pi * size**2 if len(centre) == 2 else 4 * math.pi * math.sin(size / 2) ** 2
    ends = surface.arrivals() if isinstance(near, TwoLeaves) else (surface,)
    return sum(_summed(viewer, centre, size, max_index, end, levels, side) for end in ends for side in sides) / area


def _summed(
    viewer: kc.Camera | kc.Observer, centre: Array, radius: float, max_index: int, surface: End, levels: int, side: str
) -> float:
    """The area on one side of the shadow edge, by one arrival."""
    sky = search_sky(viewer)
    camera = sky.search_camera
    chart = chart_of(camera)
    size, beyond = 2 * math.pi / 96, _DEEPEST / 64
    phi, depth = (x.ravel() for x in np.meshgrid(np.arange(96) * size, np.arange(64) * beyond, indexing="ij"))
    total = 0.0

    def place(phi: Array, depth: Array) -> Array:
        shape = np.shape(phi)
        if side == "inside":
            flat = np.stack([np.ravel(phi), -np.expm1(-np.ravel(depth))], axis=-1)
            return chart.from_polar(flat).reshape(*shape, 3)
        flat = np.stack([np.ravel(phi), np.ravel(depth), 0 * np.ravel(phi)], axis=-1)
        return chart.sky(np.ones(len(flat), int), flat).reshape(*shape, 3)

    def density(phi: Array, depth: Array) -> Array:
        """Area on the viewer's sky by that in (phi, depth)."""
        step = 1e-5
        flat = [np.ravel(phi), np.maximum(np.ravel(depth), step)]
        along = (place(flat[0] + step, flat[1]) - place(flat[0] - step, flat[1])) / (2 * step)
        down = (place(flat[0], flat[1] + step) - place(flat[0], flat[1] - step)) / (2 * step)
        area = lengths(np.cross(along, down)) * sky.lengths(place(*flat)) ** 2
        return area.reshape(np.shape(phi))

    for level in range(levels + 1):
        corners = [(0, 0), (1, 0), (0, 1), (1, 1), (0.5, 0.5)]
        x = np.stack([phi + a * size for a, _ in corners], axis=1)
        y = np.stack([np.maximum(depth + b * beyond, 1e-9) for _, b in corners], axis=1)
        beams = kc.trace_beams(
            camera, place(x, y).reshape(-1, 3), "auto", 1e-10, end=surface, crossings=False, redshift=False
        )
        reached = np.isfinite(beams.delta_plus).reshape(x.shape)
        ends = surface.ends(beams)
        distance = lengths(ends - centre) if len(centre) == 2 else angle_between(ends, centre)
        away = np.where(reached, distance.reshape(x.shape) - radius, np.nan)
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
        step = np.diff(place(np.stack([phi, phi + size], 1), np.stack([depth + beyond / 2] * 2, 1)), axis=1)
        stretch = np.where(reached, beams.delta_plus.reshape(x.shape), 0).max(axis=1)
        down = np.diff(place(np.stack([phi + size / 2] * 2, 1), np.stack([depth, depth + beyond], 1)), axis=1)
        reach = 2.0 * stretch * (lengths(step[:, 0]) + lengths(down[:, 0]))
        close = (np.abs(away) < reach[:, None]).any(axis=1)
        mixed = (counted > 0).any(axis=1) & (counted < 0).any(axis=1)
        inside = (away < 0).any(axis=1) & (counted > 0).any(axis=1)
        split = (close | (mixed & inside)) & (counted > 0).any(axis=1)
        whole = ~split & (away[:, 4] < 0) & (counted[:, 4] > 0)
        total += _area(density, phi[whole], depth[whole], size, beyond)
        if level == levels or not split.any():
            total += _partial(density, phi[split], depth[split], size, beyond, away[split], counted[split])
            break
        phi, depth = phi[split], depth[split]
        size, beyond = size / 2, beyond / 2
        phi = np.concatenate([phi, phi + size, phi, phi + size])
        depth = np.concatenate([depth, depth, depth + beyond, depth + beyond])
    return total


def _area(density, phi: Array, depth: Array, size: float, beyond: float) -> float:
    if not len(phi):
        return 0.0
    nodes, weights = np.polynomial.legendre.leggauss(3)
    part = (1 + nodes) / 2
    x = phi[:, None, None] + size * part[:, None] + 0 * part
    y = depth[:, None, None] + beyond * part + 0 * part[:, None]
    return float(np.einsum("nij,i,j->", density(x, y), weights, weights)) * size * beyond / 4


def _partial(density, phi, depth, size, beyond, away, counted) -> float:
    if not len(phi):
        return 0.0
    u, v = _SUB[:, None], _SUB

    def bilinear(f: Array) -> Array:
        a, b, c, d = (f[:, i, None, None] for i in range(4))
        return a * (1 - u) * (1 - v) + b * u * (1 - v) + c * (1 - u) * v + d * u * v

    part = ((bilinear(away) < 0) & (bilinear(counted) > 0)).mean(axis=(1, 2))
    return float(part @ density(phi + size / 2, np.maximum(depth + beyond / 2, 1e-9))) * size * beyond
