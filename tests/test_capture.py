"""Captured or escaping: the decision by roots against direct integration, and the shadow edge."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from marks import few
from scipy.optimize import brentq

from kerrcaustics.beams.beam import Status
from kerrcaustics.beams.trace import trace_rays
from kerrcaustics.lens_map.sky_chart import chart_of
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.shadow import edge_photons, even_phases, shadow_axes, shadow_edge

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

    def at(turn: float | np.ndarray) -> np.ndarray:
        return sky_from_fido(camera.frame(), edge_photons(camera, np.asarray(turn)))

    grid = 2 * math.pi * np.arange(720) / 720
    near = grid[np.argmin(np.linalg.norm(at(grid) - n, axis=1))]
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
    turn = even_phases(camera, np.random.default_rng(7).uniform(0, 1, 64))
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
    [
        (0.9, 8.0, "circular"),
        (0.999, 2.2, "static"),
        (0.9, 1.6, (0.0, 0.0, -0.9)),
        (0.0, 2.1, (0.0, 0.8, 0.0)),
        (1 - 1e-9, kerr.isco(1 - 1e-9), "circular"),
    ],
)
def test_middle_of_the_shadow_is_the_mean_of_its_directions(spin, radius, velocity):
    """To what a mean of 20,000 directions is good for, be the shadow a twentieth of the sky or all but a hundredth."""
    camera = Camera(spin, radius, velocity=velocity)
    sky = random_directions(20_000, 5)
    captured = trace_rays(camera, sky).status == Status.CAPTURED
    mean = sky[captured].sum(axis=0) - sky.sum(axis=0) * captured.mean()
    middle = shadow_axes(camera, shadow_edge(camera))[0]
    assert mean @ middle > math.cos(math.radians(3)) * np.linalg.norm(mean)


# The straight side of the edge is up to half of it, and a part of 1e-5 to 1e-7 of the range of p_phi.
EXTREMAL = [Camera(a, radius) for a in (1 - 1e-9, 1 - 1.3e-14) for radius in (kerr.isco(a), 6.0)]


def edge_by_orbits(camera: Camera) -> np.ndarray:
    """The edge seen by a camera in the plane, by the radii 1 + x of its photon orbits (JTFT A.1), evenly in ln x.

    b_o and q_o are written in x, so that nothing cancels.
    """
    a, radius = camera.spin, camera.radius
    low, high = (orbit - 1 for orbit in kerr.photon_orbits(a))
    x = low * (high / low) ** (0.5 - 0.5 * np.cos(np.linspace(0, math.pi, 100_000)))
    orbit, spare = 1 + x, (1 - a) * (1 + a)
    b = (3 - a**2 - x**2 + 2 * spare / x) / a
    q = np.maximum(orbit**3 * (3 * x**2 - x**3 - 4 * spare), 0) / (a * x) ** 2
    at = kerr.metric(a, radius, 0.0)
    along_r = (radius - orbit) * np.sqrt(radius**2 + 2 * orbit * radius - a**2 * q / orbit**2) / math.sqrt(at.delta)
    half = np.stack([along_r / radius, np.sqrt(q) / radius, b / at.cylindrical_scale], axis=-1)
    whole = np.concatenate([half, half[-2:0:-1] * (1, -1, 1)])
    return sky_from_fido(camera.frame(), whole / np.linalg.norm(whole, axis=1, keepdims=True))


def dark_part(edge: np.ndarray) -> float:
    """The part of the sky within a curve, by triangles about the direction to the hole."""
    after, middle = np.roll(edge, -1, axis=0), np.array([-1.0, 0.0, 0.0])
    volume = np.cross(edge, after) @ middle
    size = 1 + (edge * after).sum(axis=1) + edge @ middle + after @ middle
    return float(2 * np.arctan2(volume, size).sum() / (4 * math.pi))


@pytest.mark.parametrize("camera", EXTREMAL, ids=str)
def test_edge_of_extremal_holes_is_that_of_its_photon_orbits(camera):
    edge, exact = shadow_edge(camera, 720), edge_by_orbits(camera)
    assert dark_part(edge) == pytest.approx(dark_part(exact), abs=5e-5)
    middle = View.toward_hole(camera, 16, 9, 1.0).forward
    assert math.acos(min(middle @ shadow_axes(camera, exact)[0], 1)) < 1e-3


def test_part_of_the_sky_that_escapes_next_to_an_extremal_hole():
    # By 400,000 rays in random directions 0.5466, with a deviation of 0.0008.
    assert 1 - dark_part(shadow_edge(EXTREMAL[0], 4000)) == pytest.approx(0.54702, abs=1e-5)


@pytest.mark.parametrize("spin", few((0.0, 0.999, 1 - 1e-6, 1 - 1e-9, 1 - 1e-14), (1 - 1e-14,)))
def test_no_step_along_the_edge_is_longer_than_twice_the_mean(spin):
    for inclination in (math.pi / 2, 1.2, 0.0):
        for radius in (kerr.isco(spin), 3.0, 1e8):
            velocities = "fiducial", (0.0, 0.0, 0.9), (-0.99, 0.0, 0.0), (0.3, 0.9, -0.1)
            cameras = [Camera(spin, radius, inclination, velocity) for velocity in velocities]
            for viewer in (*cameras, Observer(spin=spin, inclination=inclination)):
                edge = shadow_edge(viewer, 180)
                steps = np.linalg.norm(np.roll(edge, -1, axis=0) - edge, axis=1)
                assert steps.max() < 2.2 * steps.mean(), viewer


@pytest.mark.parametrize("camera", EXTREMAL, ids=str)
def test_charts_know_the_edge_of_extremal_holes(camera):
    at_rest = camera.at_rest()
    part = chart_of(at_rest).polar(edge_by_orbits(at_rest)[::7])[:, 1]
    assert np.abs(part - 1).max() < 1e-5
