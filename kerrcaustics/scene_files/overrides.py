"""Overrides of entries of a scene file: camera.radius=5."""

import re
from collections.abc import Sequence
from typing import Any

import msgspec

from kerrcaustics.scene_files.validation import SceneError
from kerrcaustics.toml_files import TOO_DEEP, decoded, is_too_deep

_STEP = re.compile(r"([A-Za-z_][\w-]*)((?:\[\d+\])*)")


def with_overrides(table: dict[str, Any], overrides: Sequence[str]) -> dict[str, Any]:
    """A scene as plain data with some entries set, each given as PATH=VALUE.

    VALUE is a TOML value; any other text is a string, so that words need no quotation marks.
    """
    for override in overrides:
        path, sign, value = override.partition("=")
        steps = _steps(path.strip())
        if not (sign and steps):
            raise SceneError(f"an override must be given as KEY=VALUE, such as camera.radius=5, but is {override!r}.")
        _set(table, steps, _value(value.strip()), path.strip())
    if is_too_deep(table):
        raise SceneError(f"{TOO_DEEP}.")
    return table


def _steps(path: str) -> list[str | int]:
    """Keys and numbers of list entries along a path; empty for an invalid path."""
    steps: list[str | int] = []
    for part in path.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            return []
        steps += [match[1], *(int(number) for number in re.findall(r"\d+", match[2]))]
    return steps


def _value(text: str) -> Any:
    try:
        return decoded(f"value = {text}")["value"]
    except (msgspec.DecodeError, RecursionError):
        return text


def _set(table: dict[str, Any], steps: list[str | int], value: Any, path: str) -> None:
    """Set an entry, creating the tables on its path."""
    container: Any = table
    for step in steps[:-1]:
        _check_entry(container, step, path)
        if isinstance(step, str):
            container.setdefault(step, {})
        container = container[step]
    _check_entry(container, steps[-1], path)
    container[steps[-1]] = value


def _check_entry(container: Any, step: str | int, path: str) -> None:
    within = isinstance(container, list) and isinstance(step, int) and step < len(container)
    if not (within or (isinstance(container, dict) and isinstance(step, str))):
        raise SceneError(f"an override must name an entry of the scene, but {path} is none.")
