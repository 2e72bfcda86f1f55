"""
The galactic plane over an orbit
================================

One orbit of a camera at r = 2.6 round a hole of spin 0.999: the images of the galactic plane, inclined by 25 degrees to
the equatorial plane as in the star field (JTFT, fig 8), with one colour a Morse index. How many of them lie at the flat
left edge of the shadow, above it and below it is counted in each frame anew, and whether images and counts are
certified is said there.
"""

import math

import kerrcaustics as kc
from kerrcaustics.draw.circles import circle_film
from kerrcaustics.draw.films import Film

SPIN, RADIUS = 0.999, 2.6
# That of the sky of stars where no other is wanted: its tilt, and a quarter turn before its ascending node.
NORMAL = (math.radians(25), math.radians(-60 - 90))


def film(frames: int = 240) -> Film:
    return circle_film(kc.Camera(spin=SPIN, radius=RADIUS), NORMAL, frames=frames)
