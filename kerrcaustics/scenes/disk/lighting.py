"""The light of a disk in the pixels of a picture, from cells that see it (crossings.py).

Pixels are divided into as many parts as their light needs. The light of each part is summed front to back over all
crossings. At rims the covered fraction is exact for a radius that is linear over the part.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.emitters import EMITTERS, Fall, redshift
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.trace import cores
from kerrcaustics.scenes.coons_patches import weights
from kerrcaustics.scenes.disk.crossings import FINEST, DiskCells
from kerrcaustics.scenes.disk.disk import OPPOSITE, Disk, is_prograde, orbital
from kerrcaustics.scenes.disk.samples import DiskSamples, emitted_light
from kerrcaustics.scenes.disk.veil import Veil
from kerrcaustics.scenes.quadtree import in_chunks
from kerrcaustics.scenes.sky import Shifts
from kerrcaustics.shapes import Bool, Float, Int

Array = np.ndarray

# Parts of pixels that a core lights at a time: they fit in its cache.
_TOGETHER = 1 << 15
# Divisions each way of pixels that see a rim: the rim of one crossing may lie in front of another crossing.
_AT_RIM = 4
# Half the width of a pixel in its own steps, with a margin as the steps vary over the pixel.
_PIXEL_REACH = 0.75
# Divisions each way of pixels in which an opacity that is a function varies.
_AT_CHANGE = 8
# Change of the opacity over a cell above which it counts as varying.
_UNEVEN = 1 / 64
# Places each way in a cell at which the opacity is evaluated.
_SAMPLED = 4


class Looks(NamedTuple):
    """Conditions of the light of a disk.

    spin: spin of the hole.
    beaming, colour_shift, delay: switches of `render`.
    time: coordinate time of the camera, M.
    """

    spin: float
    beaming: bool
    colour_shift: bool
    delay: bool
    time: float


class _Layer(NamedTuple):
    """Cells of one crossing by pixels."""

    table: Float[Array, "cells numbers"]
    """The cells as a table for kernels."""
    large: Int[Array, " pixels"]
    """Number of the cell that contains each pixel; -1 without one."""
    pixel: Int[Array, " small"]
    """Pixels of the cells smaller than a pixel, ascending."""
    small: Int[Array, " small"]
    """Numbers of these cells."""
    size: Int[Array, " cells"]
    """Sizes of all cells on the finest lattice."""
    corner: Int[Array, "2 cells"]
    """Corners x and y of all cells in their pixel, on this lattice."""


def disk_light(
    disk: Disk | None, crossings: tuple[DiskCells, ...], shape: tuple[int, int], looks: Looks, veil: Veil | None = None
) -> tuple[Float[Array, "h w 3"], Float[Array, "h w"]]:
    """Linear light of a disk and a volume in the pixels of a picture, and their transmission.

    veil: the volume, divided by the crossings; within a pixel it counts by its mean.
    """
    light, transmission = np.zeros((shape[0] * shape[1], 3), np.float32), np.ones(shape[0] * shape[1], np.float32)
    if veil is not None:
        light[:], transmission[:] = veil.total()
    if disk is None:
        return light.reshape(*shape, 3), transmission.reshape(shape)
    parts = np.zeros(shape[0] * shape[1], np.uint8)
    layers = [_layer(disk, cells, shape, looks, parts) for cells in crossings]

    def store(pixels: Array) -> None:
        grid = _DividedPixels(shape[1], int(parts[pixels[0]]), pixels)
        light[pixels], transmission[pixels] = _chunk_light(disk, layers, looks, grid, veil)

    lit_pixels = np.flatnonzero(parts)
    chunks = [lit_pixels[rows] for rows in in_chunks(parts[lit_pixels], lambda count: _TOGETHER // count**2)]
    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(store, chunks))
    return light.reshape(*shape, 3), transmission.reshape(shape)


def _layer(disk: Disk, cells: DiskCells, shape: tuple[int, int], looks: Looks, parts: Array) -> _Layer:
    """The cells of a crossing by pixels; raises `parts` of each pixel to the number that they need."""
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
        for rows in np.array_split(finer, -(-finer.size * pixels**2 // _TOGETHER) or 1):
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
    corner = np.stack([cells.x, cells.y]) % FINEST
    return _Layer(_cell_table(cells), large, pixel[order], small[order], cells.size, corner)


def _cell_table(cells: DiskCells) -> Float[Array, "cells numbers"]:
    """The table of cells for kernels."""
    lengths = [part / FINEST for part in (cells.x, cells.y, cells.size)]
    columns = *lengths, cells.cover, cells.data.reshape(-1, 24), cells.extra.reshape(-1, 20)
    return np.asarray(kernel("disk_cell").on_rays((), columns))


def _divisions(disk: Disk, cells: DiskCells, looks: Looks) -> tuple[Int[Array, " cells"], Int[Array, " cells"]]:
    """Numbers of parts each way of the pixels of cells, powers of two up to 16.

    The first number is for emission and rims, and may be smaller in some of the pixels; the second is the least number.
    """
    pixels = cells.size / FINEST
    slope = np.hypot(cells.data[:, 4:8], cells.data[:, 8:]).max(axis=1) / pixels[:, None]
    low, high = _between_rims(disk, cells.low, cells.high)
    uneven = np.where(_uneven(disk, cells, low, high, looks), _AT_CHANGE, 1)
    return _needed(disk, cells.low, cells.high, slope), np.maximum(uneven, (1 / np.minimum(pixels, 1)).astype(int))


def _of_pixels(disk: Disk, cells: DiskCells, which: Int[Array, " n"], pixels: int) -> Int[Array, "n down right"]:
    """Numbers of parts for emission and rims of each pixel of cells of one size."""
    where, data = weights(0.0, 0.0, 1.0, pixels), np.moveaxis(cells.data[which], -1, 0)
    place, right, down = (
        np.moveaxis(data @ part, 0, -1).reshape(-1, 2) for part in (where.value, where.along_x, where.along_y)
    )
    reach = _PIXEL_REACH * (np.abs(right) + np.abs(down)) / pixels
    needed = _needed(disk, place - reach, place + reach, np.hypot(right, down) / pixels)
    return needed.reshape(len(which), pixels, pixels)


def _between_rims(disk: Disk, low: Array, high: Array) -> tuple[Float[Array, "n 2"], Float[Array, "n 2"]]:
    """Limits of across and azimuth from those of 1 / r and azimuth, cut at the rims."""
    far, near = np.clip(low[:, 0], 1 / disk.outer, None), np.clip(high[:, 0], None, 1 / disk.inner)
    across = [(1 / np.maximum(part, 1e-12) - disk.inner) / (disk.outer - disk.inner) for part in (near, far)]
    return np.stack([across[0], low[:, 1]], axis=-1), np.stack([across[1], high[:, 1]], axis=-1)


def _needed(disk: Disk, low: Array, high: Array, slope: Array) -> Int[Array, " n"]:
    """Numbers of parts for emission and rims.

    low, high: (n, 2) limits of 1 / r and azimuth.
    slope: (n, 2) their changes over a pixel.
    """
    width = disk.outer - disk.inner
    size = np.stack([slope[:, 0] / np.maximum(low[:, 0], 1 / disk.outer) ** 2 / width, slope[:, 1]], axis=-1)
    divisions = disk.emission.parts(*_between_rims(disk, low, high), np.minimum(size, [1.0, 2 * np.pi]))
    rim = (low[:, 0] < 1 / disk.outer) | (high[:, 0] > 1 / disk.inner)
    return np.maximum(divisions, np.where(rim, _AT_RIM, 1))


def _uneven(disk: Disk, cells: DiskCells, low: Array, high: Array, looks: Looks) -> Bool[Array, " cells"]:
    """True for cells in which an opacity that is a function varies; low, high: (n, 2) limits of across and azimuth."""
    if not callable(disk.opacity):
        return np.zeros(len(low), bool)
    step = (np.arange(_SAMPLED) / (_SAMPLED - 1))[:, None, None]
    across, azimuth = np.moveaxis(low + step * (high - low), -1, 0)
    radius = disk.inner + (disk.outer - disk.inner) * np.clip(across, 0, 1)
    azimuth = np.broadcast_to(azimuth[:, None], (_SAMPLED, *azimuth.shape))
    radius = np.broadcast_to(radius, azimuth.shape)
    if not disk.emission.keeps_shape:
        emitted = looks.time - cells.extra[..., 4].mean(axis=1) * looks.delay
        azimuth = azimuth - disk.orbital(looks.spin, radius) * emitted
    opacity = disk.opacity_at(radius.ravel(), azimuth.ravel()).reshape(_SAMPLED**2, -1)
    return np.ptp(opacity, axis=0) > _UNEVEN


class _DividedPixels(NamedTuple):
    """Parts of some pixels of a picture."""

    width: int
    """Width of the picture, pixels."""
    divisions: int
    """Number of parts of a pixel each way."""
    pixels: Int[Array, " n"]
    """Numbers of the pixels, ascending."""


class _VisibleParts(NamedTuple):
    """Parts of pixels that see the disk at one crossing.

    target: (m,) numbers of the parts.
    The other fields (m, ...) are those that `disk_sample` returns.
    """

    target: Array
    cover: Array
    radius: Array
    azimuth: Array
    across: Array
    matrix: Array
    redshift: Array
    time: Array
    cosine: Array
    photon: Array


def _chunk_light(
    disk: Disk, layers: list[_Layer], looks: Looks, grid: _DividedPixels, veil: Veil | None
) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
    """Light and transmission of some pixels."""
    parts, pixels = grid.divisions**2, grid.pixels
    light, transmission = np.zeros((len(pixels) * parts, 3)), np.ones(len(pixels) * parts)
    for number, layer in enumerate(layers):
        passing_before = _add_volume(veil, number, parts, pixels, light, transmission)
        lit_through = transmission if passing_before is None else transmission * passing_before
        parts_seen = _visible_parts(disk, layer, looks, grid, lit_through) if len(layer.table) else None
        if parts_seen is None or not len(parts_seen.target):
            continue
        shining, passing = _part_light(disk, parts_seen, looks)
        shining *= lit_through[parts_seen.target, None]
        light[parts_seen.target] += shining
        transmission[parts_seen.target] *= passing
    last = _add_volume(veil, len(layers), parts, pixels, light, transmission)
    transmission = transmission if last is None else transmission * last
    mean = np.full((1, parts), 1 / parts)
    return (mean @ light.reshape(len(pixels), -1, 3))[:, 0], transmission.reshape(len(pixels), -1) @ mean[0]


def _add_volume(
    veil: Veil | None, number: int, parts: int, pixels: Array, light: Array, transmission: Array
) -> Float[Array, " parts"] | None:
    """Add the light of a volume in front of a crossing to parts of pixels, and return its transmission."""
    if veil is None:
        return None
    light += transmission[:, None] * np.repeat(veil.light[number][pixels], parts, axis=0)
    return np.repeat(veil.transmission[number][pixels], parts)


def _visible_parts(
    disk: Disk, layer: _Layer, looks: Looks, grid: _DividedPixels, transmission: Float[Array, " parts"]
) -> _VisibleParts:
    """Parts that see the disk, and from which light reaches the camera."""
    target, cell = _visible(layer, grid)
    if not transmission.all():
        open_to = transmission[target] > 0
        target, cell = target[open_to], cell[open_to]
    row, part = np.divmod(target, grid.divisions**2)
    circles = not disk.emission.keeps_shape
    numbers = disk.inner, disk.outer, *_matter(disk.motion, looks.spin), looks.time, looks.delay, circles, *grid[:2]
    columns = grid.pixels[row] * grid.divisions**2 + part, cell
    parts_seen = _VisibleParts(target, *kernel("disk_sample").on_rays(numbers, columns, tables=[layer.table]))
    is_covered = parts_seen.cover > 0
    return parts_seen if is_covered.all() else _VisibleParts(*(values[is_covered] for values in parts_seen))


@lru_cache(maxsize=16)
def _matter(motion: str, spin: float) -> tuple[float, ...]:
    """The parameters of a motion for its kernel."""
    sense = 0 if motion == "static" else 1 if is_prograde(motion) else -1
    fall = Fall.from_isco(spin, sense) if motion.endswith("plunging") else Fall(0.0, 1.0, 0.0)
    return spin, sense, *(float(number) for number in fall)


def _visible(layer: _Layer, grid: _DividedPixels) -> tuple[Int[Array, " m"], Int[Array, " m"]]:
    """Numbers (m,) of parts that see one crossing, in the order of the pixels, and of the cells that they see."""
    count, pixels = grid.divisions, grid.pixels
    number = layer.large[pixels]
    rows = np.flatnonzero(number >= 0)
    pairs = [(np.add.outer(rows * count**2, np.arange(count**2)).ravel(), np.repeat(number[rows], count**2))]
    first, last = np.searchsorted(layer.pixel, [pixels[0], pixels[-1] + 1])
    row = np.searchsorted(pixels, layer.pixel[first:last])
    is_given = pixels[row] == layer.pixel[first:last]
    cell, row = layer.small[first:last][is_given], row[is_given]
    for size in np.unique(layer.size[cell]):
        which = layer.size[cell] == size
        within = np.arange(size * count // FINEST)
        right, down = layer.corner[:, cell[which]] * count // FINEST
        start = row[which] * count**2 + down * count + right
        target = start[:, None] + np.add.outer(within * count, within).ravel()
        pairs.append((target.ravel(), np.repeat(cell[which], len(within) ** 2)))
    target, cells = (np.concatenate(part) for part in zip(*pairs, strict=True))
    return target, cells


def _part_light(disk: Disk, parts_seen: _VisibleParts, looks: Looks) -> tuple[Float[Array, "m 3"], Float[Array, " m"]]:
    """Light (m, 3) and transmission (m,) of parts of pixels."""
    samples = _samples(disk, parts_seen, looks)
    emitted = emitted_light(disk.emission, samples, Shifts(looks.beaming, looks.colour_shift))
    shining = np.multiply(disk.brightness, emitted, dtype=float)
    shining *= parts_seen.cover[:, None]
    return shining, 1 - parts_seen.cover * (1 - disk.transmitted(samples, parts_seen.cosine))


def _samples(disk: Disk, parts_seen: _VisibleParts, looks: Looks) -> DiskSamples:
    """Samples of the disk at the parts of pixels."""

    def opposite(samples: DiskSamples) -> DiskSamples:
        reverse = OPPOSITE[disk.motion]
        b, q, at_infinity, outward = parts_seen.photon.T
        photon = (b, q), (parts_seen.radius, 0.0), at_infinity, outward > 0.5
        ratio = np.asarray(redshift(EMITTERS[reverse], looks.spin, *photon))
        return samples._replace(redshift=ratio, orbital=partial(orbital, reverse, looks.spin))

    width, spin = disk.outer - disk.inner, looks.spin if is_prograde(disk.motion) else -looks.spin
    seen = parts_seen.radius, parts_seen.azimuth, parts_seen.across, parts_seen.matrix, parts_seen.redshift
    return DiskSamples(*seen, width, spin, parts_seen.time, partial(disk.orbital, looks.spin), opposite)
