"""Guesses of the arcs of a disc's limb on the camera sky.

If no caustic reaches the disc, each of its images is a small closed curve, and certified images of a few points of the
limb give the guesses. Else the limb is followed in the way of the tracks of stars (level_curves/).
"""

import math
from dataclasses import replace

import numpy as np

from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.extended_sources.arcs.boundary_arcs import GUESSED
from kerrcaustics.extended_sources.sheets.limb import GuessedArcs
from kerrcaustics.images.search import ImageSearch, search
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.lens_map.sky_chart import Chart, chart_difference, chart_of
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.level_curves.links import Links, plain_cost
from kerrcaustics.numerics.matching import best_matches
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.cubic_curves import Cubics
from kerrcaustics.spacetime.sphere import flattened

Array = np.ndarray

# Points of the limb of a disc that no caustic reaches.
_POINTS = 12
# Misfit of the step between images of neighbouring points, below which they belong to one image.
_SURE = 0.3
# Parts of a link at which arcs are guessed.
_PARTS = (GUESSED + 1) / 2


def from_level_curve(branches: Branches) -> GuessedArcs:
    """Guesses along the links of a level curve."""
    links, nodes = branches.links, branches.nodes
    kinds, cubics = branches.kinds(links), branches.cubics(links)
    start, stop = nodes.sky[links.left], nodes.sky[links.right]
    at_fold = (nodes.event[links.left] >= 0) | (nodes.event[links.right] >= 0)
    return GuessedArcs(links, at_fold, start, stop, _guess(branches.chart, kinds, cubics))


def _guess(chart: Chart, kinds: Int[Array, " arcs"], cubics: Cubics) -> Float[Array, "arcs guesses 3"]:
    """Directions along cubic curves in the coordinates of the chart."""
    return np.stack([chart.sky(kinds, cubics.points(np.full(len(kinds), part))) for part in _PARTS], axis=1)


def without_caustic(
    sheets: Sheets, circle: Circle, extra_places: Float[Array, "places 3"]
) -> tuple[GuessedArcs | None, ImageSearch]:
    """Guesses for a disc that no caustic reaches, and the search for images of other places and of its limb.

    The guesses are None where the images are not certain.
    """
    longitude = 2 * math.pi * np.arange(_POINTS) / _POINTS
    searched = search(sheets, np.concatenate([extra_places, circle.place(longitude)]))
    images = searched.images[searched.images.star >= len(extra_places)]
    images = replace(images, star=images.star - len(extra_places))
    counts = searched.counts[len(extra_places) :]
    if not searched.certified[len(extra_places) :].all() or (counts != counts[0]).any():
        return None, searched
    beams = beams_of_directions(
        sheets.camera, images.sky, "auto", TOLERANCE, end=sheets.surface, crossings=False, redshift=False
    )
    east = math.sin(circle.angle) * circle.upward_and_east(beams.direction)[1]
    drift = beams.pulled_back(images.sky, flattened(beams.direction, east)) * (2 * math.pi / _POINTS)
    chart = chart_of(sheets.camera)
    place, rate = chart.place(images.index, images.sky), chart.rate(images.index, images.sky, drift)
    following = _following(images.star, images.index, place, rate)
    if following is None:
        return None, searched
    kind = images.index
    cubics = Cubics(place, chart_difference(kind, place, place[following]), rate, rate[following])
    guess = _guess(chart, kind, cubics)
    p, none = longitude[images.star], np.zeros(len(kind))
    links = Links(np.arange(len(kind)), following, kind, none, none, p, p + 2 * math.pi / _POINTS)
    return GuessedArcs(links, np.zeros(len(kind), bool), images.sky, images.sky[following], guess), searched


def _following(
    star: Int[Array, " images"],
    index: Int[Array, " images"],
    place: Float[Array, "images 3"],
    rate: Float[Array, "images 3"],
) -> Int[Array, " images"] | None:
    """The continuation of each image at the next point of the limb; None if it is ambiguous, or does not close."""
    following = np.full(len(star), -1)
    for k in np.unique(index).tolist():
        columns = [np.flatnonzero((star == i) & (index == k)) for i in range(_POINTS)]
        for first, second in zip(columns, columns[1:] + columns[:1], strict=True):
            kinds = np.full((len(first), len(second)), k)
            step = chart_difference(kinds, place[first][:, None], place[second][None])
            cost = plain_cost(step, rate[first][:, None], rate[second][None], np.zeros(kinds.shape))
            rows, chosen = best_matches(cost)
            best = cost[rows, chosen]
            cost[rows, chosen] = np.inf
            if (best > _SURE).any() or (best > _SURE * cost.min(axis=1)).any():
                return None
            following[first] = second[chosen]
        last = columns[0]
        for _ in range(_POINTS):
            last = following[last]
        if (last != columns[0]).any():
            return None
    return following
