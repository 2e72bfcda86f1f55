"""The light of a disk in the pixels of a picture, from cells that see it (crossings.py).

Pixels are divided into as many parts as their light needs. Each part is lit front to back through all crossings;
rims are covered to the exact part of a square on which the radius is linear.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import repeat
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.emitters import EMITTERS, redshift
from kerrcaustics.beams.trace import cores
from kerrcaustics.scenes.coons_patches import Weights, weights
from kerrcaustics.scenes.disk.crossings import FINEST, LARGEST, DiskCells
from kerrcaustics.scenes.disk.disk import OPPOSITE, Disk, is_prograde, orbital
from kerrcaustics.scenes.disk.samples import DiskSamples
from kerrcaustics.scenes.disk.veil import Veil
from kerrcaustics.scenes.quadtree import in_chunks
from kerrcaustics.shapes import Bool, Float, Int

Array = np.ndarray

# Parts of pixels that a core lights at a time: memory beside the picture is what these need.
_LIT = 1 << 18
# Pixels with a rim in sight are divided so finely in each direction: one crossing's rim may lie before another's.
_AT_RIM = 4
# How far a pixel reaches from its middle, in its steps, and some more as these are not quite even.
_PIXEL_REACH = 0.75
# And so finely where an opacity that is a function changes by more than this over a cell, of which it is looked at in
# so many places in each direction.
_AT_CHANGE, _UNEVEN, _LOOKED_AT = 8, 1 / 64, 4


class Looks(NamedTuple):
    """Conditions of the light of a disk: the spin, the switches of `render`, and the camera's time."""

    spin: float
    beaming: bool
    colour_shift: bool
    delay: bool
    time: float


class _Layer(NamedTuple):
    """A crossing: its cells; the one that each pixel lies in, -1 for none; those within pixels, by their pixel."""

    cells: DiskCells
    large: Int[Array, " pixels"]
    pixel: Int[Array, " small"]
    small: Int[Array, " small"]


