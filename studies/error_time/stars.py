"""Images of stars, tracks and pair events: against images in quadruple precision, and folds in long arithmetic."""

import json
import math
from collections.abc import Iterator
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, cast

import numpy as np
from mpmath import mp, mpf

import kerrcaustics as kc

from ..adversary.truth import Known, known
from ..truth.camera import Place, unit
from ..truth.rays import displaced, tangent_basis
from .points import Measured, Result, Sizes

IMAGES = Path(__file__).parents[2] / "tests" / "data" / "images.json"
CAMERA = kc.Camera(0.999, 6.03)
PLACE = Place(0.999, 6.03, math.pi / 2, "circular")
HIGHEST = 2
EVENT_LEVEL = 1.35
# Newton steps, and by how much the determinant's slopes are taken.
_STEPS, _BESIDE = 2, mpf("1e-6")
# Levels and azimuths of timed calls are so far apart: what is known of the last star is kept.
_FURTHER = 1e-3

Pairs = list[np.ndarray]


def _stars(sizes: Sizes) -> list[dict[str, Any]]:
    """The stars of the reference, with all their images; star: (theta', phi')."""
    rows = json.loads(IMAGES.read_text(encoding="utf-8"))[: sizes.stars]
    for row in rows:
        x, y, z = row["star"]
        row["star"] = math.atan2(math.hypot(x, y), z), math.atan2(y, x)
    return rows


def images(sizes: Sizes, quantity: str) -> Iterator[Measured]:
    """One more star of a camera; quantity: "place" or "magnification"."""
    numbers = count(1)
    pairs = [_image_miss(kc.star_images(CAMERA, row["star"], HIGHEST), row, quantity) for row in _stars(sizes)]

    def work() -> None:
        kc.star_images(CAMERA, (1.4, 2.9 + _FURTHER * next(numbers)), HIGHEST)

    yield _measured("one more star", work, pairs)


def tracks(sizes: Sizes) -> Iterator[Measured]:
    """Tracks of a star over an orbit, and the places of the reference on them."""
    numbers = count(1)
    pairs = []
    for row in _stars(sizes):
        level, azimuth = row["star"]
        found = cast(kc.StarImages, kc.star_tracks(CAMERA, level, HIGHEST).images_at(azimuth=azimuth))
        pairs.append(_image_miss(found, row, "place"))

    def work() -> None:
        kc.star_tracks(CAMERA, 1.4 + _FURTHER * next(numbers), HIGHEST)

    yield _measured("one more star", work, pairs)


def _measured(setting: str, work: Any, pairs: Pairs) -> Measured:
    true, reported = np.concatenate(pairs, axis=1)
    return Measured(setting, work, true, reported)


def _image_miss(found: kc.StarImages, row: dict[str, Any], quantity: str) -> np.ndarray:
    """True and reported errors (2, n) of the images of a star; infinite if one is missing."""
    known_images = row["images"]
    sky, index = (np.array([image[name] for image in known_images]) for name in ("N", "index"))
    gap = np.linalg.norm(sky[:, None] - found.sky[None], axis=-1)
    gap[index[:, None] != found.index[None]] = math.inf
    nearest = gap.argmin(axis=1)
    if quantity == "place":
        return np.stack([gap.min(axis=1), found.error[nearest]])
    true = 1 / np.abs([image["det"] for image in known_images])
    off = np.abs(found.magnification[nearest] / true - 1)
    return np.stack([off, (found.magnification_error / found.magnification)[nearest]])


def events(sizes: Sizes) -> Iterator[Measured]:
    """Azimuths at which pairs are born and die."""
    numbers = count(1)
    found = kc.pair_events(CAMERA, EVENT_LEVEL, HIGHEST)
    off = [abs(math.remainder(event.azimuth - true_fold(event.sky), 2 * math.pi)) for event in found]

    def work() -> None:
        kc.pair_events(CAMERA, EVENT_LEVEL + _FURTHER * next(numbers), HIGHEST)

    yield Measured("one more star", work, np.array(off), np.array([event.error for event in found]))


def true_fold(sky: np.ndarray) -> float:
    """phi' where a caustic has a polar angle, in long arithmetic, by Newton's method from a place next to it.

    Unknown is the direction N; its ray must end at that polar angle, with a beam whose area vanishes.
    """
    with mp.workdps(60):
        n = unit([mpf(float(x)) for x in sky])
        for _ in range(_STEPS):
            ray, tangents = _ray(n), tangent_basis(n)
            beside = [_level_and_area(_ray(unit(displaced(n, tangent, _BESIDE)))) for tangent in tangents]
            here = _level_and_area(ray)
            slopes = np.stack([one - here for one in beside], axis=1) / float(_BESIDE)
            step = np.linalg.solve(slopes, -here)
            for tangent, part in zip(tangents, step.tolist(), strict=True):
                n = displaced(n, tangent, mpf(part))
            n = unit(n)
    x, y, _ = _ray(n).direction
    return math.atan2(y, x)


def _ray(n: list) -> Known:
    found = known(PLACE, n, math.inf)
    if not isinstance(found, Known):
        raise ValueError(f"Argument `sky` must lead to the celestial sphere, but ends there: {found}.")
    return found


def _level_and_area(ray: Known) -> np.ndarray:
    """The polar angle less that of the event, and the area of the beam."""
    x, y, z = ray.direction
    area = np.dot(ray.direction, np.cross(*ray.columns.T))
    return np.array([math.atan2(math.hypot(x, y), z) - EVENT_LEVEL, area])


_QUADRUPLE = "quadruple precision (tests/data)"
RESULTS = (
    Result("stars", "images of a star", "N, rad", _QUADRUPLE, partial(images, quantity="place")),
    Result("stars", "their magnification", "relative", _QUADRUPLE, partial(images, quantity="magnification")),
    Result("stars", "pair events", "φ′, rad", "50 digits (studies/adversary)", events),
    Result("stars", "tracks", "N, rad", _QUADRUPLE, tracks),
)
"""Results of this module."""
