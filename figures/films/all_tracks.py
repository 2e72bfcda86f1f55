"""
All tracks of a star
====================

All images of index 0 to 3 of a star at θ′ = 0.4 π (JTFT, fig 7 and the third clip: 0.6 π, from the other pole) run
along their tracks while a camera at r = 6.03 goes once round a hole of spin 0.999. A track leads through the critical
curves from one index to the next: its images are born and die in pairs.
"""

import math

import kerrcaustics as kc
from kerrcaustics.draw.films import Film
from kerrcaustics.draw.orbit_films import orbit_film

SPIN, RADIUS, THETA, MAX_INDEX = 0.999, 6.03, 0.4 * math.pi, 3


def film(frames: int = 750) -> Film:
    camera = kc.Camera(spin=SPIN, radius=RADIUS)
    tracks = kc.star_tracks(camera, THETA, MAX_INDEX)
    return orbit_film(tracks, kc.caustics(camera, orders=MAX_INDEX + 1), frames)
