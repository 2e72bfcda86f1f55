"""Numbers of images of stars: for many stars at once, as a map over the celestial sphere."""

import math
import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.interop import healpix, plate_carree
from kerrcaustics.lens_map.arguments import checked_index, direct_remarks
from kerrcaustics.lens_map.domains import search_surface
from kerrcaustics.results import declared
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.results.storage import as_json, from_json
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import flags, numbers, whole_number
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

_Marks = Bool[Array, "*sources"]

_MOST_ROWS = 4096
_FITS_AXIS = "MORSE"


@result(
    "counts/1",
    record="kind=stars camera surface max_index all_certified remarks",
    rows="stars counts expected total on_caustic certified",
)
class ImageCounts(Shown):
    """Image counts of many sources."""

    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
    stars: Array = quantity(
        "star angle", "place", "theta', phi' of the stars; in the plane r, phi", json="star", given=True
    )
    counts: Array = quantity(
        "star morse_index",
        "1",
        "images found, by Morse index; for an Observer, those at finite (alpha, beta)",
        json="per_index",
    )
    expected: Array = quantity(
        "star morse_index",
        "1",
        "images that the winding of the caustics requires, by Morse index; without a search, and in the plane, the "
        "same as counts",
    )
    on_caustic: Array = quantity("star", "1", "True for stars that cannot be distinguished from some caustic")
    certified: Array = declared.certified("True as in `StarImages`; False without a search", dims="star")

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index requested."""
        return self.counts.shape[1] - 1

    @property
    @derived("", "1", json="certified")
    def all_certified(self) -> bool:
        """True if every star is certified."""
        return bool(self.certified.all())

    @property
    @derived("", "")
    def remarks(self) -> tuple[str, ...]:
        """Reasons why some counts are not certified, and images that are not counted."""
        differ = (self.counts != self.expected).any(axis=1)
        return _remarks(self.camera, self.surface, self.on_caustic, self.certified, differ)

    @property
    @derived("star", "1")
    def total(self) -> Array:
        """Images of index 0 to max_index together."""
        return self.counts.sum(axis=1)


@result("counts/1", record="kind=map camera surface max_index level phi counts on_caustic certified remarks")
class CountMap(Shown):
    """Image counts all over a surface of sources, on a grid of its two coordinates."""

    camera: Viewer = declared.viewer()
    surface: End = declared.surface()
    level: Array = quantity("level", "level", "theta' of the centres of the map's cells; in the plane r of the circles")
    phi: Array = quantity("phi", "rad", "phi' of the centres of the map's cells")
    counts: Array = quantity(
        "level phi morse_index", "1", "images of a source there, by index; for an Observer at finite (alpha, beta) only"
    )
    on_caustic: Array = quantity("level phi", "1", "True where a source cannot be distinguished from a caustic")
    certified: Array = declared.certified(
        "True as in `StarImages`; False where the winding alone counts", dims="level phi"
    )

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index requested."""
        return self.counts.shape[2] - 1

    @property
    @derived("", "")
    def remarks(self) -> tuple[str, ...]:
        """Reasons why some counts are not certified, and images that are not counted."""
        return _remarks(self.camera, self.surface, self.on_caustic, self.certified, np.zeros_like(self.certified))

    def __repr__(self) -> str:
        """Summary in one line: where, and how much of it is certified."""
        rows, columns = self.certified.shape
        where, sure = self.surface.in_words(), int(self.certified.sum())
        return f"<CountMap of {where}, {rows} by {columns} sources, {sure} certified>"

    @property
    def solid_angle(self) -> Array:
        """Solid angle of a cell of each row of a map over a sphere, steradians."""
        half = math.pi / len(self.level) / 2
        return (np.cos(self.level - half) - np.cos(self.level + half)) * 2 * math.pi / len(self.phi)

    def to_fits(self, path: str | os.PathLike[str]) -> None:
        """Write the map as FITS images: counts (morse_index, theta, phi), and ON_CAUSTIC. `kerrcaustics.load` reads it.

        For maps over a sphere. Needs the package astropy.
        """
        places = {"VIEWER": as_json(self.camera), "SURFACE": as_json(self._sphere())}
        cards = {"CTYPE3": (_FITS_AXIS, "Morse index of the images"), "CRPIX3": 1.0, "CRVAL3": 0.0, "CDELT3": 1.0}
        images = {"COUNTS": self.counts.transpose(2, 0, 1).astype("int32"), "ON_CAUSTIC": self.on_caustic.astype("u1")}
        plate_carree.write(path, images, {**cards, "BUNIT": "count", **places})

    @classmethod
    def from_fits(cls, path: str | os.PathLike[str]) -> "CountMap":
        """The map that `to_fits` wrote, equal to the original. Needs the package astropy.

        Raises ValueError if the file cannot be read or holds no such map.
        """
        (counts, header), *extensions = plate_carree.read(path)
        if header.get("CTYPE3") != _FITS_AXIS or len(extensions) != 1 or "SURFACE" not in header:
            raise ValueError(f"Argument `path` must name a map that `to_fits` wrote, but {os.fspath(path)!r} is none.")
        counts, rows = counts[:, ::-1].transpose(1, 2, 0).astype(int), counts.shape[1]
        phi, on_caustic = (np.arange(2 * rows) + 0.5) * math.pi / rows, extensions[0][0][::-1].astype(bool)
        camera, surface = (_placed(header[name], path) for name in ("VIEWER", "SURFACE"))
        return cls(camera, surface, surface.levels(camera, rows), phi, counts, on_caustic, np.zeros_like(on_caustic))

    def to_healpix(self, nside: int, order: healpix.Order = "ring") -> Int[Array, "morse_index pixels"]:
        """Counts (max_index + 1, 12 nside^2) in HEALPix: those of the map's cell that holds the centre of each pixel.

        order is "ring" or "nested". For maps over a sphere. Needs the package astropy-healpix.
        """
        self._sphere()
        theta, phi = healpix.centres(nside, order)
        rows, columns = self.on_caustic.shape
        i = np.minimum((theta / math.pi * rows).astype(int), rows - 1)
        j = (phi / (2 * math.pi) * columns).astype(int) % columns
        return np.ascontiguousarray(self.counts[i, j].T)

    def _sphere(self) -> End:
        """The surface, if it is a sphere that the map covers."""
        if self.surface.coordinates[0].unit != "rad":
            raise ValueError(f"Argument `self` must be a map over a sphere, but is one over {self.surface.in_words()}.")
        return self.surface


