"""Workers that die or stay away: how much of it a sweep bears, and how it ends."""

from collections import Counter
from collections.abc import Callable, Generator
from time import monotonic

from kerrcaustics.sweeps.store import Block

Compute = Callable[[Block], None]
"""What a worker does."""
Finished = Generator[tuple[Block, bool], None, None]
"""Each block when it is done, and whether it is computed: not so where every worker died with it."""

# Seconds without a worker after which that is said, and after which the sweep ends.
_SAID, _BORNE = 30.0, 300.0
# Deaths with one block after which its points are given up.
_WITH_A_BLOCK = 12
# Deaths for each worker, with no block computed in between, after which the sweep ends.
_IN_A_ROW = 40


class WorkersLost(RuntimeError):
    """A sweep ended because its workers died or stayed away; what it stored is kept."""

    def __init__(self, why: str) -> None:
        super().__init__(f"{why}: the sweep ended. What its store holds is kept; start again to go on.")


class Losses:
    """What is known of the workers of a sweep that is running. Whoever runs blocks tells it what happens.

    It says `say` when there has been no worker for a while, and raises WorkersLost when there is no hope.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._seen = monotonic()
        self._workers = 1
        self._deaths: Counter[Block] = Counter()
        self._in_a_row = 0

    def there_are(self, workers: int, starting: int = 0) -> None:
        """So many workers can compute at this moment; for those that are starting it waits, however long they take."""
        now = monotonic()
        if workers:
            self._seen, self._workers = now, max(workers, self._workers)
            return
        absent = now - self._seen
        if absent > _BORNE and not starting:
            raise WorkersLost(f"No worker for {absent:.0f} s")
        if absent > _SAID:
            self._say(f"no worker for {absent:.0f} s")

    def computed(self) -> None:
        """A block is done."""
        self._seen, self._in_a_row = monotonic(), 0

    def died(self, block: Block | None, times: int = 1) -> bool:
        """Workers died, with this block or before they had one; True while the block may be tried again."""
        self._in_a_row += times
        if self._in_a_row >= _IN_A_ROW * self._workers:
            raise WorkersLost(f"Workers died {self._in_a_row} times without computing anything (too little memory?)")
        if block is None:
            return True
        self._seen = monotonic()
        self._deaths[block] += times
        return self._deaths[block] < _WITH_A_BLOCK
