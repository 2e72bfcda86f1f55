"""
Birth and death of an image pair
================================

One orbit of a camera at r = 6.03 round a hole of spin 0.999. A star at θ′ = 0.392 π (JTFT, fig 6 and the second clip:
0.608 π, from the other pole) drifts round the camera's sky. Where it crosses the secondary caustic, two of its images
are born at one point of the secondary critical curve; one circuit ends with the death of another pair. Ours: the view
at the shadow edge, the celestial sphere, and time, which runs slower around each event.
"""

import math

import kerrcaustics as kc
from kerrcaustics.draw.films import Film
from kerrcaustics.draw.orbit_films import orbit_film

SPIN, RADIUS, THETA, MAX_INDEX = 0.999, 6.03, 0.392 * math.pi, 2


def film(frames: int = 600) -> Film:
    camera = kc.Camera(spin=SPIN, radius=RADIUS)
    tracks = kc.star_tracks(camera, THETA, MAX_INDEX)
    return orbit_film(tracks, kc.caustics(camera, orders=MAX_INDEX + 1), frames)
