"""The light of stars in pictures: that of all their images, wherever these lie, at any resolution."""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.lens_map.sky_chart import edge_size
from kerrcaustics.scenes.colour import luminance
from kerrcaustics.scenes.points import PointLights
from kerrcaustics.scenes.unresolved_stars import PixelSolidAngles, last_seen
from kerrcaustics.scripts import STUDIES
from kerrcaustics.spacetime.frame import sky_from_line_of_sight

study = STUDIES.module("adversary.star_light")
NEAR = kc.Camera(0.6, 8.0, 1.3, "fiducial")
WHOLE = 2 * math.pi, "equirectangular"


def light_of(camera, star, view):
    return study.received(kc.render(camera, view, study.one_star(star)))


@pytest.mark.slow
def test_an_image_that_its_footprint_misses_is_drawn():
    """Magnification 0.0501, where a pixel sees 0.2 rad of the sky; the images of index 0 and 2 lie outside."""
    star = 1.171385974087865, -0.7258046670745755
    view = kc.pictures.View.toward_hole(NEAR, 640, 480, 1.4)
    images = kc.star_images(NEAR, star, max_index=1)
    scene = kc.render(NEAR, view, study.one_star(star))
    assert study.received(scene) == pytest.approx(images.magnification[1], rel=0.003)
    x, y = np.round(view.pixels(images.sky[1])).astype(int)
    assert luminance(scene.light[y - 1 : y + 2, x - 1 : x + 2]).sum() > 0.99 * luminance(scene.light).sum()


@pytest.mark.slow
def test_an_image_is_drawn_once():
    camera, star = kc.Camera(0.0123145, 4.71771484, 2.33388671, (0, 0, 0)), (2.18973167, -1.18933297)
    total = kc.star_images(camera, star, max_index=3).magnification.sum()
    assert light_of(camera, star, kc.pictures.View(480, 240, *WHOLE)) == pytest.approx(total, rel=0.001)


