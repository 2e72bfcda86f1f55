"""Calls of the compiled engines: batches of a few fixed sizes, many rays on the first device and few on a CPU."""

from functools import cache, lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.closed_form import formula
from kerrcaustics.beams.compile_cache import Device, Program, small_job_device
from kerrcaustics.beams.ends import End
from kerrcaustics.beams.integrator import integrated
from kerrcaustics.beams.ray_end import RayEnd, Wanted
from kerrcaustics.beams.surface import Columns
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, photon_of
from kerrcaustics.spacetime.settings import own_settings
from kerrcaustics.spacetime.viewer import Viewer

# On a CPU: (rays in one call of the integrator, rays that run side by side in it). Those should fit in the cache, and
# run as long as the slowest of them.
_BATCH = (512, 128)
# Rays in one call of the closed form, for few rays and for many; of many, rays or beams at a time in _LANES. Programs
# are compiled at their first use, in seconds: so with times, those of a track are still few.
_CLOSED_FORM_CALL = (128, 2048)
_FEW_WITH_TIMES = 2048
_LANES = (2048, 512)
# On an accelerator: the fewest rays for which it is used, where a CPU would take as long; rays in one call, all side by
# side, of the closed form, for fewer and for more, and of the integrator. XLA compiles programs for some thousand rays
# that take fifty times as long as these.
_WORTH, _FEWER, _MOST, INTEGRATED = 1 << 16, 1 << 18, 1 << 20, 1 << 16
# Memory (bytes) that a beam may take there, where the program of the closed form needs 2,600 without fused loops; and
# what is assumed of a device that does not report its memory.
_BYTES_PER_RAY, _MEMORY = 1 << 12, 1 << 31


def _integrated(
    frame: Frame, sky: Components, refinement: Reals, tolerance: Reals, end: End, *, wanted: Wanted, lanes: int
) -> RayEnd[Reals | Flags]:
    """The rays of a call, `lanes` at a time, so that slow rays hold up few others."""
    columns, with_columns = end.by_ray()
    split = jax.tree.map(lambda values: values.reshape(-1, lanes), (sky, refinement, columns))

    def part(rays: tuple[Components, Reals, Columns]) -> RayEnd[Reals | Flags]:
        some, finer, own = rays
        return integrated.trace(frame, some, finer, tolerance, with_columns(own), wanted)

    ends = jax.lax.map(part, split)
    return jax.tree.map(lambda values: values.reshape(-1, *values.shape[2:]), ends)


_traced = jax.jit(formula.trace, static_argnames=("wanted", "on_equator", "short"))


def _in_parts(
    frame: Frame, sky: Components, real: Reals, end: End, *, lanes: int, **options: Any
) -> RayEnd[Reals | Flags]:
    """The rays of a call, `lanes` at a time, without the parts that hold no `real` rays."""
    count = jnp.shape(real)[0]
    if lanes >= count:
        return formula.trace(frame, sky, end, **options)

    columns, with_columns = end.by_ray()

    def part(start: Reals) -> RayEnd[Reals | Flags]:
        some, own = jax.tree.map(
            lambda values: jax.lax.dynamic_slice(jnp.asarray(values), (start,), (lanes,)), (sky, columns)
        )
        return _traced(frame, some, with_columns(own), **options)

    def stored(i: Reals, ends: RayEnd[Reals | Flags]) -> RayEnd[Reals | Flags]:
        start = i * lanes
        return jax.tree.map(lambda e, p: jax.lax.dynamic_update_slice_in_dim(e, p, start, 0), ends, part(start))

    shapes = jax.eval_shape(part, 0)
    room = jax.tree.map(lambda s: jnp.zeros((count, *s.shape[1:]), s.dtype), shapes)
    parts = (jnp.count_nonzero(real) + lanes - 1) // lanes
    return jax.lax.fori_loop(0, parts, stored, room)


def _aims(frame: Frame, sky: Components, end: End) -> tuple[Flags, Flags, Flags]:
    aim = integrated.aim_at(end, frame, photon_of(frame, sky))
    return aim.lost, aim.captured, aim.certain


_closed_form = Program(_in_parts)
_integrate, _survey, _prospects = Program(_integrated, fused=True), Program(integrated.survey), Program(_aims)


@lru_cache(maxsize=64)
def frame_on(device: Device, camera: Viewer) -> Frame:
    """The camera's frame, sent to a device once for all calls."""
    return jax.device_put(camera.frame(), device)


