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
    """Rays to aim at a ball: directions on the search sky, and times.

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

    Places are lengths across the ray, in the source's frame, along the axes t and n of the aim.

    sky: direction N on the search sky.
    time: emission time, GM/c^3.
    time_deficit: time by which the emission time is too early, GM/c^3.
    place: xi_t and xi_n.
    by_sky: change of place with the direction.
    by_time: change of place with the emission time.
    light: g^4 per solid angle of the search sky.
    relative_error: that of places and light, by curvature in the ball and along the ray, and by errors of the beam.
    index_kept: True if the Morse index is low enough.
    """

    sky: Float[Array, "n 3"]
    time: Float[Array, " n"]
    time_deficit: Float[Array, " n"]
    place: Float[Array, "n 2"]
    by_sky: Float[Array, "n 2 2"]
    by_time: Float[Array, "n 2"]
    light: Float[Array, " n"]
    relative_error: Float[Array, " n"]
    index_kept: Bool[Array, " n"]

    @property
    def spine(self) -> Float[Array, "n 3"]:
        """Unit tangents of the curve on the sky along which xi_t is 0, the spine of the image."""
        first, second = tangent_basis(self.sky)
        slope = self.by_sky[:, 0] / lengths(self.by_sky[:, 0])[:, None]
        return slope[:, 1:] * first - slope[:, :1] * second

    @property
    def steepest(self) -> Float[Array, " n"]:
        """Frobenius norm of the change of the place with the direction."""
        return np.sqrt((self.by_sky**2).sum(axis=(1, 2)))

    def slices(self, ahead: Float[Array, "n 3"], size: float) -> tuple[Array, Array, Array, Array]:
        """Slices by the linear map: 1 - (distance from the centre / radius)^2, width, middle, direction."""
        side = np.cross(ahead, self.sky)
        side /= lengths(side)[:, None]
        slope = np.stack([(side * e).sum(axis=1) for e in tangent_basis(self.sky)], axis=-1)
        change = (self.by_sky @ slope[:, :, None])[:, :, 0]
        square, half = (change**2).sum(axis=1), (change * self.place).sum(axis=1)
        root = half**2 - square * ((self.place**2).sum(axis=1) - size**2)
        with np.errstate(invalid="ignore", divide="ignore"):
            return root / square / size**2, 2 * np.sqrt(np.maximum(root, 0)) / square, -half / square, side

    def remaining_part(self, ahead: Float[Array, "n 3"], size: float) -> Float[Array, " n"]:
        """1 - (distance of the slice from the centre / radius)^2; negative beyond image and last index."""
        return np.where(self.index_kept, self.slices(ahead, size)[0], -1.0)


def axes_at(rays: Arrivals) -> Float[Array, "n 2 3"]:
    """The directions across rays in which the place changes most and least over the sky: next to a fold t and n."""
    directions = np.linalg.svd(rays.by_sky)[0]
    return np.einsum("nab,anc->nbc", directions, rays.transverse_steps)
