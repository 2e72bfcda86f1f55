"""What a random case of an analysis claims, and how true it is."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class Claim(NamedTuple):
    """One claim: what it is about, true over reported error (of a label 0, or inf if wrong), and the case as Python."""

    name: str
    ratio: float
    code: str


# One random case: its claims; none, where the program says that nothing is known.
Kind = Callable[[np.random.Generator], list[Claim]]
