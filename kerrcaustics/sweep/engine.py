"""Running a sweep: in this process, on workers of this machine, or on a Dask cluster."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from kerrcaustics.beams.trace import cores
from kerrcaustics.sweep.quantities import computed
from kerrcaustics.sweep.scene import AXES, Scene
from kerrcaustics.sweep.store import Block, Store, open_store

Progress = Callable[[str, float], None]

# How often a block may take its worker with it before it is given up.
_DEATHS = 20


def sweep(
    scene: Scene,
    path: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = lambda _what, _part: None,
) -> list[str]:
    """Compute what is missing in the store at `path`, which is made where there is none.

    Parameters
    ----------
    scene : Scene
        What `read_scene` returned.
    path : str or path
        The store. One of the same scene is gone on with; one of another scene is refused.
    workers : int
        So many processes of this machine; None, threads of this process.
    scheduler : str
        Instead: address of a Dask scheduler whose workers see the same file system, such as "tcp://host:8786".
    progress : callable
        Called with what is being done and which part of the points is.

    Returns
    -------
    list of str
        A line for each point that failed: where and why. They are not tried again.
    """
    if workers is not None and scheduler is not None:
        raise ValueError("Arguments `workers` and `scheduler`: only one of them can be given.")
    if workers is not None and workers < 1:
        raise ValueError(f"Argument `workers` must be 1 or more, but is {workers}.")
    store = open_store(Path(path), scene)
    blocks = store.blocks()
    progress("looking at what is done", 0.0)
    missing = [block for block in blocks if not store.is_done(block)]
    finished = len(blocks) - len(missing)
    progress(f"{finished} of {len(blocks)} blocks done", finished / len(blocks))
    with _runner(workers, scheduler) as run:
        for _ in run(str(store.path.absolute()), missing):
            finished += 1
            progress(f"{finished} of {len(blocks)} blocks done", finished / len(blocks))
    return store.failures()


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


Run = Callable[[str, list[Block]], Iterator[Any]]


@contextmanager
def _runner(workers: int | None, scheduler: str | None) -> Iterator[Run]:
    """What runs blocks and yields as each is done."""
    if workers is None and scheduler is None:
        yield _in_threads
        return
    try:
        from dask import config
        from distributed import Client, LocalCluster, as_completed as completed
    except ImportError:
        raise ImportError('Workers need the package dask: pip install "kerrcaustics[sweep]"') from None

    def run(path: str, blocks: list[Block]) -> Iterator[Any]:
        # The same block again after its worker died: what it writes is the same.
        futures = client.map(lambda block: compute_block(path, block), blocks, pure=False, retries=_DEATHS)
        for future in completed(futures, loop=client.loop):
            future.result()
            yield future

    with config.set({"distributed.scheduler.allowed-failures": _DEATHS, "distributed.worker.daemon": True}):
        if scheduler is not None:
            with Client(scheduler, timeout="30s", set_as_default=False) as client:
                yield run
            return
        # One thread a worker: the workers share the cores.
        with (
            LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            yield run


def _in_threads(path: str, blocks: list[Block]) -> Iterator[Any]:
    with ThreadPoolExecutor(cores()) as pool:
        futures = [pool.submit(compute_block, path, block) for block in blocks]
        try:
            for future in as_completed(futures):
                future.result()
                yield future
        finally:
            for future in futures:
                future.cancel()
