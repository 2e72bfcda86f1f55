"""Limits of good numbers: named extreme problems, and what must hold in each of them.

    kerrcaustics study stability

Every problem (problems.py) is one camera and some hundred directions. Every engine traces them as beams.
What is compared, and the verdict:

- the worst rays, and a few others, with truth in long arithmetic (truth/rays.py): n', J as vectors in space, the
  Morse index; all rays with another engine. True errors must be at most ten times the reported ones.
- the photon at the camera (its norm is 0), |n'| = 1, det J from two engines and from the differences of long
  arithmetic, a ray followed to a finite radius and back, parity = (-1)^index, the redshift; captured or not; nothing is
  NaN where a ray escapes. Along a line toward the shadow edge the index changes by one at a time; where it falls, truth
  decides whether it does.

"ok": all of it holds, and every reported error is within the tolerance of 1e-10. "honest": all of it holds, and some
reported errors are larger. "FAIL": something does not hold; these stand first. "not examined": a few rays take too long
with some engine. Times are no part of the verdict: rays that take long are called slow. In the upper picture a mark is
a problem: the largest true error of n' among the rays whose truth is known, and the largest ratio of true to reported
error. The lower one maps that ratio, of the default engine, over spin, radius and distance of the rays from the shadow
edge. Writes stability.json, stability.png and stability.md.
"""

import math
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.engine import ENGINES
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table

from . import checks
from .checks import HONEST, ROUND_OFF, certain
from .comparison import OTHERS, against_truth, compared_with_truth
from .error_map import DISTANCES, GAPS, HEIGHTS, Cell, cells
from .picture import picture
from .problems import Problem, problems

QUESTION = "Does any claim break in extreme problems?"
# Run time on two cores of an AMD EPYC (2.6 GHz, shared), and processor time there with QUICK.
SECONDS = 420
QUICK_SECONDS = 22

TOLERANCE = 1e-10
# Verdicts of problems in which everything holds.
_GOOD = ("ok", "honest")
# What must be zero, and what must be at most 1, of a row: in the words in which a fault is reported.
_NONE = {
    "not_finite": "rays that are not finite",
    "capture_mistakes": "captured or not, against long arithmetic",
    "wrongly_captured": "captured or not, against truth",
    "wrong_index": "index against truth",
    "parity_mistakes": "parity against index",
    "index_mistakes": "steps of the index along a line that are not 1, against truth where they are negative",
    "other_captured": "captured or not, against another engine",
    "other_index": "index against another engine",
}
_AT_MOST_1 = {
    "ratio": "error of n' over ten times the reported",
    "j_ratio": "error of J over ten times the reported",
    "det_ratio": "error of det J over ten times the reported",
    "reciprocity": "there and back over ten times the reported",
    "redshift_error": "redshift over what is allowed",
}
_AGAINST_OTHERS = {
    "difference_ratio": "n' against another engine over ten times the reported",
    "j_difference_ratio": "J against another engine over ten times the reported",
    "det_difference_ratio": "det J against another engine over ten times the reported",
}
# Rays for checks in long arithmetic of formulas only.
_FEW = 12
# Microseconds a ray: more than this is slow.
LONGEST = 3000.0
# A problem of which this many rays take more than so many seconds is not examined.
_PROBE, PATIENCE = 8, 20.0


