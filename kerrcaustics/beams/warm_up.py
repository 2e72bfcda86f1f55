"""Programs that are made in the background, before their first use."""

import math
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache

import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.trace import trace_beams, trace_rays
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.viewer import Viewer

# Enough rays to be many, which take a program of their own.
_MANY = 1 << 15
_FAR, _OFF_EQUATOR = 100.0, 1.0
_beside = ThreadPoolExecutor(2, "warm-up")


def warm_up(camera: Viewer) -> None:
    """Make or load the programs that trace many rays, and few beams, from a camera on the equator, or off it.

    That begins in other threads, once in a process. The first call that needs a program waits for it.
    """
    _start(camera.on_equator)


@cache
def _start(on_equator: bool) -> list[Future[Rays]]:
    """Trace rays for their programs alone: away from the hole, with formulas of their own, and past it."""
    camera = Camera(0.5, _FAR, math.pi / 2 if on_equator else _OFF_EQUATOR, "fiducial")
    past, away = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]
    requests = (trace_rays, np.array([away] + [past] * (_MANY - 1))), (trace_beams, np.array([past]))
    return [_beside.submit(trace, camera, sky, "closed-form") for trace, sky in requests]
