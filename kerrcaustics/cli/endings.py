"""How the program ends other than well: one line on standard error, and a status."""

import sys
from typing import NoReturn


class BadInput(ValueError):
    """Invalid input of the user: exit status 2, one line."""


def one_line(text: str) -> str:
    """The text without line breaks."""
    return " ".join(text.split())


def stop(status: int, line: str) -> NoReturn:
    """End with one line on standard error."""
    sys.stderr.write(f"kerrcaustics: {line}\n")
    sys.exit(status)
