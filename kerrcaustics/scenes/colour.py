"""Light and colour: black bodies as linear sRGB, shifts of frequency, white balance."""

import math
import os
import re
from collections.abc import Callable
from functools import cache, partial
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.files import read_text
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.scenes.scene_checks import check_light, check_number
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import one_of, quoted, real_array

Array = np.ndarray
Reals = Float[Array, "*batch"]
Shift = Callable[[Reals, bool, bool], Float[Array, "*batch 3"]]
"""Factors of light as `shifted_light` gives them."""

Response = Literal["cie", "film"]
RESPONSES: tuple[Response, ...] = get_args(Response)


class MeasuredResponse:
    """Measured sensitivities of the layers of a film, or of a sensor, for the argument `response`.

    Parameters
    ----------
    wavelengths : (n,) array
        Nanometres, increasing; between them the curves are linear, beyond them zero.
    sensitivities : (n, 3) array
        Sensitivities of the layers that become red, green and blue, per energy of the light; in any unit, as each is
        divided by its response to the white black body.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> curves = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0]])
    >>> response = kc.pictures.MeasuredResponse([450, 550, 650], curves)
    >>> red, green, blue = kc.pictures.black_body(3000.0, response=response)
    >>> bool(red > green > blue)
    True
    """

    def __init__(self, wavelengths: ArrayLike, sensitivities: ArrayLike) -> None:
        """Check the curves."""
        self.wavelengths = real_array("wavelengths", wavelengths)
        self.sensitivities = real_array("sensitivities", sensitivities)
        count = len(self.wavelengths) if self.wavelengths.ndim == 1 else 0
        if count < 2 or not (np.isfinite(self.wavelengths).all() and (np.diff(self.wavelengths) > 0).all()):
            raise ValueError("Argument `wavelengths` must hold two growing numbers or more.")
        if self.sensitivities.shape != (count, 3):
            shape = self.sensitivities.shape
            raise ValueError(f"Argument `sensitivities` must have shape ({count}, 3), but has {shape}.")
        check_light("sensitivities", self.sensitivities)
        if not self.interpolated(_WAVELENGTHS).sum(axis=1).all():
            first, last = _WAVELENGTHS[[0, -1]]
            raise ValueError(f"Argument `sensitivities` must be above 0 somewhere in {first:g} to {last:g} nm in each.")

    def __repr__(self) -> str:
        """Return a line with the range of wavelengths."""
        return f"<MeasuredResponse, {self.wavelengths[0]:g} to {self.wavelengths[-1]:g} nm>"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> "MeasuredResponse":
        """The curves of a text file: four numbers in each line, with commas or spaces, below lines with # or words.

        Wavelength in nanometres; sensitivities for red, green and blue.
        """
        rows = [re.split(r"[,;\s]+", line.strip()) for line in read_text(path, _LONGEST_TABLE).splitlines()]
        numbered = [row for row in rows if row[0] and re.match(r"[-+.\d]", row[0])]
        try:
            table = np.array(numbered, float).reshape(-1, 4) if numbered else np.empty((0, 4))
        except ValueError:
            raise ValueError("Argument `path` must name a file with four numbers in each line.") from None
        return cls(table[:, 0], table[:, 1:])

    def interpolated(self, wavelengths: Float[Array, " m"]) -> Float[Array, "3 m"]:
        """Sensitivities (3, m) at wavelengths."""
        curves = self.sensitivities.T
        return np.stack([np.interp(wavelengths, self.wavelengths, curve, 0.0, 0.0) for curve in curves])


ResponseLike = str | MeasuredResponse
"""A name of `RESPONSES`, or measured curves."""

DAYLIGHT = 6504.0
"""Temperature (K) of the black body that stands for the white of sRGB."""

