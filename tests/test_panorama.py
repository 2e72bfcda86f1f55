"""Equirectangular pictures as the celestial sphere: values, seam, poles, coarse look-ups, files."""

import math

import numpy as np
import pytest
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.scenes.colour import decoded
from kerrcaustics.spacetime.sphere import from_angles

ROWS = 128


def directions_of(rows):
    theta = (np.arange(rows) + 0.5) * math.pi / rows
    return from_angles(theta[:, None], (np.arange(2 * rows) + 0.5) * math.pi / rows)


def smooth_light(n):
    return np.stack([2 + n[..., 0], 2 + n[..., 1] * n[..., 2], 1 + n[..., 2] ** 2], axis=-1)


@pytest.fixture(scope="module")
def smooth():
    return kc.skies.Panorama(smooth_light(directions_of(ROWS)), mirror=True)


def round_footprints(direction, size):
    n = len(direction)
    return kc.skies.Footprint(direction, size * np.tile(np.eye(2), (n, 1, 1)), np.zeros(n), np.ones(n))


@pytest.fixture(scope="module")
def anywhere():
    n = np.random.default_rng(5).normal(size=(4000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    near_poles = from_angles(np.array([1e-9, 1e-3, 0.02, math.pi - 1e-3]), np.array([0.3, 5.0, 2.0, 3.0]))
    return np.concatenate([n, near_poles])


@pytest.mark.parametrize("size", [1e-4, 0.02, 0.3])
def test_a_constant_picture_is_constant(anywhere, size):
    panorama = kc.skies.Panorama(np.full((64, 128, 3), 0.7))
    assert panorama.light(round_footprints(anywhere, size), False, False) == pytest.approx(0.7, abs=2e-6)


def test_a_smooth_picture_has_its_values_at_poles_and_seam_too(smooth, anywhere):
    pixel = math.pi / ROWS
    seen = smooth.light(round_footprints(anywhere, 1e-4), False, False)
    wrong = np.abs(seen - smooth_light(anywhere)).max(axis=1)
    inner = np.abs(anywhere[:, 2]) < math.cos(3 * pixel)
    # Second derivatives of at most 4, and deviations of half a pixel; next to a pole a row turns round within a pixel.
    assert wrong[inner].max() < 0.5 * pixel**2 * 4
    assert wrong.max() < 0.3 * pixel


@pytest.mark.parametrize("size", [0.05, 0.2])
def test_a_wide_look_up_averages_over_a_gaussian(smooth, anywhere, size):
    # On a sphere harmonics of degree l shrink by exp(-l (l + 1) sigma^2 / 2), with sigma half of the size.
    shrink = [math.exp(-degree * (degree + 1) * size**2 / 8) for degree in (1, 2)]
    n = anywhere
    wanted = np.stack(
        [2 + shrink[0] * n[:, 0], 2 + shrink[1] * n[:, 1] * n[:, 2], 4 / 3 + shrink[1] * (n[:, 2] ** 2 - 1 / 3)],
        axis=-1,
    )
    seen = smooth.light(round_footprints(n, size), False, False)
    wrong = np.abs(seen - wanted).max(axis=1)
    inner = np.hypot(n[:, 0], n[:, 1]) > 3 * size
    assert wrong[inner].max() < 0.35 * size**2 + 2 * (math.pi / ROWS) ** 2
    assert wrong.max() < 0.2 * size


def test_no_light_is_negative(anywhere):
    light = np.random.default_rng(4).random((64, 128, 3)) ** 9
    light[:, ::3] = 0
    assert kc.skies.Panorama(light).light(round_footprints(anywhere, 0.02), False, False).min() >= 0


def test_a_turned_picture(smooth, anywhere):
    c, s = math.cos(0.7), math.sin(0.7)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    turned = kc.skies.Panorama(smooth_light(directions_of(ROWS)), orientation=turn, mirror=True)
    there = turned.light(round_footprints(anywhere @ turn.T, 0.01), False, False)
    assert there == pytest.approx(smooth.light(round_footprints(anywhere, 0.01), False, False), abs=1e-5)


@pytest.mark.parametrize("theta", [1.5, 0.3, 0.02])
def test_fine_stripes_do_not_alias(theta):
    # Meridians of the finest kind: any footprint of two stripes or more on the sphere sees grey.
    stripes = np.zeros((ROWS, 2 * ROWS, 3))
    stripes[:, ::2] = 1
    panorama = kc.skies.Panorama(stripes)
    n = from_angles(theta, np.linspace(0, 0.3, 500))
    assert panorama.light(round_footprints(n, 4 * math.pi / ROWS), False, False) == pytest.approx(0.5, abs=0.01)


def test_a_long_footprint_sees_along_its_major_axis_only():
    # A bright band at the equator, 12 rows wide: footprints along it see it whole, those across it a part.
    band = np.zeros((ROWS, 2 * ROWS, 3))
    band[ROWS // 2 - 6 : ROWS // 2 + 6] = 1
    panorama = kc.skies.Panorama(band)
    n = from_angles(np.full(1, math.pi / 2), np.ones(1))
    along, across = (np.diag(axes)[None] for axes in ((0.02, 0.9), (0.9, 0.02)))
    ones = np.ones(1)
    assert panorama.light(kc.skies.Footprint(n, along, 0 * ones, ones), False, False)[0, 0] > 0.95
    thickness = 12 * math.pi / ROWS
    # Twice the deviation of the Gaussian is the axis: the middle of a normal distribution, cut at two deviations.
    wanted = math.erf(thickness / 2 / 0.45 / math.sqrt(2)) / math.erf(math.sqrt(2))
    assert panorama.light(kc.skies.Footprint(n, across, 0 * ones, ones), False, False)[0, 0] == pytest.approx(
        wanted, abs=0.04
    )


def test_a_picture_file(tmp_path):
    values = np.random.default_rng(3).integers(0, 256, (16, 32, 3), dtype=np.uint8)
    Image.fromarray(values).save(tmp_path / "sky.png")
    seen = kc.skies.Panorama.read(tmp_path / "sky.png")
    given = kc.skies.Panorama(decoded(values / 255))
    n = directions_of(16).reshape(-1, 3)
    assert seen.light_about(n, np.full(len(n), 1e-3)) == pytest.approx(
        given.light_about(n, np.full(len(n), 1e-3)), abs=1e-6
    )


def test_an_openexr_file_is_linear(tmp_path):
    exr = pytest.importorskip("OpenEXR")
    light = np.random.default_rng(3).uniform(0, 5, (16, 32, 3)).astype(np.float32)
    exr.File({"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}, {"RGB": light}).write(
        str(tmp_path / "sky.exr")
    )
    direction, size = from_angles([0.4, 1.2, 2.7], [0.1, 3.0, 6.2]), np.full(3, 0.01)
    read = kc.skies.Panorama.read(tmp_path / "sky.exr")
    assert np.array_equal(read.light_about(direction, size), kc.skies.Panorama(light).light_about(direction, size))
    (tmp_path / "text.exr").write_text("no picture")
    with pytest.raises(ValueError, match="Argument `path` must name a picture that can be read"):
        kc.skies.Panorama.read(tmp_path / "text.exr")


def test_refusals(tmp_path):
    for light in (np.zeros((16, 16, 3)), np.zeros((2, 4, 3)), -np.ones((8, 16, 3)), np.full((8, 16, 3), np.nan)):
        with pytest.raises(ValueError, match="Argument `light` must"):
            kc.skies.Panorama(light)
    with pytest.raises(ValueError, match="Argument `orientation` must"):
        kc.skies.Panorama(np.zeros((8, 16, 3)), np.ones((3, 3)))
    Image.fromarray(np.zeros((8, 8, 3), np.uint8)).save(tmp_path / "square.png")
    (tmp_path / "text.png").write_text("no picture")
    for name in ("square.png", "text.png", "none.png", "none.exr", "sky.tif"):
        with pytest.raises(ValueError, match="Argument `path` must"):
            kc.skies.Panorama.read(tmp_path / name)


# Digits that no mirror and no half turn takes to themselves or to each other, 5 x 7 dots.
DIGITS = """
####. .#### #...# .###.
....# #.... #...# #....
....# #.... #...# #....
.###. ####. ##### ####.
#.... ....# ....# #...#
#.... ....# ....# #...#
##### ####. ....# .###.
"""
DOTS = np.array([[c == "#" for c in row.replace(" ", ".")] for row in DIGITS.split("\n")[1:-1]])
FIELD, PIXELS = 60.0, 240


def with_digits(rows=256):
    """A black picture of the whole sky with the digits in its middle, 2 degrees a dot."""
    size = round(2 * rows / 180)
    dots = np.kron(DOTS, np.ones((size, size)))
    light = np.zeros((rows, 2 * rows))
    top, left = rows // 2 - len(dots) // 2, rows - dots.shape[1] // 2
    light[top : top + len(dots), left : left + dots.shape[1]] = dots
    return np.repeat(light[..., None], 3, axis=2)


def read_off(light, right=0.0, up=0.0, roll=0.0):
    """Dots of the digits on a picture of 60 degrees, those in its middle moved and turned clockwise by degrees."""
    y, x = np.mgrid[0:7, 0 : DOTS.shape[1]] + 0.0
    # A dot of 3 rows of 256.
    pixels = 3 * 180 / 256 * PIXELS / FIELD
    place = ((x - (DOTS.shape[1] - 1) / 2) + 1j * (y - 3)) * pixels * np.exp(1j * math.radians(roll))
    column = (PIXELS - 1) / 2 + place.real + right * PIXELS / FIELD
    row = (PIXELS - 1) / 2 + place.imag - up * PIXELS / FIELD
    return light[np.rint(row).astype(int), np.rint(column).astype(int)].mean(axis=-1) > 0.5


@pytest.fixture(scope="module")
def far():
    """A camera so far from a hole without spin that nothing is bent, and what it sees behind the hole."""
    camera = kc.Camera(spin=0.0, radius=1e8, velocity="static")
    view = kc.pictures.View(PIXELS, PIXELS, math.radians(FIELD), "equirectangular")
    return kc.pictures.trace_view(camera, view, quality="draft")


def test_digits_read_as_on_the_photograph(far):
    seen = read_off(far.show(kc.skies.Panorama(with_digits())).light)
    assert np.array_equal(seen, DOTS)
    others = [DOTS[:, ::-1], DOTS[::-1], DOTS[::-1, ::-1]]
    assert min((seen != other).sum() for other in others) > 20


def test_a_chart_and_a_mirrored_photograph_are_one(far):
    light = far.show(kc.skies.Panorama(with_digits(), mirror=True)).light
    assert np.array_equal(read_off(light), DOTS[:, ::-1])
    chart = kc.skies.Panorama(with_digits()[:, ::-1], mirror=True)
    assert np.array_equal(read_off(far.show(chart).light), DOTS)


@pytest.mark.parametrize("mirror", [False, True])
def test_a_picture_is_turned_to_the_right_and_up_and_clockwise(far, mirror):
    """The place 5 degrees to the right and 6 up comes into the middle: digits move to the left and down."""
    dots = DOTS[:, ::-1] if mirror else DOTS
    for angles, moved in [(5.0, (-5, 0, 0)), ((0, 6, 0), (0, -6, 0)), ((0, 0, 12), (0, 0, 12))]:
        sky = kc.skies.Panorama(with_digits(), np.radians(angles), mirror=mirror)
        right, up, roll = moved
        # On the picture of a chart its right is the left.
        assert np.array_equal(read_off(far.show(sky).light, -right if mirror else right, up, roll), dots), angles


def test_three_angles_bring_a_place_into_the_middle():
    right, up, roll = 0.4, 0.3, 0.2
    turn = kc.skies.Panorama(np.ones((8, 16, 3)), (right, up, roll)).orientation
    place = from_angles(math.pi / 2 - up, math.pi - right)
    assert turn @ place == pytest.approx([-1, 0, 0], abs=1e-15)
    # North of it is turned clockwise, to +y, which is to the right for who looks along -x.
    north = turn @ from_angles(math.pi / 2 - up - math.pi / 2, math.pi - right)
    assert north == pytest.approx([0, math.sin(roll), math.cos(roll)], abs=1e-15)


@pytest.mark.parametrize("mirror", [False, True])
def test_a_picture_of_a_sky_is_that_sky(mirror, anywhere):
    sky = kc.skies.Panorama(smooth_light(directions_of(ROWS)))
    again = kc.skies.Panorama(kc.skies.celestial_picture(sky, ROWS, mirror=mirror), mirror=mirror)
    inner = anywhere[np.hypot(anywhere[:, 0], anywhere[:, 1]) > 0.1]
    size = np.full(len(inner), 0.1)
    assert again.light_about(inner, size) == pytest.approx(sky.light_about(inner, size), abs=1e-3)


def test_digits_of_a_scene_file(tmp_path):
    Image.fromarray((255 * with_digits()).astype(np.uint8)).save(tmp_path / "sky.png")
    text = """
        hole = {spin = 0}
        camera = {radius = 1e8, velocity = "static"}
        view = {width = 240, height = 240, field_of_view_deg = 60, projection = "equirectangular"}
        sky = {kind = "panorama", file = "sky.png"}
    """
    (tmp_path / "scene.toml").write_text(text)
    for overrides, where, dots in [
        ([], {}, DOTS),
        (["sky.mirror=true"], {}, DOTS[:, ::-1]),
        (["sky.orientation_deg=5"], {"right": -5}, DOTS),
        (["sky.orientation_deg=[0, 6, 0]"], {"up": -6}, DOTS),
    ]:
        scene = kc.SceneFile.read(tmp_path / "scene.toml", overrides)
        assert np.array_equal(read_off(scene.rendering(0, quality="draft").light, **where), dots), overrides
    with pytest.raises(ValueError, match=r"sky.orientation_deg"):
        kc.SceneFile.read(tmp_path / "scene.toml", ["sky.orientation_deg=[1, 2]"])
