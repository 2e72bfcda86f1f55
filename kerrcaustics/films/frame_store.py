"""The frames of a film that is not complete: a folder with a PNG file for each, and a record of their film.

A frame takes its name only when it is on the disk, and says of which film it is, which of its frames, and the hash of
its pixels: what is cut off, altered, lost or of another film is drawn anew. A frame depends on its number alone, so
that a store that was interrupted, wherever and however often, ends up with the same frames.

The folder may be a link to another. Whatever happens, only files are removed whose names are those of a store.
"""

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from importlib import metadata
from io import BytesIO
from pathlib import Path
from time import perf_counter as clock
from typing import Any

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from kerrcaustics.files import content, locked, make_room, writing
from kerrcaustics.shapes import UInt8

Array = np.ndarray
Draw = Callable[[int], UInt8[Array, "height width 3"]]

_RECORD = "film.json"
_TEXT_KEY, _SECONDS_KEY = "kerrcaustics", "seconds"
# The names in a store: frames, why they failed, and what was being written when a process was killed.
_FRAME, _NOTE = re.compile(r"\d{6,}\.png"), re.compile(r"\d{6,}\.failed")
_HALF = re.compile(rf"\.({_FRAME.pattern}|{_NOTE.pattern}|{re.escape(_RECORD)})\..+\.part")
# Differences that are named, and characters of each value.
_MOST_NAMED, _LONGEST = 3, 40
# What drew the last frame for `draw_frame_again`, by the mark of its film.
_LAST: dict[str, Draw] = {}
# The marks of films of which this process has drawn a frame.
WARM: set[str] = set()


@dataclass(frozen=True)
class FrameStore:
    """Frames in a folder; mark: the hash of all that they depend on."""

    folder: Path
    mark: str

    def path(self, number: int) -> Path:
        """The file of a frame."""
        return self.folder / f"{number:06d}.png"

    def has(self, number: int) -> bool:
        """True if a frame is there, whole, and of this film."""
        return self._picture(number) is not None

    def read(self, number: int) -> UInt8[Array, "height width 3"]:
        """The picture (height, width, 3) of a frame that was there a moment ago."""
        picture = self._picture(number)
        if picture is None:
            raise RuntimeError(f"Frame {number} was lost while the film was written; start again to draw it anew.")
        return picture

    def write(self, number: int, picture: Array, seconds: float | None = None) -> None:
        """Keep the picture of a frame, and how long it took."""
        texts = {_TEXT_KEY: f"{self._name(number)} {_pixel_hash(picture)}"}
        write_frame(self.path(number), picture, texts if seconds is None else {**texts, _SECONDS_KEY: f"{seconds:.3f}"})

    def seconds(self, number: int) -> float | None:
        """Time of a frame that was drawn just now; None for the first of a process, and for one that failed."""
        with suppress(Exception), Image.open(self.path(number), formats=["PNG"]) as image:
            return float(image.info[_SECONDS_KEY])
        return None

    def make_room(self, numbers: list[int]) -> None:
        """Remove what is in the places of frames and is no file; raise OSError for a folder with something in it."""
        for number in numbers:
            make_room(self.path(number))

    def fail(self, number: int, reason: str) -> None:
        """Store the reason why a frame could not be drawn."""
        make_room(self._note(number))
        with writing(self._note(number)) as file:
            file.write(reason.encode(errors="replace"))

    def failure(self, number: int) -> str | None:
        """The reason why a frame could not be drawn; None if it could."""
        note = content(self._note(number))
        if note is not None:
            return note.decode(errors="replace")
        return None if self.path(number).exists() else "it is not in the store (do the workers see the same files?)"

    def _picture(self, number: int) -> Array | None:
        """The picture of a frame; None where it is lost, not whole, or of another film."""
        try:
            file = content(self.path(number)) or b""
            with Image.open(BytesIO(file), formats=["PNG"]) as image:
                name, _, pixels = image.info[_TEXT_KEY].rpartition(" ")
                # Of every part of the file.
                image.verify()
            if name != self._name(number):
                return None
            # Every part may be right, and pixels be missing all the same.
            with Image.open(BytesIO(file), formats=["PNG"]) as image:
                picture = np.asarray(image)
        except Exception:
            # Whatever is wrong with a frame, it is drawn again.
            return None
        return picture if pixels == _pixel_hash(picture) else None

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
    try:
        folder.mkdir(exist_ok=True)
    except FileExistsError as error:
        raise OSError(error.errno, f"{folder} is there, and is neither a folder nor a link to one") from None
    return locked(folder, f"The frames in {folder} are in use: another process is drawing them.")


def open_frames(folder: Path, record: dict[str, Any], restart: bool) -> FrameStore:
    """Open the store in a locked folder; raise ValueError if its frames are of another film.

    restart: frames that are there are thrown away.
    """
    store, record_file = FrameStore(folder, film_mark(record)), folder / _RECORD
    if restart:
        _check_ours(folder)
    _remove(folder, _HALF, _NOTE, *[_FRAME] * restart)
    frames = frames_in(folder)
    if frames:
        _check_same(store, record, frames)
    make_room(record_file)
    with writing(record_file, lasting=True) as file:
        file.write(_text(record).encode())
    return store


