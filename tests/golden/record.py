"""Answers of the program today, each in a file, and what it cost."""

import json
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from fnmatch import fnmatchcase
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from tests.golden.compare import COSTS, INDEX
from tests.golden.entries import FILES, entries, save

# The one function through which all requests reach the engines. What it returns has a `status` for each ray.
COUNTED = "kerrcaustics.beams.trace", "_trace"
BEAMS = "Beams"
# What this room keeps is no answer.
KERNELS = "kerrcaustics.beams.kernels"


@contextmanager
def counting() -> Iterator[dict[str, int]]:
    """The number of requests that reach the engines meanwhile, and of their rays and beams."""
    module, name = import_module(COUNTED[0]), COUNTED[1]
    original, counts, lock = getattr(module, name), dict.fromkeys(COSTS, 0), threading.Lock()

    def counted(*arguments: Any, **options: Any) -> Any:
        result = original(*arguments, **options)
        with lock:
            counts["requests"] += 1
            counts["beams" if type(result).__name__ == BEAMS else "rays"] += np.size(result.status)
        return result

    setattr(module, name, counted)
    try:
        yield counts
    finally:
        setattr(module, name, original)


def forget() -> None:
    """Forget all that the package keeps between calls but its kernels."""
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] == "kerrcaustics" and not name.startswith(KERNELS):
            for value in list(vars(module).values()):
                if hasattr(value, "cache_clear"):
                    value.cache_clear()


def write(folder: Path, name: str, ask: Callable[[], Any]) -> str:
    """Write the answer of an entry, or why there is none, and return the name of its file."""
    try:
        answer = ask()
    except Exception as error:
        answer = {"refused": f"{type(error).__name__}: {error}"}
    plain = isinstance(answer, dict)
    path, other = (folder / f"{name}{ending}" for ending in ((".json", ".npz") if plain else (".npz", ".json")))
    other.unlink(missing_ok=True)
    if plain:
        path.write_text(json.dumps(answer) + "\n", encoding="utf-8")
    else:
        save(path, answer)
    return path.name


def record(folder: Path, only: str) -> int:
    """Record all entries whose names match; 0 when done."""
    folder = folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    index = folder / INDEX
    known = json.loads(index.read_text(encoding="utf-8"))["entries"] if index.exists() else {}
    versions = {name: version(name) for name in ("kerrcaustics", "numpy", "jax", "jaxlib")}
    with tempfile.TemporaryDirectory() as aside, chdir(aside):
        for name, text in FILES.items():
            Path(name).write_text(text, encoding="utf-8")
        for name, ask in entries():
            if not fnmatchcase(name, only):
                continue
            forget()
            began = time.process_time()
            with counting() as counts:
                file = write(folder, name, ask)
            known[name] = {"file": file, **counts, "seconds": round(time.process_time() - began, 2)}
            print(f"{known[name]['seconds']:7.2f} s  {name}", flush=True)
            reported = {"versions": versions, "entries": dict(sorted(known.items()))}
            index.write_text(json.dumps(reported, indent=1) + "\n", encoding="utf-8")
    print(f"{len(known)} entries, {sum(entry['seconds'] for entry in known.values()):.0f} s")
    return 0
