"""Reported errors against the rounding of the very formulas: the graphs of kernels in long arithmetic."""

import numpy as np
import pytest
from random_rays import random_camera, random_sky

import kerrcaustics as kc
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.kernels.programs import graph_of
from kerrcaustics.beams.kernels.trees import leaves
from studies.truth.rounding import long_results

# What the two results of one formula may differ by, relative to the reported errors: all of them.
MOST = 1.0


def assert_errors_hold(name, camera, sky, *, numbers=(), columns=()):
    """Rays of a kernel within their errors of those in long arithmetic, and the flags of those that are certain."""
    given = [*(float(number) for number in leaves(camera.frame())), *numbers]
    rays = np.column_stack([sky, *columns])
    ours, exact = kernel(name).on_rays(given, [sky, *columns]), long_results(graph_of(name)[0], given, rays)
    sure = ours.status_certain.astype(bool)
    assert np.array_equal(ours.status[sure], exact.status[sure])
    used = np.flatnonzero(ours.closed_form & np.isfinite(ours.error) & sure)
    # Next to the hole most fall in.
    assert len(used) > 0.2 * len(sky)
    ours, exact = ours.rows(used), exact.rows(used)
    away = np.linalg.norm(ours.direction - exact.direction, axis=1)
    assert np.all(away <= MOST * ours.error)
    turned = np.abs(ours.azimuth - exact.azimuth)
    assert np.all(turned <= MOST * ours.azimuth_error)
    assert ours.time is None or np.all(np.abs(ours.time - exact.time) <= MOST * ours.time_error)
    if ours.jacobian is not None:
        # The major diameter is at least the root of half the sum of squares.
        size = np.sqrt((exact.jacobian**2).sum(axis=(1, 2)) / 2)
        bent = np.sqrt(((ours.jacobian - exact.jacobian) ** 2).sum(axis=(1, 2)))
        assert np.all(bent <= MOST * 2 * ours.jacobian_error * size)
        known = ours.index_certain.astype(bool)
        assert np.array_equal(ours.index[known], exact.index[known])
    return away / ours.error


@pytest.mark.slow
def test_errors_of_beams_hold_what_rounding_does():
    rng = np.random.default_rng(11)
    camera = kc.Camera(0.97, 5.0, 1.1)
    parts = assert_errors_hold("beams_time_sky", camera, random_sky(camera, 10, rng))
    # The estimate is no empty one.
    assert parts.max() > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("place", ["sky", "sphere", "plane"])
def test_errors_hold_on_random_cameras(place):
    rng = np.random.default_rng(12)
    for _ in range(8):
        camera = random_camera(rng)
        sky = random_sky(camera, 24, rng)
        name = f"beams_time_equator_{place}" if camera.on_equator else f"beams_time_{place}"
        columns = [np.full(24, 3 * camera.radius), np.zeros(24)] if place == "sphere" else []
        assert_errors_hold(name, camera, sky, numbers=[1.0] if place == "plane" else [], columns=columns)
