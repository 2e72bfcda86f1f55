"""
Hot spots round a spinning hole
===============================

The film hot_spots for a spin of 0.95: circular orbits are stable down to r = 1.94, and the 5000 spots lie between 2.2
and 9. Close to the hole they go round in 26 units of time, at 9 in 176; the inner ones are dim and red, or, where they
come toward the camera, bright and blue.
"""

from kerrcaustics.draw.films import Film

from .hot_spots import film as hot_spots

SPIN, INNER = 0.95, 2.2


def film(frames: int = 150) -> Film:
    return hot_spots(frames, "hot_spots_kerr", SPIN, INNER)
