"""
Critical curve and caustic, point by point
==========================================

Points run once round the critical curves on the camera sky, for spin 0.999 and r = 2.6. At the same time their images
run along the caustics on the celestial sphere, and turn back at the cusps, which bear the same letters.
"""

import kerrcaustics as kc
from kerrcaustics.draw.caustic_films import Mapping
from kerrcaustics.draw.films import Film

SPIN, RADIUS = 0.999, 2.6


def film(frames: int = 360) -> Film:
    mapping = Mapping(kc.caustics(kc.Camera(spin=SPIN, radius=RADIUS), orders=3))
    return Film("mapping", {"spin": SPIN, "radius": RADIUS}, frames, 30, lambda number: mapping.frame(number / frames))
