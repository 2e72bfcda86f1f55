"""Isoradials, line profiles and ring visibilities: against closed forms of holes without spin."""

import math
from collections.abc import Iterator

import numpy as np
from scipy.special import j1

import kerrcaustics as kc

from ..disk_checks.schwarzschild import isoradial
from ..disk_checks.twin import Screen, ring_profile
from .differences import difference
from .points import Measured, Result, Sizes

Array = np.ndarray

INCLINATION = 1.0
VIEWER = kc.Observer(spin=0.0, inclination=INCLINATION)
RADII = (6.0, 10.0)
CROSSINGS = 2
POINTS = (90, 360)
INNER, OUTER = 6.0, 6.06
POWER = 3.0
BINS = 50
NODES = ((4, 32), (4, 64), (8, 128), (16, 256), (32, 512))
# Twice the positions make the error of the slow sum smaller by this factor or more.
FALL = 4.0
# Longest baseline, per M.
LONGEST = 30.0
# Relative step of derivatives.
_STEP = 2e-3


def isoradials(sizes: Sizes) -> Iterator[Measured]:
    """Images of two circles, at two crossings; a result is one image."""
    for points in POINTS:
        pairs = []
        for curve in kc.isoradials(VIEWER, RADII, CROSSINGS, points):
            alpha, beta = curve.sky.T
            true = isoradial(curve.radius, INCLINATION, np.arctan2(beta, alpha), curve.crossing)
            pairs.append(np.stack([np.abs(np.hypot(alpha, beta) - true), curve.error]))

        def work(points: int = points) -> None:
            kc.isoradials(VIEWER, RADII, CROSSINGS, points)

        yield Measured(f"{points} points", work, *np.concatenate(pairs, axis=1), count=len(RADII) * CROSSINGS)


class ClosedScreen(Screen):
    """The screen of an observer of a hole without spin, with rings in closed form, for the slow sum of `twin`."""

    def ring(self, radius: float, turn: Array) -> tuple[Array, Array]:
        """g (n,), and solid angle for each dr and turn, of the first image."""
        b = isoradial(radius, self.inclination, turn, 1)
        slope = difference(lambda k: isoradial(radius * (1 + k * _STEP), self.inclination, turn, 1)) / (_STEP * radius)
        momentum = -b * np.cos(turn) * math.sin(self.inclination)
        return math.sqrt(1 - 3 / radius) / (1 - momentum * radius**-1.5), b * slope


def line_profiles(sizes: Sizes) -> Iterator[Measured]:
    """Bins of the profile of a narrow ring, relative to the highest one."""
    edges = kc.line_profile(VIEWER, INNER, OUTER, POWER, bins=BINS).edges
    coarse, true = (
        ring_profile(ClosedScreen(0.0, INCLINATION), INNER, OUTER, POWER, edges, turns, sizes.rings)
        for turns in (sizes.twin // 2, sizes.twin)
    )
    known = float(np.abs(coarse - true).max() / true.max() / FALL)
    for radii, turns in NODES:
        found = kc.line_profile(VIEWER, INNER, OUTER, POWER, bins=edges, radii=radii, turns=turns)

        def work(radii: int = radii, turns: int = turns) -> None:
            kc.line_profile(VIEWER, INNER, OUTER, POWER, bins=edges, radii=radii, turns=turns)

        off, reported = np.abs(found.flux - true) / true.max(), found.error / true.max()
        yield Measured(f"{radii} x {turns} beams", work, off, reported, known=known)


def visibilities(sizes: Sizes) -> Iterator[Measured]:
    """Visibilities of rings seen along the axis; relative to the flux of each ring, for all baselines."""
    rings = kc.photon_rings(kc.Observer(spin=0.0, inclination=0.0))
    u = np.geomspace(1e-3, LONGEST, sizes.baselines)
    seen = kc.ring_visibility(rings, u, 0.0)
    k, off, reported = 2 * math.pi * u, [], []
    for band, value, error in zip(rings[1:], seen.value, seen.error, strict=True):
        inner, outer = (float(np.hypot(*edge.sky[0])) for edge in band.rims)
        exact = 2 * math.pi * (outer * j1(k * outer) - inner * j1(k * inner)) / k
        off.append(np.abs(value - exact) / band.solid_angle)
        reported.append(error / band.solid_angle)
    setting = f"{sizes.baselines} baselines"
    yield Measured(
        setting, lambda: kc.ring_visibility(rings, u, 0.0), np.concatenate(off), np.concatenate(reported), len(u)
    )


_CLOSED = "closed form, no spin"
RESULTS = (
    Result("disks", "isoradials", "place across, M", _CLOSED, isoradials),
    Result("disks", "line profile", "bin, of the highest", f"sum over rays in {_CLOSED}", line_profiles),
    Result("disks", "ring visibility", "of a ring's flux", "Bessel functions", visibilities),
)
"""Results of this module."""
