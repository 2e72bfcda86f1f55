"""Search for wrong answers: random hard cases, both engines, three tolerances, and every claim held against the truth.

    kerrcaustics study adversary

Cameras (cases.py) with spins 0 and 1e-12 to 1 - 1e-12, from r_+ (1 + 1e-6) to 1e9, on the axis and the equator and
1e-15 to 1e-3 off them, with speeds to 1 - 1e-9; directions of the whole sky, at the shadow edge, along the principal
null directions, through the poles, at turning points, along the camera's axes; ends at infinity, on spheres, also the
camera's own, and in the equatorial plane. Every case is traced as rays and as beams, by either engine, at three
tolerances.

What is claimed (claims.py): the place and the azimuth of the end, J and its diameters, and the time, within what is
reported; ESCAPED within the tolerance; no NaN for a ray that arrives; whether it arrives, index and crossings, unless
the result says that they are not certain. A claim is compared with the other engine at the strictest tolerance; where
that differs by more than the reported error, or in a label, and for a share of the others, with truth in long
arithmetic (truth.py), which shares no code with the package.

What is computed from beams (analyses/) has its own random cases, a few of each kind, and its own truths.

The tables count claims by trial and by class, with the largest ratio of true to reported error ("inf": a wrong label).
The worst of each broken claim is written as Python, with simple numbers where they do. Writes adversary.json, .png and
.md. Any number of cases: python -m studies.adversary.hunt and python -m studies.adversary.analyses.
"""

import time
from pathlib import Path
from typing import Any

from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table

from . import cases as hard
from .analyses.driver import try_cases
from .analyses.kinds import chosen_kinds
from .claims import CLAIMS, LABELS
from .hunt import hunt
from .picture import picture
from .reproductions import Broken, simplified
from .tally import Tally
from .trials import TRIALS, Trial

QUESTION = "Is any answer wrong in random hard cases?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 340
QUICK_SECONDS = 14

# The claim about reported errors: the true one is at most this many times larger.
HONEST = 10.0
_KINDS = ("trial", "end", "camera", "direction")


def reproductions(tally: Tally) -> list[Broken]:
    """The worst ray of each claim that is broken, simplified."""
    worst: dict[str, Broken] = {}
    for one in tally.broken(HONEST):
        worst.setdefault(one.claim, one)
    return [simplified(one) for one in worst.values()]


def findings(tally: Tally) -> list[str]:
    """Findings, in sentences: one for every claim, and how it was judged."""
    sentences = [
        f"{tally.rays} rays: {tally.truths} of them compared with the truth, {tally.unknown} where it takes too long."
    ]
    for claim in CLAIMS:
        keys = [key for key in tally.counts if key[0] == "trial" and key[2] == claim]
        if not keys:
            continue
        counts = sum(tally.counts[key] for key in keys)
        worst = max(tally.largest[key] for key in keys)
        if claim in LABELS:
            sentences.append(f"{claim}: {counts[-1]} of {counts[0]} claims are wrong.")
        else:
            sentences.append(
                f"{claim}: of {counts[0]} claims, {counts[-1]} are off by more than ten times, at most {worst:.2g}."
            )
    return sentences


QUICK: dict[str, Any] = {
    "cases": 12,
    "rays": 31,
    "kinds": "isoradials,line profiles,spots,discs,moving points,beams along paths,paths of observers,"
    "initial ellipses,diffraction patterns,photon rings,ring visibility",
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    cases: int = 60,
    rays: int = 63,
    seed: int = 2015,
    sampled: float = 0.02,
    trials: tuple[Trial, ...] = TRIALS,
    analyses: int = 1,
    kinds: str = "all",
) -> list[Path]:
    """Try the cases, and so many analyses of each kind, write adversary.json, .png and .md, and return their paths."""
    started = time.perf_counter()
    tally = hunt(hard.cases(cases, seed, rays), sampled, trials=trials)
    tried = try_cases(chosen_kinds(kinds), analyses, seed)
    broken = [str(one) for one in reproductions(tally)] + [one.code for one in tried.broken(HONEST)]
    tables = {kind: tally.table(kind) for kind in _KINDS} | {"analyses": tried.table()}
    for table in tables.values():
        print(text_table(*table))
    print("\n".join(broken))
    return write_study(
        output,
        "adversary",
        __doc__,
        picture(tally),
        "\n".join(f"**Claims by {kind}**\n\n{markdown_table(*table)}" for kind, table in tables.items()),
        settings={"cases": cases, "rays": rays, "seed": seed, "sampled": sampled, "analyses": analyses, "kinds": kinds},
        findings=findings(tally) + tried.sentences(),
        claims={kind: rows for kind, (_, rows) in tables.items()},
        broken=broken,
        seconds=time.perf_counter() - started,
    )
