"""Rays of small k = q + b^2, which leave outward close to a principal null direction: vortical ones (q < 0) too.

Their way is short, without a turning point and less than a quarter of a polar oscillation, so that both motions are
written with their origin at an end of the way, where no roots of the potentials are needed and the sign of q does not
matter.

Radial motion. With t the Mino time to infinity and wp the function of Weierstrass that has the invariants of R,
wp(t) = a2 / 12 + (r^2 + sqrt(R)) / 2. The integral I(r_h) of radial_motion.py has two poles, at which p = wp(t) - wp(v)
is p_1, p_2 = (r^2 - r_h^2 + sqrt(R) +- (2 r_h - a b)) / 2:

    I(r_h) = ln(p_1 / p_2) / 2 + [gamma_1 R_J(p_1) - gamma_2 R_J(p_2)] / 3,    gamma = wp'(v) / 2.

The coordinate time takes the integral of r, whose other pole is at wp(v) = -a2 / 6, and of r^2 = wp(t) + wp(t - v) -
a2 / 6, up to a large radius X:

    integral of r = ln X - ln(p) / 2 - gamma R_J(p) / 3,    integral of r^2 = X + r - 2 zeta(t) - a2 t / 6.

Of a way on which 1/r hardly changes, between two spheres or far from the hole, all this is a small difference of large
terms: its integrals are taken by Gauss' formula.

Polar motion. S is the solution of S'^2 = 1 + A S^2 - B S^4 with S(0) = 0, A = a^2 - k and B = a^2 q: the motion of a
camera in the equator, but for a factor. By the addition theorem, with z = m_z, m at the end is

    z = (z_0 S' + z_0' S) / (1 + a^2 z_0^2 S^2),
    m_x + i m_y = e^(-i b Pi) [(m_x + i m_y)_0 (1 - S z z_0') + (m_x + i m_y)_0' S z_0 z] / sqrt(1 - q S^2),

where Pi is the integral of d tau / (1 - q S^2).

References: Whittaker & Watson 20.3 to 20.6; DLMF 19.16, 19.25, 23.10.
"""

import jax
import jax.numpy as jnp
import numpy as np

from kerrcaustics.beams.closed_form.polar_motion import Polar
from kerrcaustics.beams.closed_form.radial_motion import RadialIntegrals, Travel
from kerrcaustics.beams.traced_ends import Spherical
from kerrcaustics.spacetime import elliptic, radial
from kerrcaustics.spacetime.arrays import Flags, Reals
from kerrcaustics.spacetime.cubic import largest_root
from kerrcaustics.spacetime.frame import Frame, Photon, potential_coefficients

# The series of S is exact to round-off for a Mino time of 1.2 after so many halvings.
_HALVINGS = 5
# The arguments of the integrals do not differ much.
_DUPLICATIONS = 5
# Gauss' formula is exact to round-off for ways shorter than this in 1/r, and than their distance from the horizon.
_SHORT_WAY = 0.2
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(14)


# A radius, its height over the outer horizon, and sqrt(R) there.
_Outward = tuple[Reals, Reals, Reals]


def radial_motion(frame: Frame, photon: Photon, end: Spherical, *, with_time: bool = False) -> Travel:
    """The radial motion of rays that start outward and are not captured, as in radial_motion.py."""
    spin, root = frame.spin, radial.horizon_lift(frame.spin)
    way = _long_way(frame, photon, end, with_time=with_time)
    turn = (way.plus - way.minus) / (2 * root)
    brief = is_brief(frame, end)
    time, psi, slow, growing = _brief_way(frame, photon, end)
    time, psi = jnp.where(brief, time, way.time), jnp.where(brief, psi, -spin * turn)
    clock = None
    if way.growing is not None:
        slow = jnp.where(brief, slow, 4 * way.time + 2 * turn + way.plus + way.minus)
        clock = slow + (jnp.where(brief, growing, way.growing) if end.finite else way.growing)
        clock = clock + jnp.where(frame.start == 0, -(frame.radius + 2 * jnp.log(frame.radius)), 0.0)
    return Travel(time, psi, jnp.zeros_like(photon.b, bool), clock, u=1 / end.radius + 0 * photon.b)


def _long_way(frame: Frame, photon: Photon, end: Spherical, *, with_time: bool) -> RadialIntegrals:
    """The integrals to the end; to a sphere as a difference of two ways to infinity."""
    spin, r, root = frame.spin, frame.radius, radial.horizon_lift(frame.spin)
    cubic = _outlying_root(spin, photon)
    way = _to_infinity(spin, photon, cubic, (r, _height(frame), -photon.rate[0] * r**2), with_time=with_time)
    if not end.finite:
        return way
    far = end.radius
    beyond = far - 1 - root
    square = (far**2 + spin**2 - spin * photon.b) ** 2 - beyond * (far - 1 + root) * photon.kappa
    rest = _to_infinity(spin, photon, cubic, (far, beyond, jnp.sqrt(square)), with_time=with_time)
    return jax.tree.map(lambda whole, part: whole - part, way, rest)


