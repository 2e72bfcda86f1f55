"""Tracing rays and beams: requests are checked, and traced block by block, here."""

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.accelerator import MOST_RAYS, on_accelerator
from kerrcaustics.beams.beam import Beams, Rays, engines_used
from kerrcaustics.beams.directions import as_vectors, normalised
from kerrcaustics.beams.dispatch import ray_ends
from kerrcaustics.beams.emitters import redshift as frequency_ratio
from kerrcaustics.beams.ends import End, Wherever, end_of
from kerrcaustics.beams.engine import Engine, engine_named, in_words
from kerrcaustics.beams.ray_end import RayEnd, RayOutputs
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.spacetime.checks import flags, quoted, real_number
from kerrcaustics.spacetime.frame import doppler, photon_of
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

# Rays that are checked, traced and stored together on a CPU: they determine the memory beside input and result.
_BLOCK = 1 << 15

# Round-off of b and q, and of a cosine of emission, relative to their terms.
_OF_CONSTANTS, _OF_COSINE = 1e-15, 3e-15

Result = TypeVar("Result", bound=Rays)
Fields = dict[str, np.ndarray]


class _Extra(NamedTuple):
    """Quantities that follow from the photons and their ends, beside those of the kernels."""

    redshift: bool = False
    constants: bool = False
    emission: bool = False


@usual_warnings
def trace_rays(
    camera: Viewer,
    sky: ArrayLike,
    engine: str = "auto",
    tolerance: float = 1e-10,
    *,
    end: Wherever | End = math.inf,
    time: bool = False,
    redshift: bool = False,
    constants: bool = False,
    emission: bool = False,
) -> Rays:
    """Trace rays backward from the sky of a camera, without their variation.

    Parameters
    ----------
    camera : Camera or Observer
    sky : (..., 3) array
        Unit vectors N on the camera sky, in the camera basis. They are normalised here. For an Observer (..., 2),
        places (alpha, beta).
    engine : str
        "closed-form", elliptic functions, with the integrator where those do not apply; "integrated"; or "auto", the
        closed form with the integrator where that is more accurate.
    tolerance : float
        Largest error of n' in radians, 1e-14 to 1e-2; and of the time, relative to the time if it is more than 1.
    end : float or EquatorialPlane
        End of rays: math.inf is the celestial sphere, a number outside the horizon the first arrival at that
        radius, an `EquatorialPlane` its n-th crossing.
    time, redshift : bool
        True to compute the coordinate time along the ray or the frequency ratio; quantities not requested cost nothing
        and are None in the result.
    constants, emission : bool
        True to compute the constants b and q of the light (`Rays.impact` and `Rays.carter`), or the slant at which it
        leaves the surface of the end (`Rays.emission_cosine`).

    Returns
    -------
    Rays
        Of batch shape (...).

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Rays.error`, at most `tolerance` except where the status is INACCURATE; `Rays.time_error`; `Rays.impact_error`,
    `Rays.carter_error` and `Rays.emission_error`.

    References
    ----------
    JTFT appendix A.1, in the variables of docs/conventions.md.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> rays = kc.trace_rays(camera, [[-0.6, 0.5, 0.4], [-1.0, 0.0, 0.0]])
    >>> rays.escaped.tolist(), bool(rays.error[0] < 1e-9)
    ([True, True], True)
    """
    flags(time=time, redshift=redshift, constants=constants, emission=emission)
    check_viewer(camera)
    extra = {"redshift": redshift, "constants": constants, "emission": emission}
    return rays_of_directions(camera, camera.directions(sky), engine, tolerance, end=end, time=time, **extra)