@pytest.mark.parametrize(
    ("camera", "star"),
    [
        pytest.param(NEAR, (2.0, 2.5), marks=pytest.mark.slow),
        pytest.param(kc.Camera(0.9, 10, 1.2, (0.0, 0.3, -0.8)), (1.4, 1.6), marks=pytest.mark.slow),
        pytest.param(kc.Camera(0.5, 300.0, 0.4, "fiducial"), (2.73, 0.05), marks=pytest.mark.slow),
    ],
)
def test_a_star_has_its_light_at_any_resolution(camera, star):
    total = kc.star_images(camera, star, max_index=3).magnification.sum()
    for width in (24, 48, 160):
        view = kc.pictures.View(width, width // 2, *WHOLE, forward=(0.3, -0.8, 0.5), up=(0.2, 0.1, 0.9))
        assert light_of(camera, star, view) == pytest.approx(total, rel=0.003), width


@pytest.mark.slow
@pytest.mark.parametrize(
    "place",
    [
        (-0.5, 11.2),
        (20.3, -0.45),
        *(pytest.param(place, marks=pytest.mark.slow) for place in ((47.5, 11.2), (7.0, 23.4), (47.2, 0.1))),
    ],
)
def test_light_goes_on_across_the_seam_and_the_poles(place):
    camera = kc.Camera(0.3, 40.0, 1.1, "fiducial")
    view = kc.pictures.View(48, 24, *WHOLE)
    beam = kc.trace_beams(camera, view.directions(*place)[0])
    star = math.acos(beam.direction[2]), math.atan2(beam.direction[1], beam.direction[0])
    total = kc.star_images(camera, star, max_index=2).magnification.sum()
    assert light_of(camera, star, view) == pytest.approx(total, rel=0.002)


@pytest.mark.parametrize("place", [(-1.2, 10.0), (-0.6, -0.8), (11.0, -1.3), (24.2, 10.0), (10.0, 23.8), (-0.9, 23.6)])
def test_stars_beside_the_border_shine_into_the_picture(place):
    """As much as the filter of a pixel says: each of its parts is that of a quadratic B-spline."""
    camera = kc.Camera(0.0, 1e7, velocity="fiducial")
    view = kc.pictures.View(24, 24, 0.004, forward=(0.9, -0.3, 0.3))
    n = kc.trace_beams(camera, view.directions(*place)[0]).direction
    scene = kc.render(camera, view, study.one_star((math.acos(n[2]), math.atan2(n[1], n[0]))))
    sides = [np.abs(np.arange(24) - along) for along in place]
    x, y = (np.where(s < 0.5, 0.75 - s**2, np.where(s < 1.5, (1.5 - s) ** 2 / 2, 0)) for s in sides)
    assert luminance(scene.light) * view.pixel**2 == pytest.approx(y[:, None] * x, abs=2e-3)


@pytest.mark.slow
def test_many_stars_bring_as_much_light_as_in_parts():
    """Of many, those that pixels beside the shadow edge see are not distinguished."""
    rng = np.random.default_rng(4)
    direction = rng.normal(size=(4000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    traced = kc.pictures.trace_view(NEAR, kc.pictures.View(64, 32, *WHOLE))

    def light(some):
        catalogue = kc.skies.StarCatalogue(direction[some], np.zeros(4000)[some], np.full(4000, 0.65)[some])
        return study.received(traced.show(kc.skies.StarField(catalogue, orientation=np.eye(3), band=0)))

    apart = sum(light(slice(start, start + 2000)) for start in (0, 2000))
    assert light(slice(None)) == pytest.approx(apart, rel=0.005)
    # Light of stars all over the sky is as bright as the sky.
    assert apart / 4000 == pytest.approx(traced.visible_fraction.mean(), abs=0.1)


def view_at_the_edge(camera, width, field):
    """A view of the shadow edge, upright in the middle of the picture: the prograde one."""
    left = kc.shadow_edge(camera, 4)[0]
    return kc.pictures.View(width, width // 2, field, forward=left, up=kc.pictures.View.toward_hole(camera, 2, 2, 1).up)


@pytest.mark.slow
def test_stars_beside_the_edge_have_the_light_of_a_finer_picture():
    """Where a pixel sees 0.3 to 25 rad of the sky in its length, and 1 to 100 stars; and they are not a flat tone."""
    camera, sky = kc.Camera(0.999, 2.6), kc.skies.StarField(band=0)
    coarse, fine = (luminance(kc.render(camera, view_at_the_edge(camera, w, 0.25), sky).light) for w in (240, 720))
    fine = fine.reshape(120, 3, 240, 3).mean(axis=(1, 3))
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(240), np.arange(120)))
    beams = kc.trace_beams(camera, view_at_the_edge(camera, 240, 0.25).directions(x, y)[0])
    extent = (beams.delta_plus * 0.25 / 240).reshape(120, 240)
    strip = (extent > 0.3) & (extent < 25)
    assert strip.sum() > 2000
    assert coarse[strip].sum() == pytest.approx(fine[strip].sum(), rel=0.02)
    step = np.abs(np.diff(coarse, axis=0))
    for low, high in ((0.3, 0.5), (0.5, 1), (1, 2), (2, 4), (4, 8)):
        band = (extent > low) & (extent < high)
        assert step[band[1:] & band[:-1]].mean() > 0.15 * coarse[band].mean(), (low, high)


@pytest.mark.slow
def test_a_pair_beside_a_cusp_keeps_its_light_in_a_coarse_picture():
    """Its images, of index 2 and 3 and a quarter of a pixel apart, bring 28 %; pixels there see 12 rad of the sky."""
    camera, star = kc.Camera(0.999, 2.6887042041, 2.0742402381, (0, 0, 0)), (1.2949859147637, 0.4415686489925)
    view = kc.pictures.View(240, 120, *WHOLE, forward=(-0.345, 0.021, -0.938), up=(0.671, 0.705, -0.23))
    images = kc.star_images(camera, star, max_index=3)
    pair = np.argsort(-images.magnification)[2:4]
    assert images.index[pair].tolist() == [2, 3] and (images.magnification[pair] > 0.06).all()
    assert light_of(camera, star, view) == pytest.approx(images.magnification.sum(), rel=0.003)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12])
