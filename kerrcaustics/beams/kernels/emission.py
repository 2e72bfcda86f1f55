"""Graphs as text in C++: a loop over lanes of rays, in terms of the functions of functions.h."""

import math
from collections.abc import Callable, Iterable

from kerrcaustics.beams.kernels.graph import FLAG, live
from kerrcaustics.beams.kernels.loops import Loop, loops_of
from kerrcaustics.beams.kernels.lowering import Lowered

# Operators of C++; of vectors and numbers, in any mixture.
_ARITHMETIC = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
_COMPARISONS = {"lt": "<", "gt": ">", "le": "<=", "ge": ">=", "eq": "==", "ne": "!="}
_LOGIC = {"and": "&", "or": "|", "xor": "^"}
# Functions that take vectors, or numbers, alone.
_ROUNDING = ("floor", "rint", "rem", "abs", "sign", "copysign", "finite", "max", "min")
_ELEMENTARY = ("sqrt", "cbrt", "exp", "log", "log1p", "sin", "cos", "atan", "atan2")
FUNCTIONS = frozenset((*_ROUNDING, *_ELEMENTARY))
"""Operations that are a function of functions.h, named with an underscore behind."""


def emitted(function: Lowered, name: str) -> str:
    """The text of a function of C++ that computes all rays.

    It takes the parameters of the call; the columns and the outputs, each by the address and the stride of its numbers,
    behind the columns the tables, by their address and the number of their rows; the number of rays.
    """
    return _Text(function).kernel(name)


