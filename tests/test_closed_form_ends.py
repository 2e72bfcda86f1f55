"""Finite ends and the coordinate time in closed form, against the integrator and long arithmetic."""

import math

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from beam_gaps import relative_gap
from marks import few
from random_rays import directions_of_small_k, random_camera, random_sky

import kerrcaustics as kc
from kerrcaustics.beams.closed_form import radial_leg, small_k
from kerrcaustics.beams.closed_form.radial_motion import RadialPlace, RadialRoots
from kerrcaustics.beams.closed_form.weierstrass import inverse_radius
from kerrcaustics.beams.ray_state import LEAST_K
from kerrcaustics.beams.spheres import Spheres
from kerrcaustics.beams.traced_ends import TracedSphere
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.frame import Photon, photon_of, potential_coefficients

pytestmark = pytest.mark.usefixtures("compiled_code")


@pytest.mark.parametrize(("trace", "finite"), [(kc.trace_beams, False), (kc.trace_rays, True)])
def test_times_on_random_cameras(trace, finite):
    rng = np.random.default_rng(1988)
    units, relative = [], []
    for _ in range(8):
        camera = random_camera(rng)
        sky = np.concatenate([random_sky(camera, 128, rng), directions_of_small_k(camera, 32, rng)])
        end = some_radius(camera, rng) if finite else math.inf
        exact = kc.trace_rays(camera, sky, "integrated", tolerance=1e-13, end=end, time=True)
        ends = trace(camera, sky, "closed-form", tolerance=1e-13, end=end, time=True)
        assert np.array_equal(ends.escaped, exact.escaped)
        assert np.array_equal(np.isfinite(ends.time), exact.escaped)
        assert end < camera.radius or ends.closed_form[128:].all()
        known = ends.closed_form
        error = np.abs(ends.time - exact.time)[known]
        # Both may be wrong by as much as they say.
        units += list(error / (ends.time_error + exact.time_error / 10)[known])
        relative += list(error / np.maximum(1, np.abs(exact.time[known])))
    assert len(units) > 250
    assert max(units) <= 10
    assert np.median(relative) < 1e-13


def test_times_of_rays_that_leave_close_to_their_turning_point():
    camera = kc.Camera(0.7, 8.0, 1.2, "fiducial")
    for tilt in (1e-3, 1e-6, 1e-9, 0.0, -1e-9, -1e-6, -1e-3):
        sky = np.array([[math.sin(tilt), 0.6 * math.cos(tilt), 0.8 * math.cos(tilt)]])
        ends = [kc.trace_rays(camera, sky, engine, 1e-13, time=True) for engine in ("closed-form", "integrated")]
        assert ends[0].closed_form.all()
        assert abs(ends[0].time - ends[1].time) < 1e-12


def test_time_of_the_automatic_engine_is_in_closed_form():
    camera = kc.Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 120, np.random.default_rng(5))
    rays = kc.trace_rays(camera, sky, tolerance=1e-10, time=True)
    assert rays.closed_form[rays.escaped].mean() > 0.95


def some_radius(camera: kc.Camera, rng: np.random.Generator) -> float:
    """Close to the horizon, close to the camera on either side, or far out."""
    horizon = kerr.horizon(camera.spin)
    near = max(horizon * 1.001, camera.radius * 10 ** rng.uniform(-0.3, 0.3))
    return float(rng.choice([horizon + 10 ** rng.uniform(-3, 1), near, camera.radius * (1 + 10 ** rng.uniform(-3, 2))]))


def displaced(ends: kc.Rays, exact: kc.Rays) -> np.ndarray:
    """Error of an end in radians, and of its radius in parts of it."""
    return np.maximum(np.linalg.norm(ends.direction - exact.direction, axis=-1), np.abs(ends.radius / exact.radius - 1))


def assert_rays_agree(camera: kc.Camera, sky: np.ndarray, end) -> int:
    """The same rays arrive, in closed form where q + b^2 and the end allow it, with honest errors; how many."""
    exact = kc.trace_rays(camera, sky, "integrated", 1e-13, end=end)
    rays = kc.trace_rays(camera, sky, "closed-form", end=end)
    assert np.array_equal(rays.escaped, exact.escaped)
    assert np.array_equal(rays.status[~rays.escaped], exact.status[~rays.escaped])
    used = rays.closed_form
    outer = isinstance(end, float) and end > camera.radius
    assert np.array_equal(used, rays.escaped & (outer | (photon_of(camera.frame(), tuple(sky.T)).k >= LEAST_K)))
    # Seen from far away, rounding N is most of the error, and the integrator leaves it out for rays in the plane.
    rounding = 1e-16 * camera.radius
    assert np.all(displaced(rays, exact)[used] <= 10 * (rays.error + exact.error)[used] + rounding)
    return int(used.sum())


