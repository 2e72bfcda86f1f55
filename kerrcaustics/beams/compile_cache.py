"""Compiled programs, kept in the user's cache folder: a second process neither traces nor compiles them.

They are kept here and not by JAX, whose cache is a setting of the whole process and saves the compilation alone. A file
is valid as long as the sources, JAX, the processor and the compiler's options stay the same.

The author of such a file controls the program. Only files of the user or of root are read, in folders to which nobody
else can write (`own_folder.py`).
"""

import contextlib
import ctypes
import fcntl
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
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import Future
from functools import cache, partial, wraps
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import jax
from jax.experimental import serialize_executable
from jax.experimental.xla_metadata import set_xla_metadata

from kerrcaustics.own_folder import NotOwnError, own_files, own_folder, read_own, write_own

# The largest number of files, and of programs in memory, where each takes some 80 MB: the least recently used go first.
MOST_KEPT, MOST_LOADED = 256, 16
# Names of complete files; files that are not complete after some time, in seconds, were left behind.
KEPT = re.compile(r"[\w.<>]+-[0-9a-f]{32}")
_PART, _LEFT_BEHIND = re.compile(rf"\.{KEPT.pattern}\.[0-9a-f]{{16}}\.part"), 3600.0
# Seconds for which a process waits for another that makes a program, before it makes it too.
PATIENCE = 60.0
# The folder of programs in that of all caches.
PLACE = ("kerrcaustics", "programs")
# The sources of programs: the rooms whose functions are compiled.
SOURCES = ("beams", "spacetime")

# For the compiler, by platform. On a CPU, fused loops would repeat the work that they share: one loop for each
# operation, over arrays that stay in the cache, takes a third of the time, and compiles faster. In JAX 0.12 loops that
# count as small would become one function each, and compile for minutes. The steps of the integrator share little:
# fused, they take three quarters of the time, and one and a half times that of compilation.
_LOOPS = "small-while-loop-hoisting"
OPTIONS = {"cpu": {"xla_disable_hlo_passes": f"fusion,{_LOOPS}"}}
_FUSED_OPTIONS = {"cpu": {"xla_disable_hlo_passes": _LOOPS}}

Compiled = Callable[..., Any]
# Type checkers know `jax.Device` as a variable alone.
Device: TypeAlias = Any
Function = TypeVar("Function", bound=Callable[..., Any])

# The setting that says for which device a program is made.
_FOR = "jax_default_device"

loaded_programs: dict[Hashable, "Future[Compiled]"] = {}
_lock = threading.Lock()
_compiling: list[str] = []


def compiling() -> tuple[str, ...]:
    """Names of the functions whose programs are being compiled, in any thread."""
    return tuple(_compiling)


class Program:
    """A function of trees of arrays, compiled once for each shape of its arguments and each value of the static ones.

    Safe to call from several threads, under the settings of `own_settings`. Loops are fused where that is faster.
    """

    def __init__(self, function: Callable[..., Any], *, fused: bool = False) -> None:
        self._function, self._fused = function, fused

    def __call__(self, *arguments: Any, on: Device | None = None, **static: Hashable) -> Any:
        """The value of the function. Arguments are trees of numbers and arrays; static ones are part of the program.

        on: the device, by default that of small jobs.
        """
        return self.compiled(*arguments, on=on, **static)(*arguments)

    def compiled(self, *arguments: Any, on: Device | None = None, **static: Hashable) -> Compiled:
        """The program for arguments of this shape: from this process, from a file, or made and put into one."""
        leaves, tree = jax.tree.flatten(arguments)
        types = [(getattr(leaf, "shape", ()), getattr(leaf, "dtype", type(leaf))) for leaf in leaves]
        device = on or small_job_device()
        key = (self, device, tree, tuple(static.items()), *types)
        with _lock:
            is_new = key not in loaded_programs
            # The most recently used program stands last.
            program = loaded_programs[key] = loaded_programs.pop(key, None) or Future()
            if len(loaded_programs) > MOST_LOADED:
                del loaded_programs[next(iter(loaded_programs))]
        if is_new:
            try:
                shapes = [(shape, str(dtype)) for shape, dtype in types]
                program.set_result(self._kept(device, arguments, static, shapes))
            except BaseException as error:
                with _lock:
                    loaded_programs.pop(key, None)
                program.set_exception(error)
        return program.result()

    def _kept(
        self, device: Device, arguments: tuple[Any, ...], static: dict[str, Hashable], shapes: list[Any]
    ) -> Compiled:
        options = (_FUSED_OPTIONS if self._fused else OPTIONS).get(device.platform)
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        request = (jax.tree.structure(arguments), shapes, sorted(static.items()), options)
        made_for = device.platform, device.device_kind, device.client.platform_version
        about = repr((_source_digest(), *made_for, name, request))
        file = f"{name}-{hashlib.sha256(about.encode()).hexdigest()[:32]}"
        program = _read(file, device)
        if program is None:
            _compiling.append(name)
            try:
                with _alone(file) as waited:
                    program = _read(file, device) if waited else None
                    if program is None:
                        function = jax.jit(partial(self._function, **static), compiler_options=options)
                        with jax.default_device(device):
                            program = function.lower(*arguments).compile()
                        _write(file, program)
            finally:
                _compiling.remove(name)
        give_back_memory()
        return program