def _remarks(camera: Viewer, surface: End, on_caustic: _Marks, certified: _Marks, differ: _Marks) -> tuple[str, ...]:
    """Remarks about counts; differ: True where the counts found and expected differ."""
    reasons = {
        "cannot be distinguished from a caustic: the images may be two more, or less": on_caustic,
        "have other numbers of images by the search than the caustics require": differ & ~on_caustic,
        "are counted once, without a certificate": ~(certified | on_caustic | differ),
    }
    lines = (f"{marks.sum()} of {marks.size} sources {text}" for text, marks in reasons.items() if marks.any())
    return (*direct_remarks(surface, camera), *lines)


@usual_warnings
@with_progress
def image_counts(
    camera: Viewer,
    stars: ArrayLike,
    max_index: int = 2,
    *,
    find: bool = True,
    end: Wherever | End = math.inf,
    progress: Progress | bool | None = None,
) -> ImageCounts:
    """Numbers of images of stars, by Morse index.

    Parameters
    ----------
    camera : Camera or Observer
    stars : (n, 2) array
        (theta', phi') in radians; in the plane (r, phi).
    max_index : int
        0 to 6.
    find : bool
        Whether to find every image too, which certifies the counts; otherwise only the winding of the caustics about
        the star counts them, a hundred times faster. In the plane the two are the same.
    end : float, Sphere or EquatorialPlane
        Radius of the stars; math.inf is the celestial sphere. Each star nearer to the hole than the camera needs a
        separate search to be certified. An `EquatorialPlane`: stars are (r, phi) in the plane.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    ImageCounts

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    None where certified; elsewhere found and expected counts differ.

    Notes
    -----
    An Observer at infinity sees each star of the celestial sphere directly, in an image of index 0 at infinite
    (alpha, beta): the counts are 0 there.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> counts = kc.image_counts(camera, [(1.4, 2.9), (0.5, 0.0)], max_index=1, find=False)
    >>> counts.total.tolist()
    [2, 2]
    """
    check_viewer(camera)
    flags(find=find)
    surface, highest = search_surface(camera, end), checked_index(max_index)
    places = surface.checked("stars", stars, camera)
    of = certificate_of(surface, camera, highest).counts(places, find=find)
    return ImageCounts(camera, surface, places, of.found, of.expected, of.on_caustic, of.certified)


