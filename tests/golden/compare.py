"""Two records of what the program answers, compared field by field. The package is not used."""

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

INDEX = "index.json"
# How long things took, and with what.
NOT_COMPARED = {"seconds", "stages", "versions"}
REFUSED = ("refused",)
COSTS = ("requests", "rays", "beams")

Leaf = np.ndarray | str
Fields = dict[tuple[str, ...], Leaf]
"""Values by the names of fields on the way to them; places in lists are as "[3]"."""


@dataclass(frozen=True)
class Passing:
    """Differences that pass: within so much (relative where numbers exceed 1), or so many errors; so much cost."""

    within: float | None = None
    errors: float | None = None
    cost: float = 1.0


@dataclass
class Renames:
    """New names of fields and classes by the old ones; an empty new name is gone, those in `added` are new."""

    names: dict[str, str] = field(default_factory=dict)
    added: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, reported: list[str]) -> "Renames":
        pairs = [text.split("=") for text in reported]
        return cls({old: new for old, new in pairs if old}, {new for old, new in pairs if not old})

    def of_field(self, name: str, owners: tuple[str, str]) -> str:
        for key in (*(f"{owner}.{name}" for owner in owners), name):
            if key in self.names:
                return self.names[key]
            if key in self.added:
                return ""
        return name


class Answer:
    """A file of a record as plain fields."""

    def __init__(self, path: Path, renames: Renames) -> None:
        self.fields: Fields = {}
        self.kinds: dict[str, str] = {}
        self._renames = renames
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as stored:
                self._arrays = dict(stored)
            self._add((), json.loads(str(self._arrays["head"]))["result"], "", as_tree=True)
        else:
            self._add((), json.loads(path.read_text(encoding="utf-8")), "", as_tree=False)

    def _add(self, place: tuple[str, ...], value: Any, owner: str, *, as_tree: bool) -> None:
        """Add a value: of JSON, or as_tree of the header of a saved result."""
        if as_tree and isinstance(value, dict):
            value, owner = self._of_tree(place, value)
        if isinstance(value, dict):
            for name, part in value.items():
                around = next((step for step in reversed(place) if not step.startswith("[")), "")
                new = self._renames.of_field(name, (owner, around))
                if new and new not in NOT_COMPARED:
                    self._add((*place, new), part, "", as_tree=as_tree)
        elif isinstance(value, list):
            numbers = as_numbers(value)
            if numbers is not None:
                self.fields[place] = numbers
                return
            self.fields[(*place, "length")] = np.array(len(value))
            for i, part in enumerate(value):
                self._add((*place, f"[{i}]"), part, "", as_tree=as_tree)
        else:
            is_text = value is None or isinstance(value, str)
            self.fields[place] = str(value) if is_text else np.asarray(value)

    def _of_tree(self, place: tuple[str, ...], tree: dict[str, Any]) -> tuple[Any, str]:
        """The value of a part of a header: a dict of fields with their class, a list, an array or a text."""
        if "kind" in tree:
            self.kinds[shown(place)] = self._renames.names.get(tree["kind"], tree["kind"])
            return tree["fields"], tree["kind"]
        if "array" in tree:
            return self._arrays[tree["array"]], ""
        ((how, inner),) = tree.items()
        return ({json.dumps(key): part for key, part in inner} if how == "dict" else inner), ""


def as_numbers(values: list[Any]) -> np.ndarray | None:
    """A list of numbers, or of such lists of one length, as an array; null is NaN. None for another list."""
    try:
        made = np.array(values)
        made = made.astype(float) if made.dtype == object else made
    except (TypeError, ValueError):
        return None
    return made if made.size and made.dtype.kind in "biuf" else None


def shown(place: tuple[str, ...]) -> str:
    """The name of a field, the same for all places of a list."""
    return re.sub(r"\.?\[\d+\]", "[]", ".".join(place)) or "all"


@dataclass
class Difference:
    """The differences between values of one field, over all places of lists."""

    largest: float = 0.0
    in_errors: float | None = None
    count: int = 0
    total: int = 0
    notes: list[str] = field(default_factory=list)
    passes: bool = True

    def add(self, old: Leaf, new: Leaf, error: np.ndarray | None, passing: Passing) -> None:
        if isinstance(old, str) or isinstance(new, str) or not {old.dtype.kind, new.dtype.kind} <= set("biufc"):
            if not np.array_equal(old, new):
                self._note(f"{clipped(old)} -> {clipped(new)}")
            return
        self.total += old.size
        if old.shape != new.shape:
            self._note(f"shape {old.shape} -> {new.shape}")
            return
        if old.dtype == new.dtype and old.tobytes() == new.tobytes():
            return
        self._add_numbers(old, new, error, passing)

    def _note(self, text: str) -> None:
        self.passes = False
        self.count += 1
        self.notes.append(text)

    def _add_numbers(self, old: np.ndarray, new: np.ndarray, error: np.ndarray | None, passing: Passing) -> None:
        """Add numbers that are not the same to the bit. Those that are not whole may pass."""
        if old.dtype != new.dtype:
            self.notes.append(f"type {old.dtype} -> {new.dtype}")
        wide = complex if "c" in old.dtype.kind + new.dtype.kind else float
        one, other = old.astype(wide), new.astype(wide)
        with np.errstate(all="ignore"):
            same = (one == other) | (np.isnan(one) & np.isnan(other))
            gap = np.where(same, 0.0, np.nan_to_num(np.abs(other - one), nan=np.inf, posinf=np.inf))
            passed = (gap == 0) & (passing.within is not None or passing.errors is not None)
            if passing.within is not None:
                passed |= gap <= passing.within * np.maximum(1, np.where(np.isfinite(one), np.abs(one), 1))
            if error is not None:
                share = np.where(gap == 0, 0.0, gap / error)
                share = np.where(np.isnan(share), np.inf, share)
                self.in_errors = max(self.in_errors or 0.0, float(share.max(initial=0)))
                if passing.errors is not None:
                    passed |= share <= passing.errors
        whole = {old.dtype.kind, new.dtype.kind} <= set("biu")
        self.passes &= bool((gap == 0).all() if whole else passed.all())
        self.largest = max(self.largest, float(gap.max(initial=0)))
        self.count += int((gap != 0).sum())

    def line(self, name: str) -> str:
        reported = list(dict.fromkeys(self.notes))[:3]
        if self.largest:
            reported.append(f"at most {self.largest:.3g} off, in {self.count} of {self.total}")
            if self.in_errors is not None:
                reported.append(f"{self.in_errors:.3g} of the error")
        text = ", ".join(reported) or "the signs of zeros or of NaN differ"
        return f"{name}: {text}{' (passes)' if self.passes else ''}"


