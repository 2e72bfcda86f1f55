"""The tables and keys of scene files in Markdown: from the structs and the lines of their docstrings."""

import inspect
import re
import types
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec

from kerrcaustics.scene_files.contents import Contents
from kerrcaustics.scene_files.table_values import GridTable, SceneTable, ValueAt, Varied

# Written in one line, as values.
VALUES = (GridTable, ValueAt)


def described(table: type[msgspec.Struct]) -> dict[str, str]:
    """The descriptions of the keys of a table, by key."""
    found: dict[str, str] = {}
    for kind in reversed(table.__mro__[: table.__mro__.index(msgspec.Struct)]):
        lines = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[2]
        found |= {key: " ".join(text.split()) for key, text in re.findall(r"^(\w+): (.*(?:\n +.*)*)", lines, re.M)}
    return found


def members(hint: Any) -> list[Any]:
    """The alternatives of a type."""
    if get_origin(hint) is Annotated:
        return members(get_args(hint)[0])
    if get_origin(hint) in (Union, types.UnionType):
        return [one for part in get_args(hint) for one in members(part)]
    return [hint]


def inner_tables(hint: Any) -> list[type[SceneTable]]:
    """The tables that a key of some type holds, alone or in a list."""
    parts = [part for one in members(hint) for part in (get_args(one) if get_origin(one) is tuple else (one,))]
    return [part for part in parts if isinstance(part, type) and issubclass(part, SceneTable) and part not in VALUES]


def tables(table: type[SceneTable] = Contents, path: str = "") -> Iterator[tuple[str, type[SceneTable]]]:
    """Each table of a scene file with its path, the outer ones first."""
    yield path, table
    for key, hint in get_type_hints(table).items():
        for inner in inner_tables(hint):
            yield from tables(inner, f"{path}.{key}".lstrip("."))


def default(field: msgspec.structs.FieldInfo) -> str:
    """What a key is if it is left out, as TOML has it; nothing if the description says so."""
    value = field.default
    if isinstance(value, str) and value:
        return f'`"{value}"`'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return f"{value:.12g}"
    if isinstance(value, tuple) and value and all(isinstance(part, int | float) for part in value):
        return f"[{', '.join(f'{part:.12g}' for part in value)}]"
    if isinstance(value, tuple) and value and all(isinstance(part, str) for part in value):
        return ", ".join(f'`"{part}"`' for part in value)
    return "required" if field.required else ""


def is_varied(hint: Any) -> bool:
    """True if a value of some type may change with time."""
    return set(members(Varied)) <= set(members(hint))


def row(table: type[msgspec.Struct], field: msgspec.structs.FieldInfo) -> str:
    """The row of a key: its name, what it means with the words that it may be, and its default."""
    hint = get_type_hints(table)[field.name]
    parts = [part for one in members(hint) for part in (one, *get_args(one))]
    words = [f'`"{word}"`' for part in parts if get_origin(part) is Literal for word in get_args(part)]
    text = described(table)[field.name].rstrip(".")
    others = ", ".join(word for word in words if word not in text)
    choices = others and f" ({others})"
    mark = " ∿" if any(map(is_varied, (hint, *parts))) else ""
    return f"| `{field.name}`{mark} | {text}{choices} | {default(field)} |"


def key_table(table: type[msgspec.Struct]) -> str:
    """The keys of a table in Markdown."""
    head = ["| key | meaning | default |", "|---|---|---|"]
    return "\n".join(head + [row(table, field) for field in msgspec.structs.fields(table)])


def key_tables() -> str:
    """The tables of scene files with their keys, in Markdown."""
    parts = []
    for path, table in tables():
        tag = table.__struct_config__.tag
        name = f"**`[{path}]`** " if path else ""
        kind = f'`kind = "{tag}"`: ' if tag else ""
        summary = inspect.cleandoc(table.__doc__ or "").partition("\n\n")[0]
        parts.append(f"{name}{kind}{' '.join(summary.split())}")
        parts += [key_table(table)] if table.__struct_fields__ else []
    return "\n\n".join(parts)
