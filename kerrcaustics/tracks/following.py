"""The images of a source followed through any motion of a viewer: a list of viewers, one for each moment."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.images.images import StarImages, star_images
from kerrcaustics.lens_map.arguments import checked_index
from kerrcaustics.lens_map.domains import Domain, domain_of, search_surface
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.lens_map.sky_chart import Chart, chart_difference, chart_of
from kerrcaustics.numerics.matching import best_matches
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, in_steps, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.checks import numbers, quoted
from kerrcaustics.spacetime.sphere import angle_between
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_FEW_STEPS = 20
# Distance below which an image that was followed is one of those searched for, radians.
_SAME = 1e-8
# The same in errors of the image.
_SAME_ERRORS = 10.0


@result("followed-star/1", record="certified remarks images before followed created annihilated")
class FollowedStar(Shown):
    """The images of a source for every viewer of a list, each image linked to one of the viewer before.

    Images are created and annihilated in pairs of index k - 1 and k, provided that at most one caustic is crossed in
    one step. Images of index max_index are an exception: their partner may have a higher index.
    """

    images: tuple[StarImages, ...] = quantity("camera", "", "images for each camera, each with its certificate")
    before: tuple[Array, ...] = quantity(
        "camera image",
        "1",
        "for each image, the image of the previous camera that it continues; -1 for a new one and for the first camera",
    )
    followed: tuple[Array, ...] = quantity(
        "camera image",
        "1",
        "True if Newton's method led from the previous image to this one; otherwise the nearest remaining one is taken",
    )
    created: tuple[tuple[int, ...], ...] = quantity("camera new", "1", "new images of each camera")
    annihilated: tuple[tuple[int, ...], ...] = quantity(
        "camera gone", "1", "for each camera, the images of the previous camera that have disappeared"
    )

    @property
    @derived("", "1")
    def certified(self) -> bool:
        """True if the images of every camera are certified."""
        return all(images.certified for images in self.images)

    @property
    @derived("", "")
    def remarks(self) -> tuple[str, ...]:
        """Remarks about the images of each camera, which is named by its number, from 0."""
        return tuple(f"camera {i}: {remark}" for i, images in enumerate(self.images) for remark in images.remarks)

    def __len__(self) -> int:
        """Number of cameras."""
        return len(self.images)

    def __repr__(self) -> str:
        """Summary in one line: how many cameras, creations and annihilations."""
        new, gone = (sum(map(len, parts)) for parts in (self.created, self.annihilated))
        return f"<FollowedStar at {len(self)} cameras: {new} images created, {gone} annihilated>"


@dataclass(frozen=True)
class _SearchedImages:
    """The images of one viewer, with their directions on the sky that is searched for it."""

    images: StarImages
    sky: Float[Array, "images 3"]
    domain: Domain

    @classmethod
    def from_images(cls, images: StarImages) -> "_SearchedImages":
        """The images of a viewer, with its search sky."""
        searched = search_sky(images.camera)
        sky = searched.to_search(images.sky).reshape(-1, 3)
        return cls(images, sky, domain_of(images.surface, searched.search_camera))

    @property
    def chart(self) -> Chart:
        """Coordinates on the sky about the shadow."""
        return chart_of(self.domain.camera)

    @property
    def star(self) -> Float[Array, " axes"]:
        """The source as a vector of its surface."""
        return self.images.surface.vectors(np.array([self.images.star]))[0]


@usual_warnings
@with_progress
def follow_star(
    cameras: Sequence[Viewer],
    star: ArrayLike,
    max_index: int = 2,
    *,
    end: Wherever | End = math.inf,
    progress: Progress | bool | None = None,
) -> FollowedStar:
    """All images of a source for each of a list of viewers, linked from one viewer to the next.

    Parameters
    ----------
    cameras : sequence of Camera, or of Observer
        In order of time. Each new place requires a search of its sky (a second).
    star : (theta', phi') or (m, 2) array
        Radians, relative to the camera, whose azimuth is 0; one for all cameras, or one for each. In the plane (r,
        phi).
    max_index : int
        0 to 6.
    end : float, Sphere or EquatorialPlane
        Where the source lies, as for `star_images`. Cameras may move through its radius.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    FollowedStar

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `StarImages.error`. Links are certain where `followed` is True and the steps are small.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> cameras = [kc.Camera(spin=0.9, radius=radius) for radius in (10.0, 9.9)]
    >>> followed = kc.follow_star(cameras, star=(1.4, 2.9), max_index=1)
    >>> len(followed), followed.certified
    (2, True)
    """
    cameras, highest = _checked_cameras(cameras, end), checked_index(max_index)
    places = _checked_places(star, cameras, end)
    moments: list[_SearchedImages] = []
    links: list[tuple[Array, Array]] = []
    for camera, place in in_steps("camera", list(zip(cameras, places, strict=True))):
        now = _SearchedImages.from_images(star_images(camera, place, highest, end=end))
        links.append(_linked(moments[-1], now) if moments else _unlinked(now))
        moments.append(now)
    before = tuple(link for link, _ in links)
    return FollowedStar(
        images=tuple(moment.images for moment in moments),
        before=before,
        followed=tuple(sure for _, sure in links),
        created=((), *(tuple(np.flatnonzero(link < 0).tolist()) for link in before[1:])),
        annihilated=((), *(_lost_images(last, link) for last, link in pairwise(before))),
    )


def _lost_images(last: Array, link: Array) -> tuple[int, ...]:
    """Numbers of the images before that no link leads to."""
    return tuple(np.setdiff1d(np.arange(len(last)), link).tolist())


def _unlinked(now: _SearchedImages) -> tuple[Int[Array, " images"], Bool[Array, " images"]]:
    return np.full(len(now.images), -1), np.zeros(len(now.images), bool)


def _linked(last: _SearchedImages, now: _SearchedImages) -> tuple[Int[Array, " images"], Bool[Array, " images"]]:
    """The earlier image that each image now continues (-1: none), and whether Newton's method says so."""
    # Where rays fall onto the surface images lie inside the shadow, too, of which the chart knows nothing.
    inside = last.domain.falls or now.domain.falls
    start, stop = (_coordinates(moment, inside=inside) for moment in (last, now))
    index = last.images.index
    guess = now.chart.unscaled(start) if inside else now.chart.sky(index, start)
    link, sure = _by_newton(now, index, guess, last.images.second_arrival)
    for k in np.unique(now.images.index):
        free = np.flatnonzero((now.images.index == k) & (link < 0))
        left = np.setdiff1d(np.flatnonzero(index == k), link)
        step = chart_difference(np.array(0 if inside else k), start[left][:, None], stop[free][None])
        for i, j in zip(*best_matches(np.linalg.norm(step, axis=-1)), strict=True):
            link[free[j]] = left[i]
    return link, sure


