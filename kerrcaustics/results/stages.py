"""Run times of the stages of some work: the current stage, and the seconds of each."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from functools import wraps
from time import perf_counter as clock
from typing import Any, ParamSpec, TypeVar

from kerrcaustics.results import progress

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Report = Callable[[str, dict[str, float]], None]

# The timings of the current work, the outermost first: seconds so far, and the receiver of reports.
_TIMING: ContextVar[tuple[tuple[dict[str, float], Report], ...]] = ContextVar("timing", default=())


@contextmanager
def stages_timed(report: Report = lambda _name, _seconds: None) -> Iterator[dict[str, float]]:
    """Seconds of each stage, by its name, of the work of this thread within the block.

    report: called with the name of each stage that begins, and the seconds of those before.
    """
    seconds: dict[str, float] = {}
    before = _TIMING.set((*_TIMING.get(), (seconds, report)))
    try:
        yield seconds
    finally:
        _TIMING.reset(before)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Time the block as this stage, less other stages within it. Also a decorator."""
    timing, began = _TIMING.get(), clock()
    earlier = [sum(seconds.values()) for seconds, _ in timing]
    progress.report(name.replace("_", " "))
    for seconds, report in timing:
        report(name, seconds)
    try:
        yield
    finally:
        took = clock() - began
        for (seconds, _), before in zip(timing, earlier, strict=True):
            inner = sum(seconds.values()) - before
            seconds[name] = seconds.get(name, 0.0) + took - inner


def with_stages(work: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A decorator: add the seconds of each stage to those that the result of a function holds already."""

    @wraps(work)
    def timed(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        with stages_timed() as seconds:
            outcome: Any = work(*arguments, **options)
        return replace(outcome, stages={**outcome.stages, **seconds})

    return timed


def in_words(seconds: dict[str, float]) -> str:
    """Stages and their seconds, for a line."""
    return ", ".join(f"{name.replace('_', ' ')} {took:.1f} s" for name, took in seconds.items())
