"""Emission of disks by pictures: their light, and their alpha as the opacity."""

import math
import os
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.scenes.colour import shifted_light
from kerrcaustics.scenes.disk.samples import DiskSamples, Emission
from kerrcaustics.scenes.light_files import read_picture_with_alpha, size_of
from kerrcaustics.scenes.scene_checks import check_light
from kerrcaustics.shapes import Float, Float32, Int
from kerrcaustics.spacetime.checks import flags, real_array

Array = np.ndarray

_LARGEST_PICTURE = 8192
# Largest number of parts each way of pixels that contain many pixels of the texture.
_MOST_PARTS = 16


class TexturePyramid(NamedTuple):
    """A picture and coarser levels of it, each half as fine.

    pixels: (m, channels) values of all levels, one after the other, by rows.
    levels: (k, 3) number of the first pixel, rows and columns of each level.
    """

    pixels: Array
    levels: Array

    @classmethod
    def from_picture(cls, picture: Float[Array, "h w channels"]) -> "TexturePyramid":
        """The pyramid of a picture."""
        levels = [picture]
        while min(levels[-1].shape[:2]) >= 2:
            levels.append(_halved(levels[-1]))
        sizes, shapes = [level[..., 0].size for level in levels], [level.shape[:2] for level in levels]
        first = np.cumsum([0, *sizes[:-1]])
        pixels = np.concatenate([level.reshape(-1, picture.shape[2]) for level in levels], dtype=np.float32)
        return cls(pixels, np.column_stack([first, shapes]).astype(float))

    def values(self, width: float, columns: tuple[Array, ...]) -> Float[Array, "n channels"]:
        """Values (n, channels) in parts of pixels; width: of the disk; columns: those of the parts for kernels."""
        _, rows, turn = self.levels[0]
        channels, numbers = self.pixels.shape[1], (rows, turn, len(self.levels), width)
        values = kernel(f"texture_{channels}").on_rays(numbers, columns, tables=self)
        return np.asarray(values).reshape(-1, channels)

    def finest_values(self, across: Float[Array, " n"], azimuth: Float[Array, " n"]) -> Float[Array, "n channels"]:
        """Values (n, channels) of the finest level at places."""
        return self.values(1.0, (across, azimuth, np.ones(len(across)), np.zeros((len(across), 4))))


