"""Rays as functions of the hole, the camera and the direction."""

from functools import partial
from typing import Any

import jax
from jaxtyping import Array, Float

from kerrcaustics.beams.differentiable import differentiable, end, float64
from kerrcaustics.beams.moving import Moving, motion_of
from kerrcaustics.beams.program_cache import keep_programs
from kerrcaustics.functional.traced_arguments import check_axis, check_shapes, wide, wide_place, with_place
from kerrcaustics.spacetime.camera import Velocity


def direction(
    spin: Any, radius: Any, inclination: Any, sky: Any, velocity: Velocity = "fiducial"
) -> Float[Array, "... 3"]:
    """The origin of the light of a camera-sky direction: n' (..., 3), a unit vector of the celestial sphere.

    Parameters
    ----------
    spin, radius, inclination : float or (...)
        As in `Camera`; checked if they are numbers, not if JAX traces them.
    sky : (..., 3)
        Directions N on the camera sky; their length does not matter, so that a gradient is tangential.
    velocity : str or (float, float, float), optional
        As in `Camera`, but "fiducial" by default. A name is the motion that belongs to the place, and is
        differentiated with it: "circular" is the angular velocity 1 / (a + r^(3/2)), also off the equator, where it is
        no geodesic and `Camera` has none.

    Returns
    -------
    (..., 3) float64; NaN for captured rays.

    Errors
    ------
    1e-13 or so times the beam's major diameter; each derivative loses one more power of it. More for cameras within
    1e-6 of the speed of light, or within 1e-4 of the horizon, relative to its radius.
    """
    return _ray_end(spin, radius, inclination, sky, velocity, timed=False)


def travel_time(
    spin: Any, radius: Any, inclination: Any, sky: Any, velocity: Velocity = "fiducial"
) -> Float[Array, "..."]:
    """The coordinate time from infinity to the camera, the limit of t - r - 2 ln r (...); all else as `direction`.

    Errors: about 1e-13 times the length of the path, and 1e-13 times the major diameter.
    """
    return _ray_end(spin, radius, inclination, sky, velocity, timed=True)[..., 3]


def _ray_end(spin: Any, radius: Any, inclination: Any, sky: Any, velocity: Velocity, *, timed: bool) -> Array:
    motion = motion_of(velocity)
    with float64():
        place, sky = wide_place(spin, radius, inclination), wide("sky", sky)
        check_axis("sky", sky, 3, "(..., 3)")
        check_shapes(*place, sky=sky.shape[:-1])
        return _ends(*place, sky, motion, timed)


@partial(jax.jit, static_argnames=("timed",))
def _ends(spin: Array, radius: Array, inclination: Array, sky: Array, motion: Moving, timed: bool) -> Array:
    keep_programs()
    arguments = with_place([spin, radius, inclination], sky)
    ends = jax.vmap(differentiable(partial(end, timed=timed)), (0, None))(arguments.reshape(-1, 6), motion)
    return ends.reshape(*arguments.shape[:-1], -1)
