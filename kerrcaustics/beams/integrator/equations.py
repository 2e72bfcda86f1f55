"""The equations of a ray and of its first variation in Mino time; see integrated.py for the variables."""

import jax.numpy as jnp

from kerrcaustics.beams.ray_state import Constants, Path
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Reals


def radial_pull(constants: Constants, u: Reals) -> Reals:
    """u'' = U'(u) / 2."""
    return (constants.a2 + (1.5 * constants.a1 + 2 * constants.a0 * u) * u) * u


def ray_rates(spin: Reals, constants: Constants, position: tuple[Reals, ...]) -> tuple[tuple[Reals, ...], Reals]:
    """Second derivatives of (u, x, y, z), and the first derivative of psi."""
    k, b = constants.k, constants.b
    u, x, y, z = position
    pull = k + 2 * spin**2 * z * z
    psi_rate = -spin * u * (2 - spin * b * u) / radial.horizon_function(spin, u)
    return (radial_pull(constants, u), -pull * x, -pull * y, (spin**2 - pull) * z), psi_rate


def rates_with_variation(
    spin: Reals,
    constants: Constants,
    position: tuple[Reals, ...],
    variations: list[tuple[Constants, tuple[Reals, ...]]],
) -> tuple[list[tuple[Reals, ...]], list[Reals]]:
    """`ray_rates`, followed by their derivatives along each variation (of the constants, of the position).

    Written out, as it shares most of its operations with the rates; the tests compare it with the automatic derivative.
    """
    a2, a1, a0, k, b = constants
    u, x, y, z = position
    accelerations, psi_rate = ray_rates(spin, constants, position)
    pull = k + 2 * spin**2 * z * z
    slope = a2 + (3 * a1 + 6 * a0 * u) * u
    inverse = 1 / radial.horizon_function(spin, u)
    psi_by_u = (2 * inverse) * (psi_rate * (1 - spin**2 * u) - spin * (1 - spin * b * u))
    psi_by_b = spin**2 * u * u * inverse
    all_accelerations, all_psi_rates = [accelerations], [psi_rate]
    for dc, (du, dx, dy, dz) in variations:
        d_pull = dc.k + 4 * spin**2 * z * dz
        all_accelerations.append(
            (
                slope * du + (dc.a2 + (1.5 * dc.a1 + 2 * dc.a0 * u) * u) * u,
                -pull * dx - d_pull * x,
                -pull * dy - d_pull * y,
                (spin**2 - pull) * dz - d_pull * z,
            )
        )
        all_psi_rates.append(psi_by_u * du + psi_by_b * dc.b)
    return all_accelerations, all_psi_rates


def polar_rapidity(constants: Constants) -> Reals:
    """Radians of arc along the sphere of m in a unit of Mino time, never less than sqrt(3)."""
    return jnp.sqrt(jnp.maximum(constants.k, 0) + 3)


def rapidity(spin: Reals, constants: Constants, path: Path) -> Reals:
    """Rate in Mino time at which the solution changes: the polar oscillation, and the pole of psi' at the horizon.

    The pole matters for rays that graze the hole and for cameras close to it.
    """
    return jnp.hypot(polar_rapidity(constants), 1.3 * horizon_rapidity(spin, constants, path))


def horizon_rapidity(spin: Reals, constants: Constants, path: Path) -> Reals:
    """1 / (the time the path would need, in the complex plane, to reach the horizon, where psi' is infinite)."""
    u, w = path.position[0], path.rate[0]
    u_horizon = 1 / radial.horizon(spin)
    acceleration = radial_pull(constants, u)
    gap = jnp.maximum(u_horizon - u, 1e-300)
    return (jnp.abs(w) + jnp.sqrt(w * w + 2 * jnp.abs(acceleration) * gap)) / (2 * gap)
