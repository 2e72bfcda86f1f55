"""The lens map of a camera next to a line of sight, with its derivatives."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from kerrcaustics.beams.differentiable import differentiable, end, float64
from kerrcaustics.beams.moving import Moving
from kerrcaustics.spacetime.sphere import tangent_basis

Vector = Float[Array, "3"]
Function = Callable[[Array, Any], Array]
Both = Callable[[Array, Any], tuple[Array, Array]]


def unit(vector: Array) -> Array:
    """The vector scaled to length 1."""
    return vector / jnp.sqrt(jnp.sum(vector * vector))


def tangents(direction: Vector) -> Float[Array, "3 2"]:
    """Two orthonormal tangents of the sphere."""
    return jnp.stack(tangent_basis(direction, jnp), axis=-1)


def jacobian(
    place: Vector, sky: Vector, motion: Moving, *, timed: bool = False
) -> tuple[Array, Float[Array, "numbers 2"]]:
    """n' (and the time) of a line of sight, and its derivatives along `tangents` of the camera sky."""
    basis = tangents(sky)

    def arrival_at(shift: Array) -> tuple[Array, Array]:
        arrival = end(jnp.concatenate([place, unit(sky + basis @ shift)]), motion, timed=timed)
        return arrival, arrival

    columns, arrival = jax.jacfwd(arrival_at, has_aux=True)(jnp.zeros(2))
    return arrival, columns


def expansion(
    place: Vector, sky: Vector, motion: Moving, *, timed: bool = False
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """The values of `jacobian`, and the derivatives of both in spin, radius, inclination and along `tangents`."""
    basis = tangents(sky)

    def moved(numbers: Float[Array, "5"]) -> tuple[Any, Any]:
        def arrival_at(shift: Array) -> tuple[Array, Array]:
            direction = unit(sky + basis @ (numbers[3:] + shift))
            arrival = end(jnp.concatenate([numbers[:3], direction]), motion, timed=timed)
            return arrival, arrival

        columns, arrival = jax.jacfwd(arrival_at, has_aux=True)(jnp.zeros(2))
        return (arrival, columns), (arrival, columns)

    columns, values = jax.jacfwd(moved, has_aux=True)(jnp.concatenate([place, jnp.zeros(2)]))
    return values, columns


def determinant(arrival: Array, columns: Array) -> Array:
    """det J from n' and its derivatives."""
    return jnp.dot(arrival[:3], jnp.cross(columns[:3, 0], columns[:3, 1]))


def solved(matrix: Float[Array, "2 2"], target_step: Float[Array, "2 ..."]) -> Float[Array, "2 ..."]:
    """The solution of two linear equations."""
    (a, b), (c, d) = matrix
    return jnp.stack([d * target_step[0] - b * target_step[1], a * target_step[1] - c * target_step[0]]) / (
        a * d - b * c
    )


def with_columns(value: Function, both: Both) -> Function:
    """A function of an array and of settings; `both` returns its values and its first derivatives in the array.

    Derivatives are right in every mode and order.
    """

    @jax.custom_jvp
    def smooth(arguments: Array, settings: Any) -> Array:
        with float64():
            return value(arguments, settings)

    def flat(arguments: Array, settings: Any) -> Array:
        values, columns = both(arguments, settings)
        return jnp.concatenate([values, columns.ravel()])

    @smooth.defjvp
    def _slope(primals: tuple[Array, Any], given: tuple[Array, Any]) -> tuple[Array, Array]:
        with float64():
            numbers = differentiable(flat)(*primals)
            count = len(numbers) // (1 + len(primals[0]))
            columns = numbers[count:].reshape(count, -1)
            # Not a product of matrices, whose transpose would be made under the caller's settings.
            return numbers[:count], jnp.sum(columns * given[0], axis=-1)

    return smooth


def smooth(function: Function) -> Function:
    """`with_columns` for a function that returns a vector; derivatives are taken forward, together with its values."""

    def values_twice(arguments: Array, settings: Any) -> tuple[Array, Array]:
        def twice(arguments: Array) -> tuple[Array, Array]:
            values = function(arguments, settings)
            return values, values

        return jax.jacfwd(twice, has_aux=True)(arguments)[::-1]

    return with_columns(function, values_twice)
