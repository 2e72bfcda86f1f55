"""Vectors of three components, each a number or an array of any kind."""

from typing import Any

from kerrcaustics.spacetime.arrays import Reals


def dot(p: Any, q: Any) -> Reals:
    """Scalar product of two vectors given by their components."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def cross(p: Any, q: Any) -> tuple[Reals, Reals, Reals]:
    """Vector product p x q."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def with_small_turn(m: Any, change: Any, angle: Reals) -> tuple[Reals, Reals, Reals]:
    """A change of m together with a turn about the spin axis by a small angle."""
    return change[0] - angle * m[1], change[1] + angle * m[0], change[2]
