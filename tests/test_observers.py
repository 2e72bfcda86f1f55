"""Distant observers: against cameras far away, other codes' numbers, and the closed curve of the shadow edge."""

import json
import math

import numpy as np
import pytest
from command_line import run
from scipy.optimize import brentq

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.observer import from_screen, on_screen, screen_basis

INCLINATION = math.radians(60)
PLACES = np.array([[6.0, 7.0], [-3.5, 4.5], [5.9, -0.4], [40.0, -90.0]])


def seen_by_camera(place, radius):
    """The direction N of a place on the screen of an observer, for a camera there."""
    a, b = np.moveaxis(np.asarray(place) / (2 * radius), -1, 0)
    square = a * a + b * b
    return np.stack([square - 1, 2 * a, 2 * b], axis=-1) / (1 + square)[..., None]


def test_arguments_come_by_name_or_in_order_as_those_of_cameras():
    assert kc.Observer(0.9, 1.0) == kc.Observer(spin=0.9, inclination=1.0)
    assert kc.Observer(0.9, 1.0, 50.0) == kc.Observer(spin=0.9, radius=50.0, inclination=1.0)
    assert kc.Camera(0.9, 50.0, 1.0) == kc.Camera(spin=0.9, inclination=1.0, radius=50.0)
    # In the order of a camera they are refused.
    with pytest.raises(ValueError, match="Argument `radius` must be larger than the horizon"):
        kc.Observer(0.9, 50.0, 1.0)


def test_screen_and_back():
    places = np.array([[3.0, 4.0], [1e5, -2.0], [0.0, 0.0], [1e-7, 1e-9]])
    assert np.allclose(on_screen(from_screen(places)), places, rtol=1e-13, atol=0)
    sky, step = from_screen(PLACES), 1e-5
    for along, basis in zip(np.eye(2), screen_basis(sky), strict=True):
        change = (from_screen(PLACES + step * along) - from_screen(PLACES - step * along)) / (2 * step)
        assert np.abs(change - basis).max() < 1e-10


