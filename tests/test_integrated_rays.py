"""Rays that the integrator follows alone, without their variations, beside those of their beams; its tolerances."""

import math
from itertools import pairwise

import numpy as np
import pytest
from random_rays import random_camera, random_sky

import kerrcaustics as kc

TOLERANCES = [1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2]
ENDS = {
    "sky": lambda camera: math.inf,
    "sphere": lambda camera: 2.0 * camera.radius,
    "first crossing": lambda camera: kc.EquatorialPlane(1),
    "third crossing": lambda camera: kc.EquatorialPlane(3),
}


@pytest.mark.parametrize("trace", [kc.trace_rays, kc.trace_beams])
def test_each_decade_of_tolerance_has_steps_of_its_own(trace):
    """Equal steps give equal bits: at every decade a quarter of the rays, or more, are in other steps."""
    camera = kc.Camera(0.9, 6.0, 1.1)
    sky = random_sky(camera, 200, np.random.default_rng(7))
    ends = [trace(camera, sky, "integrated", tolerance) for tolerance in TOLERANCES]
    for finer, coarser in pairwise(ends):
        changed = (finer.direction != coarser.direction).any(axis=1)[finer.escaped & coarser.escaped]
        assert changed.mean() > 0.25


def shares_of(ends, exact):
    """(3, n): true over reported error of n', azimuth and time."""
    away = np.linalg.norm(ends.direction - exact.direction, axis=1)
    turned, late = np.abs(ends.azimuth - exact.azimuth), np.abs(ends.time - exact.time)
    with np.errstate(invalid="ignore"):
        parts = away / ends.error, turned / ends.azimuth_error, late / ends.time_error
    return np.stack(parts)


def worst(end, tolerance, cameras, seed):
    """The largest true over reported error of rays alone; the reported one over that of beams, least and median.

    The latter where both took the same steps.
    """
    rng, shares, ratios = np.random.default_rng(seed), [], []
    for _ in range(cameras):
        camera = random_camera(rng)
        sky, goal = random_sky(camera, 128, rng), end(camera)
        options = {"end": goal, "time": True}
        rays = kc.trace_rays(camera, sky, "integrated", tolerance, **options)
        beams = kc.trace_beams(camera, sky, "integrated", tolerance, **options)
        exact = kc.trace_beams(camera, sky, "integrated", 1e-14, **options)
        # What is decided without the path is the same.
        for name in ("status_certain", "redshift", "outward"):
            if getattr(rays, name) is not None:
                assert np.array_equal(getattr(rays, name), getattr(beams, name))
        assert np.array_equal(np.isnan(rays.error), np.isnan(beams.error))
        known = np.isfinite(beams.error) & beams.status_certain & (exact.error < 0.1 * rays.error)
        shares.append(shares_of(rays, exact)[:, known])
        alike = (rays.direction == beams.direction).all(axis=1)
        ratios.append((rays.error / beams.error)[known & alike])
    shares, ratios = np.concatenate(shares, axis=1), np.concatenate(ratios)
    return np.nanmax(shares), ratios.min(), np.median(ratios)


@pytest.mark.parametrize("end", ENDS.values(), ids=ENDS)
def test_errors_of_rays_alone_are_those_of_their_beams_or_larger(end):
    """In the longest steps, which both take alike."""
    share, least, middle = worst(end, 1e-2, 12, 3)
    assert share < 1
    assert least > 0.2
    assert middle < 20


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("end", ENDS.values(), ids=ENDS)
def test_errors_of_rays_alone_hold(end, tolerance):
    assert worst(end, tolerance, 60, 4)[0] < 1.5


def test_paths_of_rays_alone_are_those_of_beams():
    """In the same steps; where one of both is traced again in shorter ones, within the errors."""
    camera = kc.Camera(0.95, 5.0, 1.2)
    sky = random_sky(camera, 400, np.random.default_rng(5))
    for tolerance in (1e-2, 1e-10):
        rays = kc.trace_rays(camera, sky, "integrated", tolerance, time=True)
        beams = kc.trace_beams(camera, sky, "integrated", tolerance, time=True)
        assert np.array_equal(rays.escaped, beams.escaped)
        there = rays.escaped
        apart = np.linalg.norm(rays.direction - beams.direction, axis=1)[there]
        assert np.all(apart <= (rays.error + beams.error)[there])
        assert np.median(apart) <= 1e-15
        time, late = (np.asarray(part, float) for part in (rays.time, rays.time_error))
        of_beams, late_beams = (np.asarray(part, float) for part in (beams.time, beams.time_error))
        assert np.all(np.abs(time - of_beams)[there] <= (late + late_beams)[there])


def test_rays_that_turn_in_the_plane_have_errors_as_large_as_their_beams():
    """They linger at the photon orbit, and meet the plane where their radius hardly changes."""
    camera = kc.Camera(0.0, 7.29, 0.0145, "fiducial")
    edge = kc.shadow_edge(camera, 64)
    away = edge - [-1.0, 0.0, 0.0]
    sky = np.concatenate([edge + step * away for step in (-1e-3, -1e-4, -1e-5, 1e-5, 1e-4, 1e-3)])
    end = kc.EquatorialPlane(3)
    rays = kc.trace_rays(camera, sky, "integrated", 1e-2, end=end)
    beams = kc.trace_beams(camera, sky, "integrated", 1e-2, end=end)
    ratio = (rays.error / beams.error)[np.isfinite(beams.error)]
    assert len(ratio) > 100
    assert ratio.min() > 0.2
