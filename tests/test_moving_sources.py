"""Light curves of points on any orbit, against numbers of another code, images of sources at rest, and energy."""

import csv
import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import problems
import pytest
from beam_equations import Event
from command_line import run
from moving_ball import ball_light, light_at_rest

import kerrcaustics as kc
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.light_curves.body_light import body_light_curve
from kerrcaustics.light_curves.image_curves import ImageCurves
from kerrcaustics.light_curves.seen_images import seen_images
from kerrcaustics.orbits.orbit import clock_rates, orbit_of
from kerrcaustics.scene_files.orbit_file import read_orbit

CAMERA = kc.Camera(spin=0.9, radius=50, inclination=1.0, velocity="fiducial")
OBSERVER = kc.Observer(spin=0.9, inclination=1.0)
INCLINED = kc.Orbit.geodesic(8.0, 1.2, 0.3, (-0.05, 0.1, 0.35), time=3.0)


@pytest.mark.parametrize(
    "orbit",
    [INCLINED, kc.Orbit.kepler(100.0, 0.9, 0.3, 0.2, 0.4), kc.Orbit.function(lambda t: (9 + 0.01 * t, 1.2, 0.02 * t))],
)
def test_rates_are_those_of_the_places(orbit):
    motion, time, step = orbit.motion_about(0.9, (-60.0, 500.0)), np.linspace(-50, 490, 19), 1e-3
    here, before, after = (motion.places(time + late) for late in (0, -step, step))
    assert np.abs((after.vector - before.vector) / (2 * step) - here.rate).max() < 1e-7
    assert np.abs((after.radius - before.radius) / (2 * step) - here.radius_rate).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    "viewer", [kc.Observer(spin=0.9, inclination=math.pi / 2), kc.Camera(0.9, 50, math.pi / 2, "static")]
)
def test_a_viewer_in_the_plane_of_the_orbit_is_told_to_leave_it(viewer):
    """Cusps of caustics lie in that plane, so that images there meet three at a time."""
    settings, times = {"source": "point", "max_index": 0}, np.linspace(0, 148, 4)
    light = kc.light_curve(viewer, 8.0, times, **settings)
    (remark,) = light.remarks
    assert not light.certified and remark.endswith("incline the viewer by 89.9999 degrees instead of 90")
    tilted = kc.light_curve(replace(viewer, inclination=math.radians(89.9999)), 8.0, times, **settings)
    assert tilted.certified and len(tilted.events) > 1
    # Of times at which the source meets no cusp nothing is in doubt.
    assert kc.light_curve(viewer, 8.0, [50.0, 60.0], **settings).certified


def test_a_circle_is_the_geodesic_that_it_is():
    radius, spin, time = 8.0, 0.9, np.linspace(0, 500, 7)
    reported = kc.Orbit.function(lambda t: (radius, math.pi / 2, t / (radius**1.5 + spin)))
    circle, other = (
        orbit.motion_about(spin, (0.0, 500.0)).places(time) for orbit in (orbit_of("orbit", radius), reported)
    )
    assert np.abs(circle.vector - other.vector).max() < 1e-10
    u_t = kc.Camera(spin, radius, velocity="circular").clock_rate
    assert clock_rates(spin, circle) == pytest.approx(u_t**-2, rel=1e-11)


@pytest.mark.slow
def test_travel_times_are_those_of_another_code():
    camera = kc.Camera(spin=0.8, radius=1000.0, inclination=math.radians(17))
    still = kc.Orbit.function(lambda t: (10.0, math.radians(89.9), math.radians(-45.0)))
    light = kc.light_curve(camera, still, [1000.0, 1100.0], max_index=3)
    # KerrP2P, as in the reference numbers: near_source_images.
    times = [1007.7900780693874, 1037.3898567339015, 1050.660102999578, 1066.9609330663752]
    assert light.certified
    assert light.travel_time[:, 0] == pytest.approx(times, abs=2e-7)