def frames_in(folder: Path) -> list[int]:
    """The numbers of the frames in a folder, whole or not; none where there is no folder."""
    return sorted(int(file.stem) for file in _named(folder, _FRAME) if not file.is_dir())


def discard(folder: Path) -> None:
    """Remove a store. A folder that is a link stays, and so does one with other files in it."""
    with suppress(OSError):
        _remove(folder, _HALF, _NOTE, _FRAME, re.compile(re.escape(_RECORD)))
        if not folder.is_symlink():
            folder.rmdir()


def _named(folder: Path, *names: re.Pattern[str]) -> list[Path]:
    """Return the entries of a folder that have names of a store."""
    inside = folder.iterdir() if folder.is_dir() else ()
    return [file for file in inside if any(name.fullmatch(file.name) for name in names)]


def _remove(folder: Path, *names: re.Pattern[str]) -> None:
    """Remove what has such names, but for folders with something in them."""
    for file in _named(folder, *names):
        if file.is_dir():
            with suppress(OSError):
                file.rmdir()
        else:
            file.unlink(missing_ok=True)


def draw_frame(folder: str, mark: str, draw: Draw, number: int) -> None:
    """Draw a frame and store it, or the reason why it could not be drawn: the job of a worker."""
    store, began = FrameStore(Path(folder), mark), clock()
    try:
        picture = draw(number)
    except Exception as error:
        if os.environ.get("KERRCAUSTICS_TRACEBACK"):
            raise
        # One frame never costs the others.
        store.fail(number, f"{type(error).__name__}: {' '.join(str(error).split())}")
        return
    # The first one loads too, and is no guide to what others take.
    seconds = clock() - began if mark in WARM else None
    WARM.add(mark)
    store.write(number, picture, seconds)


def draw_frame_again(folder: str, mark: str, draw: Draw, number: int) -> None:
    """Draw a frame with the film's first `draw` and its caches, as `draw` arrives anew with each frame."""
    first_draw = _LAST.get(mark)
    if first_draw is None:
        _LAST.clear()
        _LAST[mark] = first_draw = draw
    draw_frame(folder, mark, first_draw, number)


def write_frame(path: Path, picture: Array, texts: dict[str, str] | None = None) -> None:
    """Write one frame (height, width, 3) of a film, bytes, both lengths even, as a PNG file with texts."""
    picture, info = _checked(picture), PngInfo()
    for key, text in (texts or {}).items():
        info.add_text(key, text)
    with writing(path, lasting=True) as file:
        Image.fromarray(picture).save(file, format="PNG", compress_level=1, pnginfo=info)


def _checked(picture: Array) -> UInt8[Array, "height width 3"]:
    picture = np.asarray(picture)
    shaped = picture.ndim == 3 and picture.shape[2] == 3 and picture.dtype == np.uint8
    if not shaped or picture.shape[0] % 2 or picture.shape[1] % 2:
        raise ValueError(
            "A frame of a film must be an array (height, width, 3) of bytes with even height and width, "
            f"but has shape {picture.shape} and type {picture.dtype}."
        )
    return picture


def _pixel_hash(picture: Array) -> str:
    picture = np.asarray(picture)
    return hashlib.sha256(f"{picture.shape} {picture.dtype} ".encode() + picture.tobytes()).hexdigest()


def _text(record: dict[str, Any]) -> str:
    return json.dumps(record, sort_keys=True, default=str, indent=1)


def _check_ours(folder: Path) -> None:
    """Raise ValueError if numbered pictures would be thrown away in a folder that does not name a film."""
    if frames_in(folder) and content(folder / _RECORD) is None:
        raise ValueError(
            f"The pictures in {folder} may be no frames of a film, as there is no {_RECORD}, and are not thrown away. "
            "Remove them, or name another output."
        )


def _check_same(store: FrameStore, record: dict[str, Any], frames: list[int]) -> None:
    """Raise ValueError for frames of another film, by the folder's record and by each frame."""
    try:
        kept_record = json.loads(content(store.folder / _RECORD) or b"")
        reason = _differences(dict(_leaves(record)), dict(_leaves(kept_record)))
    except (ValueError, RecursionError):
        reason = f"its {_RECORD} cannot be read"
    if reason and not any(map(store.has, frames)):
        raise ValueError(
            f"The frames in {store.folder} are of another film ({reason}). Restart (--restart) to throw them away, or "
            "name another output to keep them."
        )


def _differences(new: dict[str, Any], kept: dict[str, Any]) -> str:
    """Describe the differences of two records; empty if they are equal."""
    keys = [key for key in {**new, **kept} if new.get(key, "nothing") != kept.get(key, "nothing")]
    parts = [f"{key}: {_short(new.get(key))} here, {_short(kept.get(key))} there" for key in keys[:_MOST_NAMED]]
    more = [f"{len(keys) - _MOST_NAMED} more"] if len(keys) > _MOST_NAMED else []
    return "; ".join(parts + more)


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
