"""Numbers that JAX traces are refused by name: converted like others, they would leave their derivatives behind."""

import math

import jax
import numpy as np
import pytest
from marks import few
from offenders import for_each
from public import PUBLIC
from public_calls import CALLS, is_numeric

import kerrcaustics as kc

# Of results, files and objects, which hold no numbers of their own.
OTHERS = (
    "CelestialSphere Sphere "
    "Beams Caustic Emission Footprint LineProfile Orbit Rays SceneFile Sky StarImages Status "
    "crossings_of_line event_derivatives explore hipparcos image_derivatives load merged_catalogues "
    "read_scene record save save_sky sweep tangent_basis to_xarray trace_view tycho2"
)


def _transformed(how, function, value):
    {
        "grad": lambda: jax.grad(function)(value),
        "jvp": lambda: jax.jvp(function, (value,), (value,)),
        "jit": lambda: jax.jit(function)(value),
        "vmap": lambda: jax.vmap(function)(value[None]),
    }[how]()


@pytest.mark.parametrize("how", few(("grad", "jvp", "jit", "vmap"), ("grad",)))
@for_each("function", "arguments", rows=CALLS)
def test_traced_numbers_are_refused_by_name(function, arguments, how):
    for name in [name for name, value in arguments.items() if is_numeric(value)]:
        words = rf"^Argument `{name}` must hold numbers, but is traced by JAX .+ caustic_derivatives and image_der"

        def call(traced, name=name):
            function(**{**arguments, name: traced})
            return 0.0 * traced.sum()

        with pytest.raises(ValueError, match=words) as caught:
            _transformed(how, call, np.asarray(arguments[name], np.float32))
        assert "kerrcaustics.functional" in str(caught.value) and "\n" not in str(caught.value)


def test_every_public_function_is_tried():
    public = {name for name, one in PUBLIC.items() if callable(one)}
    assert public == {function.__name__ for function, _ in CALLS} | set(OTHERS.split())


def test_derivatives_do_not_vanish_in_silence():
    """By radius, of the extreme of a caustic: refused, and not 0."""

    def top(radius):
        return kc.caustics(kc.Camera(0.9, radius, 1.2), orders=1)[0].theta_max

    for derivative in (jax.grad(top), lambda x: jax.jvp(top, (x,), (1.0,)), jax.jit(top)):
        with pytest.raises(ValueError, match="Argument `radius` must hold numbers, but is traced by JAX"):
            derivative(10.0)


@pytest.mark.slow
def test_moments_of_tracks_are_not_traced():
    found = kc.star_tracks(kc.Camera(0.9, 10.0), math.radians(70), 0)
    for method in (found.azimuth_at, found.images_at):
        with pytest.raises(ValueError, match="Argument `time` must hold numbers, but is traced by JAX"):
            jax.grad(method)(1.0)


def test_lists_may_be_empty():
    from kerrcaustics.functional.traced_arguments import flattened

    assert flattened(np.zeros((0, 3)), (2,), 2).shape == (2, 0, 3)
