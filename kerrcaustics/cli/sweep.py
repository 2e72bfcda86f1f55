"""The command `sweep`."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import cyclopts

from kerrcaustics.cli.app import app, with_examples
from kerrcaustics.cli.endings import BadInput, stop
from kerrcaustics.cli.options import COMMON, HERE, CommonOptions, FileName, Flag, WorkerOptions
from kerrcaustics.cli.outputs import check_store
from kerrcaustics.cli.terminal import one_line_errors, plain_errors, progress, say
from kerrcaustics.interrupts import NOTHING_LEFT, on_interrupt

if TYPE_CHECKING:
    from kerrcaustics.sweeps.run import SweepResult

# Lines about failed points that are printed; the store has them all.
_SHOWN = 20


@app.command(**with_examples("sweep sweep.toml --workers 2 --output sweep.zarr", "sweep --status sweep.zarr"))
def sweep(
    file: FileName | None = None,
    /,
    *,
    output: FileName | None = None,
    status: FileName | None = None,
    keys: Flag = False,
    workers: WorkerOptions = HERE,
    resume: Annotated[bool, cyclopts.Parameter(negative="--no-resume")] = True,
    retry: Flag = False,
    common: CommonOptions = COMMON,
) -> None:
    """Compute caustics over spin, radius and inclination, as specified in a sweep file, and write one zarr store.

    An interrupted sweep resumes when the command is run again.

    Parameters
    ----------
    file
        The sweep file, TOML: see docs/sweeps.md.
    output
        The store; by default in the current folder, named after the sweep file, with the ending .zarr.
    status
        Instead of a sweep file: print how far the sweep with this store is, also while it runs, and compute nothing.
    keys
        Instead of a sweep file: print the keys of sweep files and the variables of stores, in Markdown.
    resume
        Continue a store that exists; with --no-resume, such a store is an error.
    retry
        Retry the points that failed before.
    """
    others = {"FILE": file, "--output": output, "--retry": retry or None, "--no-resume": None if resume else True}
    others |= {f"--{name}": value for name, value in asdict(workers).items()}
    if keys:
        _print_keys({**others, "--status": status, "--json": common.json})
        return
    if status is not None:
        _print_status(others, status, common)
        return
    if file is None:
        raise BadInput("Argument FILE must be given.")
    workers.check()
    store = output or Path(f"{file.stem}.zarr")
    check_store("--output", store)
    common.check()
    if store.exists() and not resume:
        raise BadInput(f"Argument --output must name a new store if --no-resume is given, but {store} already exists.")
    on_interrupt(
        lambda: f"what was computed is kept in {store}; start again to resume." if store.exists() else NOTHING_LEFT
    )
    result = _run(file, store, workers, retry)
    from kerrcaustics.results.records import record

    done = f"{result.before} done before, {result.points - result.before} computed now, {len(result.failures)} failed"
    common.write(record(result))
    out = common.console()
    say(out, f"{result.points} points: {done}; {result.seconds:.1f} s")
    if result.damaged:
        say(out, f"{result.damaged} points were damaged in the store, and have been computed again")
    if result.mended:
        say(out, f"{len(result.mended)} files that describe the store were lost or altered, and have been rewritten")
    say(out, f"Store: {store}")
    if result.failures:
        _write_failures(result.failures)
        stop(1, f"{len(result.failures)} of {result.points} points failed.")


def _print_keys(others: dict[str, Any]) -> None:
    """The keys of sweep files, and the variables of stores."""
    _refuse(others, "--keys")
    from kerrcaustics.sweeps.key_tables import scene_table, variable_table

    sys.stdout.write(f"{scene_table()}\n\n{variable_table()}\n")


def _refuse(others: dict[str, Any], option: str) -> None:
    """Refuse arguments beside an option that computes nothing."""
    for name, value in others.items():
        if value is not None:
            raise BadInput(f"Argument {name} must not be used with {option}.")


def _write_failures(failures: tuple[str, ...]) -> None:
    sys.stderr.write("".join(f"failed: {line}\n" for line in failures[:_SHOWN]))
    if (more := len(failures) - _SHOWN) > 0:
        sys.stderr.write(f"... and {more} more; open_sweep(STORE).reason has them all (docs/sweeps.md)\n")


def _print_status(others: dict[str, Any], store: Path, common: CommonOptions) -> None:
    """How far the sweep of a store is; others: arguments of a sweep that is made, None if they are not given."""
    _refuse(others, "--status")
    common.check()
    with one_line_errors(), plain_errors({"path": "status"}):
        from kerrcaustics.sweeps.opened import sweep_status

        state = sweep_status(store)
    common.write({"schema": "kerrcaustics/sweep-status/1", "store": str(store), **asdict(state)})
    now = "; a sweep is writing to it now" if state.running else ""
    counts = f"{state.done} done, {state.failed} failed, {state.missing} not computed yet"
    say(common.console(), f"{store}: {state.points} points: {counts}{now}")
    _write_failures(state.failures)


def _run(file: Path, store: Path, workers: WorkerOptions, retry: bool) -> "SweepResult":
    def unwritten(reason: str) -> str:
        kept = "What it holds is kept; start again to resume." if store.exists() else "None of it is left."
        return f"The store {store} cannot be written: {reason}. {kept}"

    with one_line_errors(unwritten), plain_errors({"path": "output"}):
        from kerrcaustics.sweeps.scene import read_scene

        # What is wrong with the file is said before the engines are loaded.
        points = read_scene(file)
        from kerrcaustics.sweeps.run import sweep as run

        workers.announce()
        with progress(left=True) as report:
            return run(points, store, retry=retry, progress=report, **asdict(workers))
