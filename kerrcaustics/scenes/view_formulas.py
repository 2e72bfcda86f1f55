"""Projections of views, as JAX functions of one place of a picture: kernels are made of them (beams/kernels)."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import Number, Program


class Plane(NamedTuple):
    """A view: its middle (x, y), its pixel as `View` has it, and its axes (forward, right, up)."""

    middle: Any
    pixel: Any
    axes: Any


def directions(projection: Callable[[Any, Any], Any], plane: Plane, x: Any, y: Any) -> tuple[Any, Any]:
    """The direction N (3,) of a place of a picture, and its steps (3, 2) per pixel along x and y."""
    local, to_right, to_up = projection((x - plane.middle[0]) * plane.pixel, (plane.middle[1] - y) * plane.pixel)
    axes = [jnp.stack(axis) for axis in plane.axes]
    sky, along_x, up = (
        sum(part * axis for part, axis in zip(parts, axes, strict=True)) for parts in (local, to_right, to_up)
    )
    return sky, jnp.stack([along_x, -up], axis=-1) * plane.pixel


def _pinhole(across: Any, above: Any) -> Any:
    """Directions in (forward, right, up), and their derivatives along right and up, at tangents of angles."""
    shrunk = 1 / jnp.sqrt(1 + across**2 + above**2)
    n = shrunk, across * shrunk, above * shrunk
    unit = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    return n, *([(one - part * n[k]) * shrunk for one, part in zip(unit[k - 1], n, strict=True)] for k in (1, 2))


def _fisheye(across: Any, above: Any) -> Any:
    """The same at angles from the centre: N = cos(rho) forward + sin(rho)/rho (across, above)."""
    square = across**2 + above**2
    rho = jnp.sqrt(square)
    sinc = jnp.where(rho > 0, jnp.sin(rho) / rho, 1.0)
    # (cos(rho) - sin(rho)/rho) / rho^2, by its series where it would cancel.
    slope = jnp.where(square < 1e-4, -1 / 3 + square / 30, (jnp.cos(rho) - sinc) / square)
    mixed = slope * across * above
    to_right = -sinc * across, sinc + slope * across**2, mixed
    to_up = -sinc * above, mixed, sinc + slope * above**2
    return (jnp.cos(rho), sinc * across, sinc * above), to_right, to_up


def _equirectangular(across: Any, above: Any) -> Any:
    """The same at longitude and latitude."""
    (c, s), (cos, sin) = ((jnp.cos(angle), jnp.sin(angle)) for angle in (above, across))
    return (c * cos, c * sin, s), (-c * sin, c * cos, 0.0), (-s * cos, -s * sin, c)


# They stand where functions have numbers.
_ONE: Any = Number.OF_CALL
_EACH: Any = Number.OF_RAY


def programs() -> dict[str, Program]:
    """The kernels of views by their names."""
    plane = Plane((_ONE,) * 2, _ONE, ((_ONE,) * 3,) * 3)
    projections = {"pinhole": _pinhole, "fisheye": _fisheye, "equirectangular": _equirectangular}
    return {
        f"view_{name}": Program(partial(directions, projection), (plane, _EACH, _EACH))
        for name, projection in projections.items()
    }
