"""Where jobs are done: here, in processes of this machine, or on a cluster."""

from collections.abc import Callable
from functools import partial

from kerrcaustics.workers.losses import Compute, Finished, Job, Losses

Run = Callable[[Compute, list[Job], Losses], Finished]


def check_place(workers: int | None, scheduler: str | None) -> None:
    """Refuse what names no one place."""
    if workers is not None and scheduler is not None:
        raise ValueError("Arguments `workers` and `scheduler`: only one of them can be given.")
    if workers is not None and workers < 1:
        raise ValueError(f"Argument `workers` must be 1 or more, but is {workers}.")


def place(workers: int | None, scheduler: str | None, here: Run) -> Run:
    """What runs jobs, and yields each that is done with whether it is computed; `here` where no place is named."""
    if scheduler is not None:
        from kerrcaustics.workers.cluster import on_cluster

        return partial(on_cluster, scheduler)
    if workers is not None:
        from kerrcaustics.workers.processes import in_processes

        return partial(in_processes, workers)
    return here
