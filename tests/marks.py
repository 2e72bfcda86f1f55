"""Cases of tests of which the fast suite runs some, and `make test-all` all."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def few(cases: Iterable[Any], fast: Collection[Any], ids: Iterable[str] | None = None) -> list[Any]:
    """All cases as parameters, slow but for those named, by their ids if there are any."""
    cases = list(cases)
    names = list(ids) if ids is not None else [None] * len(cases)
    return [
        pytest.param(case, id=name, marks=[] if (case if name is None else name) in fast else pytest.mark.slow)
        for case, name in zip(cases, names, strict=True)
    ]
