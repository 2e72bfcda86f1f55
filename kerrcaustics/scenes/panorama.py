"""Equirectangular pictures as the celestial sphere."""

import math
import os
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.files import check_path
from kerrcaustics.interop import healpix, plate_carree
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.stages import stage
from kerrcaustics.scenes.colour import shift_of
from kerrcaustics.scenes.footprint import ASPECT, LONGEST, Footprint, averaged
from kerrcaustics.scenes.light_files import has_bytes, rows_of, size_of
from kerrcaustics.scenes.scene_checks import check_brightness, check_light, check_light_of_file, check_number, not_light
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.scenes.sphere_pyramid import SphereRows, pyramid
from kerrcaustics.shapes import Float, Float32
from kerrcaustics.spacetime.checks import flags, quoted, real_array
from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

# Smallest and largest number of rows.
_FEWEST_ROWS, _MOST_ROWS = 4, 8192
# Rows of arrays that are smoothed together.
_BLOCK = 64
LARGE = 4096
"""Rows from which a file of 8 bits a channel is held in half precision, which still resolves its values."""
# Factors of its light between which half precision resolves them.
_LOWEST, _HIGHEST = 0.1, 1e4


class Panorama(Sky):
    """A sky from an equirectangular picture seen from inside the sphere, as photographs of a whole sky are.

    Parameters
    ----------
    light : (h, 2 h, 3) array
        Linear sRGB, any unit. The north pole is above; the middle lies at phi' = pi, behind the hole for a camera at
        azimuth 0, and phi' grows to the left: writing reads as it does on the picture.
    orientation : float, (3,) or (3, 3) array, optional
        Three angles, radians: the place at the first angle to the right of the picture's middle and the second above it
        lies at phi' = pi on the equator, and the picture is turned clockwise about it by the third; a single number is
        the first angle. Or a rotation from the axes of the picture to those of the celestial sphere.
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
    Held as a pyramid of pictures, each half as fine as the one before. Each is smoothed along its rows to its own
    resolution on the sphere, over more pixels toward the poles, so that a look-up averages over round neighbourhoods
    everywhere. Look-ups are linear within a picture and between two, and continuous across phi' = 0 and the poles.

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
        flags(mirror=mirror)
        picture = real_array("light", light, np.float32)
        if picture.ndim != 3 or picture.shape[1:] != (2 * picture.shape[0], 3):
            raise ValueError(f"Argument `light` must have shape (h, 2 h, 3), but has {picture.shape}.")
        if not _FEWEST_ROWS <= len(picture) <= _MOST_ROWS:
            raise ValueError(f"Argument `light` must have {_FEWEST_ROWS} to {_MOST_ROWS} rows, but has {len(picture)}.")
        check_light("light", picture)
        self._hold(len(picture), _blocks(picture, mirror), oriented(orientation, mirror), spectrum, aspect)

    def _hold(
        self,
        rows: int,
        blocks: Iterable[SphereRows],
        orientation: Array,
        spectrum: ArrayLike | None,
        aspect: float = ASPECT,
        precision: type[np.floating] = np.float32,
    ) -> None:
        """Keep the rows of a chart as a pyramid."""
        check_number("aspect", aspect, "be a finite number from 1 on", lambda ratio: 1 <= ratio < math.inf)
        self.orientation, self.rows, self.aspect, self._shift = orientation, rows, aspect, shift_of(spectrum)
        self._pyramid = pyramid(rows, blocks, precision)

    def __repr__(self) -> str:
        """Return a line with its size."""
        return f"<Panorama of {2 * self.rows} x {self.rows} pixels>"

    @classmethod
    @with_progress
    @stage("picture_of_the_sky")
    def read(
        cls,
        path: str | os.PathLike[str],
        orientation: ArrayLike | None = None,
        *,
        mirror: bool = False,
        brightness: float = 1.0,
        spectrum: ArrayLike | None = None,
        progress: Progress | bool | None = None,
    ) -> "Panorama":
        """The panorama of a PNG, JPEG or OpenEXR file, twice as wide as high, or of a FITS image of the whole sky.

        A picture counts as a photograph; mirror: it is a chart, as for the class; brightness: factor of its light;
        spectrum: as for the class.

        Values of PNG and JPEG count as sRGB, those of OpenEXR and FITS as linear; OpenEXR needs the package of that
        name, FITS astropy. FITS images (.fits, .fit, .fits.gz) are plate carree, of one plane (grey) or three; theta'
        and phi' are 90 degrees - latitude and longitude of whatever frame they are in, unless mirror turns them over.

        PNG files of 16 bits are read if they are grey. Photographs are turned by their EXIF tag. Transparent
        parts are dark. The file is read by rows: beside the panorama little memory is needed. progress: as
        for `render`.
        """
        check_brightness(brightness)
        flags(mirror=mirror)
        fits = plate_carree.is_fits(path)
        chart = mirror != fits
        rows, blocks = _fits_rows(path) if fits else _picture_rows(path)
        half = rows >= LARGE and _LOWEST <= brightness <= _HIGHEST and not fits and has_bytes(path)
        panorama, turn = cls.__new__(cls), oriented(orientation, chart)
        light = _as_chart(path, blocks, chart, brightness)
        panorama._hold(rows, light, turn, spectrum, precision=np.float16 if half else np.float32)
        return panorama

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
        return self.light_about(from_angles(theta, phi), np.full(len(theta), healpix.resolution(nside))).T

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels; its colours shift by the spectrum."""
        return self._averaged(footprint) * self._shift(footprint.redshift, beaming, colour_shift)

    def light_about(self, direction: Float[Array, "m 3"], size: Float[Array, " m"]) -> Float32[Array, "m 3"]:
        """Light (m, 3) about directions (m, 3), averaged over neighbourhoods of sizes (m,) in radians."""
        round_ones = Footprint(direction, size[:, None, None] * np.eye(2), np.zeros(len(size)), np.ones(len(size)))
        light = self._averaged(round_ones, math.inf).astype(np.float32)
        return light if light.shape[1] == 3 else np.repeat(light, 3, axis=1)

    def _averaged(self, footprint: Footprint, longest: float = LONGEST) -> Float[Array, "m channels"]:
        """Light of pixels; one channel for a grey picture."""
        pixels, levels = self._pyramid
        numbers = self.rows, len(levels), *self.orientation.ravel()
        name = f"picture_{pixels.shape[1]}_{pixels.dtype.str[1:]}"
        return averaged(name, numbers, [pixels, levels], footprint, math.pi / self.rows, self.aspect, longest)


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
    flags(mirror=mirror)
    picture = real_array("light", light, np.float32)
    if picture.ndim != 3 or picture.shape[1:] != (2 * picture.shape[0], 3):
        raise ValueError(f"Argument `light` must have shape (h, 2 h, 3), but has {picture.shape}.")
    check_path(path)
    chart = picture if mirror else picture[:, ::-1]
    plate_carree.write(path, {"SKY": chart.transpose(2, 0, 1)}, {"CTYPE3": ("RGB", "red, green, blue; linear sRGB")})


