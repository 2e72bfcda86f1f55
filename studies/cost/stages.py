"""Time of some work by stage: within kernels, and all the rest.

Every kernel runs by `Kernel.on_rays`, and every ray and beam is traced by `followed`. Both are replaced here for a
while by functions that count.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from kerrcaustics.beams import trace
from kerrcaustics.beams.kernels.library import Kernel

TRACING, REST = STAGES = ("tracing", "rest")


class Stages:
    """Seconds of each stage by a clock, and numbers of rays and beams.

    While a kernel runs in any thread, the time is that of tracing.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self.traced = {"rays": 0, "beams": 0}
        self._clock, self._last = clock, clock()
        self._in_kernels = 0
        self._lock = threading.Lock()

    @contextmanager
    def in_kernel(self) -> Iterator[None]:
        """The block is the run of a kernel, in this thread."""
        self._step(1)
        try:
            yield
        finally:
            self._step(-1)

    def end(self) -> None:
        """The time until now belongs to its stage."""
        self._step(0)

    def _step(self, threads: int) -> None:
        with self._lock:
            now = self._clock()
            self.seconds[TRACING if self._in_kernels else REST] += now - self._last
            self._last = now
            self._in_kernels += threads

    def count(self, kind: str, number: int) -> None:
        """So many more rays or beams."""
        with self._lock:
            self.traced[kind] += number


@contextmanager
def watched(clock: Callable[[], float]) -> Iterator[Stages]:
    """The stages of all that this process does within the block, in any thread."""
    on_rays, followed = Kernel.on_rays, trace.ray_ends
    stages = Stages(clock)

    def timed(*arguments: Any, **options: Any) -> Any:
        with stages.in_kernel():
            return on_rays(*arguments, **options)

    def counted(camera: Any, sky: Any, engine: Any, tolerance: Any, end: Any, wanted: Any, **options: Any) -> Any:
        stages.count("beams" if wanted.beams else "rays", len(sky))
        return followed(camera, sky, engine, tolerance, end, wanted, **options)

    Kernel.on_rays, trace.ray_ends = timed, counted
    try:
        yield stages
    finally:
        stages.end()
        Kernel.on_rays, trace.ray_ends = on_rays, followed
