"""Line profiles and isoradials against slower sums; the study of disks, check by check."""

import math
from dataclasses import replace

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.disk.emission import page_thorne_flux
from kerrcaustics.scenes.disk.profile import barycentric, binned, round_about
from kerrcaustics.scenes.disk.ring_images import middle, ring_images
from kerrcaustics.scripts import STUDIES
from kerrcaustics.spacetime import kerr

light, rays, schwarzschild, screen, twin = (
    STUDIES.module(f"disk_checks.{name}") for name in ("light", "rays", "schwarzschild", "screen", "twin")
)
NEAR = kc.Camera(0.9, 30.0, math.radians(75), "static")
FAST = (light.iscos, light.peaks, light.flux, light.efficiency)
SLOW = [pytest.param(check, marks=pytest.mark.slow) for check in (rays.landings, rays.long_ray)]


@pytest.mark.parametrize("check", [*FAST, *SLOW])
def test_check_holds(check):
    assert check().verdict == "holds"


def test_a_check_can_fail():
    good = light.iscos()
    assert replace(good, miss=2 * good.bound).verdict == "fails" == replace(good, miss=math.nan).verdict


@pytest.mark.slow
def test_closed_isoradials_are_where_rays_land():
    exact, far = rays.closed_isoradials(turns=20)
    assert exact.verdict == far.verdict == "holds"
    assert far.miss > 1e3 * exact.miss


def test_closed_form_is_continuous_at_the_critical_impact_parameter():
    b = schwarzschild.CRITICAL * (1 + np.array([-1e-9, 1e-9]))
    falls, turns = schwarzschild.reciprocal_radius(b, np.full(2, 1.5), 0.0)
    assert falls == pytest.approx(turns, rel=1e-7)
    # Far from the hole a ray is straight.
    assert schwarzschild.reciprocal_radius(np.array([1e6]), np.array([1.0]), 0.0) == pytest.approx(1e-6 * math.sin(1))


@pytest.mark.parametrize("crossing", [1, 2])
def test_the_twin_agrees_with_the_closed_form(crossing):
    """Neither knows the package."""
    inclination, turn = 1.2, (np.arange(8) + 0.5) * math.pi / 4
    b = schwarzschild.isoradial(8.0, inclination, turn, crossing)
    assert twin.Screen(0.0, inclination).isoradial(8.0, turn, crossing) == pytest.approx(b, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "crossing", "motion"),
    [
        (NEAR, 1, "circular"),
        pytest.param(NEAR, 3, "retrograde", marks=pytest.mark.slow),
        pytest.param(kc.Camera(0.5, 20.0, 0.0, "static"), 2, "circular", marks=pytest.mark.slow),
        (kc.Camera(0.998, 1e8, 1.5, "fiducial"), 1, "plunging"),
        (kc.Camera(0.7, 9.0, 2.0, (0.1, 0.3, -0.2)), 1, "static"),
    ],
)
def test_isoradials_land_on_their_rings(camera, crossing, motion):
    radius, turn = (part.ravel() for part in np.meshgrid([2.5, 4.5, 11.0], np.arange(12) * math.pi / 6))
    found = ring_images(camera, radius, turn, crossing, motion)
    landed = kc.trace_rays(camera, found.sky, end=kc.EquatorialPlane(crossing, motion), redshift=True)
    assert landed.radius == pytest.approx(radius, rel=max(1e-10, 1e-15 * camera.radius))
    assert np.array_equal(np.isnan(found.redshift), np.isnan(landed.redshift))
    step = 1e-4
    (left, right), (lower, upper) = (
        [ring_images(camera, radius * (1 + k * dr), turn + k * dt, crossing, motion).sky for k in (-1, 1)]
        for dr, dt in ((step, 0), (0, step))
    )
    solid_angle = np.linalg.norm(np.cross(right - left, upper - lower), axis=1) / (2 * step) ** 2
    assert found.solid_angle == pytest.approx(solid_angle, rel=1e-4)


@pytest.mark.slow
def test_the_middle_never_meets_the_plane():
    for camera in (NEAR, kc.Camera(0.998, 1e6, 0.4, "static"), kc.Camera(0.7, 9.0, 2.0, (0.1, 0.3, -0.2))):
        assert kc.trace_rays(camera, middle(camera), end=kc.EquatorialPlane(1)).status == kc.Status.CAPTURED
        b, _ = screen.momenta(camera, middle(camera)[None])
        assert b == pytest.approx(camera.spin * camera.sin_theta**2, abs=1e-8 * camera.radius)


