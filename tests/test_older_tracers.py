"""Formulas and set-ups of older tracers, held against the program: what docs/comparison.md says of them.

The older disk of hot spots counts lengths in R_s = 2 M; `R` is such a length here.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import kerrcaustics as kc
from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.scene_files.templates import template_text
from kerrcaustics.scenes.disk.samples import DiskSamples
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scripts import FIGURES, FILMS
from kerrcaustics.spacetime.sphere import from_angles

R0 = 6.0
CAMERA = kc.Camera(0.0, 2 * R0, math.radians(85), "static")


@pytest.mark.slow
def test_film_and_figure_of_hot_spots_have_the_older_set_up():
    """Camera, spots, streaks and the tangents of the picture; planes at 83 to 86 degrees, rolled by 13 to 17."""
    film, figure = FILMS.load("hot_spots"), FIGURES.load("hot_spots_without")
    spots = film.spots(2 * 3.0)
    assert film.RADIUS == figure.RADIUS == 2 * R0 and len(spots.radius) == 5000
    for values, ends in ((spots.radius / 2, (3.0, 4.5)), (spots.temperature, (4000, 10_000))):
        assert values.min() == pytest.approx(ends[0], rel=0.01) and values.max() == pytest.approx(ends[1], rel=0.01)
        assert ends[0] <= values.min() and values.max() <= ends[1]
    assert spots.streak == figure.STREAK == 2 * 3
    camera = kc.Camera(0.0, film.RADIUS, math.radians(film.INCLINATION), "static")
    view = kc.pictures.View.toward_hole(camera, film.WIDTH, film.HEIGHT, film.FIELD)
    middle = (film.WIDTH - 1) / 2, (film.HEIGHT - 1) / 2
    for x, y, tangent in ((film.WIDTH - 0.5, middle[1], 1.28), (middle[0], -0.5, 0.72)):
        assert math.tan(math.acos(view.directions(x, y)[0] @ view.forward)) == pytest.approx(tangent, rel=1e-12)
    inclinations, rolls = np.array(figure.PLANES).T
    assert (inclinations.min(), inclinations.max()) == (83, 86) and (np.abs(rolls - 15) <= 2).all()
    assert (film.INCLINATION, film.ROLL) == (85, 15)


@pytest.mark.slow
def test_side_by_side_has_the_set_up_of_the_older_tracer():
    figure = FIGURES.load("disk_side_by_side")
    camera, disk = figure.CAMERA, figure.DISK
    assert (camera.spin, camera.radius, disk.inner, disk.outer) == (0.6, 70, 4, 10)
    assert math.degrees(camera.inclination) == pytest.approx(90 - 180 / 46)
    assert math.degrees(figure.VIEW.field_of_view) == pytest.approx(39) and figure.SKY_RADIUS == 80


def test_orbits_of_the_hot_spots_are_circular_geodesics():
    for R in (3.0, 4.5):
        rate = float(EMITTERS["circular"](0.0, 2 * R, 0.0).orbital)
        # Time in R_s, too.
        assert 2 * math.pi / rate / 2 == pytest.approx(2 * math.pi * math.sqrt(2 * R**3), rel=1e-14)
        speed = kc.Camera(0.0, 2 * R, velocity="circular").fido_velocity()[2]
        assert speed == pytest.approx(math.sqrt(1 / (2 * (R - 1))), rel=1e-14)


def test_the_speed_of_the_observer_in_the_older_source_is_not_that_of_an_orbit():
    speed = kc.Camera(0.0, 2 * R0, velocity="circular").fido_velocity()[2]
    assert speed == pytest.approx(0.3162, abs=5e-5)
    assert math.sqrt((1 - 1 / R0) / (2 * R0)) == pytest.approx(0.2635, abs=5e-5)


def test_the_critical_angle_is_the_shadow_edge():
    middle = np.array([-1.0, 0.0, 0.0])
    angles = np.degrees(np.arccos(kc.shadow_edge(CAMERA, 16) @ middle))
    assert angles == pytest.approx(np.full(16, 23.284), abs=5e-4)


@pytest.fixture(scope="module")
def plane():
    """Rays of the camera to the plane of the disk, and the angle by which each of them has swept round the hole."""
    rng = np.random.default_rng(5)
    turn, off = rng.uniform(0, 2 * math.pi, 60), rng.uniform(0.3, 0.7, 60)
    sky = np.stack([-np.cos(off), np.sin(off) * np.cos(turn), np.sin(off) * np.sin(turn)], axis=-1)
    rays = kc.trace_rays(CAMERA, sky, end=kc.EquatorialPlane(1, "circular"), time=True, redshift=True)
    on = np.isfinite(rays.radius) & (rays.radius > 6.5) & (rays.radius < 30)
    assert on.sum() > 15
    found = SimpleNamespace(radius=rays.radius[on] / 2, azimuth=rays.azimuth[on], redshift=rays.redshift[on])
    found.sky, found.time, found.off = sky[on], rays.time[on] / 2, off[on]
    return found


@pytest.mark.slow
def test_the_shift_is_that_of_the_older_formula(plane):
    """f'/f of doppler and of gravity, by the angle between light and motion as one at rest there sees it."""
    R = plane.radius
    beta = np.sqrt(1 / (2 * (R - 1)))
    momentum = 2 * R0 * math.sin(CAMERA.inclination) * -plane.sky[:, 1] / math.sqrt(1 - 1 / R0)
    cosine = momentum * np.sqrt(1 - 1 / R) / (2 * R)
    expected = np.sqrt(1 - beta**2) / (1 - beta * cosine) * np.sqrt((1 - 1 / R) / (1 - 1 / R0))
    assert plane.redshift == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_images_lie_where_the_older_swept_angles_say(plane):
    """cos of the angle swept round the hole is sin(phi) sin(inclination), phi from the line of nodes."""
    camera, spot = from_angles(CAMERA.inclination, 0.0), from_angles(math.pi / 2, plane.azimuth)
    assert spot @ camera == pytest.approx(np.cos(plane.azimuth) * math.sin(CAMERA.inclination), abs=1e-14)
    swept = np.arccos(spot @ camera)
    for R, angle, off in zip(plane.radius, swept, plane.off, strict=True):
        end = older_ray(off, angle)
        assert end[1] == pytest.approx(R, rel=1e-7)


