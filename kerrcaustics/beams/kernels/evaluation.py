"""Graphs evaluated without a compiler, in an arithmetic of one's own."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kerrcaustics.beams.kernels.arithmetic import ELEMENTARY, ROUNDED_ONCE
from kerrcaustics.beams.kernels.graph import live
from kerrcaustics.beams.kernels.loops import Loop, loops_of
from kerrcaustics.beams.kernels.lowering import Lowered


def _repeated(condition: Callable[[Any], Any], turn: Callable[[Any], Any], start: Any) -> Any:
    while condition(start):
        start = turn(start)
    return start


@dataclass(frozen=True)
class Arithmetic:
    """Numbers and what can be done with them.

    operations: functions by the names of operations of a graph.
    number: function that makes a number of this kind from a constant.
    any: function that is True if one of some flags holds.
    repeated: function that applies a turn to a start while a condition holds.
    """

    operations: Mapping[str, Callable[..., Any]]
    number: Callable[[float | bool], Any]
    any: Callable[[Any], Any]
    repeated: Callable[..., Any] = _repeated


DOUBLES = Arithmetic({**ROUNDED_ONCE, **ELEMENTARY}, np.asarray, np.any)
"""Doubles, or arrays of them with one for each ray."""


def evaluated(
    function: Lowered,
    parameters: Sequence[Any],
    columns: Sequence[Any] | np.ndarray,
    arithmetic: Arithmetic = DOUBLES,
    tables: Sequence[np.ndarray] = (),
) -> list[Any]:
    """The outputs of a function.

    Parameters
    ----------
    function : Lowered
        The function.
    parameters, columns : sequence
        Numbers of the call, and of the ray, in this arithmetic.
    arithmetic : Arithmetic
        The arithmetic.
    tables : sequence of (n, k) array
        Tables of the call; of doubles only.
    """
    if (len(parameters), len(columns)) != (function.parameters, function.columns):
        raise ValueError(
            f"The function takes {function.parameters} parameters and {function.columns} columns, "
            f"but got {len(parameters)} and {len(columns)}."
        )
    if function.tables and arithmetic is not DOUBLES:
        raise NotImplementedError("Tables are looked up by machine code and in doubles alone.")
    run = _Run(function, {"param": parameters, "in": columns, "table": tables}, arithmetic)
    with np.errstate(all="ignore"):
        return run.outputs()


class _Run:
    """The values of nodes, one after the other."""

    def __init__(
        self, function: Lowered, inputs: dict[str, Sequence[Any] | np.ndarray], arithmetic: Arithmetic
    ) -> None:
        self._graph, self._roots, self._inputs, self._arithmetic = function.graph, function.roots, inputs, arithmetic
        nodes = live(self._graph, self._roots)
        self._loops = loops_of(self._graph, nodes)
        inside = {node for loop in self._loops.values() for node in loop.body}
        self._outside = [node for node in nodes if node not in inside]
        self._values: dict[int, Any] = {}
        self._left: dict[int, list[Any]] = {}

    def outputs(self) -> list[Any]:
        self._evaluate(self._outside)
        return [self._values[root] for root in self._roots]

    def _evaluate(self, nodes: Iterable[int]) -> None:
        for node in nodes:
            if self._graph.nodes[node].operation != "carry":
                self._values[node] = self._value(node)

    def _value(self, node: int) -> Any:
        operation, arguments, attribute = self._graph.nodes[node]
        if operation == "const":
            value = self._graph.value(node)
            assert value is not None
            return self._arithmetic.number(value)
        if operation in self._inputs:
            return self._inputs[operation][attribute]
        if operation == "loopout":
            number, place, _ = attribute
            if number not in self._left:
                self._left[number] = self._run(self._loops[number])
            return self._left[number][place]
        if operation == "lookup":
            table = self._inputs["table"][attribute[0]]
            rows = np.nan_to_num(np.clip(self._values[arguments[0]], 0, len(table) - 1)).astype(int)
            return table[rows, attribute[1]].astype(float)
        return self._arithmetic.operations[operation](*(self._values[a] for a in arguments))

    def _run(self, loop: Loop) -> list[Any]:
        """The numbers that a loop leaves."""
        select, first = self._arithmetic.operations["select"], [self._values[n] for n in loop.before]

        def goes_on(carried: list[Any]) -> Any:
            values = zip(loop.carried, carried, strict=True)
            self._values.update({node: value for node, value in values if node is not None})
            self._evaluate(loop.condition)
            return self._values[loop.goes_on]

        def turn(state: tuple[Any, list[Any]]) -> tuple[Any, list[Any]]:
            # Where turns are made into a program, nothing is known in one from outside.
            flag = goes_on(state[1])
            self._evaluate(loop.turn)
            values = [self._values[node] for node in loop.after]
            carried = [select(flag, after, before) for after, before in zip(values, state[1], strict=True)]
            return goes_on(carried), carried

        start = (goes_on(first), first)
        return self._arithmetic.repeated(lambda state: self._arithmetic.any(state[0]), turn, start)[1]
