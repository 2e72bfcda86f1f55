"""
Caustics as the spin grows
==========================

A camera at r = 6.03 while the spin of the hole grows from 0 to 0.999: the points that the caustics of a Schwarzschild
hole are open into astroids, which drift and wind round the celestial sphere. The frames come closer together in spin
toward the end, where the caustics change fastest.
"""

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.caustic_films import caustics_frame
from kerrcaustics.draw.films import Film

RADIUS, HIGHEST = 6.03, 0.999


def film(frames: int = 240) -> Film:
    # To as many places as the title has.
    spins = np.round(HIGHEST * np.sin(np.linspace(0, np.pi / 2, frames)), 4)

    def draw(number: int) -> np.ndarray:
        spin = float(spins[number])
        caustics = kc.caustics(kc.Camera(spin=spin, radius=RADIUS), orders=3)
        return caustics_frame(caustics, f"The spin of the hole grows: a = {spin:.4f}. Camera at r = {RADIUS} M.")

    return Film("spin", {"radius": RADIUS, "to": HIGHEST}, frames, 24, draw)
