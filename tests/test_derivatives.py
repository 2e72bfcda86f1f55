"""Rays as functions for JAX, and derivatives of images and caustics: against long arithmetic, and other cameras."""

import math
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import mp, mpf

import kerrcaustics as kc
from studies.truth.rays import Path, Place, follow, unit

ROUND = np.float32([0.9, 10.0, 1.0]), np.float32([-0.6, 0.5, 0.4])
RAYS = [
    (0.9, 10.0, 1.0, -0.6, 0.5, 0.4),
    (0.999, 6.03, 1.5, -0.3, 0.8, -0.4),
    (0.3, 40.0, 0.4, -0.99, 0.1, -0.12),
    (0.7, 3.0, 1.2, 0.9, 0.1, 0.2),
]
# Of the differences in long arithmetic: their own error is the square of it.
STEP = mpf("1e-12")


@pytest.fixture(autouse=True)
def long_arithmetic():
    with mp.workdps(60):
        yield


def long_end(given):
    """n' and the time, in mpmath."""
    path = Path(Place(*given[:3], "fiducial"), unit(list(given[3:])), 50, timed=True)
    follow([path], lambda *_: None)
    there = path.end()
    return [*there.direction, there.delay]


def long_slopes(given):
    """Central differences (4, 6)."""
    columns = []
    for k in range(6):
        shifted = [[mpf(x) + sign * STEP * (i == k) for i, x in enumerate(given)] for sign in (1, -1)]
        columns.append([float((p - m) / (2 * STEP)) for p, m in zip(*map(long_end, shifted), strict=True)])
    return np.array(columns).T


def everything(*given):
    """n' and the time."""
    return jnp.append(kc.functional.direction(*given), kc.functional.travel_time(*given))


@pytest.mark.slow
@pytest.mark.parametrize("velocity", ["fiducial", "static", (0.1, 0.2, -0.3)], ids=str)
def test_direction_and_time_are_those_of_rays(velocity):
    place, sky = (0.9, 10.0, 1.0), np.array([[-0.6, 0.5, 0.4], [0.1, -0.8, 0.3], [-1.0, 0.01, 0.0]])
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    rays = kc.trace_rays(kc.Camera(*place, velocity), sky, time=True)
    found = np.asarray(kc.functional.direction(*place, 3 * sky, velocity))
    time = np.asarray(kc.functional.travel_time(*place, sky, velocity))
    seen = rays.escaped
    assert np.isnan(found[~seen]).all() and np.isnan(time[~seen]).all()
    assert np.abs(found - rays.direction)[seen].max() < 1e-13
    assert np.abs(time - rays.time)[seen].max() < 1e-12
    assert seen[:2].all() and (velocity != "fiducial" or not seen[2])


@pytest.mark.slow
def test_float64_under_any_settings():
    place, sky = ROUND
    true = np.asarray(kc.functional.direction(*map(float, place), sky.astype(float)))
    compiled = jax.jit(kc.functional.direction)(*place, sky)
    many = jax.vmap(partial(kc.functional.direction, *place))(np.stack([sky, sky]))
    assert compiled.dtype == many.dtype == np.float64
    assert np.abs(np.asarray(compiled) - true).max() < 1e-15
    assert np.abs(np.asarray(many) - true).max() < 1e-15
    with jax.debug_nans(True), jax.numpy_rank_promotion("raise"), jax.numpy_dtype_promotion("strict"):
        assert np.array_equal(kc.functional.direction(*map(float, place), sky.astype(float)), true)


@pytest.mark.parametrize("sky", [0.5, [1.0, 0.0]], ids=str)
def test_sky_without_three_components_is_refused(sky):
    with pytest.raises(ValueError, match="Argument `sky` must have the shape"):
        kc.functional.direction(0.9, 10.0, 1.0, sky)


@pytest.mark.parametrize(
    ("place", "name"),
    [
        ((1.2, 10.0, 1.0), "spin"),
        ((0.9, 1.4, 1.0), "radius"),
        ((0.9, math.nan, 1.0), "radius"),
        ((0, 9, 4), "inclination"),
    ],
)
def test_places_are_refused_as_those_of_cameras(place, name):
    with pytest.raises(ValueError, match=f"Argument `{name}` must"):
        kc.functional.direction(*place, [-0.6, 0.5, 0.4])


@pytest.mark.parametrize("velocity", ["fast", (1.0, 0.0, 0.1), (0.1, 0.2)], ids=str)
def test_velocities_are_refused_as_those_of_cameras(velocity):
    with pytest.raises(ValueError, match="Argument `velocity` must"):
        kc.functional.direction(0.9, 10.0, 1.0, [-0.6, 0.5, 0.4], velocity)


@pytest.mark.slow
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_derivatives_of_rays_against_long_arithmetic(mode):
    with jax.enable_x64(True):
        slopes = jax.jit(jax.vmap(mode(lambda x: everything(x[0], x[1], x[2], x[3:]))))(np.array(RAYS))
    for given, found in zip(RAYS, np.asarray(slopes), strict=True):
        true = long_slopes(given)
        assert np.abs(found - true).max() < 1e-12 * np.abs(true).max()


