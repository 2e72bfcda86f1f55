"""Critical curves and caustics, against independent numbers, closed forms and their own definition."""

import dataclasses
import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from marks import few

import kerrcaustics as kc
from kerrcaustics.curves import features
from kerrcaustics.curves.critical_curves import critical_curves, points_between
from kerrcaustics.curves.critical_points import Search
from kerrcaustics.spacetime.sphere import angle_between, from_angles, tangent_basis

REFERENCE = {
    (case["a"], case["r_c"]): case["orders"]
    for case in json.loads((Path(__file__).parent / "data" / "caustics.json").read_text())
}
CAMERAS = {
    (0.999, 6.03): kc.Camera(0.999, 6.03),
    (0.6, 10.0): kc.Camera(0.6, 10.0, velocity="fiducial"),
    (0.95, 4.0): kc.Camera(0.95, 4.0, math.radians(60), "fiducial"),
}

# theta' extent, phi' extent, circuits, phi' from, to: degrees, a = 0.999, as many digits as are known.
TABLE = {
    (6.03, 1): ("0.4233", "0.4511", "0.0013", "167.4713", "167.9224"),
    (6.03, 2): ("71.83", "263.02", "0.731", "48.128", "311.146"),
    (6.03, 3): ("131.75", "1876.432", "5.212", "-1426.497", "449.935"),
    (6.03, 4): ("152.29", "5315.99", "14.77", "-4727.458", "588.533"),
    (2.6, 1): ("1.8237", "2.1356", "0.0059", "140.5195", "142.6551"),
    (2.6, 2): ("84.91", "364.60", "1.013", "-81.101", "283.502"),
    (2.6, 3): ("137.24", "2261.27", "6.281", "-1839.055", "422.215"),
    (2.6, 4): ("154.49", "5825.40", "16.18", "-5264.592", "560.810"),
}


@cache
def found(spin, radius, inclination_deg=90.0, velocity=None, orders=3, engine="auto"):
    camera = kc.Camera(spin, radius, math.radians(inclination_deg), velocity)
    return kc.caustics(camera, orders, engine)


def reference_set(case):
    camera = CAMERAS[case]
    return found(camera.spin, camera.radius, round(math.degrees(camera.inclination), 9), "fiducial")


@pytest.mark.parametrize("radius", [6.03, 2.6])
def test_table_of_known_extents(radius):
    for curve in found(0.999, radius, orders=4):
        known = TABLE[radius, curve.order]
        angles = (
            curve.theta_extent,
            curve.phi_extent,
            2 * math.pi * curve.circuits,
            curve.phi_min,
            curve.phi_max,
        )
        values = [math.degrees(angle) for angle in angles]
        values[2] /= 360
        for value, text in zip(values, known, strict=True):
            assert f"{value:.{len(text.partition('.')[2])}f}" == text
        assert curve.error < math.radians(1e-6)
        assert curve.kind == "astroid" and curve.closed and not curve.remarks


@pytest.mark.slow
@pytest.mark.parametrize("case", REFERENCE, ids=str)
def test_extents_and_cusps_against_another_program(case):
    curves = reference_set(case)
    for curve in curves:
        other = next(o for o in REFERENCE[case] if o["order"] == curve.order)
        ours = np.degrees([curve.theta_min, curve.theta_max, curve.phi_min, curve.phi_max])
        theirs = [other[name] for name in ("theta_min", "theta_max", "phi_min", "phi_max")]
        np.testing.assert_allclose(ours, theirs, atol=2 * math.degrees(curve.error))
        assert len(curve.cusps) == other["n_cusps"] == 4
        for cusp in other["cusps"]:
            place = np.radians([cusp["theta_deg"], cusp["phi_deg"]])
            gaps = [np.abs(c.celestial - place) for c in curve.cusps]
            nearest = min(range(4), key=lambda i: gaps[i].max())
            assert gaps[nearest].max() < 2 * curve.cusps[nearest].error
            # The tip hardly moves when the point on the sky does: the place on the sky is less sharp.
            assert angle_between(curve.cusps[nearest].sky, np.array(cusp["N"])) < 1e-6


