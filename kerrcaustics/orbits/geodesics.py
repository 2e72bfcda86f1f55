"""Free fall: time-like geodesics of the Kerr metric, integrated once, with dense output.

The equations are those of rays in a form with no singular point, with a rest mass: in Mino time, u = 1/r and a point m
of the unit sphere, which carries the polar angle and the smooth part of the azimuth; dragging turns the azimuth by
psi more. Neither turning points nor the spin axis are special. Coordinate time is integrated along, and inverted.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kerrcaustics.orbits.moving_place import Place
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.sphere import lengths

if TYPE_CHECKING:
    from scipy.integrate import DenseOutput

Array = np.ndarray

_TOLERANCE = 1e-13
# Displacements, in radii and velocities, that grow to the errors of places.
_DISPLACEMENT = 3e-13
# Further out radii are displaced inward.
_FAR = 1e6
# Steps of Newton's method to the Mino time of a coordinate time.
_INVERSIONS = 6
# Of the horizon's radius: nearer to it a fall ends. It takes infinitely long, in coordinate time.
_NEAREST = 1e-4
_SAMPLES = 200
# Fastest speed that a circular orbit is looked for with.
_FASTEST = 1 - 1e-12
# An azimuth that seems to run backward by less, radians, stands still.
_STILL = 1e-6


@dataclass(frozen=True)
class FallConstants:
    """Constants of a geodesic, per rest mass: energy E, axial angular momentum L_z, Carter constant Q."""

    spin: float
    energy: float
    momentum: float
    carter: float

    @property
    def _terms(self) -> tuple[float, float, float, float, float]:
        """Coefficients of the radial potential (du / dMino)^2, a polynomial of u, the constant one first."""
        a, total = self.spin, self.momentum**2 + self.carter
        kappa = (self.momentum - a * self.energy) ** 2 + self.carter
        return self.excess, 2.0, a * a * self.excess - total, 2 * kappa, -a * a * self.carter

    @property
    def excess(self) -> float:
        """E^2 - 1: below zero for a bound orbit."""
        return self.energy**2 - 1

    def radial(self, u: Any) -> tuple[Any, Any]:
        """The radial potential (du / dMino)^2, and half of its derivative."""
        zero, one, two, three, four = self._terms
        value = zero + u * (one + u * (two + u * (three + u * four)))
        return value, one / 2 + u * (two + u * (1.5 * three + u * 2 * four))

    def polar(self, z: Any) -> Any:
        """The square of the rate of m."""
        return self.carter + self.momentum**2 + self.spin**2 * self.excess * z * z

    def rates(self, u: Any, sine_2: Any) -> tuple[Any, Any]:
        """dt / dMino and dpsi / dMino; sine_2: squared sine of the polar angle."""
        a, r = self.spin, 1 / u
        square = r * r + a * a
        pull = (self.energy * square - a * self.momentum) / kerr.horizon_product(a, r)
        return a * (self.momentum - a * self.energy * sine_2) + square * pull, a * (pull - self.energy)

    def slope(self, _: float, y: Array) -> list[float]:
        """The derivative of a state by Mino time."""
        u, u_rate, m_x, m_y, m_z, v_x, v_y, v_z, _, _ = y.tolist()
        bend = self.spin**2 * self.excess
        inward = v_x * v_x + v_y * v_y + v_z * v_z + bend * m_z * m_z
        forces = -inward * m_x, -inward * m_y, (bend - inward) * m_z
        return [u_rate, self.radial(u)[1], v_x, v_y, v_z, *forces, *self.rates(u, m_x * m_x + m_y * m_y)]


class _Pieces(NamedTuple):
    """The polynomials between the states of the integrator of order 8(5,3) (Hairer, Norsett & Wanner 1993, II.6).

    width: steps of Mino time.
    first: states at the starts of the steps.
    coefficients: coefficients of the polynomials.
    """

    width: Float[Array, " n"]
    first: Float[Array, "n 10"]
    coefficients: Float[Array, "n 7 10"]

    def rows(self, step: Int[Array, " n"]) -> "_Pieces":
        """Those of some steps."""
        return _Pieces(*(values[step] for values in self))

    def states_at(self, part: Float[Array, " n"]) -> Float[Array, "10 n"]:
        """The states at parts of the steps."""
        state, part = np.zeros_like(self.first), part[:, None]
        for i, power in enumerate(reversed(range(self.coefficients.shape[1]))):
            state = (state + self.coefficients[:, power]) * (1 - part if i % 2 else part)
        return (state + self.first).T


@dataclass(frozen=True)
class _Leg:
    """A direction of the integration: the state after each step, and in between, as functions of Mino time.

    A state is u, du / dMino, m, dm / dMino, t, psi. span: first and last time; azimuth: of m after each step, growing
    continuously.
    """

    constants: FallConstants
    span: tuple[float, float]
    states: Float[Array, "steps 10"]
    azimuth: Float[Array, " steps"]
    between: tuple["DenseOutput", ...]

    def state(self, time: float) -> tuple[Float[Array, "10"], float]:
        """The state at a time, and the azimuth of m."""
        times = self.states[:, 8]
        sign = -1 if times[-1] < times[0] else 1
        step = int(np.searchsorted(sign * times, sign * time, side="right")) - 1
        step = min(max(step, 0), len(self.between) - 1)
        if step < 0:
            return self.states[0], float(self.azimuth[0])
        state = self._state_in_step(step, time)
        return state, float(self.azimuth[step] + _advance(self.constants, self.states[step], state))

    def states_at(self, time: Float[Array, " n"]) -> Float[Array, "10 n"]:
        """The states at times within the span."""
        if not len(self.between):
            return np.repeat(self.states[:1].T, len(time), axis=1)
        order = np.sign(self.states[-1, 8] - self.states[0, 8])
        step = np.searchsorted(order * self.states[1:-1, 8], order * time)
        before, after, pieces = self.states[step, 8], self.states[step + 1, 8], self._pieces.rows(step)
        part = (time - before) / (after - before)
        for _ in range(_INVERSIONS):
            state = pieces.states_at(part)
            t_rate, _ = self.constants.rates(state[0], state[2] ** 2 + state[3] ** 2)
            part = np.clip(part + (time - state[8]) / (t_rate * pieces.width), 0, 1)
        return pieces.states_at(part)

    @cached_property
    def _pieces(self) -> "_Pieces":
        parts = [(piece.h, piece.y_old, piece.F) for piece in self.between]
        return _Pieces(*(np.array(values) for values in zip(*parts, strict=True)))

    def _state_in_step(self, step: int, time: float) -> Float[Array, "10"]:
        """The state at a time in a step."""
        before, after, between = self.states[step], self.states[step + 1], self.between[step]
        if (before[8] < time) == (after[8] < time) or before[8] == time:
            return before if abs(before[8] - time) <= abs(after[8] - time) else after

        def early(mino: float) -> float:
            return float(between(mino)[8]) - time

        ends = between.t_old, between.t
        if early(ends[0]) * early(ends[1]) > 0:
            return before if abs(before[8] - time) <= abs(after[8] - time) else after
        from scipy.optimize import brentq

        return between(brentq(early, *ends, xtol=1e-300, rtol=1e-15))


class PlaceErrors(NamedTuple):
    """Errors (n,) of places, over the radius, and of velocities; 1 where nothing is known."""

    place: Array
    velocity: Array


@dataclass(frozen=True)
class Release:
    """A body that is let go: a camera, its azimuth in radians, and the coordinate time."""

    camera: Camera
    azimuth: float
    time: float

    def displaced(self) -> "tuple[Release, Release]":
        """Releases that differ by a little more than the integration can tell: another radius, another velocity."""
        camera, small = self.camera, _DISPLACEMENT
        v = np.array(camera.fido_velocity())
        other = (1 - small) * v + small * (1 - np.linalg.norm(v)) / math.sqrt(3)
        # Toward radii that a camera may have.
        radius = camera.radius * (1 + small if camera.radius < _FAR else 1 - small)
        further = Camera(camera.spin, radius, camera.inclination, tuple(v.tolist()))
        moved = Camera(camera.spin, camera.radius, camera.inclination, tuple(other.tolist()))
        return replace(self, camera=further), replace(self, camera=moved)


@dataclass(frozen=True)
class Geodesic:
    """A body in free fall.

    release: its beginning. span: first and last coordinate time of the integration; where it fell into the hole, the
    time when it did. error: the largest relative change of E, L_z and Q over it, as `_drift` measures it.
    """

    release: Release
    constants: FallConstants
    span: tuple[float, float]
    error: float
    _legs: tuple[_Leg, ...]

    def errors(self, time: Float[Array, " n"]) -> PlaceErrors:
        """Errors of places at times within the span: distances to falls that begin beside this one.

        They count as what they were at most since the release.
        """
        times, place, velocity = self._growth
        # The next time further from the release.
        after = np.searchsorted(times, time, side="left")
        before = np.searchsorted(times, time, side="right") - 1
        at = np.clip(np.where(time < self.release.time, before, after), 0, len(times) - 1)
        return PlaceErrors(place[at], velocity[at])

    @cached_property
    def _growth(self) -> tuple[Array, Array, Array]:
        """Times (n,) in order, and both errors there."""
        times = np.unique(np.clip(np.concatenate([leg.states[:, 8] for leg in self._legs]), *self.span))
        errors = sum(_differences(self, other, times) for other in map(self._neighbour, self.release.displaced()))
        # Between its steps the integration is as good as its constants are kept.
        errors = np.minimum(errors + self.error, 1.0)
        since = int(np.searchsorted(times, self.release.time))
        later = np.maximum.accumulate(errors[:, since:], axis=1)
        earlier = np.maximum.accumulate(errors[:, since::-1], axis=1)[:, ::-1]
        place, velocity = np.concatenate([earlier[:, :-1], later], axis=1)
        return times, place, velocity

    def _neighbour(self, release: Release) -> "Geodesic":
        return free_fall(release.camera, release.azimuth, release.time, self.span)

    def place(self, time: float) -> Place:
        """Return the place at a time; over a pole the azimuth jumps by pi."""
        leg = next((leg for leg in self._legs if leg.span[0] <= time <= leg.span[1]), self._legs[-1])
        state, azimuth = leg.state(min(max(time, leg.span[0]), leg.span[1]))
        u, u_rate, *m, _, psi = state.tolist()
        rho = math.hypot(m[0], m[1])
        t_rate, turn = (float(rate) for rate in self.constants.rates(u, rho * rho))
        if rho > 0:
            outward, round_axis = (m[0] * m[3] + m[1] * m[4]) / rho, self.constants.momentum / rho**2
        else:
            outward, round_axis = math.hypot(m[3], m[4]), 0.0
        theta_rate = m[2] * outward - rho * m[5]
        rates = -u_rate / u**2 / t_rate, theta_rate / t_rate, (round_axis + turn) / t_rate
        # On the equator exactly pi / 2.
        theta = math.pi / 2 - math.asin(m[2]) if abs(m[2]) < rho else math.atan2(rho, m[2])
        return Place(1 / u, theta, azimuth + psi, *rates)

    def vectors(self, time: Float[Array, " n"]) -> tuple[Array, Array, Array, Array]:
        """Radius (n,) and unit vector (n, 3) of theta and phi at times within the span, and the rates of both."""
        state = np.empty((10, len(time)))
        which = np.searchsorted([leg.span[1] for leg in self._legs[:-1]], time)
        for i, leg in enumerate(self._legs):
            state[:, which == i] = leg.states_at(time[which == i])
        u, u_rate, m, m_rate, psi = state[0], state[1], state[2:5], state[5:8], state[9]
        square = m[0] ** 2 + m[1] ** 2
        t_rate, turn = self.constants.rates(u, square)
        c, s = np.cos(psi), np.sin(psi)

        def rotated(part: Array) -> Array:
            return np.stack([c * part[0] - s * part[1], s * part[0] + c * part[1], part[2]], axis=-1)

        drag = turn * np.stack([-m[1], m[0], 0 * u])
        return 1 / u, rotated(m), -u_rate / u**2 / t_rate, rotated(m_rate + drag) / t_rate[:, None]


def free_fall(camera: Camera, azimuth: float, time: float, span: tuple[float, float]) -> Geodesic:
    """The geodesic of a camera that is let go at a time, over a span of coordinate times about that time.

    Parameters: azimuth, radians, at that time. On the spin axis e_theta points along it. Errors: `Geodesic.error`;
    1e-11 or better over tens of orbits, and for falls to the hole.
    """
    constants, state = initial_state(camera, azimuth, time)
    ends = {min(span[0], time), max(span[1], time)} - {time}
    legs = tuple(sorted((_integrated(constants, state, end) for end in ends), key=lambda leg: leg.span))
    if not legs:
        legs = (_Leg(constants, (time, time), state[None], np.array([_azimuth(state)]), ()),)
    reached = legs[0].span[0], legs[-1].span[1]
    return Geodesic(Release(camera, azimuth, time), constants, reached, max(_drift(leg) for leg in legs), legs)


def _differences(one: Geodesic, other: Geodesic, times: Float[Array, " n"]) -> Float[Array, "2 n"]:
    """Distances of places over the radius, and of velocities; one that has fallen in stays where it did."""
    (r, n, r_rate, n_rate), (s, m, s_rate, m_rate) = (fall.vectors(np.clip(times, *fall.span)) for fall in (one, other))
    place = np.abs(s - r) / r + lengths(m - n)
    return np.stack([place, np.abs(s_rate - r_rate) + r * lengths(m_rate - n_rate)])


def circular_velocity(spin: float, radius: float, theta: float, heading: float) -> tuple[float, float, float]:
    """Velocity of a spherical orbit, one of constant radius, measured by the FIDO; on the equator a circle or inclined.

    heading: radians on the FIDO's sky, from the direction of growing phi toward the spin axis.
    """
    south, east = -math.sin(heading), math.cos(heading)

    def pull(speed: float) -> float:
        camera = Camera(spin, radius, theta, (0.0, speed * south, speed * east))
        return -initial_state(camera, 0.0, 0.0)[0].radial(1 / radius)[1]

    if not pull(0.0) < 0 < pull(_FASTEST):
        raise ValueError("Argument `velocity` must not be circular where no orbit keeps its radius.")
    from scipy.optimize import brentq

    speed = float(brentq(pull, 0.0, _FASTEST, xtol=1e-16, rtol=1e-15))
    return 0.0, speed * south, speed * east


def initial_state(camera: Camera, azimuth: float, time: float) -> tuple[FallConstants, Float[Array, "10"]]:
    """Constants of the motion of a camera, and its state."""
    v_r, v_theta, v_phi = camera.fido_velocity()
    frame = camera.frame()
    gamma, sine, cosine = 1 / math.sqrt(frame.slowness), frame.sin_theta, frame.cos_theta
    # Rates of m along e_theta and e_phi. On the axis, where L_z is zero, they are alike.
    south, east = gamma * frame.root_sigma * v_theta, gamma * frame.cylindrical_scale * v_phi
    momentum = east * sine
    energy = gamma * frame.lapse + frame.shift * momentum
    carter = south**2 + cosine**2 * (east**2 - frame.spin**2 * (energy**2 - 1))
    u_rate = -gamma * frame.root_sigma_delta * v_r / camera.radius**2
    m = sine, 0.0, cosine, cosine * south, east, -sine * south
    return FallConstants(camera.spin, energy, momentum, carter), np.array(
        [1 / camera.radius, u_rate, *m, time, azimuth]
    )


def _integrated(constants: FallConstants, state: Float[Array, "10"], end: float) -> _Leg:
    """Integrate in one direction, to a time or to the hole."""
    nearest = kerr.horizon(constants.spin) * (1 + _NEAREST)

    def above(_: float, y: Array) -> float:
        return 1 / y[0] - nearest

    def early(_: float, y: Array) -> float:
        return y[8] - end

    for event in (above, early):
        setattr(event, "terminal", True)  # noqa: B010
    u, swing = state[0], math.sqrt(constants.momentum**2 + abs(constants.carter))
    small = _TOLERANCE * np.array([u, math.sqrt(u), *[1.0] * 3, *[1.0 + swing] * 3, 1 / u, 1.0])
    onward = math.copysign(math.inf, end - state[8])
    from scipy.integrate import solve_ivp

    solution = solve_ivp(
        constants.slope, (0.0, onward), state, "DOP853", None, True, (above, early), rtol=_TOLERANCE, atol=small
    )
    states = solution.y.T
    # The end itself, unless the hole comes first.
    ends = float(state[8]), end if solution.t_events[1].size else float(states[-1, 8])
    advances = [_advance(constants, first, second) for first, second in pairwise(states)]
    azimuth = _azimuth(state) + np.cumsum([0.0, *advances])
    return _Leg(constants, (min(ends), max(ends)), states, azimuth, tuple(solution.sol.interpolants))


def _azimuth(state: Float[Array, "10"]) -> float:
    """Azimuth of m; on the axis that toward which it moves."""
    x, y = (state[2:4] if state[2:4].any() else state[5:7]).tolist()
    return math.atan2(y, x)


def _advance(constants: FallConstants, before: Float[Array, "10"], after: Float[Array, "10"]) -> float:
    """The growth of the azimuth of m on less than one turn, whose sense is that of L_z."""
    sense = -1 if constants.momentum * (after[8] - before[8]) < 0 else 1
    grown = sense * (_azimuth(after) - _azimuth(before))
    return sense * ((grown + _STILL) % (2 * math.pi) - _STILL)


def _drift(leg: _Leg) -> float:
    """Largest relative change of the constants over a part of the integration.

    The squares of both rates are held against the potentials, which have E, L_z and Q in them; that of the radial one
    is u . u = -1 as well. L_z is that of m, which stays a unit vector.
    """
    constants = leg.constants
    states = leg.states_at(np.linspace(*leg.span, _SAMPLES)).T
    u, u_rate, m, m_rate = states[:, 0], states[:, 1], states[:, 2:5], states[:, 5:8]
    swing = 1 / u**2 + constants.momentum**2 + abs(constants.carter)
    radial = (u_rate**2 - constants.radial(u)[0]) / (constants.energy**2 + u * u * swing)
    polar = ((m_rate**2).sum(axis=1) - constants.polar(m[:, 2])) / swing
    turning = (np.cross(m, m_rate)[:, 2] - constants.momentum) / np.sqrt(swing)
    unit = (m**2).sum(axis=1) - 1
    return float(max(np.abs(change).max() for change in (radial, polar, turning, unit)))
