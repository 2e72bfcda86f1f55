"""Checks of types and shapes at run time.

An int serves where a float is wanted, a scalar of NumPy for an array without axes or an int, and a member of a zip file
for a file. `Self` is any object: checks of one method do not know the class.
"""

from functools import wraps
from io import BufferedIOBase
from typing import IO, Self

import numpy as np
from beartype import BeartypeConf, FrozenDict, beartype

_looser = FrozenDict(
    {Self: object, np.ndarray: np.ndarray | np.generic, int: int | np.integer, IO[bytes]: IO[bytes] | BufferedIOBase}
)
_strict = beartype(conf=BeartypeConf(is_pep484_tower=True, hint_overrides=_looser))


def checked(function):
    """The function with its checks, made at its first call: most tests of a process call few functions.

    One within another is defined anew at each call, and stays as it is.
    """
    if "<locals>" in function.__qualname__:
        return function
    made = []

    @wraps(function)
    def called(*arguments, **named):
        if not made:
            made.append(_strict(function))
        return made[0](*arguments, **named)

    return called
