"""Rays in space: places, times and beams along paths, their conjugate points, and beams of initial ellipses.

Cameras are compared with long arithmetic (long_paths.py, ../truth.py); observers at infinity, which it does not know,
with the closed form to spheres of the same radii.
"""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.paths import RayPaths
from kerrcaustics.spacetime import kerr

from ...truth.rays import tangent_basis
from ..cases import FAMILIES, Case, hard_camera, hard_end, hard_inclination, hard_spin, whole_sky
from ..claims import ends_in_truth, entries_of
from ..trials import place_of, truth_of
from .claim import Claim, Kind
from .long_paths import PathEvent, events_along

# Seconds after which the truth of a ray is given up.
_PATIENCE = 5.0
# Places of one path that are compared.
_PLACES = 3
# So close to the horizon, relative to it, the truth is slow.
_NEAR_HORIZON = 1e-3
# Of values that are computed twice in doubles.
_ROUND_OFF = 1e-15


def along_paths(rng: np.random.Generator) -> list[Claim]:
    """Places, times, diameters and conjugate points of one ray of a camera."""
    camera = hard_camera(rng)
    sky = hard_direction(camera, rng)
    end = hard_end(camera, rng) if rng.uniform() < 0.3 else math.inf
    n = int(rng.integers(4, 60))
    paths = kc.ray_paths(camera, sky, n, end=end, beams=True)
    code = f"kc.ray_paths({_as_python(camera)}, {sky.tolist()!r}, {n}, end={_as_python(end)}, beams=True)"
    if not np.isfinite(paths.mino_time).all():
        return []
    return path_claims(camera, sky, paths, np.sort(rng.choice(n - 2, min(_PLACES, n - 2), replace=False)) + 1, code)


def path_claims(camera: kc.Camera, sky: np.ndarray, paths: RayPaths, places: np.ndarray, code: str) -> list[Claim]:
    """Claims of a path at places of these numbers, and of its conjugate points; none, where the truth is too slow."""
    horizon = kerr.horizon(camera.spin) * (1 + _NEAR_HORIZON)
    places = places[paths.radius[places] > horizon]
    conjugate = np.flatnonzero(paths.conjugate.radius > horizon)
    times = np.concatenate([paths.mino_time[places], paths.conjugate.mino_time[conjugate]])
    order = np.argsort(times)
    try:
        found = events_along(place_of(camera), sky.tolist(), times[order].tolist(), _PATIENCE)
    except TimeoutError:
        return []
    events = [found[k] for k in np.argsort(order)]
    claims = []
    for i, event in zip(places.tolist(), events, strict=False):
        claims += _of_place(paths, i, event, f"{code} at place {i}")
    for i, event in zip(conjugate.tolist(), events[len(places) :], strict=True):
        claims += _of_conjugate_point(paths, i, event, f"{code}.conjugate at {i}")
    return claims


def _of_place(paths: RayPaths, i: int, event: PathEvent, code: str) -> list[Claim]:
    """Of a place, whose error is known where it is not NaN; of its time, at the same radius or Mino time."""
    error, u = float(paths.error[i]), 1 / paths.radius[i]
    claims = [
        Claim("1 / radius", abs(u - float(event.inverse_radius)) / (error + _ROUND_OFF * u), code),
        Claim("direction", _apart(paths.direction[i], event.direction) / error, code),
        Claim("time", _time_off(paths, i, event) / float(paths.time_error[i]), code),
    ]
    assert paths.beams is not None
    known, plus = float(paths.beams.diameter_error[i]), float(paths.beams.delta_plus[i])
    if known < 1:
        off = abs(plus - event.diameters[0]), abs(abs(float(paths.beams.delta_minus[i])) - event.diameters[1])
        claims.append(Claim("diameters", max(off) / plus / known, code))
    return claims


def _of_conjugate_point(paths: RayPaths, i: int, event: PathEvent, code: str) -> list[Claim]:
    """How far along the ray the beam's area vanishes: in 1 / r and direction, over the error of the place."""
    point, (u_rate, n_rate) = paths.conjugate, event.rates
    late = abs(float(event.late))
    moved = late * max(abs(float(u_rate)), float(np.linalg.norm(np.array(n_rate, float))))
    return [Claim("conjugate point", moved / float(point.error[i]), code)]


