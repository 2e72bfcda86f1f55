"""Tables that keep all their digits, however narrow the terminal is."""

import math
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any

from rich import box
from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

# Where a head may be broken; not seen elsewhere.
_SOFT_HYPHEN = "\N{SOFT HYPHEN}"
# Spaces between columns, and whether heads are broken: the first that fits is taken.
_LAYOUTS = ((2, False), (1, False), (1, True))


class PlainTable:
    """Rows under heads; closer together, and at last one below the other as `head  value`, in a narrow terminal."""

    def __init__(self, heads: tuple[str, ...], words: Container[str] = ()) -> None:
        """Empty; the columns of `words` are set to the left."""
        self._heads, self._words = heads, words
        self._rows: list[tuple[str, ...]] = []

    def add_row(self, *cells: str) -> None:
        """A row, with a cell for each head."""
        self._rows.append(cells)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        for gap, broken in _LAYOUTS:
            table = self._side_by_side(gap, broken)
            if Measurement.get(console, options.update(max_width=10_000), table).maximum <= options.max_width:
                yield table
                return
        yield from self._stacked()

    def _side_by_side(self, gap: int, broken: bool) -> Table:
        table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, gap - 1, 0, 0))
        for i, head in enumerate(self._heads):
            widest = max((len(row[i]) for row in self._rows), default=0)
            shown = (
                _broken(head) if broken and len(_without_soft_hyphens(head)) > widest else _without_soft_hyphens(head)
            )
            table.add_column(shown, justify="left" if head in self._words else "right", no_wrap=True)
        for row in self._rows:
            table.add_row(*row)
        return table

    def _stacked(self) -> Iterator[RenderableType]:
        heads = [_without_soft_hyphens(head) for head in self._heads]
        width = max(map(len, heads))
        for row in self._rows:
            for head, cell in zip(heads, row, strict=True):
                yield Text(f"{head:<{width}}  {cell}".rstrip(), overflow="fold")
            yield Text()


def table_of(rows: Iterable[Any], columns: Mapping[str, str | Callable[[Any], str]]) -> PlainTable:
    """Table with a row for each result.

    columns: under each head a quantity and its format, "error:.0e", or a function of the result. Under a head that ends
    in "(deg)" stand degrees.
    """
    table = PlainTable(tuple(columns))
    for row in rows:
        table.add_row(*(cell(row) if callable(cell) else _cell(head, cell, row) for head, cell in columns.items()))
    return table


def rows_of(result: Any) -> list[SimpleNamespace]:
    """Rows of a result whose arrays run along one dimension, as it declares them."""
    from kerrcaustics.results.declared import LAYOUTS

    columns = {name: getattr(result, name) for name in LAYOUTS[type(result)].rows}
    columns = {name: column for name, column in columns.items() if column is not None}
    return [SimpleNamespace(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]


def _cell(head: str, column: str, row: Any) -> str:
    """A number, or several, of a row in a format."""
    import numpy as np

    name, _, form = column.partition(":")
    numbers = np.ravel(getattr(row, name)).tolist()
    return " ".join(format(math.degrees(x) if head.endswith("(deg)") else x, form) for x in numbers)


def _without_soft_hyphens(head: str) -> str:
    return head.replace(_SOFT_HYPHEN, "")


def _broken(head: str) -> str:
    return head.replace(" ", "\n").replace(_SOFT_HYPHEN, "-\n")
