"""Kernels at run time: the library for this processor is loaded at the first use, and its functions are called.

A call gives the GIL free: threads run kernels side by side.
"""

import ctypes
import hashlib
import importlib
import json
import os
import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.beams.kernels.trees import leaves

ROOM = Path(__file__).parent
OBJECTS = ROOM / "objects"
"""The folder of the compiled libraries."""

CATALOGUE, PROCESSOR = "kernels.json", "processor"
"""Names of the file that describes the kernels, and of the library that knows the processor."""

STALE = "The kernels are older than their sources: run `make kernels`."
"""The message about kernels that are not made from the sources as they are."""

# The instruction set that takes the place of the best one, for comparisons.
_CHOSEN = "KERRCAUSTICS_LEVEL"
_DTYPES = {"f": np.dtype(float), "b": np.dtype(bool), "i": np.dtype(np.int8)}


class _Leaf(NamedTuple):
    """A leaf of a result: its kind, the shape of one ray, its place among the numbers of its width."""

    kind: str
    shape: tuple[int, ...]
    size: int
    start: int


class Kernel:
    """A function of rays as machine code.

    Called with trees of numbers and arrays it returns trees of arrays, all of one batch shape, to which those that
    differ from ray to ray are broadcast.
    """

    def __init__(self, function: Any, about: dict[str, Any]) -> None:
        function.argtypes, function.restype = [ctypes.c_void_p] * 3 + [ctypes.c_int64], None
        self._function, self._by_ray = function, about["by_ray"]
        self._tables = about["tables"]
        self._rebuilt = _rebuilder(about["tree"])
        self._outputs, totals = [], {8: 0, 1: 0}
        for kind, shape in about["outputs"]:
            size, width = int(np.prod(shape)), _DTYPES[kind].itemsize
            self._outputs.append(_Leaf(kind, tuple(shape), size, totals[width]))
            totals[width] += size
        self._totals = totals
        # Of each component of the outputs: bytes for each ray before it; bytes before it in its own array, and its
        # stride; and which are reals, and which flags.
        parts = [(output, part) for output in self._outputs for part in range(output.size)]
        widths = np.array([_DTYPES[output.kind].itemsize for output, _ in parts])
        self._before = widths * [output.start for output, _ in parts]
        strides = [output.size for output, _ in parts]
        self._strided = np.stack([widths * [part for _, part in parts], strides], axis=-1).astype(np.int64)
        self._real, self._flags = np.flatnonzero(widths == 8), np.flatnonzero(widths == 1)

    def __call__(self, *arguments: Any) -> Any:
        """The values for trees of arguments."""
        flat = [*leaves(arguments)]
        numbers, given, tables = (
            [value for value, by_ray in zip(flat, self._by_ray, strict=True) if by_ray is kind]
            for kind in (False, True, None)
        )
        arrays = np.broadcast_arrays(*given)
        columns = [np.ascontiguousarray(values, float).ravel() for values in arrays]
        return self.on_rays(numbers, columns, np.shape(arrays[0]), tables)

    def on_rays(
        self,
        numbers: Sequence[float],
        columns: Sequence[np.ndarray],
        shape: tuple[int, ...] | None = None,
        tables: Sequence[np.ndarray] = (),
    ) -> Any:
        """The values for the numbers of the call and the columns of rays, (n,) or several in one array (n, k).

        tables (rows, k): those of the call.
        """
        held = [np.ascontiguousarray(column, float) for column in columns]
        count, given, read = len(held[0]), np.array(numbers, float), self._checked(tables, len(held[0]))
        inputs = np.array([pair for column in held for pair in _slots(column)] + [(_address(t), len(t)) for t in read])
        reals, flags = np.empty(self._totals[8] * count), np.empty(self._totals[1] * count, bool)
        outputs = self._strided.copy()
        outputs[:, 0] += self._before * count
        outputs[self._real, 0] += _address(reals)
        outputs[self._flags, 0] += _address(flags)
        self._function(_address(given), _address(inputs), _address(outputs), count)
        batch = (count,) if shape is None else shape
        values = []
        for kind, one, size, start in self._outputs:
            own = (reals if kind == "f" else flags)[start * count : (start + size) * count]
            own = own.view(np.int8) if kind == "i" else own
            values.append(own if shape is None and not one else own.reshape((*batch, *one)))
        return self._rebuilt(values)

    def _checked(self, tables: Sequence[np.ndarray], count: int) -> list[np.ndarray]:
        """The tables as they are read; empty ones only where there are no rays."""
        read = [np.ascontiguousarray(table, dtype) for table, (dtype, _) in zip(tables, self._tables, strict=True)]
        if any(
            table.shape != (max(len(table), min(count, 1)), k) for table, (_, k) in zip(read, self._tables, strict=True)
        ):
            raise ValueError(f"The kernel reads tables {self._tables}, but got {[table.shape for table in read]}.")
        return read


