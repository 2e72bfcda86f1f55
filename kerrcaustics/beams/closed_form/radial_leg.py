"""The radial integrals between two finite radii: Mino time, the two parts of psi, and the clock.

The same Carlson integrals as on the way to infinity (radial_motion.py), with both limits finite: DLMF 19.29.4 to
19.29.8. All arguments of a straight way are multiplied by the difference of the radii, which they do not outlive: the
integrals of the third kind do not change, and nothing is infinite where the radii meet. A way with a turning point,
from below or from above, has its sums that cancel written as quotients. So rays that fall back, or have no way to
infinity, are no exception, and nothing is a difference of two long ways.
"""

import jax.numpy as jnp

from kerrcaustics.beams.closed_form.radial_motion import RadialIntegrals, RadialPlace, RadialRoots, horizons
from kerrcaustics.spacetime import elliptic, radial
from kerrcaustics.spacetime.arrays import Reals


def mino_time(roots: RadialRoots, start: RadialPlace, end: RadialPlace) -> Reals:
    """Mino time from one place to another, with at most one turning point between."""
    triple, scale = _triple(roots, start, end)
    return 2 * scale * elliptic.carlson(triple).first


def integrals(
    spin: Reals, roots: RadialRoots, start: RadialPlace, end: RadialPlace, *, with_time: bool
) -> RadialIntegrals:
    """Mino time, I(r_+), I(r_-), and if requested the integral of r^2 + 2 r, from one place to another.

    The last is without r + 2 ln r of the first place, as on the way to infinity.
    """
    low, following = roots.low, roots.next
    triple, scale = _triple(roots, start, end)
    below = (low - roots.h) ** 2 - roots.d
    poles, rates, logs = [], [], []
    r_plus, r_minus = horizons(spin)
    rise = radial.horizon_lift(spin)
    for horizon, pole, rest in zip((r_plus, r_minus), (rise, -rise), roots.rest(spin), strict=True):
        heights = (start.height + (rise - pole), end.height + (rise - pole))
        from_low = horizon - low
        rate = rest / from_low
        p = triple.root**2 - below * (horizon - following) / from_low * scale**2
        s = _pole_sum(roots, start, end, pole, heights)
        product = heights[0] * heights[1] / ((start.r - low) * (end.r - low)) * p
        logs.append(elliptic.log_ratio(s, scale * rate, product))
        poles.append(elliptic.Pole(p, (following - low) * below * rate / from_low * scale**3))
        rates.append(rate)
    if with_time:
        near, width = (following - roots.h) ** 2 - roots.d, following - low
        poles.append(elliptic.Pole(triple.root**2 - near * scale**2, width * near * scale**3))
    kinds = elliptic.carlson(triple, poles, second=with_time)
    time = 2 * scale * kinds.first
    plus, minus = (
        log + 2 / 3 * third - rate * time for log, third, rate in zip(logs, kinds.thirds[:2], rates, strict=True)
    )
    growing = _growing(roots, start, end, triple, scale, poles[-1].p, kinds) if with_time else None
    return RadialIntegrals(time, plus, minus, growing)


def _triple(roots: RadialRoots, start: RadialPlace, end: RadialPlace) -> tuple[elliptic.Triple, Reals]:
    return radial.carlson_arguments(roots.quartic(), (start.r, start.inner, start.outer), (end.r, end.inner, end.outer))


def _sum(first: Reals, second: Reals, squares: Reals) -> Reals:
    """|first + second|; where the signs differ, its quotient by the gap, from squares = (first^2 - second^2) / gap."""
    turned = first * second < 0
    return jnp.where(turned, squares / jnp.where(turned, first - second, 1.0), jnp.abs(first + second))


def _pole_sum(
    roots: RadialRoots, start: RadialPlace, end: RadialPlace, pole: Reals, heights: tuple[Reals, Reals]
) -> Reals:
    """The S of DLMF 19.29.8 for a pole at a horizon, 1 + pole, of which heights are the two places' distances."""
    t1, t2 = heights
    x1, x2 = start.r - roots.low, end.r - roots.low
    # The squares are a sum without cancellation, also between two radii close to one turning point.
    s1, s2 = start.r - 1 - roots.lift, end.r - 1 - roots.lift
    mixed = (start.r - roots.next) * x2 + (end.r - roots.next) * x1
    squares = mixed * ((roots.lift - pole) * (s1 * t2 + s2 * t1) + roots.d * (t1 + t2))
    squares = squares + (roots.next - roots.low) * ((start.outer * t2) ** 2 + (end.outer * t1) ** 2)
    first, second = start.outer * start.inner / x1 * t2, end.outer * end.inner / x2 * t1
    return _sum(first, second, -squares / (2 * x1 * x2))


def _growing(
    roots: RadialRoots,
    start: RadialPlace,
    end: RadialPlace,
    triple: elliptic.Triple,
    scale: Reals,
    p: Reals,
    kinds: elliptic.Integrals,
) -> Reals:
    """The integral of r^2 + 2 r from one place to another, less r + 2 ln r at the first."""
    h, d, low, following, *_ = roots
    near, below, width = (following - h) ** 2 - d, (low - h) ** 2 - d, following - low
    t1, t2 = start.r - following, end.r - following
    time = 2 * scale * kinds.first
    first, second = start.outer * start.inner / t1, end.outer * end.inner / t2
    s1, s2 = start.r - h, end.r - h
    squares = -(s1 + s2) - width * (s1 * s2 + (h - following) * (s1 + s2) + d) / (t1 * t2)
    s = _sum(first, second, squares)
    power = following * time + elliptic.log_ratio(s, scale, p / (t1 * t2)) + 2 / 3 * kinds.thirds[-1]
    ends = (start.r - low) * (end.r - low) / (start.inner * end.inner) * scale / triple.root
    # - first - r, of rays that start inward far away, from the difference of squares.
    rest = (2 * following * start.r + (h * h - d + 2 * h * low)) - low * (h * h - d) / start.r
    inward = first < 0
    start_part = jnp.where(inward, rest * start.r / (t1 * jnp.where(inward, start.r - first, 1.0)), -first - start.r)
    square = (
        second + start_part + (following**2 - near / 2) * time + near * (below / 3 * scale**3 * kinds.second + ends)
    )
    return square + 2 * (power - jnp.log(start.r))
