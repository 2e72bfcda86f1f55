"""Formulas of searches for stars, and of directions of pixels and charts: kernels, JAX, and what they promise."""

import math
from itertools import product

import jax
import numpy as np
import pytest
from marks import few

import kerrcaustics as kc
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.kernels.programs import Number
from kerrcaustics.beams.kernels.tables import Table
from kerrcaustics.beams.kernels.trees import leaves
from kerrcaustics.scenes import cell_formulas, direction_formulas
from kerrcaustics.scenes.sky_charts import CapChart, EdgeChart
from kerrcaustics.spacetime.sphere import unit

PROGRAMS = cell_formulas.programs() | direction_formulas.programs()
CAMERAS = [kc.Camera(0.9, 6.0, 1.2, (0.3, -0.2, 0.5)), kc.Camera(0.0, 2.3), kc.Observer(spin=0.9, inclination=1.0)]
# As `CellTables` has them.
POWERS = [(i, j) for j in (0, 1) for i in range(4)] + [(i, j) for j in (2, 3) for i in (0, 1)]


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def random_maps(rng, count, size=0.3):
    """Maps of cells, some of them folded, as a table."""
    terms = size * rng.normal(size=(count, 12, 3)) / 2.0 ** np.array([3 * (i + j > 1) for i, j in POWERS])[:, None]
    terms[:, 0] = unit(rng.normal(size=(count, 3)))
    return terms.reshape(count, 36)


def mapped(rows, x, y):
    """Values (n, 3) of maps, a row (n, 36) each, at places."""
    terms = np.stack([x**i * y**j for i, j in POWERS], axis=-1)
    return (terms[:, None] @ rows.reshape(-1, 12, 3))[:, 0]


def parts_of(maps, rates, columns=4):
    """All parts of some cells, columns times columns of each."""
    cell, j, i = (axis.ravel() for axis in np.meshgrid(np.arange(len(maps)), *2 * [np.arange(columns)], indexing="ij"))
    half = np.full(len(cell), 0.5 / columns)
    places = cell, (i + 0.5) / columns, (j + 0.5) / columns, half, half
    return kernel("part_bounds").on_rays((), places, tables=[maps, rates])


def searches(rng):
    """Tables of cells, of their parts and of stars that lie in these; for each star its part, and all stars."""
    maps = random_maps(rng, 40)
    tables = maps, np.zeros((1, 36)), parts_of(maps, np.zeros((1, 36)))
    part = np.arange(len(tables[2]))
    cell, x, y = tables[2][:, :3].T
    stars = unit(mapped(maps[cell.astype(int)], *(at + rng.uniform(-0.12, 0.12, len(at)) for at in (x, y))))
    return *tables, np.column_stack([stars, np.zeros(len(stars))]), part


def inputs(name, rng):
    """Numbers, columns and tables of a kernel."""
    count = 301
    if name in ("cell_division", "part_bounds"):
        maps, rates = random_maps(rng, 20), 0.01 * random_maps(rng, 20)
        places = rng.integers(0, 20, count), *rng.uniform(0, 1, (2, count)), *rng.uniform(0, 0.3, (2, count))
        return ([], places, [maps, rates]) if name == "part_bounds" else ([], places[:1], [maps])
    if name.startswith("star"):
        maps, rates, parts, stars, part = searches(rng)
        columns = part, rng.permutation(part) if name == "star_near" else part
        return ([], columns, [parts, stars]) if name == "star_near" else ([0.1], columns, [maps, rates, parts, stars])
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    if name.startswith("view"):
        return [*axes.ravel(), 0.02, 40.0, 30.0], rng.uniform(0, 60, (2, count)), []
    frame = list(leaves(CAMERAS[0].frame()))
    if name == "aberrated":
        return frame, [*unit(rng.normal(size=(count, 3))).T, *rng.normal(size=(6, count))], []
    return [*frame, 384.0, 64.0, 0.35], rng.uniform(0, [[384], [300], [1], [0.3]], (4, count)), []


def by_jax(name, numbers, columns, tables):
    """The values of a program for all rows, leaf by leaf."""
    function, arguments = PROGRAMS[name]
    kinds, tree = jax.tree.flatten(arguments)

    def of_row(*row):
        of_ray, of_call, read = iter(row), iter(numbers), iter([jax.numpy.asarray(table) for table in tables])
        given = [
            next(read if isinstance(kind, Table) else of_call if kind is Number.OF_CALL else of_ray) for kind in kinds
        ]
        return function(*jax.tree.unflatten(tree, given))

    with jax.enable_x64(True):
        found = jax.vmap(of_row)(*(np.asarray(column, float) for column in columns))
        return [np.asarray(leaf) for leaf in jax.tree.leaves(found)]


@pytest.mark.parametrize("name", few(PROGRAMS, ("aberrated", "star_near", "view_fisheye")))
def test_kernels_have_the_values_of_jax(name, rng):
    numbers, columns, tables = inputs(name, rng)
    found = list(leaves(kernel(name).on_rays(numbers, columns, tables=tables)))
    for one, other in zip(found, by_jax(name, numbers, columns, tables), strict=True):
        # Searches stop at steps of 1e-4: round-off is multiplied beside folds.
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-9 if name == "star_image" else 1e-13)