class Texture(Emission):
    """A picture on the disk: once round from left to right, the inner rim at the bottom and the outer one at the top.

    Parameters
    ----------
    light : (h, w, 3) array
        Linear sRGB, any unit.
    alpha : (h, w) array, optional
        The part of the light behind that each pixel blocks, 0 to 1, and the part of its own light that it emits. A
        `Disk` without an opacity of its own has this one. If omitted, the picture has no opacity.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    The picture is linear between the middles of its pixels, and periodic round the disk. Averages come from a pyramid
    of pictures, each half as fine as the one before.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> kc.disks.Texture(np.ones((4, 8, 3)))
    <Texture of 8 x 4 pixels>
    """

    def __init__(self, light: ArrayLike, alpha: ArrayLike | None = None) -> None:
        """Make the pyramids."""
        picture = real_array("light", light, np.float32)
        if picture.ndim != 3 or picture.shape[2] != 3 or 0 in picture.shape:
            raise ValueError(f"Argument `light` must have shape (h, w, 3), but has {picture.shape}.")
        if max(picture.shape) > _LARGEST_PICTURE:
            raise ValueError(f"Argument `light` must have at most {_LARGEST_PICTURE} rows and columns.")
        check_light("light", picture)
        self.shape = picture.shape[:2]
        cover = None if alpha is None else _checked_alpha(alpha, self.shape)
        self._pyramid = TexturePyramid.from_picture(picture if cover is None else picture * cover)
        self.cover = None if cover is None or cover.min() == 1 else TexturePyramid.from_picture(cover)

    def __repr__(self) -> str:
        """Return a line with its size."""
        return f"<Texture of {self.shape[1]} x {self.shape[0]} pixels>"

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, mirror: bool = False) -> "Texture":
        """The texture of a PNG, JPEG or OpenEXR file: the first two count as sRGB, OpenEXR as linear.

        Writing is readable from the south, with mirror from the north. PNG and OpenEXR files may have an alpha channel.
        """
        flags(mirror=mirror)
        rows, columns = size_of(path)
        if max(rows, columns) > _LARGEST_PICTURE:
            raise ValueError(
                f"Argument `path` must name a picture of at most {_LARGEST_PICTURE} rows and columns, but "
                f"{os.fspath(path)!r} has {columns} x {rows} pixels."
            )
        light, alpha = read_picture_with_alpha(path)
        step = -1 if mirror else 1
        return cls(light[:, ::step]) if alpha is None else cls(*_opaque(path, light[:, ::step], alpha[:, ::step]))

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3); for a shift of colours the picture counts as lit by daylight."""
        return self.mean(self._pyramid, samples) * shifted_light(samples.redshift, beaming, colour_shift)

    def mean(self, pyramid: TexturePyramid, samples: DiskSamples) -> Float[Array, "n channels"]:
        """Values (n, channels) of a pyramid, averaged over samples."""
        columns = samples.across, samples.azimuth, samples.radius, samples.matrix.reshape(-1, 4)
        return pyramid.values(samples.width, columns)

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """The number for which a part is as large as a pixel of the picture, up to a limit."""
        texels = np.maximum(size[:, 0] * self.shape[0], size[:, 1] * self.shape[1] / (2 * math.pi))
        return np.clip(2 ** np.ceil(np.log2(np.maximum(3 * texels, 1))), 4, _MOST_PARTS).astype(int)

    def own_opacity(self, inner: Any, outer: float) -> "AlphaOpacity | None":
        """The opacity from its alpha channel; None without one."""
        return None if self.cover is None else AlphaOpacity(self, inner, outer)


@dataclass(frozen=True, eq=False)
class AlphaOpacity:
    """The alpha of a texture as the opacity of a disk.

    texture: the texture.
    inner, outer: radii of the rims, M.
    angle: angle by which it is turned about the spin axis, radians.
    """

    texture: Texture
    inner: float
    outer: float
    angle: float = 0.0

    def __call__(self, radius: Float[Array, " n"], azimuth: Float[Array, " n"]) -> Float[Array, " n"]:
        """The part (n,) of the light behind that places block."""
        assert self.texture.cover is not None
        across = (radius - self.inner) / (self.outer - self.inner)
        return as_part(self.texture.cover.finest_values(across, azimuth - self.angle))

    def mean(self, samples: DiskSamples) -> Float[Array, " n"]:
        """The opacity (n,), averaged over samples."""
        assert self.texture.cover is not None
        return as_part(self.texture.mean(self.texture.cover, samples._replace(azimuth=samples.azimuth - self.angle)))

    def turned_by(self, angle: float) -> "AlphaOpacity":
        """The opacity turned by an angle (radians, toward larger phi)."""
        return replace(self, angle=self.angle + angle)


def as_part(values: Float[Array, "n 1"]) -> Float[Array, " n"]:
    """Values as a part; round-off may take them beyond 1."""
    return np.clip(values[:, 0], 0, 1)


def _opaque(
    path: str | os.PathLike[str], light: Float32[Array, "h w 3"], alpha: Float32[Array, "h w"]
) -> tuple[Float32[Array, "h w 3"], Float32[Array, "h w"]]:
    """Light divided by the alpha, and the alpha."""
    clear = (alpha == 0)[..., None]
    if (clear & (light > 0)).any():
        raise ValueError(
            f"Argument `path` must name a picture without light where its alpha is 0, but {os.fspath(path)!r} has some."
        )
    return light / np.where(clear, np.float32(1), alpha[..., None]), alpha


def _checked_alpha(alpha: ArrayLike, shape: tuple[int, ...]) -> Float[Array, "h w 1"]:
    cover = real_array("alpha", alpha, np.float32)
    if cover.shape != shape:
        raise ValueError(f"Argument `alpha` must have the shape {shape} of the picture, but has {cover.shape}.")
    if not ((cover >= 0) & (cover <= 1)).all():
        raise ValueError("Argument `alpha` must hold numbers from 0 to 1.")
    return cover[..., None]


def _halved(picture: Float[Array, "h w channels"]) -> Float[Array, "_h _w channels"]:
    """Means of two by two pixels; the last one of an odd number counts twice."""
    rows, columns = picture.shape[:2]
    even = np.pad(picture, ((0, rows % 2), (0, columns % 2), (0, 0)), mode="edge")
    return (even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]) / 4
