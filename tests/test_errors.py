"""Is the reported error honest, and has the integrator the order that it claims?"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from beam_gaps import columns_in_space
from marks import few
from random_rays import outside_edge, random_camera, random_sky

from kerrcaustics.beams.beam import Beams, Rays
from kerrcaustics.beams.integrator import equations, integrated
from kerrcaustics.beams.integrator.nystroem import nystroem_step
from kerrcaustics.beams.trace import trace_beams, trace_rays
from kerrcaustics.beams.traced_ends import TracedSky
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.shadow import shadow_edge

pytestmark = pytest.mark.usefixtures("compiled_code")


def direction_error(ends: Rays, exact: Rays) -> np.ndarray:
    return np.linalg.norm(ends.direction - exact.direction, axis=-1)[exact.escaped]


def jacobian_error(beams: Beams, exact: Beams) -> np.ndarray:
    size = np.linalg.norm(columns_in_space(beams) - columns_in_space(exact), axis=(1, 2))
    return (size / exact.delta_plus)[exact.escaped]


def assert_honest(camera: Camera, sky: np.ndarray) -> None:
    """Compare tolerance 1e-10 with 1e-14: errors within ten times what was reported, integers equal."""
    beams, rays = trace_beams(camera, sky), trace_rays(camera, sky)
    exact = trace_beams(camera, sky, tolerance=1e-14)
    escaped = exact.escaped
    assert np.array_equal(beams.escaped, escaped)
    assert np.array_equal(rays.escaped, escaped)
    for ends in (beams, rays):
        assert np.all(direction_error(ends, exact) <= 10 * ends.error[escaped])
    assert np.all(jacobian_error(beams, exact) <= 10 * beams.diameter_error[escaped])
    assert np.array_equal(beams.index[escaped], exact.index[escaped])
    assert np.array_equal(beams.crossings[escaped], exact.crossings[escaped])
    assert np.array_equal(beams.parity[escaped], (-1.0) ** beams.index[escaped])


def test_honest_on_random_cameras():
    rng = np.random.default_rng(1963)
    for _ in range(12):
        camera = random_camera(rng)
        assert_honest(camera, random_sky(camera, 256, rng))


@pytest.mark.slow
def test_honest_on_many_random_cameras():
    rng = np.random.default_rng(1972)
    for _ in range(100):
        camera = random_camera(rng)
        assert_honest(camera, random_sky(camera, 512, rng))


def test_captured_rays_hold_nan_and_escaping_ones_do_not():
    rng = np.random.default_rng(5)
    camera = Camera(0.9, 5.0, 1.0, "fiducial")
    beams = trace_beams(camera, random_sky(camera, 512, rng))
    assert 0 < beams.escaped.sum() < 512
    for values in (beams.direction, beams.azimuth, beams.error, beams.jacobian, beams.redshift):
        finite = np.isfinite(values).reshape(512, -1)
        assert finite[beams.escaped].all()
        assert not finite[~beams.escaped].any()


def paths_in_equal_steps(camera: Camera, n: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """End (u, x, y, z, psi) (n, 5) of one ray after three quarters of its Mino time, in `counts` steps."""
    sky = tuple(jnp.full(len(counts), part) for part in n)
    constants, path, light = integrated.start(camera.frame(), sky)
    aim = integrated.aim_at(TracedSky(), camera.frame(), light)
    h = 0.75 * aim.mino_time / counts
    paths, variations = integrated.with_variations(camera.frame(), sky, path)
    step = jax.jit(partial(nystroem_step, partial(integrated.all_rates, camera.spin, constants, variations)))
    for i in range(max(counts)):
        paths, _ = step(paths, jnp.where(i < counts, h, 0.0))
    return np.stack([*paths[0].position, paths[0].psi], axis=-1)


@pytest.mark.slow
def test_order_of_the_integrator():
    """Fit the slope of error against step: the claim is order 12."""
    counts = np.array([4, 5, 6, 7, 8, 40])
    camera = Camera(0.9, 6.0, 1.1, "fiducial")
    sky = outside_edge(camera, np.array([2.0]), np.array([0.003]))[0]
    ends = paths_in_equal_steps(camera, sky, counts)
    errors = np.linalg.norm(ends[:-1] - ends[-1], axis=1)
    # Above round-off, which is 2e-14 here.
    assert errors[-1] > 1e-13
    slope = np.polyfit(np.log(1 / counts[:-1]), np.log(errors), 1)[0]
    assert 11 <= slope <= 14


def test_variation_of_the_rates_is_their_derivative():
    """The derivative that is written out for speed equals the automatic one."""
    rng = np.random.default_rng(3)
    constants = equations.Constants(*rng.normal(size=5))
    position = tuple(rng.uniform(0.1, 0.5, size=4))
    change = (equations.Constants(*rng.normal(size=5)), tuple(rng.normal(size=4)))
    _, expected = jax.jvp(lambda c, p: equations.ray_rates(0.8, c, p), (constants, position), change)
    accelerations, psi_rates = equations.rates_with_variation(0.8, constants, position, [change])
    np.testing.assert_allclose(accelerations[1], expected[0], rtol=1e-12)
    np.testing.assert_allclose(psi_rates[1], expected[1], rtol=1e-12)


SPINS = (0.0, 1e-12, 1e-6, 0.5, 0.999, 1 - 1e-6)
INCLINATIONS = (0.0, 1e-9, 1e-3, 0.5, np.pi / 2, np.pi)


def extreme_sky(camera: Camera) -> np.ndarray:
    """The shadow edge itself, random directions, and the radial and transverse ones."""
    random = np.random.default_rng(1).normal(size=(100, 3))
    axes = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    return np.concatenate([shadow_edge(camera, 64), random, axes])


@pytest.mark.parametrize("spin", SPINS)
@pytest.mark.parametrize("radius", few((None, 1.01, 6.0, 1e3, 1e9), (None,)))
def test_extreme_cameras_give_finite_answers(spin, radius):
    """Cameras at the horizon, on the axis, very far away: no NaN, no false parity, no unexplained error."""
    horizon = kerr.horizon(spin)
    for inclination in INCLINATIONS:
        camera = Camera(
            spin, horizon * (1 + 1e-6) if radius is None else max(radius, horizon * 1.01), inclination, "fiducial"
        )
        beams = trace_beams(camera, extreme_sky(camera))
        for values in (beams.direction, beams.azimuth, beams.error, beams.jacobian, beams.redshift):
            assert np.isfinite(values[beams.escaped]).all()
        known = beams.escaped & (beams.diameter_error < 0.1)
        assert (beams.parity[known] == (-1.0) ** beams.index[known]).all()
        # Only directions on the shadow edge itself, and nearly extremal holes from close by, may cost digits.
        if spin < 1 - 1e-4:
            assert (beams.error[64:][beams.escaped[64:]] < 1e-6).all()
