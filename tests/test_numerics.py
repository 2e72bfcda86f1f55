"""Splines, roots and matches in NumPy, against SciPy."""

import numpy as np
import pytest
from offenders import for_each
from scipy.interpolate import CubicSpline
from scipy.optimize import elementwise, linear_sum_assignment
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from kerrcaustics.numerics import fourier
from kerrcaustics.numerics.matching import best_matches, component_of
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.numerics.splines import Spline

# Rounding, in units of the largest value: the third derivative through few uneven nodes loses the most.
ROUNDING = 1e-9


@pytest.fixture
def random():
    return np.random.default_rng(5)


@for_each(ends=["not-a-knot", "periodic"], axes=[(), (3,), (2, 2)], count=[2, 3, 4, 5, 17, 2000])
def test_splines_are_those_of_scipy(count, axes, ends, random):
    # Steps that differ by factors up to ten thousand.
    nodes = np.cumsum(1e-3 + 10 * random.random(count) ** 4)
    values = random.normal(size=(count, *axes))
    if ends == "periodic":
        values[-1] = values[0]
    # Beyond both ends too.
    places = random.uniform(nodes[0] - 0.1, nodes[-1] + 0.1, (7, 3))
    spline, theirs = Spline(nodes, values, periodic=ends == "periodic"), CubicSpline(nodes, values, bc_type=ends)
    for derivative in range(4):
        expected = theirs(places, derivative)
        np.testing.assert_allclose(
            spline(places, derivative), expected, rtol=0, atol=ROUNDING * np.abs(theirs.c).max() * 10
        )
    np.testing.assert_allclose(spline(nodes[0]), values[0], rtol=1e-13)


@pytest.mark.parametrize("tolerances", [{}, {"absolute": 1e-6}, {"absolute": 1e-15, "relative": 1e-14}])
def test_roots_and_calls_are_those_of_scipy(tolerances, random):
    calls = []

    def wave(x, a, k):
        calls.append(len(x))
        return np.sin(k * x) - a * x**3 + a - 0.3

    args = random.normal(size=500), random.integers(1, 5, 500)
    bracket = random.uniform(-3, 0, 500), random.uniform(0, 3, 500)
    # No numbers, and ends of one sign.
    args[0][0], bracket[0][1], bracket[1][2] = np.nan, np.nan, bracket[0][2]
    named = {"absolute": "xatol", "relative": "xrtol"}
    theirs = elementwise.find_root(
        wave, bracket, args=args, tolerances={named[name]: value for name, value in tolerances.items()}
    )
    traced, calls = calls, []
    root = bracketed_roots(wave, bracket, args, **tolerances)
    assert 200 < root.found.sum() < 500 and not root.found[:3].any()
    np.testing.assert_array_equal(root.x, theirs.x)
    np.testing.assert_array_equal(root.found, theirs.success)
    assert calls == [count for count in traced if count]


def test_a_root_at_an_end_or_with_no_numbers_beside_it_is_found():
    bracket = np.array([-1.0, 0.0]), np.array([1.0, 1.0])
    np.testing.assert_array_equal(bracketed_roots(lambda x: x**3, bracket).x, [0, 0])
    root = bracketed_roots(lambda x: np.where(x > 0.5, np.nan, x - 0.2), bracket)
    assert root.found.all() and np.abs(root.x - 0.2).max() < 1e-15
    assert len(bracketed_roots(lambda x: x, (np.empty(0), np.empty(0))).x) == 0


def test_matches_have_the_least_cost(random):
    contested = 0
    for _ in range(300):
        cost = random.random(random.integers(1, 6, 2))
        rows, columns = best_matches(cost)
        contested += len(set(cost.argmin(axis=int(cost.shape[0] <= cost.shape[1])).tolist())) < min(cost.shape)
        for ours, theirs in zip((rows, columns), linear_sum_assignment(cost), strict=True):
            np.testing.assert_array_equal(ours, theirs)
    assert 30 < contested < 270
    assert [len(part) for part in best_matches(np.empty((0, 3)))] == [0, 0]


def test_components_are_those_of_scipy(random):
    for _ in range(200):
        nodes, links = int(random.integers(1, 60)), int(random.integers(0, 80))
        ends = random.integers(0, nodes, (2, links))
        graph = coo_matrix((np.ones(links), tuple(ends)), shape=(nodes, nodes))
        label = connected_components(graph, directed=False)[1]
        lowest = [int(np.flatnonzero(label == each)[0]) for each in label]
        np.testing.assert_array_equal(component_of(*ends, nodes), lowest)


@pytest.mark.parametrize("count", [8, 32])
def test_fourier_series_of_few_waves_are_exact(count):
    def wave(x):
        return np.stack([1.5 + np.cos(x) - 0.2 * np.sin(3 * x), np.sin(2 * x)], axis=-1)

    def slope(x):
        return np.stack([-np.sin(x) - 0.6 * np.cos(3 * x), 2 * np.cos(2 * x)], axis=-1)

    series, places = fourier.coefficients(wave(fourier.nodes(count))), np.array([0.0, 0.3, 4.0])
    for more in (8, 10, 64):
        np.testing.assert_allclose(fourier.resampled(series, more), wave(fourier.nodes(more)), atol=1e-14)
        np.testing.assert_allclose(fourier.resampled(series, more, 1), slope(fourier.nodes(more)), atol=1e-13)
    np.testing.assert_allclose(fourier.values_at(series, places), wave(places), atol=1e-14)
    np.testing.assert_allclose(fourier.values_at(series, places, 1), slope(places), atol=1e-13)


def test_the_last_wave_of_an_even_number_of_nodes_is_kept():
    x = fourier.nodes(8)
    series = fourier.coefficients(np.sin(4 * x))
    np.testing.assert_allclose(fourier.values_at(series, x), np.sin(4 * x), atol=1e-14)
    np.testing.assert_allclose(fourier.resampled(series, 8), np.sin(4 * x), atol=1e-14)
    np.testing.assert_allclose(fourier.resampled(series, 32), np.sin(4 * fourier.nodes(32)), atol=1e-14)
