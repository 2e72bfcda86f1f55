"""Arcs along curves of which every point can be found: critical curves, and limbs where the sky is symmetric."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.extended_sources.arcs.boundary_arcs import (
    DERIVATIVE,
    GUESSED,
    NODES,
    WEIGHTS,
    Attempt,
    BoundaryArcs,
    arc_values,
    arcs_by_halving,
    values_at,
)
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths, unit

Array = np.ndarray

# Rounds of halving.
_MOST_HALVINGS = 10
# Error of an arc over that of the curve, below which halving gains nothing.
_ROUND_OFF = 3.0
# Along an arc, in (-1, 1): its nodes, places at which it is checked, and both ends.
_PLACES = np.concatenate([NODES, GUESSED, [-1.0, 1.0]])
_TO_CHECK = values_at(NODES, GUESSED)
_RATE_AT_CHECK = _TO_CHECK @ DERIVATIVE

Traced = Callable[
    [Float[Array, " arcs"], Float[Array, " arcs"]], tuple[Float[Array, "arcs places 3"], Float[Array, " arcs"]] | None
]
"""Directions at the places of arcs between parameters, and their errors across the curve; None where some are lost."""


def at_places(low: Float[Array, " arcs"], high: Float[Array, " arcs"]) -> Float[Array, "arcs places"]:
    """Parameters at all places of arcs between parameters."""
    return low[:, None] + (high - low)[:, None] * (1 + _PLACES) / 2


def arcs_of_parametric_curve(
    traced: Traced,
    index: Int[Array, " arcs"],
    low: Float[Array, " arcs"],
    high: Float[Array, " arcs"],
    left: Int[Array, " arcs"],
    right: Int[Array, " arcs"],
    first: int,
    tolerance: float,
) -> BoundaryArcs | None:
    """Arcs between parameters, halved until a polynomial describes each; None where points are lost.

    Parameters
    ----------
    traced : function
    index : (arcs,) int array
        As for `BoundaryArcs`.
    low, high : (arcs,) arrays
        Parameters of their ends.
    left, right : (arcs,) int arrays
        Numbers of the nodes there.
    first : int
        Number of the first new node.
    tolerance : float
        Error of the whole area, square radians.
    """

    def attempt(pieces: _ParameterRanges) -> Attempt[_ParameterRanges, BoundaryArcs]:
        rays = traced(pieces.low, pieces.high)
        if rays is None:
            raise _LostPointsError
        sky, noise = rays
        points, check = sky[:, : len(NODES)], sky[:, len(NODES) : -2]
        size = lengths(arc_values(DERIVATIVE, points)) @ WEIGHTS
        off, tangent = arc_values(_TO_CHECK, points) - check, unit(arc_values(_RATE_AT_CHECK, points))
        # Errors along the curve do not change the area.
        across = off - np.einsum("apx,apx->ap", off, tangent)[..., None] * tangent
        miss = lengths(across).max(axis=1) * size
        # The rounding of directions is part of the floor.
        floor = (noise + np.finfo(float).eps) * size
        good = (miss <= tolerance / len(pieces.low)) | (miss <= _ROUND_OFF * floor)
        ends = pieces.left, pieces.right, sky[:, -2], sky[:, -1]
        return Attempt(BoundaryArcs(pieces.index, *ends, points, miss + floor), good, pieces.halves)

    try:
        return arcs_by_halving(_ParameterRanges(index, low, high, left, right), attempt, first, _MOST_HALVINGS)[0]
    except _LostPointsError:
        return None


class _LostPointsError(Exception):
    """Some points of a curve could not be found."""


@dataclass(frozen=True)
class _ParameterRanges(Rows):
    """Pieces of a curve.

    index: As for `BoundaryArcs`.
    low, high: Parameters of their ends.
    left, right: Numbers of the nodes there.
    """

    index: Int[Array, " arcs"]
    low: Float[Array, " arcs"]
    high: Float[Array, " arcs"]
    left: Int[Array, " arcs"]
    right: Int[Array, " arcs"]

    def halves(self, chosen: Bool[Array, " arcs"], first: int) -> "_ParameterRanges":
        """Both halves of the chosen pieces."""
        whole = self[chosen]
        middle, new = (whole.low + whole.high) / 2, first + np.arange(len(whole))
        return replace(whole, high=middle, right=new).joined(replace(whole, low=middle, left=new))
