"""Kernels of maps and of views: they are their JAX functions, and do what is done step by step elsewhere."""

import math

import jax
import numpy as np
import pytest
from marks import few

import kerrcaustics as kc
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.kernels.trees import leaves
from kerrcaustics.scenes import map_formulas
from kerrcaustics.scenes.coons_patches import doubts, weights, weights_at
from kerrcaustics.scenes.footprint import ASPECT, bend, pixel_matrix, singular_values
from kerrcaustics.scenes.sky_cells import CellPlaces, Patches, SkyCells, pixels
from kerrcaustics.scenes.sky_map import slopes
from kerrcaustics.spacetime.settings import settings_of_programs
from kerrcaustics.spacetime.sphere import polar_basis

CAMERA = kc.Camera(spin=0.9, radius=6.0)
COUNT = 40
# Round-off grows as footprints get thin: the ratio of the axes is below 1e3.
ROUND_OFF = 1e-12


@pytest.fixture
def random():
    return np.random.default_rng(6)


@pytest.fixture
def cells():
    """Cells of a map, of all sizes."""
    return kc.pictures.trace_view(CAMERA, kc.pictures.View(120, 80, math.radians(90))).sky_cells


def directions(random, *shape):
    n = random.normal(size=(*shape, 3))
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def inputs(random):
    """For each kernel: its numbers, its columns as its function takes them, and its tables."""
    data, curving = 0.1 * random.normal(size=(COUNT, 36)) + 0.5, 0.01 * random.normal(size=(COUNT, 9))
    x, y, row = random.uniform(0, 8, (2, COUNT)), None, random.integers(0, COUNT, COUNT).astype(float)
    (x, y), size, vector = x, 2.0 ** random.integers(0, 5, COUNT), directions(random, COUNT)
    table = kernel("cell_polynomials").on_rays((), (x, y, size, data, curving))
    slope = np.where(random.uniform(size=(COUNT, 1)) < 0.2, np.nan, 0.01 * random.normal(size=(COUNT, 6)))
    corners = random.integers(0, COUNT, (COUNT, 4)).astype(float)
    steps, jacobian = 0.01 * random.normal(size=(COUNT, 6)), random.normal(size=(COUNT, 4))
    return {
        "cell": ((4.0,), [corners], [vector, 0.01 * random.normal(size=(COUNT, 6))]),
        "cell_polynomials": ((), [x, y, size, data, curving], []),
        "cell_scale": ((), [size, data, curving], []),
        "drift": ((), [x, y, row], [table]),
        "part_footprint": ((2.0, 8.0), [vector, np.arange(COUNT, dtype=float)], [slope]),
        "square_footprint": ((0.5, 8.0), [x, y, row], [table]),
        "slopes": ((), [vector, jacobian, directions(random, COUNT), steps], []),
    }


def by_component(column):
    """A column as a function takes it: a number, or as many as it has."""
    return column if column.ndim == 1 else tuple(column.T)


def test_all_kernels_of_maps_are_tried(random):
    assert set(inputs(random)) == set(map_formulas.programs())


@pytest.mark.parametrize("name", few(map_formulas.programs(), ("cell_scale", "drift", "square_footprint")))
def test_kernels_are_their_functions(name, random):
    numbers, columns, tables = inputs(random)[name]
    function = map_formulas.programs()[name].function
    with settings_of_programs():
        rows = jax.vmap(lambda *own: function(*numbers, *tables, *own))(*(by_component(part) for part in columns))
    found = kernel(name).on_rays(numbers, columns, tables=tables)
    for ours, theirs in zip(leaves(found), leaves(rows), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=ROUND_OFF)


def footprint(direction, steps, curving, side):
    """Matrices (n, 2, 2) and bends (n,) from n', its steps (n, 2, 3), and its second derivatives (n, 3, 3)."""
    basis = np.stack(polar_basis(direction), axis=1)
    matrix = basis @ np.swapaxes(steps, 1, 2)
    major, _, angle = singular_values(matrix)
    across = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)[:, None] @ basis
    # Parts of pixels are widened.
    return matrix, np.maximum(bend(curving, across[:, 0]), 0.0 if side == 1 else major / (ASPECT * side))


@pytest.mark.parametrize("parts", [1, 2])
def test_footprints_are_those_of_patches(cells, parts, random):
    which = random.integers(0, len(cells.x), COUNT)
    within = random.uniform(0, 1, (2, COUNT))
    size = cells.size[which]
    place = CellPlaces(
        *(start[which] + part * size - 0.5 for start, part in zip(cells[:2], within, strict=True)), which, 1 / parts
    )
    found = Patches(cells).footprint(place, np.ones(COUNT))
    value, *steps = (np.einsum("nkc,kn->nc", cells.data[which], part) for part in weights_at(*within)[:3])
    direction = value / np.linalg.norm(value, axis=1, keepdims=True)
    np.testing.assert_allclose(found.direction, direction, atol=ROUND_OFF)
    np.testing.assert_allclose(Patches(cells).values(place), value, atol=ROUND_OFF)
    steps = np.stack(steps, axis=1) / (parts * size)[:, None, None]
    matrix, spread = footprint(direction, steps, cells.curving[which] / parts**2, 1 / parts)
    np.testing.assert_allclose(found.matrix, matrix, atol=ROUND_OFF)
    np.testing.assert_allclose(found.bend, spread, rtol=1e-9, atol=ROUND_OFF)


