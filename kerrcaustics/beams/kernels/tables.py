"""Tables of a call: arrays of rows of numbers, in which formulas look up the row of an index that they compute."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np


@dataclass(frozen=True)
class Table:
    """A table among the arguments of a program, with any number of rows.

    width: numbers in a row; dtype: "f8", "f4" or "f2", of doubles, or of finite numbers in single or half precision.
    """

    width: int
    dtype: str = "f8"

    @property
    def value(self) -> np.ndarray:
        """A table of this kind, for tracing."""
        return np.zeros((1, self.width), self.dtype)


@jax.jit
def table_row(table: Any, index: Any) -> Any:
    """The row (k,) of a table (n, k) at a whole number, as doubles; the first and the last row beyond them."""
    # The generator knows this function by its name.
    return table[jnp.clip(index, 0, len(table) - 1).astype(int)].astype(float)
