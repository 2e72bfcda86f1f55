"""Emission of disks, as JAX functions of one part of a pixel: kernels are made of them."""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import Number, Program
from kerrcaustics.beams.kernels.tables import Table, table_row

# Smallest half width of a box, swatches.
_LEAST = 1e-9


class Picture(NamedTuple):
    """A picture on a disk (texture.py).

    rows, columns: size of its finest level, pixels.
    count: number of levels.
    width: width of the disk from rim to rim, M.
    pixels: (pixels, channels) values of all levels.
    levels: (levels, 3) number of the first pixel, rows and columns.
    """

    rows: Any
    columns: Any
    count: Any
    width: Any
    pixels: Any
    levels: Any


class Paint(NamedTuple):
    """Swatches on a disk."""

    rows: Any
    """From rim to rim."""
    columns: Any
    """Once round."""
    gap: Any
    """The part of each that is a gap."""
    background: Any
    """The colour of the gaps."""
    width: Any
    """Of the disk, from rim to rim."""
    table: Any
    """A row for each row of swatches: first integrals (2, 3) of the colours of even and of odd columns, above that of
    the gaps, from the inner rim up to its start, in rows; then these colours (2, 3)."""


class DiskBox(NamedTuple):
    """A part of a pixel on a disk.

    across, azimuth, radius: as of `DiskSamples`.
    matrix: (4,) elements by rows, as of `DiskSamples`.
    """

    across: Any
    azimuth: Any
    radius: Any
    matrix: Any


class Thin(NamedTuple):
    """The law of Page & Thorne, in x = sqrt(r).

    spin: spin of the hole, negative for a retrograde disk.
    last: x of the innermost stable circular orbit.
    roots: (3,) roots of x^3 - 3 x + 2 spin.
    shares: (3,) factors of the logarithms that belong to the roots.
    """

    spin: Any
    last: Any
    roots: Any
    shares: Any


def _box(spot: DiskBox, width: Any) -> tuple[Any, Any]:
    """Half sides across and along azimuth, as by `DiskSamples.box`."""
    a, b, c, d = spot.matrix
    return jnp.sqrt(a * a + b * b) / (2 * width), jnp.sqrt(c * c + d * d) / (2 * spot.radius)


def texture_light(picture: Picture, spot: DiskBox) -> Any:
    """Light (channels,) of a picture, averaged over a part: linear within two levels, and between them."""
    half_across, half_turn = _box(spot, picture.width)
    size = jnp.maximum(2 * half_across * picture.rows, half_turn * picture.columns / math.pi)
    level = jnp.log(jnp.maximum(size, 1e-9)) / math.log(2)
    level = jnp.minimum(jnp.maximum(level, 0.0), picture.count - 1)
    lower = jnp.maximum(jnp.minimum(jnp.floor(level), picture.count - 2), 0.0)
    place = 1 - spot.across, spot.azimuth / (2 * math.pi)
    fine, coarse = (_looked_up(picture.pixels, table_row(picture.levels, k), *place) for k in (lower, lower + 1))
    return fine + (level - lower) * (coarse - fine)


def _looked_up(pixels: Any, level: Any, down: Any, right: Any) -> Any:
    """Light (channels,) at parts of the height and of the circumference of a level, linear between pixels."""
    first, rows, columns = level
    y, x = jnp.minimum(jnp.maximum(down * rows - 0.5, 0.0), rows - 1), right * columns - 0.5
    top, left = jnp.maximum(jnp.minimum(jnp.floor(y), rows - 2), 0.0), jnp.floor(x)
    v, u = y - top, x - left
    left = left - columns * jnp.floor(left / columns)
    lines = [first + line * columns for line in (top, jnp.minimum(top + 1, rows - 1))]
    beside = jnp.where(left + 1 < columns, left + 1, 0.0)
    upper, lower = ([table_row(pixels, line + column) for column in (left, beside)] for line in lines)
    above, below = (pair[0] + u * (pair[1] - pair[0]) for pair in (upper, lower))
    return above + v * (below - above)


def paint_light(paint: Paint, spot: DiskBox) -> Any:
    """Light (3,) of swatches, averaged over a box."""
    half_across, half_turn = _box(spot, paint.width)
    place, half = spot.across * paint.rows, jnp.maximum(half_across * paint.rows, _LEAST)
    # The disk ends at its rims.
    low, high = jnp.maximum(place - half, 0.0), jnp.minimum(place + half, paint.rows)
    colours = ((_integral(paint, high) - _integral(paint, low)) / (high - low)).reshape(2, 3)
    per_pair = paint.columns / (4 * math.pi)
    turns, half = spot.azimuth * per_pair, jnp.maximum(half_turn * per_pair, _LEAST)
    even, odd = (_share(paint.gap, turns - parity / 2, half) for parity in range(2))
    return jnp.stack(paint.background) + even * colours[0] + odd * colours[1]


def _integral(paint: Paint, place: Any) -> Any:
    """Integral (6,) of the colours of both parities from the inner rim to a place, in rows."""
    number = jnp.minimum(jnp.floor(place), paint.rows - 1)
    row = table_row(paint.table, number)
    return row[:6] + row[6:] * _clip(place - number - paint.gap / 2, 1 - paint.gap)


def _share(gap: Any, turns: Any, half: Any) -> Any:
    """The part of intervals about turns that a stripe covers which recurs every turn."""
    length = (1 - gap) / 2

    def stripe_length(place: Any) -> Any:
        whole = jnp.floor(place)
        return whole * length + _clip(place - whole - gap / 4, length)

    return (stripe_length(turns + half) - stripe_length(turns - half)) / (2 * half)


def _clip(value: Any, most: Any) -> Any:
    """A value cut to [0, most]."""
    # Cheaper than `clip`, which treats NaN separately.
    return jnp.where(value > 0, jnp.where(value < most, value, most), 0.0)


def thin_disk_flux(law: Thin, radius: Any) -> Any:
    """Flux of a steady thin disk; 0 within the ISCO."""
    last = law.last
    x = jnp.maximum(jnp.sqrt(jnp.maximum(radius, 1e-300)), last)
    total = x - last - 1.5 * law.spin * jnp.log(x / last)
    for root, share in zip(law.roots, law.shares, strict=True):
        total = total - share * jnp.log((x - root) / (last - root))
    shape = 1.5 / (x**4 * (x**3 - 3 * x + 2 * law.spin))
    return jnp.where(x > last, jnp.maximum(shape * total, 0.0), 0.0)


# Kinds of numbers in the signatures of kernels.
_ONE: Any = Number.OF_CALL
_EACH: Any = Number.OF_RAY
_SPOT = DiskBox(_EACH, _EACH, _EACH, (_EACH,) * 4)


def programs() -> dict[str, Program]:
    """The kernels of emissions by their names."""
    paint = Paint(_ONE, _ONE, _ONE, (_ONE,) * 3, _ONE, Table(12))
    law = Thin(_ONE, _ONE, (_ONE,) * 3, (_ONE,) * 3)
    pictures = {count: Picture(_ONE, _ONE, _ONE, _ONE, Table(count, "f4"), Table(3)) for count in (1, 3)}
    return {
        "paint": Program(paint_light, (paint, _SPOT)),
        "thin_disk_flux": Program(thin_disk_flux, (law, _EACH)),
        **{f"texture_{channels}": Program(texture_light, (picture, _SPOT)) for channels, picture in pictures.items()},
    }
