"""Files that are never half-written, and files that a user names: no devices, no pipes, nothing endless."""

import errno
import fcntl
import glob
import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path
from typing import IO, Any

# Open temporary files of `writing`.
UNFINISHED: set[str] = set()
_PART = ".part"
# Endings of formats that a saved result, a NumPy file, would be taken for.
OTHER_FORMATS = (".csv", ".fits", ".json", ".nc", ".pdf", ".png")


@contextmanager
def reading(path: str | os.PathLike[str], most: int) -> Iterator[BufferedReader]:
    """A regular file of at most `most` bytes, opened to be read; an OSError with the reason for any other file."""
    # A pipe that nobody writes to would be waited for.
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is no regular file", os.fspath(path))
        if status.st_size > most:
            raise OSError(errno.EFBIG, f"it is larger than {most / 1e6:g} MB", os.fspath(path))
        yield file


def read_text(path: str | os.PathLike[str], most: int) -> str:
    """The text, in UTF-8 with or without a byte-order mark, of a regular file of at most `most` bytes."""
    with reading(path, most) as file:
        # No more than allowed, even if the file grows meanwhile.
        return file.read(most).decode("utf-8-sig")


@contextmanager
def writing(path: str | os.PathLike[str], lasting: bool = False, private: bool = False) -> Iterator[IO[bytes]]:
    """A binary file that takes its name only when it is complete: `with writing(path) as file`.

    Through a link the file it points to is replaced; a device or a pipe is written to directly. lasting: it is on the
    disk before it takes its name, and no power cut can lose it. private: nobody else can read it (mode 0600).
    """
    path = Path(path)
    if os.path.exists(path) and not os.path.isfile(path):
        with _named(path), open(path, "wb") as file:
            yield file
        return
    path = Path(os.path.realpath(path))
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=_PART)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    UNFINISHED.add(name)
    try:
        with _named(path), os.fdopen(handle, "wb") as file:
            yield file
            if lasting:
                file.flush()
                os.fsync(file.fileno())
        # A temporary file is private; the finished one gets the permissions an ordinary file would have.
        if not private:
            mask = os.umask(0)
            os.umask(mask)
            os.chmod(name, 0o666 & ~mask)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
    finally:
        UNFINISHED.discard(name)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Give errors of the disk the name of the file."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            raise OSError(error.errno, error.strerror, str(path)) from None
        raise


def check_name(path: Any) -> None:
    """Raise ValueError unless the argument `path` is the name of a file."""
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise ValueError(f"Argument `path` must be the name of a file, but is {' '.join(f'{path!r:.80}'.split())}.")


def check_path(path: Any) -> None:
    """Raise ValueError unless the argument `path` names a file that can be written."""
    check_name(path)
    place = Path(path)
    if os.path.isdir(place):
        raise ValueError(f"Argument `path` must name a file, but {str(place)!r} is a folder.")
    if not os.path.isdir(place.parent):
        raise ValueError(f"Argument `path` must lie in a folder that exists, but {str(place.parent)!r} is none.")
    if not os.path.exists(place) and not os.access(place.parent, os.W_OK):
        raise ValueError(f"Argument `path` must name a file that can be written, but {str(place.parent)!r} cannot.")
    try:
        # Its temporary name is the longest one.
        os.lstat(place.with_name(f".{place.name}.{'x' * 8}{_PART}"))
    except FileNotFoundError:
        pass
    except OSError as error:
        raise ValueError(f"Argument `path` must name a file that can be written: {place}: {error.strerror}.") from None


def remove_unfinished() -> None:
    """Remove the temporary files of this process, before it ends at once."""
    for name in list(UNFINISHED):
        Path(name).unlink(missing_ok=True)


def remove_abandoned(folder: Path, name: str) -> None:
    """Remove temporary files of a name in a folder that killed processes left behind."""
    for part in folder.glob(f".{glob.escape(name)}.*{_PART}"):
        part.unlink(missing_ok=True)


@contextmanager
def locked(folder: Path, refusal: str) -> Iterator[None]:
    """Hold the lock of a folder, or raise ValueError if another process holds it; the lock ends with the process."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(refusal) from None
        except OSError:
            # A file system without locks.
            pass
        yield
    finally:
        os.close(handle)


def content(path: Path) -> bytes | None:
    """The bytes of a file; None if there is none that can be read. A pipe, a device or a folder is none."""
    with suppress(OSError), reading(path, sys.maxsize) as file:
        return file.read()
    return None


def make_room(path: Path) -> None:
    """Make the folder of a file, and remove a link, a pipe or an empty folder in the place of the file.

    Raise OSError, with one clear text, for a folder that is not empty, and for a file in the place of a folder.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        mode = os.lstat(path).st_mode
    except FileNotFoundError:
        return
    except (FileExistsError, NotADirectoryError) as error:
        raise OSError(error.errno, f"a file is in the place of a folder of {path}") from None
    if not stat.S_ISDIR(mode):
        if not stat.S_ISREG(mode):
            path.unlink()
        return
    try:
        path.rmdir()
    except OSError as error:
        raise OSError(error.errno, f"a folder is in the place of the file {path}") from None