def _time_off(paths: RayPaths, i: int, event: PathEvent) -> float:
    """Difference of times at one Mino time, or at one radius, which is what the error means."""
    off = float(paths.time[i] - event.time)
    u_rate = float(event.rates[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        later = (1 / paths.radius[i] - float(event.inverse_radius)) / np.float64(u_rate)
        moved = off - float(later * event.time_rate)
    return min(abs(off), abs(moved)) if math.isfinite(moved) else abs(off)


def paths_of_observers(rng: np.random.Generator) -> list[Claim]:
    """Places and times of one ray of an observer at infinity, against the closed form to spheres."""
    viewer = kc.Observer(hard_spin(rng), hard_inclination(rng))
    edge = kc.shadow_edge(viewer, 24)
    near = edge[rng.integers(24)] * (1 + 10 ** rng.uniform(-9, 0)) if rng.uniform() < 0.6 else rng.normal(size=2) * 9
    n = int(rng.integers(6, 60))
    paths = kc.ray_paths(viewer, near, n, beams=True)
    code = f"kc.ray_paths({_as_python(viewer)}, {near.tolist()!r}, {n}, beams=True)"
    if not np.isfinite(paths.mino_time).all():
        return []
    return observer_claims(viewer, near, paths, rng.integers(1, n - 1, _PLACES), code)


def observer_claims(
    viewer: kc.Observer, sky: np.ndarray, paths: RayPaths, places: np.ndarray, code: str
) -> list[Claim]:
    """Claims of a path at places of these numbers, and of its end."""
    lowest, claims = paths.mino_time[np.argmin(paths.radius)], []
    beside = np.abs(places - np.argmin(paths.radius)) < 2
    for i in places[~beside].tolist():
        radius, second = float(paths.radius[i]), bool(paths.mino_time[i] > lowest)
        rays = kc.trace_rays(viewer, sky, "closed-form", end=kc.Sphere(radius, second), time=True)
        if not rays.escaped or rays.time is None or rays.time_error is None:
            continue
        where = f"{code} at place {i}"
        # A place at the radius lies further along the ray by its error in 1 / radius.
        allowed = max(1.0, _slope(paths, i)) * float(paths.error[i]) + float(rays.error)
        claims.append(Claim("direction", _apart(paths.direction[i], rays.direction) / allowed, where))
        late = abs(float(paths.time[i] - rays.time)) / float(paths.time_error[i] + rays.time_error)
        claims.append(Claim("time", late, where))
    ends = kc.trace_beams(viewer, sky, "integrated", 1e-12)
    if ends.escaped and paths.status != kc.Status.CAPTURED and ends.index is not None and ends.index_certain:
        claims.append(Claim("index", 0.0 if paths.index == ends.index else math.inf, code))
    return claims


def _slope(paths: RayPaths, i: int) -> float:
    """Radians of the direction for a change of 1 / r, by the places beside this one."""
    u = 1 / paths.radius
    step = abs(u[i + 1] - u[i - 1])
    return _apart(paths.direction[i + 1], paths.direction[i - 1]) / step if step > 0 else math.inf


def ellipses(rng: np.random.Generator) -> list[Claim]:
    """The ellipse at the end of a beam that is one at the camera, and a displacement pulled back, by the true beam."""
    camera = hard_camera(rng)
    sky, end = hard_direction(camera, rng), hard_end(camera, rng)
    ratio, angle = float(rng.choice([0.0, 10 ** rng.uniform(-9, 0), rng.uniform(), 1.0])), float(rng.uniform(-4, 4))
    engine = str(rng.choice(["auto", "integrated"]))
    beam = kc.trace_beams(camera, sky, engine, end=end)
    call = f"kc.trace_beams({_as_python(camera)}, {sky.tolist()!r}, {engine!r}, end={_as_python(end)})"
    return ellipse_claims(camera, sky, end, beam, (ratio, angle), call) if beam.escaped else []


def ellipse_claims(camera, sky, end, beam: kc.Beams, ellipse: tuple[float, float], call: str) -> list[Claim]:
    """Claims of one beam of an ellipse, ratio and angle, at the camera."""
    (ratio, angle), true = ellipse, true_entries(camera, sky, end)
    if true is None or not beam.jacobian_error < 1:
        return []
    (c, s), found = (math.cos(angle), math.sin(angle)), beam.from_ellipse(ratio, angle)
    left, sizes, _ = np.linalg.svd(true @ np.array([[c, -ratio * s], [s, ratio * c]]))
    off = max(abs(float(found.delta_plus) - sizes[0]), abs(abs(float(found.delta_minus)) - sizes[1]))
    turn = math.remainder(math.atan2(left[1, 0], left[0, 0]) - float(found.position_angle), math.pi)
    code = f"{call}.from_ellipse({ratio!r}, {angle!r})"
    flat = np.array([c, s])
    back = beam.pulled_back(sky, flat)
    entries = np.array(tangent_basis(sky.tolist()), float) @ back
    allowed = (float(beam.jacobian_error) + _ROUND_OFF) * float(beam.delta_plus) * np.linalg.norm(entries)
    miss = float(np.linalg.norm(true @ entries - flat))
    claims = [
        Claim("diameters of an ellipse", off / float(found.error), code),
        Claim("angle of an ellipse", abs(turn) / float(found.angle_error), code),
    ]
    return [*claims, Claim("pulled back", miss / allowed, f"{call}.pulled_back(...)")] if allowed < 1 else claims


def true_entries(camera: kc.Camera, sky: np.ndarray, end) -> np.ndarray | None:
    """The true Jacobian (2, 2), of the plane in (dr, r dphi); None where it is not known."""
    truth = ends_in_truth([truth_of(Case(camera, sky[None], [""], end), 0)])
    if truth.status[0] != kc.Status.ESCAPED:
        return None
    return truth.columns[0, :2] if isinstance(end, kc.EquatorialPlane) else entries_of(truth)[0]


def hard_direction(camera: kc.Camera, rng: np.random.Generator) -> np.ndarray:
    """A unit vector N (3,) of one of the families of hard rays."""
    draw = list(FAMILIES.values())[rng.integers(len(FAMILIES))]
    with np.errstate(all="ignore"):
        sky = draw(camera, 1, rng)[0]
    sky = sky if np.isfinite(sky).all() else whole_sky(camera, 1, rng)[0]
    return sky / np.linalg.norm(sky)


def _apart(one: np.ndarray, other) -> float:
    return float(np.linalg.norm(np.asarray(one) - np.array(other, float)))


def _as_python(value: object) -> str:
    """An argument in words that Python reads."""
    return "math.inf" if value == math.inf else repr(value).replace("inf)", "math.inf)")


KINDS: dict[str, Kind] = {
    "beams along paths": along_paths,
    "paths of observers": paths_of_observers,
    "initial ellipses": ellipses,
}
