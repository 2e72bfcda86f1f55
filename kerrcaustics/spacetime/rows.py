"""Records of arrays with one entry a row: rows can be chosen and joined."""

from dataclasses import Field, fields
from typing import Any, ClassVar, Self

import numpy as np
from jaxtyping import Bool, Int


class Rows:
    """A dataclass whose fields are all arrays of one length, or rows themselves."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __len__(self) -> int:
        """Number of rows."""
        return len(getattr(self, fields(self)[0].name))

    def __getitem__(self, chosen: slice | Int[np.ndarray, " chosen"] | Bool[np.ndarray, " rows"]) -> Self:
        """The rows chosen by indices, by truth values, or by a slice."""
        return type(self)(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})

    def joined(self, *others: Self) -> Self:
        """These rows, followed by the others."""
        columns = {f.name: [getattr(rows, f.name) for rows in (self, *others)] for f in fields(self)}
        return type(self)(**{name: _joined(parts) for name, parts in columns.items()})

    def frozen(self) -> Self:
        """The same rows, with arrays that are read-only."""
        for f in fields(self):
            column = getattr(self, f.name)
            column.frozen() if isinstance(column, Rows) else column.setflags(write=False)
        return self


def _joined(parts: list[Any]) -> Any:
    return parts[0].joined(*parts[1:]) if isinstance(parts[0], Rows) else np.concatenate(parts)
