"""The terminal: lines, tables, progress, and errors about arguments."""

import math
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rich.console import Console

from kerrcaustics.cli.endings import BadInput, one_line, stop
from kerrcaustics.results.progress import DONE
from kerrcaustics.results.time_left import TimeLeft, clock_in_words

if TYPE_CHECKING:
    from rich.progress import ProgressColumn

    from kerrcaustics.beams.ends import End
    from kerrcaustics.spacetime.viewer import Viewer

FIRST_LINE = 5.0
"""Seconds after which a command that is at work without a terminal says so."""
# What a command does after its search, before it says what it does.
_WRITING = "writing the results"
# Seconds between lines about progress where there is no terminal.
_PAUSE = 20.0

# Arguments whose options have other names.
_OPTIONS = {"end": "source-radius"}

# Columns of what is read in a file, or by another program.
_ENDLESS = 10_000

quiet_output = False


def be_quiet() -> None:
    """Print neither tables nor progress from now on, but errors and requested output all the same."""
    global quiet_output
    quiet_output = True


def console(stderr: bool = False) -> Console:
    """The console of tables."""
    width = None if (sys.stderr if stderr else sys.stdout).isatty() else _ENDLESS
    return Console(stderr=stderr, width=width, quiet=quiet_output, markup=False, emoji=False)


def say(out: Console, text: str) -> None:
    """Print a line that no terminal width cuts up."""
    out.print(text, soft_wrap=True, highlight=False)


def note(text: str) -> None:
    """A line on standard error about what is allowed, and may not be what was meant."""
    if not quiet_output:
        sys.stderr.write(f"Note: {text}\n")


def say_all(out: Console, lines: Iterable[str]) -> None:
    """Print several lines."""
    for line in lines:
        say(out, line)


def place_of(camera: "Viewer") -> str:
    """The camera, in words for a headline."""
    inclination = f"{math.degrees(camera.inclination):z.12g} deg"
    viewer = f"{camera.velocity} {'camera' if camera.sky_unit == 'rad' else 'observer'}"
    return f"a = {camera.spin:z.12g}, r = {camera.radius:.12g}, inclination {inclination}, {viewer}"


def place_heads(surface: "End") -> tuple[str, ...]:
    """The names of the coordinates of a surface in tables."""
    return tuple(each.symbol + " (deg)" * (each.unit == "rad") for each in surface.coordinates)


def place_in_words(surface: "End", place: Iterable[float]) -> str:
    """A place on a surface, angles in degrees; its first coordinate alone where no other is given."""
    pairs = zip(surface.coordinates, place, strict=False)
    parts = (
        f"{each.symbol} = {math.degrees(x):z.12g} deg" if each.unit == "rad" else f"{each.symbol} = {x:.12g}"
        for each, x in pairs
    )
    return ", ".join(parts)


def place_cells(surface: "End", place: Iterable[float], digits: int = 8) -> list[str]:
    """A place on a surface, angles in degrees, as cells of a table."""
    pairs = zip(surface.coordinates, place, strict=True)
    return [f"{math.degrees(x) if each.unit == 'rad' else x:z.{digits}g}" for each, x in pairs]


def magnification_head(result: Any) -> str:
    """The head of a column of magnifications, with their unit if they are no ratios."""
    from kerrcaustics.results.units import magnification_unit

    unit = magnification_unit(result)
    return f"magnifi\N{SOFT HYPHEN}cation ({unit})" if unit else "magnifi\N{SOFT HYPHEN}cation"


def has_ratio(viewer: "Viewer", surface: "End") -> bool:
    """True for an observer who would see the star without the hole: at a finite radius, with stars at infinity."""
    return viewer.sky_unit != "rad" and math.isfinite(viewer.radius) and not surface.finite


def index_counts(per_index: dict[int, int]) -> str:
    """The count of each index, in words."""
    return ", ".join(f"{count} of index {k}" for k, count in per_index.items())


def verdict(certified: bool) -> str:
    """The certificate in words."""
    return "certified" if certified else "NOT certified"


@contextmanager
def plain_errors(named: dict[str, str] | None = None) -> Iterator[None]:
    """Turn the package's own errors about arguments into those of the command line; named: of other options."""
    try:
        yield
    except ValueError as error:
        message = str(error)
        if not message.startswith("Argument `"):
            raise
        name = message.split("`")[1]
        option = {**_OPTIONS, **(named or {})}.get(name, name).replace("_", "-")
        raise BadInput(message.replace(f"`{name}`", f"--{option}", 1)) from None


