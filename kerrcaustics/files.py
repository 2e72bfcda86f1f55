"""Files that are never half-written."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

# Temporary files of `writing` that are open now: who ends the process at once must remove them.
UNFINISHED: set[str] = set()


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[IO[bytes]]:
    """A binary file that takes its name only when it is complete: `with writing(path) as file`.

    Through a link the file it points to is replaced; a device or a pipe is written to directly.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        with open(path, "wb") as file:
            yield file
        return
    path = Path(os.path.realpath(path))
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    UNFINISHED.add(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        # A temporary file is private; the finished one gets the permissions an ordinary file would have.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
    finally:
        UNFINISHED.discard(name)
