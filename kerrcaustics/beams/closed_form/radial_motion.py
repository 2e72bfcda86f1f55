"""The radial motion of a ray in Carlson's integrals: Mino time, and the turn psi about the spin axis.

For one potential, R(r) = [(r - h)^2 - d] (r - low) (r - next), the integrals from a radius out to infinity are taken:
at the camera, and again at the other end where that is finite. low < 0 <= next are real for q >= 0; a turning point, or
a pair of complex roots h -+ sqrt(d), costs nothing special.

psi = -a / (r_+ - r_-) [I(r_+) - I(r_-)], I(r_h) = (2 r_h - a b) times the integral of d tau / (r - r_h). Since
R(r_h) = (2 r_h - a b)^2, all logarithms are of rational functions. The integrals are referred to the lowest root.

The coordinate time needs beside these the integrals of r, which has its pole at infinity, and of r^2, which is of the
second kind. Both are referred to the root `next`, so that the fourth argument p stays positive. With near and below
the values of (r - h)^2 - d at next and at low, and A, B the roots of the factors of R at the lower end,

    integral of r = next T + ln(2 X) - ln(p / (2 (r - next))) + (2/3) (next - low) near R_J,
    integral of r^2 = X - r + (next^2 - near / 2) T + near below R_D / 3 + 2 h (B - A) / (A + B),

up to a large radius X.

References: Carlson 1988 (Math. Comp. 51, 267); DLMF 19.29.4 to 19.29.8.
"""

from typing import NamedTuple

import jax.numpy as jnp

from kerrcaustics.spacetime import elliptic, radial
from kerrcaustics.spacetime.arrays import Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon


class Travel(NamedTuple):
    """The radial motion to the end.

    time: Mino time.
    psi: turn about the spin axis, radians.
    captured: True if the ray, followed on, falls in.
    clock: part of the coordinate time that belongs to r, to infinity the limit of it - r - 2 ln r; None if not
        requested.
    u: 1 / r at the end.
    rate: rate of u at the end.
    psi_rate: rate of psi at the end.
    clearance: distance from the outer roots (for a given time from their middle) over the radius, None at infinity.
    holds: True if the formulas hold.
    """

    time: Reals
    psi: Reals
    captured: Flags
    clock: Reals | None
    u: Reals = 0.0
    rate: Reals = -1.0
    psi_rate: Reals = 0.0
    clearance: Reals | None = None
    holds: Flags = True


class RadialRoots(NamedTuple):
    """The roots h -+ sqrt(d), low and next of R; lift = h - 1, and corotation = 2 r_+ - a b."""

    h: Reals
    d: Reals
    low: Reals
    next: Reals
    lift: Reals
    corotation: Reals

    def quartic(self) -> radial.Quartic:
        """The factors of R."""
        return radial.Quartic(self.h, self.d, (self.low + self.h) ** 2, self.lift)

    def rest(self, spin: Reals) -> tuple[Reals, Reals]:
        """2 r_h - a b of both horizons."""
        return self.corotation, self.corotation - 4 * radial.horizon_lift(spin)


class RadialPlace(NamedTuple):
    """A radius, its height over the outer horizon, and the roots of the two factors of R there.

    outer, of the first factor, has the sign of r'.
    """

    r: Reals
    height: Reals
    inner: Reals
    outer: Reals


class RadialIntegrals(NamedTuple):
    """Integrals along a way: Mino time, I(r_+), I(r_-), and that of r^2 + 2 r, to infinity its finite part.

    The last is also without r + 2 ln r of the start.
    """

    time: Reals
    plus: Reals
    minus: Reals
    growing: Reals | None


def radial_motion(frame: Frame, photon: Photon, quartic: radial.Quartic, *, with_time: bool = False) -> Travel:
    """The radial motion of rays from the camera to infinity; with the clock if requested."""
    roots, start = start_of(frame, photon, quartic)
    way = _to_infinity(frame.spin, roots, start, with_time=with_time)
    if way.growing is not None:
        way = way._replace(growing=way.growing + frame.start)
    return travel(frame.spin, way, radial.is_captured(frame, photon, quartic))


def travel(spin: Reals, way: RadialIntegrals, captured: Flags) -> Travel:
    """Psi and the clock from the integrals along a way."""
    r_plus, r_minus = horizons(spin)
    psi = -spin / (2 * radial.horizon_lift(spin)) * (way.plus - way.minus)
    slow = None
    if way.growing is not None:
        # The integral of 2 (2 - a b u) / (1 - 2 u + a^2 u^2).
        slow = way.growing + 4 * way.time + (r_plus * way.plus - r_minus * way.minus) / radial.horizon_lift(spin)
    return Travel(way.time, psi, captured, slow)


def horizons(spin: Reals) -> tuple[Reals, Reals]:
    """The radii of the two horizons."""
    outer = radial.horizon(spin)
    return outer, spin**2 / outer


