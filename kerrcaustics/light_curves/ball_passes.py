"""Rays past a ball: aims, and places at which they pass it."""

from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.light_curves.arrivals import Arrivals
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import lengths, tangent_basis

Array = np.ndarray


@dataclass(frozen=True)
class RayAims(Rows):
    """Directions on the search sky at which slices of a ball are taken.

    sky: Directions N.
    time: Emission times, GM/c^3.
    arrival: Times of the viewer, GM/c^3.
    second: True if the ray arrives at the sphere for the second time.
    axes: t and n across the ray, as dr, dtheta, sin theta dphi.
    """

    sky: Float[Array, "n 3"]
    time: Float[Array, " n"]
    arrival: Float[Array, " n"]
    second: Bool[Array, " n"]
    axes: Float[Array, "n 2 3"]

    def with_directions(self, sky: Float[Array, "n 3"], time: Float[Array, " n"]) -> "RayAims":
        """The same axes at other directions and emission times."""
        return replace(self, sky=sky, time=time)


@dataclass(frozen=True)
class Passes(Rows):
    """Rays that arrive at a time: the places (xi_t, xi_n) at which they pass the ball, and derivatives of these.

    sky: direction N on the search sky.
    time: emission time, GM/c^3.
    time_deficit: time by which the emission time is too early, GM/c^3.
    place: xi_t and xi_n.
    by_sky: change of place with the direction.
    by_time: change of place with the emission time.
    light: g^4 per solid angle of the search sky.
    bend: relative error of place, by curvature within the ball and along the ray, and by errors of the ray.
    inside: True if the Morse index is low enough.
    """

    sky: Float[Array, "n 3"]
    time: Float[Array, " n"]
    time_deficit: Float[Array, " n"]
    place: Float[Array, "n 2"]
    by_sky: Float[Array, "n 2 2"]
    by_time: Float[Array, "n 2"]
    light: Float[Array, " n"]
    bend: Float[Array, " n"]
    inside: Bool[Array, " n"]

    @property
    def spine(self) -> Float[Array, "n 3"]:
        """The direction of the spine."""
        first, second = tangent_basis(self.sky)
        slope = self.by_sky[:, 0] / lengths(self.by_sky[:, 0])[:, None]
        return slope[:, 1:] * first - slope[:, :1] * second

    @property
    def steepest(self) -> Float[Array, " n"]:
        """The largest change of the place with the direction, nearly."""
        return np.sqrt((self.by_sky**2).sum(axis=(1, 2)))

    def slices(self, ahead: Float[Array, "n 3"], size: float) -> tuple[Array, Array, Array, Array]:
        """Slices by the linear map: the part of the radius squared that is left, width, middle, direction."""
        side = np.cross(ahead, self.sky)
        side /= lengths(side)[:, None]
        slope = np.stack([(side * e).sum(axis=1) for e in tangent_basis(self.sky)], axis=-1)
        change = (self.by_sky @ slope[:, :, None])[:, :, 0]
        square, half = (change**2).sum(axis=1), (change * self.place).sum(axis=1)
        root = half**2 - square * ((self.place**2).sum(axis=1) - size**2)
        with np.errstate(invalid="ignore", divide="ignore"):
            return root / square / size**2, 2 * np.sqrt(np.maximum(root, 0)) / square, -half / square, side

    def remaining_part(self, ahead: Float[Array, "n 3"], size: float) -> Float[Array, " n"]:
        """The part that is left to the tip of the image, 1 to 0; negative beyond it, and beyond the last index."""
        return np.where(self.inside, self.slices(ahead, size)[0], -1.0)


def axes_at(rays: Arrivals) -> Float[Array, "n 2 3"]:
    """The directions across rays in which the place changes most and least over the sky: next to a fold t and n."""
    directions = np.linalg.svd(rays.by_sky)[0]
    return np.einsum("nab,anc->nbc", directions, rays.transverse_steps)
