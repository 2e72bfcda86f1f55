"""Expressions of the time t in a small language, with their derivatives; anything else raises ValueError."""

import ast
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from graphlib import CycleError, TopologicalSorter
from operator import methodcaller
from typing import NamedTuple

from kerrcaustics.choices import suggestion
from kerrcaustics.scene_files.validation import SceneError

_LONGEST = 2000
_ALLOWED = (
    "numbers, t, + - * / **, "
    "sin cos tan atan exp log sqrt abs min max radians degrees, pi, and names of the table definitions"
)
CONSTANTS = {"pi": math.pi}
_Value = Callable[["Moment"], "Dual"]


class Dual(NamedTuple):
    """A value, and its rate: the derivative with respect to t."""

    value: float
    rate: float


def _square_root(x: Dual) -> Dual:
    root = math.sqrt(x.value)
    return Dual(root, 0.0 if x.rate == 0 else x.rate / (2 * root))


def _raised(x: Dual, y: Dual) -> Dual:
    value = math.pow(x.value, y.value)
    slope = 0.0 if x.rate == 0 or y.value == 0 else y.value * math.pow(x.value, y.value - 1) * x.rate
    return Dual(value, slope + (0.0 if y.rate == 0 else value * math.log(x.value) * y.rate))


_SIGNS: dict[type, Callable[[Dual], Dual]] = {ast.UAdd: lambda x: x, ast.USub: lambda x: Dual(-x.value, -x.rate)}
_OPERATORS: dict[type, Callable[[Dual, Dual], Dual]] = {
    ast.Add: lambda x, y: Dual(x.value + y.value, x.rate + y.rate),
    ast.Sub: lambda x, y: Dual(x.value - y.value, x.rate - y.rate),
    ast.Mult: lambda x, y: Dual(x.value * y.value, x.rate * y.value + x.value * y.rate),
    ast.Div: lambda x, y: Dual(x.value / y.value, (x.rate - x.value / y.value * y.rate) / y.value),
    ast.Pow: _raised,
}
_FUNCTIONS: dict[str, Callable[[Dual], Dual]] = {
    "sin": lambda x: Dual(math.sin(x.value), math.cos(x.value) * x.rate),
    "cos": lambda x: Dual(math.cos(x.value), -math.sin(x.value) * x.rate),
    "tan": lambda x: Dual(math.tan(x.value), x.rate / math.cos(x.value) ** 2),
    "exp": lambda x: Dual(math.exp(x.value), math.exp(x.value) * x.rate),
    "log": lambda x: Dual(math.log(x.value), x.rate / x.value),
    "sqrt": _square_root,
    "atan": lambda x: Dual(math.atan(x.value), x.rate / (1 + x.value**2)),
    "abs": lambda x: Dual(abs(x.value), math.copysign(1, x.value) * x.rate),
    "radians": lambda x: Dual(math.radians(x.value), math.radians(x.rate)),
    "degrees": lambda x: Dual(math.degrees(x.value), math.degrees(x.rate)),
}
_EXTREMES: dict[str, Callable[..., Dual]] = {"min": min, "max": max}
RESERVED = {"t", *CONSTANTS, *_FUNCTIONS, *_EXTREMES}
"""Names that no definition may have."""


@dataclass(frozen=True)
class Formula:
    """A parsed expression.

    entry: its entry in the file.
    text: its text.
    names: names that occur in it.
    value: function of a `Moment` that returns its value and derivative.
    """

    entry: str
    text: str
    names: frozenset[str]
    value: _Value = field(compare=False, repr=False)


def formula(entry: str, text: float | str) -> Formula:
    """The formula in an entry of a scene file; a ValueError of one line for an invalid expression."""
    if not isinstance(text, str):
        return Formula(entry, str(text), frozenset(), lambda _: Dual(float(text), 0.0))
    if len(text) > _LONGEST:
        raise SceneError(f"{entry} must be at most {_LONGEST} characters long, but has {len(text)}.")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
        value = _parsed(tree)
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        reason = str(error) if type(error) is ValueError else "cannot be read"
        excerpt = text if len(text) < 80 else f"{text[:77]}..."
        raise SceneError(f"{entry} must be made of {_ALLOWED}, but {excerpt!r}: {' '.join(reason.split())}.") from None
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return Formula(entry, text, frozenset(names - (RESERVED - {"t"})), value)


