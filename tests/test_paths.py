"""Rays in space: places and times against traced ends and slow integrations, conjugate points, the trapped orbit."""

import math

import numpy as np
import pytest
from beam_equations import Event
from kerr_rays import ACCURACY, followed, forward_rates
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import kerrcaustics as kc
from kerrcaustics.beams.paths import RayPaths
from kerrcaustics.scripts import STUDIES
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import photon_of, potential_coefficients

TRUTH_CAMERA, TRUE_RAYS = (STUDIES.module(f"truth.{name}") for name in ("camera", "rays"))
CAMERA = kc.Camera(spin=0.9, radius=7.0, inclination=1.1, velocity=(0.1, -0.2, 0.3))
OBSERVERS = {radius: kc.Observer(spin=0.9, inclination=1.1, radius=radius) for radius in (1e3, math.inf)}
# Places (alpha, beta), many of them close to the shadow.
SCREEN = 7 * np.random.default_rng(1).normal(size=(200, 2))
ENDS = (math.inf, 30.0, 5.0, kc.EquatorialPlane(1), kc.EquatorialPlane(2))


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


# Spin, radius in parts of the horizon's, inclination: far out, and next to horizons, where psi turns fast.
BESIDE = [(0.9, 6.0, 1.2), (0.713, 1.002, math.pi / 2), (0.998, 1.01, 1e-3), (1 - 1.2e-5, 1.01, math.pi / 2)]


@pytest.mark.parametrize(("spin", "part", "inclination"), BESIDE)
def test_places_are_within_their_errors_of_those_in_long_arithmetic(spin, part, inclination):
    radius = float(kerr.horizon(spin)) * part
    sky = np.random.default_rng(4).normal(size=(6, 3))
    sky /= np.linalg.norm(sky, axis=1)[:, None]
    paths = kc.ray_paths(kc.Camera(spin, radius, inclination, "fiducial"), sky, 8)
    place, known = TRUTH_CAMERA.Place(spin, radius, inclination, "fiducial"), np.flatnonzero(paths.index >= 0)
    assert len(known) > 1
    for ray in known:
        # The last place is where the ray ends, not where it is at that time.
        there = TRUE_RAYS.places(place, sky[ray].tolist(), paths.mino_time[ray, 1:-1].tolist())
        for k, (u, direction) in enumerate(there, start=1):
            off = np.linalg.norm(np.array(direction, float) - paths.direction[ray, k])
            # Rounding of the directions themselves.
            assert off < paths.error[ray, k] + 4e-16 < 1e-9
            assert abs(float(u) - 1 / paths.radius[ray, k]) < paths.error[ray, k] + 4e-16


@pytest.mark.slow
@pytest.mark.parametrize("viewer", [CAMERA, *OBSERVERS.values()], ids=["camera", "finite", "infinity"])
@pytest.mark.parametrize("end", ENDS, ids=str)
def test_paths_end_where_and_when_rays_do(viewer, end, sky):
    seen = sky if viewer is CAMERA else SCREEN
    paths, rays = kc.ray_paths(viewer, seen, 41, end=end), kc.trace_beams(viewer, seen, end=end, time=True)
    certain = rays.status != kc.Status.INACCURATE
    assert np.array_equal(paths.status[certain], rays.status[certain]) and certain.mean() > 0.95
    here = rays.escaped & certain
    assert here.sum() > 40
    error = paths.error[:, -1] + rays.error
    assert np.all(np.linalg.norm(paths.direction[:, -1] - rays.direction, axis=1)[here] <= error[here])
    assert np.all(np.abs(paths.azimuth[:, -1] - rays.azimuth)[here] <= 3 * error[here])
    assert np.all(np.abs(1 / paths.radius[:, -1] - 1 / rays.radius)[here] <= error[here])
    late = paths.time_error[:, -1] + rays.time_error
    assert np.all(np.abs(paths.time[:, -1] - rays.time)[here] <= late[here])
    # Round-off, and no more: three rays of four pass the hole far from the shadow edge.
    assert np.median(paths.time_error[here, -1]) < 1e-11 and np.median(paths.error[here, -1]) < 1e-12
    assert np.array_equal(paths.index[here], rays.index[here])