def _height(frame: Frame) -> Reals:
    """The camera's height over the outer horizon: exact next to it, where the rounding of its radius would not be."""
    return (frame.root_sigma_delta / frame.root_sigma) ** 2 / (frame.radius - 1 + radial.horizon_lift(frame.spin))


def is_brief(frame: Frame, end: Spherical) -> Flags:
    """True if the way is short enough for Gauss' formula."""
    span, room = _span(frame, end)
    return (span < _SHORT_WAY) & (span < room)


def _span(frame: Frame, end: Spherical) -> tuple[Reals, Reals]:
    """The length of the way in 1/r, and the distance of the camera from the horizon in it."""
    r = frame.radius
    span = (end.radius - r) / (r * end.radius) if end.finite else 1 / r
    return span, _height(frame) / (r * radial.horizon(frame.spin))


def _brief_way(frame: Frame, photon: Photon, end: Spherical) -> tuple[Reals, ...]:
    """Mino time, psi, the clock without r^2 + 2 r, and the integral of r^2 + 2 r to a sphere, by Gauss' formula."""
    a, b, r, horizon = frame.spin, photon.b, frame.radius, radial.horizon(frame.spin)
    span, room = _span(frame, end)
    shape = -1, *(1,) * b.ndim
    passed = span * (1 + _NODES.reshape(shape)) / 2
    u = 1 / r - passed
    # Delta / r^2 and R / r^4.
    away = horizon * (room + passed)
    delta = away * (away + 2 * radial.horizon_lift(a) * u)
    total = 1 + a * (a - b) * u * u
    root = jnp.sqrt(total**2 - delta * photon.kappa * u * u)
    time = span / 2 * _WEIGHTS.reshape(shape)
    # That of psi's rate which grows without bound next to the horizon does not depend on the ray.
    psi = (1 - photon.kappa * u * u / (total + root)) / root - 1 / delta
    # Of a ray with R = r^4 the last is known: far out, where it grows without bound, the others differ little from it.
    bent = (photon.kappa * delta - a * (a - b) * (1 + total)) / (root * (1 + root))
    clock = 2 * (2 - a * b * u) / (delta * root), (1 + 2 * u) * bent
    *integrals, growing = ((rate * time).sum(0) for rate in (1 / root, a * psi, *clock))
    gap = end.radius - r if end.finite else 0.0
    return *integrals, growing + gap + 2 * jnp.log1p(gap / r)


def _outlying_root(spin: Reals, photon: Photon) -> tuple[Reals, Reals]:
    """The root e of 4 e^3 - g2 e - g3 that is farthest from the other two, and the slope 3 e^2 - g2 / 4 there.

    It varies smoothly.
    """
    a2, a1, a0 = potential_coefficients(spin, photon)
    third = (a0 + a2**2 / 12) / 12
    half = (a0 * a2 / 6 - a1**2 / 16 - a2**3 / 216) / 8

    def newton(e: Reals, third: Reals, half: Reals) -> Reals:
        slope = jax.lax.stop_gradient(3 * (e * e - third))
        value = e * (e * e - 3 * third) - 2 * half
        return e - jnp.where(slope == 0, 0, value / jnp.where(slope == 0, 1, slope))

    fixed = jax.lax.stop_gradient((third, half))
    far = jnp.where(fixed[1] < 0, -1.0, 1.0) * largest_root(fixed[0], jnp.abs(fixed[1]), jnp)
    e = newton(newton(far, *fixed), *fixed)
    e = newton(e, third, half)
    return e, 3 * (e * e - third)


def _to_infinity(
    spin: Reals, photon: Photon, cubic: tuple[Reals, Reals], place: _Outward, *, with_time: bool
) -> RadialIntegrals:
    """The integrals from a place to infinity; arguments of Carlson's integrals are 4 (wp - e)."""
    (e, slope), (r, _, rate), kappa = cubic, place, photon.kappa
    a2 = potential_coefficients(spin, photon)[0]
    weight = 2 * (r * r + rate)
    x = weight + a2 / 3 - 4 * e
    root = jnp.sqrt(x)
    # From wp' = -2 sqrt(x y z).
    product = 4 * (r * (r * r + rate) + (a2 * r + kappa) / 2) / root
    triple = elliptic.Triple(root, jnp.sqrt(2 * weight + 2 / 3 * a2 + 4 * e + 2 * product), product)
    pole, log = _horizon_poles(spin, photon, place)
    poles = [pole]
    if with_time:
        poles.append(elliptic.Pole(weight + a2, 2 * kappa))
    kinds = elliptic.carlson(triple, poles, second=with_time, duplications=_DUPLICATIONS)
    time = 2 * kinds.first
    both = jnp.asarray(kinds.thirds[0])
    plus, minus = log + (both[0] - both[1]) / 3
    growing = None
    if with_time:
        zeta = product / (2 * root) - e * time - 8 / 3 * slope * kinds.second
        growing = r - 2 * zeta - a2 / 6 * time - jnp.log((weight + a2) / 4) - 2 / 3 * kinds.thirds[1]
    return RadialIntegrals(time, plus, minus, growing)