def clipped(value: Leaf) -> str:
    text = value if isinstance(value, str) else np.array2string(np.asarray(value), threshold=4)
    return repr(text if len(text) < 400 else f"{text[:400]}...")


def error_of(fields: Fields, place: tuple[str, ...], value: Leaf) -> np.ndarray | None:
    """The error that is reported beside a field, in its unit, and of a shape that its own begins with."""
    if not place or isinstance(value, str) or value.dtype.kind not in "fc":
        return None
    stem, unit = re.fullmatch(r"(.*?)((?:_deg|_rad)?)", place[-1]).groups()
    if stem.endswith("error"):
        return None
    names = {f"{stem}_error{unit}": 1.0, f"error{unit}": 1.0, "error_rad": math.degrees(1) if unit == "_deg" else 1.0}
    for name, factor in names.items():
        error = fields.get((*place[:-1], name))
        if isinstance(error, np.ndarray) and error.dtype.kind == "f" and error.shape == value.shape[: error.ndim]:
            return factor * error.reshape(error.shape + (1,) * (value.ndim - error.ndim))
    return None


def differences(old: Answer, new: Answer, passing: Passing) -> tuple[list[str], bool]:
    """The differences between two answers, in lines, and whether it passes."""
    if (REFUSED in old.fields) != (REFUSED in new.fields):
        side, which = (old, "was refused, and is answered") if REFUSED in old.fields else (new, "is refused")
        return [f"{which}: {clipped(side.fields[REFUSED])}"], False
    by_field: dict[str, Difference] = {}
    for place in old.fields.keys() & new.fields.keys():
        one, other = old.fields[place], new.fields[place]
        by_field.setdefault(shown(place), Difference()).add(one, other, error_of(old.fields, place, one), passing)
    changed = {name: found for name, found in by_field.items() if found.count or found.notes or not found.passes}
    lines = [changed[name].line(name) for name in sorted(changed)]
    gone = sorted({shown(place) for place in old.fields.keys() - new.fields.keys()})
    more = sorted({shown(place) for place in new.fields.keys() - old.fields.keys()})
    lines += [f"{name}: gone" for name in gone] + [f"{name}: new" for name in more]
    passes = not gone and not more and all(found.passes for found in changed.values())
    renamed = {f"{old.kinds[at]} -> {kind}" for at, kind in new.kinds.items() if old.kinds.get(at, kind) != kind}
    return lines + [f"class {pair} (passes)" for pair in sorted(renamed)], passes


def costs(old: dict[str, Any], new: dict[str, Any], passing: Passing) -> tuple[list[str], bool]:
    """Requests to the engines that are more or fewer, rays and beams, and whether they pass."""
    changed = [name for name in COSTS if new[name] != old[name]]
    dearer = {name for name in changed if new[name] > passing.cost * old[name]}
    lines = [f"{name}: {old[name]} -> {new[name]}{'' if name in dearer else ' (passes)'}" for name in changed]
    return lines, not dearer


def compared(folders: tuple[Path, Path], only: str, renamed: list[str], passing: Passing) -> Iterator[tuple[str, bool]]:
    """A text for each entry, and whether it passes."""
    old, new = (json.loads((folder / INDEX).read_text(encoding="utf-8"))["entries"] for folder in folders)
    renames = Renames.of(renamed)
    added = Renames(added=renames.added)
    for name in sorted(key for key in old.keys() | new.keys() if fnmatchcase(key, only)):
        if name not in old or name not in new:
            yield f"{name}: {'new' if name in new else 'gone'}", name in new
            continue
        files = folders[0] / old[name]["file"], folders[1] / new[name]["file"]
        lines, same = differences(Answer(files[0], renames), Answer(files[1], added), passing)
        dearer, cheap = costs(old[name], new[name], passing)
        reported = [*(lines or ["equal to the bit"]), *dearer]
        text = f" {reported[0]}" if len(reported) == 1 else "".join(f"\n    {line}" for line in reported)
        yield f"{name}:{text}", same and cheap


def compare(old: Path, new: Path, only: str, renamed: list[str], passing: Passing) -> int:
    """Print what differs between two records; 0 where all passes, else 1."""
    failed = total = 0
    for text, passes in compared((old, new), only, renamed, passing):
        print(text)
        total += 1
        failed += not passes
    print(f"{total} entries, {failed} of them differ")
    return int(failed > 0 or total == 0)
