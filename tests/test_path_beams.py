"""Beams along rays, and of ellipses at the camera: against traced ends, slow integrations and displaced rays."""

import math

import numpy as np
import pytest
from beam_equations import Event, pineault_roeder_at
from kerr_rays import forward_rates
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.paths import RayPaths
from kerrcaustics.spacetime import kerr

CAMERA = kc.Camera(spin=0.9, radius=7.0, inclination=1.1, velocity=(0.1, -0.2, 0.3))
OBSERVER = kc.Observer(spin=0.9, inclination=1.1)
SCREEN = 7 * np.random.default_rng(1).normal(size=(100, 2))
PLACES = 41


def near_the_hole(camera: kc.Camera, count: int, spread: float = 0.5) -> np.ndarray:
    """Directions (count, 3) about that to the hole."""
    sky = -np.asarray(camera.frame().basis)[:, 0] + spread * np.random.default_rng(7).normal(size=(count, 3))
    return sky / np.linalg.norm(sky, axis=1, keepdims=True)


SKY = near_the_hole(CAMERA, 100)


@pytest.fixture(scope="module")
def paths() -> RayPaths:
    return kc.ray_paths(CAMERA, SKY, PLACES, beams=True)


@pytest.fixture(scope="module")
def beams() -> Beams:
    return kc.trace_beams(CAMERA, SKY, constants=True)


