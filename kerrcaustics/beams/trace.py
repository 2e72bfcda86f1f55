"""Tracing rays and beams: engine, batches and retries are decided here, once."""

import math
from functools import partial
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams import integrated
from kerrcaustics.beams.beam import Beams, Rays, Status
from kerrcaustics.beams.ends import End, Goal, goal_of, redshift_at_end
from kerrcaustics.spacetime.camera import Camera, Frame, check_camera

ENGINES = ("auto", "integrated")

# (rays in one call, rays that run side by side in it). On a CPU those should fit in the cache, and run as long
# as the slowest of them; calls that are queued run on all cores. A GPU wants one large batch.
_BATCH = {"cpu": (512, 128)}
_LARGE_BATCH = (1 << 16, 1 << 16)
_MAX_ROUNDS = 5

_survey = jax.jit(integrated.survey)


@partial(jax.jit, static_argnames=("lanes", "beams", "index", "crossings", "time"))
def _trace(
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
        "auto" or "integrated".
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
    directions, shape, engine = _checked(camera, sky, engine, tolerance)
    goal = goal_of(camera, end)
    ends = _follow(camera.frame(), directions, tolerance, goal, beams=False, time=time)
    shift = redshift_at_end(camera, directions, end, ends["direction"], ends.get("radius")) if redshift else None
    return Rays(engine=engine, **_ray_fields(ends, shift, shape, tolerance))


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
    directions, shape, engine = _checked(camera, sky, engine, tolerance)
    goal = goal_of(camera, end)
    wanted = {"index": index, "crossings": crossings, "time": time}
    ends = _follow(camera.frame(), directions, tolerance, goal, beams=True, **wanted)
    shift = redshift_at_end(camera, directions, end, ends["direction"], ends.get("radius")) if redshift else None
    fields = _ray_fields(ends, shift, shape, tolerance)
    reached = np.isfinite(ends["error"])
    return Beams(
        engine=engine,
        jacobian=ends["jacobian"].reshape((*shape, 2, 2)),
        jacobian_error=ends["jacobian_error"].reshape(shape),
        index=_whole(ends["index"], reached, shape) if index else None,
        crossings=_whole(ends["crossings"], reached, shape) if crossings else None,
        **fields,
    )


def check_request(camera: Camera, engine: str, tolerance: float) -> None:
    """Refuse what cannot be traced, with one clear ValueError."""
    check_camera(camera)
    if engine not in ENGINES:
        raise ValueError(f"Argument `engine` must be one of {', '.join(ENGINES)}, but is {engine!r}.")
    if not (isinstance(tolerance, int | float) and 1e-14 <= tolerance <= 1e-2):
        raise ValueError(f"Argument `tolerance` must lie in [1e-14, 1e-2], but is {tolerance!r}.")


def _checked(camera: Camera, sky: ArrayLike, engine: str, tolerance: float) -> tuple[np.ndarray, tuple[int, ...], str]:
    check_request(camera, engine, tolerance)
    try:
        directions = np.asarray(sky, float)
    except (TypeError, ValueError):
        raise ValueError("Argument `sky` must be an array of numbers of shape (..., 3).") from None
    if directions.ndim == 0 or directions.shape[-1] != 3:
        raise ValueError(f"Argument `sky` must have shape (..., 3), but has {directions.shape}.")
    shape = directions.shape[:-1]
    directions = directions.reshape(-1, 3)
    largest = np.abs(directions).max(axis=1, initial=0, keepdims=True)
    if not (np.isfinite(largest).all() and (largest > 0).all()):
        raise ValueError("Argument `sky` must hold finite vectors that are not zero.")
    # Divided by the largest component first, so that the squares of extreme vectors neither vanish nor overflow.
    unit = directions / largest
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    # A unit vector is left as it is: dividing by 1 + 1e-16 would move a ray close to the shadow edge.
    moved = np.abs(unit - directions).max(axis=1, initial=0, keepdims=True)
    return np.where(moved > 1e-15, unit, directions), shape, "integrated"


def _whole(counts: np.ndarray, reached: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    return np.where(reached, counts, -1).astype(int).reshape(shape)


def _ray_fields(
    ends: dict[str, np.ndarray], redshift: np.ndarray | None, shape: tuple[int, ...], tolerance: float
) -> dict[str, Any]:
    status = np.where(ends["error"] > tolerance, Status.INACCURATE, Status.ESCAPED)
    status = np.where(ends["captured"], Status.CAPTURED, status)
    if "missed" in ends:
        status = np.where(ends["missed"], Status.MISSED, status)
    extra = {name: ends[name].reshape(shape) for name in ("radius", "time", "time_error") if name in ends}
    return {
        "direction": ends["direction"].reshape((*shape, 3)),
        "azimuth": ends["azimuth"].reshape(shape),
        "status": status.reshape(shape),
        "error": ends["error"].reshape(shape),
        "redshift": None if redshift is None else redshift.reshape(shape),
        **extra,
    }


def _follow(frame: Frame, sky: np.ndarray, tolerance: float, goal: Goal, **wanted: bool) -> dict[str, np.ndarray]:
    """All rays, sorted by work into batches; rays whose error is too large are traced again in shorter steps."""
    _, work = _batched(partial(_survey, frame, goal=goal), [sky])
    order = np.argsort(work, kind="stable")
    sky = sky[order]
    refinement = np.ones(len(sky))
    kernel = partial(_trace, frame, tolerance=tolerance, goal=goal, lanes=_batch()[1], **wanted)
    ends = _as_fields(_batched(kernel, [sky, refinement]))
    for _ in range(_MAX_ROUNDS):
        excess = _excess(ends, tolerance)
        with np.errstate(invalid="ignore"):
            loose = np.flatnonzero((excess > 1) & (refinement > 0))
        if loose.size == 0:
            break
        before = excess[loose]
        refinement[loose] *= np.maximum(1.5, 1.15 * before ** (1 / 12))
        again = _as_fields(_batched(kernel, [sky[loose], refinement[loose]]))
        after = _excess(again, tolerance)
        better = after < before
        for name, values in again.items():
            ends[name][loose[better]] = values[better]
        # Shorter steps that do not halve the error show that round-off is what is left.
        refinement[loose[~(after < before / 2)]] = 0
    back = np.argsort(order, kind="stable")
    return {name: values[back] for name, values in ends.items()}


def _excess(ends: dict[str, np.ndarray], tolerance: float) -> np.ndarray:
    """Errors as multiples of what is wanted, or of twice the round-off where that is more; the time's too."""
    excess = ends["error"] / np.maximum(tolerance, 2 * ends["noise"])
    if "time" in ends:
        wanted = np.maximum(tolerance * np.maximum(1, np.abs(ends["time"])), 2 * ends["time_noise"])
        excess = np.maximum(excess, ends["time_error"] / wanted)
    return excess


def _batch() -> tuple[int, int]:
    return _BATCH.get(jax.default_backend(), _LARGE_BATCH)


def _batched(function: Any, arrays: list[np.ndarray]) -> Any:
    """`function` of sky directions (and more arrays), over calls of one fixed size; the last is filled up."""
    count, size = len(arrays[0]), _batch()[0]
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


def _as_fields(ends: integrated.End) -> dict[str, np.ndarray]:
    """The ends of rays as plain arrays that can be written to, without those that were left out."""
    fields = {
        "direction": np.stack(ends.direction, axis=-1),
        "azimuth": ends.azimuth,
        "error": ends.error,
        "noise": ends.noise,
        "captured": ends.captured,
    }
    if ends.jacobian is not None:
        fields["jacobian"] = np.stack([np.stack(row, axis=-1) for row in ends.jacobian], axis=-2)
    for name, values in (
        ("jacobian_error", ends.jacobian_error),
        ("index", ends.conjugate_points),
        ("crossings", ends.crossings),
        ("missed", ends.missed),
        ("radius", ends.radius),
        ("time", ends.time),
        ("time_error", ends.time_error),
        ("time_noise", ends.time_noise),
    ):
        if values is not None:
            fields[name] = values
    return {name: np.array(values) for name, values in fields.items()}
