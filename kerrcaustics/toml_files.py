"""TOML files as frozen structs; errors in them are one line with the place and the fault."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import msgspec

from kerrcaustics.choices import either, suggestion
from kerrcaustics.files import check_name, read_text

Kind = TypeVar("Kind")

# Bytes of a file; tables within tables; a key of more parts than that, which takes time as the square of their number.
_LONGEST, _DEEPEST = 16_000_000, 32
_DEEP_KEY = re.compile(rf"(?<![\w\"'-])(?:[\w\"'-]+\s*\.\s*){{{_DEEPEST}}}")
# Messages of the decoder about escapes.
_ESCAPE = re.compile(r"Invalid (hex|escape)|Unescaped|Invalid unicode", re.IGNORECASE)
TOO_DEEP = "it is nested too deeply"

# Characters of a value in a message.
_LONGEST_VALUE = 80
_KINDS = {float: "a number", int: "a whole number", str: "a text"}
_COUNTS = {2: "two", 3: "three"}


def read_toml(path: str | Path, holds: str = "scene") -> dict[str, Any]:
    """The content of a TOML file as plain data; a ValueError of one line with the reason if it cannot be read.

    holds: the name of what is in it, for that line; its last word is that of the argument.
    """
    check_name(path)
    path = Path(path)
    try:
        return decoded(read_text(path, _LONGEST))
    except OSError as error:
        raise ValueError(
            f"Argument {holds.upper().split()[-1]} must name a file that can be read: {path}: {error.strerror}."
        ) from None
    except UnicodeDecodeError:
        raise ValueError(f"{holds.capitalize()} {path}: it is no text in UTF-8.") from None
    except (msgspec.DecodeError, RecursionError) as error:
        what = TOO_DEEP if isinstance(error, RecursionError) else str(error)
        if _ESCAPE.match(what):
            what += r": \ is an escape in double quotes, so that paths need / or 'single quotes'"
        raise ValueError(f"{holds.capitalize()} {path}: {' '.join((what[:1].lower() + what[1:]).split())}.") from None


def decoded(text: str) -> dict[str, Any]:
    """TOML as plain data; a RecursionError if tables and lists are nested too deeply."""
    if not _DEEP_KEY.search(text):
        table = msgspec.toml.decode(text)
        if not is_too_deep(table):
            return table
    raise RecursionError(TOO_DEEP)


def is_too_deep(table: dict[str, Any]) -> bool:
    """True if tables and lists are nested more than 32 times."""
    level: list[Any] = [table]
    for _ in range(_DEEPEST):
        inner = [part.values() if isinstance(part, dict) else part for part in level if isinstance(part, dict | list)]
        level = [part for parts in inner for part in parts]
    return bool(level)


def as_struct(table: dict[str, Any], kind: type[Kind], path: str | Path, holds: str = "scene") -> Kind:
    """Plain data as a struct; raises a ValueError of one line that names the entry and what it must be.

    Words are declared as `Literal`, ranges of numbers as `msgspec.Meta`, whose description is their unit.
    """
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        raise ValueError(f"{holds.capitalize()} {path}: {_plainly(str(error), table, kind)}") from None


def numbers_in(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Entries that are numbers with a point, each with its path: camera.path.keyframes[2].radius."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from numbers_in(part, f"{place}.{key}" if place else key)
    elif isinstance(value, list | tuple):
        for i, part in enumerate(value):
            yield from numbers_in(part, f"{place}[{i}]")
    elif isinstance(value, float):
        yield place, value


def not_finite(table: dict[str, Any]) -> Iterator[tuple[str, float]]:
    """Entries that are no finite numbers, each with its path."""
    return ((place, value) for place, value in numbers_in(table) if not math.isfinite(value))


def _plainly(message: str, table: dict[str, Any], kind: type) -> str:
    """A message of msgspec as "spin.count must be a whole number, but is 'x'.", and what may be meant."""
    what, _, path = message.partition(" - at `$")
    place = path.rstrip("`").lstrip(".")
    if key := re.fullmatch("Object (contains unknown|missing required) field `(.*)`", what):
        state = key[1].split()[-1].replace("required", "missing")
        end = _keys_in_words(key[2], _keys(kind, table, place)) if state == "unknown" else "."
        return f"{place}: {state} key `{key[2]}`{end}".removeprefix(": ")
    # msgspec does not name the entry of a table whose keys may be any.
    entry = place.removesuffix("[...]")
    types, value = _declared(kind, table, entry)
    must, words = _must(types)
    return (
        f"{entry} must {must}, but is {_in_words(value) if entry == place else 'another one'}{suggestion(value, words)}"
    )


def _keys_in_words(key: str, keys: list[str]) -> str:
    """The end of a sentence about an unknown key: the one that may be meant, else all there are."""
    end = suggestion(key, keys)
    return f"; its keys are {', '.join(keys)}." if end == "." else end


def _must(types: list[Any]) -> tuple[str, list[str]]:
    """The condition on an entry of these types, and the words that it may be."""
    words = [word for part in types for word in _choices(part)]
    ranges = [_range(part) for part in types if get_origin(part) is Annotated]
    kinds = [_kind(part) for part in types if part is not NoneType and not _choices(part)]
    return ranges[0] if ranges else f"be {either([*words, *dict.fromkeys(kinds)])}", words


def _choices(kind: Any) -> list[str]:
    """The words that an entry may be, if its type is one of words, or true and false."""
    if kind is bool:
        return ["true", "false"]
    return list(get_args(kind)) if get_origin(kind) is Literal else []


def _kind(kind: Any) -> str:
    """A type of entries, which is no choice of words."""
    parts = get_args(kind)
    if get_origin(kind) is dict:
        return f"a table with {either([_kind(part) for part in _alternatives(parts[1])])} in each entry"
    if get_origin(kind) is list or ... in parts:
        return "a list"
    if get_origin(kind) is not tuple:
        return _KINDS.get(kind, "a table")
    return f"{_COUNTS.get(len(parts), len(parts))} {'numbers' if set(parts) == {float} else 'values'}"


def _in_words(value: Any) -> str:
    """A value for a message, in a line that is not too long."""
    if isinstance(value, dict):
        return "a table"
    text = str(value).lower() if isinstance(value, bool) else " ".join(repr(value).split())
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def _keys(kind: Any, table: dict[str, Any], place: str) -> list[str]:
    """The keys that a table may have, at a place in a struct."""
    types, value = _declared(kind, table, place)
    tables = {part: part.__struct_config__ for part in types if hasattr(part, "__struct_config__")}
    chosen = [part for part, config in tables.items() if config.tag in (None, (value or {}).get(config.tag_field))]
    return [field.encode_name for part in chosen for field in msgspec.structs.fields(part)]


def _declared(kind: Any, value: Any, place: str) -> tuple[list[Any], Any]:
    """Types that are declared for an entry, and its value; for the tag of a table all tags."""
    types = _alternatives(kind)
    for key in re.findall(r"[^.\[\]]+", place):
        if isinstance(value, list):
            types, value = [get_args(part)[0] for part in types if get_args(part)], value[int(key)]
        else:
            tables = {part: part.__struct_config__ for part in types if hasattr(part, "__struct_config__")}
            tags = tuple(config.tag for config in tables.values() if config.tag_field == key)
            chosen = [part for part, config in tables.items() if config.tag in (None, value.get(config.tag_field))]
            fields = [field for part in chosen for field in msgspec.structs.fields(part)]
            types = [Literal[tags]] if tags else [field.type for field in fields if field.encode_name == key]
            value = value.get(key)
        types = [part for declared in types for part in _alternatives(declared)]
    return types, value


def _alternatives(kind: Any) -> list[Any]:
    """The types of a union, or a single type."""
    return list(get_args(kind)) if get_origin(kind) in (Union, UnionType) else [kind]


def _range(kind: Any) -> str:
    """The range of a number, as declared."""
    base, meta = get_args(kind)
    if base is int:
        return f"be a whole number from {meta.ge}{'' if meta.le is None else f' to {meta.le}'}"
    low = f"[{meta.ge:g}" if meta.gt is None else f"({meta.gt:g}"
    high = f"{meta.le:g}]" if meta.lt is None else f"{meta.lt:g})"
    return f"lie in {low}, {high} {meta.description or ''}".rstrip()
