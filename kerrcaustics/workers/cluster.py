"""Jobs on the workers of a running Dask cluster."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from kerrcaustics.extras import needed
from kerrcaustics.workers.worker_failures import Compute, Finished, Job, WorkerFailures

# Jobs that the scheduler holds at a time.
_IN_FLIGHT = 20_000
SECONDS_BETWEEN_LOOKS = 5.0
"""Seconds without news after which the scheduler is queried for its workers."""
FIRST_ANSWER = 30.0
"""Seconds within which the scheduler must answer first."""
# Seconds within which it must answer later.
_ANSWER = 10.0


def on_cluster(scheduler: str, compute: Compute, jobs: list[Job], worker_failures: WorkerFailures) -> Finished:
    """Compute jobs on the workers of a scheduler at this address."""
    waiting = iter(jobs)
    at_work: dict[Any, Job] = {}
    done: SimpleQueue[Any] = SimpleQueue()
    with client_of(scheduler) as client:

        def submit(job: Job) -> None:
            future = client.submit(compute, job, pure=False)
            at_work[future.key] = job
            future.add_done_callback(done.put)

        for job in islice(waiting, _IN_FLIGHT):
            submit(job)
        while at_work:
            try:
                future = done.get(timeout=SECONDS_BETWEEN_LOOKS)
            except Empty:
                worker_failures.there_are(_workers(client))
                continue
            job, deaths = at_work.pop(future.key), _deaths(future, worker_failures)
            if not deaths:
                worker_failures.computed()
            elif worker_failures.died(job, deaths):
                submit(job)
                continue
            yield job, not deaths
            for following in islice(waiting, 1):
                submit(following)


@contextmanager
def client_of(scheduler: str) -> Iterator[Any]:
    """A client of the Dask scheduler at an address."""
    Client = needed("sweep", "distributed").Client
    with _quiet():
        try:
            client = Client(scheduler, timeout=FIRST_ANSWER, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ValueError(
                f"Argument `scheduler` must be the address of a Dask scheduler, but {scheduler!r} does not answer "
                f"({' '.join(str(error).split())})."
            ) from None
        with client:
            yield client


def _workers(client: Any) -> int:
    """Number of workers that take jobs; 0 if the scheduler does not answer."""
    try:
        return len(client.sync(client.scheduler.ncores_running, callback_timeout=_ANSWER))
    except OSError:
        return 0


def _deaths(future: Any, worker_failures: WorkerFailures) -> int:
    """Number of workers that died with a job before the scheduler gave it up; 0 if the job is done."""
    from distributed import KilledWorker

    if future.status == "cancelled":
        worker_failures.end("The Dask scheduler went away")
    # The result is in the store: nothing is fetched from the worker, which may be dead.
    error = None if future.status == "finished" else future.exception()
    if isinstance(error, KilledWorker):
        return error.allowed_failures + 1
    if error is not None:
        raise error
    return 0


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the log of Dask, which does not concern the user."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
