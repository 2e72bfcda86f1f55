"""The end of the program on Ctrl-C, with one line from its first moment on."""

import _thread
import os
import signal
import sys
import time
from collections.abc import Callable

NOTHING_LEFT = "nothing was left half-written."
# The status that shells expect of a program ended by SIGINT.
INTERRUPTED = 130
# Seconds for the last line.
_PATIENCE = 1.0


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
        _write(f"{bar}kerrcaustics: Interrupted: {remark()}\n")
        # An exception could be swallowed inside a compiled library.
        os._exit(status)

    signal.signal(signal.SIGINT, end)


def _write(line: str) -> None:
    """Write the last line on standard error; it is dropped if nobody reads a pipe that is full."""
    ended: list[bool] = []

    def write() -> None:
        try:
            sys.stderr.write(line)
            sys.stderr.flush()
        finally:
            ended.append(True)

    # A thread of its own waits for the reader, or for the write that was interrupted. Those of `threading` take locks
    # that the interrupted code may hold.
    _thread.start_new_thread(write, ())
    end = time.monotonic() + _PATIENCE
    while not ended and time.monotonic() < end:
        time.sleep(0.005)
