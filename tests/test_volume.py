"""Volumes: what must be seen of them, against closed forms, finer marches and other engines; and the flat twin."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.disk.flat import render_flat
from kerrcaustics.scenes.disk.march import Marching, marched, marched_between
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import photon_of
from kerrcaustics.spacetime.sphere import from_angles

CAMERA = kc.Camera(0.6, 74.1, math.radians(80), "static")
VIEW = kc.pictures.View(48, 36, math.radians(38))
FAR = kc.Camera(0.0, 1e6, math.pi / 2, "static")


def torus(radius, theta, azimuth):
    return 0.3 * np.exp(-0.5 * (np.cos(theta) / 0.25) ** 2 - 0.5 * ((radius - 13) / 2.5) ** 2)


def hot(radius, theta, azimuth):
    return 6000 * (radius / 10) ** -0.5 * (1 + 0.2 * np.sin(2 * azimuth))


TORUS = kc.disks.Volume(torus, hot, 5.0, 22.0, scale=2.0, motion="fiducial")


@pytest.mark.slow
def test_the_error_is_honest_and_falls_with_the_step():
    finest = kc.pictures.render_volume(CAMERA, VIEW, TORUS, beaming=True, colour_shift=True, step=0.1)
    whole, errors = luminance(finest.light).max(), []
    for step in (2.0, 0.5):
        found = kc.pictures.render_volume(CAMERA, VIEW, TORUS, beaming=True, colour_shift=True, step=step)
        wrong = np.maximum(
            np.abs(luminance(found.light) - luminance(finest.light)) / whole,
            np.abs(found.transmission - finest.transmission),
        )
        assert np.quantile(wrong, 0.98) < found.error and wrong.max() < 4 * found.error + 1e-6
        errors.append(found.error)
    assert errors[1] < errors[0] / 4 and errors[1] < 3e-4


@pytest.mark.slow
def test_a_draft_takes_fewer_steps_and_no_finer_rays(monkeypatch):
    """But at edges, which it does not refine, it shows the same."""
    counted = []

    def counting(*arguments):
        light = marched_between(*arguments)
        counted.append((len(arguments[1]), light.steps))
        return light

    monkeypatch.setattr("kerrcaustics.scenes.disk.veil.marched_between", counting)
    camera = kc.Camera(0.9, 30.0, 1.3)
    view = kc.pictures.View.toward_hole(camera, 40, 30, 0.8)
    glow = kc.disks.Volume(lambda r, theta, phi: 0.3 * np.exp(-((np.cos(theta) / 0.25) ** 2)), 6504.0, 5.0, 15.0, 2.0)
    pictures, work = [], []
    for quality in ("normal", "draft"):
        counted.clear()
        pictures.append(kc.render(camera, view, volume=glow, quality=quality).light)
        work.append([sum(numbers) for numbers in zip(*counted, strict=True)])
    normal, draft = pictures
    assert work[1][0] == 40 * 30 < work[0][0] and work[1][1] < 0.7 * work[0][1]
    off = np.abs(normal - draft).max(axis=2)
    assert off.max() > 0 and np.median(off[normal.any(axis=2)]) < 1e-3 * normal.max()


def test_an_opaque_volume_shows_its_source():
    volume = kc.disks.Volume(50.0, 5000.0, 4.0, 12.0, motion="static")
    found = kc.pictures.render_volume(CAMERA, VIEW, volume)
    within = found.transmission < 1e-5
    assert within.sum() > 200
    assert np.allclose(found.light[within], kc.pictures.black_body(5000.0), rtol=3e-5)


def test_static_matter_shines_with_the_shift_of_its_depth():
    """The first light comes from the surface: a black body of g T, with g by the lapse of a hole without spin."""
    camera = kc.Camera(0.0, 50.0, 1.3, "static")
    volume = kc.disks.Volume(1e4, 5000.0, 4.0, 12.0, motion="static")
    view = kc.pictures.View(8, 8, math.radians(2))
    found = kc.pictures.render_volume(camera, view, volume, beaming=True, colour_shift=True)
    ratio = math.sqrt((1 - 2 / 12) / (1 - 2 / 50))
    assert np.allclose(found.light, kc.pictures.black_body(5000.0 * ratio), rtol=2e-4)


SEEN = {
    (False, False): lambda g: np.ones_like(g)[:, None] * kc.pictures.black_body(6000.0),
    (True, False): lambda g: (g**4)[:, None] * kc.pictures.black_body(6000.0),
    (True, True): lambda g: kc.pictures.black_body(6000.0 * g),
}


@pytest.mark.parametrize("spin", [0.0, 0.9])
@pytest.mark.parametrize("shifts", SEEN)
def test_down_the_axis_a_thin_shell_next_to_the_hole_is_an_integral(spin, shifts):
    """I_nu / nu^3 is kept: the light of each place, shifted from its lapse to the camera's, times density and length.

    At rest on the axis alpha^2 = Delta / (r^2 + a^2), and matter measures the length dr / alpha.
    """
    inner, outer, density, away = 1.2 * kerr.horizon(spin), 9.0, 1e-6, 20.0
    volume = kc.disks.Volume(density, 6000.0, inner, outer, motion="static")
    way = Marching(kc.Camera(spin, away, 0.0, "static"), volume, *shifts, 0.1)
    found = marched(way, np.array([[-1.0, 0.0, 0.0]]), np.zeros((1, 3, 2))).light[0]
    r = np.append(np.geomspace(inner, outer, 100_001), away)
    lapse = np.sqrt(1 - 2 * r / (r * r + spin**2))
    light = SEEN[shifts](lapse[:-1] / lapse[-1])
    expected = density * np.trapezoid(light / lapse[:-1, None], r[:-1], axis=0)
    assert np.allclose(found, expected, rtol=2e-5)


def test_a_thin_ball_in_flat_space_is_as_bright_as_it_is_long():
    """Far out nothing bends: along a chord of the ball the light is density times length, but for the hole in it."""
    radius, density = 2e5, 1e-9
    volume = kc.disks.Volume(density, 6504.0, 1e3, radius, motion="static")
    view = kc.pictures.View(200, 1, 2 * math.tan(0.15))
    sky, steps = view.directions(np.arange(100, 200), np.zeros(100))
    found = marched(Marching(FAR, volume, False, False, 0.5), sky, steps)
    offset = 1e6 * np.sqrt(1 - sky[:, 0] ** 2)
    chord = 2 * np.sqrt(np.maximum(radius**2 - offset**2, 0)) - 2 * np.sqrt(np.maximum(1e6 - offset**2, 0))
    seen = (chord > 0) & (offset > 2e3)
    assert seen.sum() > 30
    assert np.allclose(luminance(found.light)[seen], -np.expm1(-density * chord[seen]), rtol=3e-4)
    assert np.allclose(found.light[(chord <= 0)], 0)


def test_a_thin_cloud_in_flat_space_is_an_integral():
    """A Gaussian cloud off the axis, against its closed form along straight rays."""
    centre, wide = np.array([0.0, 3e4, 2e4]), 5e3

    def cloud(radius, theta, azimuth):
        s = radius * np.sin(theta)
        place = np.stack([s * np.cos(azimuth), s * np.sin(azimuth), radius * np.cos(theta)], axis=-1)
        return 1e-9 * np.exp(-((place - centre) ** 2).sum(axis=-1) / (2 * wide**2))

    volume = kc.disks.Volume(cloud, 6504.0, 1e3, 1e5, scale=5e3, motion="static")
    view = kc.pictures.View(40, 40, 0.12)
    y, x = (place.ravel() for place in np.mgrid[:40, :40])
    sky, steps = view.directions(x, y)
    found = marched(Marching(FAR, volume, False, False, 0.5), sky, steps)
    # N in Cartesian axes of space: e_r, e_phi, -e_theta of a camera on the equator at azimuth 0 are x, y, z.
    from_camera = centre - np.array([1e6, 0, 0])
    away = np.linalg.norm(np.cross(sky, from_camera), axis=-1)
    expected = 1e-9 * wide * math.sqrt(2 * math.pi) * np.exp(-(away**2) / (2 * wide**2))
    assert np.allclose(luminance(found.light), expected, rtol=2e-3, atol=1e-3 * expected.max())


@pytest.mark.slow
def test_captured_rays_are_black_only_behind_the_volume():
    sky = kc.skies.Checkerboard()
    shell = kc.disks.Volume(torus, hot, 8.0, 20.0, scale=2.0)
    bare, found = kc.render(CAMERA, VIEW, sky), kc.pictures.render_volume(CAMERA, VIEW, shell, sky)
    alone = kc.pictures.render_volume(CAMERA, VIEW, shell)
    shadow = bare.visible_fraction == 0
    assert shadow.sum() > 30 and found.light[shadow].sum(axis=-1).max() > 0.01
    transmission = found.transmission[..., None]
    assert np.allclose(found.light, alone.light + transmission * bare.light, atol=1e-6)
    assert np.array_equal(found.light[found.transmission == 1], bare.light[found.transmission == 1])


@pytest.mark.parametrize("camera", [CAMERA, kc.Camera(0.95, 6.0, 1.0, "fiducial")], ids=["far", "near"])
def test_paths_are_those_of_trace_beams(camera):
    """Rays marched to an opaque shell nearly at infinity, whose temperature encodes the place, end where beams do."""
    view = kc.pictures.View.toward_hole(camera, 12, 9, 0.3 if camera is CAMERA else 2.0)
    y, x = (place.ravel() for place in np.mgrid[:9, :12])
    sky, steps = view.directions(x, y)
    direction = kc.trace_beams(camera, sky).direction
    escaped = np.isfinite(direction[:, 0])
    assert 20 < escaped.sum() < 100
    warmth = np.linspace(2000, 10000, 8001)
    wrong = np.zeros(escaped.sum())
    for axis in range(3):

        def temperature(radius, theta, azimuth, axis=axis):
            return 6000 + 3000 * from_angles(theta, azimuth)[:, axis]

        shell = kc.disks.Volume(
            lambda radius, *_: (radius > 1e7).astype(float), temperature, 3.0, 1e8, scale=1e8, motion="static"
        )
        light = luminance(marched(Marching(camera, shell, False, False, 0.5), sky, steps).light)
        assert np.array_equal(light > 0, escaped)
        found = (np.interp(light, luminance(kc.pictures.black_body(warmth)), warmth) - 6000) / 3000
        wrong = np.hypot(wrong, (found - direction[:, axis])[escaped])
    # Where the beam is narrow the end is as good as the step.
    assert wrong.max() < 2e-3 and np.median(wrong) < 1e-5


def test_energies_are_those_of_the_emitters():
    spin, radius = 0.7, np.array([4.0, 9.0, 30.0])
    light = photon_of(CAMERA.frame(), (np.array([-0.95] * 3), np.array([0.2, -0.2, 0.1]), np.array([0.1, 0.1, -0.1])))
    for name in ("circular", "fiducial", "static"):
        motion = EMITTERS[name](spin, radius, 0.0)
        expected = (1 - motion.orbital * light.b) / np.sqrt(motion.slowness)
        volume = kc.disks.Volume(1.0, 5000.0, 3.0, 40.0, motion=name)
        found = volume.energy(spin, light.b, radius, np.full(3, math.pi / 2))
        assert np.allclose(found, expected, rtol=1e-13)
    still = kc.disks.Volume(1.0, 5000.0, 1.5, 40.0, motion="static")
    assert np.isnan(still.energy(0.9, 0.0, np.array([1.6]), np.array([math.pi / 2]))).all()
    given = kc.disks.Volume(1.0, 5000.0, 3.0, 40.0, motion=lambda r, theta: 1 / (spin + r**1.5))
    circle = kc.disks.Volume(1.0, 5000.0, 3.0, 40.0)
    at = spin, light.b, radius, np.full(3, math.pi / 2)
    assert np.allclose(given.energy(*at), circle.energy(*at))
    # Rounded over the axis.
    beyond, before = (circle.energy(spin, 0.1, radius, np.full(3, math.pi + step)) for step in (1e-9, -1e-9))
    assert np.allclose(beyond, before)


def grid_of(law, shape, inner=5.0, outer=22.0):
    sides = [(np.arange(count) + 0.5) / count for count in shape]
    radius = inner * (outer / inner) ** sides[0]
    return kc.disks.VolumeGrid(
        law(*np.meshgrid(radius, np.pi * sides[1], 2 * np.pi * sides[2], indexing="ij")), inner, outer
    )


@pytest.mark.slow
def test_a_grid_is_seen_as_its_function():
    grid = grid_of(torus, (24, 48, 1))
    view = kc.pictures.View(36, 24, math.radians(38))
    one = kc.pictures.render_volume(CAMERA, view, kc.disks.Volume(grid, 5500.0, 5.0, 22.0))
    other = kc.pictures.render_volume(CAMERA, view, kc.disks.Volume(torus, 5500.0, 5.0, 22.0, scale=2.0))
    wrong = np.abs(one.light - other.light).max(axis=-1) / other.light.max()
    # Beams of pixels 1 degree wide see the coarser grids.
    assert np.median(wrong) < 0.01 and np.quantile(wrong, 0.9) < 0.06 and one.light.max() > 0.1


def test_a_wide_beam_sees_the_mean_of_a_grid():
    rng = np.random.default_rng(3)
    grid = kc.disks.VolumeGrid(rng.uniform(0, 1, (16, 32, 64)), 5.0, 22.0)
    place = rng.uniform(6, 20, 400), rng.uniform(0.3, 2.8, 400), rng.uniform(-9, 9, 400)
    fine, coarse = grid.mean(*place), grid.mean(*place, width=16 * grid.cell * place[0])
    assert fine.std() > 0.1 and coarse.std() < 0.02 and abs(coarse.mean() - 0.5) < 0.02
    r, theta, phi = (np.array([value]) for value in (10.0, 1.2, 0.7))
    assert np.allclose(grid.mean(r, theta, phi), grid.mean(r, theta, phi + 2 * np.pi))
    middle = 5.0 * (22 / 5) ** (3.5 / 16), 4.5 * np.pi / 32, 6.5 * np.pi / 32
    one = kc.disks.VolumeGrid(np.eye(64)[6] * np.eye(32)[4][:, None] * np.eye(16)[3][:, None, None], 5.0, 22.0)
    assert math.isclose(float(one.mean(*(np.array([value]) for value in middle))[0]), 1.0, rel_tol=1e-9)


def test_means_go_by_what_cells_absorb():
    """Hot clumps in empty space: a wide beam sees their temperature, and without weights one that is much too low."""
    rng = np.random.default_rng(8)
    density = (rng.random((16, 32, 64)) < 0.1).astype(float)
    heat, colour = 6000 * density, density[..., None] * [1.0, 0.5, 0.25]
    grids = [kc.disks.VolumeGrid(values, 5.0, 22.0, weights=density) for values in (heat, colour)]
    place = rng.uniform(6, 20, 400), rng.uniform(0.3, 2.8, 400), rng.uniform(-9, 9, 400)
    for part in (0.0, 3.3, 16.0):
        width = part * grids[0].cell * place[0]
        seen = kc.disks.VolumeGrid(density, 5.0, 22.0).mean(*place, width) > 1e-9
        assert seen.sum() > 100
        assert np.allclose(grids[0].mean(*place, width)[seen], 6000)
        assert np.allclose(grids[1].mean(*place, width)[seen], [1.0, 0.5, 0.25])
    plain = kc.disks.VolumeGrid(heat, 5.0, 22.0).mean(*place, width)
    assert plain.max() < 1500


def test_a_beam_between_two_levels_sees_a_part_of_both():
    grid = kc.disks.VolumeGrid(np.random.default_rng(9).uniform(0, 1, (16, 32, 64)), 5.0, 22.0)
    place = np.array([9.0]), np.array([1.1]), np.array([2.0])
    one, between, two = (grid.mean(*place, width=factor * grid.cell * 9.0)[0] for factor in (2, 2**1.25, 4))
    assert between == pytest.approx(0.75 * one + 0.25 * two, rel=1e-12) and abs(one - two) > 1e-3


@pytest.mark.slow
def test_colours_of_a_volume():
    """A grid of one colour is that colour, as three numbers and as a function; a shell of two is red on one side."""
    view, even = kc.pictures.View(12, 9, math.radians(38)), np.tile([0.8, 0.4, 0.1], (3, 4, 1, 1))
    colours = None, (0.8, 0.4, 0.1), kc.disks.VolumeGrid(even, 5.0, 22.0), lambda *_: np.array([0.8, 0.4, 0.1])
    lights = [
        kc.pictures.render_volume(CAMERA, view, kc.disks.Volume(0.1, 6000.0, 5.0, 22.0, 4.0, colour=colour)).light
        for colour in colours
    ]
    assert np.allclose(lights[1], lights[0] * np.array([0.8, 0.4, 0.1]), rtol=1e-6) and lights[0].max() > 0.5
    for light in lights[2:]:
        assert np.allclose(light, lights[1], atol=1e-3 * lights[1].max())
    sides = np.ones((1, 1, 64, 3))
    sides[:, :, 32:, 1:] = 0
    part = kc.disks.Volume(0.1, 6000.0, 5.0, 22.0, 1.0, colour=kc.disks.VolumeGrid(sides, 5.0, 22.0))
    blue = kc.pictures.render_volume(CAMERA, view, part).light[..., 2]
    # phi grows to the right of the hole, seen from phi = 0.
    assert blue[:, 8:].sum() > 3 * blue[:, :4].sum()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: kc.disks.VolumeGrid(np.ones((3, 3, 3, 2)), 5.0, 9.0), "`values` must have shape"),
        (lambda: kc.disks.VolumeGrid(np.ones((3, 3, 3)), 5.0, 9.0, weights=np.ones((3, 3, 2))), "`weights` must have"),
        (lambda: kc.disks.VolumeGrid(np.ones((3, 3, 3)), 5.0, 9.0, weights=-np.ones((3, 3, 3))), "`weights` must hold"),
        (lambda: kc.disks.Volume(kc.disks.VolumeGrid(np.ones((3, 3, 1, 3)), 5.0, 9.0), 5e3, 5.0, 9.0), "of numbers"),
        (lambda: kc.disks.Volume(0.1, 5e3, 5.0, 9.0, colour="red"), "`colour` must be three numbers"),
        (lambda: kc.disks.Volume(0.1, 5e3, 5.0, 9.0, colour=(1, 1, -1)), "`colour` must hold"),
        (lambda: kc.disks.Volume(0.1, 5e3, 5.0, 9.0, colour=lambda *_: 1.0), "`scale` must be given"),
    ],
)
def test_what_is_no_grid_and_no_colour_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_far_out_beams_are_as_wide_as_they_are_long():
    """The width at which a grid is asked for, where a ray comes to it: the larger diameter, whatever the pixel."""

    class Asked(kc.disks.VolumeGrid):
        def mean(self, radius, theta, azimuth, width=0.0):
            places.append((from_angles(theta, azimuth) * radius[:, None], width))
            return super().mean(radius, theta, azimuth, width)

    volume = kc.disks.Volume(Asked(np.ones((16, 16, 1)), 500.0, 1000.0), 5000.0, 500.0, 1000.0)
    view = kc.pictures.View(9, 9, 1e-3)
    x, y = np.array([1, 4, 6]), np.array([2, 4, 8])
    sky, steps = view.directions(x, y)
    steps = steps @ np.array([[[1.0, 0.3], [0.0, 0.5]], [[0.4, 2.0], [-1.0, 0.0]], [[3.0, 0.0], [0.0, 1.0]]])
    for k in range(3):
        places = []
        marched(Marching(FAR, volume, False, False, 0.1), sky[k : k + 1], steps[k : k + 1])
        place, width = places[0]
        away = np.linalg.norm(place[0] - [1e6, 0, 0])
        # The hole bends rays by some 1e-4 of what is left of the way.
        assert away < 1e6 - 700 and width == pytest.approx(np.linalg.norm(steps[k], 2) * away, rel=3e-4)


BAD = {
    "density": lambda: kc.disks.Volume(-1.0, 5000.0, 4.0, 9.0),
    "temperature": lambda: kc.disks.Volume(1.0, "hot", 4.0, 9.0),
    "scale": lambda: kc.disks.Volume(torus, 5000.0, 4.0, 9.0),
    "motion": lambda: kc.disks.Volume(1.0, 5000.0, 4.0, 9.0, motion="falling"),
    "inner": lambda: kc.disks.Volume(1.0, 5000.0, 9.0, 4.0),
    "outer": lambda: kc.disks.Volume(1.0, 5000.0, 9.0, math.inf),
    "brightness": lambda: kc.disks.Volume(1.0, 5000.0, 4.0, 9.0, brightness=math.nan),
    "values": lambda: kc.disks.VolumeGrid(np.zeros((3, 4)), 4.0, 9.0),
    "volume": lambda: kc.pictures.render_volume(CAMERA, VIEW, kc.disks.BlackBody(5000)),
    "step": lambda: kc.pictures.render_volume(CAMERA, VIEW, TORUS, step=0.0),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line(name):
    with pytest.raises(ValueError, match=rf"^Argument `{name}` must ") as caught:
        BAD[name]()
    assert "\n" not in str(caught.value)


def test_more_bad_input():
    with pytest.raises(ValueError, match="horizon radius"):
        kc.pictures.render_volume(CAMERA, VIEW, kc.disks.Volume(1.0, 5000.0, 1.0, 9.0))
    with pytest.raises(ValueError, match="not negative"):
        kc.pictures.render_volume(CAMERA, VIEW, kc.disks.Volume(lambda r, t, p: -r, 5000.0, 4.0, 9.0, scale=1.0))


def test_without_a_hole_the_disk_is_an_ellipse_and_the_sky_stays():
    camera = kc.Camera(0.6, 50.0, math.radians(60), "static")
    view = kc.pictures.View(160, 120, math.radians(40))
    disk = kc.disks.Disk(5.0, 12.0, kc.disks.BlackBody(6504))
    light = render_flat(camera, view, disk=disk)[..., 0]
    # Solid angle of a small disk far away: area times cosine over the square of the distance, corrected by its size.
    y, x = np.mgrid[:120, :160]
    angle = (light * view.solid_angle(view.directions(x, y)[1])).sum()
    radius = np.linspace(5, 12, 401)
    phi = np.linspace(0, 2 * np.pi, 400, endpoint=False)[:, None]
    place = np.stack([radius * np.cos(phi), radius * np.sin(phi), 0 * radius * phi], axis=-1)
    away = 50 * np.array([math.sin(math.radians(60)), 0, math.cos(math.radians(60))]) - place
    density = away[..., 2] / np.linalg.norm(away, axis=-1) ** 3 * radius
    expected = np.trapezoid(density.mean(axis=0), radius) * 2 * np.pi
    assert math.isclose(angle, expected, rel_tol=2e-3)


@pytest.mark.slow
def test_far_from_the_hole_the_flat_picture_is_that_of_render():
    camera = kc.Camera(0.0, 1e7, math.radians(70), "static")
    view = kc.pictures.View(60, 40, math.radians(30), forward=(0.2, 0.9, 0.3))
    sky = kc.skies.Checkerboard()
    assert np.allclose(render_flat(camera, view, sky), kc.render(camera, view, sky).light, atol=2e-3)
    view = kc.pictures.View(80, 40, 2.4e-2)
    disk = kc.disks.Disk(3e4, 1e5, kc.disks.Swatches(), opacity=0.7)
    one, other = render_flat(camera, view, disk=disk), kc.render(camera, view, disk=disk).light
    assert other.max() > 0.3 and np.abs(one - other).mean() < 0.003


def test_far_from_the_hole_a_flat_sky_of_finite_radius_is_that_of_render():
    camera = kc.Camera(0.0, 1e7, math.radians(70), "static")
    view, radius = kc.pictures.View(60, 40, math.radians(30), forward=(0.2, 0.9, 0.3)), 1.3e7
    rng = np.random.default_rng(5)
    stars = kc.skies.StarCatalogue(rng.normal(size=(3000, 3)), np.zeros(3000), np.full(3000, 0.65))
    for sky in (kc.skies.Checkerboard(), kc.skies.StarField(stars, orientation=np.eye(3), band=0)):
        one, other = render_flat(camera, view, sky, sky_radius=radius), kc.render(camera, view, sky, sky_radius=radius)
        assert one.max() > 0.3 and np.allclose(one, other.light, atol=2e-3 * one.max())
        assert not np.allclose(one, render_flat(camera, view, sky), atol=0.1 * one.max())
    with pytest.raises(ValueError, match="Argument `sky_radius` must be larger than the radius of the camera, 1e"):
        render_flat(camera, view, sky, sky_radius=1e7)


@pytest.mark.slow
def test_the_horizon_is_not_in_the_volume():
    """Rays that fall in through a volume that reaches down to the horizon end, with finite light."""
    volume = kc.disks.Volume(0.1, 5000.0, kerr.horizon(0.6) + 1e-3, 12.0, motion="fiducial")
    found = kc.pictures.render_volume(
        CAMERA, kc.pictures.View(30, 20, math.radians(16)), volume, beaming=True, colour_shift=True
    )
    assert np.isfinite(found.light).all() and found.transmission.min() < 0.5
    falling = marched(Marching(CAMERA, volume, True, True, 0.5), np.array([[-1.0, 0.0, 0.0]]), np.zeros((1, 3, 2)))
    assert 0 < falling.transmission[0] < 0.5 and falling.steps < 80
