"""Directions on the camera sky from a caller: arrays of any batch shape, vectors of any length."""

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.spacetime.checks import refuse_traced

# Square of a length that is 1 but for rounding: dividing by it could move a ray close to the shadow edge.
_UNIT = 1e-15


def as_vectors(sky: ArrayLike) -> tuple[np.ndarray, tuple[int, ...]]:
    """The directions (n, 3), not yet of unit length, and their batch shape."""
    try:
        directions = np.asarray(sky, float)
    except (TypeError, ValueError) as error:
        refuse_traced("sky", error)
        raise ValueError("Argument `sky` must be an array of numbers of shape (..., 3).") from None
    if directions.ndim == 0 or directions.shape[-1] != 3:
        raise ValueError(f"Argument `sky` must have shape (..., 3), but has {directions.shape}.")
    return directions.reshape(-1, 3), directions.shape[:-1]


def normalised(directions: np.ndarray) -> np.ndarray:
    """Unit vectors along the directions (n, 3); those that are unit vectors already stay as they are."""
    squares = np.einsum("ij,ij->i", directions, directions)
    if np.all(np.abs(squares - 1) < _UNIT):
        return directions
    largest = np.abs(directions).max(axis=1, initial=0, keepdims=True)
    if not (np.isfinite(largest).all() and (largest > 0).all()):
        raise ValueError("Argument `sky` must hold finite vectors that are not zero.")
    # Divided by the largest component first, so that the squares of extreme vectors neither vanish nor overflow.
    unit = directions / largest
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    return np.where(np.abs(squares - 1)[:, None] < _UNIT, directions, unit)
