"""Where rays may end: the celestial sphere, a finite radius, the equatorial plane."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.integrator.equations import Constants
from kerrcaustics.beams.integrator.nystroem import Path
from kerrcaustics.spacetime import kerr, radial
from kerrcaustics.spacetime.camera import Camera, Frame, Photon, photon, redshift as sky_redshift
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.polar import mino_time_to_plane

Array = Any

EMITTERS = ("circular", "retrograde", "static", "fiducial")


@dataclass(frozen=True)
class EquatorialPlane:
    """The n-th place where a ray, followed backward from the camera, crosses the equatorial plane.

    Parameters
    ----------
    crossing : int
        Which crossing, from 1. The start of a ray is none, also for a camera in the plane.
    emitter : str
        What shines there, for the redshift: "circular" (prograde circular geodesic), "retrograde" (the other
        sense), "static" (at rest in Boyer-Lindquist coordinates), "fiducial" (at rest with respect to the FIDO).
    """

    crossing: int = 1
    emitter: str = "circular"

    def __post_init__(self) -> None:
        """Refuse what is no crossing or no emitter."""
        whole_number("crossing", self.crossing, 1)
        if self.emitter not in EMITTERS:
            raise ValueError(f"Argument `emitter` must be one of {', '.join(EMITTERS)}, but is {self.emitter!r}.")


End = float | EquatorialPlane


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Goal:
    """An end for compiled code. kind: "infinity", "sphere" or "plane"; value: none, the radius, the crossing."""

    kind: str = field(metadata={"static": True})
    value: Any


INFINITY = Goal("infinity", None)


class Aim(NamedTuple):
    """Where a ray is going, by roots and elliptic integrals alone.

    captured: followed on, it falls in; lost: it does not reach its end; mino_time to the end, 0 if lost; rising,
    whether it arrives with growing radius (for spheres); plane_rate, |z'| in the equatorial plane (where that is the
    end); conditioning, how much it magnifies round-off in N: deep in the field the energy at infinity is a small
    difference of large numbers.
    """

    captured: Array
    lost: Array
    mino_time: Array
    conditioning: Array
    rising: Array | None = None
    plane_rate: Array | None = None


def goal_of(camera: Camera, end: object) -> Goal:
    """The end in the form that compiled code takes; what is no end is refused with one ValueError."""
    if isinstance(end, EquatorialPlane):
        return Goal("plane", float(end.crossing))
    if isinstance(end, bool) or not isinstance(end, int | float | np.integer | np.floating) or math.isnan(end):
        raise ValueError(f"Argument `end` must be a radius, math.inf or an EquatorialPlane, but is {end!r}.")
    horizon = kerr.horizon(camera.spin)
    if not end > horizon:
        raise ValueError(
            f"Argument `end` must be larger than the horizon radius {horizon:.12g}, but is {float(end):.12g}."
        )
    return INFINITY if math.isinf(end) else Goal("sphere", float(end))


def aim_at(goal: Goal, frame: Frame, light: Photon, quartic: radial.Quartic) -> Aim:
    """Whether a ray reaches its end, and when. Rays with no positive energy at infinity are not followed."""
    captured = radial.is_captured(frame, light, quartic)
    terms = frame.lapse + jnp.abs(light.energy_ratio - frame.lapse)
    conditioning = terms / jnp.abs(light.energy_ratio)
    if goal.kind == "infinity":
        time = jnp.where(captured, 0.0, radial.mino_time(frame, light, quartic))
        return Aim(captured, captured, time, conditioning)
    if goal.kind == "sphere":
        radius, inward = goal.value, light.rate[0] > 0
        rising = (radius > frame.radius) | ((radius == frame.radius) & inward)
        # A turning point stops the ray only where it comes before the end.
        root = jnp.sqrt(jnp.maximum(quartic.d, 0))
        above = ~captured | (~inward & (radius <= quartic.h - root))
        below = captured | (inward & (radius >= quartic.h + root))
        reached, plane_rate = jnp.where(rising, above, below), None
        time = radial.mino_time_to(frame, light, quartic, radius, rising)
    else:
        rising, plane_rate = None, jnp.sqrt(jnp.maximum(light.q, 0))
        horizon = radial.horizon(frame.spin)
        to_horizon = radial.mino_time_to(frame, light, quartic, horizon, jnp.zeros_like(captured))
        time = mino_time_to_plane(frame, light, goal.value)
        reached = time < jnp.where(captured, to_horizon, radial.mino_time(frame, light, quartic))
    lost = ~reached | (light.energy_ratio <= 0)
    return Aim(captured, lost, jnp.where(lost, 0.0, time), conditioning, rising, plane_rate)


def prospects(frame: Frame, sky: tuple[Array, Array, Array], goal: Goal) -> tuple[Array, Array]:
    """Which rays do not reach their end, and which fall in when followed on."""
    light = photon(frame, sky)
    aim = aim_at(goal, frame, light, radial.factor(*radial.potential_coefficients(frame.spin, light)))
    return aim.lost, aim.captured


def time_left(goal: Goal, constants: Constants, aim: Aim, path: Path) -> Array:
    """Mino time from a point close to the end to the end, from the path itself."""
    u, w = path.position[0], path.rate[0]
    if goal.kind == "infinity":
        return -u / w
    if goal.kind == "plane":
        # z'' vanishes in the plane.
        return -path.position[3] / path.rate[3]
    assert aim.rising is not None
    # The parabola through u, arriving with the known sign of w: close to a turning point too.
    pull = (constants.a2 + (1.5 * constants.a1 + 2 * constants.a0 * u) * u) * u
    gap = 1 / goal.value - u
    sense = jnp.where(aim.rising, -1.0, 1.0)
    final = sense * jnp.sqrt(jnp.maximum(w * w + 2 * pull * gap, 0))
    agrees = sense * w > 0
    return jnp.where(agrees, 2 * gap / jnp.where(agrees, w + final, 1), (final - w) / jnp.where(pull == 0, 1, pull))


def redshift_at_end(
    camera: Camera, sky: np.ndarray, end: End, direction: np.ndarray, radius: np.ndarray | None
) -> np.ndarray:
    """Frequency ratio nu_camera / nu_source for the source at the end of each ray; NaN where there can be none.

    Parameters: sky (n, 3); direction (n, 3) and radius (n,) of the ends, NaN for rays without one. At infinity the
    source is at rest, at a finite radius it is static, in the plane it is the plane's emitter.
    References: Bardeen, Press & Teukolsky 1972 for the circular orbits; JTFT A.1.
    """
    ratio = np.where(np.isfinite(direction[:, 0]), sky_redshift(camera, sky), np.nan)
    if radius is None:
        return ratio
    b = photon(camera.frame(), (sky[:, 0], sky[:, 1], sky[:, 2])).b
    with np.errstate(invalid="ignore", divide="ignore"):
        rate, slowness = _motion(camera.spin, end, radius, direction[:, 2])
        return ratio * np.sqrt(np.where(slowness > 0, slowness, np.nan)) / (1 - rate * b)


def _motion(spin: float, end: End, radius: np.ndarray, cosine: np.ndarray) -> tuple[Array, np.ndarray]:
    """Angular velocity of the source, and (dtau / dt)^2 of its clock: not positive where there is no such source."""
    a, r = spin, radius
    emitter = end.emitter if isinstance(end, EquatorialPlane) else "static"
    if emitter == "static":
        return 0.0, 1 - 2 * r / (r * r + (a * cosine) ** 2)
    if emitter == "fiducial":
        big = (r * r + a * a) * r * r + 2 * a * a * r
        return 2 * a * r / big, r * r * (r * r - 2 * r + a * a) / big
    # The retrograde orbit is the prograde one of a hole that spins the other way.
    sense = 1 if emitter == "circular" else -1
    kepler = sense * a + r**1.5
    return sense / kepler, r**3 * (1 - 3 / r + 2 * sense * a / r**1.5) / kepler**2
