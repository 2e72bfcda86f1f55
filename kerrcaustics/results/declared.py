"""Declarations of results: their quantities, each with dimensions, unit and one text.

`@result` makes a frozen dataclass whose fields are declared with `quantity`; properties may be declared with `derived`.
The docstring and the equality of the class follow from them here, files in storage.py, records for JSON in records.py
and Datasets in datasets.py.
"""

import inspect
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache
from typing import Any, TypeVar, dataclass_transform, get_args, get_type_hints

import numpy as np

Kind = TypeVar("Kind")
Get = TypeVar("Get", bound=Callable[..., Any])

usual_warnings = np.errstate(all="warn", under="ignore")
"""NumPy's own settings, as a decorator of public functions: a user's may make errors of underflow and infinities."""


@dataclass(frozen=True)
class Quantity:
    """The declaration of a number, or of an array of numbers.

    name: name of the field.
    dims: names of the dimensions, of which one that ends in "..." stands for any number of them.
    unit: "rad", "1" for pure numbers, "" for all that is no number, or a role of units.py.
    text: the description.
    dtype: type in the stores of sweeps.
    json: name in records, where a name that ends in _deg is written in degrees.
    column: name in Datasets, or the prefix of the names of the quantities of a result within a result.
    given: True for an angle that the user gives in degrees, and gets back unchanged.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    text: str
    dtype: str = "float64"
    json: str | None = None
    column: str | None = None
    given: bool = False


@dataclass(frozen=True)
class Layout:
    """The record of a result: its schema, and its names: always (name=value is a constant), as points, as rows."""

    schema: str
    names: tuple[str, ...]
    points: tuple[str, ...]
    rows: tuple[str, ...]


RUN_TIME = "s"
"""The unit of run times. Times that are computed are in units of the mass."""

# Units in the reference, of the roles of units.py and of pure numbers.
_UNIT_TEXTS = {
    "1": "",
    "sky": "rad (Observer: GM/c^2)",
    "solid angle": "sr (Observer: (GM/c^2)^2)",
    "place": "rad (plane: GM/c^2 and rad)",
    "level": "rad (plane: GM/c^2)",
    "light": "c^4/(GM)^2 (Observer: 1)",
    "flux": "c^4/(GM)^2 (Observer: 1); spot: sr (Observer: (GM/c^2)^2)",
    "source size": "rad (finite radius: GM/c^2)",
    "magnification": "1 (by viewer and surface also areas in GM/c^2)",
}

LAYOUTS: dict[type, Layout] = {}
"""All results whose modules are loaded."""


def quantity(
    dims: str,
    unit: str,
    text: str,
    *,
    json: str | None = None,
    column: str | None = None,
    given: bool = False,
    default: Any = MISSING,
) -> Any:
    """A field of a result; parameters as for `Quantity`, the dimensions in one string. default dict: empty."""
    about = Quantity("", tuple(dims.split()), unit, text, json=json, column=column, given=given)
    if default is dict:
        return field(default_factory=dict, metadata={"quantity": about})
    return field(default=default, metadata={"quantity": about})


def viewer(*, json: str | None = "") -> Any:
    """The field with the viewer of a result, which no column has; json: None where its record has it."""
    return quantity("", "", "the viewer", json=json, column="")


def surface(*, json: str | None = "", default: Any = MISSING) -> Any:
    """The field with the surface of a result's sources; json as for `viewer`."""
    return quantity("", "", "surface on which the sources lie", json=json, column="", default=default)


def highest_index() -> Any:
    """The field with the argument `max_index`."""
    return quantity("", "1", "highest Morse index requested")


def certified(text: str, *, dims: str = "", default: Any = MISSING) -> Any:
    """The field that is True where a result is certified; text: what that means."""
    return quantity(dims, "1", text, default=default)


def remarks(text: str = "remarks on what is in doubt; empty when certified", *, default: Any = MISSING) -> Any:
    """The field with the remarks on a result, in words."""
    return quantity("", "", text, default=default)


def derived(dims: str, unit: str, *, json: str | None = None, column: str | None = None) -> Callable[[Get], Get]:
    """A property that is a quantity of its result as well, with the first line of its docstring as the text."""

    def declare(get: Get) -> Get:
        text = (inspect.getdoc(get) or "").split("\n")[0].rstrip(".")
        text = text[:1].lower() + text[1:]
        getter = usual_warnings(get)
        vars(getter)["quantity"] = Quantity("", tuple(dims.split()), unit, text, json=json, column=column)
        return getter

    return declare


