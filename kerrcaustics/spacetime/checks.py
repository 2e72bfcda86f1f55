"""Checks of what a caller asks for, each one clear ValueError in one grammar."""

import math
from numbers import Real
from typing import Any

import numpy as np


def whole_number(name: str, value: Any, least: int, most: int | None = None) -> int:
    """The argument `name` as an int, where it is a whole number from `least` to `most`; a ValueError where it is not.

    Booleans and floats are none.
    """
    value = _item(name, value)
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (whole and value >= least and (most is None or value <= most)):
        to = "" if most is None else f" to {most}"
        raise ValueError(f"Argument `{name}` must be a whole number from {least}{to}, but is {value!r}.")
    return int(value)


def real_number(name: str, value: Any) -> float:
    """The argument `name` as a float, be it a number of Python, NumPy or JAX, or an array of no dimension.

    NaN where it is something else: booleans, texts and longer arrays are no numbers. A ValueError where JAX traces it.
    """
    number = _item(name, value)
    if not isinstance(number, Real) or isinstance(number, bool):
        return math.nan
    try:
        return float(number)
    except OverflowError:
        return math.nan


def numbers(name: str, value: Any) -> np.ndarray:
    """The argument `name` as a new array of floats, one NaN where it holds none. A ValueError where JAX traces it."""
    try:
        return np.array(value, float)
    except (TypeError, ValueError) as error:
        refuse_traced(name, error)
        return np.array(np.nan)


def refuse_traced(name: str, error: Exception) -> None:
    """A clear ValueError where the error of a conversion tells that the argument `name` is being traced by JAX."""
    if type(error).__module__.startswith("jax"):
        raise ValueError(
            f"Argument `{name}` must hold numbers, but is traced by JAX: kerrcaustics takes NumPy arrays, and cannot "
            "run inside jax.jit, jax.grad or jax.vmap."
        ) from None


def _item(name: str, value: Any) -> Any:
    """The number in an array of no dimension; all else as it is."""
    if getattr(value, "ndim", None) != 0:
        return value
    try:
        return value.item()
    except (TypeError, ValueError) as error:
        refuse_traced(name, error)
        return value
