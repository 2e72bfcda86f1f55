"""Whole spheres as FITS images in the plate carree projection.

Longitude is phi', latitude 90 degrees - theta'. A FITS image begins at the bottom: theta' = pi is its first row. phi'
grows to the right from 0, as in all pictures of the package. The axes are KLON-CAR and KLAT-CAR, of the form xLON, xLAT
of the standard: they are those of the hole, and no celestial frame.

References: Calabretta & Greisen 2002, A&A 395, 1077, sec. 3.1.1 and 5.2.3.
"""

import errno
import gzip
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import numpy as np

from kerrcaustics.extras import needed
from kerrcaustics.files import check_name, reading, writing
from kerrcaustics.shapes import Float, Float32

Array = np.ndarray
ENDINGS = (".fits", ".fit", ".fits.gz")
_FEWEST_ROWS, _MOST_ROWS = 4, 8192
# Bytes of a file, and of an image in it, which may be packed.
_LARGEST = 4_000_000_000
# Rows of the grid that are interpolated together.
_BLOCK = 64


def is_fits(path: str | os.PathLike[str]) -> bool:
    """True if the name of a file is that of a FITS file."""
    return os.fspath(path).lower().endswith(ENDINGS)


def write(path: str | os.PathLike[str], images: dict[str, Array], cards: dict[str, Any]) -> None:
    """Write images (h, 2 h) or (planes, h, 2 h), theta' downward, by their names; the cards go into the first one."""
    fits = needed("astro", "astropy.io.fits")
    units = [fits.PrimaryHDU() if k == 0 else fits.ImageHDU() for k in range(len(images))]
    for unit, (name, image) in zip(units, images.items(), strict=True):
        unit.data, unit.name = np.ascontiguousarray(image[..., ::-1, :]), name
        unit.header.update(_cards(image.shape[-2]))
    units[0].header.update(cards)
    write_units(path, units)


def write_units(path: str | os.PathLike[str], units: list[Any]) -> None:
    """Write the header and data units of a FITS file, packed if its name ends in .gz."""
    check_name(path)
    with writing(path) as file:
        # Astropy goes by the name of a file, which an open one does not have.
        packed = os.fspath(path).lower().endswith(".gz")
        with gzip.GzipFile(fileobj=file, mode="wb", mtime=0) if packed else nullcontext(file) as plain:
            needed("astro", "astropy.io.fits").HDUList(units).writeto(plain)


def _cards(rows: int) -> dict[str, Any]:
    """FITS cards for the places of the pixels of a whole sphere."""
    return {
        "CTYPE1": ("KLON-CAR", "phi' of the Kerr hole, plate carree"),
        "CRPIX1": rows + 0.5,
        "CRVAL1": 180.0,
        "CDELT1": 180 / rows,
        "CUNIT1": "deg",
        "CTYPE2": ("KLAT-CAR", "90 deg - theta' of the Kerr hole"),
        "CRPIX2": (rows + 1) / 2,
        "CRVAL2": 0.0,
        "CDELT2": 180 / rows,
        "CUNIT2": "deg",
    }


def read(path: str | os.PathLike[str]) -> list[tuple[Array, Any]]:
    """All images of a file with their headers, as stored; a ValueError if there are none."""
    with _images(path) as images:
        return [(np.asarray(unit.data), unit.header) for unit in images]


def read_sky(path: str | os.PathLike[str]) -> tuple[int, int, Iterator[tuple[int, int, Float32[Array, "n columns"]]]]:
    """The first image of a file: a whole sphere in plate carree, in any celestial frame.

    Values between pixels are interpolated linearly; a file on the grid of this package is read unchanged.

    Returns
    -------
    rows, planes : int
        Of the grid; one plane is grey, three are red, green and blue.
    blocks : iterator
        The number of a plane, that of the first row, and values (n, 2 rows), from the last rows to the first.
    """
    with _images(path) as images:
        header, shape = images[0].header, images[0].shape
    wcs = needed("astro", "astropy.wcs").WCS(header)
    planes = math.prod(shape[:-2])
    if len(shape) < 2 or planes not in (1, 3) or not _is_whole_sphere(wcs, shape):
        raise ValueError(
            f"Argument `path` must name a FITS image of a whole sphere in plate carree (CTYPE ...-CAR), of one plane "
            f"or three, but {os.fspath(path)!r} is none."
        )
    x_step, y_step = _steps(wcs.celestial)
    return round(180 / min(x_step, y_step)), planes, _blocks(path, wcs.celestial)


