"""Display of results: one line for a terminal; for a notebook a table of the numbers, and a small picture."""

import base64
import io
from collections.abc import Iterator, Sequence
from dataclasses import fields
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, overload

import numpy as np

from kerrcaustics.lazy_names import unknown_attribute
from kerrcaustics.results.declared import LAYOUTS, quantities
from kerrcaustics.results.units import as_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes

T = TypeVar("T")

# Largest size of an array that is shown in full.
_FEW = 4
# Largest length of a text that is shown in full.
_LONGEST_WORD = 60
# Most rows of a table.
_MOST_ROWS = 12
# First dimensions of one number, direction or place, which is shown in one cell.
_OF_ONE = {(), ("axis",), ("angle",), ("pair",), ("place_axis",)}


class Entry(NamedTuple):
    """A quantity of a result: its name, value, dimensions, unit and text."""

    name: str
    value: Any
    dims: tuple[str, ...]
    unit: str
    text: str


class Shown:
    """The display of results."""

    def __repr__(self) -> str:
        """Numbers, and sizes of arrays, in one line."""
        return one_line(self)

    def _repr_html_(self) -> str:
        """HTML for notebooks: the numbers with their errors, and a small picture."""
        return page(self)

    def plot(self, ax: "Axes | None" = None, **settings: Any) -> "Axes":
        """Draw it on axes, new ones where none are given, and return them.

        Parameters
        ----------
        ax : matplotlib Axes, optional
        settings
            Settings of the plot of this class, listed in [Plots](plots.md).
        """
        return plots().plot(self, ax, **settings)

    # To type checkers a name that is not there stays an error.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Raise the error about an attribute that is not there."""
            if hasattr(type(self), name):
                # A property of that name failed: its own error says how.
                return object.__getattribute__(self, name)
            names = [] if name.startswith("_") else [known for known in dir(self) if not known.startswith("_")]
            raise unknown_attribute(type(self).__name__, name, names)


class Items(Shown, Sequence[T]):
    """A result that is also the sequence in its first field."""

    @overload
    def __getitem__(self, place: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[T, ...]: ...
    def __getitem__(self, place: int | slice) -> T | tuple[T, ...]:
        """An item, or a tuple of items for a slice."""
        return next(iter(vars(self).values()))[place]

    def __len__(self) -> int:
        """Number of items."""
        return len(next(iter(vars(self).values())))


def plots() -> Any:
    """The module with the plots of results, which is loaded at the first use."""
    return import_module("kerrcaustics.draw.result_plots")


def one_line(result: Any) -> str:
    """The class, its numbers, and the sizes of its arrays."""
    names = [f.name for f in fields(result) if not f.name.startswith("_")]
    parts = [f"{name}={_short(getattr(result, name))}" for name in names]
    return f"{type(result).__name__}({', '.join(parts)})"


@np.errstate(all="ignore")
def page(result: Any) -> str:
    """HTML for a notebook: the line, a small picture if there is one, and tables of numbers, results and arrays."""
    entries = [entry for entry in _entries(result) if not _is_empty(entry.value)]
    single = [entry for entry in entries if not _is_long(entry) and not _holds_results(entry.value)]
    parts = [f"<p><code>{escape(repr(result))}</code></p>", _picture(result), _numbers(single) if single else ""]
    parts += [_rows(entry.name, entry.value) for entry in entries if _holds_results(entry.value)]
    parts += [_columns(group) for group in _groups([entry for entry in entries if _is_long(entry)])]
    return f"<div>{''.join(parts)}</div>"


def _entries(result: Any) -> Iterator[Entry]:
    """The quantities of a result, or the fields of another frozen dataclass; None is left out."""
    if type(result) in LAYOUTS:
        for each in quantities(type(result)).values():
            about = as_in(result, each)
            if (value := getattr(result, about.name)) is not None:
                yield Entry(about.name, value, about.dims, about.unit, about.text)
        return
    for part in fields(result):
        if not part.name.startswith("_") and (value := getattr(result, part.name)) is not None:
            yield Entry(part.name, value, tuple(map(str, np.shape(value))), "", "")


def _short(value: Any) -> str:
    """A value in a few characters."""
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, float | np.floating):
        return f"{value:.9g}"
    if isinstance(value, str):
        return repr(value if len(value) <= _LONGEST_WORD else value[: _LONGEST_WORD - 1] + "…")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_short(part)}" for key, part in list(value.items())[:_MOST_ROWS]) + "}"
    if isinstance(value, list | tuple):
        return _several(value)
    # Long texts of inner values are shortened to the name of the class.
    return f"<{type(value).__name__}>" if len(text := str(value)) > 3 * _LONGEST_WORD else text


def _array(values: np.ndarray) -> str:
    if values.size <= _FEW and values.ndim <= 1:
        return "[" + ", ".join(_short(value.item()) for value in values.ravel()) + "]"
    return f"<{' × '.join(map(str, values.shape))} array>"


