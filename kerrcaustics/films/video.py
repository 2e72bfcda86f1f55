"""Frames joined to a file: MP4 (H.264) or GIF. The same frames give the same file, to the byte."""

import os
from collections.abc import Iterator
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from kerrcaustics.extras import needed
from kerrcaustics.files import writing
from kerrcaustics.shapes import UInt8

Array = np.ndarray
Pictures = Iterator[UInt8[Array, "height width 3"]]

ENDINGS = (".mp4", ".gif")
# Constant quality of H.264: 18 is hardly distinguishable from the frames themselves. The output of x264 depends on the
# number of its threads, by default that of the machine's cores; with its macroblock tree (core 165) and a width that is
# no multiple of 128 pixels, on what lay in memory before.
_OPTIONS = {"crf": "18", "preset": "medium", "threads": "1", "x264-params": "mbtree=0"}
_COLOURS = 256


def check_film_path(path: Path) -> None:
    """Raise ValueError for files that cannot be written here, before any frame is drawn."""
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"Argument `path` must end in {' or '.join(ENDINGS)}, but is {str(path)!r}.")
    if not os.path.isdir(path.parent):
        raise ValueError(f"Argument `path` must lie in a folder that exists, but {str(path.parent)!r} is none.")
    if path.suffix.lower() == ".mp4":
        needed("films", "av")


def write_pictures(path: Path, pictures: Pictures, rate: int) -> None:
    """Write pictures (height, width, 3) of one size, so many a second, to the file of a film."""
    with writing(path, lasting=True) as file:
        (_write_gif if path.suffix.lower() == ".gif" else _write_mp4)(file, pictures, rate)


def _write_mp4(file: Any, pictures: Pictures, rate: int) -> None:
    av, first = needed("films", "av"), next(pictures)
    with av.open(file, "w", format="mp4") as container:
        stream: Any = container.add_stream("libx264", rate=Fraction(rate))
        stream.pix_fmt, stream.options = "yuv420p", dict(_OPTIONS)
        stream.height, stream.width = first.shape[:2]
        for picture in chain([first], pictures):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def _write_gif(file: Any, pictures: Pictures, rate: int) -> None:
    # No dithering: it would flicker from frame to frame.
    images = (Image.fromarray(picture).quantize(_COLOURS, dither=Image.Dither.NONE) for picture in pictures)
    # GIF counts in hundredths of a second.
    duration = round(100 / rate) * 10
    next(images).save(file, format="GIF", save_all=True, append_images=images, duration=duration, loop=0)
