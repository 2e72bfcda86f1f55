"""The magnification of a disc as a function of the hole, the camera and the disc, through a caustic."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss

from kerrcaustics.beams.differentiable import float64
from kerrcaustics.beams.moving import Moving, motion_of
from kerrcaustics.beams.program_cache import prepare_compilation
from kerrcaustics.functional.fold_patch import (
    ChebyshevPatch,
    FoldOnPatch,
    Pair,
    SkySquare,
    coefficients_from,
    fold_determinant,
    fold_where,
    last_steps,
    patch_of,
    root_of,
    smooth_root,
)
from kerrcaustics.functional.image_roots import Near, root
from kerrcaustics.functional.local_map import Vector, determinant, jacobian, smooth, tangents, unit
from kerrcaustics.functional.traced_arguments import (
    check_axis,
    check_shapes,
    direction_of,
    flattened,
    parity_sign,
    wide,
    wide_place,
    with_place,
)
from kerrcaustics.spacetime.camera import Velocity

# Of the integral along the limb, and of each integral from a fold to the limb, by Gauss and Legendre.
_NODES = 32, 8
# Fewer of both, for the error; and the relative difference below which that is about its square.
_FEWER, _AGREES = (20, 5), 1e-4
# Of the caustic within the disc.
_LINE = 9
# Width of a patch over that of its images.
_MARGIN = 1.3
# Largest tail of the polynomials of a patch.
_RESOLVED = 1e-7
# Largest length of an image over that implied by the slopes at its centre.
_LONGER = 10
# Largest coordinate on a patch at which it is valid.
_WITHIN = 1.02
_LINE_AT = chebyshev.chebpts1(_LINE)
_TO_LINE = coefficients_from(_LINE_AT)
# Nodes of the patch of a single image, along one side.
_IMAGE_NODES = 9
# Nodes of the integral over a disc in the square of the radius: exact for polynomials of degree 11.
_RINGS = 6
# Nodes of it in angle.
_TURNS = 12
_SQUARES, _DISC_SHARES = leggauss(_RINGS)
_DISC_SHARES = _DISC_SHARES / 2
_ANGLES = 2 * np.pi / _TURNS * np.arange(_TURNS)
_DISC = np.sqrt((1 + _SQUARES) / 2)[:, None, None] * np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)


class DiscSource(NamedTuple):
    """A disc on the celestial sphere: its centre, its radius in Lambert's equal-area plane, and the axes there.

    x is across a caustic, toward the side on which there is one more pair of images, y along it.
    """

    centre: Vector
    radius: Array
    axes: Float[Array, "3 2"]

    def in_plane(self, arrival: Vector) -> Pair:
        """A direction in the plane."""
        arrival = unit(arrival)
        return self.axes.T @ arrival * jnp.sqrt(2 / (1 + self.centre @ arrival))

    def star(self, x: Array, y: Array) -> Vector:
        """The direction at a place of the plane."""
        square = x * x + y * y
        return self.centre * (1 - square / 2) + (self.axes @ jnp.stack([x, y])) * jnp.sqrt(1 - square / 4)


def magnification(
    spin: Any,
    radius: Any,
    inclination: Any,
    star: Any,
    size: Any,
    near: Any,
    index: Any,
    folds: Any,
    velocity: Velocity = "fiducial",
) -> Float[Array, "..."]:
    """The magnification of a uniform disc on the celestial sphere, also while it passes through a caustic.

    Parameters
    ----------
    spin, radius, inclination : float or (...)
        As in `direction`.
    star : (..., 2)
        theta', phi' of its centre.
    size : float or (...)
        Its angular radius, radians.
    near : (..., single, 3)
        Directions N next to single images, without those of the pairs next to `folds`.
    index : (..., single) of int
        Morse indices of single images.
    folds : (..., pairs, 3)
        Directions N next to points of critical curves at which pairs of images are created, on both sides of the
        caustic. All three come from `starting_points`, and are constants: derivatives with respect to them are 0.
    velocity : str or (float, float, float), optional
        As in `direction`.

    Returns
    -------
    (...) float64; NaN where an image or a fold is lost, or the lens map over one of them is not resolved.

    Errors
    ------
    Next to regular folds 1e-12 or so, relative, and derivatives 1e-8, while the disc is small compared with its
    distance from cusps and from caustics other than those of `folds`. Where two thirds of the nodes, or half of them,
    change an integral by more than 1e-4 of itself, the value is NaN. Where the limb nearly touches a caustic,
    derivatives grow without bound, as the logarithm of the distance. `kc.magnification`, which is certified, gives the
    error of a value.

    Notes
    -----
    On a small patch of the camera sky that holds an image, or a pair of images with the critical curve between them,
    the lens map is a polynomial through rays, whose coefficients are differentiated. The coordinates of a star next to
    a fold are its place along the caustic and the square root of its distance from it: as functions of these, both
    images of a pair are one smooth function, and nothing diverges. The area of the pair is one integral along the part
    of the limb on the bright side.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.95, radius=5, inclination=1.3, velocity="fiducial")
    >>> star = (1.4, 2.9)
    >>> start = kc.functional.starting_points(camera, star, 0.01)
    >>> seen = kc.functional.magnification(0.95, 5, 1.3, star, 1e-3, *start)
    >>> abs(float(seen) / kc.magnification(camera, star, 1e-3).total - 1) < 1e-9
    True
    """
    motion = motion_of(velocity)
    with float64():
        place, star, size = wide_place(spin, radius, inclination), wide("star", star), wide("size", size)
        near, folds = wide("near", near), wide("folds", folds)
        check_axis("star", star, 2, "(..., 2)")
        if not isinstance(size, Tracer) and not ((size > 0) & (size < 1)).all():
            raise ValueError("Argument `size` must lie between 0 and 1 radian.")
        for name, value in (("near", near), ("folds", folds)):
            check_axis(name, value, 3, "(..., number, 3)", axes=2)
        check_shapes(*place, star=star.shape[:-1], size=size.shape, near=near.shape[:-2], folds=folds.shape[:-2])
        return _magnification(place, star, size, near, parity_sign(index, near.shape[:-1]), folds, motion)


@jax.jit
def _magnification(
    place: list[Array], star: Array, size: Array, near: Array, sign: Array, folds: Array, motion: Moving
) -> Array:
    prepare_compilation()
    arguments = with_place([*place, size], direction_of(star))
    shape = jnp.broadcast_shapes(arguments.shape[:-1], near.shape[:-2], folds.shape[:-2])
    flat = [flattened(x, shape, n) for x, n in ((arguments, 1), (near, 2), (sign, 1), (folds, 2))]
    return jax.vmap(lambda one, *given: _disc(one, ImageDirections(*given, motion=motion)))(*flat).reshape(shape)


class ImageDirections(NamedTuple):
    """Directions next to single images, the signs of det J there, directions next to folds, and the camera's motion."""

    near: Float[Array, "images 3"]
    sign: Float[Array, " images"]
    folds: Float[Array, "pairs 3"]
    motion: Moving


