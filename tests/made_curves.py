"""Made-up caustics and critical curves, so that only the drawing of them can change a picture."""

import math
from dataclasses import replace

import numpy as np

from kerrcaustics.curves.caustic import Caustic, CausticSet, Cusp
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.shadow import shadow_edge

CAMERA = Camera(0.1, 8.0, velocity="fiducial")
EDGE = shadow_edge(CAMERA, 2000)


def ring(radius, n=96):
    """Directions at an angle (degrees) from the hole, clockwise: e_x points away from it, e_y to the right."""
    edge_phase, radius = 2 * math.pi * np.arange(n) / n, math.radians(radius)
    across = [math.sin(radius) * np.cos(edge_phase), -math.sin(radius) * np.sin(edge_phase)]
    return np.stack([np.full(n, -math.cos(radius)), *across], axis=-1)


def astroid(order, half_width, radius, n=96):
    """A made-up caustic of an order: an astroid, and a circle of this radius (degrees) for its critical curve."""
    edge_phase = 2 * math.pi * np.arange(n) / n
    height = min(0.9 * half_width, 1.3)
    shape = np.stack([math.pi / 2 - height * np.sin(edge_phase) ** 3, half_width * np.cos(edge_phase) ** 3], axis=-1)
    shape += (0.0, order * math.pi)
    sky = ring(radius, n)
    cusps = tuple(Cusp(sky[i], shape[i], 1e-12) for i in range(0, n, n // 4))
    low, high = shape.min(axis=0), shape.max(axis=0)
    extremes = (low[0], high[0], low[1], high[1])
    return Caustic(CAMERA, order, sky, shape, cusps, *extremes, "astroid", True, 1e-12, 1e-12, ())


def point(order, radius):
    """A made-up caustic that is a point."""
    made = astroid(order, 1e-15, radius)
    return replace(made, cusps=(), kind="point")


def made_set(curves, camera=CAMERA, missing=()):
    made = {"camera": camera, "engine": "", "seconds": 0.0, "beams": 0, "versions": {}}
    return CausticSet(tuple(curves), **made, missing=missing)


def astroids(count):
    """Orders 1 to count; the half width, in radians, grows from small to several circuits."""
    return made_set([astroid(k, 0.01 * 8.0 ** (k - 1), 40 + 20 / 4.0**k) for k in range(1, count + 1)])
