"""Sums and integrals of waves as JAX functions of one frequency: kernels are made of them (beams/kernels)."""

import math
from typing import Any

import jax
import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import Number, Program
from kerrcaustics.beams.kernels.tables import Table, table_row


def phase_sums(count: Any, omega: Any, nodes: Any) -> Any:
    """Sums over nodes of two amplitudes times exp(i omega phase): real and imaginary part of each.

    nodes: a table with a phase and both amplitudes in a row, and so many rows.
    """

    def turn(now: tuple[Any, ...]) -> tuple[Any, ...]:
        number, *sums = now
        phase, *bright = table_row(nodes, number)
        angle = _within_turn(omega * phase)
        wave = jnp.cos(angle), jnp.sin(angle)
        parts = [amplitude * part for amplitude in bright for part in wave]
        return number + 1, *(total + part for total, part in zip(sums, parts, strict=True))

    # All of it depends on the frequency.
    blank = 0.0 * omega
    return jax.lax.while_loop(lambda now: now[0] < count, turn, (blank,) * 5)[1:]


def moments(count: Any, x: Any, y: Any, nodes: Any) -> Any:
    """Sums over nodes t of 1, t and t^2 times exp(i (t^4 + x t^2 + y t)), and the largest logarithm of a term.

    nodes: a table with real and imaginary part of t, t^2 and t^4 in a row, and so many rows.
    """

    def turn(now: tuple[Any, ...]) -> tuple[Any, ...]:
        number, largest, *sums = now
        real_1, imaginary_1, real_2, imaginary_2, real_4, imaginary_4 = table_row(nodes, number)
        size = -(imaginary_4 + x * imaginary_2 + y * imaginary_1)
        angle = _within_turn(real_4 + x * real_2 + y * real_1)
        bright = jnp.exp(size)
        one = bright * jnp.cos(angle), bright * jnp.sin(angle)
        parts = [*one, *_product(one, (real_1, imaginary_1)), *_product(one, (real_2, imaginary_2))]
        sums = [total + part for total, part in zip(sums, parts, strict=True)]
        return number + 1, jnp.maximum(largest, size), *sums

    # All of it depends on the numbers.
    blank = 0.0 * (x + y)
    return jax.lax.while_loop(lambda now: now[0] < count, turn, (blank, blank - math.inf, *[blank] * 6))[1:]


def _product(one: tuple[Any, Any], other: tuple[Any, Any]) -> tuple[Any, Any]:
    return one[0] * other[0] - one[1] * other[1], one[0] * other[1] + one[1] * other[0]


def _within_turn(angle: Any) -> Any:
    """An angle less whole turns, good to its own round-off."""
    return angle - 2 * math.pi * jnp.floor(angle / (2 * math.pi) + 0.5)


def programs() -> dict[str, Program]:
    """The kernels by their names."""
    one, each = Number.OF_CALL, Number.OF_RAY
    return {
        "phase_sums": Program(phase_sums, (one, each, Table(3))),
        "moments": Program(moments, (one, each, each, Table(6))),
    }
