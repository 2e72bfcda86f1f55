"""Limits of double precision: flags of rays whose properties rounding decides, and the error of the azimuth.

The rules are the same for both engines. They are elementwise on arrays of one shape, one entry a ray.
"""

import math

import jax.numpy as jnp

from kerrcaustics.beams.geometry import first_azimuth, length
from kerrcaustics.beams.ray_state import Constants, Jacobian
from kerrcaustics.beams.traced_ends import TracedEnd
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, Photon

# Round-off of N, relative, in the axial angular momentum b.
_OF_B = 4e-16
# A beam whose Jacobian has a larger error is lost on its way, together with the zeros of its area.
_LOST = 1e-6
# A ray has passed the spin axis if m has gone round it by more than this.
_PASSED = 1.0


def azimuth_error(
    frame: Frame, constants: Photon | Constants, n: Components, error: Reals, turn: Reals, rate: tuple[Reals, ...]
) -> Reals:
    """Error of the azimuth in radians: infinite for a ray whose side of the spin axis round-off decides.

    Parameters: n, the direction of the end, and its error; turn, the azimuth of m there; rate of (u, x, y, z) at the
    camera.
    """
    sine = length(n[:2])
    scale = frame.cylindrical_scale * (1 + jnp.sqrt(jnp.maximum(constants.k, 0)) / frame.radius)
    gone_round = jnp.abs(turn - first_azimuth(frame, rate))
    either = (jnp.abs(constants.b) <= _OF_B * scale) & (gone_round > _PASSED)
    # From the axis itself rays leave in any direction: that of the azimuth pi is also that of - pi.
    _, x_rate, y_rate, _ = rate
    either = either | ((frame.sin_theta == 0) & (x_rate < 0) & (jnp.abs(y_rate) <= _OF_B * jnp.abs(x_rate)))
    # An end that may lie on the axis may lie on either side of it.
    either = either | ~(error < sine)
    return jnp.where(either, math.inf, error / jnp.where(either, 1.0, sine))


def index_is_certain(jacobian: Jacobian, error: Reals) -> Flags:
    """True if the signs of det J at the end and on the way are certain; error, relative, of the Jacobian."""
    (a, b), (c, d) = jacobian
    known = jnp.abs(a * d - b * c) > error * (a * a + b * b + c * c + d * d)
    return known & (error < _LOST)


def crossings(
    frame: Frame, end: TracedEnd, counted: Reals, place: tuple[Reals, Reals], leaving: Reals, rate: tuple[Reals, ...]
) -> tuple[Reals, Flags]:
    """The crossings of rays, and True if their number is certain; an end in the plane within its error is none.

    Parameters: counted on the way; place, the height cos(theta') of the end, and its error; leaving, positive where a
    ray moves away from the plane there; rate of (u, x, y, z) at the camera. Rays that stay in the plane have none: the
    height vanishes exactly if the camera, too, stays there.
    """
    height, error = place
    stays = (frame.cos_theta == 0) & (frame.basis[1][1] == 0) & (rate[3] == 0)
    either = jnp.abs(height) <= error
    passed = end.crossings(jnp.maximum(counted - (either & (leaving > 0)), 0))
    return passed, jnp.logical_not(end.is_across(either)) | stays
