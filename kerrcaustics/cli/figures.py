"""The command `figures`."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn
from rich.text import Text

from kerrcaustics.cli.app import BadInput, app, one_line, stop
from kerrcaustics.cli.options import console, make_folder, say, script_names


@app.command
def figures(*names: str, output: Path | None = None) -> None:
    """Make the figures of this checkout (the scripts of its folder figures/) and say where each file went.

    A figure that fails is told on standard error; the others are made all the same, and the exit status is 1.

    Parameters
    ----------
    names
        Which figures, by the names of their scripts; all of them when none is named.
    output
        Folder for the files, by default figures/out of the checkout; it is made when missing.
    """
    from kerrcaustics.scripts import FIGURES

    known = script_names(FIGURES, "Figures")
    for name in names:
        if name not in known:
            raise BadInput(f"Argument NAMES must be some of {', '.join(known)}, but one is {name}.")
    wanted = list(dict.fromkeys(names)) or known
    folder = output or FIGURES.folder / "out"
    make_folder(folder)
    out, failed = console(), []
    with _bar(len(wanted)) as report:
        for made, name in enumerate(wanted):
            report(name, made)
            began = time.perf_counter()
            try:
                files = FIGURES.run(name, folder)
            except Exception as error:
                failed.append(name)
                text = f"figure {name}: {type(error).__name__}: {one_line(str(error))}"
                print(f"kerrcaustics: {text}", file=sys.stderr)
            else:
                say(out, f"{name} ({time.perf_counter() - began:.1f} s)")
                for file in files:
                    say(out, f"  {file}")
    if failed:
        stop(1, f"{len(failed)} of {len(wanted)} figures could not be made: {', '.join(failed)}")


class _TimeLeft(ProgressColumn):
    """Time left, if the figures to come take as long as those made so far."""

    def render(self, task: Task) -> Text:
        """The time since the last figure counts down."""
        if not task.completed or task.total is None:
            return Text("")
        spent = task.fields["spent"]
        left = spent * (task.total / task.completed - 1) - ((task.elapsed or 0.0) - spent)
        return Text(f"about {timedelta(seconds=max(round(left), 1))} left" if task.remaining else "")


@contextmanager
def _bar(count: int) -> Iterator[Callable[[str, int], None]]:
    """A progress bar on standard error while that is a terminal; takes what is being made, and how many are done."""
    errors = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), _TimeLeft())
    bar = Progress(
        *columns,
        console=errors,
        transient=True,
        disable=not errors.is_terminal,
        # What goes to a file stays out of the terminal.
        redirect_stdout=sys.stdout.isatty(),
    )
    began = time.perf_counter()
    with bar:
        task = bar.add_task("", total=count, spent=0.0)
        yield lambda name, made: bar.update(task, description=name, completed=made, spent=time.perf_counter() - began)
