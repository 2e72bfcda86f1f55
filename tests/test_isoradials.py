"""Images of circles in the plane, and the light of a spot on one, against rays and images one by one."""

import json
import math

import numpy as np
import pytest
from command_line import run
from scipy.interpolate import CubicSpline

import kerrcaustics as kc
from kerrcaustics.draw.spot_films import SpotFrames
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.frame import photon_of

PAPER = kc.Camera(0.6, 74.1, math.radians(86.56), "static")
CAMERAS = [PAPER, kc.Camera(0.999, 6.03, 1.3, "fiducial"), kc.Camera(0.9, 20.0, 0.0, "fiducial")]
FAR = [kc.Camera(0.9, 1e7, 1.2, "static"), kc.Observer(spin=0.9, inclination=2.0, radius=1e3)]
INFINITE = kc.Observer(spin=0.9, inclination=1.2)
SPOT = kc.Camera(0.6, 50.0, math.radians(70), "static")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "crossings"),
    [(CAMERAS[2], 1), *(pytest.param(camera, 4, marks=pytest.mark.slow) for camera in (*CAMERAS, *FAR, INFINITE))],
    ids=str,
)
def test_points_of_rims_land_on_them(camera, crossings):
    radii = [2.5, 9.26, 18.7]
    found = kc.isoradials(camera, radii, crossings, points=60)
    # At a = 0.999 light of the fourth image has gone round up to 14 times more on one side than on the other.
    assert found.certified and not found.remarks
    assert [(c.crossing, c.radius) for c in found] == [(n, r) for n in range(1, crossings + 1) for r in radii]
    for curve in found:
        assert curve.closed and len(curve.sky) == 60
        end = kc.EquatorialPlane(curve.crossing)
        beams = kc.trace_beams(camera, curve.sky, "integrated", 1e-12, end=end)
        width = 1 / np.linalg.norm(beams.jacobian[:, 0], axis=1)
        allowed = 2 * curve.error + beams.error * curve.radius * width
        assert (np.abs(beams.radius - curve.radius) * width <= allowed).all()
        # Of the fourth image more than a few digits are lost.
        assert curve.error.max() < 1e-11 and np.allclose(curve.width, width, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("rims", "most", "least"), [((9.26, 18.70), 1.31, 0.61), ((4.2, 8.48), 1.48, 0.37)])
