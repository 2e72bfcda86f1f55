"""Linear light in OpenEXR files, by rows, of the channels that are light. Needs the package OpenEXR."""

import errno
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kerrcaustics.extras import needed
from kerrcaustics.shapes import Float32

Array = np.ndarray

EXR = ".exr"
# Largest number of channels that a message names.
_MOST_NAMED = 12


class ExrChannels(NamedTuple):
    """The channels of a file that are light."""

    path: Path
    """Name of the file."""
    size: tuple[int, int]
    """Rows and columns."""
    top: int
    """Number that the file gives to the first row."""
    light: tuple[str, ...]
    """R, G and B, or Y."""
    alpha: bool
    """True if there is a channel A."""


def exr_channels(path: Path) -> ExrChannels:
    """The channels of light in a file, from its header; an OSError with the reason if they are not known."""
    with needed("exr", "OpenEXR").File(str(path), header_only=True) as file:
        parts = [{c.name: c.xSampling == c.ySampling == 1 for c in part.header["channels"]} for part in file.parts]
        low, high = file.header()["dataWindow"]
    light = [_light_of(set(part)) for part in parts]
    if sum(map(bool, light)) != 1 or not light[0]:
        raise OSError(errno.EINVAL, f"it must have R, G and B, or Y alone, in one layer, but has {_in_words(parts)}")
    alpha = "A" in parts[0]
    if not all(parts[0][name] for name in (*light[0], *("A" * alpha))):
        raise OSError(errno.EINVAL, "its channels are subsampled: save it with a value for each pixel")
    columns, rows = (1 + int(b) - int(a) for a, b in zip(low, high, strict=True))
    return ExrChannels(path, (rows, columns), int(low[1]), light[0], alpha)


def exr_rows(
    channels: ExrChannels, first: int, end: int
) -> tuple[Float32[Array, "n w c"], Float32[Array, "n w"] | None]:
    """Light, which in this format is multiplied by alpha, and alpha of rows from `first` to before `end`."""
    names = [*channels.light, *("A" * channels.alpha)]
    kind = needed("exr", "Imath").PixelType
    file = needed("exr", "OpenEXR").InputFile(str(channels.path))
    try:
        parts = file.channels(names, kind(kind.FLOAT), channels.top + first, channels.top + end - 1)
    finally:
        file.close()
    values = np.stack([np.frombuffer(part, np.float32).reshape(end - first, -1) for part in parts], axis=-1)
    return (values[..., :-1], values[..., -1]) if channels.alpha else (values, None)


def _light_of(names: set[str]) -> tuple[str, ...]:
    """The channels of a part that are light; empty if they are not known."""
    if {"R", "G", "B"} <= names:
        return "R", "G", "B"
    return ("Y",) if "Y" in names and not {"RY", "BY"} & names else ()


def _in_words(parts: list[dict[str, bool]]) -> str:
    """The channels of all parts, by name."""
    names = [name for part in parts for name in sorted(part)]
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    chroma = " (luminance and chroma)" if {"RY", "BY"} & set(names) else ""
    return f"{', '.join(names[:_MOST_NAMED])}{more}{chroma} in {len(parts)} part{'s' * (len(parts) > 1)}"
