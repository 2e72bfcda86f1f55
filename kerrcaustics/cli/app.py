"""The program itself: what runs a command, and how it ends."""

import logging
import os
import signal
import sys
from functools import partial
from importlib.metadata import version
from typing import NoReturn

import cyclopts

from kerrcaustics.cli.complaints import complaint
from kerrcaustics.files import remove_unfinished

app = cyclopts.App(
    name="kerrcaustics",
    help="Caustics, critical curves and star images of a spinning (Kerr) black hole, on the sky of a camera near it.",
    version=lambda: version("kerrcaustics"),
    suppress_keyboard_interrupt=False,
    default_parameter=cyclopts.Parameter(negative=()),
)


class BadInput(ValueError):
    """Something the user gave that cannot be: exit status 2, one line."""


def main() -> None:
    """Run the command line and exit: 0 done, 2 bad input (one line on standard error), 1 anything else."""
    on_interrupt(1, "nothing was left half-written.")
    # Where its folder cannot be written to, it takes another one, and need not say so.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        app(sys.argv[1:], exit_on_error=False, print_error=False)
    except cyclopts.CycloptsError as error:
        stop(2, complaint(error))
    except BadInput as error:
        stop(2, str(error))
    except Exception as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        stop(1, f"{type(error).__name__}: {one_line(str(error))} (KERRCAUSTICS_TRACEBACK=1 shows where)")


def one_line(text: str) -> str:
    """The text without line breaks."""
    return " ".join(text.split())


def on_interrupt(status: int, line: str) -> None:
    """From now on Ctrl-C ends the program with this status and line."""
    signal.signal(signal.SIGINT, partial(_interrupted, status, line))


def _interrupted(status: int, line: str, *_: object) -> None:
    """End at once: an exception could be swallowed inside a compiled library."""
    remove_unfinished()
    # A progress bar hides the cursor while it runs.
    show_cursor = "\x1b[?25h\n" if sys.stderr.isatty() else ""
    sys.stderr.write(f"{show_cursor}kerrcaustics: Interrupted: {line}\n")
    sys.stderr.flush()
    os._exit(status)


def stop(status: int, line: str) -> NoReturn:
    """End with one line on standard error."""
    sys.stderr.write(f"kerrcaustics: {line}\n")
    sys.exit(status)
