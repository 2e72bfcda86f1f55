"""Cusps on the equator in long arithmetic, which traces no beam; for the study orders."""

from collections.abc import Callable

from mpmath import mp, mpf

Integral = Callable[[mpf], mpf]

_DIGITS = 50


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
