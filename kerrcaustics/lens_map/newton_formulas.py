"""Newton's method on the sky map as JAX functions of one search: kernels are made of them (beams/kernels).

What newton.py does for many searches step by step, in one loop for each: beam, step, place. The beams are those of the
closed form; a search that needs others says so.
"""

import math
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.accuracy import is_mostly_noise
from kerrcaustics.beams.closed_form import formula
from kerrcaustics.beams.geometry import length
from kerrcaustics.beams.kernels.programs import ENDS, FRAME, SKY, SPHERICAL, Number, Program, named, with_end
from kerrcaustics.beams.kernels.tables import Table, table_row
from kerrcaustics.beams.ray_end import RayOutputs
from kerrcaustics.beams.vectors import dot
from kerrcaustics.lens_map import newton_limits as limits
from kerrcaustics.spacetime.sphere import polar_basis, tangent_parts


class Chart(NamedTuple):
    """The shadow edge about the direction to the hole, along which steps bend.

    bends: 0 for straight steps alone, else 1; size: the distance (radians) of the edge by position angle, in so many
    even pieces from -pi to pi: four powers of a cubic in a row, the highest first.
    """

    bends: Any
    pieces: Any
    size: Any


class NewtonTarget(NamedTuple):
    """The star and the image that a search is for.

    star: Unit vector of the star.
    index: Morse index of the image.
    """

    star: Any
    index: Any


class NewtonSearch(NamedTuple):
    """A search on its way.

    number: number of steps.
    state: state of the search, as in newton_limits.py.
    sky: best direction N.
    step: tangent that Newton's method asks for there.
    residual: residual of the best direction.
    error: error of the best direction, radians.
    part: part of the step that is tried next.
    trial: direction to which that leads.
    taken: part of the step from the best direction to the one tried.
    """

    number: Any
    state: Any
    sky: Any
    step: Any
    residual: Any
    error: Any
    part: Any
    trial: Any
    taken: Any


def root(frame: Any, start: Any, target: NewtonTarget, end: Any, chart: Chart, most: Any, *, on_equator: bool) -> Any:
    """The direction that shows a star, the error of it in radians, and the state in which the search has ended.

    Parameters: start, the first guess, three components; most: steps.
    """
    traced = partial(formula.trace, frame, end=end, outputs=RayOutputs(beams=True, index=True), on_equator=on_equator)

    def turn(now: NewtonSearch) -> NewtonSearch:
        return _next_search(now, traced(now.trial), target, partial(_stepped, frame, chart))

    # All of it depends on the ray.
    blank = 0.0 * start[0]
    none = (blank, blank, blank)
    first = NewtonSearch(blank, blank + limits.GOING, start, none, blank + math.inf, blank, blank + 1, start, blank)
    last = jax.lax.while_loop(lambda now: (now.state == limits.GOING) & (now.number < most), turn, first)
    return jnp.stack(last.sky), last.error, last.state


def _next_search(now: NewtonSearch, beam: Any, target: NewtonTarget, stepped: Any) -> NewtonSearch:
    """The search after the beam of its trial."""
    off, distance = _missed(now.trial, beam, target.star)
    error, minor = beam.error, jnp.abs(_minor_diameter(beam.jacobian))
    unsure = ~beam.closed_form | is_mostly_noise(beam, limits.TOLERANCE)
    # A linear map would bring n' closer by the part of the step that is taken; a third of that is asked for.
    allowed = (beam.index == target.index) & (distance < now.residual * (1 - now.taken / 3))
    settled = ~allowed & (now.residual < limits.MOST_ERRORS * error) & (now.part == 1)
    curving = limits.CURVING / jnp.minimum(minor, 1.0) ** 2
    left = distance**2 * jnp.maximum(limits.SAFETY * distance / now.residual**2, curving)
    last = allowed & (now.taken == 1) & (left <= error) & (distance > limits.ERRORS * error)
    done = settled | (allowed & (distance <= limits.ERRORS * error))
    sky, step = _either(allowed, now.trial, now.sky), _either(allowed, off, now.step)
    residual = jnp.where(allowed, distance, now.residual)
    known = jnp.where(allowed, (error + jnp.where(last, left, distance)) / minor, now.error)
    part = jnp.where(allowed, jnp.minimum(4 * now.part, 1.0), now.part / 4)
    going = (part > limits.SHORTEST_PART) & jnp.isfinite(residual) & jnp.isfinite(step[0] + step[1] + step[2])
    trial, taken = stepped(sky, step, part)
    ended = jnp.where(done | last, limits.FOUND, jnp.where(going, limits.GOING, limits.LOST))
    state = jnp.where(unsure, limits.UNSURE, ended)
    return NewtonSearch(
        now.number + 1, state, _either(last & going, trial, sky), step, residual, known, part, trial, taken
    )


