"""Tracing rays and beams: engine, batches, cores, device and retries are decided here, once."""

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, lru_cache, partial
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Beams, Rays, Status
from kerrcaustics.beams.closed_form import formula, small_k
from kerrcaustics.beams.ends import End, Goal, goal_of, prospects, redshift_at_end
from kerrcaustics.beams.integrator import integrated
from kerrcaustics.spacetime.camera import Camera, Frame, check_camera, photon

ENGINES = ("auto", "closed-form", "integrated")

# (rays in one call of the integrator, rays that run side by side in it). On a CPU those should fit in the cache, and
# run as long as the slowest of them. A GPU wants one large batch.
_BATCH = {"cpu": (512, 128)}
_LARGE_BATCH = (1 << 16, 1 << 16)
# Rays in one call of the closed form, for few rays and for many, each compiled when first met; and options for the
# compiler. On a CPU, fused loops would compute what they share again and again: one loop for each operation, over
# arrays that stay in the cache, takes a third of the time.
_CLOSED_FORM_CALL = {"cpu": (512, 2048)}
_LARGE_CALL = (1 << 20, 1 << 20)
_CLOSED_FORM_COMPILER = {"cpu": {"xla_disable_hlo_passes": "fusion"}}
# Rays that are checked, traced and stored together: memory beside input and result is what these need.
_BLOCK = 1 << 15
# So many rays are a large job.
_MANY = 1 << 15
_MAX_ROUNDS = 5
# The integrator is asked where this part of an error, or more, is round-off that it does not share: it gains a digit.
_MOSTLY = 0.9
# Square of a length that is 1 but for rounding: dividing by it could move a ray close to the shadow edge.
_UNIT = 1e-15

Fields = dict[str, np.ndarray]

_survey = jax.jit(integrated.survey)
_prospects = jax.jit(prospects)


@partial(jax.jit, static_argnames=("lanes", "beams", "index", "crossings", "time"))
def _integrate(
    frame: Frame,
    sky: tuple[jax.Array, ...],
    refinement: jax.Array,
    tolerance: float,
    goal: Goal,
    *,
    lanes: int,
    **wanted: bool,
) -> integrated.End:
    """One call: `lanes` rays at a time, so that slow rays hold up few others."""
    split = jax.tree.map(lambda values: values.reshape(-1, lanes), (sky, refinement))
    ends = jax.lax.map(lambda part: integrated.trace(frame, part[0], part[1], tolerance, goal, **wanted), split)
    return jax.tree.map(lambda values: values.reshape(-1), ends)


@lru_cache(maxsize=64)
def _frame_on_device(camera: Camera) -> Frame:
    """The camera's frame, sent there once for all calls."""
    return jax.device_put(camera.frame())


@cache
def _closed_form(backend: str) -> Callable[..., formula.End]:
    options = _CLOSED_FORM_COMPILER.get(backend)
    wanted = ("on_equator", "beams", "index", "crossings", "time", "short")
    return jax.jit(formula.trace, static_argnames=wanted, compiler_options=options)


def trace_rays(
    camera: Camera,
    sky: ArrayLike,
    engine: str = "auto",
    tolerance: float = 1e-10,
    *,
    end: End = math.inf,
    time: bool = False,
    redshift: bool = False,
) -> Rays:
    """Where the light comes from that the camera sees in each direction: rays without their variation.

    Parameters
    ----------
    camera : Camera
    sky : (..., 3) array
        Unit vectors N on the camera sky, in the camera basis. They are normalised here.
    engine : str
        "closed-form", elliptic functions, with the integrator where those do not hold; "integrated"; or "auto", which
        is the closed form with the integrator where that is more accurate.
    tolerance : float
        Wanted error of n' in radians, 1e-14 to 1e-2; and of the time, relative to it where it is more than 1.
    end : float or EquatorialPlane
        Where rays end: math.inf is the celestial sphere, a number outside the horizon the first arrival at that
        radius, an `EquatorialPlane` its n-th crossing.
    time, redshift : bool
        Whether to compute the coordinate time along the ray, the frequency ratio: what is left out costs nothing
        and is None in the result.

    Returns
    -------
    Rays
        Of batch shape (...).

    Errors
    ------
    `Rays.error`, at most `tolerance` except where the status is INACCURATE; `Rays.time_error`.

    References
    ----------
    JTFT appendix A.1, in the variables of docs/conventions.md.
    """
    fields = _traced(camera, sky, engine, tolerance, end, redshift=redshift, beams=False, time=time)
    return Rays(**fields)


