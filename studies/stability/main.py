"""Limits of good numbers: named extreme problems, and what must hold in each of them.

    kerrcaustics study stability

Every problem (problems.py) is one camera and some hundred directions. Every engine traces them as beams.
What is compared, and the verdict:

- the worst rays, and a few others, with truth in long arithmetic (truth/rays.py): n', J as vectors in space, the
  Morse index; all rays with another engine. True errors must be at most ten times the reported ones.
- the photon at the camera (its norm is 0), |n'| = 1, det J from two engines and from the differences of long
  arithmetic, a ray followed to a finite radius and back, the index along a line toward the shadow edge (it grows by
  one), parity = (-1)^index, the redshift; captured or not; nothing is NaN where a ray escapes, nothing takes long.

"ok": all of it holds, and every reported error is within the tolerance of 1e-10. "honest": all of it holds, and some
reported errors are larger. "FAIL": something does not hold. In the picture a mark is a problem: the largest true
error of n' among the rays whose truth is known, and the largest ratio of true to reported error. Writes
stability.json, stability.png and stability.md.
"""

import math
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.engine import ENGINES
from kerrcaustics.report.study_records import write_study
from kerrcaustics.report.tables import markdown_table, text_table

from . import checks
from .checks import HONEST, ROUND_OFF, Known
from .picture import picture
from .problems import Problem, problems

