"""Places on a ray and on those beside it at given Mino times, in long arithmetic: shares no code with the package."""

import math
import time
from typing import NamedTuple

from mpmath import mp, mpf

from ...truth.camera import Place, photon, unit
from ...truth.rays import Path, neighbours, place_ahead, stops
from ..truth import DIGITS, DISPLACEMENT, LongPath

# Displacement in Mino time for rates.
_TICK = mpf("1e-18")


class PathEvent(NamedTuple):
    """A true event of a ray and of its beam, at one Mino time.

    inverse_radius: 1 / r.
    direction: unit vector with the polar angle and the azimuth of the place.
    time: coordinate time since the start, backward.
    diameters: major and minor diameter of the beam over the radius, without sign.
    rates: of 1 / r and of the direction with Mino time.
    time_rate: of the time with Mino time.
    late: Mino time until the area passes through zero, by its rate.
    """

    inverse_radius: mpf
    direction: list
    time: mpf
    diameters: tuple[float, float]
    rates: tuple[mpf, list]
    time_rate: mpf
    late: mpf


def events_along(place: Place, sky: list, times: list[float], most_seconds: float = math.inf) -> list[PathEvent]:
    """The true events of the ray in a direction at growing Mino times; raises TimeoutError if it takes too long."""
    latest = time.process_time() + most_seconds
    with mp.workdps(DIGITS + 15):
        ticks = [mpf(t) + k * _TICK for t in times for k in (-1, 0, 1)]
        rays = [
            _states(LongPath(place, n, DIGITS, timed=i == 0), ticks, latest)
            for i, n in enumerate(neighbours(sky, DISPLACEMENT))
        ]
        spin, impact = mpf(place.spin), photon(place, unit(sky)).b
        return [_event(spin, impact, [ray[3 * i : 3 * i + 3] for ray in rays]) for i in range(len(times))]


def _states(path: Path, times: list, latest: float) -> list[tuple[mpf, list, mpf | None]]:
    """1 / r, direction and elapsed time of a path at growing Mino times, none of them later than its end."""
    return [(*place_ahead(path, ahead), _elapsed(path, ahead)) for ahead in stops(path, times, latest)]


def _elapsed(path: Path, ahead: int) -> mpf | None:
    u = path.real(path.at(ahead, path.series[0]))
    if path.delay is None or u <= 0:
        return None
    return path.real(path.at(ahead, path.delay_series)) + 1 / u - 2 * mp.log(u)


def _event(spin: mpf, impact: mpf, rays: list) -> PathEvent:
    (before, here, after), *beside = rays
    rates = _rates(before, after)
    step = 2 * DISPLACEMENT
    moved = [[_over(_minus(plus[k], minus[k]), step) for plus, minus in (beside[:2], beside[2:])] for k in range(3)]
    areas = [_area(state[1], rates, pair) for state, pair in zip((before, here, after), moved, strict=True)]
    late = -areas[1] * 2 * _TICK / (areas[2] - areas[0])
    time_rate = (after[2] - before[2]) / (2 * _TICK)
    return PathEvent(*here, _diameters(spin, impact, here, rates, moved[1]), rates, time_rate, late)


def _minus(p: tuple, q: tuple) -> tuple[mpf, list]:
    return p[0] - q[0], [x - y for x, y in zip(p[1], q[1], strict=True)]


def _over(change: tuple[mpf, list], by: mpf) -> tuple[mpf, list]:
    return change[0] / by, [x / by for x in change[1]]


def _rates(before: tuple, after: tuple) -> tuple[mpf, list]:
    return _over(_minus(after, before), 2 * _TICK)


def _triple(n: list, p: list, q: list) -> mpf:
    """n . (p x q)."""
    return n[0] * (p[1] * q[2] - p[2] * q[1]) + n[1] * (p[2] * q[0] - p[0] * q[2]) + n[2] * (p[0] * q[1] - p[1] * q[0])


def _area(n: list, rates: tuple, pair: list) -> mpf:
    """Determinant of both displacements and the ray in (1 / r, n): it is 0 at conjugate points."""
    (du_1, dn_1), (du_2, dn_2) = pair
    return du_1 * _triple(n, dn_2, rates[1]) - du_2 * _triple(n, dn_1, rates[1]) + rates[0] * _triple(n, dn_1, dn_2)


def _diameters(spin: mpf, impact: mpf, here: tuple, rates: tuple, pair: list) -> tuple[float, float]:
    """By the metric in Boyer-Lindquist coordinates: lengths of displacements at right angles to the ray's momentum.

    The displacement in time follows from that: rays of one event stay in the light cone's own surface.
    """
    u, (x, y, z), _ = here
    r, square = 1 / u, x * x + y * y
    sigma, delta = r * r + (spin * z) ** 2, r * r - 2 * r + spin * spin

    def coordinates(change: tuple) -> tuple[mpf, mpf, mpf]:
        """Changes of r, theta and phi."""
        du, (dx, dy, dz) = change
        return -du * r * r, -dz / mp.sqrt(square), (x * dy - y * dx) / square

    r_rate, theta_rate, _ = coordinates(rates)
    vectors = []
    for change in pair:
        dr, dtheta, dphi = coordinates(change)
        vectors.append((impact * dphi - r_rate * dr / delta - theta_rate * dtheta, dr, dtheta, dphi))

    def product(p: tuple, q: tuple) -> mpf:
        drag = -2 * spin * r * square / sigma
        around = square * (r * r + spin * spin + 2 * spin * spin * r * square / sigma)
        in_time = -(1 - 2 * r / sigma) * p[0] * q[0] + drag * (p[0] * q[3] + p[3] * q[0])
        return in_time + sigma / delta * p[1] * q[1] + sigma * p[2] * q[2] + around * p[3] * q[3]

    (a, b), c = (product(v, v) for v in vectors), product(*vectors)
    mean, half = (a + b) / 2, mp.sqrt(((a - b) / 2) ** 2 + c * c)
    major = mean + half
    minor = max((a * b - c * c) / major, mpf(0))
    return float(mp.sqrt(major) / r), float(mp.sqrt(minor) / r)