def assert_beams_agree(camera: kc.Camera, sky: np.ndarray, end) -> int:
    """Beams and their times within ten times what is reported, index and crossings equal; how many."""
    exact = kc.trace_beams(camera, sky, "integrated", 1e-13, end=end, time=True)
    beams = kc.trace_beams(camera, sky, "closed-form", end=end, time=True)
    assert np.array_equal(beams.escaped, exact.escaped)
    used = beams.closed_form
    assert np.all(displaced(beams, exact)[used] <= 10 * (beams.error + exact.error)[used])
    allowed = 10 * (beams.diameter_error + exact.diameter_error)
    assert np.all((relative_gap(beams, exact, end) <= allowed)[used])
    assert np.all(np.abs(beams.time - exact.time)[used] <= 10 * (beams.time_error + exact.time_error)[used])
    # Without spin every crossing of a camera's own plane is a conjugate point: on which side is open.
    known = used & (np.abs(exact.delta_minus) > 1e-9 * exact.delta_plus) & (beams.diameter_error < 0.1)
    assert np.array_equal(beams.index[known], exact.index[known])
    assert np.array_equal(beams.crossings[known], exact.crossings[known])
    return int(used.sum())


def test_ends_in_the_plane():
    rng = np.random.default_rng(1873)
    met = 0
    for spin, radius in ((0.0, 8.0), (0.9, 2.0), (0.99, 1.3), (0.7, 3.1), (0.5, 30.0)):
        camera = kc.Camera(spin, radius, rng.uniform(0, 3), tuple(rng.uniform(-0.4, 0.4, 3)))
        sky = random_sky(camera, 256, rng)
        met += sum(assert_rays_agree(camera, sky, kc.EquatorialPlane(n)) for n in (1, 2))
    assert met > 1000


def test_ends_of_rays_on_many_random_cameras():
    rng = np.random.default_rng(1917)
    met = 0
    for _ in range(60):
        camera = random_camera(rng)
        sky = random_sky(camera, 256, rng)
        for end in (kc.EquatorialPlane(int(rng.integers(1, 4))), some_radius(camera, rng)):
            met += assert_rays_agree(camera, sky, end)
    assert met > 10_000


def test_ends_of_beams_on_many_random_cameras():
    rng = np.random.default_rng(1923)
    met = 0
    for _ in range(60):
        camera = random_camera(rng)
        sky = random_sky(camera, 256, rng)
        for end in (kc.EquatorialPlane(int(rng.integers(1, 4))), some_radius(camera, rng)):
            met += assert_beams_agree(camera, sky, end)
    assert met > 10_000


def test_beams_that_graze_their_turning_point_in_the_plane_vary_smoothly():
    """At places in the plane where r' vanishes, neither the radius nor its variation is special."""
    camera = kc.Camera(0.8, 9.0, 1.0, "fiducial")
    rim = kc.shadow_edge(camera, 24)
    sky = np.concatenate(
        [rim * math.cos(t) + math.sin(t) * np.array([1.0, 0.0, 0.0]) for t in np.linspace(0.02, 1, 60)]
    )
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    assert assert_beams_agree(camera, sky, kc.EquatorialPlane(1)) > 500


def place(roots: RadialRoots, spin: float, radius: float, sense: int) -> RadialPlace:
    inner = jnp.sqrt((radius - roots.low) * (radius - roots.next))
    outer = sense * jnp.sqrt(jnp.maximum((radius - roots.h) ** 2 - roots.d, 0.0))
    return RadialPlace(jnp.float64(radius), jnp.float64(radius - kerr.horizon(spin)), inner, outer)


def test_errors_hold_on_ways_that_begin_and_end_at_the_outer_roots():
    """Rays that linger there for their whole way: psi loses digits as its ends come close to the roots."""
    velocity = -0.30179352045376306, -0.15136819852382766, -0.09089689553045997
    camera = kc.Camera(0.3147031816051521, 2.8507427030769854, math.pi / 2, velocity)
    middle = -0.21792476702369182, 0.7162096773293816, 0.6629875519324726
    sky = np.array(middle) + 1e-6 * np.random.default_rng(3).normal(size=(800, 3))
    end = kc.EquatorialPlane(2)
    ours, theirs = (kc.trace_beams(camera, sky, *how, end=end) for how in (["closed-form"], ["integrated", 1e-13]))
    reach = ours.closed_form & np.isfinite(theirs.error)
    off = np.linalg.norm(ours.direction - theirs.direction, axis=1)[reach]
    assert reach.sum() > 300 and (off <= ours.error[reach] + theirs.error[reach]).all()


