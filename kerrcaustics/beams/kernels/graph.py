"""Operations of a function of one ray as a graph in which equal operations are one node."""

from collections.abc import Iterable
from typing import Any, NamedTuple

from kerrcaustics.beams.kernels.arithmetic import folded
from kerrcaustics.beams.kernels.simplification import SIMPLER

REAL, FLAG = "f", "b"
"""Kinds of nodes: real numbers (whole numbers too, as reals), and flags."""

PER_RAY = frozenset({"in", "carry", "loopout"})
"""Nodes that depend on the ray whatever their arguments are."""


class Node(NamedTuple):
    """An operation on other nodes.

    operation: name of the operation.
    arguments: numbers of the nodes it is applied to.
    attribute: by operation, text of a constant, number of a column or parameter, place of a carried number, or the
        numbers of a table and of a column in it.
    """

    operation: str
    arguments: tuple[int, ...]
    attribute: Any


class Graph:
    """Nodes by their numbers. The arguments of a node have smaller numbers than the node.

    Operations without arguments: "const"; "param", a number of the call; "in", a number of the ray; "carry", a number
    that a loop carries; "table", a table of the call. "loopout" is what a loop leaves (see loops.py), "lookup" a number
    in the row of a table whose number is the argument. All others are operations of `operation`.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.kinds: list[str] = []
        self.uniform: list[bool] = []
        self._numbers: dict[tuple[Node, str], int] = {}

    def make(self, operation: str, arguments: tuple[int, ...] = (), attribute: Any = None, kind: str = REAL) -> int:
        """The node of an operation as it stands; an equal one is used again."""
        node = Node(operation, tuple(arguments), attribute)
        number = self._numbers.setdefault((node, kind), len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
            self.kinds.append(kind)
            self.uniform.append(operation not in PER_RAY and all(self.uniform[a] for a in node.arguments))
        return number

    def const(self, value: float | bool, kind: str = REAL) -> int:
        """The node of a constant; as text, as zeros differ by their sign and NaN does not equal itself."""
        return self.make("const", (), repr(bool(value) if kind == FLAG else float(value)), kind)

    def value(self, node: int) -> float | bool | None:
        """The value of a constant; None for any other node."""
        operation, _, text = self.nodes[node]
        if operation != "const":
            return None
        return text == "True" if self.kinds[node] == FLAG else float(text)

    def operation(self, name: str, *arguments: int, kind: str = REAL) -> int:
        """The node of an operation, or a constant or a simpler node that is equal to the bit."""
        values = [self.value(a) for a in arguments]
        known = [value for value in values if value is not None]
        if len(known) == len(values):
            value = folded(name, known)
            if value is not None:
                return self.const(value, kind)
        simpler = SIMPLER[name](self, *arguments) if name in SIMPLER else None
        return self.make(name, arguments, None, kind) if simpler is None else simpler

    def power(self, base: int, exponent: int) -> int:
        """A whole power, by repeated squaring."""
        if exponent < 0:
            return self.operation("div", self.const(1.0), self.power(base, -exponent))
        product = None
        while exponent:
            if exponent & 1:
                product = base if product is None else self.operation("mul", product, base)
            exponent >>= 1
            if exponent:
                base = self.operation("mul", base, base)
        return self.const(1.0) if product is None else product


def live(graph: Graph, roots: Iterable[int]) -> list[int]:
    """The nodes that the roots depend on, in ascending order."""
    found, waiting = set(), list(roots)
    while waiting:
        node = waiting.pop()
        if node not in found:
            found.add(node)
            waiting.extend(graph.nodes[node].arguments)
    return sorted(found)
