"""Quantities read off a path step by step: the beam's area, the azimuth, and passages through zero."""

import math
from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp

from kerrcaustics.beams.ray_state import Path
from kerrcaustics.beams.vectors import cross, dot, with_small_turn
from kerrcaustics.spacetime.arrays import Flags, Reals
from kerrcaustics.spacetime.frame import Frame


def length(parts: Any) -> Reals:
    """Euclidean length of a vector given by its components."""
    return jnp.sqrt(sum(p * p for p in parts))


def first_azimuth(frame: Frame, rate: tuple[Reals, ...]) -> Reals:
    """Azimuth of m at the camera: 0, and on the spin axis the direction in which the ray leaves, by its rate there."""
    return jnp.where(frame.sin_theta == 0, jnp.arctan2(rate[2], rate[1]), 0.0)


def azimuth_step(b: Reals, before: tuple[Reals, ...], after: tuple[Reals, ...]) -> Reals:
    """Change of the azimuth of m over a step, which has the sign of -b and is less than a turn.

    Rays with b = 0 pass the spin axis as those of small positive b.
    """
    x, y = before[1:3]
    on_axis = (x == 0) & (y == 0)
    turn = jnp.arctan2(x * after[2] - y * after[1], x * after[1] + y * after[2])
    sense = jnp.where(b < 0, 1.0, -1.0)
    return jnp.where(on_axis, 0.0, jnp.where(sense * turn < -0.5, turn + 2 * math.pi * sense, turn))


def area(psi_rate: Reals, paths: Sequence[Path]) -> Reals:
    """Signed area of the beam: the determinant of the ray's direction and its two variations.

    In components of (u, the two directions along the sphere at the turned point); zero at conjugate points.
    Parameters: psi_rate, that of the ray; paths, the ray and its two variations.
    """
    m = paths[0].position[1:]
    speed = with_small_turn(m, paths[0].rate[1:], psi_rate)
    first, second = (with_small_turn(m, path.position[1:], path.psi) for path in paths[1:])
    # At the camera the variations themselves vanish: their rates span the beam.
    starting = (paths[1].position[0] == 0) & (dot(first, first) == 0)
    first = tuple(jnp.where(starting, r, d) for r, d in zip(paths[1].rate[1:], first, strict=True))
    second = tuple(jnp.where(starting, r, d) for r, d in zip(paths[2].rate[1:], second, strict=True))
    du = [jnp.where(starting, path.rate[0], path.position[0]) for path in paths[1:]]
    return (
        paths[0].rate[0] * dot(m, cross(first, second))
        + du[0] * dot(m, cross(second, speed))
        + du[1] * dot(m, cross(speed, first))
    )


def changed_sign(before: Reals, value: Reals) -> tuple[Flags, Reals]:
    """True if a quantity has passed through zero since its sign was `before`, and its new sign.

    A value of exactly zero keeps the sign it had: touching is not passing.
    """
    sign = jnp.sign(value)
    return sign * before < 0, jnp.where(sign == 0, before, sign)
