"""Limits of caustics of high order: the photon shell, and cusps on the equator in long arithmetic.

A ray close to the shadow edge stays near a spherical photon orbit. For each half oscillation in latitude of that orbit
its distance from the edge shrinks by e^gamma and its azimuth grows by delta (Gralla & Lupsasca 2020, arXiv:1910.12881).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mpmath import mp, mpf
from scipy.special import ellipk, elliprf, elliprj

from kerrcaustics.spacetime import kerr

Integral = Callable[[mpf], mpf]

_DIGITS = 50
# Of b, for the derivative by it: its error is then about 1e-10.
_STEP = 1e-3


@dataclass(frozen=True)
class Exponents:
    """Exponents of spherical photon orbits, arrays of one shape.

    gamma: e-foldings of the distance from the shadow edge for each half oscillation; delta: azimuth gained backward
    along the ray, radians: a pass beside the spin axis is half a turn, in the sense that the sign of b gives it.
    """

    gamma: np.ndarray
    delta: np.ndarray


def exponents(spin: float, b: np.ndarray | float) -> Exponents:
    """Exponents of the spherical photon orbits with axial angular momentum b.

    Errors: about 1e-14 relative; 1e-11 next to the ends of the range of b, whose orbits are circular.
    """
    a, b = spin, np.asarray(b, float)
    orbit, q = kerr.spherical_orbit_of_impact(a, b)
    q = np.maximum(q, 0)
    # (d cos(theta) / d tau)^2 = (h + a^2 z^2) (1 - z^2 / z_+^2), z = cos(theta), z_+ its largest value.
    total = q + b**2 - a**2
    h = (total + np.sqrt(total**2 + 4 * a**2 * q)) / 2
    turning, modulus = q / h, -(a**2) * q / h**2
    half_period = 2 * ellipk(modulus) / np.sqrt(h)
    # 1 - z_+^2, a difference that would cancel close to the axis.
    least_sine = b**2 / (h + a**2)
    third = elliprf(0, 1 - modulus, 1) + turning / 3 * elliprj(0, 1 - modulus, 1, least_sine)
    u = 1 / orbit
    dragged = (2 * a * u - a**2 * b * u**2) / (1 - 2 * u + (a * u) ** 2)
    rate = a**2 - b**2 - q + 6 * ((b - a) ** 2 + q) * u - 6 * a**2 * q * u**2
    return Exponents(np.sqrt(rate) * half_period, -(2 * b * third / np.sqrt(h) + dragged * half_period))


def polar_growth(spin: float) -> float:
    """How much cot of the polar gap of a caustic grows with each order, in the limit: L |d delta / d b| at b = 0.

    Rays close to the edge and to b = 0 pass the pole of the sky along straight lines at the distance b / L, where
    L^2 = q + a^2, in the direction k delta(b); the caustic is their envelope and passes the pole at 1 / (k L |delta'|).
    Derived here. Error: 1e-9.
    """
    values = exponents(spin, np.array([-2.0, -1.0, 1.0, 2.0]) * _STEP).delta
    values[2:] += 2 * np.pi
    slope = (8 * (values[2] - values[1]) - (values[3] - values[0])) / (12 * _STEP)
    return float(abs(slope) * np.sqrt(kerr.spherical_orbit_of_impact(spin, 0.0)[1] + spin**2))


class EquatorialCusps:
    """Cusps on the equator of an equatorial camera outside all photon orbits, to 20 digits or more: no beam is traced.

    Out of the plane, a beam in the plane has the frequency w = sqrt(b^2 - a^2) in Mino time: its cusp of order k lies
    where w tau = k pi. tau and the azimuth are elliptic integrals of the first and third kind. spin > 0; side: 1 for
    the prograde end of the critical curves, -1 for the retrograde one.
    """

    def __init__(self, spin: float, radius: float, side: int) -> None:
        """The camera, its shadow edge in the plane, and the orbit there."""
        with mp.workdps(_DIGITS):
            a, r = mpf(spin), mpf(radius)
            self.spin, self.radius, self.side = a, r, side
            orbit = 2 * (1 + mp.cos(mpf(2) / 3 * mp.acos(-side * a)))
            if r <= 2 * (1 + mp.cos(mpf(2) / 3 * mp.acos(a))):
                raise ValueError(f"Argument `radius` must be outside all photon orbits, but is {radius}.")
            b = -(orbit**3 - 3 * orbit**2 + a**2 * orbit + a**2) / (a * (orbit - 1))
            delta = r**2 - 2 * r + a**2
            area = (r**2 + a**2) ** 2 - a**2 * delta
            self.shift, self.lapse, self.varpi = 2 * a * r / area, mp.sqrt(r**2 * delta / area), mp.sqrt(area) / r
            self.edge = mp.asin(side * self.lapse * b / (self.varpi * (1 - self.shift * b)))

    def _ray(self, angle: mpf) -> tuple[mpf, Callable[[Integral], mpf], mpf, list[mpf]]:
        """b of the ray at an angle from the hole's centre; the way of an elliptic integral of its phase; m; roots u."""
        a, sine = self.spin, self.side * mp.sin(angle)
        b = sine * self.varpi / (self.lapse + self.shift * self.varpi * sine)
        # Radii where the radial potential r (r^3 - p r + cubic) vanishes, largest first, the last one negative.
        p, cubic = b**2 - a**2, 2 * (b - a) ** 2
        third = mp.acos(-cubic / 2 * mp.sqrt(3 / p) ** 3) / 3
        u_2, u_3, u_1 = (1 / (2 * mp.sqrt(p / 3) * mp.cos(third - mp.pi * k / 3)) for k in (0, 2, 4))
        start, far = (mp.asin(mp.sqrt((u - u_1) / (u_2 - u_1))) for u in (1 / self.radius, mpf(0)))
        scale = 2 / mp.sqrt(cubic * (u_3 - u_1))

        def way(integral: Integral) -> mpf:
            if angle < mp.pi / 2:
                return scale * (2 * integral(mp.pi / 2) - integral(start) - integral(far))
            return scale * (integral(start) - integral(far))

        return b, way, (u_2 - u_1) / (u_3 - u_1), [u_1, u_2]

    def _phase(self, angle: mpf) -> mpf:
        """w tau / pi at infinity; 0 where |b| < a and beams open for ever."""
        b, way, modulus, _ = self._ray(angle)
        return mp.re(mp.sqrt(b**2 - self.spin**2)) * mp.re(way(lambda phase: mp.ellipf(phase, modulus))) / mp.pi

    def _azimuth(self, angle: mpf) -> mpf:
        """Azimuth at infinity, by partial fractions of its rate between the horizons."""
        b, way, modulus, (u_1, u_2) = self._ray(angle)
        a, gap, azimuth = self.spin, mp.sqrt(1 - self.spin**2), mpf(0)
        for u, other in ((1 / (1 + gap), 1 / (1 - gap)), (1 / (1 - gap), 1 / (1 + gap))):
            n = (u_2 - u_1) / (u - u_1)
            third = way(lambda phase, n=n: mp.ellippi(n, phase, modulus))
            azimuth += (b + 2 * (a - b) * u) / (a**2 * (u - other)) * mp.re(third) / (u - u_1)
        return azimuth

    def cusps(self, orders: int) -> list[tuple[mpf, mpf]]:
        """Distance from the shadow edge and phi', radians, of the cusps of order 1 to `orders`."""
        found = []
        with mp.workdps(_DIGITS):
            high = mp.log((mp.pi - self.edge) * (1 - mpf("1e-6")))
            for order in range(1, orders + 1):

                def excess(x: mpf, order: int = order) -> mpf:
                    return self._phase(self.edge + mp.exp(x)) - order

                low = high - 1
                while excess(low) < 0:
                    low -= 1
                high = mp.findroot(excess, (low, high), solver="anderson", tol=mpf(10) ** (20 - 2 * _DIGITS))
                found.append((mp.exp(high), self._azimuth(self.edge + mp.exp(high))))
        return found