def histogram(camera, inner, outer, power, edges, crossing, side, half, motion):
    """The same profile from a square of rays about the hole."""
    step = ((np.arange(side) + 0.5) / side * 2 - 1) * half
    x, y = (part.ravel() for part in np.meshgrid(step, step))
    sky = np.stack([-np.ones_like(x), x, y], axis=-1)
    landed = kc.trace_rays(camera, sky, end=kc.EquatorialPlane(crossing, motion), redshift=True)
    on = (landed.radius >= inner) & (landed.radius <= outer)
    solid = (2 * half / side) ** 2 / (1 + x[on] ** 2 + y[on] ** 2) ** 1.5
    return np.histogram(
        landed.redshift[on], edges, weights=landed.redshift[on] ** 4 * solid / landed.radius[on] ** power
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("crossing", "inner", "motion"),
    [(1, 4.0, "circular"), (2, 4.0, "circular"), (1, 3.0, "plunging"), (1, 3.0, "retrograde-plunging")],
)
def test_profile_is_that_of_many_rays(crossing, inner, motion):
    edges = np.linspace(0.0, 1.5, 16)
    found = kc.line_profile(NEAR, inner, 12.0, 2.0, crossing=crossing, motion=motion, bins=edges)
    reported, _ = histogram(NEAR, inner, 12.0, 2.0, edges, crossing, 500 if crossing == 1 else 350, 0.5, motion)
    assert np.abs(found.flux - reported).max() < (0.02 if crossing == 1 else 0.03) * found.flux.max()
    assert found.flux.sum() == pytest.approx(reported.sum(), rel=2e-3 if crossing == 1 else 1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spin", "inclination", "inner", "outer", "crossing"),
    [
        (0.6, 60, 4.0, 20.0, 1),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in ((0.6, 60, 4.0, 20.0, 2), (0.998, 80, 1.3, 15.0, 1), (0.0, 20, 6.0, 6.1, 1))
        ),
    ],
)
def test_reported_errors_of_profiles_are_honest_and_fall(spin, inclination, inner, outer, crossing):
    camera = kc.Camera(spin, 1e6, math.radians(inclination), "static")
    bins = np.linspace(0.1, 1.5, 71)
    best = kc.line_profile(camera, inner, outer, crossing=crossing, bins=bins, radii=24, turns=240)
    errors = []
    for radii, turns in ((8, 40), (16, 120)):
        found = kc.line_profile(camera, inner, outer, crossing=crossing, bins=bins, radii=radii, turns=turns)
        assert (np.abs(found.flux - best.flux) <= found.error + best.error + 1e-12 * best.flux.max()).all()
        errors.append(found.error.max())
    assert best.error.max() < errors[1] < errors[0]
    assert best.error.max() < 0.05 * best.flux.max()


@pytest.mark.slow
def test_profiles_of_laws_and_bins():
    power = kc.line_profile(NEAR, 4.0, 12.0, 2.0, bins=20, radii=8, turns=64)
    law = kc.line_profile(NEAR, 4.0, 12.0, lambda r: 3 / r**2, bins=power.edges, radii=8, turns=64)
    assert law.flux == pytest.approx(3 * power.flux, rel=1e-12)
    coarse = kc.line_profile(NEAR, 4.0, 12.0, 2.0, bins=power.edges[::5], radii=8, turns=64)
    assert coarse.flux == pytest.approx(power.flux.reshape(4, 5).sum(axis=1), rel=1e-10)
    assert len(power.flux) == 20 and power.flux.min() >= 0 and power.rays > 9 * 64
    dark = kc.line_profile(NEAR, 4.0, 12.0, lambda r: page_thorne_flux(0.9, 0 * r), radii=4, turns=8)
    assert not dark.flux.any()


@pytest.mark.slow
def test_bins_hold_frequencies_alone():
    # Light of matter that falls through the horizon comes from there at a frequency of 0.
    found = kc.line_profile(NEAR, 1.45, 4.0, motion="plunging", bins=40, radii=8, turns=16)
    assert found.edges[0] == 0 and (np.diff(found.edges) > 0).all()


@pytest.mark.slow
def test_a_profile_that_cannot_be_reported_is_unknown():
    # The ninth image lies closer to the shadow edge than directions can resolve from as far.
    unknown = kc.line_profile(kc.Camera(0.3, 1e8, 1.0, "static"), 6.0, 7.0, crossing=9, bins=5, radii=4, turns=4)
    assert np.isnan(unknown.flux).all() and np.isinf(unknown.error).all()


