"""Tones: linear light as a picture for a screen, and the exposure from its own light."""

import math
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.scenes.colour import encoded, luminance
from kerrcaustics.scenes.scene_checks import check_number, positive
from kerrcaustics.shapes import Float, UInt8
from kerrcaustics.spacetime.checks import left_out, one_of, quoted, real_array

Array = np.ndarray

Curve = Literal["linear", "asinh"]
CURVES: tuple[Curve, ...] = get_args(Curve)
Auto = Literal["auto"]
AUTO: Auto = "auto"

_SOFTENING = 30.0
# Part of the picture that is brighter than its highlights.
_SURFACE = 0.01
# The same part in a picture of points of light.
_POINTS = 0.001
# Part of the light that lies above the highlights, if these are brighter.
_OF_LIGHT = 0.25
# Ratio of the brightness at both parts from which a picture counts as one of points.
_STEEP = 4.0
# Light of highlights on the screen by the curve: asinh leaves room for brighter light.
_HIGHLIGHT: dict[Curve, float] = {"linear": 0.9, "asinh": 0.7}
# Width of the picture in which highlights are measured, pixels.
_ACROSS = 640
# Variance of the image of a star, pixels^2.
_VARIANCE = 0.25
# Digits of an automatic exposure, so that the printed number gives the same picture.
_DIGITS = 4


@usual_warnings
def tone_mapped(
    light: ArrayLike, exposure: float | Auto = AUTO, curve: str = "linear", softening: float | None = None
) -> UInt8[Array, "*batch 3"]:
    """Picture for a screen, sRGB (..., 3) uint8, of linear light (..., 3).

    Parameters
    ----------
    light : (..., 3) array
        Linear sRGB, any unit.
    exposure : float or "auto"
        Factor of the light: 1 becomes white. "auto": by the light itself, as `auto_exposure`.
    curve : str
        "linear": clipped at white. "asinh": luminance L becomes asinh(s L) / asinh(s), linear in the dark and
        logarithmic in the light, with s the softening; colours keep their hue, and light too bright for a
        channel is mixed with white of its luminance.
    softening : float, optional
        Softening s of the asinh curve, which raises dark tones; 30 by default.

    Raises
    ------
    ValueError
        If an argument is invalid.

    References
    ----------
    Lupton et al. 2004, PASP 116 133, for the curve.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.pictures.tone_mapped([[0.0, 0.5, 1.0]], exposure=1.0).tolist()
    [[0, 188, 255]]
    """
    values = _light(light)
    raised = _checked_tones(exposure, curve, softening)
    factor = auto_exposure(values, curve, softening) if isinstance(exposure, str) else exposure
    values = values * np.float32(factor)
    if curve == "asinh":
        values = _compressed(values, raised)
    return (encoded(values) * 255 + 0.5).astype(np.uint8)


@usual_warnings
def auto_exposure(light: ArrayLike, curve: str = "linear", softening: float | None = None) -> float:
    """The exposure with which the highlights of a picture become nearly white; 1 for a dark picture.

    Parameters
    ----------
    light : (..., 3) array
        Linear sRGB, any unit; a picture (height, width, 3), or several that share an exposure.
    curve, softening : str, float
        As for `tone_mapped`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    The smaller a pixel is, the brighter a point of light makes it. Pictures are therefore first smoothed to 640 pixels
    across: pictures of one view, 640 pixels across or more, have exposures that differ by a few percent at most, those
    of 320 by 30 %, less than half a stop. The value is rounded to four digits: given as a number, it makes the same
    picture.

    Notes
    -----
    Highlights are what a hundredth of the picture exceeds, or above which a quarter of its light lies, whichever is
    brighter. In a picture of points, that would leave most of them white, so highlights are what a thousandth exceeds:
    it counts wholly where it is at least four times as bright as the hundredth, and with the square of the ratio below.
    The light of highlights on the screen is 0.9 on the linear curve and 0.7 on the asinh curve, 95 % and 85 % of the
    largest sRGB value. Light counts by its brightest channel, and for the quarter, pixels brighter than the thousandth
    count as the thousandth: a single star on a caustic changes nothing.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> kc.pictures.auto_exposure(np.full((36, 64, 3), 300.0))
    0.003
    """
    values = _light(light)
    raised = _checked_tones(AUTO, curve, softening)
    level = _highlights(_smoothed(np.nan_to_num(values.max(axis=-1, initial=0.0))))
    if not 0 < level < math.inf:
        return 1.0
    aim = _HIGHLIGHT["asinh" if curve == "asinh" else "linear"]
    if curve == "asinh":
        aim = math.sinh(aim * math.asinh(raised)) / raised
    return float(f"{aim / level:.{_DIGITS}g}")