def examine(
    problem: Problem, rays: int, truths: int, seed: int, longest: float = LONGEST, patience: float = PATIENCE
) -> list[dict[str, Any]]:
    """A problem with all engines: a row of the table each.

    longest: microseconds a ray, above which an engine is called slow; patience: seconds a few rays, above which a
    problem is not examined.
    """
    rng = np.random.default_rng(seed)
    sky = problem.sky(problem.camera, rays, rng)
    camera = problem.camera
    rows = unexamined(problem, sky[:_PROBE], patience)
    if rows:
        return rows
    traced = {engine: kc.trace_beams(camera, sky, engine, TOLERANCE) for engine in ENGINES}
    others = {name: kc.trace_beams(camera, sky, *other) for name, other in OTHERS.items()}
    known = compared_with_truth(problem, sky, traced, others, truths, rng)
    few = rng.choice(rays, min(_FEW, rays), replace=False)
    truly = checks.truly_escapes(camera, sky[few])
    null = checks.null_norm(problem, sky[few])
    turn = rng.uniform(0, 2 * math.pi)
    for engine, beams in traced.items():
        row = {"group": problem.group, "problem": problem.name, "engine": engine, **status_counts(beams)}
        row |= against_truth(beams, known) | against_other(beams, others[engine])
        row["null_norm"] = null
        row["capture_mistakes"] = int(np.sum(beams.escaped[few] != truly))
        row["redshift_error"] = redshift_error(problem, sky[few], beams, few)
        row["reciprocity"] = checks.reciprocity(problem, sky[: min(rays, 64)], engine)
        row["index_mistakes"], row["last_index"] = checks.index_mistakes(problem, engine, turn)
        row["microseconds"] = 1e6 * _timed(problem, sky, engine)[1] / rays
        rows.append(row)
    for row in rows:
        others_wrong = any(is_wrong(r) for r in rows if r is not row) and not is_wrong(row)
        row["faults"] = faults(row, others_wrong)
        row["slow"] = [f"{row['microseconds']:.0f} µs a ray"] if row["microseconds"] > longest else []
        row["verdict"] = "FAIL" if row["faults"] else "honest" if row["inaccurate"] else "ok"
    return rows


def is_wrong(row: dict[str, Any]) -> bool:
    """True where an engine is contradicted by truth."""
    return row["ratio"] > 1 or row["j_ratio"] > 1 or row["det_ratio"] > 1


def unexamined(problem: Problem, sky: np.ndarray, patience: float) -> list[dict[str, Any]]:
    """Rows of a problem that is not examined, because a few of its rays take too long with some engine; else none."""
    rows = []
    for engine in ENGINES:
        beams, seconds = _timed(problem, sky, engine)
        if seconds > patience:
            # Not those of loading.
            beams, seconds = _timed(problem, sky, engine)
        row = {"group": problem.group, "problem": problem.name, "engine": engine, **status_counts(beams)}
        row |= against_truth(beams, {}) | {"microseconds": 1e6 * seconds / len(sky), "faults": []}
        row["slow"] = [f"{len(sky)} rays take {seconds:.0f} s"] if seconds > patience else []
        rows.append(row | {"verdict": "not examined"})
    return rows if any(row["slow"] for row in rows) else []


def _timed(problem: Problem, sky: np.ndarray, engine: str) -> tuple[kc.Beams, float]:
    """Beams, and the seconds that they take."""
    began = time.perf_counter()
    beams = kc.trace_beams(problem.camera, sky, engine, TOLERANCE)
    return beams, time.perf_counter() - began


def status_counts(beams: kc.Beams) -> dict[str, Any]:
    """Numbers of rays by status, NaN where there must be none, and the largest reported errors."""
    escaped, Status = beams.escaped, kc.Status
    values = np.column_stack([beams.direction, beams.azimuth, beams.error, beams.diameter_error, beams.redshift])
    finite = np.isfinite(values).all(axis=1) & np.isfinite(beams.jacobian).all(axis=(1, 2)) & (beams.index >= 0)
    sure = escaped & certain(beams)
    return {
        "rays": len(escaped),
        "escaped": int(escaped.sum()),
        "captured": int((~escaped).sum()),
        "inaccurate": int(np.sum(beams.status == Status.INACCURATE)),
        "in_closed_form": int(beams.closed_form.sum()),
        "not_finite": int(np.sum(escaped & ~finite)),
        "norm_error": _largest(np.abs(np.linalg.norm(beams.direction, axis=1) - 1)),
        "parity_mistakes": int(np.sum(beams.parity[sure] != (-1.0) ** beams.index[sure])),
        "reported_median": float(np.median(beams.error[escaped])) if escaped.any() else 0.0,
        "reported_largest": _largest(beams.error),
    }