@pytest.mark.slow
def test_a_ring_face_on_is_one_frequency():
    camera = kc.Camera(0.0, 1e8, 0.0, "static")
    found = kc.line_profile(camera, 10.0, 10.001, 0.0, bins=[0.8, 0.83, math.sqrt(0.7) + 5e-5, 0.9], radii=4, turns=8)
    assert found.flux[0] == found.flux[2] == 0 and found.flux[1] > 0


def test_cells_are_shared_among_bins():
    rng = np.random.default_rng(1)
    shift, one, other, weight = rng.uniform(0, 1, 30), *rng.uniform(-0.5, 0.5, (2, 30)), rng.uniform(0, 1, 30)
    edges = np.linspace(-1, 2, 40)
    within = (np.arange(300) + 0.5) / 300 - 0.5
    places = shift[:, None, None] + one[:, None, None] * within[:, None] + other[:, None, None] * within
    reported = np.histogram(places, edges, weights=np.broadcast_to(weight[:, None, None] / 300**2, places.shape))[0]
    found = binned(shift, one, other, weight, edges)
    assert found == pytest.approx(reported, abs=3e-3) and found.sum() == pytest.approx(weight.sum(), rel=1e-12)


def test_nodes_say_what_lies_between():
    node = 2 + 1.5 * (1 - np.cos(math.pi * np.arange(17) / 16))
    at = np.linspace(2.01, 4.93, 50)
    value, slope = barycentric(node, at)
    assert value @ np.sin(node) == pytest.approx(np.sin(at), abs=1e-13)
    assert slope @ np.sin(node) == pytest.approx(np.cos(at), abs=1e-11)
    turn = np.arange(32) * math.pi / 16
    between = (np.arange(96) + 0.5) * math.pi / 48
    assert round_about(np.exp(np.sin(turn)), 3) == pytest.approx(np.exp(np.sin(between)), abs=1e-13)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"camera": kc.Camera(0.5, 30.0)}, "`camera` must not lie in the equatorial plane"),
        ({"camera": "far"}, "`camera` must be a Camera"),
        ({"inner": 1.0}, "`inner` must be finite and larger than the horizon"),
        (
            {"inner": kerr.photon_orbits(0.9)[0] - 0.01},
            "`inner` must be a radius where `motion` 'circular' is possible",
        ),
        ({"outer": 3.0}, "`outer` must be larger than `inner`"),
        ({"emissivity": "steep"}, "`emissivity` must be a number or a function"),
        pytest.param(
            {"emissivity": lambda r: -r}, "`emissivity` must be a function whose values", marks=pytest.mark.slow
        ),
        ({"motion": "fast"}, "`motion` must be one of"),
        ({"crossing": 0}, "`crossing` must be a whole number"),
        ({"bins": 0}, "`bins` must be a whole number"),
        ({"bins": [1.0, 0.5]}, "`bins` must be a whole number, or ascending edges"),
        ({"radii": 7}, "`radii` must be an even"),
        ({"turns": 2}, "`turns` must be a whole number"),
    ],
)
def test_bad_input_is_one_line(change, words):
    asked = {"camera": NEAR, "inner": 4.0, "outer": 12.0, "radii": 4, "turns": 8} | change
    with pytest.raises(ValueError, match=words) as reported:
        kc.line_profile(**asked)
    assert "\n" not in str(reported.value)


@pytest.mark.slow
@pytest.mark.parametrize("check", [rays.edge_on, rays.face_on, rays.times, rays.spot, light.line_edges, light.uniform])
def test_slow_check_holds(check):
    assert check().verdict == "holds"


@pytest.mark.slow
@pytest.mark.parametrize(("spin", "inclination"), [(0.0, 80.0), (0.9, 60.0)])
def test_profile_of_a_ring_is_the_twins(spin, inclination):
    assert light.ring(spin, inclination).verdict == "holds"


@pytest.mark.slow
def test_transfer_function_is_another_programs():
    """At 85 degrees too, where means depend on the samples."""
    checks = light.transfer_points()
    assert len(checks) == 4 and "85°" in checks[-1].name
    assert {check.verdict for check in checks} == {"holds"}


@pytest.mark.slow
def test_transfer_function_means():
    check, means = light.transfer_checks()
    assert check.verdict == "holds"
    # Near the axis f is almost constant: its mean does not depend on the weights.
    assert means[0]["f over angle"] == pytest.approx(means[0]["f over g*"], rel=1e-4)
