"""Record what the program answers, and compare two records.

    python -m tests.golden record FOLDER [--only PATTERN]
    python -m tests.golden compare OLD NEW [--only PATTERN] [--renamed OLD=NEW ...]
                                           [--within X] [--errors X] [--cost X]

`record` asks every command that computes, for eight cameras (entries `cli.COMMAND.CAMERA`), and every analysis of the
library, over viewers and surfaces (`api.ANALYSIS.VIEWER.SURFACE`). Each answer is a file: the JSON of the command, the
result as the library saves it, or the message of a refusal. `index.json` says for each how many requests reached the
engines, with how many rays and beams, and how many seconds of all cores it took. Nothing found for one entry serves
another, so the order does not matter. PATTERN is one of the shell, as "api.*.far.*"; what is recorded later goes into
the same folder. A full record takes some minutes of one core.

`compare` reads the files without the package. It compares numbers and texts by the names of their fields; names of
classes do not count. For each entry it says "equal to the bit", or for each field the largest difference, also in units
of the error that is reported beside it (NAME_error, else error), which fields are gone and new, which messages changed,
and whether more rays and beams were traced. What took how long, and versions, are not compared.

--renamed  A field or class has a new name: `theta=level`. With the class (of the old record) or the field around it,
           only there: `PairEvent.time=moment`. `theta=` is gone on purpose, `=moment` is new on purpose.
--within   Differences up to X pass, relative to the number where that is above 1. 0 lets the sign of zeros differ.
--errors   Differences up to X times the reported error pass.
--cost     Up to X times as many requests, rays and beams pass; 1 by default.

Options can stand in a file, one in a line: `compare OLD NEW @renames.txt`. Exit status: 0 where all passes, else 1.
"""

import argparse
import sys
from pathlib import Path


def main() -> int:
    parser = argparse.ArgumentParser("python -m tests.golden", description=__doc__, fromfile_prefix_chars="@")
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    verbs = parser.add_subparsers(dest="verb", required=True)
    recording = verbs.add_parser("record")
    recording.add_argument("folder", type=Path)
    comparing = verbs.add_parser("compare", fromfile_prefix_chars="@")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    comparing.add_argument("--renamed", action="append", default=[], metavar="OLD=NEW")
    comparing.add_argument("--within", type=float, metavar="X")
    comparing.add_argument("--errors", type=float, metavar="X")
    comparing.add_argument("--cost", type=float, default=1.0, metavar="X")
    for verb in (recording, comparing):
        verb.add_argument("--only", default="*", metavar="PATTERN")
    given = parser.parse_args()
    if given.verb == "record":
        # The package is loaded here alone: records of any version can be compared.
        from tests.golden.record import record

        return record(given.folder, given.only)
    from tests.golden.compare import Passing, compare

    passing = Passing(given.within, given.errors, given.cost)
    return compare(given.old, given.new, given.only, given.renamed, passing)


if __name__ == "__main__":
    sys.exit(main())
