"""Derivatives of rays, images, caustics and events, against long arithmetic and against differences between viewers.

Derivatives of rays and of images are central differences in long arithmetic, good to 20 digits. Those of caustics and
of events are differences between results for other viewers, extrapolated to a step of 0 (Richardson); the last
extrapolation and the errors of the results are allowed for.
"""

import math
import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import from_angles, polar_angle

from ...truth.camera import Place, unit
from ...truth.rays import Path, escapes, follow, tangent_basis
from ..cases import hard_camera
from .claim import Claim, Kind
from .paths import hard_direction

# Digits of long arithmetic, its steps in parameters, and those of determinants in it.
_DIGITS, _STEP, _WIDER_STEP = 50, mpf("1e-20"), mpf("1e-10")
# Seconds after which the truth of a case is given up.
_PATIENCE = 10.0
# What kerrcaustics.functional states of its results, times the diameter of the beam for every derivative.
_STATED = 1e-13
# Step of differences between viewers.
_WIDE = 1e-3
_GIVEN = ("spin", "radius", "inclination")


class _Ray(NamedTuple):
    """A ray as a function: numbers of the place, the three of its direction, and the motion of the camera."""

    numbers: list
    velocity: Any

    def moved(self, which: int, by: mpf) -> "_Ray":
        numbers = [x + by * (i == which) for i, x in enumerate(self.numbers)]
        return _Ray(numbers, self.velocity)

    def along(self, way: list, by: mpf) -> "_Ray":
        return _Ray([x + by * y for x, y in zip(self.numbers, way, strict=True)], self.velocity)

    @property
    def place(self) -> Place:
        return Place(*self.numbers[:3], self.velocity)

    @property
    def sky(self) -> list:
        return unit(self.numbers[3:])

    def end(self, latest: float) -> list:
        """n' and the time, four numbers; raises TimeoutError if it takes too long."""
        path = Path(self.place, self.sky, _DIGITS, timed=True)

        def watch(_paths: list, _s: float) -> None:
            if time.process_time() > latest:
                raise TimeoutError

        follow([path], watch)
        end = path.end()
        return [*end.direction, end.delay]


def _ray_of(camera: kc.Camera, sky: np.ndarray) -> _Ray:
    exact = mp.pi / 2 if camera.inclination == math.pi / 2 else mpf(camera.inclination)
    return _Ray([mpf(camera.spin), mpf(camera.radius), exact, *map(mpf, sky.tolist())], camera.velocity)


def _slope(function: Callable[[mpf], list], step: mpf) -> list:
    return [(p - m) / (2 * step) for p, m in zip(function(step), function(-step), strict=True)]


def of_rays(rng: np.random.Generator) -> list[Claim]:
    """First derivatives of kc.functional.direction and travel_time, of a hard ray of a hard camera."""
    camera = hard_camera(rng)
    # Steps in parameters stay among cameras.
    if not (camera.spin > 1e-15 and 1e-15 < camera.inclination < math.pi - 1e-15):
        return []
    return ray_claims(camera, hard_direction(camera, rng), slopes_of_rays(camera.velocity))


def ray_claims(camera: kc.Camera, sky: np.ndarray, function: Callable[..., Any]) -> list[Claim]:
    """Claims of the derivatives (4, 6) of n' and of the time that a function of (place, sky) returns."""
    numbers = np.array([camera.spin, camera.radius, camera.inclination, *sky])
    latest = time.process_time() + _PATIENCE
    with mp.workdps(_DIGITS + 15):
        ray = _ray_of(camera, sky)
        try:
            if not escapes(ray.place, ray.sky):
                return []
            true = [_slope(lambda by, k=k: ray.moved(k, by).end(latest), _STEP) for k in range(6)]
        except TimeoutError:
            return []
        slopes = np.array(true, float).T
    found = np.asarray(function(numbers))
    code = f"kc.functional.direction{(*numbers[:3].tolist(), sky.tolist(), camera.velocity)!r}"
    size = max(1.0, float(np.linalg.norm(slopes[:3, 3:], 2)))
    claims = []
    for name, rows, length in (("direction", slice(0, 3), 1.0), ("time", slice(3, 4), 1.0 + camera.radius)):
        allowed = _STATED * length * size * max(size, float(np.abs(slopes[rows]).max()))
        off = float(np.abs(found[rows] - slopes[rows]).max())
        claims.append(Claim(f"slopes of {name}", off / allowed if math.isfinite(off) else math.inf, code))
    return claims


