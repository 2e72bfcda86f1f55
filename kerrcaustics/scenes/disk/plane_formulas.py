"""Places of a disk in the parts of pixels, as JAX functions of one cell or one part: kernels are made of them.

Patches are those of coons_patches.py, by their polynomials; cells those of crossings.py.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.emitters import Fall, Motion, falling_motion, radial_momentum, static
from kerrcaustics.beams.kernels.programs import Number, Program
from kerrcaustics.beams.kernels.tables import Table, table_row
from kerrcaustics.scenes.map_formulas import POWERS, patch, polynomial

# Numbers of a cell in its table: x, y, its cover, coefficients (12, 2) of its patch, and (4, 5) of the extra values.
_CELL = 3 + 24 + 20
# Step of central differences over the radius, as a part of the radius.
_STEP = 1e-4


class PartGrid(NamedTuple):
    """Parts of the pixels of a picture."""

    width: Any
    """Of the picture, in pixels."""
    count: Any
    """Parts of a pixel each way."""


class Rims(NamedTuple):
    """Radii of a disk."""

    inner: Any
    outer: Any


class Matter(NamedTuple):
    """Motion of the matter of a disk."""

    spin: Any
    """Of the hole."""
    sense: Any
    """1 for prograde, -1 for retrograde motion, 0 at rest."""
    fall: Fall
    """The orbit from which it falls; with the radius 0 if it does not fall."""


class Clock(NamedTuple):
    """Times of the light, and of the pattern that emits it."""

    time: Any
    """Coordinate time of the camera, M."""
    delay: Any
    """1 if the travel time of light counts, else 0."""
    circles: Any
    """1 if the pattern circles with the disk, else 0."""


class SeenPart(NamedTuple):
    """A part of a pixel."""

    number: Any
    """Number of the part: parts row by row, in pixels row by row."""
    cell: Any
    """Number of the cell that it sees."""


def disk_cell(x: Any, y: Any, size: Any, cover: Any, data: Any, extra: Any) -> Any:
    """The numbers (47,) of a cell for `disk_sample`.

    Parameters: those of `DiskCells`, lengths in pixels; data (24,) and extra (20,) row by row.
    """
    scale = [size ** -(i + j) for i, j in POWERS]
    terms = [term * factor for term, factor in zip(polynomial(jnp.stack(data).reshape(12, 2)), scale, strict=True)]
    first, right, down, both = jnp.stack(extra).reshape(4, 5)
    means = [first, (right - first) / size, (down - first) / size, (both - down - right + first) / size**2]
    return jnp.concatenate([jnp.stack([x, y, cover]), *terms, *means])


def disk_sample(
    rims: Rims, matter: Matter, clock: Clock, grid: PartGrid, cells: Any, part: SeenPart
) -> tuple[Any, ...]:
    """The sample of a disk in the middle of a part of a pixel.

    Returns
    -------
    cover : fraction of the part of the pixel between the rims
    radius, azimuth, across, matrix (2, 2), redshift, time : as of `DiskSamples`, with the radius cut to the rims
    cosine : cosine of the angle between the light and the axis, as the matter measures it
    photon (4,) : b and q; the ratio for a source at rest at infinity; 1 where it moves outward, else 0
    """
    row, (x, y), side = table_row(cells, part.cell), _middle(grid, part.number), 1 / grid.count
    x, y = x - row[0], y - row[1]
    (place, azimuth), *slopes = patch(row[3:27].reshape(12, 2), x, y)
    along_x, along_y = (slope * side for slope in slopes)
    terms = row[27:].reshape(4, 5)
    at_infinity, b, q, outward, travel = terms[0] + x * terms[1] + y * (terms[2] + x * terms[3])
    later = jnp.stack([terms[1, 4] + y * terms[3, 4], terms[2, 4] + x * terms[3, 4]]) * side
    within = [covered_part(place - 1 / rim, along_x[0], along_y[0]) for rim in (rims.outer, rims.inner)]
    # Parts on a rim have the light of the disk at the rim.
    radius = jnp.minimum(jnp.maximum(1 / place, rims.inner), rims.outer)
    motion = _motion(matter, radius)
    along_radius = -(radius * radius) * jnp.stack([along_x[0], along_y[0]])
    rate, shear = _orbital(motion), _shear(matter, radius)
    emitted = clock.time - clock.delay * travel
    turned = jnp.where(clock.circles > 0.5, emitted, 0.0)
    along_azimuth = jnp.stack([along_x[1], along_y[1]]) + clock.delay * rate * later - shear * turned * along_radius
    ratio = _ratio(matter, motion, (b, q), radius, at_infinity, outward)
    cosine = jnp.sqrt(jnp.maximum(q, 0.0)) / radius * ratio / at_infinity
    return (
        row[2] * (within[0] - within[1]),
        radius,
        azimuth - rate * turned,
        (radius - rims.inner) / (rims.outer - rims.inner),
        jnp.stack([along_radius, radius * along_azimuth]),
        ratio,
        emitted,
        cosine,
        jnp.stack([b, q, at_infinity, outward]),
    )


def _middle(grid: PartGrid, number: Any) -> tuple[Any, Any]:
    """Place of the middle of a part, in pixels from the corner of the picture."""
    pixel, part = _division(number, grid.count * grid.count)
    (line, column), (down, right) = _division(pixel, grid.width), _division(part, grid.count)
    return column + (right + 0.5) / grid.count, line + (down + 0.5) / grid.count


def _division(number: Any, count: Any) -> tuple[Any, Any]:
    whole = jnp.floor(number / count)
    return whole, number - whole * count


def _motion(matter: Matter, radius: Any) -> Motion:
    moving, still = falling_motion(*matter[:1], radius, *matter[1:], jnp), static(matter.spin, radius, 0.0)
    return Motion(*(jnp.where(matter.sense == 0, rest, part) for rest, part in zip(still, moving, strict=True)))


def _orbital(motion: Motion) -> Any:
    """The rate dphi / dt of matter; 0 where the motion is impossible."""
    return jnp.where(jnp.isnan(motion.orbital), 0.0, motion.orbital)


def _shear(matter: Matter, radius: Any) -> Any:
    """The derivative of the rate of matter over the radius."""
    step = _STEP * radius
    farther, nearer = (_orbital(_motion(matter, radius + sign * step)) for sign in (1, -1))
    return (farther - nearer) / (2 * step)


def _ratio(matter: Matter, motion: Motion, light: Any, radius: Any, at_infinity: Any, outward: Any) -> Any:
    """The ratio nu_camera / nu_emitter, as by `redshift` in emitters.py."""
    momentum = jnp.where(outward > 0.5, -1.0, 1.0) * radial_momentum(matter.spin, light, radius, jnp)
    measured = 1 - motion.orbital * light[0] - motion.radial * momentum
    return at_infinity * jnp.sqrt(jnp.where(motion.slowness > 0, motion.slowness, jnp.nan)) / measured


def covered_part(over: Any, x: Any, y: Any) -> Any:
    """The part of a square in which a linear function is positive, an integral over a trapezoid.

    over: value of the function in the middle; x, y: its changes along the sides.
    """
    x, y = jnp.abs(x), jnp.abs(y)
    large, small = jnp.maximum(jnp.maximum(x, y), 1e-300), jnp.minimum(x, y)
    small = jnp.maximum(small, 1e-4 * large)

    def ramp(z: Any) -> Any:
        return jnp.maximum(z, 0.0) ** 2

    outer, inner = (large + small) / 2, (large - small) / 2
    integral = ramp(over + outer) - ramp(over + inner) - ramp(over - inner) + ramp(over - outer)
    part = integral / jnp.maximum(2 * large * small, 1e-300)
    return jnp.where(over >= outer, 1.0, jnp.where(over <= -outer, 0.0, part))


# Kinds of numbers in the signatures of kernels.
_ONE: Any = Number.OF_CALL
_EACH: Any = Number.OF_RAY


def programs() -> dict[str, Program]:
    """The kernels of disks by their names."""
    call = Rims(_ONE, _ONE), Matter(_ONE, _ONE, Fall(_ONE, _ONE, _ONE)), Clock(_ONE, _ONE, _ONE), PartGrid(_ONE, _ONE)
    return {
        "covered_part": Program(covered_part, (_EACH, _EACH, _EACH)),
        "disk_cell": Program(disk_cell, (_EACH, _EACH, _EACH, _EACH, (_EACH,) * 24, (_EACH,) * 20)),
        "disk_sample": Program(disk_sample, (*call, Table(_CELL), SeenPart(_EACH, _EACH))),
    }
