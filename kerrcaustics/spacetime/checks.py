"""Checks of arguments, each with a clear ValueError of one form."""

import math
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from numbers import Real
from typing import Any

import numpy as np

from kerrcaustics.choices import suggestion

# Characters of a value in a message.
_LONGEST = 80
# By NumPy's letters of kinds: those of texts, and what numbers of the others are not.
_TEXTS = "SUTV"
_LOST = {
    "M": ("plain numbers", "dates: times are numbers, in units of M"),
    "m": ("plain numbers", "time spans: times are numbers, in units of M"),
    "c": ("real numbers", "complex ones: pass their real parts"),
}


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


def differing_digits(value: float, limit: float) -> tuple[str, str]:
    """A number and the limit that it violates as texts, with enough digits to differ."""
    texts = f"{value:.12g}", f"{limit:.12g}"
    return texts if texts[0] != texts[1] or value == limit else (repr(float(value)), repr(float(limit)))


def one_of(name: str, value: Any, choices: Iterable[str]) -> None:
    """Raise ValueError unless the argument `name` is one of some words."""
    choices = list(choices)
    if not isinstance(value, str) or value not in choices:
        raise ValueError(
            f"Argument `{name}` must be one of {', '.join(choices)}, but is {quoted(value)}{suggestion(value, choices)}"
        )


def left_out(name: str, value: Any, case: str) -> None:
    """Raise ValueError if the argument `name` is given, not None, in a case in which nothing uses it."""
    if value is not None:
        raise ValueError(f"Argument `{name}` must be left out {case}, but is {quoted(value)}.")


def instance_of(name: str, value: Any, kind: type) -> None:
    """Raise ValueError unless the argument `name` is an object of a class."""
    if not isinstance(value, kind):
        raise ValueError(f"Argument `{name}` must be a {kind.__name__}, but is {type(value).__name__}.")


def flags(**values: Any) -> None:
    """Raise ValueError unless each argument is True or False: "no" and 2 would count as true."""
    for name, value in values.items():
        if not isinstance(value, bool | np.bool_):
            raise ValueError(f"Argument `{name}` must be True or False, but is {quoted(value)}.")


@contextmanager
def argument_named(own: str, name: str) -> Iterator[None]:
    """Turn errors about the argument `own` into errors about `name`, as the caller calls it. As a decorator too."""
    try:
        yield
    except ValueError as error:
        if f"`{own}`" not in str(error):
            raise
        raise ValueError(str(error).replace(f"`{own}`", f"`{name}`")) from None


def real_array(name: str, value: Any, kind: type = float) -> np.ndarray:
    """The argument `name` as an array of floats, not copied if it is one; a ValueError if it holds no numbers."""
    array = _floats(name, value, kind)
    if array is None:
        raise ValueError(f"Argument `{name}` must hold numbers, but is {quoted(value)}.")
    return array


def _is_own_unit(unit: str) -> bool:
    """True for units that results have as Datasets, and in which arguments are."""
    return unit in ("", "1", "rad") or "GM" in unit


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
    array = _floats(name, value, float)
    return np.array(np.nan if array is None else array)


def _floats(name: str, value: Any, kind: type) -> np.ndarray | None:
    """The argument `name` as an array of floats; None if it holds no numbers."""
    array = _plain(name, value)
    if array is None or array.dtype.kind in _TEXTS:
        return None
    if array.dtype.kind == "O" and any(isinstance(part, str | bytes) for part in array.flat):
        return None
    try:
        return np.asarray(array, kind)
    except (TypeError, ValueError, OverflowError) as error:
        refuse_traced(name, error)
        return None


def _plain(name: str, value: Any) -> np.ndarray | None:
    """The argument `name` as an array, None if it makes none; a ValueError if its numbers would lose their meaning."""
    _refuse_unit_and_mask(name, value)
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError) as error:
        refuse_traced(name, error)
        return None
    if array.dtype.kind in _LOST:
        must, but = _LOST[array.dtype.kind]
        raise ValueError(f"Argument `{name}` must hold {must}, but holds {but}.")
    return array


def _refuse_unit_and_mask(name: str, value: Any) -> None:
    """Raise ValueError if an array, or one in a list, has a unit or masked numbers, which NumPy would leave behind."""
    if isinstance(value, list | tuple):
        for part in value:
            if not isinstance(part, float | int):
                _refuse_unit_and_mask(name, part)
        return
    unit = getattr(value, "unit", getattr(value, "units", None))
    if unit is not None and not (hasattr(value, "attrs") and _is_own_unit(str(unit))):
        raise ValueError(
            f"Argument `{name}` must hold plain numbers, but has the unit {unit}: convert it, angles to radians, "
            "lengths and times to units of M, and pass the numbers alone."
        )
    masked = getattr(value, "mask", False)
    if masked is not False and not callable(masked) and np.any(masked):
        raise ValueError(f"Argument `{name}` must hold no masked numbers, but some are masked: leave those out.")


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
    array = _plain(name, value)
    return value if array is None else array.item()
