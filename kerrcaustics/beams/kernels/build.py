"""Compile the kernels: trace, lower, write C++, compile, for each program and each instruction set.

    python -m kerrcaustics.beams.kernels.build [--all-levels] [--platform PLATFORM] [--into FOLDER]

Done when the package is built or installed (packaging/hatch_kernels.py), and by `make kernels`.
"""

import argparse
import ctypes
import hashlib
import json
import multiprocessing
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from kerrcaustics.beams.kernels.library import (
    CATALOGUE,
    OBJECTS,
    PROCESSOR,
    ROOM,
    digest,
    is_current,
    library_name,
)

FLAGS = (
    *("-std=c++17", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
    *("-fno-sanitize=undefined", "-fPIC", "-nostdlib", "-g0"),
)
"""Without contraction, and with functions of our own, every machine computes the same bits."""

# Texts in C++ beside those that are made: headers of all of these, and others; the rooms whose modules are sources.
_HEADERS, _TABLES = ("lanes.h", "functions.h", "coefficients.h"), "tables.h"
_TEXTS = (*_HEADERS, _TABLES, "processor.cc")
# What reads kernels, and what makes those of browsers alone, is no source of the native ones.
_NO_SOURCES = (".kernels.library", ".kernels.webassembly")
_ROOMS = ("kerrcaustics.beams.", "kerrcaustics.spacetime.", "kerrcaustics.lens_map.newton_")
# Objects as they were compiled are kept here, in a checkout.
_KEPT = ROOM.parents[2] / "build" / "kernels"


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


def sources() -> list[str]:
    """The files from which kernels are made: all that the programs and the generator import of the engine."""
    from kerrcaustics.beams.kernels import divisions, emission, lowering, programs

    modules = (divisions, emission, lowering, programs, *programs.modules())
    package, files = ROOM.parents[1], [Path(str(module.__file__)) for module in modules]
    files += [
        Path(str(module.__file__))
        for name, module in sys.modules.items()
        if name.startswith(_ROOMS) and not name.endswith(_NO_SOURCES) and module.__file__
    ]
    files += [Path(__file__), *(ROOM / name for name in _TEXTS)]
    return sorted({path.relative_to(package).as_posix() for path in files})


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


def kept_object(program: str, level: str, text: str, compiler: Sequence[Any]) -> str:
    """The object of a program's text: the kept one, if text, headers and command are those of then; else compiled."""
    included = (*_HEADERS, _TABLES) if _TABLES in text else _HEADERS
    headers = "".join((ROOM / file).read_text(encoding="utf-8") for file in included)
    command = [*compiler, f"-I{ROOM}", "-c"]
    made_of = hashlib.sha256("\0".join([text, headers, *map(str, command)]).encode()).hexdigest()[:24]
    kept = _KEPT / f"{program}-{level}-{made_of}.o"
    if not kept.exists():
        _KEPT.mkdir(parents=True, exist_ok=True)
        for old in _KEPT.glob(f"{program}-{level}-*.o"):
            old.unlink(missing_ok=True)
        code, part = _KEPT / f"{program}-{level}.cc", _KEPT / f"{program}-{level}-{os.getpid()}.part.o"
        code.write_text(text, encoding="utf-8")
        run([*command, code, "-o", part])
        part.replace(kept)
    return str(kept)


def source_of(program: str) -> tuple[str, dict[str, Any], bool]:
    """The C++ text of a program, its description for the catalogue, and True if it has loops of unknown length."""
    import jax

    from kerrcaustics.beams.kernels.divisions import with_merged_divisions
    from kerrcaustics.beams.kernels.emission import emitted
    from kerrcaustics.beams.kernels.programs import graph_of

    graph, by_ray = graph_of(program)
    made = with_merged_divisions(graph)
    kinds = {output.leaf: output.kind for output in made.outputs}
    outputs = [[kinds[leaf], list(shape.shape)] for leaf, shape in enumerate(made.shapes)]
    tree = described(jax.tree.unflatten(made.tree, made.shapes), iter(range(len(outputs))))
    about = {"by_ray": by_ray, "tables": made.tables, "outputs": outputs, "tree": tree}
    has_loops = any(node.operation == "loopout" for node in made.graph.nodes)
    include = "".join(f'#include "{file}"\n' for file in ("functions.h", *([_TABLES] if made.tables else [])))
    return f"{include}\n{emitted(made, program)}", about, has_loops


def described(tree: Any, numbers: Iterator[int]) -> Any:
    """A tree as JSON has it: a leaf as its number, a branch as its class, the names of its parts, and the parts."""
    if tree is None:
        return None
    names = getattr(tree, "_fields", None) or [*getattr(tree, "__dataclass_fields__", ())]
    if names and not hasattr(tree, "dtype"):
        kind = f"{type(tree).__module__}:{type(tree).__qualname__}"
        return [kind, [*names], [described(getattr(tree, name), numbers) for name in names]]
    if isinstance(tree, tuple | list):
        return [type(tree).__name__, [], [described(part, numbers) for part in tree]]
    return next(numbers)


def _compiler(name: str, level: str) -> list[Any]:
    """The compiler with its target: the one in CXX, for this machine; clang of ziglang; or the system's."""
    own = os.environ.get("CXX")
    if own and name == platform_here():
        return [*own.split(), f"-march={LEVELS[level].for_gcc}"]
    if find_spec("ziglang"):
        target = PLATFORMS[name].target
        return [sys.executable, "-m", "ziglang", "c++", "-target", target, f"-mcpu={LEVELS[level].for_clang}"]
    raise RuntimeError("No compiler for the kernels: install ziglang, or name a C++ compiler in CXX.")


def run(command: list[Any]) -> None:
    """Run a compiler or a linker; a RuntimeError with its words if it fails."""
    # What the compiler keeps for itself goes there too, and not into the home folder.
    caches = {f"ZIG_{kind}_CACHE_DIR": str(_KEPT / "zig") for kind in ("GLOBAL", "LOCAL")}
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, env={**caches, **os.environ})
    if done.returncode:
        raise RuntimeError(f"The compiler failed: {' '.join(map(str, command))}\n{done.stderr[-4000:]}")


def main() -> None:
    """Compile what the command line asks for."""
    from kerrcaustics.beams.kernels.webassembly import build_browser_kernels

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
