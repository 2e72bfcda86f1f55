"""Entries of a scene that are set otherwise than in its file: camera.radius=5."""

import re
from collections.abc import Sequence
from typing import Any

import msgspec

from kerrcaustics.scene_files.complaints import SceneError

_STEP = re.compile(r"([A-Za-z_][\w-]*)((?:\[\d+\])*)")


def changed(table: dict[str, Any], changes: Sequence[str]) -> dict[str, Any]:
    """A scene as plain data with some entries set, each given as PATH=VALUE.

    VALUE is as in TOML; what is none there is a text, so that words need no quotation marks.
    """
    for change in changes:
        path, sign, value = change.partition("=")
        steps = _steps(path.strip())
        if not (sign and steps):
            raise SceneError(f"a change must be given as KEY=VALUE, as camera.radius=5, but is {change!r}.")
        _set(table, steps, _value(value.strip()), path.strip())
    return table


def _steps(path: str) -> list[str | int]:
    """Keys and numbers of list entries along a path; none where it is no path."""
    found: list[str | int] = []
    for part in path.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            return []
        found += [match[1], *(int(number) for number in re.findall(r"\d+", match[2]))]
    return found


def _value(text: str) -> Any:
    try:
        return msgspec.toml.decode(f"value = {text}")["value"]
    except (msgspec.DecodeError, RecursionError):
        return text


def _set(table: Any, steps: list[str | int], value: Any, path: str) -> None:
    for step, following in zip(steps, [*steps[1:], None], strict=True):
        within = isinstance(table, list) and isinstance(step, int) and step < len(table)
        if not (within or (isinstance(table, dict) and isinstance(step, str))):
            raise SceneError(f"a change must name an entry of the scene, but {path} is none.")
        if following is None:
            table[step] = value
        else:
            table = table[step] if within else table.setdefault(step, {})
