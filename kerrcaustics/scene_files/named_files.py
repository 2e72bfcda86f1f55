"""Files that a scene names, with hashes of their contents."""

import hashlib
from pathlib import Path

from kerrcaustics.files import reading
from kerrcaustics.scene_files.contents import Contents
from kerrcaustics.scene_files.validation import SceneError

# Largest file, bytes: more than that of any accepted picture.
_LARGEST = 4_000_000_000


def named_files(contents: Contents, folder: Path) -> tuple[tuple[str, str], ...]:
    """Names of files, each with the SHA-256 of its bytes; ValueError for a file that cannot be read."""
    files = [("camera.path.file", getattr(contents.camera.path, "file", None))]
    files += [(f"sky.{key}", getattr(contents.sky, key, None)) for key in ("file", "tycho2")]
    files.append(("sky.nebulae.file", getattr(getattr(contents.sky, "nebulae", None), "file", None)))
    if contents.disk is not None:
        files.append(("disk.emission.file", getattr(contents.disk.emission, "file", None)))
    files.append(("light.response.file", getattr(contents.light.response, "file", None)))
    for law in ("density", "temperature", "colour"):
        files.append((f"volume.{law}.file", getattr(getattr(contents.volume, law, None), "file", None)))
    files += [(f"light.flare[{i}].file", halo.file) for i, halo in enumerate(contents.light.flare or ())]
    return tuple((name, _hash(entry, folder, name)) for entry, name in files if name is not None)


def _hash(entry: str, folder: Path, name: str) -> str:
    try:
        with reading(folder / name, _LARGEST) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no name of a file"
        raise SceneError(f"{entry} must name a file that can be read, but {name!r}: {reason}.") from None