@own_settings()
def closed_form(
    camera: Viewer, sky: np.ndarray, end: End, wanted: Wanted, *, short: bool = False, many: bool = False
) -> RayEnd[np.ndarray]:
    """The closed form of rays; short: by the formulas for small k; many: they are part of a large job."""
    device, on_equator = device_of(len(sky)), camera.on_equator and not short
    frame = frame_on(device, camera)
    # The formulas for small k are never taken for many rays.
    few = short or (wanted.time and len(sky) <= _FEW_WITH_TIMES)
    size, lanes = closed_form_size(len(sky), wanted.beams, many=many, few=few)

    def kernel(sky: Components, end: End, real: Reals) -> RayEnd[Reals | Flags]:
        options = {"wanted": wanted, "on_equator": on_equator, "short": short, "lanes": lanes}
        return _closed_form(frame, sky, real, end, on=device, **options)

    return _batched(kernel, [sky, np.ones(len(sky))], end, size)


@own_settings()
def prospects(camera: Viewer, sky: np.ndarray, end: End) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flags of rays that do not reach their end, that fall in when followed on, and for which both are certain."""
    device, (size, _) = device_of(len(sky)), closed_form_size(len(sky), beams=False)
    frame = frame_on(device, camera)
    return _batched(lambda sky, end: _prospects(frame, sky, end, on=device), [sky], end, size)


@own_settings()
def work(camera: Viewer, sky: np.ndarray, end: End) -> np.ndarray:
    """An estimate of the work of the integrator on each ray."""
    device, (size, _) = device_of(len(sky)), integrator_size(len(sky))
    frame = frame_on(device, camera)
    return _batched(lambda sky, end: _survey(frame, sky, end, on=device), [sky], end, size)


@own_settings()
def integrate(
    camera: Viewer, sky: np.ndarray, refinement: np.ndarray, tolerance: float, end: End, wanted: Wanted
) -> RayEnd[np.ndarray]:
    """Rays integrated once, each with its steps shorter by its refinement; batches should hold rays of similar work."""
    device, (size, lanes) = device_of(len(sky)), integrator_size(len(sky))
    frame = frame_on(device, camera)

    def kernel(sky: Components, end: End, refinement: Reals) -> RayEnd[Reals | Flags]:
        return _integrate(frame, sky, refinement, tolerance, end, on=device, wanted=wanted, lanes=lanes)

    return _batched(kernel, [sky, refinement], end, size)


def on_accelerator(count: int) -> bool:
    """True if the first device is no CPU, and takes so many rays: all side by side, in few large batches."""
    return count >= _WORTH and jax.devices()[0].platform != "cpu"


def device_of(count: int) -> Device:
    """The device that takes so many rays."""
    return jax.devices()[0] if on_accelerator(count) else small_job_device()


@cache
def most_on_accelerator() -> int:
    """The most rays in one call on an accelerator, by half of its memory."""
    room, size = (jax.devices()[0].memory_stats() or {}).get("bytes_limit", _MEMORY) // 2, _MOST
    while size > _WORTH and size * _BYTES_PER_RAY > room:
        size //= 4
    return size


def closed_form_size(count: int, beams: bool, *, many: bool = False, few: bool = False) -> tuple[int, int]:
    """The number of rays in a call, and at a time; many: the job has more rays than are counted here; few: or none."""
    if on_accelerator(count):
        size = min(_FEWER if count <= _FEWER else _MOST, most_on_accelerator())
        return size, size
    small, large = _CLOSED_FORM_CALL
    return (large, _LANES[beams]) if many or (count > small and not few) else (small, small)


def integrator_size(count: int) -> tuple[int, int]:
    """The number of rays in a call, and side by side."""
    return (INTEGRATED, INTEGRATED) if on_accelerator(count) else _BATCH


def _batched(function: Any, arrays: list[np.ndarray], end: End, size: int) -> Any:
    """`function` of sky directions, their end (and more arrays), over calls of one size; the last is filled up."""
    count = len(arrays[0])
    columns, with_columns = end.by_ray()
    if count == 0:
        arrays = [np.ones((1, *a.shape[1:])) for a in arrays]
        columns = [np.ones(1, c.dtype) for c in columns]
    results = []
    for start in range(0, max(count, 1), size):
        sky, *extra_arrays = (a[start : start + size] for a in arrays)
        own = [c[start : start + size] for c in columns]
        missing = size - len(sky)
        if missing:
            # Rays with no refinement take one step: filling up costs next to nothing.
            sky, *own = (np.concatenate([a, np.repeat(a[:1], missing, axis=0)]) for a in (sky, *own))
            extra_arrays = [np.concatenate([o, np.zeros(missing)]) for o in extra_arrays]
        results.append(function(tuple(sky.T), with_columns(own), *extra_arrays))
    if on_accelerator(count):
        # One wait for all arrays, in place of one for each.
        results = jax.device_get(results)
    return jax.tree.map(lambda *parts: _on_host(parts, count), *results)


def _on_host(parts: tuple[jax.Array | np.ndarray, ...], count: int) -> np.ndarray:
    """The first numbers of arrays on the device, joined in one array that can be written to."""
    *whole, last = (np.asarray(part) for part in parts)
    rest = count - sum(map(len, whole))
    return np.concatenate([*whole, last[:rest]]) if whole else last[:rest].copy()