@usual_warnings
def trace_beams(
    camera: Viewer,
    sky: ArrayLike,
    engine: str = "auto",
    tolerance: float = 1e-10,
    *,
    end: Wherever | End = math.inf,
    time: bool = False,
    index: bool = True,
    crossings: bool = True,
    redshift: bool = True,
    constants: bool = False,
    emission: bool = False,
) -> Beams:
    """Trace rays, each with the ellipse into which it maps a small circular beam.

    Parameters
    ----------
    camera, sky, engine, tolerance, end, time, redshift, constants, emission
        As for `trace_rays`.
    index, crossings : bool
        True to compute the Morse index or the equator crossings; quantities not requested are None in the result.

    Returns
    -------
    Beams
        Of batch shape (...).

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Beams.error` for the end point, `Beams.jacobian_error` for the ellipse; `Beams.from_ellipse` gives those of beams
    that are not circular at the camera.

    References
    ----------
    JTFT section 2 and appendix A.2; here the first variation of the ray replaces their beam equations.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> beams = kc.trace_beams(camera, [[-0.6, 0.5, 0.4]])
    >>> beams.index.tolist(), beams.jacobian.shape
    ([1], (1, 2, 2))
    """
    flags(time=time, index=index, crossings=crossings, redshift=redshift, constants=constants, emission=emission)
    check_viewer(camera)
    outputs = {"time": time, "index": index, "crossings": crossings}
    extra = {"redshift": redshift, "constants": constants, "emission": emission}
    beams = beams_of_directions(camera, camera.directions(sky), engine, tolerance, end=end, **outputs, **extra)
    by_places = camera.by_places(sky, beams.jacobian)
    return beams if by_places is beams.jacobian else replace(beams, jacobian=by_places)


def rays_of_directions(
    camera: Viewer,
    directions: ArrayLike,
    engine: str = "auto",
    tolerance: float = 1e-10,
    *,
    end: Wherever | End = math.inf,
    time: bool = False,
    **extra: bool,
) -> Rays:
    """Rays of directions (..., 3) as engines take them, of an Observer too; all else as for `trace_rays`."""
    return _trace(Rays, camera, directions, engine, tolerance, end, RayOutputs(time=time), _Extra(**extra))


def beams_of_directions(
    camera: Viewer,
    directions: ArrayLike,
    engine: str = "auto",
    tolerance: float = 1e-10,
    *,
    end: Wherever | End = math.inf,
    time: bool = False,
    index: bool = True,
    crossings: bool = True,
    redshift: bool = True,
    **extra: bool,
) -> Beams:
    """Beams of directions (..., 3) as engines take them, varied along tangents there; else as for `trace_beams`."""
    outputs = RayOutputs(beams=True, index=index, crossings=crossings, time=time)
    return _trace(Beams, camera, directions, engine, tolerance, end, outputs, _Extra(redshift=redshift, **extra))


def check_request(camera: Viewer, engine: str, tolerance: float) -> tuple[Engine, float]:
    """The requested engine and tolerance; raise ValueError if an argument is invalid."""
    check_viewer(camera)
    chosen, largest_error = engine_named(engine), real_number("tolerance", tolerance)
    if not 1e-14 <= largest_error <= 1e-2:
        raise ValueError(f"Argument `tolerance` must lie in [1e-14, 1e-2], but is {quoted(tolerance)}.")
    return chosen, largest_error


def _trace(
    kind: type[Result],
    camera: Viewer,
    sky: ArrayLike,
    engine: str,
    tolerance: float,
    end: Any,
    outputs: RayOutputs,
    extra: _Extra,
) -> Result:
    """The result, traced block by block: on all cores, or in one stream of an accelerator."""
    chosen, tolerance = check_request(camera, engine, tolerance)
    surface = end_of(camera, end)
    directions, shape = as_vectors(sky)
    count = len(directions)
    in_one_stream = on_accelerator(count)
    size = MOST_RAYS if in_one_stream else _BLOCK

    def block(start: int) -> Fields:
        block_rays = slice(start, start + size)
        unit, block_surface = normalised(directions[block_rays]), surface.rows(block_rays)
        ends = ray_ends(camera, unit, chosen, tolerance, block_surface.bare(), outputs)
        fields = ends.finished(tolerance)
        if not extra.redshift:
            del fields["redshift"]
        return fields | _extras(extra, camera, unit, block_surface, ends)

    first = block(0)
    fields = first
    if count > size:
        fields = _with_more(block, first, (count, size), 1 if in_one_stream else cores())
    if shape != (count,):
        fields = {name: values.reshape((*shape, *values.shape[1:])) for name, values in fields.items()}
    engines = engines_used(fields["error"], fields["closed_form"])
    return kind(engine=in_words(engines) if engines else chosen.value, **fields)


