"""Sources in the equatorial plane, seen at the n-th crossing, and where caustics meet it."""

import math

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.beams.ends import Sphere
from kerrcaustics.beams.trace import beams_of_directions, rays_of_directions
from kerrcaustics.draw.track_figure import tracks_figure
from kerrcaustics.scripts import STUDIES

TWIN = STUDIES.module("near_sources.twin")
CAMERA = kc.Camera(0.9, 10.0, 1.2, "fiducial")


@pytest.mark.parametrize(
    ("camera", "star", "complaint"),
    [
        (CAMERA, (1.2, 0.0), "`star` must have an r larger than the horizon"),
        (CAMERA, (math.inf, 0.0), "`star` must be two finite numbers"),
        (CAMERA, (1.0, 2.0, 3.0), "`star` must be two finite numbers"),
        (kc.Camera(0.9, 10.0), (6.0, 0.0), "`camera` must not lie in the equatorial plane"),
    ],
)
def test_sources_that_are_none(camera, star, complaint):
    with pytest.raises(ValueError, match=complaint):
        kc.star_images(camera, star, end=kc.EquatorialPlane(2))


@pytest.mark.parametrize("phi", [math.nan, math.inf])
def test_many_sources_must_be_finite_too(phi):
    with pytest.raises(ValueError, match="`stars` must be an array of finite numbers"):
        kc.image_counts(CAMERA, [(6.0, 1.0), (6.0, phi)], end=kc.EquatorialPlane(2))


@pytest.mark.parametrize("function", [kc.star_tracks, kc.pair_events])
@pytest.mark.parametrize("radius", [1.2, math.inf, math.nan, "far"])
def test_circles_that_are_none(function, radius):
    with pytest.raises(ValueError, match="`level` must be, in the equatorial plane, a finite radius larger than"):
        function(CAMERA, radius, end=kc.EquatorialPlane(1))


def test_circles_are_not_seen_from_within_the_plane():
    for function in (kc.star_tracks, kc.pair_events, kc.count_map):
        with pytest.raises(ValueError, match="`camera` must not lie in the equatorial plane"):
            function(kc.Camera(0.9, 10.0), 2, end=kc.EquatorialPlane(1))


@pytest.mark.parametrize("radii", [[3.0, 2.0], [1.2, 3.0], [], [[3.0]], [3.0, math.nan], [3.0, math.inf], "all"])
def test_radii_of_maps_that_are_none(radii):
    with pytest.raises(ValueError, match=r"`radii` must be radii in rising order, larger than the horizon's 1\.43"):
        kc.count_map(CAMERA, 1, end=kc.EquatorialPlane(1), radii=radii)


def test_spheres_have_no_radii():
    with pytest.raises(ValueError, match="`radii` must be used with an EquatorialPlane"):
        kc.count_map(CAMERA, 1, end=20.0, radii=[3.0])


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--plane", "1"], "--orbit must be given with --plane"),
        (["--orbit", "6"], "--orbit must be used with --plane"),
        (["--plane", "1", "--orbit", "1.2"], "--orbit must be, in the equatorial plane, a finite radius larger than"),
        (["--plane", "1", "--orbit", "6", "--star-theta", "70"], "--star-theta must not be used with --plane"),
        (["--plane", "1", "--orbit", "6", "--film", "x.mp4"], "--film must not be used with --plane"),
        (["--plane", "0", "--orbit", "6"], "--plane must be at least 1"),
    ],
)
def test_command_line_refuses_circles_that_are_none(capsys, options, complaint):
    code, out, err = run(capsys, "tracks", "--spin", "0.9", "--radius", "10", "--inclination", "70", *options)
    assert code == 2 and out == "" and err.count("\n") == 1 and complaint in err


