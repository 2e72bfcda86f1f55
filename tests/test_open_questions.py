"""The study of open questions, one camera: crossings, pairs at caustics, lives of images, counts, velocity."""

import math

import numpy as np
import pytest

import kerrcaustics as kc
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.scripts import STUDIES

counts, crossings, pairs, velocity = (
    STUDIES.module(f"open_questions.{name}") for name in ("counts", "crossings", "pairs", "velocity")
)


@pytest.fixture(scope="module")
def sheets():
    return sheets_of(kc.Camera(0.6, 6.03), 2)


def test_critical_rays_of_order_k_cross_the_equator_k_minus_1_times():
    for curve in crossings.critical_crossings(kc.Camera(0.6, 6.03), 3):
        assert set(curve.crossings) - {-1} == {curve.order - 1}
        # Only the two cusps in the plane end there.
        assert (curve.crossings == -1).sum() == 2
        assert curve.order - 1 < curve.phase.min() and curve.phase.max() < curve.order + 1e-9
        assert curve.theta.min() < math.pi / 2 < curve.theta.max()


@pytest.mark.slow
@pytest.mark.parametrize("order", [2, 3])
def test_inside_a_caustic_are_two_images_more(sheets, order):
    (one,) = pairs.crossings_of(sheets, order, 5, (1e-6,), np.random.default_rng(order))
    assert one.alone.all() and one.is_pair.all()
    np.testing.assert_allclose(one.away / one.fold[:, None], 1, atol=0.2)


@pytest.mark.slow
def test_an_image_of_order_1_outlives_its_partners_by_one_circuit(sheets):
    found = [life for life in crossings.lives(sheets, math.radians(85)) if life.crossings == 1]
    assert [life.index for life in found] == [1, 2] and not any(life.closed for life in found)
    assert found[0].circuits - found[1].circuits == pytest.approx(1, abs=1e-3)
    polar = crossings.lives(sheets, math.radians(10))
    assert [(life.crossings, life.index) for life in polar] == [(0, 0), (1, 1), (2, 2)]
    assert all(life.closed and life.circuits == pytest.approx(1, abs=1e-6) for life in polar)


def test_equatorial_stars_have_mirror_pairs_off_the_line(sheets):
    found = counts.equatorial_images(sheets, 12)
    assert found.certified.all()
    assert (found.counts[..., counts.PLACES.index("off the line")] % 2 == 0).all()
    assert found.counts[..., counts.PLACES.index("off the line")].any()
    _, image, azimuth = counts.line_between(sheets, 0.0, 1, 500)
    half_turns = abs(azimuth[-1] - azimuth[0]) / math.pi
    crossed = counts.circle_crossings(image, np.array([[math.cos(p), math.sin(p), 1.0] for p in np.arange(0, 6, 0.1)]))
    assert set(crossed) == {math.floor(half_turns), math.ceil(half_turns)}


def test_a_moving_camera_finds_the_same_caustics(sheets):
    camera = kc.Camera(0.6, 6.03, velocity=(0.3, -0.2, 0.5))
    miss, error = velocity.critical_misses(sheets, camera, 4, np.random.default_rng(1))
    assert (miss <= 10 * error).all() and miss.max() < 1e-8


@pytest.mark.parametrize("speed", ["static", (-0.57, 0.39, 0.19)])
def test_a_moving_camera_finds_the_same_images(sheets, speed):
    stars = np.random.default_rng(5).normal(size=(8, 3))
    stars /= np.linalg.norm(stars, axis=1, keepdims=True)
    miss, error, lost = velocity.image_misses(sheets, kc.Camera(0.6, 6.03, velocity=speed), stars)
    assert lost == 0 and len(miss) >= 24 and (miss <= error).all()
