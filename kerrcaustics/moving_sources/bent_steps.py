"""Steps on the sky that bend with the shadow edge, along which images of higher index lie in thin layers.

Near the edge a direction is held by its position angle and its part of the distance of the edge, elsewhere by itself.
"""

import numpy as np
from jaxtyping import Bool, Float

from kerrcaustics.lens_map.sky_chart import Chart
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# Parts of the distance of the shadow edge, from the direction to the hole, between which steps bend.
_NEAR = (0.4, 2.5)


def near_edge(chart: Chart, sky: Float[Array, "n 3"]) -> Bool[Array, " n"]:
    """True for directions beside the shadow edge."""
    part = chart.polar(sky)[:, 1]
    return (part > _NEAR[0]) & (part < _NEAR[1])


def bent_step(chart: Chart, sky: Float[Array, "n 3"], step: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Directions after tangent steps."""
    ahead = sky + step
    ahead = ahead / lengths(ahead)[:, None]
    place, rate = chart.polar(sky), chart.polar_rate(sky, step)
    bends = near_edge(chart, sky) & (place[:, 1] + rate[:, 1] > 0)
    return np.where(bends[:, None], chart.from_polar(place + rate), ahead)


def carried(
    chart: Chart, sky: Float[Array, "n 3"], step: Float[Array, "n 3"], to: Float[Array, "n 3"]
) -> Float[Array, "n 3"]:
    """Tangents at directions, as tangents at others: beside the edge with the same turn and part."""
    bent = chart.drift(to, chart.polar_rate(sky, step))
    return np.where((near_edge(chart, sky) & near_edge(chart, to))[:, None], bent, step)


def between(
    chart: Chart,
    ends: tuple[Float[Array, "n 3"], Float[Array, "n 3"]],
    slopes: tuple[Float[Array, "n 3"], Float[Array, "n 3"]],
    part: Float[Array, " n"],
) -> Float[Array, "n 3"]:
    """Directions on curves of third order between ends with given slopes, at parts 0 to 1 of the way."""
    (one, other), (rise, fall) = ends, slopes
    first, last, begin, end = hermite(part)
    flat = first[:, None] * one + last[:, None] * other + begin[:, None] * rise + end[:, None] * fall
    flat = flat / lengths(flat)[:, None]
    start, stop = chart.polar(one), chart.polar(other)
    # The short way round.
    stop[:, 0] = start[:, 0] + np.remainder(stop[:, 0] - start[:, 0] + np.pi, 2 * np.pi) - np.pi
    place = first[:, None] * start + last[:, None] * stop
    place += begin[:, None] * chart.polar_rate(one, rise) + end[:, None] * chart.polar_rate(other, fall)
    bends = near_edge(chart, one) & near_edge(chart, other) & (place[:, 1] > 0)
    place[~bends] = start[~bends]
    return np.where(bends[:, None], chart.from_polar(place), flat)


def hermite(part: Float[Array, " n"]) -> tuple[Array, Array, Array, Array]:
    """Weights of the values at both ends, and of the slopes there."""
    rest = 1 - part
    return rest * rest * (1 + 2 * part), part * part * (3 - 2 * part), part * rest * rest, -part * part * rest


def bent_way(chart: Chart, one: Float[Array, "n 3"], other: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """The tangent steps that lead from directions to others: the inverse of `bent_step`."""
    step = chart.polar(other) - chart.polar(one)
    step[:, 0] = np.remainder(step[:, 0] + np.pi, 2 * np.pi) - np.pi
    straight = other - one * (one * other).sum(axis=1)[:, None]
    bends = near_edge(chart, one) & near_edge(chart, other)
    return np.where(bends[:, None], chart.drift(one, step), straight)
