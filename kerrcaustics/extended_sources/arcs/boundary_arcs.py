"""Arcs: smooth pieces of the boundaries of images, as polynomials through Gauss-Legendre nodes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.polynomial import legendre

from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows

Array = np.ndarray

GUESSED = legendre.leggauss(6)[0]
"""Places in (-1, 1) along an arc at which it is guessed and brought to the limb."""
NODES, WEIGHTS = legendre.leggauss(7)
"""Places in (-1, 1) along an arc of its points, at which it is checked, with their weights."""

# Rounds in a row with more and more arcs in doubt that show that a curve is lost.
_LASTING = 4


@dataclass(frozen=True)
class BoundaryArcs(Rows):
    """Arcs on the search sky, one entry each.

    index: Morse index of the images that they bound.
    left, right: Numbers of the nodes at both ends.
    start, stop: Directions there.
    points: Directions at `NODES`.
    error: Error of the area beside the arc, square radians.
    """

    index: Int[Array, " arcs"]
    left: Int[Array, " arcs"]
    right: Int[Array, " arcs"]
    start: Float[Array, "arcs 3"]
    stop: Float[Array, "arcs 3"]
    points: Float[Array, "arcs nodes 3"]
    error: Float[Array, " arcs"]


Pieces = TypeVar("Pieces")
Arcs = TypeVar("Arcs", bound=Rows)


@dataclass(frozen=True)
class Attempt(Generic[Pieces, Arcs]):
    """Arcs through pieces of curves, and a function that halves pieces for the next attempt.

    arcs: One for each piece.
    good: True for arcs that lie on their curves.
    halves: Both halves of chosen pieces, by the number of the first new node.
    """

    arcs: Arcs
    good: Bool[Array, " pieces"]
    halves: Callable[[Bool[Array, " pieces"], int], Pieces]


def arcs_by_halving(
    pieces: Pieces,
    attempt: Callable[[Pieces], Attempt[Pieces, Arcs]],
    first: int,
    most_halvings: int,
    most_doubtful: int | None = None,
) -> tuple[Arcs, int]:
    """Arcs through pieces that are halved until the arcs are good, and the number of arcs that remain in doubt.

    Parameters
    ----------
    pieces : Pieces
    attempt : function of pieces
    first : int
        Number of the first new node.
    most_halvings : int
        Rounds of halving.
    most_doubtful : int, optional
        Number of arcs in doubt above which a curve is given up, as it is if their number keeps growing. None if every
        point of the curves can be found.
    """
    parts: list[Arcs] = []
    bad: list[int] = []
    for halving in range(most_halvings + 1):
        tried = attempt(pieces)
        bad.append(int((~tried.good).sum()))
        lost = most_doubtful is not None and (_is_lost(bad) or bad[-1] > most_doubtful)
        kept = tried.good | (halving == most_halvings) | lost
        parts.append(tried.arcs[kept])
        if kept.all():
            break
        pieces = tried.halves(~kept, first)
        first += int((~kept).sum())
    return parts[0].joined(*parts[1:]), bad[-1]


def _is_lost(doubtful: list[int]) -> bool:
    """True if a curve is lost, by the numbers of its arcs in doubt after each halving."""
    return len(doubtful) > _LASTING and bool((np.diff(doubtful[-_LASTING - 1 :]) > 0).all())


def values_at(nodes: Float[Array, " nodes"], places: Float[Array, " places"]) -> Float[Array, "places nodes"]:
    """The matrix from values of a polynomial at nodes to its values at places."""
    highest = len(nodes) - 1
    return legendre.legvander(places, highest) @ np.linalg.inv(legendre.legvander(nodes, highest))


def arc_values(
    matrix: Float[Array, "places nodes"], points: Float[Array, "arcs nodes axes"]
) -> Float[Array, "arcs places axes"]:
    """Values at places along arcs from those at nodes."""
    return np.einsum("pn,anx->apx", matrix, points)


def with_ends(
    start: Float[Array, "arcs axes"], points: Float[Array, "arcs nodes axes"], stop: Float[Array, "arcs axes"]
) -> Float[Array, "arcs nodes+2 axes"]:
    """Points of arcs between their ends."""
    return np.concatenate([start[:, None], points, stop[:, None]], axis=1)


def at_nodes(
    left: Int[Array, " arcs"], right: Int[Array, " arcs"], ends: Float[Array, "both 3"]
) -> Float[Array, "both 3"]:
    """Places of starts and then of stops of arcs, equal for all arcs that meet at a node.

    left, right: numbers of the nodes; ends: their places by each arc.
    """
    _, first, node = np.unique(np.concatenate([left, right]), return_index=True, return_inverse=True)
    return ends[first][node]


_HIGHEST = len(NODES) - 1
DERIVATIVE = legendre.legval(NODES, legendre.legder(np.linalg.inv(legendre.legvander(NODES, _HIGHEST)))).T
"""The matrix that takes values at `NODES` to derivatives there."""
AT_ENDS = values_at(NODES, np.array([-1.0, 1.0]))
"""The matrix that takes values at `NODES` to those at both ends."""
