"""Files and names that mean no good: one line says what is wrong, at once, and nothing is read without end."""

import gzip
import os
import struct
import zlib

import pytest

import kerrcaustics as kc
from kerrcaustics.scene_files.expressions import Moment, check_names, formula

SCENE = "hole = {spin = 0.6}\ncamera = {radius = 20}\nview = {width = 64, height = 36}\n"
CHAINED = 1000
LONG = "n" * 300
IRREGULAR = "it is no regular file"


@pytest.fixture
def refused(tmp_path, assert_refused):
    """Check that a scene, with a line more, is refused when it is rendered."""

    def check(line, words):
        (tmp_path / "scene.toml").write_text(SCENE + line)
        assert_refused(("render", "scene.toml"), words)

    return check


NAMED = {
    "sky": 'sky = {kind = "panorama", file = "FILE"}',
    "stars": 'sky = {kind = "stars", tycho2 = "FILE"}',
    "texture": 'disk = {inner = 6, outer = 9, emission = {kind = "texture", file = "FILE"}}',
    "flare": 'light = {flare = [{file = "FILE"}]}',
}
CSV = 'hole = {spin = 0.6}\ncamera = {path = {kind = "csv", file = "FILE"}}\n'


@pytest.fixture
def pipe(tmp_path):
    """A pipe that nobody writes to: who opens it as other files are waits for ever."""
    os.mkfifo(tmp_path / "pipe.png")
    return "pipe.png"


@pytest.mark.parametrize("line", NAMED.values(), ids=NAMED)
def test_scenes_name_regular_files(line, pipe, refused):
    for name, reason in ((pipe, IRREGULAR), ("/dev/zero", IRREGULAR), (".", "Is a directory")):
        refused(line.replace("FILE", name), f"must name a file that can be read, but {name!r}: {reason}.")


@pytest.mark.parametrize("name", ["pipe.png", "/dev/zero"])
def test_users_name_regular_files(name, pipe, tmp_path, assert_refused):
    (tmp_path / "csv.toml").write_text(CSV.replace("FILE", name))
    assert_refused(("render", "csv.toml"), f"camera.path.file must name a file that can be read, but {name!r}:")
    for argument, command in (
        ("SCENE", ("render", name, "--output", "x.png")),
        ("FILE", ("sweep", name, "--output", "x.zarr")),
    ):
        assert_refused(command, f"Argument {argument} must name a file that can be read: {name}: {IRREGULAR}.")
    counted = ("counts", "--spin", 0.5, "--radius", 6, "--stars", name)
    assert_refused(counted, f"Argument --stars must name a file that can be read: {name}: {IRREGULAR}.")


