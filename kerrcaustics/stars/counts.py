"""How many images stars have: for many stars at once, as a map over the celestial sphere."""

import math
import os
from typing import overload

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from kerrcaustics.astronomy import healpix, plate_carree
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.curves.source_map import spherical
from kerrcaustics.files import check_name
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.spacetime.checks import numbers, whole_number
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer, check_viewer
from kerrcaustics.stars.images import check_apart, checked_index, checked_sheets, checked_stars, search_for
from kerrcaustics.stars.plane_images import PlaneCounts, plane_counts
from kerrcaustics.stars.plane_maps import PlaneCountMap, plane_count_map

Array = np.ndarray

_MOST_ROWS = 4096
_FITS_AXIS = "MORSE"


@result(
    "counts/1",
    record="kind=stars source_radius max_index all_certified",
    rows="stars counts expected total on_caustic certified",
)
class ImageCounts:
    """Image counts of many stars."""

    stars: Array = quantity("star angle", "rad", "theta', phi' of the stars", json="star_deg", given=True)
    counts: Array = quantity(
        "star morse_index",
        "1",
        "images found, by Morse index; of an Observer those at finite (alpha, beta)",
        json="per_index",
    )
    expected: Array = quantity(
        "star morse_index",
        "1",
        "the same from the caustics' winding (alone, where no search was asked for: counts then equal it)",
    )
    on_caustic: Array = quantity("star", "1", "True for stars that cannot be told from some caustic")
    certified: Array = quantity("star", "1", "True where found and expected agree, and on no caustic")
    source_radius: float = quantity(
        "", "GM/c^2", "radius of the stars, infinite on the celestial sphere", default=math.inf
    )

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index that was asked for."""
        return self.counts.shape[1] - 1

    @property
    @derived("", "1", json="certified")
    def all_certified(self) -> bool:
        """Whether every star is certified."""
        return bool(self.certified.all())

    @property
    @derived("star", "1")
    def total(self) -> Array:
        """Images of index 0 to max_index together."""
        return self.counts.sum(axis=1)


@result("counts/1", record="kind=map source_radius max_index theta phi counts on_caustic")
class CountMap:
    """Image counts over the celestial sphere, from the caustics' winding."""

    theta: Array = quantity("theta", "rad", "theta' of the centres of the map's cells")
    phi: Array = quantity("phi", "rad", "phi' of the centres of the map's cells")
    counts: Array = quantity(
        "theta phi morse_index", "1", "images of a star there, by Morse index; of an Observer at finite (alpha, beta)"
    )
    on_caustic: Array = quantity("theta phi", "1", "True where a star cannot be told from some caustic")
    source_radius: float = quantity(
        "", "GM/c^2", "radius of the stars, infinite on the celestial sphere", default=math.inf
    )

    @property
    @derived("", "1")
    def max_index(self) -> int:
        """Highest Morse index that was asked for."""
        return self.counts.shape[2] - 1

    @property
    @derived("theta", "sr")
    def solid_angle(self) -> Array:
        """Solid angle of a cell of each row."""
        half = math.pi / len(self.theta) / 2
        return (np.cos(self.theta - half) - np.cos(self.theta + half)) * 2 * math.pi / len(self.phi)

    def to_fits(self, path: str | os.PathLike[str]) -> None:
        """Write the map as FITS images: counts (morse_index, theta, phi), and ON_CAUSTIC. `read_count_map` reads it.

        Needs the package astropy.
        """
        infinite = math.isinf(self.source_radius)
        radius = {} if infinite else {"SRCRAD": (self.source_radius, "[GM/c^2] radius of the stars")}
        cards = {"CTYPE3": (_FITS_AXIS, "Morse index of the images"), "CRPIX3": 1.0, "CRVAL3": 0.0, "CDELT3": 1.0}
        images = {"COUNTS": self.counts.transpose(2, 0, 1).astype("int32"), "ON_CAUSTIC": self.on_caustic.astype("u1")}
        plate_carree.write(path, images, {**cards, "BUNIT": "count", **radius})

    def to_healpix(self, nside: int, order: healpix.Order = "ring") -> Int[Array, "morse_index pixels"]:
        """Counts (max_index + 1, 12 nside^2) in HEALPix: of the map's cell that holds the centre of each pixel.

        order is "ring" or "nested". Needs the package astropy-healpix.
        """
        theta, phi = healpix.centres(nside, order)
        rows, columns = self.on_caustic.shape
        i = np.minimum((theta / math.pi * rows).astype(int), rows - 1)
        j = (phi / (2 * math.pi) * columns).astype(int) % columns
        return np.ascontiguousarray(self.counts[i, j].T)


