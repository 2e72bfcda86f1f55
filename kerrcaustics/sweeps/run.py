"""Running a sweep: in this process, on workers of this machine, or on a Dask cluster."""

import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kerrcaustics.beams.trace import cores
from kerrcaustics.results.declared import quantity, result
from kerrcaustics.results.progress import Progress, report, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime.checks import flags, instance_of
from kerrcaustics.sweeps.opened import open_sweep
from kerrcaustics.sweeps.quantities import computed
from kerrcaustics.sweeps.scene import AXES, Scene, checked
from kerrcaustics.sweeps.store import DAMAGED, KEPT, Block, Store, opened_again, store_at
from kerrcaustics.workers.places import check_answer, check_place, place
from kerrcaustics.workers.worker_failures import Compute, Finished, WorkerFailures

if TYPE_CHECKING:
    from xarray import Dataset

_DIED = "the process that computed it died each time (too little memory?)"


@result("sweep-result/1")
class SweepResult(Shown):
    """The outcome of a sweep."""

    path: Path = quantity("", "", "the store")
    points: int = quantity("", "1", "points of the sweep")
    before: int = quantity("", "1", "points that were in the store at the start")
    failures: tuple[str, ...] = quantity(
        "", "", "a line for each point that failed, now or before, with its place and the reason"
    )
    seconds: float = quantity("", "s", "time it took")
    damaged: int = quantity("", "1", "points whose chunks were damaged, and were computed again", default=0)
    mended: tuple[str, ...] = quantity(
        "", "", "axes and descriptions in the store that were lost or altered, and were written again", default=()
    )

    def dataset(self) -> "Dataset":
        """The store as a Dataset of xarray, with the reasons of failed points as text."""
        return open_sweep(self.path)


@with_progress
def sweep(
    scene: Scene,
    path: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Progress | bool | None = None,
) -> SweepResult:
    """Compute the missing points of the store at `path`, which is made if there is none.

    A sweep that was interrupted, at any moment and also by a power cut of its workers, resumes when it is started
    again; the store ends up the same to the bit. Errors of the disk end a sweep and leave the stored points unchanged.

    Parameters
    ----------
    scene : Scene
        The sweep of a file, as `read_scene` returns it.
    path : str or path
        The store. One of the same sweep is resumed, and its damaged parts are mended; for one of another sweep
        ValueError is raised.
    workers : int
        Number of processes of this machine, of one core each; None, threads of this process.
    scheduler : str
        In place of workers: address of a Dask scheduler whose workers see the same file system, such as "tcp://host:8786".
    retry : bool
        True to try points that failed before again.
    progress : callable or bool, optional
        As for `caustics`; the part is that of the points that are computed.

    Returns
    -------
    SweepResult
        Among other things, a line for each point that failed. A point inside the horizon is one of them, and does not
        affect others; so are the points of a block on which twelve workers died.

    Raises
    ------
    ValueError
        If an argument is invalid.
    kerrcaustics.workers.worker_failures.WorkersLost
        If workers died repeatedly without computing anything, a cluster had none for five minutes, or its scheduler
        went away. The store holds all points computed so far.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.sweep(kc.read_scene("scene.toml"), "scene.zarr")  # doctest: +SKIP
    """
    instance_of("scene", scene, Scene)
    flags(retry=retry)
    check_place(workers, scheduler)
    began = time.perf_counter()
    checked(scene, "Argument `scene`")
    # Before a store is made that would stay empty.
    check_answer(scheduler)
    total = int(np.prod(scene.shape))
    with store_at(Path(path), scene) as store:
        report("reading the store", 0.0)
        states = _states(store, retry)
        missing = [block for block, state in states.items() if state != KEPT]
        damaged = sum(len(block) for block, state in states.items() if state == DAMAGED)
        before = done = total - sum(map(len, missing))
        report(f"{done} of {total} points", done / total)
        if missing:
            worker_failures = WorkerFailures(lambda what: report(f"{done} of {total} points, {what}", done / total))
            compute, run = partial(compute_block, str(store.path.absolute())), place(workers, scheduler, _in_threads)
            with closing(run(compute, missing, worker_failures)) as finished:
                for block, known in finished:
                    if not known:
                        store.write(block, [_DIED] * len(block))
                    done += len(block)
                    report(f"{done} of {total} points", done / total)
        failures, took = tuple(store.failures()), time.perf_counter() - began
        return SweepResult(store.path, total, before, failures, took, damaged, store.mended)


def _states(store: Store, retry: bool) -> dict[Block, str]:
    """The state of each block in the store."""
    blocks = store.blocks()
    with ThreadPoolExecutor(cores()) as pool:
        return dict(zip(blocks, pool.map(partial(store.state, retry=retry), blocks), strict=True))


def compute_block(path: str, block: Block) -> None:
    """Compute the points of a block and store them: the work of a worker."""
    store = opened_again(Path(path))
    values = dict(zip(AXES, (store.scene.values(axis) for axis in AXES), strict=True))
    spin, inclination = float(values["spin"][block.spin]), float(values["inclination"][block.inclination])
    points: list[dict[str, np.ndarray] | str] = []
    for radius in values["radius"][slice(*block.radii)].tolist():
        try:
            point = computed(store.scene, spin, radius, inclination)
        except Exception as error:
            # A point that fails does not affect the others: the reason is stored in its place.
            point = " ".join(f"{error}".split()) or type(error).__name__
        points.append(point)
    store.write(block, points)


def _in_threads(compute: Compute, blocks: list[Block], _worker_failures: WorkerFailures) -> Finished:
    with ThreadPoolExecutor(cores()) as pool:
        futures = {pool.submit(compute, block): block for block in blocks}
        try:
            for future in as_completed(futures):
                future.result()
                yield futures[future], True
        finally:
            for future in futures:
                future.cancel()
