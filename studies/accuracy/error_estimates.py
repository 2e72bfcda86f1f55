"""Honesty of the reported errors: true over reported error of random rays of random cameras.

    python -m studies.accuracy.error_estimates [cameras] [seed] [engine] [sky | sphere | plane]

Truth is the same ray integrated at a tolerance of 1e-14, whose own error is added to the one reported where another
engine is judged. Half of the rays are close to the shadow edge. Prints quantiles of the ratio for n' of beams, for n'
of rays traced alone, and for the Jacobian as vectors in space, how many are above 1, and how often a certain Morse
index differs. Finite ends are spheres at 0.7 to 20 times the camera's radius, also at nearly that, and the first three
crossings of the plane.
"""

import math
import sys
from pathlib import Path

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.sphere import polar_basis

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from random_rays import random_camera, random_sky

RAYS = 512
# Radii of spheres, in units of the camera's, that are outside the horizon by this part of it.
RADII, OUTSIDE = (0.7, 0.999, 1.001, 2.0, 20.0), 0.02


def columns(beams: kc.Beams) -> np.ndarray:
    """The Jacobian's columns as vectors in space (..., 3, 2)."""
    e_theta, e_phi = polar_basis(beams.direction)
    return e_theta[..., None] * beams.jacobian[..., :1, :] + e_phi[..., None] * beams.jacobian[..., 1:, :]


def random_end(kind: str, camera: kc.Camera, rng: np.random.Generator) -> float | kc.EquatorialPlane:
    """An end of that kind for rays of a camera."""
    if kind == "plane":
        return kc.EquatorialPlane(int(rng.integers(1, 4)))
    nearest = (1 + OUTSIDE) * kerr.horizon(camera.spin)
    return max(camera.radius * float(rng.choice(RADII)), nearest) if kind == "sphere" else math.inf


def ratios(camera: kc.Camera, sky: np.ndarray, engine: str, end: float | kc.EquatorialPlane) -> np.ndarray:
    """(4, escaping rays): true over reported error of n' of beams, n' of rays, Jacobian; whether the index differs."""
    beams, rays, exact = (
        kc.trace_beams(camera, sky, engine, end=end),
        kc.trace_rays(camera, sky, engine, end=end),
        kc.trace_beams(camera, sky, "integrated", tolerance=1e-14, end=end),
    )
    escaped = beams.escaped & exact.escaped & beams.status_certain & np.isfinite(rays.error)
    known = engine != "integrated"
    turned = np.linalg.norm(columns(beams) - columns(exact), axis=(-2, -1)) / exact.delta_plus
    found = [
        np.linalg.norm(beams.direction - exact.direction, axis=-1) / (beams.error + known * exact.error),
        np.linalg.norm(rays.direction - exact.direction, axis=-1) / (rays.error + known * exact.error),
        turned / (beams.diameter_error + known * exact.diameter_error),
        (beams.index != exact.index) & beams.index_certain & exact.index_certain,
    ]
    return np.stack(found)[:, escaped]


def main() -> None:
    cameras = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1970)
    engine = sys.argv[3] if len(sys.argv) > 3 else "auto"
    kind = sys.argv[4] if len(sys.argv) > 4 else "sky"
    found = []
    for _ in range(cameras):
        camera = random_camera(rng)
        sky, end = random_sky(camera, RAYS, rng), random_end(kind, camera, rng)
        found.append(ratios(camera, sky, engine, end))
    everything = np.concatenate(found, axis=1)
    print(f"{engine}, {everything.shape[1]} rays of {cameras} cameras to the {kind}; ratio of true to reported error")
    print("           median     99 %   99.9 %  largest  above 1")
    for name, values in zip(("beams", "rays", "Jacobian"), everything[:3], strict=True):
        quantiles = "".join(f"{q:9.3f}" for q in np.quantile(values, [0.5, 0.99, 0.999, 1]))
        print(f"{name:9}{quantiles}{np.count_nonzero(values > 1):9}")
    print(f"Morse index differs on {int(everything[3].sum())} rays")


if __name__ == "__main__":
    main()
