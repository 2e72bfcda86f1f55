"""Linear light in picture files, by rows: PNG and JPEG, whose values count as sRGB, and OpenEXR, which is linear.

The size comes from the header, before any pixel is decoded. Files that cannot be read raise ValueError.
"""

import errno
import math
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.files import reading
from kerrcaustics.scenes.colour import decoded
from kerrcaustics.scenes.exr_files import EXR, exr_channels, exr_rows
from kerrcaustics.scenes.scene_checks import check_light_of_file, not_light
from kerrcaustics.shapes import Float32
from kerrcaustics.spacetime.checks import quoted

Array = np.ndarray

ENDINGS = (".png", ".jpg", ".jpeg", EXR)
# Largest file, bytes.
_LARGEST = 4_000_000_000
# Largest number of pixels of a picture: twice that at which Pillow warns.
_MOST_PIXELS = 178_956_970
_TOO_MANY = "it has too many pixels"
# Pixels that are decoded together.
_BLOCK = 1 << 20
# Offset (bytes) of the bits per channel in a PNG file.
_DEPTH = 24
# EXIF tag of the turn of the camera.
_ORIENTATION = 0x0112
# Values of that tag for which height and width change places.
_LYING = (5, 6, 7, 8)


class LightRows(NamedTuple):
    """Some rows of a picture."""

    first: int
    """Number of the first row."""
    light: Float32[Array, "n w channels"]
    """Linear light, multiplied by alpha; one channel if the file is grey."""
    alpha: Float32[Array, "n w"] | None
    """The part that is opaque; None if the file has no alpha."""


def size_of(path: str | os.PathLike[str]) -> tuple[int, int]:
    """Rows and columns of a picture, from its header."""
    with _readable(path) as name:
        if _is_exr(name):
            size = exr_channels(name).size
        else:
            with _opened(name) as file:
                size = file.size if _orientation(file) in _LYING else file.size[::-1]
        if math.prod(size) > _MOST_PIXELS:
            raise OSError(errno.EFBIG, _TOO_MANY)
        return size


def has_bytes(path: str | os.PathLike[str]) -> bool:
    """True for PNG and JPEG files of at most 8 bits a channel."""
    with _readable(path) as name:
        if _is_exr(name):
            return False
        with _opened(name) as file:
            return file.mode != "I;16"


def rows_of(path: str | os.PathLike[str]) -> Iterator[LightRows]:
    """The rows of a picture from above, in blocks."""
    rows, columns = size_of(path)
    count = max(_BLOCK // columns, 1)
    with _readable(path) as name:
        if _is_exr(name):
            channels = exr_channels(name)
            for first in range(0, rows, count):
                yield LightRows(first, *exr_rows(channels, first, min(first + count, rows)))
            return
        with _opened(name) as file:
            whole = _upright(file)
            for first in range(0, rows, count):
                part = whole.crop((0, first, columns, min(first + count, rows)))
                yield LightRows(first, *_light_and_alpha(part))


def read_picture(path: str | os.PathLike[str]) -> Float32[Array, "h w 3"]:
    """Linear light (h, w, 3) of a PNG, JPEG or OpenEXR file; transparent parts are dark."""
    return read_picture_with_alpha(path)[0]


def read_picture_with_alpha(
    path: str | os.PathLike[str],
) -> tuple[Float32[Array, "h w 3"], Float32[Array, "h w"] | None]:
    """Linear light (h, w, 3), multiplied by alpha, and the alpha (h, w) of a file, if it has any."""
    light, alpha, bad = np.empty((*size_of(path), 3), np.float32), None, 0
    for part in rows_of(path):
        place = slice(part.first, part.first + len(part.light))
        light[place] = part.light
        bad += not_light(part.light)
        if part.alpha is not None:
            alpha = np.empty(light.shape[:2], np.float32) if alpha is None else alpha
            alpha[place] = part.alpha
    check_light_of_file(path, bad)
    return light, alpha


@contextmanager
def _readable(path: str | os.PathLike[str]) -> Iterator[Path]:
    """The path of a file that is no device and not too large; errors in the block become one ValueError."""
    name = Path(path)
    if not name.name.lower().endswith(ENDINGS):
        raise ValueError(
            f"Argument `path` must end in {', '.join(ENDINGS)}, but is {quoted(os.fspath(path))}: other pictures can "
            "be converted, TIFF files to OpenEXR, which keeps their depth."
        )
    try:
        with reading(name, _LARGEST):
            yield name
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        reason = getattr(error, "strerror", None) or getattr(error, "reason", None) or "it is no such picture"
        raise ValueError(
            f"Argument `path` must name a picture that can be read: {os.fspath(path)!r}: {reason}."
        ) from None


def _is_exr(path: Path) -> bool:
    return path.suffix.lower() == EXR


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A PNG or JPEG file, whose pixels are not decoded yet."""
    from PIL import Image

    with warnings.catch_warnings():
        # Pillow warns of pictures that are large for it, and are not for a sky.
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            with Image.open(path) as file:
                if file.format == "PNG" and file.mode != "I;16":
                    _refuse_deep(path)
                yield file
        except Image.DecompressionBombError:
            raise OSError(errno.EFBIG, _TOO_MANY) from None


def _refuse_deep(path: Path) -> None:
    """Raise OSError for a PNG file of 16 bits a channel, of which Pillow keeps the higher 8."""
    with open(path, "rb") as file:
        if file.read(_DEPTH + 1)[-1] == 16:
            reason = "it has 16 bits a channel, which are read of grey pictures without alpha alone; OpenEXR keeps them"
            raise OSError(errno.EINVAL, reason)


def _upright(file: Any) -> Any:
    """The picture, turned upright by its EXIF tag."""
    from PIL import ImageOps

    return file if _orientation(file) == 1 else ImageOps.exif_transpose(file)


def _orientation(file: Any) -> int:
    """The turn of the camera in the EXIF tags before the pixels, which stay undecoded; 1 if there is none."""
    from PIL import Image

    tags = Image.Exif()
    # Unreadable tags are ignored.
    with suppress(Exception):
        tags.load(file.info.get("exif", b""))
    turn = tags.get(_ORIENTATION, 1)
    return turn if turn in range(1, 9) else 1


def _light_and_alpha(part: Any) -> tuple[Float32[Array, "n w channels"], Float32[Array, "n w"] | None]:
    """Linear light and alpha of some rows in Pillow's form."""
    if part.mode == "I;16":
        return decoded(np.asarray(part, np.float32)[..., None] / np.float32(65535)).astype(np.float32), None
    grey, clear = part.mode in ("1", "L", "LA"), "A" in part.getbands() or "transparency" in part.info
    mode = ("L" if grey else "RGB") + "A" * clear
    values = np.asarray(part.convert(mode)).reshape(part.height, part.width, -1)
    if not clear:
        return _OF_BYTES[values], None
    alpha = values[..., -1] / np.float32(255)
    return _OF_BYTES[values[..., :-1]] * alpha[..., None], alpha


# The light of every value of 8 bits.
_OF_BYTES = decoded(np.arange(256, dtype=np.float32) / np.float32(255))
