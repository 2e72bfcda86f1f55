"""Compile the kernels: trace, lower, write C++, compile, for each program and each instruction set.

    python -m kerrcaustics.beams.kernels.build [--all-levels] [--platform PLATFORM] [--into FOLDER]

Done when the package is built or installed (packaging/hatch_kernels.py), and by `make kernels`.
"""

import argparse
import ctypes
import json
import multiprocessing
import os
import platform
import shutil
import sys
import sysconfig
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from kerrcaustics.beams.kernels.compilation import FLAGS, kept_object, run, source_of, sources
from kerrcaustics.beams.kernels.library import (
    CATALOGUE,
    OBJECTS,
    PROCESSOR,
    ROOM,
    digest,
    is_current,
    library_name,
)
from kerrcaustics.beams.kernels.webassembly import build_browser_kernels


class InstructionSet(NamedTuple):
    """An instruction set: rays side by side, fewer in loops, as long as their slowest; its names for compilers."""

    lanes: int
    in_loops: int
    for_clang: str
    for_gcc: str


LEVELS = {
    "x86-64-v2": InstructionSet(2, 2, "x86_64_v2", "x86-64-v2"),
    "x86-64-v3": InstructionSet(8, 4, "x86_64_v3", "x86-64-v3"),
    "x86-64-v4": InstructionSet(8, 8, "x86_64_v4", "x86-64-v4"),
    "aarch64": InstructionSet(2, 2, "generic", "armv8-a"),
}


class Platform(NamedTuple):
    """A platform of wheels: the compiler's target, the system as `sys.platform` names it, and the tag."""

    target: str
    system: str
    tag: str


PLATFORMS = {
    "x86_64-linux-gnu": Platform("x86_64-linux-gnu", "linux", "manylinux_2_17_x86_64.manylinux2014_x86_64"),
    "aarch64-linux-gnu": Platform("aarch64-linux-gnu", "linux", "manylinux_2_17_aarch64.manylinux2014_aarch64"),
    "x86_64-linux-musl": Platform("x86_64-linux-musl", "linux", "musllinux_1_1_x86_64"),
    "aarch64-linux-musl": Platform("aarch64-linux-musl", "linux", "musllinux_1_1_aarch64"),
    "x86_64-macos": Platform("x86_64-macos.11.0", "darwin", "macosx_11_0_x86_64"),
    "aarch64-macos": Platform("aarch64-macos.11.0", "darwin", "macosx_11_0_arm64"),
}


