"""Cameras in free fall: time-like geodesics of the Kerr metric, integrated once, with dense output.

Carter's equations of the second order in Mino time have no singular turning points; divided by dt / d(Mino time) they
run in coordinate time. The polar angle enters as the latitude pi/2 - theta, so that an equatorial orbit stays one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from jaxtyping import Float
from scipy.optimize import brentq

from kerrcaustics.scene_files.motion import Place
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera

Array = np.ndarray

_TOLERANCE = 1e-12
# Of the horizon's radius: nearer to it a fall ends. It takes infinitely long, in coordinate time.
_NEAREST = 1e-4
_SAMPLES = 200
# Fastest speed that a circular orbit is looked for with.
_FASTEST = 1 - 1e-9


@dataclass(frozen=True)
class FallConstants:
    """Of a geodesic, per rest mass: energy E, axial angular momentum L_z, Carter constant Q."""

    spin: float
    energy: float
    momentum: float
    carter: float

    def radial(self, r: Any) -> tuple[Any, Any]:
        """The radial potential R = (dr / dMino)^2, and half of its derivative."""
        a, k = self.spin, (self.momentum - self.spin * self.energy) ** 2 + self.carter
        p = self.energy * (r * r + a * a) - a * self.momentum
        delta = r * (r - 2) + a * a
        return p * p - delta * (r * r + k), 2 * self.energy * r * p - (r - 1) * (r * r + k) - delta * r

    def polar(self, latitude: Any) -> tuple[Any, Any]:
        """The polar potential Theta = (dtheta / dMino)^2, and half of its derivative by the latitude."""
        s, c, bound = np.sin(latitude), np.cos(latitude), self.spin**2 * (1 - self.energy**2)
        # A radial or meridional orbit runs through the axis, where this is zero over zero.
        turn = 0.0 if self.momentum == 0 else (self.momentum / c) ** 2
        slope = 0.0 if self.momentum == 0 else self.momentum**2 / c**3
        return self.carter - s * s * (bound + turn), -s * (bound * c + slope)

    def rates(self, r: Any, latitude: Any) -> tuple[Any, Any]:
        """dt / dMino and dphi / dMino."""
        a, cosine = self.spin, np.cos(latitude)
        p = self.energy * (r * r + a * a) - a * self.momentum
        delta = r * (r - 2) + a * a
        turn = 0.0 if self.momentum == 0 else self.momentum / cosine**2
        time = a * (self.momentum - a * self.energy * cosine**2) + (r * r + a * a) * p / delta
        return time, turn - a * self.energy + a * p / delta


@dataclass(frozen=True)
class Geodesic:
    """A camera in free fall.

    span: first and last coordinate time of the integration; where it fell into the hole, that is when it did.
    error: the largest relative change of E, L_z and Q over it, as `drift` measures it.
    """

    constants: FallConstants
    span: tuple[float, float]
    error: float
    _parts: tuple[tuple[float, float, Callable[[Any], Array]], ...]

    def state(self, time: float) -> Float[Array, "5"]:
        """Radius, its Mino rate, latitude, its Mino rate, azimuth."""
        part = next((part for part in self._parts if part[0] <= time <= part[1]), self._parts[-1])
        return part[2](min(max(time, part[0]), part[1]))

    def place(self, time: float) -> Place:
        """Where it is; over a pole the azimuth jumps by pi."""
        r, r_rate, latitude, latitude_rate, phi = self.state(time).tolist()
        t_rate, p_rate = (float(rate) for rate in self.constants.rates(r, latitude))
        turns = round(latitude / math.pi)
        side = -1 if turns % 2 else 1
        theta = math.pi / 2 - side * (latitude - turns * math.pi)
        rates = r_rate / t_rate, -side * latitude_rate / t_rate, p_rate / t_rate
        return Place(r, theta, phi + turns * math.pi, *rates)


def free_fall(camera: Camera, azimuth: float, time: float, span: tuple[float, float]) -> Geodesic:
    """The geodesic of a camera that is let go at a time, over a span of coordinate times about it.

    Parameters: azimuth, radians, at that time. Errors: `Geodesic.error`; 1e-10 and better over tens of orbits.
    """
    constants, state = _start(camera, azimuth)
    first, last = min(span[0], time), max(span[1], time)
    parts = tuple(
        sorted((_integrated(constants, state, time, end) for end in {first, last} - {time}), key=lambda p: p[0])
    )
    if not parts:
        parts = ((time, time, lambda _: state),)
    reached = parts[0][0], parts[-1][1]
    return Geodesic(constants, reached, max(_drift(constants, part) for part in parts), parts)


def circular_velocity(spin: float, radius: float, theta: float, heading: float) -> tuple[float, float, float]:
    """Velocity of a spherical orbit, one of constant radius, measured by the FIDO; on the equator a circle or inclined.

    heading: radians on the FIDO's sky, from the direction of growing phi toward the spin axis.
    """
    south, east = -math.sin(heading), math.cos(heading)

    def pull(speed: float) -> float:
        camera = Camera(spin, radius, theta, (0.0, speed * south, speed * east))
        return _start(camera, 0.0)[0].radial(radius)[1] / radius**3

    if not pull(0.0) < 0 < pull(_FASTEST):
        raise ValueError("Argument `velocity` must not be circular where no orbit keeps its radius.")
    speed = float(brentq(pull, 0.0, _FASTEST, xtol=1e-16, rtol=1e-15))
    return 0.0, speed * south, speed * east


def _start(camera: Camera, azimuth: float) -> tuple[FallConstants, Float[Array, "5"]]:
    """Constants of the motion of a camera, and its state."""
    v_r, v_theta, v_phi = camera.fido_velocity()
    frame = camera.frame()
    gamma = 1 / math.sqrt(frame.slowness)
    scale = frame.cylindrical_scale * frame.sin_theta
    energy = gamma * (frame.lapse + frame.shift * scale * v_phi)
    momentum = gamma * scale * v_phi
    polar_rate = gamma * frame.root_sigma * v_theta
    turn = 0.0 if momentum == 0 else (momentum / frame.sin_theta) ** 2
    carter = polar_rate**2 + frame.cos_theta**2 * (frame.spin**2 * (1 - energy**2) + turn)
    latitude = math.pi / 2 - camera.inclination
    state = np.array([camera.radius, gamma * frame.root_sigma_delta * v_r, latitude, -polar_rate, azimuth])
    return FallConstants(camera.spin, energy, momentum, carter), state


def _integrated(
    constants: FallConstants, state: Float[Array, "5"], time: float, end: float
) -> tuple[float, float, Callable[[Any], Array]]:
    """First and last time of one direction of the integration, and its dense output."""

    def slope(_: float, y: Array) -> list[Any]:
        t_rate, p_rate = constants.rates(y[0], y[2])
        forces = constants.radial(y[0])[1], constants.polar(y[2])[1]
        return [y[1] / t_rate, forces[0] / t_rate, y[3] / t_rate, forces[1] / t_rate, p_rate / t_rate]

    def above(_: float, y: Array) -> float:
        return y[0] - kerr.horizon(constants.spin) * (1 + _NEAREST)

    setattr(above, "terminal", True)  # noqa: B010
    found = scipy.integrate.solve_ivp(
        slope, (time, end), state, "DOP853", None, True, above, rtol=_TOLERANCE, atol=_TOLERANCE
    )
    reached = float(found.t[-1])
    return min(time, reached), max(time, reached), found.sol or (lambda _: state)


def _drift(constants: FallConstants, part: tuple[float, float, Callable[[Any], Array]]) -> float:
    """Largest relative change of the constants over a part of the integration.

    The squares of both rates are held against the potentials, which have E, L_z and Q in them; that of the radial one
    is u . u = -1 as well.
    """
    times = np.linspace(part[0], part[1], _SAMPLES)
    r, r_rate, latitude, latitude_rate = np.array([part[2](time) for time in times])[:, :4].T
    radial = (r_rate**2 - constants.radial(r)[0]) / (r * r + constants.spin**2) ** 2
    polar = (latitude_rate**2 - constants.polar(latitude)[0]) / (r * r + constants.momentum**2 + constants.carter)
    return float(max(np.abs(polar).max(), np.abs(radial).max()))
