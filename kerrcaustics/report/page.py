"""The report as one HTML page that holds all it needs: findings of the studies, with their pictures and tables."""

import base64
import html
import re
import struct
from collections import Counter
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from kerrcaustics.report.study_records import StudyRecord, write_text
from kerrcaustics.report.tables import ReportTable

# The first studies, with their titles; the others follow by name.
_FIRST = {"accuracy": "Error against run time", "stability": "Stability"}
# Words that must not be overlooked, as CSS classes.
_VERDICTS = {"ok": "ok", "honest": "honest", "FAIL": "fail"}
_COMMAND = "kerrcaustics study {}"
# Longer lists of settings are given by their ends.
_LONGEST_LIST = 6


def write_report(path: Path, records: Sequence[StudyRecord], version: str, missing: Sequence[str] | None) -> Path:
    """Write the report as an HTML page that loads nothing; return the path. Arguments as for `report_page`."""
    return write_text(path, report_page(records, version, missing))


def report_page(records: Sequence[StudyRecord], version: str, missing: Sequence[str] | None) -> str:
    """The report as HTML: the same page for the same records.

    Parameters
    ----------
    records : sequence of StudyRecord
        One record for each study.
    version : str
        Version of the installed package: records of others are marked.
    missing : sequence of str, or None
        Studies that were not run; None if no checkout lists the studies.
    """
    ordered = sorted(records, key=lambda one: ([*_FIRST, one.name].index(one.name), one.name))
    # The one of most studies is A.
    machines = [text for text, _ in Counter(_flat(one.machine) for one in ordered).most_common()]
    notices = _notices(ordered, version, machines, missing)
    head = [_overview(ordered, version), notices, _glance(ordered), _runs(ordered, machines)]
    parts = {
        "TITLE": "How far to trust kerrcaustics",
        "HEAD": "".join(head),
        "STUDIES": "".join(_section(one, _marks(one, version, machines)) for one in ordered),
    }
    page = resources.files("kerrcaustics.report").joinpath("page.html").read_text(encoding="utf-8")
    # In one pass: a text that is filled in may hold such a name itself.
    return re.sub(r"@([A-Z]+)@", lambda name: parts[name[1]], page)


def _title(name: str) -> str:
    return _FIRST.get(name, name.replace("_", " ").capitalize())


def _overview(records: list[StudyRecord], version: str) -> str:
    """The version, the number of studies, and the days of the runs, in one line."""
    days = sorted({f"{one.date:%Y-%m-%d}" for one in records})
    when = f", run on {days[0]}" if len(days) == 1 else f", run from {days[0]} to {days[-1]}"
    count = f"{len(records)} {'study' if len(records) == 1 else 'studies'}"
    return f'<p class="faint">kerrcaustics {html.escape(version)}; {count}{when}.</p>\n'


def _marks(record: StudyRecord, version: str, machines: list[str]) -> list[str]:
    """Warnings for a reader who compares one study with the others."""
    marks = ["quick run, on fewer cases"] if record.quick else []
    marks += [f"by version {record.version}, not {version}"] if record.version != version else []
    letter = _letter(record, machines)
    return marks if letter == "A" else [*marks, f"on machine {letter}, and not A as most others"]


def _notices(records: list[StudyRecord], version: str, machines: list[str], missing: Sequence[str] | None) -> str:
    """Notices of studies that are missing, and of results that do not compare."""
    lines = []
    if missing:
        runs = ", ".join(f"<code>{html.escape(_COMMAND.format(name))}</code>" for name in missing)
        lines.append(
            f"Not run, and not on this page: {runs}; all of them: <code>kerrcaustics study report --run</code>."
        )
    if missing is None:
        lines.append("Made without a checkout of kerrcaustics: there may be studies that were not run.")
    if quick := [_title(one.name) for one in records if one.quick]:
        lines.append(f"Quick runs, on fewer cases than the studies have: {html.escape(', '.join(quick))}.")
    if outdated := ", ".join(_title(one.name) for one in records if one.version != version):
        lines.append(html.escape(f"Computed by another version than the one installed ({version}): {outdated}."))
    if len(machines) > 1:
        lines.append(f"The studies ran on {len(machines)} different machines: their times do not compare.")
    return f'<div class="notice">{"".join(f"<p>{line}</p>" for line in lines)}</div>\n' if lines else ""


