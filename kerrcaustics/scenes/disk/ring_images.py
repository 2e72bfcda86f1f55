"""Images of the rings of a disk on a viewer's sky, one place for each ring and turn.

For sums over a disk: few beams give each place and its solid angle, but the viewer must be off the plane, and the
radius must grow outward from the middle. tracks/isoradials.py computes whole curves of a ring for any viewer.
"""

import math
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.lens_map.plane_map import PlaneMap
from kerrcaustics.lens_map.search_sky import TOLERANCE, magnified
from kerrcaustics.lens_map.sky_lines import Lines
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.sphere import tangent_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Smallest distance from the middle, M, as on a plane at the hole.
_INNERMOST = 1e-6
# Difference in ln r above which there is no image.
_TAKEN = 1e-6


class RingImages(NamedTuple):
    """Places of n rings on the viewer's sky, each at one turn about the middle of the horizon; NaN for no image.

    sky: (n, axes) places.
    solid_angle: (n,) solid angles per unit of ln r and radian of turn: sr, or M^2 for an observer.
    redshift: (n,) ratios nu_camera / nu_emitter.
    rays: number of rays traced in all.
    """

    sky: Array
    solid_angle: Array
    redshift: Array
    rays: int


def middle(camera: Viewer) -> Float[Array, "3"]:
    """Direction N (3,) of the principal null ray, which falls in at constant inclination.

    For an observer, on the engines' sphere.
    """
    frame = camera.frame()
    scale, momentum = frame.cylindrical_scale / frame.zoom, frame.spin * frame.sin_theta
    along_phi = momentum * frame.lapse / (scale * (1 - frame.shift * frame.sin_theta * momentum))
    motion = np.array([[math.sqrt(1 - along_phi**2), 0.0, along_phi]])
    return sky_from_fido(frame, magnified(frame, motion)[0])


def ring_images(
    viewer: Viewer, radius: Float[Array, " n"], turn: Float[Array, " n"], crossing: int, motion: str
) -> RingImages:
    """Images of the crossing of the plane with this number at radii (n,), at turns (n,) about the middle.

    The radius is assumed to grow with the angle from the middle.
    """
    lens_map = LensMap(viewer, EquatorialPlane(crossing, motion))
    sky, camera = lens_map.sky, lens_map.sky.search_camera
    plane_map = PlaneMap(camera, EquatorialPlane(crossing), "auto", TOLERANCE)
    lines = _lines(camera, turn)
    images = plane_map.on_circles(lines, radius, np.sqrt(lines.first * lines.last))
    light = lens_map.light_at(images.sky)
    missing = ~(images.miss(radius) < _TAKEN)
    per_cell = np.sin(images.distance) / images.slope * sky.lengths(images.sky) ** 2
    return RingImages(
        sky=np.where(missing[:, None], np.nan, light.sky),
        solid_angle=np.where(missing, np.nan, per_cell),
        redshift=np.where(missing, np.nan, light.redshift),
        rays=plane_map.beams_traced + len(turn),
    )


def _lines(camera: Viewer, turn: Float[Array, " n"]) -> Lines:
    """Lines from the middle outward."""
    centre, frame = middle(camera), camera.frame()
    first, second = tangent_basis(centre)
    ahead = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    start, innermost = np.broadcast_to(centre, ahead.shape), _INNERMOST / (frame.zoom * frame.radius)
    return Lines(turn, start, ahead, np.full(len(turn), innermost), np.full(len(turn), math.pi))
