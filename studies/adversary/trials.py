"""Cases traced by every engine at every tolerance, judged by each other and, where they differ, by the truth."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc

from ..truth.camera import Place
from .cases import Case, End
from .claims import Ends, ends_in_truth, ends_of, ratios
from .truth import Known, Lost, known

TOLERANCES = (1e-4, 1e-10, 1e-14)
# An engine is compared with the other one.
OTHER = {"closed-form": "integrated", "integrated": "closed-form", "auto": "integrated"}
# Seconds after which the truth of a ray is given up.
PATIENCE = 5.0
_STRICTEST = min(TOLERANCES)


class Trial(NamedTuple):
    """A way to ask: which engine, at which tolerance, for beams or rays, with or without the time."""

    engine: str
    tolerance: float
    beams: bool
    timed: bool = True

    def __str__(self) -> str:
        """In words."""
        return f"{self.engine}, {'beams' if self.beams else 'rays'}, {self.tolerance:.0e}"


TRIALS = tuple(
    Trial(engine, t, beams) for engine in ("closed-form", "integrated") for beams in (True, False) for t in TOLERANCES
)


class Judged(NamedTuple):
    """A trial of a case: the result, its claims as ratios (n,), and which rays were compared with the truth."""

    case: Case
    trial: Trial
    result: kc.Rays
    ratios: dict[str, np.ndarray]
    by_truth: np.ndarray
    unknown: np.ndarray
    truths: list[Known | Lost | None]


def trace(case: Case, trial: Trial) -> kc.Rays:
    """The answer of the package."""
    function = kc.trace_beams if trial.beams else kc.trace_rays
    return function(case.camera, case.sky, trial.engine, trial.tolerance, end=case.end, time=trial.timed)


def judge(case: Case, trials: tuple[Trial, ...], sampled: float, rng: np.random.Generator) -> Iterator[Judged]:
    """All trials of a case.

    An engine whose answer lies within its error of the other engine's best one is taken at its word, but for a share
    `sampled` of the rays; all others are compared with the truth.
    """
    results = {trial: trace(case, trial) for trial in trials}
    best = {t.engine: Trial(OTHER[t.engine], _STRICTEST, beams=True, timed=t.timed) for t in trials}
    others = {trial: results.get(trial) or trace(case, trial) for trial in best.values()}
    ends = {trial: ends_of(result, case.end) for trial, result in others.items()}
    found = {t: ratios(result, ends[best[t.engine]], case.end, t.tolerance) for t, result in results.items()}
    doubted = rng.uniform(size=len(case.sky)) < sampled
    for trial, result in results.items():
        doubted |= doubtful(result, ends[best[trial.engine]], found[trial])
    truths = [truth_of(case, i) if doubted[i] else None for i in range(len(case.sky))]
    true = ends_in_truth(truths)
    by_truth = true.status >= 0
    for trial, result in results.items():
        exact = ratios(result, true, case.end, trial.tolerance)
        judged = {name: np.where(doubted, exact[name], ratio) for name, ratio in found[trial].items()}
        yield Judged(case, trial, result, judged, by_truth, doubted & ~by_truth, truths)


def doubtful(result: kc.Rays, other: Ends, found: dict[str, np.ndarray]) -> np.ndarray:
    """Rays (n,) on which an engine and another differ by more than the error of the first, or in a label."""
    doubted = result.escaped != (other.status == kc.Status.ESCAPED)
    for ratio in found.values():
        doubted |= ratio > 1
    return doubted


def truth_of(case: Case, i: int) -> Known | Lost | None:
    """The truth of one ray; None where it takes too long."""
    try:
        return known(place_of(case.camera), case.sky[i].tolist(), end_in_truth(case.end), most_seconds=PATIENCE)
    except TimeoutError:
        return None


def place_of(camera: kc.Camera | kc.Observer) -> Place:
    """The camera, or an observer at a finite radius, in the words of the truth."""
    return Place(camera.spin, camera.radius, camera.inclination, camera.velocity)


def end_in_truth(end: End) -> float | int:
    """The end in the words of the truth."""
    return end.crossing if isinstance(end, kc.EquatorialPlane) else float(end)