def _with_more(block: Callable[[int], Fields], first: Fields, sizes: tuple[int, int], threads: int) -> Fields:
    """The first block, and the others, shared out among threads; sizes: rays in all, and of a block."""
    count, size = sizes
    ends = {name: np.empty((count, *values.shape[1:]), values.dtype) for name, values in first.items()}

    def store(start: int, part: Fields) -> None:
        for name, values in part.items():
            ends[name][start : start + size] = values

    store(0, first)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda start: store(start, block(start)), range(size, count, size)))
    return ends


def _extras(
    extra: _Extra, camera: Viewer, sky: np.ndarray, end: End, ends: RayEnd[np.ndarray]
) -> dict[str, np.ndarray]:
    """The quantities that follow from the photons and their ends, by their names in `Rays`."""
    fields = {"redshift": _redshift(camera, sky, end, ends)} if extra.redshift else {}
    if extra.constants or extra.emission:
        light = _constants(camera, sky)
        fields |= light if extra.constants else {}
        fields |= _emission(camera.spin, end, ends, light) if extra.emission else {}
    return fields


def _constants(camera: Viewer, sky: np.ndarray) -> dict[str, np.ndarray]:
    """The constants b and q of the light from directions (n, 3), with their round-off."""
    frame = camera.frame()
    with np.errstate(divide="ignore", invalid="ignore"):
        photon = photon_of(frame, tuple(sky.T))
        scale = frame.cylindrical_scale / photon.energy_ratio
        size = np.sqrt(np.maximum(photon.k, 0)) + frame.spin + scale
        # Deep in the field the energy at infinity is a small difference; and a fast camera widens angles.
        terms = 1 + (frame.lapse + frame.shift * frame.cylindrical_scale) / photon.energy_ratio
        widening = 1 + math.sqrt(frame.slowness) / doppler(frame, tuple(sky.T))[0]
        error = _OF_CONSTANTS * size * terms * widening
        known = photon.energy_ratio > 0
        values = {"impact": photon.b, "impact_error": error, "carter": photon.q, "carter_error": 4 * size * error}
        return {name: np.where(known, value, np.nan) for name, value in values.items()}


def _emission(spin: float, end: End, ends: RayEnd[np.ndarray], light: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The cosine of the angle at which the light leaves the end, with its error: that of each number in it."""
    emitter, outward = end.emitter_motion(), True if ends.outward is None else ends.outward
    radius, cosine = np.inf if ends.radius is None else ends.radius, ends.direction[:, 2]

    def cosine_at(b: np.ndarray, q: np.ndarray, r: np.ndarray | float, z: np.ndarray) -> np.ndarray:
        normal = np.asarray(end.normal_momentum(spin, (b, q), (r, z)))
        if emitter is None:
            return normal + 0 * z
        return normal * np.asarray(frequency_ratio(emitter, spin, (b, q), (r, z), np.ones_like(z), outward))

    exact = [light["impact"], light["carter"], radius, cosine]
    errors = [light["impact_error"], light["carter_error"], radius * ends.error, ends.error]
    with np.errstate(invalid="ignore"):
        value = cosine_at(*exact)
        error = _OF_COSINE * value
        for i, step in enumerate(errors):
            moved = [part + (step if i == j else 0) for j, part in enumerate(exact)]
            error = error + np.abs(cosine_at(*moved) - value)
        unknown = np.isnan(error) & np.isfinite(value)
        return {"emission_cosine": np.minimum(value, 1.0), "emission_error": np.where(unknown, 1.0, error)}


def _redshift(camera: Viewer, sky: np.ndarray, end: End, ends: RayEnd[np.ndarray]) -> np.ndarray:
    """Frequency ratio nu_camera / nu_source for the source at the end of each ray; NaN if there can be none."""
    emitter = end.emitter_motion()
    if emitter is None or ends.radius is None or ends.outward is None:
        return ends.redshift
    photon, place = photon_of(camera.frame(), tuple(sky.T)), (ends.radius, ends.direction[:, 2])
    return np.asarray(frequency_ratio(emitter, camera.spin, (photon.b, photon.q), place, ends.redshift, ends.outward))


def cores() -> int:
    """Cores this process may use; the environment's NPROC is an upper limit."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    limit = os.environ.get("NPROC", "")
    return max(1, min(count, int(limit))) if limit.isdigit() else count
