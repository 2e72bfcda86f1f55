"""Directions of places of pictures and charts, and their steps per pixel, as JAX functions of one place: for kernels.

Directions are N (3,) on the viewer's sky, steps (3, 2) along x and y.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import FRAME, Number, Program
from kerrcaustics.spacetime.frame import Frame, doppler

_Local = tuple[Any, Any, Any]


class PixelGrid(NamedTuple):
    """Pixels of a view.

    axes: the axes forward, right and up, each (3,).
    step: step between pixels: radians, for a pinhole their tangent.
    middle: (2,) place of the middle of the picture, pixels.
    """

    axes: Any
    step: Any
    middle: Any


class EdgeGrid(NamedTuple):
    """Pixels of an edge chart.

    round: number of pixels round the hole.
    fine: number of pixels in an e-folding of the distance to the shadow edge.
    first: e-foldings at the border to the other chart.
    """

    round: Any
    fine: Any
    first: Any


def pinhole(across: Any, above: Any) -> _Local:
    """Directions (3,) along forward, right and up, and their derivatives along right and up, at tangents of angles."""
    length = jnp.sqrt(1 + across * across + above * above)
    n = jnp.stack([1 / length, across / length, above / length])
    to_right = (jnp.array([0.0, 1.0, 0.0]) - n * n[1]) / length
    return n, to_right, (jnp.array([0.0, 0.0, 1.0]) - n * n[2]) / length


def fisheye(across: Any, above: Any) -> _Local:
    """Directions as by `pinhole` at angles from the centre: N = cos(rho) forward + sin(rho)/rho (across, above)."""
    square = across * across + above * above
    is_near_centre = square < 1e-4
    rho, cos = jnp.sqrt(jnp.where(is_near_centre, 1.0, square)), jnp.cos(jnp.sqrt(square))
    # A series near the centre, where the quotients lose digits or are undefined.
    sinc = jnp.where(is_near_centre, 1 - square / 6 + square * square / 120, jnp.sin(rho) / rho)
    slope = jnp.where(is_near_centre, -1 / 3 + square / 30, (cos - sinc) / (rho * rho))
    mixed = slope * across * above
    n = jnp.stack([cos, sinc * across, sinc * above])
    to_right = jnp.stack([-sinc * across, sinc + slope * across * across, mixed])
    return n, to_right, jnp.stack([-sinc * above, mixed, sinc + slope * above * above])


def equirectangular(across: Any, above: Any) -> _Local:
    """Directions as by `pinhole` at longitude and latitude."""
    c, s, cos, sin = jnp.cos(above), jnp.sin(above), jnp.cos(across), jnp.sin(across)
    return (
        jnp.stack([c * cos, c * sin, s]),
        jnp.stack([-c * sin, c * cos, 0 * s]),
        jnp.stack([-s * cos, -s * sin, c]),
    )


def view_direction(projection: Callable[[Any, Any], _Local], pixels: PixelGrid, x: Any, y: Any) -> tuple[Any, Any]:
    """The direction of a place of a view, and its steps."""
    across, above = (x - pixels.middle[0]) * pixels.step, (pixels.middle[1] - y) * pixels.step
    axes = jnp.stack([jnp.stack(axis) for axis in pixels.axes])
    n, to_right, to_up = (part @ axes for part in projection(across, above))
    return n, jnp.stack([to_right, -to_up], axis=-1) * pixels.step


def beside_edge(frame: Frame, edge: EdgeGrid, x: Any, y: Any, size: Any, slope: Any) -> tuple[Any, Any]:
    """The direction of a place of an edge chart, and its steps.

    size, slope: angular radius of the shadow at this angle round the hole, and its derivative.
    """
    per_column = 2 * math.pi / edge.round
    angle, part = (x + 0.5) * per_column, jnp.exp(-edge.first - (y + 0.5) / edge.fine)
    beyond = (math.pi - size) * part
    distance = size + beyond
    c, s, cos, sin = jnp.cos(distance), jnp.sin(distance), jnp.cos(angle), jnp.sin(angle)
    outward = jnp.stack([s, c * cos, c * sin])
    around = jnp.stack([0 * s, -s * sin, s * cos])
    turn = (outward * (slope * (1 - part)) + around) * per_column
    steps = jnp.stack([turn, -outward * (beyond / edge.fine)], axis=-1)
    return aberrated(frame, (-c, s * cos, s * sin), steps)


def aberrated(frame: Frame, line_of_sight: Any, steps: Any) -> tuple[Any, Any]:
    """The direction for a camera where the fiducial observer has (r, theta, phi), and its steps (3, 2) from theirs."""
    basis = jnp.stack([jnp.stack(row) for row in frame.basis])
    along, change = -(basis @ jnp.stack(line_of_sight)), -(basis @ steps)
    boost, aberration = doppler(frame, (along[0], along[1], along[2]))
    shrink = -jnp.sqrt(frame.slowness)
    # The boost is the denominator of N.
    n = jnp.stack([shrink * along[0], aberration, shrink * along[2]]) / boost
    over = jnp.stack([shrink * change[0], -change[1], shrink * change[2]])
    steps = (over + n[:, None] * (frame.speed * change[1])) / boost
    return n / jnp.sqrt((n * n).sum()), steps


def programs() -> dict[str, Program]:
    """The kernels by their names."""
    one: Any = Number.OF_CALL
    each: Any = Number.OF_RAY
    pixels, edge = PixelGrid(((one,) * 3,) * 3, one, (one, one)), EdgeGrid(one, one, one)
    kernels = {
        f"view_{projection.__name__}": Program(partial(view_direction, projection), (pixels, each, each))
        for projection in (pinhole, fisheye, equirectangular)
    }
    kernels["beside_edge"] = Program(beside_edge, (FRAME, edge, each, each, each, each))
    kernels["aberrated"] = Program(
        lambda frame, line, *steps: aberrated(frame, line, jnp.stack(steps).reshape(3, 2)),
        (FRAME, (each,) * 3, *(each,) * 6),
    )
    return kernels
