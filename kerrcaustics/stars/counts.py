"""How many images stars have: for many stars at once, as a map over the celestial sphere."""

import math

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import numbers, whole_number
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.stars.images import checked_sheets, checked_stars
from kerrcaustics.stars.search import search

Array = np.ndarray

_MOST_ROWS = 4096


@result(
    "counts/1",
    record="kind=stars max_index all_certified",
    rows="stars counts expected total on_caustic certified",
)
class ImageCounts:
    """Image counts of many stars."""

    stars: Array = quantity("star angle", "rad", "theta', phi' of the stars", json="star_deg", given=True)
    counts: Array = quantity("star morse_index", "1", "images found, by Morse index", json="per_index")
    expected: Array = quantity(
        "star morse_index",
        "1",
        "the same from the caustics' winding (alone, where no search was asked for: counts then equal it)",
    )
    on_caustic: Array = quantity("star", "1", "True for stars that cannot be told from some caustic")
    certified: Array = quantity("star", "1", "True where found and expected agree, and on no caustic")

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


@result("counts/1", record="kind=map max_index theta phi counts on_caustic")
class CountMap:
    """Image counts over the celestial sphere, from the caustics' winding."""

    theta: Array = quantity("theta", "rad", "theta' of the centres of the map's cells")
    phi: Array = quantity("phi", "rad", "phi' of the centres of the map's cells")
    counts: Array = quantity("theta phi morse_index", "1", "images of a star there, by Morse index")
    on_caustic: Array = quantity("theta phi", "1", "True where a star cannot be told from some caustic")

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


@usual_warnings
def image_counts(camera: Camera, stars: ArrayLike, max_index: int = 2, *, find: bool = True) -> ImageCounts:
    """How many images each star has, by Morse index.

    Parameters
    ----------
    camera : Camera
    stars : (n, 2) array
        (theta', phi') in radians.
    max_index : int
        0 to 6.
    find : bool
        Whether to find every image too, which certifies the counts; else only the winding of the caustics about the
        star counts them, a hundred times faster.

    Returns
    -------
    ImageCounts

    Errors
    ------
    None where certified; elsewhere found and expected counts tell by how much they differ.
    """
    places = checked_stars(stars)
    sheets = checked_sheets(camera, max_index)
    angles = numbers("stars", stars)
    if find:
        found = search(sheets, places)
        return ImageCounts(
            angles, found.counts, found.expected, np.asarray(found.touching.any(axis=1)), found.certified
        )
    told = sheets.counted(places)
    unsure = np.zeros(len(places), bool)
    return ImageCounts(angles, told.expected, told.expected, told.on_caustic, unsure)


@usual_warnings
def count_map(camera: Camera, max_index: int = 2, rows: int = 180) -> CountMap:
    """Image counts over the whole celestial sphere, on a grid of equal steps in theta' and phi'.

    Parameters
    ----------
    camera : Camera
    max_index : int
        0 to 6.
    rows : int
        Cells from pole to pole; twice as many go round.
    """
    rows = whole_number("rows", rows, 1, _MOST_ROWS)
    sheets = checked_sheets(camera, max_index)
    theta = (np.arange(rows) + 0.5) * math.pi / rows
    phi = (np.arange(2 * rows) + 0.5) * math.pi / rows
    grid = np.stack(np.meshgrid(theta, phi, indexing="ij"), axis=-1)
    told = sheets.counted(from_angles(grid[..., 0].ravel(), grid[..., 1].ravel()))
    shape = grid.shape[:2]
    return CountMap(theta, phi, told.expected.reshape(*shape, -1), told.on_caustic.reshape(shape))