def slopes_of_rays(velocity: Any) -> Callable[[np.ndarray], Any]:
    """Derivatives (4, 6) of n' and of the travel time, by JAX."""
    import jax
    import jax.numpy as jnp

    def ends(numbers: Any) -> Any:
        given = (*numbers[:3], numbers[3:], velocity)
        return jnp.append(kc.functional.direction(*given), kc.functional.travel_time(*given))

    def slopes(numbers: np.ndarray) -> Any:
        with jax.enable_x64(True):
            return np.asarray(jax.jacfwd(ends)(jnp.asarray(numbers)))

    return slopes


def of_images(rng: np.random.Generator) -> list[Claim]:
    """Derivatives of one image of a star, by one parameter: anywhere or next to a caustic."""
    camera = ordinary_camera(rng)
    star = star_near_caustic(camera, rng)
    images = kc.star_images(camera, star, int(rng.integers(0, 3)))
    if not len(images):
        return []
    call = f"kc.star_images({camera!r}, {star!r}, {images.max_index})"
    found = kc.image_derivatives(camera, images)
    return image_claims(images, found, int(rng.integers(len(images))), int(rng.integers(5)), call)


def image_claims(images: kc.StarImages, found: Any, i: int, k: int, call: str) -> list[Claim]:
    """Claims of the derivatives of image i by parameter k: spin, radius, inclination, theta', phi'."""
    with mp.workdps(_DIGITS + 15):
        try:
            true = _true_slopes(images.camera, images.sky[i], k, time.process_time() + _PATIENCE)
        except TimeoutError:
            return []
    code = f"kc.image_derivatives(camera, {call}), image {i}, by {found.parameters[k]}"
    mine = found.sky[i, :, k], found.magnification[i, k] / images.magnification[i], found.time[i, k]
    largest = (
        np.abs(found.sky[i]).max(),
        np.abs(found.magnification[i]).max() / images.magnification[i],
        np.abs(found.time[i]).max(),
    )
    names = "slopes of images", "slopes of magnifications", "slopes of times"
    return [
        Claim(name, float(np.abs(one - other).max() / (error * size)), code)
        for name, one, other, error, size in zip(names, mine, true, found.error[i], largest, strict=True)
    ]


def _true_slopes(camera: kc.Camera, sky: np.ndarray, k: int, latest: float) -> tuple[np.ndarray, float, float]:
    """Derivatives of N, of ln magnification and of the time of an image by parameter k: implicit ones, in mpmath."""
    ray = _ray_of(camera, sky)
    n = ray.end(latest)
    beside = tangent_basis(ray.sky)
    columns = [_slope(lambda by, e=e: ray.along([0, 0, 0, *e], by).end(latest), _STEP) for e in beside]
    given = _slope(lambda by: ray.moved(k, by).end(latest), _STEP) if k < 3 else [mpf(0)] * 4
    sine = mp.sqrt(n[0] ** 2 + n[1] ** 2)
    axes = [n[2] * n[0] / sine, n[2] * n[1] / sine, -sine], [-n[1] / sine, n[0] / sine, mpf(0)]
    star = [mpf(k == 3), sine * (k == 4)]
    goal = [s - sum(x * y for x, y in zip(axis, given, strict=False)) for s, axis in zip(star, axes, strict=True)]
    (a, b), (c, d) = ([sum(x * y for x, y in zip(axis, column, strict=False)) for column in columns] for axis in axes)
    u, v = ((d * goal[0] - b * goal[1]) / (a * d - b * c), (a * goal[1] - c * goal[0]) / (a * d - b * c))
    moved = [u * p + v * q for p, q in zip(*beside, strict=True)]
    way = [mpf(i == k) for i in range(3)] + moved
    brightness = _slope(lambda by: [-mp.log(abs(_determinant(ray.along(way, by), latest)))], _WIDER_STEP)[0]
    late = given[3] + u * columns[0][3] + v * columns[1][3]
    return np.array(moved, float), float(brightness), float(late)