def _missed(sky: Any, beam: Any, star: Any) -> tuple[Any, Any]:
    """The tangent of the sky that a linear map asks for, and the angle between a star and the end of the ray."""
    direction = beam.direction
    way = [star[i] - direction[..., i] for i in range(3)]
    chord = length(way)
    distance = 2 * jnp.arcsin(jnp.minimum(chord / 2, 1.0))
    first, second = (dot([e[..., i] for i in range(3)], way) for e in polar_basis(direction, jnp))
    size = jnp.hypot(first, second)
    longer = distance / jnp.where(size == 0, 1.0, size)
    first, second = first * longer, second * longer
    a, b, c, d = _entries(beam.jacobian)
    area = a * d - b * c
    u, v = (d * first - b * second) / area, (a * second - c * first) / area
    e_1, e_2 = tangent_parts(sky[0], sky[1], sky[2], jnp)
    off = tuple(u * one + v * other for one, other in zip(e_1, e_2, strict=True))
    return off, jnp.where(jnp.isfinite(distance), distance, math.inf)


def _minor_diameter(jacobian: Any) -> Any:
    a, b, c, d = _entries(jacobian)
    return (jnp.hypot(a + d, c - b) - jnp.hypot(a - d, c + b)) / 2


def _entries(matrix: Any) -> tuple[Any, ...]:
    return tuple(matrix[..., i, j] for i in (0, 1) for j in (0, 1))


def _stepped(frame: Any, chart: Chart, sky: Any, step: Any, part: Any) -> tuple[Any, Any]:
    """`Chart.stepped` of sky_chart.py."""
    size = length(step)
    straight = part / jnp.maximum(size / limits.LONGEST, 1.0)
    angle = size * straight
    ahead = straight * jnp.where(angle == 0, 1.0, jnp.sin(angle) / jnp.where(angle == 0, 1.0, angle))
    great = _unit([n * jnp.cos(angle) + ahead * s for n, s in zip(sky, step, strict=True)])

    toward, along = _by_hole(frame, sky), _by_hole(frame, step)
    across = jnp.hypot(toward[1], toward[2])
    turned, away = jnp.arctan2(toward[2], toward[1]), jnp.arctan2(across, -toward[0])
    edge, slope = _edge(chart, turned)
    beyond = jnp.maximum(away - edge, limits.NEAREST)
    depth = jnp.log((math.pi - edge) / beyond)
    safe = jnp.maximum(across, 1e-150)
    outward = along[0] * safe - toward[0] * (toward[1] * along[1] + toward[2] * along[2]) / safe
    turning = (toward[1] * along[2] - toward[2] * along[1]) / safe**2
    deepening = -slope * turning / (math.pi - edge) - (outward - slope * turning) / beyond
    bent = (chart.bends > 0.5) & (depth > limits.DEEP) & (size > limits.STRAIGHT)
    longest = jnp.maximum(jnp.abs(turning) / limits.LONGEST_TURN, jnp.abs(deepening) / limits.LONGEST_DEPTH)
    short = part / jnp.maximum(longest, 1.0)
    turned, deeper = turned + turning * short, jnp.minimum(jnp.maximum(depth + deepening * short, 0.0), limits.DEEPEST)
    edge, _ = _edge(chart, turned)
    away = edge + (math.pi - edge) * jnp.exp(-deeper)
    sight = (-jnp.cos(away), jnp.sin(away) * jnp.cos(turned), jnp.sin(away) * jnp.sin(turned))
    beside = _unit([dot(row, sight) for row in frame.basis])
    return _either(bent, beside, great), jnp.where(bent, short, straight)


def _by_hole(frame: Any, sky: Any) -> tuple[Any, ...]:
    """Components along r, theta, phi of vectors on the sky of a camera at rest."""
    return tuple(dot([row[j] for row in frame.basis], sky) for j in range(3))


def _edge(chart: Chart, angle: Any) -> tuple[Any, Any]:
    """Distance of the shadow edge at a position angle, and its slope."""
    place = (angle + math.pi) / (2 * math.pi)
    place = (place - jnp.floor(place)) * chart.pieces
    piece = jnp.minimum(jnp.floor(place), chart.pieces - 1)
    ahead = (place - piece) * (2 * math.pi / chart.pieces)
    row = table_row(chart.size, piece)
    a, b, c, d = (row[i] for i in range(4))
    return ((a * ahead + b) * ahead + c) * ahead + d, (3 * a * ahead + 2 * b) * ahead + c


def _unit(vector: Any) -> tuple[Any, ...]:
    size = length(vector)
    return tuple(part / size for part in vector)


def _either(flag: Any, one: Any, other: Any) -> tuple[Any, ...]:
    return tuple(jnp.where(flag, a, b) for a, b in zip(one, other, strict=True))


def programs() -> dict[str, Program]:
    """The kernels by their names."""
    one, each, made = Number.OF_CALL, Number.OF_RAY, {}
    target, chart = NewtonTarget((each,) * 3, each), Chart(one, one, Table(4))
    for place, equator in product(SPHERICAL, (False, True)):
        function = with_end(partial(root, on_equator=equator), place, 3)
        made[f"{named('root', equator=equator)}_{place}"] = Program(
            function, (FRAME, SKY, target, ENDS[place], chart, one)
        )
    return made
