"""Frames joined to a file: MP4 (H.264) or GIF. The same frames give the same file, to the byte."""

from collections.abc import Iterator
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int32, UInt8
from PIL import Image

from kerrcaustics.files import writing

Array = np.ndarray
Pictures = Iterator[UInt8[Array, "height width 3"]]

ENDINGS = (".mp4", ".gif")
# Constant quality of H.264: 18 can hardly be told from the frames themselves. What x264 writes depends on the number of
# its threads, by default that of the machine's cores.
_OPTIONS = {"crf": "18", "preset": "medium", "threads": "1"}
_COLOURS = 256
# Weights of red, green and blue, times 2^16.
_LUMA = (16829, 33039, 6416)
_CHROMA = ((-9714, -19070, 28784), (28784, -24103, -4681))


def check_film_path(path: Path) -> None:
    """Refuse files that cannot be written here, before any frame is drawn."""
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"Argument `path` must end in {' or '.join(ENDINGS)}, but is {str(path)!r}.")
    if not path.parent.is_dir():
        raise ValueError(f"Argument `path` must lie in a folder that exists, but {str(path.parent)!r} is none.")
    if path.suffix.lower() == ".mp4":
        _av()


def write_pictures(path: Path, pictures: Pictures, rate: int) -> None:
    """Write pictures (height, width, 3) of one size, so many a second, to the file of a film."""
    with writing(path, lasting=True) as file:
        (_write_gif if path.suffix.lower() == ".gif" else _write_mp4)(file, pictures, rate)


def _av() -> Any:
    try:
        import av
    except ImportError:
        raise ImportError('MP4 films need the package av: pip install "kerrcaustics[films]"') from None
    return av


def _write_mp4(file: Any, pictures: Pictures, rate: int) -> None:
    av, first = _av(), next(pictures)
    with av.open(file, "w", format="mp4") as container:
        stream: Any = container.add_stream("libx264", rate=Fraction(rate))
        stream.pix_fmt, stream.options = "yuv420p", dict(_OPTIONS)
        stream.height, stream.width = first.shape[:2]
        for picture in chain([first], pictures):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(yuv420(picture), format="yuv420p")))
        container.mux(stream.encode())


def yuv420(picture: UInt8[Array, "height width 3"]) -> UInt8[Array, "rows width"]:
    """A picture as luma, and below it the two chroma at half the resolution: ITU-R BT.601, 16 to 235 and 16 to 240.

    In whole numbers: what FFmpeg's own conversion gives depends, in the last bit, on where in memory a picture lies.
    """
    wide = picture.astype(np.int32)
    luma = (_dot(wide, _LUMA) + (16 << 16) + (1 << 15)) >> 16
    # Sums of four pixels: two more bits.
    fours = wide[::2, ::2] + wide[1::2, ::2] + wide[::2, 1::2] + wide[1::2, 1::2]
    chroma = [(_dot(fours, weights) + (128 << 18) + (1 << 17)) >> 18 for weights in _CHROMA]
    return np.concatenate([part.ravel() for part in (luma, *chroma)]).astype(np.uint8).reshape(-1, picture.shape[1])


def _dot(colour: Int32[Array, "height width 3"], weights: tuple[int, int, int]) -> Int32[Array, "height width"]:
    return colour[..., 0] * weights[0] + colour[..., 1] * weights[1] + colour[..., 2] * weights[2]


def _write_gif(file: Any, pictures: Pictures, rate: int) -> None:
    # No dithering: it would flicker from frame to frame.
    images = (Image.fromarray(picture).quantize(_COLOURS, dither=Image.Dither.NONE) for picture in pictures)
    # GIF counts in hundredths of a second.
    duration = round(100 / rate) * 10
    next(images).save(file, format="GIF", save_all=True, append_images=images, duration=duration, loop=0)