@contextmanager
def _images(path: str | os.PathLike[str]) -> Iterator[list[Any]]:
    """The units of a file with an image, whose pixels are not read yet; a ValueError if there are none."""
    fits = needed("astro", "astropy.io.fits")
    try:
        with reading(path, _LARGEST), fits.open(path, memmap=False) as units:
            if any(unit.size > _LARGEST for unit in units):
                raise OSError(errno.EFBIG, "it has too many pixels")
            images = [unit for unit in units if unit.is_image and unit.shape]
            if not images:
                healpix = any(unit.header.get("PIXTYPE") == "HEALPIX" for unit in units)
                raise _NoImageError(
                    f"Argument `path` must name a FITS file with an image, but {os.fspath(path)!r} has none"
                    + (": it is a HEALPix table, whose columns `Panorama.from_healpix` takes." if healpix else ".")
                )
            yield images
    except _NoImageError:
        raise
    except (OSError, ValueError, TypeError) as error:
        reason = getattr(error, "strerror", None) or "it is no FITS file"
        raise ValueError(f"Argument `path` must name a file that can be read: {os.fspath(path)!r}: {reason}.") from None


class _NoImageError(ValueError):
    """A file without images."""


def _is_whole_sphere(wcs: Any, shape: tuple[int, ...]) -> bool:
    """True if an image is plate carree, upright, and complete around to a hundredth of a pixel."""
    if not wcs.has_celestial or not all(str(axis).endswith("-CAR") for axis in wcs.celestial.wcs.ctype):
        return False
    x, y = _steps(wcs.celestial)
    rows = 180 / min(x, y)
    whole = shape[-1] > 360 / x - 0.01 and shape[-2] > 180 / y - 0.01
    return whole and abs(round(360 / x) - 360 / x) < 0.01 and _FEWEST_ROWS <= round(rows) <= _MOST_ROWS


def _steps(wcs: Any) -> tuple[float, float]:
    """Sizes of a pixel along both axes, degrees."""
    x, y = needed("astro", "astropy.wcs.utils").proj_plane_pixel_scales(wcs)
    return float(x), float(y)


def _blocks(path: str | os.PathLike[str], wcs: Any) -> Iterator[tuple[int, int, Float32[Array, "n columns"]]]:
    """Values at the centres of the grid of this package, which is as fine as the finer axis."""
    x_step, y_step = _steps(wcs)
    rows, around = round(180 / min(x_step, y_step)), round(360 / x_step)
    with _images(path) as images:
        image = images[0]
        for k in range(math.prod(image.shape[:-2])):
            stored = _StoredRows(image, k, around)
            # From the south, as files begin: one that is packed is read forward.
            for end in range(rows, 0, -_BLOCK):
                first = max(end - _BLOCK, 0)
                yield k, first, stored.values_at(*_pixels(wcs, rows, first, end))


def _pixels(wcs: Any, rows: int, first: int, end: int) -> tuple[Float[Array, "n columns"], Float[Array, "n columns"]]:
    """Places x and y in the image, in pixels, of the centres of some rows of the grid."""
    phi = (np.arange(2 * rows) + 0.5) * 180 / rows
    grid = np.stack(np.meshgrid(phi, 90 - phi[first:end]), axis=-1).reshape(-1, 2)
    # Rounded, so that centres of pixels are met in spite of round-off.
    x, y = np.round(wcs.wcs_world2pix(grid, 0), 9).T
    return x.reshape(end - first, -1), y.reshape(end - first, -1)


class _StoredRows:
    """Rows of a plane of an image, read as they are needed; those read last are kept."""

    def __init__(self, image: Any, plane: int, around: int) -> None:
        """Nothing is read yet; around: pixels of a whole row, of which more may be stored."""
        place = np.unravel_index(plane, image.shape[:-2]) if len(image.shape) > 2 else ()
        self._plane, self._height, self._around = tuple(int(i) for i in place), image.shape[-2], around
        self._section, self._low, self._kept = image.section, 0, np.empty((0, around + 1))

    def values_at(self, x: Float[Array, "n w"], y: Float[Array, "n w"]) -> Float32[Array, "n w"]:
        """Values at places, linear between pixels."""
        from scipy.ndimage import map_coordinates

        y = np.clip(y, 0, self._height - 1)
        low, high = math.floor(y.min()), math.ceil(y.max()) + 1
        if low < self._low or high > self._low + len(self._kept):
            values = np.asarray(self._section[(*self._plane, slice(low, high), slice(None))], float)
            # One more column on the right, for places between the last one and the first.
            self._low, self._kept = low, np.concatenate([values[:, : self._around], values[:, :1]], axis=1)
        return map_coordinates(self._kept, [y - self._low, x % self._around], order=1).astype(np.float32)
