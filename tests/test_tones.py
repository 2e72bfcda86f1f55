"""Exposures by a picture's own light: their values, that size does not matter, and how scenes and films use them."""

import json
import math
import pickle

import numpy as np
import pytest
from command_line import run
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.scene_files.exposure import without_flashes
from kerrcaustics.scene_files.templates import film_templates, first_lines, template_path
from kerrcaustics.scenes.colour import decoded, luminance

FILM = """
hole = {spin = 0.5}
camera = {path = {kind = "expressions", radius = "40 - t", azimuth_deg = "t"}, velocity = "fiducial"}
view = {width = 64, height = 36}
sky = {kind = "checkerboard"}
film = {frames = 25, end = 24}
"""


STARS = """
hole = {spin = 0.9}
camera = {radius = 10}
view = {width = 320, height = 180}
sky = {kind = "stars"}
"""


def grey(values):
    return np.repeat(np.asarray(values, float)[..., None], 3, axis=-1)


@pytest.fixture
def scene_of(tmp_path):
    def read(text, *overrides):
        path = tmp_path / "scene.toml"
        path.write_text(text)
        return kc.SceneFile.read(path, overrides)

    return read


@pytest.mark.parametrize("unit", [1e-6, 1.0, 7e5])
def test_an_even_picture_is_nearly_white_in_any_unit(unit):
    light = grey(np.full((36, 64), unit))
    assert kc.pictures.auto_exposure(light) * unit == pytest.approx(0.9, rel=5e-4)
    for softening in (4.0, 30.0):
        picture = kc.pictures.tone_mapped(light, curve="asinh", softening=softening)
        # The screen's light is 0.7, to half a step of 255.
        assert decoded(picture / 255) == pytest.approx(0.7, abs=3e-3)


def test_a_surface_goes_by_its_brightest_hundredth():
    """A ramp from 0 to 1: a hundredth is above 0.99, a quarter of its light above sqrt(0.75)."""
    ramp = grey(np.broadcast_to(np.linspace(0, 1, 640), (360, 640)))
    assert kc.pictures.auto_exposure(ramp) == pytest.approx(0.9 / 0.99, rel=2e-3)


def test_a_small_source_on_black_goes_by_its_light():
    """A thousandth of nothing is nothing: a square of 12 x 12 of 640 x 360 pixels is still seen."""
    light = np.zeros((360, 640))
    light[100:112, 300:312] = 5.0
    exposure = kc.pictures.auto_exposure(grey(light))
    assert pytest.approx(exposure, rel=0.02) == 0.9 / 5


def test_a_single_star_on_a_caustic_changes_nothing():
    light = np.random.default_rng(4).lognormal(0, 1, (360, 640))
    brighter = light.copy()
    brighter[200, 300] = 1e7
    before, after = (kc.pictures.auto_exposure(grey(one), "asinh") for one in (light, brighter))
    assert after == pytest.approx(before, rel=0.05)


def test_without_light_the_exposure_is_one():
    for light in (np.zeros((9, 16, 3)), np.zeros((0, 3)), np.zeros(3), np.full((4, 4, 3), np.nan)):
        assert kc.pictures.auto_exposure(light) == 1.0
    assert not kc.pictures.tone_mapped(np.zeros((9, 16, 3))).any()


def test_the_printed_number_makes_the_same_picture():
    light = np.random.default_rng(4).lognormal(0, 2, (90, 160, 3))
    exposure = float(f"{kc.pictures.auto_exposure(light, 'asinh'):.4g}")
    pictures = (kc.pictures.tone_mapped(light, one, "asinh") for one in ("auto", exposure))
    assert np.array_equal(*pictures)


@pytest.mark.parametrize("curve", ["linear", "asinh"])
def test_what_is_cut_at_white_is_counted(curve):
    light = np.random.default_rng(4).lognormal(0, 2, (90, 160, 3))
    picture = kc.pictures.tone_mapped(light, 0.3, curve)
    bright = luminance(light) if curve == "asinh" else light.max(axis=-1)
    fraction = kc.pictures.clipped_fraction(light, 0.3, curve)
    assert fraction == pytest.approx((0.3 * bright > 1).mean(), abs=1e-9) and 0.01 < fraction < 0.9
    assert (picture.max(axis=-1) == 255).mean() >= fraction


def test_other_exposures_are_refused():
    for bad in ("bright", -1.0, math.inf):
        with pytest.raises(ValueError, match="Argument `exposure` must be"):
            kc.pictures.tone_mapped(np.ones((4, 4, 3)), bad)


