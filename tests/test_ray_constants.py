"""Constants of light, its slant at the source, clock rates and the ISCO: against long arithmetic and other formulas."""

import math

import mpmath
import numpy as np
import pytest
from beam_equations import Event, photon
from offenders import for_each

import kerrcaustics as kc

CAMERA = kc.Camera(spin=0.9, radius=7.0, inclination=1.1, velocity=(0.1, -0.2, 0.3))
CAMERAS = [kc.Camera(0.999, 1.3), kc.Camera(0.0, 30.0, 0.3, "static"), kc.Camera(0.95, 1e6, 3.0, (0.0, 0.0, -0.99))]
HOLES = [0.0, 1e-300, 1e-12, 1e-8, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.998, 1 - 1e-8, 1 - 1.3e-14, math.nextafter(1, 0)]


def directions(count: int) -> np.ndarray:
    sky = np.random.default_rng(5).normal(size=(count, 3))
    return sky / np.linalg.norm(sky, axis=1, keepdims=True)


SKY = directions(200)
# About the direction to the hole, as cameras see it that move round it, or not at all.
NEAR = -np.asarray(CAMERA.frame().basis)[:, 0] + 0.5 * SKY
TOWARD = np.array([-1.0, 0.0, 0.0]) + 0.4 * SKY


def long_constants(camera: kc.Camera, sky: np.ndarray) -> tuple[float, float, float]:
    """b, q and the energy at infinity, of 40 digits, for an azimuthal motion or none (JTFT A.1)."""
    with mpmath.workdps(40):
        a, r = mpmath.mpf(camera.spin), mpmath.mpf(camera.radius)
        c = mpmath.mpf(0) if camera.on_equator else mpmath.cos(mpmath.mpf(camera.inclination))
        s = mpmath.sqrt(1 - c * c)
        x, y, z = (mpmath.mpf(float(part)) for part in sky)
        length = mpmath.sqrt(x * x + y * y + z * z)
        x, y, z = x / length, y / length, z / length
        sigma, delta = r * r + a * a * c * c, r * r - 2 * r + a * a
        big = (r * r + a * a) ** 2 - a * a * delta * s * s
        alpha, omega, varpi = mpmath.sqrt(sigma * delta / big), 2 * a * r / big, mpmath.sqrt(big / sigma) * s
        speed = mpmath.mpf(0)
        if camera.velocity == "circular":
            speed = varpi * (1 / (a + mpmath.power(r, 1.5)) - omega) / alpha
        elif camera.velocity == "static":
            speed = -omega * varpi / alpha
        elif isinstance(camera.velocity, tuple):
            speed = mpmath.mpf(camera.velocity[2])
        boost = 1 - speed * y
        n_phi, n_theta = (speed - y) / boost, mpmath.sqrt(1 - speed**2) * z / boost
        energy = 1 / (alpha + omega * varpi * n_phi)
        b, p_theta = energy * varpi * n_phi, energy * mpmath.sqrt(sigma) * n_theta
        return float(b), float(p_theta**2 + c * c * (b * b / (s * s) - a * a)), float(1 / energy)


@pytest.mark.parametrize("camera", CAMERAS, ids=str)
def test_b_and_q_are_those_of_long_arithmetic(camera):
    rays = kc.trace_rays(camera, SKY, constants=True)
    true = np.array([long_constants(camera, direction) for direction in SKY])
    known = true[:, 2] > 0
    # Inside the ergosphere some light has no positive energy at infinity.
    assert known.any() and known.all() == (camera.radius > 2)
    assert np.array_equal(np.isfinite(rays.impact), known)
    ratios = np.abs(rays.impact - true[:, 0]) / rays.impact_error, np.abs(rays.carter - true[:, 1]) / rays.carter_error
    for ratio in ratios:
        assert np.all(ratio[known] < 1)
    # Captured rays have them too; and the errors are round-off.
    captured = rays.status == kc.Status.CAPTURED
    assert captured.any() == (camera.radius < 1e3) and np.isfinite(rays.impact[captured & known]).all()
    size = np.sqrt(np.maximum(true[:, 1] + true[:, 0] ** 2, 0)) + camera.radius
    assert np.median((rays.impact_error / size)[known]) < 1e-14


