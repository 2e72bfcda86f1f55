"""What double precision cannot know of a ray: flags that say so, and the error of its azimuth.

The rules are the same for both engines. They are elementwise on arrays of one shape, one entry a ray.
"""

import math

import jax.numpy as jnp

from kerrcaustics.beams.ends import Jacobian
from kerrcaustics.beams.geometry import length
from kerrcaustics.beams.integrator.equations import Constants
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.camera import Frame, Photon

# Round-off of N, relative, in the axial angular momentum b.
_OF_B = 4e-16
# A ray has passed the spin axis if m has gone round it by more than this.
_PASSED = 1.0


def azimuth_error(frame: Frame, constants: Photon | Constants, n: Components, error: Reals, turn: Reals) -> Reals:
    """Error of the azimuth in radians: infinite for a ray whose side of the spin axis round-off decides.

    Infinite too where nothing is known of the direction.

    Parameters: n, the direction of the end, and its error; turn, by how much m has gone round the axis.
    """
    sine = length(n[:2])
    scale = frame.cylindrical_scale * (1 + jnp.sqrt(jnp.maximum(constants.k, 0)) / frame.radius)
    either = (jnp.abs(constants.b) <= _OF_B * scale) & (jnp.abs(turn) > _PASSED)
    # An end that may lie on the axis may lie on either side of it.
    either = either | ~(error < sine)
    return jnp.where(either, math.inf, error / jnp.where(either, 1.0, sine))


def index_is_certain(jacobian: Jacobian, error: Reals) -> Flags:
    """Whether the sign of det J at the end is known, the Jacobian having a relative error."""
    (a, b), (c, d) = jacobian
    return jnp.abs(a * d - b * c) > error * (a * a + b * b + c * c + d * d)


def stays_in_plane(frame: Frame, sky: Components) -> Flags:
    """Whether a ray lies in the equatorial plane by its numbers, not by their rounding.

    Parameters: sky, the components of N.
    """
    along = [jnp.abs(part) * abs(axis[1]) for part, axis in zip((sky[0], 1.0, sky[2]), frame.basis, strict=True)]
    return (frame.cos_theta == 0) & (along[0] + along[1] + along[2] == 0)
