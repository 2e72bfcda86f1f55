"""The radius of a ray at a given Mino time, in Weierstrass' elliptic function: one formula for every kind of root.

u = 1/r obeys u'^2 = F(u), a quartic, and u(tau) is a rational function of p(tau) and p'(tau) with the invariants of F.
The series of p about its pole is summed at a quarter of the time, and doubled twice.

References: Whittaker & Watson 20.6, example 2 (Biermann's formula); DLMF 23.9.2, 23.9.5, 23.10.7.
"""

from kerrcaustics.spacetime.arrays import Reals

_DOUBLINGS = 2
# Powers of the series.
_TERMS = 20


def inverse_radius(
    coefficients: tuple[Reals, Reals, Reals], start: tuple[Reals, Reals], time: Reals
) -> tuple[Reals, Reals]:
    """u = 1/r and its rate after some Mino time.

    Parameters: coefficients (a2, a1, a0) of u'^2 = c + a2 u^2 + a1 u^3 + a0 u^4; start, u and its rate, which set c.

    Errors: about 1e-10 of the largest u on the way.
    """
    a2, a1, a0 = coefficients
    u, w = start
    constant = w * w - (a2 + (a1 + a0 * u) * u) * u * u
    p, slope = _weierstrass(constant * a0 + a2 * a2 / 12, constant * (a0 * a2 / 6 - a1 * a1 / 16) - a2**3 / 216, time)
    f1, f2 = (2 * a2 + (3 * a1 + 4 * a0 * u) * u) * u, 2 * a2 + (6 * a1 + 12 * a0 * u) * u
    f3, f4 = 6 * a1 + 24 * a0 * u, 24 * a0
    shifted = p[0] - f2 / 24
    above = -w * p[1] + f1 / 2 * shifted + w * w * f3 / 24
    below = 2 * shifted**2 - w * w * f4 / 48
    change = above / below
    rate = (-w * slope + f1 / 2 * p[1] - 4 * change * shifted * p[1]) / below
    return u + change, rate


def _weierstrass(g2: Reals, g3: Reals, time: Reals) -> tuple[tuple[Reals, Reals], Reals]:
    """p and p', and p''."""
    z = time / 2**_DOUBLINGS
    square = z * z
    series: list[Reals] = [0.0, 0.0, g2 / 20, g3 / 28]
    for n in range(4, _TERMS + 1):
        total = sum(2 * series[m] * series[n - m] for m in range(2, (n + 1) // 2))
        middle = series[n // 2] ** 2 if n % 2 == 0 else 0.0
        series.append(3 / ((2 * n + 1) * (n - 3)) * (total + middle))
    value, slope = 0.0, 0.0
    for n in range(_TERMS, 1, -1):
        value, slope = value * square + series[n], slope * square + (2 * n - 2) * series[n]
    p, rate = 1 / square + value * square, -2 / (square * z) + slope * z
    for _ in range(_DOUBLINGS):
        tangent = (6 * p * p - g2 / 2) / (2 * rate)
        doubled = tangent * tangent - 2 * p
        rate, p = 2 * tangent * (p - doubled) - rate, doubled
    return (p, rate), 6 * p * p - g2 / 2