def test_b_and_q_of_any_motion_and_of_observers():
    beams = kc.trace_beams(CAMERA, SKY, constants=True)
    event = Event(CAMERA.spin, CAMERA.radius, CAMERA.inclination, CAMERA.fido_velocity())
    light = [photon(event, direction) for direction in SKY]
    assert beams.impact == pytest.approx(np.array([one.b for one in light]), abs=1e-12)
    assert beams.carter == pytest.approx(np.array([one.q for one in light]), abs=1e-10)
    viewer, screen = kc.Observer(spin=0.9, inclination=1.1), 7 * SKY[:, :2]
    rays = kc.trace_rays(viewer, screen, constants=True)
    alpha, beta = screen.T
    s, c = math.sin(1.1), math.cos(1.1)
    assert np.all(np.abs(rays.impact + alpha * s) < rays.impact_error)
    assert np.all(np.abs(rays.carter - beta**2 - (alpha**2 - 0.81) * c**2) < rays.carter_error)
    assert np.median(rays.impact_error) < 1e-13
    plain = kc.trace_rays(viewer, screen)
    assert plain.impact is plain.carter is plain.emission_cosine is None


def measured(spin: float, radius: float, light: tuple[float, float], orbital: float) -> tuple[float, float]:
    """p.normal and p.u of what circles in the plane, from the metric: the normal is -e_theta."""
    g_tt, g_tp = -(1 - 2 / radius), -2 * spin / radius
    g_pp = radius**2 + spin**2 + 2 * spin**2 / radius
    u_t = 1 / math.sqrt(-(g_tt + 2 * orbital * g_tp + orbital**2 * g_pp))
    return math.sqrt(light[1]) / radius, u_t * (1 - orbital * light[0])


@pytest.mark.slow
@pytest.mark.parametrize("emitter", ["circular", "retrograde", "static"])
def test_slant_at_a_disk_is_that_of_the_metric(emitter):
    """cos i = sqrt(q) / (r E_em), with E_em = u^t (1 - Omega b)."""
    end = kc.EquatorialPlane(1, emitter)
    rays = kc.trace_rays(CAMERA, SKY, end=end, constants=True, emission=True)
    seen = np.flatnonzero(np.isfinite(rays.emission_cosine) & (rays.radius < 1e4))
    assert len(seen) > 60
    for ray in seen:
        r = float(rays.radius[ray])
        orbital = {"circular": 1 / (r**1.5 + 0.9), "retrograde": -1 / (r**1.5 - 0.9), "static": 0.0}[emitter]
        normal, energy = measured(0.9, r, (float(rays.impact[ray]), float(rays.carter[ray])), orbital)
        assert rays.emission_cosine[ray] == pytest.approx(normal / energy, abs=float(rays.emission_error[ray]) + 1e-12)
    assert np.all((rays.emission_cosine[seen] >= 0) & (rays.emission_cosine[seen] <= 1))
    assert np.median(rays.emission_error[seen]) < 1e-12
    with_shift = kc.trace_rays(CAMERA, SKY, end=end, redshift=True)
    assert np.array_equal(np.isnan(with_shift.redshift), np.isnan(rays.emission_cosine))


@pytest.mark.slow
def test_slant_of_plunging_matter_is_less_than_a_right_angle():
    rays = kc.trace_rays(kc.Camera(0.5, 20.0, 1.2), SKY, end=kc.EquatorialPlane(1, "plunging"), emission=True)
    assert np.all(rays.emission_cosine[rays.escaped] <= 1) and np.isfinite(rays.emission_cosine[rays.escaped]).all()


@pytest.mark.slow
def test_slant_far_from_the_hole_is_that_of_flat_space():
    """A far disk, at rest: light leaves it at the inclination of the observer, less its deflection."""
    observer = kc.Observer(spin=0.9, inclination=0.8)
    rays = kc.trace_rays(observer, [[3e6, 1e6], [-2e6, -3e6]], end=kc.EquatorialPlane(1, "static"), emission=True)
    assert rays.emission_cosine == pytest.approx(math.cos(0.8), abs=3e-6)


