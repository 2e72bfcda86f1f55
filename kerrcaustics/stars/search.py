"""All images of many stars at once, with the certificate: what the search finds is what the caustics tell."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from kerrcaustics.beams.trace import cores
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.stars.newton import find_roots
from kerrcaustics.stars.rings import on_rings
from kerrcaustics.stars.sheets import NARROW, WIDE, Counted, Sheets, Starts

Array = np.ndarray

# Most stars that are searched together; the cores share them.
_CHUNK = 1 << 15
# A star with an image missing is approached from this many others, so far away at most (radians), in so many steps.
_APPROACHES, _FARTHEST, _WAYPOINTS = 60, 0.3, 8
# Newton steps from waypoint to waypoint, and how many images may be followed from one to the next for one star.
_FEW_STEPS, _MOST_FOLLOWED = 16, 400
# Distance from a caustic, in radians, below which the search is always thorough.
_DELICATE = 1e-6
# Images of one star on one sheet that are closer than this, or than so many of their errors, are the same.
_SAME, _SAME_ERRORS = 1e-9, 10.0


@dataclass(frozen=True)
class Candidates(Rows):
    """Images, one entry each: which star, Morse index, direction on the sky of the camera at rest, error, radians.

    returning: True where the ray meets the star's sphere for the second time.
    """

    star: Int[Array, " images"]
    index: Int[Array, " images"]
    sky: Float[Array, "images 3"]
    error: Float[Array, " images"]
    second_arrival: Bool[Array, " images"]

    @classmethod
    def arriving(cls, star: Array, index: Array, sky: Array, error: Array) -> "Candidates":
        """Images by rays that meet the sphere for the first time."""
        return cls(star, index, sky, error, np.zeros(len(star), bool))

    def of(self, names: Int[Array, " stars"]) -> "Candidates":
        """The same, of stars with other numbers."""
        return replace(self, star=names[self.star])

    def merged(self, more: "Candidates") -> "Candidates":
        """These and more, each image once."""
        return _distinct(Candidates.joined(self, more))

    def counts(self, shape: tuple[int, ...]) -> Int[Array, "stars indices"]:
        """How many images there are."""
        counts = np.zeros(shape, int)
        np.add.at(counts, (self.star, self.index), 1)
        return counts


@dataclass(frozen=True)
class ImageSearch:
    """Images of stars: one entry an image, ordered by star, index, and place.

    star: which one; index: the Morse index; sky: direction on the sky of the camera at rest; error: of it, radians.
    counts: how many; expected: the same from the caustics; touching: True for a star that cannot be told from the
    caustic of that order; ring: True where that caustic is a point, so that the images next to it are one ring, and no
    entries; returning: True where the ray meets the star's sphere for the second time. coarse: steps of
    the grids that were coarser than the search is made for, radians, by index; else 0. doubts: what is not sure about
    each star, in words, beside that. certificate: the argument behind `certified`.
    """

    star: Int[Array, " images"]
    index: Int[Array, " images"]
    sky: Float[Array, "images 3"]
    error: Float[Array, " images"]
    counts: Int[Array, "stars indices"]
    expected: Int[Array, "stars indices"]
    touching: Bool[Array, "stars orders"]
    ring: Bool[Array, "stars orders"]
    second_arrival: Bool[Array, " images"]
    coarse: tuple[float, ...]
    doubts: tuple[tuple[str, ...], ...] = ()
    certificate: str = "winding"

    @property
    def certified(self) -> Bool[Array, " stars"]:
        """True where the search found as many images on each sheet as are expected, and nothing is in doubt."""
        doubtful = np.array([bool(lines) for lines in self.doubts] or np.zeros(len(self.counts), bool))
        return (self.counts == self.expected).all(axis=1) & ~self.touching.any(axis=1) & ~doubtful


def search(sheets: Sheets, star: Float[Array, "stars 3"]) -> ImageSearch:
    """All images of the stars."""
    size = max(1, min(_CHUNK, -(-len(star) // cores())))
    chunks = [star[i : i + size] for i in range(0, len(star), size)] or [star]
    if len(chunks) == 1:
        return _searched(sheets, chunks[0])
    with ThreadPoolExecutor(cores()) as pool:
        return found_together(list(pool.map(lambda chunk: _searched(sheets, chunk), chunks)))


def found_together(parts: Sequence[ImageSearch]) -> ImageSearch:
    """What was found of some stars, then of others, and so on."""
    offsets = np.cumsum([0, *(len(part.counts) for part in parts[:-1])])
    shifted = [replace(part, star=part.star + offset) for part, offset in zip(parts, offsets, strict=True)]
    names = [f.name for f in fields(ImageSearch) if isinstance(getattr(parts[0], f.name), np.ndarray)]
    coarse = tuple(np.max([part.coarse for part in parts], axis=0).tolist())
    return replace(
        parts[0],
        **{name: np.concatenate([getattr(part, name) for part in shifted]) for name in names},
        coarse=coarse,
        doubts=tuple(lines for part in parts for lines in part.doubts),
    )


def _searched(sheets: Sheets, star: Float[Array, "stars 3"]) -> ImageSearch:
    """Stars whose images do not match their number are searched again, more widely; then along paths."""
    told = sheets.counted(star)
    images = _images(sheets, star, sheets.starts(star, NARROW))
    on_caustic = told.on_caustic
    # Next to a caustic both counts are put to the test.
    delicate = on_caustic | (told.distance < _DELICATE)
    for again in (_beside_folds, _widely):
        doubtful = np.flatnonzero((images.counts(told.expected.shape) != told.expected).any(axis=1) | delicate)
        if doubtful.size:
            images = images.merged(again(sheets, star[doubtful], told, doubtful).of(doubtful))
    missing = np.argwhere((images.counts(told.expected.shape) < told.expected) & ~on_caustic[:, None])
    for i, k in missing.tolist():
        images = images.merged(_approached(sheets, star[i], k, int(told.expected[i, k])).of(np.array([i])))
    ring = told.touching & np.array([curve.is_point for curve in sheets.curves])
    images = images[~on_rings(ring)[images.star, images.index]]
    return found_of(images, images.counts(told.expected.shape), told.expected, (told.touching, ring), sheets)


def found_of(
    images: Candidates, counts: Array, expected: Array, touching: tuple[Array, Array], sheets: Sheets
) -> ImageSearch:
    """Images with their numbers; touching: caustics that stars cannot be told from, and which of these are points."""
    coarse = tuple(sheet.step if sheet.is_coarse else 0.0 for sheet in sheets.sheets)
    of_images = images.star, images.index, images.sky, images.error
    return ImageSearch(*of_images, counts, expected, *touching, images.second_arrival, coarse)


def _beside_folds(
    sheets: Sheets, star: Float[Array, "stars 3"], told: Counted, which: Int[Array, " stars"]
) -> Candidates:
    return _images(sheets, star, sheets.fold_starts(star, tuple(winding[which] for winding in told.windings)))


def _widely(sheets: Sheets, star: Float[Array, "stars 3"], _told: Counted, _which: Int[Array, " stars"]) -> Candidates:
    return _images(sheets, star, sheets.starts(star, WIDE))


def _approached(sheets: Sheets, star: Float[Array, " 3"], index: int, count: int) -> Candidates:
    """The images of one star on one sheet, followed from those of other stars around that have as many.

    Where the map is strongly sheared, no grid tells well where to start.
    """
    rng = np.random.default_rng(0)
    far = _FARTHEST * rng.uniform(size=(_APPROACHES, 1)) ** 2 * rng.normal(size=(_APPROACHES, 3))
    # Shorter steps toward the end, where a caustic may be close.
    paths = star + np.linspace(1, 0, _WAYPOINTS)[:, None, None] ** 2 * far
    paths /= np.linalg.norm(paths, axis=-1, keepdims=True)
    counts = sheets.counted(paths[:-1].reshape(-1, 3)).expected[:, index].reshape(_WAYPOINTS - 1, _APPROACHES)
    images = Candidates.arriving(np.empty(0, int), np.empty(0, int), np.empty((0, 3)), np.empty(0))
    followed = 0
    for path in paths[:, (counts == count).all(axis=0)].swapaxes(0, 1):
        found = _images(sheets, path[:1], sheets.starts(path[:1], NARROW))
        sky, error = found.sky[found.index == index], np.empty(0)
        for place in path[1:]:
            followed += len(sky)
            on_sheet = np.full(len(sky), index)
            star_there = np.tile(place, (len(sky), 1))
            _, sky, error = find_roots(sheets.camera, star_there, on_sheet, sky, _FEW_STEPS, end=sheets.end)
        images = images.merged(Candidates.arriving(np.zeros(len(sky), int), np.full(len(sky), index), sky, error))
        if len(images.star) >= count or followed > _MOST_FOLLOWED:
            break
    return images


def _images(sheets: Sheets, star: Float[Array, "stars 3"], starts: Starts) -> Candidates:
    owner, sheet, guess = starts
    which, sky, error = find_roots(sheets.camera, star[owner], sheet, guess, end=sheets.end)
    return _distinct(Candidates.arriving(owner[which], sheet[which], sky, error))


def _distinct(images: Candidates) -> Candidates:
    """Each image once, ordered by star, index and place."""
    images = images[np.lexsort((images.sky[:, 0], images.index, images.star))]
    again = np.zeros(len(images), bool)
    ahead = 1
    while True:
        one, other = images[:-ahead], images[ahead:]
        same = (other.star == one.star) & (other.index == one.index)
        if not same.any():
            break
        same &= other.second_arrival == one.second_arrival
        size = np.maximum(_SAME, _SAME_ERRORS * (other.error + one.error))
        again[ahead:] |= same & (np.linalg.norm(other.sky - one.sky, axis=1) < size)
        ahead += 1
    return images[~again]
