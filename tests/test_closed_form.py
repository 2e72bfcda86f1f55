"""The closed form against the integrator, which shares none of its formulas, and its choice of rays."""

import math

import jax
import mpmath
import numpy as np
import pytest
from beam_gaps import columns_in_space
from random_rays import directions_of_small_k, outside_edge, random_camera, random_sky

from kerrcaustics.beams.beam import Rays
from kerrcaustics.beams.closed_form import small_k
from kerrcaustics.beams.ray_state import LEAST_K
from kerrcaustics.beams.trace import trace_beams, trace_rays
from kerrcaustics.beams.traced_ends import TracedSky
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import photon_of, sky_from_fido

pytestmark = pytest.mark.usefixtures("compiled_code")


def assert_agree(camera: Camera, sky: np.ndarray, end: float = math.inf) -> int:
    """Errors of the closed form within ten times what it reports, index and crossings equal; how many it traced."""
    formula = trace_beams(camera, sky, "closed-form", end=end)
    steps = trace_beams(camera, sky, "integrated", 1e-13, end=end)
    rays = trace_rays(camera, sky, "closed-form", end=end)
    assert np.array_equal(formula.escaped, steps.escaped)
    used = formula.closed_form
    for ends in (formula, rays):
        gap = np.linalg.norm(ends.direction - steps.direction, axis=1)
        assert np.all(gap[used] <= 10 * (ends.error + steps.error)[used])
    turned = np.linalg.norm(columns_in_space(formula) - columns_in_space(steps), axis=(1, 2)) / steps.delta_plus
    assert np.all(turned[used] <= 10 * (formula.diameter_error + steps.diameter_error)[used])
    known = used & (formula.diameter_error < 0.1)
    assert np.array_equal(formula.index[known], steps.index[known])
    assert np.array_equal(formula.crossings[known], steps.crossings[known])
    # Through the axis itself the azimuth is known modulo a turn only.
    turn = formula.azimuth - steps.azimuth
    through = photon_of(camera.frame(), tuple(sky.T)).b == 0
    turn[through] -= 2 * math.pi * np.round(turn[through] / (2 * math.pi))
    lever = np.hypot(steps.direction[:, 0], steps.direction[:, 1])
    assert np.all(np.abs(turn * lever)[used] <= 10 * (formula.error + steps.error)[used])
    return int(used.sum())


@pytest.mark.slow
def test_random_cameras():
    rng = np.random.default_rng(1882)
    traced = 0
    for _ in range(16):
        camera = random_camera(rng)
        traced += assert_agree(camera, random_sky(camera, 512, rng))
    assert traced > 3000


@pytest.mark.slow
def test_many_random_cameras():
    rng = np.random.default_rng(1829)
    for _ in range(300):
        camera = random_camera(rng)
        assert_agree(camera, random_sky(camera, 512, rng))


def test_four_complex_and_real_roots_are_all_met():
    """With a turning point, without one, and with none real but the two inside the horizon."""
    camera = Camera(0.9, 4.0, math.pi / 2, "fiducial")
    inward = trace_beams(camera, outside_edge(camera, np.linspace(0, 6, 64), np.full(64, 0.01)), "closed-form")
    outward = trace_beams(camera, [[0.9, 0.3, 0.3], [0.6, -0.8, 0.0], [0.5, 0.5, -0.7]], "closed-form")
    assert inward.closed_form.all()
    assert outward.closed_form.all()


