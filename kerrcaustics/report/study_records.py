"""Records of studies: written with picture and tables beside them, listed below a folder, read and checked."""

import json
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kerrcaustics.report.machine import machine
from kerrcaustics.report.tables import ReportTable, read_tables
from kerrcaustics.scripts import QUICK_RUN

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SCHEMA = re.compile(r"kerrcaustics/study/([a-z][a-z0-9_]*)/1")
_SCHEMA_START = b"kerrcaustics/study/"
# `write_record` puts the schema first; a file without it there is no record.
_HEAD = 4096
_PNG_START, _PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"
_OF_A_PROBLEM = {"engine": str, "problem": str, "verdict": str, "faults": list}


@dataclass(frozen=True)
class StudyRecord:
    """The output of a study: its record (JSON), its picture (PNG) and its tables (Markdown).

    `content` is the whole record, `about` the docstring of the study, `date` in UTC; `seconds` is the run time, None if
    the study does not record it.
    """

    name: str
    path: Path
    version: str
    machine: dict[str, Any]
    date: datetime
    seconds: float | None
    about: str
    settings: dict[str, Any]
    findings: tuple[str, ...]
    content: dict[str, Any]
    picture: bytes
    tables: list[ReportTable | str]

    @property
    def quick(self) -> bool:
        """Whether the study ran on fewer cases."""
        return self.settings.get("quick") is True


def write_record(path: Path, name: str, about: str, **content: Any) -> Path:
    """Write the numbers of a study as JSON, with its schema, the version, the machine and the date; return the path.

    about: the docstring of its main.py. Numbers that are not finite become null. `kerrcaustics study report` shows of
    the content: `settings` (a dict, to which a quick run adds `quick`), `findings` (sentences), `seconds` (the run
    time), and `problems` (rows with engine, group, problem, verdict, faults, and `shown`, their cells in a table).
    """
    entry = {"schema": f"kerrcaustics/study/{name}/1", "version": metadata.version("kerrcaustics")}
    entry |= {"date": datetime.now(UTC).isoformat(timespec="seconds"), "machine": machine()}
    if QUICK_RUN.get():
        content["settings"] = {"quick": True, **content.get("settings", {})}
    entry |= {"about": cleandoc(about), **content}
    return write_text(path, json.dumps(_finite(entry), indent=1, allow_nan=False) + "\n")


def write_study(folder: Path, name: str, about: str, figure: "Figure", tables: str, **content: Any) -> list[Path]:
    """Write NAME.json as `write_record` does, NAME.png and NAME.md into a folder; return the three paths.

    The record comes last: where there is one, the study is whole.
    """
    from kerrcaustics.draw.picture_files import write_picture

    beside = [write_picture(figure, folder / f"{name}.png"), write_text(folder / f"{name}.md", tables)]
    return [write_record(folder / f"{name}.json", name, about, **content), *beside]


def write_text(path: Path, text: str) -> Path:
    """Write a text file that takes its name only when it is complete; return the path."""
    from kerrcaustics.files import writing

    with writing(path) as file:
        file.write(text.encode())
    return path


def _finite(value: Any) -> Any:
    """The value as JSON can hold it: plain numbers, and None for those that are not finite."""
    if isinstance(value, dict):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if hasattr(value, "tolist"):
        return _finite(value.tolist())
    return None if isinstance(value, float) and not abs(value) < float("inf") else value


def find_records(folder: Path) -> list[StudyRecord]:
    """Records of studies in a folder and in the folders directly in it, by name.

    Raises
    ------
    ValueError
        If a record is damaged, lacks its picture or its tables, or occurs twice.
    """
    records: dict[str, StudyRecord] = {}
    for path in sorted([*folder.glob("*.json"), *folder.glob("*/*.json")]):
        if not _is_record(path):
            continue
        record = _read_record(path)
        if record.name in records:
            both = f"{records[record.name].path} and {path}"
            raise ValueError(
                f"Argument `folder` must hold one record of each study, but {record.name} has two: {both}."
            )
        records[record.name] = record
    return [records[name] for name in sorted(records)]


def _is_record(path: Path) -> bool:
    """True if a JSON file is, or ought to be, the record of a study."""
    if not path.is_file():
        return False
    with open(path, "rb") as file:
        return path.parent.name == f"study-{path.stem}" or _SCHEMA_START in file.read(_HEAD)


def _read_record(path: Path) -> StudyRecord:
    """The record in a file, with the picture and the tables beside it."""
    try:
        entry = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise _damaged(path, f"is no whole JSON ({error})") from None
    schema = _SCHEMA.fullmatch(str(entry.get("schema", ""))) if isinstance(entry, dict) else None
    if schema is None:
        raise _damaged(path, 'has no schema "kerrcaustics/study/NAME/1"')
    findings = _checked(path, entry, "findings", list, optional=True) or []
    for row in _checked(path, entry, "problems", list, optional=True) or []:
        if not isinstance(row, dict) or not all(isinstance(row.get(key), kind) for key, kind in _OF_A_PROBLEM.items()):
            raise _damaged(path, f"has a problem without one of {', '.join(_OF_A_PROBLEM)}")
    return StudyRecord(
        name=schema[1],
        path=path,
        version=_checked(path, entry, "version", str),
        machine=_checked(path, entry, "machine", dict),
        date=_date(path, _checked(path, entry, "date", str)),
        seconds=_checked(path, entry, "seconds", (int, float), optional=True),
        about=_checked(path, entry, "about", str),
        settings=_checked(path, entry, "settings", dict, optional=True) or {},
        findings=tuple(map(str, findings)),
        content=entry,
        picture=_picture(path.with_suffix(".png")),
        tables=_tables(path.with_suffix(".md")),
    )


def _checked(path: Path, entry: dict[str, Any], key: str, kind: Any, optional: bool = False) -> Any:
    value = entry.get(key)
    if value is None and optional:
        return None
    if not isinstance(value, kind):
        raise _damaged(path, f"has no valid {key!r}")
    return value


def _date(path: Path, text: str) -> datetime:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise _damaged(path, "has no valid 'date'") from None


def _picture(path: Path) -> bytes:
    if not path.is_file():
        raise _damaged(path, "is missing: the picture of the study")
    data = path.read_bytes()
    if not (data.startswith(_PNG_START) and data.endswith(_PNG_END)):
        raise _damaged(path, "is no whole PNG picture")
    return data


def _tables(path: Path) -> list[ReportTable | str]:
    if not path.is_file():
        raise _damaged(path, "is missing: the tables of the study")
    try:
        return read_tables(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise _damaged(path, f"is damaged ({error})") from None


def _damaged(path: Path, what: str) -> ValueError:
    return ValueError(f"Argument `folder` must hold whole records of studies, but {path} {what}; run the study again.")
