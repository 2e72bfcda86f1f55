"""The primary critical curve of an observer at infinity, for sources on the celestial sphere.

Seen from the radius r it is Einstein's ring, of radius 2 sqrt(r), and what is seen directly lies beyond it. At infinity
the ring, and all beyond, is the point at infinite (alpha, beta), and its caustic, whose size falls as 1 / r^2, is the
direction opposite to the observer: rays with an impact parameter b lead to 4 / b beside it.
"""

import math
from dataclasses import replace

import numpy as np

from kerrcaustics.curves.critical_curves import CriticalCurve, CriticalCurves
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.lens_map.domains import Domain
from kerrcaustics.spacetime.sphere import from_angles, polar_basis

# Points that stand for it, and the distance (radians) from its caustic within which rays are not followed to stars.
_POINTS, _UNKNOWN = 64, 1e-6


def check_index(domain: Domain, max_index: int) -> None:
    """Raise ValueError if only images at infinity are wanted."""
    if domain.unbounded and max_index == 0:
        raise ValueError(
            "Argument `max_index` must be at least 1 for an observer and stars at infinity (images of index 0 lie at "
            "infinite (alpha, beta)), but is 0."
        )


def with_ring_at_infinity(curves: CriticalCurves) -> CriticalCurves:
    """The curves, with such a ring as the first one if there is one: a point."""
    domain, camera = curves.domain, curves.map.camera
    if not domain.unbounded:
        return curves
    edge_phase = 2 * math.pi * np.arange(_POINTS) / _POINTS
    depth, ones = domain.first(edge_phase), np.ones(_POINTS)
    theta = math.pi - camera.inclination
    opposite = np.tile(from_angles(theta, math.pi), (_POINTS, 1))
    ring = Points(
        edge_phase=edge_phase,
        depth=depth,
        line_of_sight=domain.line_of_sight(edge_phase, depth)[0],
        direction=opposite,
        theta=theta * ones,
        azimuth=math.pi * ones,
        major=polar_basis(opposite)[1],
        ratio=0 * ones,
        error=_UNKNOWN * ones,
    )
    others = tuple(curve for curve in curves if curve.order > 1)
    return replace(curves, curves=(CriticalCurve(1, ring.frozen(), closed=True, remarks=()), *others))
