"""Rings: images of a star on a caustic that is a point, as that of a hole without spin or of a camera on the spin axis.

Around the line through camera and hole all is alike there, and a star on it has no two images that meet, but a whole
critical curve of them: Einstein's ring, or one of a higher order.
"""

import math

import numpy as np
from jaxtyping import Bool

from kerrcaustics.beams.ends import Spherical
from kerrcaustics.curves.critical_curves import CriticalCurve
from kerrcaustics.curves.screens import shown_looking
from kerrcaustics.curves.source_map import SourceMap
from kerrcaustics.spacetime.camera import Camera

Array = np.ndarray

# Rounding of a direction.
_ROUNDING = 4e-16


def on_rings(ring: Bool[Array, "stars orders"]) -> Bool[Array, "stars orders"]:
    """By star and index, True where the images on a sheet are a ring, which is its outer or its inner edge.

    Parameters: ring, by star and order, True for stars on a caustic that is a point.
    """
    return ring | np.pad(ring, ((0, 0), (1, 0)))[:, :-1]


def ring_remark(camera: Camera, end: Spherical, curve: CriticalCurve, where: str = "lies on") -> str:
    """One line about the ring that is the image of a star on the caustic of a curve, as a camera sees it."""
    order, (radius, error) = curve.order, _angular_radius(camera, curve)
    if order == 1 and SourceMap(camera, end).unbounded:
        size = "at infinite (alpha, beta)"
    elif camera.is_distant:
        size = f"of radius {radius:.12g} GM/c^2 (within {error:.0e})"
    else:
        size = f"of angular radius {radius:.12g} rad, {math.degrees(radius):.10g} degrees (within {error:.0e} rad)"
    return (
        f"the star {where} the caustic of order {order}, which is a point: its images of index {order - 1} and {order} "
        f"are one ring {size}"
    )


def _angular_radius(camera: Camera, curve: CriticalCurve) -> tuple[float, float]:
    """Radius of a critical curve that is a circle, and its error: radians, of an Observer in M."""
    places = shown_looking(camera, np.concatenate([curve.points.looking, [[-1.0, 0.0, 0.0]]]))
    ring, hole = places[:-1], places[-1]
    if camera.is_distant:
        sizes = np.linalg.norm(ring, axis=1)
        return float(sizes.mean()), float(np.ptp(sizes) + _ROUNDING * sizes.max())
    one, two, three = ring[:: max(1, len(ring) // 3)][:3]
    # Aberration takes circles to circles, about another centre.
    centre = np.cross(two - one, three - one)
    centre *= math.copysign(1 / np.linalg.norm(centre), centre @ (hole - one))
    sizes = np.arctan2(np.linalg.norm(np.cross(ring, centre), axis=1), ring @ centre)
    return float(sizes.mean()), float(np.ptp(sizes) + _ROUNDING)
