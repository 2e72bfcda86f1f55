"""Isoradials, light curves and line profiles of observers: against cameras, rays, closed forms and other codes."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from scipy.interpolate import CubicSpline

import kerrcaustics as kc
from kerrcaustics.draw.spot_films import SpotFrames
from kerrcaustics.scripts import STUDIES
from kerrcaustics.tracks import isoradials

SPIN, INCLINATION, ORBIT = 0.9, 1.1, 8.0
INFINITE = kc.Observer(spin=SPIN, inclination=INCLINATION)
OTHERS = json.loads((Path(__file__).parent / "data" / "lensing_bands.json").read_text(encoding="utf-8"))
schwarzschild = STUDIES.module("disk_checks.schwarzschild")


def on_screen(camera: kc.Camera, sky: np.ndarray) -> np.ndarray:
    """Directions N as (alpha, beta) of a fiducial observer there: 2 r tan(psi / 2) for an angle psi from the hole."""
    return 2 * camera.radius * sky[..., 1:] / (1 - sky[..., :1])


def ring_light(curve, power: float = 4.0) -> float:
    """Light of a closed isoradial for a unit of radius: the integral of g^power times its width along it."""
    edge_phase = np.append(curve.edge_phase, curve.edge_phase[0] + 2 * math.pi)
    sky = CubicSpline(edge_phase, [*curve.sky, curve.sky[0]], bc_type="periodic")
    light = curve.redshift**power * curve.width * np.linalg.norm(sky(curve.edge_phase, 1), axis=-1)
    return float(CubicSpline(edge_phase, [*light, light[0]], bc_type="periodic").integrate(*edge_phase[[0, -1]]))


@pytest.mark.slow
def test_cameras_tend_to_the_observer_at_infinity():
    """Differences of numbers in units of M fall as 1 / r, also beyond 1e5, where an observer searches for them."""
    limit = kc.light_curve(INFINITE, ORBIT, 12, size=0.5, crossings=2)
    line, ring = kc.line_profile(INFINITE, 4.0, 12.0, bins=1), kc.isoradials(INFINITE, [ORBIT], 2, 90)[1]
    off = []
    for radius in (1e4, 1e6, 1e8):
        camera = kc.Camera(SPIN, radius, INCLINATION, "static")
        # The same moments of the spot, seen later.
        late = radius + 2 * math.log(radius)
        light = kc.light_curve(camera, ORBIT, limit.time + late, size=0.5, crossings=2)
        assert light.certified and len(light.events) == len(limit.events)
        flux = np.abs(light.flux * radius**2 / limit.flux - 1).max()
        place = np.abs(on_screen(camera, light.centroid) - limit.centroid).max()
        time = np.abs(light.travel_time - late - limit.travel_time).max()
        share = abs(kc.line_profile(camera, 4.0, 12.0, bins=1).flux[0] * radius**2 / line.flux[0] - 1)
        curve = np.abs(on_screen(camera, kc.isoradials(camera, [ORBIT], 2, 90)[1].sky) - ring.sky).max()
        off.append([flux, place, time, share, curve])
    scaled = np.array(off) * np.array([[1e4], [1e6], [1e8]])
    # Measured: 3 to 60 in units of 1 / r. At 1e8 the directions N of a camera themselves are as coarse.
    assert (scaled[:2] < 100).all() and scaled[1] == pytest.approx(scaled[0], rel=0.02)
    assert (np.array(off[2]) < 1e-5).all()


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1e3, 1e6])
def test_an_observer_at_a_finite_radius_is_the_fiducial_camera_there(monkeypatch, radius):
    # On the same lines: those that are even on the sky differ as the two skies do.
    monkeypatch.setattr(isoradials, "even_phases", lambda viewer, part: 2 * math.pi * part)
    camera = kc.Camera(SPIN, radius, INCLINATION, "fiducial")
    observer = kc.Observer(spin=SPIN, inclination=INCLINATION, radius=radius)
    start, rounding = radius + 2 * math.log(radius), 1e-15 * radius
    for one, other in zip(*(kc.isoradials(v, [5.0, ORBIT], 2, 60) for v in (camera, observer)), strict=True):
        size = np.linalg.norm(other.sky, axis=1) / (2 * radius)
        away = np.linalg.norm(on_screen(camera, one.sky) - other.sky, axis=1)
        # Points of either may lie apart along the curve only by what their lines do.
        assert (away <= 2 * (other.error + radius * one.error) + 100 * rounding).all()
        assert other.width == pytest.approx(one.width * radius * (1 + size**2), rel=1e-9)
        assert other.redshift == pytest.approx(one.redshift, rel=1e-10)
        allowed = 3 * (one.time_error + other.time_error) + 1e-15 * radius + 1e-9
        assert (np.abs(one.time - start - other.time) <= allowed).all()
    here, there = (kc.light_curve(v, ORBIT, [3.0 + late], crossings=2) for v, late in ((camera, start), (observer, 0)))
    # The factor of areas is taken at the hole: it varies by the square of the angle.
    assert there.flux == pytest.approx(here.flux * radius**2, rel=20 / radius**2 * 100 + 1e-9)
    assert on_screen(camera, here.centroid) == pytest.approx(there.centroid, abs=1e-4 + 1e-9 * radius)
    bins = np.linspace(0.3, 1.6, 9)
    one, other = (kc.line_profile(v, 4.0, 12.0, bins=bins).flux for v in (camera, observer))
    assert other == pytest.approx(one * radius**2, rel=1e3 / radius**2 + 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("crossing", [1, 2])
def test_a_profile_and_a_light_curve_are_sums_of_isoradials(crossing):
    """The whole line is the integral of its rings; the mean of a light curve is the light of the orbit's image."""
    node, weight = np.polynomial.legendre.leggauss(12)
    radii = 8 + 4 * node
    curves = [c for c in kc.isoradials(INFINITE, radii, crossing, 720) if c.crossing == crossing]
    total = sum(4 * w * c.radius**-3 * ring_light(c) for w, c in zip(weight, curves, strict=True))
    line = kc.line_profile(INFINITE, 4.0, 12.0, 3.0, crossing=crossing)
    assert abs(line.flux.sum() - total) <= line.error.sum() + 1e-6 * total
    assert line.flux.sum() == pytest.approx(total, rel=1e-5)
    light = kc.light_curve(INFINITE, ORBIT, 400, size=0.5, crossings=crossing)
    (curve,) = (c for c in kc.isoradials(INFINITE, [ORBIT], crossing, 720) if c.crossing == crossing)
    # Of a spot of unit area that is spread evenly over the orbit.
    assert light.shares[crossing - 1].mean() == pytest.approx(ring_light(curve) / (2 * math.pi * ORBIT), rel=1e-6)


