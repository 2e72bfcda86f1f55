"""Rays that end at a finite radius or in the equatorial plane, and the coordinate time along rays."""

import math

import numpy as np
import pytest
from beam_equations import Event, photon
from beam_gaps import columns_in_space, relative_gap
from kerr_rays import followed, unit_vector
from random_rays import random_camera, random_sky

import kerrcaustics as kc
from kerrcaustics.beams.beam import Rays, Status
from kerrcaustics.spacetime import kerr

VELOCITY = (0.1, -0.2, 0.3)
EVENTS = [
    Event(0.0, 6.0, math.pi / 2, VELOCITY),
    Event(0.999, 6.03, math.pi / 2, VELOCITY),
    Event(0.999, 2.6, 1.1, VELOCITY),
    Event(0.6, 30.0, 0.4, VELOCITY),
    Event(0.9, 4.0, 2.5, VELOCITY),
]
PLANES = [kc.EquatorialPlane(1), kc.EquatorialPlane(2), kc.EquatorialPlane(3)]


def camera_at(event: Event) -> kc.Camera:
    return kc.Camera(event.spin, event.radius, event.inclination, event.velocity)


def some_sky(event: Event, count: int) -> np.ndarray:
    """Half of the directions from the whole sky, half around the hole."""
    rng = np.random.default_rng(11)
    sky = rng.normal(size=(count, 3))
    sky[::2] = np.array([-1.0, 0.0, 0.0]) + sky[::2] * 4 / (event.radius + 3)
    return sky / np.linalg.norm(sky, axis=1, keepdims=True)


def truth(event: Event, n: np.ndarray, end) -> np.ndarray | None:
    if isinstance(end, kc.EquatorialPlane):
        return followed(event, n, lambda state: math.cos(state[1]), end.crossing)
    return followed(event, n, lambda state: event.radius / state[0] - event.radius / end)


def ends_of(event: Event) -> list:
    horizon = kerr.horizon(event.spin)
    return [horizon * 1.02, event.radius * 0.8, event.radius, event.radius * 1.3, 500.0, *PLANES]


@pytest.mark.parametrize(
    "event", [EVENTS[0], *(pytest.param(event, marks=pytest.mark.slow) for event in EVENTS[1:])], ids=str
)
def test_ends_and_times_against_integration(event):
    sky = some_sky(event, 6)
    arrived = 0
    for end in ends_of(event):
        rays = kc.trace_rays(camera_at(event), sky, end=end, time=True)
        for i, n in enumerate(sky):
            exact = truth(event, n, end)
            assert (exact is not None) == bool(rays.escaped[i])
            if exact is None:
                continue
            r, theta, phi, time = exact
            arrived += 1
            # The integration is good to 1e-11 or so.
            np.testing.assert_allclose(rays.direction[i], unit_vector(theta, phi), atol=2e-10)
            assert rays.azimuth[i] == pytest.approx(phi, abs=2e-10)
            assert rays.radius[i] == pytest.approx(r, rel=2e-10)
            assert rays.time[i] == pytest.approx(time, rel=2e-10)
    assert arrived > 9


def test_more_crossings_against_integration():
    """Rays that wind: the second and third crossings."""
    event = Event(0.9, 5.0, 1.2, (0.0, 0.0, 0.0))
    camera = camera_at(event)
    edge = kc.shadow_edge(camera, 6)
    sky = edge + 1e-3 * np.array([1.0, 0.0, 0.0])
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    found = 0
    for end in PLANES:
        rays = kc.trace_rays(camera, sky, end=end, time=True)
        for i, n in enumerate(sky):
            exact = truth(event, n, end)
            assert (exact is not None) == bool(rays.escaped[i])
            if exact is not None:
                found += 1
                assert rays.radius[i] == pytest.approx(exact[0], rel=1e-8)
                assert rays.time[i] == pytest.approx(exact[3], rel=1e-8)
    assert found > 9


@pytest.mark.parametrize("event", EVENTS[:3], ids=str)
def test_delay_at_infinity_against_integration(event):
    """t - r - 2 ln r has a limit, approached as a series in 1 / r."""
    camera, sky = camera_at(event), some_sky(event, 4)
    rays = kc.trace_rays(camera, sky, time=True)
    assert np.all(rays.radius[rays.escaped] == math.inf) and np.all(rays.outward == rays.escaped)
    assert np.all(np.isnan(rays.radius[~rays.escaped]))
    radii = np.array([500.0, 1000.0, 2000.0, 4000.0])
    powers = (1 / radii[:, None]) ** np.arange(4)
    for i in np.flatnonzero(rays.escaped):
        times = [truth(event, sky[i], radius)[3] for radius in radii]
        limit = np.linalg.solve(powers, np.array(times) - radii - 2 * np.log(radii))[0]
        assert rays.time[i] == pytest.approx(limit, abs=3e-7)


