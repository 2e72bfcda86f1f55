"""Rings: images of a star on a caustic that is a point, as that of a hole without spin or of a camera on the spin axis.

Around the line through camera and hole all is alike there, and a star on it has no two images that meet, but a whole
critical curve of them: Einstein's ring, or one of a higher order.
"""

import numpy as np
from jaxtyping import Bool

from kerrcaustics.beams.ends import End
from kerrcaustics.curves.critical_curves import CriticalCurve
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.lens_map.search_sky import search_sky, shown_line_of_sight
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


def on_rings(ring: Bool[Array, "stars orders"]) -> Bool[Array, "stars orders"]:
    """By star and index, True where the images on a sheet are a ring, which is its outer or its inner edge.

    Parameters: ring, by star and order, True for stars on a caustic that is a point.
    """
    return ring | np.pad(ring, ((0, 0), (1, 0)))[:, :-1]


def ring_remark(camera: Viewer, surface: End, curve: CriticalCurve, where: str = "lies on") -> str:
    """A remark about the ring that is the image of a star on the caustic of a curve, as a camera sees it."""
    order, (radius, error) = curve.order, _angular_radius(camera, curve)
    if order == 1 and domain_of(surface, camera).unbounded:
        size = "at infinite (alpha, beta)"
    else:
        size = f"of radius {radius:.12g} {camera.sky_unit} (within {error:.0e})"
    return (
        f"the star {where} the caustic of order {order}, which is a point: its images of index {order - 1} and {order} "
        f"are one ring {size}"
    )


def _angular_radius(camera: Viewer, curve: CriticalCurve) -> tuple[float, float]:
    """Radius of a critical curve that is a circle, and its error: radians, of an Observer in M."""
    places = shown_line_of_sight(camera, np.concatenate([curve.points.line_of_sight, [[-1.0, 0.0, 0.0]]]))
    return search_sky(camera).circle_radius(places[:-1], places[-1])
