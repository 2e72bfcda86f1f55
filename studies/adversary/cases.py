"""Hard cases by class: extreme cameras, extreme directions on their skies, and every kind of end.

Every function draws from a source of random numbers: a NumPy generator, or whatever has its `uniform` and `integers`
(the strategies of the tests do).
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

import kerrcaustics as kc
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.shadow import even_phases

from .. import directions
from ..directions import near_outward_null, of_momentum, off_the_edge
from ..stability.problems import edge_scale

End = float | kc.EquatorialPlane

_AXES = np.concatenate([np.eye(3), -np.eye(3)])
T = TypeVar("T")


class Source(Protocol):
    """The source of numbers."""

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        """A number from low to high."""
        ...

    def integers(self, low: int, high: int) -> int:
        """A whole number from low to high - 1."""
        ...


class Case(NamedTuple):
    """A camera, directions (n, 3) on its sky and the family of each, and where the rays end."""

    camera: kc.Camera
    sky: np.ndarray
    families: list[str]
    end: End


def cases(count: int, seed: int, rays: int = 64) -> Iterator[Case]:
    """So many cases of so many rays each; the same for the same seed."""
    for i in range(count):
        rng = np.random.default_rng((seed, i))
        camera = hard_camera(rng)
        sky, families = hard_sky(camera, rays, rng)
        yield Case(camera, sky, families, hard_end(camera, rng))


def hard_camera(source: Source) -> kc.Camera:
    """Any spin, place and velocity that a camera may have, the special and the extreme ones often."""
    spin = hard_spin(source)

    def anywhere() -> kc.Camera:
        return kc.Camera(spin, hard_radius(spin, source), hard_inclination(source), hard_velocity(source))

    return _one_of(source, anywhere, anywhere, anywhere, lambda: circling_camera(spin, source))


def circling_camera(spin: float, source: Source) -> kc.Camera:
    """On a circular orbit: at the ISCO, just above the photon orbit, and anywhere above it."""
    orbit = kerr.photon_orbits(spin)[0]
    radius = _one_of(source, lambda: kerr.isco(spin), lambda: orbit * (1 + _power(source, -6, 1)))
    return kc.Camera(spin, radius, velocity="circular")


def hard_spin(source: Source) -> float:
    """0, 1e-12 to 1 - 1e-12."""
    return _one_of(
        source,
        lambda: 0.0,
        lambda: _power(source, -12, -2),
        lambda: source.uniform(0.0, 0.999),
        lambda: 1 - _power(source, -5, -1),
        lambda: 1 - _power(source, -12, -5),
    )


def hard_radius(spin: float, source: Source) -> float:
    """From r_+ (1 + 1e-6) to 1e9, the photon orbits and their neighbourhood often."""
    horizon = kerr.horizon(spin)

    def between_orbits() -> float:
        low, high = kerr.photon_orbits(spin)
        return max(low + (high - low) * source.uniform(-0.1, 1.1), horizon * 1.0001)

    return _one_of(
        source,
        lambda: horizon * (1 + _power(source, -6, -2)),
        lambda: horizon + _power(source, -2, 1.3),
        lambda: horizon + _power(source, 0, 1.3),
        between_orbits,
        lambda: _power(source, 1.3, 9),
    )


def hard_inclination(source: Source) -> float:
    """Anywhere, on the equator and the axis, and 1e-15 to 1e-3 off them."""
    return _one_of(
        source,
        lambda: math.acos(source.uniform(-1.0, 1.0)),
        lambda: math.pi / 2,
        lambda: math.pi / 2 + _sign(source) * _power(source, -15, -3),
        lambda: _power(source, -15, -3),
        lambda: math.pi - _power(source, -15, -3),
        lambda: _one_of(source, lambda: 0.0, lambda: math.pi),
    )


def hard_velocity(source: Source) -> tuple[float, float, float]:
    """At rest, slow, in any direction or an azimuthal one, and to 1 - 1e-9."""
    speed = _one_of(
        source,
        lambda: 0.0,
        lambda: _power(source, -9, -2),
        lambda: source.uniform(0.0, 0.99),
        lambda: 1 - _power(source, -9, -2),
    )
    height, turn = source.uniform(-1.0, 1.0), source.uniform(0.0, 2 * math.pi)
    flat = math.sqrt(1 - height**2)
    askew = (flat * math.cos(turn), flat * math.sin(turn), height)
    way = _one_of(source, lambda: askew, lambda: (0.0, 0.0, _sign(source)), lambda: (_sign(source), 0.0, 0.0))
    return speed * way[0], speed * way[1], speed * way[2]


def hard_end(camera: kc.Camera, source: Source) -> End:
    """Infinity, a finite sphere (at the camera too, and a hair from it), or one of three crossings of the plane."""
    horizon = kerr.horizon(camera.spin)
    near = camera.radius * (1 + _sign(source) * _power(source, -15, -3))
    found = _one_of(
        source,
        lambda: math.inf,
        lambda: math.inf,
        lambda: _one_of(source, lambda: camera.radius, lambda: near),
        lambda: _one_of(
            source,
            lambda: horizon * (1 + _power(source, -6, 0)),
            lambda: _power(source, 0.4, 9),
            lambda: camera.radius * _power(source, -2, 2),
        ),
        lambda: kc.EquatorialPlane(1 + source.integers(0, 3)),
    )
    return found if isinstance(found, kc.EquatorialPlane) else max(found, horizon * (1 + 1e-6))


def hard_sky(camera: kc.Camera, count: int, rng: np.random.Generator) -> tuple[np.ndarray, list[str]]:
    """Directions N (count, 3) of every family in turn, of the whole sky where a camera has none, and their families."""
    sky, names = np.empty((count, 3)), list(FAMILIES)
    for i, name in enumerate(names):
        part = sky[i :: len(names)]
        with np.errstate(all="ignore"):
            part[:] = FAMILIES[name](camera, len(part), rng)
        missing = ~np.isfinite(part).all(axis=-1)
        part[missing] = whole_sky(camera, int(missing.sum()), rng)
    return sky, [names[i % len(names)] for i in range(count)]


def whole_sky(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """The camera sky."""
    return _unit(rng.normal(size=(count, 3)))


def rest_sky(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """The sky of the fiducial observer, crowded ahead of a fast camera."""
    return sky_from_fido(camera.frame(), _unit(rng.normal(size=(count, 3))))


def shadow_edge(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """1e-12 to 1e-1 rad outside the shadow edge and inside of it, or so many of its radii; on all sides of it."""
    distance = 10 ** rng.uniform(-12, -1, count) * rng.choice((-1, 1, 1, 1), count)
    distance *= rng.choice((min(edge_scale(camera), 1.0), 1.0), count)
    return off_the_edge(camera, even_phases(camera, rng.uniform(size=count)), distance)


def principal(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Along the principal null directions, exactly and to 0.3 rad from them on the sky of the fiducial observer."""
    angle = 10 ** rng.uniform(-15, -0.5, count) * (rng.uniform(size=count) < 0.9)
    outward = near_outward_null(camera, angle, _turns(count, rng))
    rest = camera.at_rest()
    inward = near_outward_null(rest, angle, _turns(count, rng)) * (-1, 1, 1)
    inward = as_seen(inward, rest.frame(), camera.frame())
    return np.where((rng.uniform(size=count) < 0.7)[:, None], outward, inward)


