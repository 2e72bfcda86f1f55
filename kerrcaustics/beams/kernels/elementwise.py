"""Rules of lowering for primitives of JAX that act on each element: from the nodes of the operands to a node."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.beams.kernels.graph import FLAG, REAL, Graph

# Roots up to the sixteenth are square roots of square roots.
_PARTS_OF_POWERS = 16
WHOLE = "i"
"""Kind of whole numbers among operands and results; as nodes they are reals."""


class Call(NamedTuple):
    """A primitive where it is applied: its parameters, kinds of operands, kind of the result."""

    name: str
    parameters: dict[str, Any]
    kinds: tuple[str, ...]
    kind: str

    @property
    def node_kind(self) -> str:
        """The kind of the result as a node."""
        return FLAG if self.kind == FLAG else REAL


Rule = Callable[..., int]


def kind_of(dtype: Any) -> str:
    """The kind of numbers of a type; NotImplementedError if kernels have none."""
    dtype = np.dtype(dtype)
    if dtype == np.bool_:
        return FLAG
    if dtype == np.float64:
        return REAL
    if np.issubdtype(dtype, np.integer):
        return WHOLE
    raise NotImplementedError(f"Kernels have no numbers of type {dtype}.")


def same_name(graph: Graph, call: Call, *operands: int) -> int:
    """The operation of that name."""
    return graph.operation(call.name, *operands, kind=call.node_kind)


def of_reals(graph: Graph, call: Call, *operands: int) -> int:
    """The operation of that name, which whole numbers have not."""
    _refuse(call, call.kind == WHOLE)
    return same_name(graph, call, *operands)


def of_flags(graph: Graph, call: Call, *operands: int) -> int:
    """A logical operation; that of bits of whole numbers is none."""
    _refuse(call, call.kind != FLAG)
    return same_name(graph, call, *operands)


def comparison(graph: Graph, call: Call, a: int, b: int) -> int:
    """A comparison, of flags as a logical operation."""
    if call.kinds[0] != FLAG:
        return graph.operation(call.name, a, b, kind=FLAG)
    _refuse(call, call.name not in ("eq", "ne"))
    differ = graph.operation("xor", a, b, kind=FLAG)
    return differ if call.name == "ne" else graph.operation("not", differ, kind=FLAG)


def converted(graph: Graph, call: Call, a: int) -> int:
    """A number of another type: reals become whole numbers only where they are whole already."""
    given = call.kinds[0]
    if call.kind == FLAG:
        return a if given == FLAG else graph.operation("ne", a, graph.const(0.0), kind=FLAG)
    if given == FLAG:
        return graph.operation("real", a)
    _refuse(call, call.kind == WHOLE and not is_whole(graph, a))
    return a


def is_whole(graph: Graph, node: int) -> bool:
    """True if a node holds a whole number whatever its arguments are."""
    operation, arguments, _ = graph.nodes[node]
    if operation == "const":
        value = graph.value(node)
        return value is not None and value % 1 == 0
    if operation in ("floor", "rint", "real", "sign"):
        return True
    if operation == "select":
        return all(is_whole(graph, a) for a in arguments[1:])
    return operation in ("add", "sub", "mul", "neg", "abs", "max", "min") and all(is_whole(graph, a) for a in arguments)


def whole_power(graph: Graph, call: Call, base: int) -> int:
    """x^n for whole n."""
    return graph.power(base, call.parameters["y"])


def square(graph: Graph, call: Call, a: int) -> int:
    """x^2."""
    return graph.operation("mul", a, a)


def power(graph: Graph, call: Call, base: int, exponent: int) -> int:
    """x^y: by square roots if y is a multiple of 1/16, else by the exponential function, for x > 0."""
    y = graph.value(exponent)
    if y is not None and _PARTS_OF_POWERS * y % 1 == 0:
        positive = _power_by_roots(graph, base, abs(y))
        return positive if y >= 0 else graph.operation("div", graph.const(1.0), positive)
    return graph.operation("exp", graph.operation("mul", exponent, graph.operation("log", base)))


def _power_by_roots(graph: Graph, base: int, exponent: float) -> int:
    part, whole = math.modf(exponent)
    product = graph.power(base, int(whole))
    while part:
        base = graph.operation("sqrt", base)
        part *= 2
        if part >= 1:
            product = graph.operation("mul", product, base)
            part -= 1
    return product


def choice(graph: Graph, call: Call, which: int, *cases: int) -> int:
    """The case of a flag, False first, or of a whole number."""
    if call.kinds[0] == FLAG:
        return graph.operation("select", which, cases[1], cases[0], kind=call.node_kind)
    return nth(graph, which, cases, call.node_kind)


def nth(graph: Graph, which: int, cases: tuple[int, ...], kind: str) -> int:
    """The case of a whole number; the first and the last beyond them."""
    chosen = cases[0]
    for number, case in enumerate(cases[1:], 1):
        reached = graph.operation("ge", which, graph.const(float(number)), kind=FLAG)
        chosen = graph.operation("select", reached, case, chosen, kind=kind)
    return chosen


def clamped(graph: Graph, call: Call, least: int, a: int, most: int) -> int:
    """A number between two limits."""
    return graph.operation("min", graph.operation("max", a, least), most)


def ceiling(graph: Graph, call: Call, a: int) -> int:
    """The least whole number that is not smaller."""
    return graph.operation("neg", graph.operation("floor", graph.operation("neg", a)))


def to_even(graph: Graph, call: Call, a: int) -> int:
    """The nearest whole number, halves to the even one."""
    _refuse(call, int(call.parameters["rounding_method"]) != 1)
    return graph.operation("rint", a)


def arcsine(graph: Graph, call: Call, a: int) -> int:
    """The angle of a sine; NaN beyond 1."""
    one = graph.const(1.0)
    square = graph.operation("mul", graph.operation("sub", one, a), graph.operation("add", one, a))
    return graph.operation("atan2", a, graph.operation("sqrt", square))


def finite(graph: Graph, call: Call, a: int) -> int:
    """True for a finite number."""
    return graph.operation("finite", a, kind=FLAG)


def _refuse(call: Call, is_unknown: bool) -> None:
    if is_unknown:
        raise NotImplementedError(f"Kernels have no {call.name} from {call.kinds} to {call.kind!r}.")


ELEMENTWISE: dict[str, Rule] = {
    **dict.fromkeys(("add", "sub", "mul", "neg", "abs", "max", "min", "rem", "sign"), same_name),
    **dict.fromkeys(("div", "sqrt", "cbrt", "exp", "log", "log1p", "sin", "cos", "atan", "atan2", "floor"), of_reals),
    **dict.fromkeys(("and", "or", "xor", "not"), of_flags),
    **dict.fromkeys(("lt", "gt", "le", "ge", "eq", "ne"), comparison),
    "add_any": lambda graph, call, a, b: graph.operation("add", a, b),
    "convert_element_type": converted,
    "integer_pow": whole_power,
    "square": square,
    "pow": power,
    "select_n": choice,
    "clamp": clamped,
    "ceil": ceiling,
    "round": to_even,
    "asin": arcsine,
    "is_finite": finite,
}
"""Rules by the names of primitives."""