@pytest.mark.slow
def test_slant_at_a_sphere_without_spin():
    """sin i = sqrt(q + b^2) sqrt(1 - 2 / r) / r at a static place; on the celestial sphere light comes straight in."""
    camera = kc.Camera(0.0, 30.0, 0.3, "static")
    for radius in (60.0, 10.0, 4.0):
        rays = kc.trace_rays(camera, TOWARD, end=radius, constants=True, emission=True)
        here = rays.escaped
        assert here.sum() > 5
        # Rays that do not come so far have a sine of more than 1 there.
        sine = np.sqrt((rays.carter + rays.impact**2)[here] * (1 - 2 / radius)) / radius
        gap = np.abs(rays.emission_cosine[here] - np.sqrt(1 - sine**2))
        assert np.all(gap < rays.emission_error[here] + 1e-14 / rays.emission_cosine[here])
    far = kc.trace_rays(camera, TOWARD, emission=True)
    assert np.all(far.emission_cosine[far.escaped] == 1) and np.all(np.isnan(far.emission_cosine[~far.escaped]))
    # Next to the horizon nothing is at rest within the ergosphere.
    deep = kc.trace_rays(kc.Camera(0.9, 10.0), TOWARD, end=1.6, emission=True)
    theta = np.arccos(deep.direction[:, 2])
    within = 1 + np.sqrt(1 - (0.9 * np.cos(theta)) ** 2) > 1.6
    assert np.array_equal(np.isnan(deep.emission_cosine)[deep.escaped], within[deep.escaped])


@pytest.mark.slow
def test_errors_of_the_slant_cover_the_other_engine():
    for end in (kc.EquatorialPlane(1), kc.EquatorialPlane(2, "plunging"), 3.0, 40.0):
        one, other = (
            kc.trace_rays(CAMERA, NEAR, engine, end=end, emission=True) for engine in ("closed-form", "integrated")
        )
        both = np.isfinite(one.emission_cosine) & np.isfinite(other.emission_cosine)
        assert both.sum() > 10
        gap = np.abs(one.emission_cosine - other.emission_cosine)[both]
        assert np.all(gap <= (one.emission_error + other.emission_error)[both])


@for_each(spin=HOLES, sense=[1, -1])
def test_isco_is_the_root_of_its_equation(spin, sense):
    """r^2 - 6 r + 8 a sqrt(r) - 3 a^2 = 0, for a retrograde orbit with -a; by Newton's method with 60 digits."""
    found = kc.isco(spin, prograde=sense > 0)
    with mpmath.workdps(60):
        a = sense * mpmath.mpf(spin)
        x = mpmath.sqrt(mpmath.mpf(found))
        for _ in range(60):
            slope = 4 * x**3 - 12 * x + 8 * a
            x -= (x**4 - 6 * x**2 + 8 * a * x - 3 * a * a) / slope if slope else 0
        assert abs(float(mpmath.mpf(found) - x * x)) < 2e-15


@pytest.mark.parametrize(("spin", "shown"), [(1.0, "1.0"), (-0.1, "-0.1"), (math.nan, "nan")])
def test_wrong_spins_are_named(spin, shown):
    with pytest.raises(ValueError, match=rf"^Argument `spin` must lie in \[0, 1\), but is {shown}(\.$|: the mirror)"):
        kc.isco(spin)


@pytest.mark.parametrize(("spin", "radius"), [(0.0, 6.0), (0.9, 3.0), (0.999, 1.3), (0.999, None), (1 - 1.3e-14, None)])
def test_clock_of_a_circular_orbit(spin, radius):
    """u^t = (r^3/2 + a) / sqrt(r^3 - 3 r^2 + 2 a r^3/2), with 60 digits; at one ISCO an hour is seven years."""
    camera = kc.Camera(spin, radius or kc.isco(spin), velocity="circular")
    with mpmath.workdps(60):
        a, r = mpmath.mpf(spin), mpmath.mpf(camera.radius)
        root = mpmath.power(r, mpmath.mpf(3) / 2)
        true = (root + a) / mpmath.sqrt(r**3 - 3 * r**2 + 2 * a * root)
        assert abs(float(camera.clock_rate / true - 1)) < 4e-16 * (1 + camera.clock_rate)
    if spin > 0.9999:
        assert camera.clock_rate / (24 * 365.25) == pytest.approx(7.06, abs=0.01)


def test_clocks_of_other_cameras():
    assert kc.Camera(0.0, 8.0, 0.7, "static").clock_rate == pytest.approx(1 / math.sqrt(0.75), rel=1e-15)
    still, moving = (kc.Camera(0.9, 5.0, 1.0, v).clock_rate for v in ("fiducial", (0.3, 0.0, -0.4)))
    assert moving == pytest.approx(still / math.sqrt(0.75), rel=1e-15)
    # At rest far away clocks agree; for a static source the redshift is the ratio of the clocks.
    camera = kc.Camera(0.9, 5.0, 1.0, "static")
    rays = kc.trace_rays(camera, [[1.0, 0.0, 0.0]], redshift=True)
    assert float(rays.redshift[0]) == pytest.approx(camera.clock_rate, rel=1e-14)
    assert "clock_rate" in kc.to_xarray(camera).attrs
