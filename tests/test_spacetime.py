"""The Kerr metric's special orbits, cameras and their frames."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from offenders import for_each

from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.spacetime import frame as frames, kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.frame import fido_from_sky, line_of_sight_from_sky, sky_from_fido, sky_from_line_of_sight

pytestmark = pytest.mark.usefixtures("compiled_code")

RAYS = json.loads((Path(__file__).parent / "data" / "rays.json").read_text(encoding="utf-8"))


@st.composite
def any_camera(draw) -> Camera:
    """Cameras of every spin, radius and inclination, at any velocity up to 0.99."""
    spin = draw(st.one_of(st.just(0.0), st.floats(0, 0.999999)))
    radius = kerr.horizon(spin) + 10 ** draw(st.floats(-3, 5))
    inclination = draw(st.one_of(st.sampled_from([0.0, math.pi / 2, math.pi]), st.floats(0, math.pi)))
    speed, direction = draw(st.one_of(st.just(0.0), st.floats(1e-12, 0.99))), draw(any_direction())
    return Camera(spin, radius, inclination, tuple(float(speed * part) for part in direction))


@st.composite
def any_direction(draw) -> np.ndarray:
    z, phi = draw(st.floats(-1, 1)), draw(st.floats(0, 2 * math.pi))
    s = math.sqrt(1 - z * z)
    return np.array([s * math.cos(phi), s * math.sin(phi), z])


# Special orbits.


@pytest.mark.parametrize(
    ("spin", "horizon", "isco", "inner", "outer", "b_low", "b_high"),
    [
        (0.999, 1.044710, 1.181765, 1.052081, 3.999111, -6.998333, 2.078130),
        (0.6, 1.8, 3.829069, 2.188914, 3.629850, -6.315649, 3.838494),
    ],
)
def test_special_orbits(spin, horizon, isco, inner, outer, b_low, b_high):
    assert kerr.horizon(spin) == pytest.approx(horizon, abs=6e-7)
    assert kerr.isco(spin) == pytest.approx(isco, abs=6e-7)
    assert kerr.photon_orbits(spin) == pytest.approx((inner, outer), abs=6e-7)
    ends = [kerr.spherical_orbit_impact(spin, r) for r in kerr.photon_orbits(spin)]
    assert ends == pytest.approx([b_high, b_low], abs=6e-7)


def test_special_orbits_without_spin():
    assert kerr.horizon(0.0) == 2
    assert kerr.inner_horizon(0.0) == 0
    assert kerr.ergosphere(0.0, 0.3) == 2
    assert kerr.isco(0.0) == pytest.approx(6, rel=1e-15)
    spins = np.array([[0.0, 0.1], [0.9, 0.998]])
    for prograde in (True, False):
        several = kerr.isco(spins, prograde)
        assert several.tolist() == [[kerr.isco(spin, prograde) for spin in row] for row in spins]
    assert kerr.isco([]).shape == (0,)
    assert kerr.photon_orbits(0.0) == pytest.approx((3, 3), rel=1e-15)


def test_extremal_orbits_of_retrograde_motion():
    assert kerr.isco(1 - 1e-15, prograde=False) == pytest.approx(9, abs=1e-12)
    assert kerr.photon_orbits(1 - 1e-15)[1] == pytest.approx(4, abs=1e-12)


@pytest.mark.parametrize("spin", [1e-6, 0.1, 0.6, 0.999, 0.99999])
def test_spherical_orbits_invert(spin):
    """From a radius to b and back, and R = R' = 0 there."""
    inner, outer = kerr.photon_orbits(spin)
    radius = inner + (outer - inner) * np.linspace(0.01, 0.99, 50)
    b = kerr.spherical_orbit_impact(spin, radius)
    found, q = kerr.spherical_orbit_of_impact(spin, b)
    # b(r) is flat where r - 1 is small, at the prograde end of a nearly extremal hole.
    assert np.all(np.abs(found - radius) < 1e-14 + 2e-15 / (radius - 1) ** 2)
    second, first, zeroth = spin**2 - b**2 - q, 2 * ((b - spin) ** 2 + q), -(spin**2) * q
    assert np.abs(found**4 + second * found**2 + first * found + zeroth).max() < 2e-12
    assert np.abs(4 * found**3 + 2 * second * found + first).max() < 2e-12


def test_spherical_orbit_without_spin():
    r, q = kerr.spherical_orbit_of_impact(0.0, np.linspace(-5, 5, 11))
    assert np.allclose(r, 3, rtol=1e-14)
    assert np.allclose(q + np.linspace(-5, 5, 11) ** 2, 27, rtol=1e-14)


# Cameras.


@pytest.mark.parametrize(
    ("radius", "velocity", "speed", "digits"),
    [
        (2.6, "circular", 0.54635, 5),
        (2.6, "static", -0.48048, 5),
        (6.03, "circular", 0.408196, 6),
        (6.03, "static", -0.065876, 6),
        (6.03, "fiducial", 0.0, 12),
    ],
)
def test_named_speeds(radius, velocity, speed, digits):
    v_r, v_theta, v_phi = Camera(0.999, radius, velocity=velocity).fido_velocity()
    assert (v_r, v_theta) == (0, 0)
    assert v_phi == pytest.approx(speed, abs=0.6 * 10**-digits)