def _several(values: Sequence[Any]) -> str:
    plain = all(isinstance(value, int | float | str) for value in values)
    if plain and len(values) <= _FEW:
        return "(" + ", ".join(map(_short, values)) + ")"
    kinds = sorted({type(value).__name__ for value in values})
    return f"<{len(values)} × {' or '.join(kinds)}>"


def _is_long(entry: Entry) -> bool:
    """True for an array with a dimension of its own, such as the points of a curve."""
    return isinstance(entry.value, np.ndarray) and entry.value.ndim > 0 and entry.dims[:1] not in _OF_ONE


def _is_empty(value: Any) -> bool:
    """True for an empty text or container, such as a list of no remarks."""
    return isinstance(value, dict | list | tuple | str) and len(value) == 0


def _holds_results(value: Any) -> bool:
    return isinstance(value, Sequence) and len(value) > 0 and type(value[0]) in LAYOUTS


def _numbers(entries: list[Entry]) -> str:
    """A table of single numbers and words, one a line, with their units; the pointer shows their texts."""
    lines = [_line([entry.name, _value_text(entry), _unit(entry.unit)], "td", entry.text) for entry in entries]
    return f"<table>{_line(['quantity', 'value', 'unit'], 'th')}{''.join(lines)}</table>"


def _groups(entries: list[Entry]) -> list[list[Entry]]:
    """Arrays along the same dimension together."""
    return [[entry for entry in entries if entry.dims[0] == dim] for dim in dict.fromkeys(e.dims[0] for e in entries)]


def _columns(group: list[Entry]) -> str:
    """Arrays along one dimension: a row for each place if they are few, else the ranges of the numbers."""
    count = len(group[0].value)
    if 0 < count <= _MOST_ROWS and all(entry.value[0].ndim <= 1 and entry.value[0].size <= _FEW for entry in group):
        heads = [group[0].dims[0], *(f"{entry.name}{_bracketed(entry.unit)}" for entry in group)]
        lines = [_line([str(i), *(_cell(entry.value[i], entry.name) for entry in group)], "td") for i in range(count)]
        return f"<table>{_line(heads, 'th')}{''.join(lines)}</table>"
    heads = ["array", "shape", "least", "largest", "unit"]
    lines = [
        _line([entry.name, *_range(entry.value, entry.name), _unit(entry.unit)], "td", entry.text) for entry in group
    ]
    return f"<table>{_line(heads, 'th')}{''.join(lines)}</table>"


def _rows(name: str, results: Sequence[Any]) -> str:
    """A table of results within a result: a line each, of their single numbers."""
    rows = [
        [entry for entry in _entries(part) if not (_is_long(entry) or _is_empty(entry.value))]
        for part in results[:_MOST_ROWS]
    ]
    heads = list(dict.fromkeys(entry.name for row in rows for entry in row))
    lines = []
    for row in rows:
        texts = {entry.name: _value_text(entry) for entry in row}
        lines.append(_line([texts.get(head, "") for head in heads], "td"))
    more = f"<p>and {len(results) - len(rows)} more</p>" if len(results) > len(rows) else ""
    return f"<p>{escape(name)}</p><table>{_line(heads, 'th')}{''.join(lines)}</table>{more}"


def _value_text(entry: Entry) -> str:
    """The value of an entry: errors to two digits, words without quotation marks."""
    if isinstance(entry.value, str):
        return entry.value
    if isinstance(entry.value, np.ndarray | np.generic | float):
        return _cell(entry.value, entry.name)
    return _short(entry.value)


def _cell(value: Any, name: str = "") -> str:
    """A number, or a few; errors to two digits."""
    digits = 2 if "error" in name or name == "residual" else 7
    parts = np.asarray(value).ravel().tolist()
    return ", ".join(f"{part + 0.0:.{digits}g}" if isinstance(part, float) else str(part) for part in parts)


def _range(values: np.ndarray, name: str) -> list[str]:
    """Shape, least and largest of the finite numbers."""
    shape = " × ".join(map(str, values.shape))
    if values.dtype.kind not in "iufb":
        return [shape, "", ""]
    finite = values[np.isfinite(values)]
    return [shape, _cell(finite.min(), name), _cell(finite.max(), name)] if finite.size else [shape, "", ""]


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _bracketed(unit: str) -> str:
    return f" ({unit})" if _unit(unit) else ""


def _line(cells: list[str], kind: str, text: str = "") -> str:
    """A line of a table."""
    about = f' title="{escape(text)}"' if text else ""
    return f"<tr{about}>{''.join(f'<{kind}>{escape(cell)}</{kind}>' for cell in cells)}</tr>"


def _picture(result: Any) -> str:
    """The plot of a result as a PNG within the page; empty if it has none."""
    figure = plots().small_picture(result)
    if figure is None:
        return ""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return (
        f'<img alt="{type(result).__name__}" src="data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"/>'
    )
