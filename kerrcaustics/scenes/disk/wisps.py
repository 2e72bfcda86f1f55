"""Thin glowing gas of uneven depth, drawn out into wisps along its orbits."""

import math
from typing import Any, Literal

import numpy as np

from kerrcaustics.scenes.colour import ResponseLike
from kerrcaustics.scenes.disk.emission import BlackBody, PageThorne, ThermalEmission
from kerrcaustics.scenes.disk.samples import DiskSamples
from kerrcaustics.scenes.disk.texture import Texture, TexturePyramid, as_part
from kerrcaustics.scenes.scene_checks import check_number
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.checks import one_of, quoted, real_number, whole_number

Array = np.ndarray

TemperatureLaw = Literal["black-body", "page-thorne"]
_GASES: dict[str, Any] = {"black-body": BlackBody, "page-thorne": PageThorne}

# Size of the pattern, pixels.
_ROWS, _COLUMNS = 512, 2048
# Number of waves from rim to rim up to which the spectrum is flat.
_ACROSS = 5.0
# Number of waves once round up to which the spectrum is flat.
_ROUND = 2.5
# Exponent with which the amplitude of finer waves falls.
_FALL = 1.55
# Angle (radians) by which the inner rim is ahead of the outer one, so that wisps trail.
_TRAIL = 2.0
# Part of the disk's width over which the gas thins out at each rim.
_SOFT = 0.14


class Wisps(Texture):
    """Glowing gas that lets light through, in wisps along its orbits, and thins out at both rims.

    Parameters
    ----------
    peak : float
        Kelvin; where the gas is hottest, if its temperature changes.
    inner, outer : float
        Radii of the disk's rims.
    depth : float
        Mean optical depth along the axis, away from the rims.
    contrast : float
        Standard deviation of the logarithm of the depth; 0 for an even disk.
    seed : int
        Seed of the random pattern.
    response : str or MeasuredResponse
        "cie", "film" or measured curves, as for `black_body`.
    law : str
        Temperature over the radius: "black-body", the same everywhere, or "page-thorne", that of `PageThorne`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Like any gas, it emits at every place the same part of a black body's light that it absorbs of the light behind:
    Disk(inner, outer, wisps, opacity=wisps.opacity, slant=False). With `slant` more light would be absorbed, but no
    more would be emitted. The depth is the exponential of a random field, periodic in azimuth, with a spectrum that
    falls as a power: it looks like turbulence, but is no model of it.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.disks.Wisps(peak=4500.0, inner=6.0, outer=20.0, seed=3).inner
    6.0
    """

    def __init__(
        self,
        peak: float,
        inner: float,
        outer: float,
        depth: float = 1.0,
        contrast: float = 1.0,
        seed: int = 0,
        response: ResponseLike = "cie",
        law: str = "black-body",
    ) -> None:
        """Draw the wisps; see the class."""
        if not 0 < real_number("inner", inner) < real_number("outer", outer) < math.inf:
            radii = f"{quoted(inner)} and {quoted(outer)}"
            raise ValueError(f"Arguments `inner` and `outer` must be growing radii, but are {radii}.")
        for name, value in (("depth", depth), ("contrast", contrast)):
            check_number(name, value, "be a number from 0 to 100", lambda number: 0 <= number <= 100)
        one_of("law", law, _GASES)
        self.gas: ThermalEmission = _GASES[law](peak, response)
        self.inner, self.outer = float(inner), float(outer)
        across = 1 - (np.arange(_ROWS) + 0.5)[:, None] / _ROWS
        field = _random_field(whole_number("seed", seed, 0), across)
        near = np.clip(np.minimum(across, 1 - across) / _SOFT, 0, 1)
        tau = depth * (near * near * (3 - 2 * near)) * np.exp(contrast * field - contrast**2 / 2)
        # One channel: the emitting part is the same in all colours.
        self.shape, self.cover = (_ROWS, _COLUMNS), None
        self._pyramid = TexturePyramid.from_picture(-np.expm1(-tau)[..., None].astype(np.float32))

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """The light of a black body times the opacity; with the ratio g and both shifts that of a black body of g T."""
        return self.mean(self._pyramid, samples) * self.gas.light(samples, beaming, colour_shift)

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """Half as many parts as for a picture, whose finest features are stronger."""
        return np.maximum(super().parts(low, high, size) // 2, 2)

    def opacity(self, radius: Float[Array, " n"], azimuth: Float[Array, " n"]) -> Float[Array, " n"]:
        """The part (n,) of the light behind that is blocked when seen along the axis."""
        across = (radius - self.inner) / (self.outer - self.inner)
        return as_part(self._pyramid.finest_values(across, azimuth))


def _random_field(seed: int, across: Float[Array, "rows 1"]) -> Float[Array, "rows columns"]:
    """A Gaussian random field of variance 1, periodic in azimuth, with features long in azimuth and trailing."""
    # Half of the rows are dropped, so that the field is not periodic from rim to rim.
    waves = np.fft.rfft2(np.random.default_rng(seed).normal(size=(2 * _ROWS, _COLUMNS)))
    k, m = np.fft.fftfreq(2 * _ROWS, 1 / _ROWS)[:, None], np.arange(_COLUMNS // 2 + 1)
    waves *= (1 + (k / _ACROSS) ** 2 + (m / _ROUND) ** 2) ** (-_FALL / 2)
    rows = np.fft.ifft(waves, axis=0)[:_ROWS] * np.exp(1j * m * _TRAIL * across)
    field = np.fft.irfft(rows, _COLUMNS, axis=1)
    return (field - field.mean()) / field.std()