def against_other(beams: kc.Beams, other: kc.Beams) -> dict[str, Any]:
    """Largest differences from another engine, over ten times the reported errors of both."""
    both = beams.escaped & other.escaped
    of_n = np.linalg.norm(beams.direction - other.direction, axis=1)
    of_j = np.linalg.norm(checks.columns_in_space(beams) - checks.columns_in_space(other), axis=(1, 2))
    of_det = np.abs(beams.determinant - other.determinant) / other.delta_plus**2
    j_allowed = HONEST * (beams.diameter_error + other.diameter_error)
    # An error of 1 is the largest that is ever reported: nothing is known of J.
    j_allowed[(beams.diameter_error >= 1) | (other.diameter_error >= 1)] = np.inf
    sure = both & certain(beams) & certain(other)
    return {
        "difference_ratio": _largest(of_n / (HONEST * (beams.error + other.error))),
        "j_difference_ratio": _largest(of_j / other.delta_plus / j_allowed),
        "det_difference_ratio": _largest(of_det / (2 * j_allowed)),
        "other_captured": int(np.sum(beams.escaped != other.escaped)),
        "other_index": int(np.sum(beams.index[sure] != other.index[sure])),
    }


def redshift_error(problem: Problem, sky: np.ndarray, beams: kc.Beams, few: np.ndarray) -> float:
    """Largest relative error of the redshift over round-off or ten times the error of the ray, which is larger."""
    escaped = beams.escaped[few]
    if not escaped.any():
        return 0.0
    errors = checks.redshift_error(problem, sky[escaped], beams.redshift[few][escaped])
    return float(np.max(errors / np.maximum(ROUND_OFF, HONEST * beams.error[few][escaped])))


def faults(row: dict[str, Any], others_wrong: bool) -> list[str]:
    """Claims that do not hold, in words; none if all is well.

    others_wrong: truth contradicts the other engine and not this one, so that their difference says nothing of this.
    """
    at_most_1 = _AT_MOST_1 if others_wrong else _AT_MOST_1 | _AGAINST_OTHERS
    found = [f"{words}: {row[name]}" for name, words in _NONE.items() if row[name]]
    found += [f"{words}: {row[name]:.2g}" for name, words in at_most_1.items() if not row[name] <= 1]
    found += ["norm of n'"] if row["norm_error"] > ROUND_OFF else []
    allowed = max(ROUND_OFF, HONEST * row["reported_median"])
    return found + ([f"null norm {row['null_norm']:.0e}"] if row["null_norm"] > allowed else [])


