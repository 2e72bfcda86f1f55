"""Hard cases until something breaks: the study in any size.

    python -m studies.adversary.hunt [cases] [seed] [rays a case] [share compared with the truth]

Prints the table of claims after every tenth part, and every new worst case as Python.
"""

import sys
import time
from collections.abc import Callable

import numpy as np

from kerrcaustics.report.tables import text_table

from .cases import cases
from .tally import Tally
from .trials import TRIALS, judge


def hunt(
    count: int, seed: int, rays: int, sampled: float, told: Callable[[int, Tally], None] = lambda i, tally: None
) -> Tally:
    """So many cases of so many rays, in all trials; `told` hears after each of them."""
    tally = Tally()
    for i, case in enumerate(cases(count, seed, rays)):
        rng = np.random.default_rng((seed, i, 1))
        for k, judged in enumerate(judge(case, TRIALS, sampled, rng)):
            tally.add(judged)
            if k == 0:
                tally.rays += len(case.sky)
                tally.truths += int(judged.by_truth.sum())
                tally.unknown += int(judged.unknown.sum())
        told(i, tally)
    return tally


def main() -> None:
    numbers = [float(x) for x in sys.argv[1:]]
    count, seed, rays, sampled = (*numbers, *(100, 1, 63, 0.01)[len(numbers) :])
    started, told = time.process_time(), set()

    def tell(i: int, tally: Tally) -> None:
        for one in tally.broken(3.0):
            text = str(one)
            if text not in told:
                told.add(text)
                print(text, flush=True)
        if (i + 1) % max(int(count) // 10, 1) == 0:
            print(text_table(*tally.table("trial")))
            print(
                f"{tally.rays} rays, {tally.truths} truths, {tally.unknown} unknown, {time.process_time() - started:.0f} s",
                flush=True,
            )

    tally = hunt(int(count), int(seed), int(rays), sampled, tell)
    for kind in ("end", "direction", "camera"):
        print(text_table(*tally.table(kind)))


if __name__ == "__main__":
    main()
