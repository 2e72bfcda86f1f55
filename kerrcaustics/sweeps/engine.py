"""Running a sweep: in this process, on workers of this machine, or on a Dask cluster."""

import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from kerrcaustics.beams.trace import cores
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.sweeps.quantities import computed
from kerrcaustics.sweeps.scene import AXES, Scene, checked
from kerrcaustics.sweeps.store import Block, Store, open_store

Progress = Callable[[str, float], None]
Run = Callable[[str, list[Block]], Iterator[Block]]

# A block may take so many rounds of workers with it before its points are given up.
_ROUNDS = 5
# Blocks that the scheduler holds at a time.
_IN_FLIGHT = 20_000
# Workers do no profiling, and keep the memory that they are about to need again: together a fifth of their time.
_WORKER_CONFIG = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
}
_DIED = "the process that computed it died each time (too little memory?)"


@result("sweep-result/1")
class SweepResult:
    """What a sweep did."""

    path: Path = quantity("", "", "the store")
    points: int = quantity("", "1", "points of the scene")
    before: int = quantity("", "1", "how many of them were in the store at the start")
    failures: tuple[str, ...] = quantity("", "", "a line for each point that failed, now or before, with where and why")
    seconds: float = quantity("", "s", "time it took")


def sweep(
    scene: Scene,
    path: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Progress = lambda _what, _part: None,
) -> SweepResult:
    """Compute what is missing in the store at `path`, which is made where there is none.

    Interrupted at any moment, also by a power cut of its workers, it is started again and goes on; the store ends up
    the same to the bit. Errors of the disk end it and leave what was stored as it is.

    Parameters
    ----------
    scene : Scene
        What `read_scene` returned.
    path : str or path
        The store. One of the same scene is gone on with; one of another scene is refused.
    workers : int
        So many processes of this machine, of one core each; None, threads of this process.
    scheduler : str
        Instead: address of a Dask scheduler whose workers see the same file system, such as "tcp://host:8786".
    retry : bool
        Whether points that failed before are tried again.
    progress : callable
        Called with what is being done and which part of the points is.

    Returns
    -------
    SweepResult
        Among others a line for each point that failed. A point inside the horizon is one; it costs no other.
    """
    if workers is not None and scheduler is not None:
        raise ValueError("Arguments `workers` and `scheduler`: only one of them can be given.")
    if workers is not None and workers < 1:
        raise ValueError(f"Argument `workers` must be 1 or more, but is {workers}.")
    began = time.perf_counter()
    total = int(np.prod(scene.shape))
    store = open_store(Path(path), checked(scene, "that is given"))
    with store.locked():
        store.clean()
        progress("looking at what is done", 0.0)
        missing = _missing(store, retry)
        before = done = total - sum(map(len, missing))
        progress(f"{done} of {total} points", done / total)
        if missing:
            with _runner(workers, scheduler) as run:
                for block in run(str(store.path.absolute()), missing):
                    done += len(block)
                    progress(f"{done} of {total} points", done / total)
        return SweepResult(store.path, total, before, tuple(store.failures()), time.perf_counter() - began)


def _missing(store: Store, retry: bool) -> list[Block]:
    """Blocks that are still to be computed."""
    blocks = store.blocks()
    with ThreadPoolExecutor(cores()) as pool:
        finished = pool.map(partial(store.is_done, retry=retry), blocks)
        return [block for block, done in zip(blocks, finished, strict=True) if not done]


def compute_block(path: str, block: Block) -> None:
    """Compute the points of a block and store them: what a worker does."""
    store = Store(Path(path))
    values = dict(zip(AXES, (store.scene.values(axis) for axis in AXES), strict=True))
    spin, inclination = float(values["spin"][block.spin]), float(values["inclination"][block.inclination])
    points: list[dict[str, np.ndarray] | str] = []
    for radius in values["radius"][slice(*block.radii)].tolist():
        try:
            point = computed(store.scene, spin, radius, inclination)
        except Exception as error:
            # One point never costs the others: what is wrong with it is kept in its place.
            point = " ".join(f"{error}".split()) or type(error).__name__
        points.append(point)
    store.write(block, points)


@contextmanager
def _runner(workers: int | None, scheduler: str | None) -> Iterator[Run]:
    """What runs blocks and yields each that is done."""
    if workers is None and scheduler is None:
        yield _in_threads
        return
    try:
        from dask import config
        from distributed import Client, LocalCluster
    except ImportError:
        raise ImportError(
            'Workers need the package dask[distributed]: pip install "kerrcaustics[sweep]"', name="distributed"
        ) from None
    with ExitStack() as stack:
        stack.enter_context(_quiet())
        if scheduler is None:
            stack.enter_context(config.set(_WORKER_CONFIG))
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                dashboard_address="",
                silence_logs=logging.CRITICAL,
                # One core each, XLA included: how long a sweep takes then depends on their number alone.
                env={"NPROC": "1"},
            )
            stack.enter_context(cluster)
            client = Client(cluster, set_as_default=False)
        else:
            client = _client_of(scheduler)
        yield partial(_on_cluster, stack.enter_context(client))


def _client_of(scheduler: str) -> Any:
    """A client of the Dask scheduler at an address."""
    from distributed import Client

    try:
        return Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"Argument `scheduler` must be the address of a Dask scheduler, but {scheduler!r} does not answer "
            f"({' '.join(str(error).split())})."
        ) from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Dask's remarks about its own workings are no news to who waits for a sweep."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client", "distributed.nanny")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _on_cluster(client: Any, path: str, blocks: list[Block]) -> Iterator[Block]:
    from distributed import KilledWorker, as_completed as completed

    waiting = iter(blocks)
    deaths: dict[Block, int] = {}
    at_work: dict[Any, Block] = {}
    done = completed(loop=client.loop)

    def submit(block: Block) -> None:
        future = client.submit(compute_block, path, block, pure=False)
        at_work[future.key] = block
        done.add(future)

    for block in islice(waiting, _IN_FLIGHT):
        submit(block)
    for future in done:
        block = at_work.pop(future.key)
        try:
            future.result()
        except KilledWorker:
            # Computed again, the same numbers come out.
            deaths[block] = deaths.get(block, 0) + 1
            if deaths[block] < _ROUNDS:
                submit(block)
                continue
            Store(Path(path)).write(block, [_DIED] * len(block))
        yield block
        for following in islice(waiting, 1):
            submit(following)


def _in_threads(path: str, blocks: list[Block]) -> Iterator[Block]:
    with ThreadPoolExecutor(cores()) as pool:
        futures = {pool.submit(compute_block, path, block): block for block in blocks}
        try:
            for future in as_completed(futures):
                future.result()
                yield futures[future]
        finally:
            for future in futures:
                future.cancel()
