"""Directions on the camera sky for studies: the families of truth/truth.json in any number, and more."""

import math

import numpy as np
from scipy.special import ellipkinc

import kerrcaustics as kc
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.frame import photon_of, sky_from_fido
from kerrcaustics.spacetime.settings import own_settings
from kerrcaustics.spacetime.shadow import edge_photons

# Half the angle of the curve's parameter over which its tangent is taken.
_TURN = 1e-6
# Of Newton's method on the camera sky; radians.
_NEWTON_STEPS, _LONGEST_STEP = 12, 0.2


def whole_sky(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Escaping directions (count, 3), uniform on the camera sky."""
    return _filled(camera, count, lambda n: _unit(rng.normal(size=(n, 3))))


def near_the_edge(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Escaping directions (count, 3), 1e-10 to 1e-1 rad from any point of the shadow edge."""
    return _filled(
        camera, count, lambda n: off_the_edge(camera, rng.uniform(0, 2 * math.pi, n), 10 ** rng.uniform(-10, -1, n))
    )


def through_the_poles(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Escaping directions (count, 3) of rays that pass 1e-14 to 1e-1 rad from the spin axis, for azimuthal motion."""

    def draw(n: int) -> np.ndarray:
        goal = 10 ** rng.uniform(-14, -1, n) * rng.choice((-1, 1), n)
        angle, b = rng.uniform(0, 2 * math.pi, n), np.zeros(n)
        for _ in range(4):
            sky = of_momentum(camera, b, angle)
            b = goal * np.sqrt(np.maximum(photon_of(camera.frame(), tuple(sky.T)).k, 0) + camera.spin**2)
        sky = of_momentum(camera, b, angle)
        return sky[_passes_axis(camera, sky)]

    return _filled(camera, count, draw)


def ending_on_axis(camera: kc.Camera, distance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Directions (n, 3) of rays that end on the celestial sphere `distance` (n,) radians from the spin axis.

    By Newton's method from random directions; those from which it does not converge end anywhere.
    """
    sky = fido_uniform(camera, len(distance), rng)
    for _ in range(_NEWTON_STEPS):
        beams = kc.trace_beams(camera, sky, "closed-form", redshift=False)
        across = np.hypot(beams.direction[:, 0], beams.direction[:, 1])
        # To the nearer end of the axis.
        away = np.sign(beams.direction[:, 2]) * (distance - across)
        step = beams.pulled_back(sky, np.stack([away, 0 * away], axis=-1))
        length = np.linalg.norm(step, axis=1, keepdims=True)
        with np.errstate(invalid="ignore", divide="ignore"):
            step *= np.minimum(1, _LONGEST_STEP / length)
        sky = _unit(sky + np.where(np.isfinite(step), step, 0.0))
    return sky


FAMILIES = {"whole sky": whole_sky, "near the edge": near_the_edge, "through the poles": through_the_poles}


def off_the_edge(camera: kc.Camera, turn: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Directions N (n, 3) at an angle `distance` (n,) on the camera sky outside the shadow edge at `turn` (n,)."""

    def edge(at: np.ndarray) -> np.ndarray:
        return sky_from_fido(camera.frame(), edge_photons(camera, at))

    here, along = edge(turn), edge(turn + _TURN) - edge(turn - _TURN)
    # The edge runs clockwise as seen looking at the hole.
    outward = _unit(np.cross(along, here))
    return _unit(here * np.cos(distance)[:, None] + outward * np.sin(distance)[:, None])


def of_momentum(camera: kc.Camera, b: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Directions N (n, 3) of photons of angular momentum b (n,), at an angle (n,) around e_phi; off the axis."""
    frame = camera.frame()
    varpi = frame.cylindrical_scale * frame.sin_theta
    n_phi = b * frame.lapse / (varpi * (1 - frame.shift * b))
    across = np.sqrt(1 - n_phi**2)
    return sky_from_fido(frame, np.stack([-across * np.cos(angle), across * np.sin(angle), n_phi], axis=-1))


def fido_uniform(camera: kc.Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Directions N (count, 3), uniform on the sky of the fiducial observer: crowded ahead of a fast camera."""
    return sky_from_fido(camera.frame(), _unit(rng.normal(size=(count, 3))))


def near_outward_null(camera: kc.Camera, angle: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Directions N (n, 3) at an angle (n,) of the FIDO sky from the outgoing principal null direction, followed back.

    There kappa = (b - a)^2 + q vanishes: b = a sin(theta)^2 and p_theta = 0.
    """
    frame = camera.frame()
    a, s, r = frame.spin, frame.sin_theta, frame.radius
    # b = a s^2 and p_theta = 0: n_phi = p_phi / (scale * energy), p_phi = a s, energy = (1 - shift b) / lapse.
    n_phi = a * s * frame.lapse / (frame.cylindrical_scale * (1 - frame.shift * a * s * s))
    delta = (r - 1) ** 2 - (1 - a) * (1 + a)
    # |n_r| from p_r = -(r^2 + a^2 - a b) / Delta, by its ratio to n_phi, which keeps the digits at the horizon.
    rho = math.sqrt(r * r + (a * frame.cos_theta) ** 2)
    energy = (1 - frame.shift * a * s * s) / frame.lapse
    n_r = -rho / (math.sqrt(delta) * energy)
    axis = _unit(np.array([[n_r, 0.0, n_phi]]))
    first, second = np.array([[0.0, 1.0, 0.0]]), np.cross(axis, [[0.0, 1.0, 0.0]])
    around = first * np.cos(turn)[:, None] + second * np.sin(turn)[:, None]
    return sky_from_fido(frame, axis * np.cos(angle)[:, None] + around * np.sin(angle)[:, None])


@own_settings()
def _passes_axis(camera: kc.Camera, sky: np.ndarray) -> np.ndarray:
    """True (n,) where rays of about b = 0 come closest to the spin axis on their way to infinity."""
    frame, light = camera.frame(), photon_of(camera.frame(), tuple(sky.T))
    quartic = radial.factor(frame, light)
    time = np.asarray(radial.mino_time(frame, light, quartic))
    momentum = np.maximum(light.k, 0) + camera.spin**2
    m = camera.spin**2 / momentum
    north = light.rate[3] > 0
    to_axis = ellipkinc(np.where(north, camera.inclination, math.pi - camera.inclination), m) / np.sqrt(momentum)
    return time > to_axis


def _filled(camera: kc.Camera, count: int, draw) -> np.ndarray:
    """`count` escaping directions from a source of directions."""
    found = np.empty((0, 3))
    while len(found) < count:
        sky = draw(2 * count)
        found = np.concatenate([found, sky[kc.trace_rays(camera, sky).escaped]])
    return found[:count]


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
