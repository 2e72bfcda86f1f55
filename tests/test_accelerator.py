"""Kernels as a GPU gets them, interpreted on whatever device there is: the twin of the machine code."""

import threading
from types import SimpleNamespace

import jax
import jax.export
import numpy as np
import pytest
from marks import few
from random_rays import random_sky

from kerrcaustics import Camera, EquatorialPlane, trace_beams, trace_rays
from kerrcaustics.beams import accelerator
from kerrcaustics.beams.kernels import device
from kerrcaustics.beams.kernels.divisions import with_merged_divisions
from kerrcaustics.beams.kernels.evaluation import evaluated
from kerrcaustics.beams.kernels.lowering import lowered
from kerrcaustics.beams.kernels.programs import graph_of
from kerrcaustics.spacetime.settings import own_settings, settings_of_programs


@pytest.fixture
def accelerated(monkeypatch):
    """Let calls be those of a GPU, with so many rays at most in each; the calls: name, rays, thread."""
    calls, made = [], device.device_kernel

    def spied(name):
        def on_rays(numbers, columns):
            calls.append((name, len(columns[0]), threading.current_thread()))
            return made(name).on_rays(numbers, columns)

        return SimpleNamespace(on_rays=on_rays)

    def begin(most=1 << 12):
        for place in ("kerrcaustics.beams.calls", "kerrcaustics.beams.trace"):
            monkeypatch.setattr(f"{place}.on_accelerator", lambda count: True)
        monkeypatch.setattr("kerrcaustics.beams.trace.MOST_RAYS", most)
        monkeypatch.setattr(device, "FEWEST", 1 << 11)
        monkeypatch.setattr(device, "device_kernel", spied)
        return calls

    return begin


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
def test_beams_agree_with_those_of_machine_code(accelerated, end):
    """Both engines: rays of small k and others that the closed form does not hold for are integrated."""
    camera = Camera(0.999, 6.03)
    sky = random_sky(camera, 1500, np.random.default_rng(6))
    ours = [trace_beams(camera, sky, end=end), trace_beams(camera, sky[:700], "integrated", end=end)]
    calls = accelerated()
    assert_alike(trace_beams(camera, sky, end=end), ours[0])
    calls.clear()
    assert_alike(trace_beams(camera, sky[:700], "integrated", end=end), ours[1])
    assert [(name.partition("_")[0], size) for name, size, _ in calls[:2]] == [("survey", 700), ("integrated", 700)]


@pytest.mark.slow
def test_more_rays_than_one_call_takes_follow_in_one_stream(accelerated):
    camera = Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 2500, np.random.default_rng(7))
    ours = trace_rays(camera, sky, "closed-form")
    calls = accelerated(most=1024)
    theirs = trace_rays(camera, sky, "closed-form")
    away = np.linalg.norm(theirs.direction - ours.direction, axis=1)
    assert np.nanmax(away / ours.error) < 2
    rays = [(size, thread) for name, size, thread in calls if name == "rays_sky"]
    assert [size for size, _ in rays] == [1024, 1024, 452] and len({thread for _, thread in rays[1:]}) == 1


_EXACT = slice(4, 7)
"""Outputs of `halved` whose zeros have their signs."""


def halved(x, y):
    """An odd one of everything that a program on a GPU writes in its own way."""
    turns = jax.lax.while_loop(lambda state: state[0] > 1, lambda state: (state[0] / 2, state[1] + 1), (abs(x), 0.0))
    flags = (x > y) ^ jax.numpy.isfinite(y)
    extremes = jax.numpy.maximum(x, y), jax.numpy.minimum(x, y)
    return *turns, *extremes, jax.numpy.round(x), jax.numpy.copysign(x, y), jax.numpy.sign(x), flags, x % 3.0


def test_operations_are_those_of_numpy():
    """NaN, infinities and both zeros too; XLA on a CPU has no subnormal numbers."""
    special = [np.nan, np.inf, -np.inf, 0.0, -0.0, 0.5, -1.5, 2.5, 1e300, -4503599627370497.5, 7.0]
    x, y = (values.ravel() for values in np.meshgrid(special, special))
    size = device.FEWEST >> 9
    x, y = np.resize(x[np.isfinite(x)], size), np.resize(y[np.isfinite(x)], size)
    function = lowered(halved, (0.5, 0.5), (True, True))
    program = device.compiled(function, size)
    with own_settings():
        ours = jax.device_get(program(np.zeros(1), x, y))
    theirs = evaluated(function, [], [x, y])
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one, other)
    # Which of two zeros is the greater is open.
    for one, other in zip(ours[_EXACT], theirs[_EXACT], strict=True):
        assert np.array_equal(np.signbit(one)[~np.isnan(one)], np.signbit(other)[~np.isnan(other)])


@pytest.mark.parametrize("name", [None, *few(["rays_sky", "integrated_beams_time_plane", "beams_time_sphere"], ())])
def test_programs_become_those_of_a_gpu(monkeypatch, name):
    """As far as that goes without one: Triton's own text is made, in doubles, with no operation that it lacks."""
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    whole = graph_of(name)[0] if name else lowered(halved, (0.5, 0.5), (True, True))
    function, rays = with_merged_divisions(whole), 1024
    unsafe = [jax.export.DisabledSafetyCheck.custom_call("__gpu$xla.gpu.triton")]
    with settings_of_programs():
        exported = jax.export.export(
            jax.jit(device.program_of(function, rays)), platforms=["cuda"], disabled_checks=unsafe
        )
        text = exported(*device.arguments_of(function, rays)).mlir_module()
    assert text.count("custom_call @__gpu$xla.gpu.triton") == 1 and f"grid_x = {rays // 128}" in text
    assert "tensor<1024xf64>" in text and "f32" not in text


def test_programs_with_tables_are_those_of_the_processor():
    with pytest.raises(NotImplementedError, match="no program of a GPU for swatches, which looks up"):
        device.DeviceKernel("swatches")


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