def test_command_line_refuses_bad_planes(capsys):
    camera = ["--spin", "0.9", "--radius", "10", "--inclination", "70"]
    for options in (["--plane", "0"], ["--plane", "1", "--source-radius", "20"]):
        code, out, err = run(capsys, "images", "--star", "6", "45", *camera, *options)
        assert code == 2 and out == "" and err.count("\n") == 1 and "--plane" in err
    code, _, err = run(capsys, "images", "--star", "1.2", "45", *camera, "--plane", "1")
    assert code == 2 and "--star must have an r larger than the horizon" in err


def test_caustics_in_the_plane_have_an_engine():
    with pytest.raises(ValueError, match="Argument `engine` must"):
        kc.caustics(CAMERA, 1, "best", end=kc.EquatorialPlane(2))


@pytest.mark.slow
def test_the_figure_of_a_circle_shows_what_there_is():
    figure = tracks_figure(kc.star_tracks(CAMERA, 6.0, 1, end=kc.EquatorialPlane(1)))
    sky, light = figure.axes
    assert figure.get_suptitle().startswith("star at r = 6 on crossing 1 of the equatorial plane\nspin 0.9")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["index 0"]
    assert (sky.get_title(), light.get_ylabel()) == ("tracks, camera sky", "magnification (sr/M²)")
    # Close about the hole, which is small on this sky: no half of it is shown.
    assert np.abs(sky.lines[0].get_xydata()).max() < sky.get_xlim()[1] < 90


def _random_camera(rng):
    spin = rng.choice([0.0, 0.3, 0.7, 0.9, 0.99])
    return kc.Camera(spin, rng.uniform(4.5, 30), rng.uniform(0.15, 1.45), "fiducial")


def _lacking(twin, images):
    """Images of the twin that are not among those found."""
    pairs = list(zip(images.sky, images.index, strict=True))
    return [one for one in twin if not any(np.linalg.norm(one[:3] - n) < 1e-5 and one[3] == k for n, k in pairs)]


