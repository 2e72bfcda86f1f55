"""Rules of lowering for primitives of JAX that move or join elements of small arrays of nodes."""

from collections.abc import Callable
from itertools import product
from typing import Any

import jax
import numpy as np

from kerrcaustics.beams.kernels.elementwise import kind_of
from kerrcaustics.beams.kernels.graph import FLAG, REAL, Graph

Nodes = np.ndarray
Rule = Callable[..., list[Nodes]]


def constants(graph: Graph, values: Any, dtype: Any) -> Nodes:
    """The nodes of an array of constants."""
    kind = FLAG if kind_of(dtype) == FLAG else REAL
    array = np.asarray(values)
    return np.array([graph.const(value, kind) for value in array.ravel().tolist()], int).reshape(array.shape)


def constant_indices(graph: Graph, nodes: Nodes, equation: Any) -> np.ndarray:
    """Whole numbers that nodes hold; NotImplementedError if these depend on the ray."""
    values = [graph.value(int(node)) for node in nodes.ravel()]
    if any(value is None for value in values):
        raise NotImplementedError(f"Kernels have no {equation.primitive.name} by an index that depends on the call.")
    return np.array(values, float).astype(int).reshape(nodes.shape)


def broadcast(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
    """An array with more axes."""
    shape, axes = equation.params["shape"], equation.params["broadcast_dimensions"]
    own = [array.shape[axes.index(axis)] if axis in axes else 1 for axis in range(len(shape))]
    return [np.broadcast_to(array.reshape(own), shape)]


def reshaped(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
    """An array of another shape."""
    return [array.reshape(equation.outvars[0].aval.shape)]


def reversed_along(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
    """An array in the opposite order along some axes."""
    return [np.flip(array, equation.params["dimensions"])]


def transposed(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
    """An array with its axes in another order."""
    return [array.transpose(equation.params["permutation"])]


def sliced(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
    """A part of an array."""
    limits = equation.params["start_indices"], equation.params["limit_indices"]
    strides = equation.params["strides"] or (1,) * array.ndim
    return [array[tuple(map(slice, *limits, strides))]]


def stacked(graph: Graph, equation: Any, *arrays: Nodes) -> list[Nodes]:
    """Arrays along a new axis."""
    return [np.stack(arrays, axis=equation.params["axis"])]


def concatenated(graph: Graph, equation: Any, *arrays: Nodes) -> list[Nodes]:
    """Arrays one after the other."""
    return [np.concatenate(arrays, axis=equation.params["dimension"])]


def split(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
    """Parts of an array along an axis."""
    return np.split(array, np.cumsum(equation.params["sizes"])[:-1], axis=equation.params["axis"])


def iota(graph: Graph, equation: Any) -> list[Nodes]:
    """Whole numbers along an axis, from 0."""
    shape, axis = equation.params["shape"], equation.params["dimension"]
    row = np.arange(shape[axis]).reshape([-1 if i == axis else 1 for i in range(len(shape))])
    return [constants(graph, np.broadcast_to(row, shape), equation.params["dtype"])]


def by_known_index(graph: Graph, equation: Any, *arrays: Nodes) -> list[Nodes]:
    """Elements read or written at known indices: JAX moves the numbers of the nodes as if they were the elements."""
    first_index = _FIRST_INDEX[equation.primitive.name]
    moved = [
        constant_indices(graph, array, equation).astype(variable.aval.dtype)
        if first_index <= i < _last_index(equation)
        else array
        for i, (array, variable) in enumerate(zip(arrays, equation.invars, strict=True))
    ]
    return [np.asarray(equation.primitive.bind(*map(jax.numpy.asarray, moved), **equation.params))]


_FIRST_INDEX = {"dynamic_slice": 1, "dynamic_update_slice": 2, "gather": 1, "scatter": 1}


def _last_index(equation: Any) -> int:
    return 2 if equation.primitive.name in ("gather", "scatter") else len(equation.invars)


def reduced(operation: str) -> Rule:
    """The rule that joins the elements along some axes by an operation, from the first to the last."""

    def rule(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
        axes, shape = equation.params["axes"], equation.outvars[0].aval.shape
        kind = FLAG if operation in ("and", "or") else REAL
        columns = np.moveaxis(array, axes, range(len(axes))).reshape(-1, int(np.prod(shape)))
        return [np.array([joined(graph, operation, column, kind) for column in columns.T], int).reshape(shape)]

    return rule


def joined(graph: Graph, operation: str, nodes: Nodes, kind: str) -> int:
    """Nodes joined by an operation, from the first to the last."""
    first, *rest = nodes.tolist()
    for node in rest:
        first = graph.operation(operation, first, node, kind=kind)
    return first


def accumulated(graph: Graph, equation: Any, array: Nodes) -> list[Nodes]:
    """Sums of the elements up to each along an axis."""
    axis, back = equation.params["axis"], equation.params["reverse"]
    rows = np.moveaxis(np.flip(array, axis) if back else array, axis, 0)
    sums = [rows[0]]
    for row in rows[1:]:
        sums.append(np.vectorize(lambda a, b: graph.operation("add", a, b), otypes=[int])(sums[-1], row))
    result = np.moveaxis(np.stack(sums), 0, axis)
    return [np.flip(result, axis) if back else result]


def contracted(graph: Graph, equation: Any, first: Nodes, second: Nodes) -> list[Nodes]:
    """Sums of products over the contracted axes."""
    (own, other), (batch, _) = equation.params["dimension_numbers"]
    if batch:
        raise NotImplementedError("Kernels have no products of batches of matrices.")
    rows = np.moveaxis(first, own, range(-len(own), 0))
    columns = np.moveaxis(second, other, range(len(other)))
    count = int(np.prod(rows.shape[rows.ndim - len(own) :]))
    rows, columns = rows.reshape(-1, count), columns.reshape(count, -1)
    sums = [scalar_product(graph, row, column) for row, column in product(rows.tolist(), columns.T.tolist())]
    return [np.array(sums, int).reshape(equation.outvars[0].aval.shape)]


def scalar_product(graph: Graph, first: list[int], second: list[int]) -> int:
    """A sum of products, without those of which a factor is the constant 0.

    That is for the tables of weights of the integrator, which are half empty: their slopes are finite, or NaN all.
    """
    terms = [
        graph.operation("mul", a, b)
        for a, b in zip(first, second, strict=True)
        if graph.value(a) != 0.0 and graph.value(b) != 0.0
    ]
    return joined(graph, "add", np.array(terms), REAL) if terms else graph.const(0.0)


ARRAY_RULES: dict[str, Rule] = {
    "broadcast_in_dim": broadcast,
    **dict.fromkeys(("reshape", "squeeze", "expand_dims"), reshaped),
    "rev": reversed_along,
    "transpose": transposed,
    "slice": sliced,
    "stack": stacked,
    "concatenate": concatenated,
    "split": split,
    "iota": iota,
    **dict.fromkeys(_FIRST_INDEX, by_known_index),
    "reduce_sum": reduced("add"),
    "reduce_prod": reduced("mul"),
    "reduce_max": reduced("max"),
    "reduce_min": reduced("min"),
    "reduce_and": reduced("and"),
    "reduce_or": reduced("or"),
    "cumsum": accumulated,
    "dot_general": contracted,
}
"""Rules by the names of primitives."""