@cache
def small_job_device() -> Device:
    """The device of jobs with few rays: a CPU, unless JAX has none, which is faster there than an accelerator."""
    try:
        return jax.devices("cpu")[0]
    except RuntimeError:
        return jax.devices()[0]


def apart(function: Function, *static: str) -> Function:
    """A function of trees of arrays, as a part of its own of the programs that call it; static: names of arguments.

    On a CPU, XLA compares all pairs of steps of a part when it loads a program. One of some parts therefore loads, and
    compiles, faster than one of a single part.
    """
    part = jax.jit(function, static_argnames=static)

    @wraps(function)
    def called(*arguments: Any, **options: Any) -> Any:
        if (getattr(jax.config, _FOR) or jax.devices()[0]).platform != "cpu":
            return function(*arguments, **options)
        (first, *rest), tree = jax.tree.flatten(part(*arguments, **options))
        # That is kept with the call, whichever of its values is named.
        return jax.tree.unflatten(tree, [set_xla_metadata(first, inlineable="false"), *rest])

    return called  # pyright: ignore[reportReturnType]


def give_back_memory() -> None:
    """Return freed memory to the system, as the C library might keep it: compiling and loading take some 100 MB."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def cache_root() -> Path | None:
    """The folder of all caches of the user; None if there is none, as for a user without a home."""
    with contextlib.suppress(RuntimeError):
        named = Path(os.environ.get("XDG_CACHE_HOME", ""))
        # A relative path would name another folder in each working folder.
        root = named if named.is_absolute() else Path.home() / ".cache"
        return root if root.is_absolute() else None
    return None


def cache_folder() -> Path | None:
    """The folder of programs; None if there is none."""
    root = cache_root()
    return None if root is None else root.joinpath(*PLACE)


def unsafe_cache() -> str:
    """The reason why programs are neither kept nor read, if others could have written them; else an empty text."""
    with contextlib.suppress(OSError):
        try:
            if root := cache_root():
                with own_folder(root, *PLACE):
                    pass
        except NotOwnError as error:
            return str(error)
    return ""


@cache
def _source_digest() -> str:
    """A digest of the sources and versions of programs, and of the processor that they are made for."""
    rooms = Path(__file__).parents[1]
    sources = [path.read_bytes() for room in SOURCES for path in sorted((rooms / room).rglob("*.py"))]
    versions = [*map(version, ("jax", "jaxlib", "numpy")), platform.machine(), _processor()]
    switches = [os.environ.get(name, "") for name in ("XLA_FLAGS", "LIBTPU_INIT_ARGS")]
    return hashlib.sha256(b"\0".join([*sources, repr((versions, switches)).encode()])).hexdigest()


def _processor() -> str:
    """The features of the processor, or its name if the system does not list them."""
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        return "".join(sorted({line for line in file if line.startswith(("model name", "flags", "Features"))}))
    return platform.processor()


def _read(name: str, device: Device) -> Compiled | None:
    """The program in a file; None if there is none that can be used, for any reason: it is made anew then."""
    root = cache_root()
    try:
        if root is None:
            return None
        with own_folder(root, *PLACE) as folder:
            data = read_own(folder, name)
            # In a read-only folder the times stay.
            with contextlib.suppress(OSError):
                os.utime(name, dir_fd=folder, follow_symlinks=False)
        payload, in_tree, out_tree = pickle.loads(zlib.decompress(data))
        return serialize_executable.deserialize_and_load(payload, in_tree, out_tree, device.client, [device])
    except Exception:
        return None


@contextlib.contextmanager
def _alone(name: str) -> Iterator[bool]:
    """While a program is made, let other processes wait for its file; True if this one has waited.

    The lock is a file that counts as the remains of a writer if its process is killed.
    """
    root, part, waited = cache_root(), f".{name}.{'0' * 16}.part", False
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError):
            if root is not None:
                folder = held.enter_context(own_folder(root, *PLACE, make=True))
                lock = os.open(part, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600, dir_fd=folder)
                held.callback(os.close, lock)
                waited = _locked_after_a_while(lock)
                held.callback(_remove, part, folder)
        yield waited


def _locked_after_a_while(lock: int) -> bool:
    """Lock an open file, within PATIENCE; True if another process held it."""
    begin, waited = time.monotonic(), False
    while time.monotonic() < begin + PATIENCE:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return waited
        except BlockingIOError:
            waited = True
            time.sleep(0.05)
    return waited


def _remove(name: str, folder: int) -> None:
    with contextlib.suppress(OSError):
        os.unlink(name, dir_fd=folder)


def _write(name: str, program: Any) -> None:
    """Keep a program if possible: only the time of the next first call depends on it."""
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
    """Remove the least recently used programs, and the remains of writers that were killed."""
    files = own_files(folder)
    complete = sorted((name for name in files if KEPT.fullmatch(name)), key=lambda name: files[name].st_mtime)
    remains = [name for name in files if _PART.fullmatch(name) and time.time() - files[name].st_mtime > _LEFT_BEHIND]
    for name in (*complete[:-MOST_KEPT], *remains):
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name, dir_fd=folder)


@cache
def _warn(reason: str) -> None:
    """Warn once, and not in each worker, that every start takes longer than it need."""
    if multiprocessing.parent_process() is None:
        text = f"Compiled programs are not kept, as {reason}: see `kerrcaustics doctor`."
        warnings.warn(text, RuntimeWarning, stacklevel=2)
