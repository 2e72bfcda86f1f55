"""Light of skies in footprints, as JAX functions of one footprint: kernels are made of them (beams/kernels)."""

import math
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.kernels.programs import Number, Program
from kerrcaustics.beams.kernels.tables import Table, table_row
from kerrcaustics.scenes.map_formulas import major_turn
from kerrcaustics.spacetime.sphere import polar_basis

# Numbers of probes along the major axis, from which a footprint takes the next larger one.
_PROBES = (1, 3, 5, 9, 17, 33)
# Distance of the outermost probes from the middle, standard deviations.
_DEVIATIONS = 2.0
# Distance, in major axes, that no probe or box exceeds.
_REACH = 2.1
# Ratio of that distance to the radius of the circle of latitude below which the circle counts as straight.
_STRAIGHT = 0.05


class Smoothing(NamedTuple):
    """Parameters of the average of a sky over footprints, the same in a call.

    finest: size below which the sky has no detail, radians.
    aspect: ratio of the axes beyond which footprints are widened.
    longest: length at which axes are cut, radians.
    deviation: standard deviation of a pixel's filter, pixels.
    """

    finest: Any
    aspect: Any
    longest: Any
    deviation: Any


class Beam(NamedTuple):
    """A footprint.

    direction: (3,) n' of the middle.
    matrix: (4,) elements of its matrix by rows, radians per pixel.
    bend: as of `Footprint`, radians.
    """

    direction: Any
    matrix: Any
    bend: Any


class Ellipse(NamedTuple):
    """The ellipse over which a sky is averaged.

    major, minor: axes, radians.
    ahead: (3,) unit tangent along the major axis.
    """

    major: Any
    minor: Any
    ahead: Any


class Swatches(NamedTuple):
    """Swatches on the sphere.

    rows: number of swatches from pole to pole.
    columns: number of swatches once round.
    gap: part of a swatch's period that is a gap.
    by_longitude: 1 if colours change along phi', 0 if along theta'.
    background: (3,) colour of the gaps.
    table: (swatches + 1, 12): for each swatch along the coordinate with the colours the integrals (2, 3) of the colours
        of both parities, above the background, up to its start, in swatches, and then the colours (2, 3) themselves.
    """

    rows: Any
    columns: Any
    gap: Any
    by_longitude: Any
    background: Any
    table: Any


class Pyramid(NamedTuple):
    """A picture of the sphere (sphere_pyramid.py).

    rows: number of rows of its finest level.
    count: number of levels.
    orientation: rotation (3, 3) from its axes to those of the sky.
    pixels: (pixels, channels) light of all levels.
    levels: (levels, 2) number of the first pixel, and rows.
    """

    rows: Any
    count: Any
    orientation: Any
    pixels: Any
    levels: Any


def ellipse(beam: Beam, smoothing: Smoothing) -> Ellipse:
    """The ellipse of a footprint, no longer than `longest`, no finer than `finest` or than the aspect allows."""
    (a, b, c, d), direction = beam.matrix, jnp.stack(beam.direction)
    even, odd = _length(a + d, c - b), _length(a - d, c + b)
    cos, sin = major_turn(a, b, c, d)
    major = jnp.maximum(jnp.minimum((even + odd) / 2, smoothing.longest), smoothing.finest)
    minor = jnp.minimum(_length((even - odd) / 2, beam.bend), smoothing.longest)
    e_theta, e_phi = polar_basis(direction, jnp)
    ahead = e_theta * cos + e_phi * sin
    return Ellipse(major, jnp.maximum(jnp.maximum(minor, smoothing.finest), major / smoothing.aspect), ahead)


def averaged(
    sky: Callable[[Any, Any], Any], beam: Beam, over: Ellipse, deviation: Any, channels: int, skipped: Any = False
) -> Any:
    """Colours (channels,) of a sky, averaged over an ellipse by probes along its major axis.

    Parameters
    ----------
    sky : function
        Of a direction (3,) and a size: colours (channels,), averaged over a round neighbourhood with a standard
        deviation of `deviation` times the size.
    beam, over : Beam, Ellipse
    deviation : float
    channels : int
    skipped : flag
        True if the colours are not needed: they are then NaN.

    Notes
    -----
    Probes have the size of the minor axis, are no further apart than it, and are weighted by a Gaussian whose variance
    is the excess of the major axis.
    """
    spread = deviation * jnp.sqrt(jnp.maximum(over.major**2 - over.minor**2, 0.0))
    least = 1 + jnp.ceil(2 * _DEVIATIONS * spread / over.minor - 0.5)
    count = jnp.asarray(float(_PROBES[-1]))
    for fewer in reversed(_PROBES[:-1]):
        count = jnp.where(least <= fewer, float(fewer), count)
    is_one = count == 1
    size = jnp.where(is_one, jnp.sqrt(over.minor * over.major), over.minor)
    first = jnp.where(is_one, 0.0, -_DEVIATIONS)
    step = jnp.where(is_one, 0.0, 2 * _DEVIATIONS / jnp.maximum(count - 1, 1.0))
    turn = _turning(step * spread)
    middle, ahead = _turning(first * spread)(jnp.stack(beam.direction), over.ahead)

    def probe(state: Any) -> Any:
        number, middle, ahead, weight, ratio, weights, light = state
        light = light + weight * sky(middle, size)
        # Ratios of a Gaussian's values at equal steps have a constant ratio.
        return number + 1, *turn(middle, ahead), weight * ratio, ratio * jnp.exp(-step * step), weights + weight, light

    ratio = jnp.exp(-step * (first + step / 2))
    start = (0.0, middle, ahead, 1.0, ratio, 0.0, jnp.zeros(channels))
    last = jnp.where(skipped, 0.0, count)
    *_, weights, light = jax.lax.while_loop(lambda state: state[0] < last, probe, start)
    return light / weights