def _glance(records: list[StudyRecord]) -> str:
    """The first finding of each study, or its question."""
    lines = []
    for one in records:
        text = (*one.findings, *_docstring_blocks(one), "")[0]
        lines.append(f'<li><a href="#{one.name}">{html.escape(_title(one.name))}</a>. {_prose(text)}</li>\n')
    return f"<h3>At a glance</h3>\n<ul>\n{''.join(lines)}</ul>\n"


def _runs(records: list[StudyRecord], machines: list[str]) -> str:
    """A table of the runs: date, duration, version, machine and settings."""
    heads, rows = ["study", "run (UTC)", "took", "version", "machine", "settings"], []
    for one in records:
        date = f"{one.date:%Y-%m-%d %H:%M}"
        took = "not recorded" if one.seconds is None else _duration(one.seconds)
        whole = (text.replace(" ", "\u00a0") for text in (date, took))
        rows.append([one.name, *whole, one.version, _letter(one, machines), _flat(one.settings)])
    table = ReportTable(heads, rows, [False] * len(heads))
    lines = "".join(f"<p>Machine {chr(65 + i)}: {html.escape(text)}.</p>\n" for i, text in enumerate(machines))
    return f"<h3>What was run</h3>\n{_table(table)}{lines}"


def _section(record: StudyRecord, marks: list[str]) -> str:
    """The section of a study: question, findings, picture, method, verdicts, tables."""
    headline, *about = _docstring_blocks(record) or [""]
    badges = "".join(f'<span class="badge">{html.escape(mark)}</span>' for mark in marks)
    findings = "".join(f"<li>{_prose(text)}</li>\n" for text in record.findings)
    parts = [
        f'<section id="{record.name}">\n<h2>{html.escape(_title(record.name))}</h2>\n{badges}',
        f'<p class="headline">{_prose(headline)}</p>\n' if headline else "",
        f"<ul>\n{findings}</ul>\n" if findings else "",
        _image(record.picture, f"{_title(record.name)}: {headline or 'picture of the study'}"),
        *(f'<p class="method">{_prose(text)}</p>\n' for text in about),
        _verdicts(record.content.get("problems") or []),
        *(_table(part) if isinstance(part, ReportTable) else f"<p>{html.escape(part)}</p>\n" for part in record.tables),
    ]
    return "".join(parts) + "</section>\n"


def _docstring_blocks(record: StudyRecord) -> list[str]:
    """The docstring of the study: a headline and paragraphs, without the command and the files that it writes."""
    blocks = [block for block in re.split(r"\n\s*\n", record.about) if block and not block.startswith(" ")]
    # Points of a list are paragraphs of their own.
    texts = [re.sub(r"^- ", "• ", " ".join(t.split())) for block in blocks for t in re.split(r"\n(?=- )", block)]
    texts = [re.sub(r"\s*\bWrites \S+\.json\b.*", "", text) for text in texts]
    return [text for text in texts if text]


def _prose(text: str) -> str:
    """Text, escaped, in which no line ends within a number like 3e-14 or before a percent sign."""
    return re.sub(r"\d[\d.]*e-\d+|\d+ %", r'<span class="number">\g<0></span>', html.escape(text))


