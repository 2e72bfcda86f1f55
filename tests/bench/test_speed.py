"""How long the main things take. Run with `make bench`: one core, after compilation."""

import os

import numpy as np
import pytest

import kerrcaustics as kc

BEAMS = 50_000


@pytest.fixture(scope="module", autouse=True)
def one_core():
    """Everything on one core, whatever the machine has."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    yield
    os.sched_setaffinity(0, before)


def whole_sky(count):
    directions = np.random.default_rng(2015).normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def timed(benchmark, function, count, expected):
    function()
    result = benchmark.pedantic(function, rounds=5)
    benchmark.extra_info["microseconds_each"] = 1e6 * benchmark.stats.stats.median / count
    assert expected(result)
    return result


CAMERA = kc.Camera(0.999, 6.03)
SKY = whole_sky(BEAMS)


def accurate(beams):
    """The 99 % error is what the tolerance promises; captured directions do not count."""
    return np.quantile(beams.error[beams.escaped], 0.99) < 1e-9


def test_beams_over_the_whole_sky(benchmark):
    """Everything of a beam, tolerance 1e-10: the aim is 10 microseconds each, captured directions not counted."""
    escaped = int(kc.trace_rays(CAMERA, SKY).escaped.sum())
    timed(benchmark, lambda: kc.trace_beams(CAMERA, SKY), escaped, accurate)


def test_beams_without_index_crossings_redshift(benchmark):
    options = {"index": False, "crossings": False, "redshift": False}
    timed(benchmark, lambda: kc.trace_beams(CAMERA, SKY, **options), BEAMS, accurate)


def test_rays_over_the_whole_sky(benchmark):
    timed(benchmark, lambda: kc.trace_rays(CAMERA, SKY), BEAMS, accurate)


@pytest.mark.parametrize("radius", [6.03, 2.6])
def test_three_caustics(benchmark, radius):
    """The main job on one core; on two it takes about 0.6 of this."""
    camera = kc.Camera(0.999, radius)
    timed(benchmark, lambda: kc.caustics(camera, 3), 1, lambda found: all(c.kind == "astroid" for c in found))
