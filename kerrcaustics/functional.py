"""Rays as pure functions for JAX: jit, vmap, grad, of the hole, the camera and the direction.

Unlike the engines behind `trace_rays`, which are compiled once for all callers and estimate errors, these are traced by
the caller's own transformations.

Derivatives of any order, forward and reverse, are taken by forward differentiation inside: a loop of unknown length has
no other, and the arguments are six numbers.

All arithmetic is in float64, whatever the settings of JAX. JAX itself still converts arguments and
gradients: without `jax_enable_x64`, `jit`, `vmap` and `grad` round Python's floats and NumPy's arrays to float32,
and gradients come back in the type of the arguments.
"""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from kerrcaustics.beams.differentiable import Moving, differentiable, end, float64, motion_of
from kerrcaustics.spacetime.camera import Velocity
from kerrcaustics.spacetime.viewer import LARGEST_RADIUS


def direction(
    spin: Any, radius: Any, inclination: Any, sky: Any, velocity: Velocity = "fiducial"
) -> Float[Array, "... 3"]:
    """The origin of the light of a camera-sky direction: n' (..., 3), a unit vector of the celestial sphere.

    Parameters
    ----------
    spin, radius, inclination : float or (...)
        As in `Camera`; checked if they are numbers, not if JAX traces them.
    sky : (..., 3)
        Directions N on the camera sky; their length does not matter, so that a gradient is tangential.
    velocity : str or (float, float, float), optional
        As in `Camera`, but "fiducial" by default. A name is the motion that belongs to the place, and is
        differentiated with it: "circular" is the angular velocity 1 / (a + r^(3/2)), also off the equator, where it is
        no geodesic and `Camera` has none.

    Returns
    -------
    (..., 3) float64; NaN for captured rays.

    Errors
    ------
    1e-13 or so times the beam's major diameter; derivatives lose a power of it more each.
    """
    return _traced(spin, radius, inclination, sky, velocity, timed=False)


def travel_time(
    spin: Any, radius: Any, inclination: Any, sky: Any, velocity: Velocity = "fiducial"
) -> Float[Array, "..."]:
    """The coordinate time from infinity to the camera, the limit of t - r - 2 ln r (...); all else as `direction`.

    Errors: about 1e-13 times the length of the way, and the major diameter times 1e-13.
    """
    return _traced(spin, radius, inclination, sky, velocity, timed=True)[..., 3]


def _traced(spin: Any, radius: Any, inclination: Any, sky: Any, velocity: Velocity, *, timed: bool) -> Array:
    motion = motion_of(velocity)
    with float64():
        place, sky = [_wide(x) for x in (spin, radius, inclination)], _wide(sky)
        _check_place(*place)
        if sky.ndim == 0 or sky.shape[-1] != 3:
            raise ValueError(f"Argument `sky` must have the shape (..., 3), but has {sky.shape}.")
        return _ends(*place, sky, motion, timed)


def _check_place(spin: Array, radius: Array, inclination: Array) -> None:
    """Raise ValueError for a place that no camera can have; traced arguments are not checked."""
    if not isinstance(spin, Tracer):
        if not ((spin >= 0) & (spin < 1)).all():
            raise ValueError("Argument `spin` must lie in [0, 1).")
        horizon = 1 + jnp.sqrt((1 - spin) * (1 + spin))
        if not isinstance(radius, Tracer) and not ((radius > horizon) & (radius <= LARGEST_RADIUS)).all():
            raise ValueError("Argument `radius` must be larger than the horizon radius, and at most 1e9.")
    if not isinstance(inclination, Tracer) and not ((inclination >= 0) & (inclination <= jnp.pi)).all():
        raise ValueError("Argument `inclination` must lie in [0, pi] radians.")


def _wide(value: Any) -> Array:
    """The argument in float64; a traced one is converted by JAX."""
    if isinstance(value, Tracer):
        return jax.lax.convert_element_type(value, jnp.float64)
    return jnp.asarray(value, jnp.float64)


@partial(jax.jit, static_argnames=("timed",))
def _ends(spin: Array, radius: Array, inclination: Array, sky: Array, motion: Moving, timed: bool) -> Array:
    place = (jnp.broadcast_to(x, sky.shape[:-1]) for x in jnp.broadcast_arrays(spin, radius, inclination))
    arguments = jnp.concatenate([jnp.stack(list(place), axis=-1), sky], axis=-1)
    ends = jax.vmap(differentiable(partial(end, timed=timed)), (0, None))(arguments.reshape(-1, 6), motion)
    return ends.reshape(*sky.shape[:-1], -1)
