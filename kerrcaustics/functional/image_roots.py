"""Images of stars as functions of the hole, the camera and the star: Newton's method from images next to them."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from kerrcaustics.beams.differentiable import end, float64
from kerrcaustics.beams.moving import Moving, motion_of
from kerrcaustics.beams.program_cache import prepare_compilation
from kerrcaustics.functional.local_map import (
    Vector,
    determinant,
    expansion,
    jacobian,
    solved,
    tangents,
    unit,
    with_columns,
)
from kerrcaustics.functional.traced_arguments import (
    check_axis,
    check_shapes,
    direction_of,
    parity_sign,
    wide,
    wide_place,
    with_place,
)
from kerrcaustics.spacetime.camera import Velocity

# Newton's steps must shrink by this factor at least, or the star goes a shorter way at once.
_CONTRACTION = 0.3
# Largest Newton step on the sky, radians.
_LONGEST = 0.5
# Shortest part of the star's way between two images.
_SHORTEST = 1e-7
# Most steps in all.
_MOST = 150
# Of n', relative to 1 + its derivatives: from here one step more leaves round-off.
_RESOLVED = 1e-12


class Images(NamedTuple):
    """Images of a star, NaN where one is lost.

    sky: directions N on the camera sky (..., 3), unit vectors.
    magnification: 1 / |det J| (...).
    time: time from infinity to the camera, as `travel_time` (...).
    """

    sky: Array
    magnification: Array
    time: Array


class Newton(NamedTuple):
    """Newton's method on its way.

    begun: end of the first line of sight.
    at: last image of a star on the way.
    part: part of the way at which the star was then.
    stride: part of the way from there to the next star.
    trial: line of sight that is tried next.
    tries: steps since the last image.
    size: length of the last of them, radians.
    found: True when the whole way is done.
    steps: number of steps in all.
    """

    begun: Array
    at: Array
    part: Array
    stride: Array
    trial: Array
    tries: Array
    size: Array
    found: Array
    steps: Array


class Near(NamedTuple):
    """The place to look for an image: a line of sight next to it, the sign of its det J, and the camera's motion."""

    sky: Array
    sign: Array
    motion: Moving


def root(arguments: Float[Array, "6"], near: Near) -> Vector:
    """The image of a star next to a line of sight; NaN if it is lost.

    arguments: spin, radius, inclination, and the star's direction. The star moves on a great circle from where the line
    of sight ends, and the image with it; it is lost where the sign of det J is wrong, as beyond a caustic.
    """
    place, star = arguments[:3], unit(arguments[3:])

    def step(now: Newton) -> Newton:
        arrival, columns = jacobian(place, now.trial, near.motion)
        begun = jnp.where(now.steps == 0, arrival, now.begun)
        part = now.part + now.stride
        goal = unit(begun + part * (star - begun))
        end_axes = tangents(arrival)
        miss = end_axes.T @ (goal - arrival)
        shift = solved(end_axes.T @ columns, miss)
        size = jnp.sqrt(jnp.sum(shift * shift))
        shrinks = (now.tries == 0) | (size <= _CONTRACTION * now.size)
        resolved = jnp.sqrt(jnp.sum(miss * miss)) <= _RESOLVED * (1 + jnp.abs(columns).max())
        good = (determinant(arrival, columns) * near.sign > 0) & (jnp.dot(goal, arrival) > 0)
        good &= (size < _LONGEST) & (shrinks | resolved)
        trial = unit(now.trial + tangents(now.trial) @ shift)
        last = part >= 1
        landed = good & jnp.where(last, resolved, (now.tries > 0) | resolved)
        at, part = jnp.where(landed, trial, now.at), jnp.where(landed, part, now.part)
        # After an image the stride doubles; after a failure it is half as long.
        stride = now.stride * jnp.where(landed, 2.0, jnp.where(good, 1.0, 0.5))
        return Newton(
            begun,
            at,
            part,
            jnp.minimum(stride, jnp.where(part < 1, 1 - part, 1)),
            jnp.where(good, trial, at),
            jnp.where(good & ~landed, now.tries + 1, 0),
            size,
            landed & last,
            now.steps + 1,
        )

    def goes_on(now: Newton) -> Array:
        return ~now.found & (now.stride > _SHORTEST) & (now.steps < _MOST)

    zero, start = jnp.zeros(()), unit(near.sky)
    first = Newton(jnp.zeros(3), start, zero, zero + 1, start, jnp.asarray(0), zero, jnp.asarray(False), jnp.asarray(0))
    last = jax.lax.while_loop(goes_on, step, first)
    return jnp.where(last.found, last.at, jnp.nan)


@jax.custom_jvp
def image_direction(arguments: Float[Array, "6"], near: Near) -> Vector:
    """`root`, with derivatives."""
    return root(arguments, near)


@image_direction.defjvp
def _slope(primals: tuple[Array, Near], given: tuple[Array, Near]) -> tuple[Array, Array]:
    arguments, near = primals
    sky = image_direction(arguments, near)
    numbers = jnp.concatenate([arguments[:3], sky])
    slopes = jax.jacfwd(partial(end, timed=False))(numbers, near.motion)
    basis = tangents(sky)
    moved = jnp.sum(slopes[:, :3] * given[0][:3], axis=-1)
    star_axes = tangents(unit(arguments[3:]))
    target_step = star_axes.T @ (_star_slopes(arguments) @ given[0][3:] - moved)
    return sky, basis @ solved(star_axes.T @ slopes[:, 3:] @ basis, target_step)


