"""The steps from a program to its object: the text in C++, the compiler, and objects that are kept; and the sources."""

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from kerrcaustics.beams.kernels.library import ROOM

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
    files += [Path(__file__), *(ROOM / name for name in (*_TEXTS, "build.py"))]
    return sorted({path.relative_to(package).as_posix() for path in files})


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


def run(command: list[Any]) -> None:
    """Run a compiler or a linker; a RuntimeError with its words if it fails."""
    # What the compiler keeps for itself goes there too, and not into the home folder.
    caches = {f"ZIG_{kind}_CACHE_DIR": str(_KEPT / "zig") for kind in ("GLOBAL", "LOCAL")}
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, env={**caches, **os.environ})
    if done.returncode:
        raise RuntimeError(f"The compiler failed: {' '.join(map(str, command))}\n{done.stderr[-4000:]}")