def test_static_camera_seen_from_the_circular_one():
    static = Camera(0.999, 2.6, velocity="static").fido_velocity()[2]
    circular = Camera(0.999, 2.6, velocity="circular").fido_velocity()[2]
    assert (static - circular) / (1 - static * circular) == pytest.approx(-0.81332, abs=6e-6)


def test_metric_functions_of_the_near_camera():
    at = kerr.metric(0.999, 2.6, 0.0)
    assert (at.lapse, at.shift, at.cylindrical_scale) == pytest.approx((0.547754, 0.090135, 2.919879), abs=6e-7)


@pytest.mark.parametrize("inclination", [0.0, 1.0, math.pi / 2, math.pi])
def test_exact_sines_and_cosines(inclination):
    camera = Camera(0.5, 4.0, inclination, "fiducial")
    assert camera.on_equator == (inclination == math.pi / 2)
    assert camera.on_axis == (inclination in (0.0, math.pi))
    assert camera.cos_theta == pytest.approx(math.cos(inclination), abs=1e-15)
    assert camera.sin_theta == pytest.approx(math.sin(inclination), abs=1e-15)


@given(any_camera())
@settings(derandomize=True, deadline=None)
def test_basis_is_orthonormal_and_right_handed(camera):
    frame = camera.frame()
    basis = np.array(frame.basis)
    assert np.abs(basis @ basis.T - np.eye(3)).max() < 1e-13
    assert np.linalg.det(basis) == pytest.approx(1, abs=1e-13)
    assert frame.speed * basis[1] == pytest.approx(camera.fido_velocity(), abs=1e-15)
    # (r, theta, phi) is right-handed; e_x lies in the plane of e_r and e_phi.
    assert basis[0, 1] == 0


@pytest.mark.parametrize("velocity", ["fiducial", "circular", (0.0, 0.0, -0.5)])
def test_basis_at_rest_and_in_azimuthal_motion(velocity):
    basis = np.array(Camera(0.9, 5.0, velocity=velocity).frame().basis)
    assert np.array_equal(basis, [[1, 0, 0], [0, 0, 1], [0, -1, 0]])


@given(any_camera(), any_direction())
@settings(derandomize=True, deadline=None)
def test_aberration_there_and_back(camera, sky):
    frame = camera.frame()
    photon = np.array(fido_from_sky(frame, tuple(sky)))
    # The factor (1 + beta) / (1 - beta), up to 199, multiplies round-off.
    gain = (1 + abs(frame.speed)) / (1 - abs(frame.speed))
    assert np.linalg.norm(photon) == pytest.approx(1, abs=1e-15 * (5 + gain))
    assert np.abs(sky_from_fido(frame, photon) - sky).max() < 1e-15 * (9 + gain)


@given(any_camera(), any_direction())
@settings(derandomize=True, deadline=None)
def test_two_cameras_at_one_event_see_each_others_directions(camera, sky):
    moving, still = camera.frame(), camera.at_rest().frame()
    gain = (1 + abs(moving.speed)) / (1 - abs(moving.speed))
    assert np.abs(as_seen(as_seen(sky, moving, still), still, moving) - sky).max() < 1e-15 * (9 + gain)
    ahead = np.stack([sky, -sky])
    assert np.array_equal(as_seen(ahead, moving, still)[0], as_seen(sky, moving, still))
    assert np.array_equal(
        sky_from_line_of_sight(moving, line_of_sight_from_sky(moving, ahead)), as_seen(ahead, moving, moving)
    )


def test_light_from_ahead_moves_backward():
    """A camera looks along its motion at light that moves against it, whatever the speed."""
    frame = Camera(0.9, 5.0, 1.0, (0.2, -0.3, 0.5)).frame()
    photon = fido_from_sky(frame, (0.0, 1.0, 0.0))
    assert np.allclose(photon, -np.array(frame.basis[1]), atol=1e-15)


def test_aberration_crowds_the_sky_ahead():
    """cos(angle from the motion) on the camera sky = (c + beta) / (1 + beta c), c at rest."""
    frame = Camera(0.0, 10.0, velocity=(0.0, 0.0, 0.6)).frame()
    sky = sky_from_line_of_sight(frame, np.array([1.0, 0.0, 0.0]))
    assert np.allclose(sky, [0.8, 0.6, 0.0], atol=1e-15)


@for_each(ray=RAYS)
def test_redshift_of_reference_rays(ray):
    camera = Camera(ray["a"], ray["r_c"], math.radians(ray["theta_c_deg"]), (0.0, 0.0, ray["beta"]))
    ratio = float(frames.redshift(camera.frame(), np.array(ray["N"])))
    assert ratio == pytest.approx(ray["redshift_fc_over_fprime"], rel=1e-13)


