"""Checks of types and shapes at run time: an int serves where a float is wanted."""

from beartype import BeartypeConf, beartype

_strict = beartype(conf=BeartypeConf(is_pep484_tower=True))


def checked(function):
    """The function with its checks; one within another is defined anew at each call, and stays as it is."""
    return function if "<locals>" in function.__qualname__ else _strict(function)
