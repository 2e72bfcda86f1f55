"""Numbers with errors: limits by extrapolation, and places where a quantity passes a value; studies use them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

Array = np.ndarray

_SLOPE_STEP = 1e-3


@dataclass(frozen=True)
class Measured:
    """A number and its error."""

    value: float
    error: float

    def __str__(self) -> str:
        """As 0.36816(2): the error, in brackets, is that of the last digits."""
        if not (0 < self.error < math.inf):
            return f"{self.value:.10g}"
        digits = -math.floor(math.log10(self.error))
        last = round(self.error * 10**digits)
        if last == 10:
            digits, last = digits - 1, 1
        if digits <= 0:
            return f"{self.value:.0f}({self.error:.0f})"
        return f"{self.value:.{digits}f}({last})"


def series(
    x: Array, y: Array, error: Array, coefficients: int = 1, powers: Sequence[int] = tuple(range(12))
) -> tuple[Measured, ...]:
    """The first coefficients of a series in `powers` of x through y, each with its error; the first is the limit at 0.

    Weighted least squares with ever more terms. The error of a coefficient is what the errors of y, taken as
    independent, make of it, and the larger of its last two changes; the number of terms where that is least counts.
    """
    most = min(len(powers), len(x))
    if most < coefficients + 2:
        raise ValueError(f"Argument `x` must hold {coefficients + 2} values or more, but holds {len(x)}.")
    scale = np.abs(x).max()
    weight = 1 / np.maximum(error, 1e-300)
    found, spread = [], []
    for terms in range(coefficients, most + 1):
        used = np.array(powers[:terms])
        matrix = (x[:, None] / scale) ** used * weight[:, None]
        size = np.linalg.norm(matrix, axis=0)
        inverse = np.linalg.pinv(matrix / size, rcond=1e-14) / size[:, None] / scale ** used[:, None]
        found.append((inverse @ (y * weight))[:coefficients])
        spread.append(np.linalg.norm(inverse, axis=1)[:coefficients])
    values = np.array(found)
    change = np.abs(np.diff(values, axis=0))
    doubt = np.hypot(np.array(spread)[2:], np.maximum(change[1:], change[:-1]))
    best = doubt.argmin(axis=0)
    return tuple(Measured(float(values[k + 2, i]), float(doubt[k, i])) for i, k in enumerate(best))


def crossing(
    quantity: Callable[[float], tuple[float, float]], value: float, low: float, high: float, tolerance: float
) -> Measured | None:
    """The place where a quantity, known with its error, passes a value between low and high; None without one.

    The error is that of the quantity over its slope, and the tolerance of the root.
    """

    def excess(x: float) -> float:
        return quantity(x)[0] - value

    if excess(low) * excess(high) > 0:
        return None
    root = float(brentq(excess, low, high, xtol=tolerance))
    slope = (excess(root + _SLOPE_STEP) - excess(root - _SLOPE_STEP)) / (2 * _SLOPE_STEP)
    return Measured(root, quantity(root)[1] / abs(slope) + tolerance)


def difference(one: Measured, other: Measured) -> Measured:
    """A number less another one, with errors that are independent."""
    return Measured(one.value - other.value, math.hypot(one.error, other.error))