def trace_beams(
    camera: Camera,
    sky: ArrayLike,
    engine: str = "auto",
    tolerance: float = 1e-10,
    *,
    end: End = math.inf,
    time: bool = False,
    index: bool = True,
    crossings: bool = True,
    redshift: bool = True,
) -> Beams:
    """Rays with the ellipse that each makes of a small circular beam.

    Parameters
    ----------
    camera, sky, engine, tolerance, end, time, redshift
        As for `trace_rays`.
    index, crossings : bool
        Whether to compute the Morse index, the equator crossings: what is left out costs nothing and is None in
        the result.

    Returns
    -------
    Beams
        Of batch shape (...).

    Errors
    ------
    `Beams.error` for the end point, `Beams.jacobian_error` for the ellipse.

    References
    ----------
    JTFT section 2 and appendix A.2; here the first variation of the ray replaces their beam equations.
    """
    wanted = {"beams": True, "index": index, "crossings": crossings, "time": time}
    return Beams(**_traced(camera, sky, engine, tolerance, end, redshift=redshift, **wanted))


def check_request(camera: Camera, engine: str, tolerance: float) -> None:
    """Refuse what cannot be traced, with one clear ValueError."""
    check_camera(camera)
    if engine not in ENGINES:
        raise ValueError(f"Argument `engine` must be one of {', '.join(ENGINES)}, but is {engine!r}.")
    if not (isinstance(tolerance, int | float) and 1e-14 <= tolerance <= 1e-2):
        raise ValueError(f"Argument `tolerance` must lie in [1e-14, 1e-2], but is {tolerance!r}.")


def _traced(
    camera: Camera, sky: ArrayLike, engine: str, tolerance: float, end: End, *, redshift: bool, **wanted: bool
) -> dict[str, Any]:
    """All fields of the result, traced block by block on all cores."""
    check_request(camera, engine, tolerance)
    goal = goal_of(camera, end)
    directions, shape = as_vectors(sky)
    count = len(directions)

    def block(start: int) -> Fields:
        unit = normalised(directions[start : start + _BLOCK])
        ends = _followed(camera, unit, engine, tolerance, goal, many=count >= _MANY, **wanted)
        if redshift:
            ends["redshift"] = redshift_at_end(camera, unit, end, ends["direction"], ends.get("radius"))
        return _finished(ends, tolerance)

    first = block(0)
    fields = {name: np.empty((count, *values.shape[1:]), values.dtype) for name, values in first.items()}

    def store(start: int, values: Fields) -> None:
        for name, field in fields.items():
            field[start : start + _BLOCK] = values[name]

    store(0, first)
    starts = range(_BLOCK, count, _BLOCK)
    if starts:
        with ThreadPoolExecutor(cores()) as pool:
            list(pool.map(lambda start: store(start, block(start)), starts))
    shaped = {name: values.reshape((*shape, *values.shape[1:])) for name, values in fields.items()}
    return {"engine": _used(fields) or engine, **shaped}


def _used(fields: Fields) -> str:
    """The engines that traced the rays that reached their ends."""
    formula = fields["closed_form"]
    other = np.isfinite(fields["error"]) & ~formula
    return " and ".join(name for name, used in (("closed-form", formula), ("integrated", other)) if used.any())


def cores() -> int:
    """Cores this process may use; the environment's NPROC, which XLA heeds too, is an upper limit."""
    found = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    limit = os.environ.get("NPROC", "")
    return max(1, min(found, int(limit))) if limit.isdigit() else found


def as_vectors(sky: ArrayLike) -> tuple[np.ndarray, tuple[int, ...]]:
    """The directions (n, 3), not yet of unit length, and the batch shape they had."""
    try:
        directions = np.asarray(sky, float)
    except (TypeError, ValueError):
        raise ValueError("Argument `sky` must be an array of numbers of shape (..., 3).") from None
    if directions.ndim == 0 or directions.shape[-1] != 3:
        raise ValueError(f"Argument `sky` must have shape (..., 3), but has {directions.shape}.")
    return directions.reshape(-1, 3), directions.shape[:-1]


