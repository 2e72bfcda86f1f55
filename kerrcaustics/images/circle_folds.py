"""Errors of the image of a circle in the plane: of its points, and of the folds at which its azimuth turns back."""

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.images.circle_arcs import Arcs
from kerrcaustics.shapes import Float, Int

Array = np.ndarray


def node_errors(arcs: Arcs, beams: Beams) -> Float[Array, " nodes"]:
    """Errors of the nodes' directions, radians.

    At a fold the ratio of the beam's diameters vanishes: the error of the direction is that of the ratio divided by its
    slope, taken from the neighbouring nodes.
    """
    low = arcs.low
    size = np.where(low.ratio == 0, 1, np.abs(low.ratio))
    miss = np.abs(np.log(low.radius / arcs.radius))
    plain = arcs.radius * (low.error + miss) / np.where(low.minor == 0, 1, low.minor)
    gaps = (np.linalg.norm(low.sky - np.roll(low.sky, k, axis=0), axis=1) / np.roll(size, k) for k in (1, -1))
    return np.where(arcs.folded, np.maximum(*gaps) * beams.diameter_error, plain)


def fold_errors(arcs: Arcs) -> Float[Array, " folds"]:
    """Errors of the azimuth of folds: those of the rays, and their distance from the circle times the caustic's slope.

    The beams are flat, so that J's rows, (dr, r dphi), are along the caustic.
    """
    folds = arcs.low[arcs.folded]
    if not len(folds.edge_phase):
        return folds.edge_phase
    beams = arcs.circles.beams_at(folds.edge_phase, folds.distance)
    along_r, along_phi = np.linalg.norm(beams.jacobian, axis=-1).T
    miss = np.abs(np.log(np.asarray(beams.radius) / arcs.radius))
    return np.asarray(beams.error + (beams.error + miss) * along_phi / along_r)


def fold_orders(arcs: Arcs) -> Int[Array, " folds"]:
    """The order of the caustic at each fold: the larger index of the images that meet there."""
    return np.maximum(arcs.index, np.roll(arcs.index, 1))[arcs.folded]
