"""Fewer divisions: one reciprocal for all quotients by a number, to within one more rounding each.

Divisions are the slowest operations of a processor, and cannot overlap.
"""

import math
from collections import Counter
from dataclasses import replace

from kerrcaustics.beams.kernels.graph import Graph, live
from kerrcaustics.beams.kernels.lowering import Lowered


def with_merged_divisions(function: Lowered) -> Lowered:
    """A function with products by reciprocals in the place of some quotients.

    Of numbers by which several are divided; of those of the call, by which numbers of rays are divided, as their
    reciprocals are computed once; of constants. Reciprocals of numbers below 6e-309 overflow.
    """
    graph, old = Graph(), function.graph
    nodes = live(old, function.roots)
    divisors = Counter(old.nodes[n].arguments[1] for n in nodes if old.nodes[n].operation == "div")
    new: dict[int, int] = {}
    for node in nodes:
        operation, arguments, attribute = old.nodes[node]
        given = tuple(new[a] for a in arguments)
        if operation == "div" and _is_merged(old, arguments, divisors[arguments[1]]):
            new[node] = graph.operation("mul", given[0], graph.operation("div", graph.const(1.0), given[1]))
        elif not given or operation in ("loopout", "lookup"):
            new[node] = graph.make(operation, given, attribute, old.kinds[node])
        else:
            new[node] = graph.operation(operation, *given, kind=old.kinds[node])
    outputs = tuple(output._replace(node=new[output.node]) for output in function.outputs)
    return replace(function, graph=graph, outputs=outputs)


def _is_merged(graph: Graph, quotient: tuple[int, ...], count: int) -> bool:
    above, below = quotient
    divisor = graph.value(below)
    if divisor is not None:
        return divisor != 0 and math.isfinite(1 / divisor)
    return count > 1 or (graph.uniform[below] and not graph.uniform[above])