def test_points_of_another_program_lie_on_the_caustics():
    case = (0.999, 6.03)
    for curve in reference_set(case):
        samples = next(o for o in REFERENCE[case] if o["order"] == curve.order)["samples"]
        n, sky = (np.array([p[name] for p in samples]) for name in ("n_inf", "N"))
        theta = np.arctan2(np.hypot(n[:, 0], n[:, 1]), n[:, 2])
        celestial = np.stack([theta, np.radians([p["phi_deg"] for p in samples])], axis=1)
        assert max(distances_to_curve(curve.celestial, celestial)) < 1e-3 * curve.theta_extent
        assert max(distances_to_curve(curve.sky, sky)) < 1e-3


def distances_to_curve(curve, points):
    """Distance of each point to the closed polygon through `curve`, in any number of dimensions."""
    start, step = curve, np.roll(curve, -1, axis=0) - curve
    length = np.einsum("ij,ij->i", step, step)
    for point in points:
        along = np.clip(np.einsum("ij,ij->i", point - start, step) / np.where(length > 0, length, 1), 0, 1)
        yield np.linalg.norm(start + along[:, None] * step - point, axis=1).min()


RINGS = {
    6.03: (61.686934, 45.422610, 44.813239, 44.787376),
    10.0: (44.874561, 28.217837, 27.716500),
}
IMPACTS = {6.03: (6.493641287, 5.253978129, 5.198621501, 5.196259023), 10.0: (7.888367, 5.286345, 5.199943)}


@pytest.mark.parametrize("radius", RINGS)
def test_schwarzschild_rings(radius):
    curves = found(0.0, radius, velocity="static", orders=len(RINGS[radius]))
    for curve, angle, impact in zip(curves, RINGS[radius], IMPACTS[radius], strict=True):
        from_centre = np.degrees(angle_between(curve.sky, np.array([-1.0, 0.0, 0.0])))
        assert np.ptp(from_centre) < math.degrees(1e-8)
        np.testing.assert_allclose(from_centre.mean(), angle, atol=5e-7)
        b = radius * np.sin(np.radians(from_centre.mean())) / math.sqrt(1 - 2 / radius)
        digits = 9 if radius == 6.03 else 6
        assert round(b, digits) == pytest.approx(impact, abs=1.01 * 10**-digits)
        assert curve.kind == "point" and "point" in curve.remarks[0]
        assert curve.theta_extent < 1e-8 and curve.phi_extent < 1e-8
        np.testing.assert_allclose(curve.phi_max, curve.order * math.pi, atol=10 * curve.error)


@pytest.mark.slow
@pytest.mark.parametrize("inclination_deg", [0.0, 25.0, 180.0])
def test_schwarzschild_caustics_lie_behind_and_before_the_hole(inclination_deg):
    curves = found(0.0, 8.0, inclination_deg, orders=2)
    camera = math.radians(inclination_deg)
    for curve, place in zip(curves, (from_angles(math.pi - camera, math.pi), from_angles(camera, 0)), strict=True):
        direction = from_angles(curve.celestial[:, 0], curve.celestial[:, 1])
        assert angle_between(direction, place).max() < 10 * curve.error + 1e-15


def test_axis_camera_sees_points_on_the_axis():
    for curve in found(0.9, 6.0, 0.0, orders=3):
        assert curve.kind == "point"
        assert any("spin axis" in remark for remark in curve.remarks)
        pole = math.pi if curve.order % 2 else 0.0
        assert np.abs(curve.celestial[:, 0] - pole).max() < 10 * curve.error + 1e-15


@pytest.mark.slow
@pytest.mark.parametrize(
    "velocity", [pytest.param("circular", marks=pytest.mark.slow), "static", (0.5, -0.3, 0.2), (0.0, 0.9, 0.0)]
)
def test_velocity_moves_the_sky_and_leaves_the_caustics(velocity):
    camera = kc.Camera(0.999, 6.03, velocity=velocity)
    for curve, at_rest in zip(kc.caustics(camera, 2), found(0.999, 6.03, velocity="fiducial", orders=2), strict=True):
        np.testing.assert_allclose(curve.celestial, at_rest.celestial, atol=1e-9)
        # The moving camera's own beams have no minor diameter there, and end at the same place.
        beams = kc.trace_beams(camera, curve.sky[::7], tolerance=1e-12)
        assert (np.abs(beams.delta_minus) < 1e-10 * beams.delta_plus).all()
        expected = from_angles(curve.celestial[::7, 0], curve.celestial[::7, 1])
        assert angle_between(beams.direction, expected).max() < 1e-9


