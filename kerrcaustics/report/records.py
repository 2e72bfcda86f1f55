"""Records of studies, as `kerrcaustics.study.write_record` leaves them: found below a folder, read and checked."""

import json
import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from kerrcaustics.report.tables import Table, read_tables

_SCHEMA = re.compile(r"kerrcaustics/study/([a-z][a-z0-9_]*)/1")
_SCHEMA_START = b"kerrcaustics/study/"
# `write_record` puts the schema first; what does not have it there is another file.
_HEAD = 4096
_PNG_START, _PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"
_OF_A_PROBLEM = {"engine": str, "problem": str, "verdict": str, "faults": list}


@dataclass(frozen=True)
class StudyRecord:
    """What a run of a study left behind: its record (JSON), its picture (PNG) and its tables (Markdown).

    `content` is the whole record; `date` (UTC), `seconds` and `about` (the study in its own words) are None or empty
    in records of versions that did not write them.
    """

    name: str
    path: Path
    version: str
    machine: dict[str, Any]
    date: datetime | None
    seconds: float | None
    about: str
    settings: dict[str, Any]
    findings: tuple[str, ...]
    content: dict[str, Any]
    picture: bytes
    tables: list[Table | str]


def find_records(folder: Path) -> list[StudyRecord]:
    """Records of studies in a folder and in the folders directly in it, by name.

    Raises
    ------
    ValueError
        A record that is damaged, lacks its picture or its tables, or is there twice.
    """
    found: dict[str, StudyRecord] = {}
    for path in sorted([*folder.glob("*.json"), *folder.glob("*/*.json")]):
        if not _is_record(path):
            continue
        record = _read_record(path)
        if record.name in found:
            both = f"{found[record.name].path} and {path}"
            raise ValueError(
                f"Argument `folder` must hold one record of each study, but {record.name} has two: {both}."
            )
        found[record.name] = record
    return [found[name] for name in sorted(found)]


def _is_record(path: Path) -> bool:
    """True where a JSON file is, or ought to be, the record of a study."""
    if not path.is_file():
        return False
    with open(path, "rb") as file:
        return path.parent.name == f"study-{path.stem}" or _SCHEMA_START in file.read(_HEAD)


def _read_record(path: Path) -> StudyRecord:
    """The record in a file, with what lies beside it."""
    try:
        entry = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise _damaged(path, f"is no whole JSON ({error})") from None
    schema = _SCHEMA.fullmatch(str(entry.get("schema", ""))) if isinstance(entry, dict) else None
    if schema is None:
        raise _damaged(path, 'has no schema "kerrcaustics/study/NAME/1"')
    date = _checked(path, entry, "date", str, optional=True)
    findings = _checked(path, entry, "findings", list, optional=True) or []
    for row in _checked(path, entry, "problems", list, optional=True) or []:
        if not isinstance(row, dict) or not all(isinstance(row.get(key), kind) for key, kind in _OF_A_PROBLEM.items()):
            raise _damaged(path, f"has a problem without one of {', '.join(_OF_A_PROBLEM)}")
    return StudyRecord(
        name=schema[1],
        path=path,
        version=_checked(path, entry, "version", str),
        machine=_checked(path, entry, "machine", dict),
        date=None if date is None else _date(path, date),
        seconds=_checked(path, entry, "seconds", (int, float), optional=True),
        about=_checked(path, entry, "about", str, optional=True) or "",
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


def _tables(path: Path) -> list[Table | str]:
    if not path.is_file():
        raise _damaged(path, "is missing: the tables of the study")
    try:
        return read_tables(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise _damaged(path, f"is damaged ({error})") from None


def _damaged(path: Path, what: str) -> ValueError:
    return ValueError(f"Argument `folder` must hold whole records of studies, but {path} {what}; run the study again.")