def _coordinates(moment: _SearchedImages, *, inside: bool) -> Float[Array, "images 3"]:
    """Coordinates in which images move little from one viewer to the next."""
    chart = moment.chart
    return chart.scaled(moment.sky) if inside else chart.place(moment.images.index, moment.sky)


def _by_newton(
    now: _SearchedImages,
    index: Int[Array, " before"],
    guess: Float[Array, "before 3"],
    second_arrival: Bool[Array, " before"],
) -> tuple[Int[Array, " images"], Bool[Array, " images"]]:
    """Links that Newton's method makes, from guesses for the images before."""
    link, _ = _unlinked(now)
    hits = np.zeros(len(link), int)
    for start, sky, error in _roots(now, index, guess, second_arrival & now.domain.falls):
        away = np.where(now.images.index == index[start], angle_between(now.sky, sky), math.inf)
        if len(away) and away.min() < max(_SAME, _SAME_ERRORS * error):
            hit = int(np.argmin(away))
            link[hit], hits[hit] = start, hits[hit] + 1
    # Of several that led to one image none is sure.
    return np.where(hits == 1, link, -1), hits == 1


def _roots(
    now: _SearchedImages,
    index: Int[Array, " before"],
    guess: Float[Array, "before 3"],
    second_arrival: Bool[Array, " before"],
) -> list[tuple[int, Array, float]]:
    """Guesses that lead to an image, its direction, and the error of that, leaf by leaf."""
    roots: list[tuple[int, Array, float]] = []
    surface = now.images.surface
    for leaf in np.unique(second_arrival).tolist():
        on_leaf = np.flatnonzero(second_arrival == leaf)
        star = np.tile(now.star, (len(on_leaf), 1))
        end = surface.at_second_arrival() if leaf else surface
        which, sky, error = find_roots(now.domain.camera, star, index[on_leaf], guess[on_leaf], _FEW_STEPS, end=end)
        roots += zip(on_leaf[which].tolist(), sky, error.tolist(), strict=True)
    return roots


def _checked_cameras(cameras: Sequence[Viewer], end: Wherever | End) -> list[Viewer]:
    if isinstance(cameras, Viewer) or not isinstance(cameras, Sequence) or len(cameras) == 0:
        raise ValueError(f"Argument `cameras` must be a list of at least one viewer, but is {quoted(cameras)}.")
    for i, camera in enumerate(cameras):
        if not isinstance(camera, Viewer):
            raise ValueError(
                f"Argument `cameras` must hold a Camera or an Observer each, but item {i} is {type(camera).__name__}."
            )
        if camera.sky_coordinates != cameras[0].sky_coordinates:
            raise ValueError("Argument `cameras` must hold either Cameras or Observers, whose skies differ, not both.")
        if search_surface(camera, end).in_plane and camera.on_equator:
            raise ValueError(
                "Argument `cameras` must not lie in the equatorial plane if the sources do, but item "
                f"{i} has the inclination {camera.inclination:g} (90 degrees)."
            )
    return list(cameras)


def _checked_places(star: ArrayLike, cameras: list[Viewer], end: Wherever | End) -> list[tuple[float, float]]:
    """The source's place for each camera."""
    places, count = numbers("star", star), len(cameras)
    if places.shape not in ((2,), (count, 2)):
        raise ValueError(
            "Argument `star` must be (theta', phi') in radians, in the plane (r, phi), or one such pair for each of "
            f"the {count} cameras."
        )
    rows = zip(cameras, np.broadcast_to(places, (count, 2)).tolist(), strict=True)
    checked = [search_surface(camera, end).checked("star", place, camera, one=True) for camera, place in rows]
    return [(float(first), float(second)) for first, second in checked]
