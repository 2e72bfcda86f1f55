"""Pictures in files: their depth, channels, alpha and orientation are used or refused, and little memory is needed."""

import math
import struct
import subprocess
import sys
import tracemalloc
import zlib

import numpy as np
import pytest
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.scenes import panorama
from kerrcaustics.scenes.colour import decoded
from kerrcaustics.scenes.disk.samples import DiskSamples
from kerrcaustics.scenes.light_files import read_picture

RANDOM = np.random.default_rng(8)
ROWS = 16


def png(path, width, height, depth, colours, rows=b""):
    """Write a PNG file by hand; colours: 0 grey, 2 RGB, 4 grey with alpha, 6 RGBA."""
    chunks = [b"IHDR" + struct.pack(">IIBBBBB", width, height, depth, colours, 0, 0, 0)]
    chunks += [b"IDAT" + zlib.compress(rows, 9), b"IEND"]
    parts = [struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    return path


def deep(path, values):
    """Write values (h, w, channels) of 16 bits."""
    height, width, channels = values.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in values)
    return png(path, width, height, 16, {1: 0, 2: 4, 3: 2, 4: 6}[channels], rows)


def exr(path, channels):
    module = pytest.importorskip("OpenEXR")
    header = {"compression": module.ZIP_COMPRESSION, "type": module.scanlineimage}
    module.File(header, {name: values.astype(np.float32) for name, values in channels.items()}).write(str(path))
    return path


def light_of(panorama):
    """The light that a panorama has next to the middles of its pixels."""
    theta, phi = np.meshgrid((np.arange(ROWS) + 0.5) * math.pi / ROWS, (np.arange(2 * ROWS) + 0.5) * math.pi / ROWS)
    n = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    return panorama.light_about(n, np.full(len(n), 1e-3))


def seen_on_disk(texture):
    """The light and the opacity of a disk at some places."""
    n = 50
    across, azimuth = np.linspace(0, 1, n), np.linspace(0, 6, n)
    radius, still = 6 + 4 * across, lambda radius: 0 * radius
    samples = DiskSamples(radius, azimuth, across, np.zeros((n, 2, 2)), np.ones(n), 4.0, 0.5, np.zeros(n), still)
    opacity = kc.disks.Disk(6.0, 10.0, texture).opacity_at(radius, azimuth)
    return np.column_stack([texture.light(samples, False, False), opacity])


def test_grey_pictures_of_16_bits_keep_them(tmp_path):
    values = RANDOM.integers(0, 2000, (ROWS, 2 * ROWS, 1))
    path = deep(tmp_path / "grey.png", values)
    light = np.repeat(decoded(values / 65535), 3, axis=2)
    np.testing.assert_allclose(read_picture(path), light, rtol=3e-7)
    assert light_of(kc.skies.Panorama.read(path)) == pytest.approx(light_of(kc.skies.Panorama(light)), abs=1e-9)
    scene = RANDOM.uniform(0, 1, (9, 9, 3))
    np.testing.assert_allclose(kc.pictures.with_glare(scene, path), kc.pictures.with_glare(scene, light), rtol=1e-5)


@pytest.mark.parametrize("channels", [2, 3, 4])
def test_other_pictures_of_16_bits_are_refused(tmp_path, channels):
    path = deep(tmp_path / "deep.png", RANDOM.integers(0, 65536, (ROWS, 2 * ROWS, channels)))
    for read in (kc.skies.Panorama.read, kc.disks.Texture.read):
        with pytest.raises(ValueError, match=r"^Argument `path` must .*: it has 16 bits a channel"):
            read(path)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("Y", "RY", "BY"), r"but has BY, RY, Y \(luminance and chroma\) in 1 part"),
        (
            ("diffuse.R", "diffuse.G", "diffuse.B", "glow.R"),
            "but has diffuse.B, diffuse.G, diffuse.R, glow.R in 1 part",
        ),
        (("R", "G"), "it must have R, G and B, or Y alone, in one layer, but has G, R in 1 part"),
    ],
)
def test_channels_that_are_no_light_are_named(tmp_path, names, words):
    path = exr(tmp_path / "layers.exr", {name: RANDOM.uniform(0, 1, (ROWS, 2 * ROWS)) for name in names})
    with pytest.raises(ValueError, match=rf"^Argument `path` must name a picture that can be read: .*{words}"):
        kc.skies.Panorama.read(path)