def _address(values: np.ndarray) -> int:
    return values.__array_interface__["data"][0]


def _slots(column: np.ndarray) -> list[tuple[int, int]]:
    """Address and stride of each column of an array."""
    first, size = _address(column), 1 if column.ndim == 1 else column.shape[1]
    return [(first + 8 * i, size) for i in range(size)]


def _rebuilder(tree: Any) -> Callable[[list[np.ndarray]], Any]:
    """The function that puts leaves into the tree that a description stands for (`compilation.described`)."""
    if tree is None:
        return lambda values: None
    if isinstance(tree, int):
        return lambda values: values[tree]
    kind, names, branches = tree
    parts = [_rebuilder(branch) for branch in branches]
    if kind in ("tuple", "list"):
        plain = tuple if kind == "tuple" else list
        return lambda values: plain(part(values) for part in parts)
    module, _, name = kind.partition(":")
    record = getattr(importlib.import_module(module), name)
    return lambda values: record(**{name: part(values) for name, part in zip(names, parts, strict=True)})


@cache
def kernel(name: str) -> Kernel:
    """The kernel of that name."""
    about = catalogue()["kernels"][name]
    return Kernel(getattr(_library(), name), about)


@cache
def _library() -> ctypes.CDLL:
    return ctypes.CDLL(str(OBJECTS / library_name(level())))


@cache
def catalogue() -> dict[str, Any]:
    """The description of the kernels; a RuntimeError if they are not there, or older than their sources."""
    try:
        found = json.loads((OBJECTS / CATALOGUE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise RuntimeError("The kernels are not compiled: run `make kernels`, or install the package.") from None
    if not is_current(found):
        raise RuntimeError(STALE)
    return found


def is_current(described: dict[str, Any]) -> bool:
    """True if kernels are made from the sources as they are."""
    with suppress(FileNotFoundError):
        return described["digest"] == digest(described["sources"])
    return False


def level() -> str:
    """The instruction set in use: the best one that is there and that the processor has."""
    levels, chosen = available_levels(), os.environ.get(_CHOSEN)
    if not levels:
        raise RuntimeError("There are no kernels for this processor: run `make kernels`, or install the package.")
    if chosen and chosen not in levels:
        raise RuntimeError(f"{_CHOSEN} must be one of {', '.join(levels)}, but is {chosen!r}.")
    return chosen or levels[-1]


def available_levels() -> tuple[str, ...]:
    """The instruction sets for which kernels are there, and that the processor has, the best one last."""
    # Where nothing is compiled, the catalogue says so.
    catalogue()
    return tuple(name for name in levels_here() if (OBJECTS / library_name(name)).exists())


@cache
def levels_here() -> tuple[str, ...]:
    """The instruction sets of this processor that kernels may use, the best one last."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return ("aarch64",)
    most = ctypes.CDLL(str(OBJECTS / library_name(PROCESSOR))).kernel_level()
    return tuple(f"x86-64-v{number}" for number in range(2, most + 1))


def library_name(level: str, system: str = sys.platform) -> str:
    """The file of a library, or of `PROCESSOR`."""
    name = level if level == PROCESSOR else f"kernels-{level}"
    return f"{name}.dylib" if system == "darwin" else f"{name}.so"


def digest(sources: Iterable[str]) -> str:
    """A digest of files of the package, from which kernels are made."""
    package, made = ROOM.parents[1], hashlib.sha256()
    for name in sources:
        made.update(name.encode() + b"\0" + (package / name).read_bytes() + b"\0")
    return made.hexdigest()[:32]
