"""Equirectangular pictures as the celestial sphere."""

import errno
import math
import os
import warnings
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from kerrcaustics.astronomy import healpix, plate_carree
from kerrcaustics.extras import needed
from kerrcaustics.files import check_path, reading
from kerrcaustics.scenes.colour import decoded, shift_of
from kerrcaustics.scenes.footprint import ASPECT, Footprint, averaged
from kerrcaustics.scenes.scene_checks import check_brightness, check_light, check_number
from kerrcaustics.spacetime.checks import quoted, real_array
from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

_ENDINGS = (".png", ".jpg", ".jpeg", ".exr")
_FEWEST_ROWS, _MOST_ROWS = 4, 8192
# Bytes of a file, and pixels of a picture, as Pillow has them.
_LARGEST, _MOST_PIXELS, _TOO_MANY = 4_000_000_000, 178_956_970, "it has too many pixels"
# The coarsest level of the pyramid has at least so many rows.
_COARSEST = 4


class Panorama:
    """A sky from an equirectangular picture seen from inside the sphere, as photographs of a whole sky are.

    Parameters
    ----------
    light : (h, 2 h, 3) array
        Linear sRGB, any unit. The north pole is above; the middle lies at phi' = pi, behind the hole for a camera at
        azimuth 0, and phi' grows to the left: writing reads as it does on the picture.
    orientation : float, (3,) or (3, 3) array, optional
        Radians to the right, up and clockwise: the place so far to the right of the picture's middle and above it lies
        at phi' = pi on the equator, and the picture is turned clockwise about that; a single number is the first of
        them. Or a rotation from the axes of the picture to those of the celestial sphere.
    mirror : bool
        True for a chart of the sphere from outside, as a globe shows it: phi' grows to the right, from 0 to 2 pi.
    aspect : float
        Footprints longer than this many times their width are widened: fewer look-ups, for skies with little detail.
    spectrum : float, (3,) or (n, 2) array, optional
        Spectrum of the picture's light, for a shift of its colours: the exponent alpha of a power law, S_nu as
        nu^alpha, or three, for what is shown as red, green and blue; or a table of wavelengths (nm, increasing) and
        powers per wavelength in any unit, linear in between and 0 beyond. If omitted, that of daylight.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Held as a pyramid of pictures, each half as fine as the one before. Every one is smoothed along its rows as far as
    its resolution requires on the sphere, which is more and more pixels toward the poles: a look-up therefore averages
    over round neighbourhoods, the poles included. Look-ups are linear within a picture and between two, and go on
    across the edge phi' = 0 and across the poles.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import numpy as np
    >>> kc.skies.Panorama(np.ones((16, 32, 3)))
    <Panorama of 32 x 16 pixels>
    """

    def __init__(
        self,
        light: ArrayLike,
        orientation: ArrayLike | None = None,
        aspect: float = ASPECT,
        *,
        mirror: bool = False,
        spectrum: ArrayLike | None = None,
    ) -> None:
        """Smooth the picture at every level; see the class."""
        picture = real_array("light", light, np.float32)
        if picture.ndim != 3 or picture.shape[1:] != (2 * picture.shape[0], 3):
            raise ValueError(f"Argument `light` must have shape (h, 2 h, 3), but has {picture.shape}.")
        if not _FEWEST_ROWS <= len(picture) <= _MOST_ROWS:
            raise ValueError(f"Argument `light` must have {_FEWEST_ROWS} to {_MOST_ROWS} rows, but has {len(picture)}.")
        check_light("light", picture)
        self.orientation = oriented(orientation, mirror)
        check_number("aspect", aspect, "be a finite number from 1 on", lambda ratio: 1 <= ratio < math.inf)
        self.rows, self.aspect, self._shift = len(picture), aspect, shift_of(spectrum)
        # Held as a chart; of what is grey, one channel.
        picture = picture if mirror else picture[:, ::-1]
        grey = (picture == picture[..., :1]).all()
        self._levels = [_padded(level) for level in _pyramid(picture[..., :1] if grey else picture)]

    def __repr__(self) -> str:
        """Return a line with its size."""
        return f"<Panorama of {2 * self.rows} x {self.rows} pixels>"

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        orientation: ArrayLike | None = None,
        *,
        mirror: bool = False,
        brightness: float = 1.0,
        spectrum: ArrayLike | None = None,
    ) -> "Panorama":
        """The panorama of a PNG, JPEG or OpenEXR file, twice as wide as high, or of a FITS image of the whole sky.

        A picture counts as a photograph; mirror: it is a chart, as for the class; brightness: factor of its light;
        spectrum: as for the class.

        Values of PNG and JPEG count as sRGB, those of OpenEXR and FITS as linear; OpenEXR needs the package of that
        name, FITS astropy. FITS images (.fits, .fit, .fits.gz) are plate carree, of one plane (grey) or three; theta'
        and phi' are 90 degrees - latitude and longitude of whatever frame they are in, unless mirror turns them over.
        """
        check_brightness(brightness)
        if plate_carree.is_fits(path):
            return cls(brightness * plate_carree.read_sky(path), orientation, mirror=not mirror, spectrum=spectrum)
        values = read_picture(path)
        if values.shape[1] != 2 * values.shape[0]:
            raise ValueError(
                f"Argument `path` must name a picture twice as wide as high, but {os.fspath(path)!r} has "
                f"{values.shape[1]} x {values.shape[0]} pixels."
            )
        return cls(brightness * values, orientation, mirror=mirror, spectrum=spectrum)

    @classmethod
    def from_healpix(
        cls,
        values: ArrayLike,
        order: healpix.Order = "ring",
        rows: int | None = None,
        orientation: ArrayLike | None = None,
        spectrum: ArrayLike | None = None,
    ) -> "Panorama":
        """The panorama of a HEALPix map (12 nside^2,), grey, or of three (3, 12 nside^2), linear between pixels.

        order is "ring" or "nested"; rows is 4 nside when left out. theta' and phi' are those of the map; spectrum: as
        for the class. Needs the package astropy-healpix.
        """
        light = healpix.plate_carree_of(values, order, rows)
        light = np.repeat(light, 3, axis=2) if light.shape[2] == 1 else light
        return cls(light, orientation, mirror=True, spectrum=spectrum)

    def to_healpix(self, nside: int, order: healpix.Order = "ring") -> Float32[Array, "3 pixels"]:
        """Light (3, 12 nside^2) in HEALPix, each the mean about a pixel's centre. Needs the package astropy-healpix."""
        theta, phi = healpix.centres(nside, order)
        return self.around(from_angles(theta, phi), np.full(len(theta), healpix.resolution(nside))).T

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels; its colours shift by the spectrum."""
        light = averaged(self._channels, footprint, finest=math.pi / self.rows, aspect=self.aspect)
        return light * self._shift(footprint.redshift, beaming, colour_shift)

    def around(self, direction: Float[Array, "m 3"], size: Float[Array, " m"]) -> Float32[Array, "m 3"]:
        """Light (m, 3) about directions (m, 3), averaged over neighbourhoods of sizes (m,) in radians."""
        light = self._channels(direction, size)
        return light if light.shape[1] == 3 else np.repeat(light, 3, axis=1)

    def _channels(self, direction: Float[Array, "m 3"], size: Float[Array, " m"]) -> Float32[Array, "m channels"]:
        """The same, and of a grey picture one channel."""
        x, y, z = self.orientation.T @ direction.T
        down, right = np.arctan2(np.sqrt(x * x + y * y), z) / math.pi, np.arctan2(y, x) / (2 * math.pi)
        right -= np.floor(right)
        level = np.clip(np.log2(np.maximum(size, 1e-9) * (self.rows / math.pi)), 0, len(self._levels) - 1)
        lower = np.minimum(level.astype(int), max(len(self._levels) - 2, 0))
        part = (level - lower).astype(np.float32)
        light = np.empty((len(self._levels[0]), len(down)), np.float32)
        for k in range(lower.min(initial=0), lower.max(initial=-1) + 1):
            which = np.flatnonzero(lower == k)
            place = down[which], right[which]
            fine = _looked_up(self._levels[k], *place)
            if k + 1 < len(self._levels):
                fine += part[which] * (_looked_up(self._levels[k + 1], *place) - fine)
            light[:, which] = fine
        return light.T


def save_sky(path: str | os.PathLike[str], light: ArrayLike, *, mirror: bool = False) -> None:
    """Write light (h, 2 h, 3) of a whole sky, as `celestial_picture` gives it for any sky, as a FITS image.

    In single precision, three planes. `Panorama.read` reads it. Needs the package astropy.

    Parameters
    ----------
    path : str or path
    light : (h, 2 h, 3) array
        Linear light, from the north pole down, phi' to the left from 2 pi to 0.
    mirror : bool
        True for a chart, phi' to the right from 0. The file says where phi' grows, and is the same for both.

    Raises
    ------
    ValueError
        If an argument is invalid.
    ImportError
        Without the package astropy.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.skies.save_sky("sky.fits", kc.skies.celestial_picture(kc.skies.Checkerboard(), 32))
    >>> kc.skies.Panorama.read("sky.fits").rows
    32
    """
    picture = real_array("light", light, np.float32)
    if picture.ndim != 3 or picture.shape[1:] != (2 * picture.shape[0], 3):
        raise ValueError(f"Argument `light` must have shape (h, 2 h, 3), but has {picture.shape}.")
    check_path(path)
    chart = picture if mirror else picture[:, ::-1]
    plate_carree.write(path, {"SKY": chart.transpose(2, 0, 1)}, {"CTYPE3": ("RGB", "red, green, blue; linear sRGB")})


def read_picture(path: str | os.PathLike[str]) -> Float[Array, "h w 3"]:
    """Linear light (h, w, 3) of a PNG, JPEG or OpenEXR file.

    Values of PNG and JPEG count as sRGB, those of OpenEXR as linear; OpenEXR needs the package of that name.
    """
    return read_picture_with_alpha(path)[0]


def read_picture_with_alpha(path: str | os.PathLike[str]) -> tuple[Float[Array, "h w 3"], Float[Array, "h w"] | None]:
    """Linear light (h, w, 3) of a file as by `read_picture`, and the alpha channel (h, w) of a PNG file, if any."""
    name = Path(path)
    if name.suffix.lower() not in _ENDINGS:
        raise ValueError(f"Argument `path` must end in {', '.join(_ENDINGS)}, but is {quoted(os.fspath(path))}.")
    linear = name.suffix.lower() == ".exr"
    try:
        with reading(name, _LARGEST):
            values = _read_exr(name) if linear else _read_screen(name)
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        reason = getattr(error, "strerror", None) or "it is no such picture"
        raise ValueError(
            f"Argument `path` must name a picture that can be read: {os.fspath(path)!r}: {reason}."
        ) from None
    if linear:
        return values, None
    return decoded(values[..., :3]), values[..., 3] if values.shape[2] == 4 else None


def _read_screen(path: Path) -> Float32[Array, "h w channels"]:
    """Three channels, and a fourth of a picture with alpha."""
    from PIL import Image

    with warnings.catch_warnings():
        # Pillow warns of pictures that are large for it, and are not for a sky.
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            with Image.open(path) as file:
                clear = "A" in file.getbands() or "transparency" in file.info
                mode = "RGBA" if clear else "RGB"
                return np.asarray(file.convert(mode), np.float32) / 255
        except Image.DecompressionBombError:
            raise OSError(errno.EFBIG, _TOO_MANY) from None


def _read_exr(path: Path) -> Float32[Array, "h w 3"]:
    OpenEXR = needed("exr", "OpenEXR")
    with OpenEXR.File(str(path), header_only=True) as file:
        low, high = file.header()["dataWindow"]
        if math.prod(1 + int(b) - int(a) for a, b in zip(low, high, strict=True)) > _MOST_PIXELS:
            raise OSError(errno.EFBIG, _TOO_MANY)
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        name = next(name for name in ("RGB", "RGBA") if name in channels) if {"RGB", "RGBA"} & set(channels) else "Y"
        values = np.asarray(channels[name].pixels, np.float32)
    grey = values.ndim == 2
    return np.repeat(values[..., None], 3, axis=2) if grey else values[..., :3]


def rotation(matrix: ArrayLike | None) -> Float[Array, "3 3"]:
    """The matrix (3, 3) of an argument `orientation`, the identity when left out."""
    if matrix is None:
        return np.eye(3)
    value = real_array("orientation", matrix)
    if value.shape != (3, 3) or not np.allclose(value @ value.T, np.eye(3), atol=1e-6) or np.linalg.det(value) < 0:
        raise ValueError("Argument `orientation` must be a rotation, a (3, 3) matrix.")
    return value


def oriented(value: ArrayLike | None, mirror: bool) -> Float[Array, "3 3"]:
    """The matrix (3, 3) of a panorama's argument `orientation`: of angles, or as it is."""
    if value is None or np.ndim(value) == 2:
        return rotation(value)
    angles = np.atleast_1d(real_array("orientation", value))
    if angles.shape not in ((1,), (3,)) or not np.isfinite(angles).all():
        raise ValueError(f"Argument `orientation` must be one angle or three, or a rotation, but is {quoted(value)}.")
    right, up, roll = np.pad(angles, (0, 3 - len(angles))).tolist()
    return Rotation.from_euler("zyx", [-right if mirror else right, -up, -roll]).as_matrix()


