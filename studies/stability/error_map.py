"""The map of the study stability: true over reported errors of the default engine.

Over spin, radius, and distance of the rays from the shadow edge.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr

from .checks import HONEST
from .comparison import OTHERS, against_truth, compared_with_truth
from .problems import LEAST_DISTANCE, Problem, Sky, at_distance, edge_scale, mixed

# 1 - a of the holes.
GAPS = (1.0, 0.1, 1e-3, 1e-6, 1e-9, 1e-12)
# r / r_+ - 1 of the cameras.
HEIGHTS = (1e-6, 1e-4, 1e-2, 0.3, 3.0, 100.0, 1e6)
# Of the rays from the shadow edge, in units of `edge_scale`; infinite: from anywhere on the sky, as in `mixed`.
DISTANCES = (math.inf, 1e-3, 1e-6, 1e-9)
_RAYS, _TRUTHS = 64, 2
_TOLERANCE = 1e-10


class Cell(NamedTuple):
    """Largest ratios of true to reported error of a camera's rays at one distance from the shadow edge.

    gap: 1 - a.
    height: r / r_+ - 1.
    distance: from the shadow edge, in units of its angular radius; infinite for rays from anywhere.
    velocity: of the camera.
    truths: number of rays whose truth is known.
    ratio: of n'; NaN without a truth.
    j_ratio: of J; NaN without a truth, or where no error below 1 is claimed.
    """

    gap: float
    height: float
    distance: float
    velocity: str
    truths: int
    ratio: float
    j_ratio: float


def cells(gaps: Sequence[float], heights: Sequence[float], distances: Sequence[float] = DISTANCES) -> list[Cell]:
    """The map, for cameras on circular orbits or, where there are none, at rest with respect to the FIDO."""
    return [_cell(gap, height, distance) for distance in distances for gap in gaps for height in heights]


def _cell(gap: float, height: float, distance: float) -> Cell:
    spin = 1 - gap
    camera = kc.Camera(spin, kerr.horizon(spin) * (1 + height))
    rng = np.random.default_rng(0)
    problem = Problem("map", "", camera, _sky(camera, distance))
    sky = problem.sky(camera, _RAYS, rng)
    beams = kc.trace_beams(camera, sky, "auto", _TOLERANCE)
    other = kc.trace_beams(camera, sky, *OTHERS["auto"])
    known = compared_with_truth(problem, sky, {"auto": beams}, {"auto": other}, _TRUTHS, rng)
    row = against_truth(beams, known)
    # Where nothing is claimed, nothing is compared.
    ratios = [HONEST * row[name] or math.nan for name in ("ratio", "j_ratio")]
    return Cell(gap, height, distance, str(camera.velocity), row["truths"], *ratios)


def _sky(camera: kc.Camera, distance: float) -> Sky:
    """Directions at a distance from the edge, relative to its size."""
    return mixed if math.isinf(distance) else at_distance(max(distance * edge_scale(camera), LEAST_DISTANCE))
