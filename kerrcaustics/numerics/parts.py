"""Equal parts into which the steps of a line are cut."""

import numpy as np

from kerrcaustics.shapes import Float, Int

Array = np.ndarray


def inner_parts(parts: Int[Array, " steps"]) -> tuple[Int[Array, " inner"], Float[Array, " inner"]]:
    """The inner ends of the equal parts into which steps are divided: which step, and how far along it, 0 to 1."""
    which = np.repeat(np.arange(len(parts)), parts - 1)
    number = np.arange(len(which)) - np.searchsorted(which, which) + 1
    return which, number / parts[which]