def polar(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Angular momentum 0 within rounding, and 1e-14 to 1e-1 in units of the largest."""
    frame = camera.frame()
    b = rng.choice((-1, 1), count) * 10 ** rng.uniform(-14, -1, count) * (rng.uniform(size=count) < 0.7)
    if frame.sin_theta == 0:
        return rest_sky(camera, count, rng)
    # In units of what a ray along e_phi has, at most; above the ergosphere that is finite.
    scale = frame.cylindrical_scale * frame.sin_theta / frame.lapse
    return of_momentum(camera, b * min(scale, 1 / abs(frame.shift) if frame.shift else scale), _turns(count, rng))


def tangential(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """1e-15 to 1e-3 rad from a turning point in radius."""
    turn, lift = _turns(count, rng), rng.choice((-1, 1), count) * 10 ** rng.uniform(-15, -3, count)
    lift *= rng.uniform(size=count) < 0.95
    return sky_from_fido(camera.frame(), _unit(np.stack([lift, np.cos(turn), np.sin(turn)], axis=-1)))


def level(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """1e-15 to 1e-3 rad from a turning point in polar angle."""
    turn, lift = _turns(count, rng), rng.choice((-1, 1), count) * 10 ** rng.uniform(-15, -3, count)
    lift *= rng.uniform(size=count) < 0.8
    return sky_from_fido(camera.frame(), _unit(np.stack([np.cos(turn), lift, np.sin(turn)], axis=-1)))


def ending_on_axis(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Rays that end 1e-14 to 1e-2 rad from the spin axis, on the celestial sphere."""
    return directions.ending_on_axis(camera, 10 ** rng.uniform(-14, -2, count), rng)


def along_axes(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """The axes of the camera and 1e-16 to 1e-1 rad beside them: forward, where a fast camera sees all, above all."""
    axes = _AXES[rng.choice(6, count, p=(0.1, 0.4, 0.1, 0.1, 0.2, 0.1))]
    aside = _unit(rng.normal(size=(count, 3))) * (10 ** rng.uniform(-16, -1, count))[:, None]
    return _unit(axes + aside * (rng.uniform(size=count) < 0.9)[:, None])


Draw = Callable[[kc.Camera, int, np.random.Generator], np.ndarray]
FAMILIES: dict[str, Draw] = {
    "whole sky": whole_sky,
    "sky at rest": rest_sky,
    "shadow edge": shadow_edge,
    "principal null": principal,
    "shadow edge, again": shadow_edge,
    "through the poles": polar,
    "tangential": tangential,
    "level": level,
    "along the axes": along_axes,
    "ending on the axis": ending_on_axis,
}


def place_class(camera: kc.Camera) -> str:
    """In words, what is extreme about a camera."""
    speed = math.sqrt(sum(v**2 for v in camera.fido_velocity()))
    spins = ["a > 1 - 1e-5"] * (camera.spin > 1 - 1e-5) + ["a < 0.01"] * (camera.spin < 0.01)
    near = camera.radius < kerr.horizon(camera.spin) * 1.05
    radii = ["near horizon"] * near + ["r > 1e4"] * (camera.radius > 1e4)
    heights = ["near axis"] * (camera.sin_theta < 1e-2) + ["near equator"] * (abs(camera.cos_theta) < 1e-2)
    return ", ".join([*spins, *radii, *heights, *["speed > 0.999"] * (speed > 0.999)]) or "ordinary"


def end_class(camera: kc.Camera, end: End) -> str:
    """In words, what kind of end it is."""
    if isinstance(end, kc.EquatorialPlane):
        return "plane"
    if math.isinf(end):
        return "infinity"
    return "sphere at the camera" if abs(end / camera.radius - 1) < 2e-3 else "sphere"


def _one_of(source: Source, *ways: Callable[[], T]) -> T:
    return ways[int(source.integers(0, len(ways)))]()


def _power(source: Source, low: float, high: float) -> float:
    return float(10 ** source.uniform(low, high))


def _sign(source: Source) -> float:
    return 2.0 * int(source.integers(0, 2)) - 1.0


def _turns(count: int, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(0, 2 * math.pi, count)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
