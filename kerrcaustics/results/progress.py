"""Progress of calls that take a while, passed to a function of the user's or shown as a bar.

Public functions under `with_progress` have a parameter `progress`. What they call reports where it is by `report` and
`in_steps`, whether somebody listens or not; other threads than that of the call have no listener.
"""

import math
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from functools import wraps
from html import escape
from time import perf_counter as clock
from typing import Any, ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Item = TypeVar("Item")

Progress = Callable[[str, float], None]
"""Takes a text on the current work, and the part of all work that is done, 0 to 1, which never falls."""

DONE = "done"
"""Text of the last report of a call."""

# Seconds before a bar that nobody asked for is shown, and between changes of one in a notebook.
_PATIENCE, _PAUSE = 1.0, 0.1


class _Listener:
    """The listener to a call; of the step it is at, the name and the limits within the whole."""

    def __init__(self, tell: Progress) -> None:
        self._tell, self._done = tell, 0.0
        self.step, self.low, self.high = "", 0.0, 1.0

    def report(self, what: str, part: float | None = None) -> None:
        """Tell what is done now, and which part of the step is done; left out, as much as before."""
        if part is not None:
            self._done = max(self._done, self.low + part * (self.high - self.low))
        self._tell(": ".join(filter(None, (self.step, what))), self._done)


_LISTENER: ContextVar[_Listener | None] = ContextVar("listener", default=None)


def report(what: str, part: float | None = None) -> None:
    """Tell the listener, if there is one, what is done now, and the part of the present step that is done."""
    if (listener := _LISTENER.get()) is not None:
        listener.report(what, part)


def notice(text: str) -> None:
    """Say what takes long: to the listener if there is one, else below the cell of a notebook, or on a terminal."""
    if _LISTENER.get() is not None:
        report(text)
    elif in_notebook():
        from IPython.display import display

        display({"text/plain": text, "text/html": f"<small>{escape(text)}</small>"}, raw=True)
    elif sys.stderr.isatty():
        sys.stderr.write(f"{text}\n")


def in_steps(what: str, items: Sequence[Item]) -> Iterator[Item]:
    """The items, each of which takes about as long; what is reported meanwhile belongs to one of them."""
    listener = _LISTENER.get()
    if listener is None:
        yield from items
        return
    step, low, high = listener.step, listener.low, listener.high
    each = (high - low) / max(len(items), 1)
    try:
        for i, item in enumerate(items):
            listener.low, listener.high = low + i * each, low + (i + 1) * each
            listener.step = ": ".join(filter(None, (step, f"{what} {i + 1} of {len(items)}")))
            listener.report("", 0.0)
            yield item
    finally:
        listener.step, listener.low, listener.high = step, low, high


def with_progress(work: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A decorator: its function's argument `progress` listens while it works, and the function leaves it alone.

    Parameters
    ----------
    work : callable
        With a keyword `progress`: a function to be called with a text and the part that is done, 0 to 1; True for a
        bar; False for none. None: within another call its listener, else in notebooks a bar after a second.
    """

    @wraps(work)
    def heard(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        progress: Any = options.get("progress")
        if progress is None and _LISTENER.get() is not None:
            return work(*arguments, **options)
        with listening(progress):
            outcome = work(*arguments, **options)
            report(DONE, 1.0)
        return outcome

    return heard


@contextmanager
def listening(progress: Progress | bool | None) -> Iterator[None]:
    """Let a function, a bar or nobody listen within the block; parameter as for `with_progress`."""
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise ValueError(
            "Argument `progress` must be True, False or a function of a text and a number, but is "
            f"{type(progress).__name__}."
        )
    if progress is True or (progress is None and in_notebook()):
        context = bar(0.0 if progress else _PATIENCE)
    else:
        context = nullcontext(progress or _silent)
    with context as tell:
        before = _LISTENER.set(_Listener(tell))
        try:
            yield
        finally:
            _LISTENER.reset(before)


def _silent(_what: str, _part: float) -> None:
    """Tell nobody; the calls within a call that is silent are so too."""


def bar(after: float = 0.0) -> AbstractContextManager[Progress]:
    """A bar in the notebook, or on standard error, that is shown at the first report after so many seconds."""
    return _cell_bar(after) if in_notebook() else _terminal_bar(after)


@contextmanager
def _terminal_bar(after: float) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress as Bar, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    console, began = Console(stderr=True, markup=False, emoji=False), clock()
    shown = Bar(*columns, console=console, transient=True, redirect_stdout=sys.stdout.isatty())
    task = shown.add_task("", total=1.0)

    def tell(what: str, part: float) -> None:
        if clock() - began >= after:
            shown.start()
        # A bar that is full while there is still work runs to and fro.
        shown.update(task, description=what, completed=part)
        shown.tasks[0].total = 1.0 if part < 1 or what == DONE else None

    try:
        yield tell
    finally:
        if shown.live.is_started:
            shown.stop()


@contextmanager
def _cell_bar(after: float) -> Iterator[Progress]:
    """A bar below the cell, which leaves nothing there."""
    from IPython.display import display

    began, place, last = clock(), None, -math.inf

    def show(line: str) -> None:
        nonlocal place
        content = {"text/plain": "", "text/html": line}
        if place is None:
            place = display(content, raw=True, display_id=True)
        else:
            place.update(content, raw=True)

    def tell(what: str, part: float) -> None:
        nonlocal last
        seconds = clock() - began
        if seconds >= after and seconds - last >= _PAUSE:
            last = seconds
            # Without a value the bar runs to and fro: it is not full while there is still work.
            value = f' value="{part:.3f}"' if part < 1 or what == DONE else ""
            show(f"<progress{value}></progress> {escape(what)} ({seconds:.0f} s)")

    try:
        yield tell
    finally:
        if place is not None:
            show("")


def in_notebook() -> bool:
    """True in a cell of a notebook; other threads of it have no cell."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    in_main_thread = threading.current_thread() is threading.main_thread()
    return type(shell).__name__ == "ZMQInteractiveShell" and in_main_thread
