"""Question 5: critical points and star images found on the sky of a moving camera."""

import numpy as np

import kerrcaustics as kc
from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.spacetime.frame import fido_from_sky, sky_from_fido
from kerrcaustics.spacetime.sphere import angle_between

from .pairs import random_points

Array = np.ndarray

_TOLERANCE = 1e-12
# Places on the line through a critical point, in depth, from which the moving camera finds it.
_STARTS = (-0.01, 0.013)
_SECANTS, _SHORTEST = 8, 1e-8
# Images are searched for from so far away, in parts of their distance from the critical curves.
_OFF = 1e-3


def moving(camera: kc.Camera, count: int, rng: np.random.Generator) -> list[kc.Camera]:
    """Cameras at the same event: circular where there is such an orbit, static, and with random velocities to 0.95."""
    names = ["circular", "static"] if camera.on_equator else ["static"]
    vectors = rng.normal(size=(count, 3))
    vectors *= (rng.uniform(0, 0.95, count) / np.linalg.norm(vectors, axis=1))[:, None]
    velocities = [*names, *(tuple(v) for v in vectors.tolist())]
    return [kc.Camera(camera.spin, camera.radius, camera.inclination, velocity) for velocity in velocities]


def critical_misses(sheets: Sheets, camera: kc.Camera, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Angles (n,) between caustic points of the moving camera and of the resting one, and their errors together.

    The moving camera looks for delta_minus = 0 by its own beams on the same lines of the sky.
    """
    misses, errors = [], []
    for curve in sheets.curves:
        points = random_points(sheets, curve.order, count, rng)
        depth = [points.depth + start for start in _STARTS]
        ratio = [_ratio(camera, sheets.camera, points.edge_phase, d)[0] for d in depth]
        slope = (ratio[1] - ratio[0]) / (depth[1] - depth[0])
        for _ in range(_SECANTS):
            depth = [depth[1], depth[1] - np.clip(ratio[1] / slope, -0.02, 0.02)]
            ratio = [ratio[1], _ratio(camera, sheets.camera, points.edge_phase, depth[1])[0]]
            change = depth[1] - depth[0]
            # A difference over a very short step is round-off: the last slope serves.
            long = np.abs(change) > _SHORTEST
            slope = np.where(long, (ratio[1] - ratio[0]) / np.where(long, change, 1), slope)
        beams = _ratio(camera, sheets.camera, points.edge_phase, depth[1])[1]
        misses.append(angle_between(beams.direction, points.direction))
        errors.append(beams.error + points.error)
    return np.concatenate(misses), np.concatenate(errors)


def image_misses(sheets: Sheets, camera: kc.Camera, stars: Array) -> tuple[Array, Array, int]:
    """Angles between images found by the moving camera, aberration undone, and by the resting one; errors; lost ones.

    The Morse index of each is that of the resting camera, or it is not found.
    """
    images = search(sheets, stars).images
    frame = camera.frame()
    motion = np.stack(fido_from_sky(sheets.frame, tuple(images.sky.T)), axis=-1)
    start = sky_from_fido(frame, motion)
    beams = kc.trace_beams(camera, start, "auto", _TOLERANCE, redshift=False)
    tilt = np.cross(start, np.roll(start, 1, axis=1))
    tilt /= np.linalg.norm(tilt, axis=1, keepdims=True)
    size = _OFF * np.abs(beams.delta_minus) / (beams.delta_plus + np.abs(beams.delta_minus)) ** 2
    start = start * np.cos(size)[:, None] + tilt * np.sin(size)[:, None]
    which, moved, _ = find_roots(camera, stars[images.star], images.index, start)
    back = as_seen(moved, frame, sheets.frame)
    resting = kc.trace_beams(sheets.camera, back, "auto", _TOLERANCE, crossings=False, redshift=False)
    # As far as the moving camera's own error goes, on the resting camera's sky.
    error = resting.error / np.abs(resting.delta_minus) + images.error[which]
    return angle_between(back, images.sky[which]), error, len(images.sky) - len(which)


def _ratio(camera: kc.Camera, resting: kc.Camera, edge_phase: Array, depth: Array) -> tuple[Array, kc.Beams]:
    sky = sky_from_fido(camera.frame(), -sky_lines.line_of_sight(resting, edge_phase, depth))
    beams = kc.trace_beams(camera, sky, "auto", _TOLERANCE, index=False, crossings=False, redshift=False)
    return beams.delta_minus / beams.delta_plus, beams
