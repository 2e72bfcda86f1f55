"""Exponents of the photon shell: the effect of each half oscillation of a spherical photon orbit on nearby rays.

A ray close to the shadow edge stays near a spherical photon orbit. For each half oscillation in latitude of that orbit
its distance from the edge shrinks by e^gamma, its azimuth grows by delta and its travel time by tau, so that caustics
and photon rings of high order repeat.
"""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.spacetime import kerr

# Of b, for the derivative by it: its error is then about 1e-10.
_STEP = 1e-3


@dataclass(frozen=True)
class Exponents:
    """Exponents of spherical photon orbits, for each half oscillation in latitude.

    Attributes
    ----------
    gamma : (...) array
        e-foldings by which the distance from the shadow edge shrinks.
    delta : (...) array
        Azimuth in radians gained backward along the ray: a pass beside the spin axis is half a turn, in the sense that
        the sign of b gives it.
    tau : (...) array
        Travel time in units of the mass.
    """

    gamma: np.ndarray
    delta: np.ndarray
    tau: np.ndarray


def exponents(spin: float, b: np.ndarray | float) -> Exponents:
    """Exponents of the spherical photon orbits with axial angular momentum b.

    Parameters
    ----------
    spin : float
        Spin a, 0 <= a < 1. Without spin gamma = pi, delta = pi or -pi, and tau = 3 sqrt(3) pi.
    b : (...) array
        Axial angular momentum over energy, from that of the retrograde circular photon orbit to that of the prograde
        one.

    Returns
    -------
    Exponents
        gamma, delta and tau, each (...).

    Errors
    ------
    About 1e-14 relative; 1e-11 next to the ends of the range of b, whose orbits are circular.

    Notes
    -----
    delta is discontinuous at b = 0, where the orbit passes over the poles: by -pi from the side of positive b, by +pi
    from the other one. The value at 0.0 is that of positive b, at -0.0 that of negative b.

    References
    ----------
    Gralla & Lupsasca 2020, arXiv:1910.12881, where delta is taken forward in time: it is minus the one here.
    """
    a, b = spin, np.asarray(b, float)
    orbit, q = kerr.spherical_orbit_of_impact(a, b)
    q = np.maximum(q, 0)
    # (d cos(theta) / d tau)^2 = (h + a^2 z^2) (1 - z^2 / z_+^2), z = cos(theta), z_+ its largest value.
    total = q + b**2 - a**2
    h = (total + np.sqrt(total**2 + 4 * a**2 * q)) / 2
    turning, modulus = q / h, -(a**2) * q / h**2
    # SciPy is loaded where it is needed.
    from scipy import special

    half_period = 2 * special.ellipk(modulus) / np.sqrt(h)
    # 1 - z_+^2, a difference that would cancel close to the axis.
    least_sine = b**2 / (h + a**2)
    # At b = 0 the azimuth makes a jump of half a turn at the pole.
    polar = b == 0
    pole = np.where(polar, 1.0, least_sine)
    third = special.elliprf(0, 1 - modulus, 1) + turning / 3 * special.elliprj(0, 1 - modulus, 1, pole)
    around = np.where(polar, np.copysign(np.pi, b), 2 * b * third / np.sqrt(h))
    u = 1 / orbit
    dragged = (2 * a * u - a**2 * b * u**2) / (1 - 2 * u + (a * u) ** 2)
    rate = a**2 - b**2 - q + 6 * ((b - a) ** 2 + q) * u - 6 * a**2 * q * u**2
    # With R = R' = 0 there is no Delta left.
    late = 2 * orbit * (orbit**2 + a**2) / (orbit - 1) + a * (b - a)
    second = 2 * q / (3 * h**1.5) * special.elliprd(0, 1 - modulus, 1)
    return Exponents(
        gamma=np.sqrt(rate) * half_period,
        delta=-(around + dragged * half_period),
        tau=late * half_period + a**2 * second,
    )


def polar_growth(spin: float) -> float:
    """The growth of cot of the polar gap of a caustic with each order, in the limit: L |d delta / d b| at b = 0.

    Rays close to the edge and to b = 0 pass the pole of the sky along straight lines at the distance b / L, where
    L^2 = q + a^2, in the direction k delta(b); the caustic of order k is their envelope and passes the pole at
    1 / (k L |delta'|). Derived here.

    Parameters
    ----------
    spin : float
        Spin a, 0 < a < 1.

    Returns
    -------
    float
        Growth of cot(angle between the caustic and the nearer pole of the sky) from one order to the next.

    Errors
    ------
    About 1e-9.
    """
    values = exponents(spin, np.array([-2.0, -1.0, 1.0, 2.0]) * _STEP).delta
    values[2:] += 2 * np.pi
    slope = (8 * (values[2] - values[1]) - (values[3] - values[0])) / (12 * _STEP)
    return float(abs(slope) * np.sqrt(kerr.spherical_orbit_of_impact(spin, 0.0)[1] + spin**2))
