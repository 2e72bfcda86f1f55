"""Pictures of a whole sphere as pyramids, made from blocks of rows to save memory.

A level holds a chart, phi' to the right from 0, with a pixel more on every side: those beyond phi' = 0 and the poles.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from kerrcaustics.results.progress import report
from kerrcaustics.shapes import Float, Float16, Float32

Array = np.ndarray
Level = Float32[Array, "h w channels"] | Float16[Array, "h w channels"]
FineLevel = Float32[Array, "_ _ channels"] | Float16[Array, "_ _ channels"]
"""The level before, of twice as many rows and columns without the margins."""

# Smallest number of rows of the coarsest level.
_COARSEST = 4
# Pixels that are averaged together.
_BLOCK = 1 << 19
# Part of the work that the finest level takes, for the progress report.
_FINEST = 0.75


class SphereRows(NamedTuple):
    """Some rows of a chart of the sphere."""

    first: int
    """Number of the first row, from the north pole."""
    channels: slice
    """The channels in `light`: all, or one of three."""
    light: Float32[Array, "n w channels"]
    """Linear light; grey if there is one channel for all."""


class SpherePyramid(NamedTuple):
    """All levels of a picture, each half as fine as the one before."""

    pixels: Float32[Array, "pixels channels"] | Float16[Array, "pixels channels"]
    """Light of the levels, one after the other, by rows; one channel for a grey picture."""
    levels: Float[Array, "levels 2"]
    """Number of the first pixel of each, and its rows without the margin."""

    def level(self, number: int) -> Level:
        """A level, with its margin."""
        first, rows = self.levels[number].astype(int).tolist()
        shape = rows + 2, 2 * rows + 2
        return self.pixels[first : first + math.prod(shape)].reshape(*shape, -1)


def pyramid(rows: int, blocks: Iterable[SphereRows], precision: type[np.floating] = np.float32) -> SpherePyramid:
    """The pyramid of a picture with `rows` rows, each level smoothed along its rows.

    In half precision, np.float16, light between 1e-4 and 6e4 keeps three digits.
    """
    heights = [rows]
    while heights[-1] % 2 == 0 and heights[-1] // 2 >= _COARSEST:
        heights.append(heights[-1] // 2)
    ends = np.cumsum([(height + 2) * (2 * height + 2) for height in heights])
    levels = np.stack([np.concatenate([[0], ends[:-1]]), heights], axis=1).astype(float)
    made = _with_finest(SpherePyramid(np.empty((ends[-1], 1), precision), levels), blocks)
    for number in range(len(heights)):
        if number:
            _halve(made.level(number - 1), made.level(number))
        _pad(made.level(number))
    return made


def _with_finest(made: SpherePyramid, blocks: Iterable[SphereRows]) -> SpherePyramid:
    """The pyramid with its finest level, but for the margin; it becomes coloured with the first coloured rows."""
    done, rows = 0.0, len(made.level(0)) - 2
    for first, channels, light in blocks:
        whole = channels == slice(None)
        plain = whole and bool((light == light[..., :1]).all())
        if not plain and made.pixels.shape[1] == 1:
            coloured = made._replace(pixels=np.empty((len(made.pixels), 3), made.pixels.dtype))
            # Unwritten memory is not allocated.
            coloured.level(0)[: first + 1] = made.level(0)[: first + 1]
            made = coloured
        place = slice(1 + first, 1 + first + len(light))
        made.level(0)[place, 1:-1, channels] = _smoothed(light[..., :1] if plain else light, first, rows)
        done += len(light) * (1 if whole else 1 / 3)
        report("picture of the sky", min(_FINEST * done / rows, 1.0))
    return made


def _halve(fine: FineLevel, level: Level) -> None:
    """Fill a level, but for its margin, from the one before: means of two by two pixels, weighted by their areas."""
    rows = len(level) - 2
    weight = np.sin((np.arange(2 * rows) + 0.5) * math.pi / (2 * rows)).astype(np.float32).reshape(-1, 2, 1, 1)
    count = max(_BLOCK // (4 * rows), 1)
    for first in range(0, rows, count):
        share = weight[first : first + count]
        some = fine[1 + 2 * first : 1 + 2 * (first + len(share)), 1:-1]
        pairs = some.reshape(len(share), 2, *some.shape[1:])
        tall = (pairs * share).sum(axis=1) / share.sum(axis=1)
        light = (tall[:, ::2] + tall[:, 1::2]) / 2
        level[1 + first : 1 + first + len(share), 1:-1] = _smoothed(light, first, rows)
    report("picture of the sky")


def _smoothed(light: Float32[Array, "n w channels"], first: int, rows: int) -> Float32[Array, "n w channels"]:
    """Rows of a picture smoothed by a Gaussian as wide as a row is high, where that is more than a pixel.

    Look-ups have a deviation of half a row's height on the sphere; that of the pixels is subtracted.
    """
    s = np.sin((first + np.arange(len(light)) + 0.5) * math.pi / rows)
    deviation = 0.5 * np.sqrt(np.maximum(1 / s**2 - 1, 0))
    wave = np.fft.rfftfreq(light.shape[1]) * 2 * math.pi
    damping = np.exp(-((deviation[:, None] * wave) ** 2) / 2)[..., None]
    smooth = np.fft.irfft(np.fft.rfft(light, axis=1) * damping, n=light.shape[1], axis=1)
    # A Gaussian no wider than pixels rings beside bright pixels: the row is rescaled after negative values are cut.
    positive = np.maximum(smooth, 0)
    whole = positive.sum(axis=1, keepdims=True)
    scale = light.sum(axis=1, keepdims=True, dtype=whole.dtype) / np.where(whole > 0, whole, 1)
    return (positive * scale).astype(np.float32)


def _pad(level: Level) -> None:
    """Fill the margin of a level: the other edge's pixels at the sides, those beyond the pole above and below."""
    half = level.shape[1] // 2 - 1
    for edge, next_row in ((0, 1), (-1, -2)):
        level[edge, 1:-1] = np.roll(level[next_row, 1:-1], half, axis=0)
    level[:, 0], level[:, -1] = level[:, -2], level[:, 1]
