"""The map of a picture to the sky, as JAX functions of one pixel or of one cell: kernels are made of them.

Patches are those of coons_patches.py, by their polynomials; footprints those of footprint.py; cells of sky_cells.py.
"""

from typing import Any

import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import Number, Program
from kerrcaustics.beams.kernels.tables import Table, table_row
from kerrcaustics.spacetime.sphere import polar_basis, tangent_basis

# Places where rays check patches, in units of the cell: its middle, and the middles of two edges.
_CHECKS = ((0.5, 0.5), (0.5, 0.0), (0.0, 0.5))
# Numbers of a cell in its table: x, y, the coefficients (12, 3) of its patch, and second derivatives (3, 3).
_CELL = 2 + 36 + 9


def cell_polynomials(x: Any, y: Any, size: Any, data: Any, curving: Any) -> Any:
    """The numbers (47,) of a cell for `square_footprint`: x, y, coefficients of its patch in pixels, and its curving.

    Parameters: those of `SkyCells`; data (36,) and curving (9,) row by row.
    """
    scale = [size ** -(i + j) for i, j in POWERS]
    terms = [term * factor for term, factor in zip(polynomial(jnp.stack(data).reshape(12, 3)), scale, strict=True)]
    return jnp.concatenate([jnp.stack([x, y]), *terms, jnp.stack(curving)])


# Powers (i, j) of x and y in the terms of a patch.
POWERS = [(i, j) for j in (0, 1) for i in range(4)] + [(i, j) for j in (2, 3) for i in (0, 1)]


def polynomial(data: Any) -> list[Any]:
    """The coefficients (k,) of the terms of a patch of data (12, k): those of x^i y^j, in the order of `POWERS`."""
    value, along_x, along_y = data[:4], data[4:8], data[8:]

    def cubic(slope: Any, first: int, last: int) -> tuple[Any, Any]:
        """Coefficients of the square and of the cube on an edge between two corners."""
        rise, both = value[last] - value[first], slope[first] + slope[last]
        return 3 * rise - slope[first] - both, both - 2 * rise

    (lower_2, lower_3), (upper_2, upper_3) = cubic(along_x, 0, 1), cubic(along_x, 2, 3)
    (left_2, left_3), (right_2, right_3) = cubic(along_y, 0, 2), cubic(along_y, 1, 3)
    twist = along_x[2] - along_x[0] + along_y[1] - along_y[0] - (value[3] - value[2] - value[1] + value[0])
    first = [value[0], along_x[0], lower_2, lower_3, along_y[0], twist, upper_2 - lower_2, upper_3 - lower_3]
    return [*first, left_2, right_2 - left_2, left_3, right_3 - left_3]


def patch(c: Any, x: Any, y: Any) -> tuple[Any, Any, Any]:
    """The value (k,) of a patch with coefficients c (12, k) at a place, and its derivatives along x and y."""
    by_y = [c[k] + x * (c[k + 1] + x * (c[k + 2] + x * c[k + 3])) for k in (0, 4)]
    by_y += [c[k] + x * c[k + 1] for k in (8, 10)]
    slopes = [c[k + 1] + x * (2 * c[k + 2] + (3 * x) * c[k + 3]) for k in (0, 4)]
    value = by_y[0] + y * (by_y[1] + y * (by_y[2] + y * by_y[3]))
    along_y = by_y[1] + y * (2 * by_y[2] + (3 * y) * by_y[3])
    return value, slopes[0] + y * (slopes[1] + y * (c[9] + y * c[11])), along_y


def square_footprint(side: Any, aspect: Any, cells: Any, x: Any, y: Any, cell: Any) -> tuple[Any, Any, Any]:
    """n' (3,), the matrix (2, 2) and the bend of the footprint of a square of a pixel at a place in a cell.

    Parameters: the side of the square, in pixels; `aspect` as of `footprint`; the table of `cell_polynomials`; the
    place, and the cell's number.
    """
    (value, along_x, along_y), curving = _in_cell(cells, x, y, cell)
    direction = value / _length(value)
    return direction, *footprint(direction, along_x * side, along_y * side, curving * side**2, aspect)


def drift(cells: Any, x: Any, y: Any, cell: Any) -> Any:
    """The value (3,) of a patch at a place in a cell; parameters as for `square_footprint`."""
    return _in_cell(cells, x, y, cell)[0][0]


def _in_cell(cells: Any, x: Any, y: Any, cell: Any) -> tuple[tuple[Any, Any, Any], Any]:
    """Value and derivatives of a patch by `patch`, per pixel, and the second derivatives (3, 3)."""
    row = table_row(cells, cell)
    place = x - row[0] + 0.5, y - row[1] + 0.5
    return patch(row[2:38].reshape(12, 3), *place), row[38:].reshape(3, 3)


