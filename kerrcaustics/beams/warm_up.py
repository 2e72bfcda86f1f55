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


# Rays away from the hole, which have formulas of their own, and past it.
_AWAY, _PAST = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]


@cache
def _start(on_equator: bool) -> list[Future[Rays]]:
    """Trace rays for their programs alone."""
    requests = (trace_rays, np.array([_AWAY] + [_PAST] * (_MANY - 1))), (trace_beams, np.array([_PAST]))
    return [_beside.submit(trace, _camera(on_equator), sky, "closed-form") for trace, sky in requests]


def _camera(on_equator: bool) -> Camera:
    return Camera(0.5, _FAR, math.pi / 2 if on_equator else _OFF_EQUATOR, "fiducial")
