"""Point stars: catalogue, galactic axes, and the light that images of stars give."""

import math
from dataclasses import replace

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.catalogue import galactic_axes
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.star_bins import item_numbers, star_bins
from kerrcaustics.scenes.star_field import milky_way
from kerrcaustics.spacetime.sphere import from_angles, unit

CAMERA = kc.Camera(spin=0.999, radius=6.03)
STAR = (1.77, -1.07)


def one_star(theta, phi):
    catalogue = kc.skies.StarCatalogue(from_angles(theta, phi)[None], np.zeros(1), np.full(1, 0.65))
    return kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)


def received(scene):
    """Light of all pixels together: luminance times solid angle."""
    x, y = np.meshgrid(np.arange(scene.view.width), np.arange(scene.view.height))
    return (luminance(scene.light) * scene.view.solid_angle(scene.view.directions(x, y)[1])).sum()


def test_catalogue_holds_known_stars():
    stars = kc.skies.hipparcos()
    assert len(stars) == 37622
    assert np.abs(np.linalg.norm(stars.direction, axis=1) - 1).max() < 1e-12
    assert stars.magnitude.max() <= 8 and (np.diff(stars.magnitude) >= 0).all()
    # Sirius, and Polaris (HIP 11767: 37.95 and 89.26 degrees).
    assert stars.magnitude[0] == pytest.approx(-1.088, abs=1e-3)
    assert stars.direction[0] == pytest.approx(from_angles(math.radians(90 + 16.713), math.radians(101.289)), abs=1e-3)
    polaris = from_angles(math.radians(90 - 89.264), math.radians(37.95))
    nearest = np.argmax(stars.direction @ polaris)
    assert stars.direction[nearest] @ polaris > 1 - 1e-8 and stars.magnitude[nearest] < 2.5


def test_tycho_file_is_read_and_merged(tmp_path):
    fits = pytest.importorskip("astropy.io.fits")
    rng = np.random.default_rng(8)
    direction = rng.normal(size=(60, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    magnitude = rng.uniform(5, 12, 60).astype("<f4")
    # As a tree of astrometry.net holds them: bytes of low, high and scale, and whole numbers from low on.
    scale = 2.0**30
    tables = {
        "kdtree_range_stars": ("8B", np.array([-1.0, -1, -1, 1, 1, 1, scale]).view(np.uint8).reshape(-1, 8)),
        "kdtree_data_stars": ("12B", np.round((direction + 1) * scale).astype("<u4").view(np.uint8).reshape(-1, 12)),
        "MAG_VT": ("1E", magnitude),
    }
    columns = [
        fits.BinTableHDU.from_columns([fits.Column(name, form, array=values)])
        for name, (form, values) in tables.items()
    ]
    fits.HDUList([fits.PrimaryHDU(), *columns]).writeto(tmp_path / "index.fits")
    stars = kc.skies.tycho2(tmp_path / "index.fits")
    order = np.argsort(magnitude)
    assert np.abs(stars.direction - direction[order]).max() < 2e-9
    assert np.array_equal(stars.magnitude, magnitude[order].astype(float))
    half = kc.skies.StarCatalogue(direction[:30], np.zeros(30), np.ones(30))
    both = kc.skies.merged_catalogues(half, stars)
    assert len(both) == 60 and (both.magnitude == 0).sum() == 30 and (np.diff(both.magnitude) >= 0).all()
    with pytest.raises(ValueError, match="Argument `path` must name a Tycho-2 index file"):
        kc.skies.tycho2(tmp_path / "none.fits")


def test_galactic_axes_point_to_the_centre_and_the_pole():
    axes = galactic_axes()
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    centre = from_angles(math.radians(90 + 28.936), math.radians(266.405))
    assert axes @ centre == pytest.approx([1, 0, 0], abs=1e-4)
    turn = kc.skies.tilted_galaxy(0.3, 0.0, 0.0)
    assert (turn @ axes.T)[:, 2] == pytest.approx([0, -math.sin(0.3), math.cos(0.3)])
    assert (turn @ axes.T)[:, 0] == pytest.approx([1, 0, 0])


def narrow_view(sky, shift):
    """24 x 24 pixels in which a direction lies somewhere between pixels; the sky map is nearly linear over them."""
    view = kc.pictures.View(24, 24, 0.004, forward=sky)
    return kc.pictures.View(24, 24, 0.004, forward=view.directions(11.5 + shift[0], 11.5 + shift[1])[0])


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.5, 0.25), (0.3, 0.9), (0.1, 0.7)])
def test_between_pixels_no_light_is_lost(shift):
    """Far from a hole a star has the light of its magnitude, wherever it lies between pixels."""
    camera = kc.Camera(0.0, 1e7, velocity="fiducial")
    sky = np.array([0.9, -0.3, 0.3]) / np.linalg.norm([0.9, -0.3, 0.3])
    n = kc.trace_beams(camera, sky).direction
    star = one_star(np.arccos(n[2]), np.arctan2(n[1], n[0]))
    assert received(kc.render(camera, narrow_view(sky, shift), star)) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("sky", [(0.9, -0.3, 0.3), (-0.5, -0.6, 0.5), (-0.62, -0.3, -0.72), (0.2, -0.9, 0.3)])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.5, 0.25), (0.3, 0.9)])