def tortoise(r: float) -> float:
    return r + 2 * math.log(r / 2 - 1)


@pytest.mark.parametrize("end", [2.1, 3.0, 5.9, 6.1, 100.0, 1e6])
def test_time_of_radial_rays_without_spin(end):
    camera = kc.Camera(0.0, 6.0, 1.0, "static")
    rays = kc.trace_rays(camera, [math.copysign(1, end - 6), 0, 0], tolerance=1e-13, end=end, time=True)
    exact = abs(tortoise(end) - tortoise(6.0))
    assert rays.status == Status.ESCAPED
    assert rays.time == pytest.approx(exact, rel=1e-12)
    assert abs(rays.time - exact) <= 10 * rays.time_error


def test_delay_of_the_radial_ray_without_spin():
    rays = kc.trace_rays(kc.Camera(0.0, 6.0, 1.0, "static"), [1, 0, 0], tolerance=1e-13, time=True)
    assert rays.time == pytest.approx(-2 * math.log(2) - tortoise(6.0), abs=1e-13)


def test_far_radius_tends_to_infinity():
    camera = kc.Camera(0.9, 6.0, 1.0)
    sky = random_sky(camera, 64, np.random.default_rng(2))
    far, limit = (kc.trace_beams(camera, sky, end=end, time=True) for end in (1e9, math.inf))
    seen = limit.escaped & (limit.delta_plus < 1e3)
    np.testing.assert_array_equal(far.escaped, limit.escaped)
    np.testing.assert_allclose(far.direction[seen], limit.direction[seen], atol=1e-7)
    np.testing.assert_allclose(columns_in_space(far)[seen], columns_in_space(limit)[seen], rtol=1e-5, atol=1e-5)
    delay = far.time - far.radius - 2 * np.log(far.radius)
    np.testing.assert_allclose(delay[seen], limit.time[seen], atol=1e-5)
    np.testing.assert_allclose(far.redshift[seen], limit.redshift[seen], rtol=1e-8)
    np.testing.assert_array_equal(far.index[seen], limit.index[seen])


def displacement(rays: Rays, plane: bool) -> np.ndarray:
    """Coordinates (n, 2) whose differences are those of the Jacobian's rows, but for a scale of the second."""
    theta = np.arccos(rays.direction[..., 2])
    return np.stack([rays.radius if plane else theta, rays.azimuth], axis=-1)


ENDS = [3.0, 5.0, 9.0, kc.EquatorialPlane(1), kc.EquatorialPlane(2)]


@pytest.mark.parametrize("end", ENDS, ids=str)
def test_jacobian_against_finite_differences(end):
    camera = kc.Camera(0.95, 6.0, 1.2, VELOCITY)
    sky = random_sky(camera, 200, np.random.default_rng(8))[100:]
    if end == kc.EquatorialPlane(2):
        sky = kc.shadow_edge(camera, 100) + 0.02 * np.array([1.0, 0.0, 0.0])
        sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    beams = kc.trace_beams(camera, sky, end=end, time=True)
    seen = beams.escaped & (beams.delta_plus < 1e3)
    assert seen.sum() > 10
    plane = isinstance(end, kc.EquatorialPlane)
    scale = beams.radius if plane else np.hypot(beams.direction[:, 0], beams.direction[:, 1])
    for column, tangent in enumerate(kc.tangent_basis(sky)):
        h = 2e-4
        sides = {}
        for k in (-2, -1, 1, 2):
            moved = sky * math.cos(k * h) + tangent * math.sin(k * h)
            sides[k] = displacement(kc.trace_rays(camera, moved, tolerance=1e-13, end=end, time=True), plane)
        slope = (8 * (sides[1] - sides[-1]) - (sides[2] - sides[-2])) / (12 * h)
        slope[:, 1] *= scale
        gap = np.linalg.norm(slope - beams.jacobian[..., column], axis=-1) / beams.delta_plus
        assert np.median(gap[seen]) < 1e-8
        assert np.quantile(gap[seen], 0.9) < 1e-5


