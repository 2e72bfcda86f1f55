"""What rounding loses: the graph of a kernel in long arithmetic.

The formulas are those of the kernel, its constants the same doubles, and its loops go on by conditions in long
arithmetic; only the rounding of all operations is gone. Zeros have no sign here.
"""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from mpmath import mp, mpf

from kerrcaustics.beams.kernels.evaluation import Arithmetic, evaluated
from kerrcaustics.beams.kernels.lowering import Lowered

DIGITS = 60


def quotient(x: mpf, y: mpf) -> mpf:
    """x / y, also by zero."""
    if y != 0:
        return x / y
    return mp.nan if x == 0 or mp.isnan(x) else mp.sign(x) * mp.inf


def _within(function: Callable[..., mpf], holds: Callable[..., bool]) -> Callable[..., mpf]:
    """A function that is NaN where its arguments do not hold."""
    return lambda *arguments: function(*arguments) if holds(*arguments) else mp.nan


def _finite(function: Callable[..., mpf]) -> Callable[..., mpf]:
    """A function of finite numbers: itself for an infinite one."""
    return lambda x: function(x) if mp.isfinite(x) else x


def root(x: mpf) -> mpf:
    """The cube root."""
    return mp.sign(x) * mp.cbrt(abs(x))


def remainder(x: mpf, y: mpf) -> mpf:
    """The remainder of a division, with the sign of x."""
    return x if mp.isinf(y) else x - y * mp.sign(x / y) * mp.floor(abs(x / y))


def greater(x: mpf, y: mpf) -> mpf:
    """The greater of two numbers; NaN if one is."""
    return x if x > y or mp.isnan(x) else y


def lesser(x: mpf, y: mpf) -> mpf:
    """The lesser of two numbers; NaN if one is."""
    return x if x < y or mp.isnan(x) else y


def signed(size: mpf, sign: mpf) -> mpf:
    """A number with the sign of another; zero is positive."""
    return -abs(size) if sign < 0 else abs(size)


OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": quotient,
    "neg": lambda x: -x,
    "abs": abs,
    "max": greater,
    "min": lesser,
    "sqrt": _within(mp.sqrt, lambda x: x >= 0),
    "cbrt": _finite(root),
    "exp": mp.exp,
    "log": _within(mp.log, lambda x: x >= 0),
    "log1p": _within(lambda x: mp.log(1 + x), lambda x: x >= -1),
    "sin": _within(mp.sin, mp.isfinite),
    "cos": _within(mp.cos, mp.isfinite),
    "atan": mp.atan,
    "atan2": _within(mp.atan2, lambda y, x: not (mp.isnan(x) or mp.isnan(y))),
    "floor": _finite(mp.floor),
    "rint": _finite(mp.nint),
    "rem": _within(remainder, lambda x, y: mp.isfinite(x) and y != 0),
    "sign": mp.sign,
    "copysign": signed,
    "finite": mp.isfinite,
    "lt": lambda x, y: x < y,
    "gt": lambda x, y: x > y,
    "le": lambda x, y: x <= y,
    "ge": lambda x, y: x >= y,
    "eq": lambda x, y: x == y,
    "ne": lambda x, y: x != y,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "xor": lambda a, b: a != b,
    "not": lambda a: not a,
    "real": lambda a: mpf(bool(a)),
    "select": lambda a, x, y: x if a else y,
}
LONG = Arithmetic(OPERATIONS, lambda value: value if isinstance(value, bool) else mpf(value), bool)


def long_outputs(
    function: Lowered, parameters: Sequence[float], ray: Sequence[float], digits: int = DIGITS
) -> list[mpf | bool]:
    """All outputs of one ray, to so many digits but for those that cancel."""
    with mp.workdps(digits):
        return evaluated(function, [*map(mpf, parameters)], [*map(mpf, ray)], LONG)


def long_results(function: Lowered, parameters: Sequence[float], rays: np.ndarray) -> Any:
    """Results of rays as the function returns them, with arrays of doubles (ray, ...) that are rounded once."""
    rows = np.array([[float(x) for x in long_outputs(function, parameters, ray)] for ray in rays])
    ends = np.cumsum([int(np.prod(shape.shape)) for shape in function.shapes])
    parts = zip(np.split(rows, ends[:-1], axis=1), function.shapes, strict=True)
    return jax.tree.unflatten(function.tree, [part.reshape(-1, *shape.shape) for part, shape in parts])


def rounding_errors(function: Lowered, parameters: Sequence[float], rays: np.ndarray) -> np.ndarray:
    """Differences (ray, output) of doubles to long arithmetic; 1 where flags differ, NaN where either is no number."""
    columns = np.broadcast_arrays(*evaluated(function, parameters, rays.T), rays[:, 0])[:-1]
    in_doubles = np.stack(columns, axis=-1).astype(float)
    in_full = [long_outputs(function, parameters, ray) for ray in rays]
    with mp.workdps(DIGITS), np.errstate(invalid="ignore"):
        return np.vectorize(lambda exact, short: float(mpf(exact) - mpf(short)))(np.array(in_full, object), in_doubles)
