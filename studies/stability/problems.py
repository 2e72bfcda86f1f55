"""The named problems of the study stability: extreme cameras and extreme rays."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import sky_from_fido

from ..directions import fido_uniform, near_outward_null, of_momentum, off_the_edge

# Closer than this to the shadow edge, N in doubles no longer determines the distance.
LEAST_DISTANCE = 1e-15

Sky = Callable[[kc.Camera, int, np.random.Generator], np.ndarray]


class Problem(NamedTuple):
    """A camera and directions: sky(camera, count, random numbers) gives (count, 3) unit vectors N."""

    group: str
    name: str
    camera: kc.Camera
    sky: Sky


def edge_scale(camera: kc.Camera) -> float:
    """Angular radius of the shadow on the camera sky, or of the rest of the sky where that is less."""
    edge = kc.shadow_edge(camera, 64)
    middle = edge.mean(axis=0)
    return float(np.median(np.linalg.norm(edge - middle / np.linalg.norm(middle), axis=1)))


def mixed(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """A half from the whole sky, a quarter each from that of the fiducial observer and from near the shadow edge."""
    sky = rng.normal(size=(count, 3))
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    part = count // 4
    sky[:part] = fido_uniform(camera, part, rng)
    distance = edge_scale(camera) * 10 ** rng.uniform(-7, 0, part)
    sky[part : 2 * part] = off_the_edge(camera, rng.uniform(0, 2 * math.pi, part), np.maximum(distance, LEAST_DISTANCE))
    return sky


def at_distance(distance: float) -> Sky:
    """Directions at one distance from the shadow edge, on all its sides."""

    def sky(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
        return off_the_edge(camera, rng.uniform(0, 2 * math.pi, count), np.full(count, distance))

    return sky


def principal(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Outgoing principal null direction, exactly and to 0.3 rad from it."""
    angle = 10 ** rng.uniform(-15, -0.5, count)
    angle[0] = 0
    return near_outward_null(camera, angle, rng.uniform(0, 2 * math.pi, count))