def grid(half: float, side: int) -> tuple[np.ndarray, float]:
    """Places (n, 2) on a square about the hole, and the area of each."""
    step = ((np.arange(side) + 0.5) / side * 2 - 1) * half
    return np.stack(np.meshgrid(step, step), axis=-1).reshape(-1, 2), (2 * half / side) ** 2


@pytest.mark.slow
def test_a_profile_is_a_sum_over_rays():
    places, area = grid(15.0, 700)
    rays = kc.trace_rays(INFINITE, places, end=kc.EquatorialPlane(1), redshift=True)
    on = (rays.radius >= 4) & (rays.radius <= 12)
    edges = np.linspace(0.3, 1.5, 13)
    light = rays.redshift[on] ** 4 * area / rays.radius[on] ** 2
    summed = np.histogram(rays.redshift[on], edges, weights=light)[0]
    found = kc.line_profile(INFINITE, 4.0, 12.0, 2.0, bins=edges)
    # Steps of 0.04 M at the rims, and at the edges of bins.
    assert np.abs(found.flux - summed).max() < 5e-3 * found.flux.max()
    assert found.flux.sum() == pytest.approx(summed.sum(), rel=1e-3)


@pytest.mark.slow
def test_a_light_curve_is_a_sum_over_rays():
    """A spot that is spread over a little of the radius, as a parabola, by the rays that land on it at their times."""
    half, size = 0.4, 0.6
    found = kc.light_curve(INFINITE, ORBIT, 6, size=size, crossings=1)
    places, area = grid(12.0, 900)
    rays = kc.trace_rays(INFINITE, places, end=kc.EquatorialPlane(1), redshift=True, time=True)
    part = (rays.radius - ORBIT) / half
    on = np.abs(part) < 1
    radial, orbital, width = 0.75 * (1 - part[on] ** 2) / half, 2 * math.pi / found.period, size / ORBIT
    start = rays.azimuth[on] + orbital * rays.time[on]
    for moment, flux in zip(found.time, found.flux, strict=True):
        away = (start - orbital * moment + math.pi) % (2 * math.pi) - math.pi
        profile = np.exp(-((away / width) ** 2) / 2) / (width * math.sqrt(2 * math.pi)) / ORBIT
        summed = (rays.redshift[on] ** 4 * radial * profile).sum() * area
        # The mean over radii differs by their spread, half^2 / 5, times half the second derivative.
        assert summed == pytest.approx(flux, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "degrees", "crossing"), [(6.0, 60, 1), (20.0, 80, 1), (6.0, 80, 2), (3.2, 30, 2)])
