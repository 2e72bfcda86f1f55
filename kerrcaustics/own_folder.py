"""Folders of the user's own, whose files nobody else can have written: owners and modes are checked as ssh does."""

import grp
import os
import pwd
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from kerrcaustics.files import UNFINISHED

_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
# Without O_NONBLOCK a pipe without a writer would block.
_READ = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


class NotOwnError(PermissionError):
    """The error for a folder or file that somebody else can have written."""


@contextmanager
def own_folder(root: Path, *names: str, make: bool = False) -> Iterator[int]:
    """A descriptor of the folder `root/names[0]/names[1]/...`, for `read_own`, `write_own` and `own_files`.

    The root and all below it must belong to the user or to root, and nobody else may write to them; others may write
    to the root where it is sticky, as /tmp is. The root may be a link, as the user named it; what lies in it may not.

    Parameters
    ----------
    root : Path
    names : str
    make : bool
        Make the folders that are missing, with mode 0700.

    Raises
    ------
    NotOwnError
        If somebody else can have written there.
    OSError
        If the folder cannot be opened.
    """
    if make:
        _make_root(root)
    handle = os.open(root, _FOLDER)
    try:
        _check(handle, root, sticky=True)
        for name in names:
            root /= name
            if make:
                with suppress(FileExistsError):
                    os.mkdir(name, 0o700, dir_fd=handle)
            inner = _opened_inner(handle, name, root)
            os.close(handle)
            handle = inner
            _check(handle, root)
        yield handle
    finally:
        os.close(handle)


def read_own(folder: int, name: str) -> bytes:
    """Return the content of a file of an own folder; NotOwnError if somebody else can have written it."""
    handle = os.open(name, _READ, dir_fd=folder)
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise NotOwnError(f"{name} is no file")
        _check(handle, Path(name))
        with open(handle, "rb", closefd=False) as file:
            return file.read()
    finally:
        os.close(handle)


def write_own(folder: int, name: str, data: bytes, shown: Path) -> None:
    """Write a file of an own folder, with mode 0600; it takes its name when it is complete, and is no link then.

    shown: the path of the folder, under which an interrupted program removes what is not complete.
    """
    part = f".{name}.{secrets.token_hex(8)}.part"
    handle = os.open(part, _NEW, 0o600, dir_fd=folder)
    UNFINISHED.add(str(shown / part))
    try:
        with open(handle, "wb") as file:
            file.write(data)
        os.replace(part, name, src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        os.unlink(part, dir_fd=folder)
        raise
    finally:
        UNFINISHED.discard(str(shown / part))


def own_files(folder: int) -> dict[str, os.stat_result]:
    """Return the regular files in a folder that belong to the user, by name; links are none."""
    files = {}
    for name in os.listdir(folder):
        with suppress(FileNotFoundError):
            status = os.stat(name, dir_fd=folder, follow_symlinks=False)
            if stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid():
                files[name] = status
    return files


def _make_root(root: Path) -> None:
    """Make a folder and those handle it that are missing; not in the home of another user, as root could."""
    existing = next(place for place in (root, *root.parents) if place.exists())
    handle = os.open(existing, _FOLDER)
    try:
        _check(handle, existing, sticky=True)
    finally:
        os.close(handle)
    root.mkdir(mode=0o700, parents=True, exist_ok=True)


def _opened_inner(folder: int, name: str, shown: Path) -> int:
    try:
        return os.open(name, _FOLDER | os.O_NOFOLLOW, dir_fd=folder)
    except OSError:
        if shown.is_symlink():
            raise NotOwnError(f"{shown} is a link") from None
        raise


def _check(handle: int, shown: Path, sticky: bool = False) -> None:
    """Raise NotOwnError if somebody else can have written to an open file or folder."""
    status = os.fstat(handle)
    if status.st_uid not in (os.geteuid(), 0):
        raise NotOwnError(f"{shown} belongs to another user")
    mode = status.st_mode
    writable_by_others = mode & stat.S_IWOTH or (mode & stat.S_IWGRP and not _is_private(status.st_gid))
    if writable_by_others and not (sticky and mode & stat.S_ISVTX):
        raise NotOwnError(f"others can write to {shown}")


def _is_private(group: int) -> bool:
    """Return True for the group that many systems give each user, with nobody else in it."""
    try:
        name, entry = pwd.getpwuid(os.geteuid()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return entry.gr_name == name and set(entry.gr_mem) <= {name}
