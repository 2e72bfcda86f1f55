"""The frames of a film that is not complete: a folder with a PNG file for each, and one that says what they are of.

A frame takes its name only when it is on the disk, and says of which film it is and which of its frames. Its own
checksums tell whether it is whole: what is cut off, altered, lost or of another film is drawn anew. A frame depends on
its number alone, so that a store that was interrupted, wherever and however often, ends up with the same frames.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import metadata
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from kerrcaustics.files import locked, remove_abandoned, writing

Array = np.ndarray
Draw = Callable[[int], UInt8[Array, "height width 3"]]

_SAYS = "film.json"
_OF = "kerrcaustics"
# Differences that are told, and how much of each value.
_TOLD, _LONGEST = 3, 40
# What drew the last frame for `draw_frame_again`, by the mark of its film.
_LAST: dict[str, Draw] = {}


@dataclass(frozen=True)
class FrameStore:
    """Frames in a folder; mark: the hash of all that they depend on."""

    folder: Path
    mark: str

    def path(self, number: int) -> Path:
        """The file of a frame."""
        return self.folder / f"{number:06d}.png"

    def has(self, number: int) -> bool:
        """True where a frame is there, whole, and of this film."""
        try:
            with Image.open(BytesIO(self.path(number).read_bytes())) as image:
                of = image.info.get(_OF)
                # Of every part of the file.
                image.verify()
        except Exception:
            # Whatever is wrong with a frame, it is drawn again.
            return False
        return of == self._name(number)

    def read(self, number: int) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame that was there a moment ago."""
        if not self.has(number):
            raise RuntimeError(f"Frame {number} was lost while the film was written; start again to draw it anew.")
        with Image.open(self.path(number)) as image:
            return np.asarray(image)

    def write(self, number: int, picture: Array) -> None:
        """Keep the picture of a frame."""
        write_frame(self.path(number), picture, {_OF: self._name(number)})

    def fail(self, number: int, reason: str) -> None:
        """Keep why a frame could not be drawn."""
        with writing(self._note(number)) as file:
            file.write(reason.encode(errors="replace"))

    def failure(self, number: int) -> str | None:
        """Why a frame could not be drawn; None where it could."""
        if self._note(number).exists():
            return self._note(number).read_text(encoding="utf-8")
        return None if self.path(number).exists() else "it is not in the store (do the workers see the same files?)"

    def _name(self, number: int) -> str:
        return f"{self.mark} {number}"

    def _note(self, number: int) -> Path:
        return self.folder / f"{number:06d}.failed"


def film_mark(record: dict[str, Any]) -> str:
    """The hash of all that the frames of a film depend on."""
    return hashlib.sha256(_text(record).encode()).hexdigest()


def film_record(name: str, frames: int, settings: dict[str, Any]) -> dict[str, Any]:
    """All that the frames of a film depend on, as JSON holds it."""
    version = metadata.version("kerrcaustics")
    return json.loads(_text({"version": version, "name": name, "frames": frames, "settings": settings}))


def store_lock(folder: Path) -> AbstractContextManager[None]:
    """While no other process draws frames into a folder, which is made where there is none."""
    folder.mkdir(exist_ok=True)
    return locked(folder, f"The frames in {folder} are in use: another process is drawing them.")


def open_frames(folder: Path, record: dict[str, Any], restart: bool) -> FrameStore:
    """The store in a folder that is locked: gone on with where it is of this film, and refused where of another.

    restart: frames that are there are thrown away.
    """
    remove_abandoned(folder)
    for note in folder.glob("*.failed"):
        note.unlink()
    frames, says = list(folder.glob("*.png")), folder / _SAYS
    if restart:
        for frame in frames:
            frame.unlink()
    elif frames:
        _check_same(folder, record)
    with writing(says, lasting=True) as file:
        file.write(_text(record).encode())
    return FrameStore(folder, film_mark(record))


def draw_frame(folder: str, mark: str, draw: Draw, number: int) -> None:
    """Draw a frame and keep it, or why it could not be drawn: what a worker does."""
    store = FrameStore(Path(folder), mark)
    try:
        picture = draw(number)
    except Exception as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        # One frame never costs the others.
        store.fail(number, f"{type(error).__name__}: {' '.join(str(error).split())}")
        return
    store.write(number, picture)


def draw_frame_again(folder: str, mark: str, draw: Draw, number: int) -> None:
    """The same, where `draw` arrives anew with each frame: what it has found out for one film is kept for the next."""
    kept = _LAST.get(mark)
    if kept is None:
        _LAST.clear()
        _LAST[mark] = kept = draw
    draw_frame(folder, mark, kept, number)


def write_frame(path: Path, picture: Array, says: dict[str, str] | None = None) -> None:
    """Write one frame (height, width, 3) of a film, bytes, both lengths even, as a PNG file; says: texts within it."""
    picture, texts = _checked(picture), PngInfo()
    for key, text in (says or {}).items():
        texts.add_text(key, text)
    with writing(path, lasting=True) as file:
        Image.fromarray(picture).save(file, format="PNG", compress_level=1, pnginfo=texts)


def _checked(picture: Array) -> UInt8[Array, "height width 3"]:
    picture = np.asarray(picture)
    shaped = picture.ndim == 3 and picture.shape[2] == 3 and picture.dtype == np.uint8
    if not shaped or picture.shape[0] % 2 or picture.shape[1] % 2:
        raise ValueError(
            "A frame of a film must be an array (height, width, 3) of bytes with even height and width, "
            f"but has shape {picture.shape} and type {picture.dtype}."
        )
    return picture


def _text(record: dict[str, Any]) -> str:
    return json.dumps(record, sort_keys=True, default=str, indent=1)


def _check_same(folder: Path, record: dict[str, Any]) -> None:
    """Refuse frames of another film."""
    try:
        there = json.loads((folder / _SAYS).read_text(encoding="utf-8"))
        told = _differences(dict(_leaves(record)), dict(_leaves(there)))
    except (OSError, ValueError):
        told = f"its {_SAYS} cannot be read"
    if told:
        raise ValueError(
            f"The frames in {folder} are of another film ({told}). Restart (--restart) to throw them away, or name "
            "another output to keep them."
        )


def _differences(here: dict[str, Any], there: dict[str, Any]) -> str:
    """What differs, in words; nothing where all is the same."""
    keys = [key for key in {**here, **there} if here.get(key, "nothing") != there.get(key, "nothing")]
    told = [f"{key}: {_short(here.get(key))} here, {_short(there.get(key))} there" for key in keys[:_TOLD]]
    more = [f"{len(keys) - _TOLD} more"] if len(keys) > _TOLD else []
    return "; ".join(told + more)


def _short(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """The values in a record, by their places: "scene.camera[2].radius"."""
    if isinstance(value, dict) and value:
        for key, part in value.items():
            yield from _leaves(part, key if name in ("", "settings") else f"{name}.{key}")
    elif isinstance(value, list) and value:
        for place, part in enumerate(value):
            yield from _leaves(part, f"{name}[{place}]")
    else:
        yield name, value