def _determinant(ray: _Ray, latest: float) -> mpf:
    n, (p, q) = (
        ray.end(latest),
        (_slope(lambda by, e=e: ray.along([0, 0, 0, *e], by).end(latest), _STEP) for e in tangent_basis(ray.sky)),
    )
    crossed = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
    return sum((x * y for x, y in zip(n[:3], crossed, strict=True)), mpf(0))


def of_caustics(rng: np.random.Generator) -> list[Claim]:
    """Derivatives of the cusps and extremes of caustics by one parameter of the viewer."""
    viewer = ordinary_camera(rng) if rng.uniform() < 0.6 else ordinary_observer(rng)
    order, k = int(rng.integers(1, 4)), int(rng.integers(len(viewer.parameters)))
    found = kc.caustic_derivatives(viewer, order)[order - 1]
    return caustic_claims(viewer, found, order, k)


def caustic_claims(viewer: Any, found: Any, order: int, k: int) -> list[Claim]:
    """Claims of the derivatives of one caustic by parameter k."""
    code = f"kc.caustic_derivatives({viewer!r}, {order})[{order - 1}] by {found.parameters[k]}"
    claims = []

    def features(by: float) -> tuple[np.ndarray, float]:
        caustic = kc.caustics(_with(viewer, k, by), order)[order - 1]
        cusps = np.array([cusp.celestial for cusp in caustic.cusps]).reshape(-1)
        noise = max([float(caustic.error), *(float(cusp.error) for cusp in caustic.cusps)])
        return np.array([*cusps, caustic.theta_extent, caustic.phi_extent]), noise

    slope = richardson(features)
    if slope is None:
        return []
    true, off = slope
    mine = np.array([*found.cusps[:, :, k].ravel(), found.theta_extent[k], found.phi_extent[k]])
    if mine.shape != true.shape:
        return []
    sizes = np.array([*np.repeat(np.abs(found.cusps).max(axis=(1, 2)), 2), *_extent_sizes(found)])
    known = np.isfinite(mine)
    ratio = np.abs(mine - true)[known] / (found.error * sizes + off)[known]
    claims.append(Claim("slopes of caustics", float(ratio.max(initial=0.0)), code))
    return claims


def _extent_sizes(found: Any) -> tuple[float, float]:
    """The largest derivatives of the ends of extents."""
    ends = (found.theta_min, found.theta_max), (found.phi_min, found.phi_max)
    return tuple(float(sum(np.nan_to_num(np.abs(end)).max() for end in pair)) for pair in ends)


def of_events(rng: np.random.Generator) -> list[Claim]:
    """Derivatives of the pair events of one circle of stars by one parameter."""
    viewer = ordinary_camera(rng) if rng.uniform() < 0.6 else ordinary_observer(rng)
    theta, index = float(np.arccos(rng.uniform(-1, 1))), int(rng.integers(1, 3))
    events = kc.pair_events(viewer, theta, index)
    if not len(events):
        return []
    found = kc.event_derivatives(viewer, events)
    return event_claims(viewer, found, (theta, index), int(rng.integers(len(found.parameters))))


