"""Names of stub files, loaded at their first use; one that is unknown is reported with the name that may be meant."""

from collections.abc import Callable
from typing import Any

import lazy_loader

from kerrcaustics.choices import suggestion


def attached(module: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a module, by the stub file beside its own file."""
    load, listed, names = lazy_loader.attach_stub("kerrcaustics", file)

    def attribute(name: str) -> Any:
        if name not in names:
            raise unknown_attribute(f"Module {module}", name, names)
        return load(name)

    return attribute, listed, names


def unknown_attribute(owner: str, name: str, names: list[str]) -> AttributeError:
    """The error about an attribute that is not there, and what it may be."""
    # With an object Python would add its own guess.
    return AttributeError(f"{owner} has no attribute {name}{suggestion(name, names)}", name=name, obj=None)
