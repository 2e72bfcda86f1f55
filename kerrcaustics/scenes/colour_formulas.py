"""Colours of black bodies, as a JAX function of one temperature: a kernel is made of it."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import Number, Program
from kerrcaustics.beams.kernels.tables import Table, table_row


class Colours(NamedTuple):
    """Colours of black bodies by temperature.

    first, last: logarithms of the lowest and the highest temperature, kelvin.
    steps: number of equal steps between them.
    white: (3,) logarithms of the light that becomes 1.
    table: (steps + 1, 3) logarithms of light.
    """

    first: Any
    last: Any
    steps: Any
    white: Any
    table: Any


def black_body_light(colours: Colours, kelvin: Any) -> Any:
    """Light (3,) of a black body; its logarithm is linear between temperatures of the table; NaN for NaN."""
    place = (jnp.log(kelvin) - colours.first) / (colours.last - colours.first)
    place = jnp.minimum(jnp.maximum(place, 0.0), 1.0) * colours.steps
    number = jnp.minimum(jnp.floor(place), colours.steps - 1)
    below, above = table_row(colours.table, number), table_row(colours.table, number + 1)
    light = jnp.exp(below + (place - number) * (above - below) - jnp.stack(colours.white))
    return jnp.where(jnp.isnan(kelvin), jnp.nan, light)


# Kinds of numbers in the signatures of kernels.
_ONE: Any = Number.OF_CALL
_EACH: Any = Number.OF_RAY


def programs() -> dict[str, Program]:
    """The kernel of colours by its name."""
    colours = Colours(_ONE, _ONE, _ONE, (_ONE,) * 3, Table(3))
    return {"black_body": Program(black_body_light, (colours, _EACH))}
