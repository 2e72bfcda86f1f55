"""
Caustics seen on the way down
=============================

A camera on circular orbits descends from r = 50 to r = 2.6 in the equatorial plane of a hole of spin 0.999: the shadow
and the critical curves fill its sky, the caustics grow and wind further round the celestial sphere.
"""

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.caustic_films import caustics_frame
from kerrcaustics.draw.films import Film

SPIN, HIGHEST, LOWEST = 0.999, 50.0, 2.6


def film(frames: int = 240) -> Film:
    radii = np.geomspace(HIGHEST, LOWEST, frames)

    def draw(number: int) -> np.ndarray:
        radius = float(radii[number])
        caustics = kc.caustics(kc.Camera(spin=SPIN, radius=radius), orders=3)
        return caustics_frame(caustics, f"The camera descends on circular orbits: r = {radius:.2f} M, spin {SPIN}.")

    return Film("descent", {"spin": SPIN, "from": HIGHEST, "to": LOWEST}, frames, 24, draw)
