"""The elliptic integrals and functions against SciPy and mpmath."""

import math

import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from scipy import special

from kerrcaustics.spacetime import elliptic

pytestmark = pytest.mark.usefixtures("compiled_code")

RNG = np.random.default_rng(1882)


def triple(x, y, z):
    """The arguments in the form that the functions take; y and z real, or a complex pair."""
    y, z = np.asarray(y, complex), np.asarray(z, complex)
    return elliptic.Triple(jnp.sqrt(x), jnp.asarray((np.sqrt(y) + np.sqrt(z)).real), jnp.asarray(np.sqrt(y * z).real))


def test_first_kind():
    x, y, z = 10.0 ** RNG.uniform(-4, 4, (3, 2000))
    first, *_ = elliptic.carlson(triple(x, y, z))
    np.testing.assert_allclose(first, special.elliprf(x, y, z), rtol=4e-15)


def test_first_kind_with_an_argument_of_zero():
    first, *_ = elliptic.carlson(triple(0.0, 1.0, 2.0))
    assert float(first) == pytest.approx(special.elliprf(0, 1, 2), rel=1e-14)


def test_first_kind_with_a_complex_pair():
    x, real, imaginary = RNG.uniform(0.01, 5, (3, 500))
    first, *_ = elliptic.carlson(triple(x, real + 1j * imaginary, real - 1j * imaginary))
    expected = special.elliprf(x + 0j, real + 1j * imaginary, real - 1j * imaginary).real
    np.testing.assert_allclose(first, expected, rtol=4e-15)