def test_channels_beside_the_light_are_left_alone(tmp_path):
    names = ("R", "G", "B", "Z", "diffuse.R")
    channels = {name: RANDOM.uniform(0, 5, (ROWS, 2 * ROWS)) for name in names}
    light = np.stack([channels[name] for name in "RGB"], axis=-1).astype(np.float32)
    assert np.array_equal(read_picture(exr(tmp_path / "more.exr", channels)), light)
    grey = RANDOM.uniform(0, 5, (ROWS, 2 * ROWS)).astype(np.float32)
    assert np.array_equal(read_picture(exr(tmp_path / "grey.exr", {"Y": grey})), np.repeat(grey[..., None], 3, axis=2))


def test_what_is_transparent_is_dark(tmp_path):
    values = RANDOM.integers(0, 256, (ROWS, 2 * ROWS, 4), dtype=np.uint8)
    Image.fromarray(values).save(tmp_path / "sky.png")
    light, alpha = decoded(values[..., :3] / 255), values[..., 3:] / 255
    np.testing.assert_allclose(read_picture(tmp_path / "sky.png"), light * alpha, atol=1e-6)
    given = kc.skies.Panorama(light * alpha)
    assert light_of(kc.skies.Panorama.read(tmp_path / "sky.png")) == pytest.approx(light_of(given), abs=1e-6)
    # In OpenEXR files light is multiplied by alpha already.
    channels = {name: (light * alpha)[..., k] for k, name in enumerate("RGB")} | {"A": alpha[..., 0]}
    path = exr(tmp_path / "sky.exr", channels)
    np.testing.assert_allclose(read_picture(path), light * alpha, rtol=1e-6)
    textures = kc.disks.Texture.read(path), kc.disks.Texture(light, alpha[..., 0])
    one, other = (seen_on_disk(texture) for texture in textures)
    np.testing.assert_allclose(one, other, atol=1e-6)
    clear = {name: np.ones((4, 8)) for name in "RGB"} | {"A": np.zeros((4, 8))}
    with pytest.raises(ValueError, match=r"^Argument `path` must name a picture without light where its alpha is 0"):
        kc.disks.Texture.read(exr(tmp_path / "glow.exr", clear))


@pytest.mark.parametrize(("tag", "turns"), [(3, 2), (6, -1), (8, 1)])
def test_photographs_are_turned_as_they_were_taken(tmp_path, tag, turns):
    values = RANDOM.integers(0, 256, (ROWS, 2 * ROWS, 3), dtype=np.uint8)
    exif = Image.Exif()
    exif[0x0112] = tag
    Image.fromarray(values).save(tmp_path / "sky.png", exif=exif)
    np.testing.assert_allclose(read_picture(tmp_path / "sky.png"), decoded(np.rot90(values, turns) / 255), atol=1e-6)
    if turns % 2:
        with pytest.raises(ValueError, match=rf"twice as wide as high, .* has {ROWS} x {2 * ROWS} pixels"):
            kc.skies.Panorama.read(tmp_path / "sky.png")


def test_the_number_of_bad_values_is_said(tmp_path):
    channels = {name: np.ones((ROWS, 2 * ROWS)) for name in "RGB"}
    channels["G"][3, 5:8] = math.nan, math.inf, -1.0
    path = exr(tmp_path / "bad.exr", channels)
    for read in (kc.skies.Panorama.read, kc.disks.Texture.read):
        with pytest.raises(ValueError, match=r"^Argument `path` must .*, but '.*bad.exr' has 3 values of NaN, inf"):
            read(path)
    light = np.stack(list(channels.values()), axis=-1)
    with pytest.raises(ValueError, match=r"^Argument `light` must hold .*, but 3 of 1536 are not\.$"):
        kc.skies.Panorama(light)


