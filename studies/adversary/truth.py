"""The true end of a ray at any kind of end, in long arithmetic: shares no code with the package.

The paths are those of studies/truth/rays.py; here they stop on spheres of finite radius and in the equatorial plane
too, and the beam is turned on its way so that the two rays beside it stay apart: the Morse index is known however close
to the shadow edge the ray is.
"""

import math
import time
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from mpmath import mp, mpf

from ..truth.camera import Place, metric, photon, unit
from ..truth.rays import Path, neighbours, potential, slopes, trimmed

# Digits of the path; the rays beside it are so far away on the camera sky.
DIGITS = 50
DISPLACEMENT = mpf("1e-25")
# Places of a step where conjugate points and crossings are looked for.
_SAMPLES = 48
_SERIES = 28
# Digits that a path may lose in its last terms.
_SPARE = 24
# So close to the horizon, relative to it, the steps become short: a path is followed no further.
_NEAR_HORIZON = 1e-4

# math.inf, a radius, or the number of a crossing of the equatorial plane.
End = float | int


class Known(NamedTuple):
    """A ray that reaches its end. columns (3, 2): J as changes of n', for the plane (2, 2): of (r, r phi)."""

    direction: np.ndarray
    azimuth: float
    radius: float
    time: float
    columns: np.ndarray
    index: int
    crossings: int
    redshift: float


class Lost(NamedTuple):
    """A ray that does not reach its end: it falls in, or leads to infinity."""

    captured: bool


class Way(NamedTuple):
    """Path by the roots of the radial potential: outward at first, where it turns (None: nowhere), energy above 0."""

    outward: bool
    turn: mpf | None
    real: bool

    @property
    def escapes(self) -> bool:
        """True where the ray leads to infinity."""
        return self.real and self.outward == (self.turn is None)


