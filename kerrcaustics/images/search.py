"""All images of many stars at once, with the certificate: the search finds as many as the caustics require.

Rings: if a caustic is a point, as that of a hole without spin or of a camera on the spin axis, space is symmetric about
the line through camera and hole. The image of a star on that line is a whole critical curve: Einstein's ring, or one of
a higher order.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.beams.trace import cores
from kerrcaustics.curves.critical_curves import CriticalCurve
from kerrcaustics.images.sheets import NARROW, WIDE, Sheets, Starts
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import SearchSky, as_seen, radians_of, search_sky, shown_line_of_sight
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Most stars that are searched together; the cores share them.
_CHUNK = 1 << 15
# Stars from which a star with an image missing is approached.
_APPROACHES = 60
# Their largest distance from it, radians.
_FARTHEST = 0.3
# Steps of each approach.
_WAYPOINTS = 8
# Newton steps from waypoint to waypoint.
_FEW_STEPS = 16
# Most images of one star that are followed from one waypoint to the next.
_MOST_FOLLOWED = 400
# Newton steps on the plain sky from a known place.
_PLAIN_STEPS = 8
# Distance from a caustic, in radians, below which the search is always thorough.
_DELICATE = 1e-6
# Distance of images of one star on one sheet below which they are the same, radians.
_SAME = 1e-9
# The same in their errors.
_SAME_ERRORS = 10.0


@dataclass(frozen=True)
class SkyImages(Rows):
    """Images, one entry each, on the sky of the camera at rest.

    star: number of the star.
    index: Morse index.
    sky: direction N.
    error: error of the direction, radians.
    second_arrival: True if the ray meets the star's sphere for the second time.
    """

    star: Int[Array, " images"]
    index: Int[Array, " images"]
    sky: Float[Array, "images 3"]
    error: Float[Array, " images"]
    second_arrival: Bool[Array, " images"]

    @classmethod
    def arriving(cls, star: Array, index: Array, sky: Array, error: Array, *, second: bool = False) -> "SkyImages":
        """Images by rays that meet the surface for the first time, or the second."""
        return cls(star, index, sky, error, np.full(len(star), second))

    def renumbered(self, names: Int[Array, " stars"]) -> "SkyImages":
        """The same images, of stars with other numbers."""
        return replace(self, star=names[self.star])

    def merged(self, more: "SkyImages") -> "SkyImages":
        """Both sets of images, each image once."""
        return _distinct(SkyImages.joined(self, more))

    def counts(self, shape: tuple[int, ...]) -> Int[Array, "stars indices"]:
        """Numbers of images."""
        counts = np.zeros(shape, int)
        np.add.at(counts, (self.star, self.index), 1)
        return counts


@dataclass(frozen=True)
class ImageSearch:
    """The images of stars, ordered by star, index and place, with the certificate.

    images: the images that were found.
    counts: numbers of images found.
    expected: numbers of images that the caustics require.
    on_caustic: True for a star that cannot be distinguished from the caustic of that order.
    ring: True where that caustic is a point, so that the images next to it are one ring, and not entries.
    coarse: by index, the step of a grid that is coarser than the search is made for, radians; 0 for others.
    remarks: for each star, remarks on other doubts.
    certificate: name of the argument behind `certified`.
    """

    images: SkyImages
    counts: Int[Array, "stars indices"]
    expected: Int[Array, "stars indices"]
    on_caustic: Bool[Array, "stars orders"]
    ring: Bool[Array, "stars orders"]
    coarse: tuple[float, ...]
    remarks: tuple[tuple[str, ...], ...] = ()
    certificate: str = "winding"

    @property
    def certified(self) -> Bool[Array, " stars"]:
        """True where the search found as many images on each sheet as are expected, and nothing is uncertain."""
        remarked = np.array([bool(lines) for lines in self.remarks] or np.zeros(len(self.counts), bool))
        return (self.counts == self.expected).all(axis=1) & ~self.on_caustic.any(axis=1) & ~remarked


def search(sheets: Sheets, star: Float[Array, "stars 3"]) -> ImageSearch:
    """All images of the stars."""
    size = max(1, min(_CHUNK, -(-len(star) // cores())))
    chunks = [star[i : i + size] for i in range(0, len(star), size)] or [star]
    if len(chunks) == 1:
        return _searched_thoroughly(sheets, chunks[0])
    with ThreadPoolExecutor(cores()) as pool:
        return searched_together(list(pool.map(lambda chunk: _searched_thoroughly(sheets, chunk), chunks)))


def searched_together(parts: Sequence[ImageSearch]) -> ImageSearch:
    """Searches for several groups of stars joined into one, group after group."""
    names = np.split(np.arange(sum(len(p.counts) for p in parts)), np.cumsum([len(p.counts) for p in parts[:-1]]))
    images = [part.images.renumbered(stars) for part, stars in zip(parts, names, strict=True)]
    arrays = ("counts", "expected", "on_caustic", "ring")
    return replace(
        parts[0],
        images=images[0].joined(*images[1:]),
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in arrays},
        coarse=tuple(np.max([part.coarse for part in parts], axis=0).tolist()),
        remarks=tuple(lines for part in parts for lines in part.remarks),
    )


def _searched_thoroughly(sheets: Sheets, star: Float[Array, "stars 3"]) -> ImageSearch:
    """Stars whose images do not match their number are searched again, more widely; then along paths."""
    counted = sheets.expected_counts(star)
    images = _images(sheets, star, sheets.starts(star, NARROW))
    on_caustic = np.any(counted.on_caustic, axis=1)
    # Next to a caustic both counts are put to the test.
    delicate = on_caustic | (counted.distance < _DELICATE)

    def beside_folds(which: Int[Array, " stars"]) -> Starts:
        return sheets.fold_starts(star[which], tuple(winding[which] for winding in counted.windings))

    for starts in (beside_folds, lambda which: sheets.starts(star[which], WIDE)):
        doubtful = np.flatnonzero((images.counts(counted.expected.shape) != counted.expected).any(axis=1) | delicate)
        if doubtful.size:
            images = images.merged(_images(sheets, star[doubtful], starts(doubtful)).renumbered(doubtful))
    missing = np.argwhere((images.counts(counted.expected.shape) < counted.expected) & ~on_caustic[:, None])
    for i, k in missing.tolist():
        images = images.merged(_approached(sheets, star[i], k, int(counted.expected[i, k])).renumbered(np.array([i])))
    ring = counted.on_caustic & np.array([curve.is_point for curve in sheets.curves])
    images = images[~on_rings(ring)[images.star, images.index]]
    counts = images.counts(counted.expected.shape)
    return ImageSearch(images, counts, counted.expected, counted.on_caustic, ring, sheets.coarse)


def _approached(sheets: Sheets, star: Float[Array, " 3"], index: int, count: int) -> SkyImages:
    """The images of one star on one sheet, followed from those of other stars around that have as many.

    It serves where the map is strongly sheared and the grid gives poor guesses.
    """
    rng = np.random.default_rng(0)
    far = _FARTHEST * rng.uniform(size=(_APPROACHES, 1)) ** 2 * rng.normal(size=(_APPROACHES, 3))
    # Shorter steps toward the end, where a caustic may be close.
    paths = star + np.linspace(1, 0, _WAYPOINTS)[:, None, None] ** 2 * far
    paths /= np.linalg.norm(paths, axis=-1, keepdims=True)
    counts = sheets.expected_counts(paths[:-1].reshape(-1, 3)).expected[:, index].reshape(_WAYPOINTS - 1, _APPROACHES)
    images = SkyImages.arriving(np.empty(0, int), np.empty(0, int), np.empty((0, 3)), np.empty(0))
    followed = 0
    for path in paths[:, (counts == count).all(axis=0)].swapaxes(0, 1):
        approached = _images(sheets, path[:1], sheets.starts(path[:1], NARROW))
        sky, error = approached.sky[approached.index == index], np.empty(0)
        for place in path[1:]:
            followed += len(sky)
            on_sheet = np.full(len(sky), index)
            star_there = np.tile(place, (len(sky), 1))
            _, sky, error = find_roots(sheets.camera, star_there, on_sheet, sky, _FEW_STEPS, end=sheets.surface)
        images = images.merged(SkyImages.arriving(np.zeros(len(sky), int), np.full(len(sky), index), sky, error))
        if len(images.star) >= count or followed > _MOST_FOLLOWED:
            break
    return images


def _images(sheets: Sheets, star: Float[Array, "stars 3"], starts: Starts) -> SkyImages:
    owner, sheet, guess = starts
    which, sky, error = find_roots(sheets.camera, star[owner], sheet, guess, end=sheets.surface)
    return _distinct(SkyImages.arriving(owner[which], sheet[which], sky, error))


def _distinct(images: SkyImages) -> SkyImages:
    """Each image once, ordered by star, index and place."""
    images = images[np.lexsort((images.sky[:, 0], images.index, images.star))]
    repeated = np.zeros(len(images), bool)
    ahead = 1
    while True:
        first, second = images[:-ahead], images[ahead:]
        same = (second.star == first.star) & (second.index == first.index)
        if not same.any():
            break
        same &= second.second_arrival == first.second_arrival
        size = np.maximum(_SAME, _SAME_ERRORS * (second.error + first.error))
        repeated[ahead:] |= same & (lengths(second.sky - first.sky) < size)
        ahead += 1
    return images[~repeated]


def on_rings(ring: Bool[Array, "stars orders"]) -> Bool[Array, "stars orders"]:
    """True, by star and index, where the images on a sheet are a ring, which is its outer or its inner edge.

    Parameters: ring, by star and order, True for stars on a caustic that is a point.
    """
    return ring | np.pad(ring, ((0, 0), (1, 0)))[:, :-1]


def ring_remark(camera: Viewer, surface: End, curve: CriticalCurve, where: str = "lies on") -> str:
    """A remark about the ring that is the image of a star on the caustic of a curve, as a camera sees it."""
    order = curve.order
    places = shown_line_of_sight(camera, np.concatenate([curve.points.line_of_sight, [[-1.0, 0.0, 0.0]]]))
    radius, error = search_sky(camera).circle_radius(places[:-1], places[-1])
    if order == 1 and domain_of(surface, camera).unbounded:
        size = "at infinite (alpha, beta)"
    else:
        size = f"of radius {radius:.12g} {camera.sky_unit} (within {error:.0e})"
    return (
        f"the star {where} the caustic of order {order}, which is a point: its images of index {order - 1} and {order} "
        f"are one ring {size}"
    )


def sharpened(searched: SearchSky, result: ImageSearch, star: Float[Array, "stars 3"], end: End) -> ImageSearch:
    """The images of stars that an observer at a finite radius finds, those of index 0 with smaller errors.

    A screen resolves best the images next to the hole. Direct images lie on it at a distance of about the observer's
    radius, where the rounding of a direction on the engines' sphere is a large length: they are refined on the plain
    sky of a camera at the same place.
    """
    plain, observer = searched.plain_camera, searched.search_camera
    if plain is None:
        return result
    images = result.images
    direct = np.flatnonzero(images.index == 0)
    start = as_seen(images.sky[direct], observer.frame(), plain.frame())
    which, sky, error = find_roots(plain, star[images.star[direct]], images.index[direct], start, _PLAIN_STEPS, end=end)
    sharp, sky = direct[which], as_seen(sky, plain.frame(), observer.frame())
    # A radian on the plain sky, on the engines' sphere.
    error = error / radians_of(plain.radius, sky, search_sky(observer).lengths(sky))
    better = error < images.error[sharp]
    skies, errors = images.sky.copy(), images.error.copy()
    skies[sharp[better]], errors[sharp[better]] = sky[better], error[better]
    return replace(result, images=replace(images, sky=skies, error=errors))
