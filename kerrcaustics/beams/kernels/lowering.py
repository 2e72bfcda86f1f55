"""Functions of JAX as graphs: a function is traced for one ray, and each primitive becomes operations on nodes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np

from kerrcaustics.beams.kernels.array_rules import ARRAY_RULES, Nodes, constants
from kerrcaustics.beams.kernels.elementwise import ELEMENTWISE, Call, kind_of, nth
from kerrcaustics.beams.kernels.graph import FLAG, Graph
from kerrcaustics.spacetime.settings import own_settings


class Output(NamedTuple):
    """A number that a function returns.

    node: its node.
    kind: "f", "b" or "i".
    leaf: number of the leaf of the result to which it belongs.
    """

    node: int
    kind: str
    leaf: int


@dataclass(frozen=True)
class Lowered:
    """A function of one ray as a graph.

    graph: the graph.
    outputs: all elements of all leaves of the result, in order.
    shapes: shape and type of each leaf.
    tree: structure of the result.
    columns: how many numbers of the ray the function takes.
    parameters: how many numbers of the call the function takes.
    tables: type of numbers and width of each table of the call (see tables.py).
    """

    graph: Graph
    outputs: tuple[Output, ...]
    shapes: tuple[jax.ShapeDtypeStruct, ...]
    tree: Any
    columns: int
    parameters: int
    tables: tuple[tuple[str, int], ...] = ()

    @property
    def roots(self) -> list[int]:
        """The nodes of the outputs."""
        return [output.node for output in self.outputs]


@own_settings()
def lowered(function: Callable[..., Any], arguments: Sequence[Any], by_ray: Sequence[bool | None]) -> Lowered:
    """A function of one ray as a graph.

    Parameters
    ----------
    function : callable
        A function that JAX can trace.
    arguments : sequence
        Its arguments, trees of numbers and small arrays. Only their types and shapes matter.
    by_ray : sequence of bool or None
        For each leaf of the arguments in the order of `jax.tree.leaves`, True if each ray has its own: a column for
        each element. Other leaves are parameters of a call or, where this is None, tables (n, k) for any n.

    Raises
    ------
    NotImplementedError
        If kernels have no rule for an operation of the function.
    """
    traced, shape = jax.make_jaxpr(function, return_shape=True)(*arguments)
    shapes, tree = jax.tree.flatten(shape)
    graph = Graph()
    types = [variable.aval for variable in traced.jaxpr.invars]
    inputs, columns, parameters = _inputs(graph, types, by_ray)
    results = Lowering(graph).closed(traced, inputs)
    kinds = [kind_of(leaf.dtype) for leaf in shapes]
    outputs = [Output(int(n), kinds[i], i) for i, result in enumerate(results) for n in result.ravel()]
    tables = [(leaf.dtype.str[1:], leaf.shape[1]) for leaf, own in zip(types, by_ray, strict=True) if own is None]
    return Lowered(graph, tuple(outputs), tuple(shapes), tree, columns, parameters, tuple(tables))


def _inputs(graph: Graph, types: Sequence[Any], by_ray: Sequence[bool | None]) -> tuple[list[Nodes], int, int]:
    """Nodes of the arguments; the number of columns and of parameters."""
    counts, inputs = {"in": 0, "param": 0, "table": 0}, []
    for leaf, is_column in zip(types, by_ray, strict=True):
        if is_column is None:
            # A table as a whole is one node.
            inputs.append(np.array(graph.make("table", (), counts["table"])))
            counts["table"] += 1
            continue
        operation = "in" if is_column else "param"
        first, size = counts[operation], int(np.prod(leaf.shape))
        nodes = [graph.make(operation, (), number) for number in range(first, first + size)]
        if kind_of(leaf.dtype) == FLAG:
            nodes = [graph.operation("ne", node, graph.const(0.0), kind=FLAG) for node in nodes]
        inputs.append(np.array(nodes, int).reshape(leaf.shape))
        counts[operation] += size
    return inputs, counts["in"], counts["param"]


class Lowering:
    """The primitives of a function, one after the other, as nodes of a graph. Arrays are arrays of nodes."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self._loops = 0

    def closed(self, jaxpr: Any, inputs: Sequence[Nodes]) -> list[Nodes]:
        """The results of a traced function with its constants."""
        values = zip(jaxpr.consts, jaxpr.jaxpr.constvars, strict=True)
        return self.open(jaxpr.jaxpr, [constants(self.graph, c, v.aval.dtype) for c, v in values], inputs)

    def open(self, jaxpr: Any, consts: Sequence[Nodes], inputs: Sequence[Nodes]) -> list[Nodes]:
        """The results of a traced function."""
        nodes = dict(zip([*jaxpr.constvars, *jaxpr.invars], [*consts, *inputs], strict=True))

        def read(variable: Any) -> Nodes:
            is_literal = hasattr(variable, "val")
            return constants(self.graph, variable.val, variable.aval.dtype) if is_literal else nodes[variable]

        for equation in jaxpr.eqns:
            results = self._results(equation, [read(variable) for variable in equation.invars])
            nodes.update(zip(equation.outvars, results, strict=True))
        return [read(variable) for variable in jaxpr.outvars]

    def _results(self, equation: Any, inputs: list[Nodes]) -> Sequence[Nodes]:
        name = equation.primitive.name
        if name in CONTROL:
            return CONTROL[name](self, equation, inputs)
        if name in ARRAY_RULES:
            return ARRAY_RULES[name](self.graph, equation, *inputs)
        if name in ELEMENTWISE:
            return [self._elementwise(ELEMENTWISE[name], equation, inputs)]
        raise NotImplementedError(f"Kernels have no rule for {name}, with parameters {equation.params}.")

    def _elementwise(self, rule: Callable[..., int], equation: Any, inputs: list[Nodes]) -> Nodes:
        kinds = tuple(kind_of(variable.aval.dtype) for variable in equation.invars)
        call = Call(equation.primitive.name, equation.params, kinds, kind_of(equation.outvars[0].aval.dtype))
        elements = zip(*(array.ravel().tolist() for array in np.broadcast_arrays(*inputs)), strict=True)
        nodes = [rule(self.graph, call, *operands) for operands in elements]
        return np.array(nodes, int).reshape(equation.outvars[0].aval.shape)

    def results_of_call(self, equation: Any, inputs: list[Nodes]) -> Sequence[Nodes]:
        """The results of a function within the function."""
        if equation.params.get("name") == "copysign":
            # JAX takes the bits of numbers apart there.
            pairs = zip(*(array.ravel().tolist() for array in np.broadcast_arrays(*inputs)), strict=True)
            nodes = [self.graph.operation("copysign", size, sign) for size, sign in pairs]
            return [np.array(nodes, int).reshape(equation.outvars[0].aval.shape)]
        if equation.params.get("name") == "table_row":
            table, index = (array.item() for array in inputs)
            number, columns = self.graph.nodes[table].attribute, range(equation.outvars[0].aval.size)
            return [np.array([self.graph.make("lookup", (index,), (number, column)) for column in columns])]
        inner = next(equation.params[key] for key in ("jaxpr", "call_jaxpr", "fun_jaxpr") if key in equation.params)
        return self.closed(inner, inputs) if hasattr(inner, "consts") else self.open(inner, [], inputs)

    def scan(self, equation: Any, inputs: list[Nodes]) -> Sequence[Nodes]:
        """A loop of known length, written out."""
        params = equation.params
        first_carried, first_row = params["num_consts"], params["num_consts"] + params["num_carry"]
        fixed, carried, rows = inputs[:first_carried], inputs[first_carried:first_row], inputs[first_row:]
        results: list[list[Nodes]] = []
        turns = range(params["length"])
        for turn in reversed(turns) if params["reverse"] else turns:
            after = self.closed(params["jaxpr"], [*fixed, *carried, *(np.asarray(row[turn]) for row in rows)])
            carried = after[: params["num_carry"]]
            results.append(after[params["num_carry"] :])
        if params["reverse"]:
            results.reverse()
        return [*carried, *(np.stack(column) for column in zip(*results, strict=True))]

    def loop(self, equation: Any, inputs: list[Nodes]) -> Sequence[Nodes]:
        """A loop until no ray goes on."""
        params, graph = equation.params, self.graph
        of_condition, of_body = params["cond_nconsts"], params["cond_nconsts"] + params["body_nconsts"]
        before = inputs[of_body:]
        kinds = [graph.kinds[n] for array in before for n in array.ravel()]
        number, self._loops = self._loops, self._loops + 1
        turn = [graph.make("carry", (), (number, i), kind) for i, kind in enumerate(kinds)]
        carried = _shaped(turn, before)
        (goes_on,) = self.closed(params["cond_jaxpr"], [*inputs[:of_condition], *carried])
        after = self.closed(params["body_jaxpr"], [*inputs[of_condition:of_body], *carried])
        arguments = tuple(int(n) for array in (*before, *after, goes_on) for n in array.ravel())
        left = [graph.make("loopout", arguments, (number, i, len(kinds)), kind) for i, kind in enumerate(kinds)]
        return _shaped(left, before)

    def branches(self, equation: Any, inputs: list[Nodes]) -> Sequence[Nodes]:
        """A choice between functions: all of them, and the results of one."""
        which, *operands = inputs
        results = [self.closed(branch, operands) for branch in equation.params["branches"]]
        chosen = []
        for cases in zip(*results, strict=True):
            elements = zip(*(case.ravel().tolist() for case in cases), strict=True)
            nodes = [nth(self.graph, which.item(), element, self.graph.kinds[element[0]]) for element in elements]
            chosen.append(np.array(nodes, int).reshape(cases[0].shape))
        return chosen


def _shaped(nodes: list[int], like: Sequence[Nodes]) -> list[Nodes]:
    """Nodes in a row as arrays of the shapes of others."""
    ends = np.cumsum([array.size for array in like])
    return [
        np.array(nodes[end - array.size : end], int).reshape(array.shape) for array, end in zip(like, ends, strict=True)
    ]


def _unchanged(lowering: Lowering, equation: Any, inputs: list[Nodes]) -> Sequence[Nodes]:
    return inputs


CONTROL: dict[str, Callable[[Lowering, Any, list[Nodes]], Sequence[Nodes]]] = {
    "scan": Lowering.scan,
    "while": Lowering.loop,
    "cond": Lowering.branches,
    **dict.fromkeys(
        ("jit", "pjit", "closed_call", "core_call", "custom_jvp_call", "custom_vjp_call", "checkpoint"),
        Lowering.results_of_call,
    ),
    **dict.fromkeys(("stop_gradient", "copy", "copy_p", "xla_metadata_value"), _unchanged),
}
"""Rules for functions within functions, loops and choices, and for primitives that change nothing."""
