"""Findings: claims counted by class, and the worst of each."""

from collections import defaultdict

import numpy as np

from .cases import end_class, place_class
from .claims import CLAIMS, LABELS
from .reproductions import Broken
from .trials import Judged

# True over reported errors beyond which rays are counted.
LIMITS = (0.1, 0.3, 1.0, 2.0, 3.0, 10.0)
# How much more an error may be than is reported, before it is shown.
_SHOWN = (1.0, 2.0, 3.0, 10.0)


class Tally:
    """Counts of claims: how many rays, how many with a ratio beyond each of LIMITS, and the largest ratio."""

    def __init__(self) -> None:
        self.counts: dict[tuple[str, str, str], np.ndarray] = defaultdict(lambda: np.zeros(len(LIMITS) + 1, int))
        self.largest: dict[tuple[str, str, str], float] = defaultdict(float)
        self.worst: dict[tuple[str, ...], Broken] = {}
        self.rays = self.truths = self.unknown = 0

    def add_case(self, trials: list[Judged]) -> None:
        """Count all trials of a case."""
        self.rays += len(trials[0].case.sky)
        self.truths += int(trials[0].by_truth.sum())
        self.unknown += int(trials[0].unknown.sum())
        for judged in trials:
            self._add(judged)

    def _add(self, judged: Judged) -> None:
        case, trial = judged.case, judged.trial
        families = np.array(case.families)
        end, place = end_class(case.camera, case.end), place_class(case.camera)
        for claim, ratio in judged.ratios.items():
            self._count(("trial", str(trial)), claim, ratio)
            self._count(("end", end), claim, ratio)
            for word in place.split(", "):
                self._count(("camera", word), claim, ratio)
            for family in dict.fromkeys(case.families):
                self._count(("direction", family), claim, ratio[families == family])
            if np.any(ratio > 1):
                self._keep(Broken.worst(claim, judged), (end, place))

    def _count(self, group: tuple[str, str], claim: str, ratio: np.ndarray) -> None:
        known = ratio[~np.isnan(ratio)]
        self.counts[*group, claim] += [len(known), *(int(np.sum(known > limit)) for limit in LIMITS)]
        self.largest[*group, claim] = max(self.largest[*group, claim], float(known.max(initial=0)))

    def _keep(self, one: Broken, classes: tuple[str, str]) -> None:
        """Keep the worst of each claim, trial and class."""
        key = (one.claim, one.trial.engine, "beams" if one.trial.beams else "rays", *classes)
        if key not in self.worst or one.ratio > self.worst[key].ratio:
            self.worst[key] = one

    def table(self, kind: str) -> tuple[list[str], list[list[str]]]:
        """Heads and rows: claims by the classes of one kind (trial, end, camera, direction)."""
        heads = [kind, "claim", "rays", *(f"> {limit:g}" for limit in _SHOWN), "share > 2", "worst"]
        rows = []
        for name, group, claim in sorted(self.counts, key=lambda key: (key[1], CLAIMS.index(key[2]))):
            counts = self.counts[name, group, claim]
            if name == kind and counts[0]:
                beyond = [int(counts[1 + LIMITS.index(limit)]) for limit in _SHOWN]
                worst = f"{self.largest[name, group, claim]:.2g}"
                rows.append([group, claim, str(counts[0]), *map(str, beyond), f"{beyond[1] / counts[0]:.1e}", worst])
        return heads, rows

    def broken(self, beyond: float = 2.0) -> list[Broken]:
        """The worst of each claim and class that goes beyond a ratio; wrong labels always."""
        found = [one for one in self.worst.values() if one.ratio > beyond or one.claim in LABELS]
        return sorted(found, key=lambda one: (CLAIMS.index(one.claim), -one.ratio))
