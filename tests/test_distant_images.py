"""Views of distant observers and far cameras: images, counts, events and tracks, against cameras far away."""

import json
import math

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.beams.ends import Sphere
from kerrcaustics.lens_map.search_sky import as_seen, magnified, search_camera, search_sky
from kerrcaustics.spacetime.frame import photon_of
from kerrcaustics.spacetime.observer import from_screen, on_screen

INCLINATION = math.radians(60)
OBSERVER = kc.Observer(spin=0.9, inclination=INCLINATION)
STARS = np.array([[1.1, 2.0], [0.4, 5.5], [2.0, 3.3], [1.047, 0.3]])
OPPOSITE = (math.pi - INCLINATION, math.pi)


def camera_at(radius, velocity="fiducial"):
    return kc.Camera(0.9, radius, INCLINATION, velocity)


def on_its_screen(sky, radius):
    """Directions N of a camera as places (alpha, beta) of an observer there."""
    return 2 * radius * sky[:, 1:] / (1 - sky[:, :1])


def test_impact_parameters_keep_their_digits_far_out():
    # At infinity b = -alpha sin i, however large alpha is.
    places = np.array([[1e3, 2e3], [-1e5, 4e4], [3e7, 1e7]])
    light = photon_of(OBSERVER.frame(), tuple(from_screen(places).T))
    np.testing.assert_allclose(light.b, -places[:, 0] * math.sin(INCLINATION), rtol=4e-15)


def test_skies_of_two_magnifications_show_the_same():
    plain, lens = camera_at(1e6), kc.Observer(spin=0.9, inclination=INCLINATION, radius=1e6)
    places = np.array([[3.0, -4.0], [2e3, 1e3], [-1e6, 5e6]])
    sky = as_seen(from_screen(places), lens.frame(), plain.frame())
    np.testing.assert_allclose(on_its_screen(sky, 1e6)[1:], places[1:], rtol=1e-10)
    np.testing.assert_allclose(on_screen(as_seen(sky, plain.frame(), lens.frame())), places, rtol=1e-10)
    np.testing.assert_allclose(magnified(lens.frame(), -sky), -from_screen(places), atol=1e-10)


def test_lengths_are_those_of_the_screen():
    lens, far = kc.Observer(spin=0.9, inclination=INCLINATION, radius=1e7), camera_at(1e7, (0.0, 0.0, 0.0))
    places, step = np.array([[5.0, 1.0], [3e4, -2e4], [2e7, 1e7]]), 1e-3
    sky, beside = from_screen(places), from_screen(places * (1 + step))
    apart = 2 * np.arcsin(np.linalg.norm(beside - sky, axis=1) / 2)
    # A difference of first order, on a step of a thousandth.
    np.testing.assert_allclose(search_sky(lens).lengths(sky) * apart, step * np.linalg.norm(places, axis=1), rtol=2e-3)
    seen = [search_sky(far).to_viewer(one) for one in (sky, beside)]
    np.testing.assert_allclose(
        search_sky(far).lengths(sky) * apart, np.linalg.norm(seen[1] - seen[0], axis=1), rtol=2e-3
    )
    assert search_camera(far) == lens and search_camera(camera_at(1e4)) == camera_at(1e4)


@pytest.mark.slow
@pytest.mark.parametrize("end", [1.6, 6.0, 1000.0], ids=str)
def test_images_at_finite_radius_are_the_limit_of_cameras(end):
    for star in STARS:
        limit = kc.star_images(OBSERVER, star, 3, end=end)
        assert limit.certified and limit.remarks == ()
        misses = []
        for radius in (1e4, 1e6):
            images = kc.star_images(camera_at(radius), star, 3, end=end)
            assert images.per_index == limit.per_index and (images.second_arrival == limit.second_arrival).all()
            late = images.time - radius - 2 * math.log(radius) - limit.time
            place = on_its_screen(images.sky, radius) - limit.sky
            share = images.magnification * radius**2 / limit.magnification - 1
            misses.append(np.stack([late, *place.T, share]) * radius)
        # As 1 / r: the coefficient is the same at both, to its own next term; a camera's N knows 1e-10 M at 1e6.
        size = 1 + np.abs(misses[1])
        assert (np.abs(misses[0] - misses[1]) < 0.2 * end * size + 1e-2 * size).all()


