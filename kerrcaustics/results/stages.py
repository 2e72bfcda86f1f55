"""How long the stages of some work take: which is on, and the seconds of each."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from functools import wraps
from time import perf_counter as clock
from typing import Any, ParamSpec, TypeVar

Asked = ParamSpec("Asked")
Made = TypeVar("Made")
Tell = Callable[[str, dict[str, float]], None]

# Who times what is done now, the outermost first: seconds so far, and who is told of each stage.
_TIMING: ContextVar[tuple[tuple[dict[str, float], Tell], ...]] = ContextVar("timing", default=())


@contextmanager
def stages_timed(tell: Tell = lambda _name, _seconds: None) -> Iterator[dict[str, float]]:
    """Seconds of each stage, by its name, of what this thread does meanwhile.

    tell: called with the name of each stage that begins, and the seconds of those before.
    """
    seconds: dict[str, float] = {}
    before = _TIMING.set((*_TIMING.get(), (seconds, tell)))
    try:
        yield seconds
    finally:
        _TIMING.reset(before)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """What is done meanwhile is this stage, but for other stages within it. Also a decorator."""
    timing, began = _TIMING.get(), clock()
    earlier = [sum(seconds.values()) for seconds, _ in timing]
    for seconds, tell in timing:
        tell(name, seconds)
    try:
        yield
    finally:
        took = clock() - began
        for (seconds, _), before in zip(timing, earlier, strict=True):
            inner = sum(seconds.values()) - before
            seconds[name] = seconds.get(name, 0.0) + took - inner


def with_stages(work: Callable[Asked, Made]) -> Callable[Asked, Made]:
    """A function whose result tells the seconds of each stage, too, after those that it has already: a decorator."""

    @wraps(work)
    def timed(*arguments: Asked.args, **options: Asked.kwargs) -> Made:
        with stages_timed() as seconds:
            made: Any = work(*arguments, **options)
        return replace(made, stages={**made.stages, **seconds})

    return timed


def in_words(seconds: dict[str, float]) -> str:
    """Stages and their seconds, for a line."""
    return ", ".join(f"{name.replace('_', ' ')} {took:.1f} s" for name, took in seconds.items())