def _largest(values: np.ndarray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else 0.0


def shown(row: dict[str, Any]) -> dict[str, str]:
    """The numbers of a row as the tables have them."""
    return {
        "escaped": str(row["escaped"]),
        "inaccurate": str(row["inaccurate"]),
        "error of n′": f"{row['error']:.0e}",
        "reported": f"{row['reported_largest']:.0e}",
        "true / reported": f"{HONEST * row['ratio']:.1g}",
        "error of J": f"{row['j_error']:.0e}",
        "J: true / reported": f"{HONEST * row['j_ratio']:.1g}",
        "µs a ray": f"{row['microseconds']:.0f}",
    }


def table(rows: list[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    lines = []
    for row in failures_first(rows):
        verdict = "; ".join([row["verdict"], *row["faults"], *row["slow"]])
        lines.append([name_of(row), row["engine"], *shown(row).values(), verdict])
    return ["problem", "engine", *shown(rows[0]), "verdict"], lines


def condensed(rows: list[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """The table for the documentation: the worst of each group, and what does not hold."""
    heads = ["problems", "rays", "beyond 1e-10", "worst true error", "worst reported", "J: worst true error"]
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in failures_first(rows):
        if row["engine"] == "auto":
            groups.setdefault(row["group"] if row["verdict"] in _GOOD else name_of(row), []).append(row)
    lines = []
    for name, group in groups.items():
        counts = [str(sum(row[key] for row in group)) for key in ("escaped", "inaccurate")]
        worst = [f"{max(row[key] for row in group):.0e}" for key in ("error", "reported_largest", "j_error")]
        verdicts = Counter(row["verdict"] for row in group)
        lines.append([name, *counts, *worst, ", ".join(f"{n} {verdict}" for verdict, n in verdicts.items())])
    return [*heads, "verdict"], lines


def failures_first(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows in which something does not hold, those not examined, and the others."""
    return sorted(rows, key=lambda row: (row["verdict"] != "FAIL", row["verdict"] in _GOOD))


def name_of(row: dict[str, Any]) -> str:
    return f"{row['group']}: {row['problem']}"


def findings(rows: list[dict[str, Any]], mapped: list[Cell]) -> list[str]:
    """Findings, in sentences: what fails, in how many problems all holds, what is slow, how honest the errors are."""
    failing = [row for row in rows if row["verdict"] == "FAIL"]
    sentences = [f"{row['engine']} fails in {name_of(row)}: {'; '.join(row['faults'])}." for row in failing]
    for engine in ENGINES:
        own = [row for row in rows if row["engine"] == engine]
        good = sum(row["verdict"] in _GOOD for row in own)
        slow = [f"{name_of(row)} ({', '.join(row['slow'])})" for row in own if row["slow"]]
        sentences.append(f"{engine}: everything holds in {good} of {len(own)} problems.")
        sentences += [f"{engine} is slow in {', '.join(slow)}."] if slow else []
    sure = [row for row in rows if row["verdict"] in _GOOD]
    of_n, of_j = (HONEST * max((row[name] for row in sure), default=0.0) for name in ("ratio", "j_ratio"))
    on_map = [float(np.nanmax([0.0, *(getattr(c, name) for c in mapped)])) for name in ("ratio", "j_ratio")]
    unknown = sum(not c.truths for c in mapped)
    return [
        *sentences,
        f"Where everything holds, true errors are at most {of_n:.2g} (n′) and {of_j:.2g} (J) times the reported ones; "
        f"on the map of spin, radius and distance from the shadow edge at most {on_map[0]:.2g} and {on_map[1]:.2g} "
        f"times ({len(mapped)} cells, {unknown} of them without a truth).",
    ]


QUICK: dict[str, Any] = {
    "rays": 128,
    "truths": 2,
    "examined": tuple({problem.group: problem for problem in problems()}.values()),
    "gaps": (0.1, 1e-6),
    "heights": (1e-2, 3.0, 1e6),
    "distances": (math.inf, 1e-6),
}
"""Arguments of `main` for a quick run."""


def main(
    output: Path,
    rays: int = 512,
    truths: int = 6,
    examined: Sequence[Problem] = tuple(problems()),
    longest: float = LONGEST,
    patience: float = PATIENCE,
    gaps: Sequence[float] = GAPS,
    heights: Sequence[float] = HEIGHTS,
    distances: Sequence[float] = DISTANCES,
) -> list[Path]:
    """Examine the problems, write stability.json, .png and .md, and return their paths."""
    started, rows = time.perf_counter(), []
    for i, problem in enumerate(examined):
        began = time.perf_counter()
        rows += examine(problem, rays, truths, i, longest, patience)
        verdicts = ", ".join(f"{row['engine']} {row['verdict']}" for row in rows[-len(ENGINES) :])
        print(f"{problem.group}: {problem.name}: {verdicts} ({time.perf_counter() - began:.1f} s)", flush=True)
    mapped = cells(gaps, heights, distances)
    print(text_table(*table(rows)))
    settings = {"rays": rays, "truths": truths, "tolerance": TOLERANCE, "honest": HONEST}
    return write_study(
        output,
        "stability",
        __doc__,
        picture(rows, mapped),
        markdown_table(*condensed(rows)),
        settings=settings,
        findings=findings(rows, mapped),
        problems=[row | {"shown": shown(row)} for row in failures_first(rows)],
        map=[cell._asdict() for cell in mapped],
        seconds=time.perf_counter() - started,
    )
