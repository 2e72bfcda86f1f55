"""Geometry of the unit sphere: frames, angles. No physics. Works on NumPy and on JAX arrays."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.spacetime.arrays import HostReals, HostVectors, Vectors


def tangent_basis(n: Vectors, xp: Any = np) -> tuple[Vectors, Vectors]:
    """The two tangents of the public `tangent_basis` at unit vectors n (..., 3), unchecked.

    References: Duff et al. 2017, J. Comput. Graph. Tech. 6(1).
    """
    e_1, e_2 = tangent_parts(n[..., 0], n[..., 1], n[..., 2], xp)
    return xp.stack(e_1, axis=-1), xp.stack(e_2, axis=-1)


def tangent_parts(x: Any, y: Any, z: Any, xp: Any = np) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The tangents of `tangent_basis` by components."""
    sign = xp.where(z >= 0, 1.0, -1.0)
    c = -1 / (sign + z)
    d = x * y * c
    return (1 + sign * x * x * c, sign * d, -sign * x), (d, sign + y * y * c, -y)


def polar_basis(n: Vectors, xp: Any = np) -> tuple[Vectors, Vectors]:
    """Unit tangents (e_theta, e_phi) of spherical coordinates at each point n (..., 3).

    On the axis, where they are not defined, the limit along phi = 0 is returned.
    """
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    s = xp.hypot(x, y)
    on_axis = s == 0
    safe = xp.where(on_axis, 1.0, s)
    c, d = xp.where(on_axis, 1.0, x / safe), y / safe
    return xp.stack([z * c, z * d, -s], axis=-1), xp.stack([-d, c, 0 * z], axis=-1)


def polar_turn(n: tuple[Any, Any, Any], error: Any, xp: Any = np) -> Any:
    """The largest angle by which `polar_basis` turns as n, three components, moves by `error` radians; pi / 2 at most.

    As much as a half turn is open if n may lie on the axis.
    """
    x, y, z = n
    sine = xp.maximum(xp.hypot(x, y), 1e-300)
    return xp.abs(z) * xp.arcsin(xp.minimum(error / sine, 1.0))


def polar_angle(n: HostVectors) -> HostReals:
    """Polar angle theta in [0, pi] of each unit vector n (..., 3), accurate at the poles too."""
    return np.arctan2(np.hypot(n[..., 0], n[..., 1]), n[..., 2])


def angle_between(m: ArrayLike, n: ArrayLike) -> HostReals:
    """Angle in [0, pi] between unit vectors m and n (..., 3), accurate for small and for straight angles."""
    m, n = np.asarray(m), np.asarray(n)
    return 2 * np.arctan2(lengths(m - n), lengths(m + n))


def lengths(vectors: np.ndarray) -> HostReals:
    """Lengths of vectors along the last axis, which is short: NumPy's `norm` takes several times as long there."""
    total = vectors[..., 0] ** 2
    for i in range(1, vectors.shape[-1]):
        total = total + vectors[..., i] ** 2
    return np.asarray(np.sqrt(total))


def unit(vectors: np.ndarray) -> HostVectors:
    """Vectors of length 1 along vectors (..., 3)."""
    return np.asarray(vectors / lengths(vectors)[..., None])


def from_angles(theta: ArrayLike, phi: ArrayLike) -> HostVectors:
    """Unit vectors (..., 3) with polar angle theta and azimuth phi."""
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)


def flattened(direction: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Components (n, 2) of vectors (n, 3) along e_theta and e_phi at directions (n, 3)."""
    return np.stack([np.einsum("ij,ij->i", e, vector) for e in polar_basis(direction)], axis=-1)


def moved(direction: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) reached from directions (n, 3) along great circles, by tangent steps (n, 3) in radians."""
    length = lengths(step)[:, None]
    point = direction * np.cos(length) + step * np.sinc(length / np.pi)
    return unit(point)
