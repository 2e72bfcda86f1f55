"""Light curves, discs and waves: against rays and fields in closed form, without spin, and slow sums with it."""

import json
import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.ends import SKY

from ..extended_sources.twin import summed
from ..truth.partial_waves import field
from .behind import beside, centred
from .no_spin import Circle
from .points import Measured, Result, Sizes

ORBIT = Circle(radius=8.0, distance=50.0, inclination=1.0)
VIEWER = kc.Camera(0.0, ORBIT.distance, ORBIT.inclination, "static")
FIRST, LAST = 100.0, 240.0
IMAGES = 3
SPOT = 0.1
SPOT_POINTS = (16, 256, 1024, 4096)
BALLS = (0.1, 0.01, 0.001)

NEAR = kc.Camera(0.0, 10.0, math.pi / 2, "static")
AWAY = 0.5
CAMERA = kc.Camera(0.999, 6.03)
DISCS = (0.1, 0.01)
# Changes of the slow sum that its own error may amount to.
SUMMED = 4.0

WAVES = Path(__file__).parents[2] / "tests" / "data" / "waves_spin.json"
ANGLES = np.array([0.05, 0.3, 1.0, 1.8, 2.6])
SPINNING = 3.766
# Places and times of timed calls are so far apart: what is known of the last one is kept.
FURTHER = 1e-5


def light_curves(sizes: Sizes, sources: dict[str, Any]) -> Iterator[Measured]:
    """Flux of sources, by the names of the settings, over an orbit."""
    times = np.linspace(FIRST, LAST, sizes.times)
    for setting, source in sources.items():
        found = kc.light_curve(VIEWER, ORBIT.radius, times, source=source)
        true = _flux(times, source)

        def work(source: Any = source) -> None:
            kc.light_curve(VIEWER, ORBIT.radius, times, source=source)

        yield Measured(setting, work, np.abs(found.flux / true - 1), found.error / found.flux)


def _flux(times: np.ndarray, source: Any) -> np.ndarray:
    """The true flux; of a ball that of a point."""
    if isinstance(source, kc.Spot):
        return np.sum([ORBIT.spread(times, image, source.size) for image in range(source.crossings)], axis=0)
    return np.sum([ORBIT.light(times, image, "point") for image in range(IMAGES)], axis=0)


def point_light(sizes: Sizes) -> Iterator[Measured]:
    """Light of a point."""
    return light_curves(sizes, {f"{sizes.times} times": "point"})


def ball_light(sizes: Sizes) -> Iterator[Measured]:
    """Light of balls of several sizes."""
    return light_curves(sizes, {f"radius {size:g}": kc.Ball(size) for size in BALLS})


def spot_light(sizes: Sizes) -> Iterator[Measured]:
    """Light of a spot, with more and more points on its orbit."""
    counts = [points for points in SPOT_POINTS if points <= sizes.spot_points]
    spots = [kc.Spot(SPOT, crossings=IMAGES, points=points) for points in counts]
    return light_curves(sizes, {f"{spot.points} points": spot for spot in spots})


def discs_away(sizes: Sizes) -> Iterator[Measured]:
    """Discs away from the caustic of a hole without spin."""
    for size in DISCS:
        yield _disc(NEAR, (math.pi / 2, math.pi - AWAY), size, 1, beside(NEAR.radius, AWAY, size))


def discs_on_point(sizes: Sizes) -> Iterator[Measured]:
    """Discs on the caustic of a hole without spin, a point."""
    for size in DISCS:
        yield _disc(NEAR, (math.pi / 2, math.pi), size, 1, centred(NEAR.radius, size))


def discs_on_fold(sizes: Sizes) -> Iterator[Measured]:
    """Discs on a fold of a spinning hole."""
    curve = kc.caustics(CAMERA, 2)[1]
    place = curve.place[len(curve.place) // 7]
    for size in DISCS:
        total, off = summed(CAMERA, SKY.vectors(place[None])[0], size, 2)
        yield _disc(CAMERA, (float(place[0]), float(place[1])), size, 2, total, SUMMED * off / total)


def _disc(
    camera: kc.Camera, place: tuple[float, float], size: float, highest: int, true: float, known: float = 0.0
) -> Measured:
    found, numbers = kc.magnification(camera, place, size, max_index=highest), count(1)

    def work() -> None:
        kc.magnification(camera, (place[0], place[1] + FURTHER * next(numbers)), size, max_index=highest)

    off, reported = abs(found.total / true - 1), found.error / found.total
    return Measured(f"radius {size:g} rad", work, np.array([off]), np.array([reported]), known=known)


def waves(sizes: Sizes) -> Iterator[Measured]:
    """Fields of sources on the celestial sphere of a hole without spin, by frequency."""
    for omega in sizes.frequencies:
        true = field(omega, NEAR.radius, ANGLES)
        places = [(math.pi / 2, math.pi - angle) for angle in ANGLES.tolist()]
        camera = kc.Camera(0.0, NEAR.radius, math.pi / 2, "fiducial")
        yield _field(f"ω M = {omega:g}", camera, places, omega, true, {"max_index": 4})


def waves_with_spin(sizes: Sizes) -> Iterator[Measured]:
    """Fields of a spinning hole, also on folds and cusps."""
    rows = [row for row in json.loads(WAVES.read_text(encoding="utf-8"))["rows"] if row["omega"] == SPINNING]
    camera = kc.Camera(rows[0]["spin"], rows[0]["radius"], rows[0]["inclination"], "fiducial")
    true = np.array([complex(*row["field"]) for row in rows])
    places = [tuple(row["source"]) for row in rows]
    yield _field(f"ω M = {SPINNING:g}", camera, places, SPINNING, true, {"end": rows[0]["end"]})


def _field(
    setting: str, camera: kc.Camera, places: list, omega: float, true: np.ndarray, options: dict[str, Any]
) -> Measured:
    """Errors of fields at places, relative to the field there."""
    found = [kc.amplification(camera, place, omega, **options) for place in places]
    numbers = count(1)

    def work() -> None:
        theta, phi = places[1]
        kc.amplification(camera, (theta, phi + FURTHER * next(numbers)), omega, **options)

    off = np.array([abs(one.value[0] - value) for one, value in zip(found, true, strict=True)])
    reported = np.array([one.error[0] for one in found])
    return Measured(setting, work, off / np.abs(true), reported / np.abs(true))


_CLOSED = "closed form, no spin"
RESULTS = (
    Result("light", "light curve, point", "flux, relative", _CLOSED, point_light),
    Result("light", "light curve, spot", "flux, relative", _CLOSED, spot_light),
    Result("light", "light curve, ball", "flux, relative", f"{_CLOSED}, of a point", ball_light),
    Result("discs", "disc away from a caustic", "magnification, relative", _CLOSED, discs_away),
    Result("discs", "disc on a caustic, no spin", "magnification, relative", _CLOSED, discs_on_point),
    Result("discs", "disc on a fold", "magnification, relative", "a slow sum over rays", discs_on_fold),
    Result("waves", "waves, no spin", "field, relative", "partial waves (studies/truth)", waves),
    Result("waves", "waves on folds and cusps", "field, relative", "separated modes (tests/data)", waves_with_spin),
)
"""Results of this module."""
