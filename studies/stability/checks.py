"""Truth and invariants for the study stability, from formulas written apart from the package.

Long arithmetic is that of truth/rays.py. Most checks return a ratio: what was found over what the reported error
allows. More than 1 is a failure.
"""

import math
from typing import NamedTuple

import numpy as np
from mpmath import mp, mpf

import kerrcaustics as kc
from kerrcaustics.spacetime import frame as package
from kerrcaustics.spacetime.sphere import polar_basis

from ..directions import off_the_edge
from ..truth.camera import Place, metric, photon, unit
from ..truth.rays import beam, escapes
from .problems import LEAST_DISTANCE, Problem, edge_scale

# The claim about reported errors: the true one is at most this many times larger.
HONEST = 10.0
# Digits of the truth; J is a difference of rays 1e-20 of their distance from the shadow edge apart.
DIGITS = 50
# What single formulas may lose where no error is reported for them.
ROUND_OFF = 1e-13
# Points of the line toward the shadow edge, and how often it is refined where the index jumps by more than one.
_LINE_POINTS = 500
_REFINEMENTS = 4
# Seconds after which the truth of a ray is given up; of one that decides about a step of the index.
_PATIENCE, _LONG_PATIENCE = 3.0, 60.0


class Known(NamedTuple):
    """Truth of one ray: direction (3,), columns of J in space (3, 2), delta_plus, det J, index."""

    direction: np.ndarray
    columns: np.ndarray
    delta_plus: float
    determinant: float
    index: int


def place_of(camera: kc.Camera) -> Place:
    """The camera in the words of truth/rays.py."""
    return Place(camera.spin, camera.radius, camera.inclination, camera.velocity)


def known(camera: kc.Camera, sky: np.ndarray, growth: float, most_seconds: float = _PATIENCE) -> Known | None:
    """Truth of the ray in direction `sky` (3,) with delta_plus of about `growth`; None if it is captured.

    Raises TimeoutError for a ray that takes more than `most_seconds`.
    """
    place, n = place_of(camera), [float(x) for x in sky]
    with mp.workdps(DIGITS + 15):
        if not escapes(place, n):
            return None
    found = beam(place, n, 1 / max(mpf(growth), 1), DIGITS, timed=False, most_seconds=most_seconds)
    columns = np.array([[float(x) for x in row] for row in found["columns"]])
    direction = np.array([float(x) for x in found["direction"]])
    return Known(direction, columns, float(found["delta_plus"]), float(found["determinant"]), found["index"])


def truly_escapes(camera: kc.Camera, sky: np.ndarray) -> np.ndarray:
    """True for rays (n,) that escape, from the roots of the radial potential in long arithmetic."""
    with mp.workdps(DIGITS):
        return np.array([escapes(place_of(camera), [float(x) for x in n]) for n in sky])


def columns_in_space(beams: kc.Beams) -> np.ndarray:
    """The columns of J as vectors (n, 3, 2)."""
    return np.stack(polar_basis(beams.direction), axis=-1) @ beams.jacobian


def null_norm(problem: Problem, sky: np.ndarray) -> float:
    """Largest norm of the package's photon at the camera, relative to its terms: 0 in exact arithmetic."""
    light = package.photon_of(problem.camera.frame(), tuple(sky.T))
    worst = mpf(0)
    with mp.workdps(DIGITS):
        at, a, r = metric(place_of(problem.camera)), mpf(problem.camera.spin), mpf(problem.camera.radius)
        for i in range(len(sky)):
            b, u_rate, x_rate, y_rate, z_rate = (mpf(float(v[i])) for v in (light.b, *light.rate))
            p_theta, p_phi = at.sin * z_rate - at.cos * x_rate, -y_rate
            radial, total = (u_rate * r**2) ** 2, (r**2 + a**2 - a * b) ** 2
            rest = at.delta * (p_theta**2 + (p_phi - a * at.sin) ** 2)
            worst = max(worst, abs(radial + rest - total) / (radial + rest + total))
    return float(worst)


def redshift_error(problem: Problem, sky: np.ndarray, redshift: np.ndarray) -> np.ndarray:
    """Relative error (n,) of nu_camera / nu_source, from b and p of the photon and the camera's four-velocity."""
    camera = problem.camera
    errors = []
    with mp.workdps(DIGITS):
        at, r = metric(place_of(camera)), mpf(camera.radius)
        velocity = [at.speed * part for part in at.axes[1]]
        for n, value in zip(sky, redshift, strict=True):
            light = photon(place_of(camera), unit([float(x) for x in n]))
            energy = (1 - at.shift * light.b) / at.lapse
            p_theta, p_phi = at.sin * light.rate[3] - at.cos * light.rate[1], -light.rate[2]
            p_r = light.rate[0] * r**2 / mp.sqrt(at.sigma * at.delta)
            momentum = (p_r, p_theta / mp.sqrt(at.sigma), p_phi / at.scale)
            along = sum(v * p for v, p in zip(velocity, momentum, strict=True))
            exact = (energy - along) / mp.sqrt(1 - at.speed**2)
            errors.append(float(abs(mpf(float(value)) / exact - 1)))
    return np.array(errors)


