"""A slow, obvious integration of single rays to any end, for comparison: it shares no code with the package.

Hamilton's equations in Boyer-Lindquist coordinates and Mino time, for unit energy at infinity:
2 H = Delta p_r^2 + p_theta^2 - P^2 / Delta + (b / sin theta - a sin theta)^2, P = r^2 + a^2 - a b.
"""

import math
from collections.abc import Callable

import numpy as np
from beam_equations import Event, photon
from scipy.integrate import solve_ivp

ACCURACY = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}


def followed(event: Event, sky: np.ndarray, passes: Callable[[np.ndarray], float], count: int = 1) -> np.ndarray | None:
    """(r, theta, phi, t) of the ray backward where `passes(state)` is zero for the count-th time, t the time ago.

    None where the ray ends before, at a radius of 1e5 or close to the horizon.
    """
    a, r, theta, _ = event
    light = photon(event, sky)
    b, horizon = light.b, 1 + math.sqrt(1 - a * a)

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        return -forward_rates(a, b, state)

    def wanted(_: float, state: np.ndarray) -> float:
        return passes(state)

    def fell(_: float, state: np.ndarray) -> float:
        return state[0] - horizon * (1 + 1e-5)

    def left(_: float, state: np.ndarray) -> float:
        return state[0] - 1e5

    wanted.terminal = count + (abs(passes(np.array([r, theta, 0, 0]))) < 1e-12)
    fell.terminal = left.terminal = True
    start = np.array([r, theta, 0.0, 0.0, light.p_r, light.p_theta])
    path = solve_ivp(rates, (0, 50), start, events=(wanted, fell, left), **ACCURACY)
    if len(path.t_events[0]) < wanted.terminal:
        return None
    # The events are of lower order than the steps: again to the event, then Newton's method onto it.
    time, state = path.t_events[0][-1], start
    state = solve_ivp(rates, (0, time), state, **ACCURACY).y[:, -1]
    for _ in range(3):
        small = 1e-6 / (1 + state[0]) * rates(0, state)
        slope = (passes(state + small) - passes(state - small)) / (2e-6 / (1 + state[0]))
        rest = -passes(state) / slope
        state = solve_ivp(rates, (0, rest), state, **ACCURACY).y[:, -1]
    return np.array([*state[:3], -state[3]])


def forward_rates(a: float, b: float | np.ndarray, state: np.ndarray) -> np.ndarray:
    """Rates of (r, theta, phi, t, p_r, p_theta) along the photon's motion; of many photons, a column of state each."""
    r, theta, _, _, p_r, p_theta = state
    s, c = np.sin(theta), np.cos(theta)
    delta, d_delta, big = r * r - 2 * r + a * a, 2 * r - 2, r * r + a * a - a * b
    spin_part = b / s - a * s
    return np.array(
        [
            delta * p_r,
            p_theta,
            a * big / delta + spin_part / s,
            (r * r + a * a) * big / delta + a * s * spin_part,
            -d_delta * p_r**2 / 2 + 2 * r * big / delta - big**2 * d_delta / (2 * delta**2),
            spin_part * (b / s**2 + a) * c,
        ]
    )


def unit_vector(theta: float, phi: float) -> np.ndarray:
    return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])
