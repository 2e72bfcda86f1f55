"""What the page asks for, and what it is told: the one way in for the server and for notebooks."""

import json
from collections.abc import Callable
from typing import Any

from kerrcaustics.explorer.page_data import Message, view_of
from kerrcaustics.explorer.state import PRESETS, ExplorerState

LONGEST_QUESTION = 4096
"""Bytes of a question at most."""

WANTS = ("full", "draft", "star", "orbit", "backdrop")


def greeting() -> Message:
    """What the page is told first: the state to begin with, if its address has none, and the presets."""
    presets = [{"name": name, "state": state.record()} for name, state in PRESETS.items()]
    return Message({"kind": "greeting", "state": ExplorerState().record(), "presets": presets}, {})


def question(text: str) -> tuple[int, str, ExplorerState]:
    """Number, want and state of a question {"id", "want", "state"}, or a ValueError."""
    if len(text) > LONGEST_QUESTION:
        raise ValueError(f"Argument `question` must have at most {LONGEST_QUESTION} characters, but has {len(text)}.")
    try:
        asked = json.loads(text, parse_constant=_refused)
    except (ValueError, RecursionError):
        raise ValueError("Argument `question` must be JSON.") from None
    if not isinstance(asked, dict) or not isinstance(asked.get("state"), dict):
        raise ValueError('Argument `question` must have the keys "id", "want" and "state".')
    number, want = asked.get("id"), asked.get("want")
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 2**53:
        raise ValueError("Argument `id` must be a whole number.")
    if want not in WANTS:
        raise ValueError(f"Argument `want` must be one of {', '.join(WANTS)}, but is {str(want)[:20]!r}.")
    return number, want, ExplorerState.of(asked["state"])


def answer(number: int, want: str, state: ExplorerState) -> Message:
    """What is asked for; in place of what cannot be had, why."""
    try:
        found = _maker(want)(state)
    except ValueError as error:
        return refusal(str(error), number, want)
    return Message({**found.record, "id": number, "want": want}, found.arrays)


def refusal(line: str, number: int | None = None, want: str | None = None) -> Message:
    """Why there is no answer."""
    return Message({"kind": "refusal", "line": line, "id": number, "want": want}, {})


def _maker(want: str) -> Callable[[ExplorerState], Message]:
    if want == "orbit":
        from kerrcaustics.explorer.orbit import orbit_of

        return orbit_of
    if want == "backdrop":
        from kerrcaustics.explorer.backdrop import backdrop_of

        return backdrop_of
    return lambda state: view_of(state, want)


def _refused(constant: str) -> Any:
    raise ValueError(constant)
