"""Star tracks and pair events: against rays traced one by one, the search for images, and the caustics."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from offenders import for_each

import kerrcaustics as kc
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.level_curves.path_events import path_events
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.sphere import polar_angle

# Name: spin, radius, inclination, velocity, highest index.
CAMERAS = {
    "6.03": (0.999, 6.03, math.pi / 2, "circular", 2),
    "2.6": (0.999, 2.6, math.pi / 2, "circular", 2),
    "2.6 index 3": (0.999, 2.6, math.pi / 2, "circular", 3),
    "inclined": (0.9, 8.0, 1.0, "fiducial", 2),
    "retrograde": (0.95, 5.0, math.pi / 2, (0.0, 0.0, -0.5), 1),
    "small caustics": (0.01, 13.0, math.pi / 2, "circular", 2),
}
# The star at 1.0 passes through cusps that the inclined camera's caustic of order 2 has at its own inclination.
FAST = [("6.03", 1.2)]
SLOW = [
    ("2.6", 1.5),
    ("2.6", math.pi / 2),
    ("2.6", math.pi / 2 + 1e-3),
    ("2.6", 0.05),
    ("2.6 index 3", 1.2),
    ("2.6 index 3", math.pi / 2),
    ("inclined", 1.0),
    ("inclined", 1.2),
    ("inclined", 2.5),
    ("retrograde", 1.4),
    ("6.03", 2.1),
    # Through the secondary and the tertiary caustic, of 1e-4 rad, and past the primary one of 2e-7 rad.
    ("small caustics", 1.57078),
]


def slow(cases):
    return [pytest.param(*case, marks=pytest.mark.slow) for case in cases]


def camera_of(name):
    return kc.Camera(*CAMERAS[name][:4])


@cache
def tracked(name, theta):
    return kc.star_tracks(camera_of(name), theta, CAMERAS[name][4])


def wrapped(angle):
    return (np.asarray(angle) + math.pi) % (2 * math.pi) - math.pi


@pytest.mark.slow
@pytest.mark.parametrize(("name", "theta"), FAST + slow(SLOW))
def test_every_point_of_a_track_shows_the_star(name, theta):
    tracks = tracked(name, theta)
    assert tracks.certified and not tracks.remarks
    for track in tracks.tracks:
        beams = kc.trace_beams(tracks.camera, track.sky, tolerance=1e-12)
        away = np.hypot(polar_angle(beams.direction) - theta, math.sin(theta) * wrapped(beams.azimuth - track.azimuth))
        # Far on the sky by no more than the errors say: the shorter side of the beam is the worst case.
        moved = np.where(track.parity == 0, beams.delta_plus, np.abs(beams.delta_minus)) * track.error
        assert np.all(away <= 10 * (beams.error + moved))
        plain = track.parity != 0
        assert np.array_equal(beams.index[plain], track.index[plain])
        assert np.array_equal(beams.parity[plain], track.parity[plain])
        assert np.isinf(track.magnification[~plain]).all()
        np.testing.assert_array_equal(np.flatnonzero(~plain), track.places)
        assert track.closed or (track.places[0], track.places[-1]) == (0, len(track) - 1)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "theta"), FAST + slow(SLOW))
def test_tracks_are_smooth(name, theta):
    for track in tracked(name, theta).tracks:
        sky, azimuth = track.sky, track.azimuth
        if track.closed:
            sky, azimuth = np.concatenate([sky, sky[:1]]), np.append(azimuth, azimuth[0] + 2 * math.pi * track.turns)
        assert np.linalg.norm(np.diff(sky, axis=0), axis=1).max() <= math.radians(2.0001)
        assert np.abs(np.diff(azimuth)).max() * math.sin(theta) <= math.radians(2.0001)
        # The index changes at events alone, and there by one.
        change = np.abs(np.diff(track.index))
        assert change.max(initial=0) <= 1
        assert np.all((track.parity[1:] == 0) | (track.parity[:-1] == 0) | (change == 0))


def matched(ours, other):
    """Largest distance of images, in the sum of both errors; images of one index in any order."""
    assert ours.per_index == other.per_index
    gap = np.linalg.norm(ours.sky[:, None] - other.sky[None], axis=2)
    gap[ours.index[:, None] != other.index[None]] = np.inf
    nearest = gap.argmin(axis=1)
    assert len(set(nearest.tolist())) == len(nearest)
    return (gap.min(axis=1) / (ours.error + other.error[nearest])).max()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "theta"), FAST + slow(SLOW))
def test_images_at_any_moment_are_those_of_the_search(name, theta):
    tracks = tracked(name, theta)
    azimuth, compared = np.random.default_rng(1).uniform(-20, 20, 12), 0
    for phi, images in zip(azimuth, tracks.images_at(azimuth=azimuth), strict=True):
        other = kc.star_images(tracks.camera, (theta, phi), tracks.max_index)
        assert images.certified
        assert math.isclose(images.star[1], phi % (2 * math.pi), abs_tol=1e-12)
        if other.certified:
            compared += 1
            assert matched(images, other) <= 1
            np.testing.assert_allclose(np.sort(images.redshift), np.sort(other.redshift), rtol=1e-9)
    assert compared > 9
    one = tracks.images_at(3.7)
    other = tracks.images_at(azimuth=-3.7 * tracks.angular_velocity)
    assert matched(one, other) <= 1


@pytest.mark.parametrize(("name", "theta"), FAST + slow(SLOW))
def test_counts_change_by_a_pair_at_every_event(name, theta):
    tracks = tracked(name, theta)
    sense = np.sign(tracks.angular_velocity)
    for event in (*tracks.events, *tracks.ends):
        # As the orbit goes on, the star's azimuth falls.
        azimuth = event.azimuth + np.array([1, -1]) * sense * 1e-6
        earlier, later = tracks.images_at(azimuth=azimuth)
        assert earlier.certified and later.certified
        gained = {k: later.per_index[k] - earlier.per_index[k] for k in later.per_index}
        sign = 1 if event.kind == "creation" else -1
        assert gained == {k: sign * (k in event.indices) for k in gained}
        stars = np.stack([np.full(2, theta), azimuth], axis=-1)
        expected = kc.image_counts(tracks.camera, stars, tracks.max_index, find=False).expected
        assert [list(images.per_index.values()) for images in (earlier, later)] == expected.tolist()
    kinds = [event.kind for event in tracks.events]
    assert kinds.count("creation") == kinds.count("annihilation")


@pytest.mark.parametrize(("name", "theta"), FAST + slow(SLOW))
def test_events_lie_on_the_caustics_and_say_their_error(name, theta):
    tracks = tracked(name, theta)
    events = kc.pair_events(tracks.camera, theta, tracks.max_index)
    assert [e.moment for e in events] == sorted(e.moment for e in events)
    for one, other in zip(events, tracks.events, strict=True):
        assert one.kind == other.kind and abs(one.azimuth - other.azimuth) <= one.error + other.error
    for event in (*events, *tracks.ends):
        beams = kc.trace_beams(tracks.camera, event.sky[None], "integrated", 1e-13)
        assert abs(beams.delta_minus[0]) < 1e-9 * beams.delta_plus[0]
        assert abs(polar_angle(beams.direction)[0] - theta) <= 10 * beams.error[0] + 10 * event.error * math.sin(theta)
        assert abs(wrapped(beams.azimuth[0] - event.azimuth)) <= 10 * (beams.error[0] / math.sin(theta) + event.error)
        assert event.star == (theta, event.azimuth % (2 * math.pi)) and event.indices == (event.order - 1, event.order)
        phase = event.azimuth + tracks.angular_velocity * event.moment
        assert abs(wrapped(phase)) < 1e-9 and 0 <= event.moment < tracks.period


def test_extremes_of_theta_bound_the_events():
    """A star just below the highest point of a caustic meets it twice; one just above, never."""
    camera = camera_of("6.03")
    secondary = kc.caustics(camera, 2)[1]
    inside, outside = (kc.pair_events(camera, secondary.theta_min + step, 2) for step in (1e-9, -1e-9))
    assert [e.order for e in inside].count(2) == 2 and [e.order for e in outside].count(2) == 0
    grazing = kc.pair_events(camera, secondary.theta_min, 2)
    # Nearer to the extreme than its error: the two are left out, and that is said.
    assert len(grazing) == 0 and len(grazing.remarks) == 1
    assert "grazes the caustic of order 2" in grazing.remarks[0]


def test_star_that_passes_through_cusps():
    events = kc.pair_events(camera_of("6.03"), math.pi / 2, 2)
    cusps = kc.caustics(camera_of("6.03"), 2)
    assert len(events) == 4 and all(event.at_cusp and event.remarks for event in events)
    for event in events:
        gaps = [abs(c.celestial[1] - event.azimuth) for c in cusps[event.order - 1].cusps]
        assert min(gaps) <= 10 * (event.error + cusps[event.order - 1].error)


@pytest.mark.slow
def test_tracks_through_small_caustics_are_certified():
    tracks = kc.star_tracks(camera_of("small caustics"), 1.57078, 1)
    assert tracks.certified
    assert [event.order for event in tracks.ends] == [2, 2]


def test_star_at_a_pole_stands_still():
    tracks = kc.star_tracks(camera_of("6.03"), 0.0, 2)
    assert tracks.certified and not tracks.events
    assert [len(track) for track in tracks.tracks] == [1, 1, 1]
    images = tracks.images_at([0.0, 5.0])
    assert all(image.certified and np.array_equal(image.sky, images[0].sky) for image in images)


def test_orbital_velocity():
    camera = kc.Camera(0.999, 2.6)
    assert math.isclose(camera.orbital_velocity(), 1 / (0.999 + 2.6**1.5), rel_tol=1e-14)
    assert math.isclose(kc.Camera(0.999, 2.6, velocity="fiducial").orbital_velocity(), 0.090135, abs_tol=1e-6)


@pytest.mark.slow
def test_star_followed_through_an_orbit_is_the_star_of_the_tracks():
    tracks = tracked("2.6", 1.5)
    times = np.linspace(0, tracks.period, 120)
    places = np.stack([np.full(len(times), 1.5), tracks.azimuth_at(times)], axis=-1)
    followed = kc.follow_star([tracks.camera] * len(times), places, 2)
    assert followed.certified and len(followed) == len(times)
    for i in range(1, len(times)):
        inside = [e for e in tracks.events if times[i - 1] < e.moment <= times[i]]
        ends = [e for e in tracks.ends if times[i - 1] < e.moment <= times[i]]
        born, gone = ([e for e in inside if e.kind == kind] for kind in ("creation", "annihilation"))
        single = [sum(e.kind == kind for e in ends) for kind in ("creation", "annihilation")]
        assert len(followed.created[i]) == 2 * len(born) + single[0]
        assert len(followed.annihilated[i]) == 2 * len(gone) + single[1]


@pytest.mark.slow
def test_star_followed_by_a_falling_camera():
    cameras = [kc.Camera(0.9, radius, 1.2, (-0.1, 0.02, 0.3)) for radius in (8.0, 7.95, 7.9)]
    followed = kc.follow_star(cameras, (1.0, 2.0), 1)
    assert followed.certified
    for i, (before, images) in enumerate(zip(followed.before, followed.images, strict=True)):
        if i == 0:
            assert np.all(before == -1)
            continue
        assert sorted(before.tolist()) == list(range(len(images))) and followed.followed[i].all()
        step = np.linalg.norm(images.sky - followed.images[i - 1].sky[before], axis=1)
        assert np.all(step < 0.02) and np.all(np.abs(images.azimuth - followed.images[i - 1].azimuth[before]) < 0.1)


@for_each(
    "change",
    "name",
    rows=[
        ({"level": -0.1}, "level"),
        ({"level": 3.2}, "level"),
        ({"level": math.nan}, "level"),
        ({"level": "up"}, "level"),
        ({"max_index": -1}, "max_index"),
        ({"max_index": 1.5}, "max_index"),
        ({"camera": kc.Camera(0.9, 8.0, 1.0, "static")}, "camera"),
        ({"camera": kc.Camera(0.9, 8.0, velocity=(0.1, 0.0, 0.3))}, "camera"),
        ({"camera": kc.Camera(0.9, 8.0, velocity=(0.0, 0.1, 0.3))}, "camera"),
        ({"camera": kc.Camera(0.0, 8.0, velocity="fiducial")}, "camera"),
        ({"camera": kc.Camera(0.9, 8.0, 0.0)}, "camera"),
        ({"camera": "Gargantua"}, "camera"),
    ],
    function=[kc.star_tracks, kc.pair_events],
)
def test_bad_input_is_named(function, change, name):
    request = {"camera": kc.Camera(0.999, 6.03), "level": 1.2, "max_index": 2, **change}
    with pytest.raises(ValueError, match=rf"Argument `{name}` must") as caught:
        function(**request)
    assert "\n" not in str(caught.value)


def test_bad_moments_and_lists_are_named():
    tracks = tracked("6.03", 1.2)
    with pytest.raises(ValueError, match="Arguments `time` and `azimuth`"):
        tracks.images_at()
    with pytest.raises(ValueError, match="Argument `time`"):
        tracks.images_at(math.inf)
    with pytest.raises(ValueError, match="Argument `cameras`"):
        kc.follow_star([], (1.0, 2.0))
    with pytest.raises(ValueError, match="Argument `star`"):
        kc.follow_star([tracks.camera], (1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="Argument `star` must have theta'"):
        kc.follow_star([tracks.camera], (4.0, 2.0))


@pytest.mark.slow
def test_counts_along_tracks_are_the_winding_of_the_caustics():
    """Between events, at many azimuths, the tracks hold as many images of each index as the caustics say."""
    for name, theta in (*FAST, *SLOW):
        tracks = tracked(name, theta)
        azimuth = np.random.default_rng(2).uniform(0, 2 * math.pi, 300)
        stars = np.stack([np.full(300, theta), azimuth], axis=-1)
        expected = kc.image_counts(tracks.camera, stars, tracks.max_index, find=False).expected
        images = tracks.images_at(azimuth=azimuth)
        counts = np.array([list(image.per_index.values()) for image in images])
        assert np.array_equal(counts, expected)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "theta"), [("6.03", 1.2), ("2.6", 1.5), ("2.6 index 3", 1.0), ("inclined", 1.2)])
def test_event_errors_are_honest(name, theta):
    camera, highest = camera_of(name), CAMERAS[name][4]
    sheets = sheets_of(camera, highest)
    exact_map = replace(sheets.curves.map, engine="integrated", tolerance=1e-13)
    exact = replace(sheets, curves=replace(sheets.curves, map=exact_map))
    circle = Circle.about_spin_axis(theta)
    ours, other = path_events(sheets, circle), path_events(exact, circle)
    assert np.array_equal(ours.order, other.order) and np.array_equal(ours.side, other.side)
    assert np.all(np.abs(ours.longitude - other.longitude) <= 10 * ours.error)
    assert np.linalg.norm(ours.points.line_of_sight - other.points.line_of_sight, axis=1).max() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("level", "end"), [(1.2, math.inf), (1.5, 8.0), (6.0, kc.EquatorialPlane(1))], ids=["sky", "sphere", "plane"]
)
def test_light_of_tracks_is_that_of_images_within_both_errors(level, end):
    camera = kc.Camera(0.9, 10.0, 1.2)
    (track, *_) = kc.star_tracks(camera, level, 1, end=end).tracks
    for i in range(0, len(track), len(track) // 4):
        images = kc.star_images(camera, (level, math.remainder(track.azimuth[i], 2 * math.pi)), 1, end=end)
        k = int(np.argmin(np.linalg.norm(images.sky - track.sky[i], axis=1)))
        for name in ("magnification", "redshift", "time"):
            value, other = (getattr(one, name)[j] for one, j in ((track, i), (images, k)))
            off, more = (getattr(one, f"{name}_error")[j] for one, j in ((track, i), (images, k)))
            assert abs(value - other) < off + more < 1e-6 * abs(value)