def test_pictures_and_catalogues_are_regular_files(pipe, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.fits")
    os.mkfifo("pipe.exr")
    for name in (pipe, "pipe.fits", "pipe.exr"):
        with pytest.raises(ValueError, match=IRREGULAR):
            kc.skies.Panorama.read(name)
    with pytest.raises(ValueError, match="must name a Tycho-2 index file"):
        kc.skies.tycho2("pipe.fits")


def test_results_are_regular_files(pipe, tmp_path):
    for path in (tmp_path / pipe, "/dev/zero"):
        with pytest.raises(ValueError, match=IRREGULAR):
            kc.load(path)


def test_files_that_are_too_large_are_not_read(tmp_path, refused, assert_refused):
    """They have holes, and take no place."""
    for name, size in (("scene.toml", 20e6), ("stars.csv", 200e6), ("sky.png", 5e9)):
        with open(tmp_path / name, "wb") as file:
            file.truncate(int(size))
    assert_refused(("render", "scene.toml"), "scene.toml: it is larger than 16 MB.")
    counted = ("counts", "--spin", 0.5, "--radius", 6, "--stars", "stars.csv")
    assert_refused(counted, "stars.csv: it is larger than 100 MB.")
    refused(NAMED["sky"].replace("FILE", "sky.png"), "'sky.png': it is larger than 4000 MB.")


def test_small_files_of_huge_pictures_are_not_unpacked(tmp_path, refused):
    head = struct.pack(">II5B", 200_000, 100_000, 8, 2, 0, 0, 0)
    parts = [(b"IHDR", head), (b"IDAT", zlib.compress(bytes(1000))), (b"IEND", b"")]
    packed = [struct.pack(">I", len(x)) + kind + x + struct.pack(">I", zlib.crc32(kind + x)) for kind, x in parts]
    (tmp_path / "sky.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(packed))
    refused(NAMED["sky"].replace("FILE", "sky.png"), "sky.png': it has too many pixels.")


def test_small_files_of_huge_exr_pictures_are_not_unpacked(tmp_path, refused):
    OpenEXR = pytest.importorskip("OpenEXR", reason="OpenEXR is missing: pip install '.[exr]'")
    import numpy as np

    path = tmp_path / "sky.exr"
    with OpenEXR.File({}, {"RGB": np.zeros((4, 8, 3), np.float32)}) as file:
        file.write(str(path))
    window = b"dataWindow\0box2i\0" + struct.pack("<i", 16)
    small, huge = (window + struct.pack("<4i", 0, 0, *size) for size in ((7, 3), (199_999, 99_999)))
    assert small in path.read_bytes()
    path.write_bytes(path.read_bytes().replace(small, huge))
    refused(NAMED["sky"].replace("FILE", "sky.exr"), "sky.exr': it has too many pixels.")


def test_small_files_of_huge_fits_images_are_not_unpacked(tmp_path, refused):
    pytest.importorskip("astropy", reason="astropy is missing: pip install '.[astro]'")
    cards = ["SIMPLE  = T", "BITPIX  = -64", "NAXIS   = 2", "NAXIS1  = 200000", "NAXIS2  = 100000", "END"]
    cards = [f"{card[:10]}{card[10:]:>20}".ljust(80) if "=" in card else card.ljust(80) for card in cards]
    with gzip.open(tmp_path / "sky.fits.gz", "wb") as file:
        file.write("".join(cards).ljust(2880).encode() + bytes(2880))
    refused(NAMED["sky"].replace("FILE", "sky.fits.gz"), "sky.fits.gz': it has too many pixels.")


CAMERA = ("--spin", 0.5, "--radius", 6)
LONG_NAMES = {
    "--json": ("images", *CAMERA, "--star", 80, 10, "--json", f"{LONG}.json"),
    "--figure": ("caustics", *CAMERA, "--figure", f"{LONG}.png"),
    "--output": ("render", "scene.toml", "--output", f"{LONG}.png"),
    "a store": ("sweep", "sweep.toml", "--output", f"{LONG}.zarr"),
    "--stars": ("counts", *CAMERA, "--stars", f"{LONG}.csv"),
    "a folder": ("figures", "--output", LONG),
    "a folder in one": ("images", *CAMERA, "--star", 80, 10, "--json", f"{LONG}/images.json"),
    "a film": ("film", f"{LONG}.toml"),
    "a film's file": ("film", "descent", "--output", f"{LONG}.mp4"),
    "a scene": ("render", f"{LONG}.toml"),
    "studies": ("study", "report", LONG),
}


@pytest.mark.parametrize("command", LONG_NAMES.values(), ids=LONG_NAMES)
def test_names_that_no_file_can_have_are_refused(command, tmp_path, assert_refused):
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "sweep.toml").write_text("spin = 0.5\nradius = 6\n")
    assert_refused(command, "must ")


def test_names_that_no_file_can_have_are_bad_arguments(tmp_path):
    for name in (LONG, "n" * 250):
        with pytest.raises(ValueError, match=r"Argument `path` must name a file that can be written: .*too long"):
            kc.save(tmp_path / name, kc.Camera(0.5, 6))


def test_names_of_scenes_may_be_too_long(refused):
    refused(NAMED["sky"].replace("FILE", f"{LONG}.png"), "sky.file must name a file that can be read")


@pytest.mark.parametrize(
    ("caption", "words"),
    [
        (
            "{radius.__class__.__mro__}",
            "overlays.caption must have names in braces, as {t} or {radius:.2f}, but is '{ra",
        ),
        ("{radius[0]}", "must have names in braces"),
        ("{radius!r}", "must have names in braces"),
        ("{radius:999999999}", "must have names in braces"),
        ("{radius:.999999999f}", "must have names in braces"),
        ("{radius:{t}}", "must have names in braces"),
        ("{radius:*>9}", "must have names in braces"),
        ("{radius:d}", "must have names in braces"),
        ("{radius", "must have names in braces"),
        ("radius}", "must have names in braces"),
        ("{__class__}", "must name azimuth_deg"),
        ("r" * 501, "must be at most 500 characters long, but is 501 long"),
    ],
)
def test_captions_hold_names_and_simple_formats(caption, words, refused):
    refused(f"overlays = {{caption = '{caption}'}}", words)


def test_captions_may_be_formatted(tmp_path):
    formats = ("", ":.2f", ":8.3f", ":>+10.1e", ":,.0f", ":08.2f", ":g", ":.0%")
    caption = " ".join(f"{{radius{form}}}" for form in formats)
    (tmp_path / "scene.toml").write_text(f"{SCENE}overlays = {{caption = '{caption}'}}")
    assert kc.read_scene(tmp_path / "scene.toml").contents.overlays.caption == caption


def chained(count, last="1"):
    """Definitions, each of which needs the next one."""
    texts = [f"d{i + 1} + 1" for i in range(count - 1)] + [last]
    return {f"d{i}": formula(f"definitions.d{i}", text) for i, text in enumerate(texts)}


def test_definitions_may_need_many_others():
    formulas = chained(CHAINED)
    check_names((), formulas, ())
    assert Moment(0.0, formulas).named("d0").value == CHAINED


@pytest.mark.parametrize(("last", "name"), [("d0", "d0"), ("d999 * 2", "d999")])
def test_long_circles_of_definitions_are_refused(last, name):
    with pytest.raises(ValueError, match=f"^definitions.{name} must not depend on itself, by way of d"):
        check_names((), chained(CHAINED, last), ())


def test_too_many_definitions_are_refused(refused):
    lines = "\n".join(f"d{i} = 'd{i + 1} + 1'" for i in range(20_000))
    refused(f"[definitions]\n{lines}\nd20000 = 1\n", "definitions must be at most 1000, but is 20001.")


DEEP = {
    "keys": f"{'.'.join(['a'] * 5000)} = 1",
    "quoted keys": ".".join(['"a"'] * 5000) + " = 1",
    "tables": f"[{'.'.join(['a'] * 300)}]",
    "lists": f"a = {'[' * 300}{']' * 300}",
    "tables in tables": f"a = {'{b = ' * 200}1{'}' * 200}",
    "very many": f"a = {'[' * 50_000}",
}


@pytest.mark.parametrize("line", DEEP.values(), ids=DEEP)
def test_what_is_nested_too_deeply_is_refused(line, refused):
    refused(line, "Scene scene.toml: it is nested too deeply.")


@pytest.mark.parametrize("change", ["a." * 5000 + "b=1", f"camera.radius={'[' * 300}{']' * 300}"])
def test_changes_that_are_nested_too_deeply_are_refused(change, tmp_path, assert_refused):
    (tmp_path / "scene.toml").write_text(SCENE)
    assert_refused(("render", "scene.toml", "--set", change), "Scene scene.toml: ")


def test_sweeps_that_are_nested_too_deeply_are_refused(tmp_path, assert_refused):
    (tmp_path / "sweep.toml").write_text(f"spin = 0.5\nradius = 6\n{DEEP['keys']}\n")
    assert_refused(("sweep", "sweep.toml", "--output", "x.zarr"), "Sweep file sweep.toml: it is nested too deeply.")
