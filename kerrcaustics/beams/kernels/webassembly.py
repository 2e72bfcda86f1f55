"""Kernels for browsers: a few programs as WebAssembly, in a build with SIMD and in one without.

    python -m kerrcaustics.beams.kernels.webassembly [--into FOLDER]

Their flags are those of the native kernels, so that the answers are equal to the bit. Made after these, where ziglang
is installed: a compiler that CXX names seldom knows the target.
"""

import argparse
import json
import math
import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from kerrcaustics.beams.kernels.compilation import FLAGS, kept_object, run, source_of, sources
from kerrcaustics.beams.kernels.library import OBJECTS, ROOM, STALE, digest, is_current

PROGRAMS = (
    "root_sky",
    "root_equator_sky",
    "beams_sky",
    "beams_equator_sky",
    "rays_sky",
    "rays_equator_sky",
    "short_beams_sky",
    "short_rays_sky",
)
"""The programs that the search of a page calls."""

LAYOUT = "wasm.json"
"""The file that describes them."""


class _Build(NamedTuple):
    """A build: rays side by side, and the processor's name for clang."""

    lanes: int
    processor: str


_BUILDS = {"simd": _Build(2, "generic+simd128"), "plain": _Build(1, "generic")}
# Names of results of programs that return a tuple.
_NAMES = {"root": ("sky", "error", "state")}
# Bytes of the stack: the programs keep their numbers in registers and a few of them in memory.
_STACK = 65536


class BrowserKernels(NamedTuple):
    """Kernels for a page.

    simd: the module for browsers with SIMD.
    plain: the module for all others.
    layout: for each program the counts of numbers and columns, its tables, and its outputs (name, kind, size).
    """

    simd: bytes
    plain: bytes
    layout: dict[str, Any]


def file_name(build: str) -> str:
    """The file of a build."""
    return f"kernels-{build}.wasm"


def browser_kernels(folder: Path = OBJECTS) -> BrowserKernels | None:
    """The kernels for pages; None if they were not built; a RuntimeError if they are older than their sources."""
    if not _are_there(folder):
        return None
    about = _description(folder)
    if not is_current(about):
        raise RuntimeError(STALE)
    simd, plain = ((folder / file_name(build)).read_bytes() for build in _BUILDS)
    return BrowserKernels(simd, plain, about["kernels"])


def build_browser_kernels(folder: Path = OBJECTS) -> bool:
    """Build them unless they are current; False, and none are there, without ziglang."""
    if not find_spec("ziglang"):
        for name in (LAYOUT, *map(file_name, _BUILDS)):
            (folder / name).unlink(missing_ok=True)
        return False
    if _are_there(folder) and is_current(_description(folder)):
        return True
    made_of = sorted({*sources(), Path(__file__).relative_to(ROOM.parents[1]).as_posix()})
    about: dict[str, Any] = {"digest": digest(made_of), "sources": made_of}
    with ProcessPoolExecutor(min(8, os.cpu_count() or 1), multiprocessing.get_context("spawn")) as pool:
        parts = dict(zip(PROGRAMS, pool.map(_compiled, PROGRAMS), strict=True))
    folder.mkdir(parents=True, exist_ok=True)
    shown = [f"--export={name}" for name in (*PROGRAMS, "__heap_base")]
    for build in _BUILDS:
        objects = [parts[program][1][build] for program in PROGRAMS]
        linker = [sys.executable, "-m", "ziglang", "wasm-ld", "--no-entry", "--strip-all", "-z", f"stack-size={_STACK}"]
        run([*linker, *shown, *objects, "-o", folder / file_name(build)])
    about["kernels"] = {program: parts[program][0] for program in PROGRAMS}
    (folder / LAYOUT).write_text(json.dumps(about), encoding="utf-8")
    return True


def _compiled(program: str) -> tuple[dict[str, Any], dict[str, str]]:
    """The layout of a program, and its objects."""
    text, about, _ = source_of(program)
    flags = [flag for flag in FLAGS if flag != "-fPIC"]
    objects = {}
    for build, (lanes, processor) in _BUILDS.items():
        compiler = [sys.executable, "-m", "ziglang", "c++", "-target", "wasm32-freestanding", f"-mcpu={processor}"]
        objects[build] = kept_object(program, f"wasm-{build}", text, [*compiler, *flags, f"-DW={lanes}"])
    return _layout(program, about), objects


def _layout(program: str, about: dict[str, Any]) -> dict[str, Any]:
    _, fields, places = about["tree"]
    names = fields or _NAMES[program.split("_")[0]]
    by_leaf = {place: name for name, place in zip(names, places, strict=True) if place is not None}
    outputs = [[by_leaf[leaf], kind, math.prod(shape)] for leaf, (kind, shape) in enumerate(about["outputs"])]
    by_ray = about["by_ray"]
    counts = {"numbers": by_ray.count(False), "columns": by_ray.count(True)}
    return {**counts, "tables": about["tables"], "outputs": outputs}


def _are_there(folder: Path) -> bool:
    return all((folder / name).exists() for name in (LAYOUT, *map(file_name, _BUILDS)))


def _description(folder: Path) -> dict[str, Any]:
    return json.loads((folder / LAYOUT).read_text(encoding="utf-8"))


def main() -> None:
    """Build into the folder that the command line names."""
    parser = argparse.ArgumentParser(description="Compile the kernels of pages in browsers.")
    parser.add_argument("--into", type=Path, default=OBJECTS, help="the folder of the modules")
    build_browser_kernels(parser.parse_args().into)


if __name__ == "__main__":
    main()
