"""The studies with their questions and times, read from the constants of each main.py without running it."""

import ast
import re
from dataclasses import dataclass

_CONSTANT = re.compile(r"^(QUESTION|SECONDS|QUICK_SECONDS) = (.+)$", re.MULTILINE)
# Above this number of seconds, times are in minutes.
_MOST_SECONDS = 120
WIDTH = 80
"""Columns of the list."""


@dataclass(frozen=True)
class StudyLine:
    """What a study says of itself.

    name: of its folder.
    question: it answers this one (empty if its main.py has none).
    seconds: run time on two cores (None if its main.py has none).
    quick_seconds: processor time with --quick.
    """

    name: str
    question: str
    seconds: float | None
    quick_seconds: float | None


def study_lines() -> list[StudyLine]:
    """All studies, by name."""
    from kerrcaustics.scripts import STUDIES

    lines = []
    for name in STUDIES.names():
        text = (STUDIES.folder / STUDIES.place.format(name)).read_text(encoding="utf-8")
        found = {key: ast.literal_eval(value) for key, value in _CONSTANT.findall(text)}
        lines.append(StudyLine(name, found.get("QUESTION", ""), found.get("SECONDS"), found.get("QUICK_SECONDS")))
    return lines


def study_list() -> str:
    """A line for each study: name, time, time with --quick, question."""
    lines = study_lines()
    width = max((len(line.name) for line in lines), default=0)
    texts = [
        f"  {line.name:{width}}  {_in_words(line.seconds):>6}  {_in_words(line.quick_seconds):>5}  {line.question}"
        for line in lines
    ]
    total = sum(line.seconds or 0 for line in lines)
    quick = sum(line.quick_seconds or 0 for line in lines)
    head = f"Studies, their times on two cores, and with --quick (all: {_in_words(total)}, {_in_words(quick)}):"
    return "\n".join([head, *texts]) if texts else ""


def time_table() -> str:
    """The same as a table for the documentation."""
    rows = [
        f"| `{line.name}` | {line.question} | {_in_words(line.seconds)} | {_in_words(line.quick_seconds)} |"
        for line in study_lines()
    ]
    return "\n".join(["| study | question | time | `--quick` |", "|---|---|---:|---:|", *rows])


def _in_words(seconds: float | None) -> str:
    """A run time to two digits or so; empty if it is not known."""
    if seconds is None:
        return ""
    return f"{seconds:.0f} s" if seconds < _MOST_SECONDS else f"{seconds / 60:.0f} min"
