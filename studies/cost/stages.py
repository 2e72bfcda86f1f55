"""Time of some work by stage: programs that are made or loaded, programs that run, and all the rest.

All that is compiled is called as a `Program`, and every ray and beam is traced by `followed`. Both are replaced here
for a while by functions that count.
"""

import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import jax

from kerrcaustics.beams import trace
from kerrcaustics.beams.compile_cache import Program

LOADING, TRACING, REST = STAGES = ("loading", "tracing", "rest")
# Threads that make programs before they are needed: nobody waits for them.
BESIDE = "warm-up"


class Stages:
    """Seconds of each stage by a clock, and numbers of rays and beams.

    While any thread loads a program, the time is that of loading; else while any program runs, that of tracing.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self.traced = {"rays": 0, "beams": 0}
        self._clock, self._last = clock, clock()
        self._threads: Counter[str] = Counter()
        self._lock = threading.Lock()

    @contextmanager
    def inside(self, stage: str) -> Iterator[None]:
        """The block belongs to a stage, for this thread."""
        self._step(stage, 1)
        try:
            yield
        finally:
            self._step(stage, -1)

    def _step(self, stage: str, threads: int) -> None:
        if threading.current_thread().name.startswith(BESIDE):
            return
        with self._lock:
            now = self._clock()
            current = next((name for name in (LOADING, TRACING) if self._threads[name]), REST)
            self.seconds[current] += now - self._last
            self._last = now
            self._threads[stage] += threads

    def count(self, kind: str, number: int) -> None:
        """So many more rays or beams."""
        if not threading.current_thread().name.startswith(BESIDE):
            with self._lock:
                self.traced[kind] += number


@contextmanager
def watched(clock: Callable[[], float]) -> Iterator[Stages]:
    """The stages of all that this process does within the block, in any thread."""
    compiled, followed = Program.compiled, trace.followed
    stages = Stages(clock)

    def loaded(program: Program, *arguments: Any, **static: Any) -> Callable[..., Any]:
        with stages.inside(LOADING):
            run = compiled(program, *arguments, **static)

        def traced(*arguments: Any) -> Any:
            # A call returns before its arrays are there.
            with stages.inside(TRACING):
                return jax.block_until_ready(run(*arguments))

        return traced

    def counted(camera: Any, sky: Any, engine: Any, tolerance: Any, end: Any, wanted: Any, **options: Any) -> Any:
        stages.count("beams" if wanted.beams else "rays", len(sky))
        return followed(camera, sky, engine, tolerance, end, wanted, **options)

    Program.compiled, trace.followed = loaded, counted
    try:
        with stages.inside(REST):
            yield stages
    finally:
        Program.compiled, trace.followed = compiled, followed