def _parsed(tree: ast.expr) -> _Value:
    """The value of an expression at a moment; raises ValueError for all that is not of the language."""
    # Few objects for each part, which the garbage collector scans repeatedly while a file is read.
    match tree:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return partial(_constant, Dual(float(number), 0.0))
        case ast.Name(id=name) if name in _FUNCTIONS or name in _EXTREMES:
            raise ValueError(f"{name} is a function")
        case ast.Name(id=name):
            return methodcaller("named", name)
        case ast.UnaryOp(op=sign, operand=part) if type(sign) in _SIGNS:
            return partial(_applied, _SIGNS[type(sign)], _parsed(part))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return partial(_joined, _OPERATORS[type(op)], _parsed(left), _parsed(right))
        case ast.Call(func=ast.Name(id=name), args=[part], keywords=[]) if name in _FUNCTIONS:
            return partial(_applied, _FUNCTIONS[name], _parsed(part))
        case ast.Call(func=ast.Name(id=name), args=[_, _, *_] as parts, keywords=[]) if name in _EXTREMES:
            return partial(_extreme, _EXTREMES[name], [_parsed(part) for part in parts])
        case ast.Call(func=ast.Name(id=name), keywords=[]) if name in _FUNCTIONS or name in _EXTREMES:
            raise ValueError(f"{name} takes {'one number' if name in _FUNCTIONS else 'two numbers or more'}")
        case _:
            raise ValueError(f"{ast.unparse(tree)[:40]!r} is none of these")


def _constant(value: Dual, _: "Moment") -> Dual:
    return value


def _applied(function: Callable[[Dual], Dual], part: _Value, moment: "Moment") -> Dual:
    return function(part(moment))


def _joined(function: Callable[[Dual, Dual], Dual], first: _Value, second: _Value, moment: "Moment") -> Dual:
    return function(first(moment), second(moment))


def _extreme(function: Callable[..., Dual], parts: list[_Value], moment: "Moment") -> Dual:
    return function(*[part(moment) for part in parts])


class Moment:
    """The values of formulas at one time, each computed at its first use.

    formulas: formulas by their names; values: values of further names.
    """

    def __init__(self, time: float, formulas: dict[str, Formula], values: dict[str, Dual] | None = None) -> None:
        self.time = time
        self._formulas = formulas
        self._values = {"t": Dual(time, 1.0), **{name: Dual(v, 0.0) for name, v in CONSTANTS.items()}, **(values or {})}

    def value(self, expression: Formula) -> Dual:
        """Value and derivative of a formula; ValueError of one line if it has none."""
        try:
            dual = expression.value(self)
        except (ArithmeticError, ValueError, RecursionError) as error:
            if isinstance(error, _NoValueError):
                raise
            raise _NoValueError(f"{expression.entry} must have a value at t = {self.time:g}, but: {error}.") from None
        if not (math.isfinite(dual.value) and math.isfinite(dual.rate)):
            raise _NoValueError(f"{expression.entry} must be finite at t = {self.time:g}, but is {dual.value:g}.")
        return dual

    def named(self, name: str) -> Dual:
        """Value and derivative of a name; the names on which it depends are computed first."""
        # A list in place of recursion, whose depth Python limits.
        waiting = [] if name in self._values else [name]
        while waiting:
            last = waiting[-1]
            # One at a time: with all of them, names that others need too would be listed many times.
            missing = next((n for n in self._formulas[last].names if n not in self._values), None)
            if missing is not None:
                waiting.append(missing)
            else:
                self._values[waiting.pop()] = self.value(self._formulas[last])
        return self._values[name]


class _NoValueError(SceneError):
    """A formula has no value at some time, in one line."""


def check_names(formulas: Iterable[Formula], named: dict[str, Formula], variables: Iterable[str]) -> None:
    """Raise ValueError for formulas with undefined names, or that depend on themselves."""
    defined = {"t", *named, *variables}
    for expression in (*named.values(), *formulas):
        for name in sorted(expression.names - defined):
            end = suggestion(name, defined)
            raise SceneError(f"{expression.entry} must use names that are defined, but {name} is not{end}")
    try:
        TopologicalSorter({name: sorted(f.names & named.keys()) for name, f in named.items()}).prepare()
    except CycleError as error:
        # Names from the needed one to the one that needs it, back to the first.
        circle = error.args[1][:-1]
        name = next(name for name in named if name in circle)
        before = circle[circle.index(name) - 1]
        raise SceneError(f"{named[name].entry} must not depend on itself, by way of {before}.") from None