def normalised(directions: np.ndarray) -> np.ndarray:
    """Unit vectors along the directions (n, 3); those that are unit vectors already stay as they are."""
    squares = np.einsum("ij,ij->i", directions, directions)
    if np.all(np.abs(squares - 1) < _UNIT):
        return directions
    largest = np.abs(directions).max(axis=1, initial=0, keepdims=True)
    if not (np.isfinite(largest).all() and (largest > 0).all()):
        raise ValueError("Argument `sky` must hold finite vectors that are not zero.")
    # Divided by the largest component first, so that the squares of extreme vectors neither vanish nor overflow.
    unit = directions / largest
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    return np.where(np.abs(squares - 1)[:, None] < _UNIT, directions, unit)


def _finished(ends: Fields, tolerance: float) -> Fields:
    """What a result holds, from what the engines return."""
    with np.errstate(invalid="ignore"):
        status = np.where(ends["error"] > tolerance, Status.INACCURATE, Status.ESCAPED)
    status = np.where(ends.pop("captured"), Status.CAPTURED, status)
    if "missed" in ends:
        status = np.where(ends.pop("missed"), Status.MISSED, status)
    reached = np.isfinite(ends["error"])
    for name in ("index", "crossings"):
        if name in ends:
            ends[name] = np.where(reached, ends[name], -1).astype(np.int32)
    ends["closed_form"] = ends["closed_form"] & reached
    for name in ("noise", "time_noise", "steps"):
        ends.pop(name, None)
    return {"status": status.astype(np.int8), **ends}


def _followed(
    camera: Camera, sky: np.ndarray, engine: str, tolerance: float, goal: Goal, *, many: bool, **wanted: bool
) -> Fields:
    """Rays by the engine asked for; which of them are in closed form. many, whether they are part of a large job."""
    frame = _frame_on_device(camera)
    if engine == "integrated":
        ends = _integrated(frame, sky, tolerance, goal, **wanted)
        return {**ends, "closed_form": np.zeros(len(sky), bool)}
    backend = jax.default_backend()
    kernel = partial(_closed_form(backend), frame, goal=goal, on_equator=camera.on_equator, **wanted)
    size = _CLOSED_FORM_CALL.get(backend, _LARGE_CALL)[many]
    outward = goal.kind == "infinity" or (goal.kind == "sphere" and goal.value > camera.radius)
    if outward:
        ends = _as_fields(_batched(kernel, [sky], size))
        _add_short_ways(camera, sky, goal, ends, **wanted)
    else:
        ends = _arriving(frame, sky, goal, kernel, size)
    certified = ends.pop("certified")
    unsure = ~certified
    if engine == "auto":
        # Round-off of the formulas, which the integrator does not share; that of the direction itself it does.
        unsure |= (ends["error"] > tolerance) & (ends["noise"] > _MOSTLY * ends["error"])
        if wanted["time"]:
            late = ends["time_error"] > tolerance * np.maximum(1, np.abs(ends["time"]))
            unsure |= late & (ends["time_noise"] > _MOSTLY * ends["time_error"])
    ends["closed_form"] = certified.copy()
    rest = np.flatnonzero(unsure)
    if rest.size:
        # Few rays, mostly: one program serves them all, whatever was asked for beside the beam.
        more = {"index": True, "crossings": True} if wanted["beams"] else {}
        again = _integrated(frame, sky[rest], tolerance, goal, **wanted | more)
        before = {name: ends[name][rest] for name in again.keys() & ends.keys()}
        better = ~certified[rest] | (_excess(again, tolerance, 0) < _excess(before, tolerance, 0))
        chosen = rest[better]
        for name in ends.keys() & again.keys():
            ends[name][chosen] = again[name][better]
        ends["closed_form"][chosen] = False
    return ends


def _add_short_ways(camera: Camera, sky: np.ndarray, goal: Goal, ends: Fields, **wanted: bool) -> None:
    """Put the rays of small k, which have formulas of their own, into what the others' formulas gave."""
    left = np.flatnonzero(~ends["certified"] & ~ends["captured"])
    left = left[photon(camera.frame(), tuple(sky[left].T)).k < small_k.MOST_K]
    if not left.size:
        return
    backend = jax.default_backend()
    frame = _frame_on_device(camera)
    kernel = partial(_closed_form(backend), frame, goal=goal, on_equator=False, short=True, **wanted)
    again = _as_fields(_batched(kernel, [sky[left]], _CLOSED_FORM_CALL.get(backend, _LARGE_CALL)[0]))
    known = again["certified"]
    for name, values in again.items():
        ends[name][left[known]] = values[known]


