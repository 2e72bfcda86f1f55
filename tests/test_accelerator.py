"""Batches as a GPU gets them, on whatever device there is: few large batches, with the answers of many small ones."""

import operator
import os
import subprocess
import sys
import threading
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from random_rays import random_sky

from kerrcaustics import Camera, trace_beams, trace_rays
from kerrcaustics.beams import batches, compile_cache
from kerrcaustics.beams.compile_cache import Program
from kerrcaustics.spacetime.settings import own_settings

PROGRAMS = ("_closed_form", "_integrate", "_survey", "_prospects")


@pytest.fixture
def accelerated(monkeypatch):
    """Let batches be those of an accelerator, for as many rays as its memory holds; the calls: name, rays, thread."""
    calls = []

    def spied(name, program):
        def call(frame, sky, *others, **options):
            # Rays of small k have formulas of their own.
            calls.append(("_short" if options.get("short") else name, len(sky[0]), threading.current_thread()))
            return program(frame, sky, *others, **options)

        return call

    def begin(most=1 << 12):
        for place in (batches, "kerrcaustics.beams.trace"):
            monkeypatch.setattr(f"{getattr(place, '__name__', place)}.on_accelerator", lambda count: True)
        for place in (batches, "kerrcaustics.beams.trace"):
            target = f"{getattr(place, '__name__', place)}.most_on_accelerator"
            monkeypatch.setattr(target, lambda: most)
        for name in PROGRAMS:
            monkeypatch.setattr(batches, name, spied(name, getattr(batches, name)))
        return calls

    return begin


def sizes(calls):
    return [(name, size) for name, size, _ in calls]


def assert_alike(some, others):
    """The same rays, within what they say of their errors."""
    for name in ("status", "closed_form", "index", "crossings"):
        assert np.array_equal(getattr(some, name), getattr(others, name))
    away = np.linalg.norm(some.direction - others.direction, axis=1)
    assert np.nanmax(away / some.error) < 2
    bent = np.linalg.norm(some.jacobian - others.jacobian, axis=(1, 2)) / others.delta_plus
    assert np.nanmax(bent / others.diameter_error) < 2


@pytest.mark.slow
def test_beams_agree_with_those_of_small_batches(accelerated, monkeypatch):
    """Both engines: rays of small k and others that the closed form does not hold for are integrated."""
    camera = Camera(0.999, 6.03)
    sky = random_sky(camera, 1500, np.random.default_rng(6))
    small = [trace_beams(camera, sky), trace_beams(camera, sky[:700], "integrated")]
    calls = accelerated()
    assert_alike(trace_beams(camera, sky), small[0])
    assert [size for name, size in sizes(calls) if name == "_closed_form"] == [4096]
    calls.clear()
    monkeypatch.setattr(batches, "INTEGRATED", 1024)
    assert_alike(trace_beams(camera, sky[:700], "integrated"), small[1])
    assert {size for _, size in sizes(calls)} == {1024} and sizes(calls)[:2] == [
        ("_survey", 1024),
        ("_integrate", 1024),
    ]


@pytest.mark.slow
def test_what_its_memory_does_not_hold_follows_in_one_stream(accelerated):
    camera = Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 2500, np.random.default_rng(7))
    small = trace_rays(camera, sky, "closed-form")
    calls = accelerated(most=1024)
    large = trace_rays(camera, sky, "closed-form")
    np.testing.assert_allclose(large.direction, small.direction, rtol=0, atol=1e-13)
    assert {size for _, size in sizes(calls)} == {1024} and len({thread for *_, thread in calls[1:]}) <= 2
    assert [name for name, _ in sizes(calls)].count("_closed_form") == 3


