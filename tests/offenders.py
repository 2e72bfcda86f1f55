"""Tests of many cases at once, that list the offenders: a test for each would take longer to collect than to run."""

import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from itertools import product
from typing import Any

import pytest

# Letters of what is said about one offender.
_LONGEST = 1000


def for_each(*names: str, rows: Iterable[Any] = ((),), **cases: Iterable[Any]) -> Callable[..., Callable[..., None]]:
    """A test of all combinations of some arguments; those that are left are fixtures, and each has a folder of its own.

    names: of arguments that belong together, of which `rows` has the values.
    """
    arguments = (*names, *cases)
    combinations = [(*row, *values) for row, *values in product(rows, *cases.values())]

    def decorate(check: Callable[..., None]) -> Callable[..., None]:
        @wraps(check)
        def test(**fixtures: Any) -> None:
            assert combinations
            wrong = {}
            for number, values in enumerate(combinations):
                own = dict(fixtures)
                if "tmp_path" in own:
                    own["tmp_path"] = own["tmp_path"] / str(number)
                    own["tmp_path"].mkdir()
                try:
                    check(**dict(zip(arguments, values, strict=True)), **own)
                except (Exception, pytest.fail.Exception) as error:
                    wrong[f"{number}: {', '.join(map(_word, values))}"] = f"{type(error).__name__}: {error}"[:_LONGEST]
            assert not wrong, "\n\n".join(f"{case}\n{why}" for case, why in wrong.items())

        signature = inspect.signature(check)
        fixtures = [part for name, part in signature.parameters.items() if name not in arguments]
        test.__signature__ = signature.replace(parameters=fixtures)  # pyright: ignore[reportAttributeAccessIssue]
        return test

    return decorate


def _word(value: Any) -> str:
    """A case in a word or a few."""
    return getattr(value, "__name__", None) or repr(value)[:80]
