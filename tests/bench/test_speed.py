"""Times of the main functions. Run with `make bench`: one core, after a first call."""

import os
import subprocess
import sys

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.ray_state import LEAST_K
from kerrcaustics.curves.critical_curves import forget
from kerrcaustics.spacetime.frame import photon_of

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


ENGINES = ("closed-form", "integrated", "auto")
BENT = SKY[np.asarray(photon_of(CAMERA.frame(), tuple(SKY.T)).k) >= LEAST_K]


def test_closed_form_rays(benchmark):
    """Direction and azimuth of rays that have a closed form: the aim is 1 microsecond each."""
    timed(benchmark, lambda: kc.trace_rays(CAMERA, BENT, "closed-form"), len(BENT), accurate)


def test_closed_form_beams(benchmark):
    """With Jacobian and index: the aim is 2.5 microseconds each, at most 5."""
    options = {"crossings": False, "redshift": False}
    timed(benchmark, lambda: kc.trace_beams(CAMERA, BENT, "closed-form", **options), len(BENT), accurate)


def test_closed_form_beams_off_the_equator(benchmark):
    camera = kc.Camera(0.999, 6.03, 1.2)
    bent = SKY[np.asarray(photon_of(camera.frame(), tuple(SKY.T)).k) >= LEAST_K]
    timed(benchmark, lambda: kc.trace_beams(camera, bent, "closed-form"), len(bent), accurate)


@pytest.mark.parametrize("engine", ENGINES)
def test_beams_over_the_whole_sky(benchmark, engine):
    """Everything of a beam, tolerance 1e-10; captured directions count."""
    timed(benchmark, lambda: kc.trace_beams(CAMERA, SKY, engine), BEAMS, accurate)


@pytest.mark.parametrize("engine", ENGINES)
def test_beams_without_index_crossings_redshift(benchmark, engine):
    options = {"index": False, "crossings": False, "redshift": False}
    timed(benchmark, lambda: kc.trace_beams(CAMERA, SKY, engine, **options), BEAMS, accurate)


@pytest.mark.parametrize("engine", ENGINES)
def test_rays_over_the_whole_sky(benchmark, engine):
    timed(benchmark, lambda: kc.trace_rays(CAMERA, SKY, engine), BEAMS, accurate)


@pytest.mark.parametrize("count", [1_000, 10_000, 100_000, 1_000_000])
def test_time_grows_with_the_number_of_beams(benchmark, count):
    sky = whole_sky(count)
    timed(benchmark, lambda: kc.trace_beams(CAMERA, sky), count, accurate)


def test_ten_million_beams_in_two_gigabytes(benchmark):
    """In a process of its own, so that its peak memory is that of this job."""
    script = (
        "import resource, time, numpy as np, kerrcaustics as kc\n"
        "sky = np.random.default_rng(2015).normal(size=(10_000_000, 3))\n"
        "camera = kc.Camera(0.999, 6.03)\n"
        "kc.trace_beams(camera, sky[:1000])\n"
        "start = time.perf_counter()\n"
        "kc.trace_beams(camera, sky)\n"
        "print(time.perf_counter() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6)\n"
    )

    def run():
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        seconds, gigabytes = map(float, done.stdout.split())
        return seconds, gigabytes

    seconds, gigabytes = benchmark.pedantic(run, rounds=1)
    benchmark.extra_info.update(microseconds_each=seconds / 10, gigabytes=gigabytes)
    assert gigabytes < 2


@pytest.mark.parametrize("radius", [6.03, 2.6])
def test_three_caustics(benchmark, radius):
    """The main job on one core."""
    camera = kc.Camera(0.999, radius)

    def found_anew():
        forget()
        return kc.caustics(camera, 3)

    timed(benchmark, found_anew, 1, lambda found: all(c.kind == "astroid" for c in found))
