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
