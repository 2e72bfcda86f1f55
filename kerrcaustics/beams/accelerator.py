"""Rays on a GPU: the formulas as JAX compiles them, in few large calls.

Nothing needs a GPU, and JAX is loaded when one is used. The functions have the signatures of those in calls.py, whose
kernels they take the place of; tests compare the two, on a CPU too.
"""

from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.beams.ray_end import RayEnd, Wanted
from kerrcaustics.spacetime.viewer import Viewer

MOST_INTEGRATED = 1 << 16
"""Rays in one call of the integrator."""

# The fewest rays for which a GPU is used; rays in one call of the closed form, for fewer and for more. XLA compiles
# programs for some thousand rays that take fifty times as long as these.
_WORTH, _FEWER, _MOST = 1 << 16, 1 << 18, 1 << 20
# Memory (bytes) that a beam may take there, where the program of the closed form needs 2,600 without fused loops; and
# what is assumed of a device that does not report its memory.
_BYTES_PER_RAY, _MEMORY = 1 << 12, 1 << 31


def on_accelerator(count: int) -> bool:
    """True if so many rays go to a GPU: there is one, JAX can use it, and it pays."""
    return count >= _WORTH and name_of_device() is not None


@cache
def name_of_device() -> str | None:
    """The GPU that JAX can use, in words; None without one."""
    # Plug-ins of JAX for devices are parts of this package: without one JAX need not be loaded to know.
    if find_spec("jax_plugins") is None:
        return None
    import jax

    first = jax.devices()[0]
    return None if first.platform == "cpu" else f"{first.platform}: {first.device_kind}"


@cache
def most_on_accelerator() -> int:
    """The most rays in one call on an accelerator, by half of its memory."""
    import jax

    room, size = (jax.devices()[0].memory_stats() or {}).get("bytes_limit", _MEMORY) // 2, _MOST
    while size > _WORTH and size * _BYTES_PER_RAY > room:
        size //= 4
    return size


def closed_form(
    camera: Viewer, sky: np.ndarray, end: End, wanted: Wanted, *, short: bool = False
) -> RayEnd[np.ndarray]:
    """The closed form of rays; short: by the formulas for small k."""
    from kerrcaustics.beams.closed_form import formula

    size = min(_FEWER if len(sky) <= _FEWER else _MOST, most_on_accelerator())
    options = {"wanted": wanted, "on_equator": camera.on_equator and not short, "short": short}
    return _in_calls(formula.trace, camera, [sky], end, size, **options)


def prospects(camera: Viewer, sky: np.ndarray, end: End) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flags of rays that do not reach their end, that fall in when followed on, and for which both are certain."""
    from kerrcaustics.beams.integrator import integrated

    return _in_calls(integrated.prospects, camera, [sky], end, most_on_accelerator())


def work(camera: Viewer, sky: np.ndarray, end: End) -> np.ndarray:
    """An estimate of the work of the integrator on each ray."""
    from kerrcaustics.beams.integrator import integrated

    return _in_calls(integrated.survey, camera, [sky], end, most_on_accelerator())


def integrate(
    camera: Viewer, sky: np.ndarray, refinement: np.ndarray, tolerance: float, end: End, wanted: Wanted
) -> RayEnd[np.ndarray]:
    """Rays integrated once, each with its steps shorter by its refinement; calls should hold rays of similar work."""
    from kerrcaustics.beams.integrator import integrated

    return _in_calls(integrated.trace, camera, [sky, refinement], end, MOST_INTEGRATED, tolerance, wanted=wanted)


def _in_calls(
    function: Callable[..., Any],
    camera: Viewer,
    arrays: list[np.ndarray],
    end: End,
    size: int,
    *more: Any,
    **static: Any,
) -> Any:
    """A function of the frame, of arrays of rays, of more numbers and of the end, over calls of one size.

    The last call is filled up, with rays of no refinement, which take one step.
    """
    import jax

    from kerrcaustics.beams.traced_ends import traced
    from kerrcaustics.spacetime.settings import own_settings

    count, results = len(arrays[0]), []
    with own_settings():
        program = compiled(function, tuple(static.items()))
        for start in range(0, max(count, 1), size):
            chosen = slice(start, start + size)
            sky, *rest = (_padded(values[chosen], size) for values in arrays)
            there = end.rows(np.resize(np.arange(count)[chosen], size) if count else np.zeros(0, int))
            results.append(program(camera.frame(), tuple(sky.T), *rest, *more, traced(there)))
        # One wait for all arrays, in place of one for each.
        results = jax.device_get(results)
        return jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *results)


def _padded(values: np.ndarray, size: int) -> np.ndarray:
    missing = size - len(values)
    if not missing:
        return values
    if values.ndim == 1:
        return np.concatenate([values, np.zeros(missing)])
    return np.concatenate([values, np.repeat(values[:1] if len(values) else np.eye(3)[:1], missing, axis=0)])


@cache
def compiled(function: Callable[..., Any], static: tuple[tuple[str, Any], ...]) -> Callable[..., Any]:
    """A function with some arguments fixed, as JAX compiles it."""
    import jax

    return jax.jit(lambda *arguments: function(*arguments, **dict(static)), compiler_options=compiler_options())


def compiler_options() -> dict[str, Any] | None:
    """Options with which XLA compiles formulas.

    On a CPU, one loop for each operation compiles in half the time, and runs faster: fused loops repeat what they
    share.
    """
    import jax

    return {"xla_disable_hlo_passes": "fusion,small-while-loop-hoisting"} if jax.default_backend() == "cpu" else None
