"""Orbits of sources: where a body is at each coordinate time, on a geodesic, on a Kepler ellipse, or as one says.

BodyPlaces are held as a radius and a unit vector of theta and phi, so that the spin axis is a place like all others.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from kerrcaustics.orbits.geodesics import Geodesic, circular_velocity, free_fall
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera, Velocity
from kerrcaustics.spacetime.checks import quoted, real_number
from kerrcaustics.spacetime.sphere import from_angles, polar_angle
from kerrcaustics.spacetime.viewer import finite_number

Array = np.ndarray
Path = Callable[[float], tuple[float, float, float]]

# Steps of differences, in times r^(3/2) of an orbit: the errors of the fifth order and of rounding are about equal.
_STEP = 1e-3
_STENCIL = np.array([-2.0, -1.0, 1.0, 2.0])
_SLOPES = np.array([1.0, -8.0, 8.0, -1.0]) / 12
_KEPLER_STEPS = 60


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

    def at(self, time: Float[Array, " n"]) -> BodyPlaces:
        """The places at times within the span."""
        ...


@dataclass(frozen=True, eq=False)
class Orbit:
    """The orbit of a source: made by `Orbit.geodesic`, `Orbit.kepler` or `Orbit.function`.

    Azimuths are counted from the camera's, like those of stars. Times are coordinate times.

    Parameters
    ----------
    words : str
        The orbit as text.
    about : function
        The motion about a hole of a spin, over a span of time.
    when : float
        A time at which its place is known at once.
    period : function, optional
        Its period about a hole of a spin, if it has one.

    Raises
    ------
    ValueError
        By the three methods, if an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.Orbit.kepler(200.0, eccentricity=0.6, inclination=0.3)
    <Orbit kepler(semi_major_axis=200.0, eccentricity=0.6, inclination=0.3, node=0.0, pericentre=0.0, time=0.0)>
    """

    words: str
    about: Callable[[float, tuple[float, float]], BodyMotion]
    when: float = 0.0
    period: Callable[[float], float] | None = None

    def __repr__(self) -> str:
        """The kind of orbit with its numbers, in one line."""
        return f"<Orbit {self.words}>"

    @classmethod
    def geodesic(
        cls,
        radius: float,
        theta: float = math.pi / 2,
        phi: float = 0.0,
        velocity: Velocity = "circular",
        *,
        time: float = 0.0,
    ) -> "Orbit":
        """Free fall through a place, at rest or in motion there.

        Parameters
        ----------
        radius, theta, phi : float
            The place at a time; theta and phi in radians.
        velocity : (v_r, v_theta, v_phi) or str
            As the fiducial observer there measures it, in units of c. "circular": along phi, such that the radius is
            kept, which off the equatorial plane is an inclined orbit at its highest latitude; "fiducial" or "static":
            released from rest.
        time : float
            The time when the body is there.

        Raises
        ------
        ValueError
            If an argument is invalid; when it is used with a hole, if there is no such motion.

        Errors
        ------
        The constants of motion are kept to 1e-11 or better over tens of orbits.

        Examples
        --------
        >>> import kerrcaustics as kc
        >>> kc.Orbit.geodesic(8.0, velocity=(-0.1, 0.0, 0.3))
        <Orbit geodesic(radius=8.0, theta=1.5707963267948966, phi=0.0, velocity=(-0.1, 0.0, 0.3), time=0.0)>
        """
        place = {
            name: finite_number(name, value) for name, value in (("radius", radius), ("theta", theta), ("phi", phi))
        }
        when = finite_number("time", time)

        def about(spin: float, span: tuple[float, float]) -> BodyMotion:
            moves: Any = velocity
            if isinstance(velocity, str) and velocity == "circular":
                moves = circular_velocity(spin, place["radius"], place["theta"], 0.0)
            camera = Camera(spin, place["radius"], place["theta"], moves)
            return _Falling(free_fall(camera, place["phi"], when, span))

        # A velocity that no hole allows is refused at once; the place is checked beside a hole.
        if not isinstance(velocity, str):
            Camera(0.0, 1e6, 0.0, velocity)
        elif velocity not in ("circular", "fiducial", "static"):
            raise ValueError(
                "Argument `velocity` must be circular, fiducial, static or three finite numbers, but is "
                f"{quoted(velocity)}."
            )
        return cls(_words("geodesic", {**place, "velocity": velocity, "time": when}), about, when)

    @classmethod
    def kepler(
        cls,
        semi_major_axis: float,
        eccentricity: float = 0.0,
        inclination: float = 0.0,
        node: float = 0.0,
        pericentre: float = 0.0,
        *,
        time: float = 0.0,
    ) -> "Orbit":
        """Newton's ellipse, in Boyer-Lindquist coordinates: for sources far out, where it hardly precesses.

        Parameters
        ----------
        semi_major_axis : float
            In units of the mass; the period is 2 pi times its 3/2 power.
        eccentricity : float
            From 0 to below 1.
        inclination, node, pericentre : float
            Radians: the angle of the orbit to the equatorial plane (0 to pi, beyond pi / 2 against the spin), the
            azimuth of the ascending node, and the angle along the orbit from there to the pericentre.
        time : float
            Time of a passage through the pericentre.

        Raises
        ------
        ValueError
            If an argument is invalid.

        Errors
        ------
        None for the ellipse. The pericentre of a true orbit advances, by 3 / (a (1 - e^2)) radians per radian.

        Examples
        --------
        >>> import kerrcaustics as kc
        >>> orbit = kc.Orbit.kepler(100.0, eccentricity=0.5)
        """
        elements = {
            "semi_major_axis": finite_number("semi_major_axis", semi_major_axis),
            "eccentricity": finite_number("eccentricity", eccentricity),
            "inclination": finite_number("inclination", inclination),
            "node": finite_number("node", node),
            "pericentre": finite_number("pericentre", pericentre),
            "time": finite_number("time", time),
        }
        if not elements["semi_major_axis"] > 0:
            raise ValueError(f"Argument `semi_major_axis` must be positive, but is {quoted(semi_major_axis)}.")
        if not 0 <= elements["eccentricity"] < 1:
            raise ValueError(f"Argument `eccentricity` must lie in [0, 1), but is {quoted(eccentricity)}.")
        if not 0 <= elements["inclination"] <= math.pi:
            raise ValueError(f"Argument `inclination` must lie in [0, pi] radians, but is {quoted(inclination)}.")
        ellipse = _KeplerMotion(**elements)
        period = 2 * math.pi * elements["semi_major_axis"] ** 1.5
        return cls(_words("kepler", elements), lambda spin, span: ellipse, elements["time"], lambda spin: period)

    @classmethod
    def function(cls, path: Path) -> "Orbit":
        """Any smooth motion: a function of the coordinate time that returns (r, theta, phi), angles in radians.

        Errors: velocities are differences of places over a thousandth of r^(3/2), good to about 1e-11.

        Raises
        ------
        ValueError
            If it is not a function; when it is used, if it does not return three finite numbers.

        Examples
        --------
        >>> import kerrcaustics as kc
        >>> orbit = kc.Orbit.function(lambda t: (10.0 + 0.01 * t, 1.2, 0.02 * t))
        """
        if not callable(path):
            raise ValueError(f"Argument `path` must be a function of the time, but is {quoted(path)}.")
        return cls(f"function {getattr(path, '__name__', type(path).__name__)}", lambda spin, span: _Told(path))


def orbit_of(name: str, value: object) -> Orbit:
    """The orbit that an argument means: an `Orbit`, a radius (a circle in the equatorial plane), or a function."""
    if isinstance(value, Orbit):
        return value
    if callable(value):
        path: Any = value
        return Orbit.function(path)
    radius = real_number(name, value)
    if not math.isfinite(radius):
        raise ValueError(f"Argument `{name}` must be a radius, an Orbit or a function of time, but is {quoted(value)}.")
    circle = Orbit.geodesic(radius)
    return replace(circle, period=lambda spin: 2 * math.pi * (radius**1.5 + spin))


def _words(kind: str, values: dict[str, Any]) -> str:
    return f"{kind}({', '.join(f'{name}={value!r}' for name, value in values.items())})"


@dataclass(frozen=True)
class _Falling:
    """The motion on a geodesic."""

    geodesic: Geodesic

    @property
    def span(self) -> tuple[float, float]:
        return self.geodesic.span

    def at(self, time: Float[Array, " n"]) -> BodyPlaces:
        return BodyPlaces(*self.geodesic.vectors(time))


@dataclass(frozen=True)
class _KeplerMotion:
    """The motion on a Kepler ellipse."""

    semi_major_axis: float
    eccentricity: float
    inclination: float
    node: float
    pericentre: float
    time: float

    @property
    def span(self) -> tuple[float, float]:
        return -math.inf, math.inf

    def at(self, time: Float[Array, " n"]) -> BodyPlaces:
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

    @property
    def _axes(self) -> Float[Array, "2 3"]:
        """Unit vectors toward the pericentre, and along the motion there."""
        c, s = math.cos(self.node), math.sin(self.node)
        tilt, up = math.cos(self.inclination), math.sin(self.inclination)
        node, ahead = np.array([c, s, 0.0]), np.array([-s * tilt, c * tilt, up])
        along, across = math.cos(self.pericentre), math.sin(self.pericentre)
        return np.stack([along * node + across * ahead, along * ahead - across * node])


@dataclass(frozen=True)
class _Told:
    """The motion that a function gives."""

    path: Path

    @property
    def span(self) -> tuple[float, float]:
        return -math.inf, math.inf

    def at(self, time: Float[Array, " n"]) -> BodyPlaces:
        place = self._rows(time)
        step = _STEP * np.maximum(np.abs(place[:, 0]), 1.0) ** 1.5
        around = np.stack([self._rows(time + part * step) for part in _STENCIL])
        rates = np.tensordot(_SLOPES, around, 1) / step[:, None]
        return BodyPlaces(place[:, 0], place[:, 1:], rates[:, 0], rates[:, 1:])

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


def clock_rates(spin: float, places: BodyPlaces) -> Float[Array, " n"]:
    """(dtau / dt)^2 (n,) of bodies at places, regular on the axis: not positive where nothing can move that way."""
    r, (x, y, z), a = places.radius, places.vector.T, spin
    sigma, delta = r**2 + (a * z) ** 2, r * (r - 2) + a * a
    square = x * x + y * y
    # sin^2 theta dphi / dt, and the squares of sin theta dphi / dt and of dtheta / dt.
    around = x * places.rate[:, 1] - y * places.rate[:, 0]
    spun = np.divide(around**2, square, out=np.zeros_like(r), where=square > 0)
    turned = np.maximum((places.rate**2).sum(axis=-1) - spun, 0.0)
    big = (r * r + a * a) ** 2 - a * a * delta * square
    at_rest = 1 - (2 * r - 4 * a * r * around) / sigma
    return at_rest - big / sigma * spun - sigma * (places.radius_rate**2 / delta + turned)


def checked_places(spin: float, motion: BodyMotion, time: Float[Array, " n"]) -> BodyPlaces:
    """The places at times; ValueError where nothing can be there, or move that way."""
    first, last = motion.span
    if (time < first).any() or (time > last).any():
        limit = first if (time < first).any() else last
        raise ValueError(
            f"Argument `orbit` must stay outside the hole within `times`, but is at the horizon at t = {limit:.6g}."
        )
    places = motion.at(time)
    inside = np.flatnonzero(~(places.radius > kerr.horizon(spin)))
    if len(inside):
        raise ValueError(
            f"Argument `orbit` must stay outside the horizon, at r = {kerr.horizon(spin):.6g}, within `times`, but at "
            f"t = {time[inside[0]]:.6g} it is at r = {places.radius[inside[0]]:.6g}."
        )
    fast = np.flatnonzero(~(clock_rates(spin, places) > 0))
    if len(fast):
        raise ValueError(
            f"Argument `orbit` must be slower than light, but at t = {time[fast[0]]:.6g}, r = "
            f"{places.radius[fast[0]]:.6g} it is not."
        )
    return places