@pytest.mark.slow
def test_travel_times_are_those_of_the_older_rays(plane):
    camera, spot = from_angles(CAMERA.inclination, 0.0), from_angles(math.pi / 2, plane.azimuth)
    swept = np.arccos(spot @ camera)
    delays = [older_ray(off, angle)[0] for off, angle in zip(plane.off, swept, strict=True)]
    assert plane.time == pytest.approx(np.array(delays), rel=1e-7)


def older_ray(off, swept):
    """t, r where a ray, sent from R0 so many radians off the hole, has swept an angle round it: the older equations."""
    lapse = 1 - 1 / R0

    def rates(_, y):
        _, r, _, dt, dr, dth = y
        return [
            dt,
            dr,
            dth,
            dr * dt / (r - r * r),
            (r**2 * dr**2 - (r - 1) ** 2 * dt**2) / (2 * (r - 1) * r**3) + (r - 1) * dth**2,
            -2 * dr * dth / r,
        ]

    start = [0.0, R0, 0.0, 1 / math.sqrt(lapse), -math.cos(off) * math.sqrt(lapse), math.sin(off) / R0]

    def arrived(_, y):
        return y[2] - swept

    arrived.terminal = True
    done = solve_ivp(rates, (0, 1e3), start, method="DOP853", rtol=1e-10, atol=1e-12, events=arrived)
    return done.y[:, -1]


@pytest.mark.slow
def test_the_camera_comes_down_on_the_older_way(tmp_path):
    (tmp_path / "approach.toml").write_text(template_text("approach"), encoding="utf-8")
    scene = kc.SceneFile.read(tmp_path / "approach.toml")
    assert (scene.frames, scene.rate) == (520, 25)
    for time in (-227.0, -100.0, 0.0, 9.4):
        since = time + 227
        r = 600 - 2.53 * since
        calm, phi = min(((600 - r) / 575) ** 20, 1), math.radians(3 * since)
        camera = scene.camera(time)
        assert camera.radius == pytest.approx(r, rel=1e-12)
        assert math.degrees(camera.inclination) == pytest.approx(84 + 8 * math.sin(phi) * (1 - calm) + 3 * calm)
        assert scene.azimuth(time) == pytest.approx(phi)
        values = scene.views.values(time)
        assert values["view.tilt_deg"] == pytest.approx(8 * math.cos(phi) * (1 - calm))
        assert values["view.yaw_deg"] == pytest.approx(calm)
    # The horizon is at 1.8.
    assert 1.8 < camera.radius < 2


