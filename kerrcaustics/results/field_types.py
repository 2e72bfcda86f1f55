"""Checks of values against the fields that a result declares: their types, and the dimensions of arrays."""

import inspect
from collections.abc import Iterator
from functools import cache
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from kerrcaustics.results.declared import stored

# Differences allowed between a field and its value made anew: unit vectors are normalised again.
_ROUND_OFF = 1e-12


def check_fields(made: Any) -> None:
    """Raise ValueError unless each field of a result is of its declared type, and has its declared dimensions."""
    kind, lengths = type(made), {}
    for name, about in stored(kind).items():
        value = getattr(made, name)
        if not fits(value, _hints(kind)[name], about.dims):
            raise ValueError(f"{kind.__name__}.{name} is of another type")
        for dim, length in _lengths(value, about.dims):
            if lengths.setdefault(dim, length) != length:
                raise ValueError(f"{kind.__name__}.{name} has another length")


def check_anew(made: Any) -> None:
    """Raise ValueError unless a class that checks its arguments, as `Camera`, makes the same result from its fields."""
    if not hasattr(type(made), "__post_init__"):
        return
    parameters = inspect.signature(type(made)).parameters
    anew = type(made)(**{name: getattr(made, name) for name in stored(type(made)) if name in parameters})
    for name in stored(type(made)):
        first, second = getattr(made, name), getattr(anew, name)
        if type(first) is not type(second) or not _close(first, second):
            raise ValueError(f"{type(made).__name__}.{name} cannot be")


def fits(value: Any, hint: Any, dims: tuple[str, ...]) -> bool:
    """True if a value is of a type; dims: of the arrays in it."""
    origin, inner = get_origin(hint), get_args(hint)
    if hint is Any:
        return True
    if origin in (Union, UnionType):
        return any(fits(value, part, dims) for part in inner)
    if origin is tuple and inner[-1] is not Ellipsis:
        pairs = isinstance(value, tuple) and len(value) == len(inner) and zip(value, inner, strict=True)
        return bool(pairs) and all(fits(part, one, dims[1:]) for part, one in pairs)
    if origin in (tuple, list):
        return isinstance(value, origin) and all(fits(part, inner[0], dims[1:]) for part in value)
    if origin is dict:
        return isinstance(value, dict) and all(
            fits(k, inner[0], ()) and fits(v, inner[1], ()) for k, v in value.items()
        )
    if hint is np.ndarray:
        # If no dimensions are declared, a number stands for an array without any.
        return isinstance(value, np.ndarray if dims else np.ndarray | float | int) and _has_dims(np.ndim(value), dims)
    if hint is float:
        return isinstance(value, float | int) and not isinstance(value, bool)
    return isinstance(value, hint) and (hint is not int or not isinstance(value, bool))


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _has_dims(number: int, dims: tuple[str, ...]) -> bool:
    """True if arrays may have this number of dimensions; a name with "..." stands for any number of them."""
    many = any(dim.endswith("...") for dim in dims)
    return number >= len(dims) - 1 if many else not dims or number == len(dims)


def _lengths(value: Any, dims: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """The lengths of an array by the names of its dimensions."""
    if isinstance(value, np.ndarray) and dims:
        first, rest = (dims[0], dims[1:]) if dims[0].endswith("...") else (None, dims)
        ahead = value.ndim - len(rest)
        if first is not None:
            yield first, value.shape[:ahead]
        yield from zip(rest, value.shape[ahead:], strict=True)


def _close(first: Any, second: Any) -> bool:
    if isinstance(first, np.ndarray):
        return first.shape == second.shape and bool(np.all(np.abs(first - second) <= _ROUND_OFF))
    return first == second