def _arriving(frame: Frame, sky: np.ndarray, goal: Goal, kernel: Any, size: int) -> Fields:
    """The closed form of the rays that arrive, where few may."""
    lost, captured = _batched(partial(_prospects, frame, goal=goal), [sky], size)
    some = _as_fields(_batched(kernel, [sky[~lost]], size))
    ends = {}
    for name, values in some.items():
        ends[name] = np.full((len(sky), *values.shape[1:]), False if values.dtype == bool else np.nan, values.dtype)
        ends[name][~lost] = values
    ends["captured"] |= lost & captured
    ends["missed"] |= lost & ~captured
    ends["certified"] |= lost
    return ends


def _integrated(frame: Frame, sky: np.ndarray, tolerance: float, goal: Goal, **wanted: bool) -> Fields:
    """All rays, sorted by work into batches; rays whose error is too large are traced again in shorter steps."""
    size, lanes = _BATCH.get(jax.default_backend(), _LARGE_BATCH)
    _, work = _batched(partial(_survey, frame, goal=goal), [sky], size)
    order = np.argsort(work, kind="stable")
    sky = sky[order]
    refinement = np.ones(len(sky))
    kernel = partial(_integrate, frame, tolerance=tolerance, goal=goal, lanes=lanes, **wanted)
    ends = _as_fields(_batched(kernel, [sky, refinement], size))
    for _ in range(_MAX_ROUNDS):
        excess = _excess(ends, tolerance)
        with np.errstate(invalid="ignore"):
            loose = np.flatnonzero((excess > 1) & (refinement > 0))
        if loose.size == 0:
            break
        before = excess[loose]
        refinement[loose] *= np.maximum(1.5, 1.15 * before ** (1 / 12))
        again = _as_fields(_batched(kernel, [sky[loose], refinement[loose]], size))
        after = _excess(again, tolerance)
        better = after < before
        for name, values in again.items():
            ends[name][loose[better]] = values[better]
        # Shorter steps that do not halve the error show that round-off is what is left.
        refinement[loose[~(after < before / 2)]] = 0
    back = np.argsort(order, kind="stable")
    return {name: values[back] for name, values in ends.items()}


def _excess(ends: Fields, tolerance: float, noises: float = 2) -> np.ndarray:
    """Errors as multiples of what is wanted, or of so many times the round-off where that is more; the time's too."""
    excess = ends["error"] / np.maximum(tolerance, noises * ends["noise"])
    if "time" in ends:
        wanted = np.maximum(tolerance * np.maximum(1, np.abs(ends["time"])), noises * ends["time_noise"])
        excess = np.maximum(excess, ends["time_error"] / wanted)
    return excess


def _batched(function: Any, arrays: list[np.ndarray], size: int) -> Any:
    """`function` of sky directions (and more arrays), over calls of one fixed size; the last is filled up."""
    count = len(arrays[0])
    if count == 0:
        arrays = [np.ones((1, *a.shape[1:])) for a in arrays]
    results = []
    for start in range(0, max(count, 1), size):
        sky, *others = (a[start : start + size] for a in arrays)
        missing = size - len(sky)
        if missing:
            # Rays with no refinement take one step: filling up costs next to nothing.
            sky = np.concatenate([sky, np.repeat(sky[:1], missing, axis=0)])
            others = [np.concatenate([o, np.zeros(missing)]) for o in others]
        results.append(function(tuple(sky.T), *others))
    return jax.tree.map(lambda *parts: np.concatenate([np.asarray(p) for p in parts])[:count], *results)


def _as_fields(ends: integrated.End | formula.End) -> Fields:
    """The ends of rays as plain arrays that can be written to, without those that were left out."""
    fields = {}
    for name, values in ends._asdict().items():
        if values is None:
            continue
        if name == "direction":
            fields[name] = np.stack(values, axis=-1)
        elif name == "jacobian":
            fields[name] = np.stack([np.stack(row, axis=-1) for row in values], axis=-2)
        else:
            fields["index" if name == "conjugate_points" else name] = values
    return fields