def test_textures_lie_as_the_older_ones_do():
    """Of the sky x = phi / 2 pi, y = theta / pi; of a disk x = phi / 2 pi, y from the inner rim."""
    picture = np.random.default_rng(7).uniform(0, 1, (8, 16, 3))
    theta, phi = (3.5 / 8) * math.pi, (5.5 / 16) * 2 * math.pi
    small = np.eye(2)[None] * 1e-6
    direction = from_angles(np.array([theta]), np.array([phi]))
    chart = kc.skies.Panorama(picture, mirror=True)
    light = chart.light(Footprint(direction, small, np.zeros(1), np.ones(1)), False, False)
    assert np.abs(picture - light[0]).sum(axis=-1).argmin() == 3 * 16 + 5
    still = np.zeros(1), np.zeros_like
    place = np.array([10.0]), np.array([phi]), np.array([3.5 / 8])
    samples = DiskSamples(*place, small, np.ones(1), 5.0, 0.5, *still)
    assert kc.disks.Texture(picture[::-1]).light(samples, False, False)[0] == pytest.approx(picture[3, 5], rel=1e-5)


def test_no_column_at_the_axis_is_bad():
    """Beams across the spin axis above and below the hole: places change evenly from pixel to pixel."""
    camera = kc.Camera(0.6, 70.0, math.radians(90 - 180 / 46), "static")
    x = np.linspace(-0.02, 0.02, 41)
    sky = np.stack([-np.ones(41), x, np.full(41, 0.25)], axis=-1)
    beams = kc.trace_beams(camera, sky / np.linalg.norm(sky, axis=-1, keepdims=True))
    assert np.isfinite(beams.direction).all() and (beams.error < 1e-9).all()
    theta_phi = np.unwrap(np.arctan2(beams.direction[:, 1], beams.direction[:, 0]))
    assert np.isfinite(theta_phi).all()
    second = np.diff(beams.direction, 2, axis=0)
    assert np.abs(second).max() < 2e-4 < np.abs(np.diff(beams.direction, axis=0)).max()


ORBITAL = 1 / math.sqrt(2 * R0 - 2)
MOVING = [kc.Camera(0.0, 2 * R0, math.radians(60), velocity) for velocity in ("static", (0.0, 0.0, ORBITAL))]


def doppler(direction):
    """Of light from a direction (3,) on the sky of the camera at rest, for the one that circles."""
    return (1 + ORBITAL * direction[..., 1]) / math.sqrt(1 - ORBITAL**2)


@pytest.mark.slow
def test_a_moving_observer_sees_a_light_curve_by_the_doppler_factor():
    """Flux goes as D^4 of the bolometric intensity over a solid angle of D^-2, with D of the image's own direction."""
    times = np.linspace(0.0, 120.0, 9)
    rest, moving = (kc.light_curve(camera, 8.0, times, size=0.01, crossings=1) for camera in MOVING)
    ratio = doppler(rest.centroid) ** 2
    assert ratio.min() < 0.75 and ratio.max() > 1.6
    assert moving.flux / rest.flux == pytest.approx(ratio, rel=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("tilted", [False, True])
def test_a_moving_observer_sees_a_picture_by_the_doppler_factor(tilted):
    """Spots in a disk, and one on an orbit of its own: light of a picture from rest, direction by direction."""
    glow = {"volume": kc.disks.OrbitingSpots([8.0], 0.7, 0.3, 0.2, size=0.6)}
    if not tilted:
        glow = {"disk": kc.disks.Disk(6.5, 9.5, kc.disks.Spots([8.0], [0.9], size=0.3), opacity=0.0)}
    view, fluxes = kc.pictures.View(220, 220, 2.2), []
    y, x = (part.ravel() for part in np.mgrid[:220, :220])
    sky, steps = view.directions(x, y)
    solid = np.linalg.norm(np.cross(steps[..., 0], steps[..., 1]), axis=-1)
    for camera in MOVING:
        light = kc.render(camera, view, beaming=True, delay=True, time=25.0, **glow).light[..., 1].ravel()
        fluxes.append(solid * light)
    rest, moving = fluxes
    assert moving.sum() == pytest.approx((rest * doppler(sky) ** 2).sum(), rel=0.006 if tilted else 0.001)
    assert abs(moving.sum() / rest.sum() - 1) > 0.2
