"""Random cases of analyses, each held against an independent truth, until something breaks.

    python -m studies.adversary.analyses [NAMES or all] COUNT [SEED]

NAMES are kinds with commas between them: KINDS of the modules of this folder. Prints every new worst case beyond its
reported error as Python, and in the end, or when it is interrupted, the table of claims.
"""

import signal
import sys
import time

from kerrcaustics.report.tables import text_table

from .claim import Claim
from .driver import Findings, try_cases
from .kinds import chosen_kinds

_SEED = 2073


def main(words: list[str]) -> int:
    """Try the cases; return 1 if a claim is broken."""
    names, numbers = ("all", words) if words[0].isdigit() else (words[0], words[1:])
    count, seed = (*(int(word) for word in numbers), _SEED)[:2]
    kinds, findings, started = chosen_kinds(names), Findings(), time.process_time()

    def hear(number: int, kind: str, worst: list[Claim]) -> None:
        for claim in worst:
            print(f"{kind} {number}, {claim.name}: {claim.ratio:.3g} times: {claim.code}", flush=True)

    # In the background too, where shells have the first of them ignored.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        try_cases(kinds, count, seed, findings, hear)
    except KeyboardInterrupt:
        print("interrupted")
    print(text_table(*findings.table()))
    print("\n".join(findings.sentences()))
    print(f"{time.process_time() - started:.0f} s")
    return int(bool(findings.broken()))


if __name__ == "__main__":
    if not sys.argv[1:]:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1:]))
