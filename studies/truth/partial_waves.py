"""Scalar waves about a hole without spin as a sum of partial waves, which shares nothing with rays.

A wave of angular frequency omega falls in from far away; the field at a finite radius is a sum over l of radial
functions, ingoing at the horizon (Regge & Wheeler's equation for a scalar), which converges without tricks. Waves go as
exp(-i omega t), and the phase is that of the times of rays. M = 1. Of a source at a finite radius, whose strength is
by coordinate time, the field is the sum of Green's functions.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import eval_legendre

Array = np.ndarray

# Where radial functions begin, by the horizon, and where they are split into waves.
_NEAR, _FAR = 1e-5, 600.0
# Partial waves beyond those whose impact parameter is the camera's distance; most terms of a series.
_BEYOND, _TERMS = 30, 60


def field(omega: float, radius: float, angles: Array) -> Array:
    """The field at a radius, unlensed 1, of stars at angles (radians) from the direction opposite to the camera's."""
    count = math.ceil(omega * radius / math.sqrt(1 - 2 / radius) + _BEYOND)
    level = np.arange(count + 1)
    barrier = level * (level + 1.0)
    (here, value), (_, slope) = _inner(omega, barrier, (radius, _FAR))
    out, ahead, come, back = *_series(omega, barrier, 1), *_series(omega, barrier, -1)
    incoming = (value * ahead - slope * out) / (come * ahead - out * back)
    shares = -((-1.0) ** level) * (2 * level + 1) / (2j * omega * radius) * here / incoming
    legendre = np.array([eval_legendre(level, math.cos(angle)) for angle in angles])
    return np.exp(-2j * omega * math.log(2)) * (legendre @ shares)


def field_within(omega: float, radii: tuple[float, float], angles: Array) -> Array:
    """The field of a source at one radius at the other, unlensed 1, at angles between both."""
    low, high = sorted(radii)
    # Further terms fall as the ratio of the radii to the power l.
    count = math.ceil(omega * low / math.sqrt(1 - 2 / low) + _BEYOND / math.log(high / low))
    level = np.arange(count + 1)
    barrier = level * (level + 1.0)
    (value,), (slope,) = _inner(omega, barrier, (low,))
    out, ahead = _outer(omega, barrier, (high, low))
    shares = (2 * level + 1) / (low * high) * value * out[0] / (slope * out[1] - value * ahead[1])
    legendre = np.array([eval_legendre(level, math.cos(angle)) for angle in angles])
    distance = np.sqrt(low**2 + high**2 - 2 * low * high * np.cos(angles))
    return distance * (legendre @ shares)


def _tortoise(r: float) -> float:
    return r + 2 * math.log(r / 2 - 1)


def _inner(omega: float, barrier: Array, radii: tuple[float, ...]) -> tuple[Array, Array]:
    """Radial functions that are ingoing at the horizon, at growing radii, and rates by the tortoise coordinate."""
    # The first two terms of the series at the horizon.
    start, next_term = 2 + _NEAR, (barrier + 1) / 4 / (0.5 - 2j * omega)
    wave = np.exp(-1j * omega * _tortoise(start))
    value = wave * (1 + next_term * _NEAR)
    slope = wave * (-1j * omega * (1 + next_term * _NEAR) + (1 - 2 / start) * next_term)
    return _carried(omega, barrier, (value, slope), (start, *radii))


def _outer(omega: float, barrier: Array, radii: tuple[float, ...]) -> tuple[Array, Array]:
    """Radial functions that are outgoing far away, at falling radii, and their rates."""
    return _carried(omega, barrier, _series(omega, barrier, 1), (_FAR, *radii))


def _carried(omega: float, barrier: Array, first: tuple[Array, Array], radii: tuple[float, ...]) -> tuple[Array, Array]:
    """Radial functions and their rates, carried from the first radius to the others."""

    def rates(r: float, values: Array) -> Array:
        value, slope = values.reshape(2, -1)
        f = 1 - 2 / r
        return np.concatenate([slope / f, -(omega**2 - f * (barrier / r**2 + 2 / r**3)) * value / f])

    ends = solve_ivp(
        rates, (radii[0], radii[-1]), np.concatenate(first), "DOP853", t_eval=radii[1:], rtol=1e-10, atol=1e-12
    ).y.T
    return ends[:, : len(barrier)], ends[:, len(barrier) :]


def _series(omega: float, barrier: Array, sign: int) -> tuple[Array, Array]:
    """Outgoing (1) or ingoing (-1) waves far away and their rates: a series in 1 / r, as far as its terms fall."""
    before, term = np.zeros(len(barrier), complex), np.ones(len(barrier), complex)
    value, slope, last = term.copy(), np.zeros_like(term), np.full(len(barrier), np.inf)
    falls = np.ones(len(barrier), bool)
    for k in range(_TERMS):
        following = ((k * (k + 1) - barrier) * term - 2 * k * k * before) / (sign * 2j * omega * (k + 1))
        part = following * _FAR ** -(k + 1.0)
        # Terms of high l grow first.
        falls &= (np.abs(part) < last) | (2 * omega * _FAR * (k + 1) < barrier)
        if not falls.any():
            break
        value = np.where(falls, value + part, value)
        slope = np.where(falls, slope - (k + 1) * part / _FAR, slope)
        last = np.where(falls, np.abs(part), last)
        before, term = term, following
    wave = np.exp(sign * 1j * omega * _tortoise(_FAR))
    return wave * value, wave * (sign * 1j * omega * value + (1 - 2 / _FAR) * slope)
