"""`python -m kerrcaustics`, and `kerrcaustics` itself: the command line."""

import sys
import warnings
from typing import Any

from kerrcaustics.interrupts import on_interrupt


def main() -> None:
    """Run the command line; Ctrl-C ends it with one line even while it is loading."""
    on_interrupt()
    warnings.showwarning = _show_warning
    from kerrcaustics.cli import main as run

    run()


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning is one line, without its place in the code."""
    sys.stderr.write(f"kerrcaustics: Warning: {' '.join(str(message).split())}\n")


if __name__ == "__main__":
    main()