@pytest.fixture(scope="module")
def inclined():
    """The light of the inclined orbit, which passes turning points of rays and two pair events."""
    return kc.light_curve(CAMERA, INCLINED, np.linspace(100.0, 190.0, 60))


@pytest.mark.slow
def test_images_are_those_of_a_source_at_rest_at_its_place(inclined):
    assert inclined.certified
    motion = INCLINED.motion_about(0.9, (-100.0, 300.0))
    for i, j in ((0, 5), (1, 30), (3, 10)):
        emitted = inclined.emission_time[i, j]
        place = motion.places(np.array([emitted]))
        theta, phi = place.angles[0].tolist()
        images = kc.star_images(CAMERA, (theta, phi), 2, end=float(place.radius[0]))
        away = np.linalg.norm(images.sky - inclined.sky[i, j], axis=1)
        k = int(np.argmin(away))
        assert away[k] < 1e-9
        assert images.index[k] == inclined.index[i]
        assert emitted + images.time[k] == pytest.approx(inclined.time[j], abs=1e-6)


@pytest.mark.slow
def test_a_point_may_pass_behind_the_camera():
    camera, orbit = kc.Camera(0.9, 5.0, 1.2), kc.Orbit.geodesic(10.0, 1.2)
    light = kc.light_curve(camera, orbit, np.linspace(0.0, 10.0, 5), max_index=0)
    assert light.certified and light.index.tolist() == [0]
    motion = orbit.motion_about(0.9, (-100.0, 100.0))
    for emitted, time, sky in zip(light.emission_time[0], light.time, light.sky[0], strict=True):
        place = motion.places(np.array([emitted]))
        images = kc.star_images(camera, tuple(place.angles[0].tolist()), 0, end=float(place.radius[0]))
        assert np.linalg.norm(images.sky[0] - sky) < 1e-9
        assert emitted + images.time[0] == pytest.approx(time, abs=1e-6)


@pytest.mark.slow
def test_a_point_that_comes_from_the_horizon_is_seen_from_afar():
    observer = kc.Observer(spin=0.998, inclination=math.pi / 2, radius=6516.157274392356)
    orbit = kc.Orbit.geodesic(9.926460384800599, 2.1338613635158032, -1.4934293270483676, velocity=(0.9, 0.0, 0.2))
    light = kc.light_curve(observer, orbit, np.linspace(5.0, 35.0, 10), max_index=1)
    assert light.certified
    assert (light.error < 1e-6 * light.flux).all()


@pytest.mark.stand_ins
def test_without_any_image_the_flux_is_unknown():
    source, curves = SimpleNamespace(searched=search_sky(CAMERA)), ImageCurves((), (), ("in doubt",))
    images = seen_images(source, [], [])
    light = body_light_curve(source, INCLINED, np.array([1.0, 2.0]), curves, [], images, None, 0.0)
    assert np.isnan(light.flux).all() and len(light.index) == 0 and light.remarks == ("in doubt",)


@pytest.mark.slow
def test_the_frequency_ratio_is_that_of_arrival_times():
    """In place of momenta: light that is sent dtau apart arrives dtau / g apart at a viewer at rest far away."""
    step = 2e-3
    fine = kc.light_curve(OBSERVER, INCLINED, 95.0 + np.array([-step, step]) / 2)
    motion = INCLINED.motion_about(0.9, (-100.0, 300.0))
    for i in range(len(fine.index)):
        emitted = fine.emission_time[i]
        clock = math.sqrt(clock_rates(0.9, motion.places(np.array([emitted.mean()])))[0])
        assert clock * np.diff(emitted)[0] / step == pytest.approx(fine.redshift[i].mean(), rel=1e-6)


