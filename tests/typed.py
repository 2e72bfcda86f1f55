"""Checks of types and shapes at run time: an int serves where a float is wanted."""

from functools import wraps

from beartype import BeartypeConf, beartype

_strict = beartype(conf=BeartypeConf(is_pep484_tower=True))


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
