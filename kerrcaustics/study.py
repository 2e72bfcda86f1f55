"""What every study (a script of the folder studies/ of a checkout) writes down beside its numbers, and its timing."""

import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kerrcaustics.scripts import STUDIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Work that takes less than this many seconds is repeated within one timing.
_SHORTEST_TIMING = 0.05
# Heads of columns that hold words.
_WORDS = ("engine", "verdict")
# Once repeats have taken this long in all, there are no more of them.
_LONGEST_TIMING = 2.0


def write_record(path: Path, name: str, **content: Any) -> Path:
    """Write the numbers of a study as JSON, with its schema, the version, the machine and the date; return the path.

    Numbers that are not finite become null. What `kerrcaustics study report` shows of the content: `settings` (a dict),
    `findings` (sentences), `seconds` (how long it took), and `problems` (rows with engine, group, problem, verdict,
    faults).
    """
    entry = {"schema": f"kerrcaustics/study/{name}/1", "version": metadata.version("kerrcaustics")}
    entry |= {"date": datetime.now(UTC).isoformat(timespec="seconds"), "machine": machine()}
    entry |= {"about": STUDIES.docstring(name), **content}
    return write_text(path, json.dumps(_finite(entry), indent=1, allow_nan=False) + "\n")


def write_study(folder: Path, name: str, figure: "Figure", tables: str, **content: Any) -> list[Path]:
    """Write NAME.json as `write_record` does, NAME.png and NAME.md into a folder; return the three paths.

    The record comes last: where there is one, the study is whole.
    """
    from kerrcaustics.draw.files import write_picture

    beside = [write_picture(figure, folder / f"{name}.png"), write_text(folder / f"{name}.md", tables)]
    return [write_record(folder / f"{name}.json", name, **content), *beside]


def write_text(path: Path, text: str) -> Path:
    """Write a text file that takes its name only when it is complete; return the path."""
    from kerrcaustics.files import writing

    with writing(path) as file:
        file.write(text.encode())
    return path


def markdown_table(heads: list[str], rows: list[list[str]]) -> str:
    """A Markdown table: first column to the left, the others to the right."""
    lines = [heads, ["---", *["---:"] * (len(heads) - 1)], *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def text_table(heads: list[str], rows: list[list[str]]) -> str:
    """The same table for a terminal; words to the left, too."""
    widths = [max(len(line[i]) for line in [heads, *rows]) for i in range(len(heads))]
    lines = [
        [
            text.ljust(w) if i == 0 or heads[i] in _WORDS else text.rjust(w)
            for i, (text, w) in enumerate(zip(line, widths, strict=True))
        ]
        for line in [heads, *rows]
    ]
    return "".join("  ".join(line).rstrip() + "\n" for line in lines)


def machine() -> dict[str, Any]:
    """What the numbers were computed on: processor, cores, versions, device."""
    import jax
    import numpy as np

    device = jax.devices()[0]
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "jax": jax.__version__,
        "device": f"{device.platform}: {device.device_kind}",
    }


@contextmanager
def one_core() -> Iterator[None]:
    """Work within is done on one core, where the system can say so."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def core_seconds(work: Callable[[], object], repeats: int = 3) -> float:
    """Processor time of one call in seconds, of all cores together: the least of several, after one to compile."""
    work()
    best, calls, total = float("inf"), 1, 0.0
    for _ in range(repeats):
        if total > _LONGEST_TIMING:
            break
        while True:
            began = time.process_time()
            for _ in range(calls):
                work()
            spent = time.process_time() - began
            if spent > _SHORTEST_TIMING:
                break
            calls *= 2
        best, total = min(best, spent / calls), total + spent
    return best


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def _finite(value: Any) -> Any:
    """The same for JSON: plain numbers, and None for those that are not finite."""
    if isinstance(value, dict):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if hasattr(value, "tolist"):
        return _finite(value.tolist())
    return None if isinstance(value, float) and not abs(value) < float("inf") else value