def test_frequencies_of_the_papers_disk_have_the_extremes_of_theory(rims, most, least):
    """Of the disk with the paper's rims, and of the one to which the paper's factors of 1.5 and 0.4 belong."""
    inner, outer = kc.isoradials(PAPER, rims, crossings=1, points=720)
    ratio = np.concatenate([outer.redshift, inner.redshift])
    assert ratio.max() == pytest.approx(most, abs=0.005) and ratio.min() == pytest.approx(least, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("observer", [INFINITE, kc.Observer(spin=0.5, inclination=0.5)], ids=str)
def test_errors_of_frequencies_hold_the_miss_of_the_radius(observer):
    """Against circular orbits of the circle's own radius, in closed form by the angular momentum of each ray."""
    for curve in kc.isoradials(observer, [6.0, 9.0], 4, points=60):
        surface = kc.EquatorialPlane(curve.crossing)
        rays = kc.trace_rays(observer, curve.sky, end=surface, constants=True)
        root, spin = curve.radius**1.5, observer.spin
        clock = math.sqrt(root**2 * (1 - 3 / curve.radius + 2 * spin / root)) / (root + spin)
        exact = clock / (1 - rays.impact / (root + spin))
        miss = np.abs(curve.redshift - exact)
        assert (miss <= curve.redshift_error).all()
        assert curve.redshift_error.max() < 2e-9


@pytest.mark.slow
def test_isoradials_of_a_fast_hole_hold_their_bright_end():
    """Seen along the straight side of the shadow edge, on which the edge phase hardly changes."""
    spin = 1 - 1e-6
    (curve,) = kc.isoradials(kc.Observer(spin=spin, inclination=math.radians(80)), [kc.isco(spin)], 1)
    assert curve.redshift.max() == pytest.approx(0.06095, rel=0.01)
    steps = np.linalg.norm(np.diff(curve.sky, axis=0), axis=1)
    # The whole image is 15 M long.
    assert steps.max() < 0.4


@pytest.mark.slow
def test_pieces_of_an_image_are_said_to_be_pieces():
    """Rays that wind round the horizon of an extremal hole a hundred times lose digits, and some points are lost."""
    spin = 1 - 1e-9
    found = kc.isoradials(kc.Observer(spin=spin, inclination=math.pi / 2), [kc.isco(spin), 6.0], 1)
    pieces = [curve for curve in found if curve.radius < 6]
    lost = 360 - sum(len(curve.sky) for curve in pieces)
    said = [remark.split(": ")[1] for remark in found.remarks if remark.startswith("crossing 1, r = 1.0")]
    plane = "the camera lies in the plane, along which rays run that never cross it"
    points = [f"{lost} of its points on lines could not be found"] * (lost > 0)
    assert said == [plane, *points, *([f"the image was found in {len(pieces)} pieces"] * (len(pieces) > 1))]
    assert len(found) == len(pieces) + 1 and found[-1].closed


@pytest.mark.slow
def test_from_the_axis_circles_are_round():
    for curve in kc.isoradials(CAMERAS[2], [4.0, 15.0], crossings=3, points=24):
        assert np.ptp(curve.sky[:, 0]) < 1e-12 and np.ptp(curve.redshift) < 1e-12


@pytest.mark.slow
def test_images_at_the_end_of_double_precision_are_not_certified():
    found = kc.isoradials(kc.Camera(0.0, 10.0, 0.4), [8.0], crossings=12, points=16)
    # Light of the twelfth has gone six times round: it is as close to the shadow's edge as directions can say.
    assert all(curve.error.max() < 1e-12 for curve in found) and not found.certified
    assert any(remark.startswith("crossing 12, r = 8: ") for remark in found.remarks)
    assert kc.isoradials(kc.Camera(0.0, 10.0, 0.4), [8.0], crossings=6, points=16).certified


def direct_sum(curve, orbital, times, power=4.0):
    """Flux (t,) of a point, image by image: solid angle times g^4, from the beam at each image."""
    edge_phase = np.append(curve.edge_phase, 2 * math.pi)
    phase = curve.azimuth + orbital * curve.time
    winds = round((phase[-1] - phase[0]) / (2 * math.pi))
    along = CubicSpline(edge_phase, np.append(phase, phase[0] + 2 * math.pi * winds))
    sky = CubicSpline(edge_phase, [*curve.sky, curve.sky[0]], bc_type="periodic")
    least, most = np.floor(phase.min() / (2 * math.pi)) - 1, np.ceil(phase.max() / (2 * math.pi)) + 1
    total = np.zeros((len(times), 6))
    for i, time in enumerate(times):
        wanted = orbital * time % (2 * math.pi) + 2 * math.pi * np.arange(least, most)
        places = np.concatenate([along.solve(level, extrapolate=False) for level in wanted])
        if not len(places):
            continue
        n = sky(places)
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        beams = kc.trace_beams(SPOT, n, end=kc.EquatorialPlane(curve.crossing), time=True)
        b = photon_of(SPOT.frame(), tuple(n.T)).b
        light = beams.redshift**power / np.abs(beams.determinant) / np.abs(1 - orbital * b)
        total[i] = light @ np.column_stack([np.ones(len(n)), n, beams.time, beams.redshift])
    return total


@pytest.mark.slow
def test_light_of_a_spot_is_that_of_its_images():
    found = kc.light_curve(SPOT, 8.0, 40, size=0.02, crossings=3)
    orbital = 2 * math.pi / found.period
    images = kc.isoradials(SPOT, [8.0], 3, 1440)
    sums = np.array([direct_sum(curve, orbital, found.time) for curve in images])
    shares = sums[..., 0]
    centroid = sums[..., 1:4].sum(axis=0)
    centroid /= np.linalg.norm(centroid, axis=1, keepdims=True)
    # A spot of a size of its own is no point: next to where images are born its centroid is another.
    away = np.linalg.norm(found.centroid - centroid, axis=1)
    assert np.median(away) < 2e-6 and away.max() < 1e-4 and found.centroid_error.max() < 1e-5
    assert np.nanmax(np.abs(found.travel_time[0] - sums[0, :, 4] / shares[0])) < 1e-3
    # Of each crossing, as of all light: its mean frequency ratio and place.
    assert np.abs(found.redshift[:2] - sums[:2, :, 5] / shares[:2]).max() < 1e-3
    direct = sums[0, :, 1:4] / np.linalg.norm(sums[0, :, 1:4], axis=1, keepdims=True)
    assert np.linalg.norm(found.sky[0] - direct, axis=1).max() < 1e-4 and found.sky_error[0].max() < 1e-5
    assert np.abs(found.flux / shares.sum(axis=0) - 1).max() < 1e-3
    for curve, share, wanted in zip(images, found.shares, shares, strict=True):
        far = np.ones(len(found.time), bool)
        for event in found.events:
            if event.crossing == curve.crossing:
                away = (found.time - event.moment + found.period / 2) % found.period - found.period / 2
                far &= np.abs(away) > 2
        assert np.abs(share[far] / wanted[far] - 1).max() < 3e-3
    finer = kc.light_curve(SPOT, 8.0, 40, source=kc.Spot(0.02, crossings=3, points=4000))
    assert (np.abs(finer.flux - found.flux) <= 3 * found.error + 1e-6 * found.flux).all()


def extremes(curve, orbital, kind):
    """Moments, and places on the sky, of the extremes of one kind of phi + Omega T along a curve."""
    edge_phase = np.append(curve.edge_phase, 2 * math.pi)
    phase = np.unwrap(curve.azimuth + orbital * curve.time)
    winds = round((phase[-1] - phase[0]) / (2 * math.pi))
    along = CubicSpline(edge_phase, np.append(phase, phase[0] + 2 * math.pi * winds))
    sky = CubicSpline(edge_phase, [*curve.sky, curve.sky[0]], bc_type="periodic")
    sign = 1 if kind == "creation" else -1
    places = [at for at in along.derivative().roots(extrapolate=False) if sign * orbital * along(at, 2) > 0]
    return [(float(along(at)) / orbital, sky(at)) for at in places]


def sky_size(curves):
    return max(np.ptp(curve.sky, axis=0).max() for curve in curves.values())


def test_light_of_a_spot_beside_an_extremal_horizon_is_as_unsure_as_its_frequencies():
    camera, radius = kc.Camera(0.9999999738, 1022.2, 3.1415, "fiducial"), 1.004733464697
    light = kc.light_curve(camera, radius, 4, source=kc.Spot(0.139, crossings=1))
    curve = kc.isoradials(camera, [radius], 1)[0]
    of_frequency = (curve.redshift_error / curve.redshift).max()
    assert of_frequency > 1e-5 and (light.error / light.flux > 2 * of_frequency).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "orbit"),
    [
        (kc.Camera(0.622, 50.0, 1.34, "static"), 9.87),
        (kc.Camera(0.511, 15.0, 1.5, "static"), 11.72),
        (kc.Observer(spin=0.622, inclination=1.34), 9.87),
    ],
    ids=["far", "near", "infinity"],
)
def test_errors_of_events_are_honest(camera, orbit):
    """Against extremes of phi + Omega T along splines through many points of the orbit's image."""
    found = kc.light_curve(camera, orbit, 1, crossings=3)
    assert found.certified and len(found.events) == 4
    orbital = 2 * math.pi / found.period
    curves = {curve.crossing: curve for curve in kc.isoradials(camera, [orbit], 3, 6000)}
    for event in found.events:
        assert event.error < 1e-7 and event.sky_error < 1e-5
        true = extremes(curves[event.crossing], orbital, event.kind)
        late = (np.array([moment for moment, _ in true]) - event.moment + found.period / 2) % found.period
        nearest = int(np.argmin(np.abs(late - found.period / 2)))
        # The splines are off by as much themselves.
        assert abs(late[nearest] - found.period / 2) <= event.error + 1e-8
        assert np.linalg.norm(event.sky - true[nearest][1]) <= event.sky_error * math.sqrt(2) + 1e-7 * sky_size(curves)


