"""Derivatives of closed forms by central differences of the eighth order."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

_WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
Value = TypeVar("Value", float, np.ndarray)


def difference(values: Callable[[int], Value]) -> Value:
    """The change of a function over one step, from its values that many steps away, 1 to 4 in either direction."""
    total = _WEIGHTS[0] * (values(1) - values(-1))
    for k, weight in enumerate(_WEIGHTS[1:], 2):
        total = total + weight * (values(k) - values(-k))
    return total