@usual_warnings
def clipped_fraction(light: ArrayLike, exposure: float, curve: str = "linear") -> float:
    """The part of a picture's pixels that are clipped at white: luminance, or on the linear curve a channel, is over 1.

    Parameters
    ----------
    light : (..., 3) array
        Linear sRGB, any unit.
    exposure, curve : float, str
        As for `tone_mapped`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.pictures.clipped_fraction([[1.0, 1.0, 1.0], [3.0, 0.0, 0.0]], exposure=0.5)
    0.5
    """
    values = _light(light)
    _checked_tones(exposure, curve, None)
    bright = luminance(values) if curve == "asinh" else values.max(axis=-1)
    # White itself is not clipped.
    return float(np.mean(bright * exposure > 1 + 1e-6)) if bright.size else 0.0


def check_exposure(exposure: float | Auto) -> None:
    """Raise ValueError unless the exposure is valid."""
    if isinstance(exposure, str):
        if exposure != AUTO:
            raise ValueError(f'Argument `exposure` must be a number, or "auto", but is {quoted(exposure)}.')
        return
    check_number("exposure", exposure, "be a positive, finite number", positive)


def _checked_tones(exposure: float | Auto, curve: str, softening: float | None) -> float:
    """The softening, after checks of all three."""
    one_of("curve", curve, CURVES)
    check_exposure(exposure)
    if curve != "asinh":
        left_out("softening", softening, "for the linear curve, as only asinh has one")
    return (
        _SOFTENING
        if softening is None
        else check_number("softening", softening, "be a positive, finite number", positive)
    )


def _light(light: ArrayLike) -> Float[Array, "*batch 3"]:
    values = real_array("light", light, np.float32)
    if values.ndim == 0 or values.shape[-1] != 3:
        raise ValueError(f"Argument `light` must have the shape (..., 3), but has {values.shape}.")
    return values


def _smoothed(bright: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """A picture (..., h, w) smoothed as if it were 640 pixels across."""
    if bright.ndim < 2:
        return bright
    variance = (max(bright.shape[-2:]) / _ACROSS) ** 2 - _VARIANCE
    if not variance > 0:
        return bright
    from scipy.ndimage import gaussian_filter

    deviation = (0.0,) * (bright.ndim - 2) + 2 * (math.sqrt(variance),)
    return gaussian_filter(bright, deviation, mode="nearest")


def _highlights(bright: Float[Array, "*shape"]) -> float:
    """The level of the brightest parts of a picture; 0 for a dark picture."""
    falling = np.sort(bright, axis=None)[::-1].astype(float)
    if not falling.size or not falling[0] > 0:
        return 0.0
    surface, points = (float(falling[int(part * falling.size)]) for part in (_SURFACE, _POINTS))
    # A star on a caustic outshines all others: brighter pixels count as the thousandth.
    total = np.cumsum(np.minimum(falling, points) if points > 0 else falling)
    quarter = float(falling[np.searchsorted(total, _OF_LIGHT * total[-1])])
    if points < _STEEP * surface:
        points *= (points / (_STEEP * surface)) ** 2
    return max(surface, points, quarter)


def _compressed(light: Float[Array, "*batch 3"], softening: float) -> Float[Array, "*batch 3"]:
    """Light whose luminance is compressed by asinh, each channel at most 1."""
    grey = luminance(light)[..., None]
    target = np.minimum(np.arcsinh(softening * grey) / math.asinh(softening), 1)
    light = light * (target / np.maximum(grey, 1e-30))
    most = light.max(axis=-1, keepdims=True)
    # Colours are mixed with grey of their luminance until the brightest channel is 1.
    pale = np.where(most > 1, (most - 1) / np.maximum(most - target, 1e-30), 0)
    return light + (target - light) * pale
