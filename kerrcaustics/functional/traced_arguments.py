"""Arguments that JAX may trace: float64, and checks of those that are numbers."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from kerrcaustics.spacetime.checks import quoted, real_array
from kerrcaustics.spacetime.kerr import if_mirrored
from kerrcaustics.spacetime.viewer import LARGEST_RADIUS


def _check_place(spin: Array, radius: Array, inclination: Array) -> None:
    """Raise ValueError for a place that no camera can have; traced arguments are not checked."""
    check_shapes(spin, radius, inclination)
    if not isinstance(spin, Tracer):
        if not ((spin >= 0) & (spin < 1)).all():
            wrong = float(spin[~((spin >= 0) & (spin < 1))][0])
            raise ValueError(f"Argument `spin` must lie in [0, 1), but is {quoted(wrong)}{if_mirrored(wrong)}")
        horizon = 1 + jnp.sqrt((1 - spin) * (1 + spin))
        if not isinstance(radius, Tracer) and not ((radius > horizon) & (radius <= LARGEST_RADIUS)).all():
            raise ValueError("Argument `radius` must be larger than the horizon radius, and at most 1e9.")
    if not isinstance(inclination, Tracer) and not ((inclination >= 0) & (inclination <= jnp.pi)).all():
        raise ValueError("Argument `inclination` must lie in [0, pi] radians.")


def wide(name: str, value: Any) -> Array:
    """The argument `name` in float64; a traced one, or numbers among which some are traced, are converted by JAX."""
    if isinstance(value, Tracer):
        return jax.lax.convert_element_type(value, jnp.float64)
    if any(isinstance(part, Tracer) for part in jax.tree.leaves(value)):
        return jnp.asarray(value, jnp.float64)
    return jnp.asarray(real_array(name, value))


def wide_place(spin: Any, radius: Any, inclination: Any) -> list[Array]:
    """The arguments of a camera's place in float64; a ValueError if they are numbers that no camera can have."""
    place = [wide("spin", spin), wide("radius", radius), wide("inclination", inclination)]
    _check_place(*place)
    return place


def check_axis(name: str, value: Array, count: int, shape: str, axes: int = 1) -> None:
    """Raise ValueError unless the last axis of an array has `count` entries."""
    if value.ndim < axes or value.shape[-1] != count:
        raise ValueError(f"Argument `{name}` must have the shape {shape}, but has {value.shape}.")


def check_shapes(spin: Array, radius: Array, inclination: Array, **others: tuple[int, ...]) -> None:
    """Raise ValueError unless the shapes of arguments fit together; others: shapes, without axes of their own."""
    shape: tuple[int, ...] = ()
    for name, own in {"spin": spin.shape, "radius": radius.shape, "inclination": inclination.shape, **others}.items():
        try:
            shape = jnp.broadcast_shapes(shape, own)
        except ValueError:
            raise ValueError(
                f"Argument `{name}` must have a shape that fits the {shape} of those before it, but has {own}."
            ) from None


def flattened(value: Array, shape: tuple[int, ...], inner: int) -> Array:
    """An array over leading axes of this shape, which become one; `inner` axes stay."""
    own = value.shape[value.ndim - inner :]
    return jnp.broadcast_to(value, (*shape, *own)).reshape(math.prod(shape), *own)


def direction_of(angles: Float[Array, "... 2"]) -> Float[Array, "... 3"]:
    """Unit vectors with polar angle and azimuth."""
    theta, phi = angles[..., 0], angles[..., 1]
    s = jnp.sin(theta)
    return jnp.stack([s * jnp.cos(phi), s * jnp.sin(phi), jnp.cos(theta)], axis=-1)


def with_place(place: list[Array], *vectors: Array) -> Float[Array, "... numbers"]:
    """Spin, radius and inclination (...), followed by vectors (..., n), in one array."""
    shape = jnp.broadcast_shapes(*(x.shape for x in place), *(x.shape[:-1] for x in vectors))
    parts = [*(x[..., None] for x in place), *vectors]
    return jnp.concatenate([jnp.broadcast_to(x, (*shape, x.shape[-1])) for x in parts], axis=-1)


def parity_sign(index: Any, shape: tuple[int, ...]) -> Array:
    """The sign of det J of images of an index."""
    if isinstance(index, Tracer):
        return jnp.broadcast_to(1 - 2 * wide("index", index % 2), shape)
    # In numpy: what is constant stays so while JAX traces.
    number, _ = np.asarray(index), real_array("index", index)
    if not np.issubdtype(number.dtype, np.integer) or (number < 0).any():
        raise ValueError("Argument `index` must hold whole numbers of at least 0.")
    try:
        np.broadcast_shapes(number.shape, shape)
    except ValueError:
        raise ValueError(f"Argument `index` must have a shape that fits {shape}, but has {number.shape}.") from None
    return jnp.broadcast_to(1 - 2 * wide("index", number % 2), shape)
