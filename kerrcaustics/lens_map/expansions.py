"""Rays with their derivatives by the viewer's place and sky, on any surface, for implicit differentiation."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from kerrcaustics.beams.accelerator import compiler_options
from kerrcaustics.beams.ends import End
from kerrcaustics.beams.moving import Moving, motion_of
from kerrcaustics.beams.ray_state import DENSEST
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

REFINED = 1e-15
"""Distance of refined points from critical curves, relative to their place on the sky."""

# Steps per radian of arc that leave round-off alone, and fewer, for an error of those.
_DENSE, _SPARSE = DENSEST, 0.8 * DENSEST
# Numbers of a viewer's place, as the compiled function takes them.
_OF_VIEWER = ("spin", "radius", "inclination")
# Rays in one call of the compiled program.
_BATCH = 32
# Rounding of a place on the sky, relative to its size.
_ROUNDING = 2.3e-16


@dataclass(frozen=True)
class Expansion:
    """Ends of rays: place (three rows), time and det J, with their derivatives.

    given: by the numbers of the viewer's place; sky: along two tangents of the viewer's sky.
    """

    values: Float[Array, "rays 5"]
    given: Float[Array, "rays 5 numbers"]
    sky: Float[Array, "rays 5 2"]


def expanded(
    camera: Viewer,
    surface: End,
    sky: Float[Array, "rays axes"],
    density: float,
    second_arrival: Bool[Array, " rays"],
) -> Expansion:
    """The ends of rays on their leaves."""
    numbers = 3 + sky.shape[1]
    values, slopes = np.empty((len(sky), 5)), np.empty((len(sky), 5, numbers))
    frame = camera.frame()
    place = np.broadcast_to([camera.spin, frame.radius, camera.inclination], (len(sky), 3))
    given = np.concatenate([place, sky], axis=-1)
    for leaf in np.unique(second_arrival).tolist():
        on_leaf, end = second_arrival == leaf, surface.at_second_arrival() if leaf else surface
        values[on_leaf], slopes[on_leaf] = _in_batches(given[on_leaf], motion_of(camera.velocity), end.bare(), density)
    kept = [_OF_VIEWER.index(name) for name in camera.parameters]
    return Expansion(values, slopes[..., kept], slopes[..., 3:] @ camera.tangents(sky))


def _in_batches(
    given: Float[Array, "rays numbers"], motion: Moving, surface: End, density: float
) -> tuple[Array, Array]:
    """Values and slopes of rays, in batches of one size."""
    parts = []
    for start in range(0, len(given), _BATCH):
        part = given[start : start + _BATCH]
        filled = np.concatenate([part, np.repeat(part[:1], _BATCH - len(part), axis=0)])
        parts.append([batch[: len(part)] for batch in _batch(filled, motion, surface, density)])
    values, slopes = (np.concatenate(column) for column in zip(*parts, strict=True))
    # The derivatives of what is lost are those of a constant.
    slopes[~np.isfinite(values).all(axis=1)] = np.nan
    return values, slopes


def _batch(given: Float[Array, "rays numbers"], motion: Moving, surface: End, density: float) -> tuple[Array, Array]:
    # JAX is loaded for derivatives alone.
    from kerrcaustics.beams.traced_ends import traced_end
    from kerrcaustics.spacetime.settings import own_settings

    with own_settings():
        values, slopes = _compiled()(given, motion, traced_end(surface), density)
        return np.array(values), np.array(slopes)


@cache
def _compiled() -> Callable[..., Any]:
    import jax

    from kerrcaustics.beams.differentiable import expansion
    from kerrcaustics.beams.program_cache import prepare_compilation

    prepare_compilation()
    return jax.jit(expansion, compiler_options=compiler_options())


def with_errors(
    evaluated: Callable[[Array, Array, float], tuple[Array, ...]],
    camera: Viewer,
    sky: Float[Array, "n axes"],
    error: Float[Array, " n"],
) -> tuple[tuple[Array, ...], Float[Array, "n kinds"]]:
    """Values at places on the sky, and their errors relative to their largest, one for each kind of values.

    evaluated: the kinds of values (n, ...) at places, of which it is given the numbers too, by a density of steps. The
    errors are what they change by in fewer steps, and where places lie off by their errors, or by rounding.
    """
    step, tangents = np.maximum(error, _ROUNDING * np.linalg.norm(sky, axis=1)), camera.tangents(sky)
    places = [sky, *(sky + step[:, None] * tangents[..., i] for i in range(2))]
    number = np.arange(len(sky))
    dense = [np.split(values, 3) for values in evaluated(np.concatenate(places), np.tile(number, 3), _DENSE)]
    sparse = evaluated(sky, number, _SPARSE)
    values = tuple(first for first, *_ in dense)
    estimates = [[*more, less] for (_, *more), less in zip(dense, sparse, strict=True)]
    errors = [
        sum(_relative(second - first, first) for second in more) for first, more in zip(values, estimates, strict=True)
    ]
    return values, np.stack(errors, axis=-1)


def source_parameters(surface: End) -> tuple[str, ...]:
    """Names of the coordinates of sources on a surface: a radius is another one than the viewer's."""
    names = [coordinate.name for coordinate in surface.coordinates]
    return tuple(f"source_{name}" if name in _OF_VIEWER else name for name in names)


def inverse(columns: Float[Array, "n axes 2"]) -> Float[Array, "n 2 axes"]:
    """Inverses on the surface of matrices of two tangents; NaN where a ray is lost."""
    known = np.isfinite(columns).all(axis=(1, 2))
    inverses = np.full(columns.swapaxes(1, 2).shape, np.nan)
    inverses[known] = np.linalg.pinv(columns[known])
    return inverses


def _relative(change: Array, values: Array) -> Array:
    """The size of a change (n, ...), relative to the values."""
    rows = tuple(range(1, values.ndim))
    return np.abs(change).max(axis=rows) / np.abs(values).max(axis=rows)
