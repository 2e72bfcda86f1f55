"""Checks of what a caller asks for, each one clear ValueError in one grammar."""

from typing import Any

import numpy as np


def whole_number(name: str, value: Any, least: int, most: int | None = None) -> int:
    """The argument `name` as an int, where it is a whole number from `least` to `most`; a ValueError where it is not.

    Booleans and floats are none.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (whole and value >= least and (most is None or value <= most)):
        to = "" if most is None else f" to {most}"
        raise ValueError(f"Argument `{name}` must be a whole number from {least}{to}, but is {value!r}.")
    return int(value)
