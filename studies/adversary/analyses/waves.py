"""Waves about spinning holes, each method held against the sum over separated modes.

Spins 0 to 0.998, viewers from the photon orbits to 12 M, sources at 2 to 40 times their radius or, exchanged with the
viewer, nearer to the hole; at random, behind the hole, and on and beside folds and cusps of orders 1 and 2.
"""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.spacetime import kerr
from kerrcaustics.waves.amplification import METHODS
from studies.truth import separated_modes

from .claim import Claim, Kind

# Largest distances from a fold or cusp and from the point behind the hole, radians.
_BESIDE, _BEHIND = 0.3, 0.5
_PLACES = ("random", "behind", "fold", "cusp")
_FREQUENCIES = (0.3, 3.8)
# Largest radians of phase from the hole to the nearer and to the farther place: the time of the sum grows with them.
_MOST_NEAR, _MOST_FAR = 10.0, 80.0
# Radius of the outermost photon orbit.
_PHOTON_ORBITS = 4.0
# Least part of the field of which the sum over modes is certain.
_CERTAIN = 1e-6


def waves(rng: np.random.Generator) -> list[Claim]:
    """One source at one frequency, by every method."""
    spin = float(rng.choice([0.0, rng.uniform(0, 0.998), 0.998]))
    near = float(kerr.horizon(spin)) * 10 ** rng.uniform(0.1, 0.9)
    inclination = float(rng.choice([math.pi / 2, math.acos(rng.uniform(-0.95, 0.95))]))
    omega = float(10 ** rng.uniform(*np.log10(_FREQUENCIES)))
    omega = max(min(omega, _MOST_NEAR / near), _FREQUENCIES[0])
    far = near * max(min(float(rng.choice([2.0, 5.0, 20.0, 40.0])), _MOST_FAR / (omega * near)), 2.0)
    # Among the photon orbits there are no sources.
    exchanged = bool(rng.uniform() < 0.25) and near > _PHOTON_ORBITS
    radius, end = (far, near) if exchanged else (near, far)
    camera = kc.Camera(spin, radius, inclination, "fiducial")
    place = _place(rng, kc.Camera(spin, near, inclination, "fiducial"), far)
    return _claims(camera, place, omega, end)


def _place(rng: np.random.Generator, camera: kc.Camera, end: float) -> tuple[float, float]:
    """Where the source lies, on the larger of both spheres."""
    kind = str(rng.choice(_PLACES))
    theta, phi = math.acos(rng.uniform(-1, 1)), float(rng.uniform(0, 2 * math.pi))
    off = float(10 ** rng.uniform(-4, 0)) * rng.normal(size=2) * float(rng.uniform() < 0.8)
    if kind == "behind":
        theta, phi = np.array([math.pi - camera.inclination, math.pi]) + _BEHIND * off
    elif kind != "random":
        caustic = list(kc.caustics(camera, int(rng.integers(1, 3)), end=end))[-1]
        points = caustic.place if kind == "fold" else np.array([cusp.celestial for cusp in caustic.cusps])
        if len(points):
            theta, phi = rng.choice(points) + _BESIDE * off
    # Beyond a pole the place lies on the other side.
    theta = math.acos(math.cos(theta))
    return float(theta), float(phi % (2 * math.pi))


def _claims(camera: kc.Camera, place: tuple[float, float], omega: float, end: float) -> list[Claim]:
    """What every method says, by the separated modes; nothing where these are not certain."""
    inner, outer = sorted((camera.radius, end))
    angles = (camera.inclination, place[0]) if inner == camera.radius else (place[0], camera.inclination)
    # The Green function does not change if both places are exchanged.
    truth, rest = separated_modes.field(
        camera.spin, omega, (inner, angles[0]), outer, np.array([[angles[1], place[1]]])
    )
    if not rest[0] < _CERTAIN * abs(truth[0]):
        return []
    found = []
    for method in METHODS:
        seen = kc.amplification(camera, place, omega, max_index=2, end=end, method=method)
        ratio = float(abs(seen.value[0] - truth[0]) / (seen.error[0] + rest[0]))
        code = f"kc.amplification({camera!r}, {place!r}, {omega!r}, end={end!r}, method={method!r})  # {truth[0]:.9g}"
        found.append(Claim(f"waves, {method}", ratio, code))
    return found


KINDS: dict[str, Kind] = {"waves": waves}