def event_claims(viewer: Any, found: Any, path: tuple[float, int], k: int) -> list[Claim]:
    """Claims of the derivatives of events by parameter k; path: theta' and the highest index."""
    theta, index = path
    code = f"kc.event_derivatives(viewer, kc.pair_events({viewer!r}, {theta!r}, {index})) by {found.parameters[k]}"

    def azimuths(by: float) -> tuple[np.ndarray, float]:
        of_level = k == len(found.parameters) - 1
        moved = kc.pair_events(viewer if of_level else _with(viewer, k, by), theta + by * of_level, index)
        azimuth = np.array([event.azimuth for event in moved])
        return azimuth, max([float(event.error) for event in moved], default=0.0)

    slope = richardson(azimuths)
    if slope is None or slope[0].shape != found.azimuth[:, k].shape:
        return []
    true, off = slope
    allowed = found.error[:, 0] * np.abs(found.azimuth).max(axis=1) + off
    ratio = np.abs(found.azimuth[:, k] - true) / allowed
    return [Claim("slopes of events", float(ratio.max(initial=0.0)), code)]


def richardson(values: Callable[[float], tuple[np.ndarray, float]]) -> tuple[np.ndarray, np.ndarray] | None:
    """Slopes at 0 of values (n,), known to within a number, and their errors; None if their number changes."""
    slopes, noise = [], 0.0
    for step in (_WIDE, _WIDE / 2, _WIDE / 4):
        (up, one), (down, two) = values(step), values(-step)
        if up.shape != down.shape:
            return None
        # Azimuths differ by whole turns.
        slopes.append((up - down - 2 * math.pi * np.round((up - down) / (2 * math.pi))) / (2 * step))
        noise = max(one, two) / step
    if len({slope.shape for slope in slopes}) > 1:
        return None
    first, second = ((4 * fine - rough) / 3 for rough, fine in pairwise(slopes))
    best = (16 * second - first) / 15
    return best, np.abs(best - second) + 3 * noise


def _with(viewer: Any, k: int, by: float) -> Any:
    """The viewer with a parameter that is larger."""
    name = viewer.parameters[k]
    place = {given: getattr(viewer, given) + by * (given == name) for given in _GIVEN}
    if isinstance(viewer, kc.Camera):
        return kc.Camera(**place, velocity="fiducial")
    return kc.Observer(**place)


def ordinary_camera(rng: np.random.Generator) -> kc.Camera:
    """A camera so far from all limits that its parameters can be changed by steps of 1e-3."""
    spin = float(rng.choice([rng.uniform(0.01, 0.98), rng.uniform(0.9, 0.99), 0.01]))
    radius = float(kerr.horizon(spin) * (1.05 + 10 ** rng.uniform(-0.7, 1.7)))
    return kc.Camera(spin, radius, float(math.acos(rng.uniform(-0.98, 0.98))), "fiducial")


def ordinary_observer(rng: np.random.Generator) -> kc.Observer:
    """An observer at infinity, or far away."""
    radius = math.inf if rng.uniform() < 0.6 else float(10 ** rng.uniform(1.5, 4))
    return kc.Observer(float(rng.uniform(0.01, 0.99)), float(math.acos(rng.uniform(-0.98, 0.98))), radius)


def star_near_caustic(camera: kc.Camera, rng: np.random.Generator) -> tuple[float, float]:
    """theta', phi' of a star, two in three next to a caustic."""
    if rng.uniform() < 1 / 3:
        return float(math.acos(rng.uniform(-1, 1))), float(rng.uniform(-math.pi, math.pi))
    curve = from_angles(*kc.caustics(camera, 2)[rng.integers(2)].place.T)
    place = curve[rng.integers(len(curve))] + 10 ** rng.uniform(-7, -1) * rng.normal(size=3)
    place /= np.linalg.norm(place)
    return float(polar_angle(place)), float(math.atan2(place[1], place[0]))


KINDS: dict[str, Kind] = {
    "gradients of rays": of_rays,
    "derivatives of images": of_images,
    "derivatives of caustics": of_caustics,
    "derivatives of events": of_events,
}
