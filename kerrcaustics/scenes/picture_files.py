"""Rendered pictures and their light as files, written without Matplotlib."""

import os
import shutil
import tempfile
from typing import Any

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from kerrcaustics.extras import needed
from kerrcaustics.files import writing

Array = np.ndarray


def save_picture(path: str | os.PathLike[str], picture: Array, note: str = "") -> None:
    """Write a picture (height, width, 3) uint8, as `tone_mapped` makes it, as PNG or JPEG, by the ending of `path`.

    note: a comment in the file.
    """
    endings = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
    ending = os.path.splitext(os.fspath(path))[1].lower()
    if ending not in endings:
        raise ValueError(f"Argument `path` must end in {', '.join(endings)}, but is {os.fspath(path)!r}.")
    picture = np.asarray(picture)
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:
        raise ValueError("Argument `picture` must be an array (height, width, 3) of uint8.")
    about: dict[str, Any] = {}
    if note:
        text = PngInfo()
        text.add_text("Comment", note)
        about = {"pnginfo": text} if endings[ending] == "PNG" else {"comment": note}
    with writing(path) as file:
        Image.fromarray(picture).save(file, endings[ending], **about)


def save_light(path: str | os.PathLike[str], light: Array, alpha: Array | None = None) -> None:
    """Write linear light (height, width, 3) as an OpenEXR file, single precision; needs the package of that name.

    alpha: opacity (height, width) of the matter; the light is already multiplied by it, as OpenEXR requires.
    """
    if os.path.splitext(os.fspath(path))[1].lower() != ".exr":
        raise ValueError(f"Argument `path` must end in .exr, but is {os.fspath(path)!r}.")
    OpenEXR = needed("exr", "OpenEXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    # The library writes to names alone.
    with tempfile.TemporaryDirectory() as folder, writing(path) as file:
        whole = os.path.join(folder, "light.exr")
        channels = light if alpha is None else np.dstack([light, alpha])
        names = "RGB" if alpha is None else "RGBA"
        OpenEXR.File(header, {names: np.ascontiguousarray(channels, np.float32)}).write(whole)
        with open(whole, "rb") as made:
            shutil.copyfileobj(made, file)
