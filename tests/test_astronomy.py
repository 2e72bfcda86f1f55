"""Units, FITS and HEALPix: what astronomers' own packages say of them. Those that need these packages skip without."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import run

import kerrcaustics as kc
from kerrcaustics.images.counts import CountMap
from kerrcaustics.spacetime.sphere import from_angles

RESULTS = (Path(__file__).parents[1] / "docs" / "results.md").read_text(encoding="utf-8")
# Mass in solar masses, distance in parsec; GM/c^3 and GM/(c^2 D) worked out by hand from the constants.
HOLES = {"Sgr A*": (4.3e6, 8180.0), "M87*": (6.5e9, 16.8e6)}
# Odd, so that few centres of HEALPix pixels lie on edges of cells.
ROWS = 11


@pytest.fixture
def fits():
    return pytest.importorskip("astropy.io.fits", reason="astropy is not installed")


@pytest.fixture
def healpy():
    return pytest.importorskip("astropy_healpix.healpy", reason="astropy-healpix is not installed")


def made_map(radius=math.inf, viewer=None):
    theta, phi = (np.arange(ROWS) + 0.5) * math.pi / ROWS, (np.arange(2 * ROWS) + 0.5) * math.pi / ROWS
    counts = np.random.default_rng(1).integers(0, 9, (ROWS, 2 * ROWS, 3))
    viewer = viewer or kc.Camera(0.1 + 0.2, 7.7, 1.1, (0.1, -0.2, 0.3))
    surface = kc.CelestialSphere() if radius == math.inf else kc.Sphere(radius)
    return CountMap(viewer, surface, theta, phi, counts, counts[..., 0] > 6, np.zeros(counts.shape[:2], bool))


def made_light(rows=32):
    theta, phi = (np.arange(rows) + 0.5) * math.pi / rows, (np.arange(2 * rows) + 0.5) * math.pi / rows
    x, y, z = from_angles(theta[:, None], phi).transpose(2, 0, 1)
    return np.stack([2 + x, 2 + y * z, 1 + z**2], axis=-1).astype(np.float32)


@pytest.mark.parametrize("name", HOLES)
def test_scales_of_known_holes_are_those_of_the_page(name):
    scale = kc.PhysicalScale(*HOLES[name])
    row = next(line for line in RESULTS.splitlines() if line.startswith(f"| {name}"))
    _, _, mass, distance, seconds, units, angle, _ = (cell.strip() for cell in row.split("|"))
    assert (float(mass), float(distance)) == HOLES[name]
    assert float(seconds) == float(f"{scale.seconds:.4g}")
    assert float(units) == float(f"{scale.astronomical_units:.4g}")
    assert float(angle) == float(f"{scale.microarcseconds:.4g}")


def test_one_solar_mass_at_one_parsec_by_hand():
    scale = kc.PhysicalScale(mass=1, distance=1)
    # GM/c^3 of the Sun is 4.925490947 us (Lorimer & Kramer's Handbook and many others), GM/c^2 1.476625 km.
    assert scale.seconds == pytest.approx(4.925490947e-6, rel=2e-10)
    assert scale.metres == pytest.approx(1476.625, rel=1e-7)
    # By the definition of the parsec one au is one second of arc there.
    assert scale.microarcseconds == pytest.approx(1e6 * scale.astronomical_units, rel=1e-15)
    assert kc.PhysicalScale(10.0).seconds == pytest.approx(10 * scale.seconds, rel=1e-15)


@pytest.mark.parametrize("wrong", [-4.3e6, 0, math.nan, math.inf, "much", True, [1.0, 2.0], None])
def test_what_no_mass_can_be_is_refused(wrong):
    with pytest.raises(ValueError, match=r"^Argument `mass` must be a positive, finite number of solar masses, but "):
        kc.PhysicalScale(wrong)


def test_what_no_distance_can_be_is_refused():
    with pytest.raises(ValueError, match=r"^Argument `distance` must be a positive, finite number of parsec, but is 0"):
        kc.PhysicalScale(1.0, 0)
    with pytest.raises(ValueError, match="Argument `distance` must be given"):
        _ = kc.PhysicalScale(1.0).microarcseconds
    with pytest.raises(ValueError, match="Argument `kind` must be one of time, length, angle, but is 'mass'"):
        kc.PhysicalScale(1.0).quantity("mass")


def test_quantities_of_astropy_come_in_and_go_out():
    units = pytest.importorskip("astropy.units", reason="astropy is not installed")
    constants = pytest.importorskip("astropy.constants", reason="astropy is not installed")
    plain, given = kc.PhysicalScale(4.3e6, 8180.0), kc.PhysicalScale(4.3e6 * units.Msun, 8.18 * units.kpc)
    assert (given.mass, given.distance) == pytest.approx((plain.mass, plain.distance), rel=1e-15)
    time = (constants.GM_sun * 4.3e6 / constants.c**3).to("s")
    assert abs(plain.quantity("time") / time - 1) < 1e-15
    angle = (constants.GM_sun * 4.3e6 / constants.c**2 / (8.18 * units.kpc)).to("uarcsec", units.dimensionless_angles())
    assert np.all(abs(plain.quantity("angle", [1.0, 2.0]) / angle - [1, 2]) < 1e-14)
    assert plain.quantity("length").to_value("au") == pytest.approx(plain.astronomical_units, rel=1e-15)
    with pytest.raises(ValueError, match="Argument `mass` must be a positive, finite number of solar masses, but is 3"):
        kc.PhysicalScale(3 * units.s)


@pytest.mark.parametrize("radius", [math.inf, 20.0])
def test_a_count_map_comes_back_from_fits(fits, tmp_path, radius):
    counts = made_map(radius)
    counts.to_fits(tmp_path / "counts.fits")
    assert kc.load(tmp_path / "counts.fits") == counts


def test_a_map_of_an_observer_comes_back_and_one_over_the_plane_is_refused(fits, tmp_path):
    counts = made_map(viewer=kc.Observer(spin=0.5, inclination=1.0))
    counts.to_fits(tmp_path / "counts.fits")
    assert kc.load(tmp_path / "counts.fits") == counts
    with pytest.raises(ValueError, match="must be a map over a sphere, but is one over crossing 1"):
        replace(counts, surface=kc.EquatorialPlane(1)).to_fits(tmp_path / "plane.fits")


def test_pixels_of_fits_lie_where_the_header_says(fits, tmp_path):
    from astropy.wcs import WCS

    counts = made_map()
    counts.to_fits(tmp_path / "counts.fits")
    with fits.open(tmp_path / "counts.fits") as units:
        units.verify("exception")
        for unit in units:
            wcs = WCS(unit.header).celestial
            assert list(wcs.wcs.ctype) == ["KLON-CAR", "KLAT-CAR"]
            longitude, latitude = np.degrees(counts.phi), 90 - np.degrees(counts.level)
            places = np.stack(np.meshgrid(longitude, latitude), axis=-1).reshape(-1, 2)
            x, y = np.rint(wcs.wcs_world2pix(places, 0)).astype(int).T
            assert np.allclose(wcs.wcs_pix2world(np.stack([x, y], axis=-1), 0), places, rtol=0, atol=1e-12)
            true = counts.counts.transpose(2, 0, 1) if unit.data.ndim == 3 else counts.on_caustic
            assert np.array_equal(unit.data[..., y, x].reshape(true.shape), true)


@pytest.mark.parametrize(("name", "start"), [("sky.fits", b"SIMPLE"), ("sky.fits.gz", b"\x1f\x8b")])
def test_a_sky_comes_back_from_fits(fits, tmp_path, name, start):
    light, n = made_light(), from_angles(np.linspace(0, math.pi, 50), np.linspace(0, 6.2, 50))
    kc.skies.save_sky(tmp_path / name, light)
    assert (tmp_path / name).read_bytes().startswith(start)
    read, size = kc.skies.Panorama.read(tmp_path / name), np.full(50, 0.1)
    assert np.array_equal(read.light_about(n, size), kc.skies.Panorama(light).light_about(n, size))


@pytest.mark.parametrize(("wide", "high"), [(180, 90), (181, 91), (180, 91)], ids=["cells", "nodes", "nodes once"])
def test_skies_of_others_are_read_where_their_header_says(fits, tmp_path, wide, high):
    """Longitude to the left and the centre of the frame in the middle, as maps of the Galaxy are; one plane is grey."""
    step, middle = 2.0, 90.0 if high == 91 else 89.5
    longitude = step * (middle - np.arange(wide))
    latitude = step * np.arange(high) - (high - 1) / 2 * step
    n = from_angles(np.radians(90 - latitude)[:, None], np.radians(longitude))
    cards = {"CTYPE1": "GLON-CAR", "CRPIX1": middle + 1, "CDELT1": -step, "CRVAL1": 0.0}
    cards |= {"CTYPE2": "GLAT-CAR", "CRPIX2": (high + 1) / 2, "CDELT2": step, "CRVAL2": 0.0}
    unit = fits.PrimaryHDU(2 + n[..., 0] + 0.5 * n[..., 1])
    unit.header.update(cards)
    unit.writeto(tmp_path / "galaxy.fits")
    at = from_angles(np.linspace(0.2, 2.9, 200), np.linspace(-7, 7, 200))
    seen = kc.skies.Panorama.read(tmp_path / "galaxy.fits").light_about(at, np.full(200, 1e-3))
    # Linear between pixels, twice, and smoothed by at most half a pixel: three of (step)^2 / 8 times the values' 1.2.
    assert seen == pytest.approx(np.repeat((2 + at[:, 0] + 0.5 * at[:, 1])[:, None], 3, axis=1), abs=1e-3)


def test_what_is_no_whole_sky_is_refused(fits, tmp_path):
    (tmp_path / "text.fits").write_text("no picture")
    fits.PrimaryHDU(np.zeros((8, 16))).writeto(tmp_path / "no_wcs.fits")
    fits.PrimaryHDU().writeto(tmp_path / "empty.fits")
    made_map().to_fits(tmp_path / "part.fits")
    with fits.open(tmp_path / "part.fits", mode="update") as units:
        units[0].header["CDELT1"] = 1.0
    kc.skies.save_sky(tmp_path / "sky.fits", made_light())
    for name in ("text", "no_wcs", "empty", "part", "none"):
        with pytest.raises(ValueError, match=r"^Argument `path` must name [^\n]*$"):
            kc.skies.Panorama.read(tmp_path / f"{name}.fits")
    for name in ("text", "no_wcs", "sky", "none"):
        with pytest.raises(ValueError, match=r"^Argument `path` must name [^\n]*$"):
            kc.load(tmp_path / f"{name}.fits")
    with pytest.raises(ValueError, match="Argument `light` must have shape"):
        kc.skies.save_sky(tmp_path / "none.fits", np.zeros((8, 8, 3)))


@pytest.mark.parametrize("order", ["ring", "nested"])
def test_counts_in_healpix_are_those_of_the_cells(healpy, order):
    counts = made_map()
    found = counts.to_healpix(8, order)
    assert found.shape == (3, 768)
    centre = from_angles(counts.level[:, None], counts.phi).reshape(-1, 3)
    places = np.stack(healpy.pix2vec(8, np.arange(768), nest=order == "nested"), axis=-1)
    # The slow twin: the nearest centre, in angle of longitude and latitude, which is that of the cell.
    theta, phi = healpy.pix2ang(8, np.arange(768), nest=order == "nested")
    i = np.abs(theta[:, None] - counts.level).argmin(axis=1)
    j = np.abs((phi[:, None] - counts.phi + math.pi) % (2 * math.pi) - math.pi).argmin(axis=1)
    edge = np.abs(phi / math.pi * ROWS - np.rint(phi / math.pi * ROWS)) < 1e-9
    edge |= np.abs(theta / math.pi * ROWS - np.rint(theta / math.pi * ROWS)) < 1e-9
    assert np.array_equal(found.T[~edge], counts.counts[i, j][~edge]) and edge.mean() < 0.2
    assert (np.einsum("pk,pk->p", places, centre.reshape(ROWS, 2 * ROWS, 3)[i, j]) > math.cos(math.pi / ROWS)).all()


@pytest.mark.parametrize("order", ["ring", "nested"])
def test_a_sky_goes_to_healpix_and_back(healpy, order):
    sky = kc.skies.Panorama(made_light(128), mirror=True)
    values = sky.to_healpix(32, order)
    theta, phi = healpy.pix2ang(32, np.arange(12 * 32**2), nest=order == "nested")
    x, y, z = from_angles(theta, phi).T
    wanted = np.stack([2 + x, 2 + y * z, 1 + z**2])
    pixel = math.sqrt(math.pi / 3) / 32
    # Harmonics of degree 2 shrink by 6 (pixel/2)^2 / 2; next to the poles a panorama smooths more (docs/scenes.md).
    inner = np.sin(theta) > 3 * pixel
    assert values[:, inner] == pytest.approx(wanted[:, inner], abs=2 * pixel**2)
    assert values == pytest.approx(wanted, abs=0.3 * pixel)
    back = kc.skies.Panorama.from_healpix(values, order)
    n = from_angles(np.linspace(0.1, 3.0, 300), np.linspace(0, 20, 300))
    assert back.rows == 128 and back.light_about(n, np.full(300, 1e-3)) == pytest.approx(
        sky.light_about(n, np.full(300, 1e-3)), abs=4 * pixel**2
    )
    grey = kc.skies.Panorama.from_healpix(np.full(48, 0.3), order, rows=8)
    assert grey.rows == 8 and grey.light_about(n, np.full(300, 0.1)) == pytest.approx(0.3, abs=1e-6)


def test_what_is_no_healpix_is_refused(healpy):
    with pytest.raises(ValueError, match="Argument `nside` must be a power of two, but is 12"):
        made_map().to_healpix(12)
    with pytest.raises(ValueError, match="Argument `order` must be 'ring' or 'nested', but is 'nest'"):
        made_map().to_healpix(4, "nest")
    for values in (np.ones(11), np.ones((2, 48)), np.ones((2, 2, 48)), 3.0, "map"):
        with pytest.raises(ValueError, match="Argument `values` must"):
            kc.skies.Panorama.from_healpix(values)


@pytest.mark.parametrize("call", ["to_fits('x.fits')", "to_healpix(4)"])
def test_missing_packages_are_reported_by_name(call):
    code = (
        "import sys; sys.modules.update({'astropy': None, 'astropy_healpix': None})\n"
        "import numpy as np, kerrcaustics as kc; from kerrcaustics.images.counts import CountMap\n"
        "a, b, at = np.zeros(1), np.zeros((4, 8), bool), (kc.Camera(0.5, 10), kc.CelestialSphere())\n"
        "m = CountMap(*at, a, a, np.zeros((4, 8, 1), int), b, b)\n"
        f"try: m.{call}\nexcept ImportError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install '.[astro]'" in done.stdout


def test_the_command_says_the_scale(capsys):
    status, out, _ = run(capsys, "scale", "--mass", "4.3e6", "--distance", 8180, "--json", "-")
    found, scale = json.loads(out), kc.PhysicalScale(4.3e6, 8180.0)
    assert status == 0 and found["schema"] == "kerrcaustics/scale/1"
    assert (found["seconds"], found["microarcseconds"]) == (scale.seconds, scale.microarcseconds)
    status, out, _ = run(capsys, "scale", "--mass", 1)
    assert status == 0 and "4.92549e-06 seconds, 1476.63 metres" in out and "arcseconds" not in out


@pytest.mark.parametrize(("mass", "distance", "wrong"), [("-4e6", "1", "mass"), ("1", "0", "distance")])
def test_the_command_refuses_in_one_line(capsys, mass, distance, wrong):
    status, out, err = run(capsys, "scale", f"--mass={mass}", f"--distance={distance}")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert f"Argument --{wrong} must be a positive, finite number" in err