# Second radiation constant, nm K.
_HC_OVER_K = 1.438776877e7
# Lowest temperature of the table of black bodies, kelvin.
_COOLEST = 300.0
# Highest temperature of this table, kelvin.
_HOTTEST = 1e6
# Number of its temperatures, at equal steps of the logarithm.
_TEMPERATURES = 600
# Shortest wavelength of a user's spectrum, nm.
_SHORTEST = 1.0
# Longest wavelength of a user's spectrum, nm.
_LONGEST = 1e6
# Step in ln g of the table of a shifted spectrum.
_FINE = 0.002
# Wavelengths at which spectra are integrated, nm.
_WAVELENGTHS = np.arange(360.0, 831.0, 2.0)
# Lobes (height, centre, width below, width above; nm) of the colour-matching functions x, y, z.
_LOBES = (
    ((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
    ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
    ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)),
)
# Sensitivities (centre, deviation; nm) of the layers of the model film that become red, green and blue.
_LAYERS = ((640.0, 25.0), (545.0, 25.0), (445.0, 25.0))
# Largest file of curves, bytes.
_LONGEST_TABLE = 10_000_000
# From XYZ to linear sRGB, IEC 61966-2-1.
_TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@usual_warnings
def black_body(
    temperature: ArrayLike, white: float = DAYLIGHT, response: ResponseLike = "cie"
) -> Float[Array, "*batch 3"]:
    """Linear sRGB (..., 3) of black bodies, per area and solid angle, with a white balance.

    Parameters
    ----------
    temperature : (...,) array
        Kelvin; values below 300 or above 1e6 count as these limits.
    white : float
        Temperature (K) of the black body that looks white, and has luminance 1.
    response : str or MeasuredResponse
        Response to a spectrum in three channels. "cie": the eye, by the CIE functions. "film": a colour film, whose
        layers see red, green and blue alone, and whose three dyes are shown as the channels of the screen. Measured
        curves are used likewise, in place of the model's.

    Returns
    -------
    (..., 3) array
        Channels divided by those of the white black body, cut at zero where they leave the range of a screen.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    The colour-matching functions are the analytic fit of the reference, about 1 % of the maximum. The film is a model
    of this package, not a product: Gaussians of deviation 25 nm about 640, 545 and 445 nm, linear in the light.

    References
    ----------
    Wyman, Sloan & Shirley 2013, J. Comput. Graph. Tech. 2(2), eq. 4: the CIE 1931 functions.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> red, green, blue = kc.pictures.black_body(3000.0)
    >>> bool(red > green > blue)
    True
    """
    check_number("white", white, "lie in [1000, 40000] kelvin", lambda kelvin: 1000 <= kelvin <= 40000)
    check_response(response)
    kelvin = real_array("temperature", temperature)
    if not (kelvin >= 0).all():
        raise ValueError(f"Argument `temperature` must be from 0 kelvin on, but is {quoted(temperature)}.")
    return _black_body(kelvin, white, response)


def _black_body(kelvin: ArrayLike, white: float = DAYLIGHT, response: ResponseLike = "cie") -> Float[Array, "*batch 3"]:
    """The light of `black_body`, of temperatures that may be NaN."""
    kelvin = np.asarray(kelvin, float)
    logarithms, table = _table(response)
    ends = logarithms[0], logarithms[-1], len(logarithms) - 1
    numbers = *ends, *_interpolated(np.asarray(white), response)
    light = kernel("black_body").on_rays(numbers, [kelvin.ravel()], tables=[table.T])
    return np.asarray(light).reshape(*kelvin.shape, 3)


def luminance(light: ArrayLike) -> Float[Array, "*batch"]:
    """Luminance (...,) of linear sRGB light (..., 3)."""
    return np.asarray(np.asarray(light) @ _LUMINANCE)


def star_temperature(colour_index: ArrayLike) -> Float[Array, "*batch"]:
    """Temperature (...,) in kelvin of stars of colour index B - V (...,).

    References: Ballesteros 2012, EPL 97 34008, eq. 14; B - V is cut to [-0.4, 2.5], where it was tested.
    """
    index = np.clip(np.asarray(colour_index, float), -0.4, 2.5)
    return np.asarray(4600 * (1 / (0.92 * index + 1.7) + 1 / (0.92 * index + 0.62)))


