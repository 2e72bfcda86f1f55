"""Captured or escaping: the decision by roots against direct integration, and the shadow edge."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.trace import trace_rays
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.shadow import edge_photons, shadow_axes, shadow_edge

EDGE = json.loads((Path(__file__).parent / "data" / "shadow_edge.json").read_text(encoding="utf-8"))

# Spin, radius, inclination in degrees; the third and fourth are within the photon region.
EVENTS = [
    (0.999, 6.03, 90),
    (0.999, 2.6, 90),
    (0.999, 1.2, 80),
    (0.9, 1.5, 90),
    (0.0, 2.5, 40),
    (0.6, 3.0, 0),
]


FAST = [EVENTS[4]]
SLOW = [pytest.param(event, marks=pytest.mark.slow) for event in EVENTS if event not in FAST]


def random_directions(count: int, seed: int) -> np.ndarray:
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def integrated_capture(spin: float, radius: float, inclination: float, photon: np.ndarray) -> np.ndarray:
    """1 where the ray backward of a photon (n, 3) reaches the horizon, 0 where u = 0, NaN where undecided.

    u'' = U'(u) / 2 in steps of 1/25 of the fastest rate, for a photon of unit energy in the fiducial frame:
    its energy at infinity may have either sign.
    """
    a, r, s, c = spin, radius, math.sin(inclination), math.cos(inclination)
    delta, sigma = r * r - 2 * r + a * a, r * r + (a * c) ** 2
    big = (r * r + a * a) ** 2 - delta * (a * s) ** 2
    n_r, n_theta, n_phi = photon.T
    per_sine = math.sqrt(big / sigma) * n_phi
    spin_part = per_sine * s
    energy = math.sqrt(sigma * delta / big) + 2 * a * r / big * spin_part
    p_theta2 = sigma * n_theta**2
    q = p_theta2 + c * c * (per_sine**2 - (a * energy) ** 2)
    kappa = p_theta2 + (per_sine - a * s * energy) ** 2
    # U = E^2 + a2 u^2 + 2 kappa u^3 - a^2 q u^4.
    force = np.stack([(a * energy) ** 2 - spin_part**2 - q, 3 * kappa, -2 * a * a * q])
    path = np.stack([np.full(len(photon), 1 / r), math.sqrt(sigma * delta) / r**2 * n_r])
    step = 0.04 / np.sqrt(np.abs(force).sum(axis=0))
    return follow(force, path, step, 1 / (1 + math.sqrt(1 - a * a)))


def follow(force: np.ndarray, path: np.ndarray, step: np.ndarray, horizon: float) -> np.ndarray:
    """Classical Runge-Kutta steps of all rays until u leaves (0, u of the horizon), 3000 at most."""
    captured = np.full(len(step), np.nan)
    active = np.arange(len(step))
    for _ in range(3000):
        path = runge_kutta_step(force, path, step)
        u = path[0]
        captured[active[u >= horizon]] = 1
        captured[active[u <= 0]] = 0
        inside = (u > 0) & (u < horizon)
        active, path, step, force = active[inside], path[:, inside], step[inside], force[:, inside]
        if active.size == 0:
            break
    return captured


def runge_kutta_step(force: np.ndarray, path: np.ndarray, h: np.ndarray) -> np.ndarray:
    def rate(state: np.ndarray) -> np.ndarray:
        u, w = state
        return np.stack([w, ((force[2] * u + force[1]) * u + force[0]) * u])

    k1 = rate(path)
    k2 = rate(path + h / 2 * k1)
    k3 = rate(path + h / 2 * k2)
    k4 = rate(path + h * k3)
    return path + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


@pytest.mark.slow
@pytest.mark.parametrize("event", FAST + SLOW, ids=str)
def test_capture_against_integration(event):
    spin, radius, inclination = event[0], event[1], math.radians(event[2])
    camera = Camera(spin, radius, inclination, "fiducial")
    photon = random_directions(10_000, seed=int(1000 * radius))
    decided = trace_rays(camera, sky_from_fido(camera.frame(), photon), tolerance=1e-2).escaped
    captured = integrated_capture(spin, radius, inclination, photon)
    # Only rays that follow a spherical orbit for dozens of radians remain open.
    known = np.isfinite(captured)
    assert np.mean(~known) < 1e-3
    assert 0.01 < np.mean(captured[known]) < 0.999
    assert np.array_equal(captured[known] == 0, decided[known])


def test_stored_shadow_edge_lies_on_the_curve():
    stored = EDGE[0]
    camera = Camera(stored["a"], stored["r_c"], math.pi / 2, "circular")
    assert len(stored["points"]) == 20
    for point in stored["points"]:
        assert distance_to_edge(camera, np.array(point["N"])) < 1e-12


def distance_to_edge(camera: Camera, n: np.ndarray) -> float:
    """Distance of n from the shadow edge: from the curve's tangent at the foot point."""

    def at(turn: float) -> np.ndarray:
        return sky_from_fido(camera.frame(), edge_photons(camera, np.asarray(turn)))

    grid = 2 * math.pi * np.arange(720) / 720
    near = grid[np.argmin(np.linalg.norm(shadow_edge(camera, 720) - n, axis=1))]
    tangent = at(near + 1e-3) - at(near - 1e-3)
    tangent /= np.linalg.norm(tangent)
    foot = brentq(lambda turn: (at(turn) - n) @ tangent, near - 0.01, near + 0.01, xtol=1e-15)
    gap = at(foot) - n
    # At the two ends of the curve p_theta is right to the root of round-off only, which is along the curve.
    assert np.linalg.norm(gap) < 1e-7
    tangent = at(foot + 1e-6) - at(foot - 1e-6)
    return float(np.linalg.norm(np.cross(gap, tangent / np.linalg.norm(tangent))))


@pytest.mark.parametrize("event", [*FAST, *SLOW, (0.5, 50.0, 25), (0.95, 8.0, 120)], ids=str)
def test_edge_parts_captured_from_escaping(event):
    camera = Camera(event[0], event[1], math.radians(event[2]), "fiducial")
    turn = np.random.default_rng(7).uniform(0, 2 * math.pi, 64)
    edge = -edge_photons(camera, turn)
    toward = np.array([-1.0, 0.0, 0.0]) + edge * edge[:, :1]
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    for distance, expected in ((1e-9, False), (-1e-9, True)):
        line_of_sight = edge + distance * toward
        rays = trace_rays(camera, sky_from_fido(camera.frame(), -line_of_sight), tolerance=1e-2)
        assert np.array_equal(rays.escaped, np.full(64, expected))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spin", "radius", "velocity"),
    [(0.9, 8.0, "circular"), (0.999, 2.2, "static"), (0.9, 1.6, (0.0, 0.0, -0.9)), (0.0, 2.1, (0.0, 0.8, 0.0))],
)
def test_middle_of_the_shadow_is_the_mean_of_its_directions(spin, radius, velocity):
    """To what a mean of 20,000 directions is good for, be the shadow a twentieth of the sky or all but a hundredth."""
    camera = Camera(spin, radius, velocity=velocity)
    sky = random_directions(20_000, 5)
    captured = trace_rays(camera, sky).status == Status.CAPTURED
    mean = sky[captured].sum(axis=0) - sky.sum(axis=0) * captured.mean()
    middle = shadow_axes(camera, shadow_edge(camera))[0]
    assert mean @ middle > math.cos(math.radians(3)) * np.linalg.norm(mean)
