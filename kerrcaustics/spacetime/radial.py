"""The radial potential of a photon: its roots, whether the ray is captured, and the Mino time to infinity.

Everything is real arithmetic with one path for every kind of root (four real, two real, none real), on NumPy
or JAX arrays of any shape.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.spacetime import elliptic
from kerrcaustics.spacetime.arrays import Flags, Reals
from kerrcaustics.spacetime.cubic import largest_root
from kerrcaustics.spacetime.frame import Frame, Photon, potential_coefficients

_SMALLEST = 1e-300
# Rounding of b, of kappa and of the formulas here, as it enters the distance of the outer roots.
_ROUNDING = 1e-15
# Rounding of the distance of the camera from the middle of the outer roots, and of the rate there, squared.
_AT_CAMERA = 1e-15
# Of N, relative to that.
_IN_DIRECTION = 4.0
# Between these values of k and kappa the potential is taken about r = 1.
_LEAST_K, _MOST_KAPPA = 2.0, 30.0
# Terms of 2 r_+ - a b below which it is their difference.
_COROTATING = 0.5


class Quartic(NamedTuple):
    """R(r) = r^4 + a2 r^2 + a1 r + a0 = [(r - h)^2 - d] [(r + h)^2 - e], h >= 0.

    The outer pair of roots, real when d > 0, is h -+ sqrt(d): only it can lie outside the horizon. lift = h - 1 keeps
    its digits where roots and horizons nearly coincide, at r = 1.
    """

    h: Reals
    d: Reals
    e: Reals
    lift: Reals


class _Resolvent(NamedTuple):
    """The cubic z (z + middle)^2 + linear z + constant, whose largest root gives the factors of the potential."""

    middle: Reals
    linear: Reals
    constant: Reals


def factor(frame: Frame, photon: Photon) -> Quartic:
    """The two real quadratic factors of the radial potential.

    With x = r - 1, R = (x^2 + 2 x + eta)^2 - kappa (x^2 - 1 + a^2), eta = 1 + a^2 - a b. All of it is small where the
    outer roots come close to the horizon of a nearly extremal hole, and its factors are then found about x = 0.

    Errors: the factors to about 1e-15; d, which vanishes at the shadow edge, to its `doubt`, and better where
    `rate_knows_roots`.
    """
    a, kappa = frame.spin, photon.kappa
    a2, a1, a0 = potential_coefficients(a, photon)
    room = (1 - a) * (1 + a)
    eta = slip(frame, photon) - room
    level = eta**2 + kappa * room
    sigma = 4 + 2 * eta - kappa
    about_one = (photon.k >= _LEAST_K) & (kappa < _MOST_KAPPA)
    about_r1 = sigma, 16 * eta - 4 * level, 16 * eta * sigma - 32 * eta**2 - 16 * kappa * room
    cubic = _Resolvent(*(jnp.where(about_one, x, r) for x, r in zip(about_r1, (a2, -4 * a0, -(a1**2)), strict=True)))
    z = _largest_root(cubic)
    near = _factors_about_one(jnp.where(about_one, z, 4.0), eta, sigma, level)
    far = _factors(jnp.where(about_one, 4.0, jnp.maximum(z, _SMALLEST)), a2, a1, a0)
    quartic = Quartic(*(jnp.where(about_one, x, r) for x, r in zip(near, far, strict=True)))
    (_, outer), above = outer_start(frame, photon, quartic), frame.radius - 1 - quartic.lift
    d = jnp.where(rate_knows_roots(frame, photon, quartic), (above - outer) * (above + outer), quartic.d)
    return quartic._replace(d=d)


def rate_knows_roots(frame: Frame, photon: Photon, quartic: Quartic) -> Flags:
    """True if the camera is so close to the outer roots that the rate there gives d better than the coefficients."""
    above = frame.radius - 1 - quartic.lift
    return _AT_CAMERA * above**2 < doubt(frame, photon, quartic)


def doubt(frame: Frame, photon: Photon, quartic: Quartic) -> Reals:
    """The uncertainty of d by rounding: the change of R by that of b and of kappa at h, over the other factor there."""
    a, lift = frame.spin, quartic.lift
    room, lost = (1 - a) * (1 + a), slip(frame, photon)
    total = lift * (lift + 2) + lost - room
    moved = 2 * jnp.abs(total) * (2 + jnp.abs(lost)) + jnp.abs(lift**2 - room) * photon.kappa
    return _ROUNDING * conditioning(frame, photon) * (moved / jnp.abs(4 * quartic.h**2 - quartic.e) + lift**2)


def conditioning(frame: Frame, photon: Photon) -> Reals:
    """The factor of rounding by the energy at infinity, deep in the field a small difference of large numbers."""
    terms = frame.lapse + jnp.abs(photon.energy_ratio - frame.lapse)
    return terms / jnp.abs(photon.energy_ratio)


def corotation(frame: Frame, photon: Photon) -> Reals:
    """2 r_+ - a b, which vanishes for photons that move with the horizon; close to it from the rates at the camera.

    These give it better than b.
    """
    lift = horizon_lift(frame.spin)
    height, delta = frame.radius - 1 - lift, (frame.root_sigma_delta / frame.root_sigma) ** 2
    # r^2 + a^2 - a b at the camera, and its excess over that at the horizon.
    total = jnp.sqrt((photon.rate[0] * frame.radius**2) ** 2 + delta * photon.kappa)
    rest = delta * (frame.radius + 1 + lift) / (height + 2 * lift)
    # The product a b alone would lose the digits that remain.
    direct = 2 * lift + ((2 - photon.b) + (1 - frame.spin) * photon.b)
    return jnp.where(total + rest < _COROTATING, total - rest, direct)


def slip(frame: Frame, photon: Photon) -> Reals:
    """2 - a b: the same for a horizon at r = 1."""
    return corotation(frame, photon) - 2 * horizon_lift(frame.spin)


def _factors_about_one(z: Reals, eta: Reals, sigma: Reals, level: Reals) -> tuple[Reals, ...]:
    """(h, d, e, h - 1), from the root of the resolvent of the potential about r = 1."""
    lift = z / 4 / (1 + jnp.sqrt(1 + z / 4))
    total = sigma + z
    inner = (total * (2 + lift) - 2 * eta) / (2 * (1 + lift))
    return 1 + lift, lift**2 - level / inner, (2 + lift) ** 2 - inner, lift


def _factors(z: Reals, a2: Reals, a1: Reals, a0: Reals) -> tuple[Reals, ...]:
    """(h, d, e, h - 1), from the root z = 4 h^2 of the resolvent of the potential about r = 0."""
    # g = a1 / sqrt(z), whose square is also (z + a2)^2 - 4 a0: a form for rays close to the principal null
    # directions, where a1 and z vanish together.
    vanishing = z < 1e-12 * (jnp.abs(a2) + jnp.sqrt(jnp.abs(a0)))
    g = jnp.where(vanishing, jnp.sqrt(jnp.maximum((z + a2) ** 2 - 4 * a0, 0)), a1 / jnp.sqrt(z))
    h = jnp.sqrt(z) / 2
    return h, -(a2 + z / 2 + g) / 2, -(a2 + z / 2 - g) / 2, h - 1


def _largest_root(cubic: _Resolvent) -> Reals:
    """The largest real root: Cardano's formula, then Newton steps.

    Only the last step, from a root that is exact already, has derivatives: they are those of the root.
    """

    def newton(z: Reals, cubic: _Resolvent) -> Reals:
        middle, linear, constant = cubic
        slope = jax.lax.stop_gradient((z + middle) * (3 * z + middle) + linear)
        value = z * (z + middle) ** 2 + linear * z + constant
        return z - jnp.where(slope == 0, 0, value / jnp.where(slope == 0, 1, slope))

    fixed = jax.lax.stop_gradient(cubic)
    z = _resolvent_start(fixed)
    for _ in range(2):
        z = newton(z, fixed)
    return newton(z, cubic)


def _resolvent_start(cubic: _Resolvent) -> Reals:
    """The root above, but for round-off.

    Where the two larger roots nearly coincide (cameras far away) the formula cannot decide if they are real: the
    value at the minimum between them can, and gives the start.
    """
    middle, linear, constant = cubic
    third = (middle**2 / 3 - linear) / 3
    half = -(-2 * middle**3 / 27 - 2 * middle * linear / 3 + constant) / 2
    pair = jnp.sqrt(jnp.maximum(third, 0))
    bottom = pair - 2 * middle / 3
    least = bottom * (bottom + middle) ** 2 + linear * bottom + constant
    of_pair = pair + jnp.sqrt(jnp.maximum(-least, 0) / jnp.where(pair == 0, 1, 3 * pair))
    paired = (half < 0) & (third > 0) & (least <= 0) & (half**2 - third**3 > -1e-8 * half**2)
    return jnp.where(paired, of_pair, largest_root(third, half, jnp)) - 2 * middle / 3


def horizon(spin: Reals) -> Reals:
    """Radius of the outer horizon, r_+, in compiled code."""
    return 1 + horizon_lift(spin)


def horizon_lift(spin: Reals) -> Reals:
    """sqrt(1 - a^2): the horizons lie at 1 +- that."""
    return jnp.sqrt((1 - spin) * (1 + spin))


def horizon_function(spin: Reals, u: Reals) -> Reals:
    """Delta / r^2 = 1 - 2 u + a^2 u^2, in factors that keep their digits close to a nearly extremal hole."""
    lift = horizon_lift(spin) * u
    return (1 - u - lift) * (1 - u + lift)


def is_captured(frame: Frame, photon: Photon, quartic: Quartic) -> Flags:
    """True if the ray, followed backward from the camera, ends at the horizon: decided by roots alone.

    A ray that starts inward comes back only from a turning point between the horizon and the camera; a ray
    that starts outward falls back from a turning point above the camera. Rays with no positive energy at
    infinity (inside the ergosphere) come from the hole. A ray within round-off of the shadow edge, which may wind for
    ever, counts as captured.

    References: JTFT A.1, extended to cameras inside the photon region.
    """
    outer_root = quartic.lift + jnp.sqrt(jnp.maximum(quartic.d, 0))
    inward = photon.rate[0] > 0
    least = doubt(frame, photon, quartic)
    # No ray is between the outer roots, so the camera is beyond both or within both: their middle decides, also
    # where the camera is within round-off of a turning point.
    beyond = frame.radius - 1 > quartic.lift
    turns_below = (quartic.d > least) & (outer_root > horizon_lift(frame.spin)) & beyond
    falls_back = (quartic.d > -least) & ~beyond
    return jnp.where(inward, ~turns_below, falls_back) | (photon.energy_ratio <= 0)


def capture_is_certain(frame: Frame, photon: Photon, quartic: Quartic) -> Flags:
    """False where round-off may decide whether the ray is captured: next to the shadow edge.

    Beside the doubt of d there is that of N, which the camera's distance magnifies.
    """
    inward, above = photon.rate[0] > 0, frame.radius - 1 - quartic.lift
    least = _doubt_with_direction(frame, photon, quartic)
    # A ray that leaves outward from above the roots escapes anyhow, one that leaves inward from below falls in.
    anyhow = (inward != (above > 0)) & (above**2 > least)
    is_determined = _ROUNDING * conditioning(frame, photon) < 1
    return (anyhow | (jnp.abs(quartic.d) > least)) & is_determined


def time_doubt(frame: Frame, photon: Photon, quartic: Quartic) -> Reals:
    """The relative uncertainty, by rounding of N too, of Mino times as long as those to infinity."""
    least = _doubt_with_direction(frame, photon, quartic)
    return _IN_DIRECTION * _ROUNDING + least / (least + jnp.abs(quartic.d))


def _doubt_with_direction(frame: Frame, photon: Photon, quartic: Quartic) -> Reals:
    magnified = 1 + frame.cylindrical_scale / jnp.sqrt(jnp.maximum(photon.k, 1e-2))
    return _IN_DIRECTION * magnified * doubt(frame, photon, quartic)


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
    h, d, e, lift = quartic
    above = r - 1 - lift
    inward = outer < 0
    span = jnp.where(inward, inner - outer, 1.0)
    root = jnp.where(inward, (4 * r * h + d - e) / span, outer + inner)
    squares = d * (r + h) ** 2 - e * above**2
    span = jnp.where(inward, inner * above - outer * (r + h), 1.0)
    product = 2 * jnp.where(inward, squares / span, outer * (r + h) + inner * above)
    reach = jnp.where(inward, d / jnp.where(inward, above - outer, 1.0), above + outer)
    return elliptic.Triple(root, 2 * jnp.sqrt(jnp.maximum((r + h + inner) * reach, 0)), product)


def mino_time_to(frame: Frame, photon: Photon, quartic: Quartic, radius: Reals, rising: Flags) -> Reals:
    """Mino time from the camera to a radius that the ray reaches, directly or through its one turning point.

    Parameters: rising: the radius grows along the ray when it arrives there.

    Errors: about 1e-15 divided by the relative distance of the outer roots from each other, and from the radius.
    References: as for `mino_time`; past a turning point the square roots are multiplied out, so that they stay
    finite where the two radii are equal.
    """
    r1, r2 = frame.radius, radius
    # R = Q1 Q2: the signed root of Q1 and the root of Q2 at both ends.
    b1, b2 = _inner(quartic, r1), _inner(quartic, r2)
    start = outer_start(frame, photon, quartic)
    a1 = start[1]
    a2 = jnp.where(rising, 1.0, -1.0) * jnp.sqrt(jnp.maximum(outer_square(quartic, start, r2), 0))
    triple, scale = carlson_arguments(quartic, (r1, b1, a1), (r2, b2, a2))
    return 2 * scale * elliptic.carlson(triple).first


def outer_start(frame: Frame, photon: Photon, quartic: Quartic) -> tuple[Reals, Reals]:
    """The camera's radius, and the root of (r - h)^2 - d there, with the sign of r'."""
    return frame.radius, -photon.rate[0] * frame.radius**2 / _inner(quartic, frame.radius)


def _inner(quartic: Quartic, r: Reals) -> Reals:
    return jnp.sqrt((r + quartic.h) ** 2 - quartic.e)


def outer_square(quartic: Quartic, start: tuple[Reals, Reals], radius: Reals) -> Reals:
    """(r - h)^2 - d at a radius; close to the start, a radius and the root of the same there, from that."""
    change, above, nearby = _from_start(quartic, start, radius)
    return jnp.where(nearby, start[1] ** 2 + change, above**2 - quartic.d)


def arrival_doubt(frame: Frame, photon: Photon, quartic: Quartic, radius: Reals) -> Reals:
    """The uncertainty, by rounding of N too, of (r - h)^2 - d at a radius: rays just reach it where that is zero."""
    start = outer_start(frame, photon, quartic)
    change, above, nearby = _from_start(quartic, start, radius)
    outer, scale = start[1], photon.energy_ratio * _inner(quartic, frame.radius)
    wobble = _ROUNDING * conditioning(frame, photon) * frame.root_sigma_delta / scale
    close_by = _ROUNDING * (jnp.abs(change) + outer**2) + (2 * jnp.abs(outer) + jnp.abs(wobble)) * jnp.abs(wobble)
    return jnp.where(nearby, close_by, _ROUNDING * above**2 + _doubt_with_direction(frame, photon, quartic))


def _from_start(quartic: Quartic, start: tuple[Reals, Reals], radius: Reals) -> tuple[Reals, Reals, Flags]:
    """The change of (r - h)^2 - d from the start to a radius; r - h there; True if the change is the better way."""
    r1, outer = start
    before, above = r1 - 1 - quartic.lift, radius - 1 - quartic.lift
    change = (radius - r1) * (before + above)
    return change, above, outer**2 + jnp.abs(change) < above**2 + jnp.abs(quartic.d)


def carlson_arguments(
    quartic: Quartic, start: tuple[Reals, Reals, Reals], end: tuple[Reals, Reals, Reals]
) -> tuple[elliptic.Triple, Reals]:
    """The arguments of an R_F, and a factor: their product is half the Mino time from one radius to another.

    Parameters: start and end, each (r, inner, outer): the radius and the roots of the two factors of R past, outer
    with the sign of r'. The two signs differ where a turning point lies between, above or below.
    """
    (r1, b1, a1), (r2, b2, a2), (h, d, e, lift) = start, end, quartic
    a, b, gap = a1 * a2, b1 * b2, r2 - r1
    s1, s2, g2 = r1 - 1 - lift, r2 - 1 - lift, (r1 + h) * (r2 + h) - e
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
    root_x, root_yz, quarter = (jnp.where(turned, past, direct) for past, direct in zip(back, straight, strict=True))
    triple = elliptic.Triple(root_x, 2 * jnp.sqrt(jnp.maximum(quarter, 0)), root_yz)
    return triple, jnp.where(turned, 1, jnp.abs(gap))
