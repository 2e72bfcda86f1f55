"""The coordinate time in closed form against the integrated one."""

import math

import numpy as np
import pytest
from test_closed_form import directions_of_small_k
from test_errors import random_camera, random_sky

import kerrcaustics as kc


@pytest.mark.parametrize(
    ("trace", "finite"), [pytest.param(kc.trace_beams, False, marks=pytest.mark.slow), (kc.trace_rays, True)]
)
def test_times_on_random_cameras(trace, finite):
    rng = np.random.default_rng(1988)
    units, relative = [], []
    for _ in range(8):
        camera = random_camera(rng)
        sky = np.concatenate([random_sky(camera, 128, rng), directions_of_small_k(camera, 32, rng)])
        end = camera.radius * (1 + 10 ** rng.uniform(-3, 2)) if finite else math.inf
        exact = kc.trace_rays(camera, sky, "integrated", tolerance=1e-13, end=end, time=True)
        ends = trace(camera, sky, "closed-form", tolerance=1e-13, end=end, time=True)
        assert np.array_equal(ends.escaped, exact.escaped)
        assert np.array_equal(np.isfinite(ends.time), exact.escaped)
        assert ends.closed_form[128:].all()
        known = ends.closed_form
        error = np.abs(ends.time - exact.time)[known]
        # Both may be wrong by as much as they say.
        units += list(error / (ends.time_error + exact.time_error / 10)[known])
        relative += list(error / np.maximum(1, np.abs(exact.time[known])))
    assert len(units) > 500
    assert max(units) <= 10
    assert np.median(relative) < 1e-13


def test_times_of_rays_that_leave_close_to_their_turning_point():
    camera = kc.Camera(0.7, 8.0, 1.2, "fiducial")
    for tilt in (1e-3, 1e-6, 1e-9, 0.0, -1e-9, -1e-6, -1e-3):
        sky = np.array([[math.sin(tilt), 0.6 * math.cos(tilt), 0.8 * math.cos(tilt)]])
        ends = [kc.trace_rays(camera, sky, engine, 1e-13, time=True) for engine in ("closed-form", "integrated")]
        assert ends[0].closed_form.all()
        assert abs(ends[0].time - ends[1].time) < 1e-12


def test_time_of_the_automatic_engine_is_in_closed_form():
    camera = kc.Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 256, np.random.default_rng(4))
    rays = kc.trace_rays(camera, sky, tolerance=1e-10, time=True)
    assert rays.closed_form[rays.escaped].mean() > 0.95
