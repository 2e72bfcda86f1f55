"""The command `sweep`."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import cyclopts

from kerrcaustics.cli.app import BadInput, app, one_line, stop, with_examples
from kerrcaustics.cli.options import COMMON, CommonOptions, FileName, Flag, WholeNumber
from kerrcaustics.cli.outputs import check_store
from kerrcaustics.cli.terminal import plain_errors, progress, say
from kerrcaustics.interrupts import NOTHING_LEFT, on_interrupt

if TYPE_CHECKING:
    from kerrcaustics.sweeps.run import SweepResult

# Lines about failed points that are printed; the store has them all.
_SHOWN = 20


@app.command(**with_examples("sweep scene.toml --workers 2 --output sweep.zarr"))
def sweep(
    scene: FileName,
    /,
    *,
    output: FileName | None = None,
    workers: WholeNumber | None = None,
    scheduler: str | None = None,
    resume: Annotated[bool, cyclopts.Parameter(negative="--no-resume")] = True,
    retry: Flag = False,
    common: CommonOptions = COMMON,
) -> None:
    """Compute caustics over spin, radius and inclination, as a scene file says, into one zarr store.

    An interrupted sweep resumes when it is started again.

    Parameters
    ----------
    scene
        The scene, a TOML file: see docs/sweeps.md.
    output
        The store; by default in this folder, named like the scene, with the ending .zarr.
    workers
        Compute in so many processes of this machine. By default in the threads of one.
    scheduler
        Compute on the Dask cluster with this scheduler, such as tcp://host:8786, whose workers see the same files.
    resume
        Go on with a store that is there; or else refuse it.
    retry
        Try again the points that failed before.
    """
    if workers is not None and scheduler is not None:
        raise BadInput("Arguments --workers and --scheduler: only one of them can be given.")
    store = output or Path(f"{scene.stem}.zarr")
    check_store("--output", store)
    common.check()
    if store.exists() and not resume:
        raise BadInput(f"Argument --output must name a new store where --no-resume is given, but {store} is there.")
    on_interrupt(
        lambda: f"what was computed is kept in {store}; start again to go on." if store.exists() else NOTHING_LEFT
    )
    result = _swept(scene, store, workers, scheduler, retry)
    from kerrcaustics.results.records import record

    done = f"{result.before} done before, {result.points - result.before} computed now, {len(result.failures)} failed"
    common.write(record(result))
    out = common.console()
    say(out, f"{result.points} points: {done}; {result.seconds:.1f} s")
    if result.damaged:
        say(out, f"{result.damaged} points were damaged in the store, and are computed anew")
    if result.mended:
        say(out, f"{len(result.mended)} files that describe the store were lost or altered, and are written anew")
    say(out, f"Store: {store}")
    if result.failures:
        _tell_failures(result)


def _tell_failures(result: "SweepResult") -> NoReturn:
    lines = [f"failed: {line}" for line in result.failures[:_SHOWN]]
    more = len(result.failures) - _SHOWN
    if more > 0:
        lines.append(f"... and {more} more; status and reason in the store tell them all")
    sys.stderr.write("".join(f"{line}\n" for line in lines))
    stop(1, f"{len(result.failures)} of {result.points} points failed.")


def _swept(scene: Path, store: Path, workers: int | None, scheduler: str | None, retry: bool) -> "SweepResult":
    try:
        return _run(scene, store, workers, scheduler, retry)
    except ImportError as error:
        raise BadInput(one_line(str(error))) from None
    except OSError as error:
        reason = error.strerror or one_line(str(error))
        kept = "What it holds is kept; start again to go on." if store.exists() else "Nothing of it is left."
        stop(1, f"The store {store} cannot be written: {reason}. {kept}")
    except BadInput:
        raise
    except ValueError as error:
        raise BadInput(one_line(str(error))) from None


def _run(scene: Path, store: Path, workers: int | None, scheduler: str | None, retry: bool) -> "SweepResult":
    from kerrcaustics.workers.worker_failures import WorkersLost

    try:
        with plain_errors({"path": "output"}), progress(left=True) as report:
            from kerrcaustics.sweeps.run import sweep as run
            from kerrcaustics.sweeps.scene import read_scene

            return run(read_scene(scene), store, workers=workers, scheduler=scheduler, retry=retry, progress=report)
    except WorkersLost as lost:
        stop(1, str(lost))
