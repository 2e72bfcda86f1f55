"""Pictures of a whole sphere as pyramids: made from blocks of rows, so that little is held beside them; looked up.

A level holds a chart, phi' to the right from 0, with a pixel more on every side: those beyond phi' = 0 and the poles.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from kerrcaustics.results.progress import report
from kerrcaustics.shapes import Float, Float16, Float32

Array = np.ndarray
Level = Float32[Array, "channels h w"] | Float16[Array, "channels h w"]

# The coarsest level has at least so many rows; pixels of blocks; and the work on the finest level, as part of all.
_COARSEST, _BLOCK, _FINEST = 4, 1 << 19, 0.75


class SphereRows(NamedTuple):
    """Some rows of a chart of the sphere."""

    first: int
    """Number of the first one, from the north pole."""
    channels: slice
    """The channels that are given: all, or one of three."""
    light: Float32[Array, "n w channels"]
    """Light; one channel under all of them is grey."""


def pyramid(rows: int, blocks: Iterable[SphereRows], precision: type[np.floating] = np.float32) -> list[Level]:
    """The levels of a picture with so many rows, each half as fine as the one before: of what is grey, one channel.

    Each is smoothed along its rows. In half precision, np.float16, light between 1e-4 and 6e4 keeps three digits.
    """
    levels = [_padded(_finest(rows, blocks, precision))]
    while len(levels[-1][0]) % 2 == 0 and (len(levels[-1][0]) - 2) // 2 >= _COARSEST:
        levels.append(_padded(_halved(levels[-1])))
    return levels


def looked_up(padded: Level, down: Float[Array, " m"], right: Float[Array, " m"]) -> Float32[Array, "channels m"]:
    """Light (channels, m) at parts of the height and width of a level, linear between pixels."""
    rows, columns = padded.shape[1] - 2, padded.shape[2] - 2
    y, x = down * rows + 0.5, right * columns + 0.5
    i, j = np.minimum(y.astype(int), rows), np.minimum(x.astype(int), columns)
    v, u = (y - i).astype(np.float32), (x - j).astype(np.float32)
    start, steps = i * (columns + 2) + j, (0, 1, columns + 2, columns + 3)
    light = np.empty((len(padded), len(start)), np.float32)
    for k, channel in enumerate(padded.reshape(len(padded), -1)):
        first, second, third, last = (channel[step:].take(start).astype(np.float32, copy=False) for step in steps)
        upper, lower = first + u * (second - first), third + u * (last - third)
        light[k] = upper + v * (lower - upper)
    return light


def _finest(rows: int, blocks: Iterable[SphereRows], precision: type[np.floating]) -> Level:
    """The finest level, without its margin."""
    # Memory that is not written to is not taken: the second and third channel are, from the first colour on.
    level, coloured, done = np.empty((3, rows + 2, 2 * rows + 2), precision), False, 0
    inner = level[:, 1:-1, 1:-1]
    for first, channels, light in blocks:
        place = slice(first, first + len(light))
        plain = channels == slice(None) and bool((light == light[..., :1]).all())
        if not plain and not coloured:
            coloured = True
            if channels == slice(None):
                inner[1:, :first] = inner[0, :first]
        smooth = _smoothed((light[..., :1] if plain else light).transpose(2, 0, 1), first, rows)
        inner[channels if coloured else slice(1), place] = smooth
        done += len(light) * (1 if channels == slice(None) else 1 / 3)
        report("picture of the sky", min(_FINEST * done / rows, 1.0))
    return level if coloured else level[:1]


def _halved(padded: Level) -> Level:
    """The next level, without its margin: means of two by two pixels, weighted by their areas on the sphere."""
    rows = padded.shape[1] // 2 - 1
    weight = np.sin((np.arange(2 * rows) + 0.5) * math.pi / (2 * rows)).astype(np.float32).reshape(-1, 2, 1)
    level = np.empty((len(padded), rows + 2, 2 * rows + 2), padded.dtype)
    count = max(_BLOCK // (4 * rows), 1)
    for first in range(0, rows, count):
        share = weight[first : first + count]
        some = padded[:, 1 + 2 * first : 1 + 2 * (first + len(share)), 1:-1]
        pairs = some.reshape(len(padded), len(share), 2, -1)
        tall = (pairs * share).sum(axis=2) / share.sum(axis=1)
        level[:, 1 + first : 1 + first + len(share), 1:-1] = _smoothed(
            (tall[..., ::2] + tall[..., 1::2]) / 2, first, rows
        )
    report("picture of the sky")
    return level


def _smoothed(light: Float32[Array, "channels n w"], first: int, rows: int) -> Float32[Array, "channels n w"]:
    """Rows of a picture smoothed by a Gaussian as wide as a row is high, where that is more than a pixel.

    Half a row's height on the sphere is what look-ups have for a deviation; the pixels' own is taken off.
    """
    s = np.sin((first + np.arange(light.shape[1]) + 0.5) * math.pi / rows)
    deviation = 0.5 * np.sqrt(np.maximum(1 / s**2 - 1, 0))
    wave = np.fft.rfftfreq(light.shape[2]) * 2 * math.pi
    damping = np.exp(-((deviation[:, None] * wave) ** 2) / 2)
    smooth = np.fft.irfft(np.fft.rfft(light, axis=2) * damping, n=light.shape[2], axis=2)
    # A Gaussian that is no wider than pixels rings beside bright ones: what is cut there is taken from them.
    positive = np.maximum(smooth, 0)
    whole = positive.sum(axis=2, keepdims=True)
    kept = light.sum(axis=2, keepdims=True, dtype=whole.dtype) / np.where(whole > 0, whole, 1)
    return (positive * kept).astype(np.float32)


def _padded(level: Level) -> Level:
    """The level with its margin: the other edge's pixels at the sides, those beyond the pole above and below."""
    half = level.shape[2] // 2 - 1
    for edge, next_row in ((0, 1), (-1, -2)):
        level[:, edge, 1:-1] = np.roll(level[:, next_row, 1:-1], half, axis=-1)
    level[..., 0], level[..., -1] = level[..., -2], level[..., 1]
    return level
