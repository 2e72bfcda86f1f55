"""Places of execution: this process, processes of this machine, or a cluster."""

import re
from collections.abc import Callable
from functools import partial
from http import HTTPStatus

from kerrcaustics.workers.worker_failures import Compute, Finished, Job, WorkerFailures

# Addresses of schedulers; Dask waits for ever for an invalid one.
_ADDRESS = re.compile(r"(inproc://.+|((tcp|tls|ucx|ws|wss)://)?(\[[0-9a-fA-F:.]+\]|[\w.-]+):(\d{1,5}))")

# Seconds within which the page of the dashboard must answer.
_PAGE_ANSWER = 2.0

Run = Callable[[Compute, list[Job], WorkerFailures], Finished]


def check_place(workers: int | None, scheduler: str | None) -> None:
    """Raise ValueError unless the arguments name one place."""
    if workers is not None and scheduler is not None:
        raise ValueError("Arguments `workers` and `scheduler`: only one of them can be given.")
    if workers is not None and workers < 1:
        raise ValueError(f"Argument `workers` must be 1 or more, but is {workers}.")
    address = None if scheduler is None else _ADDRESS.fullmatch(scheduler)
    if scheduler is not None and (address is None or int(address[5] or 0) > 65535):
        raise ValueError(
            "Argument `scheduler` must be the address of a Dask scheduler, such as tcp://host:8786, "
            f"but is {scheduler!r}."
        )


def check_answer(scheduler: str | None) -> None:
    """Raise ValueError unless the scheduler answers."""
    if scheduler is not None:
        dashboard_of(scheduler)


def dashboard_of(scheduler: str) -> str | None:
    """Address of the dashboard of a scheduler, None if it has none; raise ValueError unless the scheduler answers."""
    from kerrcaustics.workers.cluster import client_of

    with client_of(scheduler) as client:
        try:
            link = client.dashboard_link
        except KeyError:
            return None
        return None if link is None or _is_missing(link) else link


def _is_missing(link: str) -> bool:
    """True if the scheduler says that it has no such page: Dask names one even if the dashboard is switched off."""
    from urllib.error import HTTPError
    from urllib.request import ProxyHandler, build_opener

    try:
        # Proxies of the environment lead elsewhere.
        build_opener(ProxyHandler({})).open(link, timeout=_PAGE_ANSWER).close()
    except HTTPError as error:
        return error.code == HTTPStatus.NOT_FOUND
    except (OSError, ValueError):
        # Other machines may reach it.
        return False
    return False


def place(workers: int | None, scheduler: str | None, here: Run) -> Run:
    """The function that runs jobs, and yields each with True if it was computed; `here` if no place is named."""
    if scheduler is not None:
        from kerrcaustics.workers.cluster import on_cluster

        return partial(on_cluster, scheduler)
    if workers is not None:
        from kerrcaustics.workers.processes import in_processes

        return partial(in_processes, workers)
    return here
