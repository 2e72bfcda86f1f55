"""Jobs on processes of this machine, of one core each; one that dies is replaced at once."""

import os
import signal
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from threading import Thread
from typing import cast

from kerrcaustics.files import remove_unfinished
from kerrcaustics.workers.worker_failures import Compute, Finished, Job, WorkerFailures

Crew = dict[Connection, BaseProcess]

# Below zero a process was killed; above, Python has written the error to standard error.
_NO_START = 'A worker could not start (exit status {}; does a script call this without `if __name__ == "__main__":`?)'
# Seconds between checks for workers.
_LOOK = 1.0
# The run time then depends on the number of workers alone.
_ONE_CORE: dict[str, str] = dict.fromkeys(("NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def in_processes(workers: int, compute: Compute, jobs: list[Job], worker_failures: WorkerFailures) -> Finished:
    """Compute jobs in a number of processes."""
    waiting = deque(jobs)
    # A process that is starting is in the crew, and not at work.
    crew: Crew = {}
    at_work: dict[Connection, Job] = {}
    try:
        while waiting or at_work:
            _fill_up(crew, min(workers, len(waiting) + len(at_work)), compute, worker_failures)
            worker_failures.there_are(len(at_work), starting=len(crew) - len(at_work))
            for pipe in cast("list[Connection]", wait(list(crew), _LOOK)):
                job = at_work.pop(pipe, None)
                if _is_ready(pipe):
                    if waiting:
                        at_work[pipe] = waiting.popleft()
                        # The death of a process is noticed at the next read.
                        with suppress(OSError):
                            pipe.send(at_work[pipe])
                    else:
                        _end(pipe, crew.pop(pipe))
                    if job is not None:
                        worker_failures.computed()
                        yield job, True
                else:
                    status = _end(pipe, crew.pop(pipe))
                    if job is None and status > 0:
                        worker_failures.end(_NO_START.format(status))
                    may_retry = worker_failures.died(job)
                    if job is not None and may_retry:
                        waiting.append(job)
                    elif job is not None:
                        yield job, False
    finally:
        for pipe, process in crew.items():
            _end(pipe, process)


def _fill_up(crew: Crew, size: int, compute: Compute, worker_failures: WorkerFailures) -> None:
    """Start processes until the crew has this size."""
    while len(crew) < size:
        try:
            pipe, process = _start(compute)
        except OSError:
            # No memory for another process; there may be some in a moment.
            worker_failures.died(None)
            time.sleep(_LOOK)
            return
        crew[pipe] = process


def _start(compute: Compute) -> tuple[Connection, BaseProcess]:
    """A new process, and the pipe for its jobs."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs, compute), daemon=True)
    with theirs, _surroundings():
        process.start()
    return cast("Connection", ours), process


@contextmanager
def _surroundings() -> Iterator[None]:
    """The environment of a new process: one core, and no Ctrl-C, which this process handles."""
    before = dict(os.environ)
    # Python's own helper, which would be started with the first of them, lets Ctrl-C through when it is.
    resource_tracker.ensure_running()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    os.environ.update(_ONE_CORE)
    try:
        yield
    finally:
        for name in _ONE_CORE:
            del os.environ[name]
            os.environ.update({name: before[name]} if name in before else {})
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _work(pipe: Connection, compute: Compute) -> None:
    """The work of a process: send None at the start, and after each job None or its error."""
    Thread(target=_end_with_parent, daemon=True).start()
    # When the other end is closed there is nobody to work for.
    with suppress(EOFError, OSError):
        pipe.send(None)
        while True:
            pipe.send(_error_of(compute, pipe.recv()))


def _error_of(compute: Compute, job: Job) -> Exception | None:
    try:
        compute(job)
    except Exception as error:
        return error
    return None


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
    remove_unfinished()
    os._exit(1)


def _is_ready(pipe: Connection) -> bool:
    """True if a process is ready for a job, False if it died; raise the error of its last job."""
    try:
        error = pipe.recv()
    except (EOFError, OSError):
        return False
    if error is not None:
        raise error
    return True


def _end(pipe: Connection, process: BaseProcess) -> int:
    """End a process that has nothing to do, and return its exit status."""
    process.kill()
    process.join()
    status = process.exitcode or 0
    process.close()
    pipe.close()
    return status
