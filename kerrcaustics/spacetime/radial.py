"""The radial potential of a photon: its roots, whether the ray is captured, and the Mino time to infinity.

Everything is real arithmetic with one path for every kind of root (four real, two real, none real), on NumPy
or JAX arrays of any shape.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.spacetime import elliptic
from kerrcaustics.spacetime.arrays import Flags, Reals
from kerrcaustics.spacetime.camera import Frame, Photon
from kerrcaustics.spacetime.cubic import largest_root

_SMALLEST = 1e-300
# Relative distance (squared) of the outer roots below which double precision does not know their sign.
_UNDECIDED = 2e-15
# Round-off of N, as it enters that.
_IN_DIRECTION = 2e-15


class Quartic(NamedTuple):
    """R(r) = r^4 + a2 r^2 + a1 r + a0 = [(r - h)^2 - d] [(r + h)^2 - e], h >= 0.

    The outer pair of roots, real when d > 0, is h -+ sqrt(d): only it can lie outside the horizon.
    """

    h: Reals
    d: Reals
    e: Reals


def potential_coefficients(spin: Reals, photon: Photon) -> tuple[Reals, Reals, Reals]:
    """(a2, a1, a0) of R(r) = r^4 + a2 r^2 + a1 r + a0 (JTFT A.1 with E = 1)."""
    return spin**2 - photon.k, 2 * photon.kappa, -(spin**2) * photon.q


def factor(a2: Reals, a1: Reals, a0: Reals) -> Quartic:
    """The two real quadratic factors of the radial potential.

    z = 4 h^2 is the largest root of the resolvent z (z + a2)^2 - 4 a0 z - a1^2.

    Errors: the factors to about 1e-15; d, which vanishes at the shadow edge, to 1e-15 of h^2.
    """
    z = jnp.maximum(_largest_resolvent_root(a2, a1, a0), _SMALLEST)
    # g = a1 / sqrt(z), whose square is also (z + a2)^2 - 4 a0: a form for rays close to the principal null
    # directions, where a1 and z vanish together.
    vanishing = z < 1e-12 * (jnp.abs(a2) + jnp.sqrt(jnp.abs(a0)))
    g = jnp.where(vanishing, jnp.sqrt(jnp.maximum((z + a2) ** 2 - 4 * a0, 0)), a1 / jnp.sqrt(z))
    h = jnp.sqrt(z) / 2
    return Quartic(h=h, d=-(a2 + z / 2 + g) / 2, e=-(a2 + z / 2 - g) / 2)


def _largest_resolvent_root(a2: Reals, a1: Reals, a0: Reals) -> Reals:
    """The largest real root of z (z + a2)^2 - 4 a0 z - a1^2: Cardano's formula, then Newton steps.

    Only the last step, from a root that is exact already, has derivatives: they are those of the root.
    """

    def newton(z: Reals, a2: Reals, a1: Reals, a0: Reals) -> Reals:
        slope = jax.lax.stop_gradient((z + a2) * (3 * z + a2) - 4 * a0)
        value = z * (z + a2) ** 2 - 4 * a0 * z - a1**2
        return z - jnp.where(slope == 0, 0, value / jnp.where(slope == 0, 1, slope))

    fixed = jax.lax.stop_gradient((a2, a1, a0))
    z = _resolvent_start(*fixed)
    for _ in range(2):
        z = newton(z, *fixed)
    return newton(z, a2, a1, a0)


def _resolvent_start(a2: Reals, a1: Reals, a0: Reals) -> Reals:
    """The root above, but for round-off.

    Where the two larger roots nearly coincide (cameras far away) the formula cannot tell whether they are real: the
    value at the minimum between them can, and gives the start.
    """
    third = (a2**2 / 3 + 4 * a0) / 3
    half = -(-2 * a2**3 / 27 + 8 * a2 * a0 / 3 - a1**2) / 2
    middle = jnp.sqrt(jnp.maximum(third, 0))
    bottom = middle - 2 * a2 / 3
    least = bottom * (bottom + a2) ** 2 - 4 * a0 * bottom - a1**2
    of_pair = middle + jnp.sqrt(jnp.maximum(-least, 0) / jnp.where(middle == 0, 1, 3 * middle))
    paired = (half < 0) & (third > 0) & (least <= 0) & (half**2 - third**3 > -1e-8 * half**2)
    return jnp.where(paired, of_pair, largest_root(third, half, jnp)) - 2 * a2 / 3


def horizon(spin: Reals) -> Reals:
    """Radius of the outer horizon, r_+, in compiled code."""
    return 1 + jnp.sqrt((1 - spin) * (1 + spin))


def horizon_function(spin: Reals, u: Reals) -> Reals:
    """Delta / r^2 = 1 - 2 u + a^2 u^2, in factors that keep their digits close to a nearly extremal hole."""
    outer = horizon(spin)
    return (1 - outer * u) * (1 - spin**2 / outer * u)


def is_captured(frame: Frame, photon: Photon, quartic: Quartic) -> Flags:
    """True where the ray, followed backward from the camera, ends at the horizon: decided by roots alone.

    A ray that starts inward comes back only from a turning point between the horizon and the camera; a ray
    that starts outward falls back from a turning point above the camera. Rays with no positive energy at
    infinity (inside the ergosphere) come from the hole. A ray that cannot be told from one that winds for ever,
    within round-off of the shadow edge, counts as captured.

    References: JTFT A.1, extended to cameras inside the photon region.
    """
    outer_root = quartic.h + jnp.sqrt(jnp.maximum(quartic.d, 0))
    inward = photon.rate[0] > 0
    least = _UNDECIDED * quartic.h**2
    # No ray is between the outer roots, so the camera is beyond both or within both: their middle tells which, also
    # where the camera is within round-off of a turning point.
    beyond = frame.radius > quartic.h
    turns_below = (quartic.d > least) & (outer_root > horizon(frame.spin)) & beyond
    falls_back = (quartic.d > -least) & ~beyond
    return jnp.where(inward, ~turns_below, falls_back) | (photon.energy_ratio <= 0)


def capture_is_certain(frame: Frame, photon: Photon, quartic: Quartic) -> Flags:
    """False where round-off in N decides whether the ray is captured: next to the shadow edge.

    Next to it d is as uncertain as the square of the impact parameter, which N magnifies by the camera's distance.
    """
    magnified = 4 + frame.cylindrical_scale / jnp.sqrt(jnp.maximum(photon.k, 1e-2))
    energies = (frame.lapse + jnp.abs(photon.energy_ratio - frame.lapse)) / jnp.abs(photon.energy_ratio)
    return jnp.abs(quartic.d) > _IN_DIRECTION * magnified * energies * quartic.h**2


def mino_time(frame: Frame, photon: Photon, quartic: Quartic) -> Reals:
    """Mino time of an escaping ray from the camera to infinity, through its turning point where it has one.

    Errors: about 1e-15 divided by the relative distance of the outer roots from each other.
    References: as for `to_infinity`.
    """
    r = frame.radius
    inner = jnp.sqrt((r + quartic.h) ** 2 - quartic.e)
    outer = -photon.rate[0] * r**2 / inner
    return 2 * elliptic.carlson(to_infinity(quartic, r, inner, outer)).first


def to_infinity(quartic: Quartic, r: Reals, inner: Reals, outer: Reals) -> elliptic.Triple:
    """The arguments of the R_F that is half the Mino time from r to infinity.

    Parameters: inner and outer, the roots of the two factors of R at r, outer with the sign of r': where that is
    negative, the way leads through the turning point. Sums that cancel then are written as quotients. The arguments
    are real with a complex pair of roots too; sqrt(y z) < 0 stands for a path beyond half a period.

    References: Carlson 1995 (Numer. Algorithms 10, 13); DLMF 19.29.4 to 19.29.6.
    """
    h, d, e = quartic
    inward = outer < 0
    span = jnp.where(inward, inner - outer, 1.0)
    root = jnp.where(inward, (4 * r * h + d - e) / span, outer + inner)
    squares = 2 * r * h * (e + d) - (e - d) * (r * r + h * h)
    span = jnp.where(inward, inner * (r - h) - outer * (r + h), 1.0)
    product = 2 * jnp.where(inward, squares / span, outer * (r + h) + inner * (r - h))
    reach = jnp.where(inward, d / jnp.where(inward, r - h - outer, 1.0), r - h + outer)
    return elliptic.Triple(root, 2 * jnp.sqrt(jnp.maximum((r + h + inner) * reach, 0)), product)


def mino_time_to(frame: Frame, photon: Photon, quartic: Quartic, radius: Reals, rising: Flags) -> Reals:
    """Mino time from the camera to a radius that the ray reaches, directly or through its one turning point.

    Parameters: rising, whether the radius grows along the ray when it arrives there.

    Errors: about 1e-15 divided by the relative distance of the outer roots from each other, and from the radius.
    References: as for `mino_time`; past a turning point the square roots are multiplied out, so that they stay
    finite where the two radii are equal.
    """
    r1, r2, (h, d, e) = frame.radius, radius, quartic
    # R = Q1 Q2: the signed root of Q1 and the root of Q2 at both ends.
    b1, b2 = jnp.sqrt((r1 + h) ** 2 - e), jnp.sqrt((r2 + h) ** 2 - e)
    a1 = -photon.rate[0] * r1**2 / b1
    a2 = jnp.where(rising, 1.0, -1.0) * jnp.sqrt(jnp.maximum((r2 - h) ** 2 - d, 0))
    triple, scale = between(quartic, (r1, b1, a1), (r2, b2, a2))
    return 2 * scale * elliptic.carlson(triple).first


def between(
    quartic: Quartic, start: tuple[Reals, Reals, Reals], end: tuple[Reals, Reals, Reals]
) -> tuple[elliptic.Triple, Reals]:
    """The arguments of an R_F, and a factor: their product is half the Mino time from one radius to another.

    Parameters: start and end, each (r, inner, outer): the radius and the roots of the two factors of R there, outer
    with the sign of r'. The two signs differ where a turning point lies between, above or below.
    """
    (r1, b1, a1), (r2, b2, a2), (h, d, e) = start, end, quartic
    a, b, gap = a1 * a2, b1 * b2, r2 - r1
    s1, s2, g2 = r1 - h, r2 - h, (r1 + h) * (r2 + h) - e
    turned, real = a < 0, d > 0
    # s1 s2 - d, of which little is left where both radii are close to one turning point.
    g1 = jnp.where(real, (d * (a1 * a1 + a2 * a2) + a * a) / jnp.where(real, s1 * s2 + d, 1), s1 * s2 - d)
    # Straight on, all three are multiplied by the gap. a + g1 is d gap^2 / (g1 - a): one of them does not cancel.
    reach = jnp.where(g1 >= 0, a + g1, d * gap**2 / jnp.where(g1 >= 0, 1, g1 - a))
    straight = (jnp.abs(a1 * b2 + a2 * b1), 2 * (a * g2 + b * g1), (b + g2) * reach)
    # The difference of the squares of a1 b2 and a2 b1 over the gap, a sum that does not cancel above the outer roots.
    cross = -4 * h * (s1 * s2 + d) - (4 * h * h - e + d) * (s1 + s2)
    safe = jnp.where(turned, b * g1 - a * g2, 1)
    back = (
        cross / jnp.where(turned, a1 * b2 - a2 * b1, 1),
        2 * (d * b * b - e * a * a) / safe,
        (b + g2) * d / jnp.where(turned, g1 - a, 1),
    )
    root_x, root_yz, quarter = (jnp.where(turned, there, here) for there, here in zip(back, straight, strict=True))
    triple = elliptic.Triple(root_x, 2 * jnp.sqrt(jnp.maximum(quarter, 0)), root_yz)
    return triple, jnp.where(turned, 1, jnp.abs(gap))
