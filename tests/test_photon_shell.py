"""Limits of high orders in studies/photon_shell.py, against quadrature and numbers of another program."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from kerrcaustics.scripts import STUDIES
from kerrcaustics.spacetime import kerr

shell = STUDIES.load("photon_shell")


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
        found = shell.exponents(spin, b)
        np.testing.assert_allclose([found.gamma, found.delta], by_quadrature(spin, b), rtol=1e-10)


@pytest.mark.parametrize("spin", [0.1, 0.7, 0.9999])
def test_equatorial_orbits_shrink_by_pi(spin):
    for orbit in kerr.photon_orbits(spin):
        assert shell.exponents(spin, kerr.spherical_orbit_impact(spin, orbit)).gamma == pytest.approx(math.pi, abs=1e-9)


def test_azimuth_of_a_slow_hole_is_half_a_turn_and_the_drift():
    spin = 1e-6
    drift = 2 * math.pi * spin / (3 * math.sqrt(3))
    for b, half in ((3.0, -math.pi), (-3.0, math.pi)):
        assert float(shell.exponents(spin, b).delta) - half == pytest.approx(-drift, rel=1e-4)


def test_cusps_on_the_equator_are_those_of_another_program():
    # a = 0.999, r = 6.03: ends in phi' of orders 1 to 4, degrees, unwrapped so that one curve closes.
    ends = {1: (167.4713, 48.128, -1426.497, -4727.458), -1: (167.9224, 311.146, 449.935, 588.533)}
    for side, expected in ends.items():
        cusps = shell.EquatorialCusps(0.999, 6.03, side).cusps(4)
        found = [math.degrees(azimuth) + (360 * k if side > 0 else 0) for k, (_, azimuth) in enumerate(cusps, 1)]
        np.testing.assert_allclose(found, expected, atol=6e-4)
        assert all(later[0] < sooner[0] / 4 for sooner, later in pairwise(cusps))


def test_a_camera_among_the_photon_orbits_is_refused():
    with pytest.raises(ValueError, match="outside all photon orbits, but is 3"):
        shell.EquatorialCusps(0.999, 3.0, 1)
