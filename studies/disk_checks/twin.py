"""Rays to the plane for an observer at infinity, by other means than the package: the slow twin of its disks.

In Mino time the polar motion is a quadrature (Gauss-Legendre), and u = 1/r obeys u'' = U'(u) / 2, regular at its
turning points, solved by DOP853 from u = 0.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import elementwise

Array = np.ndarray

_NODES = 48
_TOLERANCE = 1e-12
# What is deeper has fallen in.
_DEEPEST = 1.0
# Relative step of differences.
_STEP = 2e-3
# Places between two turns.
_FINE = 24


def plane_time(spin: float, inclination: float, b: Array, q: Array, upward: Array, crossing: int) -> Array:
    """Mino time (n,) from the observer to the n-th crossing of the plane; upward, where the ray rises first."""
    total = spin * spin - q - b * b
    other = (np.hypot(total, 2 * spin * np.sqrt(q)) - total) / 2
    highest = np.sqrt(q / other)
    first = np.arcsin(np.clip(math.cos(inclination) / highest, -1, 1))
    last = np.where(upward, math.pi - first, first) + (crossing - 1) * math.pi
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    angle = last[:, None] * (node + 1) / 2
    rate = np.sqrt((spin * highest[:, None] * np.sin(angle)) ** 2 + other[:, None])
    return last / 2 * (weight / rate).sum(axis=1)


def reciprocal_radius(spin: float, b: Array, q: Array, time: Array) -> Array:
    """1 / r (n,) of rays from infinity after Mino times (n,); negative where they have left, 1 where they fell in."""
    second, third, fourth = spin * spin - b * b - q, (b - spin) ** 2 + q, -2 * spin * spin * q

    def rate(_: float, state: Array) -> Array:
        u, speed = state.reshape(2, -1)
        live = u < _DEEPEST
        return np.concatenate([np.where(live, speed, 0), np.where(live, second + u * (3 * third + u * fourth), 0) * u])

    # From here on time goes from 0 to 1.
    def scaled(moment: float, state: Array) -> Array:
        return (rate(moment, state).reshape(2, -1) * time).ravel()

    start = np.concatenate([np.zeros_like(b), np.ones_like(b)])
    found = solve_ivp(scaled, (0, 1), start, method="DOP853", rtol=_TOLERANCE, atol=_TOLERANCE)
    return found.y[: len(b), -1]


@dataclass(frozen=True)
class Screen:
    """The screen of an observer at infinity, with polar coordinates about the principal null ray."""

    spin: float
    inclination: float

    def constants(self, distance: Array, turn: Array) -> tuple[Array, Array, Array]:
        """b, q, and whether the ray rises first."""
        sine, a = math.sin(self.inclination), self.spin
        alpha, beta = distance * np.cos(turn) - a * sine, distance * np.sin(turn)
        return -alpha * sine, beta**2 + math.cos(self.inclination) ** 2 * (alpha**2 - a * a), beta > 0

    def landing(self, distance: Array, turn: Array, crossing: int) -> Array:
        """1 / r (n,) of crossings of the plane."""
        b, q, upward = self.constants(distance, turn)
        time = plane_time(self.spin, self.inclination, b, np.maximum(q, 1e-12), upward, crossing)
        return reciprocal_radius(self.spin, b, q, time)

    def isoradial(self, radius: float, turn: Array, crossing: int = 1) -> Array:
        """Distances (n,) on the screen at which a ring is seen."""

        def short(distance: Array, turn: Array) -> Array:
            return 1 / radius - self.landing(distance, turn, crossing)

        bracket = np.full_like(turn, 0.05), np.full_like(turn, 2 * radius + 20)
        found = elementwise.find_root(short, bracket, args=(turn,), tolerances={"xrtol": 1e-11})
        return found.x

    def ring(self, radius: float, turn: Array) -> tuple[Array, Array]:
        """g (n,), and solid angle (in units of M / distance, squared) for each dr and turn, of the first image."""
        distance = self.isoradial(radius, turn)
        steps = np.array([-2, -1, 1, 2]) * _STEP
        beside = [1 / self.landing(distance * (1 + step), turn, 1) for step in steps]
        # The slope to the fourth order in the step.
        slope = (beside[0] - 8 * beside[1] + 8 * beside[2] - beside[3]) / (12 * _STEP * distance)
        a, b = self.spin, self.constants(distance, turn)[0]
        clock = (1 + a / radius**1.5) / math.sqrt(1 - 3 / radius + 2 * a / radius**1.5)
        return 1 / (clock * (1 - b / (a + radius**1.5))), distance / slope


def ring_profile(
    screen: Screen, inner: float, outer: float, power: float, edges: Array, turns: int = 240, rings: int = 600
) -> Array:
    """The light between edges of g of a narrow ring, in units of (M / distance)^2: a sum over very many places."""
    turn = 2 * math.pi * np.arange(turns) / turns
    # Chebyshev nodes; smooth functions in between.
    node = (inner + outer) / 2 - (outer - inner) / 2 * np.cos((np.arange(4) + 0.5) * math.pi / 4)
    fields = np.array([screen.ring(float(r), turn) for r in node])
    wrapped = np.concatenate([fields, fields[..., :1]], axis=-1)
    many = 2 * math.pi * np.arange(turns * _FINE + 1) / (turns * _FINE)
    smooth = CubicSpline(np.append(turn, 2 * math.pi), wrapped, axis=-1, bc_type="periodic")(many)
    total = np.zeros(len(edges) - 1)
    for place in (np.arange(rings) + 0.5) / rings:
        radius = inner + (outer - inner) * place
        g, per_turn = np.tensordot(_lagrange(node, radius), smooth, 1)
        light = radius**-power * g**4 * per_turn * (outer - inner) / rings * many[1]
        total += _shared(g, (light[1:] + light[:-1]) / 2, edges)
    return total


def _shared(g: Array, light: Array, edges: Array) -> Array:
    """The light of steps from each g to the next one, spread evenly; none of them crosses two edges."""
    low, high = np.minimum(g[1:], g[:-1]), np.maximum(g[1:], g[:-1])
    above = np.clip(np.searchsorted(edges, low), 1, len(edges) - 1)
    part = np.clip((high - edges[above]) / np.maximum(high - low, 1e-300), 0, 1)
    total = np.bincount(above - 1, light * (1 - part), len(edges)) + np.bincount(above, light * part, len(edges))
    return total[:-1]


def _lagrange(node: Array, at: float) -> Array:
    """Weights of the polynomial through nodes at a place."""
    return np.array([np.prod((at - np.delete(node, k)) / np.delete(one - node, k)) for k, one in enumerate(node)])