@pytest.mark.slow
@pytest.mark.parametrize("end", [1.6, 6.0, 1e5], ids=str)
def test_images_lead_to_their_star(end):
    """By the integrator, and with the index that it counts."""
    for star in STARS:
        images = kc.star_images(OBSERVER, star, 2, end=end)
        for leaf in (False, True):
            here = images.second_arrival == leaf
            if not here.any():
                continue
            beams = kc.trace_beams(OBSERVER, images.sky[here], "integrated", end=Sphere(end, leaf), time=True)
            np.testing.assert_allclose(np.cos(beams.azimuth - star[1]), 1, atol=1e-12)
            np.testing.assert_allclose(beams.direction[:, 2], math.cos(star[0]), atol=1e-7)
            np.testing.assert_array_equal(beams.index, images.index[here])
            np.testing.assert_allclose(beams.magnification, images.magnification[here], rtol=1e-6)
            np.testing.assert_allclose(beams.time, images.time[here], atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("end", [1.6, 6.0, 300.0, 1e6], ids=str)
def test_caustics_of_the_screen_count_what_the_source_sees(end):
    rng = np.random.default_rng(2)
    stars = np.stack([np.arccos(rng.uniform(-1, 1, 12)), rng.uniform(0, 2 * np.pi, 12)], axis=-1)
    reported = kc.image_counts(OBSERVER, stars, 2, find=False, end=end)
    found = kc.image_counts(OBSERVER, stars, 2, end=end)
    assert found.certified.all() and not reported.certified.any()
    np.testing.assert_array_equal(found.counts, reported.counts)
    # Seen directly.
    assert (found.counts[:, 0] >= 1).all()
    middle = kc.count_map(OBSERVER, 2, 30, end=end)
    assert middle.counts[..., 0].min() >= 1


@pytest.mark.slow
def test_stars_at_infinity_have_no_direct_image():
    rng = np.random.default_rng(3)
    stars = np.stack([np.arccos(rng.uniform(-1, 1, 40)), rng.uniform(0, 2 * np.pi, 40)], axis=-1)
    limit, near = (kc.image_counts(camera, stars, 3) for camera in (OBSERVER, camera_at(3e4)))
    assert limit.certified.all() and near.certified.all()
    assert (limit.counts[:, 0] == 0).all() and (near.counts[:, 0] == 1).all()
    np.testing.assert_array_equal(limit.counts[:, 1:], near.counts[:, 1:])
    images, far = (kc.star_images(camera, STARS[0], 3) for camera in (OBSERVER, camera_at(1e6)))
    assert images.certified and images.per_index[0] == images.expected[0] == 0
    assert len(images.remarks) == 1 and "infinite (alpha, beta)" in images.remarks[0]
    direct = far.index == 0
    np.testing.assert_allclose(on_its_screen(far.sky, 1e6)[~direct], images.sky, atol=1e-4)
    # It is where the star is in flat space, at about the radius of the camera from the hole.
    assert np.hypot(*on_its_screen(far.sky, 1e6)[direct].T).min() > 1e5


@pytest.mark.slow
def test_next_to_the_opposite_point():
    # Rays of impact parameter b lead to 4 / b beside it.
    for away in (1e-2, 1e-4):
        images = kc.star_images(OBSERVER, (OPPOSITE[0] + away, OPPOSITE[1]), 1)
        assert images.certified and np.hypot(*images.sky[0]) == pytest.approx(4 / away, rel=4 * away)
    there = kc.star_images(OBSERVER, OPPOSITE, 1)
    assert not there.certified and there.on_caustic == (1,)


def test_only_images_of_index_one_can_be_asked_for_at_infinity():
    with pytest.raises(
        ValueError, match="Argument `max_index` must be at least 1 for an observer and stars at infinity"
    ):
        kc.star_images(OBSERVER, STARS[0], 0)


@pytest.mark.slow
@pytest.mark.parametrize("crossing", [1, 3])
def test_sources_in_the_plane(crossing):
    end = kc.EquatorialPlane(crossing)
    for source in ((6.0, 0.8), (2.5, 3.0)):
        limit, far = (kc.star_images(camera, source, 4, end=end) for camera in (OBSERVER, camera_at(1e6)))
        assert limit.certified and limit.per_index == far.per_index
        np.testing.assert_allclose(on_its_screen(far.sky, 1e6), limit.sky, atol=1e-4)
        np.testing.assert_allclose(far.time - 1e6 - 2 * math.log(1e6), limit.time, atol=1e-4)
        rays = kc.trace_rays(OBSERVER, limit.sky, end=end)
        np.testing.assert_allclose(rays.radius, source[0], rtol=1e-9)
        counts = kc.image_counts(OBSERVER, [source], 4, end=end)
        assert counts.certified.all() and counts.counts[0].tolist() == list(limit.per_index.values())


@pytest.mark.slow
def test_caustics_in_the_plane_lead_there():
    curves = kc.caustics(OBSERVER, 3, end=kc.EquatorialPlane(3))
    assert len(curves)
    for curve in curves:
        beams = kc.trace_beams(OBSERVER, curve.sky, end=kc.EquatorialPlane(3))
        near = curve.place[:, 0] < 100
        np.testing.assert_allclose(beams.radius[near], curve.place[near, 0], rtol=1e-7)
        assert np.abs(beams.delta_minus / beams.delta_plus)[near].max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("end", [6.0, math.inf], ids=str)
def test_events_are_where_counts_change(end):
    events = kc.pair_events(OBSERVER, 1.2, 2, end=end)
    assert len(events) == 2 and [event.kind for event in events] == ["creation", "annihilation"]
    for event in events:
        before, after = (kc.star_images(OBSERVER, (1.2, event.longitude + step), 2, end=end) for step in (-1e-3, 1e-3))
        assert before.certified and after.certified and math.isnan(event.moment)
        assert len(after) - len(before) == (2 if event.kind == "creation" else -2)
        assert event.sky.shape == (2,) and np.linalg.norm(event.sky) < 8


@pytest.mark.slow
def test_tracks_are_of_the_star():
    tracks = kc.star_tracks(OBSERVER, 1.2, 2)
    assert tracks.certified and len(tracks.events) == 2 and math.isinf(tracks.period)
    single, together = kc.star_images(OBSERVER, (1.2, 2.0), 2), tracks.images_at(azimuth=2.0)
    np.testing.assert_allclose(together.sky, single.sky, atol=1e-10)
    with pytest.raises(ValueError, match="Argument `time` must be left out where the camera does not orbit"):
        tracks.images_at(0.0)


@pytest.mark.slow
def test_tracks_at_finite_radius_are_images():
    tracks = kc.star_tracks(OBSERVER, 1.4, 1, end=8.0)
    assert tracks.certified
    for track in tracks.tracks:
        which = len(track) // 3
        images = kc.star_images(OBSERVER, (1.4, track.azimuth[which] % math.tau), 1, end=8.0)
        mine = images.index == track.index[which]
        assert np.linalg.norm(images.sky[mine] - track.sky[which]) <= images.error[mine] + track.error[which]
        assert images.magnification[mine] == pytest.approx(track.magnification[which], rel=1e-9)
        assert images.redshift[mine] == pytest.approx(track.redshift[which], rel=1e-9)
    at = tracks.images_at(azimuth=1.0)
    assert at.sky == pytest.approx(kc.star_images(OBSERVER, (1.4, 1.0), 1, end=8.0).sky, abs=1e-10)


@pytest.mark.slow
def test_tracks_in_the_plane_are_images():
    plane = kc.EquatorialPlane(2)
    tracks, events = kc.star_tracks(OBSERVER, 4.0, 2, end=plane), kc.pair_events(OBSERVER, 4.0, 2, end=plane)
    assert tracks.certified and [e.azimuth for e in events] == [e.azimuth for e in tracks.events]
    radius = 1e4
    far = kc.pair_events(camera_at(radius), 4.0, 2, end=plane)
    assert [e.azimuth for e in far] == pytest.approx([e.azimuth for e in events], abs=50 / radius)
    (track,) = tracks.tracks
    which = int(np.flatnonzero(track.parity)[len(track) // 3])
    images = kc.star_images(OBSERVER, (4.0, track.azimuth[which] % math.tau), 2, end=plane)
    mine = np.linalg.norm(images.sky - track.sky[which], axis=1).argmin()
    assert np.linalg.norm(images.sky[mine] - track.sky[which]) <= images.error[mine] + track.error[which]
    assert images.magnification[mine] == pytest.approx(track.magnification[which], rel=1e-6)
    assert images.time[mine] == pytest.approx(track.time[which], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1.1e5, 1e7, 1e9])
def test_far_cameras_see_as_well_as_near_ones(radius):
    moving = camera_at(radius, (0.1, -0.2, 0.3))
    counts = kc.image_counts(moving, STARS, 3)
    assert counts.certified.all()
    np.testing.assert_array_equal(counts.counts, kc.image_counts(camera_at(3e4), STARS, 3).counts)
    images = kc.star_images(moving, STARS[0], 3)
    assert images.certified and images.error.max() < 1e-13
    beams = kc.trace_beams(moving, images.sky)
    place = np.stack([np.sin(STARS[0, 0]) * np.cos(STARS[0, 1]), np.sin(STARS[0, 0]) * np.sin(STARS[0, 1])])
    # N of a camera knows 1e-16 rad, and so much less of what lies next to the hole.
    spread = 1e-15 * beams.delta_plus
    assert (np.abs(beams.direction[:, :2] - place).max(axis=1) < 1e-12 + spread).all()
    np.testing.assert_allclose(images.redshift, beams.redshift, rtol=1e-9)
    np.testing.assert_allclose(images.magnification, beams.magnification, rtol=1e-7 + 1e-13 * radius)
    caustics = kc.caustics(moving, 4)
    assert caustics.missing == () and [curve.kind for curve in caustics][1:] == ["astroid"] * 3
    assert max(curve.error for curve in caustics) < 1e-9
    limit = kc.caustics(OBSERVER, 4)
    assert caustics[1].phi_extent == pytest.approx(limit[1 - 1].phi_extent, abs=10 / radius)


@pytest.mark.slow
def test_times_and_places_go_on_where_an_observer_stands_in():
    """Of cameras at 1e5, less than it and more."""
    below, above = (kc.star_images(camera_at(radius), STARS[0], 2, end=1e8) for radius in (1e5 - 0.01, 1e5 + 0.01))
    assert below.certified and above.certified
    np.testing.assert_allclose(below.sky, above.sky, atol=1e-9)
    np.testing.assert_allclose(above.time, below.time, atol=0.1)
    np.testing.assert_allclose(above.magnification, below.magnification, rtol=1e-6)
    planes = [kc.star_images(camera_at(r), (50.0, 1.0), 2, end=kc.EquatorialPlane(1)) for r in (1e5 - 0.01, 1e5 + 0.01)]
    np.testing.assert_allclose(planes[0].sky, planes[1].sky, atol=1e-9)
    np.testing.assert_allclose(planes[0].time, planes[1].time, atol=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("caustics", "--velocity", "static"), "--velocity must be fiducial at infinity"),
        (("caustics", "--plane", "1", "--figure", "curves.png"), "--figure must not be used with --plane"),
        (("tracks", "--plane", "1", "--orbit", "6", "--film", "t.mp4"), "--film must not be used with --plane"),
        (("images", "--star", "70", "120", "--max-index", "0"), "--max-index must be at least 1 for an observer"),
        (("images", "--star", "70", "120", "--velocity", "static"), "--velocity must be fiducial at infinity"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_commands_refuse_what_needs_a_camera(arguments, message, capsys):
    command, *others = arguments
    status, out, err = run(capsys, command, "--spin", "0.9", "--inclination", "60", "--radius", "inf", *others)
    assert (status, out) == (2, "") and f"Argument {message}" in err


@pytest.mark.slow
def test_commands_take_an_observer(tmp_path, capsys):
    camera = ("--spin", 0.9, "--radius", "inf", "--inclination", 60)
    file = tmp_path / "images.json"
    status, out, _ = run(capsys, "images", *camera, "--star", 70, 120, "--source-radius", 10, "--json", file)
    assert status == 0 and "alpha, beta" in out and "errors on the sky in GM/c^2" in out
    entry = json.loads(file.read_text())
    assert entry["certified"] and len(entry["images"][0]["sky"]) == 2
    status, out, _ = run(capsys, "images", *camera, "--star", 6, 45, "--plane", 1)
    assert status == 0 and "certified" in out
    status, out, _ = run(capsys, "counts", *camera, "--star", 70, 120)
    assert status == 0 and "1 of 1 certified" in out and "are not among the images" in out
    picture = tmp_path / "map.png"
    status, out, _ = run(capsys, "counts", *camera, "--map", "--rows", 20, "--figure", picture)
    assert status == 0 and picture.exists()
    status, out, _ = run(capsys, "tracks", *camera, "--star-theta", 70)
    assert status == 0 and "in one turn of phi': certified" in out


@pytest.mark.slow
@pytest.mark.parametrize("inclination", [0.0, math.pi])
def test_on_the_spin_axis(inclination):
    """On the axis, where any azimuth will do: nothing jumps, and both counts agree."""
    observer, beside = (kc.Observer(spin=0.9, inclination=abs(inclination - tilt)) for tilt in (0.0, 1e-7))
    found, reported = (kc.image_counts(observer, STARS, 2, find=find, end=6.0) for find in (True, False))
    assert found.certified.all() and (found.counts == reported.counts).all()
    images, others = (kc.star_images(one, STARS[0], 2, end=6.0) for one in (observer, beside))
    np.testing.assert_allclose(images.sky, others.sky, atol=1e-5)
    np.testing.assert_allclose(images.time, others.time, atol=1e-5)


@pytest.mark.parametrize("spin", [0.0, 0.999])
def test_sources_as_far_away_as_the_observer_are_found_as_those_beyond(spin):
    """A line to them begins below the horizontal by more than the rounding of a direction on the magnified sky."""
    observer = kc.Observer(spin=spin, inclination=1.2, radius=1e9)
    level, beyond = (kc.star_images(observer, (1.4, 2.9), 1, end=factor * observer.radius) for factor in (1.0, 1.5))
    assert level.certified and beyond.certified and level.per_index == beyond.per_index == {0: 1, 1: 1}
    assert level.magnification[1] == pytest.approx(beyond.magnification[1], rel=1e-6)
