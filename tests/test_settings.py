"""A user's own settings of JAX and NumPy change no answer, and the package does not change them."""

import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest

import kerrcaustics as kc

CAMERA, HIGHER = kc.Camera(0.9, 6.0), kc.Camera(0.9, 6.0, 1.0, (0.0, 0.0, 0.4))
# Toward the hole, past it, and away from it: NaN, and rays by both formulas.
SKY = np.array([[-0.9, 0.3, 0.3], [-0.7, 0.1, 0.7], [0.3, -0.9, 0.2], [0.98, 0.1, 0.1]])
SETTINGS = {
    "jax_enable_x64": [False, True],
    "jax_debug_nans": [True],
    "jax_debug_infs": [True],
    "jax_disable_jit": [True],
    "jax_no_tracing": [True],
    "jax_check_tracer_leaks": [True],
    "jax_numpy_dtype_promotion": ["strict"],
    "jax_numpy_rank_promotion": ["raise"],
    "jax_default_matmul_precision": ["bfloat16"],
    "jax_default_device": [jax.devices("cpu")[0]],
    "jax_transfer_guard": ["disallow"],
}


def answers():
    rays = kc.trace_rays(HIGHER, SKY, end=np.array(20.0))
    return [kc.trace_beams(CAMERA, SKY), rays, kc.trace_beams(CAMERA, SKY, "integrated")]


@pytest.fixture(scope="module")
def usual():
    return answers()


@pytest.fixture(params=[(name, value) for name, values in SETTINGS.items() for value in values], ids=str)
def setting(request):
    """A setting of the user's, which holds for all threads."""
    name, value = request.param
    before = getattr(jax.config, name)
    jax.config.update(name, value)
    yield
    assert getattr(jax.config, name) == value
    jax.config.update(name, before)


def test_settings_change_no_answer(usual, setting):
    assert answers() == usual


@pytest.mark.slow
def test_a_second_device_changes_no_answer(usual, tmp_path):
    """Neither its presence nor the wish to use it: no ray is traced there."""
    code = f"""import sys; sys.path.insert(1, {str(Path(__file__).parent)!r})
import jax, pickle; from test_settings import answers
first, second = jax.devices()
found = [answers()]; jax.config.update("jax_default_device", second); found.append(answers())
open({str(tmp_path / "answers")!r}, "wb").write(pickle.dumps(found))"""
    two = os.environ | {"XLA_FLAGS": f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count=2"}
    subprocess.run([sys.executable, "-c", code], env=two, check=True)
    assert pickle.loads((tmp_path / "answers").read_bytes()) == [usual, usual]


@pytest.mark.parametrize("precise", [False, True])
def test_settings_of_a_thread_change_no_answer(usual, precise):
    with jax.enable_x64(precise), jax.debug_nans(True):
        assert answers() == usual
        with pytest.raises(ValueError, match="`sky`"):
            kc.trace_rays(CAMERA, [[np.nan, 0.0, 1.0]])
        assert (jax.config.jax_enable_x64, jax.config.jax_debug_nans) == (precise, True)


def test_many_rays_in_threads_are_precise():
    assert not jax.config.jax_enable_x64
    many = np.tile(SKY, (1 << 14, 1))
    errors = kc.trace_rays(CAMERA, many).error
    assert np.nanmax(errors) < 1e-10 and np.array_equal(errors[-4:], errors[:4], equal_nan=True)


def test_numpy_may_raise():
    with np.errstate(all="raise"):
        beams = kc.trace_beams(CAMERA, SKY)
        assert np.isnan(beams.delta_plus[0]) and np.isnan(beams.magnification[0])
        assert len(kc.caustics(CAMERA, orders=1)) == 1
        assert kc.shadow_edge(CAMERA, 50).shape == (50, 3)


def test_within_a_program_of_the_user(usual):
    @jax.jit
    def shifted(x):
        return x + kc.trace_beams(CAMERA, SKY).error[1]

    assert shifted(1.0) == np.float32(1 + usual[0].error[1])


@pytest.mark.parametrize(
    "call",
    [
        lambda x: kc.trace_rays(CAMERA, [[x, 0.0, 0.0]]),
        lambda x: kc.trace_rays(CAMERA, x * SKY),
        lambda x: kc.trace_rays(CAMERA, SKY, end=x),
        lambda x: kc.trace_rays(CAMERA, SKY, tolerance=x),
        lambda x: kc.Camera(x, 6.0),
        lambda x: kc.Camera(0.9, 6.0, velocity=(x, 0.0, 0.0)),
        lambda x: kc.star_images(CAMERA, (x, 0.0)),
        lambda x: kc.image_counts(CAMERA, [(x, 0.0)]),
        lambda x: kc.caustics(CAMERA, x),
    ],
)
def test_traced_arguments_are_refused(call):
    with pytest.raises(ValueError) as refusal:
        jax.jit(call)(0.5)
    assert re.fullmatch(r"Argument `\w+` must hold numbers, but is traced by JAX .+", refusal.value.args[0])


@pytest.mark.parametrize("number", [np.float32, np.float64, np.array, np.longdouble, jax.numpy.float32])
def test_numbers_of_any_kind(number):
    camera = kc.Camera(number(0.5), number(8.0), number(1.0))
    assert camera == kc.Camera(0.5, 8.0, 1.0) and type(camera.radius) is float
    rays = kc.trace_rays(HIGHER, SKY, tolerance=number(2.0**-20), end=number(16.0))
    assert rays == kc.trace_rays(HIGHER, SKY, tolerance=2.0**-20, end=16.0)


@pytest.mark.parametrize("tolerance", [True, "1e-10", [1e-10], np.nan, 1j, None])
def test_no_number_is_no_tolerance(tolerance):
    with pytest.raises(ValueError, match="`tolerance` must lie in"):
        kc.trace_rays(CAMERA, SKY, tolerance=tolerance)


def test_results_keep_no_array_of_the_caller():
    stars = np.array([[1.0, 2.0], [2.0, 0.5]])
    counts = kc.image_counts(CAMERA, stars, 1, find=False)
    stars[:] = 0
    assert counts.stars.tolist() == [[1.0, 2.0], [2.0, 0.5]]


def test_import_and_use_leave_settings_alone():
    code = """
import jax, numpy
before, errors = dict(jax.config.values), numpy.geterr()
import kerrcaustics
kerrcaustics.trace_rays(kerrcaustics.Camera(0.9, 6.0), [1.0, 0.0, 0.0])
assert dict(jax.config.values) == before and numpy.geterr() == errors
assert jax.numpy.ones(1).dtype == "float32"
"""
    subprocess.run([sys.executable, "-c", code], check=True)
