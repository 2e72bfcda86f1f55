"""The light of a disc that is not uniform: a sum over the uniform discs within it.

With the radius sin x of a disc, in radii of the source, its brightness I(x), and the area A(x) of its images, the light
is I(pi/2) A(pi/2) less the integral of A dI. A is costly and smooth between kinks; I is cheap and may have steps. So A
is expanded in a series between its kinks, and I enters by the moments of dI alone. The part of A proportional to the
area of the source is integrated exactly.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from kerrcaustics.extended_sources.profiles import Brightness
from kerrcaustics.results.progress import in_steps
from kerrcaustics.shapes import Float

Array = np.ndarray

Columns = Callable[[float], tuple[Array, Array]]
"""Quantities of the disc of radius sin x, (columns,), and their errors."""

# Numbers of radii in each range between kinks, by the least relative tolerance for which they are taken.
_COUNTS = ((1e-2, 5), (1e-4, 6), (0.0, 8))
# Terms of series over which the truncation error is summed.
_TERMS = 40
# Largest ratio of successive terms that the estimate allows: terms of kinks fall slowly.
_SLOWEST = 0.9
# Factor of the truncation error (tests/test_nested_discs.py).
_MARGIN = 4.0
# Most ranges of radii.
_MOST_RANGES = 12
# Least truncation error, as a part of the tolerance: kinks are known only approximately.
_LEAST = 0.1
# Nodes of sums over panels of the profile.
_GAUSS, _GAUSS_WEIGHTS = legendre.leggauss(32)


@dataclass(frozen=True)
class RoundSource:
    """A source of a radius, an angle or, if it is flat, a length in a plane."""

    radius: float
    flat: bool
    brightness: Brightness

    def area(self, x: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Areas of the discs of radii sin x within it."""
        if self.flat:
            return math.pi * (self.radius * np.sin(x)) ** 2
        return 4 * math.pi * np.sin(self.radius * np.sin(x) / 2) ** 2

    @cached_property
    def light(self) -> float:
        """The integral of the brightness over the source itself."""

        def ring(x: Array) -> Array:
            radius = self.radius * np.sin(x)
            return 2 * math.pi * (radius if self.flat else np.sin(radius)) * self.radius * np.cos(x)

        return self.brightness.integral(ring)


