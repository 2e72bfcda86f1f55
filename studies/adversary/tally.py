"""What was found: claims counted by class, the worst of each, and reproductions in Python."""

import math
from collections import defaultdict
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc

from .cases import Case, end_class, place_class
from .claims import CLAIMS, LABELS, diameters
from .trials import Judged, Trial
from .truth import Known, Lost

LIMITS = (1.0, 2.0, 3.0, 10.0)


class Broken(NamedTuple):
    """A claim that does not hold for one ray."""

    claim: str
    ratio: float
    trial: Trial
    case: Case
    ray: int
    truth: Known | Lost | None
    said: str

    def __str__(self) -> str:
        """Python to paste, with what is claimed and what is true."""
        camera, end, n = self.case.camera, self.case.end, self.case.sky[self.ray]
        function = "trace_beams" if self.trial.beams else "trace_rays"
        where = "" if end == math.inf else f", end={f'kc.{end}' if isinstance(end, kc.EquatorialPlane) else repr(end)}"
        place = f"kc.Camera({camera.spin!r}, {camera.radius!r}, {camera.inclination!r}, {camera.velocity!r})"
        asked = f"{self.trial.engine!r}, {self.trial.tolerance:g}{where}, time=True"
        return (
            f"# {self.claim}: {self.ratio:.3g} times the error ({self.case.families[self.ray]})\n"
            f"kc.{function}({place}, {[n.tolist()]}, {asked})\n"
            f"# says {self.said}\n# true {in_words(self.truth)}\n"
        )


def in_words(one: Known | Lost | None) -> str:
    """The truth in a line."""
    if not isinstance(one, Known):
        return "not known" if one is None else "captured" if one.captured else "missed"
    major, minor = diameters(one)
    numbers = {"n'": one.direction.tolist(), "azimuth": one.azimuth, "radius": one.radius, "time": one.time}
    numbers |= {"diameters": (major, minor), "index": int(one.index), "crossings": int(one.crossings)}
    return ", ".join(f"{name} {value}" for name, value in numbers.items())


def says(result: kc.Rays, i: int) -> str:
    """What a result says of a ray, in a line."""
    numbers = {"status": kc.Status(int(result.status[i])).name, "n'": result.direction[i].tolist()}
    numbers |= {
        "+-": result.error[i],
        "azimuth": result.azimuth[i],
        "time": result.time[i],
        "+- ": result.time_error[i],
    }
    if isinstance(result, kc.Beams):
        numbers |= {"diameters": (float(result.delta_plus[i]), float(result.delta_minus[i]))}
        numbers |= {"+-  ": result.jacobian_error[i], "index": result.index[i], "crossings": result.crossings[i]}
    certain = ("azimuth_error", "status_certain", "index_certain", "crossings_certain")
    numbers |= {name: getattr(result, name)[i] for name in certain if getattr(result, name, None) is not None}
    return ", ".join(f"{name.strip()} {value}" for name, value in numbers.items())


class Tally:
    """Counts of claims: how many rays, how many with a ratio beyond each of LIMITS, and the largest ratio."""

    def __init__(self) -> None:
        self.counts: dict[tuple[str, str, str], np.ndarray] = defaultdict(lambda: np.zeros(len(LIMITS) + 1, int))
        self.worst: dict[tuple[str, ...], Broken] = {}
        self.rays = self.truths = self.unknown = 0

    def add(self, judged: Judged) -> None:
        """Count one trial of a case."""
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
            self._keep(claim, ratio, judged, (end, place))

    def _count(self, group: tuple[str, str], claim: str, ratio: np.ndarray) -> None:
        known = ratio[~np.isnan(ratio)]
        self.counts[*group, claim] += [len(known), *(int(np.sum(known > limit)) for limit in LIMITS)]

    def _keep(self, claim: str, ratio: np.ndarray, judged: Judged, classes: tuple[str, str]) -> None:
        """Keep the worst of each claim, trial and class."""
        if not np.any(ratio > LIMITS[0]):
            return
        i = int(np.nanargmax(ratio))
        trial = judged.trial
        key = (claim, trial.engine, "beams" if trial.beams else "rays", *classes)
        if key not in self.worst or ratio[i] > self.worst[key].ratio:
            self.worst[key] = Broken(
                claim, float(ratio[i]), trial, judged.case, i, judged.truths[i], says(judged.result, i)
            )

    def table(self, kind: str) -> tuple[list[str], list[list[str]]]:
        """Heads and rows: claims by the classes of one kind."""
        heads = [kind, "claim", "rays", *(f"> {limit:g}" for limit in LIMITS), "share > 2"]
        rows = []
        for (name, group, claim), counts in sorted(
            self.counts.items(), key=lambda item: (item[0][1], CLAIMS.index(item[0][2]))
        ):
            if name == kind and counts[0]:
                rows.append([group, claim, *(str(n) for n in counts), f"{counts[2] / counts[0]:.1e}"])
        return heads, rows

    def broken(self, beyond: float = 2.0) -> list[Broken]:
        """The worst of each claim and class that goes beyond a ratio; wrong labels always."""
        found = [one for one in self.worst.values() if one.ratio > beyond or one.claim in LABELS]
        return sorted(found, key=lambda one: (CLAIMS.index(one.claim), -one.ratio))
