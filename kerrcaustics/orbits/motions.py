"""Motions of bodies: where each is at coordinate times, and how well that is known.

Places are held as a radius and a unit vector of theta and phi, so that the spin axis is a place like all others.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from kerrcaustics.orbits.geodesics import Geodesic, PlaceErrors, circular_velocity, initial_state
from kerrcaustics.orbits.moving_place import Place
from kerrcaustics.orbits.spherical_orbits import SphericalOrbits
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import quoted
from kerrcaustics.spacetime.sphere import from_angles, polar_angle

Array = np.ndarray
Path = Callable[[float], tuple[float, float, float]]

# Steps of differences, in times r^(3/2) of an orbit: the errors of the fifth order and of rounding are about equal.
_STEP = 1e-3
_STENCIL = np.array([-2.0, -1.0, 1.0, 2.0])
_SLOPES = np.array([1.0, -8.0, 8.0, -1.0]) / 12
# Errors of velocities from differences.
_DIFFERENCES = 1e-11
_KEPLER_STEPS = 60
# Rounding of unit vectors.
_ROUNDING = 1e-15


class BodyPlaces(NamedTuple):
    """Places at some times, and their rates in coordinate time: radius (n,), unit vector (n, 3) of theta and phi."""

    radius: Array
    vector: Array
    radius_rate: Array
    rate: Array

    @property
    def angles(self) -> Float[Array, "n 2"]:
        """theta and phi."""
        return np.stack([polar_angle(self.vector), np.arctan2(self.vector[:, 1], self.vector[:, 0])], axis=-1)


@runtime_checkable
class BodyMotion(Protocol):
    """The motion of a body about one hole."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time at which it is known."""
        ...

    def places(self, time: Float[Array, " n"]) -> BodyPlaces:
        """The places at times within the span."""
        ...

    def errors(self, time: Float[Array, " n"]) -> PlaceErrors:
        """The errors of places at times within the span."""
        ...


@dataclass(frozen=True)
class Falling:
    """The motion on a geodesic."""

    geodesic: Geodesic

    @property
    def span(self) -> tuple[float, float]:
        """First and last time at which it is known."""
        return self.geodesic.span

    def places(self, time: Float[Array, " n"]) -> BodyPlaces:
        """Return the places at times."""
        return BodyPlaces(*self.geodesic.vectors(time))

    def errors(self, time: Float[Array, " n"]) -> PlaceErrors:
        """Return the errors of places at times."""
        return self.geodesic.errors(time)


@dataclass(frozen=True)
class Circling:
    """The motion on a circular orbit of any inclination, which stays on it, stable or not.

    orbit: the orbit of one body.
    start: coordinate time at which its phase is that of the orbit.
    span: first and last coordinate time.
    """

    orbit: SphericalOrbits
    start: float
    span: tuple[float, float] = (-math.inf, math.inf)

    def places(self, time: Float[Array, " n"]) -> BodyPlaces:
        """Return the places at times."""
        found = self.orbit.places(time - self.start)
        return BodyPlaces(self.orbit.radius[0] + 0 * time, found.vector, 0 * time, found.rate)

    def errors(self, time: Float[Array, " n"]) -> PlaceErrors:
        """Return the errors of places at times."""
        error = self.orbit.errors(time - self.start)
        return PlaceErrors(error, error)

    def place(self, time: float) -> Place:
        """Return the place at a time; over a pole the azimuth jumps by pi."""
        found = self.places(np.array([time]))
        (x, y, z), (x_rate, y_rate, z_rate) = found.vector[0].tolist(), found.rate[0].tolist()
        rho = math.hypot(x, y)
        if rho < _ROUNDING:
            # On the axis the azimuth is that toward which it moves.
            theta, azimuth = math.atan2(0.0, z), math.atan2(y_rate, x_rate)
            theta_rate, phi_rate = z * math.hypot(x_rate, y_rate), 0.0
        else:
            # On the equator exactly pi / 2.
            theta = math.pi / 2 - math.asin(z) if abs(z) < rho else math.atan2(rho, z)
            azimuth = math.atan2(y, x)
            theta_rate = z * (x * x_rate + y * y_rate) / rho - rho * z_rate
            phi_rate = (x * y_rate - y * x_rate) / rho**2
        evenly = self._even_azimuth(time)
        phi = evenly + math.remainder(azimuth - evenly, 2 * math.pi)
        return Place(float(self.orbit.radius[0]), theta, phi, 0.0, theta_rate, phi_rate)

    def _even_azimuth(self, time: float) -> float:
        """The azimuth of a body that goes round evenly, which differs by less than pi."""
        orbit = self.orbit
        sense = math.copysign(1.0, math.cos(orbit.inclination[0]))
        rounds = (time - self.start) / orbit.period[0]
        return float(orbit.node[0] + sense * orbit.phase[0] + rounds * (2 * math.pi * sense + orbit.precession[0]))