def test_isoradials_without_spin_are_those_of_the_closed_form(radius, degrees, crossing):
    """Luminet 1979, from infinity, with elliptic functions; places and their errors."""
    observer = kc.Observer(spin=0.0, inclination=math.radians(degrees))
    (curve,) = (c for c in kc.isoradials(observer, [radius], crossing, 64) if c.crossing == crossing)
    alpha, beta = curve.sky.T
    size, turn = np.hypot(alpha, beta), np.arctan2(beta, alpha)
    exact = schwarzschild.isoradial(radius, observer.inclination, turn, crossing)
    assert (np.abs(size - exact) <= curve.error + 1e-13 * size).all()


@pytest.mark.slow
def test_lensing_bands_are_another_programs():
    """Areas on the screen of a disk from the horizon to r = 50, image by image, and the mean frequency ratio."""
    observer = kc.Observer(
        spin=OTHERS["spin"], inclination=math.radians(OTHERS["inclination_deg"]), radius=OTHERS["observer_radius"]
    )
    horizon, box = 1 + math.sqrt(1 - observer.spin**2), 25.0
    node, weight = np.polynomial.legendre.leggauss(20)
    low, high = math.log(1.0001 * horizon), math.log(50.0)
    radii = np.exp((high + low) / 2 + (high - low) / 2 * node)
    rings = kc.isoradials(observer, radii, 3, 360, "plunging")
    rims = kc.isoradials(observer, [1.0001 * horizon, 50.0], 3, 360)
    assert rings.certified and rims.certified
    stated = OTHERS["solid_angle_M2"], OTHERS["mean_redshift"], OTHERS["relative_change"]
    for n, (area, mean, change) in enumerate(zip(*stated, strict=True), start=1):
        inner, outer = (enclosed(c) for c in rims if c.crossing == n)
        shifted = (
            (high - low)
            / 2
            * sum(
                w * c.radius * ring_light(c, 1.0)
                for w, c in zip(weight, (c for c in rings if c.crossing == n), strict=True)
            )
        )
        if n == 1:
            # Their grid of the first image ends at 25 M, within the image of the outer rim.
            outer, shifted = 4 * box**2, shifted_in_box(observer, box)
        assert outer - inner == pytest.approx(area, rel=change)
        assert shifted / (outer - inner) == pytest.approx(mean, rel=change)