def platform_here() -> str:
    """The name of this platform; a RuntimeError if there are no kernels for it."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    library = "musl" if "musl" in (sysconfig.get_config_var("HOST_GNU_TYPE") or "") else "gnu"
    system = {"darwin": "macos", "linux": f"linux-{library}"}.get(sys.platform, sys.platform)
    name = f"{machine}-{system}"
    if name not in PLATFORMS:
        raise RuntimeError(f"There are no kernels for {name}, but for {', '.join(PLATFORMS)}.")
    return name


def wheel_platform(name: str | None = None) -> str:
    """The platform tag of wheels, by default of those for this platform."""
    return PLATFORMS[name or platform_here()].tag


def levels_for(name: str) -> tuple[str, ...]:
    """All instruction sets of a platform."""
    return tuple(level for level in LEVELS if level.startswith("x86") == _is_chosen_at_run_time(name))


def _is_chosen_at_run_time(name: str) -> bool:
    """True for platforms with several instruction sets, among which a library that knows the processor chooses."""
    return name.startswith("x86_64")


def file_names(name: str, levels: Sequence[str]) -> list[str]:
    """The files that are built."""
    libraries = [PROCESSOR, *levels] if _is_chosen_at_run_time(name) else levels
    return [CATALOGUE, *(library_name(level, PLATFORMS[name].system) for level in libraries)]


def build_native(folder: Path = OBJECTS) -> None:
    """The kernels of this machine, at the best instruction set of its processor."""
    name = platform_here()
    levels = levels_for(name)
    if _is_chosen_at_run_time(name):
        folder.mkdir(parents=True, exist_ok=True)
        _build_processor(folder, name)
        levels = levels[: ctypes.CDLL(str(folder / library_name(PROCESSOR))).kernel_level() - 1][-1:]
    if not _is_built(folder, name, levels):
        build_all(folder, name, levels)


def _is_built(folder: Path, name: str, levels: Sequence[str]) -> bool:
    """True if the kernels are there, and made from the sources as they are; their date is then of now."""
    if not all((folder / file).exists() for file in file_names(name, levels)):
        return False
    catalogue = folder / CATALOGUE
    if not is_current(json.loads(catalogue.read_text(encoding="utf-8"))):
        return False
    catalogue.touch()
    return True


def build_all(
    folder: Path = OBJECTS,
    name: str | None = None,
    levels: Sequence[str] | None = None,
    chosen: Sequence[str] | None = None,
) -> None:
    """The kernels of a platform, by default this one, for instruction sets, by default all; chosen: only these."""
    from kerrcaustics.beams.kernels.programs import programs

    name = name or platform_here()
    levels, names = levels or levels_for(name), chosen or [*programs()]
    files = sources()
    made_of = digest(files)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if _is_chosen_at_run_time(name):
        _build_processor(folder, name)
    workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with ProcessPoolExecutor(min(8, workers), multiprocessing.get_context("spawn")) as pool:
        parts = dict(zip(names, pool.map(partial(_built, levels=levels, name=name), names), strict=True))
    for level in levels:
        library = folder / library_name(level, PLATFORMS[name].system)
        objects = [parts[program][1][level] for program in names]
        run([*_compiler(name, level), "-shared", "-nostdlib", *objects, "-o", library])
    about = {"digest": made_of, "sources": files, "kernels": {program: parts[program][0] for program in names}}
    (folder / CATALOGUE).write_text(json.dumps(about), encoding="utf-8")


def _build_processor(folder: Path, name: str) -> None:
    build_library(ROOM / "processor.cc", folder / library_name(PROCESSOR, PLATFORMS[name].system), name, "x86-64-v2")


def build_library(text: Path, library: Path, name: str, level: str, lanes: int = 1) -> None:
    """A library of one text in C++, for one instruction set of a platform."""
    run([*_compiler(name, level), *FLAGS, f"-DW={lanes}", f"-I{ROOM}", "-shared", text, "-o", library])


def _built(program: str, *, levels: Sequence[str], name: str) -> tuple[dict[str, Any], dict[str, str]]:
    """The description of a program, and its objects."""
    text, about, has_loops = source_of(program)
    objects = {}
    for level in levels:
        lanes = LEVELS[level].in_loops if has_loops else LEVELS[level].lanes
        objects[level] = kept_object(program, level, text, [*_compiler(name, level), *FLAGS, f"-DW={lanes}"])
    return about, objects


def _compiler(name: str, level: str) -> list[Any]:
    """The compiler with its target: the one in CXX, for this machine; clang of ziglang; or the system's."""
    own = os.environ.get("CXX")
    if own and name == platform_here():
        return [*own.split(), f"-march={LEVELS[level].for_gcc}"]
    if find_spec("ziglang"):
        target = PLATFORMS[name].target
        return [sys.executable, "-m", "ziglang", "c++", "-target", target, f"-mcpu={LEVELS[level].for_clang}"]
    raise RuntimeError("No compiler for the kernels: install ziglang, or name a C++ compiler in CXX.")


def main() -> None:
    """Compile what the command line asks for."""
    parser = argparse.ArgumentParser(description="Compile the kernels.")
    parser.add_argument("--all-levels", action="store_true", help="for all instruction sets of the platform")
    parser.add_argument("--platform", choices=PLATFORMS, help="a platform other than this one, with all its levels")
    parser.add_argument("--into", type=Path, default=OBJECTS, help="the folder of the libraries")
    asked = parser.parse_args()
    if asked.all_levels or asked.platform:
        build_all(asked.into, asked.platform)
    else:
        build_native(asked.into)
    build_browser_kernels(asked.into)


if __name__ == "__main__":
    main()
