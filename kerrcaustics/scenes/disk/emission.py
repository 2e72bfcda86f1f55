"""Emission of disks: black bodies of one temperature or of a law, and paint swatches."""

import math
from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.scenes.checkerboard import COLOURS, DARKER, GAP_COLOUR, check_pattern, mixed
from kerrcaustics.scenes.colour import ResponseLike, check_response, from_srgb, seen_black_body, shifted_light
from kerrcaustics.scenes.disk.samples import DiskSamples, Emission, smooth_parts
from kerrcaustics.scenes.scene_checks import check_number, positive
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime import kerr

Array = np.ndarray

# Divisions each way of pixels that contain an edge of paint.
_PARTS = 8
_HOTTEST = 1e6
# Number of radii of each of two tables for the largest flux of a disk.
_RADII = 2001


class ThermalEmission(Emission):
    """Light of a temperature that depends on the radius alone; it is smooth, so that a pixel needs no division."""

    symmetric = True
    peak: float
    response: ResponseLike = "cie"

    def __post_init__(self) -> None:
        """Raise ValueError unless temperature and response are valid."""
        must = "be a temperature above 0 and at most 1e6 kelvin"
        check_number("peak", self.peak, must, lambda kelvin: 0 < kelvin <= _HOTTEST)
        check_response(self.response)

    @abstractmethod
    def temperature(self, spin: float, radius: Float[Array, " n"]) -> Float[Array, " n"]:
        """Temperature in kelvin; 0 for no light. spin: of the hole, negative for a retrograde disk."""

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """The light of a black body of temperature T; with the ratio g and both shifts that of a black body of g T."""
        temperature = self.temperature(samples.spin, samples.radius)
        return seen_black_body(temperature, samples.redshift, beaming, colour_shift, self.response)

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """One, or more for pixels that see much of the disk."""
        return smooth_parts(size)


@dataclass(frozen=True)
class BlackBody(ThermalEmission):
    """A disk of one temperature.

    Parameters
    ----------
    peak : float
        Kelvin. A black body of 6504 K has luminance 1, and is white.
    response : str or MeasuredResponse
        "cie", "film" or measured curves, as for `black_body`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.disks.BlackBody(4500).temperature(0.9, [6.0, 12.0]).tolist()
    [4500.0, 4500.0]
    """

    peak: float
    response: ResponseLike = "cie"

    def temperature(self, spin: float, radius: Float[Array, " n"]) -> Float[Array, " n"]:
        """Temperature in kelvin, the same everywhere."""
        return np.full(np.shape(radius), float(self.peak))


@dataclass(frozen=True)
class PowerLaw(ThermalEmission):
    """A disk whose temperature falls as a power of the radius.

    Parameters
    ----------
    peak : float
        Kelvin, at the radius `at`.
    exponent : float
        Temperature goes as radius ** -exponent; 3/4 far out in any disk that radiates the energy released by infall.
    at : float
    response : str or MeasuredResponse
        "cie", "film" or measured curves, as for `black_body`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> kc.disks.PowerLaw(6000, exponent=0.75, at=10.0).temperature(0.9, np.array([10.0])).tolist()
    [6000.0]
    """

    peak: float
    exponent: float = 0.75
    at: float = 10.0
    response: ResponseLike = "cie"

    def __post_init__(self) -> None:
        """Raise ValueError unless temperature, law and response are valid."""
        super().__post_init__()
        check_number("exponent", self.exponent, "be a number")
        check_number("at", self.at, "be a positive, finite radius", positive)

    def temperature(self, spin: float, radius: Float[Array, " n"]) -> Float[Array, " n"]:
        """Temperature in kelvin."""
        return np.asarray(self.peak * (radius / self.at) ** -self.exponent)


@dataclass(frozen=True)
class PageThorne(ThermalEmission):
    """The thin disk with steady infall that radiates the released energy as a black body; dark within the ISCO.

    Parameters
    ----------
    peak : float
        Kelvin, where the disk is hottest.
    response : str or MeasuredResponse
        "cie", "film" or measured curves, as for `black_body`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    References
    ----------
    Page & Thorne 1974, ApJ 191, 499, eq. 15n.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> hot, cool = kc.disks.PageThorne(6000).temperature(0.9, [4.0, 40.0])
    >>> bool(hot > cool)
    True
    """

    peak: float
    response: ResponseLike = "cie"

    def temperature(self, spin: float, radius: Float[Array, " n"]) -> Float[Array, " n"]:
        """Temperature in kelvin: the fourth root of the flux."""
        return np.asarray(self.peak * np.sqrt(np.sqrt(page_thorne_flux(spin, radius) / _most_flux(spin))))


