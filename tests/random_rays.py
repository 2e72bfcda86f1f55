"""Random cameras, and random directions on their skies, the special and the extreme ones often.

Those of the study adversary go to all extremes, as strategies for hypothesis: `hard_cameras`, `hard_cases`.
"""

import math

import numpy as np
from hypothesis import strategies as st

from kerrcaustics.beams.ray_state import LEAST_K
from kerrcaustics.scripts import STUDIES
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.shadow import edge_photons

hard = STUDIES.module("adversary.cases")


def random_camera(rng: np.random.Generator) -> Camera:
    """Any spin, radius, inclination and velocity; the special and the extreme ones often."""
    spin = rng.choice([0.0, rng.uniform(0, 1), 1 - 10 ** rng.uniform(-5, -1)])
    outside = rng.choice([10 ** rng.uniform(-2, 0), 10 ** rng.uniform(0, 1.3), 10 ** rng.uniform(1, 6)])
    inclination = rng.choice([math.pi / 2, math.acos(rng.uniform(-1, 1)), 10 ** rng.uniform(-6, -1)])
    velocity = rng.normal(size=3)
    velocity *= rng.uniform(0, 0.9) / np.linalg.norm(velocity)
    return Camera(spin, kerr.horizon(spin) + outside, inclination, tuple(velocity))


def outside_edge(camera: Camera, turn: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Directions N (n, 3) beyond the shadow edge by a fraction of its angular distance from the hole."""
    edge = -edge_photons(camera, turn)
    centre = np.array([-1.0, 0.0, 0.0])
    away = edge * (edge @ centre)[:, None] - centre
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    distance = (fraction * np.arccos(np.clip(edge @ centre, -1, 1)))[:, None]
    return sky_from_fido(camera.frame(), -(edge * np.cos(distance) + away * np.sin(distance)))


def random_sky(camera: Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Directions N (count, 3): half from the whole sky, half near the shadow edge, down to 1e-7."""
    sky = rng.normal(size=(count, 3))
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    half = count // 2
    sky[:half] = outside_edge(camera, rng.uniform(0, 2 * math.pi, half), 10 ** rng.uniform(-7, 0, half))
    return sky


def directions_of_small_k(camera: Camera, count: int, rng: np.random.Generator) -> np.ndarray:
    """Directions N (at most count, 3) that look outward, with k < LEAST_K; some are close to the principal null one."""
    frame = camera.frame()
    size = np.sqrt((LEAST_K + (frame.spin * frame.cos_theta) ** 2) * rng.uniform(size=count))
    turn, close = rng.uniform(0, 2 * math.pi, count), 10 ** rng.uniform(-12, 0, count)
    principal = rng.uniform(size=count) < 0.3
    p_theta = np.where(principal, close, size) * np.cos(turn)
    p_phi = np.where(principal, close * np.sin(turn) + frame.spin * frame.sin_theta, size * np.sin(turn))
    energy = (1 - frame.shift * frame.sin_theta * p_phi) / frame.lapse
    n_phi, n_theta = p_phi / (frame.cylindrical_scale * energy), p_theta / (frame.root_sigma * energy)
    there = (energy > 0) & (n_phi**2 + n_theta**2 < 1)
    there &= p_theta**2 + p_phi**2 < LEAST_K + (frame.spin * frame.cos_theta) ** 2
    n_r = -np.sqrt(np.maximum(1 - n_phi**2 - n_theta**2, 0))
    return sky_from_fido(frame, np.stack([n_r, n_theta, n_phi], axis=-1)[there])


class Drawn:
    """Numbers for the study adversary, drawn by hypothesis."""

    def __init__(self, draw):
        self.draw = draw

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        return self.draw(st.floats(low, high))

    def integers(self, low: int, high: int) -> int:
        return self.draw(st.integers(low, high - 1))


@st.composite
def hard_cameras(draw) -> Camera:
    """Cameras of any spin, place and velocity that there may be."""
    return hard.hard_camera(Drawn(draw))


@st.composite
def hard_cases(draw, rays: int = 18, ends: bool = True):
    """A camera, directions of every hard family on its sky, and an end; the celestial sphere if not `ends`."""
    camera = draw(hard_cameras())
    sky, families = hard.hard_sky(camera, rays, np.random.default_rng(draw(st.integers(0, 2**32 - 1))))
    return hard.Case(camera, sky, families, hard.hard_end(camera, Drawn(draw)) if ends else math.inf)