def test_images_are_where_their_stars_are(rng):
    maps, rates, parts, stars, part = searches(rng)
    is_found, place, steps, positive = kernel("star_image").on_rays(
        [0.1], (part, part), tables=(maps, rates, parts, stars)
    )
    found = np.flatnonzero(is_found)
    assert np.abs(place[found] - 0.5).max() < 0.6
    assert len(found) > 0.8 * len(part)
    rows, (x, y) = maps[parts[part[found], 0].astype(int)], place[found].T
    assert np.abs(unit(mapped(rows, x, y)) - stars[found, :3]).max() < 1e-6
    ahead = [mapped(rows, x + i, y + j) - mapped(rows, x - i, y - j) for i, j in ((1e-5, 0), (0, 1e-5))]
    change = np.stack(ahead, axis=1) / 2e-5
    # Across the direction of the star.
    across = change - (change @ stars[found, :3, None]) * stars[found, None, :3]
    assert steps[found] == pytest.approx(across, abs=1e-6)
    sense = np.vecdot(np.cross(across[:, 0], across[:, 1]), stars[found, :3])
    assert (positive[found] == (sense > 0))[np.abs(sense) > 1e-6].all()


def test_parts_lie_within_their_bounds(rng):
    maps, rates = random_maps(rng, 30), 0.02 * random_maps(rng, 30)
    parts = parts_of(maps, rates)
    cell = parts[:, 0].astype(int)
    for i, j, moment in product(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5), (-0.5, 0.5)):
        x, y = parts[:, 1] + i / 8, parts[:, 2] + j / 8
        n = unit(mapped(maps[cell] + moment * rates[cell], x, y))
        # Two of a hundred of these maps, which are bent more than those of pictures, do not.
        within = np.linalg.norm(n - parts[:, 3:6], axis=1) <= parts[:, 6]
        assert within.mean() > 0.97
        assert (np.abs(np.vecdot(n, parts[:, 7:10])) <= parts[:, 10])[within].mean() > 0.97


def test_parts_are_about_as_long_as_wide_and_folds_have_more(rng):
    rows = np.zeros((3, 12, 3))
    rows[:, 0, 0] = 1
    # Along x eight times as long as along y; round; and folded along x.
    rows[0, 1, 1], rows[0, 4, 2] = 0.08, 0.01
    rows[1, 1, 1], rows[1, 4, 2] = 0.01, 0.01
    rows[2, 1, 1], rows[2, 2, 1], rows[2, 4, 2] = 0.01, -0.01, 0.007
    wanted = kernel("cell_division").on_rays((), [np.arange(3)], tables=[rows.reshape(3, 36)])
    assert wanted[0] == pytest.approx([8, 1], rel=0.01)
    assert wanted[1] == pytest.approx([1, 1], rel=0.01)
    assert np.prod(wanted[2]) == pytest.approx(64)


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("kind", ["edge", "cap"])
def test_charts_lead_there_and_back(camera, kind, rng):
    edge = EdgeChart(camera, 3e-4, 1e-3)
    chart = edge if kind == "edge" else CapChart(camera, edge)
    x, y = rng.uniform(1, chart.width - 2, 200), rng.uniform(1, chart.height - 2, 200)
    sky, steps = chart.directions(x, y)
    assert np.abs(chart.places(sky) - np.stack([x, y], axis=-1)).max() < 1e-6
    for k, (i, j) in enumerate(((1e-4, 0), (0, 1e-4))):
        change = (chart.directions(x + i, y + j)[0] - chart.directions(x - i, y - j)[0]) / 2e-4
        assert steps[..., k] == pytest.approx(change, abs=1e-9 + 1e-5 * np.abs(change).max())


@pytest.mark.parametrize("projection", ["pinhole", "fisheye", "equirectangular"])
def test_steps_of_views_are_their_slopes(projection, rng):
    view = kc.pictures.View(60, 40, 2.0, projection, (0.3, 0.2, 0.5), (0.1, 0.9, 0.2))
    # The middle too, where a fisheye has series.
    x, y = (np.append(rng.uniform(-1, side, 200), (side - 1) / 2 + offset) for side, offset in ((60, 0.0), (40, 1e-3)))
    sky, steps = view.directions(x, y)
    assert np.linalg.norm(sky, axis=1) == pytest.approx(1, abs=1e-14)
    for k, (i, j) in enumerate(((1e-3, 0), (0, 1e-3))):
        change = (view.directions(x + i, y + j)[0] - view.directions(x - i, y - j)[0]) / 2e-3
        assert steps[..., k] == pytest.approx(change, abs=1e-9)
    assert view.directions(3.0, 4.0)[0].shape == (3,) and view.directions(np.zeros((2, 1)), 4.0)[1].shape == (
        2,
        1,
        3,
        2,
    )
    assert math.isclose(view.solid_angle(view.directions(3.0, 4.0)[1]), view.pixel_sizes(3.0, 4.0), rel_tol=1e-12)
