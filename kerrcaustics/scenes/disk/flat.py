"""Pictures without the hole: straight rays in flat space, for comparison with `render`."""

import math

import numpy as np

from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.scenes.disk.disk import Disk, disk_about
from kerrcaustics.scenes.disk.samples import DiskSamples, emitted_light
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.points import draw_points
from kerrcaustics.scenes.raster import check_picture
from kerrcaustics.scenes.sky import UNSHIFTED, Sky, check_sky, light_of_sky
from kerrcaustics.scenes.view import View
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera, check_camera
from kerrcaustics.spacetime.checks import quoted, real_number
from kerrcaustics.spacetime.sphere import from_angles, polar_basis

Array = np.ndarray

# Divisions each way of the pixels of a disk, for its rims and its paint.
_DIVISIONS = 6


@usual_warnings
def render_flat(
    camera: Camera, view: View, sky: Sky | None = None, *, disk: Disk | None = None, sky_radius: float = math.inf
) -> Float[Array, "height width 3"]:
    """Light (height, width, 3) of a sky and a disk as a camera at rest sees them without a hole.

    Parameters
    ----------
    camera : Camera
        Its radius and inclination count as spherical coordinates, its axes are kept, and it is at rest.
    view : View
    sky : Sky, optional
    disk : Disk, optional
        In the plane z = 0, between circles of its radii; no light is shifted.
    sky_radius : float
        Radius of the sphere with `sky`, beyond the camera; the flux of a star is that at its centre.

    Errors
    ------
    Pixels of the disk are the means of 36 places, and its rims are as accurate as these places allow.
    """
    check_camera(camera)
    check_picture(camera, view)
    check_sky(sky)
    start = camera.radius * from_angles(camera.inclination, 0.0)
    if not real_number("sky_radius", sky_radius) > camera.radius:
        must = f"be larger than the radius of the camera, {camera.radius:g}"
        raise ValueError(f"Argument `sky_radius` must {must}, but is {quoted(sky_radius)}.")
    y, x = (place.ravel() for place in np.mgrid[: view.height, : view.width])
    light = np.zeros((len(x), 3))
    if sky is not None:
        place = start / sky_radius
        footprint = _footprint(*_line_of_sight(camera, view, x, y), place)
        light = light + light_of_sky(sky, footprint, UNSHIFTED)
        _draw_points(camera, view, sky, place, light.reshape(view.height, view.width, 3))
    disk = disk_about(disk, camera)
    if disk is not None:
        within = (np.arange(_DIVISIONS) + 0.5) / _DIVISIONS - 0.5
        total, transmission = np.zeros((len(x), 3)), np.zeros(len(x))
        for right in within:
            for down in within:
                shining, passing = _disk_light(camera, view, disk, x + right, y + down)
                total, transmission = total + shining, transmission + passing
        light = (total + transmission[:, None] * light) / _DIVISIONS**2
    return light.reshape(view.height, view.width, 3)


def _line_of_sight(camera: Camera, view: View, x: Array, y: Array) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 2"]]:
    """Directions (n, 3) in space, and their steps (n, 3, 2) per pixel, in Cartesian coordinates."""
    sky, steps = view.directions(x, y)
    turn = _turn(camera)
    return sky @ turn, turn.T @ steps


def _turn(camera: Camera) -> Float[Array, "3 3"]:
    """The rotation from the camera's axes (rows) to Cartesian coordinates."""
    outward = from_angles(camera.inclination, 0.0)
    e_theta = from_angles(camera.inclination + np.pi / 2, 0.0)
    return np.asarray(camera.frame().basis) @ np.stack([outward, e_theta, np.array([0.0, 1.0, 0.0])])


def _draw_points(camera: Camera, view: View, sky: Sky, viewer: Float[Array, "3"], light: Float[Array, "h w 3"]) -> None:
    """Draw the points of light of a sky, if it has any."""
    points = sky.points
    if points is None:
        return
    offset = points.direction - viewer
    length = np.linalg.norm(offset, axis=1)
    place = view.pixels(offset / length[:, None] @ _turn(camera).T)
    some = ((place > -2) & (place < (view.width + 1, view.height + 1))).all(axis=1)
    # Ratio of the solid angles of a part of the sphere from the camera and from the centre.
    magnification = np.vecdot(offset, points.direction) / length**3
    draw_points(light, view, place[some], points.flux[some] * magnification[some, None])


def _footprint(direction: Float[Array, "n 3"], steps: Float[Array, "n 3 2"], viewer: Float[Array, "3"]) -> Footprint:
    """Footprints of pixels on the unit sphere, in directions with their steps from a place within."""
    ahead = direction @ viewer
    length = (np.sqrt(ahead**2 + 1 - viewer @ viewer) - ahead)[:, None]
    end = viewer + length * direction
    # The end of the ray stays on the sphere: its displacement has a part along the ray.
    along = (end[:, None] @ steps) / np.vecdot(end, direction)[:, None, None]
    steps = length[..., None] * (steps - direction[..., None] * along)
    matrix = np.stack(polar_basis(end), axis=-2) @ steps
    return Footprint(end, matrix, np.zeros(len(end)), np.ones(len(end)))


def _disk_light(
    camera: Camera, view: View, disk: Disk, x: Array, y: Array
) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
    """Light (n, 3) of the disk in parts of pixels, and its transmission (n,)."""
    direction, steps = _line_of_sight(camera, view, x, y)
    steps = steps / _DIVISIONS
    start = camera.radius * from_angles(camera.inclination, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        length = -start[2] / direction[:, 2]
        place = start + length[:, None] * direction
    radius = np.hypot(place[:, 0], place[:, 1])
    on = np.flatnonzero((length > 0) & (radius >= disk.inner) & (radius <= disk.outer))
    light, transmission = np.zeros((len(x), 3)), np.ones(len(x))
    direction, place, radius = direction[on], place[on], radius[on]
    # In the plane, a displacement of the direction is stretched along the ray.
    slope = steps[on] - direction[:, :, None] * (steps[on, 2:] / direction[:, 2:, None])
    along = place[:, :2] / radius[:, None]
    frame = np.stack([along, np.stack([-along[:, 1], along[:, 0]], axis=-1)], axis=1)
    matrix = length[on, None, None] * (frame @ slope[:, :2])
    azimuth, width = np.arctan2(place[:, 1], place[:, 0]), disk.outer - disk.inner
    still = np.zeros(len(on)), np.zeros_like
    samples = DiskSamples(radius, azimuth, (radius - disk.inner) / width, matrix, np.ones(len(on)), width, 0.0, *still)
    light[on] = disk.brightness * emitted_light(disk.emission, samples, UNSHIFTED)
    transmission[on] = disk.transmitted(samples, np.abs(direction[:, 2]))
    return light, transmission