def assert_honest(camera: kc.Camera, sky: np.ndarray, end) -> int:
    """Compare tolerance 1e-10 with 1e-14: errors within ten times what was reported."""
    exact = kc.trace_beams(camera, sky, tolerance=1e-14, end=end, time=True)
    beams = kc.trace_beams(camera, sky, end=end, time=True)
    rays = kc.trace_rays(camera, sky, end=end, time=True)
    seen = exact.escaped
    for ends in (beams, rays):
        assert np.array_equal(ends.escaped, seen)
        error = np.linalg.norm(ends.direction - exact.direction, axis=-1)
        if isinstance(end, kc.EquatorialPlane):
            error = np.maximum(error, np.abs(ends.radius / exact.radius - 1))
        assert np.all(error[seen] <= 10 * ends.error[seen])
        assert np.all(np.abs(ends.time - exact.time)[seen] <= 10 * ends.time_error[seen])
    assert np.all(relative_gap(beams, exact, end)[seen] <= 10 * beams.diameter_error[seen])
    # Without spin every crossing of a camera's own plane is a conjugate point: on which side is open.
    known = seen & (np.abs(exact.delta_minus) > 1e-9 * exact.delta_plus)
    assert np.array_equal(beams.index[known], exact.index[known])
    assert np.array_equal(beams.crossings[seen], exact.crossings[seen])
    return int(seen.sum())


def random_ends(camera: kc.Camera, rng: np.random.Generator) -> list:
    horizon = kerr.horizon(camera.spin)
    near = max(horizon * 1.001, camera.radius * 10 ** rng.uniform(-0.3, 0.3))
    return [math.inf, horizon + 10 ** rng.uniform(-3, 1), near, kc.EquatorialPlane(int(rng.integers(1, 3)))]


def test_honest_on_random_cameras():
    rng = np.random.default_rng(1919)
    seen = 0
    for _ in range(16):
        camera = random_camera(rng)
        sky = random_sky(camera, 200, rng)
        seen += sum(assert_honest(camera, sky, end) for end in random_ends(camera, rng))
    assert seen > 5000


def test_statuses_and_what_was_not_asked_for():
    camera = kc.Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 60, np.random.default_rng(6)).reshape(3, 20, 3)
    plain = kc.trace_rays(camera, sky)
    assert (plain.time, plain.time_error, plain.redshift) == (None, None, None)
    beams = kc.trace_beams(camera, kc.shadow_edge(camera, 9)[0] - [0, 0, 0.1], crossings=False, redshift=False)
    assert (beams.time, beams.crossings, beams.redshift) == (None, None, None)
    timed = kc.trace_rays(camera, sky, end=3.0, time=True, redshift=True)
    for values in (timed.radius, timed.time, timed.time_error, timed.redshift, timed.status):
        assert values.shape == (3, 20)
    # Below the camera arrives what is captured, or turns below 3; the rest misses it.
    assert set(np.unique(timed.status)) == {Status.ESCAPED, Status.MISSED}
    assert np.all(timed.escaped[plain.status == Status.CAPTURED])
    assert np.isnan(timed.time[~timed.escaped]).all()
    assert np.all(timed.time[timed.escaped] > 0)
    above = kc.trace_rays(camera, sky, end=7.0, time=True)
    assert np.array_equal(above.status == Status.CAPTURED, plain.status == Status.CAPTURED)
    assert not (above.status == Status.MISSED).any()
    assert all(status.sentence for status in Status)


def test_time_does_not_change_the_rays():
    camera = kc.Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 60, np.random.default_rng(3))
    plain, timed = kc.trace_rays(camera, sky), kc.trace_rays(camera, sky, time=True)
    np.testing.assert_allclose(timed.direction, plain.direction, atol=1e-9)


def test_parity_follows_the_index():
    """A sphere is met from inside or, with the other sense, from outside."""
    camera = kc.Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 200, np.random.default_rng(5))
    for end, sense in ((9.0, 1), (3.0, -1)):
        beams = kc.trace_beams(camera, sky, end=end, time=True)
        seen = beams.escaped
        assert np.array_equal(beams.parity[seen], sense * (-1.0) ** beams.index[seen])
        assert beams.index.shape == (200,) and np.all(beams.index[~seen] == -1)