def polar(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Angular momentum b = 0 within rounding, and down to 1e-14 beside it."""
    b = rng.choice((-1, 1), count) * 10 ** rng.uniform(-14, -2, count)
    b[: count // 2] = 0
    return of_momentum(camera, b, rng.uniform(0, 2 * math.pi, count))


def equatorial(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """p_theta = 0 exactly, for a camera at rest or in azimuthal motion, and N_z down to 1e-14."""
    turn = rng.uniform(0, 2 * math.pi, count)
    lift = rng.choice((-1, 1), count) * 10 ** rng.uniform(-14, -2, count)
    lift[: count // 2] = 0
    return np.stack([np.cos(turn), np.sin(turn), lift], axis=-1) / np.sqrt(1 + lift**2)[:, None]


def radial_and_transverse(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """The six directions of the FIDO's axes, exactly and a little beside them."""
    axes = np.tile(np.concatenate([np.eye(3), -np.eye(3)]), (count // 6 + 1, 1))[:count]
    aside = rng.normal(size=(count, 3)) * 10 ** rng.uniform(-16, -1, count)[:, None]
    aside[:6] = 0
    return sky_from_fido(camera.frame(), (axes + aside) / np.linalg.norm(axes + aside, axis=1, keepdims=True))


def problems() -> list[Problem]:
    """All of them, group by group."""
    return [*_spins(), *_places(), *_inclinations(), *_speeds(), *_edges(), *_rays(), *_together()]


def _at_rest(spin: float, radius: float, degrees: float = 90.0) -> kc.Camera:
    return kc.Camera(spin, radius, math.radians(degrees), "fiducial")


def _spins() -> list[Problem]:
    spins = {"a = 0": 0.0, "a = 1e-12": 1e-12, **{f"a = 1 - 1e-{n}": 1 - 10.0**-n for n in (3, 6, 9, 12)}}
    return [Problem("spin", f"{name}, r = 6", kc.Camera(a, 6.0), mixed) for name, a in spins.items()]


def _places() -> list[Problem]:
    found = []
    for a in (0.0, 0.9, 0.999):
        inside = 2.5 if a < 0.999 else 2.0
        radii = {"r_+ (1 + 1e-6)": kerr.horizon(a) * (1 + 1e-6), f"r = {inside}, among the photon orbits": inside}
        radii |= {"the ISCO": kerr.isco(a)} | {f"r = {r:.0e}": r for r in (1e3, 1e6, 1e9)}
        for name, r in radii.items():
            if a == 0 and name.startswith("r = 2.5"):
                name = "r = 2.5, below the photon orbit"
            found.append(Problem("place", f"a = {a:g}, {name}", kc.Camera(a, r), mixed))
    return found


def _inclinations() -> list[Problem]:
    return [
        Problem("inclination", f"{degrees:g} deg, a = {a:g}, r = 8", _at_rest(a, 8.0, degrees), mixed)
        for a in (0.9, 0.0)
        for degrees in (0, 1e-9, 1e-3, 30, 90, 180)
    ]


def _speeds() -> list[Problem]:
    ways = {"outward": (1, 0, 0), "inward": (-1, 0, 0), "south": (0, 1, 0), "along phi": (0, 0, 1)}
    ways |= {"against phi": (0, 0, -1), "askew": (0.48, -0.64, 0.6)}
    found = []
    for text, slowness in (("0.9", 0.1), ("1 - 1e-6", 1e-6), ("1 - 1e-9", 1e-9)):
        for way, parts in ways.items():
            velocity = tuple((1 - slowness) * part / math.hypot(*parts) for part in parts)
            camera = kc.Camera(0.9, 5.0, math.radians(60), velocity)
            found.append(Problem("speed", f"{text} {way}, a = 0.9, r = 5", camera, mixed))
    return found


def _edges() -> list[Problem]:
    cameras = {"a = 0.999, r = 6.03": kc.Camera(0.999, 6.03), "a = 0.9, r = 8, 60 deg": _at_rest(0.9, 8.0, 60)}
    return [
        Problem("shadow edge", f"{distance:.0e} rad, {name}", camera, at_distance(distance))
        for name, camera in cameras.items()
        for distance in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)
    ]


def _rays() -> list[Problem]:
    cameras = {"a = 0.999, r = 6.03": kc.Camera(0.999, 6.03), "a = 0.9, r = 1e6, 60 deg": _at_rest(0.9, 1e6, 60)}
    cameras |= {"a = 0.9, r = 2, 30 deg": _at_rest(0.9, 2.0, 30), "a = 0, r = 4": _at_rest(0.0, 4.0)}
    found = [Problem("principal null rays", name, camera, principal) for name, camera in cameras.items()]
    found.append(Problem("principal null rays", "a = 0.9, r = 8, on the axis", _at_rest(0.9, 8.0, 0), principal))
    cameras |= {"a = 0.999, r = 2, 90 deg": _at_rest(0.999, 2.0)}
    found += [Problem("polar rays", name, camera, polar) for name, camera in cameras.items()]
    found += [Problem("p_theta = 0", name, camera, equatorial) for name, camera in cameras.items()]
    return found + [Problem("along the axes", name, camera, radial_and_transverse) for name, camera in cameras.items()]


def _together() -> list[Problem]:
    extreme = 1 - 1e-12
    return [
        Problem(
            "together", "a = 1 - 1e-12, r_+ (1 + 1e-6)", _at_rest(extreme, kerr.horizon(extreme) * 1.000001), mixed
        ),
        Problem("together", "a = 1 - 1e-12, the ISCO", kc.Camera(extreme, kerr.isco(extreme)), mixed),
        Problem("together", "a = 1 - 1e-12, r = 2.5, 1e-9 deg", _at_rest(extreme, 2.5, 1e-9), mixed),
        Problem("together", "speed 1 - 1e-9 askew, r_+ (1 + 1e-3), a = 0.999", _plunging(0.999), mixed),
        Problem(
            "together", "speed 1 - 1e-9 inward, r = 1e6, a = 0.9", kc.Camera(0.9, 1e6, 1.0, (1e-9 - 1, 0, 0)), mixed
        ),
    ]


def _plunging(spin: float) -> kc.Camera:
    speed = 1 - 1e-9
    return kc.Camera(spin, kerr.horizon(spin) * 1.001, 1.0, (-0.48 * speed, 0.64 * speed, 0.6 * speed))