def test_mirror_symmetry_is_what_a_camera_just_off_the_equator_finds_without_it():
    mirrored = found(0.95, 5.0)
    off = kc.Camera(0.95, 5.0, math.pi / 2 - 1e-12, "fiducial")
    assert not off.on_equator
    for curve, whole in zip(mirrored, kc.caustics(off, 3), strict=True):
        for name in ("theta_min", "theta_max", "phi_min", "phi_max"):
            assert getattr(curve, name) == pytest.approx(getattr(whole, name), abs=1e-9)
        assert curve.theta_min + curve.theta_max == pytest.approx(math.pi, abs=1e-10)
        assert len(whole.cusps) == 4


@pytest.mark.parametrize(("spin", "radius", "inclination_deg"), [(0.05, 50, 90), (0.7, 2.6, 60), (0.999, 20, 30)])
def test_caustics_are_closed_astroids(spin, radius, inclination_deg):
    curves = found(spin, radius, inclination_deg)
    assert [curve.order for curve in curves] == [1, 2, 3] and curves.missing == ()
    for curve in curves:
        assert curve.kind == "astroid" and curve.closed and curve.residual < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("inclination_deg", [90, 60, 30])
@pytest.mark.parametrize("radius", [2.6, 3, 4, 6, 10, 20, 50])
@pytest.mark.parametrize("spin", [0.05, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.98, 0.999])
def test_every_caustic_is_a_closed_astroid(spin, radius, inclination_deg):
    curves = kc.caustics(kc.Camera(spin, radius, math.radians(inclination_deg)), 4)
    assert [curve.order for curve in curves] == [1, 2, 3, 4]
    for curve in curves:
        assert curve.kind == "astroid" and curve.closed and not curve.remarks
        assert curve.residual < 1e-10


def test_a_cusp_is_where_the_critical_curve_runs_along_the_null_direction():
    curves = found(0.95, 4.0, 60.0, "fiducial")
    camera = kc.Camera(0.95, 4.0, math.radians(60), "fiducial")
    for curve in curves:
        for cusp in curve.cusps:
            beams = kc.trace_beams(camera, cusp.sky, tolerance=1e-12)
            null = np.linalg.svd(beams.jacobian)[2][1]
            e_1, e_2 = tangent_basis(cusp.sky)
            nearest = np.argmin(np.linalg.norm(curve.sky - cusp.sky, axis=1))
            around = np.take(curve.sky, range(nearest - 3, nearest + 4), axis=0, mode="wrap") - cusp.sky
            # Slope, at the cusp, of the curve against the null direction.
            flat = around @ np.stack([e_1, e_2], axis=1)
            along, across = flat @ null, flat @ np.array([-null[1], null[0]])
            assert abs(np.polyfit(along, across, 4)[-2]) < 1e-3


@pytest.mark.slow
def test_engines_agree_within_their_errors():
    for one, other in zip(found(0.9, 4.0), found(0.9, 4.0, engine="integrated"), strict=True):
        for name in ("theta_min", "theta_max", "phi_min", "phi_max"):
            assert abs(getattr(one, name) - getattr(other, name)) <= 2 * (one.error + other.error)


@pytest.mark.slow
def test_orders_beyond_double_precision_are_reported_missing():
    curves = found(0.0, 6.0, orders=10)
    orders = tuple(curve.order for curve in curves)
    assert orders + curves.missing == tuple(range(1, 11))
    assert len(orders) >= 7 and curves.missing
    for curve in curves:
        assert np.abs(curve.celestial[:, 1] - curve.order * math.pi).max() <= 2 * curve.error


@pytest.mark.parametrize("orders", [0, -1, 11, 2.5, "3"])
def test_bad_orders(orders):
    with pytest.raises(ValueError, match="Argument `orders` must be a whole number from 1 to 10"):
        kc.caustics(kc.Camera(0.9, 6.0), orders)


def test_an_island_of_the_index_is_reported_for_its_order(monkeypatch, nothing_kept):
    """Raise the index by one in a small part of the sky between the curves of order 2 and 3."""
    seen = Search.index_and_ratio

    def raised(self, turn, depth):
        index, ratio = seen(self, turn, depth)
        return index + ((np.abs(turn - 1.0) < 0.15) & (np.abs(depth - 6.0) < 0.4)), ratio

    monkeypatch.setattr(Search, "index_and_ratio", raised)
    curves = kc.caustics(kc.Camera(0.9, 6.0), 3)
    reported = ["more than one critical curve of order 3" in " ".join(curve.remarks) for curve in curves]
    assert reported == [False, False, True]


