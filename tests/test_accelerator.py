"""The formulas as a GPU gets them, compiled by JAX on whatever device there is: the twin of the kernels."""

import os
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from random_rays import random_sky

from kerrcaustics import Camera, EquatorialPlane, trace_beams, trace_rays
from kerrcaustics.beams import accelerator


@pytest.fixture
def accelerated(monkeypatch):
    """Let calls be those of an accelerator, for as many rays as its memory holds; the calls: name, rays, thread."""
    calls, compiled = [], accelerator.compiled

    def spied(function, static):
        made = compiled(function, static)

        def call(frame, sky, *others):
            name = "short" if dict(static).get("short") else function.__name__
            calls.append((name, len(sky[0]), threading.current_thread()))
            return made(frame, sky, *others)

        return call

    def begin(most=1 << 12, integrated=1 << 10):
        for place in ("kerrcaustics.beams.accelerator", "kerrcaustics.beams.trace"):
            monkeypatch.setattr(f"{place}.on_accelerator", lambda count: True)
            monkeypatch.setattr(f"{place}.most_on_accelerator", lambda: most)
        monkeypatch.setattr(accelerator, "MOST_INTEGRATED", integrated)
        monkeypatch.setattr(accelerator, "compiled", spied)
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
@pytest.mark.parametrize("end", [np.inf, 30.0, EquatorialPlane(1)])
def test_beams_agree_with_those_of_kernels(accelerated, end):
    """Both engines: rays of small k and others that the closed form does not hold for are integrated."""
    camera = Camera(0.999, 6.03)
    sky = random_sky(camera, 1500, np.random.default_rng(6))
    ours = [trace_beams(camera, sky, end=end), trace_beams(camera, sky[:700], "integrated", end=end)]
    calls = accelerated()
    assert_alike(trace_beams(camera, sky, end=end), ours[0])
    assert {size for name, size in sizes(calls) if name == "trace"} <= {4096, 1024}
    calls.clear()
    assert_alike(trace_beams(camera, sky[:700], "integrated", end=end), ours[1])
    assert sizes(calls)[:2] == [("survey", 4096), ("trace", 1024)]


@pytest.mark.slow
def test_what_its_memory_does_not_hold_follows_in_one_stream(accelerated):
    camera = Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 2500, np.random.default_rng(7))
    ours = trace_rays(camera, sky, "closed-form")
    calls = accelerated(most=1024)
    theirs = trace_rays(camera, sky, "closed-form")
    away = np.linalg.norm(theirs.direction - ours.direction, axis=1)
    assert np.nanmax(away / ours.error) < 2
    assert {size for _, size in sizes(calls)} == {1024} and len({thread for *_, thread in calls[1:]}) <= 2
    assert [name for name, _ in sizes(calls)].count("trace") >= 3


def test_few_rays_stay_on_the_processor(monkeypatch):
    """An accelerator takes as long for one ray as for many thousands."""
    monkeypatch.setattr(accelerator, "name_of_device", lambda: "gpu: any")
    assert accelerator.on_accelerator(1 << 16) and not accelerator.on_accelerator((1 << 16) - 1)
    monkeypatch.setattr(accelerator, "name_of_device", lambda: None)
    assert not accelerator.on_accelerator(1 << 20)


@pytest.mark.parametrize("platform", ["cpu", "gpu"])
def test_a_device_is_looked_for_only_where_jax_has_a_plug_in(monkeypatch, platform):
    asked = []
    device = SimpleNamespace(platform=platform, device_kind="H100")
    monkeypatch.setattr(jax, "devices", lambda: asked.append(1) or [device])
    monkeypatch.setattr(accelerator, "find_spec", lambda name: None)
    assert accelerator.name_of_device.__wrapped__() is None and not asked
    monkeypatch.setattr(accelerator, "find_spec", lambda name: name)
    assert accelerator.name_of_device.__wrapped__() == (None if platform == "cpu" else "gpu: H100")


@pytest.mark.parametrize(
    "memory, most",
    [({"bytes_limit": 80 << 30}, 1 << 20), ({"bytes_limit": 1 << 30}, 1 << 16), ({}, 1 << 18), (None, 1 << 18)],
)
def test_half_of_the_memory_is_used(monkeypatch, memory, most):
    monkeypatch.setattr(jax, "devices", lambda: [SimpleNamespace(memory_stats=lambda: memory)])
    assert accelerator.most_on_accelerator.__wrapped__() == most


@pytest.mark.slow
def test_one_of_two_devices_takes_large_calls():
    """Neither a second device nor the calls of an accelerator change an answer by more than round-off."""
    code = f"""import sys; sys.path.insert(1, {str(Path(__file__).parent)!r})
import jax, numpy as np; from test_settings import answers; from kerrcaustics.beams import accelerator, trace
first, second = jax.devices(); usual = answers()
accelerator.on_accelerator = trace.on_accelerator = lambda count: True
accelerator.most_on_accelerator = trace.most_on_accelerator = lambda: 1024
accelerator.MOST_INTEGRATED = 1024
for default in (None, second):
    jax.config.update("jax_default_device", default)
    for one, other in zip(answers(), usual, strict=True):
        np.testing.assert_array_equal(one.status, other.status)
        np.testing.assert_allclose(one.direction, other.direction, rtol=0, atol=1e-12)
"""
    two = os.environ | {"XLA_FLAGS": f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count=2"}
    subprocess.run([sys.executable, "-c", code], env=two, check=True)
