"""Steps on the sky that bend with the shadow edge, along which images of higher index lie in thin layers.

The coordinates of a direction are its position angle and its part of the edge's distance near the edge, and the unit
vector itself elsewhere.
"""

import numpy as np

from kerrcaustics.lens_map.sky_chart import Chart
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.cubic_curves import Cubics
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# Parts of the distance of the shadow edge, from the direction to the hole, between which steps bend.
_NEAR = (0.4, 2.5)


def bent_step(chart: Chart, sky: Float[Array, "n 3"], step: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Directions after tangent steps."""
    ahead = sky + step
    ahead = ahead / lengths(ahead)[:, None]
    place, rate = chart.polar(sky), chart.polar_rate(sky, step)
    bends = _near_edge(place) & (place[:, 1] + rate[:, 1] > 0)
    return np.where(bends[:, None], chart.from_polar(place + rate), ahead)


def bent_way(chart: Chart, first: Float[Array, "n 3"], second: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """The tangent steps that lead from directions to others: the inverse of `bent_step`."""
    start, step = _polar_way(chart, first, second)
    straight = second - first * (first * second).sum(axis=1)[:, None]
    return np.where(_both_near(start, step)[:, None], chart.drift(first, step), straight)


def carried(
    chart: Chart, sky: Float[Array, "n 3"], step: Float[Array, "n 3"], to: Float[Array, "n 3"]
) -> Float[Array, "n 3"]:
    """Tangents at directions, carried to other directions; near the edge with the same rates of angle and part."""
    bent = chart.drift(to, chart.polar_rate(sky, step))
    return np.where(_both_near(*_polar_way(chart, sky, to))[:, None], bent, step)


def directions_on_cubics(
    chart: Chart,
    ends: tuple[Float[Array, "n 3"], Float[Array, "n 3"]],
    slopes: tuple[Float[Array, "n 3"], Float[Array, "n 3"]],
    part: Float[Array, " n"],
) -> Float[Array, "n 3"]:
    """Directions at parts 0 to 1 of cubic curves between ends with given slopes."""
    (first, second), (rise, fall) = ends, slopes
    flat = Cubics(first, second - first, rise, fall).points(part)
    flat = flat / lengths(flat)[:, None]
    start, step = _polar_way(chart, first, second)
    place = Cubics(start, step, chart.polar_rate(first, rise), chart.polar_rate(second, fall)).points(part)
    bends = _both_near(start, step) & (place[:, 1] > 0)
    place[~bends] = start[~bends]
    return np.where(bends[:, None], chart.from_polar(place), flat)


def _polar_way(chart: Chart, first: Float[Array, "n 3"], second: Float[Array, "n 3"]) -> tuple[Array, Array]:
    """(angle, part) of directions, and the steps in both to others, the short way round."""
    start = chart.polar(first)
    step = chart.polar(second) - start
    step[:, 0] = np.remainder(step[:, 0] + np.pi, 2 * np.pi) - np.pi
    return start, step


def _near_edge(place: Float[Array, "n 2"]) -> Bool[Array, " n"]:
    """True for directions beside the shadow edge."""
    return (place[:, 1] > _NEAR[0]) & (place[:, 1] < _NEAR[1])


def _both_near(start: Float[Array, "n 2"], step: Float[Array, "n 2"]) -> Bool[Array, " n"]:
    return _near_edge(start) & _near_edge(start + step)