def _paths_from(radius: float, **settings) -> RayPaths:
    return kc.ray_paths(OBSERVERS.get(radius) or kc.Observer(spin=0.9, inclination=1.1, radius=radius), **settings)


@pytest.mark.slow
@pytest.mark.parametrize("radius", OBSERVERS)
def test_paths_of_observers_are_those_of_a_slow_integration(radius):
    """From a place at 50 M on, with b and q of the screen: r, theta, phi and t in Boyer-Lindquist coordinates."""
    viewer = OBSERVERS[radius]
    spin, (s, c) = viewer.spin, (math.sin(viewer.inclination), math.cos(viewer.inclination))
    screen = np.array([[6.0, 3.0], [-7.5, 1.0], [0.5, -6.5]])
    paths = kc.ray_paths(viewer, screen, 60, start=50.0)
    assert np.all(paths.radius[:, 0] == 50) and np.all(paths.status == kc.Status.ESCAPED)
    light = photon_of(viewer.frame(), tuple(viewer.directions(screen).T))
    if radius == math.inf:
        alpha, beta = screen.T
        assert light.b == pytest.approx(-alpha * s, rel=1e-13)
        assert light.q == pytest.approx(beta**2 + (alpha**2 - spin**2) * c**2, rel=1e-13)
    for ray in range(len(screen)):
        b, q = light.b[ray], light.q[ray]
        r, theta, phi, time = (getattr(paths, name)[ray] for name in ("radius", "theta", "azimuth", "time"))
        delta, lapsed = r[0] ** 2 - 2 * r[0] + spin**2, r[0] ** 2 + spin**2 - spin * b
        p_r = math.sqrt(lapsed**2 - delta * (q + (b - spin) ** 2)) / delta
        p_theta = math.sqrt(q + math.cos(theta[0]) ** 2 * (spin**2 - (b / math.sin(theta[0])) ** 2))
        # Light moves outward to the observer; its theta falls where that of the path backward grows.
        start = np.array([r[0], theta[0], phi[0], 0.0, p_r, math.copysign(p_theta, theta[0] - theta[1])])
        taken = paths.mino_time[ray, :-1] - paths.mino_time[ray, 0]
        slow = solve_ivp(lambda _, y, b=b: -forward_rates(spin, b, y), (0, taken[-1]), start, t_eval=taken, **ACCURACY)
        near = r[:-1] < 200
        assert near.sum() > 40
        error = (paths.error[ray, :-1] + paths.error[ray, 0])[near]
        # The integration itself keeps some 1e-11, and is about as far off in r^2 / r as in r.
        for number, own in ((1, theta), (2, phi)):
            assert np.all(np.abs(slow.y[number] - own[:-1])[near] < error + 3e-10)
        assert np.all(np.abs(1 / slow.y[0] - 1 / r[:-1])[near] < error + 3e-10)
        late = np.abs(-slow.y[3] - (time - time[0])[:-1]) - np.abs(slow.y[0] - r[:-1])
        assert np.all(late[near] < paths.time_error[ray, :-1][near] + 3e-9)


