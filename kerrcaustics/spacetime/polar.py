"""The polar motion of a photon: the Mino time to its crossings of the equatorial plane, on NumPy or JAX arrays."""

import jax.numpy as jnp

from kerrcaustics.spacetime import elliptic
from kerrcaustics.spacetime.arrays import Reals
from kerrcaustics.spacetime.frame import Frame, Photon


def mino_time_to_plane(frame: Frame, photon: Photon, crossing: Reals) -> Reals:
    """Mino time from the camera to the n-th crossing of the equatorial plane; infinite for rays that never cross.

    z^2' = (c + a^2 z^2) (1 - z^2 / Z) Z, with q = c Z: the time from the plane to z, and the half period, are each
    one Carlson integral. A start on the plane is no crossing. Rays with q <= 0 stay on one side, or in the plane.

    Errors: about 1e-15 relative.
    References: DLMF 19.25.5.
    """
    a2, k, q = frame.spin**2, photon.k, photon.q
    z, z_rate = photon.position[3], photon.rate[3]
    crosses = q > 0
    q = jnp.where(crosses, q, 1)
    root = jnp.hypot(k - a2, 2 * frame.spin * jnp.sqrt(q))
    c = jnp.where(k >= a2, k - a2 + root, 4 * a2 * q / jnp.where(k >= a2, 1, root + a2 - k)) / 2
    largest = q / c
    stretch = c + a2 * z * z
    sine, cosine = jnp.abs(z) / jnp.sqrt(largest), jnp.abs(z_rate) / jnp.sqrt(largest * stretch)
    from_plane = sine * _rf(jnp.sqrt(c) * cosine, jnp.sqrt(stretch), jnp.sqrt(c))
    half_period = 2 * _rf(jnp.zeros_like(c), jnp.sqrt(c + a2 * largest), jnp.sqrt(c))
    first = jnp.where(z * z_rate < 0, from_plane, half_period - from_plane)
    return jnp.where(crosses, first + (crossing - 1) * half_period, jnp.inf)


def _rf(root_x: Reals, root_y: Reals, root_z: Reals) -> Reals:
    return elliptic.carlson(elliptic.Triple(root_x, root_y + root_z, root_y * root_z)).first