@overload
def image_counts(
    camera: Viewer, stars: ArrayLike, max_index: int = ..., *, find: bool = ..., end: EquatorialPlane
) -> PlaneCounts: ...
@overload
def image_counts(
    camera: Viewer, stars: ArrayLike, max_index: int = ..., *, find: bool = ..., end: float = ...
) -> ImageCounts: ...
@usual_warnings
def image_counts(
    camera: Viewer, stars: ArrayLike, max_index: int = 2, *, find: bool = True, end: float | EquatorialPlane = math.inf
) -> ImageCounts | PlaneCounts:
    """How many images each star has, by Morse index.

    Parameters
    ----------
    camera : Camera or Observer
    stars : (n, 2) array
        (theta', phi') in radians.
    max_index : int
        0 to 6.
    find : bool
        Whether to find every image too, which certifies the counts; else only the winding of the caustics about the
        star counts them, a hundred times faster.
    end : float
        Radius of the stars; math.inf is the celestial sphere. Of stars nearer to the hole than the camera each takes a
        search of its own to be certified. An `EquatorialPlane`: stars are (r, phi) in the plane.

    Returns
    -------
    ImageCounts
        For the plane `PlaneCounts`.

    Raises
    ------
    ValueError
        Where an argument cannot be; the message names it, and what it must be.

    Errors
    ------
    None where certified; elsewhere found and expected counts tell by how much they differ.

    Notes
    -----
    An Observer at infinity sees stars of the celestial sphere directly, by an image of index 0 each, at infinite
    (alpha, beta): the counts have 0 there.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> counts = kc.image_counts(camera, [(1.4, 2.9), (0.5, 0.0)], max_index=1, find=False)
    >>> counts.total.tolist()
    [2, 2]
    """
    if isinstance(end, EquatorialPlane):
        check_viewer(camera)
        return plane_counts(camera, stars, checked_index(max_index), end)
    places, angles = checked_stars(stars), numbers("stars", stars)
    surface = spherical(camera, end)
    radius = float(surface.radius)
    check_apart("stars", camera, angles, surface)
    if find:
        found = search_for(camera, places, angles, checked_index(max_index), surface)
        on_caustic = np.asarray(found.touching.any(axis=1))
        return ImageCounts(angles, found.counts, found.expected, on_caustic, found.certified, radius)
    told = checked_sheets(camera, max_index, surface).counted(places)
    unsure = np.zeros(len(places), bool)
    return ImageCounts(angles, told.expected, told.expected, told.on_caustic, unsure, radius)


@overload
def count_map(
    camera: Viewer, max_index: int = ..., rows: int = ..., *, end: EquatorialPlane, radii: ArrayLike | None = ...
) -> PlaneCountMap: ...
@overload
def count_map(
    camera: Viewer, max_index: int = ..., rows: int = ..., *, end: float = ..., radii: None = ...
) -> CountMap: ...
@usual_warnings
def count_map(
    camera: Viewer,
    max_index: int = 2,
    rows: int = 180,
    *,
    end: float | EquatorialPlane = math.inf,
    radii: ArrayLike | None = None,
) -> CountMap | PlaneCountMap:
    """Image counts over the whole celestial sphere, or one of finite radius, on a grid of equal steps in theta', phi'.

    Parameters
    ----------
    camera : Camera or Observer
    max_index : int
        0 to 6.
    rows : int
        Cells from pole to pole; twice as many go round.
    end : float
        Radius of the stars; math.inf is the celestial sphere. An `EquatorialPlane`: a map over r and phi, in which
        rows are circles, of about a second each.
    radii : array
        In the plane alone: the radii of the circles, rising. Left out, they are `rows` in equal ratios, from 1.05 times
        the horizon's to twice the camera's, to 100 for an Observer.

    Returns
    -------
    CountMap
        For the plane `PlaneCountMap`.

    Raises
    ------
    ValueError
        Where an argument cannot be; the message names it, and what it must be.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> counts = kc.count_map(camera, max_index=1, rows=18)
    >>> counts.counts.shape
    (18, 36, 2)
    """
    rows = whole_number("rows", rows, 1, _MOST_ROWS)
    if isinstance(end, EquatorialPlane):
        check_viewer(camera)
        return plane_count_map(camera, checked_index(max_index), rows if radii is None else radii, 2 * rows, end)
    if radii is not None:
        raise ValueError(f"Argument `radii` must come with an EquatorialPlane as `end`, but that is {end!r}.")
    surface = spherical(camera, end)
    sheets = checked_sheets(camera, max_index, surface)
    theta, phi = _centres(rows)
    grid = np.stack(np.meshgrid(theta, phi, indexing="ij"), axis=-1)
    told = sheets.counted(from_angles(grid[..., 0].ravel(), grid[..., 1].ravel()))
    shape = grid.shape[:2]
    counts = told.expected.reshape(*shape, -1)
    return CountMap(theta, phi, counts, told.on_caustic.reshape(shape), float(surface.radius))


def read_count_map(path: str | os.PathLike[str]) -> CountMap:
    """The map that `CountMap.to_fits` wrote, equal to the one that was written. Needs the package astropy.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    ValueError
        Where the file cannot be read, or holds no such map.
    ImportError
        Without the package astropy.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> kc.count_map(camera, max_index=1, rows=18).to_fits("counts.fits")
    >>> kc.read_count_map("counts.fits").counts.shape
    (18, 36, 2)
    """
    check_name(path)
    (counts, header), *others = plate_carree.read(path)
    if header.get("CTYPE3") != _FITS_AXIS or len(others) != 1:
        raise ValueError(f"Argument `path` must name a map that `to_fits` wrote, but {os.fspath(path)!r} is none.")
    counts = counts[:, ::-1].transpose(1, 2, 0).astype(int)
    radius = float(header.get("SRCRAD", math.inf))
    return CountMap(*_centres(len(counts)), counts, others[0][0][::-1].astype(bool), radius)


def _centres(rows: int) -> tuple[Float[Array, " rows"], Float[Array, " 2*rows"]]:
    """theta' and phi' of the centres of cells."""
    return (np.arange(rows) + 0.5) * math.pi / rows, (np.arange(2 * rows) + 0.5) * math.pi / rows