def test_azimuth_and_time_continue_from_infinity():
    """No spin, in the equatorial plane: the integrals from infinity to a place on the way in, and past the hole."""
    impact, spin = 8.0, 0.0
    viewer = kc.Observer(spin=spin, inclination=math.pi / 2)
    paths = kc.ray_paths(viewer, [-impact, 0.0], 40, start=1e4)
    turn = brentq(lambda u: 1 - impact**2 * u * u * (1 - 2 * u), 1e-6, 0.3)
    inward = np.arange(40) <= np.argmin(paths.radius)

    def angle(u: float) -> float:
        return quad(lambda x: impact / math.sqrt(1 - (impact * x) ** 2 * (1 - 2 * x)), 0, u, epsabs=1e-13)[0]

    def lapse(u: float) -> float:
        """The integral of dt / du without 1 / u^2 and 2 / u, and that of these two: -r - 2 ln r."""

        def rest(x: float) -> float:
            square = 1 - (impact * x) ** 2 * (1 - 2 * x)
            return (1 / ((1 - 2 * x) * math.sqrt(square)) - 1 - 2 * x) / x**2 if x > 1e-4 else 4 + impact**2 / 2

        return quad(rest, 0, u, epsabs=1e-12, limit=200)[0] - 1 / u + 2 * math.log(u)

    for place in np.flatnonzero(inward)[:12:3]:
        u = 1 / paths.radius[place]
        assert abs(paths.azimuth[place]) == pytest.approx(angle(u), abs=1e-11)
        # The divergent terms leave out a little where x is small: 1e-4 of a rest that varies by some hundreds.
        assert paths.time[place] == pytest.approx(lapse(u), abs=2e-5)
    # The place of a plane wave that is not deflected yet.
    assert u > 1 / 30 and abs(paths.azimuth[0]) == pytest.approx(math.asin(impact / 1e4), rel=1e-6)
    # All of it is symmetric about the turning point.
    assert abs(paths.azimuth[-1]) == pytest.approx(2 * angle_to_turn(impact, turn), rel=1e-11)


def angle_to_turn(impact: float, turn: float) -> float:
    """The angle from infinity to the turning point: with u = turn (1 - x^2) the root there is no singularity."""

    def integrand(x: float) -> float:
        # 1 - b^2 u^2 (1 - 2 u) over turn - u, by the factor that vanishes at the turning point.
        u = turn * (1 - x * x)
        square = impact**2 * (turn + u - 2 * (turn**2 + turn * u + u * u))
        return 2 * math.sqrt(turn) * impact / math.sqrt(square)

    return quad(integrand, 0, 1, epsabs=1e-13)[0]


@pytest.mark.slow
def test_paths_of_far_observers_tend_to_those_from_infinity():
    """Places at given Mino times from 100 M on, as 1 / r; r + 2 ln r is not in the times."""
    settings = {"sky": [[6.0, 3.0], [-7.5, 1.0], [9.0, -4.0]], "n": 30, "start": 100.0}
    limit = _paths_from(math.inf, **settings)
    gaps = []
    for radius in (1e4, 1e6, 1e8):
        near = _paths_from(radius, **settings)
        off = [np.abs(getattr(near, name) - getattr(limit, name)) for name in ("theta", "azimuth", "time")]
        inside = limit.radius < 300
        gaps.append([float(values[inside].max()) for values in off])
    gaps = np.array(gaps)
    assert np.all(np.abs(gaps[:2] / gaps[1:] / 100 - 1) < 0.05)
    # The screen of the third is flat to 1e-8 of 100 M.
    assert np.all(gaps[2] < [1e-5, 1e-5, 1e-3])


@pytest.mark.slow
def test_a_start_is_where_paths_begin():
    whole = kc.ray_paths(CAMERA, [-1.0, 0.3, 0.3], 30, end=kc.EquatorialPlane(1))
    part = kc.ray_paths(CAMERA, [-1.0, 0.3, 0.3], 30, end=kc.EquatorialPlane(1), start=6.0)
    assert part.radius[0] == 6.0 and whole.radius[0] == CAMERA.radius
    assert abs(whole.time[0]) <= whole.time_error[0] < 1e-13
    for name in ("radius", "theta", "azimuth", "time"):
        assert getattr(part, name)[-1] == pytest.approx(getattr(whole, name)[-1], abs=1e-11)
    assert np.array_equal(part.index, whole.index)
    # One that turns back before, and one that leaves outward.
    none = kc.ray_paths(CAMERA, [[-0.3, 0.9, 0.3], [1.0, 0.0, 0.0]], 5, start=2.0)
    assert np.all(np.isnan(none.radius)) and np.all(none.status == kc.Status.MISSED) and np.all(none.index == -1)
    # No place lies at infinity, whatever ray: the first one is a step away.
    far = kc.ray_paths(OBSERVERS[math.inf], [[3000.0, 10.0], [7.0, 0.0]], 10)
    assert np.all(np.isfinite(far.radius[:, 0])) and far.mino_time[:, 0] == pytest.approx(far.mino_time[:, -1] / 10)


