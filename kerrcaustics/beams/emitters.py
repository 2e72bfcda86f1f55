"""What shines at the end of a ray, and how its frequency changes on the way to the camera.

An emitter is a function of the spin and of its place, (spin, radius, cosine of theta) -> (Omega, (dtau / dt)^2): how
fast it circles the hole, dphi / dt, and how fast its clock goes, not positive where nothing can move that way.
"""

from collections.abc import Callable

import numpy as np

from kerrcaustics.spacetime.arrays import Reals

Motion = tuple[Reals, Reals]


def static(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """At rest in Boyer-Lindquist coordinates, outside the ergosphere."""
    return 0.0, 1 - 2 * radius / (radius * radius + (spin * cosine) ** 2)


def fiducial(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """In the equatorial plane, at rest with respect to the FIDO (JTFT A.1: omega and alpha^2)."""
    a, r = spin, radius
    big = (r * r + a * a) * r * r + 2 * a * a * r
    return 2 * a * r / big, r * r * (r * r - 2 * r + a * a) / big


def circular(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """In the equatorial plane, on the prograde circular geodesic (Bardeen, Press & Teukolsky 1972, eq. 2.16)."""
    return _orbiting(spin, radius, 1)


def retrograde(spin: float, radius: Reals, cosine: Reals) -> Motion:
    """In the equatorial plane, on the retrograde circular geodesic: prograde about a hole that spins the other way."""
    return _orbiting(spin, radius, -1)


def _orbiting(spin: float, radius: Reals, sense: int) -> Motion:
    r = radius
    kepler = sense * spin + r**1.5
    return sense / kepler, r**3 * (1 - 3 / r + 2 * sense * spin / r**1.5) / kepler**2


Emitter = Callable[[float, Reals, Reals], Motion]
EMITTERS: dict[str, Emitter] = {
    "circular": circular,
    "retrograde": retrograde,
    "static": static,
    "fiducial": fiducial,
}


def redshift(emitter: Emitter, spin: float, b: Reals, place: tuple[Reals, Reals], at_infinity: Reals) -> Reals:
    """Frequency ratio nu_camera / nu_source for an emitter; NaN where there can be none.

    Parameters: b, the photon's axial angular momentum per energy; place, radius and cosine of theta of the emitter;
    at_infinity, the ratio for a source at rest there. The source measures (1 - Omega b) dt / dtau of unit energy.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        rate, slowness = emitter(spin, *place)
        return at_infinity * np.sqrt(np.where(slowness > 0, slowness, np.nan)) / (1 - rate * b)