@pytest.mark.slow
def test_images_of_a_spot_are_born_where_beams_vanish():
    camera = kc.Camera(0.998, 50.0, math.radians(85), "static")
    found = kc.light_curve(camera, 6.0, 10, size=0.05, crossings=3)
    kinds = [(event.kind, event.crossing) for event in found.events]
    assert sorted(kinds) == [("annihilation", 2), ("annihilation", 3), ("creation", 2), ("creation", 3)]
    for event in found.events:
        beam = kc.trace_beams(camera, event.sky[None], end=kc.EquatorialPlane(event.crossing))
        assert abs(beam.radius[0] - 6.0) < 0.01
        assert abs(beam.delta_minus[0]) < 0.02 * beam.delta_plus[0]


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: kc.isoradials(SPOT, [1.5]), "`radii` must be finite and larger than the horizon"),
        (lambda: kc.isoradials(SPOT, []), "`radii` must be"),
        (lambda: kc.isoradials(SPOT, [8.0], 0), "`crossings` must be a whole number"),
        (lambda: kc.isoradials(SPOT, [8.0], motion="fast"), "`motion` must be one of"),
        (lambda: kc.light_curve(kc.Camera(0.9, 10.0), 9.0), "`camera` must not lie in the equatorial plane"),
        (lambda: kc.line_profile(kc.Observer(spin=0.9, inclination=math.pi / 2), 6.0, 9.0), "`camera` must not lie in"),
        (lambda: kc.light_curve(SPOT, 2.0), "`orbit` must be the radius of a circular orbit"),
        (lambda: kc.light_curve(SPOT, 8.0, size=0.0), "`size` must be a positive, finite length"),
        (lambda: kc.light_curve(SPOT, 8.0, [math.nan]), "`times` must be"),
        (lambda: kc.light_curve(SPOT, 8.0, source=kc.Spot(motion="static")), "`motion` must be one of"),
        (lambda: kc.Spot(power=math.inf), "`power` must be a finite number"),
        (lambda: kc.Spot(points=1), "`points` must be a whole number from 16 to 100000"),
        (lambda: kc.Ball(-1.0), "`size` must be a positive, finite length"),
    ],
)
def test_bad_input_is_one_line(ask, words):
    with pytest.raises(ValueError, match=words) as reported:
        ask()
    assert "\n" not in str(reported.value)


