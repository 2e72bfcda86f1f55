"""Elliptic integrals and functions for JAX arrays: real arithmetic, fixed numbers of steps, no physics.

Carlson's integrals take their arguments y, z as sqrt(y) + sqrt(z) and sqrt(y z), so that a complex pair is no
special case. The functions of Jacobi come from theta series: for a parameter m of one half or less, the largest that
is needed here, four terms are exact to round-off.

References: Carlson 1995 (Numer. Algorithms 10, 13); DLMF 19.16, 19.26, 19.36, 20.2, 22.2, 22.7.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.spacetime.arrays import Reals

# Terms of atanh(e) / e that are exact to round-off after so many duplications: 0 stands for the logarithm itself.
_ATANH_TERMS = (0, 0, 10, 5, 3, 2, 2)
# Steps of duplication; each brings the arguments closer together by a factor of 4.
_DUPLICATIONS = len(_ATANH_TERMS)
_LANDEN_STEPS = 4


class Triple(NamedTuple):
    """The arguments x, y, z of Carlson's integrals: sqrt(x), sqrt(y) + sqrt(z), sqrt(y z).

    sqrt(y z) may be negative: the integral then goes beyond half a period.
    """

    root: Reals
    root_sum: Reals
    root_product: Reals


class Pole(NamedTuple):
    """The fourth argument p of R_J, with gamma = +-sqrt(-(p - x) (p - y) (p - z)), which must be real.

    In the circular case that root is imaginary, and gamma is it divided by i: +-sqrt((p - x) (p - y) (p - z)).
    """

    p: Reals
    gamma: Reals
    circular: bool = False


class Integrals(NamedTuple):
    """R_F(x, y, z), gamma R_J(x, y, z, p) for every pole, and R_D(y, z, x), 0 if it was not requested."""

    first: Reals
    thirds: Sequence[Reals]
    second: Reals


def carlson(
    triple: Triple, poles: Sequence[Pole] = (), *, second: bool = False, duplications: int = _DUPLICATIONS
) -> Integrals:
    """Carlson's integrals of the first, the third and, if requested, the second kind.

    Errors: relative 1e-15 for arguments whose ratios are below 1e8 or so; with 5 duplications, for those below 100.
    References: Carlson 1995; DLMF 19.26.18 to 19.26.21, 19.36.1, 19.36.2.
    """
    levels = _duplicated(triple, duplications)
    powers = [pole.p for pole in poles]
    sums: list[Reals] = [0.0 for _ in poles]
    seconds: Reals = 0.0
    for n, (root, root_sum, root_product) in enumerate(levels[:-1]):
        shift = root * root_sum + root_product
        for i, pole in enumerate(poles):
            p = powers[i]
            root_p = jnp.sqrt(p)
            d = (root_p + root) * (p + root_p * root_sum + root_product)
            if pole.circular:
                term = 6 * 2**n * jnp.arctan(pole.gamma / 8**n / d)
            else:
                term = _duplication_term(n, d, pole.gamma / 8**n, 2 * d * root_p * (p + shift))
            sums[i] = sums[i] + term
            powers[i] = (p + shift) / 4
        if second:
            seconds = seconds + 3 / 4**n / (root * (root**2 + shift))
    last = levels[-1]
    scale = 4.0**-duplications
    thirds = [s + scale * pole.gamma * _third_tail(last, p) for s, pole, p in zip(sums, poles, powers, strict=True)]
    if second:
        seconds = seconds + scale * _third_tail(last, last.root**2)
    return Integrals(_first_tail(last), thirds, seconds)


def first_slopes(triple: Triple) -> tuple[Reals, Triple]:
    """R_F and its derivatives by the three arguments: all of one sign, from sums of one sign.

    Errors: relative 1e-15.
    """
    levels = _duplicated(triple, _DUPLICATIONS)
    first, pull = jax.vjp(_first_tail, levels[-1])
    (slopes,) = pull(jnp.ones_like(first))
    for (root, root_sum, _), (half, following, _) in zip(reversed(levels[:-1]), reversed(levels[1:]), strict=True):
        # The changes of the next level's arguments have the divisors 8 half and 8 following.
        inverse = 0.125 / (half * following)
        by_sum = slopes.root_sum * half * inverse
        by_half = slopes.root + root_sum * (slopes.root_product / 2 + 4 * by_sum)
        by_square = by_half * following * inverse
        slopes = Triple(
            2 * root_sum * by_sum + (2 * root + root_sum) * by_square,
            2 * (root_sum + root + 2 * half) * by_sum + half / 2 * slopes.root_product + root * by_square,
            by_square,
        )
    return first, slopes


def _duplicated(triple: Triple, times: int) -> list[Triple]:
    """The arguments, and those after each of so many duplications, for the same R_F (DLMF 19.26.18)."""
    levels = [triple]
    for _ in range(times):
        root, root_sum, root_product = levels[-1]
        half = jnp.sqrt(root * root + (root * root_sum + root_product)) / 2
        following = jnp.sqrt(root_sum * (root_sum + 2 * root + 4 * half)) / 2
        levels.append(Triple(half, following, root_sum * half / 2))
    return levels


def log_ratio(s: Reals, k: Reals, product: Reals) -> Reals:
    """ln((s + k) / (s - k)) for s > |k|, with (s + k) (s - k) = product known without cancellation."""
    sign = jnp.where(k < 0, -1.0, 1.0)
    return sign * jnp.log((s + sign * k) ** 2 / product)


def _duplication_term(n: int, d: Reals, gamma: Reals, product: Reals) -> Reals:
    """4^-n (6 / d) gamma_0 R_C(1, 1 - (gamma / d)^2) with gamma_0 = 8^n gamma, and d^2 - gamma^2 = product."""
    if _ATANH_TERMS[n] == 0:
        return 3 * 2**n * log_ratio(d, gamma, product)
    ratio = gamma / d
    square = ratio * ratio
    series = 0.0
    for j in reversed(range(_ATANH_TERMS[n])):
        series = series * square + 1 / (2 * j + 1)
    return 6 * 2**n * ratio * series


def _squares(triple: Triple) -> tuple[Reals, Reals, Reals]:
    """x, y + z and y z."""
    return triple.root**2, triple.root_sum**2 - 2 * triple.root_product, triple.root_product**2


def _first_tail(triple: Triple) -> Reals:
    """R_F of nearly equal arguments (DLMF 19.36.1)."""
    x, total, product = _squares(triple)
    mean = (x + total) / 3
    dx = 1 - x / mean
    pair = 1 - total / mean + product / mean**2
    e2, e3 = pair - dx**2, dx * pair
    return (1 - e2 / 10 + e3 / 14 + e2**2 / 24 - 3 * e2 * e3 / 44) / jnp.sqrt(mean)


def _third_tail(triple: Triple, p: Reals) -> Reals:
    """R_J of nearly equal arguments (DLMF 19.36.2)."""
    x, total, product = _squares(triple)
    mean = (x + total + 2 * p) / 5
    inverse = 1 / mean
    dx, dp = 1 - x * inverse, 1 - p * inverse
    pair_sum = 2 - total * inverse
    pair = 1 - total * inverse + product * inverse**2
    e2 = dx * pair_sum + pair - 3 * dp**2
    e3 = dx * pair + 2 * e2 * dp + 4 * dp**3
    e4 = (2 * dx * pair + e2 * dp + 3 * dp**3) * dp
    e5 = dx * pair * dp**2
    series = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2**2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26
    return series * inverse * jnp.sqrt(inverse)


class Modulus(NamedTuple):
    """A parameter m = slope * part, 0 <= m <= 1/2, slope <= 1 or so, 0 <= part <= 1, and its complement 1 - m.

    Nomes and amplitudes are given divided by `part`, so that no digits and no derivative are lost where it vanishes.
    """

    slope: Reals
    part: Reals
    complement: Reals


def nome_slope(modulus: Modulus) -> Reals:
    """The nome exp(-pi K' / K), divided by `part` (DLMF 22.2.1, 20.9)."""
    k = jnp.sqrt(modulus.complement)
    slope = modulus.slope / (2 * (1 + k) * (1 + jnp.sqrt(k)) ** 2)
    fourth = (slope * modulus.part) ** 4
    return slope * (1 + fourth * (2 + fourth * (15 + 150 * fourth)))


def landen(modulus: Modulus, tangent: Reals, amplitude: tuple[Reals, Reals] | None = None) -> tuple[Reals, Reals]:
    """Two arguments of elliptic functions in units of 2 K / pi, by descending Landen transformations (DLMF 22.7).

    Parameters: tangent, t = sqrt(1 - part) >= 0, where part is that of the modulus; amplitude, (sine, cosine).
    Returns exp(-2 beta) / part, where sc(i beta) = i t / sqrt(part); and the difference between the amplitude and the
    argument that has it (0 by default).
    """
    slope, part, complement = modulus
    t, power, delay = tangent, 0.5, 0.0
    decay = 1 / (1 + t) ** 2
    sine, cosine = amplitude or (0.0, 1.0)
    for _ in range(_LANDEN_STEPS):
        k = jnp.sqrt(complement)
        mixed = slope + complement
        decay = decay * (mixed * ((1 + t) / (1 + k * t)) ** 2) ** power
        if amplitude is not None:
            even = cosine**2 + k * sine**2
            delay = delay + power * jnp.arctan(slope * part / (1 + k) * sine * cosine / even)
            length = jnp.sqrt(cosine**2 + complement * sine**2)
            sine, cosine = (1 + k) * sine * cosine / length, (cosine**2 - k * sine**2) / length
        denominator = 1 + k * t * t
        t = t * (1 + k) / denominator
        slope, part = (slope * denominator) ** 2 / ((1 + k) ** 4 * mixed), part * part * mixed / denominator**2
        complement = 1 - slope * part
        power /= 2
    return decay, delay


def theta3(nome: Reals) -> Reals:
    """theta_3(0), the square root of 2 K / pi (DLMF 20.2.3), for a nome below 0.05."""
    return 1 + 2 * (nome + nome**4 + nome**9)


def sd(nome: Reals, theta3_z: Reals, sine1: Reals, sine3: Reals, sine5: Reals) -> Reals:
    """The function sd = sn / dn at the phase z, from theta_3(z) and the sines of z, 3 z, 5 z (DLMF 22.2, 20.2)."""
    n2, n4 = nome**2, nome**4
    theta1 = sine1 - n2 * sine3 + n4 * n2 * sine5
    theta2, theta4 = 1 + n2 + n4 * n2, 1 - 2 * (nome - n4)
    return theta3(nome) ** 2 / (theta2 * theta4) * theta1 / theta3_z
