"""A star's question changes no other star's answer: images are the same to the bit, whatever was asked before."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.spacetime.sphere import polar_angle

SPIN, RADIUS = 0.999, 2.6
CAMERA = kc.Camera(SPIN, RADIUS)


def stars_of(seed, count):
    """Stars (count, 2): half of them anywhere, half of them 1e-3 to 1e-9 rad from a caustic, on either side."""
    rng = np.random.default_rng(seed)
    anywhere = rng.normal(size=(count // 2, 3))
    places = np.concatenate([caustic.celestial for caustic in kc.caustics(CAMERA, 3)])
    close = places[rng.integers(0, len(places), count - count // 2)]
    close = close + 10.0 ** rng.uniform(-9, -3, (len(close), 1)) * rng.normal(size=close.shape)
    anywhere /= np.linalg.norm(anywhere, axis=1, keepdims=True)
    angles = np.stack([polar_angle(anywhere), np.arctan2(anywhere[:, 1], anywhere[:, 0])], axis=-1)
    return rng.permutation(np.concatenate([angles, np.clip(close, [0, -np.inf], [np.pi, np.inf])]))


def images(star):
    """All that there is to know of the images of one star, as one array."""
    found = kc.star_images(CAMERA, tuple(star), 2)
    expected = [*found.expected.values(), *(order in found.on_caustic for order in (1, 2, 3))]
    return np.concatenate([found.sky.ravel(), found.error, found.magnification, found.index, expected])


def same(one, other):
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def after_others_in_any_order_and_from_threads(stars, first, others):
    kc.image_counts(CAMERA, stars_of(11, others), 2)
    assert same(first, [images(star) for star in stars[::-1]][::-1])
    mixed = np.random.default_rng(3).permutation(len(stars))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(images, stars[mixed]))
    assert same(first, [found[i] for i in np.argsort(mixed)])


@pytest.mark.slow
def test_images_of_a_few_stars_stay():
    stars = stars_of(7, 8)
    after_others_in_any_order_and_from_threads(stars, [images(star) for star in stars], 16)


@pytest.mark.slow
def test_images_of_many_stars_stay(tmp_path):
    stars = stars_of(8, 60)
    np.save(tmp_path / "stars.npy", stars)
    script = (
        "import sys, numpy as np\n"
        "from test_answers_stay import images\n"
        "np.savez(sys.argv[2], *[images(star) for star in np.load(sys.argv[1])])\n"
    )
    places = tmp_path / "stars.npy", tmp_path / "found.npz"
    subprocess.run([sys.executable, "-c", script, *map(str, places)], check=True, cwd="tests")
    with np.load(places[1]) as stored:
        first = [stored[f"arr_{i}"] for i in range(len(stars))]
    after_others_in_any_order_and_from_threads(stars, first, 300)
    together = kc.image_counts(CAMERA, stars, 2)
    assert all(np.array_equal(a[-6:-3], b) for a, b in zip(first, together.expected, strict=True))
