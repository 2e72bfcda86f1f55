"""Arcs along curves of which every point can be found: critical curves, and limbs where the sky is symmetric."""

from collections.abc import Callable

import numpy as np

from kerrcaustics.extended_sources.arcs import DERIVATIVE, GUESSED, NODES, WEIGHTS, BoundaryArcs, along, values_at
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.sphere import lengths, unit

Array = np.ndarray

# Rounds of halving. An arc is not halved where its error is below so many times that of the curve.
_MOST_HALVINGS, _ROUND_OFF = 10, 3.0
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


def refined(
    traced: Traced,
    index: Int[Array, " arcs"],
    low: Float[Array, " arcs"],
    high: Float[Array, " arcs"],
    left: Int[Array, " arcs"],
    right: Int[Array, " arcs"],
    first: int,
    wanted: float,
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
    wanted : float
        Error of the whole area, square radians.
    """
    pieces: list[BoundaryArcs] = []
    for halving in range(_MOST_HALVINGS + 1):
        rays = traced(low, high)
        if rays is None:
            return None
        sky, noise = rays
        points, check = sky[:, : len(NODES)], sky[:, len(NODES) : -2]
        size = lengths(along(DERIVATIVE, points)) @ WEIGHTS
        off, tangent = along(_TO_CHECK, points) - check, unit(along(_RATE_AT_CHECK, points))
        # What points miss along the curve does not matter.
        across = off - np.einsum("apx,apx->ap", off, tangent)[..., None] * tangent
        miss = lengths(across).max(axis=1) * size
        # Directions are rounded, too.
        floor = (noise + np.finfo(float).eps) * size
        good = (miss <= wanted / len(low)) | (miss <= _ROUND_OFF * floor) | (halving == _MOST_HALVINGS)
        pieces.append(BoundaryArcs(index, left, right, sky[:, -2], sky[:, -1], points, miss + floor)[good])
        if good.all():
            break
        low, high, left, right, index = (values[~good] for values in (low, high, left, right, index))
        middle, new = (low + high) / 2, first + np.arange(len(low))
        first += len(low)
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        left, right, index = np.concatenate([left, new]), np.concatenate([new, right]), np.tile(index, 2)
    return pieces[0].joined(*pieces[1:])