@pytest.mark.slow
def test_pairs_are_there_between_their_events(inclined):
    assert [(event.kind, event.order) for event in inclined.events] == [
        ("creation", 3),
        ("annihilation", 3),
        ("creation", 2),
        ("annihilation", 2),
    ]
    for event in inclined.events:
        near = kc.light_curve(CAMERA, INCLINED, event.moment + np.array([-2e-3, -1e-3, 1e-3, 2e-3]))
        there = np.isfinite(near.emission_time).sum(axis=0)
        sign = 1 if event.kind == "creation" else -1
        step = there[2] - there[1]
        # Of a pair with the highest index the other image is not followed.
        assert step == sign * (1 if event.order == 3 else 2)
        # The flux of an image goes by the root of the time to the event.
        side = slice(2, 4) if sign > 0 else slice(0, 2)
        pair = [i for i in range(len(near.index)) if np.isfinite(near.emission_time[i]).sum() == 2]
        for i in pair:
            ratio = near.shares[i, side][0 if sign > 0 else 1] / near.shares[i, side][1 if sign > 0 else 0]
            assert ratio == pytest.approx(math.sqrt(2), rel=0.05)


def on_axis(**settings):
    """A source that stays behind a hole without spin, as its camera sees it."""
    camera = kc.Camera(0.0, 10.0, 1.0, "fiducial")
    return kc.light_curve(camera, lambda t: (8.0, math.pi - 1.0, math.pi), [100.0, 200.0], **settings)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: kc.light_curve(CAMERA, INCLINED), "`times` must be an array of times, as this orbit has no period"),
        (lambda: kc.light_curve(CAMERA, INCLINED, [math.nan]), "`times` must be"),
        (lambda: kc.light_curve(CAMERA, INCLINED, [1.0], searches=1), "`searches` must be a whole number from 2"),
        (lambda: kc.light_curve(CAMERA, 8.0, source="disk"), "`source` must be one of point, ball, spot"),
        (lambda: kc.light_curve(CAMERA, lambda t: (9.0, 1.2, 0.5 * t), [60.0]), "`orbit` must be slower than light"),
        (
            lambda: kc.light_curve(CAMERA, lambda t: (9.0, 1.2), [60.0]),
            "`orbit` must be a function of time that returns",
        ),
        (lambda: kc.light_curve(CAMERA, lambda t: (1.2, 1.2, 0.0), [60.0]), "`orbit` must stay outside the horizon"),
        (
            lambda: kc.light_curve(CAMERA, kc.Orbit.geodesic(4.0, velocity="static"), [200.0]),
            "`orbit` must stay outside the hole within `times`",
        ),
        (lambda: kc.Orbit.kepler(-1.0), "`semi_major_axis` must be positive"),
        (lambda: kc.Orbit.kepler(9.0, 1.0), "`eccentricity` must lie in"),
        (lambda: kc.Orbit.kepler(9.0, 0.1, 4.0), "`inclination` must lie in"),
        (lambda: kc.Orbit.geodesic(9.0, velocity=(0.9, 0.9, 0.0)), "`velocity` must have a speed below 1"),
        (lambda: kc.Orbit.geodesic(9.0, velocity="fast"), "`velocity` must be circular, retrograde, fiducial, static"),
        (lambda: kc.Orbit.geodesic(math.nan), "`radius` must be a finite number"),
        (lambda: on_axis(), "but stays on it: a point there is seen as rings, and is infinitely bright"),
        (lambda: on_axis(source="ball"), "but stays on it: a ball there is seen as rings, of finite light"),
        (
            lambda: kc.light_curve(
                kc.Camera(0.9, 10.0, 0.0, "fiducial"), kc.Orbit.geodesic(8.0, math.pi, velocity="static"), [12.0, 20.0]
            ),
            "`orbit` must leave the axis through hole and viewer",
        ),
        (
            lambda: kc.light_curve(CAMERA, "far", [1.0], source="point"),
            "`orbit` must be a radius, an Orbit or a function",
        ),
    ],
)
def test_bad_input_gets_one_line(call, words):
    with pytest.raises(ValueError, match="Argument ") as error:
        call()
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_orbits_of_files_are_those_of_their_numbers(tmp_path):
    path = tmp_path / "orbit.toml"
    path.write_text('kind = "geodesic"\nradius = 8\ntheta = 70.0\nvelocity = [-0.05, 0.1, 0.35]\n')
    assert read_orbit(path).words == kc.Orbit.geodesic(8.0, math.radians(70), velocity=(-0.05, 0.1, 0.35)).words
    path.write_text('kind = "geodesic"\nradius = 8\nvelocity = "retrograde"\n')
    assert read_orbit(path).words == kc.Orbit.geodesic(8.0, velocity="retrograde").words
    path.write_text('kind = "kepler"\nsemi_major_axis = 60\neccentricity = 0.5\nnode = 30\n')
    assert read_orbit(path).words == kc.Orbit.kepler(60.0, 0.5, node=math.radians(30)).words


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('kind = "geodesic"\nradiu = 8.0', "unknown key `radiu`; did you mean radius?"),
        ('kind = "circle"\nradius = 8.0', "kind must be"),
        ('kind = "geodesic"\nradius = nan', "radius must be a finite number, but is nan."),
        ('kind = "kepler"\nsemi_major_axis = -3.0', "`semi_major_axis` must be positive"),
    ],
)
def test_bad_orbit_files_get_one_line(text, words, tmp_path):
    path = tmp_path / "orbit.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"^(Orbit|Argument) ") as error:
        read_orbit(path)
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.slow
def test_tables_hold_the_light_of_each_time(tmp_path):
    fits = pytest.importorskip("astropy.io.fits")
    still = kc.Orbit.function(lambda t: (10.0, 1.2, 0.4))
    light = kc.light_curve(OBSERVER, still, [0.0, 10.0], max_index=1)
    light.to_csv(tmp_path / "light.csv")
    names, *rows = csv.reader((tmp_path / "light.csv").open())
    table = dict(zip(names, np.array(rows, float).T, strict=True))
    light.to_fits(tmp_path / "light.fits")
    with fits.open(tmp_path / "light.fits") as units:
        assert units["LIGHT"].columns.names == names and units["LIGHT"].header["CERTIF"]
        for name in names:
            np.testing.assert_array_equal(units["LIGHT"].data[name], table[name])
    np.testing.assert_array_equal(table["flux"], light.flux)
    np.testing.assert_array_equal(table["sky_2_beta"], light.sky[1, :, 1])
    np.testing.assert_array_equal(table["index_2"], [1, 1])