def test_beyond_half_a_period_of_the_first_kind():
    """After the smallest root has changed its sign, the integral is the whole period less the one before."""
    x, y, z = 1.7, 2.9, 0.3
    here = triple(x, y, z)
    beyond = elliptic.Triple(here.root, jnp.asarray(math.sqrt(y) - math.sqrt(z)), -here.root_product)
    total = float(elliptic.carlson(here)[0]) + float(elliptic.carlson(beyond)[0])
    assert total == pytest.approx(2 * special.elliprf(0, x - z, y - z), rel=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("pair", ["real", "complex"])
def test_slopes_of_the_first_kind(pair):
    """By x, and by y, which both the sum and the product of the roots depend on: derivatives are R_D (DLMF 19.18.1)."""
    x, y, z = 10.0 ** RNG.uniform(-3, 3, (3, 500)) + 0j
    if pair == "complex":
        y, z = y + 1j * z, y - 1j * z
    first, slopes = elliptic.first_slopes(triple(x.real, y, z))
    np.testing.assert_allclose(first, special.elliprf(x, y, z).real, rtol=4e-15)
    by_x = -np.sqrt(x) * special.elliprd(y, z, x) / 3
    np.testing.assert_allclose(slopes.root, by_x.real, rtol=1e-14)
    by_y = -np.sqrt(y) * special.elliprd(x, z, y) / 3
    np.testing.assert_allclose(slopes.root_sum + np.sqrt(z) * slopes.root_product, by_y, rtol=1e-14)


def test_third_kind():
    x, y, z = RNG.uniform(0.02, 4, (3, 500))
    # Gamma is real where p lies below one or all of the others.
    p = np.minimum(np.minimum(x, y), z) * RNG.uniform(0.05, 0.95, 500)
    gamma = np.sqrt(-(p - x) * (p - y) * (p - z))
    for sign in (1, -1):
        _, (third,), _ = elliptic.carlson(triple(x, y, z), [elliptic.Pole(jnp.asarray(p), jnp.asarray(sign * gamma))])
        np.testing.assert_allclose(third, sign * gamma * special.elliprj(x, y, z, p), rtol=2e-13)


def test_third_kind_with_a_complex_pair():
    for _ in range(20):
        x, real, imaginary = RNG.uniform(0.1, 3, 3)
        p = x * RNG.uniform(0.05, 0.95)
        pair = mpmath.mpc(real, imaginary), mpmath.mpc(real, -imaginary)
        gamma = math.sqrt((x - p) * ((p - real) ** 2 + imaginary**2))
        arguments = triple(x, complex(pair[0]), complex(pair[1]))
        _, (third,), _ = elliptic.carlson(arguments, [elliptic.Pole(p, gamma)])
        assert float(third) == pytest.approx(gamma * float(mpmath.elliprj(x, *pair, p).real), rel=3e-14)


def test_third_kind_in_the_circular_case():
    x, p, y, z = np.sort(RNG.uniform(0.1, 3, (4, 500)), axis=0)
    gamma = np.sqrt((p - x) * (y - p) * (z - p))
    for sign in (1, -1):
        pole = elliptic.Pole(jnp.asarray(p), jnp.asarray(sign * gamma), circular=True)
        _, (third,), _ = elliptic.carlson(triple(x, y, z), [pole])
        np.testing.assert_allclose(third, sign * gamma * special.elliprj(x, y, z, p), rtol=2e-13)


def test_few_duplications_for_arguments_that_do_not_differ_much():
    x, y, z = 10.0 ** RNG.uniform(-1, 1, (3, 2000))
    first, _, second = elliptic.carlson(triple(x, y, z), second=True, duplications=5)
    np.testing.assert_allclose(first, special.elliprf(x, y, z), rtol=4e-15)
    np.testing.assert_allclose(second, special.elliprd(y, z, x), rtol=1e-13)


def test_second_kind():
    x, y, z = 10.0 ** RNG.uniform(-2, 2, (3, 500))
    found = elliptic.carlson(triple(x, y, z), second=True)
    np.testing.assert_allclose(found.second, special.elliprd(y, z, x), rtol=1e-13)


def modulus(m, part=0.5):
    return elliptic.Modulus(m / part, part, 1 - m)


@pytest.mark.parametrize("m", [0.0, 1e-18, 1e-9, 0.03, 0.2, 1 / 3])
def test_nome_and_period(m):
    nome = 0.5 * float(elliptic.nome_slope(modulus(m)))
    assert nome == pytest.approx(float(mpmath.qfrom(m=m)), rel=1e-14)
    assert float(elliptic.theta3(nome)) ** 2 == pytest.approx(2 / math.pi * special.ellipk(m), rel=1e-15)


def test_sd():
    for m in (0.0, 1e-9, 0.1, 1 / 3):
        nome = 0.5 * elliptic.nome_slope(modulus(m))
        z = np.linspace(-4, 9, 101)
        theta3 = 1 + 2 * sum(nome ** (n * n) * np.cos(2 * n * z) for n in (1, 2, 3))
        sn, _, dn, _ = special.ellipj(z * 2 / math.pi * special.ellipk(m), m)
        found = elliptic.sd(nome, theta3, np.sin(z), np.sin(3 * z), np.sin(5 * z))
        np.testing.assert_allclose(found, sn / dn, atol=3e-14)


def test_landen_finds_the_argument_of_an_amplitude():
    phi = np.linspace(-3, 3, 61)
    for m in (0.0, 1e-9, 0.1, 1 / 3):
        _, delay = elliptic.landen(modulus(m), math.sqrt(0.5), (np.sin(phi), np.cos(phi)))
        expected = special.ellipkinc(phi, m) * math.pi / (2 * special.ellipk(m))
        np.testing.assert_allclose(phi - delay, expected, atol=3e-15)


@pytest.mark.parametrize("part", [0.9, 0.3, 1e-3, 1e-8])
def test_landen_finds_the_imaginary_argument(part):
    """cn(i v) = 1 / sqrt(part), that is cn(v) = sqrt(part) for the complementary parameter."""
    for m in (1e-2 * part, min(part, 1 / 3)):
        decay, _ = elliptic.landen(modulus(m, part), math.sqrt(1 - part))
        v = mpmath.ellipf(mpmath.acos(mpmath.sqrt(part)), 1 - mpmath.mpf(m))
        beta = v * mpmath.pi / (2 * mpmath.ellipk(m))
        assert part * float(decay) == pytest.approx(float(mpmath.exp(-2 * beta)), rel=1e-12)


def test_landen_has_a_limit_where_the_motion_stays_in_the_plane():
    """Nothing is lost, nor divided by zero, where part and parameter vanish together."""
    limit, _ = elliptic.landen(elliptic.Modulus(0.3, 0.0, 1.0), 1.0)
    near, _ = elliptic.landen(elliptic.Modulus(0.3, 1e-9, 1 - 3e-10), math.sqrt(1 - 1e-9))
    assert float(limit) == pytest.approx(float(near), rel=1e-8)