@smooth
def _disc(arguments: Float[Array, "7"], parts: ImageDirections) -> Float[Array, "1"]:
    """The magnification; arguments: the camera's three numbers, the size of the disc, and the star."""
    numbers, centre = arguments[:3], unit(arguments[4:])
    disc = DiscSource(centre, 2 * jnp.sin(arguments[3] / 2), tangents(centre))
    total = jnp.zeros(())
    if len(parts.near):
        image = partial(_image_area, numbers, disc)
        total += jax.vmap(lambda near, sign: image(Near(near, sign, parts.motion)))(parts.near, parts.sign).sum()
    if len(parts.folds):
        total += jax.vmap(lambda near: pair_area(numbers, disc, near, parts.motion))(parts.folds).sum()
    return (total / (jnp.pi * disc.radius**2))[None]


def _image_area(numbers: Vector, disc: DiscSource, near: Near) -> Array:
    """The solid angle of one image of a disc, by an integral over the disc."""
    fixed = jax.lax.stop_gradient
    place = _place_of_image(fixed(numbers), fixed(disc), near)
    patch = patch_of(numbers, place, near.motion, disc.in_plane, _IMAGE_NODES)
    images = jax.vmap(jax.vmap(partial(_inside, patch)))(disc.radius * jnp.asarray(_DISC))
    densities = jax.vmap(jax.vmap(partial(_density, place, patch)))(images)
    area = jnp.pi * disc.radius**2 * (densities.mean(axis=-1) @ _DISC_SHARES)
    # A rule of half as many turns shows whether the density is resolved.
    fewer = jnp.pi * disc.radius**2 * (densities[:, ::2].mean(axis=-1) @ _DISC_SHARES)
    resolved = (fixed(patch.tail()) < _RESOLVED) & (jnp.abs(fixed(fewer / area) - 1) < _AGREES)
    return jnp.where(resolved & (jnp.abs(fixed(images)).max() < _WITHIN), area, jnp.nan)


