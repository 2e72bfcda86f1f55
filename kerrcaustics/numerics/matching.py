"""What belongs together: pairs of least cost, and nodes of a graph that are connected."""

import numpy as np

from kerrcaustics.shapes import Float, Int

Array = np.ndarray


def best_matches(cost: Float[Array, "n m"]) -> tuple[Int[Array, " pairs"], Int[Array, " pairs"]]:
    """Rows, ascending, and their columns: as many pairs as there can be, with the least sum of costs."""
    rows, columns = np.arange(cost.shape[0]), np.arange(cost.shape[1])
    if cost.size == 0:
        return rows[:0], columns[:0]
    # Where no two want the same partner, all have the one that they want. That is nearly always so.
    if len(rows) <= len(columns):
        cheapest = cost.argmin(axis=1)
        if len(np.unique(cheapest)) == len(rows):
            return rows, cheapest
    else:
        cheapest = cost.argmin(axis=0)
        order = np.argsort(cheapest)
        if len(np.unique(cheapest)) == len(columns):
            return cheapest[order], columns[order]
    from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(cost)


def component_of(first: Int[Array, " links"], second: Int[Array, " links"], nodes: int) -> Int[Array, " nodes"]:
    """The lowest node that each node of a graph is connected with, for links between nodes of these numbers."""
    lowest = np.arange(nodes)
    while (lowest[first] != lowest[second]).any():
        least = np.minimum(lowest[first], lowest[second])
        for end in (first, second):
            # What a node stands for is connected too: so the ways to the lowest are cut in halves.
            np.minimum.at(lowest, lowest[end], least)
        lowest = lowest[lowest]
    return lowest
