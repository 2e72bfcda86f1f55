"""A volume and a disk in one picture: order along the ray, energy, limits of either, motion blur."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.draw.scenes import save_light
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.disk.march import Marching, marched, marched_between
from kerrcaustics.scenes.disk.turned import turned_volume

CAMERA = kc.Camera(0.6, 30.0, 1.2, "static")
VIEW = kc.pictures.View(24, 15, math.radians(55))
SHIFTS = {"beaming": True, "colour_shift": True}
DISK = kc.disks.Disk(5.0, 12.0, kc.disks.BlackBody(5000.0))


def first_face(camera, view, disk):
    """Pixels that see nothing but the disk at its first crossing: so do their corners."""
    y, x = (place.ravel() - 0.5 for place in np.mgrid[: view.height + 1, : view.width + 1])
    radius = kc.trace_rays(camera, view.directions(x, y)[0], end=kc.EquatorialPlane(1)).radius
    on = ((radius > 1.05 * disk.inner) & (radius < 0.95 * disk.outer)).reshape(view.height + 1, -1)
    return on[1:, 1:] & on[1:, :-1] & on[:-1, 1:] & on[:-1, :-1]


def half_space(below, depth=0.2):
    """Matter on one side of the plane alone."""
    return lambda r, theta, phi: depth * ((theta > math.pi / 2) == below)


@pytest.mark.slow
def test_a_transparent_volume_leaves_the_picture_equal_to_the_bit():
    disk = kc.disks.Disk(5.0, 12.0, kc.disks.Swatches(), opacity=0.7)
    clear = kc.disks.Volume(0.0, 5000.0, 4.0, 20.0)
    one, other = (kc.render(CAMERA, VIEW, kc.skies.Checkerboard(), disk=disk, volume=v) for v in (None, clear))
    assert np.array_equal(one.light, other.light) and np.array_equal(one.transmission, other.transmission)
    assert one.light.std() > 0.1 and "volume" in other.stages and "volume" not in one.stages


@pytest.mark.slow
def test_linear_light_in_a_file_has_the_opacity_of_what_shines(tmp_path):
    """Put over the sky alone it is the picture of both; where there is a sky nothing is left to be put behind."""
    OpenEXR = pytest.importorskip("OpenEXR")
    disk, sky = kc.disks.Disk(5.0, 12.0, kc.disks.Swatches(), opacity=0.7), kc.skies.Checkerboard()
    alone, both, behind = (
        kc.render(CAMERA, VIEW, *seen, disk=one) for seen, one in (((), disk), ((sky,), disk), ((sky,), None))
    )
    assert both.alpha is None and behind.alpha is None
    save_light(tmp_path / "disk.exr", alone.light, alone.alpha)
    with OpenEXR.File(str(tmp_path / "disk.exr")) as file:
        pixels = np.asarray(file.channels()["RGBA"].pixels)
    light, alpha = pixels[..., :3], pixels[..., 3:]
    assert alpha.max() > 0.69 and alpha.min() == 0
    assert np.allclose(light + (1 - alpha) * behind.light, both.light, atol=1e-6)


@pytest.mark.slow
def test_matter_behind_an_opaque_disk_is_not_seen_and_matter_before_it_is():
    behind, before = (kc.disks.Volume(half_space(part), 9000.0, 3.0, 20.0, scale=2.0) for part in (True, False))
    bare, hidden, veiled = (kc.render(CAMERA, VIEW, disk=DISK, volume=v) for v in (None, behind, before))
    seen = first_face(CAMERA, VIEW, DISK)
    assert seen.sum() > 40
    assert np.array_equal(bare.light[seen], hidden.light[seen])
    assert (veiled.light[seen][:, 2] > 1.5 * bare.light[seen][:, 2]).all()
    # Beside the disk both are seen.
    assert (hidden.light != bare.light).any()


@pytest.mark.slow
def test_an_opaque_volume_hides_the_disk():
    thick = kc.disks.Volume(50.0, 4000.0, 2.5, 20.0)
    alone, both = (kc.render(CAMERA, VIEW, disk=disk, volume=thick, **SHIFTS) for disk in (None, DISK))
    dark = alone.transmission < 1e-4
    assert dark.sum() > 100
    assert np.allclose(both.light[dark], alone.light[dark], rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("density", [0.02, 0.3])
def test_matter_as_hot_as_the_disk_leaves_it_as_bright(density):
    """Of one temperature nothing shows what is where: (1 - T) B + T B = B."""
    volume = kc.disks.Volume(density, 5000.0, 2.5, 20.0)
    found = kc.render(CAMERA, VIEW, disk=DISK, volume=volume)
    seen = first_face(CAMERA, VIEW, DISK)
    assert np.allclose(found.light[seen], kc.pictures.black_body(5000.0), rtol=2e-6)


@pytest.mark.slow
def test_parts_between_crossings_make_up_the_whole():
    y, x = (place.ravel() for place in np.mgrid[:15, :24])
    sky, steps = VIEW.directions(x, y)

    def density(r, theta, phi):
        return 0.05 * np.exp(-((np.cos(theta) / 0.4) ** 2))

    volume = kc.disks.Volume(density, 5000.0, 2.5, 20.0, scale=1.0)
    whole = marched(Marching(CAMERA, volume, True, True, 0.25), sky, steps)
    parts = marched_between(Marching(CAMERA, volume, True, True, 0.25, crossings=2), sky, steps)
    assert parts.light.shape == (3, 360, 3) and (parts.light.sum(axis=(1, 2)) > 0).all()
    assert (np.diff(parts.transmission, axis=0) <= 0).all()
    # A ray that winds round the hole ends elsewhere with other steps.
    assert np.quantile(np.abs(parts.transmission[-1] - whole.transmission), 0.98) < 1e-5
    assert np.allclose(parts.light.sum(axis=0), whole.light, atol=2e-6 * whole.light.max())


@pytest.mark.slow
def test_crossings_are_those_of_the_disk():
    """Matter that shines on one side alone is parted as the plane parts it: even parts above it, odd ones below."""
    y, x = (place.ravel() for place in np.mgrid[:15, :24])
    sky, steps = VIEW.directions(x, y)
    for below in (True, False):
        volume = kc.disks.Volume(half_space(below), 5000.0, 2.5, 20.0, scale=1.0)
        light = marched_between(Marching(CAMERA, volume, False, False, 0.5, crossings=3), sky, steps).light
        for k in range(3):
            assert (luminance(light[k]).max() > 1e-3) == ((k % 2 == 1) == below), (below, k)


@pytest.mark.slow
def test_a_thin_slab_approaches_a_disk():
    """The lower an opaque slab is, the more it looks like the disk, shifts included."""
    camera = kc.Camera(0.6, 30.0, 0.7, "static")
    view = kc.pictures.View(20, 14, math.radians(50))
    seen = first_face(camera, view, DISK)
    expected = luminance(kc.render(camera, view, disk=DISK, **SHIFTS).light)[seen]
    wrong = []
    for height in (0.2, 0.05):

        def slab(r, theta, phi, height=height):
            return 30 / height * np.exp(-((r * np.cos(theta) / height) ** 2) / 2)

        volume = kc.disks.Volume(slab, 5000.0, 5.0, 12.0, scale=height)
        found = luminance(kc.render(camera, view, volume=volume, **SHIFTS).light)[seen]
        wrong.append(np.quantile(np.abs(found - expected) / expected, 0.9))
    assert wrong[1] < 0.06 and wrong[1] < wrong[0] / 2


@pytest.mark.slow
@pytest.mark.parametrize("disk", [None, kc.disks.Disk(5.0, 9.0, kc.disks.Swatches(), opacity=0.5)])
def test_blur_is_the_mean_of_moments(disk):
    view = kc.pictures.View(48, 30, math.radians(60))

    def lobes(r, theta, phi):
        return 0.3 * np.exp(-((r * np.cos(theta)) ** 2)) * np.cos(2 * phi) ** 4

    volume = kc.disks.Volume(lobes, 6000.0, 9.0, 14.0, scale=1.5)
    motion = kc.pictures.ShutterMotion((CAMERA, CAMERA), (view, view), azimuths=(-0.2, 0.2))
    found = kc.render(CAMERA, view, disk=disk, volume=volume, motion=motion).light
    moments = (np.arange(64) + 0.5) / 64 * 0.4 - 0.2
    expected = np.mean(
        [kc.render(CAMERA, view, volume=turned_volume(volume, -float(phi))).light for phi in moments], axis=0
    )
    still = kc.render(CAMERA, view, volume=volume).light
    if disk is None:
        brightest = expected.max()
        assert np.abs(found - expected).max() < 0.05 * brightest < 0.2 * np.abs(still - expected).max() / 0.2
        assert np.quantile(np.abs(found - expected), 0.95) < 0.01 * brightest
    else:
        # Matter beyond the disk is before it or behind it, and nothing of it is lost where there is no disk.
        beside = (found.sum(axis=-1) > 0) & (kc.render(CAMERA, view, disk=disk).transmission == 1)
        assert beside.sum() > 100
        assert np.quantile(np.abs(found - expected)[beside], 0.9) < 0.01 * expected.max()


@pytest.mark.slow
def test_a_symmetric_volume_on_a_circular_orbit_is_that_of_one_moment():
    grid = kc.disks.VolumeGrid(np.full((4, 8, 1), 0.05), 5.0, 12.0)
    volume = kc.disks.Volume(grid, 6000.0, 5.0, 12.0)
    motion = kc.pictures.ShutterMotion((CAMERA, CAMERA), (VIEW, VIEW), azimuths=(-0.2, 0.2), times=(-1.0, 1.0))
    one, other = (kc.render(CAMERA, VIEW, volume=volume, motion=way) for way in (None, motion))
    assert np.array_equal(one.light, other.light) and one.light.max() > 0


@pytest.mark.slow
def test_a_volume_turns():
    values = np.random.default_rng(1).uniform(0, 1, (3, 4, 8))
    grid = kc.disks.VolumeGrid(values, 5.0, 12.0)
    law = kc.disks.Volume(grid, lambda r, theta, phi: 5000 + 100 * np.cos(phi), 5.0, 12.0, scale=1.0)
    turned = turned_volume(law, 0.5)
    place = np.array([6.0, 9.0]), np.array([1.0, 2.0]), np.array([0.3, 4.0])
    later = place[0], place[1], place[2] + 0.5
    for one, other in zip(law.matter(*place, 0.0), turned.matter(*later, 0.0), strict=True):
        assert np.allclose(one, other, rtol=1e-12)
    assert turned_volume(kc.disks.Volume(0.1, 5000.0, 5.0, 12.0), 0.5).symmetric


@pytest.mark.parametrize(
    ("volume", "message"),
    [(3, "`volume` must be a Volume, but is int"), (kc.disks.Volume(0.1, 5e3, 1.1, 9.0), "`inner` must be larger")],
)
def test_what_is_no_volume_of_the_hole_is_refused(volume, message):
    for motion in (None, kc.pictures.ShutterMotion((CAMERA, CAMERA), (VIEW, VIEW), azimuths=(-0.2, 0.2))):
        with pytest.raises(ValueError, match=message):
            kc.render(CAMERA, VIEW, volume=volume, motion=motion)
