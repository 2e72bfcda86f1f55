"""Rays, beams and caustics: against rays to 25 digits, and cusps on the equator to 20."""

import math
from collections.abc import Callable, Iterator
from functools import cache
from itertools import count

import numpy as np

import kerrcaustics as kc

from ..accuracy.main import Known, errors, known_rays
from ..directions import FAMILIES
from ..orders.equatorial_cusps import EquatorialCusps
from .points import Measured, Result, Sizes

FAMILY = "whole sky"
CAMERA = kc.Camera(0.999, 6.03)
ORDERS = 3
# Other cameras are so much farther out: what is known of the last one is kept.
FURTHER = 1e-3
_EQUATOR = 1e-8


def methods(sizes: Sizes) -> Iterator[tuple[str, str, float]]:
    """Name, engine and tolerance of each setting; the closed form takes no tolerance."""
    yield "closed form", "closed-form", 1e-10
    for tolerance in sizes.tolerances:
        yield f"integrated, {tolerance:.0e}", "integrated", tolerance
    yield "auto, 1e-10", "auto", 1e-10


def rays(sizes: Sizes) -> Iterator[Measured]:
    """Rays of the whole sky."""
    known = known_rays()[FAMILY]
    for name, engine, tolerance in methods(sizes):
        found = [kc.trace_rays(part.camera, part.sky, engine, tolerance) for part in known]
        true = [np.linalg.norm(f.direction - part.direction, axis=1) for f, part in zip(found, known, strict=True)]
        reported = np.concatenate([f.error for f in found])
        yield _traced(sizes, name, kc.trace_rays, (engine, tolerance), np.concatenate(true), reported)


def beams(sizes: Sizes) -> Iterator[Measured]:
    """Beams of the whole sky, with index, crossings and redshift."""
    for name, engine, tolerance in methods(sizes):
        found = errors(known_rays()[FAMILY], engine, tolerance)
        reported = found["delta_minus reported"]
        yield _traced(sizes, name, kc.trace_beams, (engine, tolerance), found["delta_minus"], reported)


def _traced(
    sizes: Sizes, name: str, trace: Callable, settings: tuple[str, float], true: np.ndarray, reported: np.ndarray
) -> Measured:
    samples = _samples(sizes.directions)

    def work() -> None:
        for camera, sky in samples:
            trace(camera, sky, *settings)

    return Measured(name, work, true, reported, sum(len(sky) for _, sky in samples))


@cache
def _samples(directions: int) -> list[tuple[kc.Camera, np.ndarray]]:
    """Directions that are timed, drawn as those of the truth are."""
    known: list[Known] = known_rays()[FAMILY]
    rng, total = np.random.default_rng(2015), sum(len(part.sky) for part in known)
    return [
        (part.camera, FAMILIES[FAMILY](part.camera, max(directions * len(part.sky) // total, 1), rng)) for part in known
    ]


def caustics(sizes: Sizes) -> Iterator[Measured]:
    """Azimuths of the cusps on the equator of the first three caustics; each timed call has another camera."""
    true = _equatorial_cusps()
    for name, engine in (("closed form", "closed-form"), ("integrated", "integrated"), ("auto", "auto")):
        pairs = np.array([_cusp_miss(curve, true) for curve in kc.caustics(CAMERA, ORDERS, engine)])
        numbers = count(1)

        def work(engine: str = engine, numbers: Iterator[int] = numbers) -> None:
            kc.caustics(kc.Camera(CAMERA.spin, CAMERA.radius + FURTHER * next(numbers)), ORDERS, engine)

        yield Measured(name, work, pairs[:, 0].ravel(), pairs[:, 1].ravel())


@cache
def _equatorial_cusps() -> list[tuple[float, float]]:
    """Azimuths of the prograde and the retrograde cusp of each order."""
    sides = [EquatorialCusps(CAMERA.spin, CAMERA.radius, side).cusps(ORDERS) for side in (1, -1)]
    return [(float(one[1]), float(other[1])) for one, other in zip(*sides, strict=True)]


def _cusp_miss(curve: kc.Caustic, true: list[tuple[float, float]]) -> np.ndarray:
    """True and reported errors (2, 2) of the two cusps on the equator."""
    found = [cusp for cusp in curve.cusps if abs(cusp.celestial[0] - math.pi / 2) < _EQUATOR]
    gaps = [
        [abs(math.remainder(cusp.celestial[1] - phi, 2 * math.pi)) for cusp in found] for phi in true[curve.order - 1]
    ]
    nearest = [int(np.argmin(row)) for row in gaps]
    return np.array([[row[i] for row, i in zip(gaps, nearest, strict=True)], [found[i].error for i in nearest]])


_LONG = "25 digits (studies/truth)"
RESULTS = (
    Result("rays", "ray", "n′, rad", _LONG, rays, 0.99),
    Result("rays", "beam", "δ₋ / δ₊", _LONG, beams, 0.99),
    Result("curves", "three caustics", "φ′ of cusps, rad", "20 digits (studies/orders)", caustics),
)
"""Results of this module."""
