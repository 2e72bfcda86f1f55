"""The choice of the engine for each ray, and of the better of two results of one ray."""

from dataclasses import replace

import numpy as np

from kerrcaustics.beams import calls
from kerrcaustics.beams.accuracy import excess, is_mostly_noise
from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.ends import End
from kerrcaustics.beams.engine import Engine
from kerrcaustics.beams.ray_end import RayEnd, RayOutputs
from kerrcaustics.beams.ray_state import MOST_K
from kerrcaustics.spacetime.frame import photon_of
from kerrcaustics.spacetime.viewer import Viewer

_MAX_ROUNDS = 5
# Parts of a radian of arc by which rays are sorted, and the most of them in a small integer.
_PARTS, _MOST_PARTS = 8, 32767
# A plain number: NumPy takes four times as long for those of an enum.
_CAPTURED = int(Status.CAPTURED)


def ray_ends(
    camera: Viewer, sky: np.ndarray, engine: Engine, tolerance: float, end: End, outputs: RayOutputs
) -> RayEnd[np.ndarray]:
    """Rays by the requested engine."""
    if engine is Engine.INTEGRATED:
        return _by_integrator(camera, sky, tolerance, end, outputs)
    ends = _by_closed_form(camera, sky, end, outputs).only(outputs)
    unsure = ~ends.closed_form
    if engine is Engine.AUTO:
        unsure |= is_mostly_noise(ends, tolerance)
    rest = np.flatnonzero(unsure)
    if rest.size:
        # The variations of beams say best how errors have grown.
        more = replace(outputs, beams=True, index=True, crossings=True)
        integrated, before = _by_integrator(camera, sky[rest], tolerance, end.rows(rest), more), ends.rows(rest)
        better = ~before.closed_form | (excess(integrated, tolerance, 0) < excess(before, tolerance, 0))
        ends.replace_rows(rest[better], integrated.rows(better))
    return ends


def _by_closed_form(camera: Viewer, sky: np.ndarray, end: End, outputs: RayOutputs) -> RayEnd[np.ndarray]:
    """The closed form of all rays, with the formulas for small k."""
    if end.is_beyond(camera):
        ends = calls.closed_form(camera, sky, end, outputs)
        _add_small_k(camera, sky, end, outputs, ends)
    else:
        ends = _finite_closed_form(camera, sky, end, outputs)
    return ends


def _add_small_k(camera: Viewer, sky: np.ndarray, end: End, outputs: RayOutputs, ends: RayEnd[np.ndarray]) -> None:
    """Replace the rays of small k in `ends` by those of their own formulas."""
    rest = np.flatnonzero(~ends.closed_form & (ends.status != _CAPTURED))
    if not rest.size:
        return
    rest = rest[photon_of(camera.frame(), tuple(sky[rest].T)).k < MOST_K]
    if rest.size:
        short = calls.closed_form(camera, sky[rest], end.rows(rest), outputs, short=True)
        ends.replace_rows(rest[short.closed_form], short.rows(short.closed_form))


def _finite_closed_form(camera: Viewer, sky: np.ndarray, end: End, outputs: RayOutputs) -> RayEnd[np.ndarray]:
    """The closed form of rays of which few may arrive: the others are not traced."""
    lost, captured, certain = calls.prospects(camera, sky, end)
    some = calls.closed_form(camera, sky[~lost], end.rows(~lost), outputs)
    ends = some.room(len(sky))
    ends.replace_rows(lost, some.nowhere(np.where(captured[lost], Status.CAPTURED, Status.MISSED), certain[lost]))
    ends.replace_rows(~lost, some)
    return ends


def _by_integrator(
    camera: Viewer, sky: np.ndarray, tolerance: float, end: End, outputs: RayOutputs
) -> RayEnd[np.ndarray]:
    """All rays, sorted by work into batches; rays whose error is too large are traced again in shorter steps."""
    order = _by_work(calls.work(camera, sky, end))
    sky, end = sky[order], end.rows(order)
    refinement = np.ones(len(sky))
    ends = calls.integrate(camera, sky, refinement, tolerance, end, outputs)
    for _ in range(_MAX_ROUNDS):
        ratio = excess(ends, tolerance)
        with np.errstate(invalid="ignore"):
            inaccurate = np.flatnonzero((ratio > 1) & (refinement > 0))
        if inaccurate.size == 0:
            break
        before = ratio[inaccurate]
        refinement[inaccurate] *= np.maximum(1.5, 1.15 * before ** (1 / 12))
        refined = calls.integrate(
            camera, sky[inaccurate], refinement[inaccurate], tolerance, end.rows(inaccurate), outputs
        )
        after = excess(refined, tolerance)
        better = after < before
        ends.replace_rows(inaccurate[better], refined.rows(better))
        # If shorter steps do not halve the error, round-off dominates.
        refinement[inaccurate[~(after < before / 2)]] = 0
    places = np.empty_like(order)
    places[order] = np.arange(len(order))
    return ends.rows(places)


def _by_work(work: np.ndarray) -> np.ndarray:
    """The order of rays by their work, in whole parts of a step: NumPy sorts small integers several times as fast."""
    return np.argsort(np.fmin(_PARTS * work, _MOST_PARTS).astype(np.int16), kind="stable")
