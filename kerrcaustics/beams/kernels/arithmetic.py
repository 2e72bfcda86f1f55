"""Values of operations in double precision: of constants, and of arrays."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

ROUNDED_ONCE: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "max": np.maximum,
    "min": np.minimum,
    "floor": np.floor,
    "rint": np.rint,
    "rem": np.fmod,
    # Zeros keep their sign.
    "sign": lambda x: np.where(np.equal(x, 0), x, np.sign(x)),
    "copysign": np.copysign,
    "finite": np.isfinite,
    "lt": np.less,
    "gt": np.greater,
    "le": np.less_equal,
    "ge": np.greater_equal,
    "eq": np.equal,
    "ne": np.not_equal,
    "and": np.logical_and,
    "or": np.logical_or,
    "xor": np.logical_xor,
    "not": np.logical_not,
    "real": lambda flag: np.where(flag, 1.0, 0.0),
    "select": np.where,
}
"""Operations whose results are rounded correctly, or are exact: the same bits everywhere."""

ELEMENTARY: dict[str, Callable[..., Any]] = {
    "cbrt": np.cbrt,
    "exp": np.exp,
    "log": np.log,
    "log1p": np.log1p,
    "sin": np.sin,
    "cos": np.cos,
    "atan": np.arctan,
    "atan2": np.arctan2,
}
"""Functions of which each library has its own bits."""


def folded(name: str, values: Sequence[float | bool]) -> float | bool | None:
    """The value of an operation on constants; None if it has not the same bits everywhere."""
    if name not in ROUNDED_ONCE:
        return None
    with np.errstate(all="ignore"):
        return ROUNDED_ONCE[name](*values).item()