def test_an_image_has_the_light_of_its_magnification(sky, shift):
    sky = np.array(sky) / np.linalg.norm(sky)
    beam = kc.trace_beams(CAMERA, sky)
    star = one_star(np.arccos(beam.direction[2]), np.arctan2(beam.direction[1], beam.direction[0]))
    view = narrow_view(sky, shift)
    scene = kc.render(CAMERA, view, star)
    assert received(scene) == pytest.approx(beam.magnification, rel=0.02)
    # However magnified, an image is small: nothing two and a half pixels away from it.
    y, x = np.nonzero(luminance(scene.light))
    place = view.pixels(sky)
    assert np.hypot(x - place[0], y - place[1]).max() < 2.5


@pytest.mark.slow
def test_a_moving_star_is_the_mean_of_its_moments():
    sky = np.array([0.9, -0.3, 0.3]) / np.linalg.norm([0.9, -0.3, 0.3])
    beam = kc.trace_beams(CAMERA, sky)
    star = one_star(np.arccos(beam.direction[2]), np.arctan2(beam.direction[1], beam.direction[0]))
    view = kc.pictures.trace_view(CAMERA, narrow_view(sky, (0.3, 0.1)))
    sweep = 8 * view.view.pixel
    blurred = view.show(replace(star, sweep=sweep))
    parts = (np.arange(400) + 0.5) / 400 - 0.5
    moments = [view.show(kc.skies.TurnedSky(star, float(sweep * part))).light for part in parts]
    mean = np.mean(moments, axis=0)
    assert luminance(blurred.light).max() < 0.5 * luminance(view.show(star).light).max()
    assert np.abs(blurred.light - mean).max() < 0.02 * mean.max()
    assert received(blurred) == pytest.approx(received(view.show(star)), rel=0.02)


def test_beaming_of_an_image():
    sky = np.array([-0.5, -0.6, 0.5]) / np.linalg.norm([-0.5, -0.6, 0.5])
    beam = kc.trace_beams(CAMERA, sky)
    star = one_star(np.arccos(beam.direction[2]), np.arctan2(beam.direction[1], beam.direction[0]))
    view = narrow_view(sky, (0.2, 0.1))
    plain, beamed = (received(kc.render(CAMERA, view, star, beaming=on)) for on in (False, True))
    assert beamed / plain == pytest.approx(beam.redshift**4, rel=1e-3)
    bluer = kc.render(CAMERA, view, star, colour_shift=True)
    assert received(bluer) == pytest.approx(plain, rel=1e-6)


@pytest.mark.slow
def test_all_images_of_a_star_in_a_picture():
    images = kc.star_images(CAMERA, STAR, max_index=1)
    for sky, magnification in zip(images.sky, images.magnification, strict=True):
        scene = kc.render(CAMERA, narrow_view(sky, (0.3, 0.6)), one_star(*STAR))
        assert received(scene) == pytest.approx(magnification, rel=0.03)


def test_band_lies_along_the_galactic_plane():
    longitude = np.linspace(0, 6.2, 50)
    plane, away = milky_way(from_angles(math.pi / 2 + 0.12, longitude)), milky_way(from_angles(0.3, longitude))
    assert (plane > 3 * away).all() and (away > 0).all()


def picture_of(sky):
    return kc.skies.celestial_picture(sky, 24)