@given(any_camera(), any_direction())
@settings(max_examples=300, derandomize=True, deadline=None)
def test_photon_is_null_and_has_its_constants(camera, sky):
    """g^ab p_a p_b = 0 and Carter's constant, by the inverse metric typed in afresh."""
    frame = camera.frame()
    light = frames.photon_of(frame, tuple(sky))
    a, r, s, c = camera.spin, camera.radius, camera.sin_theta, camera.cos_theta
    if s < 1e-3 or abs(light.energy_ratio) < 1e-3:
        # Spherical coordinates fail on the axis, and so does unit energy for photons that have none.
        return
    delta = (r - kerr.horizon(a)) * (r - kerr.inner_horizon(a))
    p_r = light.rate[0] * r * r / delta
    p_theta = light.rate[3] / s
    axial = (r * r + a * a - a * light.b) ** 2 / delta
    terms = [delta * p_r**2, p_theta**2, (light.b / s - a * s) ** 2, -axial]
    assert abs(sum(terms)) <= 1e-13 * sum(map(abs, terms)) / camera_margin(a, r)
    scale = p_theta**2 + (light.b / s) ** 2 + 1
    assert light.q == pytest.approx(p_theta**2 + c * c * ((light.b / s) ** 2 - a * a), abs=1e-13 * scale)
    assert light.k == pytest.approx(light.q + light.b**2, abs=1e-13 * scale)
    assert light.kappa == pytest.approx(light.q + (light.b - a) ** 2, abs=1e-13 * scale)


def camera_margin(spin: float, radius: float) -> float:
    """Relative height above the horizon, which Delta is the difference of."""
    return min(1.0, radius - kerr.horizon(spin))


# What is refused, and what is said.


@for_each(
    "arguments",
    "message",
    rows=[
        ({"spin": 1.0}, "Argument `spin` must lie in [0, 1), but is 1."),
        ({"spin": -0.1}, "Argument `spin` must lie in [0, 1), but is -0.1: the mirror image, spin 0.1"),
        ({"spin": math.nan}, "Argument `spin` must be a finite number, but is nan."),
        ({"spin": "fast"}, "Argument `spin` must be a finite number, but is 'fast'."),
        ({"radius": 1.0}, "Argument `radius` must be larger than the horizon radius"),
        ({"radius": math.inf}, "Argument `radius` must be a finite number, but is inf: farther away, take an Observer"),
        ({"radius": None}, "Argument `radius` must be a finite number, but is None."),
        ({"inclination": -0.1}, "Argument `inclination` must lie in [0, pi] radians"),
        ({"inclination": 3.2}, "Argument `inclination` must lie in [0, pi] radians"),
        ({"inclination": math.nan}, "Argument `inclination` must be a finite number"),
        ({"velocity": "orbiting"}, "Argument `velocity` must be circular, fiducial, static or a vector"),
        (
            {"velocity": (0.1, 0.2)},
            "Argument `velocity` must be circular, fiducial, static or three finite numbers",
        ),
        ({"velocity": (0.1, math.nan, 0)}, "Argument `velocity` must be circular, fiducial, static or three"),
        ({"velocity": 0.5}, "Argument `velocity` must be circular, fiducial, static or three finite numbers"),
        ({"velocity": (0.6, 0.0, 0.8)}, "Argument `velocity` must have a speed below 1 (light), but has 1."),
        (
            {"velocity": "circular", "inclination": 1.0},
            "Argument `velocity` must not be circular off the equator",
        ),
        (
            {"velocity": "circular", "radius": 1.5},
            "Argument `velocity` must not be circular at or inside the photon",
        ),
        (
            {"velocity": "static", "radius": 1.9},
            "Argument `velocity` must not be static at or inside the ergosphere",
        ),
    ],
)
def test_bad_camera_is_refused(arguments, message):
    good = {"spin": 0.9, "radius": 5.0, "inclination": math.pi / 2, "velocity": "fiducial"}
    with pytest.raises(ValueError, match=re.escape(message)):
        Camera(**good | arguments)


def test_photon_orbit_itself_is_refused():
    with pytest.raises(ValueError, match="photon orbit"):
        Camera(0.9, kerr.photon_orbits(0.9)[0], velocity="circular")


def test_static_camera_in_the_ergosphere_of_the_equator_may_stand_over_the_pole():
    assert Camera(0.9, 1.9, 0.1, "static").fido_velocity()[2] < 0


@pytest.mark.parametrize("value", [True, 2.0, 0, 11, "3", None])
def test_no_whole_number_is_refused_in_one_grammar(value):
    with pytest.raises(ValueError, match=f"`n` must be a whole number from 1 to 10, but is {value!r}"):
        whole_number("n", value, 1, 10)


def test_whole_numbers_become_int():
    assert type(whole_number("n", np.int32(3), 1)) is int
    with pytest.raises(ValueError, match="whole number from 1, but is 0"):
        whole_number("n", 0, 1)
