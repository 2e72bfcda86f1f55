"""The lens map of a camera next to a fold, as a polynomial whose coefficients JAX differentiates.

Rays at the nodes of a small patch of the camera sky are all that is traced. Folds, images and areas are those of the
polynomial, so that derivatives of the lens map cost no ray.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial import chebyshev

from kerrcaustics.beams.differentiable import end
from kerrcaustics.beams.moving import Moving
from kerrcaustics.functional.local_map import Vector, jacobian, smooth, tangents, unit

NODES = 13
"""Nodes of a patch along one side."""
REACH = 0.05
"""Half-width of the patch in which a fold is searched for, times the major diameter."""
# Most patches on the way to a fold.
_PATCHES = 40
# Steps of Newton's method to a root.
_STEPS = 8

Pair = Float[Array, "2"]
Residual = Callable[[Array], Array]


class SkySquare(NamedTuple):
    """A patch of the camera sky: its centre N, its axes (columns), and its half-widths along them."""

    centre: Vector
    axes: Float[Array, "3 2"]
    widths: Pair

    def sky(self, at: Pair) -> Vector:
        """The direction N at a place of the patch, which reaches from -1 to 1 along both axes."""
        return unit(self.centre + self.axes @ (self.widths * at))

    def area(self, at: Pair) -> Array:
        """The solid angle of the camera sky for one unit of area of the patch."""
        shift = self.widths * at
        return self.widths[0] * self.widths[1] * (1 + shift @ shift) ** -1.5


class ChebyshevPatch(NamedTuple):
    """Functions of the lens map on a patch: coefficients of products of Chebyshev polynomials."""

    coefficients: Float[Array, "nodes nodes numbers"]

    def __call__(self, at: Pair) -> Float[Array, " numbers"]:
        """The values at a place."""
        first, second = _polynomials(at, len(self.coefficients))
        return jnp.einsum("i,j,ijk->k", first, second, self.coefficients)

    def tail(self) -> Array:
        """The largest of the last coefficients, divided by the largest of all but the first."""
        size = jnp.abs(self.coefficients)
        last = jnp.maximum(size[-2:].max(), size[:, -2:].max())
        return last / jnp.maximum(size[1:].max(), size[:, 1:].max())


def _polynomials(at: Pair, count: int) -> Float[Array, "2 nodes"]:
    """Chebyshev polynomials at the two coordinates."""
    values = [jnp.ones(2), at]
    while len(values) < count:
        values.append(2 * at * values[-1] - values[-2])
    return jnp.stack(values, axis=-1)


def patch_of(
    numbers: Vector, place: SkySquare, motion: Moving, function: Callable[[Vector], Array], nodes: int = NODES
) -> ChebyshevPatch:
    """The polynomial of a function of n' on a patch.

    numbers: the spin, radius and inclination of the camera; nodes: along each side.
    """
    line = chebyshev.chebpts1(nodes)
    grid = jnp.stack(jnp.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    values = jax.vmap(lambda at: function(_ray(numbers, (place.sky(at), motion))))(grid)
    to = coefficients_from(line)
    return ChebyshevPatch(jnp.einsum("im,jn,mnk->ijk", to, to, values.reshape(nodes, nodes, -1)))


@smooth
def _ray(numbers: Vector, settings: tuple[Vector, Moving]) -> Vector:
    sky, motion = settings
    return end(jnp.concatenate([numbers, sky]), motion, timed=False)


def coefficients_from(nodes: np.ndarray) -> np.ndarray:
    """The matrix from values at nodes to coefficients of Chebyshev polynomials."""
    return np.linalg.inv(chebyshev.chebvander(nodes, len(nodes) - 1))


def root_of(residual: Residual, start: Array) -> Array:
    """A root by Newton's method, from a place next to it, as a constant."""
    return jax.lax.stop_gradient(jax.lax.fori_loop(0, _STEPS, lambda _, at: newton_step(residual, at), start))


def smooth_root(residual: Residual, start: Array) -> Array:
    """A root from a place next to it, with its derivatives."""
    return last_steps(residual, root_of(residual, start))


def last_steps(residual: Residual, root: Array) -> Array:
    """A root that is known as a constant, with its derivatives."""
    return newton_step(residual, newton_step(residual, root))


def newton_step(residual: Residual, at: Array) -> Array:
    """A place closer to a root. Its derivatives are right up to twice the order of those of the place before."""
    return at - jnp.linalg.solve(jax.jacfwd(residual)(at), residual(at))


def fold_determinant(patch: ChebyshevPatch, at: Pair) -> Array:
    """The Jacobian determinant of the first two numbers of a patch with respect to the place."""
    slopes = jax.jacfwd(patch)(at)
    return slopes[0, 0] * slopes[1, 1] - slopes[0, 1] * slopes[1, 0]


class FoldOnPatch(NamedTuple):
    """A point of a critical curve.

    place: the square of the camera sky next to the fold.
    patch: polynomials of n' there.
    at: coordinates of the fold on the patch.
    extra: further unknowns.
    found: False if there is no fold; the other fields are then undefined.
    """

    place: SkySquare
    patch: ChebyshevPatch
    at: Pair
    extra: Array
    found: Array

    @property
    def sky(self) -> Vector:
        """The direction N on the camera sky."""
        return self.place.sky(self.at)


# Zero at a point of a critical curve, for a patch, a step across the kernel there, and the unknowns.
Condition = Callable[[ChebyshevPatch, Pair, Array], Array]


def fold_where(numbers: Vector, near: Vector, motion: Moving, condition: Condition, extra: Array) -> FoldOnPatch:
    """The fold next to a direction at which a condition holds, as constants.

    numbers: the spin, radius and inclination of the camera; extra: further unknowns, next to the fold.
    """

    def look(now: tuple[FoldOnPatch, Vector, Array]) -> tuple[FoldOnPatch, Vector, Array]:
        last, sky, count = now
        _, columns = jacobian(numbers, sky, motion)
        place = SkySquare(sky, tangents(sky), jnp.full(2, REACH) / jnp.sqrt(jnp.sum(columns**2)))
        patch = patch_of(numbers, place, motion, lambda arrival: arrival)
        across = jnp.linalg.svd(columns)[2][0]
        root = root_of(partial(condition, patch, across), jnp.append(jnp.zeros(2), last.extra))
        inside = jnp.abs(root[:2]).max() < 1
        fold = FoldOnPatch(place, patch, root[:2], jnp.where(inside, root[2:], last.extra), inside)
        return fold, place.sky(jnp.clip(root[:2], -1, 1)), count + 1

    def goes_on(now: tuple[FoldOnPatch, Vector, Array]) -> Array:
        return ~now[0].found & (now[2] < _PATCHES)

    start = unit(near)
    nothing = ChebyshevPatch(jnp.zeros((NODES, NODES, 3)))
    first = FoldOnPatch(
        SkySquare(start, tangents(start), jnp.ones(2)), nothing, jnp.zeros(2), extra, jnp.asarray(False)
    )
    return jax.lax.stop_gradient(jax.lax.while_loop(goes_on, look, (first, start, jnp.asarray(0)))[0])