def test_too_large_pictures_are_refused_by_their_headers(tmp_path):
    """These files have no pixels."""
    for width, height, words in ((40000, 20000, "too many pixels"), (16400, 8200, "of 4 to 8192 rows, but")):
        with pytest.raises(ValueError, match=rf"^Argument `path` must .*{words}"):
            kc.skies.Panorama.read(png(tmp_path / "large.png", width, height, 8, 2))
    with pytest.raises(ValueError, match=r"^Argument `path` must .* at most 8192 rows and columns, but"):
        kc.disks.Texture.read(png(tmp_path / "large.png", 9000, 10, 8, 2))


def test_other_endings_say_what_to_do():
    for name in ("sky.tif", "sky.webp"):
        with pytest.raises(ValueError, match=r"^Argument `path` must end in .*, but is 'sky.* can be converted"):
            kc.skies.Panorama.read(name)


def test_a_healpix_table_says_where_it_belongs(tmp_path):
    fits = pytest.importorskip("astropy.io.fits")
    table = fits.BinTableHDU.from_columns([fits.Column("T", "E", array=np.ones(12))])
    table.header["PIXTYPE"] = "HEALPIX"
    table.writeto(tmp_path / "map.fits")
    with pytest.raises(ValueError, match=r"a FITS file with an image, but .* has none: it is a HEALPix table"):
        kc.skies.Panorama.read(tmp_path / "map.fits")


def flat(path, rows, colours):
    """A picture of one colour, whose file is small."""
    row = b"\0" + bytes(colours) * (2 * rows)
    return png(path, 2 * rows, rows, 8, 2, row * rows)


@pytest.mark.slow
def test_reading_a_sky_needs_little_memory_beside_it_and_reports_progress(tmp_path):
    path, heard = flat(tmp_path / "sky.png", 2048, (90, 90, 90)), []
    tracemalloc.start()
    try:
        sky = kc.skies.Panorama.read(path, progress=lambda what, part: heard.append((what, part)))
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert sky.rows == 2048
    # The levels of one channel in single precision, and blocks of a million pixels.
    assert most < 4 / 3 * 4 * 2 * 2048**2 + 120e6
    parts = [part for what, part in heard if what == "picture of the sky"]
    assert len(set(parts)) > 4 and parts == sorted(parts) and heard[-1][1] == 1


def test_large_skies_of_8_bits_are_held_in_half_precision(tmp_path, monkeypatch):
    path, rng = tmp_path / "sky.png", np.random.default_rng(5)
    Image.fromarray(rng.integers(0, 256, (128, 256, 3), np.uint8)).save(path)
    way, size = rng.normal(size=(2000, 3)), 10 ** rng.uniform(-3, 0, 2000)

    def light(brightness, large):
        monkeypatch.setattr(panorama, "LARGE", large)
        return kc.skies.Panorama.read(path, brightness=brightness).light_about(way, size)

    for brightness in (0.1, 1.0, 1e4):
        half, exact = light(brightness, 128), light(brightness, 256)
        assert not np.array_equal(half, exact)
        np.testing.assert_allclose(half, exact, rtol=1e-3, atol=1e-7 * brightness)
    # Beyond the range of half precision.
    assert np.isfinite(light(1e8, 128)).all()


# The largest memory of the program itself, kB: what getrusage says begins with that of the parent.
PROGRAM = """
import re, sys
import kerrcaustics as kc
kc.skies.Panorama.read(sys.argv[1])
print(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the largest memory is asked of Linux")
@pytest.mark.slow
@pytest.mark.parametrize(("colours", "most"), [((90, 90, 90), 1.1), ((90, 80, 70), 1.8)])
def test_the_largest_skies(tmp_path, colours, most):
    """Skies of 16384 x 8192 pixels; levels in half precision take 0.36 GB a channel."""
    path = flat(tmp_path / "sky.png", 8192, colours)
    done = subprocess.run([sys.executable, "-c", PROGRAM, str(path)], capture_output=True, text=True, check=True)
    assert 1.024e-6 * float(done.stdout) < most, done.stdout
