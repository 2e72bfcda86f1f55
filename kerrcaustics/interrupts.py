"""The end of the program on Ctrl-C, with one line from its first moment on."""

import os
import signal
import sys
from collections.abc import Callable

NOTHING_LEFT = "nothing was left half-written."
# The status that shells expect of a program ended by SIGINT.
INTERRUPTED = 130


def on_interrupt(remark: Callable[[], str] = lambda: NOTHING_LEFT, status: int = INTERRUPTED) -> None:
    """Let Ctrl-C end the program with this status and with the remark of that moment."""

    def end(*_: object) -> None:
        # A second Ctrl-C would end it in between.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        # If its module is not loaded, or is being loaded, no file was begun.
        remove = getattr(sys.modules.get("kerrcaustics.files"), "remove_unfinished", None)
        if remove is not None:
            remove()
        # In the place of a progress bar, which hides the cursor while it runs.
        bar = "\r\x1b[2K\x1b[?25h" if sys.stderr.isatty() else ""
        sys.stderr.write(f"{bar}kerrcaustics: Interrupted: {remark()}\n")
        sys.stderr.flush()
        # An exception could be swallowed inside a compiled library.
        os._exit(status)

    signal.signal(signal.SIGINT, end)