def test_a_cusp_or_an_extreme_that_cannot_be_traced_is_reported(monkeypatch):
    """Lose all points between those of the secondary caustic: no silent answer from the coarse ones."""

    def lost(search, curves, turns):
        found = points_between(search, curves, turns)
        return {k: points[:0] if k == 2 else points for k, points in found.items()}

    monkeypatch.setattr(features, "points_between", lost)
    primary, secondary = kc.caustics(kc.Camera(0.999, 6.03), 2)
    assert primary.kind == "astroid" and not primary.remarks
    assert secondary.kind == "unresolved" and "cusps could not be traced" in secondary.remarks[-1]
    assert sum("could not be refined" in remark for remark in secondary.remarks) == 4
    exact = found(0.999, 6.03)[1]
    for name in ("theta_min", "theta_max", "phi_min", "phi_max"):
        assert abs(getattr(secondary, name) - getattr(exact, name)) <= secondary.error


@pytest.mark.parametrize(("spin", "inclination_deg"), [(3e-6, 57.3), (1e-5, 57.3), (1e-5, 90), (1e-4, 90), (1e-3, 30)])
def test_caustics_of_slow_holes_are_astroids_or_unresolved(spin, inclination_deg):
    # Sizes, in errors, of what is called so.
    sizes = {"point": (0, 4), "unresolved": (4, 500), "astroid": (500, math.inf)}
    curves = found(spin, 6.0, inclination_deg)
    assert [curve.order for curve in curves] == [1, 2, 3]
    for curve in curves:
        low, high = sizes[curve.kind]
        assert low < max(curve.theta_extent, curve.phi_extent) / curve.error < high
        assert len(curve.cusps) == (4 if curve.kind == "astroid" else 0)


@pytest.mark.parametrize("inclination", few((1e-5, 1e-4, 1e-2), (1e-4,)))
def test_azimuths_close_to_the_axis_have_an_honest_error(inclination):
    camera = kc.Camera(0.9, 6.0, inclination)
    for one, other in zip(kc.caustics(camera, 3), kc.caustics(camera, 3, "integrated"), strict=True):
        for name in ("theta_min", "theta_max", "phi_min", "phi_max"):
            assert abs(getattr(one, name) - getattr(other, name)) <= 2 * (one.error + other.error)


@pytest.mark.slow
def test_cameras_next_to_the_horizon_find_whole_curves():
    for camera in (kc.Camera(0.999, 1.05), kc.Camera(0.999848, 1.04996, 1.163)):
        for curve in kc.caustics(camera, 2):
            assert curve.kind == "astroid" and curve.closed and not curve.remarks


def test_a_curve_that_is_not_whole_says_so(monkeypatch, nothing_kept):
    """Blind the search on some lines: the result must not look complete."""
    seen = Search.brackets

    def blinded(self, turn, orders):
        low, high, remarks = seen(self, turn, orders)
        low[1, 3:6] = np.nan
        return low, high, remarks

    monkeypatch.setattr(Search, "brackets", blinded)
    primary, secondary = kc.caustics(kc.Camera(0.9, 6.0), 2)
    assert primary.closed and not primary.remarks
    assert not secondary.closed and "3 of 33 lines" in secondary.remarks[0]


def test_critical_curves_are_found_once_and_cannot_be_changed():
    still, moving = kc.Camera(0.9, 7.0, velocity="static"), kc.Camera(0.9, 7.0, velocity="circular")
    curves = critical_curves(still, 2)
    assert critical_curves(moving, 2) is curves and list(kc.caustics(moving, 2)) == list(kc.caustics(moving, 2))
    with pytest.raises(ValueError, match="read-only"):
        curves.curves[0].points.depth[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        curves.orders = 3


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "inclination"), [(100.0, 1.0), (6.0, math.pi / 2)])
def test_next_to_extremal_spin_curves_keep_their_order(radius, inclination):
    """At the prograde edge, where orders crowd, points between neighbours are not those of the next curve."""
    found = kc.caustics(kc.Camera(1 - 1e-9, radius, inclination, "fiducial"), 5)
    assert found.missing == () and all(curve.closed for curve in found.curves)
    assert [curve.order for curve in found.curves] == [1, 2, 3, 4, 5]