class _Text:
    """The lines of a function. Numbers of the call are s0, s1, ...; those of lanes of rays are v0, v1, ..."""

    def __init__(self, function: Lowered) -> None:
        self._function, self._graph = function, function.graph
        nodes = live(self._graph, function.roots)
        self._loops = loops_of(self._graph, nodes)
        self._once = [node for node in nodes if self._graph.uniform[node]]
        inside = {node for loop in self._loops.values() for node in loop.body}
        self._per_lanes = [node for node in nodes if not self._graph.uniform[node] and node not in inside]
        self._lines: list[str] = []
        # Sines and cosines of an argument are computed together; arguments for which they are there.
        self._turns: set[int] = set()

    def kernel(self, name: str) -> str:
        self._add(0, f'extern "C" void {name}(const double *P, const In *in, const Out *out, int64_t n) {{')
        self._statements(1, self._once)
        self._add(1, "for (int64_t i = 0; i < n; i += W) {")
        self._statements(2, self._per_lanes)
        for slot, (node, kind, _) in enumerate(self._function.outputs):
            self._add(2, f"store_{kind}(out, {slot}, i, n, {self._lanes(node)});")
        self._add(1, "}")
        self._add(0, "}")
        return "\n".join(self._lines) + "\n"

    def _add(self, depth: int, line: str) -> None:
        self._lines.append("  " * depth + line)

    def _statements(self, depth: int, nodes: Iterable[int]) -> None:
        for node in nodes:
            operation, arguments, attribute = self._graph.nodes[node]
            if operation in ("const", "param", "carry"):
                continue
            if operation == "loopout":
                self._loop(depth, attribute[0])
                self._add(depth, f"const {self._type(node)} {self._name(node)} = c{attribute[0]}_{attribute[1]};")
                continue
            if operation in ("sin", "cos") and not self._graph.uniform[node]:
                self._turn(depth, arguments[0])
            self._add(depth, f"const {self._type(node)} {self._name(node)} = {self._expression(node)};")

    def _turn(self, depth: int, angle: int) -> None:
        if angle not in self._turns:
            self._turns.add(angle)
            self._add(depth, f"const SC t{angle} = sincos_({self._lanes(angle)});")

    def _loop(self, depth: int, number: int) -> None:
        """A loop until no lane goes on, once."""
        loop = self._loops.pop(number, None)
        if loop is None:
            return
        types = [self._type(node) for node in loop.after]
        for i, node in enumerate(loop.before):
            self._add(depth, f"{types[i]} c{number}_{i} = {self._lanes(node)};")
        self._add(depth, "for (;;) {")
        for i, node in enumerate(loop.carried):
            if node is not None:
                self._add(depth + 1, f"const {types[i]} {self._name(node)} = c{number}_{i};")
        self._turn_of_loop(depth + 1, number, loop)
        self._add(depth, "}")

    def _turn_of_loop(self, depth: int, number: int, loop: Loop) -> None:
        self._statements(depth, loop.condition)
        self._add(depth, f"const M go{number} = {self._lanes(loop.goes_on)};")
        self._add(depth, f"if (!any_(go{number})) break;")
        self._statements(depth, loop.turn)
        for i, (before, after) in enumerate(zip(loop.carried, loop.after, strict=True)):
            if before != after:
                choose = "selm" if self._graph.kinds[after] == FLAG else "sel"
                name = f"c{number}_{i}"
                self._add(depth, f"{name} = {choose}(go{number}, {self._lanes(after)}, {name});")

    def _type(self, node: int) -> str:
        is_flag = self._graph.kinds[node] == FLAG
        if self._graph.uniform[node]:
            return "int64_t" if is_flag else "double"
        return "M" if is_flag else "V"

    def _name(self, node: int) -> str:
        """A node as it is named, or written, in an expression."""
        operation, _, attribute = self._graph.nodes[node]
        if operation == "const":
            return literal(self._graph.value(node))
        if operation == "param":
            return f"P[{attribute}]"
        return f"s{node}" if self._graph.uniform[node] else f"v{node}"

    def _lanes(self, node: int) -> str:
        """A node as lanes, in each of which a number of the call is the same."""
        if not self._graph.uniform[node]:
            return self._name(node)
        return f"{'M' if self._graph.kinds[node] == FLAG else 'V'}_({self._name(node)})"

    def _expression(self, node: int) -> str:
        operation, arguments, attribute = self._graph.nodes[node]
        alone = self._graph.uniform[node]
        names = [self._name(argument) for argument in arguments]
        # All numbers of the call, or all lanes.
        alike = names if alone else [self._lanes(argument) for argument in arguments]
        if operation == "in":
            return f"load(in, {attribute}, i, n)"
        if operation == "lookup":
            kind, width = self._function.tables[attribute[0]]
            slot = self._function.columns + attribute[0]
            return f"looked_up<{kind}, {width}>(in[{slot}], {attribute[1]}, {alike[0]})"
        if operation in ("sin", "cos") and not alone:
            return f"t{arguments[0]}.{operation[0]}"
        if operation in _ARITHMETIC or operation in _COMPARISONS:
            # Between a number and lanes too.
            return f" {(_ARITHMETIC | _COMPARISONS)[operation]} ".join(names)
        if operation in _LOGIC:
            return f" {_LOGIC[operation]} ".join(alike)
        if operation == "select":
            return self._choice(node, alike)
        if operation in FUNCTIONS:
            return f"{operation}_({', '.join(alike)})"
        return _OTHERS[operation](*alike)

    def _choice(self, node: int, alike: list[str]) -> str:
        flag = self._graph.nodes[node].arguments[0]
        if self._graph.uniform[flag]:
            return f"{self._name(flag)} ? {alike[1]} : {alike[2]}"
        choose = "selm" if self._graph.kinds[node] == FLAG else "sel"
        return f"{choose}({', '.join(alike)})"


_OTHERS: dict[str, Callable[[str], str]] = {
    "neg": lambda a: f"-{a}",
    "not": lambda a: f"not_({a})",
    "real": lambda a: f"real_({a})",
}


def literal(value: float | bool | None) -> str:
    """A constant as C++ writes it, to the bit."""
    if isinstance(value, bool):
        return "1" if value else "0"
    if value is None or math.isnan(value):
        return "NOTANUMBER"
    if math.isinf(value):
        return "INF" if value > 0 else "(-INF)"
    return repr(value) if math.copysign(1.0, value) > 0 else f"({value!r})"
