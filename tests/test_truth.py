"""Traced beams against end points, Jacobians and indices known to 25 digits; see studies/truth/."""

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kerrcaustics.beams.engine import ENGINES
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.sphere import polar_basis

TRUTH = json.loads((Path(__file__).parents[1] / "studies" / "truth" / "truth.json").read_text(encoding="utf-8"))
CAMERAS = [Camera(**camera) for camera in TRUTH["cameras"]]
RAYS = sorted(TRUTH["rays"], key=lambda ray: ray["camera"])
FAMILIES = ("whole sky", "near the edge", "through the poles")
FIELDS = (
    "direction",
    "azimuth",
    "error",
    "jacobian",
    "diameter_error",
    "delta_minus",
    "index",
    "escaped",
)
TIMED = ("time", "time_error")

pytestmark = pytest.mark.parametrize(
    "engine", [pytest.param(engine, marks=[pytest.mark.slow] * (engine != "closed-form")) for engine in ENGINES]
)


def truth(name: str) -> np.ndarray:
    """A quantity of all rays, rounded to doubles."""
    return np.array([ray[name] for ray in RAYS], float)


@cache
def traced(engine: str, time: bool = False) -> dict[str, np.ndarray]:
    """Named quantities of all beams, in the order of RAYS."""
    camera_of = truth("camera")
    parts = [
        trace_beams(camera, truth("sky")[camera_of == i], engine, tolerance=1e-12, time=time)
        for i, camera in enumerate(CAMERAS)
    ]
    return {name: np.concatenate([getattr(part, name) for part in parts]) for name in FIELDS + TIMED * time}


def columns_in_space(beams: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack(polar_basis(beams["direction"]), axis=-1) @ beams["jacobian"]


def direction_error(engine: str) -> np.ndarray:
    return np.linalg.norm(traced(engine)["direction"] - truth("direction"), axis=1)


def camera_rounding() -> np.ndarray:
    """Errors of n' in radians from the rounding of the camera's numbers to doubles, beside that of N."""
    return 1e-16 * truth("delta_plus")


def test_all_rays_escape(engine):
    assert {ray["family"] for ray in RAYS} == set(FAMILIES)
    assert len(RAYS) == 400
    assert traced(engine)["escaped"].all()


def test_reported_error_of_end_points_is_honest(engine):
    assert np.all(direction_error(engine) <= 10 * traced(engine)["error"] + camera_rounding())


def test_whole_sky_is_within_the_tolerance(engine):
    whole = np.array([ray["family"] == "whole sky" for ray in RAYS])
    assert np.quantile(direction_error(engine)[whole], 0.99) < 1e-12


def test_reported_error_of_jacobians_is_honest(engine):
    beams = traced(engine)
    error = np.linalg.norm(columns_in_space(beams) - truth("columns"), axis=(1, 2)) / truth("delta_plus")
    assert np.all(error <= 10 * beams["diameter_error"] + camera_rounding())


def test_minor_diameters(engine):
    beams = traced(engine)
    error = np.abs(beams["delta_minus"] - truth("delta_minus")) / truth("delta_plus")
    assert np.all(error <= 10 * beams["diameter_error"] + camera_rounding())


def test_unwrapped_azimuth(engine):
    beams = traced(engine)
    difference = beams["azimuth"] - truth("azimuth")
    passing = np.array([float(ray.get("axis_distance", "1")) for ray in RAYS])
    # A ray through the axis has an azimuth but for whole turns.
    difference -= np.where(passing == 0, 2 * math.pi * np.round(difference / (2 * math.pi)), 0)
    # A ray that passes the axis turns about it by its sideways error over its distance.
    ending = np.hypot(*truth("direction")[:, :2].T)
    lever = np.where(passing == 0, ending, np.minimum(passing, ending))
    assert np.all(np.abs(difference) * lever <= 10 * beams["error"] + camera_rounding())


@pytest.mark.slow
def test_reported_error_of_times_is_honest(engine):
    beams = traced(engine, time=True)
    error = np.abs(beams["time"] - truth("delay"))
    assert np.all(error <= 10 * beams["time_error"] + camera_rounding())
    whole = np.array([ray["family"] == "whole sky" for ray in RAYS])
    assert np.quantile(error[whole], 0.99) < 1e-11


def test_morse_index(engine):
    assert np.array_equal(traced(engine)["index"], truth("index"))
