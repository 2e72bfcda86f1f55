"""Hard cases until something breaks: the study in any size.

    python -m studies.adversary.hunt [cases] [seed] [rays a case] [share compared with the truth]

Prints the table of claims after every tenth part, and every new worst case as Python.
"""

import sys
import time
from collections.abc import Callable, Iterable

import numpy as np

from kerrcaustics.report.tables import text_table

from .cases import Case, cases
from .tally import Tally
from .trials import TRIALS, Trial, judge

Report = Callable[[int, Tally], None]


def hunt(
    found: Iterable[Case],
    sampled: float,
    reported: Report = lambda i, tally: None,
    trials: tuple[Trial, ...] = TRIALS,
) -> Tally:
    """The claims of all trials of cases; `reported` hears after each of the cases.

    sampled: the share of the rays that are compared with the truth although both engines agree.
    """
    tally = Tally()
    for i, case in enumerate(found):
        tally.add_case(list(judge(case, trials, sampled, np.random.default_rng(i))))
        reported(i, tally)
    return tally


def main() -> None:
    numbers = [float(x) for x in sys.argv[1:]]
    count, seed, rays, sampled = (*numbers, *(100, 1, 63, 0.01)[len(numbers) :])
    started, reported = time.process_time(), set()

    def tell(i: int, tally: Tally) -> None:
        for one in tally.broken(3.0):
            if (one.claim, one.code) not in reported:
                reported.add((one.claim, one.code))
                print(one, flush=True)
        if (i + 1) % max(int(count) // 10, 1) == 0:
            print(text_table(*tally.table("trial")))
            seconds = time.process_time() - started
            print(f"{tally.rays} rays, {tally.truths} truths, {tally.unknown} unknown, {seconds:.0f} s", flush=True)

    tally = hunt(cases(int(count), int(seed), int(rays)), sampled, tell)
    for kind in ("end", "direction", "camera"):
        print(text_table(*tally.table(kind)))


if __name__ == "__main__":
    main()
