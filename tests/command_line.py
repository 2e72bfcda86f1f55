"""The command line, run in the process of the tests."""

import math
import sys

from kerrcaustics import cli
from kerrcaustics.cli import terminal

# On a busy machine commands of other tests would say that they are at work.
terminal.FIRST_LINE = math.inf


def run(capsys, *arguments):
    """Exit status, standard output and standard error of the command line, run in this process."""
    status = 0
    old, sys.argv = sys.argv, ["kerrcaustics", *map(str, arguments)]
    try:
        cli.main()
    except SystemExit as stop:
        status = stop.code or 0
    finally:
        sys.argv = old
    captured = capsys.readouterr()
    return status, captured.out, captured.err
