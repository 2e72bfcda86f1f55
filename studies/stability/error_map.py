"""The map of the study stability: true over reported errors of the default engine, over spin and radius."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr

from .checks import HONEST
from .comparison import OTHERS, against_truth, compared_with_truth
from .problems import Problem, mixed

# 1 - a, and r / r_+ - 1, of the cameras.
GAPS = (1.0, 0.1, 1e-3, 1e-6, 1e-9, 1e-12)
HEIGHTS = (1e-6, 1e-4, 1e-2, 0.3, 3.0, 100.0, 1e6)
_RAYS, _TRUTHS = 64, 2
_TOLERANCE = 1e-10


class Cell(NamedTuple):
    """A camera in the plane of the map, and its largest ratios of true to reported error, of n' and of J.

    truths: so many rays are compared; the ratios of none are NaN.
    """

    gap: float
    height: float
    velocity: str
    truths: int
    ratio: float
    j_ratio: float


def cells(gaps: Sequence[float], heights: Sequence[float]) -> list[Cell]:
    """The map, for cameras on circular orbits or, where there are none, at rest with respect to the FIDO."""
    return [_cell(gap, height) for gap in gaps for height in heights]


def _cell(gap: float, height: float) -> Cell:
    spin = 1 - gap
    camera = kc.Camera(spin, kerr.horizon(spin) * (1 + height))
    rng = np.random.default_rng(0)
    problem = Problem("map", "", camera, mixed)
    sky = mixed(camera, _RAYS, rng)
    beams = kc.trace_beams(camera, sky, "auto", _TOLERANCE)
    other = kc.trace_beams(camera, sky, *OTHERS["auto"])
    known = compared_with_truth(problem, sky, {"auto": beams}, {"auto": other}, _TRUTHS, rng)
    row = against_truth(beams, known)
    ratios = [HONEST * row[name] if row["truths"] else math.nan for name in ("ratio", "j_ratio")]
    return Cell(gap, height, str(camera.velocity), row["truths"], *ratios)
