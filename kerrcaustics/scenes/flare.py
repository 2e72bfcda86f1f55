"""The flare of a camera's lens: light that falls beside its place, by a point spread function."""

import math
import os

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.scenes.light_files import read_picture
from kerrcaustics.scenes.scene_checks import check_light, check_number, positive
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import flags, numbers, whole_number

Array = np.ndarray


# Default radius of a halo, in units of its width.
_REACH = 20
# Largest side of a point spread function, pixels.
_LARGEST = 8192
# Divisor of the lengths of Fourier transforms.
_FACTOR = 64


@usual_warnings
def with_glare(
    light: ArrayLike, spread: ArrayLike | str | os.PathLike[str], framed: bool = False
) -> Float[Array, "_height _width 3"]:
    """Light of a picture, as seen through a lens with flare: every point of it becomes the point spread function.

    Parameters
    ----------
    light : (h, w, 3) array
        Linear light, as in `Rendering.light`: before `tone_mapped`, which clips light brighter than white.
    spread : (p, q) or (p, q, 3) array, or path of a file
        The point spread function, for all channels or for each of them, any unit: it is divided by its sum. Its pixels
        are those of the picture, and pixel p // 2, q // 2 stands for the point itself. `glare_kernel` makes one.
        Values of PNG and JPEG files count as sRGB, in which the faint end of a halo is lost, those of OpenEXR as
        linear.
    framed : bool
        Also return the light that falls beside the picture, in a frame round it.

    Returns
    -------
    (h, w, 3) array, or (h + p - 1, w + q - 1, 3) when framed
        In its frame, the picture begins in row p // 2 and column q // 2.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    The light of each channel is kept to 1e-12 of it, that of the frame included: light that leaves the picture is lost,
    and does not reappear at the opposite edge. A pixel is good to about 1e-15 of the brightest one.

    References
    ----------
    JTFT section 4 (fig 16): a picture convolved with the point spread function of a lens.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> light = np.zeros((9, 9, 3))
    >>> light[4, 4] = 1.0
    >>> round(float(kc.pictures.with_glare(light, kc.pictures.glare_kernel(0.2, 2.0)).sum()), 3)
    2.808
    """
    picture = _numbers("light", light)
    flags(framed=framed)
    if picture.ndim != 3 or picture.shape[2] != 3:
        raise ValueError(f"Argument `light` must have shape (h, w, 3), but has {picture.shape}.")
    shape = _normalised_spread(spread)
    middle = shape.shape[0] // 2, shape.shape[1] // 2
    if not framed:
        shape, middle = _cropped(shape, middle, picture.shape[:2])
    channels = [_convolved(picture[..., i], shape[..., i % shape.shape[2]]) for i in range(3)]
    # Round-off leaves dark pixels slightly negative, which tone curves do not accept.
    whole = np.maximum(np.stack(channels, axis=-1), 0)
    rows, columns = (slice(start, start + size) for start, size in zip(middle, picture.shape[:2], strict=True))
    return whole if framed else whole[rows, columns]


def _convolved(light: Float[Array, "h w"], shape: Float[Array, "m n"]) -> Float[Array, "h+m-1 w+n-1"]:
    """The sum of shapes at all pixels, times their light, by Fourier transforms."""
    whole = [a + b - 1 for a, b in zip(light.shape, shape.shape, strict=True)]
    # Transforms are slow where a length has a large prime factor.
    padded = [-(-length // _FACTOR) * _FACTOR for length in whole]
    product = np.fft.rfft2(light, padded) * np.fft.rfft2(shape, padded)
    return np.fft.irfft2(product, padded)[: whole[0], : whole[1]]


def glare_kernel(share: float, width: float, falloff: float = 3.0, reach: int | None = None) -> Float[Array, "n n"]:
    """A point spread function (n, n) whose sum is one: most of the light in place, the rest in a round halo about it.

    Parameters
    ----------
    share : float
        Part of the light that is in the halo, 0 to 1.
    width : float
        Pixels. The halo goes as (1 + (distance / width)**2) ** (-falloff / 2), less its value at the end.
    falloff : float
        Above 0; far out, the halo falls with this power of the distance. In the eye, glare falls with 2 to 3.
    reach : int
        Pixels from the middle to the end of the halo, n = 2 reach + 1; if omitted, twenty widths.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> spread = kc.pictures.glare_kernel(share=0.2, width=2.0)
    >>> spread.shape[0] == spread.shape[1]
    True
    """
    check_number("share", share, "lie in [0, 1]", lambda part: 0 <= part <= 1)
    for name, value in (("width", width), ("falloff", falloff)):
        check_number(name, value, "be a positive, finite number", positive)
    most = (_LARGEST - 1) // 2
    reach = whole_number("reach", math.ceil(min(_REACH * width, most)) if reach is None else reach, 0, most)
    square = (np.arange(-reach, reach + 1) / width) ** 2
    # The halo falls to zero one pixel beyond its end, without a visible edge.
    end = (1 + ((reach + 1) / width) ** 2) ** (-falloff / 2)
    kernel = np.maximum((1 + square[:, None] + square) ** (-falloff / 2) - end, 0)
    kernel *= share / kernel.sum()
    kernel[reach, reach] += 1 - share
    return kernel


def _normalised_spread(spread: ArrayLike | str | os.PathLike[str]) -> Float[Array, "p q channels"]:
    """The point spread function of an argument `spread`, with 1 or 3 channels, the sum of each of them 1."""
    values = read_picture(spread) if isinstance(spread, str | os.PathLike) else spread
    shape = _numbers("spread", values)
    if shape.ndim == 2:
        shape = shape[..., None]
    if shape.ndim != 3 or shape.shape[2] not in (1, 3):
        raise ValueError(f"Argument `spread` must be a picture, (p, q) or (p, q, 3), but has shape {np.shape(values)}.")
    total = shape.sum(axis=(0, 1))
    if not (total > 0).all():
        raise ValueError("Argument `spread` must have light in all of its channels.")
    return shape / total


def _numbers(name: str, value: ArrayLike) -> Float[Array, "*shape"]:
    """The argument as an array that holds light."""
    values = numbers(name, value)
    check_light(name, values if values.size else np.array(np.nan))
    return values


def _cropped(
    shape: Float[Array, "p q channels"], middle: tuple[int, int], size: tuple[int, ...]
) -> tuple[Float[Array, "_p _q channels"], tuple[int, int]]:
    """The part of a point spread function that reaches from a pixel of a picture to another, and its middle."""
    first = [max(place - (pixels - 1), 0) for place, pixels in zip(middle, size, strict=True)]
    last = [place + pixels for place, pixels in zip(middle, size, strict=True)]
    return shape[first[0] : last[0], first[1] : last[1]], (middle[0] - first[0], middle[1] - first[1])
