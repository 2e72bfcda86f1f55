"""TOML files as frozen structs; errors in them are one line with the place and the fault."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from kerrcaustics.files import check_name, read_text

Kind = TypeVar("Kind")

# Bytes of a file; tables within tables; a key of more parts than that, which takes time as the square of their number.
_LONGEST, _DEEPEST = 16_000_000, 32
_DEEP_KEY = re.compile(rf"(?<![\w\"'-])(?:[\w\"'-]+\s*\.\s*){{{_DEEPEST}}}")
TOO_DEEP = "it is nested too deeply"

_OURS = (
    ("object contains unknown field", "unknown key"),
    ("object missing required field", "missing key"),
    ("object", "table"),
    ("array", "list"),
)


def read_toml(path: str | Path) -> dict[str, Any]:
    """The content of a TOML file as plain data; a ValueError of one line with the reason if it cannot be read."""
    check_name(path)
    path = Path(path)
    try:
        return decoded(read_text(path, _LONGEST))
    except OSError as error:
        raise ValueError(f"Argument SCENE must name a file that can be read: {path}: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise ValueError(f"Scene {path}: it is no text in UTF-8.") from None
    except (msgspec.DecodeError, RecursionError) as error:
        what = TOO_DEEP if isinstance(error, RecursionError) else str(error)
        raise ValueError(f"Scene {path}: {' '.join((what[:1].lower() + what[1:]).split())}.") from None


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


def as_struct(table: dict[str, Any], kind: type[Kind], path: str | Path, words: dict[str, tuple[str, ...]]) -> Kind:
    """Plain data as a struct.

    words: those that an entry may hold, by its path without numbers of lists, or by the last part of it.
    """
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        raise ValueError(f"Scene {path}: {_plainly(str(error), words)}.") from None


def not_finite(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Entries that are no finite numbers, each with its path."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from not_finite(part, f"{place}.{key}" if place else key)
    elif isinstance(value, list):
        for i, part in enumerate(value):
            yield from not_finite(part, f"{place}[{i}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield place, value


def _plainly(message: str, words: dict[str, tuple[str, ...]]) -> str:
    """The message of msgspec with the path first: "spin.count: expected `int`, got `str`"."""
    what, _, path = message.partition(" - at `$")
    what = what[:1].lower() + what[1:]
    for theirs, ours in _OURS:
        what = what.replace(theirs, ours)
    place = path.rstrip("`").lstrip(".")
    if what.startswith("invalid"):
        plain = re.sub(r"\[[^]]*\]", "", place)
        allowed = words.get(plain) or words.get(plain.rpartition(".")[2])
        what += f", expected {' or '.join(allowed)}" if allowed else ""
    return f"{place}: {what}" if place else what