@pytest.mark.slow
@pytest.mark.parametrize("viewer", [CAMERA, *OBSERVERS.values()], ids=["camera", "finite", "infinity"])
def test_conjugate_points_are_where_the_closed_form_has_them(viewer, sky):
    """The radius at which the minor diameter vanishes, of beams in closed form to a radius: within the errors."""
    seen = sky if viewer is CAMERA else SCREEN
    paths = kc.ray_paths(viewer, seen, 41)
    free = (paths.index >= 1) & (paths.status == kc.Status.ESCAPED)
    rays = [ray for ray in np.flatnonzero(free) if 4 < paths.conjugate.radius[ray, 0] < 200][:12]
    assert len(rays) >= 6
    for ray in rays:
        radius = paths.conjugate.radius[ray, 0]
        rising = paths.mino_time[ray, np.argmin(paths.radius[ray])] < paths.conjugate.mino_time[ray, 0]
        if not rising:
            continue

        def beam(r: float, ray: int = ray) -> kc.Beams:
            second = r < viewer.radius
            return kc.trace_beams(viewer, seen[ray], "closed-form", end=kc.Sphere(r, second), time=True)

        low, high = radius * (1 - 1e-6), radius * (1 + 1e-6)
        zero = brentq(lambda r: float(beam(r).delta_minus), low, high, xtol=1e-15)
        own, there = paths.conjugate.error[ray, 0], beam(zero)
        ends = beam(low), beam(high)
        slope, delay = (
            float(getattr(ends[1], x) - getattr(ends[0], x)) / (high - low) for x in ("delta_minus", "time")
        )
        off = float(there.diameter_error * there.delta_plus) / abs(slope) + 4e-16 * radius
        assert abs(zero - radius) <= own * radius**2 + off
        assert own < 1e-11
        late = abs(float(there.time) - paths.conjugate.time[ray, 0])
        assert late <= paths.conjugate.time_error[ray, 0] + float(there.time_error) + delay * off


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
    a2, a1, a0 = (np.asarray(part)[:, None] for part in potential_coefficients(CAMERA.spin, light))
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
    # dt / dtau = a (b - a sin^2 theta) + (r^2 + a^2) (r^2 + a^2 - a b) / Delta.
    square = radius**2 + spin**2
    rate = spin * (impact - spin * np.sin(orbit.theta) ** 2) + square * (square - spin * impact) / delta
    turn = np.gradient(orbit.time, orbit.mino_time)
    assert turn[1:-1] == pytest.approx(rate[1:-1], rel=3e-4)
    # Every half period takes as long.
    halves = np.diff(orbit.time[::500])
    assert np.abs(halves - halves[0]).max() < 2 * orbit.time_error.max() < 1e-9
    assert np.abs(orbit.theta[[0, 1000, 2000, 3000]] - math.pi / 2).max() < orbit.error.max() < 1e-12


@pytest.mark.parametrize(
    ("wrong", "name"),
    [({"n": 1}, "n"), ({"n": 2.5}, "n"), ({"end": 0.5}, "end"), ({"start": 1.0}, "start"), ({"start": "far"}, "start")],
)
def test_wrong_arguments_are_named(wrong, name):
    with pytest.raises(ValueError, match=f"Argument `{name}` must"):
        kc.ray_paths(CAMERA, [-1.0, 0, 0], **wrong)


def test_no_rays_and_one_ray():
    assert kc.ray_paths(CAMERA, np.empty((0, 3)), 41).radius.shape == (0, 41)
    one = kc.ray_paths(CAMERA, [0.0, 0, 1], 41)
    assert one.radius.shape == (41,) and one.index.shape == () and one.conjugate.radius.shape == (0,)


@pytest.mark.parametrize(("arguments", "name"), [((1.0, 0.0), "spin"), ((0.5, 9.0), "impact")])
def test_wrong_orbits_are_named(arguments, name):
    with pytest.raises(ValueError, match=f"Argument `{name}` must"):
        kc.trapped_orbit(*arguments)
