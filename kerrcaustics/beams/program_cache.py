"""JAX's own cache of compiled programs, in a folder of the user, so that a gradient is compiled once and for all."""

import hashlib
import os
import platform
import sys
import time
import zlib
from contextlib import suppress
from functools import cache
from pathlib import Path

import jax

from kerrcaustics.results.progress import in_notebook, notice

FOLDER_VARIABLE = "KERRCAUSTICS_CACHE"
"""The environment variable that names another folder for the cache, or none if it is empty."""

# Bytes of programs that are kept: the oldest go first.
_MOST_BYTES = 500e6
# Seconds after which no process is still writing a program.
_WRITTEN = 60.0
# The beginning of a file that can be checked.
_ZLIB = b"\x78"
# Settings of JAX.
_ENABLED = "jax_enable_compilation_cache"
_DIRECTORY = "jax_compilation_cache_dir"
_LOG_LEVEL = "jax_logging_level"


def cache_folder() -> Path | None:
    """The folder of compiled programs for this kind of processor; None if the user wants none.

    Machine code of one processor may not run on another, with which it shares the user's home.
    """
    named = os.environ.get(FOLDER_VARIABLE)
    if named == "":
        return None
    usual = Path.home() / "Library" / "Caches" if sys.platform == "darwin" else Path.home() / ".cache"
    caches = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or usual) / "kerrcaustics"
    return caches / "jax" / hashlib.sha256(instructions().encode()).hexdigest()[:16]


def instructions() -> str:
    """The instructions that the processor knows, as far as the system says."""
    with suppress(OSError), open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith(("flags", "Features")):
                return line
    return f"{platform.machine()} {platform.processor()}"


@cache
def keep_programs() -> Path | None:
    """The folder in which JAX keeps compiled programs from now on; None if it keeps none.

    To be called where a function is traced, which is before it is compiled. A setting of JAX for the whole process, as
    the caller's own `jax.jit` compiles what contains these functions. A folder that the caller has set is left alone.
    """
    if not getattr(jax.config, _ENABLED):
        return None
    if kept := getattr(jax.config, _DIRECTORY):
        return Path(kept)
    try:
        folder = cache_folder()
        if folder is None:
            return None
        folder.mkdir(parents=True, exist_ok=True)
        tidy(folder)
    except (OSError, RuntimeError):
        # No home, a full disk, or a folder that cannot be written: programs are compiled in each process.
        return None
    if not os.access(folder, os.W_OK | os.X_OK):
        return None
    jax.config.update(_DIRECTORY, str(folder))
    return folder


def tidy(folder: Path) -> None:
    """Remove programs that are not whole, as killed processes leave them, and the oldest if there are too many."""
    stamp, now = folder / "checked", time.time()
    since = stamp.stat().st_mtime if stamp.exists() else 0.0
    size = 0
    for file in sorted(folder.glob("*-cache"), key=_moment, reverse=True):
        with suppress(FileNotFoundError):
            status = file.stat()
            size += status.st_size
            unchecked = since <= status.st_mtime < now - _WRITTEN
            if size > _MOST_BYTES or (unchecked and not _whole(file.read_bytes())):
                file.unlink()
    stamp.touch()
    os.utime(stamp, (now - _WRITTEN, now - _WRITTEN))


def _moment(file: Path) -> float:
    """The time at which a file was written; 0 if another process has removed it."""
    with suppress(FileNotFoundError):
        return file.stat().st_mtime
    return 0.0


def _whole(program: bytes) -> bool:
    """True unless a compressed program ends before its end."""
    if not program.startswith(_ZLIB):
        return bool(program)
    try:
        zlib.decompress(program)
    except zlib.error:
        return False
    return True


@cache
def prepare_compilation() -> None:
    """Once in a process, `keep_programs`, and say that what follows takes long where none has been kept yet."""
    folder = keep_programs()
    if in_notebook():
        _silence_compiler()
    if folder is None or not any(folder.glob("*-cache")):
        notice(f"compiling, about a minute{', this once' if folder else ''}")


def _silence_compiler() -> None:
    """Turn off the log of XLA, which reports slow compilation in red, unless the user has set a level."""
    if getattr(jax.config, _LOG_LEVEL) in (None, "NOTSET"):
        # The second call changes JAX's own loggers back, and those alone.
        jax.config.update(_LOG_LEVEL, "CRITICAL")
        jax.config.update(_LOG_LEVEL, "NOTSET")