def _turning(angle: Any) -> Callable[[Any, Any], tuple[Any, Any]]:
    """Return the rotation of a direction (3,) by an angle toward a tangent (3,), which turns with it."""
    cos, sin = jnp.cos(angle), jnp.sin(angle)
    return lambda middle, ahead: (cos * middle + sin * ahead, cos * ahead - sin * middle)


def _length(x: Any, y: Any) -> Any:
    return jnp.sqrt(x * x + y * y)


def _angles(direction: Any) -> tuple[Any, Any, Any]:
    """The angles theta' and phi' of a direction, and the sine of theta'."""
    x, y, z = direction
    across = _length(x, y)
    return jnp.arctan2(across, z), jnp.arctan2(y, x), across


def swatches_light(board: Swatches, smoothing: Smoothing, beam: Beam) -> Any:
    """Light (3,) of swatches in a footprint; that of its middle if it sees one swatch alone, or gaps alone."""
    over = ellipse(beam, smoothing)
    is_plain, plain = _plain_light(board, beam, over)

    def sky(middle: Any, size: Any) -> Any:
        # A box of this half width has the required deviation.
        return _box_light(board, middle, jnp.maximum(smoothing.deviation * math.sqrt(3) * size, 1e-9))

    mean = averaged(sky, beam, over, smoothing.deviation, 3, is_plain)
    # Round-off may make a black swatch negative.
    return jnp.maximum(jnp.where(is_plain, plain, mean), 0.0)


def _plain_light(board: Swatches, beam: Beam, over: Ellipse) -> tuple[Any, Any]:
    """True if a footprint sees one swatch alone, or gaps alone; and the colour (3,) in its middle."""
    theta, phi, across = _angles(beam.direction)
    reach, per_radian = _REACH * over.major, _swatches_per_radian(board)
    place = theta * per_radian[0], phi * per_radian[1]
    # Depth in the swatch, or negative in the gap beyond it, in rows and columns.
    depth = [0.5 - board.gap / 2 - jnp.abs(along - jnp.floor(along) - 0.5) for along in place]
    reaches = reach * per_radian[0], reach * per_radian[1] / across
    on_swatch, on_gap = ([sign * part > far for part, far in zip(depth, reaches, strict=True)] for sign in (1, -1))
    swatch = on_swatch[0] & on_swatch[1]
    coloured, alternating = _ordered(board, *place)
    colours = table_row(board.table, _swatch_part(board, coloured)[0])[6:].reshape(2, 3)
    colour = jnp.where(alternating - 2 * jnp.floor(alternating / 2) < 1, colours[0], colours[1])
    is_plain = (reach < _STRAIGHT * across) & (swatch | on_gap[0] | on_gap[1])
    return is_plain, jnp.stack(board.background) + jnp.where(swatch, colour, 0.0)


def _box_light(board: Swatches, direction: Any, half: Any) -> Any:
    """Mean colours (3,) over a box in theta' and phi' with a half width (radians)."""
    theta, phi, across = _angles(direction)
    half_phi, per_radian = jnp.minimum(half / across, math.pi), _swatches_per_radian(board)
    # The part of a box beyond a pole is left out.
    rows = [angle * per_radian[0] for angle in (jnp.maximum(theta - half, 0.0), jnp.minimum(theta + half, math.pi))]
    columns = [angle * per_radian[1] for angle in (phi - half_phi, phi + half_phi)]
    coloured, alternating = zip(*(_ordered(board, *ends) for ends in zip(rows, columns, strict=True)), strict=True)
    (low, first), (high, last) = (_integral_of_colours(board, place) for place in coloured)
    before, after = (_integrals_of_parities(board, place) for place in alternating)
    scale = 1 / ((rows[1] - rows[0]) * (columns[1] - columns[0]))
    once = table_row(board.table, jnp.maximum(board.rows, board.columns))[:6]
    colours = (once * (last - first) + (high - low)).reshape(2, 3)
    even, odd = ((end - start) * scale for start, end in zip(before, after, strict=True))
    return jnp.stack(board.background) + even * colours[0] + odd * colours[1]