def circling(spin: float, radius: float, theta: float, azimuth: float, heading: float, time: float) -> Circling:
    """The circular orbit through a place at a time; a ValueError if there is none.

    heading: radians on the FIDO's sky, from the direction of growing phi toward the spin axis.
    """
    camera = Camera(spin, radius, theta, circular_velocity(spin, radius, theta, heading))
    constants, state = initial_state(camera, azimuth, time)
    (x, y, z), (x_rate, y_rate, z_rate) = state[2:5].tolist(), state[5:8].tolist()
    # The highest latitude is where the polar rate vanishes: a root of a quadratic in its squared sine.
    beta, total = -(spin**2) * constants.excess, constants.momentum**2 + constants.carter
    middle = total + beta
    sine_2 = 2 * constants.carter / (middle + math.sqrt(middle**2 - 4 * beta * constants.carter))
    swing = math.sqrt(total - beta * sine_2)
    tilt, up = constants.momentum / swing, math.sqrt(sine_2)
    chi = math.atan2(z * math.sqrt(swing**2 + beta * (1 - z * z)), z_rate) if up > 0 else 0.0
    if x or y:
        turn = math.atan2(y, x) - math.atan2(tilt * math.sin(chi), math.cos(chi))
    else:
        turn = math.atan2(-z * y_rate, -z * x_rate)
    columns = (np.array([part]) for part in (radius, math.atan2(up, tilt), azimuth + turn, chi))
    return Circling(SphericalOrbits(spin, *columns), time)


@dataclass(frozen=True)
class KeplerMotion:
    """The motion on a Kepler ellipse."""

    semi_major_axis: float
    eccentricity: float
    inclination: float
    node: float
    pericentre: float
    time: float

    @property
    def span(self) -> tuple[float, float]:
        """First and last time at which it is known."""
        return -math.inf, math.inf

    def places(self, time: Float[Array, " n"]) -> BodyPlaces:
        """Return the places at times."""
        e, rate = self.eccentricity, self.semi_major_axis**-1.5
        mean = np.remainder(rate * (time - self.time) + math.pi, 2 * math.pi) - math.pi
        # Newton's method from the far side, where Kepler's equation is convex: it never overshoots.
        anomaly = np.copysign(math.pi, mean)
        for _ in range(_KEPLER_STEPS):
            step = (anomaly - e * np.sin(anomaly) - mean) / (1 - e * np.cos(anomaly))
            anomaly = anomaly - step
            if (np.abs(step) < 4e-16 * np.maximum(np.abs(anomaly), 1e-3)).all():
                break
        cosine, sine, flat = np.cos(anomaly), np.sin(anomaly), math.sqrt((1 - e) * (1 + e))
        turned = rate / (1 - e * cosine)
        radius, grows = self.semi_major_axis * (1 - e * cosine), self.semi_major_axis * e * sine * turned
        x, y = self.semi_major_axis * (cosine - e), self.semi_major_axis * flat * sine
        x_rate, y_rate = -self.semi_major_axis * sine * turned, self.semi_major_axis * flat * cosine * turned
        plane = np.stack([x, y], axis=-1) / radius[:, None]
        plane_rate = (np.stack([x_rate, y_rate], axis=-1) - plane * grows[:, None]) / radius[:, None]
        return BodyPlaces(radius, plane @ self._axes, grows, plane_rate @ self._axes)

    def errors(self, time: Float[Array, " n"]) -> PlaceErrors:
        """Return the errors of places at times."""
        # Rounding of the mean anomaly, where the body is fastest.
        e, rate = self.eccentricity, self.semi_major_axis**-1.5
        fastest = math.sqrt(1 + e) / (1 - e) ** 1.5
        error = np.minimum(_ROUNDING * (1 + fastest * (1 + np.abs(rate * (time - self.time)))), 1.0)
        return PlaceErrors(error, error)

    @property
    def _axes(self) -> Float[Array, "2 3"]:
        """Unit vectors toward the pericentre, and along the motion there."""
        c, s = math.cos(self.node), math.sin(self.node)
        tilt, up = math.cos(self.inclination), math.sin(self.inclination)
        node, ahead = np.array([c, s, 0.0]), np.array([-s * tilt, c * tilt, up])
        along, across = math.cos(self.pericentre), math.sin(self.pericentre)
        return np.stack([along * node + across * ahead, along * ahead - across * node])


@dataclass(frozen=True)
class Reported:
    """The motion that a function gives."""

    path: Path

    @property
    def span(self) -> tuple[float, float]:
        """First and last time at which it is known."""
        return -math.inf, math.inf

    def places(self, time: Float[Array, " n"]) -> BodyPlaces:
        """Return the places at times."""
        place = self._rows(time)
        step = _STEP * np.maximum(np.abs(place[:, 0]), 1.0) ** 1.5
        around = np.stack([self._rows(time + part * step) for part in _STENCIL])
        rates = np.tensordot(_SLOPES, around, 1) / step[:, None]
        return BodyPlaces(place[:, 0], place[:, 1:], rates[:, 0], rates[:, 1:])

    def errors(self, time: Float[Array, " n"]) -> PlaceErrors:
        """Return the errors of places at times."""
        return PlaceErrors(0 * time, _DIFFERENCES + 0 * time)

    def _rows(self, time: Float[Array, " n"]) -> Float[Array, "n 4"]:
        """Radius and unit vector at times."""
        rows = []
        for moment in time.tolist():
            try:
                r, theta, phi = (float(part) for part in self.path(moment))
            except (TypeError, ValueError):
                raise ValueError(
                    "Argument `orbit` must be a function of time that returns (r, theta, phi), three numbers, but at "
                    f"t = {moment:g} it returns {quoted(self.path(moment))}."
                ) from None
            if not (math.isfinite(r) and math.isfinite(theta) and math.isfinite(phi)):
                raise ValueError(
                    f"Argument `orbit` must return finite numbers, but at t = {moment:g} returns {(r, theta, phi)}."
                )
            rows.append([r, *from_angles(theta, phi).tolist()])
        return np.array(rows).reshape(-1, 4)
