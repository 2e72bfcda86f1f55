"""Directions next to which images and folds are looked for, from the certified searches."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from kerrcaustics.beams.differentiable import float64
from kerrcaustics.beams.moving import Moving, motion_of
from kerrcaustics.beams.program_cache import keep_programs
from kerrcaustics.curves.caustic import Caustic
from kerrcaustics.curves.caustic_search import caustics
from kerrcaustics.functional.disc_images import closest_fold
from kerrcaustics.functional.local_map import unit
from kerrcaustics.images.images import StarImages, star_images
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import instance_of, real_number
from kerrcaustics.spacetime.sphere import from_angles, lengths

Array = np.ndarray

# A star so close to a caustic, radians, may have a pair of images, on either side.
_ON_CAUSTIC = 1e-9


class StartingPoints(NamedTuple):
    """Arguments of `kc.functional.magnification`.

    near, indices: directions N next to single images (images, 3), and their Morse indices (images,); folds: directions
    next to the points of critical curves at which pairs of images are created (pairs, 3).
    """

    near: Float[Array, "images 3"]
    indices: Int[Array, " images"]
    folds: Float[Array, "pairs 3"]


def starting_points(camera: Camera, star: tuple[float, float], reach: float, max_index: int = 2) -> StartingPoints:
    """Directions next to the images of a star, and next to the folds whose caustics are close to it.

    Parameters
    ----------
    camera : Camera
    star : (theta', phi')
        Radians, on the celestial sphere.
    reach : float
        Radians: pairs of images are taken together where their caustic is this close to the star. At least five radii
        of a disc, or the length of the path of a star that crosses the caustic.
    max_index : int
        1 to 6: images with Morse index up to it. Discs that reach the caustic of the next order, where one image of a
        pair is left out, give NaN.

    Returns
    -------
    StartingPoints

    Raises
    ------
    ValueError
        If an argument is invalid, or a caustic within reach is a point.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.95, radius=5, inclination=1.3, velocity="fiducial")
    >>> kc.functional.starting_points(camera, (1.4, 2.9), 0.01).indices
    array([0, 1, 2])
    """
    instance_of("camera", camera, Camera)
    if not 0 < (reach := real_number("reach", reach)) < 1:
        raise ValueError(f"Argument `reach` must be an angle between 0 and 1 radian, but is {reach}.")
    images = star_images(camera, star, max_index)
    centre = from_angles(*star)
    single = np.ones(len(images), bool)
    folds = []
    for caustic in caustics(camera, max_index):
        for near in _closest_points(caustic, centre, reach):
            if caustic.kind == "point":
                raise ValueError(
                    f"Argument `star` lies next to the caustic of order {caustic.order}, which is a point."
                )
            folds.append(near)
            single[_pair(camera, centre, images, caustic.order, near)] = False
    return StartingPoints(images.sky[single], images.index[single], np.array(folds).reshape(-1, 3))


def _closest_points(caustic: Caustic, centre: Float[Array, " 3"], reach: float) -> Float[Array, "points 3"]:
    """Points of a critical curve at which its caustic comes closest to a star, those within reach."""
    ends = from_angles(*caustic.celestial.T)
    away = lengths(ends - centre)
    if caustic.kind == "point":
        return caustic.sky[:1][away[:1] < reach]
    # Between stored points a caustic leaves its chord by much less than half of the chord.
    chord = lengths(ends - np.roll(ends, 1, axis=0))
    after = np.roll(ends, -1, axis=0)
    part = np.clip(((centre - ends) * (after - ends)).sum(axis=1) / np.roll(chord, -1) ** 2, 0, 1)
    nearest = lengths(ends + part[:, None] * (after - ends) - centre)
    least = (away <= np.roll(away, 1)) & (away <= np.roll(away, -1))
    return caustic.sky[least & (np.minimum(nearest, np.roll(nearest, 1)) < reach)]


def _pair(
    camera: Camera, centre: Float[Array, " 3"], images: StarImages, order: int, near: Float[Array, " 3"]
) -> list[int]:
    """The pair of images next to a fold; none on the dark side of its caustic."""
    assert camera.velocity is not None
    with float64():
        place = jnp.asarray([camera.spin, camera.radius, camera.inclination])
        skies, reach = _pair_skies(place, jnp.asarray(centre), jnp.asarray(near), motion_of(camera.velocity))
    skies, reach = np.asarray(skies), float(reach)
    pair = []
    for index in (order - 1, order):
        candidates = np.flatnonzero(images.index == index)
        away = lengths(images.sky[candidates, None] - skies).min(axis=1, initial=np.inf)
        if away.min(initial=np.inf) < reach:
            pair.append(int(candidates[away.argmin()]))
    return pair


@jax.jit
def _pair_skies(place: jax.Array, centre: jax.Array, near: jax.Array, motion: Moving) -> tuple[jax.Array, jax.Array]:
    """Directions next to the two images of a pair, and how close the images are to them.

    On the dark side of the caustic, 0; of a star that is on it within rounding, more than the distance of the images.
    """
    keep_programs()
    fold, shape = closest_fold(place, centre, near, motion)
    depth = (centre - unit(fold.patch(fold.at))) @ shape.across
    step = jnp.sqrt((jnp.abs(depth) + _ON_CAUSTIC) / shape.bend[0])
    skies = [unit(fold.sky + sign * step * shape.axes[:, 0]) for sign in (1, -1)]
    return jnp.stack(skies), jnp.where(depth > -_ON_CAUSTIC, 2 * step, 0)
