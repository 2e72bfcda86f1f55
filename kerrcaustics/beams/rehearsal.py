"""Programs that are made beside what goes on, for who knows which will be asked for next."""

import math
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache

import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.trace import trace_rays
from kerrcaustics.spacetime.camera import Camera

# Few rays and many take programs of their own.
_COUNTS = (1, 1 << 15)
_FAR, _OFF_EQUATOR = 100.0, 1.0
_beside = ThreadPoolExecutor(len(_COUNTS), "rehearsal")


def rehearse(camera: Camera) -> None:
    """Let the programs that trace rays to infinity from a camera on the equator, or off it, be made or loaded.

    That begins in other threads, once in a process. Whoever needs one of them first waits for it.
    """
    _begun(camera.on_equator)


@cache
def _begun(on_equator: bool) -> list[Future[Rays]]:
    """The rays are seen for nothing: away from the hole, where they have formulas of their own, and past it."""
    camera = Camera(0.5, _FAR, math.pi / 2 if on_equator else _OFF_EQUATOR, "fiducial")
    past, away = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]
    skies = [np.array([away] + [past] * (count - 1)) for count in _COUNTS]
    return [_beside.submit(trace_rays, camera, sky, "closed-form") for sky in skies]