@pytest.mark.slow
@pytest.mark.parametrize("crossing", [1, 2, 3])
def test_plane_images_against_a_dense_grid(crossing):
    rng, end = np.random.default_rng(crossing), kc.EquatorialPlane(crossing)
    for _ in range(3):
        camera = _random_camera(rng)
        source = (1 + math.sqrt(1 - camera.spin**2)) * math.exp(rng.uniform(0.05, 3)), rng.uniform(0, 6)
        images = kc.star_images(camera, source, 3, end=end)
        assert images.certified
        assert not _lacking(TWIN.Twin(camera, end).images(source, 3), images)
        beams = kc.trace_beams(camera, images.sky, "integrated", end=end, time=True)
        np.testing.assert_allclose(beams.radius, source[0], rtol=1e-6)
        np.testing.assert_allclose(np.cos(beams.azimuth), math.cos(source[1]), atol=1e-6)
        np.testing.assert_array_equal(beams.index, images.index)
        np.testing.assert_allclose(beams.time, images.time, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("crossing", [1, 2, 3])
def test_cameras_below_the_plane_see_what_those_above_it_see(crossing):
    """Mirrored, certified."""
    cameras = [CAMERA, kc.Camera(CAMERA.spin, CAMERA.radius, math.pi - CAMERA.inclination, "fiducial")]
    for source in ((3.3, 2.8), (6.0, 0.4)):
        above, below = (kc.star_images(camera, source, 3, end=kc.EquatorialPlane(crossing)) for camera in cameras)
        assert above.certified and below.certified and len(above) == len(below) > 0
        for n, index in zip(above.sky * [1, 1, -1], above.index, strict=True):
            i = int(np.argmin(np.linalg.norm(below.sky - n, axis=1)))
            assert below.index[i] == index and np.linalg.norm(below.sky[i] - n) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(("crossing", "radius"), [(1, 3.0), (2, 6.0), (3, 2.5)])
def test_tracks_in_the_plane_hold_all_images(crossing, radius):
    """Every point leads to the circle by the integrator; images at any azimuth lie on tracks, as many as there are."""
    moving, end = kc.Camera(0.9, 10.0, 1.2, (0.1, 0.3, 0.2)), kc.EquatorialPlane(crossing)
    found = kc.star_tracks(moving, radius, 2, end=end)
    assert found.certified and found.tracks
    for track in found.tracks:
        plain = np.flatnonzero(track.parity != 0)
        beams = kc.trace_beams(moving, track.sky[plain], "integrated", 1e-12, end=end, time=True)
        np.testing.assert_allclose(beams.radius, radius, rtol=1e-7)
        turned = beams.azimuth - track.azimuth[plain]
        np.testing.assert_allclose(turned, 2 * math.pi * np.round(turned / (2 * math.pi)), atol=1e-7)
        np.testing.assert_array_equal(beams.index, track.index[plain])
        np.testing.assert_allclose(beams.time, track.time[plain], rtol=1e-8)
        assert track.turns == (-1 if track.closed else 0)
        assert (track.index[list(track.places)] == [event.order for event in track.events]).all()
    for images in found.images_at(azimuth=np.linspace(0, 6.2, 13)):
        assert images.certified
        passed = sum(_passes(track, images.star[1]) for track in found.tracks)
        assert passed == len(images)


def _passes(track, phi):
    """The number of times that a track passes an azimuth."""
    azimuth = np.append(track.azimuth, track.azimuth[0] + 2 * math.pi * track.turns) if track.closed else track.azimuth
    return int(np.abs(np.diff(np.floor((azimuth - phi) / (2 * math.pi)))).sum())


@pytest.mark.slow
@pytest.mark.parametrize("inclination", [1.2, math.pi - 1.2])
def test_pair_events_in_the_plane_change_the_counts(inclination):
    """By one of each index, the way that their kind says; by the integrator, the beam is flat there."""
    camera, end = kc.Camera(0.9, 10.0, inclination, "fiducial"), kc.EquatorialPlane(2)
    for radius in (2.2, 6.0):
        events = kc.pair_events(camera, radius, 2, end=end)
        assert events.certified and [event.kind for event in events] == ["creation", "annihilation"]
        for event in events:
            sides = [(radius, event.azimuth - 1e-6), (radius, event.azimuth + 1e-6)]
            counts = kc.image_counts(camera, sides, 2, end=end)
            assert counts.certified.all()
            change = 1 if event.kind == "creation" else -1
            np.testing.assert_array_equal(np.diff(counts.counts, axis=0)[0], [0, change, change])
            beams = kc.trace_beams(camera, event.sky[None], "integrated", 1e-12, end=end)
            assert abs(beams.delta_minus[0] / beams.delta_plus[0]) < 1e-7
            assert beams.radius[0] == pytest.approx(radius, rel=1e-8)
            assert math.cos(beams.azimuth[0] - event.azimuth) == pytest.approx(1, abs=1e-15) and event.error < 1e-10
        ends = kc.star_tracks(camera, radius, 1, end=end).ends
        assert [one.azimuth for one in ends] == [event.azimuth for event in events]
        assert len(kc.pair_events(camera, radius, 1, end=end)) == 0


@pytest.mark.slow
def test_count_maps_of_the_plane_and_their_files(tmp_path, capsys):
    """As the counts of single sources; the command line writes the same."""
    end, radii = kc.EquatorialPlane(2), [2.0, 4.0, 12.0]
    world = kc.count_map(CAMERA, 2, 20, end=end, radii=radii)
    assert world.certified.all() and world.counts.shape == (3, 40, 3)
    place = [(4.0, world.phi[j]) for j in range(0, 40, 3)]
    np.testing.assert_array_equal(world.counts[1, ::3], kc.image_counts(CAMERA, place, 2, end=end).counts)
    # Where the caustic is crossed.
    assert set(world.counts[1].sum(axis=1)) == {1, 3}
    tracks = kc.star_tracks(CAMERA, 4.0, 2, end=end)
    for result in (world, tracks, kc.pair_events(CAMERA, 4.0, 2, end=end)):
        kc.save(tmp_path / "result", result)
        assert kc.load(tmp_path / "result") == result
    camera = ["--spin", "0.9", "--radius", "10", "--inclination", "70", "--velocity", "static", "--plane", "2"]
    code, out, err = run(capsys, "tracks", "--orbit", "4", *camera, "--figure", str(tmp_path / "tracks.png"))
    assert code == 0 and "1 tracks, 2 events" in out and err == "" and (tmp_path / "tracks.png").exists()
    code, out, err = run(capsys, "counts", "--map", "--rows", "4", *camera, "--figure", str(tmp_path / "map.png"))
    assert code == 0 and "100.00% of 32 places certified" in out and (tmp_path / "map.png").exists()


@pytest.mark.slow
def test_sphere_images_against_a_dense_grid():
    rng = np.random.default_rng(7)
    for factor in (0.6, 0.9, 1.4, 20.0):
        camera, star = _random_camera(rng), (rng.uniform(0.1, 3.04), rng.uniform(0, 6))
        radius = factor * camera.radius
        images = kc.star_images(camera, star, 2, end=radius)
        assert images.certified
        assert not _lacking(TWIN.Twin(camera, Sphere(radius)).images(star, 2), images)


@pytest.mark.slow
def test_plane_caustics_are_flat_and_bound_the_counts():
    """By the integrator the beams are flat there; across the curve the count changes by two."""
    end = kc.EquatorialPlane(2)
    caustics = kc.caustics(CAMERA, 3, end=end)
    assert [curve.order for curve in caustics] == [2, 2] and caustics.surface == end
    curve = caustics[0]
    middle = curve.place[(curve.place[:, 0] > 2) & (curve.place[:, 0] < 50)]
    beams = kc.trace_beams(CAMERA, curve.sky[::9], "integrated", end=end)
    assert np.abs(beams.delta_minus / beams.delta_plus).max() < 1e-7
    np.testing.assert_allclose(beams.radius, curve.place[::9, 0], rtol=1e-6)
    for r, phi in middle[::12]:
        sides = kc.image_counts(CAMERA, [(r, phi - 1e-3), (r, phi + 1e-3)], 3, end=end)
        assert sides.certified.all()
        assert sorted(np.diff(sides.counts, axis=0)[0].tolist()) in ([0, 0, 1, 1], [-1, -1, 0, 0])


@pytest.mark.slow
def test_sections_of_tubes_are_the_curves_found_directly():
    """The points of `caustic_tubes`, by another engine, lie on the caustic of the sphere through them."""
    tube = kc.caustic_tubes(CAMERA, 2, np.array([math.inf, 30.0, 12.0, 6.0]))[1]
    for row, line in ((1, 10), (2, 60), (3, 100)):
        radius = float(tube.points.radius[row, line])
        section = kc.caustics(CAMERA, 2, end=radius)[1]
        place = np.array([tube.points.theta[row, line], tube.points.azimuth[row, line]])
        away = section.celestial - place
        away[:, 1] = (away[:, 1] + math.pi) % (2 * math.pi) - math.pi
        i = int(np.argmin(np.linalg.norm(away, axis=1)))
        ahead = away[(i + 1) % len(away)] - away[i - 1]
        across = abs(ahead[0] * away[i, 1] - ahead[1] * away[i, 0]) / np.linalg.norm(ahead)
        assert across < 2e-5


@pytest.mark.slow
def test_caustics_in_the_plane_by_the_engine_asked_for():
    """The integrator finds the same curves, with errors of its own."""
    end = kc.EquatorialPlane(2)
    usual, other = kc.caustics(CAMERA, 2, end=end), kc.caustics(CAMERA, 2, "integrated", end=end)
    assert "closed-form" in usual.engine and other.engine == "integrated" and usual.beams > 0 < other.beams
    assert len(usual) == len(other) == 2
    for one, two in zip(usual, other, strict=True):
        assert (one.order, one.ends) == (two.order, two.ends) and one.lost == two.lost == 0
        assert two.error != one.error
        # The points are those of one grid.
        np.testing.assert_allclose(two.place, one.place, rtol=1e-5, atol=1e-5)
        assert two.r_min == pytest.approx(one.r_min, rel=1e-7) and two.r_max == pytest.approx(one.r_max, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [10.0, 1e6])
def test_caustics_in_the_plane_take_few_rays(monkeypatch, radius):
    """Next to where the index changes, and not everywhere; most of them with no more accuracy than that takes."""
    traced = []

    def counting(function):
        def call(camera, sky, engine, tolerance, **options):
            traced.append((np.size(sky) // 3, tolerance))
            return function(camera, sky, engine, tolerance, **options)

        return call

    monkeypatch.setattr("kerrcaustics.lens_map.plane_map.beams_of_directions", counting(beams_of_directions))
    monkeypatch.setattr("kerrcaustics.lens_map.plane_map.rays_of_directions", counting(rays_of_directions))
    camera = kc.Camera(0.9, radius, 1.21, "fiducial")
    found = kc.caustics(camera, 2, end=kc.EquatorialPlane(2))
    assert [curve.order for curve in found] == [2, 2] and not any(curve.lost for curve in found)
    # Measured: 84,000 and 17,000.
    assert sum(rays for rays, _ in traced) < 120_000
    assert sum(rays for rays, tolerance in traced if tolerance < 1e-6) < 25_000


@pytest.mark.slow
def test_open_caustics_in_the_plane_are_whole():
    """To the circles that are looked at first and last, also where the curve leaves along them."""
    for curve in kc.caustics(kc.Camera(0.99, 6.0, 1.45, "fiducial"), 3, end=kc.EquatorialPlane(3)):
        assert sorted(curve.ends) == ["horizon", "infinity"] and curve.lost == 0
        horizon = 1 + math.sqrt(1 - 0.99**2)
        assert (curve.r_min, curve.r_max) == pytest.approx((horizon + 1e-3, horizon + 1e3), rel=curve.error)


@pytest.mark.slow
def test_pairs_next_to_the_extreme_of_a_caustic():
    """A circle that just reaches it meets it twice: both events, or a remark that they may be none."""
    camera, end = kc.Camera(0.99, 4.0, 1.45, "fiducial"), kc.EquatorialPlane(1)
    (curve,) = kc.caustics(camera, 1, end=end)
    for below in (1e-7, 1e-8, 1e-10, 0.0):
        events = kc.pair_events(camera, curve.r_max * (1 - below), 2, end=end)
        assert len(events) == 2 or (not events.certified and "touches a caustic" in events.remarks[0])
        assert events.certified or below < 1e-7
        for event in events:
            beams = kc.trace_beams(camera, event.sky, "integrated", 1e-12, end=end)
            assert abs(beams.delta_minus / beams.delta_plus) < 1e-9
    beyond = kc.pair_events(camera, curve.r_max * (1 + 1e-7), 2, end=end)
    assert beyond.certified and len(beyond) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("off", "crossing", "radius"), [(1e-3, 1, 15.0), (1e-3, 2, 4.0), (-1e-3, 2, 15.0), (1e-4, 1, 15.0)]
)
def test_circles_seen_from_close_to_their_plane(off, crossing, radius):
    """Events are flat by the integrator, and where they say; the whole circle is found."""
    camera, end = kc.Camera(0.9, 10.0, math.pi / 2 + off, "fiducial"), kc.EquatorialPlane(crossing)
    events = kc.pair_events(camera, radius, 2, end=end)
    assert len(events) == 2 and events.certified
    for event in events:
        beams = kc.trace_beams(camera, event.sky, "integrated", 1e-13, end=end)
        assert abs(beams.delta_minus / beams.delta_plus) < 1e-7
        assert float(beams.radius) == pytest.approx(radius, rel=1e-8)
        assert abs(math.remainder(float(beams.azimuth) - event.azimuth, 2 * math.pi)) < 1e-10 and event.error < 1e-10
