"""How many images stars have: for many stars at once, as a map over the celestial sphere."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.stars.images import checked_sheets, checked_stars
from kerrcaustics.stars.search import search

Array = np.ndarray

_MOST_ROWS = 4096


@dataclass(frozen=True, eq=False)
class ImageCounts:
    """Image counts of many stars.

    stars (n, 2): (theta', phi'), radians; counts (n, max_index + 1): images found, by Morse index; expected, the same
    from the caustics' winding (alone, where no search was asked for: counts then equal it); on_caustic (n,): True for
    stars that cannot be told from some caustic; certified (n,): found and expected agree, and on no caustic.
    """

    stars: Array
    counts: Array
    expected: Array
    on_caustic: Array
    certified: Array

    @property
    def total(self) -> Array:
        """Images (n,) of index 0 to max_index together."""
        return self.counts.sum(axis=1)


@dataclass(frozen=True, eq=False)
class CountMap:
    """Image counts over the celestial sphere, from the caustics' winding.

    theta (m,), phi (n,): centres of the map's cells in radians; counts (m, n, max_index + 1); on_caustic (m, n).
    """

    theta: Array
    phi: Array
    counts: Array
    on_caustic: Array

    @property
    def solid_angle(self) -> Array:
        """Solid angle (m,) of a cell of each row."""
        half = math.pi / len(self.theta) / 2
        return (np.cos(self.theta - half) - np.cos(self.theta + half)) * 2 * math.pi / len(self.phi)


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
    angles = np.asarray(stars, float)
    if find:
        found = search(sheets, places)
        return ImageCounts(angles, found.counts, found.expected, found.touching.any(axis=1), found.certified)
    told = sheets.counted(places)
    unsure = np.zeros(len(places), bool)
    return ImageCounts(angles, told.expected, told.expected, told.touching.any(axis=1), unsure)


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
    whole_number("rows", rows, 1, _MOST_ROWS)
    sheets = checked_sheets(camera, max_index)
    theta = (np.arange(rows) + 0.5) * math.pi / rows
    phi = (np.arange(2 * rows) + 0.5) * math.pi / rows
    grid = np.stack(np.meshgrid(theta, phi, indexing="ij"), axis=-1)
    told = sheets.counted(from_angles(grid[..., 0].ravel(), grid[..., 1].ravel()))
    shape = grid.shape[:2]
    return CountMap(theta, phi, told.expected.reshape(*shape, -1), told.touching.any(axis=1).reshape(shape))