def test_sizes_are_few_and_fit(accelerated):
    accelerated(most=1 << 20)
    for count, size in ((1 << 16, 1 << 18), (1 << 18, 1 << 18), ((1 << 18) + 1, 1 << 20), (5_000_000, 1 << 20)):
        assert batches.closed_form_size(count, beams=True) == (size, size)
        assert batches.integrator_size(count) == (1 << 16,) * 2
    accelerated(most=1 << 16)
    assert batches.closed_form_size(1 << 20, beams=True) == (1 << 16,) * 2


def test_few_rays_stay_on_a_cpu(monkeypatch):
    """An accelerator takes as long for one ray as for many thousands."""
    gpu, cpu = SimpleNamespace(platform="gpu"), SimpleNamespace(platform="cpu")
    monkeypatch.setattr(jax, "devices", lambda platform=None: [cpu if platform == "cpu" else gpu])
    monkeypatch.setattr(batches, "small_job_device", compile_cache.small_job_device.__wrapped__)
    assert batches.device_of(1 << 16) is gpu and batches.device_of((1 << 16) - 1) is cpu
    assert not batches.on_accelerator(1000) and batches.closed_form_size(1000, beams=True) == (2048, 512)

    def without(platform=None):
        if platform:
            raise RuntimeError("Unknown backend cpu")
        return [gpu]

    monkeypatch.setattr(jax, "devices", without)
    assert batches.device_of(1) is gpu


@pytest.mark.parametrize(
    "memory, most",
    [({"bytes_limit": 80 << 30}, 1 << 20), ({"bytes_limit": 1 << 30}, 1 << 16), ({}, 1 << 18), (None, 1 << 18)],
)
def test_half_of_the_memory_is_used(monkeypatch, memory, most):
    monkeypatch.setattr(jax, "devices", lambda: [SimpleNamespace(memory_stats=lambda: memory)])
    assert batches.most_on_accelerator.__wrapped__() == most


class Other:
    """The device under another description."""

    def __init__(self, platform, device_kind, version):
        self.platform, self.device_kind, self.client = platform, device_kind, SimpleNamespace(platform_version=version)


@pytest.mark.parametrize("other", [("gpu", "cpu", "cpu"), ("cpu", "H100", "cpu"), ("cpu", "cpu", "cuda 12090")])
def test_programs_are_those_of_one_device(other, tmp_path, monkeypatch):
    """They are kept apart, and what is said to the compiler of a CPU is said of no other."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    asked, jit = [], jax.jit

    def spied(function, compiler_options):
        asked.append(compiler_options)
        return jit(function)

    monkeypatch.setattr(compile_cache.jax, "jit", spied)
    monkeypatch.setattr(compile_cache.jax, "default_device", lambda device: nullcontext())
    with own_settings():
        for name in (("cpu", "cpu", "cpu"), other):
            assert Program(operator.add)(1.0, 2.0, on=Other(*name)) == 3.0
    assert len(list((tmp_path / "kerrcaustics" / "programs").iterdir())) == 2
    assert (asked[1] is None) == (other[0] == "gpu") and asked[0] == compile_cache.OPTIONS["cpu"]


@pytest.mark.slow
def test_one_of_two_devices_takes_large_batches(tmp_path):
    """Neither a second device nor the batches of an accelerator change an answer by more than round-off."""
    code = f"""import sys; sys.path.insert(1, {str(Path(__file__).parent)!r})
import jax, numpy as np; from test_settings import answers; from kerrcaustics.beams import batches, trace
first, second = jax.devices(); usual = answers()
batches.on_accelerator = trace.on_accelerator = lambda count: True
batches.most_on_accelerator = trace.most_on_accelerator = lambda: 1024
for default in (None, second):
    jax.config.update("jax_default_device", default)
    for one, other in zip(answers(), usual, strict=True):
        np.testing.assert_array_equal(one.status, other.status)
        np.testing.assert_allclose(one.direction, other.direction, rtol=0, atol=1e-12)
"""
    two = os.environ | {"XLA_FLAGS": f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count=2"}
    subprocess.run([sys.executable, "-c", code], env=two, check=True)
