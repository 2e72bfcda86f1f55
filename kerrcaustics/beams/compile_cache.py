"""Compiled programs, kept in the user's cache folder: a second process neither traces nor compiles them.

They are kept here and not by JAX, whose cache is a setting of the whole process and saves the compilation alone. A file
serves as long as all that made it stays the same: the sources, JAX, the processor, the compiler's options.

Whoever writes such a file decides what the program does. Only those are read that the user or root wrote, in folders to
which nobody else can write (`own_folder.py`).
"""

import contextlib
import ctypes
import hashlib
import multiprocessing
import os
import pickle
import platform
import re
import threading
import time
import warnings
import zlib
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jax
from jax.experimental import serialize_executable

from kerrcaustics.own_folder import NotOwnError, own_files, own_folder, read_own, write_own

# Files kept at most, and programs in memory, where each takes some 80 MB: those not used for longest go first.
_MOST_KEPT, _MOST_LOADED = 256, 16
# Names of files that are kept; files that are not complete after so many seconds were left behind.
KEPT = re.compile(r"[\w.<>]+-[0-9a-f]{32}")
_PART, _LEFT_BEHIND = re.compile(rf"\.{KEPT.pattern}\.[0-9a-f]{{16}}\.part"), 3600.0
# The folder of programs in that of all caches.
PLACE = ("kerrcaustics", "programs")
# What programs are made of: the rooms whose functions are compiled.
_SOURCES = ("beams", "spacetime")

# For the compiler, by platform. On a CPU, fused loops would compute what they share again and again: one loop for each
# operation, over arrays that stay in the cache, takes a third of the time, and compiles faster. Loops that are taken
# for small would become one function each, as JAX 0.12 has it, and compile for minutes.
_OPTIONS = {"cpu": {"xla_disable_hlo_passes": "fusion,small-while-loop-hoisting"}}

Compiled = Callable[..., Any]

_loaded: dict[Hashable, "Future[Compiled]"] = {}
_lock = threading.Lock()


class Program:
    """A function of trees of arrays, compiled once for each shape of its arguments and each value of the static ones.

    Safe to call from several threads, under the settings of `own_settings`.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def __call__(self, *arguments: Any, **static: Hashable) -> Any:
        """The function's value. Arguments are trees of numbers and arrays; static ones are part of the program."""
        return self.compiled(*arguments, **static)(*arguments)

    def compiled(self, *arguments: Any, **static: Hashable) -> Compiled:
        """The program for arguments such as these: found in this process, in a file, or made and put into one."""
        leaves, tree = jax.tree.flatten(arguments)
        kinds = [(getattr(leaf, "shape", ()), getattr(leaf, "dtype", type(leaf))) for leaf in leaves]
        key = (self, tree, tuple(static.items()), *kinds)
        with _lock:
            mine = key not in _loaded
            # The last one used stands last.
            found = _loaded[key] = _loaded.pop(key, None) or Future()
            if len(_loaded) > _MOST_LOADED:
                del _loaded[next(iter(_loaded))]
        if mine:
            try:
                found.set_result(self._kept(arguments, static, [(shape, str(kind)) for shape, kind in kinds]))
            except BaseException as error:
                with _lock:
                    _loaded.pop(key, None)
                found.set_exception(error)
        return found.result()

    def _kept(self, arguments: tuple[Any, ...], static: dict[str, Hashable], shapes: list[Any]) -> Compiled:
        device = jax.devices()[0]
        options = _OPTIONS.get(device.platform)
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        asked = (jax.tree.structure(arguments), shapes, sorted(static.items()), options)
        about = repr((_made_of(), device.platform, device.device_kind, name, asked))
        file = f"{name}-{hashlib.sha256(about.encode()).hexdigest()[:32]}"
        kept = _read(file)
        if kept is None:
            kept = jax.jit(partial(self._function, **static), compiler_options=options).lower(*arguments).compile()
            _write(file, kept)
            give_back_memory()
        return kept


def give_back_memory() -> None:
    """Give what was freed back to the system, where the C library would keep it: the compiler takes some 100 MB."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def cache_root() -> Path | None:
    """The folder of all caches of the user; None where there is none, as for a user without a home."""
    with contextlib.suppress(RuntimeError):
        named = Path(os.environ.get("XDG_CACHE_HOME", ""))
        # A relative one would be another folder in each place where the program runs.
        root = named if named.is_absolute() else Path.home() / ".cache"
        return root if root.is_absolute() else None
    return None


def cache_folder() -> Path | None:
    """The folder of programs; None if there is none."""
    root = cache_root()
    return None if root is None else root.joinpath(*PLACE)


def unsafe_cache() -> str:
    """Why programs are neither kept nor read, where others could have written them; else nothing."""
    with contextlib.suppress(OSError):
        try:
            if root := cache_root():
                with own_folder(root, *PLACE):
                    pass
        except NotOwnError as error:
            return str(error)
    return ""


@cache
def _made_of() -> str:
    """A digest of all that programs are made of, and of the processor that they are made for."""
    rooms = Path(__file__).parents[1]
    sources = [path.read_bytes() for room in _SOURCES for path in sorted((rooms / room).rglob("*.py"))]
    versions = [*map(version, ("jax", "jaxlib", "numpy")), platform.machine(), _processor()]
    switches = [os.environ.get(name, "") for name in ("XLA_FLAGS", "LIBTPU_INIT_ARGS")]
    return hashlib.sha256(b"\0".join([*sources, repr((versions, switches)).encode()])).hexdigest()


def _processor() -> str:
    """The features of the processor, if the system tells."""
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        return "".join(sorted({line for line in file if line.startswith(("model name", "flags", "Features"))}))
    return platform.processor()


def _read(name: str) -> Compiled | None:
    """The program in a file; None where there is none that can be used, for whatever reason: it is made anew then."""
    root = cache_root()
    try:
        if root is None:
            return None
        with own_folder(root, *PLACE) as folder:
            data = read_own(folder, name)
            # A folder that is read only keeps its times.
            with contextlib.suppress(OSError):
                os.utime(name, dir_fd=folder, follow_symlinks=False)
        payload, taken, given = pickle.loads(zlib.decompress(data))
        device = jax.devices()[0]
        return serialize_executable.deserialize_and_load(payload, taken, given, device.client, [device])
    except Exception:
        return None


def _write(name: str, program: Any) -> None:
    """Keep a program, where it can be kept: nothing depends on it but the time of the next first call."""
    root = cache_root()
    with contextlib.suppress(Exception):
        if root is None:
            return
        data = zlib.compress(pickle.dumps(serialize_executable.serialize(program)), 1)
        try:
            with own_folder(root, *PLACE, make=True) as folder:
                write_own(folder, name, data, root.joinpath(*PLACE))
                _trim(folder)
        except NotOwnError as error:
            _warn(str(error))


def _trim(folder: int) -> None:
    """Remove the programs that were not used for longest, and what is left of writers that were killed."""
    files = own_files(folder)
    kept = sorted((name for name in files if KEPT.fullmatch(name)), key=lambda name: files[name].st_mtime)
    left = [name for name in files if _PART.fullmatch(name) and time.time() - files[name].st_mtime > _LEFT_BEHIND]
    for name in (*kept[:-_MOST_KEPT], *left):
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name, dir_fd=folder)


@cache
def _warn(reason: str) -> None:
    """Say once, and not again in each worker, why every start takes longer than it need."""
    if multiprocessing.parent_process() is None:
        text = f"Compiled programs are not kept, as {reason}: see `kerrcaustics doctor`."
        warnings.warn(text, RuntimeWarning, stacklevel=2)