def reciprocity(problem: Problem, sky: np.ndarray, engine: str) -> float:
    """Largest ratio, over some rays, of the miss of the way back to what the errors allow.

    A ray is followed to a finite radius; from there the reversed photon is followed to the camera's radius. Under
    t, phi -> -t, -phi it has the same b and q and turns by the same azimuth, so it must arrive at the camera's place.
    """
    camera = problem.camera
    far = camera.radius * 3 if camera.radius <= 1e6 else camera.radius / 3
    there = kc.trace_beams(camera, sky, engine, end=far)
    # Rays that turn back in radius on the way would pass the camera's radius elsewhere first.
    straight = (package.photon_of(camera.frame(), tuple(sky.T)).rate[0] < 0) == (far > camera.radius)
    usable = np.flatnonzero(straight & there.escaped & (there.error < 1e-8))
    worst = 0.0
    for i in usable[:: max(len(usable) // 4, 1)][:4]:
        returned = _return(camera, sky[i], there.direction[i], far)
        if returned is None:
            continue
        second, n = returned
        back = kc.trace_beams(second, n, engine, end=camera.radius)
        azimuth, s, c = there.azimuth[i], camera.sin_theta, camera.cos_theta
        goal = np.array([s * math.cos(azimuth), s * math.sin(azimuth), c])
        miss = np.linalg.norm(back.direction - goal, axis=1)
        best = np.nanargmin(miss) if np.isfinite(miss).any() else 0
        # The second camera's place and direction are those of the first ray's end, within its error.
        doubt = (there.error[i] + ROUND_OFF) * (1 + back.delta_plus[best])
        ratio = miss[best] / (HONEST * (back.error[best] + doubt))
        worst = max(worst, float(ratio) if np.isfinite(ratio) else math.inf)
    return worst


def _return(camera: kc.Camera, n: np.ndarray, end: np.ndarray, far: float) -> tuple[kc.Camera, np.ndarray] | None:
    """A fiducial camera at a ray's end, and both directions (2, 3) of the way back that b and q leave."""
    second = kc.Camera(camera.spin, far, math.atan2(math.hypot(end[0], end[1]), end[2]), "fiducial")
    frame = second.frame()
    if frame.sin_theta < 1e-3:
        return None
    with mp.workdps(DIGITS):
        light = photon(place_of(camera), unit([float(x) for x in n]))
        b, q = float(light.b), float(light.q)
    n_phi = b * frame.lapse / (frame.cylindrical_scale * frame.sin_theta * (1 - frame.shift * b))
    energy = (1 - frame.shift * b) / frame.lapse
    turning = (frame.cos_theta * b / frame.sin_theta) ** 2
    p_theta = q + (camera.spin * frame.cos_theta) ** 2 - turning
    # Where the ray turns back in theta, its direction is not known well enough from b and q.
    if p_theta < 0.05 * (abs(q) + turning):
        return None
    n_theta = math.sqrt(p_theta) / (frame.root_sigma * energy)
    n_r = math.sqrt(max(1 - n_phi**2 - n_theta**2, 0))
    if n_r < 0.1:
        return None
    # The photon that arrives at the second camera from the first one moves outward if the second is farther out.
    n_r = n_r if far > camera.radius else -n_r
    directions = np.array([[n_r, n_theta, n_phi], [n_r, -n_theta, n_phi]])
    return second, package.sky_from_fido(frame, directions)


def index_mistakes(problem: Problem, engine: str, turn: float) -> tuple[int, int]:
    """Steps of the index along a line toward the shadow edge that are wrong, and its last value.

    Where it is certain it changes by one at a time. It falls where the line crosses a critical curve back: truth says.
    """
    camera = problem.camera
    scale = min(edge_scale(camera), 0.5)
    distance = scale * np.logspace(-0.3, math.log10(LEAST_DISTANCE / scale) + 1, _LINE_POINTS)
    for _ in range(_REFINEMENTS):
        sky = off_the_edge(camera, np.full(len(distance), turn), distance)
        beams = kc.trace_beams(camera, sky, engine)
        sure = np.flatnonzero(beams.escaped & certain(beams))
        steps = np.diff(beams.index[sure])
        # Between rays with uncertain ones in between many steps may lie.
        wide = sure[:-1][(np.abs(steps) > 1) & (np.diff(sure) == 1)]
        if not wide.size:
            break
        between = [np.geomspace(distance[i], distance[i + 1], 40)[1:-1] for i in wide[:40]]
        distance = np.sort(np.concatenate([distance, *between]))[::-1]
    beside = [i for k in np.flatnonzero(steps < 0) for i in sure[k : k + 2]]
    wrong = sum(not _is_true_index(camera, sky[i], float(beams.delta_plus[i]), int(beams.index[i])) for i in beside)
    return len(wide) + wrong, int(beams.index[sure[-1]]) if sure.size else -1


def _is_true_index(camera: kc.Camera, sky: np.ndarray, growth: float, index: int) -> bool:
    """True if truth confirms the index of a ray; one whose truth takes too long counts as wrong."""
    try:
        true = known(camera, sky, growth, _LONG_PATIENCE)
    except TimeoutError:
        return False
    return true is not None and true.index == index


def certain(beams: kc.Beams) -> np.ndarray:
    """True (n,) where the index is claimed to be certain."""
    assert beams.index_certain is not None
    return beams.index_certain
