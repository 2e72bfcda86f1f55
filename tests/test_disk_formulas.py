"""Kernels of disks and colours: they are their JAX functions, and do what is done step by step elsewhere."""

import math

import jax
import numpy as np
import pytest
from marks import few

from kerrcaustics.beams.emitters import EMITTERS, redshift
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.kernels.trees import leaves
from kerrcaustics.scenes import colour_formulas
from kerrcaustics.scenes.colour import shifted_light
from kerrcaustics.scenes.coons_patches import weights_at
from kerrcaustics.scenes.disk import emission_formulas, plane_formulas
from kerrcaustics.scenes.disk.texture import TexturePyramid
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.settings import settings_of_programs

COUNT, WIDTH, PARTS = 40, 8, 2
SPIN, INNER, OUTER = 0.7, 4.0, 14.0
PROGRAMS = colour_formulas.programs() | emission_formulas.programs() | plane_formulas.programs()
TIME, STILL = (3.0, 1.0, 1.0), (0.0, 1.0, 0.0)


@pytest.fixture
def random():
    return np.random.default_rng(8)


def cells(random):
    """Columns of cells two pixels wide, one for each place of a picture, as their kernel takes them."""
    # 1 / r falls across some rims.
    place = random.uniform(0.05, 0.27, (COUNT, 12, 2)) * [1.0, 10.0]
    place[:, 4:] = 0.02 * random.normal(size=(COUNT, 8, 2))
    extra = random.uniform(0.5, 1.5, (COUNT, 4, 5))
    corner = np.stack([np.arange(COUNT) % 4 * 2.0, np.arange(COUNT) // 4 * 2.0])
    cover = random.uniform(0.5, 1.0, COUNT)
    return [*corner, np.full(COUNT, 2.0), cover, place.reshape(-1, 24), extra.reshape(-1, 20)]


def parts(random, which):
    """Numbers of parts of pixels in some cells, and their places (2, n) there."""
    within = random.integers(0, 2 * PARTS, (2, len(which)))
    x, y = (which % 4 * 2 * PARTS + within[0]), (which // 4 * 2 * PARTS + within[1])
    pixel, part = y // PARTS * WIDTH + x // PARTS, y % PARTS * PARTS + x % PARTS
    return (pixel * PARTS**2 + part).astype(float), (within + 0.5) / (2 * PARTS)


def matter(motion):
    """The numbers of a motion."""
    if motion == "plunging":
        last = kerr.isco(SPIN)
        return SPIN, 1, last, *kerr.circular_constants(SPIN, last)
    return SPIN, {"static": 0, "circular": 1, "retrograde": -1}[motion], 0.0, 1.0, 0.0


def inputs(random):
    """For each kernel: its numbers, its columns as its function takes them, and its tables."""
    which = random.integers(0, COUNT, COUNT)
    table = kernel("disk_cell").on_rays((), cells(random))
    spot = [random.uniform(0, 1, COUNT), random.uniform(-9, 9, COUNT), random.uniform(4, 14, COUNT)]
    spot.append(0.3 * random.normal(size=(COUNT, 4)))
    pyramids = {channels: TexturePyramid.from_picture(random.uniform(size=(13, 30, channels))) for channels in (1, 3)}
    colours = np.sort(random.uniform(-3, 3, (20, 3)), axis=0)
    pictures = {
        f"texture_{channels}": ((13.0, 30.0, float(len(one.levels)), 10.0), spot, list(one))
        for channels, one in pyramids.items()
    }
    call = INNER, OUTER, *matter("plunging"), *TIME, WIDTH, PARTS
    return {
        "black_body": ((6.0, 11.0, 19.0, 0.1, 0.2, 0.3), [10 ** random.uniform(2, 6, COUNT)], [colours]),
        "covered_part": ((), list(random.uniform(-1, 1, (3, COUNT))), []),
        "disk_cell": ((), cells(random), []),
        "disk_sample": (call, [parts(random, which)[0], which.astype(float)], [table]),
        "paint": ((5.0, 40.0, 0.16, 0.1, 0.2, 0.3, 10.0), spot, [random.uniform(size=(5, 12))]),
        "thin_disk_flux": ((0.0, 2.5, 1.7, 1e-17, -1.7, 1.0, 0.0, 1.2), [random.uniform(5, 20, COUNT)], []),
        **pictures,
    }


def tree_of(arguments, values):
    """Numbers, tables and columns in the places of a program's arguments."""
    return jax.tree.unflatten(jax.tree.structure(arguments), values)


def test_all_kernels_are_tried(random):
    assert set(inputs(random)) == set(PROGRAMS)


@pytest.mark.parametrize("name", few(PROGRAMS, ("covered_part", "texture_3", "thin_disk_flux")))
def test_kernels_are_their_functions(name, random):
    numbers, columns, tables = inputs(random)[name]
    function, arguments = PROGRAMS[name]
    own = [part for column in columns for part in (column[:, None] if column.ndim == 1 else column).T]

    def of_row(*row):
        # In all of them the numbers of the call come first, then its tables.
        return function(*tree_of(arguments, [*numbers, *tables, *row]))

    with settings_of_programs():
        rows = jax.vmap(of_row)(*own)
    found = kernel(name).on_rays(numbers, columns, tables=tables)
    for ours, theirs in zip(leaves(found), leaves(rows), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("motion", ["static", "circular", "retrograde", "plunging"])
@pytest.mark.parametrize("clock", [TIME, STILL])
def test_parts_see_what_patches_say(motion, clock, random):
    columns, which = cells(random), random.integers(0, COUNT, COUNT)
    number, place = parts(random, which)
    call = INNER, OUTER, *matter(motion), *clock, WIDTH, PARTS
    table = kernel("disk_cell").on_rays((), columns)
    found = kernel("disk_sample").on_rays(call, (number, which), tables=[table])
    _, radius, azimuth, across, matrix, ratio, emitted, cosine, photon = found
    weights = weights_at(*place)
    data, extra = columns[4].reshape(-1, 12, 2)[which], columns[5].reshape(-1, 4, 5)[which]
    value, *slopes = (np.einsum("nkc,kn->nc", data, part) for part in weights[:3])
    slopes = np.stack(slopes, axis=2) / (2 * PARTS)
    known, *late = (np.einsum("nkc,kn->nc", extra, part) for part in weights[3:])
    late = np.stack([part[:, 4] for part in late], axis=1) / (2 * PARTS)
    seen = np.clip(1 / value[:, 0], INNER, OUTER)
    np.testing.assert_allclose(radius, seen, rtol=1e-12)
    np.testing.assert_allclose(across, (seen - INNER) / (OUTER - INNER), atol=1e-12)
    np.testing.assert_allclose(photon, known[:, [1, 2, 0, 3]], rtol=1e-12)
    np.testing.assert_allclose(emitted, clock[0] - known[:, 4], rtol=1e-12, atol=1e-12)
    rate = EMITTERS[motion](SPIN, seen, 0.0).orbital + 0 * seen
    shear = (EMITTERS[motion](SPIN, seen + 1e-5, 0.0).orbital - EMITTERS[motion](SPIN, seen - 1e-5, 0.0).orbital) / 2e-5
    np.testing.assert_allclose(azimuth, value[:, 1] - clock[2] * rate * emitted, atol=1e-10)
    along_radius = -(seen[:, None] ** 2) * slopes[:, 0]
    along_azimuth = slopes[:, 1] + rate[:, None] * late - clock[2] * (shear * emitted)[:, None] * along_radius
    np.testing.assert_allclose(matrix[:, 0], along_radius, atol=1e-10)
    np.testing.assert_allclose(matrix[:, 1], seen[:, None] * along_azimuth, atol=2e-5)
    light = (known[:, 1], known[:, 2]), (seen, 0.0), known[:, 0], known[:, 3] > 0.5
    np.testing.assert_allclose(ratio, redshift(EMITTERS[motion], SPIN, *light), rtol=1e-10)
    np.testing.assert_allclose(cosine, np.sqrt(known[:, 2]) / seen * ratio / known[:, 0], rtol=1e-10)


def test_covered_part_of_a_square():
    rng = np.random.default_rng(3)
    within = (np.arange(400) + 0.5) / 400 - 0.5
    x, y = np.meshgrid(within, within)
    lines = rng.uniform(-1, 1, (20, 3))
    found = kernel("covered_part").on_rays((), list(lines.T))
    for part, (over, along_x, along_y) in zip(found, lines, strict=True):
        assert part == pytest.approx(np.mean(over + along_x * x + along_y * y > 0), abs=2e-3)
    whole_and_none = kernel("covered_part").on_rays((), [np.array([1.0, -1.0]), np.zeros(2), np.zeros(2)])
    assert whole_and_none == pytest.approx([1, 0])


def test_a_picture_is_linear_between_its_pixels():
    light = np.arange(12.0).reshape(3, 4, 1)
    pyramid = TexturePyramid.from_picture(light)
    assert pyramid.levels.tolist() == [[0, 3, 4], [12, 2, 2], [16, 1, 1]]
    # Middles of pixels from the inner rim up; between the last and the first of a row; beyond the outer rim's middle.
    across, turns = np.array([1 / 6, 5 / 6, 1 / 2, 1.0]), np.array([1 / 8, 3 / 8, 0.0, 9 / 8])
    found = pyramid.finest_values(across, 2 * math.pi * turns)[:, 0]
    assert found == pytest.approx([8, 1, (4 + 7) / 2, 0], abs=1e-9)


def test_temperatures_that_are_no_number_have_no_colour():
    light = shifted_light(np.array([1.0, np.nan]), True, True)
    assert light[0] == pytest.approx([1, 1, 1]) and np.isnan(light[1]).all()