def test_a_cell_is_joined_from_its_corners(random):
    size, numbers = 4, random.integers(0, COUNT, (COUNT, 4))
    place, slope = directions(random, COUNT), 0.01 * random.normal(size=(COUNT, 3, 2))
    data, curving, extent, scale, doubt, checked = kernel("cell").on_rays(
        (size,), [numbers], tables=[place, slope.reshape(-1, 6)]
    )
    known = [place[numbers], size * slope[numbers, :, 0], size * slope[numbers, :, 1]]
    np.testing.assert_allclose(data, np.concatenate(known, axis=1), atol=ROUND_OFF)
    assert extent == pytest.approx(np.linalg.norm(data[:, 4:], axis=-1).max(axis=1))
    s = slope[numbers]
    along_x, along_y = (
        (s[:, first] - s[:, 0] + s[:, 3] - s[:, second]) / (2 * size) for first, second in ((1, 2), (2, 1))
    )
    mixed = (along_x[..., 1] + along_y[..., 0]) / 2
    np.testing.assert_allclose(curving, np.stack([along_x[..., 0], mixed, along_y[..., 1]], axis=1), atol=ROUND_OFF)
    np.testing.assert_allclose(doubt, pixels(scale, np.stack(doubts(data), axis=1)).max(axis=1), rtol=1e-9)
    middles = [weights(x, y, 0.0, 1).value[:, 0] for x, y in ((0.5, 0.5), (0.5, 0.0), (0.0, 0.5))]
    value = np.einsum("nkc,sk->nsc", data, middles)
    np.testing.assert_allclose(checked, value / np.linalg.norm(value, axis=-1, keepdims=True), atol=ROUND_OFF)


def test_a_step_of_a_pixel_is_a_pixel():
    # Slopes are the same everywhere, so that neither curving nor corners add to the width.
    steps = np.array([[0.02, 0.001], [0.003, 0.01]])
    x, y = np.array([0, 1, 0, 1]), np.array([0, 0, 1, 1])
    basis = np.stack(polar_basis(np.array([0.6, 0.0, 0.8])))
    columns = basis.T @ steps
    corners = np.array([0.6, 0.0, 0.8]) + 8 * (columns @ [x - 0.5, y - 0.5]).T
    data = np.concatenate([corners, *(np.tile(8 * column, (4, 1)) for column in columns.T)])
    empty = np.zeros((1, 0, 3))
    cells = SkyCells(
        *(np.array([part]) for part in (0, 0, 8)), data[None], np.zeros((1, 3, 3)), *np.zeros((2, 1)), empty
    )
    columns_of = cells.size, cells.data.reshape(-1, 36), cells.curving.reshape(-1, 9)
    scale, middle = kernel("cell_scale").on_rays((), columns_of)
    np.testing.assert_allclose(middle, [[0.6, 0.0, 0.8]], atol=ROUND_OFF)
    # The corners, which lie off the sphere, are seen under other angles.
    assert pixels(scale, columns.T[None]) == pytest.approx(np.ones((1, 2)), rel=0.01)


def test_parts_of_pixels_bend_as_their_neighbours_differ(random):
    count = 4
    columns = 0.01 * random.normal(size=(3, count, count, 3, 2))
    columns[1, 2, 1] = np.nan
    inside = np.flatnonzero(np.isfinite(columns[..., 0, 0]))
    middle = directions(random, len(inside))
    found = kernel("part_footprint").on_rays((count, ASPECT / count), (middle, inside), tables=[columns.reshape(-1, 6)])
    along_y, along_x = np.gradient(columns, axis=(1, 2))
    mixed = (along_x[..., 1] + along_y[..., 0]) / 2
    curving = np.nan_to_num(np.stack([along_x[..., 0], mixed, along_y[..., 1]], axis=-2), nan=0.0)
    own = columns.reshape(-1, 3, 2)[inside].swapaxes(1, 2)
    known = footprint(middle, own, curving.reshape(-1, 3, 3)[inside], 1 / count)
    for ours, theirs in zip(found, known, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=ROUND_OFF)


def test_slopes_are_those_of_beams():
    view = kc.pictures.View(20, 12, math.radians(90))
    sky, steps = view.directions(np.arange(20.0), np.arange(12.0)[:, None])
    beams = kc.trace_beams(CAMERA, sky)
    known = np.stack(polar_basis(beams.direction), axis=-1) @ pixel_matrix(beams, sky, steps)
    np.testing.assert_allclose(slopes(beams, sky, steps), known, rtol=1e-9, atol=ROUND_OFF)
