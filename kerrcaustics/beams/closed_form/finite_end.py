"""The radial motion of a ray to a finite end: a radius, or the radius after a given Mino time.

The radius after a Mino time comes roughly from Weierstrass' function, and is refined by the integral for the time. A
place on the ray is held as u = 1/r and y, the root of the outer factor of R over r with the sign of r',

    y^2 = (1 - h u)^2 - d u^2,   x^2 = (1 - low u) (1 - next u),   u' = -x y,

two numbers that pass a turning point smoothly. A point that rounding, or a change of the roots, takes off that curve is
put back at right angles to it, so that nothing is ever divided by a rate that may vanish.
"""

import jax
import jax.numpy as jnp

from kerrcaustics.beams.closed_form import radial_leg
from kerrcaustics.beams.closed_form.radial_motion import (
    RadialIntegrals,
    RadialPlace,
    RadialRoots,
    Travel,
    start_of,
    travel,
)
from kerrcaustics.beams.closed_form.weierstrass import inverse_radius
from kerrcaustics.beams.ray_state import Aim
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon, potential_coefficients

# Steps from Weierstrass' function to round-off, and the distance in time, relative to that from the outer roots and to
# the Mino time of an oscillation, that they may leave to the last one.
_REFINEMENTS = 2
_LATE = 1e-6
# Radians of arc below which the variation of a way, a difference of much larger ones, is left to the integrator.
_SHORTEST = 1e-3


# u and y of a place.
_Point = tuple[Reals, Reals]


def to_sphere(
    frame: Frame, photon: Photon, quartic: radial.Quartic, radius: Reals, aim: Aim, *, with_time: bool
) -> Travel:
    """The motion to the first arrival at a radius."""
    roots, start = start_of(frame, photon, quartic)
    u = 1 / radius + 0 * photon.b
    square = radial.outer_square(roots.quartic(), (start.r, start.outer), radius)
    is_certain = aim.lost | (square > radial.arrival_doubt(frame, photon, quartic, radius))
    square = square * u * u
    y = jnp.where(aim.rising, 1.0, -1.0) * jnp.sqrt(jnp.where(is_certain & (square > 0), square, 1.0))
    # The radius itself, not 1 / u, so that its difference from the camera's is exact.
    end = _place(frame.spin, roots, (u, y))._replace(r=radius, height=radius - 1 - radial.horizon_lift(frame.spin))
    way = _timed(frame, radial_leg.integrals(frame.spin, roots, start, end, with_time=with_time))
    motion = travel(frame.spin, way, aim.captured)
    psi_rate, _ = _rates_at(frame.spin, photon.b, u)
    return motion._replace(u=u, rate=-y * _x(roots, u), psi_rate=psi_rate, clearance=jnp.abs(y), holds=is_certain)


def travel_over_time(
    frame: Frame, photon: Photon, quartic: radial.Quartic, time: Reals, aim: Aim, *, with_time: bool
) -> Travel:
    """The motion over a given Mino time."""
    spin = frame.spin
    roots, start = start_of(frame, photon, quartic)
    coefficients = potential_coefficients(spin, photon)
    near, certified = _refined(spin, *jax.lax.stop_gradient((photon, coefficients, roots, start, time)))
    near_u, y = point = _on_curve(roots, near)
    whole = _timed(frame, radial_leg.integrals(spin, roots, start, _place(spin, roots, point), with_time=with_time))
    time_left = time - whole.time
    slope = -y * _x(roots, near_u)
    u = near_u + jax.lax.stop_gradient(slope) * time_left
    motion = travel(spin, whole, aim.captured)
    psi_rate, clock_rate = _rates_at(spin, photon.b, u)
    rates = jax.lax.stop_gradient((psi_rate, clock_rate))
    slow = None if motion.clock is None else motion.clock + rates[1] * time_left
    arc, clearance = time * jnp.sqrt(photon.k + 3), jnp.sqrt(y**2 + (1 - roots.h * u) ** 2)
    certified = certified & (jnp.abs(time_left) * jnp.sqrt(photon.k + 3) < _LATE * clearance) & (arc > _SHORTEST)
    return Travel(
        time=time,
        psi=motion.psi + rates[0] * time_left,
        captured=aim.captured,
        clock=slow,
        u=u,
        rate=slope,
        psi_rate=psi_rate,
        clearance=jnp.minimum(clearance, (arc + jnp.abs(slope)) / 8),
        holds=aim.lost | certified,
    )


