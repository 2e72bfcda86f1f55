"""Spheres in HEALPix: the places of pixels, and values between them.

References: Gorski et al. 2005, ApJ 622, 759.
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.extras import needed
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers, quoted, whole_number

Array = np.ndarray
Order = Literal["ring", "nested"]
MOST_SIDES = 2048
_MOST_ROWS = 8192


def centres(nside: int, order: Order) -> tuple[Float[Array, " pixels"], Float[Array, " pixels"]]:
    """theta' and phi' (12 nside^2,), radians, of the centres of all pixels."""
    nside = whole_number("nside", nside, 1, MOST_SIDES)
    if power := _next_power(nside):
        raise ValueError(f"Argument `nside` must be a power of two, but is {nside}: take {power}.")
    nested = _is_nested(order)
    return needed("astro", "astropy_healpix.healpy").pix2ang(nside, np.arange(12 * nside**2), nest=nested)


def resolution(nside: int) -> float:
    """Side of a square as large as a pixel, radians."""
    return math.sqrt(math.pi / 3) / nside


def plate_carree_of(values: ArrayLike, order: Order, rows: int | None) -> Float[Array, "rows 2*rows maps"]:
    """A HEALPix map (12 nside^2,), or three (3, 12 nside^2), at the centres of a plate carree grid.

    Linear between the four nearest pixels. By default there are 4 nside rows: the next power of two beyond the
    resolution of the map.
    """
    maps = np.atleast_2d(numbers("values", values))
    nside = math.isqrt(maps.shape[-1] // 12)
    if maps.ndim != 2 or len(maps) not in (1, 3) or not nside or 12 * nside**2 != maps.shape[-1]:
        raise ValueError(
            f"Argument `values` must be one map or three of 12 nside^2 pixels, but has shape {maps.shape}."
        )
    if power := _next_power(nside):
        raise ValueError(
            f"Argument `values` must be a map whose nside is a power of two, but that is {nside}: healpy.ud_grade "
            f"brings a map to {power}."
        )
    rows = whole_number("rows", 4 * nside if rows is None else rows, 4, _MOST_ROWS)
    theta = (np.arange(rows) + 0.5) * math.pi / rows
    phi = (np.arange(2 * rows) + 0.5) * math.pi / rows
    places = np.meshgrid(theta, phi, indexing="ij")
    interpolated, nested = needed("astro", "astropy_healpix.healpy").get_interp_val, _is_nested(order)
    return np.stack([interpolated(one, *places, nest=nested) for one in maps], axis=-1)


def _next_power(nside: int) -> int | None:
    """The next power of two, for a number that is none."""
    return 1 << nside.bit_length() if nside & (nside - 1) else None


def _is_nested(order: Order) -> bool:
    if order not in ("ring", "nested"):
        raise ValueError(f"Argument `order` must be 'ring' or 'nested', but is {quoted(order)}.")
    return order == "nested"