@pytest.mark.slow
def test_second_derivatives_and_their_order():
    def one(x):
        return kc.functional.direction(x[0], x[1], x[2], x[3:])[2]

    with jax.enable_x64(True):
        x, step = jnp.array(RAYS[0]), 1e-4
        slope, curved = jax.jit(jax.grad(one)), jax.jit(jax.hessian(one))(x)
        for direction in np.eye(6):
            change = (slope(x + step * direction) - slope(x - step * direction)) / (2 * step)
            assert np.abs(curved @ direction - change).max() < 1e-6 * np.abs(curved).max()


def long_image(given, images, slopes):
    """One image's place, ln magnification and time in long arithmetic, by Newton's method with a fixed slope.

    given: spin, radius, inclination, theta, phi as mpf; images: N; slopes, dn'/dN there.
    """
    theta, phi = given[3:]
    star = [mp.sin(theta) * mp.cos(phi), mp.sin(theta) * mp.sin(phi), mp.cos(theta)]
    inverse = mp.matrix(np.linalg.pinv(slopes, rcond=1e-8).tolist())
    sky = unit([mpf(x) for x in images])
    for _ in range(4):
        left = [s - n for s, n in zip(star, long_end([*given[:3], *sky])[:3], strict=True)]
        sky = unit([n + d for n, d in zip(sky, inverse * mp.matrix(left), strict=True)])
    step = mpf("1e-15")
    columns = []
    for k in range(3):
        ends = [long_end([*given[:3], *(x + s * step * (i == k) for i, x in enumerate(sky))]) for s in (1, -1)]
        columns.append([(p - m) / (2 * step) for p, m in zip(*(e[:3] for e in ends), strict=True)])
    x, y, z = columns
    n = long_end([*given[:3], *sky])

    def crossed(p, q):
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    cofactors = zip(sky, (crossed(y, z), crossed(z, x), crossed(x, y)), strict=True)
    determinant = sum(s * sum(p * q for p, q in zip(n[:3], c, strict=True)) for s, c in cofactors)
    return [*sky, 1 / abs(determinant), n[3]]


@pytest.mark.slow
@pytest.mark.parametrize(("place", "star"), [((0.9, 10.0, 1.0), (1.4, 2.9)), ((0.6, 6.0, 1.3), (1.5, 0.4))], ids=str)
def test_derivatives_of_images_against_long_arithmetic(place, star):
    camera = kc.Camera(*place, "fiducial")
    images = kc.star_images(camera, star, 1)
    found = kc.image_derivatives(camera, images)
    beams = kc.trace_beams(camera, images.sky)
    step = mpf("1e-9")
    for i, sky in enumerate(images.sky):
        basis = np.stack(kc.tangent_basis(sky), axis=-1)
        n = beams.direction[i]
        sine = np.hypot(n[0], n[1])
        there = np.array([[n[2] * n[0] / sine, n[2] * n[1] / sine, -sine], [-n[1] / sine, n[0] / sine, 0]]).T
        slopes = there @ beams.jacobian[i] @ basis.T
        for k in range(5):
            ends = []
            for sign in (1, -1):
                given = [mpf(x) + sign * step * (j == k) for j, x in enumerate((*place, *star))]
                ends.append(long_image(given, sky, slopes))
            true = np.array([float((p - m) / (2 * step)) for p, m in zip(*ends, strict=True)])
            mine = np.array([*found.sky[i, :, k], found.magnification[i, k], found.time[i, k]])
            scale = np.array([*[np.abs(true[:3]).max()] * 3, abs(true[3]), abs(true[4])])
            assert (np.abs(mine - true) < 1e-9 * scale).all()
    assert found.error.max() < 1e-9


@pytest.mark.slow
def test_derivatives_of_caustics_against_other_cameras():
    place, step = np.array([0.9, 10.0, 1.0]), 1e-3

    def features(change):
        found = kc.caustics(kc.Camera(*(place + change)), 2)
        extents = [[c.theta_min, c.theta_max, c.phi_min, c.phi_max] for c in found]
        return [np.append(e, [cusp.celestial for cusp in c.cusps]) for e, c in zip(extents, found, strict=True)]

    def difference(change):
        pairs = zip(features(change), features(-change), strict=True)
        return [(p - m) / (2 * step) for p, m in pairs]

    slopes = kc.caustic_derivatives(kc.Camera(*place), 2)
    for k, axis in enumerate(np.eye(3)):
        wide, close = difference(step * axis), [2 * d for d in difference(step / 2 * axis)]
        for one, w, c in zip(slopes, wide, close, strict=True):
            extents = [one.theta_min, one.theta_max, one.phi_min, one.phi_max]
            mine = np.append([e[k] for e in extents], one.cusps[:, :, k])
            assert np.abs(mine - (4 * c - w) / 3).max() < 3e-9 * max(np.abs(mine).max(), 0.1)
            assert one.error < 1e-10
            assert math.isclose(one.phi_extent[k], one.phi_max[k] - one.phi_min[k])


def test_derivatives_take_images_alone():
    with pytest.raises(ValueError, match="Argument `images` must be StarImages, but is tuple"):
        kc.image_derivatives(kc.Camera(0.9, 10.0), (1.4, 2.9))


def test_derivatives_of_stars_at_a_finite_radius_are_refused():
    camera = kc.Camera(0.9, 10.0)
    near = replace(kc.star_images(camera, (1.4, 2.9), max_index=0), surface=kc.Sphere(50.0))
    with pytest.raises(ValueError, match="`images` must be of a star at infinity, but it is on the sphere r = 50"):
        kc.image_derivatives(camera, near)
