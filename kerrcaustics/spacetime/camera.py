"""Cameras: place and velocity."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, ClassVar, get_args

from kerrcaustics.choices import VelocityName, suggestion
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import differing_digits, instance_of, quoted, real_number, refuse_traced
from kerrcaustics.spacetime.frame import Frame
from kerrcaustics.spacetime.viewer import Vector, Viewer, check_place, finite_number, frame_at

Velocity = str | Vector

# A camera that turns slower than this part of its terms stands still.
_ROUND_OFF = 1e-12

VELOCITY_NAMES: tuple[VelocityName, ...] = get_args(VelocityName)


@result("camera/1", eq=True)
class Camera(Viewer):
    """A camera at rest in its own frame at one event outside the horizon of a Kerr black hole.

    Parameters
    ----------
    spin : float
        Spin a of the hole, 0 <= a < 1, along +z (units of the mass).
    radius : float
        Boyer-Lindquist radius, outside the horizon, at most 1e9.
    inclination : float
        Polar angle of the camera in radians, 0 to pi; pi/2 is the equator.
    velocity : str or (float, float, float), optional
        "circular" (prograde equatorial geodesic), "fiducial" (at rest with respect to the FIDO), "static"
        (at rest in Boyer-Lindquist coordinates), or a vector (v_r, v_theta, v_phi) measured by the FIDO.
        By default "circular" if there is such an orbit, else "fiducial".

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    The camera's azimuth is 0. Camera basis, with B the unit direction of motion: e_y = B, e_x perpendicular
    to B in the plane of e_r and e_phi, e_z = e_x x e_y (JTFT A.1). At rest, and for azimuthal
    motion, e_x = e_r, e_y = e_phi, e_z = -e_theta.

    References: JTFT appendix A.1.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.999, radius=6.03)
    >>> camera.velocity
    'circular'
    """

    spin: float = quantity("", "1", "spin a of the hole")
    radius: float = quantity("", "GM/c^2", "Boyer-Lindquist radius")
    inclination: float = quantity("", "rad", "polar angle", given=True, default=math.pi / 2)
    velocity: Velocity | None = quantity("", "", "name, or vector measured by the FIDO", default=None)
    sky_unit: ClassVar[str] = "rad"
    sky_coordinates: ClassVar[str] = "direction N"

    def __post_init__(self) -> None:
        """Raise ValueError unless there is such a camera."""
        for name in ("spin", "radius", "inclination"):
            object.__setattr__(self, name, finite_number(name, getattr(self, name)))
        check_place(self.spin, self.radius, self.inclination)
        if self.velocity is None:
            orbits = self.on_equator and kerr.has_circular_orbit(self.spin, self.radius)
            object.__setattr__(self, "velocity", "circular" if orbits else "fiducial")
        elif not isinstance(self.velocity, str):
            object.__setattr__(self, "velocity", _velocity_vector(self.velocity))
        elif self.velocity not in VELOCITY_NAMES:
            raise ValueError(
                "Argument `velocity` must be circular, fiducial, static or a vector (v_r, v_theta, v_phi), "
                f"but is {quoted(self.velocity)}{self._retrograde() or suggestion(self.velocity, VELOCITY_NAMES)}"
            )
        if self.velocity in _CLOCKS:
            _CLOCKS[self.velocity](self)

    def fido_velocity(self) -> tuple[float, float, float]:
        """Velocity (v_r, v_theta, v_phi) of the camera as measured by the fiducial observer (FIDO).

        Errors: relative 1e-15.
        References: JTFT A.1 for "circular".
        """
        if isinstance(self.velocity, tuple):
            return self.velocity
        if self.velocity == "fiducial":
            return (0.0, 0.0, 0.0)
        at = kerr.metric(self.spin, self.radius, self.cos_theta)
        if self.velocity == "static":
            return (0.0, 0.0, -at.shift * at.cylindrical_scale * self.sin_theta / at.lapse)
        return (0.0, 0.0, kerr.circular_speed(self.spin, self.radius, at.delta))

    @property
    @derived("", "1")
    def clock_rate(self) -> float:
        """dt / dtau = u^t: coordinate time, that of clocks at rest far away, per time of the camera's own clock.

        Errors: relative 1e-15; of a static camera off the equator 2e-16 (5 + clock_rate^2), as the cosine of the
        inclination is rounded.
        """
        frame = self.frame()
        return 1 / (frame.lapse * math.sqrt(frame.slowness))

    def at_rest(self) -> "Camera":
        """The fiducial camera at the same event: same caustics, another sky."""
        return self if self.velocity == "fiducial" else _fiducial(self.spin, self.radius, self.inclination)

    def _retrograde(self) -> str:
        """The end of a message about a velocity: the vector that is meant by "retrograde", if there is one."""
        if self.velocity != "retrograde" or self.cos_theta != 0 or not self.radius > kerr.photon_orbits(self.spin)[1]:
            return ""
        at = kerr.metric(self.spin, self.radius, 0.0)
        speed = at.cylindrical_scale * (1 / (self.radius**1.5 - self.spin) + at.shift) / at.lapse
        return f"; the retrograde circular orbit there has (0, 0, {-speed!r})."

    def frame(self) -> Frame:
        """The camera's numbers for compiled code."""
        return _frame(self)

    def orbital_velocity(self) -> float:
        """Angular velocity (coordinate azimuth per coordinate time); a ValueError unless it circles the spin axis."""
        v_r, v_theta, v_phi = self.fido_velocity()
        frame = self.frame()
        scale = frame.cylindrical_scale * frame.sin_theta
        own = frame.lapse * v_phi / scale if scale > 0 else 0.0
        angular_velocity = frame.shift + own
        turns = scale > 0 and abs(angular_velocity) > _ROUND_OFF * (abs(frame.shift) + abs(own))
        if v_r != 0 or v_theta != 0 or not turns:
            raise ValueError(
                "Argument `camera` must orbit the spin axis (a purely azimuthal velocity, and an angular velocity that "
                f"is not 0), but is {self}."
            )
        return angular_velocity


