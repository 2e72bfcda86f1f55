"""Results of the engines in functions that JAX traces."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.ray_end import RayEnd
from kerrcaustics.spacetime.arrays import Flags, Reals

jax.tree_util.register_dataclass(RayEnd)


def status_of(lost: Flags, captured: Flags) -> Reals:
    """The status of rays from the flags of those that do not reach their end, and of those that would fall in."""
    return jnp.where(lost, jnp.where(captured, Status.CAPTURED, Status.MISSED), Status.ESCAPED).astype(jnp.int8)


def stacked(rows: tuple[Any, ...], hidden: Reals) -> Float[Array, "..."]:
    """Components, or rows of them, along the last axes, with `hidden` added to each."""
    if isinstance(rows[0], tuple):
        return jnp.stack([stacked(row, hidden) for row in rows], axis=-2)
    return jnp.stack([part + hidden for part in rows], axis=-1)
