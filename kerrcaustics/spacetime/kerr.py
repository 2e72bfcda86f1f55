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


def _isco(spin: Any, prograde: bool) -> float:
    """Its radius for one spin."""
    a = real_number("spin", spin)
    if not 0 <= a < 1:
        raise ValueError(f"Argument `spin` must lie in [0, 1), but is {quoted(spin)}{if_mirrored(a)}")
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
