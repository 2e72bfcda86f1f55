"""Gas in wisps: it shines with what it takes from the light behind, without a seam, and shifts as a black body."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.scenes.disk.samples import DiskSamples

CAMERA = kc.Camera(0.6, 74.1, math.radians(86.56), "static")


@pytest.fixture(scope="module")
def wisps():
    return kc.disks.Wisps(4500, 9.26, 18.70, depth=0.8, contrast=1.0, seed=3)


def samples_at(radius, azimuth, ratio=1.0):
    radius, azimuth = np.broadcast_arrays(radius, azimuth)
    points, width = np.full((len(radius), 2, 2), 1e-12), 18.70 - 9.26
    still = np.zeros(len(radius)), np.zeros_like
    return DiskSamples(
        radius, azimuth, (radius - 9.26) / width, points, np.full(len(radius), ratio), width, 0.6, *still
    )


def test_it_shines_with_what_it_takes(wisps):
    samples = samples_at(np.linspace(9.26, 18.70, 500), np.linspace(-9, 9, 500))
    opacity = wisps.opacity(samples.radius, samples.azimuth)
    assert opacity.min() >= 0 and opacity.max() <= 1 and opacity.std() > 0.1
    assert wisps.light(samples, False, False) == pytest.approx(
        opacity[:, None] * kc.pictures.black_body(4500), abs=1e-6
    )


@pytest.mark.slow
def test_a_picture_shines_with_what_it_takes(wisps):
    disk = kc.disks.Disk(9.26, 18.70, wisps, opacity=wisps.opacity, slant=False)
    left = -math.cos(math.radians(12)), -math.sin(math.radians(12)), 0.0
    rendering = kc.render(CAMERA, kc.pictures.View(120, 60, math.radians(4), forward=left), disk=disk)
    wanted = (1 - rendering.transmission)[..., None] * kc.pictures.black_body(4500)
    wrong = np.abs(rendering.light - wanted) / wanted.max()
    assert rendering.transmission.min() < 0.5
    assert np.median(wrong[wanted > 0]) < 0.003 and wrong.max() < 0.08


def test_it_is_soft_at_the_rims_and_has_no_seam(wisps):
    around = np.linspace(-math.pi, math.pi, 200)
    for rim in (9.27, 18.69):
        assert wisps.opacity(np.full(200, rim), around).max() < 0.01
    radius = np.linspace(9.3, 18.6, 300)
    step = 2 * math.pi / 2048
    across = [wisps.opacity(radius, np.full(300, phi)) for phi in (-step, 0.0, step, 2 * math.pi)]
    assert np.abs(across[1] - across[0]).max() < 3 * np.abs(across[2] - across[1]).max()
    assert across[3] == pytest.approx(across[1], abs=1e-6)


def test_its_depth_is_what_was_asked_for():
    wisps = kc.disks.Wisps(4500, 9.26, 18.70, depth=0.5, contrast=0.8)
    radius, azimuth = np.meshgrid(np.linspace(11, 17, 200), np.linspace(0, 2 * math.pi, 400))
    depth = -np.log1p(-wisps.opacity(radius.ravel(), azimuth.ravel()))
    assert depth.mean() == pytest.approx(0.5, rel=0.1)
    assert np.log(depth).std() == pytest.approx(0.8, rel=0.1)
    even = kc.disks.Wisps(4500, 9.26, 18.70, depth=0.5, contrast=0.0)
    assert even.opacity(np.array([13.0]), np.array([1.0])) == pytest.approx(1 - math.exp(-0.5), rel=1e-6)


@pytest.mark.parametrize("shifts", [(True, False), (False, True), (True, True)])
def test_light_shifts_as_that_of_a_black_body(shifts):
    deep = kc.disks.Wisps(4500, 9.26, 18.70, depth=100.0, contrast=0.0)
    samples = samples_at(np.linspace(12, 16, 9), np.linspace(0, 6, 9), ratio=0.8)
    assert deep.light(samples, *shifts) == pytest.approx(kc.disks.BlackBody(4500).light(samples, *shifts), rel=1e-5)


@pytest.mark.parametrize("shifts", [(False, False), (True, True)])
def test_wisps_of_a_page_thorne_disk_shine_with_its_light(wisps, shifts):
    hot = kc.disks.Wisps(4500, 9.26, 18.70, depth=0.8, contrast=1.0, seed=3, law="page-thorne")
    samples = samples_at(np.linspace(9.26, 18.70, 500), np.linspace(-9, 9, 500), ratio=0.9)
    opacity = wisps.opacity(samples.radius, samples.azimuth)
    assert np.array_equal(hot.opacity(samples.radius, samples.azimuth), opacity)
    wanted = opacity[:, None] * kc.disks.PageThorne(4500).light(samples, *shifts)
    assert hot.light(samples, *shifts) == pytest.approx(wanted, rel=1e-5, abs=1e-6 * wanted.max())
    # It is hottest inside the inner rim.
    assert np.diff(hot.gas.temperature(0.6, samples.radius)).max() < 0


def test_other_seeds_make_other_wisps(wisps):
    radius, azimuth = np.full(300, 14.0), np.linspace(0, 6, 300)
    here = wisps.opacity(radius, azimuth)
    assert np.array_equal(here, kc.disks.Wisps(4500, 9.26, 18.70, 0.8, 1.0, 3).opacity(radius, azimuth))
    assert np.abs(here - kc.disks.Wisps(4500, 9.26, 18.70, 0.8, 1.0, 4).opacity(radius, azimuth)).max() > 0.2


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"peak": -1}, "`peak` must be a temperature"),
        ({"inner": 20.0}, "`inner` and `outer` must be growing radii"),
        ({"outer": math.inf}, "`inner` and `outer` must be growing radii"),
        ({"depth": -0.1}, "`depth` must be a number from 0 to 100"),
        ({"contrast": "much"}, "`contrast` must be a number from 0 to 100"),
        ({"seed": 1.5}, "`seed` must be a whole number"),
        ({"law": "page"}, "`law` must be one of black-body, page-thorne"),
    ],
)
def test_bad_input_is_one_line(values, words):
    with pytest.raises(ValueError, match=words) as reported:
        kc.disks.Wisps(**{"peak": 4500, "inner": 9.26, "outer": 18.70, **values})
    assert "\n" not in str(reported.value)