@pytest.mark.slow
def test_tables_name_the_units_of_angles(tmp_path):
    """Not those of lengths and times, for which FITS has no names."""
    fits = pytest.importorskip("astropy.io.fits")
    kc.light_curve(kc.Camera(0.5, 50.0, 1.0, "static"), 8.0, 3, crossings=1).to_fits(tmp_path / "light.fits")
    with fits.open(tmp_path / "light.fits") as units:
        kinds = {column.name: column.unit for column in units["LIGHT"].columns}
    assert (kinds["flux"], kinds["centroid_error"], kinds["centroid_x"], kinds["time"]) == ("sr", "rad", None, None)


@pytest.mark.slow
def test_command_follows_an_orbit_of_a_file(capsys, tmp_path):
    path, table, figure = (tmp_path / name for name in ("orbit.toml", "light.csv", "light.png"))
    path.write_text('kind = "kepler"\nsemi_major_axis = 40\neccentricity = 0.3\n')
    options = ["--spin", 0.5, "--radius", "inf", "--inclination", 50, "--orbit", path, "--max-index", 1]
    files = ["--table", table, "--figure", figure, "--json", "-", "--points"]
    status, out, err = run(capsys, "light-curve", *options, "--during", 0, 300, "--times", 12, *files)
    entry = json.loads(out)
    assert status == 0 and "certified" in err and entry["schema"] == "kerrcaustics/light-curve/2"
    light = kc.light_curve(
        kc.Observer(spin=0.5, inclination=math.radians(50)),
        kc.Orbit.kepler(40.0, 0.3),
        np.linspace(0, 300, 12),
        max_index=1,
    )
    assert entry["flux"] == light.flux.tolist() and figure.stat().st_size > 10_000
    assert len(table.read_text().splitlines()) == 13
    path.write_text('kind = "geodesic"\nradius = 9\n')
    status, _, err = run(capsys, "light-curve", *options)
    assert status == 2
    assert err == "kerrcaustics: Argument --during must be given, as this orbit has no period.\n"