def start_of(frame: Frame, photon: Photon, quartic: radial.Quartic) -> tuple[RadialRoots, RadialPlace]:
    """The roots of R, and the place of the camera."""
    (r, outer), h, d = radial.outer_start(frame, photon, quartic), quartic.h, quartic.d
    excess = frame.spin**2 * photon.q / (h * h - d)
    width = jnp.sqrt(h * h + excess)
    low, following = -h - width, excess / (h + width)
    inner = jnp.sqrt((r - low) * (r - following))
    # Exact next to the horizon, where the rounding of its radius would not be.
    height = (frame.root_sigma_delta / frame.root_sigma) ** 2 / (r - 1 + radial.horizon_lift(frame.spin))
    roots = RadialRoots(h, d, low, following, quartic.lift, radial.corotation(frame, photon))
    return roots, RadialPlace(r, height, inner, outer)


def _to_infinity(spin: Reals, roots: RadialRoots, place: RadialPlace, *, with_time: bool) -> RadialIntegrals:
    """The integrals from a place to infinity, through the turning point where r' < 0."""
    h, d, low, following, lift, _ = roots
    r, height, inner, outer = place
    triple = radial.to_infinity(roots.quartic(), r, inner, outer)
    # The product of the outer roots, less 1.
    below, product = (low - h) ** 2 - d, lift**2 - d
    poles, rates, logs = [], [], []
    r_plus, r_minus = horizons(spin)
    rise = radial.horizon_lift(spin)
    sides = zip((r_plus, r_minus), (height, height + 2 * rise), (rise, -rise), roots.rest(spin), strict=True)
    for horizon, above_horizon, pole, rest in sides:
        from_low = horizon - low
        rate = rest / from_low
        p = triple.root**2 - below * (horizon - following) / from_low
        above = above_horizon * (r - low)
        # above + outer inner, from their difference of squares where they cancel.
        squares = (pole**2 + 2 * pole * (low - 1) - product - 2 * (following - 1) * lift) * (r - 1)
        squares = squares - 2 * (horizon + low) * (r - 1) ** 2 - pole**2 * (low - 1) + (following - 1) * product
        cancels = outer * inner < -0.5 * above
        gap = jnp.where(cancels, above - outer * inner, 1.0)
        s = jnp.where(cancels, squares / gap, (above + outer * inner) / (r - low))
        logs.append(elliptic.log_ratio(s, rate, above_horizon / (r - low) * p))
        poles.append(elliptic.Pole(p, (following - low) * below * rate / from_low))
        rates.append(rate)
    if with_time:
        poles.append(_pole_at_infinity(roots, place))
    kinds = elliptic.carlson(triple, poles, second=with_time)
    time = 2 * kinds.first
    plus, minus = (
        log + 2 / 3 * third - rate * time for log, third, rate in zip(logs, kinds.thirds[:2], rates, strict=True)
    )
    return RadialIntegrals(time, plus, minus, _growing(roots, place, triple, poles[-1].p, kinds) if with_time else None)


def _pole_at_infinity(roots: RadialRoots, place: RadialPlace) -> elliptic.Pole:
    """The pole of r itself: p = (A + B)^2 - near = 2 (r^2 - next^2 + A B)."""
    h, d, low, following, *_ = roots
    r, _, inner, outer = place
    squares = r * r - following**2
    slope = 3 * h * h + d + 2 * h * following - following**2
    level = low * (h * h - d) - following**3
    inward = outer < 0
    p = 2 * jnp.where(
        inward,
        (r - following) * (slope * r + level) / jnp.where(inward, squares - outer * inner, 1.0),
        squares + outer * inner,
    )
    return elliptic.Pole(p, (following - low) * ((following - h) ** 2 - d))


def _growing(
    roots: RadialRoots, place: RadialPlace, triple: elliptic.Triple, p: Reals, kinds: elliptic.Integrals
) -> Reals:
    """The integral of r^2 + 2 r from a place to a large radius X, less X + 2 ln X, and less the same at the place."""
    h, d, low, following, *_ = roots
    r, _, inner, outer = place
    e = (low + h) ** 2
    near, below = (following - h) ** 2 - d, (low - h) ** 2 - d
    time = 2 * kinds.first
    first_power = following * time - jnp.log(p / (4 * (r - following)) * r) + 2 / 3 * kinds.thirds[-1]
    # (B - A) / (A + B) from the difference of squares; 2 h times that is 2 r, and a rest, for rays that start inward.
    product = 4 * r * h + d - e
    ends = 2 * h * product / triple.root**2 - 2 * r
    # (B - A)^2 - 4 r^2, from R - r^4.
    bend = ((h * h - d) * (h * h - e) / r + 2 * h * (e - d)) / r - (2 * h * h + d + e)
    square = (2 * h * h - d - e) + 2 * bend / (1 + jnp.abs(outer / r) * (inner / r))
    rest = (2 * h * square - 2 * r * (d - e)) / jnp.where(outer < 0, product, 1.0)
    finite = jnp.where(outer < 0, rest, ends)
    return (following**2 - near / 2) * time + near * below / 3 * kinds.second + finite + 2 * first_power
