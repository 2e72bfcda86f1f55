"""Roots of functions of one variable, many at once, each between two places with values of opposite signs.

References
----------
Chandrupatla 1997, Advances in Engineering Software 28, 145: bisection, or where it is safe a parabola through three
values that is solved for the root.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kerrcaustics.shapes import Bool, Float

Array = np.ndarray

_TINY, _ROUND_OFF = np.finfo(float).tiny, np.finfo(float).eps


class Roots(NamedTuple):
    """Roots, NaN where none was found, and True where one was."""

    x: Float[Array, " roots"]
    found: Bool[Array, " roots"]


class _Bracket(NamedTuple):
    """Two places around each root, the later one first, and the place before them; and the values there."""

    x1: Array
    f1: Array
    x2: Array
    f2: Array
    x3: Array
    f3: Array

    def best(self) -> tuple[Array, Array]:
        """The place with the smaller value, and that."""
        first = np.abs(self.f1) < np.abs(self.f2)
        return np.where(first, self.x1, self.x2), np.where(first, self.f1, self.f2)

    def is_lost(self) -> Array:
        """True where no root can be found."""
        one_sign = np.sign(self.f1) == np.sign(self.f2)
        return one_sign | (np.isnan(self.f1) & np.isnan(self.f2)) | ~np.isfinite(self.x1 + self.x2)

    def cut(self, x: Array, f: Array) -> "_Bracket":
        """The part of the bracket on the side of a new place where the root lies."""
        same = np.sign(f) == np.sign(self.f1)
        x2, f2 = np.where(same, self.x2, self.x1), np.where(same, self.f2, self.f1)
        return _Bracket(x, f, x2, f2, np.where(same, self.x1, self.x2), np.where(same, self.f1, self.f2))

    def subset(self, rows: Array) -> "_Bracket":
        """The brackets of some rows."""
        return _Bracket(*(values[rows] for values in self))


def bracketed_roots(
    function: Callable[..., Array],
    bracket: tuple[Array, Array],
    args: tuple[Array, ...] = (),
    *,
    absolute: float = 4 * _TINY,
    relative: float = 4 * _ROUND_OFF,
) -> Roots:
    """Roots of `function(x, *args)`, each between two places, to an absolute and a relative error.

    The function takes arrays along one axis, with entries for those roots alone that are still searched for. Where the
    values at both places have one sign, or are no numbers, nothing is found.
    """
    low, high, *more = np.broadcast_arrays(*(np.asarray(end, float) for end in bracket), *args)
    at = _Bracket(low, np.asarray(function(low, *more)), high, np.asarray(function(high, *more)), high, high)
    rows, x, found, parabolic = np.arange(len(low)), np.full(low.shape, np.nan), np.zeros(low.shape, bool), False
    while True:
        (best, value), width = at.best(), np.abs(at.x2 - at.x1)
        error = np.abs(best) * relative + absolute
        exact, lost = np.abs(value) <= _TINY, at.is_lost()
        done = exact | (~lost & (width < error))
        x[rows[done]], found[rows[done]] = best[done], True
        left = ~(done | lost)
        if not left.any():
            return Roots(x, found)
        rows, at, more = rows[left], at.subset(left), [values[left] for values in more]
        part = _next_parts(at, error[left] / width[left]) if parabolic else 0.5
        place = at.x1 + part * (at.x2 - at.x1)
        at, parabolic = at.cut(place, np.asarray(function(place, *more))), True


def _next_parts(at: _Bracket, error: Array) -> Array:
    """Parts of the way through the brackets at which the function is called next; error: as such a part."""
    x1, f1, x2, f2, x3, f3 = at
    with np.errstate(all="ignore"):
        place, value, alpha = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2), (x3 - x1) / (x2 - x1)
        # Where the parabola, on its side, is sure to lead into the bracket.
        safe = (1 - np.sqrt(1 - place) < value) & (value < np.sqrt(place))
        parabola = f1 / (f1 - f2) * f3 / (f3 - f2) - alpha * f1 / (f3 - f1) * f2 / (f2 - f3)
    return np.clip(np.where(safe, parabola, 0.5), 0.5 * error, 1 - 0.5 * error)