@pytest.mark.slow
def test_a_small_ball_is_a_point():
    still = kc.Orbit.function(lambda t: (10.0, 1.2, 0.4))
    point, ball = (
        kc.light_curve(OBSERVER, still, [0.0], max_index=1, **kind) for kind in ({}, {"source": "ball", "size": 0.01})
    )
    assert ball.certified and ball.size == 0.01 and point.size == 0
    assert np.abs(ball.shares - point.shares).max() < 1e-4 * point.flux[0]
    assert (ball.error < 1e-4 * ball.flux).all()


@pytest.mark.slow
def test_a_ball_crosses_a_caustic_as_a_disc_crosses_a_fold():
    first = kc.light_curve(CAMERA, INCLINED, [184.0, 185.0], searches=8)
    event = next(event for event in first.events if event.kind == "creation" and event.order == 2)
    time = event.moment + np.linspace(-0.2, 0.4, 61)
    ball = kc.light_curve(CAMERA, INCLINED, time, source="ball", size=0.03, searches=8)
    pair = ball.shares[:, time < event.moment - 0.01].any(axis=1) & ~ball.shares[:, time < event.moment - 0.19].any(
        axis=1
    )
    assert ball.certified and sorted(ball.index[pair].tolist()) == [1, 2]
    light = ball.shares[pair].sum(axis=0)
    # The most light of a disc that crosses a fold is 1.393119, with its middle on the fold it is 1.112836.
    assert light.max() / np.interp(event.moment, time, light) == pytest.approx(1.393119 / 1.112836, rel=0.01)
    # No light before the limb arrives, which takes as long as from the limb to the middle.
    begins = time[np.flatnonzero(light)[0]] - event.moment
    assert 0.06 < -begins < 0.14 and (np.diff(light[light > 0][:6]) > 0).all()
    # It is that of two points far inside.
    far = time > event.moment + 0.39
    point = kc.light_curve(CAMERA, INCLINED, time[far], searches=8)
    assert ball.flux[far] == pytest.approx(point.flux, rel=2e-3)


@pytest.mark.slow
@problems.each(problems.BODIES, problems.in_motion)
def test_light_of_balls_is_that_of_rays_that_meet_them(problem):
    camera, orbit, size, time = problem.viewer, problem.place, problem.size, problem.time
    light = kc.light_curve(camera, orbit, [time], source="ball", size=size, max_index=1, searches=4)
    places = (
        orbit if callable(orbit) else _places(orbit_of("orbit", orbit).motion_about(camera.spin, (time - 150.0, time)))
    )
    assert light.certified
    for i in np.flatnonzero(np.isfinite(light.emission_time[:, 0])):
        share, image = light.shares[i, 0], (light.sky[i, 0], light.emission_time[i, 0])
        traced = ball_light(_event(camera), places, size, time, image) / (4 * math.pi)
        assert abs(traced - share) < light.error[0] + 2e-4 * share