def _pyramid(picture: Float32[Array, "h w 3"]) -> list[Float32[Array, "_h _w 3"]]:
    """The picture and coarser ones, each smoothed along its rows."""
    levels = [_smoothed(picture)]
    while len(levels[-1]) % 2 == 0 and len(levels[-1]) // 2 >= _COARSEST:
        levels.append(_smoothed(_halved(levels[-1])))
    return levels


def _halved(picture: Float32[Array, "h w 3"]) -> Float32[Array, "h//2 w//2 3"]:
    """Means of two by two pixels, weighted by their areas on the sphere."""
    rows = len(picture)
    weight = np.sin((np.arange(rows) + 0.5) * math.pi / rows).astype(np.float32).reshape(-1, 2, 1, 1)
    pairs = picture.reshape(rows // 2, 2, *picture.shape[1:])
    tall = (pairs * weight).sum(axis=1) / weight.sum(axis=1)
    return (tall[:, ::2] + tall[:, 1::2]) / 2


def _smoothed(picture: Float32[Array, "h w 3"]) -> Float32[Array, "h w 3"]:
    """Rows smoothed by a Gaussian as wide as a row is high, where that is more than a pixel.

    Half a row's height on the sphere is what look-ups have for a deviation; the pixels' own is taken off.
    """
    rows = len(picture)
    s = np.sin((np.arange(rows) + 0.5) * math.pi / rows)
    deviation = 0.5 * np.sqrt(np.maximum(1 / s**2 - 1, 0))
    wave = np.fft.rfftfreq(picture.shape[1]) * 2 * math.pi
    result = np.empty_like(picture)
    for i, row in enumerate(picture):
        damping = np.exp(-((deviation[i] * wave) ** 2) / 2)[:, None]
        result[i] = np.fft.irfft(np.fft.rfft(row, axis=0) * damping, n=len(row), axis=0)
    # A Gaussian that is no wider than pixels rings beside bright ones.
    return np.maximum(result, 0)


def _padded(picture: Float32[Array, "h w channels"]) -> Float32[Array, "channels h+2 w+2"]:
    """The picture with a pixel more on every side: the other edge's at the sides, beyond the pole above and below."""
    half = picture.shape[1] // 2
    tall = np.concatenate([np.roll(picture[:1], half, axis=1), picture, np.roll(picture[-1:], half, axis=1)])
    return np.ascontiguousarray(np.concatenate([tall[:, -1:], tall, tall[:, :1]], axis=1).transpose(2, 0, 1))


def _looked_up(
    padded: Float32[Array, "channels h w"], down: Float[Array, " m"], right: Float[Array, " m"]
) -> Float32[Array, "channels m"]:
    """Light (channels, m) at parts of the height and width of a padded picture, linear between pixels."""
    rows, columns = padded.shape[1] - 2, padded.shape[2] - 2
    y, x = down * rows + 0.5, right * columns + 0.5
    i, j = np.minimum(y.astype(int), rows), np.minimum(x.astype(int), columns)
    v, u = (y - i).astype(np.float32), (x - j).astype(np.float32)
    start, below = i * (columns + 2) + j, columns + 2
    light = np.empty((len(padded), len(start)), np.float32)
    for k, channel in enumerate(padded.reshape(len(padded), -1)):
        first, second, third, last = (channel[step:].take(start) for step in (0, 1, below, below + 1))
        upper, lower = first + u * (second - first), third + u * (last - third)
        light[k] = upper + v * (lower - upper)
    return light
