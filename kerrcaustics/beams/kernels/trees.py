"""Trees of arrays without JAX: tuples, named ones too, lists and data classes, their leaves in the order of JAX."""

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any


def leaves(tree: Any) -> Iterator[Any]:
    """The leaves of a tree in their order; None is none."""
    if tree is None:
        return
    parts = _parts(tree)
    if parts is None:
        yield tree
    else:
        for part in parts:
            yield from leaves(part)


def mapped(function: Callable[..., Any], tree: Any, *others: Any) -> Any:
    """A tree with the values of a function of its leaves, and of the leaves of others of its shape."""
    if tree is None:
        return None
    parts = _parts(tree)
    if parts is None:
        return function(tree, *others)
    rest = [_parts(other) for other in others]
    return _rebuild(tree, [mapped(function, *column) for column in zip(parts, *rest, strict=True)])


def _parts(tree: Any) -> list[Any] | None:
    """The branches of a tree; None for a leaf."""
    if isinstance(tree, tuple | list):
        return list(tree)
    if is_dataclass(tree):
        return [getattr(tree, field.name) for field in fields(tree)]
    return None


def _rebuild(tree: Any, parts: list[Any]) -> Any:
    """A branch of the same kind with other branches in it."""
    if is_dataclass(tree):
        return type(tree)(**{field.name: part for field, part in zip(fields(tree), parts, strict=True)})  # pyright: ignore
    if isinstance(tree, tuple) and hasattr(tree, "_fields"):
        return type(tree)(*parts)
    return type(tree)(parts)
