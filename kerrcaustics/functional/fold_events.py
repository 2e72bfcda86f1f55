"""The time at which a star on its path meets a caustic, as a function of the hole, the camera and the path."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from kerrcaustics.beams.differentiable import float64
from kerrcaustics.beams.moving import Moving, motion_of
from kerrcaustics.beams.program_cache import prepare_compilation
from kerrcaustics.functional.fold_patch import ChebyshevPatch, fold_where, patch_of, smooth_root
from kerrcaustics.functional.local_map import Vector, determinant, smooth, tangents, unit
from kerrcaustics.functional.traced_arguments import (
    check_axis,
    check_shapes,
    direction_of,
    flattened,
    wide,
    wide_place,
    with_place,
)
from kerrcaustics.spacetime.camera import Velocity


def event_time(
    spin: Any, radius: Any, inclination: Any, path: Any, near: Any, velocity: Velocity = "fiducial"
) -> Float[Array, "..."]:
    """The time at which a star that moves meets a caustic.

    Parameters
    ----------
    spin, radius, inclination : float or (...)
        As in `direction`.
    path : (..., terms, 2)
        theta' and phi' of the star as polynomials of time: at time 0, their rates, and so on.
    near : (..., 3)
        Directions N next to the point of the critical curve at which the pair of images is created or annihilated:
        `sky` of a `PairEvent`. They are constants: derivatives with respect to them are 0.
    velocity : str or (float, float, float), optional
        As in `direction`.

    Returns
    -------
    (...) float64, in units of the path; NaN where the fold is lost.

    Errors
    ------
    The error of n', 1e-12 or so, divided by the speed of the star across the caustic; derivatives 1e-9 or so, relative.

    Notes
    -----
    Azimuths are relative to the camera: those of a star that an orbiting camera sees fall at its angular velocity. At
    cusps, and where the star moves along the caustic, the time has no derivatives.

    Examples
    --------
    >>> import jax, math, kerrcaustics as kc
    >>> event = kc.pair_events(kc.Camera(0.999, 6.03), 0.392 * math.pi)[0]
    >>> path = [[0.392 * math.pi, event.longitude - 0.01], [0.0, 1.0]]
    >>> time = kc.functional.event_time(0.999, 6.03, math.pi / 2, path, event.sky, "circular")
    >>> abs(float(time) - 0.01) < 1e-11
    True
    """
    motion = motion_of(velocity)
    with float64():
        place, path, near = wide_place(spin, radius, inclination), wide("path", path), wide("near", near)
        check_axis("path", path, 2, "(..., terms, 2)", axes=2)
        check_axis("near", near, 3, "(..., 3)")
        check_shapes(*place, path=path.shape[:-2], near=near.shape[:-1])
        return _event_time(place, path, near, motion)


@jax.jit
def _event_time(place: list[Array], path: Array, near: Array, motion: Moving) -> Array:
    prepare_compilation()
    arguments = with_place(place, path.reshape(*path.shape[:-2], -1))
    shape = jnp.broadcast_shapes(arguments.shape[:-1], near.shape[:-1])
    flat = [flattened(x, shape, 1) for x in (arguments, near)]
    return jax.vmap(lambda one, sky: _time(one, (sky, motion)))(*flat).reshape(shape)


@smooth
def _time(arguments: Float[Array, " numbers"], settings: tuple[Vector, Moving]) -> Float[Array, "1"]:
    """The time; arguments: the camera's three numbers, then the path."""
    near, motion = settings
    numbers, path = arguments[:3], arguments[3:].reshape(-1, 2)
    fixed = jax.lax.stop_gradient
    fold = fold_where(fixed(numbers), near, motion, partial(_on_path, fixed(path)), jnp.zeros(1))
    patch = patch_of(numbers, fold.place, motion, lambda arrival: arrival)
    start = jnp.concatenate([fold.at, fold.extra])
    root = smooth_root(partial(_on_path, path, patch, jnp.zeros(2)), start)
    return jnp.where(fold.found, root[2:], jnp.nan)


def _on_path(path: Float[Array, "terms 2"], patch: ChebyshevPatch, _: Array, unknown: Vector) -> Vector:
    """Zero where the beam at a place has no area and ends at the star, as it is at a time."""
    at, time = unknown[:2], unknown[2]
    arrival, columns = patch(at), jax.jacfwd(patch)(at)
    end_axes = tangents(jax.lax.stop_gradient(unit(arrival)))
    star = direction_of(jnp.polyval(path[::-1], time))
    return jnp.append(end_axes.T @ (arrival - star), determinant(arrival, columns))
