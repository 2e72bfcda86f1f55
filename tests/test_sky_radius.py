"""A sky on a sphere of finite radius: against rays one by one, flat space, the sky at infinity, and images of stars."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scene_files import overlays
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.spacetime.sphere import from_angles

CAMERA = kc.Camera(spin=0.9, radius=8.0, inclination=1.2)
RADIUS = 12.0
SIDEWAYS = kc.pictures.View(32, 18, 1.0, forward=(0.3, 0.9, 0.2))


class Marks(kc.skies.Sky):
    """A sky whose light encodes 1 + n'_x, 1 + n'_y and the frequency ratio."""

    def light(self, footprint, beaming, colour_shift):
        return np.column_stack([1 + footprint.direction[:, :2], footprint.redshift])


def pixels_of(view):
    return view.directions(*np.meshgrid(np.arange(view.width), np.arange(view.height)))


def marks(camera, view, radius=math.inf, quality="high"):
    return kc.render(camera, view, Marks(), beaming=True, quality=quality, sky_radius=radius)


def one_star(direction):
    catalogue = kc.skies.StarCatalogue(np.asarray(direction)[None], np.zeros(1), np.full(1, 0.65))
    return kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)


def received(scene):
    return (luminance(scene.light) * scene.view.solid_angle(pixels_of(scene.view)[1])).sum()


@pytest.fixture(scope="module")
def seen():
    return marks(CAMERA, SIDEWAYS, RADIUS)


@pytest.mark.slow
def test_pixels_see_where_their_rays_meet_the_sphere(seen):
    rays = kc.trace_rays(CAMERA, pixels_of(SIDEWAYS)[0], end=RADIUS, redshift=True)
    off = seen.light - np.concatenate([1 + rays.direction[..., :2], rays.redshift[..., None]], axis=-1)
    # An error of the map in pixels, of which none sees more than 0.1 rad; single precision.
    assert np.abs(off[..., :2]).max() < 0.1 * seen.error
    assert np.abs(off[..., 2] / rays.redshift).max() < 1e-5
    assert seen.sky_radius == RADIUS and seen.error <= 0.005


@pytest.mark.slow
def test_the_shadow_is_that_before_the_sky_at_infinity():
    view = kc.pictures.View.toward_hole(CAMERA, 24, 14, 1.6)
    near, far = (kc.pictures.trace_view(CAMERA, view, sky_radius=radius) for radius in (RADIUS, math.inf))
    assert near.visible_fraction == pytest.approx(far.visible_fraction, abs=1e-6)
    assert 0.1 < near.visible_fraction.mean() < 0.9


@pytest.mark.slow
def test_a_large_sphere_tends_to_infinity_as_its_radius():
    """Directions differ by r sin / R; the redshift by 1 / R, that of the sources."""
    far = marks(CAMERA, SIDEWAYS).light
    one, other = (np.abs(marks(CAMERA, SIDEWAYS, radius).light - far).mean(axis=(0, 1)) for radius in (400, 800))
    assert one / other == pytest.approx(2, abs=0.05)
    assert 0.2 < other[0] * 800 / CAMERA.radius < 2
    assert other[2] * 800 / far[..., 2].mean() == pytest.approx(1, rel=0.02)


def met(sky, radius):
    """The places at which straight rays from (1, 0, 0) meet a sphere, in camera radii: unit vectors, ways."""
    way = -sky[..., 0] + np.sqrt(sky[..., 0] ** 2 + radius**2 - 1)
    return (sky * way[..., None] + [1.0, 0, 0]) / radius, way


@pytest.mark.slow
def test_in_flat_space_the_sphere_is_where_straight_lines_meet_it():
    camera = kc.Camera(0.0, 1e7, velocity="static")
    view = kc.pictures.View(24, 24, 1.0, forward=(0.2, 0.9, 0.3))
    seen = marks(camera, view, 1.5e7)
    assert np.abs(seen.light[..., :2] - 1 - met(pixels_of(view)[0], 1.5)[0][..., :2]).max() < 0.1 * seen.error + 1e-6
    # The light of a star: of the area that it stands for on the sphere, by the angle and the distance.
    sky = np.array([0.2, 0.9, 0.3]) / math.sqrt(0.94)
    place, way = met(sky, 1.5)
    star = kc.render(camera, kc.pictures.View(16, 16, 0.01, forward=sky), one_star(place), sky_radius=1.5e7)
    assert received(star) == pytest.approx(1.5**2 * (sky @ place) / way**2, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("coarse", [False, True])
def test_images_of_a_star_have_the_light_that_is_certified(coarse):
    """Also in pixels that see so much that charts are searched, and with the shift of a source at rest there."""
    images = kc.star_images(CAMERA, (1.3, 2.4), max_index=1, end=RADIUS)
    star = one_star(from_angles(1.3, 2.4))
    if coarse:
        view = kc.pictures.View(36, 18, 2 * math.pi, "equirectangular")
        seen = received(kc.render(CAMERA, view, star, sky_radius=RADIUS))
        assert seen == pytest.approx(images.magnification.sum(), rel=0.01)
        return
    view = kc.pictures.View(24, 24, 0.004, forward=images.sky[0])
    plain, shifted = (received(kc.render(CAMERA, view, star, beaming=on, sky_radius=RADIUS)) for on in (False, True))
    assert plain == pytest.approx(images.magnification[0], rel=0.01)
    assert shifted / plain == pytest.approx(images.redshift[0] ** 4, rel=1e-3)


@pytest.mark.slow
def test_motion_blur_is_the_mean_of_moments():
    view = SIDEWAYS
    cameras = [kc.Camera(0.9, 8 - step, velocity=(-0.3, 0, 0.2)) for step in (-0.1, 0.1)]
    motion = kc.pictures.ShutterMotion(cameras, (view, view), (-0.05, 0.05))
    camera, sky = kc.Camera(0.9, 8.0, velocity=(-0.3, 0, 0.2)), kc.skies.Checkerboard(rows=15, columns=30)
    blurred = kc.render(camera, view, sky, motion=motion, sky_radius=RADIUS)
    moments = (np.arange(16) + 0.5) / 16 - 0.5
    mean = np.mean(
        [
            kc.render(
                kc.Camera(0.9, 8 - 0.2 * moment, velocity=(-0.3, 0, 0.2)),
                view,
                kc.skies.TurnedSky(sky, -0.1 * moment),
                sky_radius=RADIUS,
            ).light
            for moment in moments.tolist()
        ],
        axis=0,
    )
    still = kc.render(camera, view, sky, sky_radius=RADIUS).light
    off, without = (np.abs(luminance(light - mean)).mean() / luminance(mean).mean() for light in (blurred.light, still))
    assert off < 0.03 and off < 0.25 * without and blurred.sky_radius == RADIUS


@pytest.mark.parametrize(
    ("viewer", "radius", "words"),
    [
        (CAMERA, 8.0, "must be larger than the radius of the camera, 8, but is 8."),
        (CAMERA, -1, "must be larger than the radius of the camera, 8, but is -1."),
        (CAMERA, math.nan, "must be larger than the radius of the camera, 8, but is nan."),
        (kc.Camera(0.9, 3.0), 3.5, "must be larger than that of the outermost photon orbit, 3.91"),
        (kc.Observer(spin=0.9, inclination=1.2), 1e9, "must be inf for an observer at infinity, but is 1000000000.0."),
        (CAMERA, "far", "must be larger than the radius of the camera, 8, but is 'far'."),
    ],
)
def test_who_is_not_within_the_sphere_is_refused(viewer, radius, words):
    view = SIDEWAYS if isinstance(viewer, kc.Camera) else kc.Screen(8, 6, 20)
    with pytest.raises(ValueError, match="Argument `sky_radius` " + re.escape(words)):
        kc.render(viewer, view, kc.skies.Checkerboard(), sky_radius=radius)


def test_a_disk_is_within_the_sphere():
    disk = kc.disks.Disk(5.0, 12.5, kc.disks.BlackBody(5000.0))
    with pytest.raises(ValueError, match=r"larger than that of the disk's outer rim, 12.5, but is 12"):
        kc.render(CAMERA, SIDEWAYS, kc.skies.Checkerboard(), disk=disk, sky_radius=RADIUS)


@pytest.mark.stand_ins
def test_lines_over_a_picture_are_those_of_its_sphere(monkeypatch):
    ends = []
    monkeypatch.setattr(overlays, "caustics", lambda camera, orders, end: ends.append(end) or [])
    monkeypatch.setattr(overlays, "tracks_of", lambda *_, end: ends.append(end) or SimpleNamespace(tracks=[]))
    rendering = SimpleNamespace(camera=CAMERA, view=SIDEWAYS, sky_radius=RADIUS)
    table = overlays.OverlaysTable(critical_curves=2, tracks=(80.0,))
    overlays.overlaid(np.zeros((18, 32, 3), np.uint8), table, rendering, None)
    assert ends == [RADIUS, RADIUS]
