"""Cubic curves through places with known rates."""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.rows import Rows

Array = np.ndarray


@dataclass(frozen=True)
class Cubics(Rows):
    """Cubic curves that follow links: the place at the left end, the step to the right end, the rates at both."""

    start: Float[Array, "links axes"]
    step: Float[Array, "links axes"]
    rate_0: Float[Array, "links axes"]
    rate_1: Float[Array, "links axes"]

    def points(self, part: Float[Array, " links"]) -> Float[Array, "links axes"]:
        """Places at parts of the links."""
        t = part[:, None]
        bend = t * (1 - t)
        return self.start + t * t * (3 - 2 * t) * self.step + bend * ((1 - t) * self.rate_0 - t * self.rate_1)
