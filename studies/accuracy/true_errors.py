"""True errors: traced beams against studies/truth/truth.json, by family of rays.

    python -m studies.accuracy.true_errors [engine] [tolerance]

Prints the median, 99 % and largest error of n' in radians, the 99 % and largest error of the Jacobian as vectors in
space over delta_plus, the largest ratio of true to reported error of both, and n' over 1e-16 delta_plus, which is about
what the rounding of N alone costs.
"""

import json
import sys
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime.sphere import polar_basis

TRUTH = Path(__file__).parents[1] / "truth" / "truth.json"


def errors(rays: list[dict], beams: kc.Beams) -> np.ndarray:
    """True error of n', its ratio to the reported one and to 1e-16 delta_plus, the same of J without the last."""
    direction, columns, major = (
        np.array([ray[name] for ray in rays], float) for name in ("direction", "columns", "delta_plus")
    )
    traced = np.stack(polar_basis(beams.direction), axis=-1) @ beams.jacobian
    of_n = np.linalg.norm(beams.direction - direction, axis=1)
    of_j = np.linalg.norm(traced - columns, axis=(1, 2)) / major
    return np.stack([of_n, of_n / beams.error, of_n / (1e-16 * major), of_j, of_j / beams.diameter_error])


def main() -> None:
    engine = sys.argv[1] if len(sys.argv) > 1 else "auto"
    tolerance = float(sys.argv[2]) if len(sys.argv) > 2 else 1e-13
    truth = json.loads(TRUTH.read_text(encoding="utf-8"))
    cameras = [kc.Camera(**camera) for camera in truth["cameras"]]
    families: dict[str, list[np.ndarray]] = {}
    for family, i in dict.fromkeys((ray["family"], ray["camera"]) for ray in truth["rays"]):
        rays = [ray for ray in truth["rays"] if (ray["family"], ray["camera"]) == (family, i)]
        sky = np.array([ray["sky"] for ray in rays])
        families.setdefault(family, []).append(errors(rays, kc.trace_beams(cameras[i], sky, engine, tolerance)))
    print(f"engine {engine}, tolerance {tolerance:g}")
    print(f"{'':18}|{'n` median':>9} {'99 %':>8} {'largest':>8} {'honesty':>8} {'floor':>8} |", end="")
    print(f"{'J 99 %':>9} {'largest':>8} {'honesty':>8}")
    for family, parts in families.items():
        n, n_ratio, n_floor, j, j_ratio = np.concatenate(parts, axis=1)
        found = [np.median(n), np.quantile(n, 0.99), n.max(), n_ratio.max(), n_floor.max()]
        more = [np.quantile(j, 0.99), j.max(), j_ratio.max()]
        print(f"{family:18}|" + " |".join("".join(f"{x:9.1e}" for x in row) for row in (found, more)))


if __name__ == "__main__":
    main()
