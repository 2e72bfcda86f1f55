"""Rays worth comparing with truth, and the comparison."""

import math
from contextlib import suppress
from typing import Any

import numpy as np

import kerrcaustics as kc

from . import checks
from .checks import HONEST, Known, certain
from .problems import Problem

# The engine and tolerance that the rays of each engine are compared with.
OTHERS = {"auto": ("integrated", 1e-13), "closed-form": ("integrated", 1e-13), "integrated": ("closed-form", 1e-13)}


def compared_with_truth(
    problem: Problem,
    sky: np.ndarray,
    traced: dict[str, kc.Beams],
    others: dict[str, kc.Beams],
    most: int,
    rng: np.random.Generator,
) -> dict[int, Known | None]:
    """Truth of the rays of a problem that are worth it, by their number, without those that take too long."""
    known: dict[int, Known | None] = {}
    for i in suspects(traced, others, most, rng):
        with suppress(TimeoutError):
            known[int(i)] = checks.known(problem.camera, sky[i], _growth(traced, i))
    return known


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
    known = np.where(beams.diameter_error < 1, beams.diameter_error, np.inf)
    return of_n, np.linalg.norm(gap, axis=(1, 2)) / other.delta_plus / known


def against_truth(beams: kc.Beams, known: dict[int, Known | None]) -> dict[str, Any]:
    """Largest true errors, and their largest ratio to ten times the reported ones."""
    row: dict[str, Any] = {"truths": 0, "wrong_index": 0, "error": 0.0, "ratio": 0.0, "j_error": 0.0, "j_ratio": 0.0}
    row |= {"det_ratio": 0.0, "wrongly_captured": 0}
    columns, sure = checks.columns_in_space(beams), certain(beams)
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
        if not beams.diameter_error[i] < 1:
            # The largest error that is ever reported: nothing is known of J.
            continue
        row["j_ratio"] = max(row["j_ratio"], of_j / (HONEST * float(beams.diameter_error[i])))
        row["det_ratio"] = max(row["det_ratio"], of_det / (2 * HONEST * float(beams.diameter_error[i])))
    return row
