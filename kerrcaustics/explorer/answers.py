"""Questions of the page and answers to them, for the server and for notebooks."""

import json
from collections.abc import Callable
from typing import Any

from kerrcaustics.explorer.page_data import QUALITIES, Message, view_of
from kerrcaustics.explorer.state import PRESETS, ExplorerState

LONGEST_QUESTION = 4096
"""Bytes of a question at most."""

WANTS = (*QUALITIES, "orbit", "backdrop")


def greeting() -> Message:
    """The first message to the page: the state to begin with, if its address has none, and the presets."""
    presets = [{"name": name, "state": state.record()} for name, state in PRESETS.items()]
    return Message({"kind": "greeting", "state": ExplorerState().record(), "presets": presets}, {})


def question(text: str) -> tuple[int, str, ExplorerState]:
    """Number, want and state of a question {"id", "want", "state"}, or a ValueError."""
    if len(text) > LONGEST_QUESTION:
        raise ValueError(f"Argument `question` must have at most {LONGEST_QUESTION} characters, but has {len(text)}.")
    try:
        values = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise ValueError("Argument `question` must be JSON.") from None
    if not isinstance(values, dict) or not isinstance(values.get("state"), dict):
        raise ValueError('Argument `question` must have the keys "id", "want" and "state".')
    number, want = values.get("id"), values.get("want")
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 2**53:
        raise ValueError("Argument `id` must be a whole number.")
    if want not in WANTS:
        raise ValueError(f"Argument `want` must be one of {', '.join(WANTS)}, but is {str(want)[:20]!r}.")
    return number, want, ExplorerState.of(values["state"])


def answer(number: int, want: str, state: ExplorerState) -> Message:
    """The answer to a question, or the reason why there is none."""
    try:
        message = _maker(want)(state)
    except ValueError as error:
        return refusal(str(error), number, want)
    return Message({**message.record, "id": number, "want": want}, message.arrays)


def refusal(line: str, number: int | None = None, want: str | None = None) -> Message:
    """The message that there is no answer, and why."""
    return Message({"kind": "refusal", "line": line, "id": number, "want": want}, {})


def _maker(want: str) -> Callable[[ExplorerState], Message]:
    if want == "orbit":
        from kerrcaustics.explorer.orbit import orbit_of

        return orbit_of
    if want == "backdrop":
        from kerrcaustics.explorer.backdrop import backdrop_of

        return backdrop_of
    return lambda state: view_of(state, want)


def _no_constant(constant: str) -> Any:
    raise ValueError(constant)
