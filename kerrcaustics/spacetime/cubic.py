"""Roots of cubics, on NumPy or JAX arrays of any shape."""

from typing import Any

import numpy as np

from kerrcaustics.spacetime.arrays import Reals


def largest_root(third: Reals, half: Reals, xp: Any = np) -> Reals:
    """The largest real root of x^3 = 3 third x + 2 half, to start Newton's steps from.

    Parameters: third and half (...,), the coefficients; xp, the array module (numpy or jax.numpy).
    Errors: round-off of the coefficients, whose effect grows where two roots nearly coincide.
    References: Cardano's formula where one root is real, Vieta's where all three are (DLMF 1.11).
    """
    disc = half**2 - third**3
    size = xp.sqrt(xp.maximum(disc, 0))
    cube = xp.cbrt(half + xp.where(half < 0, -size, size))
    only = cube + third / xp.where(cube == 0, 1, cube)
    angle = xp.arctan2(xp.sqrt(xp.maximum(-disc, 0)), half)
    return xp.where(disc > 0, only, 2 * xp.sqrt(xp.maximum(third, 0)) * xp.cos(angle / 3))