def _place_of_image(numbers: Vector, disc: DiscSource, near: Near) -> SkySquare:
    """A patch that holds one image of a disc: first by the lens map's slopes, then by that patch."""
    sky = root(jnp.concatenate([numbers, disc.centre]), near)
    _, columns = jacobian(numbers, sky, near.motion)
    _, sizes, right = jnp.linalg.svd(columns)
    place = SkySquare(sky, tangents(sky) @ right.T, _MARGIN * disc.radius / sizes)
    patch = patch_of(numbers, place, near.motion, disc.in_plane, _IMAGE_NODES)
    limb = jax.vmap(partial(_inside, patch))(disc.radius * jnp.asarray(_DISC[-1] / np.linalg.norm(_DISC[-1, 0])))
    return place._replace(widths=_MARGIN * place.widths * jnp.clip(jnp.abs(limb).max(axis=0), 0.5, _LONGER))


def _inside(patch: ChebyshevPatch, goal: Pair) -> Pair:
    """The image of a place of the disc, in the patch of one image."""
    start = jnp.linalg.solve(jax.jacfwd(patch)(jnp.zeros(2)), goal)
    return smooth_root(lambda at: patch(at) - goal, jax.lax.stop_gradient(start))


def _density(place: SkySquare, patch: ChebyshevPatch, at: Pair) -> Array:
    """Solid angle of the camera sky for one unit of area of the disc."""
    return place.area(at) / jnp.abs(fold_determinant(patch, at))


class Shape(NamedTuple):
    """The lens map at a fold.

    axes: steps on the camera sky along the kernel of J and across it, columns.
    across: normal of the caustic, toward the bright side.
    bend: displacement of the star across the caustic and along it, per square of a step along the kernel.
    major: major diameter of the beam.
    """

    axes: Float[Array, "3 2"]
    across: Vector
    bend: Pair
    major: Array


def pair_area(numbers: Vector, disc: DiscSource, near: Vector, motion: Moving) -> Array:
    """The solid angle of the images of a disc that form a pair next to a fold; 0 beyond the caustic."""
    fixed = jax.lax.stop_gradient
    fold, shape = closest_fold(fixed(numbers), fixed(disc.centre), near, motion)
    across = unit(shape.across - disc.centre * (shape.across @ disc.centre))
    disc = disc._replace(axes=jnp.stack([across, jnp.cross(disc.centre, across)], axis=-1))
    place = _place_of_pair(fold, shape, fixed(disc))
    patch = patch_of(numbers, place, motion, disc.in_plane)
    resolved = fold.found & (fixed(patch.tail()) < _RESOLVED)
    caustic = _caustic(patch, disc.radius)
    areas = [_integral(patch, place, disc, caustic, rule) for rule in (_NODES, _FEWER)]
    resolved &= jnp.abs(fixed(areas[1] - areas[0])) < _AGREES * fixed(disc.radius**2 + jnp.abs(areas[0]))
    return jnp.where(resolved, areas[0], jnp.nan)