def _star_slopes(arguments: Float[Array, "6"]) -> Float[Array, "3 3"]:
    """Derivatives of the star's unit vector."""
    size = jnp.sqrt(jnp.sum(arguments[3:] ** 2))
    star = arguments[3:] / size
    return (jnp.eye(3) - star[:, None] * star) / size


def _image(arguments: Float[Array, "6"], near: Near, *, timed: bool) -> tuple[Array, Array]:
    """N, det J, and the time of an image, and their derivatives by the arguments."""
    sky = image_direction(arguments, near)
    (arrival, columns), (moves, bends) = expansion(arguments[:3], sky, near.motion, timed=timed)
    star_axes = tangents(unit(arguments[3:]))
    target_step = star_axes.T @ jnp.concatenate([-moves[:3, :3], _star_slopes(arguments)], axis=1)
    shifts = solved(star_axes.T @ columns[:3], target_step)
    slopes = jax.vmap(lambda *moved: jax.jvp(determinant, (arrival, columns), moved)[1], -1)(moves, bends)
    rows = jnp.concatenate([slopes[None], moves[3:]])
    by_place = jnp.concatenate([rows[:, :3], jnp.zeros((len(rows), 3))], axis=1)
    derivatives = jnp.concatenate([tangents(sky) @ shifts, by_place + rows[:, 3:] @ shifts])
    return jnp.concatenate([sky, determinant(arrival, columns)[None], arrival[3:]]), derivatives


def _bare_image(arguments: Float[Array, "6"], near: Near, *, timed: bool) -> Array:
    """N, det J and the time of an image."""
    sky = image_direction(arguments, near)
    arrival, columns = jacobian(arguments[:3], sky, near.motion, timed=timed)
    return jnp.concatenate([sky, determinant(arrival, columns)[None], arrival[3:]])


timed_image = with_columns(partial(_bare_image, timed=True), partial(_image, timed=True))
image = with_columns(partial(_bare_image, timed=False), partial(_image, timed=False))


def images(
    spin: Any, radius: Any, inclination: Any, star: Any, near: Any, index: Any, velocity: Velocity = "fiducial"
) -> Images:
    """Images of a star on the celestial sphere, each next to a direction that is given.

    Parameters
    ----------
    spin, radius, inclination : float or (...)
        As in `direction`.
    star : (..., 2)
        theta', phi' of the star.
    near : (..., number, 3)
        Directions N next to the images: those of `star_images`, for a camera and a star not far from these. They are
        constants: derivatives with respect to them are 0.
    index : (..., number) of int
        Morse indices of the images: those of `star_images`.
    velocity : str or (float, float, float), optional
        As in `direction`.

    Returns
    -------
    Images
        NaN for an image that is lost.

    Errors
    ------
    For sky, 1e-13 or so times the ratio of the beam's major diameter to its minor one; for magnification, that times
    the same ratio. As for `direction`, each derivative loses one more power of it. These are absolute: from afar, where
    the direct image hardly changes, its derivatives have few digits.

    Notes
    -----
    The line of sight `near` ends somewhere on the celestial sphere. From there a great circle leads to the star; the
    image of a point that moves along it begins at `near`, and ends at the image that is returned. It is lost if the way
    meets a caustic, or if `near` is on the wrong side of a critical curve, where the parity is not that of `index`. So
    no image turns into its partner in a pair, but one that exists may be lost if the way to it is bent; then `near`
    must be closer.

    Derivatives are those of the implicit function theorem; Newton's method is not differentiated.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10, inclination=1.0, velocity="fiducial")
    >>> at = kc.star_images(camera, star=(1.4, 2.9), max_index=1)
    >>> kc.functional.images(0.9, 10, 1.0, (1.41, 2.9), at.sky, at.index).sky.shape
    (2, 3)
    """
    motion = motion_of(velocity)
    with float64():
        place, star, near = wide_place(spin, radius, inclination), wide("star", star), wide("near", near)
        check_axis("star", star, 2, "(..., 2)")
        check_axis("near", near, 3, "(..., number, 3)", axes=2)
        check_shapes(*place, star=star.shape[:-1], near=near.shape[:-2])
        return _images(place, star, near, parity_sign(index, near.shape[:-1]), motion)


@jax.jit
def _images(place: list[Array], star: Array, near: Array, sign: Array, motion: Moving) -> Images:
    prepare_compilation()
    arguments = with_place([x[..., None] for x in place], direction_of(star)[..., None, :])
    numbers = jnp.moveaxis(image_numbers(arguments, near, sign, motion, timed=True), -1, 0)
    return Images(jnp.moveaxis(numbers[:3], 0, -1), 1 / jnp.abs(numbers[3]), numbers[4])


def image_numbers(arguments: Array, near: Array, sign: Array, motion: Moving, *, timed: bool) -> Array:
    """N, det J, and the time of images, over leading axes."""
    shape = jnp.broadcast_shapes(arguments.shape[:-1], near.shape[:-1])
    flat = [jnp.broadcast_to(x, (*shape, x.shape[-1])).reshape(-1, x.shape[-1]) for x in (arguments, near)]
    sign = jnp.broadcast_to(sign, shape).ravel()
    function = timed_image if timed else image
    numbers = jax.vmap(lambda a, n, s: function(a, Near(n, s, motion)))(flat[0], flat[1], sign)
    return numbers.reshape(*shape, numbers.shape[-1])
