"""Rays and beams to 40 digits: a second implementation that shares no code with the package.

The camera's photon is written down in mpmath; its path in Mino time, in the variables of docs/conventions.md, is
followed by Taylor series of high order. The coefficients are whole numbers in units of 2^-bits, which is the fastest
long arithmetic that Python has of its own. J is the central difference of four neighbouring rays.
"""

import math
import time
from collections.abc import Iterator
from itertools import pairwise
from operator import mul
from typing import NamedTuple

import numpy as np
from mpmath import mp, mpf

from .camera import Place, photon, unit

# Digits of the path; the order of the series that is about the cheapest for them; neighbours at DISPLACEMENT times
# the distance from the shadow edge: (1e-20)^2 of J is the truncation, 1e-66 / 1e-20 or so its round-off.
DIGITS = 66
DISPLACEMENT = mpf("1e-20")
GUARD_BITS = 28


class End(NamedTuple):
    """End of a path: n', unwrapped azimuth, Mino time, and |t| - r - 2 ln r in the limit (None if not asked)."""

    direction: list
    azimuth: mpf
    mino_time: mpf
    delay: mpf | None


def potential(a: mpf, b: mpf, q: mpf) -> list:
    """Coefficients of U(u) = u'^2, from the constant to the fourth power."""
    return [mpf(1), mpf(0), a**2 - b**2 - q, 2 * ((b - a) ** 2 + q), -(a**2) * q]


def trimmed(coefficients: list) -> list:
    """The same polynomial without vanishing highest powers."""
    degree = max(k for k, c in enumerate(coefficients) if c != 0)
    return coefficients[: degree + 1]


def slopes(coefficients: list) -> list:
    """Coefficients of the derivative, from the constant up."""
    return [k * c for k, c in enumerate(coefficients)][1:]


