"""Images of stars in cells of a map, as JAX functions of one part, or one search: kernels are made of them.

The map of a cell to the celestial sphere is a pair of polynomials of the place in it, x and y from 0 to 1
(cell_search.py). Tables of a call have a row for each cell, each part of one, and each star.
"""

from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import Number, Program
from kerrcaustics.beams.kernels.tables import Table, table_row
from kerrcaustics.spacetime.sphere import polar_basis

# Factor between the bounds of a part and those of its samples.
_SLACK = 1.3
# Ratio of the largest to the smallest determinant above which the map of a cell is bent.
_BENT = 3.0
# Smallest number of parts of a bent cell.
_PARTS_OF_BENT = 16.0
# Smallest number of parts of a cell that the map folds.
_PARTS_OF_FOLDED = 64.0
# Largest number of parts of a cell that is only long.
_LONGEST = 16.0
# Length (cells) of a Newton step below which a search ends.
_LAST = 1e-4
# Distance (cells) from the middle of a cell beyond which a search is given up: it rarely returns.
_LOST = 1.0
# Largest number of Newton steps.
_STEPS = 20
# Length (cells) to which Newton steps are cut.
_LONGEST_STEP = 0.5
# Length (cells) of the last Newton step below which a search has converged.
_SOLVED = 1e-3


class CellTables(NamedTuple):
    """Tables of the maps of cells.

    maps: (cells, 36) coefficients (12, 3) of n' by x^i y^j: i = 0 to 3 for j = 0 and 1, then i = 0 and 1 for j = 2, 3.
    rates: (cells, 36) their change over an exposure. One row of zeros if nothing moves.
    """

    maps: Any
    rates: Any


class CellSteps(NamedTuple):
    """State of a search for a star.

    number: number of steps.
    x, y: place in the cell, from 0 to 1.
    length: length of the last step, cells.
    """

    number: Any
    x: Any
    y: Any
    length: Any


def _rows(table: Any, cell: Any) -> Any:
    return table_row(table, jnp.floor(cell)).reshape(12, -1)


def _value(c: Any, x: Any, y: Any) -> Any:
    """Values (k,) of polynomials with coefficients (12, k)."""
    first, second = (c[k] + x * (c[k + 1] + x * (c[k + 2] + x * c[k + 3])) for k in (0, 4))
    return first + y * (second + y * (c[8] + x * c[9] + y * (c[10] + x * c[11])))


def _slopes(c: Any, x: Any, y: Any) -> tuple[Any, Any]:
    """Slopes (k,) along x and y of polynomials with coefficients (12, k)."""
    first, second = (c[k + 1] + x * (2 * c[k + 2] + x * (3 * c[k + 3])) for k in (0, 4))
    linear = c[4] + x * (c[5] + x * (c[6] + x * c[7]))
    along_y = linear + y * (2 * (c[8] + x * c[9]) + y * (3 * (c[10] + x * c[11])))
    return first + y * (second + y * (c[9] + y * c[11])), along_y


def _size(vector: Any) -> Any:
    return jnp.sqrt((vector * vector).sum())


def division(maps: Any, cell: Any) -> Any:
    """Numbers (2,) of parts of a cell along x and y, not rounded; parts are about as long as wide on the sky."""
    c = _rows(maps, cell)
    areas, lengths = [], jnp.zeros(2)
    for x, y in [(i / 2, j / 2) for j in range(3) for i in range(3)]:
        along_x, along_y = _slopes(c, x, y)
        areas.append((_value(c, x, y) * jnp.cross(along_x, along_y)).sum())
        lengths = lengths + jnp.stack([_size(along_x), _size(along_y)])
    least, most = reduce(jnp.minimum, areas), reduce(jnp.maximum, areas)
    small, large = reduce(jnp.minimum, map(jnp.abs, areas)), reduce(jnp.maximum, map(jnp.abs, areas))
    bent = jnp.where(large > _BENT * small, _PARTS_OF_BENT, 1.0)
    x, y = jnp.maximum(lengths, 1e-300)
    ratio = jnp.minimum(jnp.maximum(y / x, 1 / _LONGEST), _LONGEST)
    count = jnp.maximum(jnp.where(least * most <= 0, _PARTS_OF_FOLDED, bent), jnp.maximum(ratio, 1 / ratio))
    return jnp.sqrt(jnp.stack([count / ratio, count * ratio]))