@pytest.mark.slow
@problems.each(problems.BODIES, lambda problem: not problems.in_motion(problem))
def test_errors_of_evenly_lit_balls_are_honest(problem):
    camera, size, time = problem.viewer, problem.size, problem.time

    def place(t):
        return problem.place

    light = kc.light_curve(camera, place, [time], source="ball", size=size, max_index=1, searches=2)
    assert light.certified and (light.error < 1e-3 * light.flux).all()
    images = zip(light.sky[:, 0], light.emission_time[:, 0], strict=True)
    traced = [light_at_rest(_event(camera), place, size, time, image) / (4 * math.pi) for image in images]
    assert abs(sum(traced) - light.flux[0]) < light.error[0] + 1e-7 * light.flux[0]


@pytest.mark.slow
def test_light_of_a_ball_on_a_caustic_is_that_of_rays_that_meet_it():
    first = kc.light_curve(CAMERA, INCLINED, [184.0, 185.0], searches=8)
    event = next(event for event in first.events if event.kind == "creation" and event.order == 2)
    time, size = event.moment + np.array([-0.2, 0.007, 0.1]), 0.01
    light = kc.light_curve(CAMERA, INCLINED, time, source="ball", size=size, searches=8)
    places = _places(INCLINED.motion_about(0.9, (-100.0, 300.0)))
    there = np.isfinite(light.emission_time)
    pair = np.flatnonzero(there[:, 1] & ~there[:, 0])
    assert len(pair) == 2

    def traced(i, k):
        image = light.sky[i, k], light.emission_time[i, k]
        return ball_light(_event(CAMERA), places, size, float(time[k]), image) / (4 * math.pi)

    # Merged, each leads to all of their light; later each has its own.
    shares = light.shares[pair]
    assert traced(pair[0], 1) == pytest.approx(shares[:, 1].sum(), rel=2e-4)
    assert [traced(i, 2) for i in pair] == pytest.approx(shares[:, 2], rel=2e-4)


@pytest.mark.slow
def test_all_directions_together_receive_what_was_emitted():
    """The energy of light that escapes, with no images: isotropic in the frame of the source."""
    spin, radius = 0.9, 10.0
    emitter = kc.Camera(spin, radius, velocity="circular")
    count = np.arange(200_000) + 0.5
    height, turn = 1 - 2 * count / len(count), count * math.pi * (1 + math.sqrt(5))
    away = np.sqrt(1 - height**2)
    rays = kc.trace_rays(emitter, np.stack([away * np.cos(turn), away * np.sin(turn), height], axis=-1), redshift=True)
    emitted = np.where(rays.escaped, 1 / rays.redshift, 0.0).mean() / emitter.clock_rate

    # Over inclinations and one period; times are close to each other where the source is behind the hole.
    period = 2 * math.pi * (radius**1.5 + spin)
    nodes, weights = np.polynomial.legendre.leggauss(6)
    part = (np.arange(40) + 0.5) / 40
    received = 0.0
    for node, weight in zip((1 + nodes) / 2, weights / 2, strict=True):
        observer = kc.Observer(spin=spin, inclination=math.acos(node**2))
        coarse = kc.light_curve(observer, radius, np.linspace(0, period, 33), source="point")
        time = coarse.time[np.nanargmax(coarse.flux)] + period * (part - np.sin(2 * math.pi * part) / (2 * math.pi))
        order = np.argsort(time)
        light = kc.light_curve(observer, radius, time[order], source="point")
        mean = np.mean(light.flux * (1 - np.cos(2 * math.pi * part[order])))
        received += 4 * math.pi * weight * 2 * node * mean
    # The mean over times and inclinations next to caustics is good to 1e-3.
    assert received == pytest.approx(emitted, rel=2e-3)


def _event(camera):
    return Event(camera.spin, camera.radius, camera.inclination, camera.fido_velocity())


def _places(motion):
    def at(time):
        place = motion.places(time)
        return (place.radius, *place.angles.T)

    return at


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.0, -1.0, math.nan, 2.0])
def test_balls_have_a_size(size):
    with pytest.raises(ValueError, match="Argument `size` must be"):
        kc.light_curve(OBSERVER, 10.0, [0.0], source="ball", size=size)
