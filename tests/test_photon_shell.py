"""Exponents of the photon shell, against quadrature and limits that are known."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.photon_shell import exponents, polar_growth


def by_quadrature(spin, b):
    """gamma and delta of a spherical photon orbit, cos(theta) = z sin(psi) with psi over half an oscillation."""
    r, q = kerr.spherical_orbit_of_impact(spin, b)
    total = q + b**2 - spin**2
    h = (total + math.sqrt(total**2 + 4 * spin**2 * q)) / 2
    z_squared = q / h

    def over_half(rate):
        def integrand(psi):
            return rate(z_squared * math.sin(psi) ** 2) / math.sqrt(h + spin**2 * z_squared * math.sin(psi) ** 2)

        return quad(integrand, -math.pi / 2, math.pi / 2, epsabs=1e-13, epsrel=1e-13)[0]

    delta = r**2 - 2 * r + spin**2
    radial = spin * (r**2 + spin**2 - spin * b) / delta - spin
    # Gralla & Lupsasca 2020: the growth is 4 r sqrt(chi) over the Mino time of half an oscillation, chi as here.
    chi = 1 - delta / (r * (r - 1) ** 2)
    return 2 * r * math.sqrt(chi) * over_half(lambda _: 1.0), -over_half(lambda zz: b / (1 - zz) + radial)


@pytest.mark.parametrize("spin", [1e-3, 0.5, 0.999])
def test_exponents_agree_with_quadrature(spin):
    low, high = (kerr.spherical_orbit_impact(spin, r) for r in reversed(kerr.photon_orbits(spin)))
    for part in (0.1, 0.45, 0.7, 0.95):
        b = low + part * (high - low)
        found = exponents(spin, b)
        np.testing.assert_allclose([found.gamma, found.delta], by_quadrature(spin, b), rtol=1e-10)


@pytest.mark.parametrize("spin", [0.1, 0.7, 0.9999])
def test_equatorial_orbits_shrink_by_pi(spin):
    for orbit in kerr.photon_orbits(spin):
        assert exponents(spin, kerr.spherical_orbit_impact(spin, orbit)).gamma == pytest.approx(math.pi, abs=1e-9)


def test_azimuth_of_a_slow_hole_is_half_a_turn_and_the_drift():
    spin = 1e-6
    drift = 2 * math.pi * spin / (3 * math.sqrt(3))
    for b, half in ((3.0, -math.pi), (-3.0, math.pi)):
        assert float(exponents(spin, b).delta) - half == pytest.approx(-drift, rel=1e-4)


@pytest.mark.parametrize("spin", [0.1, 0.7, 0.999])
def test_polar_growth_is_the_slope_of_the_azimuth_beside_the_axis(spin):
    _, q = kerr.spherical_orbit_of_impact(spin, 0.0)
    azimuth = {k: by_quadrature(spin, 0.05 * k)[1] + (k > 0) * 2 * math.pi for k in (-2, -1, 1, 2)}
    slope = (8 * (azimuth[1] - azimuth[-1]) - (azimuth[2] - azimuth[-2])) / (12 * 0.05)
    # What is left out of the slope goes as the fourth power of the step.
    assert polar_growth(spin) == pytest.approx(abs(slope) * math.sqrt(q + spin**2), rel=1e-5)


# Spin, b, and gamma, delta and tau by quadrature to 16 digits, in another program.
TABLE = [
    (0.0, 1.0, 3.141592653589793, -math.pi, 16.32419427810796),
    (0.5, 1.0, None, None, 16.076338768737624),
    (0.94, 1.0, 2.404736784818647, -5.008803353054293, 15.45097200556237),
    (0.94, -3.0, 2.892602241618992, 2.214140504789769, 15.79089549358762),
    (0.999, 2.0, 1.18326214943435, -17.7969673831540, 38.3715195904148),
]


@pytest.mark.parametrize("row", TABLE)
def test_exponents_are_those_of_the_table(row):
    spin, b, *known = row
    found = exponents(spin, b)
    for value, expected in zip((found.gamma, found.delta, found.tau), known, strict=True):
        assert expected is None or value == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("spin", [0.0, 0.3, 0.94, 0.999])
def test_exponents_of_polar_orbits_are_the_limits_from_both_sides(spin):
    for sign in (1, -1):
        polar, beside = exponents(spin, math.copysign(0.0, sign)), exponents(spin, sign * 1e-9)
        for name in ("gamma", "delta", "tau"):
            assert getattr(polar, name) == pytest.approx(getattr(beside, name), abs=1e-7)