CASES = {
    "equatorial rays": (0.999, math.pi / 2, [[math.cos(t), math.sin(t), 0.0] for t in np.linspace(-1.5, 1.5, 41)]),
    "polar rays": (0.9, 1.0, None),
    "no spin": (0.0, 1.2, None),
    "spin of 1e-9": (1e-9, 1.2, None),
    "on the axis": (0.9, 0.0, None),
    "next to the axis": (0.9, 1e-9, None),
    "next to the equator": (0.9, math.pi / 2 - 1e-9, None),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_special_rays(case):
    spin, inclination, sky = CASES[case]
    camera = Camera(spin, 6.03, inclination, "fiducial")
    if case == "polar rays":
        # No component along e_phi: b = 0 exactly.
        angle = np.linspace(-2, 2, 81)
        sky = np.stack([np.cos(angle), np.zeros(81), np.sin(angle)], axis=1)
    elif sky is None:
        sky = random_sky(camera, 256, np.random.default_rng(9))
    assert assert_agree(camera, np.array(sky)) > 15


def test_nearly_equatorial_rays_vary_smoothly():
    """The Jacobian at p_theta = 0 is the limit of those nearby: cusps lie there."""
    camera = Camera(0.999, 6.03, math.pi / 2, "fiducial")
    tilt = np.array([0.0, 1e-150, 1e-17, 1e-12, -1e-12])
    sky = np.stack([np.full(5, -0.6), np.full(5, -0.8), tilt], axis=1)
    beams = trace_beams(camera, sky, "closed-form")
    assert beams.closed_form.all()
    assert np.ptp(beams.delta_plus) < 1e-11
    assert np.ptp(beams.delta_minus) < 1e-11
    assert np.ptp(columns_in_space(beams)[:4], axis=0).max() < 1e-10
    assert np.all(beams.crossings[1:] <= 1)
    assert beams.crossings[0] == 0


SMALL_K = {
    "no spin": Camera(0.0, 3.0, 1.2, "fiducial"),
    "spin of 1e-9": Camera(1e-9, 6.03, 1.2, "fiducial"),
    "among the photon orbits": Camera(0.999, 1.5, 1.2, "fiducial"),
    "next to the horizon": Camera(0.9, kerr.horizon(0.9) * (1 + 1e-6), math.pi / 2, "fiducial"),
    "on the axis": Camera(0.999, 2.0, 0.0, "fiducial"),
    "on the other axis": Camera(0.9, 4.0, math.pi, "fiducial"),
    "next to the axis": Camera(0.999, 2.0, 1e-9, "fiducial"),
    "on the equator": Camera(0.999, 1.2, math.pi / 2, "fiducial"),
    "next to the equator": Camera(0.999, 1.2, math.pi / 2 - 1e-9, "fiducial"),
    "nearly extremal": Camera(1 - 1e-12, 1.3, 1.0, "fiducial"),
    "far away": Camera(0.999, 1e9, 1.0, "fiducial"),
}


@pytest.mark.slow
@pytest.mark.parametrize("place", SMALL_K)
def test_rays_of_small_k(place):
    camera = SMALL_K[place]
    sky = directions_of_small_k(camera, 256, np.random.default_rng(12))
    light = photon_of(camera.frame(), tuple(sky.T))
    assert np.any(light.q < 0) or camera.spin < 1e-6 or abs(camera.cos_theta) < 1e-6
    assert np.all(light.k < LEAST_K + 1e-12)
    assert assert_agree(camera, sky) == len(sky) > 180


@pytest.mark.slow
def test_many_rays_of_small_k():
    rng = np.random.default_rng(1931)
    for _ in range(150):
        camera = random_camera(rng)
        sky = directions_of_small_k(camera, 256, rng)
        assert assert_agree(camera, sky) == len(sky)


@pytest.mark.slow
def test_rays_of_small_k_to_a_finite_radius():
    rng = np.random.default_rng(1932)
    for _ in range(20):
        camera = random_camera(rng)
        sky = directions_of_small_k(camera, 256, rng)
        assert assert_agree(camera, sky, camera.radius * (1 + 10 ** rng.uniform(-3, 2))) == len(sky)


@pytest.mark.slow
def test_principal_null_rays_and_their_neighbours_vary_smoothly():
    """There the constants of the ray are stationary, and two of the roots meet."""
    for camera in (
        Camera(0.9, 6.0, 1.1, "fiducial"),
        Camera(0.9, 6.0, 0.0, "fiducial"),
        Camera(0.0, 6.0, 1.1, "static"),
    ):
        frame = camera.frame()
        lean = frame.spin * frame.sin_theta * frame.lapse
        n_phi = lean / (frame.cylindrical_scale * (1 - frame.shift * frame.spin * frame.sin_theta**2))
        tilt = np.array([0.0, 1e-200, 1e-15, 1e-12, -1e-12])
        along = np.stack([np.full(5, -math.sqrt(1 - n_phi**2)), tilt, np.full(5, n_phi)], axis=-1)
        beams = trace_beams(camera, sky_from_fido(frame, along), "closed-form")
        assert beams.closed_form.all()
        # The camera-sky directions that the columns belong to do not vary smoothly.
        spread = columns_in_space(beams) @ columns_in_space(beams).swapaxes(1, 2)
        assert np.ptp(spread, axis=0).max() < 1e-10
        assert np.ptp(beams.direction, axis=0).max() < 1e-10


@pytest.mark.slow
def test_every_escaping_ray_has_a_closed_form():
    rng = np.random.default_rng(2)
    small = 0
    for _ in range(40):
        camera = random_camera(rng)
        sky = np.concatenate([random_sky(camera, 480, rng), directions_of_small_k(camera, 32, rng)])
        rays = trace_rays(camera, sky, "closed-form")
        assert np.array_equal(rays.closed_form, rays.escaped)
        assert rays.engine == "closed-form"
        assert np.isfinite(rays.error[rays.escaped]).all()
        small += int((photon_of(camera.frame(), tuple(sky.T)).k < LEAST_K)[rays.escaped].sum())
    assert small > 1000
    assert trace_rays(camera, sky, "integrated").engine == "integrated"


def test_rays_on_the_border_of_small_k_agree():
    """Both sets of formulas on either side of it."""
    camera = Camera(0.999, 2.0, 1.1, "fiducial")
    frame = camera.frame()
    turn = np.linspace(0, 2 * math.pi, 64)
    for k in (LEAST_K * (1 - 1e-13), LEAST_K * (1 + 1e-13)):
        size = math.sqrt(k + (frame.spin * frame.cos_theta) ** 2)
        p_theta, p_phi = size * np.cos(turn), size * np.sin(turn)
        energy = (1 - frame.shift * frame.sin_theta * p_phi) / frame.lapse
        n_phi, n_theta = p_phi / (frame.cylindrical_scale * energy), p_theta / (frame.root_sigma * energy)
        n_r = -np.sqrt(1 - n_phi**2 - n_theta**2)
        assert assert_agree(camera, sky_from_fido(frame, np.stack([n_r, n_theta, n_phi], axis=-1))) == 64


@pytest.mark.slow
def test_short_way_next_to_the_horizon_against_long_arithmetic():
    """Closer than the integrator can resolve: Mino time and psi by quadrature of the height, as exp(s)."""
    camera = Camera(0.999, kerr.horizon(0.999) * (1 + 1e-6), 1.0, "fiducial")
    sky = directions_of_small_k(camera, 4, np.random.default_rng(5))
    light = photon_of(camera.frame(), tuple(sky.T))
    travel = jax.jit(small_k.radial_motion)(camera.frame(), light, TracedSky())
    with mpmath.workdps(30):
        a, r_c = mpmath.mpf(camera.spin), mpmath.mpf(camera.radius)
        root = mpmath.sqrt(1 - a * a)
        for i in range(len(sky)):
            b, kappa = mpmath.mpf(light.b[i]), mpmath.mpf(light.kappa[i])

            def rates(s: mpmath.mpf, b: mpmath.mpf = b, kappa: mpmath.mpf = kappa) -> tuple:
                height = mpmath.exp(s)
                r, delta = 1 + root + height, height * (height + 2 * root)
                big = r * r + a * a - a * b
                speed = height / mpmath.sqrt(big**2 - delta * kappa)
                return speed, -a * (2 * r - a * b) / delta * speed

            ends = mpmath.linspace(mpmath.log(r_c - 1 - root), 60, 12)
            time, psi = (mpmath.quad(lambda s, j=j: rates(s)[j], ends) for j in range(2))
            assert float(travel.time[i]) == pytest.approx(float(time), rel=2e-15)
            assert float(travel.psi[i]) == pytest.approx(float(psi), rel=2e-14)


@pytest.mark.slow
def test_auto_takes_the_integrator_where_round_off_of_the_formulas_is_larger():
    """psi is a small difference for a nearly extremal hole."""
    camera = Camera(1 - 1e-12, 3.0, math.pi / 2, "fiducial")
    sky = random_sky(camera, 512, np.random.default_rng(4))
    formula, auto = trace_rays(camera, sky, "closed-form"), trace_rays(camera, sky, "auto")
    sharp = auto.escaped & ~auto.closed_form & formula.closed_form
    assert sharp.sum() > 100
    assert np.all(auto.error[sharp] < formula.error[sharp])
    truth = trace_rays(camera, sky, "integrated", 1e-13)
    away = np.linalg.norm(formula.direction - truth.direction, axis=1)
    assert np.all(away[formula.escaped] <= 10 * (formula.error + truth.error)[formula.escaped])


def test_empty_and_single_directions():
    camera = Camera(0.9, 6.0)
    assert trace_beams(camera, np.empty((0, 3)), "closed-form").direction.shape == (0, 3)
    one = trace_beams(camera, [1.0, 0.4, 0.2], "closed-form")
    assert isinstance(one, Rays)
    assert one.direction.shape == (3,)
    assert one.closed_form.shape == ()


def test_few_beams_agree_with_many():
    """Few are one small call; many are several parts of a large one, the last of which is filled up."""
    camera = Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 700, np.random.default_rng(16))
    sky = sky[photon_of(camera.frame(), tuple(sky.T)).k >= LEAST_K]
    many = trace_beams(camera, sky, "closed-form")
    assert len(sky) > 512
    for start in (0, 450, len(sky) - 50):
        chosen = slice(start, start + 100)
        few = trace_beams(camera, sky[chosen], "closed-form")
        assert np.array_equal(few.status, many.status[chosen])
        assert np.array_equal(few.index, many.index[chosen])
        assert np.array_equal(few.crossings, many.crossings[chosen])
        for name in ("direction", "azimuth", "error", "jacobian", "redshift"):
            np.testing.assert_allclose(getattr(few, name), getattr(many, name)[chosen], rtol=1e-12, atol=1e-14)


@pytest.mark.slow
def test_rays_close_to_the_principal_directions_meet_no_conjugate_point():
    """The search for critical curves takes this for granted: their index is 0."""
    rng = np.random.default_rng(8)
    met = 0
    for _ in range(40):
        camera = random_camera(rng)
        sky = random_sky(camera, 512, rng)
        beams = trace_beams(camera, sky, "integrated", 1e-8)
        short = beams.escaped & (photon_of(camera.frame(), tuple(sky.T)).k < LEAST_K)
        assert np.all(beams.index[short] == 0)
        assert np.all(beams.determinant[short] > 0)
        met += int(short.sum())
    assert met > 100
