"""The command `figures`."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

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
    with _bar(len(wanted)) as bar:
        for name in wanted:
            bar.update(bar.task_ids[0], description=name)
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
            bar.advance(bar.task_ids[0])
    if failed:
        stop(1, f"{len(failed)} of {len(wanted)} figures could not be made: {', '.join(failed)}")


@contextmanager
def _bar(count: int) -> Iterator[Progress]:
    """A progress bar of figures with the time left, on standard error while that is a terminal."""
    errors = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    left = TimeRemainingColumn()
    # The time left follows from all figures made so far.
    bar = Progress(
        *columns,
        TextColumn("left"),
        left,
        console=errors,
        transient=True,
        disable=not errors.is_terminal,
        # What goes to a file stays out of the terminal.
        redirect_stdout=sys.stdout.isatty(),
        speed_estimate_period=3600,
    )
    with bar:
        bar.add_task("", total=count)
        yield bar
