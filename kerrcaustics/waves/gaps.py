"""A gap in a ring of lines: where the nearest place jumps from one line to the next, and the integral is faded out.

Functions on the other lines are joined smoothly across the gap, so that their Fourier series converge; the amplitude
falls to 0 before the joint begins. The error of the fade falls faster than any power of the frequency, as long as no
image lies in it.
"""

import math
from dataclasses import dataclass

import numpy as np

from kerrcaustics.shapes import Bool, Float

Array = np.ndarray

FADES = (0.8, 0.5, 0.3)
"""Radians over which the amplitude fades, the longest first: the longer, the less is lost."""

# Width of the stretch beside the broken lines that the gap includes, radians.
_BESIDE = 0.05
# Width of the next stretch, from which functions are continued across the gap, radians.
_JOINT = 0.3
# Length of a short fade, in parts of the fade.
_SHORT = 0.5
# The longest stretch of broken lines, radians.
_LONGEST = 2.0
# Standard deviations of a step that is an error function.
_DEVIATIONS = 12.0


@dataclass(frozen=True)
class Gap:
    """A stretch of lines that are left out.

    middle: edge phase of its middle, radians.
    half: half its length, radians.
    fade: length over which the amplitude fades beside it, radians.
    """

    middle: float
    half: float
    fade: float = FADES[0]

    def _away(self, edge_phase: Float[Array, " lines"]) -> Float[Array, " lines"]:
        """Signed distances from the middle."""
        return (edge_phase - self.middle + math.pi) % (2 * math.pi) - math.pi

    def hides(self, edge_phase: Float[Array, " lines"]) -> Bool[Array, " lines"]:
        """True for lines that are left out, at least in part."""
        return np.abs(self._away(edge_phase)) < self.half + _JOINT + self.fade

    def fades(self, edge_phase: Float[Array, " lines"]) -> Bool[Array, " lines"]:
        """True for lines on which the amplitude is reduced, but not 0."""
        return self.hides(edge_phase) & (np.abs(self._away(edge_phase)) > self.half + _JOINT)

    def share(self, edge_phase: Float[Array, " lines"], *, short: bool = False) -> Float[Array, " lines"]:
        """The part of the amplitude that lines keep."""
        start = self.half + _JOINT
        return _step(np.abs(self._away(edge_phase)), start, start + self.fade * (_SHORT if short else 1))

    def joined(self, edge_phase: Float[Array, " lines"], values: Float[Array, " lines *axes"]) -> Array:
        """Functions on the lines, led smoothly across the gap."""
        away, end = self._away(edge_phase), self.half + _JOINT
        before, after = int(np.abs(away + end).argmin()), int(np.abs(away - end).argmin())
        axes = (len(values), *[1] * (values.ndim - 1))
        part = ((away - away[before]) / (away[after] - away[before])).reshape(axes)
        kept = _step(np.abs(away), self.half, end).reshape(axes)
        straight = values[before] + part * (values[after] - values[before])
        return np.where(kept > 0, kept * values, 0.0) + (1 - kept) * straight


def gap_of(edge_phase: Float[Array, " lines"], broken: Bool[Array, " lines"]) -> Gap | None:
    """The shortest stretch of equally spaced lines that holds all broken ones; None if it is too long."""
    places = np.flatnonzero(broken)
    if not len(places):
        return None
    spacing = 2 * math.pi / len(edge_phase)
    between = np.diff(np.append(places, places[0] + len(edge_phase)))
    widest = int(between.argmax())
    first = places[(widest + 1) % len(places)]
    length = (len(edge_phase) - between[widest]) * spacing
    if length > _LONGEST:
        return None
    return Gap(float(edge_phase[first] + length / 2), float(length / 2 + spacing + _BESIDE))


def _step(x: Float[Array, " lines"], start: float, end: float) -> Float[Array, " lines"]:
    """A step from 0 to 1."""
    from scipy.special import ndtr

    deviations = _DEVIATIONS * ((x - start) / (end - start) - 0.5)
    return ndtr(np.where(x <= start, -math.inf, np.where(x >= end, math.inf, deviations)))