# (b, q, radius and sense at the start, and at the end): straight on, and through a turning point below and above.
WAYS = [
    (2.0, 20.0, 6.0, 1, 20.0, 1),
    (2.0, 20.0, 20.0, -1, 6.0, -1),
    (2.0, 20.0, 6.0, -1, 5.9, 1),
    (2.0, 20.0, 6.0, -1, 6.0, 1),
    (-3.0, 15.0, 6.0, -1, 1.6, -1),
    (-3.0, 40.0, 1.6, 1, 1.8, 1),
    (-3.0, 40.0, 1.6, 1, 1.5, -1),
    (-3.0, 40.0, 1.8, 1, 1.8, -1),
    (100.0, 1e4, 1e6, -1, 200.0, 1),
]


@pytest.mark.parametrize("way", few(WAYS, ()), ids=str)
def test_radial_integrals_against_quadrature(way):
    b, q, first, sense, last, final = way
    spin = 0.9
    a2, a1, a0 = spin**2 - q - b * b, 2 * (q + (b - spin) ** 2), -(spin**2) * q
    none = (jnp.float64(0.0),) * 4
    u_rate = -sense * math.sqrt(a0 + first * (a1 + first * (a2 + first * first))) / first**2
    rate = (jnp.float64(u_rate), *none[1:])
    light = Photon(*(jnp.float64(c) for c in (b, q + b * b, a1 / 2, q)), position=none, rate=rate, energy_ratio=1.0)
    quartic = radial.factor(kc.Camera(spin, first, math.pi / 2, "fiducial").frame(), light)
    h, d = float(quartic.h), float(quartic.d)
    excess = spin**2 * q / (h * h - d)
    width = math.sqrt(h * h + excess)
    roots = RadialRoots(h, d, -h - width, excess / (h + width), quartic.lift, 2 * kerr.horizon(spin) - spin * b)
    ends = place(roots, spin, first, sense), place(roots, spin, last, final)
    found = radial_leg.integrals(spin, roots, *ends, with_time=True)
    outer = kerr.horizon(spin)

    def integrand(power: int, u):
        rate = mpmath.sqrt(abs(1 + u * u * (mpmath.mpf(a2) + u * (mpmath.mpf(a1) + u * mpmath.mpf(a0)))))
        pole = [1, *((2 * r - spin * b) * u / (1 - r * u) for r in (outer, spin**2 / outer)), (1 / u + 2) / u][power]
        return pole / rate

    def leg(power: int, turn, stop):
        """From one place to another, in the root of the distance from the first, a turning point."""
        span = stop - turn
        return abs(mpmath.quad(lambda s: 2 * span * s * integrand(power, turn + span * s * s), [0, 1]))

    with mpmath.workdps(30):
        stops = [1 / mpmath.mpf(first), 1 / mpmath.mpf(last)]
        if sense != final:
            turn = 1 / mpmath.findroot(lambda r: a0 + r * (a1 + r * (a2 + r * r)), h - sense * math.sqrt(d))
        # The last without what is taken off at the first place.
        whole = (*found[:3], found[3] + first + 2 * math.log(first))
        for power, value in enumerate(whole):
            legs = [leg(power, *stops)] if sense == final else [leg(power, turn, stop) for stop in stops]
            assert abs(float(value)) == pytest.approx(float(sum(legs)), rel=2e-11 if power in (1, 2) else 2e-13)


def test_radius_after_a_time():
    """Against the same motion in two halves."""
    camera = kc.Camera(0.9, 5.0, 1.1, "fiducial")
    light = photon_of(camera.frame(), tuple(random_sky(camera, 256, np.random.default_rng(2)).T))
    coefficients = potential_coefficients(camera.spin, light)
    start = light.position[0] * np.ones(256), light.rate[0]
    time = 0.4 / np.sqrt(light.k + 3)
    there = jax.jit(inverse_radius)
    whole, halves = (
        there(coefficients, start, time),
        there(coefficients, there(coefficients, start, time / 2), time / 2),
    )
    np.testing.assert_allclose(whole, halves, rtol=1e-8, atol=1e-10)