def way(place: Place, sky: list) -> Way:
    """The way of a ray in radius, followed backward."""
    a, path = mpf(place.spin), photon(place, unit(sky))
    coefficients = potential(a, path.b, path.q)
    roots = mp.polyroots(trimmed(coefficients), maxsteps=1000, extraprec=400, asc=True)
    real = [root.real for root in map(mp.mpc, roots) if abs(root.imag) < mpf(10) ** (-mp.dps // 2)]
    here, horizon = path.position[0], 1 / (1 + mp.sqrt(1 - a**2))
    outward = path.rate[0] < 0
    if path.rate[0] == 0:
        # A turning point itself: U' says where the ray goes.
        real = [root for root in real if abs(root / here - 1) > mpf(10) ** (-mp.dps // 3)]
        outward = mp.polyval(slopes(coefficients), here, asc=True) < 0
    ahead = [r for r in real if 0 < r <= here] if outward else [r for r in real if here <= r < horizon]
    return Way(outward, (max if outward else min)(ahead, default=None), 0 < path.energy < mp.inf)


def reaches(place: Place, found: Way, end: float) -> bool:
    """True if a ray reaches a sphere, infinity included; the start itself is no arrival."""
    if not found.real:
        return False
    here, there = 1 / mpf(place.radius), mpf(0) if math.isinf(end) else 1 / mpf(end)
    ahead = there < here if found.outward else there > here
    if ahead:
        return found.turn is None or (there >= found.turn if found.outward else there <= found.turn)
    return found.turn is not None


class LongPath(Path):
    """A path with digits to spare: close to the horizon of a fast hole, the division by Delta magnifies round-off."""

    def __init__(self, place: Place, sky: list, digits: int, timed: bool):
        super().__init__(place, sky, digits + _SPARE, timed)
        self.order = digits

    def reach(self) -> float:
        """As for every path, for the digits that are wanted."""
        return super().reach() * 2.0 ** (_SPARE * math.log2(10) / self.order)


class Journey:
    """A ray and four beside it, on their way to an end."""

    def __init__(self, place: Place, sky: list, end: End, found: Way, digits: int, displacement: mpf):
        self.end, self.h, self.found = end, displacement, found
        self.plane = end if isinstance(end, int) else 0
        self.paths = [LongPath(place, n, digits, timed=i == 0) for i, n in enumerate(neighbours(sky, displacement))]
        lead, light = self.paths[0], photon(place, unit(sky))
        self.spin = mpf(place.spin)
        self.potential = potential(self.spin, light.b, light.q)
        there = mpf(0) if self.plane or math.isinf(end) else 1 / mpf(end)
        self.goal = lead.whole(there)
        self.falling = not (self.plane or math.isinf(end)) and _arrives_inward(place, found, end)
        self.horizon = lead.whole(1 / (1 + mp.sqrt(1 - mpf(place.spin) ** 2)))
        self.signs: list[float] = []
        self.crossings, self.side, self.angle = 0, float(np.sign(lead.position[3] / (1 << lead.bits))), (1 << 60, 0)

    def follow(self, latest: float) -> bool:
        """Go to the end; False where the ray falls in, or leads to infinity, before."""
        lead = self.paths[0]
        h = lead.whole(mpf(1) / 20)
        while True:
            if time.process_time() > latest:
                raise TimeoutError
            for path in self.paths:
                path.expand(h)
            reach = lead.reach()
            if reach < 1e-3:
                # The first guess of h was far too large.
                h = max(h * int(reach * 2**40) >> 40, 1)
                continue
            stop = int(min(reach, 1.0) * 2**40) << (lead.bits - 40)
            arrival = self.arrival(stop)
            stops = [stop] * 5 if arrival is None else [self.refined(path, arrival) for path in self.paths]
            self.watch(stops[0] / (1 << lead.bits))
            for path, s in zip(self.paths, stops, strict=True):
                path.move(s)
            if arrival is not None:
                return True
            if self.plane and self.is_gone():
                return False
            self.turn_beam()
            h = h * int(min(reach, 4.0) * 2**40) >> 40

    def is_gone(self) -> bool:
        """True where the first path is beyond infinity, or so close to the horizon that no crossing is left.

        Raises TimeoutError where one may be left: the series are short there.
        """
        lead = self.paths[0]
        u, z = (lead.real(lead.position[i]) for i in (0, 3))
        horizon = lead.real(self.horizon)
        if u <= 0 or u < horizon * (1 - _NEAR_HORIZON) or lead.rate[0] < 0:
            return u <= 0
        left = mp.quad(lambda v: 1 / mp.sqrt(abs(mp.polyval(self.potential, v, asc=True))), [u, horizon])
        if z * lead.rate[3] < 0 and abs(z / lead.real(lead.rate[3])) < 3 * left:
            raise TimeoutError
        return True

    def arrival(self, stop: int) -> int | None:
        """The place where the first path meets the end before `stop`, in units of 2^-bits; None where it does not."""
        lead = self.paths[0]
        if self.plane:
            changes = self.sides(stop / (1 << lead.bits))[1]
            missing = self.plane - self.crossings
            if len(changes) < missing:
                return None
            k = changes[missing - 1]
            found = _zero(lead, lead.series[3], 0, stop * k // _SAMPLES, stop * (k + 1) // _SAMPLES)
            # The crossing counts only at a finite radius outside the horizon.
            return found if 0 < lead.at(found, lead.series[0]) < self.horizon else None
        u = lead.series[0]
        slope = [k * c for k, c in enumerate(u)][1:]
        first, last = lead.at(0, slope), lead.at(stop, slope)
        begin, finish = 0, stop
        if (first > 0) != (last > 0):
            turn = _zero(lead, slope, 0, 0, stop)
            begin, finish = (turn, stop) if (last > 0) == self.falling else (0, turn)
        elif (first > 0) != self.falling:
            return None
        met = lead.at(finish, u) >= self.goal if self.falling else lead.at(finish, u) <= self.goal
        beyond = lead.at(begin, u) < self.goal if self.falling else lead.at(begin, u) > self.goal
        return _zero(lead, u, self.goal, begin, finish) if met and beyond else None

    def refined(self, path: Path, s: int) -> int:
        """The place where a path beside the first one meets the end."""
        series, goal = (path.series[3], 0) if self.plane else (path.series[0], self.goal)
        slope = [k * c for k, c in enumerate(series)][1:]
        for _ in range(40):
            change = ((path.at(s, series) - goal) << path.bits) // path.at(s, slope)
            s -= change
            if abs(change) < 8:
                break
        return s

    def sides(self, s: float) -> tuple[np.ndarray, list[int]]:
        """Signs of z at the samples of a step, the first one included, and after which of them it changes."""
        lead = self.paths[0]
        z = _floats(lead.series[3:4], lead.bits)[0] @ _powers(s, np.arange(1, _SAMPLES + 1))
        signs = np.concatenate([[self.side], np.sign(z)])
        changes, last = [], self.side
        for k, sign in enumerate(signs[1:]):
            if sign and last and sign != last:
                changes.append(k)
            last = sign or last
        return signs, changes

    def watch(self, s: float) -> None:
        """Count conjugate points and crossings of a step, before it is made; at its end z = 0 is the plane's own."""
        signs, changes = self.sides(s)
        if self.plane and self.crossings + len(changes) > self.plane:
            changes = changes[: self.plane - self.crossings]
        self.crossings += len(changes)
        known = signs[signs != 0]
        self.side = float(known[-1]) if known.size else 0.0
        self.signs.extend(np.sign(self.areas(s)))

    def differences(self) -> list[list[list[int]]]:
        """Series of the two displacements of the beam, turned by the angle kept; u, x, y, z, psi."""
        pairs = [
            [[c - d for c, d in zip(p, m, strict=True)] for p, m in zip(plus.series, minus.series, strict=True)]
            for plus, minus in (self.paths[1:3], self.paths[3:5])
        ]
        c, s = self.angle
        return [
            [[p * x + q * y for x, y in zip(one, two, strict=True)] for one, two in zip(*pairs, strict=True)]
            for p, q in ((c, s), (-s, c))
        ]

    def areas(self, s: float) -> np.ndarray:
        """The beam's area at the samples of a step: determinant of (du, dn) of both displacements and of the path."""
        lead, powers = self.paths[0], _powers(s, np.arange(1, _SAMPLES + 1))
        terms = _floats(lead.series, lead.bits)
        rates = terms[:, 1:] * np.arange(1, _SERIES) @ powers[:-1]
        m = (terms @ powers)[1:4].T
        around = np.stack([-m[:, 1], m[:, 0], 0 * m[:, 0]], axis=-1)

        def in_space(change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return change[0], change[1:4].T + change[4][:, None] * around

        scale = lead.bits + 60 - int(-mp.log(2 * self.h, 2))
        (du_1, dn_1), (du_2, dn_2) = (in_space(_floats(d, scale) @ powers) for d in self.differences())
        u_rate, n_rate = in_space(rates)

        def triple(p: np.ndarray, q: np.ndarray) -> np.ndarray:
            return np.sum(m * np.cross(p, q), axis=-1)

        return du_1 * triple(dn_2, n_rate) - du_2 * triple(dn_1, n_rate) + u_rate * triple(dn_1, dn_2)

    def turn_beam(self) -> None:
        """Choose the two displacements so that, across the path, one of them is as small as it can be here."""
        lead = self.paths[0]

        def place(path: Path) -> list:
            return [path.real(p) for p in [*path.position, path.psi]]

        m, wide = place(lead)[1:4], [place(path) for path in self.paths]
        around = [-m[1], m[0], mpf(0)]

        def in_space(change: list) -> list:
            return [change[0], *(x + change[4] * y for x, y in zip(change[1:4], around, strict=True))]

        one, two = (in_space([p - q for p, q in zip(*pair, strict=True)]) for pair in (wide[1:3], wide[3:5]))
        u = lead.real(lead.position[0])
        psi_rate = -self.spin * (2 - self.spin * lead.b * u) * u / (1 - 2 * u + (self.spin * u) ** 2)
        rate = in_space([*(lead.real(p) for p in lead.rate), psi_rate])
        norm = _dot(rate, rate)

        def across(p: list, q: list) -> mpf:
            return _dot(p, q) - _dot(p, rate) * _dot(q, rate) / norm

        turn = mp.atan2(2 * across(one, two), across(one, one) - across(two, two)) / 2
        self.angle = int(mp.ldexp(mp.cos(turn), 60)), int(mp.ldexp(mp.sin(turn), 60))


def known(place: Place, sky: list, end: End, digits: int = DIGITS, most_seconds: float = math.inf) -> Known | Lost:
    """All that is true of the ray in direction `sky` (divided by its length) to an end, and of its beam.

    Raises TimeoutError for a ray that takes too long.
    """
    displacement = DISPLACEMENT if digits == DIGITS else mpf(10) ** (-digits // 2)
    with mp.workdps(digits + 15):
        found = way(place, sky)
        if not found.real or not (isinstance(end, int) or reaches(place, found, end)):
            return Lost(captured=not found.escapes)
        journey = Journey(place, sky, end, found, digits, displacement)
        if not journey.follow(time.process_time() + most_seconds):
            return Lost(captured=not found.escapes)
        return _result(place, sky, journey)


def _result(place: Place, sky: list, journey: Journey) -> Known:
    lead, ends = journey.paths[0], [path.end() for path in journey.paths]
    u = [path.real(path.position[0]) for path in journey.paths]
    finite = bool(journey.plane) or not math.isinf(journey.end)
    radius = 1 / u[0] if finite else mp.inf
    delay = lead.real(lead.delay) + (radius + 2 * mp.log(radius) if finite else 0)
    if journey.plane:
        # Rays to either side of the spin axis go round it by a whole turn more, or less.
        turned = [end.azimuth - ends[0].azimuth for end in ends]
        turned = [angle - 2 * mp.pi * mp.nint(angle / (2 * mp.pi)) for angle in turned]
        moved = [(1 / v, radius * angle) for v, angle in zip(u, turned, strict=True)]
    else:
        moved = [tuple(end.direction) for end in ends]
    step = 2 * journey.h
    columns = [[(p - q) / step for p, q in zip(*pair, strict=True)] for pair in (moved[1:3], moved[3:5])]
    signs = [sign for sign in journey.signs if sign]
    return Known(
        np.array(ends[0].direction, float),
        float(ends[0].azimuth),
        float(radius),
        float(delay),
        np.array(columns, float).T,
        sum(int(p != q) for p, q in pairwise(signs)),
        journey.plane or journey.crossings,
        float(_redshift(place, sky)),
    )


def _redshift(place: Place, sky: list) -> mpf:
    """Frequency ratio for a source at rest at infinity."""
    at, n = metric(place), unit(sky)
    light = photon(place, n)
    return mp.sqrt(1 - at.speed**2) * light.energy / (1 - at.speed * n[1])


def _arrives_inward(place: Place, found: Way, end: float) -> bool:
    """True if a ray that reaches a sphere meets it with falling radius."""
    return end < place.radius or (end == place.radius and found.outward)


def _zero(path: Path, series: list, goal: int, low: int, high: int) -> int:
    """Place where a series passes a value between low and high (units of 2^-bits), the value below at one of them."""
    rising = path.at(high, series) > goal
    while high - low > 8:
        middle = (low + high) // 2
        low, high = (low, middle) if (path.at(middle, series) > goal) == rising else (middle, high)
    return (low + high) // 2


def _floats(series: list, bits: int) -> np.ndarray:
    """The first coefficients of series, in doubles."""
    return np.array([[c / (1 << bits) for c in one[:_SERIES]] for one in series])


def _powers(s: float, samples: np.ndarray) -> np.ndarray:
    """Powers (series, samples) of the places of the samples in a step."""
    return (s * samples / _SAMPLES) ** np.arange(_SERIES)[:, None]


def _dot(p: list, q: list) -> mpf:
    return sum((x * y for x, y in zip(p, q, strict=True)), mpf(0))
