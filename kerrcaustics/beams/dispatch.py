"""Which engine traces which ray, and which of two results of one ray is kept."""

from dataclasses import replace

import numpy as np

from kerrcaustics.beams import batches
from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.closed_form import small_k
from kerrcaustics.beams.ends import End
from kerrcaustics.beams.engine import Engine
from kerrcaustics.beams.errors import excess, is_mostly_noise
from kerrcaustics.beams.ray_end import RayEnd, Wanted
from kerrcaustics.spacetime.frame import photon_of
from kerrcaustics.spacetime.viewer import Viewer

_MAX_ROUNDS = 5


def followed(
    camera: Viewer,
    sky: np.ndarray,
    engine: Engine,
    tolerance: float,
    end: End,
    wanted: Wanted,
    *,
    many: bool,
) -> RayEnd[np.ndarray]:
    """Rays by the engine asked for. many, whether they are part of a large job."""
    if engine is Engine.INTEGRATED:
        return _integrated(camera, sky, tolerance, end, wanted)
    # One program serves all beams: index and crossings cost next to nothing, nor does the time of few.
    asked = replace(wanted, index=True, crossings=True, time=wanted.time or not many) if wanted.beams else wanted
    ends = _in_closed_form(camera, sky, end, asked, many=many).only(wanted)
    unsure = ~ends.closed_form
    if engine is Engine.AUTO:
        unsure |= is_mostly_noise(ends, tolerance)
    rest = np.flatnonzero(unsure)
    if rest.size:
        # Few rays, mostly: one program serves them all, whatever was asked for.
        more = replace(wanted, beams=True, index=True, crossings=True)
        again, before = _integrated(camera, sky[rest], tolerance, end, more), ends.rows(rest)
        better = ~before.closed_form | (excess(again, tolerance, 0) < excess(before, tolerance, 0))
        ends.put(rest[better], again.rows(better))
    return ends


def _in_closed_form(camera: Viewer, sky: np.ndarray, end: End, wanted: Wanted, *, many: bool) -> RayEnd[np.ndarray]:
    """The closed form of all rays, of those too that have formulas of their own."""
    if end.is_beyond(camera):
        ends = batches.closed_form(camera, sky, end, wanted, many=many)
        _add_small_k(camera, sky, end, wanted, ends)
    else:
        ends = _arriving(camera, sky, end, wanted, many=many)
    return ends


def _add_small_k(camera: Viewer, sky: np.ndarray, end: End, wanted: Wanted, ends: RayEnd[np.ndarray]) -> None:
    """Put the rays of small k, which have formulas of their own, into what the others' formulas gave."""
    left = np.flatnonzero(~ends.closed_form & (ends.status != Status.CAPTURED))
    if not left.size:
        return
    left = left[photon_of(camera.frame(), tuple(sky[left].T)).k < small_k.MOST_K]
    if left.size:
        again = batches.closed_form(camera, sky[left], end, wanted, short=True)
        ends.put(left[again.closed_form], again.rows(again.closed_form))


def _arriving(camera: Viewer, sky: np.ndarray, end: End, wanted: Wanted, *, many: bool) -> RayEnd[np.ndarray]:
    """The closed form of the rays that arrive, where few may."""
    lost, captured, certain = batches.prospects(camera, sky, end)
    some = batches.closed_form(camera, sky[~lost], end, wanted, many=many)
    ends = some.room(len(sky))
    ends.put(lost, some.nowhere(np.where(captured[lost], Status.CAPTURED, Status.MISSED), certain[lost]))
    ends.put(~lost, some)
    return ends


def _integrated(camera: Viewer, sky: np.ndarray, tolerance: float, end: End, wanted: Wanted) -> RayEnd[np.ndarray]:
    """All rays, sorted by work into batches; rays whose error is too large are traced again in shorter steps."""
    order = np.argsort(batches.work(camera, sky, end), kind="stable")
    sky = sky[order]
    refinement = np.ones(len(sky))
    ends = batches.integrate(camera, sky, refinement, tolerance, end, wanted)
    for _ in range(_MAX_ROUNDS):
        missing = excess(ends, tolerance)
        with np.errstate(invalid="ignore"):
            loose = np.flatnonzero((missing > 1) & (refinement > 0))
        if loose.size == 0:
            break
        before = missing[loose]
        refinement[loose] *= np.maximum(1.5, 1.15 * before ** (1 / 12))
        again = batches.integrate(camera, sky[loose], refinement[loose], tolerance, end, wanted)
        after = excess(again, tolerance)
        better = after < before
        ends.put(loose[better], again.rows(better))
        # Shorter steps that do not halve the error show that round-off is what is left.
        refinement[loose[~(after < before / 2)]] = 0
    return ends.rows(np.argsort(order, kind="stable"))
