"""Checks of arguments, each with a clear ValueError of one form."""

import math
import sys
from collections.abc import Iterable
from numbers import Real
from typing import Any

import numpy as np

from kerrcaustics.choices import near

# Characters of a value in a message.
_LONGEST = 80


def quoted(value: Any) -> str:
    """A value as text for a message: a line that is not too long; no zero has a sign."""
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float) and value == 0:
        return "0.0"
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        # Python writes no whole number of more than some thousand digits.
        text = "a number of very many digits"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def if_degrees(angle: Any, most: float = math.pi) -> str:
    """The end of a sentence about an angle that is too large: its radians, where these are at most `most`; else ".".

    Not every angle is a number: "." for what is none.
    """
    degrees = real_number("angle", angle)
    if not 2 < degrees <= math.degrees(most):
        return "."
    return f" ({degrees:.12g} degrees are {math.radians(degrees):.6g} radians)."


def apart(value: float, limit: float) -> tuple[str, str]:
    """A number and the limit that it violates as texts, with enough digits to differ."""
    texts = f"{value:.12g}", f"{limit:.12g}"
    return texts if texts[0] != texts[1] or value == limit else (repr(float(value)), repr(float(limit)))


def one_of(name: str, value: Any, choices: Iterable[str]) -> None:
    """Raise ValueError unless the argument `name` is one of some words."""
    choices = list(choices)
    if not isinstance(value, str) or value not in choices:
        raise ValueError(
            f"Argument `{name}` must be one of {', '.join(choices)}, but is {quoted(value)}{near(value, choices)}"
        )


def instance_of(name: str, value: Any, kind: type) -> None:
    """Raise ValueError unless the argument `name` is an object of a class."""
    if not isinstance(value, kind):
        raise ValueError(f"Argument `{name}` must be a {kind.__name__}, but is {type(value).__name__}.")


def real_array(name: str, value: Any, kind: type = float) -> np.ndarray:
    """The argument `name` as an array of floats, not copied if it is one; a ValueError if it holds no numbers."""
    try:
        return np.asarray(value, kind)
    except (TypeError, ValueError, OverflowError) as error:
        refuse_traced(name, error)
        raise ValueError(f"Argument `{name}` must hold numbers, but is {quoted(value)}.") from None


def whole_number(name: str, value: Any, least: int, most: int | None = None) -> int:
    """The argument `name` as an int; a ValueError unless it is a whole number from `least` to `most`.

    Booleans and floats are no whole numbers.
    """
    value = _item(name, value)
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (whole and value >= least and (most is None or value <= most)):
        to = "" if most is None else f" to {most}"
        raise ValueError(f"Argument `{name}` must be a whole number from {least}{to}, but is {quoted(value)}.")
    return int(value)


def real_number(name: str, value: Any) -> float:
    """The argument `name`, a number of Python, NumPy or JAX or an array of no dimension, as a float.

    NaN for anything else: booleans, texts and longer arrays are no numbers. A ValueError if JAX traces it.
    """
    number = _item(name, value)
    if not isinstance(number, Real) or isinstance(number, bool):
        return math.nan
    try:
        # No zero has a sign.
        return float(number) + 0.0
    except OverflowError:
        return math.nan


def numbers(name: str, value: Any) -> np.ndarray:
    """The argument `name` as a new array of floats, one NaN if it holds none. A ValueError if JAX traces it."""
    try:
        return np.array(value, float)
    except (TypeError, ValueError, OverflowError) as error:
        refuse_traced(name, error)
        return np.array(np.nan)


def refuse_traced(name: str, error: Exception) -> None:
    """Raise ValueError if the error of a conversion shows that JAX is tracing the argument `name`."""
    if type(error).__module__.startswith("jax"):
        raise _is_traced(name) from None


def _is_traced(name: str) -> ValueError:
    return ValueError(
        f"Argument `{name}` must hold numbers, but is traced by JAX (jit, vmap, grad or jvp): derivatives are in "
        "caustic_derivatives and image_derivatives, rays for JAX in kerrcaustics.functional."
    )


def refuse_tracer(name: str, value: Any) -> None:
    """Raise ValueError if JAX traces the argument `name`, before it is converted.

    The conversion of a number that is differentiated would succeed, and lose the derivative.
    """
    # If JAX is not loaded, nothing is traced.
    core = sys.modules.get("jax.core")
    if core is not None and isinstance(value, core.Tracer):
        raise _is_traced(name)


def _item(name: str, value: Any) -> Any:
    """The number in an array of no dimension; any other value unchanged."""
    refuse_tracer(name, value)
    if getattr(value, "ndim", None) != 0:
        return value
    try:
        return value.item()
    except (TypeError, ValueError):
        return value
