"""The flare of a lens: light is kept, a point becomes the spread, nothing comes back at the opposite edge."""

import math

import numpy as np
import pytest
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.scenes.colour import decoded

RNG = np.random.default_rng(8)


def spread_by_hand(light, spread):
    """The slow twin, framed: each pixel of the spread shifts the whole picture."""
    (height, width, _), (rows, columns) = light.shape, spread.shape[:2]
    found = np.zeros((height + rows - 1, width + columns - 1, 3))
    for i, j in np.ndindex(rows, columns):
        found[i : i + height, j : j + width] += light * (spread[i, j] / spread.sum(axis=(0, 1)))
    return found


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (4, 6), (31, 2), (40, 60), (5, 5, 3)])
def test_every_point_becomes_the_spread(size):
    light, spread = RNG.uniform(0, 1, (12, 17, 3)), RNG.uniform(0, 1, size)
    wanted = spread_by_hand(light, spread)
    assert kc.pictures.with_glare(light, spread, framed=True) == pytest.approx(wanted, abs=1e-13)
    top, left = size[0] // 2, size[1] // 2
    assert kc.pictures.with_glare(light, spread) == pytest.approx(wanted[top : top + 12, left : left + 17], abs=1e-13)


def test_light_is_kept():
    light = RNG.uniform(0, 1, (60, 80, 3)) ** 12 * [1, 10, 1000]
    total = light.sum(axis=(0, 1))
    framed = kc.pictures.with_glare(light, kc.pictures.glare_kernel(0.4, 3.0), framed=True)
    assert framed.sum(axis=(0, 1)) == pytest.approx(total, rel=1e-12)
    lost = total - kc.pictures.with_glare(light, kc.pictures.glare_kernel(0.4, 3.0)).sum(axis=(0, 1))
    assert (lost > 1e-3 * total).all()


def test_light_far_from_the_borders_is_kept_to_the_last_of_many_dark_pixels():
    light = np.zeros((1500, 1500, 3))
    light[700, 800] = 1e6, 1.0, 1e-6
    seen = kc.pictures.with_glare(light, kc.pictures.glare_kernel(0.5, 2.0))
    assert seen.sum(axis=(0, 1)) == pytest.approx([1e6, 1.0, 1e-6], rel=1e-12)
    assert seen.min() >= 0


def test_a_halo_holds_its_share_and_falls_off():
    spread = kc.pictures.glare_kernel(0.3, 10.0, falloff=2.5)
    middle = len(spread) // 2
    assert spread.sum() == pytest.approx(1, rel=1e-14) and spread.shape == (401, 401)
    row = spread[middle, middle:]
    assert row[0] > 0.7 and (np.diff(row) <= 0).all() and row[-1] < 1e-3 * row[1]
    # Its end is taken off all of it.
    end = (1 + 20.1**2) ** -1.25
    law = (1 + (np.array([10.0, 40.0]) / 10) ** 2) ** -1.25 - end
    assert row[10] / row[40] == pytest.approx(law[0] / law[1], rel=1e-12)
    assert np.allclose(spread, spread.T, rtol=1e-13) and np.allclose(spread, spread[::-1], rtol=1e-13)


def test_without_a_halo_nothing_changes():
    light = RNG.uniform(0, 1, (20, 30, 3))
    assert kc.pictures.with_glare(light, kc.pictures.glare_kernel(0.0, 5.0)) == pytest.approx(light, abs=1e-14)


def test_the_shadow_is_no_longer_black():
    y, x = np.mgrid[:101, :101] - 50
    ring = (np.abs(np.hypot(x, y) - 30) < 5)[..., None] * np.ones(3)
    seen = kc.pictures.with_glare(ring, kc.pictures.glare_kernel(0.1, 20.0))
    assert ring[50, 50].max() == 0 and 0.002 < seen[50, 50].min() < 0.1


def test_what_leaves_the_picture_does_not_come_back():
    light = np.zeros((40, 50, 3))
    light[20, 0] = 1.0
    spread = np.zeros((3, 41))
    spread[1, 20], spread[1, 0] = 0.75, 0.25
    seen = kc.pictures.with_glare(light, spread)
    assert seen[20, 0] == pytest.approx(0.75) and seen.sum(axis=(0, 1)) == pytest.approx(0.75, rel=1e-12)


def test_a_measured_spread_may_come_from_a_file(tmp_path):
    values = np.zeros((5, 7, 3), np.uint8)
    values[2, 3], values[2, 4], values[1, 3] = 255, (40, 80, 120), 30
    Image.fromarray(values).save(tmp_path / "spread.png")
    light = RNG.uniform(0, 1, (9, 9, 3))
    assert np.array_equal(
        kc.pictures.with_glare(light, tmp_path / "spread.png"),
        kc.pictures.with_glare(light, decoded(values / np.float32(255))),
    )
    point = np.zeros((9, 9, 3))
    point[4, 4] = 1.0
    seen = kc.pictures.with_glare(point, str(tmp_path / "spread.png"))
    assert seen.sum(axis=(0, 1)) == pytest.approx(1, rel=1e-12)
    assert seen[4, 5] / seen[4, 4] == pytest.approx(decoded(np.array([40, 80, 120]) / 255), rel=1e-6)


LIGHT = np.ones((4, 4, 3))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: kc.pictures.glare_kernel(1.1, 5.0), r"`share` must lie in \[0, 1\], but is 1.1"),
        (lambda: kc.pictures.glare_kernel(-0.1, 5.0), "`share` must"),
        (lambda: kc.pictures.glare_kernel("all", 5.0), "`share` must"),
        (lambda: kc.pictures.glare_kernel(0.1, -5.0), "`width` must be a positive, finite number, but is -5.0"),
        (lambda: kc.pictures.glare_kernel(0.1, math.nan), "`width` must"),
        (lambda: kc.pictures.glare_kernel(0.1, 5.0, 0.0), "`falloff` must"),
        (lambda: kc.pictures.glare_kernel(0.1, 5.0, reach=2.5), "`reach` must be a whole number"),
        (lambda: kc.pictures.with_glare(np.ones((4, 4)), LIGHT), "`light` must have shape"),
        (lambda: kc.pictures.with_glare(-LIGHT, LIGHT), "`light` must hold finite numbers"),
        (lambda: kc.pictures.with_glare(LIGHT, np.ones(5)), "`spread` must be a picture"),
        (lambda: kc.pictures.with_glare(LIGHT, np.ones((5, 5, 2))), "`spread` must be a picture"),
        (lambda: kc.pictures.with_glare(LIGHT, [[1.0], [math.inf]]), "`spread` must hold finite numbers"),
        (lambda: kc.pictures.with_glare(LIGHT, [[1.0], [1.0, 2.0]]), "`spread` must hold finite numbers"),
        (lambda: kc.pictures.with_glare(LIGHT, np.zeros((5, 5))), "`spread` must have light"),
        (lambda: kc.pictures.with_glare(LIGHT, LIGHT * [1, 0, 1]), "`spread` must have light"),
        (lambda: kc.pictures.with_glare(LIGHT, __file__), "`path` must end in"),
        (lambda: kc.pictures.with_glare(LIGHT, "no such file.png"), "`path` must name a picture that can be read"),
    ],
)
def test_bad_input_is_one_line(make, words):
    with pytest.raises(ValueError, match=words) as reported:
        make()
    assert "\n" not in str(reported.value)