@usual_warnings
@with_progress
def count_map(
    camera: Viewer,
    max_index: int = 2,
    rows: int = 180,
    *,
    end: Wherever | End = math.inf,
    radii: ArrayLike | None = None,
    progress: Progress | bool | None = None,
) -> CountMap:
    """Image counts over the whole celestial sphere, or one of finite radius, on a grid of equal steps in theta', phi'.

    Parameters
    ----------
    camera : Camera or Observer
    max_index : int
        0 to 6.
    rows : int
        Number of cells from pole to pole, with twice as many in phi'.
    end : float, Sphere or EquatorialPlane
        Radius of the stars; math.inf is the celestial sphere. An `EquatorialPlane`: a map over r and phi, in which
        each row is a circle and takes about a second.
    radii : array
        In the plane only: the radii of the circles, increasing. By default `rows` radii in equal ratios, from 1.05
        times the horizon's to twice the camera's, at most 100.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    CountMap

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> counts = kc.count_map(camera, max_index=1, rows=18)
    >>> counts.counts.shape
    (18, 36, 2)
    """
    rows = whole_number("rows", rows, 1, _MOST_ROWS)
    check_viewer(camera)
    surface, highest = search_surface(camera, end), checked_index(max_index)
    levels = surface.levels(camera, rows) if radii is None else _checked_radii(surface, camera, radii)
    phi = (np.arange(2 * rows) + 0.5) * math.pi / rows
    grid = np.stack(np.meshgrid(levels, phi, indexing="ij"), axis=-1)
    cells = certificate_of(surface, camera, highest).counts(grid.reshape(-1, 2), find=False)
    shape = grid.shape[:2]
    near, certified = cells.on_caustic.reshape(shape), cells.certified.reshape(shape)
    return CountMap(camera, surface, levels, phi, cells.expected.reshape(*shape, -1), near, certified)


def _checked_radii(surface: End, camera: Viewer, radii: ArrayLike) -> Float[Array, " rows"]:
    """The radii of the circles of a map of the plane; ValueError unless they are valid."""
    if surface.coordinates[0].name != "radius":
        raise ValueError(f"Argument `radii` must be used with an EquatorialPlane as `end`, but that is {surface!r}.")
    horizon, radius = kerr.horizon(camera.spin), numbers("radii", radii)
    rising = radius.ndim == 1 and len(radius) > 0 and bool((np.diff(radius) > 0).all())
    if not (rising and horizon < radius[0] and radius[-1] < math.inf):
        raise ValueError(
            f"Argument `radii` must be radii in rising order, larger than the horizon's {horizon:.12g}, but is "
            f"{radii!r}."
        )
    return radius


def _placed(text: str, path: str | os.PathLike[str]) -> Any:
    """The viewer or the surface of a header."""
    try:
        return from_json(text, ("Camera", "Observer", "CelestialSphere", "Sphere"))
    except ValueError:
        raise ValueError(
            f"Argument `path` must name a map that `to_fits` wrote, but {os.fspath(path)!r} is none."
        ) from None
