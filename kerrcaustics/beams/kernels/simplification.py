"""Simpler forms of operations, equal to the bit, zeros with their signs and infinities included.

x + 0 and 0 x are therefore left as they are. Each rule returns a node, or None if there is no simpler form.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kerrcaustics.beams.kernels.graph import Graph
else:
    Graph = Any


def is_zero(value: float | bool | None, sign: float) -> bool:
    """True for a zero of that sign."""
    return value is not None and value == 0.0 and math.copysign(1.0, value) == sign


def negated(graph: Graph, node: int) -> int | None:
    """The argument of a negation; None for any other node."""
    operation, arguments, _ = graph.nodes[node]
    return arguments[0] if operation == "neg" else None


def _argument_of(graph: Graph, node: int, operation: str) -> int | None:
    return graph.nodes[node].arguments[0] if graph.nodes[node].operation == operation else None


def _ordered(graph: Graph, name: str, a: int, b: int, kind: str = "f") -> int:
    return graph.make(name, (min(a, b), max(a, b)), None, kind)


def product(graph: Graph, a: int, b: int) -> int:
    """A product: without factors of 1 and -1, the sign outside, |x| |x| as x x."""
    for one, other in ((a, b), (b, a)):
        factor, inner = graph.value(one), negated(graph, other)
        if factor == 1.0:
            return other
        if factor == -1.0:
            return graph.operation("neg", other)
        if inner is not None:
            # A constant takes the sign.
            if factor is not None:
                return graph.operation("mul", graph.const(-factor), inner)
            return graph.operation("neg", graph.operation("mul", one, inner))
    size = _argument_of(graph, a, "abs")
    if a == b and size is not None:
        return graph.operation("mul", size, size)
    return _ordered(graph, "mul", a, b)


def total(graph: Graph, a: int, b: int) -> int:
    """A sum: without -0, as a difference if a term is negated; (x + 0) + 0 as x + 0."""
    for one, other in ((a, b), (b, a)):
        inner = negated(graph, one)
        if is_zero(graph.value(one), -1.0):
            return other
        if is_zero(graph.value(one), 1.0) and _has_added_zero(graph, other):
            return other
        if inner is not None:
            return graph.operation("sub", other, inner)
    return _ordered(graph, "add", a, b)


def _has_added_zero(graph: Graph, node: int) -> bool:
    operation, arguments, _ = graph.nodes[node]
    return operation == "add" and any(is_zero(graph.value(a), 1.0) for a in arguments)


def difference(graph: Graph, a: int, b: int) -> int | None:
    """A difference: without 0, as a sum if what is subtracted is negated."""
    inner = negated(graph, b)
    if is_zero(graph.value(b), 1.0):
        return a
    return None if inner is None else graph.operation("add", a, inner)


def quotient(graph: Graph, a: int, b: int) -> int | None:
    """A quotient: by a power of two as a product, the sign outside."""
    divisor, above, below = graph.value(b), negated(graph, a), negated(graph, b)
    if divisor is not None and math.isfinite(divisor) and abs(math.frexp(divisor)[0]) == 0.5:
        inverse = 1 / divisor
        if math.isfinite(inverse):
            return graph.operation("mul", a, graph.const(inverse))
    if above is not None:
        return graph.operation("neg", graph.operation("div", above, b))
    if below is not None:
        return graph.operation("neg", graph.operation("div", a, below))
    return None


def opposite(graph: Graph, a: int) -> int | None:
    """-(-x) is x."""
    return negated(graph, a)


def size(graph: Graph, a: int) -> int | None:
    """|-x| is |x|, and so is ||x||."""
    inner = negated(graph, a)
    if inner is not None:
        return graph.operation("abs", inner)
    return a if graph.nodes[a].operation == "abs" else None


def choice(graph: Graph, flag: int, true: int, false: int) -> int | None:
    """A choice: by a known flag, between equal nodes, without a negated flag; of flags by logical operations."""
    known, inner = graph.value(flag), _argument_of(graph, flag, "not")
    kind = graph.kinds[true]
    if known is not None:
        return true if known else false
    if true == false:
        return true
    if inner is not None:
        return graph.operation("select", inner, false, true, kind=kind)
    return None if kind != "b" else _choice_of_flags(graph, flag, true, false)


def _choice_of_flags(graph: Graph, flag: int, true: int, false: int) -> int | None:
    opposite_flag = graph.operation("not", flag, kind="b")
    match graph.value(true), graph.value(false):
        case True, _:
            return graph.operation("or", flag, false, kind="b")
        case False, _:
            return graph.operation("and", opposite_flag, false, kind="b")
        case _, True:
            return graph.operation("or", opposite_flag, true, kind="b")
        case _, False:
            return graph.operation("and", flag, true, kind="b")
    return None


def contrary(graph: Graph, flag: int) -> int | None:
    """Not not x is x; not equal, and equal, are one node."""
    operation, arguments, _ = graph.nodes[flag]
    if operation in ("eq", "ne"):
        return graph.operation("ne" if operation == "eq" else "eq", *arguments, kind="b")
    return arguments[0] if operation == "not" else None


def conjunction(graph: Graph, a: int, b: int) -> int:
    """Two flags of which both must hold."""
    return _joined(graph, "and", a, b)


def disjunction(graph: Graph, a: int, b: int) -> int:
    """Two flags of which one must hold."""
    return _joined(graph, "or", a, b)


def _joined(graph: Graph, name: str, a: int, b: int) -> int:
    for one, other in ((a, b), (b, a)):
        known = graph.value(one)
        if known is not None:
            return other if known == (name == "and") else one
    return a if a == b else _ordered(graph, name, a, b, "b")


def unlike(graph: Graph, a: int, b: int) -> int:
    """Two flags that must differ."""
    for one, other in ((a, b), (b, a)):
        known = graph.value(one)
        if known is not None:
            return graph.operation("not", other, kind="b") if known else other
    return _ordered(graph, "xor", a, b, "b")


def equal(graph: Graph, a: int, b: int) -> int:
    """Equal numbers; a flag that was made a number is compared with 0 as a flag."""
    flag = _flag_beside_zero(graph, a, b)
    return _ordered(graph, "eq", a, b, "b") if flag is None else graph.operation("not", flag, kind="b")


def unequal(graph: Graph, a: int, b: int) -> int:
    """Unequal numbers, like equal ones."""
    flag = _flag_beside_zero(graph, a, b)
    return _ordered(graph, "ne", a, b, "b") if flag is None else flag


def _flag_beside_zero(graph: Graph, a: int, b: int) -> int | None:
    for one, other in ((a, b), (b, a)):
        if graph.value(one) == 0.0:
            return _argument_of(graph, other, "real")
    return None


SIMPLER: dict[str, Callable[..., int | None]] = {
    "mul": product,
    "add": total,
    "sub": difference,
    "div": quotient,
    "neg": opposite,
    "abs": size,
    "select": choice,
    "not": contrary,
    "and": conjunction,
    "or": disjunction,
    "xor": unlike,
    "eq": equal,
    "ne": unequal,
}
"""Rules by the names of operations."""