def slopes(direction: Any, jacobian: Any, sky: Any, steps: Any) -> Any:
    """Changes (3, 2) of n' for a pixel with a direction N and steps (3, 2), by the Jacobian (2, 2) of its beam."""
    first, second = (jnp.stack(e) for e in polar_basis(jnp.stack(direction), jnp))
    basis = tangent_basis(jnp.stack(sky), jnp)
    columns = []
    for k in range(2):
        tangent = [sum(e[i] * steps[2 * i + k] for i in range(3)) for e in basis]
        image = [jacobian[2 * i] * tangent[0] + jacobian[2 * i + 1] * tangent[1] for i in range(2)]
        columns.append(first * image[0] + second * image[1])
    return jnp.stack(columns, axis=-1)


def part_footprint(count: Any, aspect: Any, slopes: Any, direction: Any, number: Any) -> tuple[Any, Any]:
    """The matrix (2, 2) and the bend of the footprint of one of count x count parts of a pixel, row by row.

    Parameters: `aspect` as of `footprint`; a table of slopes (3, 2) per part, NaN where nothing is seen; n' of the
    part; its number in the table.
    """
    line = jnp.floor(number / count)
    column, row = number - line * count, line - jnp.floor(line / count) * count
    along_x, along_y = (_rate(slopes, number, place, count, step) for place, step in ((column, 1.0), (row, count)))
    second = jnp.stack([along_x[:, 0], (along_x[:, 1] + along_y[:, 0]) / 2, along_y[:, 1]])
    # Next to parts that see nothing, second derivatives are unknown and count as 0.
    curving = jnp.where(jnp.isnan(second), 0.0, second)
    own = table_row(slopes, number).reshape(3, 2)
    return footprint(jnp.stack(direction), own[:, 0], own[:, 1], curving, aspect)


def _rate(table: Any, number: Any, place: Any, count: Any, step: Any) -> Any:
    """Change (3, 2) of rows from neighbour to neighbour, at a place in a line of `count`."""
    before, after = jnp.where(place > 0, 1.0, 0.0), jnp.where(place < count - 1, 1.0, 0.0)
    rise = table_row(table, number + after * step) - table_row(table, number - before * step)
    return (rise / jnp.maximum(before + after, 1.0)).reshape(3, 2)


def footprint(direction: Any, along_x: Any, along_y: Any, curving: Any, aspect: Any) -> tuple[Any, Any]:
    """The matrix (2, 2) and the bend of the footprint of a pixel.

    Parameters: n' (3,), its steps (3,) along x and y, and its second derivatives (3, 3) along xx, xy and yy; the ratio
    of the axes beyond which it is widened.
    """
    e_theta, e_phi = polar_basis(direction, jnp)
    a, b, c, d = _matrix(e_theta, e_phi, along_x, along_y)
    cos, sin = major_turn(a, b, c, d)
    spread = _bend(curving, e_phi * cos - e_theta * sin)
    return jnp.stack([a, b, c, d]).reshape(2, 2), jnp.maximum(spread, _axes(a, b, c, d)[0] / aspect)


def _matrix(e_theta: Any, e_phi: Any, along_x: Any, along_y: Any) -> list[Any]:
    return [jnp.sum(basis * step) for basis in (e_theta, e_phi) for step in (along_x, along_y)]


def major_turn(a: Any, b: Any, c: Any, d: Any) -> tuple[Any, Any]:
    """Cosine and sine of the angle from the first axis to the major one, of the image of a circle by [[a, b], [c, d]].

    Either end of the axis is as good: from the cosine and the sine of twice the angle.
    """
    even, odd = a * a - d * d + b * b - c * c, 2 * (a * c + b * d)
    length = jnp.sqrt(even * even + odd * odd)
    cosine, sine = (jnp.where(length > 0, part / length, at_0) for part, at_0 in ((even, 1.0), (odd, 0.0)))
    larger = jnp.sqrt((1 + jnp.abs(cosine)) / 2)
    # The smaller one from the sine: its own half-angle formula loses digits near 0.
    smaller = sine / (2 * larger)
    return jnp.where(cosine > 0, larger, smaller), jnp.where(cosine > 0, smaller, larger)


def _axes(a: Any, b: Any, c: Any, d: Any) -> tuple[Any, Any]:
    """Major and minor axis of the image of a circle by [[a, b], [c, d]]."""
    even, odd = _length(jnp.stack([a + d, c - b])), _length(jnp.stack([a - d, c + b]))
    return (even + odd) / 2, jnp.abs(even - odd) / 2


def _bend(curving: Any, across: Any) -> Any:
    """As `bend` in footprint.py."""
    xx, xy, yy = (jnp.sum(curving[k] * across) for k in range(3))
    return jnp.sqrt((xx * xx + 2 * xy * xy + yy * yy) / 8)