def _horizon_poles(spin: Reals, photon: Photon, place: _Outward) -> tuple[elliptic.Pole, Reals]:
    """The poles (p_1, p_2) of (I(r_+), I(r_-)) in one array, with p times 4, and their logarithms."""
    (r, height, rate), b, kappa = place, photon.b, photon.kappa
    root = radial.horizon_lift(spin)
    both = (1 + root, spin**2 / (1 + root)), (2 * root, -2 * root), (height, height + 2 * root)
    horizon, gap, above = (_of_both_horizons(*parts, b.ndim) for parts in both)
    rest, total = 2 * horizon - spin * b, r + horizon
    # p_1 p_2 over r - r_h: next to the outer horizon one of them would cancel.
    product = total * (above * total + 2 * rate + r**2 + horizon**2 + 2 * spin * (spin - b)) - above[::-1] * kappa
    larger = 2 * (above * total + rate + jnp.abs(rest))
    smaller = 4 * above * product / larger
    first, second = jnp.where(rest < 0, smaller, larger), jnp.where(rest < 0, larger, smaller)
    pull = gap * kappa
    pole = elliptic.Pole(jnp.stack([first, second]), jnp.stack([pull, pull - 8 * horizon * rest]))
    return pole, jnp.log(first / second) / 2


def _of_both_horizons(outer: Reals, inner: Reals, axes: int) -> jax.Array:
    """Two values in one array, for rays with so many axes: the values are those of all rays, or of each."""
    values = jnp.stack([outer, inner])
    return values.reshape(2, *(1,) * (axes + 1 - values.ndim), *values.shape[1:])


def polar_motion(frame: Frame, photon: Photon, time: Reals, *, with_time: bool = False) -> Polar:
    """The polar motion over a short Mino time, from the camera, as in polar_motion.py."""
    b, q, k, spin2 = photon.b, photon.q, photon.k, frame.spin**2
    _, s0, _, z0 = photon.position
    _, x_rate, y_rate, z_rate = photon.rate
    linear, cubic = spin2 - k, spin2 * q
    s = _odd_solution(linear, cubic, time)
    s2 = s * s
    slope = jnp.sqrt(1 + (linear - cubic * s2) * s2)
    z = (z0 * slope + z_rate * s) / (1 + spin2 * z0**2 * s2)
    p = 1 - q * s2
    triple = elliptic.Triple(jnp.ones_like(s), jnp.sqrt(2 + linear * s2 + 2 * slope), slope)
    pole = elliptic.Pole(p, q * b * s2 * s, circular=True)
    kinds = elliptic.carlson(triple, [pole], second=with_time, duplications=_DUPLICATIONS)
    turn = -b * time - kinds.thirds[0] / 3
    along = s0 * (1 - s * z * z_rate) + x_rate * s * z0 * z
    across = y_rate * s * z0 * z
    scale = 1 / jnp.sqrt(p)
    slow = spin2 * (q * s2 * s / 3 * kinds.second + s * z0 * z) if with_time else None
    return Polar(
        x=scale * along,
        y=scale * across,
        z=z,
        turn=turn,
        azimuth=turn + jnp.arctan2(across, along),
        phase=jnp.sqrt(jnp.maximum(k, 0)) * time,
        crossings=jnp.where(z0 * z < 0, 1.0, 0.0),
        leaving=-z0 * z,
        clock=slow,
    )


def _odd_solution(linear: Reals, cubic: Reals, time: Reals) -> Reals:
    """S with S'^2 = 1 + linear S^2 - cubic S^4: its series at a part of the time, and doublings (DLMF 22.6, 22.10)."""
    t = time / 2**_HALVINGS
    square = linear * linear
    series = (
        1.0,
        linear / 6,
        (square - 12 * cubic) / 120,
        linear * (square - 132 * cubic) / 5040,
        (square * (square - 1224 * cubic) + 3024 * cubic**2) / 362880,
    )
    s = 0.0
    for term in reversed(series):
        s = s * t * t + term
    s = s * t
    for _ in range(_HALVINGS):
        s2 = s * s
        slope = jnp.sqrt(1 + (linear - cubic * s2) * s2)
        s = 2 * s * slope / (1 + cubic * s2 * s2)
    return s