def escapes(place: Place, sky: list) -> bool:
    """True where the path backward reaches infinity: a turning point outside the horizon, or outward without one."""
    a, path = mpf(place.spin), photon(place, unit(sky))
    if not 0 < path.energy < mp.inf:
        return False
    coefficients = potential(a, path.b, path.q)
    roots = mp.polyroots(trimmed(coefficients), maxsteps=500, extraprec=200, asc=True)
    real = [root.real for root in map(mp.mpc, roots) if abs(root.imag) < mpf(10) ** (-mp.dps // 2)]
    here, horizon = path.position[0], 1 / (1 + mp.sqrt(1 - a**2))
    if path.rate[0] == 0:
        # A turning point itself: U' says where the ray goes.
        real = [root for root in real if abs(root / here - 1) > mpf(10) ** (-mp.dps // 3)]
    inward = path.rate[0] > 0 or (path.rate[0] == 0 and mp.polyval(slopes(coefficients), here, asc=True) > 0)
    if inward:
        return any(here <= root < horizon for root in real)
    return not any(0 < root <= here for root in real)


def tangent_basis(n: list) -> tuple[list, list]:
    """Unit tangents e_1, e_2 at n with e_1 x e_2 = n, as Duff et al. 2017 choose them."""
    x, y, z = n
    sign = 1 if z >= 0 else -1
    c = -1 / (sign + z)
    return [1 + sign * x * x * c, sign * x * y * c, -sign * x], [x * y * c, sign + y * y * c, -y]


class Path:
    """A path, step by step; all numbers in units of 2^-bits."""

    def __init__(self, place: Place, sky: list, digits: int, timed: bool):
        self.bits, self.order = int(digits * math.log2(10)) + GUARD_BITS, digits
        start, a = photon(place, sky), mpf(place.spin)
        self.u_terms = [self.whole(c * k / 2) for k, c in enumerate(potential(a, start.b, start.q))][2:]
        self.k, self.aa, self.b = self.whole(start.q + start.b**2), self.whole(a**2), start.b
        self.psi_terms = self.whole(-2 * a), self.whole(a**2 * start.b)
        # The bounded part of dt/dtau, whatever comes before 1 / (1 - 2 u + a^2 u^2).
        self.t_terms = [self.whole(c) for c in (a**2 - a * start.b + 4, -2 * a**2, a**3 * (a - start.b))]
        self.t_constant = self.whole(a * (start.b - a))
        self.position = [self.whole(x) for x in start.position]
        self.rate = [self.whole(x) for x in start.rate]
        self.psi = self.turn = self.time = 0
        self.delay = self.whole(-place.radius - 2 * mp.log(place.radius)) if timed else None

    def whole(self, x: mpf) -> int:
        return int(mp.nint(mp.ldexp(x, self.bits)))

    def real(self, x: int) -> mpf:
        return mp.ldexp(mpf(x), -self.bits)

    def expand(self, h: int) -> None:
        """Taylor coefficients in (tau - tau_0) / h: u'' = U'(u) / 2, m'' = a^2 z e_z - (k + 2 a^2 z^2) m, psi'."""
        bits, one = self.bits, 1 << self.bits
        hh = h * h >> bits
        c_1, c_2, c_3 = (c * hh >> bits for c in self.u_terms)
        hh_aa, aa = hh * self.aa >> bits, self.aa
        psi_1, psi_2 = (c * h >> bits for c in self.psi_terms)
        u, x, y, z = series = [[p, r * h >> bits] for p, r in zip(self.position, self.rate, strict=True)]
        uu, uuu, zz, pull, d, psi_rate, psi = [], [], [], [], [], [], [self.psi]
        for k in range(self.order - 1):
            uu.append(sum(map(mul, u, u[k::-1])) >> bits)
            uuu.append(sum(map(mul, u, uu[::-1])) >> bits)
            zz.append(sum(map(mul, z, z[k::-1])) >> bits)
            pull.append(2 * hh_aa * zz[k] >> bits)
            d.append((aa * uu[k] >> bits) - 2 * u[k])
            if k == 0:
                pull[0] += hh * self.k >> bits
                d[0] += one
            psi_rate.append(_next_of_quotient(psi_1 * u[k] + psi_2 * uu[k], d, psi_rate))
            psi.append(psi_rate[k] // (k + 1))
            steps = (k + 1) * (k + 2)
            u.append((c_1 * u[k] + c_2 * uu[k] + c_3 * uuu[k] >> bits) // steps)
            for m in (x, y):
                m.append((-sum(map(mul, m, pull[::-1])) >> bits) // steps)
            z.append((hh_aa * z[k] - sum(map(mul, z, pull[::-1])) >> bits) // steps)
        self.h, self.series = h, [*series, psi]
        if self.delay is not None:
            self.delay_series = self._expand_delay(uu, zz, d)

    def _expand_delay(self, uu: list, zz: list, d: list) -> list:
        """Series of |t| - r - 2 ln r; its rate is (1 + u') (1/u^2 + 2/u) and terms that are plainly bounded."""
        bits, h, u = self.bits, self.h, self.series[0]
        t_0, t_1, t_2 = (c * h >> bits for c in self.t_terms)
        once, twice, bounded, delay = [], [], [], [self.delay]
        for k in range(self.order - 1):
            first = (k == 0) * h
            once.append(_next_of_quotient((first + (k + 1) * u[k + 1]) << bits, u, once))
            twice.append(_next_of_quotient(once[k] << bits, u, twice))
            numerator = ((k == 0) * t_0 << bits) + t_1 * u[k] + t_2 * uu[k]
            bounded.append(_next_of_quotient(numerator, d, bounded))
            rest = h * (self.t_constant * (k == 0) + (self.aa * zz[k] >> bits)) >> bits
            delay.append((twice[k] + 2 * once[k] + bounded[k] + rest) // (k + 1))
        return delay

    def reach(self) -> float:
        """Range of the series in units of h: the size of their last terms against one unit of 2^-bits.

        The delay has poles where u = 0 at the other end of the path; its round-off before the end makes a looser
        bound necessary, about 1e-40.
        """
        largest = max(abs(c) for s in self.series for c in s[-2:]).bit_length()
        if self.delay is not None:
            largest = max(largest, max(abs(c) for c in self.delay_series[-2:]).bit_length() - 2 * self.bits // 5)
        return 2.0 ** ((GUARD_BITS / 2 - largest) / self.order)

    def at(self, s: int, series: list) -> int:
        """Value of a series at s (whole number, units of 2^-bits)."""
        total = 0
        for c in reversed(series):
            total = (total * s >> self.bits) + c
        return total

    def zero_of_u(self, s: int) -> int:
        """Zero of u between 0 and s, by bisection and Newton's method."""
        u, low = self.series[0], 0
        for _ in range(12):
            middle = (low + s) // 2
            low, s = (middle, s) if self.at(middle, u) > 0 else (low, middle)
        slope = [k * c for k, c in enumerate(u)][1:]
        for _ in range(60):
            change = (self.at(s, u) << self.bits) // self.at(s, slope)
            s -= change
            if abs(change) < 8:
                break
        return s

    def move(self, s: int) -> None:
        """Go to s, and turn on by the azimuth of m; a step is much less than a full turn, in the sense of -b."""
        before = self._azimuth()
        values = [self.at(s, c) for c in self.series]
        self.rate = [
            (self.at(s, [k * c for k, c in enumerate(series)][1:]) << self.bits) // self.h for series in self.series[:4]
        ]
        self.position, self.psi = values[:4], values[4]
        self.time += self.h * s >> self.bits
        if self.delay is not None:
            self.delay = self.at(s, self.delay_series)
        turned = self._azimuth() - before
        if turned * self.b > 0:
            turned -= 2 * mp.pi * mp.sign(self.b)
        self.turn += turned

    def _azimuth(self) -> mpf:
        return mp.atan2(*(self.real(self.position[i]) for i in (2, 1)))

    def end(self) -> End:
        """The end point, once u = 0."""
        psi = self.real(self.psi)
        x, y, z = unit([self.real(p) for p in self.position[1:]])
        c, s = mp.cos(psi), mp.sin(psi)
        delay = None if self.delay is None else self.real(self.delay)
        return End([c * x - s * y, s * x + c * y, z], psi + self.turn, self.real(self.time), delay)


def _next_of_quotient(numerator: int, divisor: list, quotient: list) -> int:
    """The next coefficient of a quotient of series; the numerator in units of 2^-(2 bits)."""
    return (numerator - sum(map(mul, divisor[1:], quotient[::-1]))) // divisor[0]


def follow(paths: list[Path], watch) -> None:
    """Take paths that start together to infinity in common steps; the first decides on the steps.

    `watch(paths, s)` sees every step, 0 to s in units of h, before it is made.
    """
    lead = paths[0]
    h = lead.whole(mpf(1) / 20)
    while True:
        for path in paths:
            path.expand(h)
        reach = lead.reach()
        if reach < 1e-3:
            # The first guess of h was far too large.
            h = max(h * int(reach * 2**40) >> 40, 1)
            continue
        s = int(min(reach, 1.0) * 2**40) << (lead.bits - 40)
        last = lead.at(s, lead.series[0]) <= 0
        ends = [path.zero_of_u(s) for path in paths] if last else [s] * len(paths)
        watch(paths, ends[0] / (1 << lead.bits))
        for path, stop in zip(paths, ends, strict=True):
            path.move(stop)
        if last:
            return
        h = h * int(min(reach, 4.0) * 2**40) >> 40


def places(place: Place, sky: list, times: list, digits: int = 30) -> list[tuple[mpf, list]]:
    """1 / r and the direction of a path at growing Mino times, none of them later than its end."""
    with mp.workdps(2 * digits):
        path = Path(place, unit([mpf(n) for n in sky]), digits, timed=False)
        return [place_ahead(path, ahead) for ahead in stops(path, [mpf(t) for t in times])]


def stops(path: Path, times: list[mpf], latest: float = math.inf) -> Iterator[int]:
    """Follow a path to growing Mino times, none of them later than its end: how far ahead in its step each lies.

    Raises TimeoutError once the processor time of the program is later than `latest`.
    """
    reached, h = 0, path.whole(mpf(1) / 20)
    while reached < len(times):
        if time.process_time() > latest:
            raise TimeoutError
        path.expand(h)
        reach = path.reach()
        if reach < 1e-3:
            h = max(h * int(reach * 2**40) >> 40, 1)
            continue
        s = int(min(reach, 1.0) * 2**40) << (path.bits - 40)
        while reached < len(times):
            ahead = (times[reached] - path.real(path.time)) / path.real(h)
            if ahead > path.real(s):
                break
            yield path.whole(ahead)
            reached += 1
        path.move(s)
        h = h * int(min(reach, 4.0) * 2**40) >> 40


def place_ahead(path: Path, ahead: int) -> tuple[mpf, list]:
    """1 / r and the direction of a path, so far ahead in its step."""
    u, *m, psi = (path.real(path.at(ahead, series)) for series in path.series)
    (x, y, z), c, d = unit(m), mp.cos(psi), mp.sin(psi)
    return u, [c * x - d * y, d * x + c * y, z]


def conjugate_points(paths: list[Path], s: float, displacement: float) -> np.ndarray:
    """Signs of the beam's area at 32 points of a step: determinant of (du, dn) of two neighbours and of the path."""
    path_terms = np.array([[c / (1 << paths[0].bits) for c in series[:24]] for series in paths[0].series])
    differences = [
        [
            [(c - d) / (1 << path.bits) for c, d in zip(plus[:24], minus[:24], strict=True)]
            for plus, minus in zip(path.series, other.series, strict=True)
        ]
        for path, other in (paths[1:3], paths[3:5])
    ]
    where = s * np.arange(1, 33) / 32
    powers = where[:, None] ** np.arange(24)
    rates = np.arange(1, 24) * powers[:, :-1]
    here, speed = path_terms @ powers.T, path_terms[:, 1:] @ rates.T
    m = here[1:4].T
    around = np.stack([-m[:, 1], m[:, 0], 0 * m[:, 0]], axis=-1)

    def in_space(change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return change[0], change[1:4].T + change[4][:, None] * around

    (du_1, dn_1), (du_2, dn_2) = (in_space(np.array(d) / (2 * displacement) @ powers.T) for d in differences)
    u_rate, n_rate = in_space(speed)

    def triple(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        return np.sum(m * np.cross(p, q), axis=-1)

    return np.sign(du_1 * triple(dn_2, n_rate) - du_2 * triple(dn_1, n_rate) + u_rate * triple(dn_1, dn_2))


def displaced(n: list, tangent: list, h: mpf) -> list:
    """n moved along a unit tangent by the angle h."""
    return [mp.cos(h) * x + mp.sin(h) * e for x, e in zip(n, tangent, strict=True)]


def neighbours(sky: list, h: mpf) -> list[list]:
    """N, and N displaced by +h and -h along either tangent."""
    n = unit(sky)
    return [n, *(displaced(n, e, sign * h) for e in tangent_basis(n) for sign in (1, -1))]


def columns_of(ends: list, h: mpf) -> list[list]:
    """The two columns of J as vectors in space, from the end points of `neighbours`."""
    return [[(p - m) / (2 * h) for p, m in zip(*pair, strict=True)] for pair in (ends[1:3], ends[3:5])]


def ellipse(n: list, columns: list[list]) -> tuple[mpf, mpf, mpf]:
    """delta_plus, delta_minus and det J."""
    (a, b, c), (d, e, f) = columns
    determinant = n[0] * (b * f - c * e) + n[1] * (c * d - a * f) + n[2] * (a * e - b * d)
    square = sum(x * x for column in columns for x in column)
    major = (mp.sqrt(square + 2 * determinant) + mp.sqrt(max(square - 2 * determinant, mpf(0)))) / 2
    return major, determinant / major, determinant


def beam(
    place: Place,
    sky: list,
    distance: mpf | float = 1,
    digits: int = DIGITS,
    timed: bool = True,
    most_seconds: float = math.inf,
) -> dict:
    """All that is known of the beam in direction `sky`, `distance` (about) from the shadow edge; delay if timed."""
    latest = time.process_time() + most_seconds
    with mp.workdps(digits + 15):
        if not escapes(place, sky):
            raise ValueError(f"The ray in direction {sky} is captured.")
        h = DISPLACEMENT * distance
        paths = [Path(place, n, digits, timed=timed and i == 0) for i, n in enumerate(neighbours(sky, h))]
        signs = []

        def watch(paths: list[Path], s: float) -> None:
            if time.process_time() > latest:
                raise TimeoutError(f"The ray in direction {sky} takes more than {most_seconds} s.")
            signs.extend(conjugate_points(paths, s, float(h)))

        follow(paths, watch)
        ends = [path.end() for path in paths]
        columns = columns_of([end.direction for end in ends], h)
        major, minor, determinant = ellipse(ends[0].direction, columns)
        index = sum(int(p != q) for p, q in pairwise(signs))
        if (minor > 0) != (index % 2 == 0):
            raise ArithmeticError(f"Index {index} and parity disagree at {sky}.")
        return {
            **ends[0]._asdict(),
            "delta_plus": major,
            "delta_minus": minor,
            "determinant": determinant,
            "columns": [list(row) for row in zip(*columns, strict=True)],
            "index": index,
        }


def polar_turns(place: Place, sky: list) -> int:
    """Number of times the ray is at its closest to the spin axis, from a short calculation."""
    path = Path(place, unit(sky), 18, timed=False)
    rates = [path.rate[3]]
    follow([path], lambda paths, s: rates.append(paths[0].rate[3]))
    rates.append(path.rate[3])
    return sum((p > 0) != (q > 0) for p, q in pairwise(rates))