def shifted_light(
    redshift: Reals,
    beaming: bool,
    colour_shift: bool,
    temperature: ArrayLike = DAYLIGHT,
    response: ResponseLike = "cie",
) -> Float[Array, "*batch 3"]:
    """Factors (..., 3) of linear sRGB light that comes with frequency ratios g = nu_camera / nu_source (...,).

    Parameters
    ----------
    redshift : (...,) array
    beaming : bool
        Intensity times g^4, over all frequencies. Otherwise the luminance is kept.
    colour_shift : bool
        The spectrum is shifted by g: a black body of temperature T looks like a black body of g T.
    temperature : float or (...,) array
        Temperature of the light's source; pictures and swatches count as lit by daylight.
    response : str
        As for `black_body`.

    Notes
    -----
    With both, the factor is the ratio of the black bodies of g T and T: I_nu / nu^3 is the same for all observers, so
    that Planck's law at T becomes Planck's law at g T, brightness and all.
    """
    if not (beaming or colour_shift):
        return np.ones((*np.shape(redshift), 3))
    if not colour_shift:
        return np.repeat((np.asarray(redshift) ** 4)[..., None], 3, axis=-1)
    before = _black_body(temperature, response=response)
    return _factor(before, _black_body(np.asarray(temperature) * redshift, response=response), beaming)


def _factor(before: Float[Array, "*_ 3"], after: Float[Array, "*batch 3"], beaming: bool) -> Float[Array, "*batch 3"]:
    """Factors of light from its channels before and after the shift; without beaming the luminance is kept."""
    factor = after / before
    if beaming:
        return factor
    bright = luminance(after)[..., None]
    scaled = factor * luminance(before)[..., None]
    return np.divide(scaled, bright, out=np.zeros_like(scaled), where=bright > 0)


def shift_of(spectrum: ArrayLike | None) -> Shift:
    """The shift of light with a spectrum, as `shifted_light` with its first three arguments.

    Parameters
    ----------
    spectrum : float, (3,) or (n, 2) array, optional
        An exponent alpha, or those of red, green and blue: S_nu goes as nu^alpha. Or a table: wavelengths (nm),
        increasing, and powers per wavelength, in any unit; linear in between, and 0 beyond. If omitted, that of
        daylight.

    Raises
    ------
    ValueError
        If the spectrum is invalid, or has no light that can be seen.

    Notes
    -----
    I_nu / nu^3 is the same for all observers: a power law stays one, g^(3 - alpha) times as bright; of a table
    I_lambda(lambda) is g^5 times that of the source at g lambda, seen by the CIE functions.
    """
    if spectrum is None:
        return shifted_light
    values = real_array("spectrum", spectrum)
    valid = bool(np.isfinite(values).all())
    if valid and values.shape in ((), (3,)):
        return partial(_shifted, partial(_power_law, values))
    wavelength, power = values.T if values.ndim == 2 and values.shape[1] == 2 else (np.zeros(0), np.zeros(0))
    valid &= len(wavelength) > 1 and bool((np.diff(wavelength) > 0).all() and (power >= 0).all())
    if not valid or wavelength[0] < _SHORTEST or wavelength[-1] > _LONGEST:
        must = "be an exponent, three of them, or a table of growing wavelengths (1 to 1e6 nm) and powers from 0 on"
        raise ValueError(f"Argument `spectrum` must {must}, but is {quoted(spectrum)}.")
    grid, channels = _shifted_table(wavelength, power)
    if not _tabulated(grid, channels, np.ones(())).any():
        raise ValueError("Argument `spectrum` must have light between 360 and 830 nm.")
    return partial(_shifted, partial(_tabulated, grid, channels))


def _shifted(
    light: Callable[[Reals], Array], redshift: Reals, beaming: bool, colour_shift: bool
) -> Float[Array, "*batch 3"]:
    """Factors of light; light: its channels for a frequency ratio."""
    if not colour_shift:
        return shifted_light(redshift, beaming, False)
    return _factor(light(np.ones(())), light(np.asarray(redshift)), beaming)


def _power_law(exponent: Float[Array, "*_"], redshift: Reals) -> Float[Array, "*batch 3"]:
    return redshift[..., None] ** (3 - exponent) * np.ones(3)


def _tabulated(grid: Float[Array, " n"], channels: Float[Array, "n 3"], redshift: Reals) -> Float[Array, "*batch 3"]:
    """Channels of a table for frequency ratios; 0 for spectra shifted out of the visible range."""
    place = np.log(redshift)
    return np.stack([np.interp(place, grid, part, 0.0, 0.0) for part in channels.T], axis=-1)


