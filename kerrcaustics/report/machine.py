"""The machine of a study: its description, the use of one core alone, and the time that work takes there."""

import os
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

# Work that takes less than this many seconds is repeated within one timing.
_SHORTEST_TIMING = 0.05
# After repeats of this length in all there are no more of them.
_LONGEST_TIMING = 2.0


def machine() -> dict[str, Any]:
    """Description of the machine: processor, cores, versions, device."""
    import numpy as np

    from kerrcaustics.beams.accelerator import name_of_device
    from kerrcaustics.beams.kernels.library import level

    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "jax": version("jax"),
        "kernels": level(),
        "accelerator": name_of_device(),
    }


@contextmanager
def one_core() -> Iterator[None]:
    """Do the work of the block on one core, in all threads of the process, if the system supports that."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    _allow({max(allowed)})
    try:
        yield
    finally:
        _allow(allowed)


def _allow(cores: set[int]) -> None:
    """Let the threads of this process run on these cores alone, also those that start later."""
    for thread in [0, *(int(task.name) for task in Path("/proc/self/task").glob("*"))]:
        # It may have ended meanwhile.
        with suppress(ProcessLookupError):
            os.sched_setaffinity(thread, cores)


def core_seconds(work: Callable[[], object], repeats: int = 3) -> float:
    """Processor time of one call in seconds, of all cores together: the least of several, after one that loads."""
    work()
    best, calls, total = float("inf"), 1, 0.0
    for _ in range(repeats):
        if total > _LONGEST_TIMING:
            break
        while True:
            began = time.process_time()
            for _ in range(calls):
                work()
            spent = time.process_time() - began
            if spent > _SHORTEST_TIMING:
                break
            calls *= 2
        best, total = min(best, spent / calls), total + spent
    return best


def processor() -> str:
    """The name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