def cell(size: Any, places: Any, slopes: Any, corners: Any) -> tuple[Any, ...]:
    """A cell from the beams at its corners, before rays check it.

    Parameters: size, in pixels; tables of n' and of its slopes (3, 2) at corners; the numbers of its four corners.

    Returns
    -------
    data (12, 3), curving (3, 3), extent : as of `SkyCells`
    scale (2, 3) : as of `cell_scale`
    doubt : estimated error of its patch, pixels
    checked (3, 3) : n' at the places where rays check the patch
    """
    place = [table_row(places, corner) for corner in corners]
    slope = [table_row(slopes, corner).reshape(3, 2) for corner in corners]
    columns = [[steps[:, k] for steps in slope] for k in range(2)]
    data = jnp.stack(place + [step * size for column in columns for step in column])
    rates = [[(s[1] - s[0] + s[3] - s[2]) / (2 * size), (s[2] - s[0] + s[3] - s[1]) / (2 * size)] for s in columns]
    curving = jnp.stack([rates[0][0], (rates[1][0] + rates[0][1]) / 2, rates[1][1]])
    terms = polynomial(data)
    scale, _ = _scale(data, terms, curving, size)
    checked = [value / _length(value) for value in (patch(terms, *place)[0] for place in _CHECKS)]
    doubt = jnp.maximum(*(_length(_product(scale, miss)) for miss in _doubts(data, terms)))
    squares = [jnp.sum(step * step) for step in data[4:]]
    extent = jnp.sqrt(jnp.maximum(_most(squares[:4]), _most(squares[4:])))
    return data, curving, extent, scale, doubt, jnp.stack(checked)


def cell_scale(size: Any, data: Any, curving: Any) -> tuple[Any, Any]:
    """The matrix (2, 3) from displacements of n' in the middle of a cell to pixels, and n' (3,) there.

    Parameters: those of `SkyCells`.
    """
    data, curving = jnp.stack(data).reshape(12, 3), jnp.stack(curving).reshape(3, 3)
    return _scale(data, polynomial(data), curving, size)


def _scale(data: Any, terms: Any, curving: Any, size: Any) -> tuple[Any, Any]:
    value, along_x, along_y = patch(terms, 0.5, 0.5)
    middle = value / _length(value)
    e_theta, e_phi = polar_basis(middle, jnp)
    matrix = [element / size for element in _matrix(e_theta, e_phi, along_x, along_y)]
    cos, sin = major_turn(*matrix)
    along, across = e_theta * cos + e_phi * sin, e_phi * cos - e_theta * sin
    major, minor = _axes(*matrix)
    least = jnp.minimum(minor, _least_minor(data) / size)
    # A pixel on a critical curve covers a folded strip of the sky: errors are measured by the width of the strip.
    width = _length(jnp.stack([least, _bend(curving, across)]))
    return jnp.stack([along / major, across / width]), middle


def _least_minor(data: Any) -> Any:
    """The smallest minor axis at the corners, for the whole cell; 0 where a critical curve passes between."""
    minors = []
    for k in range(4):
        first, second = data[4 + k], data[8 + k]
        area = jnp.sum(jnp.cross(first, second) * data[k])
        a, b, c = jnp.sum(first * first), jnp.sum(first * second), jnp.sum(second * second)
        minors.append(area / jnp.sqrt((a + c + _length(jnp.stack([a - c, 2 * b]))) / 2))
    least, most = -_most([-minor for minor in minors]), _most(minors)
    return jnp.where(least * most > 0, -_most([-jnp.abs(minor) for minor in minors]), 0.0)


def _most(values: list[Any]) -> Any:
    return jnp.maximum(jnp.maximum(values[0], values[1]), jnp.maximum(values[2], values[3]))


def _doubts(data: Any, terms: Any) -> list[Any]:
    """As `doubts` in coons_patches.py: the middle (3,) by either diagonal, less that by the edges."""
    value, x, y = data[:4], data[4:8], data[8:]
    middle = patch(terms, 0.5, 0.5)[0]
    return [
        (value[i] + value[j]) / 2 + (sign * (x[i] - x[j]) + y[i] - y[j]) / 8 - middle
        for i, j, sign in ((0, 3, 1), (1, 2, -1))
    ]


def _product(rows: Any, vector: Any) -> Any:
    return jnp.stack([jnp.sum(row * vector) for row in rows])


def _length(vector: Any) -> Any:
    return jnp.sqrt(jnp.sum(vector * vector))


# Kinds of numbers in the signatures of kernels.
_ONE: Any = Number.OF_CALL
_EACH: Any = Number.OF_RAY
_VECTOR = (_EACH,) * 3


def programs() -> dict[str, Program]:
    """The kernels of maps by their names."""
    in_cell = Table(_CELL), _EACH, _EACH, _EACH
    return {
        "cell": Program(cell, (_ONE, Table(3), Table(6), (_EACH,) * 4)),
        "cell_polynomials": Program(cell_polynomials, (_EACH, _EACH, _EACH, (_EACH,) * 36, (_EACH,) * 9)),
        "cell_scale": Program(cell_scale, (_EACH, (_EACH,) * 36, (_EACH,) * 9)),
        "drift": Program(drift, in_cell),
        "part_footprint": Program(part_footprint, (_ONE, _ONE, Table(6), _VECTOR, _EACH)),
        "slopes": Program(slopes, (_VECTOR, (_EACH,) * 4, _VECTOR, (_EACH,) * 6)),
        "square_footprint": Program(square_footprint, (_ONE, _ONE, *in_cell)),
    }
