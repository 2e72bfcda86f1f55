"""The program itself: it runs a command, and ends with a status."""

import errno
import logging
import os
import sys
from typing import Annotated, Any

import cyclopts

from kerrcaustics.cli.endings import BadInput, one_line, stop
from kerrcaustics.cli.usage import usage_message

_QUIET = cyclopts.Parameter(name=("--quiet", "-q"), negative=(), group="Global options", show_default=False)
# Of standard output: the disk is full, or nobody reads it any longer.
_UNWRITTEN = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EPIPE)
_EXIT_STATUS = "Exit status: 0 done; 1 something failed, or is not certified; 2 bad input; 130 interrupted."


def program_version() -> str:
    """The version of the package, whose reader takes long to load."""
    from importlib.metadata import version

    return version("kerrcaustics")


app = cyclopts.App(
    name="kerrcaustics",
    help="Caustics, critical curves and star images of a spinning (Kerr) black hole, on the sky of a camera near it.",
    help_epilogue=_EXIT_STATUS,
    version=program_version,
    version_flags=("--version", "-V"),
    # No --empty-star.
    default_parameter=cyclopts.Parameter(negative_iterable=()),
    suppress_keyboard_interrupt=False,
)
app.register_install_completion_command()


def with_examples(*lines: str) -> dict[str, Any]:
    """The end of a command's help: lines to try, and the exit status."""
    # Two spaces end a line of Markdown.
    block = "  \n".join(f"$ kerrcaustics {line}" for line in lines)
    return {"help_epilogue": f"Try:\n\n{block}\n\n{_EXIT_STATUS}"}


def main() -> None:
    """Run the command line and exit: 0 done, 2 bad input (one line on standard error), 1 anything else."""
    for stream in (sys.stdout, sys.stderr):
        # Names of files need not be text in the terminal's encoding.
        stream.reconfigure(errors="backslashreplace")  # pyright: ignore[reportAttributeAccessIssue]
    # If its folder cannot be written to, it takes another one, and need not say so.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        app.meta(sys.argv[1:], exit_on_error=False, print_error=False)
        sys.stdout.flush()
    except cyclopts.CycloptsError as error:
        stop(2, usage_message(error))
    except BadInput as error:
        stop(2, str(error))
    except OSError as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        reason = error.strerror or one_line(str(error))
        written = error.filename is None and error.errno in _UNWRITTEN
        _leave_standard_output()
        stop(
            1, f"Standard output cannot be written: {reason}." if written else f"{error.filename or 'Error'}: {reason}."
        )
    except Exception as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        stop(1, f"{type(error).__name__}: {one_line(str(error))} (KERRCAUSTICS_TRACEBACK=1 shows where)")


def _leave_standard_output() -> None:
    """Let what standard output still holds go nowhere: where it cannot be written, Python would complain at the end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@app.meta.default
def _run(
    *command: Annotated[str, cyclopts.Parameter(show=False, allow_leading_hyphen=True)],
    quiet: Annotated[bool, _QUIET] = False,
) -> None:
    """Run a command.

    Parameters
    ----------
    quiet
        Print neither tables nor progress; errors are still printed.
    """
    if quiet:
        from kerrcaustics.cli.terminal import be_quiet

        be_quiet()
    if not command:
        from kerrcaustics.cli.first_page import first_page

        first_page(app, program_version())
        return
    app(command, exit_on_error=False, print_error=False)
