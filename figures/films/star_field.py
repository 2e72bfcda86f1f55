"""
Stars over one orbit
====================

What a camera at r = 6.03 sees while it goes once round a hole of spin 0.999, looking at the hole: the stars of
Hipparcos and a galactic band drift to the right outside the primary critical curve and to the left inside it, and
brighten where image pairs are born and die. Each frame is exposed for half of its time (motion blur), or for 1.5
degrees of the orbit where frames are few. The beams are traced once; the sky turns.
"""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.draw.films import Film

SPIN, RADIUS, FIELD = 0.999, 6.03, 115.0
WIDTH, HEIGHT, EXPOSED = 960, 540, 0.5
LONGEST_EXPOSURE = math.radians(1.5)


def film(frames: int = 240) -> Film:
    camera = kc.Camera(spin=SPIN, radius=RADIUS)
    view = kc.trace_view(camera, kc.View.toward_hole(camera, WIDTH, HEIGHT, math.radians(FIELD)))
    step = 2 * math.pi / frames
    sky = kc.StarField(sweep=min(EXPOSED * step, LONGEST_EXPOSURE))

    def draw(number: int) -> np.ndarray:
        # The camera moves toward larger phi': seen from it, the sky turns the other way.
        light = view.show(kc.TurnedSky(sky, -step * number)).light
        return kc.tone_mapped(light, exposure=1 / 2500, curve="asinh", softening=25)

    settings = {"spin": SPIN, "radius": RADIUS, "field": FIELD, "size": (WIDTH, HEIGHT), "exposed": EXPOSED}
    return Film("star_field", settings, frames, 24, draw)