def _timed(frame: Frame, way: RadialIntegrals) -> RadialIntegrals:
    """The integrals, with the time counted from the start of the camera's."""
    return way if way.growing is None else way._replace(growing=way.growing + frame.start)


def growth(frame: Frame, photon: Photon, time: Reals) -> Reals:
    """The change of u at the end by that of its rate at the camera, in arcs of unit slope."""
    coefficients = potential_coefficients(frame.spin, photon)
    u, w = photon.position[0], photon.rate[0]

    def varied(rate: Reals) -> Reals:
        return inverse_radius(coefficients, (u, rate), time)[0]

    return jnp.abs(jax.jvp(varied, (w,), (jnp.sqrt(jnp.maximum(photon.k, 0) + 3),))[1])


def _refined(
    spin: Reals,
    photon: Photon,
    coefficients: tuple[Reals, Reals, Reals],
    roots: RadialRoots,
    start: RadialPlace,
    time: Reals,
) -> tuple[_Point, Flags]:
    """The place after a Mino time, but for round-off; True if it lies between horizon and infinity."""
    a2, a1, a0 = coefficients
    u, w = inverse_radius(coefficients, (photon.position[0], photon.rate[0]), time)
    inside = (u > 0) & (u * radial.horizon(spin) < 1)
    u = jnp.where(inside, u, photon.position[0])
    # The rate is less certain than u: the first time the curve may be some way off.
    point = _on_curve(roots, (u, -w / _x(roots, u)))
    for _ in range(_REFINEMENTS):
        point = _on_curve(roots, point)
        time_left = time - radial_leg.mino_time(roots, start, _place(spin, roots, point))
        u, y = point
        x, slope, bend = _x(roots, u), roots.h * (1 - roots.h * u) + roots.d * u, roots.d - roots.h**2
        x_slope = roots.low * roots.next * u - (roots.low + roots.next) / 2
        pull = (a2 + (1.5 * a1 + 2 * a0 * u) * u) * u
        moved = u + time_left * (time_left / 2 * pull - x * y)
        turned = y + time_left * (x * slope - time_left / 2 * y * (x_slope * slope + x * x * bend))
        inside = inside & (moved > 0) & (moved * radial.horizon(spin) < 1)
        point = (jnp.where(inside, moved, photon.position[0]), turned)
    return point, inside


def _on_curve(roots: RadialRoots, point: _Point) -> _Point:
    """The point put back on the curve y(u), at right angles to it in y and h u; by derivatives of the roots too."""
    h, d = roots.h, roots.d
    u, y = point
    excess = y * y - (1 - h * u) ** 2 + d * u * u
    along_y, along_u = jax.lax.stop_gradient((2 * y, 2 * ((1 - h * u) + d * u / h)))
    square = along_y**2 + along_u**2
    step = excess / jnp.where(square == 0, 1.0, square)
    return u - along_u * step / jax.lax.stop_gradient(h), y - along_y * step


def _x(roots: RadialRoots, u: Reals) -> Reals:
    return jnp.sqrt((1 - roots.low * u) * (1 - roots.next * u))


def _place(spin: Reals, roots: RadialRoots, point: _Point) -> RadialPlace:
    u, y = point
    r = 1 / u
    return RadialPlace(r, r - 1 - radial.horizon_lift(spin), _x(roots, u) * r, y * r)


def _rates_at(spin: Reals, b: Reals, u: Reals) -> tuple[Reals, Reals]:
    """psi' and the rate of the radial part of the clock."""
    inverse = 1 / radial.horizon_function(spin, u)
    turning = 2 - spin * b * u
    return -spin * u * turning * inverse, 1 / (u * u) + 2 / u + 2 * turning * inverse
