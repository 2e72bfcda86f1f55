"""Orbits of sources: on a geodesic, on a Kepler ellipse, or by a function of the coordinate time."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from kerrcaustics.choices import ReleaseName, suggestion
from kerrcaustics.orbits.geodesics import free_fall
from kerrcaustics.orbits.motions import BodyMotion, BodyPlaces, Falling, KeplerMotion, Path, Reported, circling
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera, Velocity
from kerrcaustics.spacetime.checks import argument_named, quoted, real_number
from kerrcaustics.spacetime.viewer import finite_number

Array = np.ndarray

# Velocities with a name, and headings of those that keep the radius.
RELEASES: tuple[ReleaseName, ...] = get_args(ReleaseName)
CIRCLES = {"circular": 0.0, "retrograde": math.pi}
# Of its radius: the place of an orbit is in doubt where rounding grows to more.
UNSTABLE = 1e-6


@dataclass(frozen=True)
class _Throw:
    """A body that is let go at a place and a time, or kept on a circle there: "circular" or "retrograde"."""

    radius: float
    theta: float
    phi: float
    velocity: Velocity
    time: float

    def motion_about(self, spin: float, span: tuple[float, float]) -> BodyMotion:
        """Its motion about a hole, over a span of time."""
        if isinstance(self.velocity, str) and self.velocity in CIRCLES:
            return circling(spin, self.radius, self.theta, self.phi, CIRCLES[self.velocity], self.time)
        with argument_named("radius", "orbit"), argument_named("velocity", "orbit"):
            camera = Camera(spin, self.radius, self.theta, self.velocity)
        return Falling(free_fall(camera, self.phi, self.time, span))

    def period(self, spin: float) -> float:
        """That of a circle in the equatorial plane."""
        return 2 * math.pi * (self.radius**1.5 + spin)


@dataclass(frozen=True)
class _Fixed:
    """A motion that is the same about all holes."""

    motion: BodyMotion
    length: float = math.nan

    def motion_about(self, spin: float, span: tuple[float, float]) -> BodyMotion:
        """The motion."""
        return self.motion

    def period(self, spin: float) -> float:
        """Its period."""
        return self.length


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
    radius : float, optional
        Of a circle in the equatorial plane; otherwise NaN.

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
    motion_about: Callable[[float, tuple[float, float]], BodyMotion]
    when: float = 0.0
    period: Callable[[float], float] | None = None
    radius: float = math.nan

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
            kept, which off the equatorial plane is an inclined orbit at its highest latitude; "retrograde": the same
            against the spin; "fiducial" or "static": released from rest.
        time : float
            The time when the body is there.

        Raises
        ------
        ValueError
            If an argument is invalid; when it is used with a hole, if there is no such motion.

        Errors
        ------
        Circular orbits are exact. For others the constants of motion are kept to 1e-11 or better over tens of orbits;
        a displacement of the size of rounding grows, fast where the orbit is unstable, and is part of the errors of
        light curves.

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

        # A velocity that no hole allows is refused at once; the place is checked beside a hole.
        if not isinstance(velocity, str):
            velocity = Camera(0.0, 1e6, 0.0, velocity).fido_velocity()
        elif velocity not in RELEASES:
            raise ValueError(
                f"Argument `velocity` must be {', '.join(RELEASES)} or three finite numbers, but is "
                f"{quoted(velocity)}{suggestion(velocity, RELEASES)}"
            )
        throw = _Throw(**place, velocity=velocity, time=when)
        return cls(_words("geodesic", {**place, "velocity": velocity, "time": when}), throw.motion_about, when)

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
        ellipse = _Fixed(KeplerMotion(**elements), 2 * math.pi * elements["semi_major_axis"] ** 1.5)
        return cls(_words("kepler", elements), ellipse.motion_about, elements["time"], ellipse.period)

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
        return cls(f"function {getattr(path, '__name__', type(path).__name__)}", _Fixed(Reported(path)).motion_about)


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
    period = _Throw(radius, math.pi / 2, 0.0, "circular", 0.0).period
    return replace(Orbit.geodesic(radius), words=f"circle(radius={radius!r})", period=period, radius=radius)


def _words(kind: str, values: dict[str, Any]) -> str:
    return f"{kind}({', '.join(f'{name}={value!r}' for name, value in values.items())})"


def clock_rates(spin: float, places: BodyPlaces) -> Float[Array, " n"]:
    """(dtau / dt)^2 (n,) of bodies at places, regular on the axis: not positive where nothing can move that way.

    That of the fiducial observer there, alpha^2, less the square of the velocity that it measures.
    """
    r, (x, y, z), a = places.radius, places.vector.T, spin
    sigma, delta = r**2 + (a * z) ** 2, kerr.horizon_product(a, r)
    sine = np.hypot(x, y)
    big = (r * r + a * a) ** 2 - a * a * delta * sine**2
    # sin theta dphi / dt, and that relative to the fiducial observer; the square of dtheta / dt.
    around = x * places.rate[:, 1] - y * places.rate[:, 0]
    spun = np.divide(around, sine, out=np.zeros_like(r), where=sine > 0)
    dragged = spun - 2 * a * r / big * sine
    turned = np.maximum((places.rate**2).sum(axis=-1) - spun**2, 0.0)
    return sigma * (delta / big - places.radius_rate**2 / delta - turned) - big / sigma * dragged**2


def ending(motion: BodyMotion, limit: float) -> str:
    """In words, why a motion goes no further than a time."""
    if motion.errors(np.array([limit])).place[0] > UNSTABLE:
        advice = 'give earlier times, or for a circle velocity="circular"'
        return f"is unstable, so that rounding decides whether it falls in by t = {limit:.6g} ({advice})"
    return f"is at the horizon at t = {limit:.6g}"


def checked_places(spin: float, motion: BodyMotion, time: Float[Array, " n"]) -> BodyPlaces:
    """The places at times; ValueError where nothing can be there, or move that way."""
    first, last = motion.span
    if (time < first).any() or (time > last).any():
        limit = first if (time < first).any() else last
        raise ValueError(f"Argument `orbit` must stay outside the hole within `times`, but {ending(motion, limit)}.")
    places = motion.places(time)
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
