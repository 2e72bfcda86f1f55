"""Programs that are made in the background, before their first use."""

import math
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache

import numpy as np

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.spheres import SKY
from kerrcaustics.beams.trace import trace_beams, trace_in_steps, trace_rays
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.viewer import Viewer

# Enough rays to be many, which take a program of their own.
_MANY = 1 << 15
_FAR, _OFF_EQUATOR = 100.0, 1.0
_beside = ThreadPoolExecutor(2, "warm-up")


def warm_up(camera: Viewer) -> None:
    """Make or load the programs of beams in steps, many rays, and few beams, for a camera on the equator, or off it.

    That begins in other threads, in the order of their first use, once in a process. The first call that needs a
    program waits for it, and until then loads what else it needs, as SciPy.
    """
    _start(camera.on_equator)


# Rays away from the hole, which have formulas of their own, and past it.
_AWAY, _PAST = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]


@cache
def _start(on_equator: bool) -> list[Future[Rays]]:
    """Trace rays for their programs alone."""
    camera, many, one = _camera(on_equator), np.array([_AWAY] + [_PAST] * (_MANY - 1)), np.array([_PAST])
    return [
        _beside.submit(trace_in_steps, camera, one, "closed-form", 1e-10, SKY),
        _beside.submit(trace_rays, camera, many, "closed-form"),
        _beside.submit(trace_beams, camera, one, "closed-form"),
    ]


def _camera(on_equator: bool) -> Camera:
    return Camera(0.5, _FAR, math.pi / 2 if on_equator else _OFF_EQUATOR, "fiducial")
