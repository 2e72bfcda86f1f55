"""Emitters at the ends of rays, and the change of their frequency on the way to the camera.

An emitter is a function of the spin and of its place, (spin, radius, cosine of theta) -> `Motion`.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.arrays import Flags, Reals


class Motion(NamedTuple):
    """The motion of an emitter.

    orbital: dphi / dt.
    slowness: (dtau / dt)^2, not positive if nothing can move that way.
    radial: dr / dt.
    """

    orbital: Reals
    slowness: Reals
    radial: Reals = 0.0


def static(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """Motion of matter at rest in Boyer-Lindquist coordinates, outside the ergosphere."""
    # Sigma - 2 r is Delta of the spin a cos(theta).
    below = spin * cosine
    return Motion(0.0, kerr.horizon_product(below, radius) / (radius * radius + below * below))


def fiducial(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """Motion of matter in the equatorial plane, at rest with respect to the FIDO (JTFT A.1: omega and alpha^2)."""
    a, r = spin, radius
    big = (r * r + a * a) * r * r + 2 * a * a * r
    return Motion(2 * a * r / big, r * r * kerr.horizon_product(a, r) / big)


def circular(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """Motion on the prograde circular geodesic in the equatorial plane (Bardeen, Press & Teukolsky 1972, eq. 2.16)."""
    return orbital_motion(spin, radius, 1)


def retrograde(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """Motion on the retrograde circular geodesic in the equatorial plane: prograde about a hole of opposite spin."""
    return orbital_motion(spin, radius, -1)


def plunging(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """Motion in the equatorial plane: circular and prograde down to the ISCO, and from there falling.

    Inside, with the energy E and the angular momentum L of the ISCO (Cunningham 1975, ApJ 202, 788).
    """
    return _falling(spin, radius, 1)


def retrograde_plunging(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """Motion as of `plunging`, in the other sense, inside the retrograde ISCO."""
    return _falling(spin, radius, -1)


class Fall(NamedTuple):
    """The orbit from which matter falls."""

    last: Any
    """Radius of the innermost stable orbit."""
    energy: Any
    """Of matter there, per mass."""
    momentum: Any
    """The angular momentum of matter there, per mass."""

    @classmethod
    def from_isco(cls, spin: float, sense: int) -> "Fall":
        """That of matter that circles in a sense."""
        # Retrograde orbits are the mirror image of prograde ones about a hole of opposite spin.
        last = kerr.isco(spin, sense > 0)
        return cls(last, *kerr.circular_constants(sense * spin, last))


def _falling(spin: float, radius: Reals, sense: int) -> Motion:
    return falling_motion(spin, radius, sense, Fall.from_isco(spin, sense), np)


def falling_motion(spin: Any, radius: Any, sense: Any, fall: Fall, xp: Any) -> Motion:
    """Motion that is circular, in a sense, down to the orbit that it falls from; xp: NumPy, or that of JAX."""
    a, r, outside = sense * spin, radius, orbital_motion(spin, radius, sense)
    # Both times r Delta; and u^r.
    t_rate = ((r * r + a * a) * r + 2 * a * a) * fall.energy - 2 * a * fall.momentum
    phi_rate = (r - 2) * fall.momentum + 2 * a * fall.energy
    inward = -xp.sqrt(2 / (3 * fall.last)) * xp.maximum((fall.last - r) / r, 0.0) ** 1.5
    clock = r * kerr.horizon_product(a, r) / t_rate
    falls = r < fall.last
    return Motion(
        xp.where(falls, sense * phi_rate / t_rate, outside.orbital),
        xp.where(falls, clock * clock, outside.slowness),
        xp.where(falls, inward * clock, 0.0),
    )


def orbital_motion(spin: Any, radius: Any, sense: Any) -> Motion:
    """Motion on the circular geodesic of a sense in the equatorial plane; floats, NumPy or JAX arrays."""
    return Motion(sense / (sense * spin + radius**1.5), kerr.circular_slowness(spin, radius, sense))


Light = tuple[Reals, Reals]
Emitter = Callable[[float, Reals, Reals], Motion]
EMITTERS: dict[str, Emitter] = {
    "circular": circular,
    "retrograde": retrograde,
    "static": static,
    "fiducial": fiducial,
    "plunging": plunging,
    "retrograde-plunging": retrograde_plunging,
}


def redshift(
    emitter: Emitter, spin: float, light: Light, place: tuple[Reals, Reals], at_infinity: Reals, outward: Flags
) -> Reals:
    """Frequency ratio nu_camera / nu_source for an emitter; NaN if there can be none.

    Parameters: light, b and q of the photons; place, radius and cosine of theta of the emitter; at_infinity, the ratio
    for a source at rest there; outward: the photon, followed backward, moves outward at the emitter. The source
    measures (1 - Omega b - (dr / dt) p_r) dt / dtau of unit energy.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        motion = emitter(spin, *place)
        measured = 1 - motion.orbital * light[0]
        if np.any(motion.radial):
            momentum = np.where(outward, -1.0, 1.0) * radial_momentum(spin, light, place[0])
            measured = measured - motion.radial * momentum
        return at_infinity * np.sqrt(np.where(motion.slowness > 0, motion.slowness, np.nan)) / measured


def radial_momentum(spin: Any, light: Any, radius: Any, xp: Any = np) -> Any:
    """The size of p_r of photons of unit energy, of which b and q are given; xp: NumPy, or that of JAX."""
    b, q = light
    delta = kerr.horizon_product(spin, radius)
    potential = (radius * radius + spin * spin - spin * b) ** 2 - delta * (q + (b - spin) ** 2)
    return xp.sqrt(xp.maximum(potential, 0.0)) / delta
