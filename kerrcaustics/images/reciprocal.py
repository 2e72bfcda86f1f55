"""Images of sources that lie within the camera's radius: camera and source change places.

Kerr spacetime is the same with time and azimuth reversed together. So each way of light from the source S to the
camera C, run backward, is one from the mirrored camera to the mirrored source: S sees C where C sees S, with the same
b and q, the same conjugate points, hence the same index. Seen from S, C lies further out, where all images can be found
and counted.
"""

import math
from dataclasses import replace
from functools import reduce

import numpy as np

from kerrcaustics.beams.ends import Sphere, end_of
from kerrcaustics.images.search import ImageSearch, SkyImages, search, searched_together
from kerrcaustics.images.sheets import Sheets, sheets_of
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import magnified, search_camera
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import photon_of, sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Newton steps from the place that b and q give.
_FEW_STEPS = 12
# Tolerance of the rays of guesses, radians.
_OF_GUESS = 1e-10


def search_within(camera: Viewer, angles: Float[Array, "stars 2"], max_index: int, end: Sphere) -> ImageSearch:
    """All images of stars on a sphere within the camera's radius.

    Parameters: angles, (theta, phi) of the stars; end, their sphere.
    """
    together = len(angles) > 0 and bool((angles[:, 0] == angles[0, 0]).all())
    groups = [angles] if together else np.split(angles, len(angles))
    return searched_together([_one_theta(search_camera(camera), group, max_index, end) for group in groups])


def _one_theta(camera: Viewer, angles: Float[Array, "stars 2"], max_index: int, end: Sphere) -> ImageSearch:
    """The images of stars with one theta, from those that are seen of the camera there."""
    phi = angles[:, 1]
    _, sheets = sheets_from(camera, float(angles[0, 0]), max_index, end)
    searched = search(sheets, from_angles(np.full(len(phi), camera.inclination), phi))
    return _seen_from(camera, from_angles(angles[:, 0], phi), searched, sheets, end)


def sheets_from(camera: Viewer, theta: float, max_index: int, end: Sphere) -> tuple[Viewer, Sheets]:
    """A camera at a star on a sphere, and its sheets of the sphere on which the camera lies."""
    star_camera = Camera(camera.spin, float(end.radius), theta, "fiducial")
    outward = end_of(star_camera, camera.radius)
    try:
        return star_camera, sheets_of(star_camera, max_index, outward)
    except ValueError as error:
        raise ValueError(f"{error} (Applies to a camera at the star, as the star lies nearer to the hole.)") from None


def _seen_from(
    camera: Viewer, star: Float[Array, "stars 3"], searched: ImageSearch, sheets: Sheets, end: Sphere
) -> ImageSearch:
    """The images as the camera sees them, refined there."""
    photon = photon_of(sheets.frame, tuple(searched.images.sky.T))
    # Photons that move inward at the star pass a turning point before they reach the camera.
    second_arrival = photon.rate[0] > 0
    parts = []
    for sign in (1.0, -1.0):
        sky = directions(camera, np.asarray(photon.b), np.asarray(photon.q), sign)
        for leaf in (False, True):
            on_leaf = np.flatnonzero((second_arrival == leaf) & np.isfinite(sky).all(axis=1))
            here, stars = replace(end, second_arrival=leaf), star[searched.images.star[on_leaf]]
            guesses = _rotated_about_axis(camera, stars, sky[on_leaf], sign, here) if camera.on_axis else sky[on_leaf]
            images = _refined(camera, stars, searched.images.index[on_leaf], guesses, here)
            parts.append(images.renumbered(searched.images.star[on_leaf]))
    merged = reduce(SkyImages.merged, parts)
    counts = merged.counts(searched.expected.shape)
    return ImageSearch(merged, counts, searched.expected, searched.on_caustic, searched.ring, sheets.coarse)


def directions(camera: Viewer, b: Float[Array, " n"], q: Float[Array, " n"], sign: float) -> Float[Array, "n 3"]:
    """Directions N in which photons with this b and q come in; sign: of their motion in theta."""
    frame = camera.frame()
    return sky_from_line_of_sight(frame, -magnified(frame, _motion(camera, b, q, sign)))


def _motion(camera: Viewer, b: Float[Array, " n"], q: Float[Array, " n"], sign: float) -> Float[Array, "n 3"]:
    """Directions of motion (r, theta, phi), in the FIDO frame, of photons that come out to the camera."""
    frame = camera.frame()
    a, r, c, s = frame.spin, frame.radius, frame.cos_theta, frame.sin_theta
    at = kerr.metric(a, r, c)
    radial = kerr.radial_potential(a, r, b, q)
    # On the axis b is 0, and any azimuth will do.
    around = np.zeros_like(b) if camera.on_axis else b / s
    polar = q - c**2 * (around**2 - a**2)
    n_r = np.sqrt(np.maximum(radial, 0)) / math.sqrt(at.sigma * at.delta)
    n_theta = (1.0 if camera.on_axis else sign) * np.sqrt(np.maximum(polar, 0)) / math.sqrt(at.sigma)
    motion = np.stack([n_r, n_theta, around / at.cylindrical_scale], axis=-1)
    return motion / np.linalg.norm(motion, axis=-1, keepdims=True)


def _rotated_about_axis(
    camera: Viewer, star: Float[Array, "n 3"], sky: Array, sense: float, end: Sphere
) -> Float[Array, "n 3"]:
    """Directions of a camera on the spin axis, turned about it so that their rays end at the star's azimuth.

    sense: of the turn on the sky, which is another one at either pole.
    """
    if not len(sky):
        return sky
    rays = SearchMap(camera, end).rays_of_sky(sky, tolerance=_OF_GUESS)
    angle = sense * (np.arctan2(star[:, 1], star[:, 0]) - rays.azimuth)
    (x, y, z), c, s = sky.T, np.cos(angle), np.sin(angle)
    return np.stack([x, c * y - s * z, s * y + c * z], axis=-1)


def _refined(
    camera: Viewer, star: Float[Array, "n 3"], index: Int[Array, " n"], sky: Float[Array, "n 3"], end: Sphere
) -> SkyImages:
    """Images on one leaf, from guesses; as their star, the number of the guess."""
    which, sky, error = find_roots(camera, star, index, sky, _FEW_STEPS, end=end)
    return SkyImages.arriving(which, index[which], sky, error, second=bool(end.second_arrival))
