"""The coordinate time along a ray, as one more path in the integration: no term of it grows without bound.

With t counted backward from the camera, t' = r^2 + 2 r + 2 (2 - a b u) / (1 - 2 u + a^2 u^2) + a^2 z^2. Here

    integral of r^2 = [-w / u] + integral of (a1 u / 2 + a0 u^2),   w = u',
    integral of r   = 2 ln Y - ln u,   Y'' = (a2 / 4 + a1 u / 2 + 3 a0 u^2 / 4) Y,

so that the clock is Y, beside u, and a quadrature Q of the rest, which takes the place of the path's angle.
"""

import jax.numpy as jnp

from kerrcaustics.beams.integrator.equations import polar_rapidity
from kerrcaustics.beams.integrator.nystroem import Positions, Rates
from kerrcaustics.beams.ray_state import Constants, Path
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Flags, Reals


def started(constants: Constants, ray: Path) -> Path:
    """The clock at the camera: Y = sqrt(u), Y' = (w + 1) / (2 Y), Q = 0."""
    a2, a1, a0, _, _ = constants
    u, w = ray.position[0], ray.rate[0]
    # w + 1 without its cancellation far from the hole, where w is close to -1: U - 1 = w^2 - 1.
    excess = (a2 + (a1 + a0 * u) * u) * u * u
    above = jnp.where(w > 0, w + 1, excess / jnp.where(w > 0, 1, w - 1))
    root = jnp.sqrt(u)
    return Path((root,), (above / (2 * root),), jnp.zeros_like(u))


def with_clock(rates: Rates, spin: Reals, constants: Constants) -> Rates:
    """The rates of the paths and, last, of their clock."""
    a2, a1, a0, _, b = constants

    def all_rates(positions: Positions) -> tuple[Positions, list[Reals]]:
        accelerations, angles = rates(positions[:-1])
        (u, _, _, z), (y,) = positions[0], positions[-1]
        pull = (a2 + (2 * a1 + 3 * a0 * u) * u) / 4
        quadrature = (a1 / 2 + a0 * u) * u + _rest(spin, b, u, z)
        return [*accelerations, (pull * y,)], [*angles, quadrature]

    return all_rates


def rate(spin: Reals, constants: Constants, u: Reals, z: Reals) -> Reals:
    """t' at a place."""
    return (1 / u + 2) / u + _rest(spin, constants.b, u, z)


def _rest(spin: Reals, b: Reals, u: Reals, z: Reals) -> Reals:
    """t' without the two terms that grow with the radius."""
    return 2 * (2 - spin * b * u) / radial.horizon_function(spin, u) + (spin * z) ** 2


def local_error(constants: Constants, clock: Path, gap: Path) -> Reals:
    """The error of the time by the gap between the orders."""
    in_y = jnp.abs(gap.position[0]) + jnp.abs(gap.rate[0]) / polar_rapidity(constants)
    return 4 * in_y / jnp.abs(clock.position[0]) + jnp.abs(gap.psi)


def reading(
    constants: Constants, start: Path, end: Path, clock: Path, *, at_infinity: bool, distant: Flags = False
) -> Reals:
    """Coordinate time from the end to the camera; at infinity the limit of t - r - 2 ln r.

    distant: r + 2 ln r of the camera is subtracted too, as for an `Observer`.
    """
    a2, a1, a0, _, _ = constants
    u, w = start.position[0], start.rate[0]
    # w / u - 1 / u, without its cancellation where w is close to 1, from w^2 - 1.
    inward = w > 0
    beyond = jnp.where(inward, (a2 + (a1 + a0 * u) * u) * u / jnp.where(inward, w + 1, 1.0), (w - 1) / u)
    first = jnp.where(distant, beyond + 2 * jnp.log(u), w / u)
    time = first + clock.psi + 4 * jnp.log(jnp.abs(clock.position[0]))
    if at_infinity:
        return time
    u, w = end.position[0], end.rate[0]
    # w is divided by a u that may be very small: there U(u) gives it more accurately.
    square = 1 + (a2 + (a1 + a0 * u) * u) * u * u
    w = jnp.where(square > 0.25, jnp.copysign(jnp.sqrt(jnp.maximum(square, 0.25)), w), w)
    return time - w / u - 2 * jnp.log(u)
