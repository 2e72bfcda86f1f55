"""Whole spheres as FITS images in the plate carree projection.

Longitude is phi', latitude 90 degrees - theta'. A FITS image begins at the bottom: theta' = pi is its first row. phi'
grows to the right from 0, as in all pictures of the package. The axes are KLON-CAR and KLAT-CAR, of the form xLON, xLAT
of the standard: they are those of the hole, and no celestial frame.

References: Calabretta & Greisen 2002, A&A 395, 1077, sec. 3.1.1 and 5.2.3.
"""

import errno
import gzip
import os
from contextlib import nullcontext
from typing import Any

import numpy as np
from jaxtyping import Float

from kerrcaustics.extras import needed
from kerrcaustics.files import check_name, reading, writing

Array = np.ndarray
ENDINGS = (".fits", ".fit", ".fits.gz")
_FEWEST_ROWS, _MOST_ROWS = 4, 8192
# Bytes of a file, and of an image in it, which may be packed.
_LARGEST = 4_000_000_000


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
    fits = needed("astro", "astropy.io.fits")
    try:
        with reading(path, _LARGEST), fits.open(path, memmap=False) as units:
            if any(unit.size > _LARGEST for unit in units):
                raise OSError(errno.EFBIG, "it has too many pixels")
            images = [(np.asarray(unit.data), unit.header) for unit in units if unit.is_image and unit.data is not None]
    except (OSError, ValueError, TypeError) as error:
        reason = getattr(error, "strerror", None) or "it is no FITS file"
        raise ValueError(f"Argument `path` must name a file that can be read: {os.fspath(path)!r}: {reason}.") from None
    if not images:
        raise ValueError(f"Argument `path` must name a FITS file with an image, but {os.fspath(path)!r} has none.")
    return images


def read_sky(path: str | os.PathLike[str]) -> Float[Array, "rows 2*rows 3"]:
    """Light (h, 2 h, 3) in the first image of a file: a whole sphere in plate carree, in any celestial frame.

    One plane is grey, three are red, green and blue. Values between pixels are interpolated linearly; a file on the
    grid of this package is read unchanged.
    """
    image, header = read(path)[0]
    planes = image.reshape(-1, *image.shape[-2:])
    wcs = needed("astro", "astropy.wcs").WCS(header)
    if planes.ndim != 3 or len(planes) not in (1, 3) or not _is_whole_sphere(wcs, planes.shape):
        raise ValueError(
            f"Argument `path` must name a FITS image of a whole sphere in plate carree (CTYPE ...-CAR), of one plane "
            f"or three, but {os.fspath(path)!r} is none."
        )
    light = _interpolated(planes.astype(float), wcs.celestial).transpose(1, 2, 0)
    return light if len(planes) == 3 else np.repeat(light, 3, axis=2)


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


def _interpolated(planes: Float[Array, "planes h w"], wcs: Any) -> Float[Array, "planes rows 2*rows"]:
    """Values at the centres of the grid of this package, which is as fine as the finer axis."""
    from scipy.ndimage import map_coordinates

    x_step, y_step = _steps(wcs)
    rows, around = round(180 / min(x_step, y_step)), round(360 / x_step)
    phi = (np.arange(2 * rows) + 0.5) * 180 / rows
    grid = np.stack(np.meshgrid(phi, 90 - phi[:rows]), axis=-1).reshape(-1, 2)
    # Rounded, so that centres of pixels are met in spite of round-off.
    x, y = np.round(wcs.wcs_world2pix(grid, 0), 9).T
    # One more column on the right, for places between the last one and the first.
    wide = np.concatenate([planes[..., :around], planes[..., :1]], axis=-1)
    shape = (rows, 2 * rows)
    place = [np.clip(y, 0, planes.shape[1] - 1).reshape(shape), (x % around).reshape(shape)]
    return np.stack([map_coordinates(plane, place, order=1) for plane in wide])
