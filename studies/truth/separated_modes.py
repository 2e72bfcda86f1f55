"""Scalar waves of a point source about a spinning hole as a sum over separated modes, which shares nothing with rays.

Spheroidal functions are eigenvectors in Legendre functions (Brill et al. 1972); radial functions, ingoing at the
horizon and outgoing far away, begin with series there (Teukolsky 1973, spin weight 0) and are carried on by Runge-Kutta
steps. Waves go as exp(-i omega t), and phases are those of coordinate times and azimuths. M = 1.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import sph_legendre_p

Array = np.ndarray

# The series at the horizon: its place in units of the distance of the two horizons, and its terms.
_NEAR, _NEAR_TERMS = 0.5, 100
# The series far away: its place in wavelengths of the highest mode, at least this radius, and its terms.
_FAR, _LEAST, _FAR_TERMS = 8.0, 40.0, 40
# Modes beyond those that reach the viewer: by the logarithm of what is left, and more. Legendre functions beyond the
# highest mode; relative error of a step.
_FALL, _MORE, _BEYOND, _TOLERANCE = 26, 8, 40, 1e-10


@dataclass(frozen=True)
class Modes:
    """Separated modes of one frequency, (n,), and their spheroidal functions at the places, (places, n)."""

    spin: float
    omega: float
    azimuthal: Array
    eigenvalue: Array
    level: Array
    polar: Array

    def potential(self, r: float | Array) -> Array:
        """K = (r^2 + a^2) omega - a m."""
        return self.omega * (r * r + self.spin**2) - self.spin * self.azimuthal


def field(spin: float, omega: float, viewer: tuple[float, float], end: float, places: Array) -> tuple[Array, Array]:
    """The field at a viewer (r, theta; phi = 0), unlensed 1, of sources at places (theta', phi') of a larger radius.

    It is 4 pi d G, with d the flat distance and G the Green function. The second array is the size of what the last
    three levels of modes add.
    """
    radius, inclination = viewer
    # Further terms fall as the ratio of the radii to the power of the level.
    reach = omega * radius / math.sqrt(1 - 2 / max(radius, 2.5))
    count = math.ceil(reach + _FALL / math.log(end / radius) + _MORE)
    modes = _modes(spin, omega, count, np.array([inclination, *places[:, 0]]))
    near, inner, slope = _ingoing(modes, radius, end)
    outer, outer_slope = _outgoing(modes, end)
    # Delta times the Wronskian; the ratio keeps large numbers within range.
    radial = -near / inner / (outer_slope / outer - slope / inner)
    shares = modes.polar[0] * modes.polar[1:] * np.exp(-1j * modes.azimuthal * places[:, 1:]) * radial / (2 * math.pi)
    strength = 4 * math.pi * _distances(radius, inclination, end, places)
    rest = np.abs(shares[:, modes.level > count - 3]).sum(axis=1)
    return strength * shares.sum(axis=1), strength * rest


def _distances(radius: float, inclination: float, end: float, places: Array) -> Array:
    theta, phi = places.T
    cosine = np.sin(theta) * np.cos(phi) * math.sin(inclination) + np.cos(theta) * math.cos(inclination)
    return np.sqrt(radius**2 + end**2 - 2 * radius * end * cosine)


def _modes(spin: float, omega: float, count: int, theta: Array) -> Modes:
    """All modes up to a level, with their spheroidal functions at angles."""
    azimuthal, eigenvalue, level, polar = [], [], [], []
    for m in range(-count, count + 1):
        degree = np.arange(abs(m), count + _BEYOND + 1)
        # cos(theta) takes a normalised Legendre function to its neighbours.
        step = np.sqrt(((degree + 1) ** 2 - m * m) / ((2 * degree + 1) * (2 * degree + 3)))[:-1]
        cosine = np.diag(step, 1) + np.diag(step, -1)
        matrix = np.diag(degree * (degree + 1.0)) - (spin * omega) ** 2 * cosine @ cosine
        values, vectors = np.linalg.eigh(matrix[:-2, :-2])
        kept = np.arange(count + 1 - abs(m))
        legendre = sph_legendre_p(degree[:-2], abs(m), theta[:, None])[0] * math.sqrt(2 * math.pi)
        azimuthal.append(np.full(len(kept), float(m)))
        eigenvalue.append(values[kept] + (spin * omega) ** 2 - 2 * spin * m * omega)
        level.append(abs(m) + kept)
        polar.append(legendre @ vectors[:, kept])
    return Modes(spin, omega, *map(np.concatenate, (azimuthal, eigenvalue, level)), np.concatenate(polar, axis=1))


def _ingoing(modes: Modes, radius: float, end: float) -> tuple[Array, Array, Array]:
    """Radial functions that are ingoing at the horizon: R(radius), R(end) and Delta R'(end)."""
    width = 2 * math.sqrt(1 - modes.spin**2)
    horizon = 1 + width / 2
    start = _NEAR * min(width, radius - horizon)
    first, omega = modes.potential(horizon), modes.omega
    # R = exp(-i integral K / Delta) times a series in the distance from the horizon: a power of it alone would have
    # terms of exp(m / width).
    terms = [np.ones(len(first), complex)]
    for n in range(1, _NEAR_TERMS):
        total = (n * (n - 1) - 2j * omega * horizon * (2 * n - 1) - modes.eigenvalue) * start * terms[n - 1]
        if n > 1:
            total -= 2j * omega * (n - 1) * start**2 * terms[n - 2]
        terms.append(-total / (n * (width * n - 2j * first)))
    value = np.sum(terms, axis=0)
    rate = sum(n * term for n, term in enumerate(terms)) / start
    delta = start * (start + width)
    slope = delta * rate - 1j * modes.potential(horizon + start) * value
    values, slopes = _carried(modes, value, slope, (horizon + start, radius, end))
    return values[0], values[1], slopes[1]