def closest_fold(numbers: Vector, centre: Vector, near: Vector, motion: Moving) -> tuple[FoldOnPatch, Shape]:
    """The fold whose caustic is closest to a star, next to a direction, and the lens map there; constants."""
    fold = fold_where(numbers, near, motion, partial(_closest, centre), jnp.zeros(0))
    return fold, _shape(fold)


def _closest(centre: Vector, patch: ChebyshevPatch, across: Pair, at: Pair) -> Pair:
    """Zero where the beam at a place has no area and its end is the closest of its caustic to a star."""
    arrival, columns = patch(at), jax.jacfwd(patch)(at)
    return jnp.stack([(columns @ across) @ (arrival - centre), determinant(arrival, columns)])


def _shape(fold: FoldOnPatch) -> Shape:
    place, patch, at = fold.place, fold.patch, fold.at
    arrival, sky = patch(at), fold.sky
    end_axes, sky_axes = tangents(arrival), tangents(sky)
    steps = sky_axes.T @ jax.jacfwd(place.sky)(at)
    left, sizes, right = jnp.linalg.svd(end_axes.T @ jax.jacfwd(patch)(at) @ jnp.linalg.inv(steps))
    kernel, beside = right[1], right[0]
    step = jnp.linalg.solve(steps, kernel)
    bend = jnp.einsum("kij,i,j->k", jax.jacfwd(jax.jacfwd(patch))(at), step, step) / 2
    across = end_axes @ left[:, 1]
    across = across * jnp.sign(across @ bend)
    along = jnp.cross(arrival, across)
    beside = beside * jnp.sign(along @ (end_axes @ left[:, 0]))
    return Shape(sky_axes @ jnp.stack([kernel, beside], -1), across, jnp.stack([across @ bend, along @ bend]), sizes[0])


def _place_of_pair(fold: FoldOnPatch, shape: Shape, disc: DiscSource) -> SkySquare:
    """A patch that holds the pair's images of a disc, and the critical curve between them."""
    caustic = disc.in_plane(fold.patch(fold.at))[0]
    far = jnp.maximum(disc.radius - caustic, 0.1 * disc.radius)
    along = disc.radius + jnp.abs(shape.bend[1] / shape.bend[0]) * far
    return SkySquare(fold.sky, shape.axes, _MARGIN * jnp.stack([jnp.sqrt(far / shape.bend[0]), along / shape.major]))


def _caustic(patch: ChebyshevPatch, radius: Array) -> tuple[Float[Array, " nodes"], Float[Array, "nodes 2"]]:
    """x of the caustic, and the place of the fold, as Chebyshev polynomials of y / radius."""
    fixed = jax.lax.stop_gradient
    slope = fixed(jax.jacfwd(patch)(jnp.zeros(2))[1, 1])

    def fold(y: Array) -> Array:
        def residual(at: Pair) -> Pair:
            return jnp.stack([patch(at)[1] - y, fold_determinant(patch, at)])

        at = smooth_root(residual, jnp.stack([0.0, fixed(y) / slope]))
        return jnp.append(patch(at)[:1], at)

    values = jnp.asarray(_TO_LINE) @ jax.vmap(fold)(radius * _LINE_AT)
    return values[:, 0], values[:, 1:]


def _series(coefficients: Array, at: Array) -> Array:
    """The sum of Chebyshev polynomials."""
    before, now = jnp.ones_like(at), at
    total = coefficients[0] + coefficients[1] * now
    for one in coefficients[2:]:
        before, now = now, 2 * at * now - before
        total = total + one * now
    return total


def _ends(caustic: Array, radius: Array) -> Float[Array, "2"]:
    """The angles from x, to both sides, to which a limb is on the bright side of a caustic: 0 to pi."""

    def depth(angle: Array) -> Array:
        return jnp.cos(angle) - _series(caustic, jnp.sin(angle)) / radius

    def end(sense: float) -> Array:
        middle = caustic[0] - caustic[2]
        first = jax.lax.stop_gradient(jnp.arccos(jnp.clip(middle / radius, -0.999999, 0.999999)))
        crossed = (depth(jnp.zeros(())) > 0) & (depth(jnp.asarray(jnp.pi)) < 0)
        # Elsewhere any other function, whose root is a number.
        root = smooth_root(lambda a: jnp.where(crossed, depth(sense * a), a - first), first[None])[0]
        return jnp.where(crossed, root, jnp.where(depth(jnp.zeros(())) > 0, jnp.pi, 0.0))

    return jnp.stack([end(1.0), end(-1.0)])


