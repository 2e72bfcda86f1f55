"""Points of the study: a result with one setting, what it takes, and its true and its reported error."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from kerrcaustics.report.machine import core_seconds

Array = np.ndarray


@dataclass(frozen=True)
class Point:
    """A result with one setting.

    family: colour of the picture; line: name of the curve, points of which are joined; result, setting: in the table;
    error, reported: true and reported error, the latter NaN if there is none; ratio: the largest true over reported
    error of all values; bound: true if the error is no more than the truth's own one explains, then there is no ratio;
    quantity: what the errors are of, with its unit; against: where the truth is from.
    """

    family: str
    line: str
    setting: str
    seconds: float
    error: float
    reported: float
    ratio: float
    bound: bool
    quantity: str
    against: str


@dataclass(frozen=True)
class Result:
    """A result that the study measures, and how: the texts of its points.

    points: one for each setting, for a size of the study; the setting, a call to be timed, how many results it has, and
    true and reported errors (n,).
    """

    family: str
    line: str
    quantity: str
    against: str
    points: Callable[["Sizes"], Iterable["Measured"]]
    # Part of the values that are better than what the table has: 1 for the largest error.
    part: float = 1.0

    def measured(self, sizes: "Sizes") -> list[Point]:
        """The points of all settings."""
        return [self._point(one, sizes.repeats) for one in self.points(sizes)]

    def _point(self, one: "Measured", repeats: int) -> Point:
        error, reported = np.asarray(one.error, float), np.asarray(one.reported, float)
        bound = bool(error.max() < one.known)
        return Point(
            family=self.family,
            line=self.line,
            setting=one.setting,
            seconds=core_seconds(one.work, repeats) / one.count,
            error=float(np.quantile(error, self.part)),
            reported=float(np.quantile(reported, self.part)),
            ratio=math.nan if bound else float(np.max(error / reported)),
            bound=bound,
            quantity=self.quantity,
            against=self.against,
        )


@dataclass(frozen=True)
class Measured:
    """A setting, a call that takes its time, true and reported errors (n,), and the number of results of a call.

    known: differences below it are explained by the truth's own error.
    """

    setting: str
    work: Callable[[], object]
    error: Array
    reported: Array
    count: int = 1
    known: float = 0.0


@dataclass(frozen=True)
class Sizes:
    """Sizes of the study.

    repeats: of each timing; directions: of rays that are timed; tolerances: of the integrator; stars: of the camera of
    the reference; times: of light curves; baselines: of visibilities; spot_points: most of a spot; frequencies: of
    waves; pixels: rows of frames; side: rays across a pixel that a frame is compared with; twin, rings: positions round
    the ring, and radii, of the slow sum over a line profile.
    """

    repeats: int = 3
    directions: int = 24576
    tolerances: tuple[float, ...] = (1e-6, 1e-8, 1e-10, 1e-12, 1e-14)
    stars: int = 6
    times: int = 100
    baselines: int = 1000
    spot_points: int = 4096
    frequencies: tuple[float, ...] = (0.5, 1.0, 2.0, 5.0, 10.0)
    pixels: int = 90
    side: int = 23
    twin: int = 480
    rings: int = 4000


SIZES = Sizes()
"""Those of the study."""


def nothing(count: int) -> Array:
    """Reported errors of what reports none."""
    return np.full(count, math.nan)