def test_random_pictures_of_the_whole_sky_keep_the_light(seed):
    reported, broken = study.try_all(80, seed)
    assert not broken and reported["certified"] > 70 and reported["median"] < 0.001


@pytest.mark.slow
@pytest.mark.parametrize("projection", ["pinhole", "fisheye"])
@pytest.mark.parametrize("number", range(6))
def test_pictures_hold_the_images_that_lie_in_them(projection, number):
    camera, _, rng = next(sky for i, sky in enumerate(study.whole_skies(5)) if i == number)
    view = kc.pictures.View.toward_hole(camera, 200, 150, 1.5, projection)
    traced = kc.pictures.trace_view(camera, view)
    for star in study.random_stars(rng, 10):
        images = kc.star_images(camera, star, max_index=3)
        place = view.pixels(images.sky)
        with np.errstate(invalid="ignore"):
            beside = np.abs(place - [99.5, 74.5]) - [100, 75]
            inside, cut = (beside < -1.5).all(axis=1), (np.abs(beside) < 2).any(axis=1) & (beside < 2).all(axis=1)
        if cut.any() or not images.certified:
            continue
        light = study.received(traced.show(study.one_star(star)))
        assert light == pytest.approx(images.magnification[inside].sum(), rel=0.01, abs=2e-4)


def test_some_of_many_stars_are_searched_for_as_all_of_them():
    # Beside the shadow edge their mean light takes the place of images, for some as for all.
    camera = kc.Camera(0.9, 8.0)
    traced = kc.pictures.trace_view(camera, kc.pictures.View.toward_hole(camera, 96, 54, 1.6))
    rng = np.random.default_rng(4)
    sky = rng.normal(size=(3000, 3))
    stars = PointLights(sky / np.linalg.norm(sky, axis=1)[:, None], np.ones((3000, 3)), np.full(3000, 6000.0))
    chosen = np.arange(1500)
    with ThreadPoolExecutor(1) as pool:
        every = traced.star_search.images(stars, np.zeros(3000), pool)
        some = traced.star_search.images(stars.some(chosen, 0.0), np.zeros(1500), pool)
    these = every.star < 1500
    assert these.sum() > 200
    np.testing.assert_array_equal(np.bincount(some.star), np.bincount(every.star[these]))
    assert some.magnification.sum() == pytest.approx(every.magnification[these].sum(), rel=1e-12)


@pytest.mark.parametrize(
    "spin, radius, pixel", [(0.999, 168.07, 0.26), (0.9, 6.0, 0.01), (0.999, 2.6, 0.002), (0.0, 1e3, 0.1)]
)
@pytest.mark.parametrize("limit", [1e-3, 8 * math.pi])
def test_all_images_beside_the_edge_that_are_not_searched_for_have_faded(spin, radius, pixel, limit):
    camera, frame = kc.Camera(spin, radius), kc.Camera(spin, radius).frame()
    solid_angles = PixelSolidAngles(camera, pixel)
    angle, part = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 6.2, 60), [1e-3, 0.1, 0.5, 1.0]))
    distance = edge_size(camera)(angle) + np.maximum(part * solid_angles.nearest(angle, limit), 1e-9)
    line_of_sight = [-np.cos(distance), np.sin(distance) * np.cos(angle), np.sin(distance) * np.sin(angle)]
    sky = sky_from_line_of_sight(frame, np.stack(line_of_sight, axis=-1))
    seen = solid_angles.values(pixel * kc.trace_beams(camera, sky).delta_plus, sky)
    assert np.nanmin(seen) > last_seen(limit) and np.isfinite(seen).mean() > 0.9