def of_size(camera, sky, width, field, **options):
    view = kc.pictures.View.toward_hole(camera, width, width * 9 // 16, field)
    light = kc.render(camera, view, sky, quality="draft", **options).light
    return kc.pictures.auto_exposure(light, "asinh")


@pytest.mark.slow
@pytest.mark.parametrize("radius", [6.03, 60.0])
def test_stars_have_one_exposure_at_half_the_size_and_at_twice(radius):
    """Their peaks are four times as bright in pixels half as wide; the exposure changes by some percent.

    Below 640 pixels across nothing can be smoothed to that size: a preview is up to 0.4 of a stop off.
    """
    camera, sky = kc.Camera(0.9, radius), kc.skies.StarField()
    small, half, full = (of_size(camera, sky, width, 1.4) for width in (320, 640, 1280))
    assert full == pytest.approx(half, rel=0.07) and small == pytest.approx(half, rel=0.3)


@pytest.mark.slow
def test_a_disk_and_swatches_have_one_exposure_at_half_the_size():
    camera = kc.Camera(0.9, 30.0, math.radians(80), "static")
    disk = kc.disks.Disk(3.0, 14.0, kc.disks.PageThorne(6000.0))
    for sky, options in ((None, {"disk": disk, "beaming": True, "colour_shift": True}), (kc.skies.Checkerboard(), {})):
        half, full = (of_size(camera, sky, width, 1.0, **options) for width in (320, 640))
        assert full == pytest.approx(half, rel=0.02)


def test_a_star_scene_needs_no_light_table(scene_of):
    """Curve, halo and exposure come with the stars; the sky between them is dark, and few pixels are white."""
    scene = scene_of(STARS)
    light = scene.contents.light
    assert light.curve == "asinh" and light.exposure == "auto" and light.flare[0].share == 0.2
    assert light.flare[0].width == pytest.approx(180 / 240)
    rendering = scene.rendering(0, quality="draft")
    picture, exposure, clipped = scene.development(0, rendering)
    assert exposure == kc.pictures.auto_exposure(scene.light(rendering), "asinh", light.softening)
    sky = picture[rendering.visible_fraction > 0.99].max(axis=-1)
    assert np.quantile(sky, 0.5) < 60 and np.quantile(sky, 0.999) > 100 and clipped < 0.005
    bare = scene_of(STARS, "light.flare=[]", "light.curve=linear").contents.light
    assert bare.flare == () and bare.curve == "linear"


def test_skies_without_stars_have_a_linear_curve_and_no_halo(scene_of):
    light = scene_of(FILM).contents.light
    assert light.curve == "linear" and light.flare == ()


def test_a_scene_with_nothing_to_see_says_so(scene_of, tmp_path, capsys):
    text = "hole = {spin = 0.5}\ncamera = {radius = 10}\nview = {width = 32, height = 18}"
    scene = scene_of(text)
    assert len(scene.remarks) == 1 and "neither a sky nor a disk" in scene.remarks[0]
    status, words, _ = run(capsys, "render", tmp_path / "scene.toml", "--output", tmp_path / "black.png")
    assert status == 0 and scene.remarks[0] in words.splitlines()
    assert not np.asarray(Image.open(tmp_path / "black.png")).any()
    assert scene_of(FILM).remarks == ()


@pytest.mark.slow
def test_a_disk_that_is_too_dark_beside_its_sky_is_named(scene_of, tmp_path, capsys):
    scene_of(
        STARS.replace("320", "64").replace("180", "36")
        + "disk = {inner = 6, outer = 14, emission = {kind = 'black-body', peak = 6000}}"
    )
    command = ["render", tmp_path / "scene.toml", "--quality", "draft", "--output", tmp_path / "disk.png"]
    remark = "The disk, with disk.brightness = 1, is nearly black beside its sky; without that key it has 600"
    for overrides, said in (
        ((), False),
        (("--set", "disk.brightness=1"), True),
        (("--set", "disk.brightness=300"), False),
    ):
        _, words, _ = run(capsys, *command, *overrides, "--json", tmp_path / "a.json")
        remarks = json.loads((tmp_path / "a.json").read_text())["remarks"]
        assert (remark in words) == said and [each.startswith(remark) for each in remarks] == [True] * said


def test_the_exposure_is_printed_and_kept(scene_of, tmp_path, capsys):
    text = FILM.replace("film = {frames = 25, end = 24}", "")
    scene = scene_of(text)
    out = tmp_path / "board.png"
    command = ["render", tmp_path / "scene.toml", "--output", out]
    _, words, _ = run(capsys, *command, "--json", tmp_path / "a.json")
    entry = json.loads((tmp_path / "a.json").read_text())
    assert f"Exposure {entry['exposure']:.6g} (auto)" in words and "of the pixels are clipped at white" in words
    assert entry["clipped"] < 0.02 and entry["remarks"] == []
    assert Image.open(out).text["Comment"] == f"exposure {entry['exposure']:.6g}"
    given = scene_of(text, f"light.exposure={entry['exposure']}")
    assert np.array_equal(given.picture(0), np.asarray(Image.open(out)))
    assert np.array_equal(scene.picture(0), given.picture(0))
    _, words, _ = run(capsys, *command, "--set", "light.exposure=9")
    assert "--set light.exposure=auto sets it from the light" in words


@pytest.mark.slow
def test_a_film_has_its_exposures_from_nine_frames(scene_of):
    """They change smoothly, whichever process draws which frame, and are those of the nine frames themselves."""
    scene = scene_of(FILM)
    keyed = scene.with_exposures()
    values = keyed.contents.light.exposure
    assert [round(key.time / scene.step) for key in values] == [0, 3, 6, 9, 12, 15, 18, 21, 24]
    lights = [scene.light(scene.rendering(number, quality="draft")) for number in range(0, 25, 3)]
    wanted = without_flashes([kc.pictures.auto_exposure(light, "linear") for light in lights])
    assert [key.value for key in values] == wanted
    assert [scene.exposure(3 * i, light) for i, light in enumerate(lights)] == pytest.approx(wanted, rel=1e-12)
    nothing = np.zeros((2, 2, 3))
    stops = np.log2([scene.exposure(number, nothing) for number in range(25)])
    assert np.abs(np.diff(stops, 2)).max() < 0.5 * max(np.ptp(stops), 0.1)
    again = pickle.loads(pickle.dumps(keyed))
    assert [again.exposure(number, nothing) for number in (0, 7, 24)] == [
        scene.exposure(number, nothing) for number in (0, 7, 24)
    ]
    assert keyed.with_exposures() is keyed and keyed.record()["light"]["exposure"] != "auto"


def test_a_flash_of_a_star_does_not_darken_a_film():
    trend = [2.0**number for number in range(9)]
    assert without_flashes(trend) == pytest.approx(trend)
    for number in range(9):
        flash = [value / 50 if i == number else value for i, value in enumerate(trend)]
        # A neighbour's value takes its place, and an end follows its neighbour: two steps at most, and not 5.6.
        assert max(abs(np.log2(np.divide(without_flashes(flash), trend)))) <= 2 + 1e-12
    assert without_flashes([3.0, 1.0]) == [3.0, 1.0] and without_flashes([1.0, 0.01, 1.0]) == [1.0, 1.0, 1.0]


def test_exposures_at_times_are_joined_in_stops(scene_of):
    """From 1 to 1e-6 and back: the spline of the logarithms stays above zero, that of the values would not."""
    keys = [(0, 1.0), (8, 1e-6), (16, 1.0), (24, 1.0)]
    value = "[" + ", ".join(f"{{time = {time}, value = {exposure}}}" for time, exposure in keys) + "]"
    scene = scene_of(FILM, f"light.exposure={value}", "film.end=25")
    nothing = np.zeros((2, 2, 3))
    assert [scene.exposure(time, nothing) for time, _ in keys[:3]] == pytest.approx([1.0, 1e-6, 1.0])
    assert min(scene.exposure(number, nothing) for number in range(25)) > 0
    with pytest.raises(ValueError, match=r"light.exposure\[1\].value must be a positive number, but is 0"):
        scene_of(FILM, "light.exposure=[{time = 0, value = 1}, {time = 2, value = 0}]")


def test_a_dark_film_has_an_exposure(scene_of):
    assert scene_of(FILM, "sky={kind='none'}").with_exposures().contents.light.exposure == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in sorted(first_lines()) if name not in film_templates()])
def test_templates_are_neither_white_nor_black(name):
    scene = kc.SceneFile.read(template_path(name))
    scale = 320 / scene.size[0]
    picture, _, clipped = scene.development(0, scene.rendering(0, quality="draft", scale=scale), scale)
    bright = picture.max(axis=-1)
    assert clipped < 0.05 and np.quantile(bright, 0.99) > 120