def _outgoing(modes: Modes, end: float) -> tuple[Array, Array]:
    """Radial functions that are outgoing far away, and Delta times their slopes, at a radius."""
    omega, spin = modes.omega, modes.spin
    far = max(_LEAST, 2 * end, _FAR * modes.level.max() / omega)
    constant = omega * spin**2 - spin * modes.azimuthal
    terms = [np.ones(len(constant), complex)]
    # R = exp(i integral K / Delta) times a series in 1 / r.
    for k in range(1, _FAR_TERMS):
        total = (k * (k - 1) - modes.eigenvalue) * terms[k - 1] / far
        if k > 1:
            total -= (2 * (k - 1) ** 2 + 2j * (k - 1) * constant) * terms[k - 2] / far**2
        if k > 2:
            total += (k - 2) * (k - 1) * spin**2 * terms[k - 3] / far**3
        terms.append(total / (2j * k * omega))
    value = np.sum(terms, axis=0)
    rate = -sum((k + 1) * term for k, term in enumerate(terms)) / far
    delta = far**2 - 2 * far + spin**2
    values, slopes = _carried(modes, value, delta * rate + 1j * modes.potential(far) * value, (far, end))
    return values[0], slopes[0]


def _carried(modes: Modes, value: Array, slope: Array, radii: tuple[float, ...]) -> tuple[Array, Array]:
    """R and Delta R', carried from the first radius to the others."""

    def rates(r: float, state: Array) -> Array:
        function, rising = state.reshape(2, -1)
        delta = r * r - 2 * r + modes.spin**2
        return np.concatenate([rising / delta, (modes.eigenvalue - modes.potential(r) ** 2 / delta) * function])

    # Each function has a size of its own, and grows as a power of the radius.
    size = np.abs(value)
    state = np.concatenate([value / size, slope / size])
    ends = solve_ivp(rates, (radii[0], radii[-1]), state, "DOP853", t_eval=radii[1:], rtol=_TOLERANCE, atol=1e-30).y.T
    return ends[:, : len(size)], ends[:, len(size) :]
