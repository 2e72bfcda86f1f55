"""The Kerr metric in Boyer-Lindquist coordinates, G = c = M = 1, and its special orbits.

Functions of the spin and of one event take floats, those of the spherical photon orbits arrays too.
Radii are in units of the mass, angles in radians, 0 <= spin < 1.
"""

import math
from fractions import Fraction
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.spacetime.arrays import HostReals
from kerrcaustics.spacetime.checks import flags, quoted, real_array, real_number
from kerrcaustics.spacetime.cubic import largest_root


class Metric(NamedTuple):
    """Metric functions at one event (JTFT A.1).

    lapse (alpha), shift (omega, the angular velocity of the fiducial observers), cylindrical_scale
    (varpi / sin(theta), finite on the axis), sigma (rho^2 = r^2 + a^2 cos^2 theta), delta.
    """

    lapse: float
    shift: float
    cylindrical_scale: float
    sigma: float
    delta: float


def metric(spin: float, radius: float, cos_theta: float) -> Metric:
    """Metric functions at one event (JTFT A.1)."""
    sigma = radius**2 + (spin * cos_theta) ** 2
    # Exactly: next to the horizon its rounding alone would cost all digits.
    r, a = Fraction(radius), Fraction(spin)
    delta = float(r * (r - 2) + a * a)
    big = (radius**2 + spin**2) ** 2 - spin**2 * delta * (1 - cos_theta**2)
    return Metric(
        lapse=math.sqrt(sigma * delta / big),
        shift=2 * spin * radius / big,
        cylindrical_scale=math.sqrt(big / sigma),
        sigma=sigma,
        delta=delta,
    )


def horizon_product(spin: Any, radius: Any) -> Any:
    """Delta by the distances from the two horizons, which keep their digits; floats, NumPy or JAX arrays."""
    lift, height = ((1 - spin) * (1 + spin)) ** 0.5, radius - 1
    return (height - lift) * (height + lift)


def circular_speed(spin: Any, radius: Any, delta: Any) -> Any:
    """Speed of the prograde circular geodesic in the plane as the FIDO measures it; floats, NumPy or JAX arrays.

    Errors: relative 1e-15. r^2 - 2 a sqrt(r) + a^2, which cancels next to the horizon of a nearly extremal hole, is
    written as a sum of positive terms.
    References: JTFT A.1.
    """
    return _angular(spin, radius) / (delta**0.5 * (radius * radius**0.5 + spin))


def circular_slowness(spin: Any, radius: Any, sense: int = 1) -> Any:
    """(dtau / dt)^2 on the circular geodesic of a sense in the plane, not positive where there is none.

    Floats, NumPy or JAX arrays. r^(3/2) - 3 sqrt(r) + 2 a is written about r = 1, where it nearly vanishes next to a
    nearly extremal hole.

    References: Bardeen, Press & Teukolsky 1972, eq. 2.16.
    """
    root = radius**0.5
    excess = ((radius - 1) / (1 + root)) ** 2 * (root + 2) - 2 * (1 - sense * spin)
    return radius * root * excess / (radius * root + sense * spin) ** 2


def exact_circular_slowness(spin: float, radius: float) -> float:
    """(dtau / dt)^2 on the prograde circular geodesic, without loss of digits next to the photon orbit.

    Errors: relative 1e-15.
    """
    root = math.sqrt(radius)
    r, a = Fraction(radius), Fraction(spin)
    # Below r = 3 the two terms of r^(3/2) - 3 sqrt(r) + 2 a differ in sign, and their squares are known exactly.
    if radius < 3:
        excess = float(4 * a * a - r * (3 - r) ** 2) / (2 * spin + root * (3 - radius))
    else:
        excess = root * (radius - 3) + 2 * spin
    return radius * root * excess / (radius * root + spin) ** 2


def has_circular_orbit(spin: float, radius: float) -> bool:
    """True outside the prograde photon orbit, as a double and as what that stands for."""
    return radius > photon_orbits(spin)[0] and exact_circular_slowness(spin, radius) > 0


def static_slowness(spin: float, radius: float, cos_theta: float) -> float:
    """(dtau / dt)^2 at rest in Boyer-Lindquist coordinates, not positive at and inside the ergosphere.

    Errors: relative 1e-15, for the cosine as it is.
    """
    r = Fraction(radius)
    sigma = r * r + (Fraction(spin) * Fraction(cos_theta)) ** 2
    return float((sigma - 2 * r) / sigma)


def circular_constants(spin: float, radius: float) -> tuple[float, float]:
    """Energy and angular momentum, per mass, on the prograde circular geodesic in the plane.

    Errors: relative 1e-15, but next to the photon orbit.
    References: Bardeen, Press & Teukolsky 1972, eqs. 2.12 and 2.13.
    """
    root = math.sqrt(radius)
    height = (radius - 1) / (1 + root)
    clock = math.sqrt(exact_circular_slowness(spin, radius)) * (radius * root + spin)
    energy = height * (radius + root - 1) - (1 - spin)
    return energy / clock, _angular(spin, radius) / clock


def _angular(spin: Any, radius: Any) -> Any:
    """The factor r^2 - 2 a sqrt(r) + a^2 of the angular momentum of a circular orbit."""
    root = radius**0.5
    return (radius - spin) ** 2 + 2 * spin * root * (radius - 1) / (1 + root)


