"""Numbers, tables and pictures of the pages that come from studies: one record for each number.

    python -m studies.pages FOLDER    # takes the studies below FOLDER into docs/, and says what changed
    python -m studies.pages           # prints the numbers of pages, and where each comes from

The tables in docs/tables are the record. A number of a page is found by the words around it, and replaced by that of
the record, in the digits of the page; README and first page have a short table of their own between two comments.
`tests/test_page_numbers.py` fails where a page disagrees.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kerrcaustics.report.tables import ReportTable, markdown_table, read_tables

HOME = Path(__file__).resolve().parents[1]
STUDIES = ("accuracy", "cost", "error_time")
"""Studies whose tables and pictures are in docs/."""


@dataclass(frozen=True)
class Cell:
    """A cell of a study's tables: its column, and the row by its first cells, empty ones filled from above.

    caption: of the table, if a study has several tables with such rows.
    """

    study: str
    row: tuple[str, ...]
    column: str
    caption: str = ""

    def text(self, tables: dict[str, list[ReportTable]]) -> str:
        """The cell as it is written."""
        for table in tables[self.study]:
            if self.column not in table.heads or self.caption not in table.caption:
                continue
            for row in _filled(table.rows, len(self.row)):
                if tuple(row[: len(self.row)]) == self.row:
                    return row[table.heads.index(self.column)]
        raise ValueError(f"The tables of {self.study} must have a row {self.row} with {self.column!r}.")


def _filled(rows: list[list[str]], count: int) -> list[list[str]]:
    """Rows whose first cells, but the last of `count`, are those above where they are empty."""
    found: list[list[str]] = []
    for row in rows:
        above = found[-1] if found else row
        found.append([above[i] if i < count - 1 and not cell else cell for i, cell in enumerate(row)])
    return found


@dataclass(frozen=True)
class Number:
    """A number of a page: a pattern with one group, which is the number, and what it is in the record.

    shown: the text of the page, from the cell.
    """

    page: str
    pattern: str
    cell: Cell
    shown: Callable[[str], str]

    def on_page(self, text: str) -> re.Match[str]:
        """The place of the number on its page."""
        found = list(re.finditer(self.pattern, text))
        if len(found) != 1:
            raise ValueError(f"{self.page} must have {self.pattern!r} once, but has it {len(found)} times.")
        return found[0]

    def of_record(self, tables: dict[str, list[ReportTable]]) -> str:
        """The number as the page must have it."""
        return self.shown(self.cell.text(tables))


def as_written(text: str) -> str:
    """The cell itself."""
    return text


def seconds(text: str) -> str:
    """Milliseconds as seconds, to two digits."""
    return f"{float(text) / 1e3:.2g}"


def two_digits(text: str) -> str:
    """A number to two digits."""
    return f"{float(text):.2g}"


def rate(text: str) -> str:
    """How many millions in a second, from microseconds of each."""
    return f"{1 / float(text):.2g}"


def one_digit(text: str) -> str:
    """A number to one digit after the point."""
    return f"{float(text):.1f}"


def _cost(row: str, column: str) -> Cell:
    return Cell("cost", (row,), column)


def _accuracy(row: str, column: str) -> Cell:
    return Cell("accuracy", (row,), column, "whole sky")


_LATER, _ENGINES = "later call, ms", "docs/accuracy.md"
# Tolerances of the engines' table, with their rows in the table of the study.
_TOLERANCES = {"1e-6": "1e-06", "1e-10, the default": "1e-10", "1e-12": "1e-12", "1e-14": "1e-14"}
NUMBERS = (
    Number("README.md", r"A beam takes ([\d.]+) µs", _cost("+ redshift", "closed-form, µs"), as_written),
    Number("README.md", r"first star ([\d.]+) s", _cost("first star", "until its answer, s"), as_written),
    Number("README.md", r"a frame of a disk of 960 x 540 pixels ([\d.]+) s", _cost("frame of a disk", _LATER), seconds),
    *(
        Number(_ENGINES, rf"\| {name} \|[^|]*\| ([\d.]+) µs", _accuracy(f"integrated, {row}", "µs a beam"), one_digit)
        for name, row in _TOLERANCES.items()
    ),
    *(
        Number(
            _ENGINES, rf"\| {name} \|[^|]*\|[^|]*\| (\S+),", _accuracy(f"integrated, {row}", "n′: median"), as_written
        )
        for name, row in _TOLERANCES.items()
    ),
    *(
        Number(
            _ENGINES, rf"\| {name} \|[^|]*\|[^|]*\| \S+, (\S+) \|", _accuracy(f"integrated, {row}", "99 %"), as_written
        )
        for name, row in _TOLERANCES.items()
    ),
    Number("docs/stars.md", r"first star for a camera takes ([\d.]+) s", _cost("first star", _LATER), seconds),
    Number(
        "docs/stars.md", r"new process ([\d.]+) s", Cell("cost", ("first star",), "until its answer, s"), as_written
    ),
    Number("docs/stars.md", r"next star, which takes ([\d.]+) ms", _cost("one more star", _LATER), two_digits),
    Number("docs/disks.md", r"thousand moments take ([\d.]+) s", _cost("light curve, 1,000 times", _LATER), seconds),
    Number("docs/comparison.md", r"([\d.]+) million rays a second", _cost("rays", "closed-form, µs"), rate),
    Number(
        "docs/rings.md",
        r"baselines of three rings take (.+?)\.\n",
        Cell("error_time", ("ring visibility", "1000 baselines"), "time"),
        lambda text: of_many(text, 1000),
    ),
)
"""Numbers of pages that come from studies."""


def of_many(text: str, count: int) -> str:
    """The time of so many, from that of one."""
    value, unit = text.split()
    units = ["µs", "ms", "s"]
    total = float(value) * count
    while total >= 1000 and unit != "s":
        total, unit = total / 1000, units[units.index(unit) + 1]
    return f"{total:.{0 if total >= 10 else 1}f} {unit}"


# Rows of the short table: words, result, setting.
SHORT = (
    ("a ray", "ray", "closed form"),
    ("a beam", "beam", "closed form"),
    ("three caustics of a new camera", "three caustics", "auto"),
    ("all images of one more star, certified", "images of a star", "one more star"),
    ("where pairs are born and die", "pair events", "one more star"),
    ("tracks of images", "tracks", "one more star"),
    ("light curve of a point, 100 times", "light curve, point", "100 times"),
    ("light of a disc on a caustic", "disc on a caustic, no spin", "radius 0.01 rad"),
    ("field of a wave", "waves, no spin", "ω M = 10"),
    ("line profile", "line profile", "8 x 128 beams"),
    ("visibility of a ring, one baseline", "ring visibility", "1000 baselines"),
    ("frame, 160 x 90 pixels", "frame", "normal"),
    ("the same with 16 rays a pixel", "frame of rays alone", "16 a pixel"),
)
BEGIN, END = "<!-- error and time -->\n", "<!-- end of error and time -->"
"""What stands before and after the short table."""
SHORT_PAGES = ("README.md", "docs/index.md")


def short_table(tables: dict[str, list[ReportTable]]) -> str:
    """The short table of README and first page: times in beams, true errors, and what they are against."""
    rows = []
    for words, result, setting in SHORT:
        columns = ("in beams", "true error", "reported")
        cells = [Cell("error_time", (result, setting), column).text(tables) for column in columns]
        rows.append([words, *cells])
    return markdown_table(["result", "time, in beams", "true error", "reported error"], rows)


def rewritten(page: str, text: str, tables: dict[str, list[ReportTable]]) -> str:
    """The text of a page with the numbers of the record."""
    for number in (number for number in NUMBERS if number.page == page):
        at = number.on_page(text)
        text = text[: at.start(1)] + number.of_record(tables) + text[at.end(1) :]
    if page in SHORT_PAGES:
        before, rest = text.split(BEGIN)
        text = f"{before}{BEGIN}\n{short_table(tables)}\n{END}{rest.split(END)[1]}"
    return text


def record(home: Path = HOME) -> dict[str, list[ReportTable]]:
    """The tables of docs/tables, by study."""
    paths = {name: home / "docs" / "tables" / f"{name}.md" for name in STUDIES}
    read = {name: read_tables(path.read_text(encoding="utf-8")) for name, path in paths.items()}
    return {name: [part for part in parts if isinstance(part, ReportTable)] for name, parts in read.items()}


def pages() -> list[str]:
    """Pages with numbers of the record."""
    return sorted({number.page for number in NUMBERS} | set(SHORT_PAGES))


def take(folder: Path, home: Path = HOME) -> list[Path]:
    """Copy tables and pictures of the studies below a folder to docs/, rewrite the pages; return what changed.

    Raises
    ------
    ValueError
        If the folder lacks one of the studies, or a page lacks one of its numbers.
    """
    changed: list[Path] = []
    for name in STUDIES:
        found = sorted([*folder.glob(f"{name}.json"), *folder.glob(f"*/{name}.json")])
        if len(found) != 1:
            raise ValueError(f"Argument `folder` must hold one record of {name}, but {folder} has {len(found)}.")
        for place, ending in (("tables", "md"), ("images", "png")):
            source, target = found[0].with_suffix(f".{ending}"), home / "docs" / place / f"{name}.{ending}"
            if not target.is_file() or target.read_bytes() != source.read_bytes():
                shutil.copyfile(source, target)
                changed.append(target)
    tables = record(home)
    for page in pages():
        path = home / page
        before = path.read_text(encoding="utf-8")
        after = rewritten(page, before, tables)
        if after != before:
            path.write_text(after, encoding="utf-8")
            changed.append(path)
    return changed


def main(arguments: list[str]) -> None:
    """Take the studies of a folder, or print the numbers of pages."""
    if arguments:
        changed = take(Path(arguments[0]))
        subprocess.run([sys.executable, HOME / "docs" / "media_digests.py", *STUDIES], check=True)
        print("\n".join(str(path.relative_to(HOME)) for path in changed) or "Nothing has changed.")
        return
    tables = record()
    for number in NUMBERS:
        print(f"{number.page}: {number.of_record(tables)} ({number.cell.study}: {', '.join(number.cell.row)})")


if __name__ == "__main__":
    main(sys.argv[1:])
