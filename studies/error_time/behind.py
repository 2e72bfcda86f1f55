"""Discs on the celestial sphere of a hole without spin, in closed form: shares no code with the package.

Rays of a camera at rest sweep an angle round the hole until they are far away: Luminet 1979, as in
disk_checks/schwarzschild.py. The sky is symmetric about the hole, so that a disc is a sum over distances from the point
behind it.
"""

import math

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

from ..disk_checks.schwarzschild import CRITICAL
from .differences import difference

# Nodes across a disc, and the step of derivatives.
_NODES, _STEP = 60, 4e-3


def swept(distance: float, b: float) -> float:
    """The angle round the hole from a camera to infinity of a ray that passes the hole; inward at first."""
    angle = math.acos(max(1 - 54 / b**2, -1)) / 3
    u1, u2, u3 = ((1 + 2 * math.cos(angle + k * 2 * math.pi / 3)) / 6 for k in (1, 2, 0))
    m = (u2 - u1) / (u3 - u1)
    ends = (float(ellipkinc(math.asin(math.sqrt((u - u1) / (u2 - u1))), m)) for u in (1 / distance, 0.0))
    return (2 * float(ellipk(m)) - sum(ends)) / math.sqrt((u3 - u1) / 2)


def cosine(distance: float, angle: float) -> float:
    """The cosine of the angle from the hole, on the sky of a camera at rest, of rays that sweep such an angle."""
    most = distance / math.sqrt(1 - 2 / distance) * (1 - 1e-14)
    low, high = math.log(1e-9), math.log(most - CRITICAL)
    x = brentq(lambda x: swept(distance, CRITICAL + math.exp(x)) - angle, low, high, xtol=1e-15, rtol=1e-15)
    b = CRITICAL + math.exp(x)
    return math.sqrt(1 - (1 - 2 / distance) * (b / distance) ** 2)


def centred(distance: float, size: float) -> float:
    """The magnification of a disc straight behind the hole, with the images beside its Einstein ring."""
    inner, outer = (cosine(distance, math.pi + side * size) for side in (1, -1))
    return abs(inner - outer) / (1 - math.cos(size))


def beside(distance: float, away: float, size: float) -> float:
    """The magnification of a disc so far from the point behind the hole, with its first two images."""
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    turn = math.pi / 2 * (node + 1)
    places = away - size * np.cos(turn)
    half = (math.cos(size) - np.cos(places) * math.cos(away)) / (np.sin(places) * math.sin(away))
    width = 2 * np.arccos(np.clip(half, -1, 1)) * size * np.sin(turn) * math.pi / 2 * weight
    area = 0.0
    for side in (-1, 1):
        slope = [_slope(distance, math.pi + side * place) for place in places.tolist()]
        area += float(width @ np.abs(slope))
    return area / (2 * math.pi * (1 - math.cos(size)))


def _slope(distance: float, angle: float) -> float:
    """The derivative of the cosine."""
    return difference(lambda k: cosine(distance, angle + k * _STEP)) / _STEP
