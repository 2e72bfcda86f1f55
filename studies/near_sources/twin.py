"""All images by a dense grid of integrated rays and Newton's method: slow, and knows nothing of caustics."""

import math

import numpy as np

import kerrcaustics as kc
from kerrcaustics.beams.ends import End
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import moved

TURNS, PARTS, CLOSEST = 360, 160, 3e-7
_STEPS, _SAME = 30, 1e-6


class Twin:
    """The sky of one camera, at rest, and where all of it leads on one surface, at every arrival."""

    def __init__(self, camera: Camera, end: End) -> None:
        self.camera, self.ends, self.sky = camera, end.arrivals(), grid(camera)
        self.places = [one.ends(kc.trace_rays(camera, self.sky, "integrated", 1e-8, end=one)) for one in self.ends]

    def images(self, target: tuple[float, float], highest: int) -> np.ndarray:
        """Directions N and indices, as columns (n, 4), of the images of a source at (theta, phi), or (r, phi)."""
        (goal,) = self.ends[0].vectors(np.array([target]))
        found = []
        for end, ends in zip(self.ends, self.places, strict=True):
            starts = around(ends, goal)
            found.append(newton(self.camera, self.sky[:-1, :-1][starts], goal, end, highest))
        return np.concatenate(found)


def grid(camera: Camera) -> np.ndarray:
    """Directions N on both sides of the shadow edge, ever closer to it."""
    turn = 2 * math.pi * np.arange(TURNS + 1) / TURNS
    reach = sky_lines.line_reach(camera, turn)[:, None]
    out = np.concatenate([np.geomspace(CLOSEST, 0.02, PARTS // 2, endpoint=False), np.linspace(0.02, 0.9999, PARTS)])
    size = (math.pi - reach) / reach
    part = np.concatenate([-size * out[::-1], np.broadcast_to(out, (len(turn), len(out)))], axis=1)
    line_of_sight = sky_lines.beside_edge(camera, np.broadcast_to(turn[:, None], part.shape), part)
    rest = camera.at_rest().frame()
    return as_seen(sky_from_line_of_sight(rest, line_of_sight), rest, camera.frame())


def around(ends: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Cells whose ends lie around the goal, with some margin; too many rather than too few."""
    corners = np.stack([ends[:-1, :-1], ends[1:, :-1], ends[:-1, 1:], ends[1:, 1:]])
    middle = corners.mean(axis=0)
    size = np.linalg.norm(corners - middle, axis=-1).max(axis=0)
    return (np.linalg.norm(middle - goal, axis=-1) < 1.2 * size) & (size < 1.5 * np.linalg.norm(goal))


def newton(camera: Camera, sky: np.ndarray, goal: np.ndarray, end: End, highest: int) -> np.ndarray:
    """Roots from all starts, each once."""
    found = np.empty((0, 4))
    for _ in range(_STEPS):
        if not len(sky):
            break
        beams = kc.trace_beams(camera, sky, "integrated", 1e-11, end=end)
        at = end.ends(beams)
        away = np.linalg.norm(at - goal, axis=1)
        done = (away < 1e-8 * max(1, np.linalg.norm(goal))) & (np.asarray(beams.index) <= highest)
        found = np.concatenate([found, np.column_stack([sky[done], np.asarray(beams.index)[done]])])
        left = np.isfinite(away) & ~done & (away > 1e-8 * max(1, np.linalg.norm(goal)))
        step = beams.pulled_back(sky, end.displacement(beams, np.broadcast_to(goal, at.shape)))
        length = np.linalg.norm(step, axis=1)
        left &= np.isfinite(length)
        step = step[left] * np.minimum(1, 0.05 / np.maximum(length[left], 1e-300))[:, None]
        sky = moved(sky[left], step)
    return distinct(found)


def distinct(found: np.ndarray) -> np.ndarray:
    kept: list[np.ndarray] = []
    for one in found:
        if all(one[3] != other[3] or np.linalg.norm(one[:3] - other[:3]) > _SAME for other in kept):
            kept.append(one)
    return np.array(kept).reshape(-1, 4)
