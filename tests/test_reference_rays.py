"""Traced beams against stored numbers of other programs; see data/README.md."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from kerrcaustics.beams.beam import Beams, Status
from kerrcaustics.beams.trace import trace_beams, trace_rays
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_fido

DATA = Path(__file__).parent / "data"
REFERENCE = json.loads((DATA / "rays.json").read_text(encoding="utf-8"))
ESCAPING = [ray for ray in REFERENCE if not ray["captured"]]


def column(name: str) -> np.ndarray:
    """A quantity of all escaping rays."""
    return np.array([ray[name] for ray in ESCAPING])


def edge_distance() -> np.ndarray:
    """Distance in radians from the shadow edge of the rays tagged with it; infinite for the others."""
    tags = [ray["tag"] for ray in ESCAPING]
    return np.array([float(tag.removeprefix("near_edge_")) if "edge" in tag else math.inf for tag in tags])


def traced(ray: dict) -> Beams:
    camera = Camera(ray["a"], ray["r_c"], math.radians(ray["theta_c_deg"]), (0.0, 0.0, ray["beta"]))
    return trace_beams(camera, ray["N"], tolerance=1e-10)


@pytest.fixture(scope="module")
def beams():
    """All 112 beams of the reference, each from its own camera."""
    return [traced(ray) for ray in REFERENCE]


@pytest.fixture(scope="module")
def escaping(beams):
    """Named quantities of the beams that escape, one row a beam."""
    kept = [beam for beam, ray in zip(beams, REFERENCE, strict=True) if not ray["captured"]]
    names = ("direction", "azimuth", "error", "diameter_error", "determinant", "delta_plus", "delta_minus")
    names += ("index", "crossings", "redshift", "status")
    return {name: np.array([getattr(beam, name) for beam in kept]) for name in names}


def direction_error(escaping: dict[str, np.ndarray]) -> np.ndarray:
    return np.linalg.norm(escaping["direction"] - column("n_inf"), axis=1)


def test_captured_rays(beams):
    assert len(REFERENCE) == 112
    expected = [ray["captured"] for ray in REFERENCE]
    assert [bool(beam.status == Status.CAPTURED) for beam in beams] == expected
    assert all(np.isnan(beam.direction).all() for beam, lost in zip(beams, expected, strict=True) if lost)


def test_end_points(escaping):
    error = direction_error(escaping)[edge_distance() >= 1e-6]
    assert np.median(error) < 1e-11
    assert np.quantile(error, 0.99) < 1e-9


def test_reported_error_of_end_points_is_honest(escaping):
    assert np.all(direction_error(escaping) <= 10 * escaping["error"])


def test_reported_error_is_within_the_tolerance(escaping):
    loose = escaping["error"] > 1e-10
    assert np.array_equal(loose, escaping["status"] == Status.INACCURATE)
    # Round-off alone is 1e-15 to 1e-14 of delta_plus.
    assert not loose[column("delta_plus") < 1e4].any()


@pytest.mark.parametrize("name", ["delta_plus", "delta_minus"])
def test_diameters(escaping, name):
    error = np.abs(escaping[name] - column(name)) / column("delta_plus")
    assert np.all(error <= 10 * escaping["diameter_error"])


def test_determinant(escaping):
    # |d det J| <= 2 delta_plus |dJ|.
    error = np.abs(escaping["determinant"] - column("det")) / column("delta_plus") ** 2
    assert np.all(error <= 20 * escaping["diameter_error"])


def test_morse_index(escaping):
    assert np.array_equal(escaping["index"], column("morse"))


def test_equator_crossings(escaping):
    assert np.array_equal(escaping["crossings"], column("equator_crossings"))


def test_redshift(escaping):
    # The factor 1 - beta N_y and a lapse of 1e-3 near the horizon cost three digits at most.
    assert np.allclose(escaping["redshift"], column("redshift_fc_over_fprime"), rtol=1e-13, atol=0)


def test_unwrapped_azimuth(escaping):
    difference = escaping["azimuth"] - column("phi_unwrapped")
    on_axis = np.array([ray["tag"] == "on_axis_b0" for ray in ESCAPING])
    whole_turns = 2 * math.pi * np.round(difference / (2 * math.pi))
    difference = np.where(on_axis, difference - whole_turns, difference)
    # A ray that passes the axis at the angle sin(theta) >= |b| / sqrt(q + b^2 + a^2) turns about it by its
    # sideways error over that angle; a ray through the axis ends at a known azimuth all the same.
    b, q, a = column("b"), column("q"), column("a")
    square = q + b**2 + a**2
    passing = np.abs(b) / np.sqrt(np.where(square > 0, square, 1))
    ending = np.hypot(escaping["direction"][:, 0], escaping["direction"][:, 1])
    # Without angular momentum, the polar angle does not change at all.
    lever = np.where(on_axis | (square <= 0), ending, passing)
    assert np.all(np.abs(difference) * lever <= 10 * escaping["error"])


def test_rays_alone_end_where_beams_do(escaping):
    for ray, direction, error in zip(ESCAPING, escaping["direction"], escaping["error"], strict=True):
        camera = Camera(ray["a"], ray["r_c"], math.radians(ray["theta_c_deg"]), (0.0, 0.0, ray["beta"]))
        alone = trace_rays(camera, ray["N"])
        assert np.linalg.norm(alone.direction - direction) <= 10 * (error + alone.error)


def fido_direction(camera: Camera, b, q, signs) -> np.ndarray:
    """Unit FIDO components (..., 3) of photons with constants b, q and signs of p_r, p_theta."""
    a, r, s, c = camera.spin, camera.radius, camera.sin_theta, camera.cos_theta
    delta, sigma = r * r - 2 * r + a * a, r * r + (a * c) ** 2
    big = (r * r + a * a) ** 2 - delta * (a * s) ** 2
    radial = (r * r + a * a - a * b) ** 2 - delta * ((b - a) ** 2 + q)
    polar = q - c * c * ((b / s) ** 2 - a * a)
    n_r = signs[0] * np.sqrt(radial / (sigma * delta))
    n = np.stack([n_r, signs[1] * np.sqrt(polar / sigma), b / s * np.sqrt(sigma / big)], axis=-1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def turned(direction: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(direction, -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


@pytest.fixture(scope="module")
def kerrp2p():
    return np.loadtxt(DATA / "kerrp2p_inclined_camera.csv", delimiter=",")


def continued(row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """End direction and azimuth (2, ...) of a stored ray, traced on with both signs of p_theta."""
    _, _, _, b, q, theta, phi, _ = row
    there = Camera(0.999, 1000.0, theta, "fiducial")
    photons = np.stack([fido_direction(there, b, q, (-1, sign)) for sign in (1, -1)])
    rays = trace_rays(there, sky_from_fido(there.frame(), photons), tolerance=1e-13)
    # (t, phi) -> (-t, -phi) turns the emitted ray into the ray followed backward.
    return turned(rays.direction, -phi), rays.azimuth - phi


@pytest.mark.slow
def test_kerrp2p_rays_traced_on_from_a_thousand(kerrp2p):
    """Rays from r = 6.03 to infinity are KerrP2P's rays to r = 1000 followed by the rest of the way."""
    camera = Camera(0.999, 6.03, 1.2, "fiducial")
    photons = fido_direction(camera, *kerrp2p.T[3:5], -kerrp2p.T[1:3])
    beams = trace_beams(camera, sky_from_fido(camera.frame(), photons), tolerance=1e-13)
    assert beams.escaped.all()
    for row, n, azimuth, error in zip(kerrp2p, beams.direction, beams.azimuth, beams.error, strict=True):
        directions, azimuths = continued(row)
        gap = np.linalg.norm(directions - n, axis=-1)
        # The stored file does not say the sign of p_theta at the end; the other one is 1e-5 off or more.
        kept = gap.argmin()
        assert gap[kept] < 10 * error + 1e-13
        # A ray passes the axis no closer than its b lets it.
        lever = abs(row[3]) / math.sqrt(row[4] + row[3] ** 2 + 1)
        assert abs(azimuths[kept] - azimuth) * lever < 10 * error + 1e-13