def bounds(cells: CellTables, cell: Any, x: Any, y: Any, half_x: Any, half_y: Any) -> Any:
    """Row (11,) of a part: cell, middle x, y, and its bounds on the sphere.

    The bounds are a disc, by its centre n' (3,) and its radius, and a strip, by its normal (3,) and half its width.
    half_x, half_y: half of the part's sides.
    """
    c, rates = _rows(cells.maps, cell), _rows(cells.rates, cell)
    middle = _value(c, x, y)
    steps = [(i, j) for j in (-1, 0, 1) for i in (-1, 0, 1) if (i, j) != (0, 0)]
    offsets = [_value(c, x + i * half_x, y + j * half_y) - middle for i, j in steps]
    farthest, radius = offsets[0], _size(offsets[0])
    for offset in offsets[1:]:
        size = _size(offset)
        farthest, radius = jnp.where(size > radius, offset, farthest), jnp.maximum(size, radius)
    side = jnp.cross(middle, farthest)
    side = side / jnp.maximum(_size(side), 1e-300)
    # Samples underestimate the width of a short, bent part: the square of the radius is added to it.
    width = reduce(jnp.maximum, [jnp.abs((offset * side).sum()) for offset in offsets])
    drift = _size(_value(rates, x, y)) / 2
    radius, width = radius + drift, width + drift
    width = _SLACK * (width + (_SLACK - 1) * radius * radius)
    return jnp.stack([cell, x, y, *(middle / _size(middle)), _SLACK * radius, *side, width])


def is_near(parts: Any, stars: Any, part: Any, star: Any) -> Any:
    """True if a star may lie in a part."""
    bound, n = table_row(parts, jnp.floor(part))[3:], table_row(stars, jnp.floor(star))[:3]
    return (_size(n - bound[:3]) <= bound[3]) & (jnp.abs((n * bound[4:7]).sum()) <= bound[7])


def image(over: Any, cells: CellTables, parts: Any, stars: Any, part: Any, star: Any) -> tuple[Any, Any, Any, Any]:
    """The image of a star in a cell, by Newton's method from the middle of a part.

    Parameters
    ----------
    over : length by which an image may lie beyond the cell's sides, cells
    cells, parts : tables of the cells, and of their parts by `bounds`
    stars : table of n' (3,) and of moments of the exposure, from -1/2 to 1/2
    part, star : numbers of rows

    Returns
    -------
    True if the search converged at an image; its place (2,) in the cell; steps (2, 3) of n' along the cell's sides;
    True if their cross product is along n'
    """
    cell, x, y = table_row(parts, jnp.floor(part))[:3]
    row = table_row(stars, jnp.floor(star))
    across = jnp.stack(polar_basis(row[:3], jnp))
    # Both components of the miss are zero where n' is the star's direction.
    miss = (_rows(cells.maps, cell) + row[3] * _rows(cells.rates, cell)) @ across.T

    def newton_step(state: CellSteps) -> CellSteps:
        (u, v), ((a, c), (b, d)) = _value(miss, state.x, state.y), _slopes(miss, state.x, state.y)
        det = a * d - b * c
        det = jnp.where(jnp.abs(det) > 1e-300, det, 1e-300)
        x, y = (b * v - d * u) / det, (c * u - a * v) / det
        length = jnp.sqrt(x * x + y * y)
        part = jnp.minimum(1.0, _LONGEST_STEP / jnp.maximum(length, 1e-300))
        return CellSteps(state.number + 1, state.x + part * x, state.y + part * y, length)

    def distance(state: CellSteps) -> Any:
        return jnp.maximum(jnp.abs(state.x - 0.5), jnp.abs(state.y - 0.5))

    def is_running(state: CellSteps) -> Any:
        return (state.number < _STEPS) & (state.length > _LAST) & (distance(state) < _LOST)

    last = jax.lax.while_loop(is_running, newton_step, CellSteps(0 * x, x, y, 0 * x + jnp.inf))
    is_found = (distance(last) <= 0.5 + over) & (last.length < _SOLVED)
    (a, c), (b, d) = slopes = _slopes(miss, last.x, last.y)
    return is_found, jnp.stack([last.x, last.y]), jnp.stack(slopes) @ across, a * d > b * c


def programs() -> dict[str, Program]:
    """The kernels of searches by their names."""
    each: Any = Number.OF_RAY
    cells, parts, stars = CellTables(Table(36), Table(36)), Table(11), Table(4)
    return {
        "cell_division": Program(division, (Table(36), each)),
        "part_bounds": Program(bounds, (cells, each, each, each, each, each)),
        "star_near": Program(is_near, (parts, stars, each, each)),
        "star_image": Program(image, (Number.OF_CALL, cells, parts, stars, each, each)),
    }
