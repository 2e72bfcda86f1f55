"""Loops of a graph: numbers carried from turn to turn until no ray goes on.

A loop of n numbers has n nodes "carry" with the attribute (loop, i), the numbers of the present turn, and n nodes
"loopout" with (loop, i, n), those that are left. The arguments of a "loopout" are the n numbers before the loop, the n
numbers after a turn, and the flag of rays that go on, which is computed before a turn. The numbers of a ray that has
stopped stay.
"""

from collections.abc import Sequence
from typing import NamedTuple

from kerrcaustics.beams.kernels.graph import Graph, live


class Loop(NamedTuple):
    """A loop.

    before: nodes that are carried at first.
    carried: nodes that stand for the carried numbers, None if unused.
    after: nodes of the carried numbers after a turn.
    goes_on: node of the flag.
    condition: nodes that depend on carried numbers and belong to the flag.
    turn: all other nodes that depend on carried numbers.
    """

    before: tuple[int, ...]
    carried: tuple[int | None, ...]
    after: tuple[int, ...]
    goes_on: int
    condition: list[int]
    turn: list[int]

    @property
    def body(self) -> list[int]:
        """The nodes that depend on carried numbers."""
        return self.condition + self.turn


def loops_of(graph: Graph, nodes: Sequence[int]) -> dict[int, Loop]:
    """The loops among nodes in ascending order, by their numbers; NotImplementedError for one within another."""
    within = _loop_by_node(graph, nodes)
    loops = {}
    for node in nodes:
        operation, arguments, attribute = graph.nodes[node]
        if operation == "loopout" and attribute[0] not in loops:
            number, _, count = attribute
            body = [n for n in nodes if within.get(n) == number]
            carries = {graph.nodes[n].attribute[1]: n for n in body if graph.nodes[n].operation == "carry"}
            carried = tuple(carries.get(i) for i in range(count))
            before, after, goes_on = arguments[:count], arguments[count:-1], arguments[-1]
            of_flag = set(live(graph, [goes_on]))
            condition, turn = ([n for n in body if (n in of_flag) == is_first] for is_first in (True, False))
            loops[number] = Loop(before, carried, after, goes_on, condition, turn)
    return loops


def _loop_by_node(graph: Graph, nodes: Sequence[int]) -> dict[int, int]:
    within: dict[int, int] = {}
    for node in nodes:
        operation, arguments, attribute = graph.nodes[node]
        if operation == "loopout":
            count = attribute[2]
            if any(argument in within for argument in arguments[:count]):
                raise NotImplementedError("Kernels have no loops within loops.")
            continue
        outer = {within[argument] for argument in arguments if argument in within}
        if operation == "carry":
            outer.add(attribute[0])
        if len(outer) > 1:
            raise NotImplementedError("Kernels have no loops within loops.")
        if outer:
            within[node] = outer.pop()
    return within