def shifted_in_box(observer: kc.Observer, box: float) -> float:
    """The integral of the frequency ratio over a square of rays, where they meet the disk."""
    places, area = grid(box, 400)
    rays = kc.trace_rays(observer, places, end=kc.EquatorialPlane(1, "plunging"), redshift=True)
    return float(np.nansum(rays.redshift) * area)


def enclosed(curve) -> float:
    """The area in a closed curve of (alpha, beta)."""
    x, y = curve.sky.T
    return abs(float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2)


@pytest.mark.slow
def test_errors_of_light_curves_are_honest():
    """Against four times as many points: fluxes, centroids and travel times."""
    for viewer in (INFINITE, kc.Camera(SPIN, 1e7, INCLINATION, "static")):
        found, true = (kc.light_curve(viewer, ORBIT, 40, source=kc.Spot(crossings=3, points=n)) for n in (720, 2880))
        assert (np.abs(found.flux - true.flux) <= found.error + true.error).all()
        away = np.linalg.norm(found.centroid - true.centroid, axis=1)
        assert (away <= found.centroid_error + true.centroid_error).all()
        allowed = found.emission_time_error + true.emission_time_error
        # Not many times too large, either.
        assert np.median(found.error / found.flux) < 40 * np.median(np.abs(found.flux / true.flux - 1))
        assert (np.abs(found.travel_time - true.travel_time) <= allowed).all()
        assert found.error.max() < 1e-4 * found.flux.max()


@pytest.mark.slow
def test_units_are_those_of_the_viewer(tmp_path):
    camera = kc.Camera(SPIN, 50.0, INCLINATION, "static")
    for viewer, rad, unit in ((camera, "_rad", "sr"), (INFINITE, "", "(GM/c^2)^2")):
        rings = kc.isoradials(viewer, [ORBIT], 1, 16)
        entry = kc.record(rings, points=True)
        assert {f"error{rad}", f"width{rad}"} <= entry["isoradials"][0].keys() and entry["certified"]
        light = kc.light_curve(viewer, ORBIT, 4, crossings=2)
        record = kc.record(light, points=True)
        assert f"centroid_error{rad}" in record
        line = kc.line_profile(viewer, 6.0, 8.0, bins=4, radii=4, turns=8)
        for result in (light, line):
            assert kc.to_xarray(result).flux.attrs["units"] == unit
        for name, result in (("rings", rings), ("light", light), ("line", line)):
            kc.save(tmp_path / f"{name}.npz", result)
            assert kc.load(tmp_path / f"{name}.npz") == result
            assert ("α" in result.plot().get_xlabel()) == (name == "rings" and viewer is INFINITE)


@pytest.mark.slow
def test_command_and_film_for_an_observer_at_infinity(capsys, tmp_path):
    figure = tmp_path / "light.png"
    options = ["--spin", "0.9", "--radius", "inf", "--inclination", "75", "--orbit", "6", "--crossings", "2"]
    status, out, _ = run(capsys, "light-curve", *options, "--times", "8", "--points", "--figure", figure, "--json", "-")
    entry = json.loads(out)
    assert status == 0 and entry["certified"] and entry["radius"] is None and figure.stat().st_size > 10_000
    assert len(entry["centroid"][0]) == 2 and "centroid_error" in entry
    assert {"moment", "sky_error", "error"} <= entry["events"][0].keys()
    frames = SpotFrames(kc.light_curve(kc.Observer(spin=0.9, inclination=math.radians(75)), 6.0, 40, crossings=2), 4)
    (places, bright), _ = frames.images(frames.times[1]).values()
    assert places.shape[1] == 2 and (bright > 0).all()
    rays = kc.trace_rays(frames.light.camera, places, end=kc.EquatorialPlane(1))
    np.testing.assert_allclose(rays.radius, 6, rtol=1e-3)
    assert frames.frame(1).shape == (720, 1280, 3)
