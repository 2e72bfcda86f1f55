"""The images of a star followed through any motion of a camera: a list of cameras, one for each moment."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from kerrcaustics.beams.ends import SKY
from kerrcaustics.images.images import StarImages, checked_sheets, images_of
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.lens_map.sky_chart import Chart, apart
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.spacetime.camera import Camera, check_camera
from kerrcaustics.spacetime.checks import numbers, quoted
from kerrcaustics.spacetime.sphere import angle_between, from_angles

Array = np.ndarray

_FEW_STEPS = 20
# An image that is found again lies so close (radians) to one of those searched for.
_SAME = 1e-8


@result("followed-star/1", record="certified images before followed created annihilated")
class FollowedStar:
    """The images of a star at every camera of a list, each linked to that of the camera before.

    Images are created and annihilated in pairs of index k - 1 and k, as long as no more than one caustic was crossed in
    one step, and but for images of index max_index, whose partner may have a higher one.
    """

    images: tuple[StarImages, ...] = quantity("camera", "", "one for each camera, each with its certificate")
    before: tuple[Array, ...] = quantity(
        "camera image",
        "1",
        "for each image, which image of the camera before it continues; -1 for a new one, and for the first camera",
    )
    followed: tuple[Array, ...] = quantity(
        "camera image",
        "1",
        "True where Newton's method led from the image before to this one; else the nearest that was left over",
    )
    created: tuple[tuple[int, ...], ...] = quantity("camera new", "1", "for each camera its images that are new")
    annihilated: tuple[tuple[int, ...], ...] = quantity(
        "camera gone", "1", "for each camera the images of the camera before that are gone"
    )

    @property
    @derived("", "1")
    def certified(self) -> bool:
        """True if the images of every camera are certified."""
        return all(images.certified for images in self.images)

    def __len__(self) -> int:
        """Number of cameras."""
        return len(self.images)

    def __repr__(self) -> str:
        """Summary in one line: how many cameras, creations and annihilations."""
        new, gone = (sum(map(len, parts)) for parts in (self.created, self.annihilated))
        return f"<FollowedStar at {len(self)} cameras: {new} images created, {gone} annihilated>"


@usual_warnings
def follow_star(cameras: Sequence[Camera], star: ArrayLike, max_index: int = 2) -> FollowedStar:
    """All images of a star at each of a list of cameras, linked from one camera to the next.

    Parameters
    ----------
    cameras : sequence of Camera
        In the order of time. Each new place costs a search for critical curves (a second).
    star : (theta', phi') or (m, 2) array
        Radians, relative to the camera, whose azimuth is 0; one for all cameras, or one for each.
    max_index : int
        0 to 6.

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
    cameras = _checked_cameras(cameras)
    angles = _checked_places(star, cameras)
    images: list[StarImages] = []
    before, followed, created, annihilated = [], [], [], []
    sheets = None
    for camera, place in zip(cameras, angles, strict=True):
        last, sheets = sheets, checked_sheets(camera, max_index)
        spot = (float(place[0]), float(place[1]))
        now = images_of(camera, sheets.surface, [spot], search(sheets, from_angles(*spot)[None]))[0]
        if last is None:
            link, sure = np.full(len(now), -1), np.zeros(len(now), bool)
            new, gone = np.empty(0, int), np.empty(0, int)
        else:
            link, sure = _linked((last, cameras[len(images) - 1], images[-1]), (sheets, camera, now))
            new, gone = np.flatnonzero(link < 0), np.setdiff1d(np.arange(len(images[-1])), link)
        images.append(now)
        before.append(link)
        followed.append(sure)
        created.append(tuple(new.tolist()))
        annihilated.append(tuple(gone.tolist()))
    return FollowedStar(tuple(images), tuple(before), tuple(followed), tuple(created), tuple(annihilated))


def _linked(
    last: tuple[Sheets, Camera, StarImages], this: tuple[Sheets, Camera, StarImages]
) -> tuple[Int[Array, " images"], Bool[Array, " images"]]:
    """For each image now which image before it continues (-1: none), and whether Newton's method says so."""
    (sheets_0, camera_0, images_0), (sheets_1, camera_1, images_1) = last, this
    sky_0, sky_1 = (
        as_seen(images_0.sky, camera_0.frame(), sheets_0.frame),
        as_seen(images_1.sky, camera_1.frame(), sheets_1.frame),
    )
    chart_0, chart_1 = Chart(sheets_0.camera), Chart(sheets_1.camera)
    place_0, place_1 = chart_0.place(images_0.index, sky_0), chart_1.place(images_1.index, sky_1)
    link, sure = np.full(len(images_1), -1), np.zeros(len(images_1), bool)
    star = np.tile(from_angles(*images_1.star), (len(images_0), 1))
    guess = chart_1.sky(images_0.index, place_0)
    which, found, _ = find_roots(sheets_1.camera, star, images_0.index, guess, _FEW_STEPS)
    for start, sky in zip(which.tolist(), found, strict=True):
        away = np.where(images_1.index == images_0.index[start], angle_between(sky_1, sky), math.inf)
        if len(away) and away.min() < _SAME:
            hit = int(np.argmin(away))
            # Two that led to one image: neither is sure.
            link[hit], sure[hit] = (start, True) if link[hit] < 0 else (-1, False)
    for k in np.unique(images_1.index):
        free_1 = np.flatnonzero((images_1.index == k) & (link < 0))
        free_0 = np.setdiff1d(np.flatnonzero(images_0.index == k), link)
        step = apart(np.array(k), place_0[free_0][:, None], place_1[free_1][None])
        for i, j in zip(*linear_sum_assignment(np.linalg.norm(step, axis=-1)), strict=True):
            link[free_1[j]] = free_0[i]
    return link, sure


def _checked_cameras(cameras: Sequence[Camera]) -> list[Camera]:
    if isinstance(cameras, Camera) or not isinstance(cameras, Sequence) or len(cameras) == 0:
        raise ValueError(f"Argument `cameras` must be a list of at least one Camera, but is {quoted(cameras)}.")
    for camera in cameras:
        check_camera(camera)
    return list(cameras)


def _checked_places(star: ArrayLike, cameras: list[Camera]) -> Float[Array, "cameras 2"]:
    """Angles of the star at each camera."""
    angles, count = numbers("star", star), len(cameras)
    if angles.shape not in ((2,), (count, 2)):
        raise ValueError(
            f"Argument `star` must be (theta', phi') in radians, or one such pair for each of the {count} cameras."
        )
    angles = np.broadcast_to(angles, (count, 2))
    SKY.checked("star", angles, cameras[0])
    return angles
