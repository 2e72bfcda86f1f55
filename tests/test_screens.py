"""Pictures of observers far away and at infinity: against cameras, sums over rays, star images and closed forms."""

import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from command_line import run
from marks import few

import kerrcaustics as kc
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.scene_files import renderer
from kerrcaustics.scenes.colour import luminance, seen_black_body
from kerrcaustics.scenes.disk.flat import render_flat
from kerrcaustics.scenes.disk.turned import turned_disk
from kerrcaustics.scenes.motion import ExposedMoment
from kerrcaustics.scenes.points import PointLights
from kerrcaustics.scenes.traced_view import trace_view

SPIN, INCLINATION = 0.9, math.radians(70)
DISTANT = kc.Observer(spin=SPIN, inclination=INCLINATION)
SCREEN = kc.Screen(64, 36, 24.0)


class Smooth(kc.skies.Sky):
    """A sky that grows linearly along each axis, one a channel."""

    def light(self, footprint, beaming, colour_shift):
        return (1 + footprint.direction) / 2 * (footprint.redshift[:, None] ** 4 if beaming else 1)


class Star(Smooth):
    """A single star of flux 1 on a black sky."""

    def __init__(self, theta, phi):
        direction = [[math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]]
        self.points = PointLights(np.array(direction), np.ones((1, 3)), np.array([6500.0]))

    def light(self, footprint, beaming, colour_shift):
        return np.zeros((len(footprint), 3))


def observer_at(radius):
    return kc.Observer(spin=SPIN, inclination=INCLINATION, radius=radius)


def received(scene):
    """Light times area of all pixels."""
    y, x = np.mgrid[: scene.view.height, : scene.view.width]
    return (luminance(scene.light) * scene.view.pixel_sizes(x, y)).sum()


@pytest.mark.parametrize(("centre", "up"), [((0.0, 0.0), (0.0, 2.0)), ((30.0, -4.0), (0.6, 0.8)), ((1, 2), (-1, 0))])
def test_places_directions_and_steps_agree(centre, up):
    screen = kc.Screen(31, 17, 9.0, centre, up)
    x, y = np.random.default_rng(1).uniform(-1, 32, (2, 20))
    sky, steps = screen.directions(x, y)
    assert screen.pixels(sky) == pytest.approx(np.stack([x, y], axis=-1), abs=1e-11)
    assert screen.pixels(screen.places(x, y)) == pytest.approx(np.stack([x, y], axis=-1), abs=1e-12)
    assert screen.places(15, 8) == pytest.approx(centre)
    # The middle of the picture moves along `up` by a pixel a row.
    upward = screen.places(15, 7) - screen.places(15, 8)
    assert upward == pytest.approx(screen.pixel * np.array(up) / np.linalg.norm(up))
    right = screen.places(16, 8) - screen.places(15, 8)
    assert right @ upward == pytest.approx(0, abs=1e-12)
    assert np.linalg.det([right, upward]) == pytest.approx(screen.pixel**2)
    for axis, step in enumerate(np.eye(2) * 1e-4):
        ahead, behind = (screen.directions(x + sign * step[0], y + sign * step[1])[0] for sign in (1, -1))
        assert steps[..., axis] == pytest.approx((ahead - behind) / 2e-4, abs=1e-10)
    areas = screen.solid_angle(steps) * screen.lengths(sky) ** 2
    assert areas == pytest.approx(screen.pixel_sizes(x, y))


@pytest.mark.parametrize(
    ("argument", "values"),
    [
        ("width", {"width": 0}),
        ("height", {"height": 2.5}),
        ("size", {"size": 0}),
        ("size", {"size": math.inf}),
        ("centre", {"centre": (0, math.nan)}),
        ("centre", {"centre": 3}),
        ("up", {"up": (0, 0)}),
        ("up", {"up": (0, 0, 1)}),
    ],
)
def test_screen_refuses(argument, values):
    with pytest.raises(ValueError, match=f"^Argument `{argument}` must "):
        kc.Screen(**({"width": 4, "height": 3, "size": 2.0} | values))


VOLUME = kc.disks.Volume(0.1, 6504.0, inner=5.0, outer=8.0)
PICTURES = (
    lambda viewer, view: kc.render(viewer, view, Smooth()),
    lambda viewer, view: kc.pictures.trace_view(viewer, view),
    lambda viewer, view: kc.pictures.render_volume(viewer, view, VOLUME),
)


