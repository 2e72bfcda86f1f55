"""Directions from a caller: arrays of any batch shape, vectors of any length."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.spacetime import sphere
from kerrcaustics.spacetime.checks import real_array

# Square of a length that is 1 but for rounding: dividing by it could move a ray close to the shadow edge.
_UNIT = 1e-15


def tangent_basis(n: Any, xp: Any = np) -> tuple[Any, Any]:
    """Two unit tangents (e_1, e_2) at each point n of the sphere, with e_1 x e_2 = n.

    Parameters
    ----------
    n : (..., 3) array
        Unit vectors. They are normalised here.
    xp : module
        Of the arrays: numpy or jax.numpy. Those of JAX are not checked.

    Returns
    -------
    (..., 3) arrays
        e_1 and e_2.

    Raises
    ------
    ValueError
        If a vector is zero or not finite.

    Errors
    ------
    Orthonormal to round-off everywhere, poles included; discontinuous only across n_z = 0.

    References
    ----------
    Duff et al. 2017, J. Comput. Graph. Tech. 6(1).

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> one, two = kc.tangent_basis([[0.0, 0.0, 2.0]])
    >>> one.shape
    (1, 3)
    """
    if xp is np:
        directions, shape = as_vectors(n, "n")
        return sphere.tangent_basis(normalised(directions, "n").reshape(*shape, 3))
    return sphere.tangent_basis(n / xp.linalg.norm(n, axis=-1, keepdims=True), xp)


def as_vectors(sky: ArrayLike, name: str = "sky") -> tuple[np.ndarray, tuple[int, ...]]:
    """The directions (n, 3) in the argument `name`, not yet of unit length, and their batch shape."""
    directions = real_array(name, sky)
    if directions.ndim == 0 or directions.shape[-1] != 3:
        raise ValueError(f"Argument `{name}` must have shape (..., 3), but has {directions.shape}.")
    return directions.reshape(-1, 3), directions.shape[:-1]


def normalised(directions: np.ndarray, name: str = "sky") -> np.ndarray:
    """Unit vectors along the directions (n, 3) of the argument `name`; those that have unit length stay as they are."""
    squares = np.einsum("ij,ij->i", directions, directions)
    if np.all(np.abs(squares - 1) < _UNIT):
        return directions
    largest = np.abs(directions).max(axis=1, initial=0, keepdims=True)
    if not (np.isfinite(largest).all() and (largest > 0).all()):
        raise ValueError(f"Argument `{name}` must hold finite vectors that are not zero{_bad_row(largest)}.")
    # Divided by the largest component first, so that the squares of extreme vectors neither vanish nor overflow.
    unit = directions / largest
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    return np.where(np.abs(squares - 1)[:, None] < _UNIT, directions, unit)


def _bad_row(largest: np.ndarray) -> str:
    """The first vector that is not finite or is zero, by its number, as the end of a message."""
    bad = np.flatnonzero(~(np.isfinite(largest[:, 0]) & (largest[:, 0] > 0)))
    return f", but vector {bad[0]} of {len(largest)}, counted from 0, is not" if len(largest) > 1 else ""