def test_shadow_edge_is_the_closed_curve():
    # Bardeen 1973: alpha(r), beta(r) of the spherical photon orbits.
    spin = 0.9

    def constants(r):
        b = -(r**3 - 3 * r * r + spin**2 * r + spin**2) / (spin * (r - 1))
        return b, r**3 * (4 * spin**2 - r * (r - 3) ** 2) / (spin * (r - 1)) ** 2

    edge = kc.shadow_edge(kc.Observer(spin=spin, inclination=INCLINATION), 24)
    for alpha, beta in edge[1:12]:
        low, high = kerr.photon_orbits(spin)
        orbit = brentq(lambda r, alpha=alpha: constants(r)[0] + alpha * math.sin(INCLINATION), low, high, xtol=1e-15)
        b, q = constants(orbit)
        square = q + (spin * math.cos(INCLINATION)) ** 2 - (b / math.tan(INCLINATION)) ** 2
        assert beta**2 == pytest.approx(square, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("end", [math.inf, 20.0, kc.EquatorialPlane(1)], ids=str)
def test_observer_sees_what_the_camera_there_sees(end, radius):
    observer, camera = (
        kc.Observer(spin=0.9, inclination=INCLINATION, radius=radius),
        kc.Camera(0.9, radius, INCLINATION, "fiducial"),
    )
    mine = kc.trace_beams(observer, PLACES, end=end, time=True)
    theirs = kc.trace_beams(camera, seen_by_camera(PLACES, radius), end=end, time=True)
    assert (mine.escaped == theirs.escaped).all() and mine.escaped.any()
    seen = mine.escaped
    assert (np.abs(mine.direction - theirs.direction).max(axis=-1) <= mine.error + 3 * theirs.error)[seen].all()
    late = mine.time - (theirs.time - radius - 2 * math.log(radius))
    assert (np.abs(late) <= mine.time_error + theirs.time_error)[seen].all()
    # Per M, not per radian; and the sense of the two tangents is the same.
    scale = (2 / (1 - seen_by_camera(PLACES, radius)[:, 0])) ** 2 * radius**2
    assert np.allclose(mine.determinant[seen], (theirs.determinant / scale)[seen], rtol=1e-8)
    assert (mine.index == theirs.index)[seen].all() and (mine.redshift - theirs.redshift)[seen].max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("end", [math.inf, 20.0, kc.EquatorialPlane(1)], ids=str)
def test_infinity_is_the_limit(end):
    def values(radius):
        beams = kc.trace_beams(
            kc.Observer(spin=0.9, inclination=INCLINATION, radius=radius), PLACES[:3], end=end, time=True
        )
        return np.concatenate([beams.direction.ravel(), beams.time, beams.jacobian.ravel()])

    limit, *near = (values(radius) for radius in (math.inf, 1e3, 1e5, 1e7))
    known = np.isfinite(limit)
    away = [np.abs(one - limit)[known] for one in near]
    # As 1 / r: the coefficient is the same to its own next term.
    size = 1 + np.abs(limit[known])
    assert (np.abs(1e3 * away[0] - 1e5 * away[1]) < 0.2 * 1e5 * away[1] + 0.1 * size).all()
    assert (np.abs(1e5 * away[1] - 1e7 * away[2]) < 2e-3 * 1e5 * away[1] + 1e-3 * size).all()


@pytest.mark.slow
@pytest.mark.parametrize("end", [math.inf, 50.0, kc.EquatorialPlane(1)], ids=str)
@pytest.mark.parametrize(("spin", "degrees"), [(0.9, 60), (0.998, 0), (0.0, 45)])
def test_engines_agree_at_infinity(spin, degrees, end):
    observer, rng = kc.Observer(spin=spin, inclination=math.radians(degrees)), np.random.default_rng(3)
    places = rng.normal(size=(300, 2)) * rng.choice([1.0, 4.0, 8.0, 40.0, 1e3], size=(300, 1))
    formula, steps = (
        kc.trace_beams(observer, places, engine, end=end, time=True) for engine in ("closed-form", "integrated")
    )
    assert (formula.escaped == steps.escaped).all()
    seen = formula.escaped
    assert (np.linalg.norm(formula.direction - steps.direction, axis=-1) <= formula.error + steps.error)[seen].all()
    late = np.abs(formula.time - steps.time)
    assert (late <= formula.time_error + steps.time_error)[seen].all()
    off = np.abs(formula.jacobian - steps.jacobian).max(axis=(1, 2)) / formula.delta_plus
    assert (off <= 2 * (formula.jacobian_error + steps.jacobian_error))[seen].all()
    sure = seen & formula.index_certain & steps.index_certain
    assert (formula.index == steps.index)[sure].all()


@pytest.mark.slow
def test_caustics_tend_to_those_seen_from_infinity():
    found = {
        radius: kc.caustics(kc.Observer(spin=0.9, inclination=INCLINATION, radius=radius), 3)
        for radius in (1e5, 1e7, 1e9, math.inf)
    }
    assert found[math.inf].missing == (1,) and found[1e5].missing == ()
    limit, far, near = found[math.inf][0], found[1e7][1], found[1e5][1]
    assert limit.order == far.order == 2 and limit.kind == "astroid" and limit.closed
    assert 1e7 * (far.phi_extent - limit.phi_extent) == pytest.approx(
        1e5 * (near.phi_extent - limit.phi_extent), rel=2e-3
    )
    for at in found.values():
        assert [curve.closed for curve in at if curve.order > 1] == [True, True]
    assert limit.sky.shape[1] == 2 and np.hypot(*limit.sky.T).max() < 8
    # The primary critical curve is Einstein's ring.
    assert np.hypot(*found[1e5][0].sky.T).mean() == pytest.approx(2 * math.sqrt(1e5), rel=1e-2)
    # The same as for a camera.
    camera = kc.caustics(kc.Camera(0.9, 1e3, INCLINATION, "fiducial"), 2)[1]
    observed = kc.caustics(kc.Observer(spin=0.9, inclination=INCLINATION, radius=1e3), 2)[1]
    assert abs(camera.phi_extent - observed.phi_extent) <= 2 * (camera.error + observed.error)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1.2, 1.0), "`spin` must lie in"),
        ((0.5, 4.0), "`inclination` must lie in"),
        ((0.5, 1.0, -math.inf), "`radius` must be a finite number"),
        ((0.5, 1.0, math.nan), "`radius` must be a finite number"),
        ((0.5, 1.0, 1e10), "`radius` must be at most"),
        ((0.5, 1.0, 1.0), "`radius` must be larger than the horizon"),
    ],
    ids=str,
)
def test_observers_that_cannot_be_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        kc.Observer(**dict(zip(("spin", "inclination", "radius"), arguments, strict=False)))


def test_what_takes_no_observer_says_so():
    observer = kc.Observer(spin=0.5, inclination=1.0)
    with pytest.raises(ValueError, match=r"Argument `sky` must hold finite numbers \(alpha, beta\)"):
        kc.trace_rays(observer, [6.0, math.nan])


@pytest.mark.slow
def test_command_finds_caustics_seen_from_infinity(tmp_path, capsys):
    file = tmp_path / "caustics.json"
    status, out, _ = run(capsys, "caustics", "--spin", 0.9, "--radius", "inf", "--inclination", 60, "--json", file)
    assert status == 0 and "r = inf" in out
    entry = json.loads(file.read_text())
    assert entry["radius"] is None and entry["missing_orders"] == [1]
    assert [curve["order"] for curve in entry["curves"]] == [2, 3]


def test_observers_are_kept_in_files(tmp_path):
    observer = kc.Observer(spin=0.5, inclination=1.0)
    kc.save(tmp_path / "observer.npz", observer)
    loaded = kc.load(tmp_path / "observer.npz")
    assert (
        loaded == observer
        and loaded.frame() == observer.frame()
        and loaded != kc.Observer(spin=0.5, inclination=1.0, radius=1e9)
    )
    assert kc.record(observer)["schema"] == "kerrcaustics/observer/1"


def test_an_observer_at_infinity_misses_the_primary_curve_alone():
    found = kc.caustics(kc.Observer(spin=0.9, inclination=0.5), orders=1)
    assert len(found) == 0 and found.missing == (1,)