@pytest.mark.slow
def test_frames_of_a_light_curve_show_the_images_that_are_there():
    """Two more between a creation and an annihilation; where each is, the spot was when its light left it."""
    camera = kc.Camera(0.9, 50.0, math.radians(75), "static")
    found = kc.light_curve(camera, 6.0, 40, crossings=2)
    frames = SpotFrames(found, 15)
    orbital = 2 * math.pi / found.period
    births = {event.kind: event.moment for event in found.events if event.crossing == 2}
    begin, end = births["creation"], births["annihilation"]
    for time in frames.times:
        images = frames.images(time)
        between = (time - begin) % found.period < (end - begin) % found.period
        assert [len(images[crossing][0]) for crossing in (1, 2)] == [1, 3 if between else 1]
        for crossing, (places, bright) in images.items():
            view = View.toward_hole(camera, 1000, 500, math.radians(22), "fisheye")
            x, y = np.radians(places * [1, -1]).T / view.pixel + [[499.5], [249.5]]
            beams = kc.trace_beams(camera, view.directions(x, y)[0], end=kc.EquatorialPlane(crossing), time=True)
            np.testing.assert_allclose(beams.radius, 6, rtol=1e-2)
            np.testing.assert_allclose(np.cos(beams.azimuth - orbital * (time - beams.time)), 1, atol=1e-3)
            assert (bright > 0).all()
    first, later = frames.frame(0), frames.frame(5)
    assert first.shape == (720, 1280, 3) and (first != later).any()
    np.testing.assert_array_equal(frames.frame(0), first)


@pytest.mark.slow
def test_command_says_draws_and_saves_a_light_curve(capsys, tmp_path):
    figure, saved = tmp_path / "light.png", tmp_path / "light.npz"
    options = ["--spin", "0.9", "--radius", "50", "--inclination", "60", "--orbit", "8", "--size", "0.5"]
    files = ["--figure", figure, "--save", saved, "--json", "-"]
    status, out, err = run(capsys, "light-curve", *options, "--times", "8", "--crossings", "1", "--points", *files)
    entry = json.loads(out)
    assert status == 0 and "creation" not in err and "8.000" not in err
    assert (entry["schema"], entry["radius"], entry["orbit_radius"]) == ("kerrcaustics/light-curve/2", 50, 8)
    light = kc.load(saved)
    assert entry["flux"] == light.flux.tolist() and len(light.flux) == 8 and figure.stat().st_size > 10_000
    assert np.allclose(np.linalg.norm(light.centroid, axis=1), 1, atol=1e-14)
    # The emission of 4 pi r^2 of sky: a spot of unit area at r = 50 covers some 1 / 50^2.
    assert 1e-5 < light.flux.mean() < 1e-3 and (light.error < 1e-3 * light.flux).all()
    status, _, err = run(capsys, "light-curve", *options[:-4], "--orbit", "1.2")
    assert status == 2 and err.startswith("kerrcaustics: Argument --orbit must be")