def _blocks(picture: Float32[Array, "h w 3"], mirror: bool) -> Iterator[SphereRows]:
    """The rows of a picture in memory, as rows of a chart."""
    for first in range(0, len(picture), _BLOCK):
        some = picture[first : first + _BLOCK]
        yield SphereRows(first, slice(None), some if mirror else some[:, ::-1])


def _picture_rows(path: str | os.PathLike[str]) -> tuple[int, Iterator[SphereRows]]:
    """The number of rows of a picture of the whole sky, and the rows."""
    rows, columns = size_of(path)
    if columns != 2 * rows or not _FEWEST_ROWS <= rows <= _MOST_ROWS:
        raise ValueError(
            f"Argument `path` must name a picture twice as wide as high, of {_FEWEST_ROWS} to {_MOST_ROWS} rows, but "
            f"{os.fspath(path)!r} has {columns} x {rows} pixels."
        )
    return rows, (SphereRows(first, slice(None), light) for first, light, _ in rows_of(path))


def _fits_rows(path: str | os.PathLike[str]) -> tuple[int, Iterator[SphereRows]]:
    """The number of rows of a FITS image, and the rows."""
    rows, planes, blocks = plate_carree.read_sky(path)
    channel = (slice(None),) if planes == 1 else (slice(0, 1), slice(1, 2), slice(2, 3))
    return rows, (SphereRows(first, channel[k], light[..., None]) for k, first, light in blocks)


def _as_chart(
    path: str | os.PathLike[str], blocks: Iterable[SphereRows], mirror: bool, brightness: float
) -> Iterator[SphereRows]:
    """Rows of a file with phi' to the right, and brighter; ValueError at the end if some values are no light."""
    bad = 0
    for first, channels, light in blocks:
        if wrong := not_light(light):
            bad, light = bad + wrong, np.zeros_like(light)
        yield SphereRows(first, channels, np.float32(brightness) * (light if mirror else light[:, ::-1]))
    check_light_of_file(path, bad)


def rotation(matrix: ArrayLike | None) -> Float[Array, "3 3"]:
    """The matrix (3, 3) of an argument `orientation`; the identity for None."""
    if matrix is None:
        return np.eye(3)
    value = real_array("orientation", matrix)
    if value.shape != (3, 3) or not np.allclose(value @ value.T, np.eye(3), atol=1e-6) or np.linalg.det(value) < 0:
        raise ValueError("Argument `orientation` must be a rotation, a (3, 3) matrix.")
    return value


def oriented(value: ArrayLike | None, mirror: bool) -> Float[Array, "3 3"]:
    """The matrix (3, 3) of a panorama's argument `orientation`, from angles or a matrix."""
    if value is None or np.ndim(value) == 2:
        return rotation(value)
    from scipy.spatial.transform import Rotation

    angles = np.atleast_1d(real_array("orientation", value))
    if angles.shape not in ((1,), (3,)) or not np.isfinite(angles).all():
        raise ValueError(f"Argument `orientation` must be one angle or three, or a rotation, but is {quoted(value)}.")
    right, up, roll = np.pad(angles, (0, 3 - len(angles))).tolist()
    return Rotation.from_euler("zyx", [-right if mirror else right, -up, -roll]).as_matrix()
