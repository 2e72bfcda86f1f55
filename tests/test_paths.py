"""Rays in space: places against traced ends, constants of motion, conjugate points, the trapped orbit."""

import math

import numpy as np
import pytest
from beam_equations import Event
from kerr_rays import followed

import kerrcaustics as kc
from kerrcaustics.beams.paths import RayPaths
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.frame import photon_of

CAMERA = kc.Camera(spin=0.9, radius=7.0, inclination=1.1, velocity=(0.1, -0.2, 0.3))


@pytest.fixture(scope="module")
def sky() -> np.ndarray:
    """Directions of which many pass close to the hole."""
    sky = np.random.default_rng(7).normal(size=(200, 3))
    towards = -np.asarray(CAMERA.frame().basis)[:, 0]
    sky = towards + 0.5 * sky
    return sky / np.linalg.norm(sky, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def paths(sky) -> RayPaths:
    return kc.ray_paths(CAMERA, sky, 41)


@pytest.fixture(scope="module")
def beams(sky) -> kc.Beams:
    return kc.trace_beams(CAMERA, sky)


def test_paths_end_where_rays_do(paths, beams):
    free = beams.escaped
    assert 50 < free.sum() < 150
    assert np.array_equal(paths.status, beams.status)
    assert np.all(paths.radius[free, -1] == math.inf)
    off = np.linalg.norm(paths.direction[free, -1] - beams.direction[free], axis=1)
    assert np.all(off <= paths.error[free, -1] + beams.error[free])
    assert np.all(np.abs(paths.azimuth[free, -1] - beams.azimuth[free]) < 1e-10)
    # The first place is the camera.
    assert np.all(paths.radius[:, 0] == CAMERA.radius)
    assert np.all(paths.azimuth[:, 0] == 0)


@pytest.mark.slow
def test_paths_to_a_radius_are_traced_rays(sky):
    # Also those that only pass by: they go on to infinity.
    for end in (4.0, 30.0):
        paths, rays = kc.ray_paths(CAMERA, sky, 11, end=end), kc.trace_rays(CAMERA, sky, end=end)
        assert np.array_equal(paths.status, rays.status)
        here = rays.escaped
        assert here.any() and not here.all()
        assert np.all(paths.radius[here, -1] == end)
        assert np.all(np.abs(paths.direction[here, -1] - rays.direction[here]).max(axis=1) < 1e-11)
        assert np.all(paths.radius[rays.status == kc.Status.MISSED, -1] == math.inf)
        low = paths.radius[rays.status == kc.Status.CAPTURED, -1] - kerr.horizon(CAMERA.spin)
        assert np.all(np.abs(low - 0.01) < 1e-9)


def test_places_on_the_way_are_those_of_a_slow_integration(paths, beams, sky):
    event = Event(CAMERA.spin, CAMERA.radius, CAMERA.inclination, CAMERA.fido_velocity())
    few = np.flatnonzero(beams.index == 1)[:3]
    assert len(few) == 3
    for ray in few:
        out = np.flatnonzero(np.diff(paths.radius[ray]) > 0)
        i = out[out > 3][5]
        radius = paths.radius[ray, i]
        rising = paths.radius[ray, i] > CAMERA.radius or paths.radius[ray, i + 1] > radius > paths.radius[ray].min()
        assert rising
        count = 1 if radius > CAMERA.radius else 2
        slow = followed(event, sky[ray], lambda state, radius=radius: state[0] - radius, count)
        assert slow is not None
        assert abs(slow[1] - paths.theta[ray, i]) < 1e-9
        assert abs(slow[2] - paths.azimuth[ray, i]) < 1e-9


@pytest.mark.slow
def test_radial_and_polar_equations_hold_along_a_path(sky):
    # r'^2 = R(r) in Mino time, from the places alone: a fourth-order difference.
    paths = kc.ray_paths(CAMERA, sky[:20], 801, end=20.0)
    light = photon_of(CAMERA.frame(), tuple(sky[:20].T))
    a2, a1, a0 = (np.asarray(part)[:, None] for part in radial.potential_coefficients(CAMERA.spin, light))
    b, q = (np.asarray(part)[:, None] for part in (light.b, light.q))
    tau, r, theta = paths.mino_time, paths.radius[:, 2:-2], paths.theta[:, 2:-2]
    step = tau[:, 1:2]
    good = paths.status == kc.Status.ESCAPED

    def rate(y: np.ndarray) -> np.ndarray:
        return (y[:, :-4] - 8 * y[:, 1:-3] + 8 * y[:, 3:-1] - y[:, 4:]) / (12 * step)

    potential = r**4 + a2 * r**2 + a1 * r + a0
    assert np.all((np.abs(rate(paths.radius) ** 2 - potential) / r**4)[good] < 1e-5)
    polar = q + np.cos(theta) ** 2 * (CAMERA.spin**2 - (b / np.sin(theta)) ** 2)
    assert np.all(np.abs(rate(paths.theta) ** 2 - polar)[good] < 1e-4 * (1 + np.abs(q))[good])


def test_conjugate_points_are_as_many_as_the_index_says(paths, beams):
    free = beams.escaped
    assert np.array_equal(paths.index[free], beams.index[free])
    assert set(beams.index[free]) >= {0, 1, 2}
    assert np.array_equal(np.isfinite(paths.conjugate.radius).sum(axis=1), paths.index)
    # They come in order, each before the end.
    twice = paths.index > 1
    assert np.all(paths.conjugate.mino_time[twice, 0] < paths.conjugate.mino_time[twice, 1])
    assert np.all(paths.conjugate.mino_time[twice, 1] < paths.mino_time[twice, -1])


@pytest.mark.slow
def test_at_a_conjugate_point_the_index_changes(paths, beams, sky):
    """Against the beams in closed form, to a radius just below and just above: their last arrival is the first."""
    outside = np.flatnonzero((beams.index == 1) & (paths.conjugate.radius[:, 0] > CAMERA.radius))
    assert len(outside) >= 4
    for ray in outside[:4]:
        radius = paths.conjugate.radius[ray, 0]
        below, above = (kc.trace_beams(CAMERA, sky[ray], end=radius * (1 + s)) for s in (-1e-9, 1e-9))
        assert (int(below.index), int(above.index)) == (0, 1)
        assert below.parity == -above.parity


def test_neighbouring_rays_meet_at_a_conjugate_point(paths, beams, sky):
    ray = next(ray for ray in np.flatnonzero(beams.index == 1) if paths.conjugate.radius[ray, 0] > CAMERA.radius)
    e = np.stack(kc.tangent_basis(sky[ray]))
    small = 1e-5

    def squeeze(end: float) -> float:
        """Ratio of the diameters of the beam, from rays beside it."""
        ends = kc.trace_rays(CAMERA, np.concatenate([sky[ray] + small * e, sky[ray] - small * e]), end=end).direction
        sizes = np.linalg.svd((ends[:2] - ends[2:]) / (2 * small), compute_uv=False)
        return float(sizes[1] / sizes[0])

    radius = paths.conjugate.radius[ray, 0]
    assert squeeze(radius) < 1e-7 < 1e-3 < squeeze(1.1 * radius)


@pytest.mark.slow
def test_trapped_orbit_stays_on_its_sphere():
    spin, impact = 0.95, 1.0
    orbit = kc.trapped_orbit(spin, impact, 3001, oscillations=3)
    radius, q = (float(x) for x in kerr.spherical_orbit_of_impact(spin, impact))
    assert np.all(orbit.radius == pytest.approx(radius, rel=1e-15))
    # Three periods end at the equator, going north; the turning points are those of the polar potential.
    assert orbit.theta[[0, 1000, 2000, 3000]] == pytest.approx(math.pi / 2, abs=1e-12)
    assert orbit.theta[1] < math.pi / 2
    s2 = np.sin(orbit.theta.min()) ** 2
    assert q + (1 - s2) * (spin**2 - impact**2 / s2) == pytest.approx(0, abs=1e-4)
    # dphi / dtau = b / sin^2 theta - a + a (r^2 + a^2 - a b) / Delta.
    delta = radius**2 - 2 * radius + spin**2
    rate = impact / np.sin(orbit.theta) ** 2 - spin + spin * (radius**2 + spin**2 - spin * impact) / delta
    turn = np.gradient(orbit.azimuth, orbit.mino_time)
    assert turn[1:-1] == pytest.approx(rate[1:-1], rel=3e-4)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [({"n": 1}, "n"), ({"n": 2.5}, "n"), ({"end": 0.5}, "end"), ({"end": kc.EquatorialPlane()}, "end")],
)
def test_wrong_arguments_are_named(wrong, name):
    with pytest.raises(ValueError, match=f"Argument `{name}` must"):
        kc.ray_paths(CAMERA, [-1.0, 0, 0], **wrong)


def test_no_rays_and_one_ray():
    assert kc.ray_paths(CAMERA, np.empty((0, 3)), 5).radius.shape == (0, 5)
    one = kc.ray_paths(CAMERA, [0.0, 0, 1], 5)
    assert one.radius.shape == (5,) and one.index.shape == () and one.conjugate.radius.shape == (0,)


@pytest.mark.parametrize(("arguments", "name"), [((1.0, 0.0), "spin"), ((0.5, 9.0), "impact")])
def test_wrong_orbits_are_named(arguments, name):
    with pytest.raises(ValueError, match=f"Argument `{name}` must"):
        kc.trapped_orbit(*arguments)