@pytest.mark.parametrize("picture", PICTURES)
def test_the_view_must_be_of_the_viewer(picture):
    with pytest.raises(ValueError, match=r"^Argument `view` must be a Screen for an Observer, but is a View\.$"):
        picture(DISTANT, kc.pictures.View(4, 3, 1.0))
    with pytest.raises(ValueError, match=r"^Argument `view` must be a View for a Camera, but is a Screen\.$"):
        picture(kc.Camera(0.9, 10), SCREEN)
    with pytest.raises(ValueError, match=r"^Argument `view` must be a View or a Screen, but is float\.$"):
        picture(DISTANT, 24.0)
    with pytest.raises(ValueError, match=r"^Argument `camera` must be a Camera or an Observer, but is Screen\.$"):
        picture(SCREEN, DISTANT)


def test_the_view_must_be_of_the_viewer_where_no_screen_was_made_before():
    code = (
        "import kerrcaustics as kc; v = kc.pictures.View(4, 3, 1.0); kc.render(kc.Observer(spin=0.9, inclination=1), v)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "Argument `view` must be a Screen for an Observer, but is a View." in ended.stderr


def test_a_picture_without_the_hole_is_of_a_camera():
    with pytest.raises(ValueError, match=r"^Argument `view` must be a View for a Camera, but is a Screen\.$"):
        render_flat(kc.Camera(0.9, 10), SCREEN, Smooth())
    with pytest.raises(ValueError, match=r"^Argument `camera` must be a Camera, but is Observer\.$"):
        render_flat(DISTANT, SCREEN, Smooth())


def patch_of(camera, observer, screen):
    """A view of a camera with the pixels of a small screen: same place, size and sense in the middle."""
    sky, steps = screen.directions((screen.width - 1) / 2, (screen.height - 1) / 2)
    frames = observer.frame(), camera.frame()
    middle, beside = (as_seen(place, *frames) for place in (sky, sky - 1e-6 * steps[:, 1]))
    pixel = np.linalg.norm(beside - middle) / 1e-6
    return kc.pictures.View(
        screen.width,
        screen.height,
        2 * math.atan(screen.width * pixel / 2),
        forward=middle,
        up=(beside - middle) / 1e-6,
    )


@pytest.mark.slow
@pytest.mark.parametrize("centre", [(9.0, 3.0), (-7.5, -1.0), (1.0, 12.0), (-60.0, 20.0)])
def test_an_observer_at_a_finite_radius_sees_what_a_camera_sees_there(centre):
    """Pixel by pixel: sky, disk and volume, with all shifts; small pictures, on which both maps are linear."""
    observer, screen = observer_at(12.0), kc.Screen(4, 4, 0.02, centre)
    camera = kc.Camera(SPIN, 12.0, INCLINATION, "fiducial")
    view = patch_of(camera, observer, screen)
    disk = kc.disks.Disk(3, 40, kc.disks.PowerLaw(7000.0), opacity=0.7)
    shifts = {"beaming": True, "colour_shift": True}
    for one, other in (
        (
            kc.render(viewer, part, Smooth(), disk=disk, **shifts)
            for viewer, part in ((observer, screen), (camera, view))
        ),
        (
            kc.pictures.render_volume(viewer, part, VOLUME, Smooth(), **shifts)
            for viewer, part in ((observer, screen), (camera, view))
        ),
    ):
        assert one.light == pytest.approx(other.light, rel=2e-5, abs=1e-6)
        assert one.transmission == pytest.approx(other.transmission, abs=1e-5)
        assert one.light.max() > 0


@pytest.mark.slow
def test_cameras_far_away_see_more_and_more_of_what_is_seen_from_infinity():
    """Differences fall as 1 / r; those of maps are left where they are smaller."""
    scene = kc.render(DISTANT, SCREEN, Smooth(), quality="high")
    means = []
    for radius in (1e3, 1e4, 1e6):
        view = kc.pictures.View(64, 36, 2 * math.atan(12 / radius))
        camera = kc.Camera(SPIN, radius, INCLINATION, "fiducial")
        seen = [kc.render(camera, view, Smooth(), quality="high")]
        seen.append(kc.render(observer_at(radius), SCREEN, Smooth(), quality="high"))
        means.append([np.abs(one.light - scene.light).mean() for one in seen])
    means = np.array(means)
    assert (means[0] / means[1]).tolist() == pytest.approx([10, 10], rel=0.05)
    assert (means[1] * 1e4 > 0.5).all() and (means[1] * 1e4 < 5).all()
    assert (means[2] < 1e-5).all()


def test_the_shadow_has_its_size():
    """Without spin a disk of radius sqrt(27) M; with it the area within the shadow's edge."""
    screen = kc.Screen(240, 240, 13.0, centre=(1.0, 0.0))
    scene = kc.render(kc.Observer(spin=0.0, inclination=1.0), screen, Smooth(), quality="draft")
    assert (1 - scene.visible_fraction).sum() * screen.pixel**2 == pytest.approx(27 * math.pi, rel=3e-4)
    scene = kc.render(DISTANT, screen, Smooth(), quality="draft")
    alpha, beta = kc.shadow_edge(DISTANT, 2000).T
    area = abs((alpha * np.roll(beta, -1) - beta * np.roll(alpha, -1)).sum()) / 2
    assert (1 - scene.visible_fraction).sum() * screen.pixel**2 == pytest.approx(area, rel=3e-4)


@pytest.mark.parametrize(("radius", "size"), [(30.0, 240.0), (math.inf, 40.0)])
@pytest.mark.parametrize("pixels", few((16, 60, 300), (16,)))
def test_a_star_has_the_light_of_its_images(radius, size, pixels):
    """Flux times the magnification of its images (M^2 / sr), at any resolution."""
    observer, star = observer_at(radius), (2.1, 2.6)
    images = kc.star_images(observer, star, max_index=3)
    scene = kc.render(observer, kc.Screen(pixels, pixels, size), Star(*star))
    assert np.abs(images.sky).max() < 0.45 * size
    assert received(scene) == pytest.approx(images.magnification.sum(), rel=0.001)


def test_stars_that_are_not_resolved_are_as_bright_as_the_sky():
    """Many stars of flux 4 pi / n everywhere: light 1 in each pixel that sees the sky, the strip at the edge too."""
    rng = np.random.default_rng(2)
    direction = rng.normal(size=(40_000, 3))
    stars = Star(0.0, 0.0)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    flux = np.full((len(direction), 3), 4 * math.pi / len(direction))
    stars.points = PointLights(direction, flux, np.full(len(direction), 6500.0))
    scene = kc.render(DISTANT, kc.Screen(24, 24, 16.0), stars)
    visible = scene.visible_fraction.sum() * scene.view.pixel**2
    assert received(scene) == pytest.approx(visible, rel=0.02)


def disk_by_rays(observer, disk, screen, shifts):
    """Light times area of an opaque disk: of the first crossing between its rims of each of many rays."""
    y, x = (place.ravel() for place in np.mgrid[: screen.height, : screen.width])
    sky = screen.places(x, y)
    light, left = np.zeros(len(sky)), np.arange(len(sky))
    for crossing in (1, 2, 3, 4):
        rays = kc.trace_rays(observer, sky[left], end=kc.EquatorialPlane(crossing, "circular"), redshift=True)
        on = np.isfinite(rays.radius) & (rays.radius > disk.inner) & (rays.radius < disk.outer)
        temperature = disk.emission.temperature(observer.spin, rays.radius[on])
        light[left[on]] = luminance(seen_black_body(temperature, rays.redshift[on], *shifts))
        left = left[~on]
    return light.sum() * screen.pixel**2


@pytest.mark.slow
@pytest.mark.parametrize("shifts", [(False, False), (True, False), (True, True)])
def test_a_disk_seen_from_infinity_has_the_light_of_its_rays(shifts):
    """Steady accretion at a = 0.9 and 70 degrees; the sum over 920 x 520 rays is good to 1e-3 itself."""
    disk = kc.disks.Disk(2.4, 15, kc.disks.PageThorne(6500))
    scene = kc.render(DISTANT, kc.Screen(128, 72, 38.0), disk=disk, beaming=shifts[0], colour_shift=shifts[1])
    assert received(scene) == pytest.approx(disk_by_rays(DISTANT, disk, kc.Screen(920, 520, 38.0), shifts), rel=2e-3)


SPOTS = kc.disks.Disk(4, 12, kc.disks.Spots([6.0, 9.0], [0.3, -2.0], [6500.0, 8000.0], 1.0))


@pytest.mark.slow
def test_a_distant_camera_sees_the_disk_of_its_own_time():
    """Light is late by as much everywhere: by r + 2 ln r more for the camera."""
    radius = 1e5
    camera = kc.Camera(SPIN, radius, INCLINATION, "fiducial")
    view = kc.pictures.View(64, 36, 2 * math.atan(17 / radius))
    settings = {"disk": SPOTS, "beaming": True, "colour_shift": True, "delay": True}
    seen = kc.render(camera, view, time=radius + 2 * math.log(radius) + 3.0, **settings)
    scene = kc.render(DISTANT, kc.Screen(64, 36, 34.0), time=3.0, **settings)
    brightest = scene.light.max()
    assert np.abs(seen.light - scene.light).max() < 0.01 * brightest
    # A light-crossing time later the spots are elsewhere.
    assert np.abs(kc.render(DISTANT, kc.Screen(64, 36, 34.0), time=13.0, **settings).light - scene.light).max() > (
        0.3 * brightest
    )


@pytest.mark.slow
@pytest.mark.parametrize("opacity", [0.003, 0.1])
def test_a_volume_seen_from_infinity_is_that_of_a_distant_camera(opacity):
    """Differences fall as 1 / r: 2e-3 of the brightest at 1e4, on rays that graze the volume."""
    camera = kc.Camera(SPIN, 1e8, INCLINATION, "fiducial")
    view, screen = kc.pictures.View(48, 27, 2 * math.atan(12 / 1e8)), kc.Screen(48, 27, 24.0)
    volume = kc.disks.Volume(opacity, 6504.0, inner=5.0, outer=8.0)
    shifts = {"beaming": True, "colour_shift": True}
    one, other = (
        kc.pictures.render_volume(viewer, part, volume, **shifts)
        for viewer, part in ((DISTANT, screen), (camera, view))
    )
    assert one.light == pytest.approx(other.light, abs=2e-5 * float(other.light.max()))
    assert one.transmission == pytest.approx(other.transmission, abs=1e-4)


@pytest.mark.slow
def test_a_volume_seen_from_infinity_is_as_good_as_it_says():
    screen = kc.Screen(32, 18, 24.0)
    coarse, fine = (kc.pictures.render_volume(DISTANT, screen, VOLUME, step=step) for step in (1.0, 0.1))
    off = np.abs(luminance(coarse.light) - luminance(fine.light)).max() / luminance(fine.light).max()
    assert 0 < off < max(coarse.error, 1e-6)


def test_observers_move_while_a_picture_is_exposed():
    """Inclination, size and centre; a radius between a finite one and infinity goes by its inverse."""
    observers = [kc.Observer(spin=SPIN, inclination=INCLINATION + step) for step in (-0.1, 0.1)]
    screens = [kc.Screen(64, 36, 24.0 + step, (step, 0.0)) for step in (-1.0, 1.0)]
    exposure = kc.pictures.ShutterMotion(observers, screens).exposure(ExposedMoment(DISTANT, SCREEN))
    moment = exposure.moment_at(0.25)
    assert not exposure.keeps_view
    assert (moment.camera.inclination, moment.camera.radius) == (pytest.approx(INCLINATION + 0.05), math.inf)
    assert (moment.view.size, *moment.view.centre) == pytest.approx((24.5, 0.5, 0.0))
    near = kc.pictures.ShutterMotion((observer_at(100.0), DISTANT), (SCREEN, SCREEN)).exposure(
        ExposedMoment(observer_at(200.0), SCREEN)
    )
    assert near.moment_at(0.25).camera.radius == pytest.approx(400.0)


@pytest.mark.parametrize(
    ("cameras", "views"),
    [
        ((kc.Camera(SPIN, 10.0), kc.Camera(SPIN, 10.0)), (SCREEN, SCREEN)),
        ((DISTANT, DISTANT), (kc.pictures.View(64, 36, 1.0), kc.pictures.View(64, 36, 1.0))),
    ],
)
def test_an_exposure_is_of_one_kind_of_viewer(cameras, views):
    with pytest.raises(ValueError, match=r"^Argument `motion` must "):
        kc.render(DISTANT, SCREEN, Smooth(), motion=kc.pictures.ShutterMotion(cameras, views))


def tilting(viewers, view):
    """An exposure in which the inclination grows by 0.06, and the viewer goes round by 0.04."""
    return kc.pictures.ShutterMotion((viewers[0], viewers[2]), (view, view), azimuths=(-0.02, 0.02))


TILTS = [INCLINATION + step for step in (-0.03, 0.0, 0.03)]
TILTED = [kc.Observer(spin=SPIN, inclination=tilt) for tilt in TILTS]


@pytest.mark.slow
def test_blur_of_a_disk_is_the_mean_of_moments():
    motion = tilting(TILTED, SCREEN)
    blurred = kc.render(DISTANT, SCREEN, disk=SPOTS, motion=motion).light
    exposure, count = motion.exposure(ExposedMoment(DISTANT, SCREEN)), 16
    mean = np.zeros_like(blurred)
    for number in range(count):
        now = exposure.moment_at((number + 0.5) / count - 0.5)
        mean += kc.render(now.camera, now.view, disk=turned_disk(SPOTS, -now.azimuth)).light / count
    still = kc.render(DISTANT, SCREEN, disk=SPOTS).light
    off, without = (luminance(np.abs(light - mean)).mean() / luminance(mean).mean() for light in (blurred, still))
    assert off < 0.002
    assert without > 5 * off


@pytest.mark.slow
def test_blur_of_a_sky_is_that_of_a_distant_camera():
    radius = 1e6
    cameras = [kc.Camera(SPIN, radius, tilt, "fiducial") for tilt in TILTS]
    view = kc.pictures.View(64, 36, 2 * math.atan(12 / radius))
    one = kc.render(DISTANT, SCREEN, Smooth(), motion=tilting(TILTED, SCREEN))
    other = kc.render(cameras[1], view, Smooth(), motion=tilting(cameras, view))
    assert np.abs(one.light - other.light).mean() < 1e-4
    assert np.abs(kc.render(DISTANT, SCREEN, Smooth()).light - one.light).mean() > 2e-4


def test_a_picture_can_be_saved_and_read(tmp_path):
    scene = kc.render(DISTANT, kc.Screen(16, 9, 24.0, (1.0, 2.0)), Smooth())
    kc.save(tmp_path / "scene.npz", scene)
    again = kc.load(tmp_path / "scene.npz")
    assert again == scene
    assert (again.view, again.camera) == (scene.view, DISTANT)


def test_datasets_of_observers_name_alpha_and_beta():
    for of_observer in (kc.Screen(4, 3, 24.0), kc.star_images(DISTANT, (2.1, 2.6), 1)):
        data = kc.to_xarray(of_observer)
        assert list(data.axis.values) == ["alpha", "beta"]


SCENE = """
hole = {spin = 0.9}
camera = {radius = inf, inclination_deg = 70}
view = {size = 24, width = 64, height = 36}
sky = {kind = "checkerboard"}
"""


@pytest.fixture
def scene_of(tmp_path):
    def read(text=SCENE, *overrides):
        path = tmp_path / "scene.toml"
        path.write_text(text, encoding="utf-8")
        return kc.SceneFile.read(path, overrides)

    return read


def test_a_scene_has_an_observer_and_a_screen(scene_of):
    scene = scene_of(SCENE, "view.centre=[1, 't / 2']", "view.tilt_deg=90")
    assert scene.camera(0.0) == DISTANT
    screen = scene.view(6.0, 0.5)
    assert (screen.width, screen.height, screen.size, *screen.centre) == (32, 18, 24.0, 1.0, 3.0)
    # As for cameras: the picture is turned clockwise, so that what was on the right is up.
    assert screen.up == pytest.approx([1, 0], abs=1e-15)
    assert scene_of(SCENE, "camera.radius=500").camera(0.0) == observer_at(500.0)


def test_a_scene_of_an_observer_is_what_python_renders(scene_of):
    scene = kc.render(DISTANT, SCREEN, kc.skies.Checkerboard())
    assert np.array_equal(scene_of().rendering(0).light, scene.light)


def test_the_records_of_scenes_say_observers_apart(scene_of):
    records = [scene_of(SCENE, *change).record() for change in ((), ("camera.radius=500",), ("view.size=25",))]
    assert records[0] != records[1] != records[2] != records[0]
    assert records[0] == scene_of(SCENE, "view.centre=[0, 0]").record()


FILM = SCENE + "film = {frames = 4, end = 40}\n"


@pytest.mark.slow
def test_a_film_of_an_observer_who_stays_has_one_map(scene_of, monkeypatch):
    """Disk and time go on; where the inclination changes each frame has another one."""
    traced = []

    def counted(*arguments, **options):
        traced.append(arguments)
        return trace_view(*arguments, **options)

    monkeypatch.setattr(renderer, "trace_view", counted)
    monkeypatch.setattr(renderer, "LAST", [])
    disk = "disk = {inner = 4, outer = 12, emission = {kind = 'spots', number = 9, size = 1.0}}\n"
    still = scene_of(FILM.replace("width = 64, height = 36", "width = 16, height = 9") + disk, "sky.kind=none")
    frames = [still.rendering(number).light for number in range(still.frames)]
    assert len(traced) == 1 and not np.allclose(frames[0], frames[1])
    path = "camera={path={kind='expressions', radius=inf, inclination_deg='70 + t / 4', azimuth_deg='t'}}"
    tilting = scene_of(FILM, path, "film.frames=2", "film.end=20", "overlays.caption={radius} {inclination_deg}")
    cameras = [tilting.camera(tilting.moment(number)) for number in range(2)]
    assert [math.degrees(one.inclination) for one in cameras] == pytest.approx([70, 72.5])
    assert {one.radius for one in cameras} == {math.inf}
    assert tilting.azimuth(20.0) == pytest.approx(math.radians(20))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["view={width=64}"], "view.size must be given where camera.radius is inf, but is left out."),
        (["camera.radius=nan"], "camera.radius must be a finite number, but is nan."),
        (["camera.radius=-inf"], "camera.radius must be a finite number, but is -inf."),
        (["hole.spin=inf"], "hole.spin must be a finite number, but is inf."),
        (["camera.radius=1.2"], "camera.radius must be larger than the horizon radius 1.4"),
        (["view.size=0"], "view.size must be a positive, finite number (of M), but is 0.0."),
        (["view.size='t - 1'"], "view.size must be a positive, finite number (of M), but is -1.0."),
        (["view.centre=[1, 2, 3]"], "view.centre must be two values, but is [1, 2, 3]."),
        (["view.look=forward"], "view.look must be left out where view.size is given, but is 'forward'."),
        (["view.projection=pinhole"], "view.projection must be left out where view.size is given"),
        (["view.yaw_deg=0"], "view.yaw_deg must be left out where view.size is given"),
        (["camera.velocity=circular"], "camera.velocity must be left out or fiducial where view.size is given (for a"),
        (
            ["camera={path={kind='geodesic', radius=9}}"],
            "camera.path.kind must be keyframes, expressions or csv where view.size is given (for a fiducial observer)",
        ),
        (
            ["camera={path={kind='keyframes', keyframes=[{time=0, radius=inf}, {time=1, radius=9}]}}"],
            "camera.path.keyframes[0].radius must be a finite number, but is inf.",
        ),
        (
            ["view={centre=[0, 0]}", "camera.radius=10"],
            "view.centre must be left out where view.size is left out",
        ),
    ],
)
def test_invalid_scenes_are_reported_in_a_line(changes, words, scene_of):
    with pytest.raises(ValueError, match=re.escape(words)) as caught:
        scene_of(SCENE, *changes)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_overlays_lie_on_the_screen(scene_of):
    """The shadow's edge parts dark from bright; the secondary critical curve runs round it."""
    scene = scene_of(SCENE.replace("64, height = 36", "320, height = 180"), "sky.kind=none")
    plain = kc.render(DISTANT, scene.view(0.0), Smooth(), quality="draft")
    for overlay in ("overlays.shadow_edge=true", "overlays.critical_curves=2", "overlays.tracks=[60]"):
        drawn = scene_of(SCENE.replace("64, height = 36", "320, height = 180"), overlay).developed(0, plain)
        bare = scene.developed(0, plain)
        y, x = np.nonzero(np.abs(drawn.astype(int) - bare).max(axis=2) > 40)
        places = scene.view(0.0).places(x, y)
        if "tracks" in overlay:
            assert len(x) > 100
            continue
        edge = kc.shadow_edge(DISTANT, 400)
        away = np.linalg.norm(places[:, None] - edge, axis=2).min(axis=1)
        assert len(x) > 200
        assert away.max() < 0.8


def test_a_scene_at_infinity_is_rendered_by_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far.toml").write_text(SCENE, encoding="utf-8")
    status, out, _ = run(capsys, "render", "far.toml", "--preview", "--json", "-")
    entry = json.loads(out)
    assert status == 0
    assert (entry["radius"], entry["inclination_deg"], entry["size"]) == (None, 70.0, [64, 36])
    assert (tmp_path / "far.png").exists()