def test_jacobians_next_to_an_extremal_horizon_lose_nothing_to_its_being_double():
    """The turn is a difference divided by r_+ - r_-; its variation is not."""
    camera = kc.Camera(1 - 1e-6, 1.5, 1.5, "fiducial")
    sky = random_sky(camera, 64, np.random.default_rng(8))
    end = kc.EquatorialPlane(1)
    ends, exact = (kc.trace_beams(camera, sky, engine, 1e-13, end=end) for engine in ("closed-form", "integrated"))
    known = ends.escaped & exact.escaped & ends.closed_form
    assert known.sum() > 20
    gap = np.linalg.norm(ends.jacobian - exact.jacobian, axis=(1, 2))[known] / exact.delta_plus[known]
    assert np.median(gap) < 2e-13


# Rays of small k: camera, N, radius of the sphere; azimuth, time and diameters by a program of 50 digits.
BRIEF_WAYS = {
    "next to the horizon": (
        kc.Camera(0.999999988818395, 1.0002495582919504, 1.5707963267950527),
        [0.9999999950131309, -9.986860051143321e-05, 3.0505081560448075e-08],
        1.0002500683889388,
        (-12.73860898907514, 25.483583315234306, 0.002553346765769757, 0.0025529564113720587),
    ),
    "next to the camera": (
        kc.Camera(
            0.9996241624184498,
            6.228742752432673,
            1.5707963267948966,
            (-0.061938671679926546, 0.11479651561951795, -0.9914561704586617),
        ),
        [-0.0001415883738355912, 0.9999999899757296, 1.1284087684591242e-06],
        6.228742752433283,
        (-2.231060463000309e-14, 8.882169559056452e-13, 8.294151415042547e-10, 8.294149129754603e-10),
    ),
}


@pytest.mark.parametrize("name", BRIEF_WAYS)
def test_brief_ways_keep_their_digits(name):
    camera, sky, radius, exact = BRIEF_WAYS[name]
    beam = kc.trace_beams(camera, [sky], "closed-form", end=radius, time=True)
    assert beam.time is not None
    found = [beam.azimuth[0], beam.time[0], beam.delta_plus[0], beam.delta_minus[0]]
    assert np.allclose(found, exact, rtol=1e-11, atol=0)


def test_psi_of_a_distant_camera_outlives_an_extremal_horizon():
    """Divided by the distance of the horizons its rounding would be 1e-10."""
    camera = kc.Camera(
        0.9999999999200627,
        1486.6780394132218,
        1.5707463034089335,
        (0.11553495075811103, 0.19063563216449317, 0.07410950278142378),
    )
    sky = [[0.4704546156076512, 0.6514695108073864, 0.5951973883862746]]
    rays = kc.trace_rays(camera, sky, "closed-form", tolerance=1e-14)
    assert rays.escaped[0]
    assert rays.azimuth[0] == pytest.approx(-1.0464170523892554e-07, abs=1e-15)


@pytest.mark.slow
def test_rays_of_small_k_may_have_spheres_of_their_own():
    frame, sky = kc.Camera(0.9, 5.0, 1.2).frame(), tuple(np.array([[0.9, 0.99], [0.3, 0.1], [0.3, -0.1]]))

    def moved(radius):
        end = TracedSphere(radius, np.zeros(2, bool))
        return small_k.radial_motion(frame, photon_of(frame, sky), end, with_time=True)

    shapes = jax.eval_shape(moved, np.array([7.0, 30.0]))
    assert shapes.time.shape == shapes.psi.shape == shapes.clock.shape == (2,)


@pytest.mark.parametrize("engine", ["closed-form", "integrated"])
def test_beams_to_spheres_of_their_own_are_those_to_each(engine):
    """Behind the camera and before it, within its radius and beyond."""
    camera, rng = kc.Camera(0.9, 5.0, 1.2), np.random.default_rng(11)
    sky = np.concatenate([random_sky(camera, 40, rng), directions_of_small_k(camera, 40, rng)])
    radii = np.array([2.5, 5.3, 7.0, 30.0])
    spheres = Spheres(np.tile(radii, 20), np.zeros(80, bool))
    own = kc.trace_beams(camera, sky, engine, end=spheres, time=True)
    for i, radius in enumerate(radii.tolist()):
        each = kc.trace_beams(camera, sky[i::4], engine, end=radius, time=True)
        assert np.array_equal(own.status[i::4], each.status)
        for name in ("direction", "jacobian", "time"):
            np.testing.assert_allclose(getattr(own, name)[i::4], getattr(each, name), rtol=1e-9, atol=1e-9)
