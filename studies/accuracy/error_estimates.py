"""Honesty of the reported errors: true over reported error of random rays of random cameras.

    python -m studies.accuracy.error_estimates [cameras] [seed] [engine]

Truth is the same ray integrated at a tolerance of 1e-14, whose own error is added to the one reported where another
engine is judged. Half of the rays are close to the shadow edge. Prints quantiles of the ratio for n' of beams, for n'
of rays traced alone, and for the Jacobian as vectors in space, and how often the Morse index differs.
"""

import sys
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime.sphere import polar_basis

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from random_rays import random_camera, random_sky

RAYS = 512


def columns(beams: kc.Beams) -> np.ndarray:
    """The Jacobian's columns as vectors in space (..., 3, 2)."""
    e_theta, e_phi = polar_basis(beams.direction)
    return e_theta[..., None] * beams.jacobian[..., :1, :] + e_phi[..., None] * beams.jacobian[..., 1:, :]


def ratios(camera: kc.Camera, sky: np.ndarray, engine: str) -> np.ndarray:
    """(4, escaping rays): true over reported error of n' of beams, n' of rays, Jacobian; whether the index differs."""
    beams, rays, exact = (
        kc.trace_beams(camera, sky, engine),
        kc.trace_rays(camera, sky, engine),
        kc.trace_beams(camera, sky, "integrated", tolerance=1e-14),
    )
    escaped = beams.escaped
    known = engine != "integrated"
    turned = np.linalg.norm(columns(beams) - columns(exact), axis=(-2, -1)) / exact.delta_plus
    found = [
        np.linalg.norm(beams.direction - exact.direction, axis=-1) / (beams.error + known * exact.error),
        np.linalg.norm(rays.direction - exact.direction, axis=-1) / (rays.error + known * exact.error),
        turned / (beams.diameter_error + known * exact.diameter_error),
        (beams.index != exact.index) & (beams.diameter_error < 0.01),
    ]
    return np.stack(found)[:, escaped]


def main() -> None:
    cameras = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1970)
    engine = sys.argv[3] if len(sys.argv) > 3 else "auto"
    found = []
    for _ in range(cameras):
        camera = random_camera(rng)
        found.append(ratios(camera, random_sky(camera, RAYS, rng), engine))
    everything = np.concatenate(found, axis=1)
    print(f"{engine}, {everything.shape[1]} rays of {cameras} cameras; ratio of true to reported error")
    print("           median     99 %   99.9 %  largest")
    for name, values in zip(("beams", "rays", "Jacobian"), everything[:3], strict=True):
        print(f"{name:9}" + "".join(f"{q:9.3f}" for q in np.quantile(values, [0.5, 0.99, 0.999, 1])))
    print(f"Morse index differs on {int(everything[3].sum())} rays")


if __name__ == "__main__":
    main()