def test_nebulae_are_added_to_the_stars_and_the_band():
    both = kc.skies.StarField(nebulae=kc.skies.Checkerboard())
    apart = picture_of(replace(both, nebulae=None)) + picture_of(kc.skies.Checkerboard())
    assert picture_of(both) == pytest.approx(apart, rel=1e-12)
    turned = kc.skies.TurnedSky(both, 0.4), kc.skies.TurnedSky(kc.skies.Checkerboard(), 0.4)
    rest = picture_of(kc.skies.TurnedSky(replace(both, nebulae=None), 0.4))
    assert picture_of(turned[0]) == pytest.approx(rest + picture_of(turned[1]), rel=1e-12)


def test_nebulae_turn_with_the_stars_while_a_picture_is_exposed():
    view = kc.pictures.trace_view(CAMERA, kc.pictures.View(24, 24, 0.05, forward=(0.8, -0.36, 0.48)))
    unseen = kc.skies.StarCatalogue(np.array([[0.0, 0.0, 1.0]]), np.full(1, 30.0), np.full(1, 0.65))
    fine = kc.skies.Checkerboard(rows=720, columns=720)
    sweep = 8 * view.view.pixel
    sky = kc.skies.StarField(unseen, band=0, sweep=sweep, nebulae=fine)
    blurred = view.show(fine, turn=sweep).light
    assert view.show(sky).light == pytest.approx(blurred, rel=1e-5)
    assert np.abs(blurred - view.show(fine).light).max() > 0.1 * blurred.max()


def test_a_picture_of_the_galaxy_lies_where_its_stars_are():
    """Its middle at Sgr A* (ICRS), its right at l = 270 degrees, in Vela, its upper edge at the galactic north pole."""
    stars = kc.skies.StarField()
    light = np.zeros((32, 64, 3))
    light[15:17, 31:33, 0] = light[15:17, 47:49, 1] = light[:3, :, 2] = 1
    picture = kc.skies.Panorama(light, stars.galaxy)
    icrs = [(266.405, -28.936), (137.836, -48.330), (192.859, 27.128), (86.405, 28.936)]
    alpha, delta = np.radians(icrs).T
    seen = picture.light_about(from_angles(math.pi / 2 - delta, alpha) @ stars.orientation.T, np.full(4, 0.01))
    assert seen == pytest.approx(np.concatenate([np.eye(3), np.zeros((1, 3))]), abs=0.05)


@pytest.mark.parametrize(
    "values",
    [
        {"catalogue": 3},
        {"band": -1},
        {"white": 10},
        {"orientation": np.zeros((3, 3))},
        {"sweep": -1},
        {"nebulae": 3},
        {"nebulae": kc.skies.Checkerboard},
        {"nebulae": kc.skies.StarField(band=0)},
    ],
)
def test_star_field_refuses(values):
    with pytest.raises(ValueError, match="Argument"):
        kc.skies.StarField(**values)


def test_a_catalogue_of_lists_is_rendered():
    stars = kc.skies.StarCatalogue([[0.0, 0.0, 1.0]], [2.0], [0.6])
    assert len(kc.skies.merged_catalogues(stars, stars)) == 1
    view = kc.pictures.View(4, 3, 0.2)
    assert kc.render(kc.Camera(0.5, 20.0), view, kc.skies.StarField(stars, band=0)).light.shape == (3, 4, 3)


def test_bins_hold_every_star_of_a_disc_once():
    rng = np.random.default_rng(3)
    stars, centre = (unit(rng.normal(size=(count, 3))) for count in (3000, 400))
    centre[:9] = unit(centre[:9] * [1e-3, 1e-3, 1])
    radius = 10 ** rng.uniform(-3, 0.3, 400)
    bins = star_bins(stars, np.arange(3000))
    runs = bins.runs(centre, radius, np.arange(400))
    run, number = item_numbers(runs.length)
    held = np.zeros((400, 3000), int)
    np.add.at(held, (runs.disc[run], bins.star[runs.first[run] + number]), 1)
    inside = np.linalg.norm(stars - centre[:, None], axis=2) <= radius[:, None]
    assert (held <= 1).all() and (held[inside] == 1).all()
    assert inside.sum() > 0.5 * held.sum()


def test_a_picture_within_the_shadow_is_dark():
    camera = kc.Camera(0.0, 2.2)
    view = kc.pictures.View.toward_hole(camera, 8, 6, 0.1)
    assert not kc.render(camera, view, kc.skies.StarField()).light.any()