def _image(picture: bytes, words: str) -> str:
    """A picture inside the page, which fills the column where a journal page is filled: three pixels on two."""
    width, height = (size * 2 // 3 for size in struct.unpack(">II", picture[16:24]))
    data = base64.b64encode(picture).decode()
    size = f'width="{width}" height="{height}"'
    return f'<img {size} alt="{html.escape(words)}" src="data:image/png;base64,{data}">\n'


def _verdicts(problems: list[dict[str, Any]]) -> str:
    """Numbers of problems by engine and verdict, and a list of those that fail, with their faults."""
    if not problems:
        return ""
    verdicts = list(dict.fromkeys([*_VERDICTS, *(row["verdict"] for row in problems)]))
    counts = Counter((row["engine"], row["verdict"]) for row in problems)
    engines = list(dict.fromkeys(row["engine"] for row in problems))
    rows = [[engine, *(str(counts[engine, verdict]) for verdict in verdicts)] for engine in engines]
    summary = ReportTable(["engine", *verdicts], rows, [False, *[True] * len(verdicts)])
    failing = [row for row in problems if row["faults"]]
    faults = [[_problem(row), row["engine"], row["verdict"], "; ".join(map(str, row["faults"]))] for row in failing]
    listed = ReportTable(["problem", "engine", "verdict", "what does not hold"], faults, [False] * 4)
    fails = f"<h3>What fails</h3>\n{_table(listed)}" if failing else "<p>Nothing fails.</p>\n"
    return f"<h3>Verdicts</h3>\n{_table(summary)}{fails}{_all_problems(problems)}"


def _all_problems(problems: list[dict[str, Any]]) -> str:
    """Every problem with every engine, in the order of the record, and their cells, where the record has these."""
    heads = list(dict.fromkeys(head for row in problems for head in row.get("shown") or {}))
    if not heads:
        return ""
    rows = [
        [_problem(row), row["engine"], *(str(row.get("shown", {}).get(head, "")) for head in heads), row["verdict"]]
        for row in problems
    ]
    table = ReportTable(["problem", "engine", *heads, "verdict"], rows, [False, False, *[True] * len(heads), False])
    return f"<h3>All {len(rows)} rows of problems by engine</h3>\n{_table(table)}"


def _problem(row: dict[str, Any]) -> str:
    return f"{row['group']}: {row['problem']}" if row.get("group") else row["problem"]


def _table(table: ReportTable) -> str:
    """A table that scrolls where it does not fit."""
    caption = f"<h3>{html.escape(table.caption)}</h3>\n" if table.caption else ""
    heads = _line(table.heads, table, "th")
    body = "".join(_line(row, table, "td") for row in table.rows)
    inner = f"<table>\n<thead>\n{heads}</thead>\n<tbody>\n{body}</tbody>\n</table>"
    return f'{caption}<div class="table" tabindex="0">{inner}</div>\n'


def _line(cells: list[str], table: ReportTable, tag: str) -> str:
    parts = []
    for cell, right in zip(cells, table.to_right, strict=True):
        classes = " ".join(filter(None, ("right" if right else "", _VERDICTS.get(cell, ""))))
        mark = f' class="{classes}"' if classes else ""
        parts.append(f"<{tag}{mark}>{html.escape(cell)}</{tag}>")
    return f"<tr>{''.join(parts)}</tr>\n"


def _letter(record: StudyRecord, machines: list[str]) -> str:
    return chr(65 + machines.index(_flat(record.machine)))


def _duration(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 60} min {whole % 60:02d} s" if whole >= 60 else f"{whole} s"


def _flat(value: Any) -> str:
    """A value of JSON in words: pairs of a dict, the items of a list, or its ends where there are many numbers."""
    if isinstance(value, dict):
        return "; ".join(f"{key.replace('_', ' ')} {_flat(item)}" for key, item in value.items())
    if isinstance(value, list):
        numbers = all(isinstance(item, int | float) for item in value)
        if len(value) > _LONGEST_LIST and numbers:
            return f"{len(value)} values from {_flat(min(value))} to {_flat(max(value))}"
        return ", ".join(map(_flat, value))
    return f"{value:.10g}" if isinstance(value, float) else str(value)