def lit(
    disk: Disk | None, crossings: tuple[DiskCells, ...], shape: tuple[int, int], looks: Looks, veil: Veil | None = None
) -> tuple[Float[Array, "h w 3"], Float[Array, "h w"]]:
    """Linear light of the pixels of a picture, and the part of the light behind that comes through.

    veil: a volume, divided by as many crossings. Where it and the disk change within a pixel, it counts by its mean.
    """
    light, transmission = np.zeros((shape[0] * shape[1], 3), np.float32), np.ones(shape[0] * shape[1], np.float32)
    if veil is not None:
        light[:], transmission[:] = veil.whole()
    if disk is None:
        return light.reshape(*shape, 3), transmission.reshape(shape)
    parts = np.zeros(shape[0] * shape[1], np.uint8)
    layers = [_layer(disk, cells, shape, looks, parts) for cells in crossings]

    def store(pixels: Array, layers: list[_Layer]) -> None:
        count = int(parts[pixels[0]])
        light[pixels], transmission[pixels] = _chunk_lit(disk, layers, shape[1], looks, count, pixels, veil)

    with ThreadPoolExecutor(cores()) as pool:
        for pixels, covering in _ordered(np.flatnonzero(parts), layers, shape[1]):
            chunks = (pixels[rows] for rows in in_chunks(parts[pixels], lambda count: _LIT // count**2))
            list(pool.map(store, chunks, repeat(covering)))
    return light.reshape(*shape, 3), transmission.reshape(shape)


def _ordered(pixels: Array, layers: list[_Layer], width: int) -> Iterator[tuple[Array, list[_Layer]]]:
    """Pixels with cells within them, and the others, so that those at one place in their cells follow each other."""
    within = np.zeros(len(layers[0].large) if layers else 0, bool)
    for layer in layers:
        within[layer.pixel] = True
    none = np.zeros(0, int)
    yield pixels[within[pixels]], layers
    outside = pixels[~within[pixels]]
    order = np.lexsort((outside % width % LARGEST, outside // width % LARGEST))
    yield outside[order], [layer._replace(pixel=none, small=none) for layer in layers]


def _layer(disk: Disk, cells: DiskCells, shape: tuple[int, int], looks: Looks, parts: Array) -> _Layer:
    """The cells of a crossing by pixels; `parts` of each pixel grows to what they need."""
    height, width = shape
    needed, least = _divisions(disk, cells, looks)
    large = np.full(height * width, -1)
    for size in np.unique(cells.size[cells.size >= FINEST]):
        pixels, which = size // FINEST, np.flatnonzero(cells.size == size)
        within = np.arange(pixels)
        x = (cells.x[which] // FINEST)[:, None, None] + within
        y = (cells.y[which] // FINEST)[:, None, None] + within[:, None]
        x, y, number = np.broadcast_arrays(x, y, which[:, None, None])
        divisions = np.maximum(needed[number], least[number])
        finer = np.flatnonzero((needed > least)[which] & (pixels > 1))
        for rows in np.array_split(finer, -(-finer.size * pixels**2 // _LIT) or 1):
            divisions[rows] = np.maximum(_of_pixels(disk, cells, which[rows], int(pixels)), least[number[rows]])
        inside = (x < width) & (y < height)
        place = y[inside] * width + x[inside]
        large[place] = number[inside]
        parts[place] = np.maximum(parts[place], divisions[inside])
    small = np.flatnonzero(cells.size < FINEST)
    x, y = cells.x[small] // FINEST, cells.y[small] // FINEST
    inside = (x < width) & (y < height)
    small, pixel = small[inside], (y * width + x)[inside]
    np.maximum.at(parts, pixel, np.maximum(needed, least)[small].astype(parts.dtype))
    order = np.argsort(pixel, kind="stable")
    return _Layer(cells, large, pixel[order], small[order])


def _divisions(disk: Disk, cells: DiskCells, looks: Looks) -> tuple[Int[Array, " cells"], Int[Array, " cells"]]:
    """Numbers of parts, in each direction, of the pixels of cells, powers of two to 16.

    By the emission and rims, which some pixels need less; and at least.
    """
    pixels = cells.size / FINEST
    slope = np.hypot(cells.data[:, 4:8], cells.data[:, 8:]).max(axis=1) / pixels[:, None]
    low, high = _between_rims(disk, cells.low, cells.high)
    uneven = np.where(_uneven(disk, cells, low, high, looks), _AT_CHANGE, 1)
    return _needed(disk, cells.low, cells.high, slope), np.maximum(uneven, (1 / np.minimum(pixels, 1)).astype(int))


def _of_pixels(disk: Disk, cells: DiskCells, which: Int[Array, " n"], pixels: int) -> Int[Array, "n down right"]:
    """The same by the emission and rims of each pixel of cells of one size."""
    where, data = weights(0.0, 0.0, 1.0, pixels), np.moveaxis(cells.data[which], -1, 0)
    place, right, down = (
        np.moveaxis(data @ part, 0, -1).reshape(-1, 2) for part in (where.value, where.along_x, where.along_y)
    )
    reach = _PIXEL_REACH * (np.abs(right) + np.abs(down)) / pixels
    needed = _needed(disk, place - reach, place + reach, np.hypot(right, down) / pixels)
    return needed.reshape(len(which), pixels, pixels)


def _between_rims(disk: Disk, low: Array, high: Array) -> tuple[Float[Array, "n 2"], Float[Array, "n 2"]]:
    """Limits of across and azimuth, of 1 / r and azimuth: what reaches beyond a rim is none of the disk."""
    far, near = np.clip(low[:, 0], 1 / disk.outer, None), np.clip(high[:, 0], None, 1 / disk.inner)
    across = [(1 / np.maximum(part, 1e-12) - disk.inner) / (disk.outer - disk.inner) for part in (near, far)]
    return np.stack([across[0], low[:, 1]], axis=-1), np.stack([across[1], high[:, 1]], axis=-1)


def _needed(disk: Disk, low: Array, high: Array, slope: Array) -> Int[Array, " n"]:
    """Numbers of parts by the emission and rims.

    low, high, slope (n, 2), of 1 / r and azimuth: between which they lie, and how far they go in a pixel.
    """
    width = disk.outer - disk.inner
    size = np.stack([slope[:, 0] / np.maximum(low[:, 0], 1 / disk.outer) ** 2 / width, slope[:, 1]], axis=-1)
    divisions = disk.emission.parts(*_between_rims(disk, low, high), np.minimum(size, [1.0, 2 * np.pi]))
    rim = (low[:, 0] < 1 / disk.outer) | (high[:, 0] > 1 / disk.inner)
    return np.maximum(divisions, np.where(rim, _AT_RIM, 1))


def _uneven(disk: Disk, cells: DiskCells, low: Array, high: Array, looks: Looks) -> Bool[Array, " cells"]:
    """Cells in which an opacity that is a function changes; low, high (n, 2), between which across and azimuth lie."""
    if not callable(disk.opacity):
        return np.zeros(len(low), bool)
    step = (np.arange(_LOOKED_AT) / (_LOOKED_AT - 1))[:, None, None]
    across, azimuth = np.moveaxis(low + step * (high - low), -1, 0)
    radius = disk.inner + (disk.outer - disk.inner) * np.clip(across, 0, 1)
    azimuth = np.broadcast_to(azimuth[:, None], (_LOOKED_AT, *azimuth.shape))
    radius = np.broadcast_to(radius, azimuth.shape)
    if not getattr(disk.emission, "keeps_shape", False):
        emitted = looks.time - cells.extra[..., 4].mean(axis=1) * looks.delay
        azimuth = azimuth - disk.orbital(looks.spin, radius) * emitted
    opacity = disk.opacity_at(radius.ravel(), azimuth.ravel()).reshape(_LOOKED_AT**2, -1)
    return np.ptp(opacity, axis=0) > _UNEVEN


class _Sight(NamedTuple):
    """Parts of pixels that see the plane at one crossing; the last axis of all arrays is theirs.

    target (m,), the number of the part; cover (m,), the part of it between the rims; place (2, m), 1 / r and phi; slope
    (2, 2, m), changes along the sides of the part (rows) of these; extra (5, m) as in `DiskCells`; late (2, m), the
    change of the travel time along the sides.
    """

    target: Array
    cover: Array
    place: Array
    slope: Array
    extra: Array
    late: Array


def _chunk_lit(
    disk: Disk, layers: list[_Layer], width: int, looks: Looks, count: int, pixels: Array, veil: Veil | None
) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
    """Light and transmission of some pixels, divided into count x count parts."""
    light = np.zeros((len(pixels) * count * count, 3))
    transmission = np.ones(len(light))
    for number, layer in enumerate(layers):
        passing_before = _matter_lit(veil, number, count, pixels, light, transmission)
        lit_through = transmission if passing_before is None else transmission * passing_before
        groups = _groups(layer, width, count, pixels)
        sights = [_sight(disk, layer.cells, *group, count, lit_through) for group in groups]
        if not any(len(part.target) for part in sights):
            continue
        sight = _Sight(*(np.concatenate(parts, axis=-1) for parts in zip(*sights, strict=True)))
        shining, passing = _parts_lit(disk, sight, looks)
        light[sight.target] += lit_through[sight.target, None] * shining
        transmission[sight.target] *= passing
    last = _matter_lit(veil, len(layers), count, pixels, light, transmission)
    transmission = transmission if last is None else transmission * last
    each = np.full((1, count * count), 1 / count**2)
    return (each @ light.reshape(len(pixels), -1, 3))[:, 0], transmission.reshape(len(pixels), -1) @ each[0]


def _matter_lit(
    veil: Veil | None, number: int, count: int, pixels: Array, light: Array, transmission: Array
) -> Float[Array, " parts"] | None:
    """Add the light of a volume before a crossing to parts of pixels, and return the part that it lets through."""
    if veil is None:
        return None
    light += transmission[:, None] * np.repeat(veil.light[number][pixels], count * count, axis=0)
    return np.repeat(veil.transmission[number][pixels], count * count)


def _sight(
    disk: Disk,
    cells: DiskCells,
    rows: Array,
    block: tuple[slice, slice],
    which: Array,
    where: Weights,
    count: int,
    transmission: Float[Array, " parts"],
) -> _Sight:
    """The visible plane of those parts that see it.

    transmission: the part of its light that comes through to each of them; other parameters as `_groups` yields them.
    """
    down, right = (np.arange(part.start, part.stop) for part in block)
    target = rows[:, None] * count**2 + (down[:, None] * count + right).ravel()
    # The length of a cell along a side of a part.
    side = FINEST / int(cells.size[which[0]]) / count
    by = np.stack([where.value, side * where.along_x, side * where.along_y], axis=1).reshape(12, -1)
    data = (_columns(cells.data, which) @ by).reshape(2, len(which), 3, -1)
    by = np.concatenate([where.mean, side * where.mean_x, side * where.mean_y], axis=1)
    extra = _columns(cells.extra, which)
    late = (extra[4] @ by[:, target.shape[1] :]).reshape(len(which), 2, -1)
    cover = np.repeat(cells.cover[which, None], target.shape[1], axis=1)
    rim = np.flatnonzero((cells.low[which, 0] < 1 / disk.outer) | (cells.high[which, 0] > 1 / disk.inner))
    value, *slopes = np.moveaxis(data[0, rim], 1, 0)
    within = [covered_part(value - edge, *slopes) for edge in (1 / disk.outer, 1 / disk.inner)]
    cover[rim] *= within[0] - within[1]
    parts = (data[:, :, 0], data[:, :, 1:].swapaxes(1, 2), extra @ where.mean, late.swapaxes(0, 1))
    visible = np.flatnonzero((cover > 0) & (transmission[target] > 0))
    return _Sight(*(part.reshape(*part.shape[:-2], -1).take(visible, -1) for part in (target, cover, *parts)))


def _columns(values: Float[Array, "cells rows columns"], which: Int[Array, " n"]) -> Float[Array, "columns n rows"]:
    """Values of some cells, column by column, as matrices are multiplied fastest."""
    return np.ascontiguousarray(values[which].transpose(2, 0, 1))


def _groups(
    layer: _Layer, width: int, count: int, pixels: Array
) -> Iterator[tuple[Array, tuple[slice, slice], Array, Weights]]:
    """Pixels that see one crossing through cells of one size at one place in them.

    Each as: rows of the pixels; slices of their parts, down and across; the cells; the weights there.
    """
    cells, whole = layer.cells, (slice(0, count), slice(0, count))
    number = layer.large[pixels]
    rows = np.flatnonzero(number >= 0)
    if len(rows):
        number = number[rows]
        size = cells.size[number] // FINEST
        x = pixels[rows] % width - cells.x[number] // FINEST
        y = pixels[rows] // width - cells.y[number] // FINEST
        for kind, chosen in _by_value((size * FINEST + y) * FINEST + x):
            size_here, place = divmod(kind, FINEST * FINEST)
            down, right = divmod(place, FINEST)
            side = 1 / size_here
            yield rows[chosen], whole, number[chosen], weights(right * side, down * side, side, count)
    first, last = np.searchsorted(layer.pixel, [pixels[0], pixels[-1] + 1])
    row = np.searchsorted(pixels, layer.pixel[first:last])
    here = np.flatnonzero(pixels[np.minimum(row, len(pixels) - 1)] == layer.pixel[first:last])
    if not len(here):
        return
    number, row = layer.small[first:last][here], row[here]
    size = cells.size[number]
    for kind, chosen in _by_value((size * FINEST + cells.y[number] % FINEST) * FINEST + cells.x[number] % FINEST):
        size_here, place = divmod(kind, FINEST * FINEST)
        down, right = divmod(place, FINEST)
        parts = size_here * count // FINEST
        first_row, first_column = down * count // FINEST, right * count // FINEST
        block = slice(first_row, first_row + parts), slice(first_column, first_column + parts)
        yield row[chosen], block, number[chosen], weights(0.0, 0.0, 1.0, parts)


def _by_value(kinds: Array) -> Iterator[tuple[int, Array]]:
    """Values, each with its places."""
    order = np.argsort(kinds, kind="stable")
    values, starts = np.unique(kinds[order], return_index=True)
    for value, chosen in zip(values, np.split(order, starts[1:]), strict=True):
        yield int(value), chosen


def _parts_lit(disk: Disk, sight: _Sight, looks: Looks) -> tuple[Float[Array, "m 3"], Float[Array, " m"]]:
    """Light (m, 3) and transmission (m,) of parts of pixels."""
    at_infinity, b, q, outward, _ = sight.extra
    # Parts on a rim are lit by what lies within.
    radius = np.clip(1 / sight.place[0], disk.inner, disk.outer)

    def ratio_of(motion: str) -> Array:
        photon = (b, q), (radius, 0.0), at_infinity, outward > 0.5
        return np.asarray(redshift(EMITTERS[motion], looks.spin, *photon))

    def opposite(samples: DiskSamples) -> DiskSamples:
        reverse = OPPOSITE[disk.motion]
        return samples._replace(redshift=ratio_of(reverse), orbital=partial(orbital, reverse, looks.spin))

    ratio = ratio_of(disk.motion)
    samples = _samples(disk, sight, looks, radius, ratio)._replace(opposite=opposite)
    shining = disk.brightness * disk.emission.light(samples, looks.beaming, looks.colour_shift)
    if looks.beaming or looks.colour_shift:
        shining = np.where(np.isfinite(ratio)[:, None], shining, 0.0)
    # p . normal over p . u of what shines, which in units of the energy at infinity is a ratio of the two ratios.
    cosine = np.sqrt(np.maximum(q, 0)) / radius * ratio / at_infinity if disk.slanting else np.ones_like(radius)
    return sight.cover[:, None] * shining, 1 - sight.cover * (1 - disk.transmitted(samples, cosine))


def _samples(disk: Disk, sight: _Sight, looks: Looks, radius: Array, ratio: Array) -> DiskSamples:
    """Samples of the disk, or of its pattern, which circles as light travels."""
    along_radius = -(radius**2) * sight.slope[0]
    azimuth, along_azimuth = sight.place[1], sight.slope[1]
    emitted = looks.time - (sight.extra[4] if looks.delay else np.zeros_like(radius))
    if looks.delay:
        along_azimuth = along_azimuth + disk.orbital(looks.spin, radius) * sight.late
    if not getattr(disk.emission, "keeps_shape", False) and np.any(emitted):
        azimuth = azimuth - disk.orbital(looks.spin, radius) * emitted
        step = 1e-4 * radius
        farther, nearer = (disk.orbital(looks.spin, radius + sign * step) for sign in (1, -1))
        along_azimuth = along_azimuth - ((farther - nearer) / (2 * step) * emitted) * along_radius
    matrix = np.moveaxis(np.stack([along_radius, radius * along_azimuth]), -1, 0)
    width = disk.outer - disk.inner
    spin = looks.spin if is_prograde(disk.motion) else -looks.spin
    across = (radius - disk.inner) / width
    return DiskSamples(radius, azimuth, across, matrix, ratio, width, spin, emitted, partial(disk.orbital, looks.spin))


def covered_part(over: Array, x: Array, y: Array) -> Array:
    """The part of a square in which a linear function is positive: its value in the middle, its changes along sides.

    A square's shadow along the gradient is a trapezoid; this is its integral.
    """
    x, y = np.abs(x), np.abs(y)
    large, small = np.maximum(x, y), np.minimum(x, y)
    large = np.maximum(large, 1e-300)
    small = np.maximum(small, 1e-4 * large)

    def ramp(z: Array) -> Array:
        return np.maximum(z, 0) ** 2

    outer, inner = (large + small) / 2, (large - small) / 2
    integral = ramp(over + outer) - ramp(over + inner) - ramp(over - inner) + ramp(over - outer)
    return np.where(over >= outer, 1.0, np.where(over <= -outer, 0.0, integral / np.maximum(2 * large * small, 1e-300)))
