"""Tables of studies: written as Markdown and for a terminal, and read back from Markdown."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

_BOLD = re.compile(r"\*\*(.+)\*\*")
_COMMENT = re.compile(r"<!--\s*(.+?)\s*-->")
# Heads of columns that hold words.
_WORDS = ("engine", "verdict")


@dataclass(frozen=True)
class ReportTable:
    """Heads and rows of cells; `to_right` is True for each column of numbers, set to the right."""

    heads: list[str]
    rows: list[list[str]]
    to_right: list[bool]
    caption: str = ""


def markdown_table(heads: list[str], rows: list[list[str]]) -> str:
    """A Markdown table: first column to the left, the others to the right."""
    lines = [heads, ["---", *["---:"] * (len(heads) - 1)], *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def text_table(heads: list[str], rows: list[list[str]]) -> str:
    """A table for a terminal: first column and words to the left, the others to the right."""
    widths = [max(len(line[i]) for line in [heads, *rows]) for i in range(len(heads))]
    lines = [
        [
            text.ljust(w) if i == 0 or heads[i] in _WORDS else text.rjust(w)
            for i, (text, w) in enumerate(zip(line, widths, strict=True))
        ]
        for line in [heads, *rows]
    ]
    return "".join("  ".join(line).rstrip() + "\n" for line in lines)


def read_tables(text: str) -> list[ReportTable | str]:
    """Tables and, as plain text, paragraphs; a bold line or a comment above a table is its caption.

    Raises
    ------
    ValueError
        If the lines of a table have different numbers of cells.
    """
    parts: list[ReportTable | str] = []
    caption = ""
    for block in _blocks(text):
        named = _BOLD.fullmatch(block[0]) or _COMMENT.fullmatch(block[0])
        if block[0].startswith("|"):
            parts.append(_table(block, caption))
            caption = ""
        elif named:
            # A comment "end of ..." closes an earlier one.
            caption = "" if named[1].startswith("end of ") else named[1]
        else:
            parts.append(" ".join(block))
    return parts


def _blocks(text: str) -> Iterator[list[str]]:
    """Lines that belong together: those of a table, those of a paragraph, a comment by itself."""
    block: list[str] = []
    for line in (*map(str.strip, text.splitlines()), ""):
        if block and _kind(line) != _kind(block[-1]):
            yield block
            block = []
        if line:
            block.append(line)


def _kind(line: str) -> str:
    return "" if not line else line if _COMMENT.fullmatch(line) else "table" if line[0] == "|" else "text"


def _table(lines: list[str], caption: str) -> ReportTable:
    rows = [[cell.strip() for cell in line[1:-1].split("|")] for line in lines]
    if len(rows) < 2 or any(len(row) != len(rows[0]) for row in rows) or not all(line.endswith("|") for line in lines):
        raise ValueError(f"the table that begins with {lines[0][:60]!r} is not whole")
    return ReportTable(rows[0], rows[2:], [mark.endswith(":") for mark in rows[1]], caption)