def _integral(
    patch: ChebyshevPatch, place: SkySquare, disc: DiscSource, caustic: tuple[Array, Array], rule: tuple[int, int]
) -> Array:
    """The area of a pair's images, NaN if they leave the patch: limb integral of E dy, E that from caustic to limb."""
    line, folds = caustic
    (nodes, shares), (across_nodes, across_shares) = map(leggauss, rule)
    ends = _ends(line, disc.radius)
    turns = jnp.pi / 2 * nodes
    middle, half = (ends[0] - ends[1]) / 2, (ends[0] + ends[1]) / 2
    angles = middle + half * jnp.sin(turns)
    weights = jnp.pi / 2 * shares * half * jnp.cos(turns) * disc.radius * jnp.cos(angles)
    y = disc.radius * jnp.sin(angles)
    inside = disc.radius * jnp.cos(angles) - _series(line, jnp.sin(angles))
    root = jnp.sqrt(jnp.where(inside > 0, inside, 1.0))

    def densities(y: Array, parts: Array) -> tuple[Array, Array]:
        """Densities of both images at one y, and their distances from the middle of the patch."""
        x, start = _series(line, y / disc.radius), jax.vmap(_series, (1, None))(folds, y / disc.radius)
        goals = jnp.stack([x + parts**2, jnp.full(len(parts), y)], axis=-1)

        def images(sense: float) -> Float[Array, "parts 2"]:
            near = _from_fold(*jax.lax.stop_gradient((patch, start, sense, goals, parts)))
            return jax.vmap(lambda goal, at: last_steps(lambda at: patch(at) - goal, at))(goals, near)

        pair = jnp.stack([images(1.0), images(-1.0)])
        sizes = jax.vmap(jax.vmap(partial(_density, place, patch)))(pair)
        return 2 * parts * sizes.sum(axis=0), jnp.abs(pair).max()

    parts = root[:, None] * (1 + across_nodes) / 2
    each, away = jax.vmap(densities)(y, parts)
    inner = root * (each @ across_shares) / 2
    within = jax.lax.stop_gradient(jnp.where(inside > 0, away, 0.0)).max() < _WITHIN
    return jnp.where(within, jnp.sum(jnp.where(inside > 0, weights * inner, 0.0)), jnp.nan)


def _from_fold(
    patch: ChebyshevPatch, fold: Pair, sense: float, goals: Float[Array, "parts 2"], parts: Float[Array, " parts"]
) -> Float[Array, "parts 2"]:
    """Images of places farther and farther from a fold, on one side of it: at the squares of parts."""
    left, _, right = jnp.linalg.svd(jax.jacfwd(patch)(fold))
    kernel, across = right[1] * jnp.sign(right[1, 0]), left[:, 1]
    bend = across @ (jax.jacfwd(jax.jacfwd(patch))(fold) @ kernel @ kernel) / 2
    start = sense * jnp.sqrt(jnp.abs(across[0] / bend)) * kernel

    def following(last: tuple[Array, Array], now: tuple[Pair, Array]) -> tuple[tuple[Array, Array], Pair]:
        # The way from the fold, by the part, goes on as a straight line from the two before.
        slopes, at_parts = last
        goal, part = now
        ahead = slopes[1] + (slopes[1] - slopes[0]) * (part - at_parts[1]) / (at_parts[1] - at_parts[0])
        at = root_of(lambda at: patch(at) - goal, fold + part * ahead)
        return (jnp.stack([slopes[1], (at - fold) / part]), jnp.stack([at_parts[1], part])), at

    first = jnp.stack([start, start]), jnp.stack([-parts[0], 0.0])
    return jax.lax.scan(following, first, (goals, parts))[1]
