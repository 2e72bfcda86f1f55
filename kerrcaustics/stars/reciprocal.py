"""Images of sources that lie within the camera's radius: camera and source change places.

Kerr spacetime is the same with time and azimuth reversed together. So each way of light from the source S to the
camera C, run backward, is one from the mirrored camera to the mirrored source: S sees C where C sees S, with the same
b and q, the same conjugate points, hence the same index. Seen from S, C lies further out, where all images can be found
and counted.
"""

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from kerrcaustics.beams.ends import Sphere
from kerrcaustics.curves.source_map import check_domain
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera, photon, sky_from_looking
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.stars.newton import find_roots
from kerrcaustics.stars.search import Candidates, Found, found_of, found_together, search
from kerrcaustics.stars.sheets import Sheets, sheets_of

Array = np.ndarray

# Newton steps from the place that b and q tell.
_FEW_STEPS = 12


def search_within(camera: Camera, angles: Float[Array, "stars 2"], max_index: int, end: Sphere) -> Found:
    """All images of stars on a sphere within the camera's radius.

    Parameters: angles, (theta, phi) of the stars; end, their sphere.
    """
    if math.sin(camera.inclination) == 0:
        raise ValueError("Argument `end` must be at least the camera's radius where the camera is on the spin axis.")
    together = len(angles) > 0 and bool((angles[:, 0] == angles[0, 0]).all())
    groups = [angles] if together else np.split(angles, len(angles))
    return found_together([_one_theta(camera.at_rest(), group, max_index, end) for group in groups])


def _one_theta(camera: Camera, angles: Float[Array, "stars 2"], max_index: int, end: Sphere) -> Found:
    """The images of stars with one theta, from those that are seen of the camera there."""
    phi = angles[:, 1]
    _, sheets = sheets_from(camera, float(angles[0, 0]), max_index, end)
    found = search(sheets, from_angles(np.full(len(phi), camera.inclination), phi))
    return _seen_from(camera, from_angles(angles[:, 0], phi), found, sheets, end)


def sheets_from(camera: Camera, theta: float, max_index: int, end: Sphere) -> tuple[Camera, Sheets]:
    """A camera at a star on a sphere, and its sheets of the sphere on which the camera lies."""
    there = Camera(camera.spin, float(end.radius), theta, "fiducial")
    outward = Sphere(camera.radius)
    try:
        check_domain(there, outward)
        return there, sheets_of(there, max_index, outward)
    except ValueError as error:
        raise ValueError(f"{error} (Said of a camera at the star, as the star lies nearer to the hole.)") from None


def _seen_from(camera: Camera, star: Float[Array, "stars 3"], found: Found, sheets: Sheets, end: Sphere) -> Found:
    """The images as the camera sees them, refined there."""
    light = photon(sheets.frame, tuple(found.sky.T))
    # Of photons that come in at the star the ways lead on inward, and out again.
    returning = light.rate[0] > 0
    parts = []
    for sign in (1.0, -1.0):
        sky = sky_from_looking(camera.frame(), -motion(camera, np.asarray(light.b), np.asarray(light.q), sign))
        for leaf in (False, True):
            these = np.flatnonzero((returning == leaf) & np.isfinite(sky).all(axis=1))
            images = _refined(
                camera, star[found.star[these]], found.index[these], sky[these], replace(end, returning=leaf)
            )
            parts.append(images.of(found.star[these]))
    merged = parts[0]
    for part in parts[1:]:
        merged = merged.merged(part)
    counts = merged.counts(found.expected.shape)
    return found_of(merged, counts, found.expected, found.touching, sheets)


def motion(camera: Camera, b: Float[Array, " n"], q: Float[Array, " n"], sign: float) -> Float[Array, "n 3"]:
    """Directions of motion (r, theta, phi), in the FIDO frame, of photons that come out to the camera."""
    frame = camera.frame()
    a, r, c, s = frame.spin, frame.radius, frame.cos_theta, frame.sin_theta
    at = kerr.metric(a, r, c)
    square = r**2 + a**2
    radial = (square - a * b) ** 2 - (square - 2 * r) * ((b - a) ** 2 + q)
    polar = q - c**2 * (b**2 / s**2 - a**2)
    n_r = np.sqrt(np.maximum(radial, 0)) / math.sqrt(at.sigma * at.delta)
    n_theta = sign * np.sqrt(np.maximum(polar, 0)) / math.sqrt(at.sigma)
    motion = np.stack([n_r, n_theta, b / (s * at.cylindrical_scale)], axis=-1)
    return motion / np.linalg.norm(motion, axis=-1, keepdims=True)


def _refined(
    camera: Camera, star: Float[Array, "n 3"], index: Int[Array, " n"], sky: Float[Array, "n 3"], end: Sphere
) -> Candidates:
    """Images on one leaf, from guesses; as their star, the number of the guess."""
    which, sky, error = find_roots(camera, star, index, sky, _FEW_STEPS, end=end)
    return Candidates(which, index[which], sky, error, np.full(len(which), end.returning, bool))
