"""Workers that die or stay away: limits that a sweep or a film tolerates, and its end beyond them."""

from collections import Counter
from collections.abc import Callable, Generator
from time import monotonic
from typing import Any, NoReturn

Job = Any
"""The description of a job: hashable, and small enough to be sent."""

Compute = Callable[[Job], None]
"""The work of a worker on one job."""
Finished = Generator[tuple[Job, bool], None, None]
"""A job when it is done, with True if it was computed, False if every worker died with it."""

# Seconds without a worker until a message, and until the end.
SECONDS_UNTIL_SAID, SECONDS_BORNE = 30.0, 300.0
# Deaths with one job until it is given up.
MOST_DEATHS_WITH_A_JOB = 12
# Deaths for each worker, with no job computed in between, until the end.
_IN_A_ROW = 40


class WorkersLost(RuntimeError):
    """A sweep or a film ended because its workers died or stayed away; its store is kept."""

    def __init__(self, why: str, task: str = "sweep") -> None:
        super().__init__(f"{why}: the {task} ended. What its store holds is kept; start again to resume.")


class WorkerFailures:
    """Failures of the workers of a sweep or a film, as reported by the function that runs the jobs.

    The absence of workers is reported through `say`; beyond the limits WorkersLost is raised.
    """

    def __init__(self, say: Callable[[str], None], task: str = "sweep") -> None:
        self._say, self._task = say, task
        self._last_sign = monotonic()
        self._workers = 1
        self._deaths: Counter[Job] = Counter()
        self._in_a_row = 0

    def there_are(self, workers: int, starting: int = 0) -> None:
        """Report the number of workers at this moment; those that are starting may take any time."""
        now = monotonic()
        if workers:
            self._last_sign, self._workers = now, max(workers, self._workers)
            return
        absent = now - self._last_sign
        if absent > SECONDS_BORNE and not starting:
            self.end(f"No worker for {absent:.0f} s")
        if absent > SECONDS_UNTIL_SAID:
            self._say(f"no worker for {absent:.0f} s")

    def end(self, why: str) -> NoReturn:
        """Raise WorkersLost: nothing more can be computed."""
        raise WorkersLost(why, self._task)

    def computed(self) -> None:
        """Report a job that is done."""
        self._last_sign, self._in_a_row = monotonic(), 0

    def died(self, job: Job | None, times: int = 1) -> bool:
        """Report workers that died, with this job or before they had one; True while the job may be tried again."""
        self._in_a_row += times
        if self._in_a_row >= _IN_A_ROW * self._workers:
            self.end(f"Workers died {self._in_a_row} times without computing anything (too little memory?)")
        if job is None:
            return True
        self._last_sign = monotonic()
        self._deaths[job] += times
        return self._deaths[job] < MOST_DEATHS_WITH_A_JOB