def test_crossings_up_to_the_end():
    camera = kc.Camera(0.9, 6.0, 1.2)
    sky = random_sky(camera, 100, np.random.default_rng(6))
    beams = kc.trace_beams(camera, sky, end=kc.EquatorialPlane(2), time=True)
    assert beams.escaped.any()
    assert set(beams.crossings[beams.escaped]) == {2}
    assert np.all(beams.direction[beams.escaped][:, 2] == pytest.approx(0, abs=1e-12))


def test_rays_in_the_plane_do_not_cross_it():
    camera = kc.Camera(0.9, 6.0)
    angle = np.linspace(0, 2 * math.pi, 16, endpoint=False)
    sky = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    rays = kc.trace_rays(camera, sky, end=kc.EquatorialPlane(), time=True)
    assert np.array_equal(rays.status == Status.CAPTURED, kc.trace_rays(camera, sky).status == Status.CAPTURED)
    assert not rays.escaped.any()


def frequency(spin: float, r: float, theta: float, b: float, emitter: str) -> float:
    """-p.u of a photon of unit energy for a source in azimuthal motion, from the metric; NaN if there is none."""
    s2 = math.sin(theta) ** 2
    sigma = r * r + (spin * math.cos(theta)) ** 2
    g_tt, g_tp = -(1 - 2 * r / sigma), -2 * spin * r * s2 / sigma
    g_pp = (r * r + spin**2 + 2 * spin**2 * r * s2 / sigma) * s2
    rate = {
        "circular": 1 / (r**1.5 + spin),
        "retrograde": -1 / (r**1.5 - spin),
        "static": 0.0,
        "fiducial": -g_tp / g_pp,
    }[emitter]
    norm = -(g_tt + 2 * rate * g_tp + rate**2 * g_pp)
    return (1 - rate * b) / math.sqrt(norm) if norm > 0 else math.nan


@pytest.mark.parametrize("event", EVENTS, ids=str)
@pytest.mark.parametrize("emitter", ["circular", "retrograde", "static", "fiducial"])
def test_redshift_of_emitters_in_the_plane(emitter, event):
    sky = some_sky(event, 12)
    rays = kc.trace_rays(camera_at(event), sky, end=kc.EquatorialPlane(1, emitter), time=True, redshift=True)
    for i in np.flatnonzero(rays.escaped):
        light = photon(event, sky[i])
        source = frequency(event.spin, rays.radius[i], math.pi / 2, light.b, emitter)
        assert rays.redshift[i] == pytest.approx(light.camera_energy / source, rel=1e-9, nan_ok=True)


def test_redshift_of_static_sources_on_a_sphere():
    event = EVENTS[2]
    sky = some_sky(event, 20)
    for end in (1.5, 2.3, 8.0):
        rays = kc.trace_rays(camera_at(event), sky, end=end, time=True, redshift=True)
        assert rays.escaped.any()
        for i in np.flatnonzero(rays.escaped):
            light = photon(event, sky[i])
            theta = math.acos(rays.direction[i, 2])
            source = frequency(event.spin, end, theta, light.b, "static")
            assert rays.redshift[i] == pytest.approx(light.camera_energy / source, rel=1e-9, nan_ok=True)


def test_redshift_of_a_disk_seen_face_on():
    """Bardeen, Press & Teukolsky 1972: without spin and with b = 0, g is sqrt(1 - 3 / r) over the camera's own."""
    camera = kc.Camera(0.0, 1000.0, 0.0, "static")
    angle = np.linspace(0.006, 0.03, 20)
    sky = np.stack([-np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    rays = kc.trace_rays(camera, sky, end=kc.EquatorialPlane(), time=True, redshift=True)
    expected = np.sqrt(1 - 3 / rays.radius) / math.sqrt(1 - 2 / 1000.0)
    assert rays.escaped.all()
    np.testing.assert_allclose(rays.redshift, expected, rtol=1e-10)


@pytest.mark.parametrize("end", [1.0, -3, math.nan, "plane", None, True, kc.EquatorialPlane, 1 + math.sqrt(0.19)])
def test_what_is_no_end_is_refused(end):
    with pytest.raises(ValueError, match=r"^Argument `end` must be .*, but is .*\.$"):
        kc.trace_rays(kc.Camera(0.9, 6.0), [1, 0, 0], end=end)


@pytest.mark.parametrize(("name", "value"), [("crossing", 0), ("crossing", 1.5), ("emitter", "comoving")])
def test_what_is_no_plane_is_refused(name, value):
    with pytest.raises(ValueError, match=rf"^Argument `{name}` must be .*, but is .*\.$"):
        kc.EquatorialPlane(**{name: value})