def _swatches_per_radian(board: Swatches) -> tuple[Any, Any]:
    return board.rows / math.pi, board.columns / (2 * math.pi)


def _ordered(board: Swatches, row: Any, column: Any) -> tuple[Any, Any]:
    """Places along both coordinates, the coordinate with the colours first."""
    by_longitude = board.by_longitude > 0.5
    return jnp.where(by_longitude, column, row), jnp.where(by_longitude, row, column)


def _swatch_part(board: Swatches, place: Any) -> tuple[Any, Any, Any]:
    """The swatch, the part of it, and the whole turns of a place along the coordinate with the colours."""
    count = jnp.where(board.by_longitude > 0.5, board.columns, board.rows)
    turns = jnp.floor(place / count)
    part = place - turns * count
    # Round-off may lead beyond the last swatch.
    swatch = jnp.minimum(jnp.floor(part), count - 1)
    return swatch, part - swatch, turns


def _integral_of_colours(board: Swatches, place: Any) -> tuple[Any, Any]:
    """Integral (6,) of the colours of both parities from the start of the turn, in swatches; and whole turns."""
    swatch, part, turns = _swatch_part(board, place)
    row = table_row(board.table, swatch)
    return row[:6] + row[6:] * _covered(board, part), turns


def _integrals_of_parities(board: Swatches, place: Any) -> tuple[Any, Any]:
    """Lengths of the swatches of even and of odd number between 0 and a place."""
    pairs = jnp.floor(place / 2)
    part, whole = place - 2 * pairs, pairs * (1 - board.gap)
    return whole + _covered(board, part), whole + _covered(board, part - 1)


def _covered(board: Swatches, part: Any) -> Any:
    """The length without gaps between the start of a swatch and a place in it."""
    past, whole = part - board.gap / 2, 1 - board.gap
    # Cheaper than `clip`, which treats NaN separately.
    return jnp.where(past > 0, jnp.where(past < whole, past, whole), 0.0)


def picture_light(picture: Pyramid, smoothing: Smoothing, beam: Beam, channels: int) -> Any:
    """Light (channels,) of a picture of the sphere in a footprint."""
    sky = partial(_neighbourhood_light, picture)
    return averaged(sky, beam, ellipse(beam, smoothing), smoothing.deviation, channels)


def _neighbourhood_light(picture: Pyramid, direction: Any, size: Any) -> Any:
    """Light (channels,) about a direction: linear within two levels, and between them."""
    theta, phi, _ = _angles(jnp.stack([jnp.stack(row) for row in picture.orientation]).T @ direction)
    turns = phi / (2 * math.pi)
    place = theta / math.pi, turns - jnp.floor(turns)
    level = jnp.log(jnp.maximum(size, 1e-9) * (picture.rows / math.pi)) / math.log(2)
    level = jnp.clip(level, 0.0, picture.count - 1)
    lower = jnp.maximum(jnp.minimum(jnp.floor(level), picture.count - 2), 0.0)
    fine, coarse = (_looked_up(picture, table_row(picture.levels, number), *place) for number in (lower, lower + 1))
    return fine + (level - lower) * (coarse - fine)


def _looked_up(picture: Pyramid, level: Any, down: Any, right: Any) -> Any:
    """Light (channels,) at parts of the height and width of a level, linear between pixels."""
    first, rows = level
    width = 2 * rows + 2
    y, x = down * rows + 0.5, right * (2 * rows) + 0.5
    i, j = jnp.minimum(jnp.floor(y), rows), jnp.minimum(jnp.floor(x), 2 * rows)
    v, u = y - i, x - j
    start = first + i * width + j
    corners = [table_row(picture.pixels, start + step) for step in (0, 1, width, width + 1)]
    upper, lower = corners[0] + u * (corners[1] - corners[0]), corners[2] + u * (corners[3] - corners[2])
    return upper + v * (lower - upper)


# Kinds of numbers in the signatures of kernels.
_ONE: Any = Number.OF_CALL
_EACH: Any = Number.OF_RAY
_SMOOTHING = Smoothing(*[_ONE] * 4)
_BEAM = Beam((_EACH,) * 3, (_EACH,) * 4, _EACH)


def programs() -> dict[str, Program]:
    """The kernels of skies by their names."""
    swatches = Swatches(_ONE, _ONE, _ONE, _ONE, (_ONE,) * 3, Table(12))
    kernels = {"swatches": Program(swatches_light, (swatches, _SMOOTHING, _BEAM))}
    for channels, dtype in product((1, 3), ("f4", "f2")):
        picture = Pyramid(_ONE, _ONE, ((_ONE,) * 3,) * 3, Table(channels, dtype), Table(2))
        function = partial(picture_light, channels=channels)
        kernels[f"picture_{channels}_{dtype}"] = Program(function, (picture, _SMOOTHING, _BEAM))
    return kernels
