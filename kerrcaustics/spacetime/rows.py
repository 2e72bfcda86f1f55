"""Records of arrays with one entry a row: rows can be chosen and joined."""

from dataclasses import Field, fields
from functools import cache
from typing import Any, ClassVar, Self

import numpy as np

from kerrcaustics.shapes import Bool, Int


class Rows:
    """A dataclass whose fields are all arrays of one length, or rows themselves."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __len__(self) -> int:
        """Number of rows."""
        return len(getattr(self, _names(type(self))[0]))

    def __getitem__(self, chosen: slice | Int[np.ndarray, " chosen"] | Bool[np.ndarray, " rows"]) -> Self:
        """The rows chosen by indices, by truth values, or by a slice."""
        return type(self)(**{name: getattr(self, name)[chosen] for name in _names(type(self))})

    def joined(self, *others: Self) -> Self:
        """The rows, followed by those of the others."""
        columns = {name: [getattr(rows, name) for rows in (self, *others)] for name in _names(type(self))}
        return type(self)(**{name: _joined(parts) for name, parts in columns.items()})

    def frozen(self) -> Self:
        """The same rows, with arrays that are read-only."""
        for name in _names(type(self)):
            column = getattr(self, name)
            column.frozen() if isinstance(column, Rows) else column.setflags(write=False)
        return self


@cache
def _names(kind: type[Rows]) -> tuple[str, ...]:
    return tuple(f.name for f in fields(kind))


def _joined(parts: list[Any]) -> Any:
    return parts[0].joined(*parts[1:]) if isinstance(parts[0], Rows) else np.concatenate(parts)
