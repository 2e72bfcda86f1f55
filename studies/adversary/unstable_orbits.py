"""Are bodies in free fall where they are said to be, and do circular orbits stay on their circles?

    python -m studies.adversary.unstable_orbits SECONDS [SEED]

Random falls about holes with any spin: thrown in any direction; by vectors that happen to be those of circular orbits,
stable or not, and of either sense; and beside these by 1e-9 to 3e-2, which whirl about the hole before they fall in or
turn back. Places are compared with the truth in long arithmetic (true_orbits.py), in units of the reported errors;
circular orbits with their radius and latitude. Prints what was tried, how large the ratios are, and every broken claim
as a line of Python.
"""

import math
import sys
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import kerrcaustics as kc
from kerrcaustics.orbits.geodesics import circular_velocity
from kerrcaustics.spacetime import kerr

from .true_orbits import Release, true_fall

# True error over reported error that is still a kept promise.
HONEST = 1.0
# Reported errors of this size say that nothing is known.
UNKNOWN = 1.0
_LATEST, _DIGITS = 2.7, 32
# The horizon over the radius of what has fallen in.
_AT_HORIZON = 0.9998


class Claim(NamedTuple):
    """True and reported error of a place, relative to the radius, and the call."""

    off: float
    error: float
    name: str

    @property
    def ratio(self) -> float:
        """True over reported error; 0 where nothing is claimed."""
        return self.off / self.error if self.error < UNKNOWN else 0.0


def releases(seed: int) -> Iterator[tuple[Release, float]]:
    """Random bodies, each with a time from its release."""
    rng = np.random.default_rng(seed)
    while True:
        spin = float(rng.choice([0.0, rng.uniform(0, 1), 1 - 10 ** rng.uniform(-6, -1)]))
        radius = float(kerr.horizon(spin) + 10 ** rng.uniform(-0.5, 1.3))
        theta = math.pi / 2 if rng.uniform() < 0.7 else float(rng.uniform(0.6, math.pi - 0.6))
        velocity = _velocity(rng, spin, radius, theta)
        if velocity is not None and math.hypot(*velocity) < 1:
            yield Release(spin, radius, theta, velocity), float(rng.choice([-1, 1]) * 10 ** rng.uniform(0.5, _LATEST))


def _velocity(rng: np.random.Generator, spin: float, radius: float, theta: float) -> tuple[float, float, float] | None:
    """Any velocity, that of a circular orbit, or one beside it; None where there is no such orbit."""
    if rng.uniform() < 0.3:
        way = rng.normal(size=3) * (1, theta != math.pi / 2, 1)
        v_r, v_theta, v_phi = (way / np.linalg.norm(way) * rng.uniform(0, 0.9)).tolist()
        return v_r, v_theta, v_phi
    try:
        _, v_theta, v_phi = circular_velocity(spin, radius, theta, float(rng.choice([0.0, math.pi])))
    except ValueError:
        return None
    if rng.uniform() < 0.5:
        return 0.0, v_theta, v_phi
    beside = float(10 ** rng.uniform(-9, -1.5) * rng.choice([1, -1]))
    return float(rng.choice([0, 1e-6, 1e-3]) * rng.normal()), v_theta, v_phi * (1 + beside)


def fall_claim(release: Release, late: float) -> Claim:
    """The place of a fall a time after its release against the truth."""
    orbit = kc.Orbit.geodesic(release.radius, release.theta, velocity=release.velocity)
    motion = orbit.motion_about(release.spin, (min(late, 0.0), max(late, 0.0)))
    name = f"{orbit!r} about a = {release.spin!r} at t = {late!r}"
    error = float(motion.errors(np.array([late]))[0][0])
    true, horizon = true_fall(release, late, _DIGITS), kerr.horizon(release.spin)
    known = motion.span[0] <= late <= motion.span[1]
    places = motion.places(np.clip([late], *motion.span))
    if true is None or not known:
        # The integration ends shortly before the horizon: so what falls in only here, or only there, is off.
        fallen = (math.inf if true is None else horizon / float(true.radius)), horizon / places.radius[0]
        return Claim(float(min(fallen) < _AT_HORIZON), error, name)
    radius, theta, phi = (float(part) for part in true)
    n = np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
    off = abs(places.radius[0] / radius - 1) + float(np.linalg.norm(places.vector[0] - n))
    return Claim(float(off), error, name)


def circle_claim(release: Release, late: float, heading: str) -> Claim | None:
    """The radius of a circular orbit, and its highest latitude, a time later; None where there is none."""
    orbit = kc.Orbit.geodesic(release.radius, release.theta, velocity=heading)
    try:
        motion = orbit.motion_about(release.spin, (min(late, 0.0), max(late, 0.0)))
    except ValueError:
        return None
    times = np.linspace(0, late, 7)
    places = motion.places(times)
    highest = abs(math.cos(release.theta)) if release.theta != math.pi / 2 else 0.0
    beyond = np.maximum(np.abs(places.vector[:, 2]) - highest, 0).max()
    off = np.abs(places.radius / release.radius - 1).max() + beyond
    return Claim(float(off), float(motion.errors(times)[0].max()), f"{orbit!r} about a = {release.spin!r}")


def main(seconds: float, seed: int = 2015) -> int:
    """Try random falls for a time; return the number of broken claims."""
    claims: list[Claim] = []
    finish = time.monotonic() + seconds
    for release, late in releases(seed):
        if time.monotonic() > finish:
            break
        found = (
            fall_claim(release, late),
            *(circle_claim(release, 50 * late, way) for way in ("circular", "retrograde")),
        )
        claims += [claim for claim in found if claim is not None]
    known = np.array([claim.ratio for claim in claims if claim.error < UNKNOWN])
    broken = [claim for claim in claims if claim.ratio > HONEST]
    print(f"{len(claims)} claims, {len(claims) - len(known)} of which say that nothing is known; ratios:")
    print(", ".join(f"{q:g}: {np.quantile(known, q):.2g}" for q in (0.1, 0.5, 0.9, 0.99, 1)))
    for claim in broken:
        print(f"{claim.ratio:.3g} times {claim.error:.2g}: {claim.name}")
    return len(broken)


if __name__ == "__main__":
    sys.exit(min(main(float(sys.argv[1]), *map(int, sys.argv[2:])), 1))
