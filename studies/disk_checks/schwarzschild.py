"""Rays round a hole that does not spin, in closed form: the radius as a function of the angle swept round the hole.

(du/dpsi)^2 = 2 u^3 - u^2 + 1/b^2 with u = 1/r: Luminet 1979, A&A 75, 228, eqs. 3 to 13, for rays that turn (three real
roots, his equation 13) and for those that fall in (one real root).
"""

import math

import numpy as np
from scipy.optimize import elementwise
from scipy.special import ellipj, ellipk, ellipkinc

Array = np.ndarray

# Impact parameter below which rays fall in.
CRITICAL = 3 * math.sqrt(3)
# 1 / r of rays that have come to the centre.
_CENTRE = 1e9


def reciprocal_radius(b: Array, swept: Array, start: float) -> Array:
    """1 / r (n,) of rays of impact parameter b that have swept an angle since 1 / r was `start`, inward there.

    It is negative where the ray has left to infinity before.
    """
    turns = b > CRITICAL
    found = np.empty_like(b)
    found[turns] = _turning(b[turns], swept[turns], start)
    found[~turns] = _falling(b[~turns], swept[~turns], start)
    return found


def _turning(b: Array, swept: Array, start: float) -> Array:
    """With the three roots u1 < 0 < u2 < u3 as Viete has them."""
    angle = np.arccos(np.clip(1 - 54 / b**2, -1, 1)) / 3
    u1, u2, u3 = ((1 + 2 * np.cos(angle + k * 2 * math.pi / 3)) / 6 for k in (1, 2, 0))
    m = (u2 - u1) / (u3 - u1)
    first = ellipkinc(np.arcsin(np.sqrt((start - u1) / (u2 - u1))), m)
    # Half a period later it has left, whatever it swept.
    sine, *_ = ellipj(np.minimum(np.sqrt((u3 - u1) / 2) * swept + first, 2 * ellipk(m)), m)
    return u1 + (u2 - u1) * sine**2


def _falling(b: Array, swept: Array, start: float) -> Array:
    """With the one real root u1, the real part of the others, and the distance of these from u1."""
    u1 = (1 - 2 * np.cosh(np.arccosh(np.maximum(54 / b**2 - 1, 1)) / 3)) / 6
    part = (0.5 - u1) / 2
    size = np.sqrt(u1 * (u1 - 2 * part) - 1 / (2 * b * b * u1))
    m = (size + part - u1) / (2 * size)
    argument = np.sqrt(2 * size) * swept + ellipkinc(2 * np.arctan(np.sqrt((start - u1) / size)), m)
    _, cosine, _, _ = ellipj(argument, m)
    there = argument < 2 * ellipk(m)
    return np.where(there, u1 + size * (1 - cosine) / np.where(there, 1 + cosine, 1), _CENTRE)


def swept_to_plane(inclination: float, turn: Array, crossing: int) -> Array:
    """Angle (n,) round the hole to the n-th crossing of the plane, of rays that leave at a turn from right to up."""
    first = np.arctan2(-math.cos(inclination), np.sin(turn) * math.sin(inclination))
    return np.mod(first, math.pi) + (crossing - 1) * math.pi


def isoradial(radius: float, inclination: float, turn: Array, crossing: int, start: float = 0.0) -> Array:
    """Impact parameters b (n,) at which a ring is seen at turns, from 1 / r = start."""
    swept = swept_to_plane(inclination, turn, crossing)

    def short(b: Array, swept: Array) -> Array:
        return 1 / radius - reciprocal_radius(b, swept, start)

    bracket = np.full_like(turn, 1e-3), np.full_like(turn, 2 * radius + 20)
    return elementwise.find_root(short, bracket, args=(swept,), tolerances={"xrtol": 1e-14}).x
