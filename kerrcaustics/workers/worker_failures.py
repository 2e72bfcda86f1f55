"""Workers that die or stay away: how much of it a sweep or a film bears, and how it ends."""

from collections import Counter
from collections.abc import Callable, Generator
from time import monotonic
from typing import Any, NoReturn

Job = Any
"""What one job is told by: hashable, and small enough to be sent."""

Compute = Callable[[Job], None]
"""What a worker does."""
Finished = Generator[tuple[Job, bool], None, None]
"""Each job when it is done, and whether it is computed: not so where every worker died with it."""

# Seconds without a worker after which that is said, and after which all ends.
_SAID, _BORNE = 30.0, 300.0
# Deaths with one job after which it is given up.
_WITH_A_JOB = 12
# Deaths for each worker, with no job computed in between, after which all ends.
_IN_A_ROW = 40


class WorkersLost(RuntimeError):
    """A sweep or a film ended because its workers died or stayed away; what it stored is kept."""

    def __init__(self, why: str, task: str = "sweep") -> None:
        super().__init__(f"{why}: the {task} ended. What its store holds is kept; start again to go on.")


class WorkerFailures:
    """What is known of the workers of a sweep or a film. Whoever runs jobs tells it what happens.

    It says `say` when there has been no worker for a while, and raises WorkersLost when there is no hope.
    """

    def __init__(self, say: Callable[[str], None], task: str = "sweep") -> None:
        self._say, self._task = say, task
        self._seen = monotonic()
        self._workers = 1
        self._deaths: Counter[Job] = Counter()
        self._in_a_row = 0

    def there_are(self, workers: int, starting: int = 0) -> None:
        """So many workers can compute at this moment; for those that are starting it waits, however long they take."""
        now = monotonic()
        if workers:
            self._seen, self._workers = now, max(workers, self._workers)
            return
        absent = now - self._seen
        if absent > _BORNE and not starting:
            self.end(f"No worker for {absent:.0f} s")
        if absent > _SAID:
            self._say(f"no worker for {absent:.0f} s")

    def end(self, why: str) -> NoReturn:
        """Nothing more can be computed."""
        raise WorkersLost(why, self._task)

    def computed(self) -> None:
        """A job is done."""
        self._seen, self._in_a_row = monotonic(), 0

    def died(self, job: Job | None, times: int = 1) -> bool:
        """Workers died, with this job or before they had one; True while the job may be tried again."""
        self._in_a_row += times
        if self._in_a_row >= _IN_A_ROW * self._workers:
            self.end(f"Workers died {self._in_a_row} times without computing anything (too little memory?)")
        if job is None:
            return True
        self._seen = monotonic()
        self._deaths[job] += times
        return self._deaths[job] < _WITH_A_JOB