@lru_cache(maxsize=64)
def _frame(camera: Camera) -> Frame:
    slowness = None
    if camera.velocity in _CLOCKS:
        at = kerr.metric(camera.spin, camera.radius, camera.cos_theta)
        slowness = _CLOCKS[camera.velocity](camera) / at.lapse**2
    return frame_at(camera, camera.radius, camera.fido_velocity(), slowness)


def _static_slowness(camera: Camera) -> float:
    """(dtau / dt)^2 at rest; a ValueError if nothing can be at rest there."""
    slowness = kerr.static_slowness(camera.spin, camera.radius, camera.cos_theta)
    if not slowness > 0:
        value, limit = differing_digits(camera.radius, kerr.ergosphere(camera.spin, camera.cos_theta))
        raise ValueError(
            f"Argument `velocity` must not be static at or inside the ergosphere (radius {value} is not above {limit})."
        )
    return slowness


def _circular_slowness(camera: Camera) -> float:
    """(dtau / dt)^2 on the circular orbit; a ValueError if there is none."""
    if camera.cos_theta != 0:
        raise ValueError(
            "Argument `velocity` must not be circular off the equator "
            f"(inclination {math.degrees(camera.inclination):.12g} degrees is not 90)."
        )
    if not kerr.has_circular_orbit(camera.spin, camera.radius):
        value, limit = differing_digits(camera.radius, kerr.photon_orbits(camera.spin)[0])
        raise ValueError(
            "Argument `velocity` must not be circular at or inside the photon orbit "
            f"(radius {value} is not above {limit})."
        )
    return kerr.exact_circular_slowness(camera.spin, camera.radius)


# Of the motions that have a name, (dtau / dt)^2: 1 - beta^2, without the rounding of beta.
_CLOCKS: dict[Velocity | None, Callable[[Camera], float]] = {
    "static": _static_slowness,
    "circular": _circular_slowness,
}


@lru_cache(maxsize=64)
def _fiducial(spin: float, radius: float, inclination: float) -> Camera:
    return Camera(spin, radius, inclination, "fiducial")


def check_camera(camera: object) -> None:
    """Raise ValueError unless `camera` is a Camera."""
    instance_of("camera", camera, Camera)


def _velocity_vector(value: Any) -> tuple[float, float, float]:
    try:
        parts = tuple(real_number("velocity", v) for v in value)
    except TypeError as error:
        refuse_traced("velocity", error)
        parts = ()
    if len(parts) != 3 or not all(math.isfinite(v) for v in parts):
        raise ValueError(
            f"Argument `velocity` must be circular, fiducial, static or three finite numbers, but is {quoted(value)}."
        )
    speed = math.hypot(*parts)
    if not speed < 1:
        raise ValueError(f"Argument `velocity` must have a speed below 1 (light), but has {speed:g}.")
    return parts