@contextmanager
def one_line_errors(unwritten: Callable[[str], str] | None = None) -> Iterator[None]:
    """Turn errors about files and packages into lines of the command line, and end if workers are lost.

    unwritten: makes the line about a file that cannot be written of the reason; left out, that is an error of input.
    """
    from kerrcaustics.workers.worker_failures import WorkersLost

    try:
        yield
    except WorkersLost as error:
        stop(1, str(error))
    except OSError as error:
        if unwritten is None:
            raise BadInput(one_line(str(error))) from None
        stop(1, unwritten(error.strerror or one_line(str(error))))
    except (ImportError, ValueError) as error:
        raise BadInput(one_line(str(error))) from None


@contextmanager
def progress(prefix: str = "", left: bool = False, at_once: int = 1) -> Iterator[Callable[[str, float], None]]:
    """A progress bar on standard error while it is a terminal, else a line now and then.

    left: with the time left, on the bar too; at_once: steps that are at work at the same time.
    """
    console = Console(stderr=True, markup=False, emoji=False)
    if quiet_output:
        yield lambda _what, _part: None
        return
    if not console.is_terminal:
        with _ProgressLines(prefix, at_once).written() as report:
            yield report
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    estimate = TimeLeft(at_once)
    if left:
        columns += (_left_column(estimate),)
    # What goes to a file stays out of the terminal.
    with Progress(*columns, console=console, transient=True, redirect_stdout=sys.stdout.isatty()) as bar:
        task = bar.add_task(f"{prefix}loading", total=1.0)

        def report_on_bar(what: str, part: float) -> None:
            estimate.note(time.monotonic(), part)
            bar.update(task, description=f"{prefix}{_WRITING if what == DONE else what}", completed=part)
            # A bar that is full while there is still work runs to and fro.
            bar.tasks[0].total = 1.0 if part < 1 else None

        yield report_on_bar


def _left_column(estimate: TimeLeft) -> "ProgressColumn":
    """The time left, as a column of a bar: it counts down between reports."""
    from rich.progress import ProgressColumn, Task
    from rich.text import Text

    class Left(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(
                _time_left(estimate.seconds_left(time.monotonic()) if task.completed < 1 else None).lstrip(", ")
            )

    return Left()


class _ProgressLines:
    """Lines about progress on standard error, when there was none for a while."""

    def __init__(self, prefix: str, at_once: int = 1) -> None:
        self._prefix, self._what, self._count = prefix, "computing", 0
        self._last = time.monotonic() if math.isfinite(FIRST_LINE) else math.inf
        self._estimate = TimeLeft(at_once)

    @contextmanager
    def written(self) -> Iterator[Callable[[str, float], None]]:
        """Write lines on reports, and where there are none by the clock."""
        over = threading.Event()
        watch = threading.Thread(target=self._watch, args=(over,), daemon=True)
        if math.isfinite(FIRST_LINE):
            watch.start()
        try:
            yield self._report
        finally:
            over.set()
            if watch.is_alive():
                watch.join()

    def _report(self, what: str, part: float) -> None:
        now = time.monotonic()
        self._what = _WRITING if what == DONE else what
        self._estimate.note(now, part)
        # What follows says itself what was done.
        if what != DONE and now - self._last >= _PAUSE:
            self._last = now
            self._write(_time_left(self._estimate.seconds_left(now) if part < 1 else None))

    def _watch(self, over: threading.Event) -> None:
        """Lines for work that reports nothing for long."""
        waited, pause, count = 0.0, FIRST_LINE, 0
        while not over.wait(pause):
            waited, pause = waited + pause, _PAUSE
            if self._count == count:
                self._write(f", {waited:.0f} s so far")
            count = self._count

    def _write(self, more: str) -> None:
        self._count += 1
        sys.stderr.write(f"{self._prefix}{self._what}{more}\n")
        sys.stderr.flush()


def _time_left(seconds: float | None) -> str:
    """The time left in words; none where it is not known."""
    return "" if seconds is None else f", {clock_in_words(seconds)} left"