def radial_potential(spin: float, radius: float, b: np.ndarray, q: np.ndarray) -> np.ndarray:
    """R of light of unit energy, of which p_r = sqrt(R) / Delta; below 0 by rounding where light turns."""
    square = radius**2 + spin**2
    return (square - spin * b) ** 2 - (square - 2 * radius) * ((b - spin) ** 2 + q)


def horizon(spin: float) -> float:
    """Radius of the outer horizon, r_+."""
    return 1 + math.sqrt((1 - spin) * (1 + spin))


def inner_horizon(spin: float) -> float:
    """Radius of the inner horizon, r_-, written so that it keeps its digits at small spin."""
    return spin**2 / horizon(spin)


def ergosphere(spin: float, cos_theta: float) -> float:
    """Radius of the static limit at a polar angle: nothing can be at rest at or below it."""
    return 1 + math.sqrt(1 - (spin * cos_theta) ** 2)


@overload
def isco(spin: float, prograde: bool = True) -> float: ...
@overload
def isco(spin: ArrayLike, prograde: bool = True) -> HostReals: ...
def isco(spin: ArrayLike, prograde: bool = True) -> float | HostReals:
    """Radius of the innermost stable circular orbit in the equatorial plane, in units of M.

    Parameters
    ----------
    spin : float or array
        Spin a of the hole, 0 <= a < 1.
    prograde : bool
        True for orbits in the sense of the hole's rotation, False for the other sense.

    Returns
    -------
    float, or an array of the shape of `spin`

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    2e-15, at every spin.

    References
    ----------
    Bardeen, Press & Teukolsky 1972, eq. 2.21; 3 - Z_1 without its cancellation at small spin.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.isco(0.0), kc.isco(0.0, prograde=False)
    (6.0, 6.0)
    """
    flags(prograde=prograde)
    if np.ndim(spin):
        spins = real_array("spin", spin)
        return np.array([_isco(a, prograde) for a in spins.ravel().tolist()]).reshape(spins.shape)
    return _isco(spin, prograde)


def checked_spin(spin: Any) -> float:
    """The spin of a hole; ValueError for what is none."""
    a = real_number("spin", spin)
    if not 0 <= a < 1:
        raise ValueError(f"Argument `spin` must lie in [0, 1), but is {quoted(spin)}{if_mirrored(a)}")
    return a


def _isco(spin: Any, prograde: bool) -> float:
    """Its radius for one spin."""
    a = checked_spin(spin)
    with_spin, against = math.log1p(a), math.log1p(-a)
    # 3 - Z_1, of which either term alone is of the first order in the spin.
    rest = -math.expm1((2 * with_spin + against) / 3) - math.expm1((with_spin + 2 * against) / 3)
    z2 = math.sqrt(3 * a**2 + (3 - rest) ** 2)
    root = math.sqrt(rest * (6 - rest + 2 * z2))
    return 3 + z2 + (-root if prograde else root)


def if_mirrored(spin: float) -> str:
    """The end of a sentence about a spin that is out of range: for a negative one, the way to write what it means."""
    if not -1 < spin < 0:
        return "."
    return (
        f": the mirror image, spin {-spin:g} with azimuths and velocities along phi of the other sign, is such a hole; "
        'orbits and disks against the spin have motion "retrograde".'
    )


def photon_orbits(spin: float) -> tuple[float, float]:
    """Radii (r_1, r_2) of the prograde and the retrograde circular photon orbit in the equatorial plane.

    The spherical photon orbits fill r_1 <= r_o <= r_2 (JTFT A.1).
    """
    third = 2 / 3
    return 2 * (1 + math.cos(third * math.acos(-spin))), 2 * (1 + math.cos(third * math.acos(spin)))


def spherical_orbit_impact(spin: float, orbit_radius: float | HostReals) -> float | HostReals:
    """Axial angular momentum b_o(r_o) of the spherical photon orbit of radius r_o, spin > 0 (JTFT A.1)."""
    a, r = spin, orbit_radius
    return -(r**3 - 3 * r**2 + a**2 * r + a**2) / (a * (r - 1))


def spherical_orbit_of_impact(spin: float, b: ArrayLike) -> tuple[HostReals, HostReals]:
    """Radius and Carter constant (r_o, q_o) of the spherical photon orbit with axial angular momentum b.

    The inverse of JTFT A.1, regular at spin 0: r_o = 1 + x where x is the largest root of
    x^3 - 3 p x - 2 (1 - a^2) = 0 with 3 p = 3 - a^2 - a b.

    Errors: relative 1e-15 away from the extremal corner (spin -> 1, b -> 2), where x itself tends to 0.
    """
    a, b = spin, np.asarray(b, float)
    p = 1 - (a**2 + a * b) / 3
    h = (1 - a) * (1 + a)
    x = np.asarray(largest_root(p, h))
    for _ in range(2):
        x = x - (x**3 - 3 * p * x - 2 * h) / np.where(x**2 > p, 3 * (x**2 - p), np.inf)
    r = 1 + x
    q = (2 * r**3 + (a**2 - b**2) * r + (b - a) ** 2) / x
    return r, q
