"""Question 4: images of great circles and of equatorial stars, for a camera on the equator."""

from dataclasses import dataclass

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.trace import rays_of_directions
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.spacetime.frame import fido_from_sky, sky_from_fido
from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

_TOLERANCE = 1e-12
# |n_theta| of light in the equatorial plane.
_IN_PLANE = 1e-9
PLACES = ("on the prograde line", "on the retrograde line", "off the line")


def line_between(sheets: Sheets, turn: float, index: int, points: int) -> tuple[Array, Array, Array]:
    """The line of the sky at `turn` between the critical curves of order index and index + 1.

    Returns directions N (n, 3), their images n' (n, 3), and the unwrapped phi' (n,).
    """
    sheet = sheets.sheets[index]
    turns = np.full(points, turn)
    sky = sheets.sky(sky_lines.line_of_sight(sheets.camera, turns, sheet.depth(turns, np.linspace(0, 1, points))))
    rays = rays_of_directions(sheets.camera, sky, "auto", _TOLERANCE)
    return sky, rays.direction, rays.azimuth


def circle_crossings(image: Array, normals: Array) -> Array:
    """Number of images of each great circle, given by its normal (m, 3), that cross a line with images n' (n, 3)."""
    side = normals @ image.T > 0
    return (side[:, 1:] != side[:, :-1]).sum(axis=1)


def half_turn_gaps(camera: kc.Camera, sheets: Sheets, sky: Array, azimuth: Array) -> Array:
    """Angles on the camera's sky, radians, between places on a line (n, 3) that are half a turn of phi' apart.

    From the outer end inward; the images of one great circle on the equatorial line are about so far apart.
    """
    motion = np.stack(fido_from_sky(sheets.frame, tuple(sky.T)), axis=-1)
    run = np.abs(azimuth - azimuth[0])
    seen = sky_from_fido(camera.frame(), motion)
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(seen, axis=0), axis=1))])
    return np.diff(np.interp(np.arange(0, run[-1], np.pi), run, way))


@dataclass(frozen=True)
class EquatorialImages:
    """Images of stars on the celestial equator: phi (n,), radians; counts (n, indices, places), places as in PLACES.

    certified (n,): all images were found.
    """

    phi: Array
    counts: Array
    certified: Array


def equatorial_images(sheets: Sheets, stars: int) -> EquatorialImages:
    """Images of stars at equal steps of phi', by Morse index, on and off the equatorial line of the sky."""
    phi = (np.arange(stars) + 0.5) * 2 * np.pi / stars
    found = search(sheets, from_angles(np.full(stars, np.pi / 2), phi))
    motion = fido_from_sky(sheets.frame, tuple(found.images.sky.T))
    place = np.where(np.abs(motion[1]) > _IN_PLANE, 2, np.where(motion[2] > 0, 0, 1))
    counts = np.zeros((stars, len(sheets.sheets), len(PLACES)), int)
    np.add.at(counts, (found.images.star, found.images.index, place), 1)
    return EquatorialImages(phi, counts, found.certified)
