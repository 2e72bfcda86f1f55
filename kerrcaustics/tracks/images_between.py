"""Images of a circling source at given azimuths: between the nodes of its tracks, or by a full search."""

import math

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.images import StarImages, images_of
from kerrcaustics.images.search import search
from kerrcaustics.level_curves.between_nodes import images_on
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.level_tracks import level_curve

Array = np.ndarray

_TURN = 2 * math.pi


def images_at_azimuths(
    camera: Viewer, surface: End, level: float, max_index: int, phi: Float[Array, " moments"]
) -> list[StarImages]:
    """All images of a source at several azimuths relative to the camera."""
    certificate = certificate_of(surface, camera, max_index)
    if not certificate.follows:
        stars = [(level, angle) for angle in (phi % _TURN).tolist()]
        return images_of(camera, surface, stars, certificate.images(np.array(stars)))
    branches = level_curve(camera, surface, level, max_index)
    phi, between, sure = images_on(branches, phi)
    stars = [(level, angle) for angle in (phi % _TURN).tolist()]
    whole = images_of(camera, surface, stars, between)
    doubtful = np.flatnonzero(~sure)
    if doubtful.size:
        searched = search(branches.sheets, branches.circle.place(phi[doubtful]))
        images = images_of(camera, surface, [stars[i] for i in doubtful], searched)
        for i, one in zip(doubtful.tolist(), images, strict=True):
            whole[i] = one
    return whole