@dataclass(frozen=True)
class _RadiusRange:
    """A range of x.

    low, high: Ends, radians.
    dense_low, dense_high: True if A has a kink at this end: nodes then approach it quadratically.
    """

    low: float
    high: float
    dense_low: bool
    dense_high: bool

    def x(self, place: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Angles at places from -1 to 1."""
        part = (1 + place) / 2
        if self.dense_low and self.dense_high:
            part = np.sin(math.pi / 2 * part) ** 2
        elif self.dense_low:
            part = part**2
        elif self.dense_high:
            part = 1 - (1 - part) ** 2
        return self.low + (self.high - self.low) * part

    def place(self, x: Float[Array, " n"]) -> Float[Array, " n"]:
        """The inverse of `x`."""
        part = np.clip((x - self.low) / (self.high - self.low), 0, 1)
        if self.dense_low and self.dense_high:
            part = np.arcsin(np.sqrt(part)) * 2 / math.pi
        elif self.dense_low:
            part = np.sqrt(part)
        elif self.dense_high:
            part = 1 - np.sqrt(1 - part)
        return 2 * part - 1

    def halves(self) -> "tuple[_RadiusRange, _RadiusRange]":
        """The ranges on both sides of the middle, at which A has no kink."""
        middle = float(self.x(np.zeros(1))[0])
        return _RadiusRange(self.low, middle, self.dense_low, False), _RadiusRange(
            middle, self.high, False, self.dense_high
        )


class _Rule(NamedTuple):
    """Nodes of a range, from -1 to 1, and the matrix from values there to a series of Legendre's polynomials."""

    nodes: Float[Array, " nodes"]
    to_series: Float[Array, "nodes nodes"]


@cache
def _rule(count: int) -> _Rule:
    nodes = legendre.leggauss(count)[0]
    return _Rule(nodes, np.linalg.inv(legendre.legvander(nodes, count - 1)))


def radii_for(tolerance: float) -> int:
    """The number of radii in each range between kinks for a relative tolerance of the light."""
    return next(count for least, count in _COUNTS if tolerance >= least)


@dataclass(frozen=True, eq=False)
class _RangeColumns:
    """Values of columns at the nodes of a range, their errors, and the profile."""

    range: _RadiusRange
    rule: "_Rule"
    values: Float[Array, "nodes columns"]
    errors: Float[Array, "nodes columns"]
    brightness: Brightness

    @cached_property
    def _panels(self) -> tuple[Float[Array, " ends"], Float[Array, " panels"]]:
        """Ends of the panels of the profile in this range, as places, and the residuals of the profile there."""
        ends, low, high = self.brightness.ends, self.range.low, self.range.high
        inner = ends[(ends > low) & (ends < high)]
        panel = np.searchsorted(ends, np.concatenate([[low], inner]), side="right") - 1
        return self.range.place(np.concatenate([[low], inner, [high]])), self.brightness.residual[panel]

    @cached_property
    def moments(self) -> Float[Array, " terms"]:
        """Integrals of Legendre's polynomials with dI: by parts, as I may have steps."""
        ends, _ = self._panels
        half = np.diff(ends)[:, None] / 2
        place = (ends[:-1, None] + half + half * _GAUSS).ravel()
        bright = self.brightness.intensity(self.range.x(place)) * (half * _GAUSS_WEIGHTS).ravel()
        slope = legendre.legval(place, legendre.legder(np.eye(_TERMS)))
        low, high = self.brightness.intensity(np.array([self.range.low, self.range.high]))
        return high - low * (-1.0) ** np.arange(_TERMS) - slope @ bright

    @cached_property
    def series(self) -> Float[Array, "nodes columns"]:
        """Coefficients of the columns."""
        return self.rule.to_series @ self.values

    @property
    def integral(self) -> Float[Array, " columns"]:
        """Integrals of the columns with dI."""
        return self.moments[: len(self.rule.nodes)] @ self.series

    @property
    def error(self) -> Float[Array, " columns"]:
        """Errors of the integral by those of the columns, and by the residual of the profile."""
        own = np.abs(self.moments[: len(self.rule.nodes)] @ self.rule.to_series) @ self.errors
        ends, residual = self._panels
        grown = np.abs(np.diff(legendre.legval(ends, self.series), axis=-1))
        return own + grown @ residual

    @cached_property
    def truncation(self) -> Float[Array, " columns"]:
        """Errors of the integral by the missing terms of the series, which are assumed to fall as the last ones do."""
        size, nodes, to_series = np.abs(self.series), self.rule.nodes, self.rule.to_series
        count = len(nodes)
        last, before, largest = size[-2:].max(axis=0), size[-4:-2].max(axis=0), size.max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = np.sqrt((last / before) ** 0.5 * (last / largest) ** (1 / (count - 1)))
        fall = np.clip(np.nan_to_num(fall), 0, _SLOWEST)
        more = np.arange(count, _TERMS)
        # At the nodes a missing term has the values of a sum of the terms in the series (aliasing).
        aliased = to_series @ legendre.legvander(nodes, _TERMS - 1)[:, more]
        lacking = self.moments[more] - self.moments[:count] @ aliased
        return _MARGIN * np.abs(lacking) @ (last * fall ** (more[:, None] - (count - 1)))


def integrated(
    columns: Columns,
    whole: tuple[Array, Array],
    source: RoundSource,
    kinks: Float[Array, " kinks"],
    tolerance: Float[Array, " columns"],
    radii: int = 8,
) -> tuple[Float[Array, " columns"], Float[Array, " columns"]]:
    """The light of the images of a source by columns, and its errors.

    Parameters
    ----------
    columns : function of x
    whole : two arrays (columns,)
        Quantities and errors of the disc as large as the source.
    source : RoundSource
    kinks : (kinks,) array
        Angles x, 0 to pi / 2, next to which the columns are not smooth.
    tolerance : (columns,) array
        Truncation errors at which ranges between kinks are not halved any further.
    radii : int
        Number of radii in each range.
    """
    rule = _rule(radii)
    of_area = whole[0] / source.area(np.array([math.pi / 2]))
    ends = np.unique(np.concatenate([[0.0], kinks, [math.pi / 2]]))
    dense = np.isin(ends, kinks).tolist()
    parts: list[_RangeColumns] = []
    ranges = [_RadiusRange(*pair, *dense[i : i + 2]) for i, pair in enumerate(pairwise(ends.tolist()))]
    light, own, missing = np.zeros((3, len(of_area)))
    for _ in in_steps("pass over the disc", range(1 + max(_MOST_RANGES - len(ranges), 0))):
        parts += [_range_columns(columns, of, source, of_area, rule) for of in ranges]
        light = source.light * of_area - np.sum([part.integral for part in parts], axis=0)
        own = source.brightness.at_limb * whole[1] + np.sum([part.error for part in parts], axis=0)
        lost = np.array([part.truncation for part in parts])
        missing = np.maximum(lost.sum(axis=0), _LEAST * np.where(np.isfinite(tolerance), tolerance, 0))
        # A column that is unknown at some radius gains nothing from further radii.
        if (missing <= np.maximum(tolerance, own)).all() or not np.isfinite(own).all():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            worst = int(np.nan_to_num(lost / tolerance).max(axis=1).argmax())
        ranges = parts.pop(worst).range.halves()
    return light, np.nan_to_num(own + missing, nan=math.inf, posinf=math.inf)


def _range_columns(
    columns: Columns, of: _RadiusRange, source: RoundSource, of_area: Float[Array, " columns"], rule: "_Rule"
) -> _RangeColumns:
    """The columns at the nodes of a range, less the part proportional to the area of the source."""
    x = of.x(rule.nodes)
    rows = [columns(one) for one in in_steps("ring of the disc", x.tolist())]
    values, errors = (np.array(part) for part in zip(*rows, strict=True))
    return _RangeColumns(of, rule, values - source.area(x)[:, None] * of_area, errors, source.brightness)