def off(one: np.ndarray, other: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Differences of matrices, relative to a size."""
    return np.linalg.norm(one - other, axis=(-2, -1)) / size


def assert_ends_are_beams(paths: RayPaths, beams: Beams, least: int) -> None:
    """At infinity the screen is that of e_theta', e_phi'; and the estimates are not lavish."""
    free = beams.escaped & (beams.status != kc.Status.INACCURATE)
    assert free.sum() > least
    gap = off(paths.beams.jacobian[free, -1], beams.jacobian[free], beams.delta_plus[free])
    assert np.all(gap < paths.beams.diameter_error[free, -1] + beams.diameter_error[free])
    assert np.median(gap) < 1e-14 and np.median(paths.beams.diameter_error[free, -1]) < 5e-13
    for name in ("delta_plus", "delta_minus"):
        gap = np.abs(getattr(paths.beams, name)[free, -1] - getattr(beams, name)[free]) / beams.delta_plus[free]
        assert np.all(gap < paths.beams.diameter_error[free, -1] + beams.diameter_error[free])


@pytest.mark.slow
def test_at_infinity_they_are_traced_beams(paths, beams):
    assert_ends_are_beams(paths, beams, 30)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [math.inf, 1e3])
def test_of_observers_they_are_per_length_on_the_screen(radius):
    viewer = kc.Observer(spin=0.9, inclination=1.1, radius=radius)
    assert_ends_are_beams(kc.ray_paths(viewer, SCREEN, 21, beams=True), kc.trace_beams(viewer, SCREEN), 60)


@pytest.mark.slow
def test_the_screen_is_across_the_ray(paths):
    ahead, screen = paths.beams.heading, paths.beams.screen
    assert np.abs(np.linalg.norm(ahead, axis=-1) - 1).max() < 1e-13
    assert np.abs(np.einsum("...ij,...j->...i", screen, ahead)).max() < 1e-13
    assert np.abs(screen @ np.swapaxes(screen, -1, -2) - np.eye(2)).max() < 1e-13
    assert np.abs(np.cross(screen[..., 0, :], screen[..., 1, :]) - ahead).max() < 1e-13
    # It turns slowly along every ray: between places by no more than the ray itself.
    step, turn = (np.linalg.norm(np.diff(part, axis=1), axis=-1) for part in (ahead, screen[..., 0, :]))
    assert np.all(turn < 3 * step + 1e-12)
    assert np.abs(np.einsum("...j,...j", paths.beams.major_axis[:, 1:], ahead[:, 1:])).max() < 1e-13


@pytest.mark.slow
def test_at_the_viewer_a_beam_is_a_point_that_opens(paths):
    assert np.all(paths.beams.jacobian[:, 0] == 0)
    # In a local frame of the size of the first step it opens as in flat space, by the same angle in both directions.
    start = kc.ray_paths(CAMERA, SKY, 3, end=CAMERA.radius * (1 - 1e-5), beams=True)
    near = start.status == kc.Status.ESCAPED
    assert near.sum() > 20
    ratio = start.beams.delta_minus[near, 1] / start.beams.delta_plus[near, 1]
    assert np.all(np.abs(ratio - 1) < 1e-6)


def across(camera: kc.Camera, place: tuple[float, float], beam: Beams, heading: np.ndarray, screen: np.ndarray):
    """A Jacobian of displacements on a sphere, across the ray, over the radius: b from the beam, p_theta by the ray."""
    radius, theta = place
    at, b, sine = kerr.metric(camera.spin, radius, math.cos(theta)), float(beam.impact), math.sin(theta)
    energy = (1 - at.shift * b) / at.lapse
    d_theta, d_phi = beam.jacobian[0], beam.jacobian[1] / sine
    late = -heading[1] * energy * math.sqrt(at.sigma) * d_theta + b * d_phi
    apart = [0 * d_theta, math.sqrt(at.sigma) * d_theta, at.cylindrical_scale * sine * (d_phi - at.shift * late)]
    return screen @ np.stack(apart) / radius


@pytest.mark.slow
def test_along_rays_they_are_traced_beams_to_spheres(paths):
    """The closed form to a radius gives the displacement on a sphere, which is seen across the ray."""
    ratios, ours = [], []
    for ray in np.flatnonzero(paths.status == kc.Status.ESCAPED)[:12]:
        lowest = paths.mino_time[ray, np.argmin(paths.radius[ray])]
        for i in (1, 4, 9, 15, 21, 28, 34, 39):
            radius, second = float(paths.radius[ray, i]), paths.mino_time[ray, i] > lowest
            if abs(i - np.argmin(paths.radius[ray])) < 2:
                continue
            end = kc.Sphere(radius, bool(second and radius < CAMERA.radius))
            beam = kc.trace_beams(CAMERA, SKY[ray], end=end, constants=True)
            at = paths.beams.heading[ray, i], paths.beams.screen[ray, i]
            there = across(CAMERA, (radius, float(paths.theta[ray, i])), beam, *at)
            size = paths.beams.delta_plus[ray, i]
            gap = float(off(paths.beams.jacobian[ray, i], there, size))
            error = float(beam.diameter_error) * np.linalg.norm(there) / size
            ratios.append(gap / (paths.beams.diameter_error[ray, i] + 10 * error))
            ours.append(gap)
    assert len(ours) > 60 and np.median(ours) < 1e-14 and max(ratios) < 1


@pytest.mark.slow
def test_diameters_and_axes_are_those_of_a_slow_integration(paths):
    """The way of JTFT A.2 to places beyond the camera: diameters, and the major axis in space."""
    event = Event(CAMERA.spin, CAMERA.radius, CAMERA.inclination, CAMERA.fido_velocity())
    free = [ray for ray in np.flatnonzero(paths.status == kc.Status.ESCAPED) if abs(paths.index[ray]) <= 1]
    checked = 0
    for ray in free[:5]:
        beyond = np.flatnonzero((paths.radius[ray] > 1.1 * CAMERA.radius) & (paths.radius[ray] < 200))
        for i in beyond[[0, len(beyond) // 2]]:
            radius = float(paths.radius[ray, i])
            slow = pineault_roeder_at(event, SKY[ray], radius)
            plus, minus = paths.beams.delta_plus[ray, i] * radius, paths.beams.delta_minus[ray, i] * radius
            assert plus == pytest.approx(slow.delta_plus, rel=1e-9)
            assert minus == pytest.approx(slow.delta_minus, abs=1e-9 * slow.delta_plus)
            turned = 1e-9 * plus / (plus - abs(minus)) + 1e-12
            assert 1 - abs(slow.axis @ paths.beams.major_axis[ray, i]) < turned**2 + 1e-14
            checked += 1
    assert checked == 10


@pytest.mark.slow
def test_minor_diameters_vanish_at_conjugate_points(paths):
    """As often as the index says, and where."""
    fine = kc.ray_paths(CAMERA, SKY, 401, beams=True)
    sign = np.sign(fine.beams.delta_minus[:, 1:])
    assert np.array_equal((np.diff(sign, axis=1) != 0).sum(axis=1), fine.index)
    assert set(fine.index) >= {0, 1}
    for ray in np.flatnonzero((paths.index >= 1) & (paths.conjugate.radius[:, 0] > CAMERA.radius))[:4]:
        radius, own = paths.conjugate.radius[ray, 0], paths.conjugate.error[ray, 0]
        there = kc.ray_paths(CAMERA, SKY[ray], 2, end=radius, beams=True).beams
        wide = kc.ray_paths(CAMERA, SKY[ray], 2, end=radius * 1.001, beams=True).beams
        slope = abs(wide.delta_minus[-1]) / (0.001 * radius)
        assert (
            abs(there.delta_minus[-1]) < there.diameter_error[-1] * there.delta_plus[-1] + 2 * slope * own * radius**2
        )
        assert abs(there.delta_minus[-1]) < 1e-11 < abs(wide.delta_minus[-1])


@pytest.mark.slow
@pytest.mark.parametrize(
    "camera",
    [CAMERA, kc.Camera(0.999, 2.6), kc.Camera(0.0, 30.0, 0.3, "static"), kc.Camera(0.999, 6.03, 1.5, "fiducial")],
    ids=str,
)
def test_reported_errors_cover_other_steps(camera):
    """Places ten times as dense are reached by other steps: captured rays and those next to the edge, too."""
    sky = near_the_hole(camera, 200, 0.7)
    one, two = (kc.ray_paths(camera, sky, n, beams=True) for n in (31, 301))
    gap = off(one.beams.jacobian, two.beams.jacobian[:, ::10], 1.0)[:, 1:] / one.beams.delta_plus[:, 1:]
    assert np.all(gap < one.beams.diameter_error[:, 1:]) and np.median(gap) < 1e-14
    assert np.array_equal(one.turning_points, two.turning_points)


@pytest.mark.slow
def test_headings_and_turning_points_are_those_of_a_slow_integration(paths, beams):
    for ray in np.flatnonzero(paths.status == kc.Status.ESCAPED)[:4]:
        b, light = float(beams.impact[ray]), paths.beams.heading[ray]
        r, theta = paths.radius[ray, 0], paths.theta[ray, 0]
        momenta = []
        for i in (0, 12, 25):
            at = kerr.metric(CAMERA.spin, paths.radius[ray, i], math.cos(paths.theta[ray, i]))
            energy = (1 - at.shift * b) / at.lapse
            momenta.append(-light[i, :2] * energy * np.sqrt([at.sigma / at.delta, at.sigma]))
        start = np.array([r, theta, 0.0, 0.0, *momenta[0]])
        time = paths.mino_time[ray, -2]
        settings = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "dense_output": True}
        slow = solve_ivp(lambda _, y, b=b: -forward_rates(CAMERA.spin, b, y), (0, time), start, **settings)
        for i, momentum in zip((12, 25), momenta[1:], strict=True):
            assert slow.sol(paths.mino_time[ray, i])[4:] == pytest.approx(momentum, abs=3e-7)
        upward = np.sign(slow.sol(np.linspace(0, time, 4000))[5])
        assert (np.diff(upward) != 0).sum() == paths.turning_points[ray]


@pytest.mark.slow
def test_turning_points_lie_between_crossings(paths, beams):
    """Between two crossings of the plane there is one, before the first and after the last one more at the most."""
    free = beams.escaped
    extra = paths.turning_points[free] - (beams.crossings[free] - 1)
    assert set(extra) >= {0, 1} and set(extra) <= {0, 1, 2}
    equator = kc.Camera(0.9, 10.0)
    flat = kc.ray_paths(equator, [[-0.9, math.sqrt(0.19), 0.0], [-0.9, 0.3, math.sqrt(0.1)]], 21)
    assert flat.turning_points[0] == 0 < flat.turning_points[1]
    # Light of no positive energy has none.
    deep = kc.ray_paths(kc.Camera(0.99, 1.5), [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]], 5, beams=True)
    lost = np.isnan(deep.radius[:, 0])
    assert lost.sum() == 1 and np.all(np.isnan(deep.beams.jacobian[lost])) and np.all(deep.turning_points[lost] == -1)


@pytest.mark.slow
def test_an_ellipse_at_the_camera_is_the_image_of_its_axes(paths, beams):
    """By the singular value decomposition of J times the ellipse; of all ratios and angles at once."""
    ratio, angle = np.array([1.0, 0.6, 0.1, 0.0])[:, None], np.array([0.3, -1.2, 2.0, 7.0])[:, None]
    free = beams.jacobian[beams.escaped]
    some = kc.trace_beams(CAMERA, SKY[beams.escaped])
    found = some.from_ellipse(ratio, angle)
    c, s = np.cos(angle), np.sin(angle)
    axes = np.stack([np.stack([c, -ratio * s], -1), np.stack([s, ratio * c], -1)], -2)
    left, sizes, _ = np.linalg.svd(free @ axes)
    assert found.delta_plus.shape == (4, len(free))
    size = some.delta_plus
    assert np.all(np.abs(found.delta_plus - sizes[..., 0]) < 1e-14 * size)
    assert np.all(np.abs(np.abs(found.delta_minus) - sizes[..., 1]) < 1e-14 * size)
    signed = ratio * some.determinant
    assert np.all(np.abs(found.delta_plus * found.delta_minus - signed) < 1e-13 * size**2)
    turn = np.arctan2(left[..., 1, 0], left[..., 0, 0]) - found.position_angle
    assert np.all(np.abs(np.sin(turn)) < 1e-13 + found.angle_error)
    # That of a circle is the beam's own, wherever its axes are.
    for name in ("delta_plus", "delta_minus", "position_angle"):
        assert np.all(np.abs(getattr(found, name)[0] - getattr(some, name)) < 1e-12 * size)
    along = paths.beams.from_ellipse(0.5, 0.2)
    assert along.delta_plus.shape == paths.radius.shape
    ends = some.from_ellipse(0.5, 0.2)
    gap = np.abs(along.delta_minus[beams.escaped, -1] - ends.delta_minus)
    assert np.all(gap < along.error[beams.escaped, -1] + ends.error)


@pytest.mark.slow
def test_rays_on_an_ellipse_end_on_the_predicted_one(beams):
    """24 rays beside one, on an ellipse of 1e-5 rad: their ends lie on it, where the linear map holds to 1e-4."""
    ray = np.flatnonzero(beams.escaped & (beams.delta_plus < 3))[0]
    ratio, angle, small = 0.4, 0.7, 1e-5
    e_1, e_2 = kc.tangent_basis(SKY[ray])
    c, s = math.cos(angle), math.sin(angle)
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)[:, None]
    aside = np.cos(turn) * (c * e_1 + s * e_2) + ratio * np.sin(turn) * (c * e_2 - s * e_1)
    ends = kc.trace_rays(CAMERA, SKY[ray] + small * aside)
    middle = kc.trace_rays(CAMERA, SKY[ray])
    theta, phi = math.acos(float(middle.direction[2])), float(middle.azimuth)
    e_theta = np.array([math.cos(theta) * math.cos(phi), math.cos(theta) * math.sin(phi), -math.sin(theta)])
    e_phi = np.array([-math.sin(phi), math.cos(phi), 0.0])
    moved = (ends.direction - middle.direction) @ np.stack([e_theta, e_phi]).T / small
    found = kc.trace_beams(CAMERA, SKY[ray]).from_ellipse(ratio, angle)
    c, s = math.cos(found.position_angle), math.sin(found.position_angle)
    major, minor = moved @ np.array([c, s]), moved @ np.array([-s, c])
    assert np.all(np.abs((major / found.delta_plus) ** 2 + (minor / found.delta_minus) ** 2 - 1) < 1e-3)
    assert np.abs(major).max() > 0.98 * found.delta_plus


@pytest.mark.slow
def test_errors_of_ellipses_cover_the_other_engine(beams):
    sky = SKY[beams.escaped]
    one, other = (
        kc.trace_beams(CAMERA, sky, engine).from_ellipse(0.3, 0.9) for engine in ("closed-form", "integrated")
    )
    for name in ("delta_plus", "delta_minus"):
        assert np.all(np.abs(getattr(one, name) - getattr(other, name)) < one.error + other.error)
    turn = np.abs((one.position_angle - other.position_angle + math.pi / 2) % math.pi - math.pi / 2)
    assert np.all(turn < one.angle_error + other.angle_error) and np.median(one.angle_error) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ratio", "angle", "words"),
    [
        (1.5, 0.0, r"`ratio` must lie in \[0, 1\], but is 1.5"),
        (-0.1, 0.0, "`ratio` must lie"),
        ("round", 0.0, "`ratio` must lie"),
        (0.5, math.inf, "`angle` must be finite, but is inf"),
    ],
)
def test_wrong_ellipses_are_named(paths, ratio, angle, words):
    with pytest.raises(ValueError, match=words):
        paths.beams.from_ellipse(ratio, angle)