@dataclass_transform(
    eq_default=False,
    frozen_default=True,
    field_specifiers=(quantity, viewer, surface, highest_index, certified, remarks),
)
def result(
    schema: str, *, record: str = "", points: str = "", rows: str = "", eq: bool = False, kw_only: bool = False
) -> Callable[[type[Kind]], type[Kind]]:
    """Make a class a result: a frozen dataclass, equal to another if all quantities but run times are.

    Parameters
    ----------
    schema : str
        Of its record, after "kerrcaustics/".
    record : str
        Content of the record: names of quantities in order, and constants as name=value. By default all fields.
    points : str
        Further content of a record with points.
    rows : str
        Arrays along one dimension that the record holds as a list of rows, named after the dimension.
    eq : bool
        True for a class that is compared, and hashed, as other dataclasses are.
    """

    def declare(kind: type[Kind]) -> type[Kind]:
        # The text of a class of few numbers is a call that makes it.
        made: Any = dataclass(frozen=True, eq=eq, repr=eq, kw_only=kw_only)(kind)
        if not eq:
            made.__eq__, made.__hash__ = same, None
        names = record.split() or [name for name in stored(made) if not name.startswith("_")]
        LAYOUTS[made] = Layout(f"kerrcaustics/{schema}", tuple(names), tuple(points.split()), tuple(rows.split()))
        made.__doc__ = _documented(made)
        return made

    return declare


@dataclass_transform(eq_default=False, frozen_default=True, field_specifiers=(quantity,))
def base(kind: type[Kind]) -> type[Kind]:
    """Make a class a base of results, whose quantities come first in theirs."""
    made: Any = dataclass(frozen=True, eq=False, repr=False)(kind)
    return made


@cache
def stored(kind: type) -> dict[str, Quantity]:
    """The quantities that are fields of a result, by name: the arguments of its class, and the content of files."""
    return {f.name: replace(f.metadata["quantity"], name=f.name) for f in fields(kind) if "quantity" in f.metadata}


@cache
def quantities(kind: type) -> dict[str, Quantity]:
    """All quantities of a result, by name: the fields that users see, and the properties declared with `derived`."""
    declared = {name: about for name, about in stored(kind).items() if not name.startswith("_")}
    for name, member in inspect.getmembers(kind, lambda member: isinstance(member, property)):
        about = vars(member.fget).get("quantity")
        if about is not None:
            declared[name] = replace(about, name=name)
    return declared


@cache
def element(kind: type, name: str) -> tuple[Any, bool]:
    """The result, or the base class of results, that a field holds, and whether it may hold several; else None."""
    hint = get_type_hints(kind).get(name)
    if hint in LAYOUTS and issubclass(hint, Sequence):
        return element(hint, next(iter(stored(hint))))
    inner = next((part for part in (hint, *get_args(hint)) if _is_result(part)), None)
    return inner, inner is not None and inner is not hint


def _is_result(hint: Any) -> bool:
    return isinstance(hint, type) and any(issubclass(kind, hint) for kind in LAYOUTS)


def same(first: Any, second: Any) -> bool:
    """True if two results, or parts of them, are of one type and every number is the same; NaN is equal to NaN.

    Run times are not compared: they differ each time.
    """
    first, second = (value.item() if isinstance(value, np.generic) else value for value in (first, second))
    if type(first) is not type(second):
        return False
    if type(first) in LAYOUTS and type(first).__eq__ is same:
        compared = (name for name, about in stored(type(first)).items() if about.unit != RUN_TIME)
        return all(same(getattr(first, name), getattr(second, name)) for name in compared)
    if isinstance(first, np.ndarray):
        exact = first.dtype == second.dtype and first.shape == second.shape
        return exact and np.array_equal(first, second, equal_nan=first.dtype.kind in "fc")
    if isinstance(first, dict):
        return first.keys() == second.keys() and all(same(first[key], second[key]) for key in first)
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(same, first, second))
    return bool(first == second or (first != first and second != second))


def _documented(kind: type) -> str:
    """The docstring, followed by the quantities that it declares."""
    doc = inspect.cleandoc(kind.__doc__ or "")
    if "Parameters\n---" in doc or not stored(kind):
        return doc
    hints = get_type_hints(kind)
    lines = [doc, "", "Attributes", "----------"]
    for name, about in stored(kind).items():
        if not name.startswith("_"):
            unit = _UNIT_TEXTS.get(about.unit, about.unit)
            what = ", ".join(filter(None, (_type(hints[name], about.dims), unit)))
            lines += [f"{name} : {what}", textwrap.indent(textwrap.fill(_sentence(about.text), 110), "    ")]
    return "\n".join(lines)


def _sentence(text: str) -> str:
    """A text with a full stop, and a capital where its first word is no symbol."""
    return f"{text[0].upper() if re.match('[a-z]+[ ,]', text) else text[0]}{text[1:]}."


def _type(hint: Any, dims: tuple[str, ...]) -> str:
    """A type in words: "array over image × axis", "tuple of Cusp", "float or None"."""
    if type(None) in get_args(hint):
        rest = [part for part in get_args(hint) if part is not type(None)]
        return " or ".join([*(_type(part, dims) for part in rest), "None"])
    text = re.sub(r"\btuple\[([\w.]+), \.\.\.\]", r"tuple of \1", inspect.formatannotation(hint))
    if "ndarray" in text and "tuple" not in text:
        # Separated by commas, the documentation would make each name a link.
        return f"array over {' × '.join(dims)}"
    return re.sub(r"\w+\.|\[.*", "", text)