@lru_cache(maxsize=16)
def _most_flux(spin: float) -> float:
    low, high, flux = _isco(spin), 4 * _isco(spin), np.zeros(1)
    # The second table lies about the maximum of the first: steps of 1e-6 change the flux by 1e-12.
    for _ in range(2):
        radius = np.linspace(low, high, _RADII)
        flux = page_thorne_flux(spin, radius)
        best = int(np.argmax(flux))
        low, high = radius[max(best - 1, 0)], radius[min(best + 1, _RADII - 1)]
    return float(flux.max())


def page_thorne_flux(spin: float, radius: ArrayLike) -> Float[Array, "*batch"]:
    """Flux (...,) of a face of a steady thin disk, per accretion rate, in 1 / (4 pi) of the units G = c = M = 1.

    Parameters: spin, negative for a retrograde disk; radius (...,); inside the ISCO the flux is 0.
    Errors: next to the ISCO, where the flux vanishes as the square of the distance, 1e-15 of that at its peak.
    References: Page & Thorne 1974, ApJ 191, 499, eq. 15n; 4 pi times their f times the flux per area of both faces.
    """
    r = np.asarray(radius, float)
    return np.asarray(kernel("thin_disk_flux").on_rays(_thin_disk(spin), [r.ravel()])).reshape(r.shape)


@lru_cache(maxsize=16)
def _thin_disk(spin: float) -> tuple[float, ...]:
    """The parameters of the law for its kernel."""
    third = math.acos(spin) / 3
    roots = (2 * math.cos(third - math.pi / 3), 2 * math.cos(third + math.pi / 3), -2 * math.cos(third))
    shares = []
    for i, root in enumerate(roots):
        first, second = (roots[j] for j in range(3) if j != i)
        # At spin 0 one of the roots is 0, and its term vanishes.
        share = 3 * (root - spin) ** 2 / (root * (root - first) * (root - second)) if abs(root) > 1e-12 else 0.0
        shares.append(share)
    return spin, math.sqrt(_isco(spin)), *roots, *shares


def _isco(spin: float) -> float:
    return kerr.isco(abs(spin), prograde=spin >= 0)


@dataclass(frozen=True, eq=False)
class Swatches(Emission):
    """Paint swatches between circles and radii, alternating in brightness, with gaps, as in JTFT fig 13.

    Parameters
    ----------
    rows, columns : int
        Numbers of swatches from rim to rim, and once round; columns must be even.
    gap : float
        Part of a swatch's period, below 1, that the gap takes up, in either direction.
    colours : tuple of str
        "#rrggbb" from the inner rim to the outer one; rows between two of them are mixed in linear light.
    gap_colour : str

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Averages are exact for a box in radius and azimuth.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.disks.Swatches(rows=3, columns=12).rows
    3
    """

    rows: int = 5
    columns: int = 40
    gap: float = 0.16
    colours: tuple[str, ...] = COLOURS
    gap_colour: str = GAP_COLOUR

    def __post_init__(self) -> None:
        """Raise ValueError unless the pattern is valid."""
        check_pattern(self, least_rows=1)

    @cached_property
    def _paint(self) -> tuple[tuple[float, ...], Float[Array, "rows 12"]]:
        """Arguments of the kernel: the colour of the gaps, and the table of rows."""
        background = from_srgb(self.gap_colour)
        bright = mixed(self.colours, self.rows)
        # The brighter swatches of a row are those whose column has its parity.
        even = (np.arange(self.rows) % 2 == 0)[:, None]
        colours = np.stack([np.where(own, bright, DARKER * bright) for own in (even, ~even)], axis=1) - background
        above = np.cumsum((1 - self.gap) * colours, axis=0) - (1 - self.gap) * colours
        return tuple(background), np.concatenate([above, colours], axis=1).reshape(-1, 12)

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3), as of paint in daylight."""
        background, table = self._paint
        numbers = self.rows, self.columns, self.gap, *background, samples.width
        columns = samples.across, samples.azimuth, samples.radius, samples.matrix.reshape(-1, 4)
        light = np.asarray(kernel("paint").on_rays(numbers, columns, tables=[table]))
        return light * shifted_light(samples.redshift, beaming, colour_shift) if beaming or colour_shift else light

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """A large number if an edge may be in sight: not within one swatch, nor in the gap between two rows."""
        painted, bare, coarse = (np.full(len(low), value) for value in (True, False, False))
        for axis, period in ((0, 1 / self.rows), (1, 2 * math.pi / self.columns)):
            # Periods from the start of the paint.
            first = low[:, axis] / period - self.gap / 2
            within = first - np.floor(first)
            last = within + (high - low)[:, axis] / period
            painted &= (within > 0) & (last < 1 - self.gap)
            if axis == 0:
                bare = (within > 1 - self.gap) & (last < 1) & (low[:, 0] > 0) & (high[:, 0] < 1)
            coarse |= size[:, axis] > 0.3 * period
        return np.where(painted | bare, 1, np.where(coarse, 2 * _PARTS, _PARTS))