TOLERANCE = 1e-10
# The engine and tolerance that the rays of each engine are compared with.
OTHERS = {"auto": ("integrated", 1e-13), "closed-form": ("integrated", 1e-13), "integrated": ("closed-form", 1e-13)}
# Verdicts of problems in which everything holds.
_GOOD = ("ok", "honest")
# What must be zero, and what must be at most 1, of a row: in the words in which a fault is reported.
_NONE = {
    "not_finite": "rays that are not finite",
    "capture_mistakes": "captured or not, against long arithmetic",
    "wrongly_captured": "captured or not, against truth",
    "wrong_index": "index against truth",
    "parity_mistakes": "parity against index",
    "index_mistakes": "places where the index does not grow one by one",
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
# Microseconds a ray: more than this is "takes long".
LONGEST = 3000.0
# A problem of which this many rays take more than so many seconds, compilation included, is given up.
_PROBE, PATIENCE = 8, 20.0


def examine(
    problem: Problem, rays: int, truths: int, seed: int, longest: float = LONGEST, patience: float = PATIENCE
) -> list[dict[str, Any]]:
    """A problem with all engines: a row of the table each.

    longest: microseconds a ray, above which an engine fails; patience: seconds after which a problem is given up.
    """
    rng = np.random.default_rng(seed)
    sky = problem.sky(problem.camera, rays, rng)
    camera = problem.camera
    slow = too_slow(problem, sky[:_PROBE], patience)
    if slow:
        return slow
    traced = {engine: kc.trace_beams(camera, sky, engine, TOLERANCE) for engine in ENGINES}
    others = {name: kc.trace_beams(camera, sky, *other) for name, other in OTHERS.items()}
    known: dict[int, Known | None] = {}
    for i in suspects(traced, others, truths, rng):
        with suppress(TimeoutError):
            known[int(i)] = checks.known(camera, sky[i], _growth(traced, i))
    few = rng.choice(rays, min(_FEW, rays), replace=False)
    truly = checks.truly_escapes(camera, sky[few])
    null = checks.null_norm(problem, sky[few])
    turn = rng.uniform(0, 2 * math.pi)
    rows = []
    for engine, beams in traced.items():
        row = {"group": problem.group, "problem": problem.name, "engine": engine, **status_counts(beams)}
        row |= against_truth(beams, known) | against_other(beams, others[engine])
        row["null_norm"] = null
        row["capture_mistakes"] = int(np.sum(beams.escaped[few] != truly))
        row["redshift_error"] = redshift_error(problem, sky[few], beams, few)
        row["reciprocity"] = checks.reciprocity(problem, sky[: min(rays, 64)], engine)
        row["index_mistakes"], row["last_index"] = checks.index_jumps(problem, engine, turn)
        began = time.perf_counter()
        kc.trace_beams(camera, sky, engine, TOLERANCE)
        row["microseconds"] = 1e6 * (time.perf_counter() - began) / rays
        rows.append(row)
    for row in rows:
        others_wrong = any(is_wrong(r) for r in rows if r is not row) and not is_wrong(row)
        row["faults"] = faults(row, others_wrong, longest)
        row["verdict"] = "FAIL" if row["faults"] else "honest" if row["inaccurate"] else "ok"
    return rows


def is_wrong(row: dict[str, Any]) -> bool:
    """True where an engine is contradicted by truth."""
    return row["ratio"] > 1 or row["j_ratio"] > 1 or row["det_ratio"] > 1


def too_slow(problem: Problem, sky: np.ndarray, patience: float) -> list[dict[str, Any]]:
    """Rows of a problem that is given up, because a few of its rays take too long with some engine; else none."""
    rows = []
    for engine in ENGINES:
        began = time.perf_counter()
        beams = kc.trace_beams(problem.camera, sky, engine, TOLERANCE)
        seconds = time.perf_counter() - began
        row = {"group": problem.group, "problem": problem.name, "engine": engine, **status_counts(beams)}
        row |= against_truth(beams, {}) | {"microseconds": 1e6 * seconds / len(sky)}
        row["faults"] = [f"given up: {len(sky)} rays take {seconds:.0f} s"] if seconds > patience else []
        rows.append(row | {"verdict": "FAIL" if row["faults"] else "not examined"})
    return rows if any(row["faults"] for row in rows) else []


def _growth(traced: dict[str, kc.Beams], i: int) -> float:
    sizes = [float(beams.delta_plus[i]) for beams in traced.values()]
    return max([size for size in sizes if math.isfinite(size)], default=1.0)


def suspects(
    traced: dict[str, kc.Beams], others: dict[str, kc.Beams], most: int, rng: np.random.Generator
) -> np.ndarray:
    """Rays to compare with truth: those on which an engine and another differ most for their errors, and others."""
    found: list[int] = []
    for engine, beams in traced.items():
        with np.errstate(invalid="ignore", divide="ignore"):
            gaps = differences(beams, others[engine])
            found += [int(np.argmax(np.nan_to_num(gap, nan=-1, posinf=1e300))) for gap in gaps if np.any(gap > 0)]
    escaped = np.flatnonzero(traced["auto"].escaped)
    found += list(rng.permutation(escaped)[:most])
    return np.array(list(dict.fromkeys(found))[:most], int)


def differences(beams: kc.Beams, other: kc.Beams) -> tuple[np.ndarray, np.ndarray]:
    """Differences of n' and J from those of another engine over the error reported here (rays,); NaN if captured."""
    of_n = np.linalg.norm(beams.direction - other.direction, axis=1) / beams.error
    gap = checks.columns_in_space(beams) - checks.columns_in_space(other)
    known = np.where(beams.jacobian_error < 1, beams.jacobian_error, np.inf)
    return of_n, np.linalg.norm(gap, axis=(1, 2)) / other.delta_plus / known


def status_counts(beams: kc.Beams) -> dict[str, Any]:
    """Numbers of rays by status, NaN where there must be none, and the largest reported errors."""
    escaped, Status = beams.escaped, kc.Status
    values = np.column_stack([beams.direction, beams.azimuth, beams.error, beams.jacobian_error, beams.redshift])
    finite = np.isfinite(values).all(axis=1) & np.isfinite(beams.jacobian).all(axis=(1, 2)) & (beams.index >= 0)
    sure = escaped & checks.is_sure(beams)
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


def against_truth(beams: kc.Beams, known: dict[int, Known | None]) -> dict[str, Any]:
    """Largest true errors, and their largest ratio to ten times the reported ones."""
    row: dict[str, Any] = {"truths": 0, "wrong_index": 0, "error": 0.0, "ratio": 0.0, "j_error": 0.0, "j_ratio": 0.0}
    row |= {"det_ratio": 0.0, "wrongly_captured": 0}
    columns, sure = checks.columns_in_space(beams), checks.is_sure(beams)
    for i, true in known.items():
        if (true is None) == bool(beams.escaped[i]):
            row["wrongly_captured"] += 1
        if true is None or not beams.escaped[i]:
            continue
        of_n = float(np.linalg.norm(beams.direction[i] - true.direction))
        of_j = float(np.linalg.norm(columns[i] - true.columns)) / true.delta_plus
        of_det = abs(float(beams.determinant[i]) - true.determinant) / true.delta_plus**2
        row["truths"] += 1
        row["error"], row["j_error"] = max(row["error"], of_n), max(row["j_error"], of_j)
        row["ratio"] = max(row["ratio"], of_n / (HONEST * float(beams.error[i])))
        row["wrong_index"] += bool(sure[i]) and int(beams.index[i]) != true.index
        if not beams.jacobian_error[i] < 1:
            # The largest error that is ever reported: nothing is known of J.
            continue
        row["j_ratio"] = max(row["j_ratio"], of_j / (HONEST * float(beams.jacobian_error[i])))
        row["det_ratio"] = max(row["det_ratio"], of_det / (2 * HONEST * float(beams.jacobian_error[i])))
    return row


def against_other(beams: kc.Beams, other: kc.Beams) -> dict[str, Any]:
    """Largest differences from another engine, over ten times the reported errors of both."""
    both = beams.escaped & other.escaped
    of_n = np.linalg.norm(beams.direction - other.direction, axis=1)
    of_j = np.linalg.norm(checks.columns_in_space(beams) - checks.columns_in_space(other), axis=(1, 2))
    of_det = np.abs(beams.determinant - other.determinant) / other.delta_plus**2
    j_allowed = HONEST * (beams.jacobian_error + other.jacobian_error)
    # An error of 1 is the largest that is ever reported: nothing is known of J.
    j_allowed[(beams.jacobian_error >= 1) | (other.jacobian_error >= 1)] = np.inf
    sure = both & checks.is_sure(beams) & checks.is_sure(other)
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


def faults(row: dict[str, Any], others_wrong: bool, longest: float) -> list[str]:
    """Claims that do not hold, in words; none if all is well.

    others_wrong: truth contradicts the other engine and not this one, so that their difference says nothing of this.
    """
    at_most_1 = _AT_MOST_1 if others_wrong else _AT_MOST_1 | _AGAINST_OTHERS
    found = [f"{words}: {row[name]}" for name, words in _NONE.items() if row[name]]
    found += [f"{words}: {row[name]:.2g}" for name, words in at_most_1.items() if not row[name] <= 1]
    found += ["norm of n'"] if row["norm_error"] > ROUND_OFF else []
    allowed = max(ROUND_OFF, HONEST * row["reported_median"])
    found += [f"null norm {row['null_norm']:.0e}"] if row["null_norm"] > allowed else []
    return found + ([f"{row['microseconds']:.0f} µs a ray"] if row["microseconds"] > longest else [])


def _largest(values: np.ndarray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else 0.0


def table(rows: list[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    heads = ["problem", "engine", "escaped", "inaccurate", "error", "reported", "true / reported", "J: error"]
    heads += ["true / reported", "µs a ray", "verdict"]
    lines = []
    for row in rows:
        cells = (row["escaped"], row["inaccurate"], f"{row['error']:.0e}", f"{row['reported_largest']:.0e}")
        more = (f"{HONEST * row['ratio']:.1g}", f"{row['j_error']:.0e}", f"{HONEST * row['j_ratio']:.1g}")
        verdict = "; ".join([row["verdict"], *row["faults"]])
        name = f"{row['group']}: {row['problem']}"
        lines.append([name, row["engine"], *map(str, cells), *more, f"{row['microseconds']:.0f}", verdict])
    return heads, lines


def condensed(rows: list[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """The table for the documentation: the rows of the default engine."""
    heads = ["problem", "escaped", "beyond 1e-10", "worst true error", "worst reported", "J: worst true error"]
    lines = []
    for row in rows:
        if row["engine"] == "auto":
            cells = (row["escaped"], row["inaccurate"], *(f"{row[n]:.0e}" for n in ("error", "reported_largest")))
            more = (f"{row['j_error']:.0e}", f"{row['microseconds']:.0f}", row["verdict"])
            lines.append([f"{row['group']}: {row['problem']}", *map(str, cells), *more])
    return [*heads, "µs", "verdict"], lines


def findings(rows: list[dict[str, Any]]) -> list[str]:
    """Findings, in sentences: how many problems hold, which groups fail, and how honest the errors are."""
    sentences = []
    for engine in ENGINES:
        here = [row for row in rows if row["engine"] == engine]
        others = [row for row in here if row["verdict"] not in _GOOD]
        groups = ", ".join(dict.fromkeys(f'"{row["group"]}"' for row in others))
        where = f"; the others are of the kind {groups}" if others else ""
        sentences.append(f"{engine}: everything holds in {len(here) - len(others)} of {len(here)} problems{where}.")
    sure = [row for row in rows if row["verdict"] in _GOOD]
    of_n, of_j = (HONEST * max((row[name] for row in sure), default=0.0) for name in ("ratio", "j_ratio"))
    return [
        *sentences,
        f"Where everything holds, true errors are at most {of_n:.2g} (n′) and {of_j:.2g} (J) times the reported ones.",
    ]


def main(
    output: Path,
    rays: int = 512,
    truths: int = 6,
    examined: Sequence[Problem] = tuple(problems()),
    longest: float = LONGEST,
    patience: float = PATIENCE,
) -> list[Path]:
    """Examine the problems, write stability.json, .png and .md, and return their paths."""
    started, rows = time.perf_counter(), []
    for i, problem in enumerate(examined):
        began = time.perf_counter()
        rows += examine(problem, rays, truths, i, longest, patience)
        verdicts = ", ".join(f"{row['engine']} {row['verdict']}" for row in rows[-len(ENGINES) :])
        print(f"{problem.group}: {problem.name}: {verdicts} ({time.perf_counter() - began:.1f} s)", flush=True)
    print(text_table(*table(rows)))
    settings = {"rays": rays, "truths": truths, "tolerance": TOLERANCE, "honest": HONEST}
    return write_study(
        output,
        "stability",
        __doc__,
        picture(rows),
        markdown_table(*condensed(rows)),
        settings=settings,
        findings=findings(rows),
        problems=rows,
        seconds=time.perf_counter() - started,
    )