def _shifted_table(
    wavelength: Float[Array, " m"], power: Float[Array, " m"]
) -> tuple[Float[Array, " n"], Float[Array, "n 3"]]:
    """Logarithms (n,) of frequency ratios, and the channels (n, 3) of a table seen with them."""
    ends = math.log(wavelength[0] / _WAVELENGTHS[-1]), math.log(wavelength[-1] / _WAVELENGTHS[0])
    grid = np.linspace(*ends, math.ceil((ends[1] - ends[0]) / _FINE) + 1)
    ratio = np.exp(grid)[:, None]
    spectrum = ratio**5 * np.interp(ratio * _WAVELENGTHS, wavelength, power, 0.0, 0.0)
    # In units of the white black body, as other light.
    return grid, _channels(spectrum, "cie") / np.exp(_interpolated(np.asarray(DAYLIGHT), "cie"))


def seen_black_body(
    temperature: Reals, redshift: Reals, beaming: bool, colour_shift: bool, response: ResponseLike = "cie"
) -> Float[Array, "*batch 3"]:
    """Linear sRGB (..., 3) of black bodies seen with frequency ratios g (...,); 0 where the temperature is 0.

    Switches as for `shifted_light`.
    """
    kelvin, shines = np.maximum(temperature, 1.0), (np.asarray(temperature) > 0)[..., None]
    if beaming and colour_shift:
        return _black_body(kelvin * redshift, response=response) * shines
    factor = shifted_light(redshift, beaming, colour_shift, kelvin, response)
    return _black_body(kelvin, response=response) * factor * shines


def from_srgb(colour: str, name: str = "colour") -> Float[Array, "3"]:
    """Linear light (3,) of "#rrggbb"; name: the name of the argument."""
    if not (isinstance(colour, str) and re.fullmatch("#[0-9a-fA-F]{6}", colour)):
        raise ValueError(f'Argument `{name}` must look like "#rrggbb", but is {quoted(colour)}.')
    return decoded(np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]))


def decoded(values: ArrayLike) -> Float[Array, "*shape"]:
    """Linear light of sRGB values in [0, 1] (IEC 61966-2-1)."""
    values = np.asarray(values)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def encoded(light: ArrayLike) -> Float[Array, "*shape"]:
    """sRGB values in [0, 1] of linear light, which is cut to [0, 1]."""
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def check_response(response: ResponseLike) -> None:
    """Raise ValueError unless the response is valid."""
    if not isinstance(response, MeasuredResponse):
        one_of("response", response, RESPONSES)


def _interpolated(temperature: Float[Array, "*batch"], response: ResponseLike) -> Float[Array, "*batch 3"]:
    """Logarithms (..., 3) of the channels."""
    grid, channels = _table(response)
    place = np.log(np.clip(temperature, _COOLEST, _HOTTEST))
    return np.stack([np.interp(place, grid, channel) for channel in channels], axis=-1)


@cache
def _table(response: ResponseLike) -> tuple[Float[Array, " n"], Float[Array, "3 n"]]:
    """Logarithms of temperatures (n,), and of the channels (3, n) of their black bodies."""
    grid = np.linspace(math.log(_COOLEST), math.log(_HOTTEST), _TEMPERATURES)
    ratio = _HC_OVER_K / (_WAVELENGTHS * np.exp(grid)[:, None])
    spectrum = (_WAVELENGTHS / 560.0) ** -5 * np.exp(-ratio) / -np.expm1(-ratio)
    return grid, np.log(np.maximum(_channels(spectrum, response), 1e-300)).T


def _channels(spectrum: Float[Array, "n wavelengths"], response: ResponseLike) -> Float[Array, "n 3"]:
    """Linear channels (n, 3) of spectra per wavelength."""
    if response != "cie":
        model = [_lobe(1.0, centre, width, width) for centre, width in _LAYERS]
        layers = response.interpolated(_WAVELENGTHS) if isinstance(response, MeasuredResponse) else np.stack(model)
        return spectrum @ layers.T
    matching = np.stack([sum(_lobe(*lobe) for lobe in lobes) for lobes in _LOBES])
    light = spectrum @ matching.T @ _TO_SRGB.T
    # A channel outside the range of a screen keeps a small value, so that ratios stay finite.
    return np.maximum(light, 1e-3 * (light @ _LUMINANCE)[:, None])


def _lobe(height: float, centre: float, below: float, above: float) -> Float[Array, " wavelengths"]:
    width = np.where(centre > _WAVELENGTHS, below, above)
    return height * np.exp(-(((_WAVELENGTHS - centre) / width) ** 2) / 2)
