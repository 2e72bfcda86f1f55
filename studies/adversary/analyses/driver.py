"""Random cases of analyses: their claims, counted by kind, and the worst of each.

A case is known by its kind, a seed and a number. A refusal in the grammar of the package is no claim; any other
exception breaks the claim "no crash".
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from .claim import Claim, Kind

HEADS = ["kind", "claim", "number", "median", "99 %", "largest", "> 1", "> 10"]
CRASH = "no crash"
# Beyond this ratio a claim is shown.
SHOWN = 1.0

Hear = Callable[[int, str, list[Claim]], None]


def case_code(name: str, seed: int, number: int) -> str:
    """A case as Python."""
    return f'all_kinds()["{name}"](np.random.default_rng(({seed}, {number})))'


def refused(error: Exception) -> bool:
    """True for an argument that is refused in one clear line."""
    return isinstance(error, ValueError) and str(error).startswith("Argument")


def case_claims(name: str, kind: Kind, seed: int, number: int) -> list[Claim] | None:
    """Claims of a case; None where its arguments are refused."""
    try:
        found = kind(np.random.default_rng((seed, number)))
    except Exception as error:
        if refused(error):
            return None
        return [Claim(CRASH, math.inf, f"{case_code(name, seed, number)}  # {type(error).__name__}: {error}")]
    return [claim if claim.ratio >= 0 else claim._replace(ratio=math.inf) for claim in found]


class Findings:
    """Claims by kind and name: their ratios, and the worst of each. A ratio that is NaN is infinite."""

    def __init__(self) -> None:
        self.ratios: dict[tuple[str, str], list[float]] = {}
        self.worst: dict[tuple[str, str], Claim] = {}
        self.cases: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self.silent: Counter[str] = Counter()

    def add(self, kind: str, claims: list[Claim] | None) -> list[Claim]:
        """Count the claims of a case, and return those that are the worst so far and beyond what is shown."""
        self.cases[kind] += 1
        self.refused[kind] += claims is None
        self.silent[kind] += claims == []
        new = []
        for claim in claims or []:
            key = (kind, claim.name)
            self.ratios.setdefault(key, []).append(claim.ratio)
            if key not in self.worst or claim.ratio > self.worst[key].ratio:
                self.worst[key] = claim
                new += [claim] if claim.ratio > SHOWN else []
        return new

    def broken(self, beyond: float = SHOWN) -> list[Claim]:
        """The worst of each claim that goes beyond a ratio."""
        return [claim for claim in self.worst.values() if claim.ratio > beyond]

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Heads and rows: one for each claim of each kind."""
        rows = []
        for (kind, name), ratios in self.ratios.items():
            each = np.array(ratios)
            # No value lies between one that is infinite and its neighbour.
            quantiles = (np.quantile(each, q, method="higher") for q in (0.5, 0.99, 1.0))
            beyond = (str(int((each > limit).sum())) for limit in (1, 10))
            rows.append([kind, name, str(len(each)), *(f"{q:.2g}" for q in quantiles), *beyond])
        return list(HEADS), sorted(rows, key=lambda row: row[0])

    def sentences(self) -> list[str]:
        """What was tried, kind by kind."""
        return [
            f"{kind}: {count} cases, {self.refused[kind]} refused, {self.silent[kind]} of which nothing is claimed."
            for kind, count in self.cases.items()
        ]


def try_cases(
    kinds: Mapping[str, Kind],
    count: int,
    seed: int,
    findings: Findings | None = None,
    hear: Hear = lambda _number, _kind, _worst: None,
) -> Findings:
    """So many cases of each kind, the kinds in turn.

    findings: where they are counted; `hear` gets the number, the kind and new worst claims of each case.
    """
    found = Findings() if findings is None else findings
    for number, name in _in_turn(kinds, count):
        hear(number, name, found.add(name, case_claims(name, kinds[name], seed, number)))
    return found


def _in_turn(kinds: Mapping[str, Kind], count: int) -> Iterator[tuple[int, str]]:
    for number in range(count):
        for name in kinds:
            yield number, name
