"""The light of a small ball that moves, by rays alone: which of them pass within its radius, looked at place by place.

It shares no code with the package, but the places of the ball, which are an argument.
"""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from beam_equations import Event, photon
from kerr_rays import forward_rates
from scipy.integrate import solve_ivp

Places = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""(r, theta, phi) of the ball at coordinate times."""
_MOMENTS = 60
_ACCURACY = {"method": "DOP853", "rtol": 1e-8, "atol": 1e-8}
_CELLS = (20, 48)
_ANGLES = 16


def ball_light(event: Event, places: Places, size: float, arrival: float, image: tuple[np.ndarray, float]) -> float:
    """Flux times 4 pi, for luminosity 1 spread evenly, of the image near a direction with a time of emission.

    The integral of g^4 over the rays that arrive at one time and pass within `size` of the ball's middle, in its frame,
    over pi size^2. Of cells that are cut the part inside is that of a plane through the distances at their corners.
    """
    sky, emitted = image
    basis = _across(sky)
    frame, half, fill = _Frame(np.eye(2), np.zeros(1)), np.full(2, size / event.radius), 0.0
    middle = 0.0
    for _ in range(20):
        grid = _grid(_CELLS[0], middle, half)
        at = frame.at(grid)
        distance, _ = _passes(event, places, arrival, emitted, _rays(sky, at @ basis))
        inside = distance.reshape(_CELLS[0], -1) < 1.3 * size
        border = inside.copy()
        border[1:-1, 1:-1] = False
        before, fill = fill, inside.mean()
        if not border.any() and (fill > 0.3 or 0.02 < fill < 1.1 * before):
            break
        # The image itself is one of the places, where the grid is too coarse to meet it.
        at = np.vstack([at[inside.ravel()], np.zeros(2)])
        frame = _Frame.through(at)
        u, v = frame.of(at).T
        step = half.min() * 2 / (_CELLS[0] - 1)
        middle, half = (u.max() + u.min()) / 2, np.array([np.ptp(u), 2 * np.abs(v).max()]) * 0.55 + 0.6 * step
        if border.any():
            half[0] *= 1.5
    else:
        raise AssertionError("no window holds the image")
    for _ in range(9):
        count = int(_CELLS[1] * math.sqrt(min(max(0.5 / fill, 1.0), 8.0)))
        at = frame.at(_grid(count, middle, half))
        distance, redshift = (
            x.reshape(count, count) for x in _passes(event, places, arrival, emitted, _rays(sky, at @ basis))
        )
        inside = distance < 1.1 * size
        ends, sides = inside[[0, -1]].any(), inside[:, [0, -1]].any()
        if not ends and not sides:
            break
        # The coarse grid missed the tips of a bent image.
        at = at[inside.ravel()]
        frame = _Frame.through(at)
        u, v = frame.of(at).T
        middle, half = (u.max() + u.min()) / 2, np.array([np.ptp(u) * (0.75 if ends else 0.55), 1.5 * np.abs(v).max()])
        fill = inside.mean()
    else:
        raise AssertionError("no window holds the image")
    weight = np.where(distance < 2 * size, redshift, 0.0) ** 4
    share = _shares_inside(distance / size - 1)
    cells = [
        weight[i : weight.shape[0] - 1 + i, j : weight.shape[1] - 1 + j] for i, j in itertools.product((0, 1), (0, 1))
    ]
    area = np.prod(2 * half / (count - 1))
    return float((share * np.mean(cells, axis=0)).sum() * area / (math.pi * size**2))


def light_at_rest(event: Event, places: Places, size: float, arrival: float, image: tuple[np.ndarray, float]) -> float:
    """The same for a ball at rest, to many more digits: the area within the image of its limb times g^4.

    Rays at equal angles are moved straight away from the middle until they pass the limb, in coordinates in which the
    image is nearly round. They come from the cosine of the angle from -e_x and the azimuth about it, along which images
    of high magnification are long, and which keep areas.
    """
    sky, emitted = image
    angle = np.arange(_ANGLES) * 2 * math.pi / _ANGLES
    round_about, frame = np.stack([np.cos(angle), np.sin(angle)], axis=-1), np.eye(2) * size / event.radius

    def passed(round_places):
        cosine, turn = (round_places @ frame.T + [-sky[0], math.atan2(sky[2], sky[1])]).T
        sine = np.sqrt(1 - cosine**2)
        rays = np.stack([-cosine, sine * np.cos(turn), sine * np.sin(turn)], axis=-1)
        return _passes(event, places, arrival, emitted, rays)

    for _ in range(3):
        first, second, both = passed(np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]))[0] ** 2
        mixed = (both - first - second) / 2
        values, axes = np.linalg.eigh([[first, mixed], [mixed, second]])
        frame = frame @ axes / np.sqrt(np.maximum(values, 1e-3 * values.max())) * size
    away = np.ones(_ANGLES)
    for _ in range(12):
        distance, redshift = passed(away[:, None] * round_about)
        away *= size / distance
        if np.abs(distance / size - 1).max() < 1e-6:
            return float(np.mean(redshift**4) * (away**2).mean() * abs(np.linalg.det(frame)) / size**2)
    raise AssertionError("no limb was found")


def _across(sky: np.ndarray) -> np.ndarray:
    first = np.cross(sky, np.eye(3)[np.argmin(np.abs(sky))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(sky, first)])


class _Frame(NamedTuple):
    """Coordinates along and across a bent image, which keep areas: v is counted from a polynomial in u."""

    turn: np.ndarray
    bend: np.ndarray

    @classmethod
    def through(cls, at):
        turn = np.linalg.svd(at - at.mean(axis=0), full_matrices=False)[2] if len(at) > 3 else np.eye(2)
        u, v = (at @ turn.T).T
        return cls(turn, np.polyfit(u, v, 4 if len(at) > 19 else 2) if len(at) > 9 else np.array([v.mean()]))

    def at(self, places):
        u, v = places.T
        return np.stack([u, v + np.polyval(self.bend, u)], axis=-1) @ self.turn

    def of(self, at):
        u, v = (at @ self.turn.T).T
        return np.stack([u, v - np.polyval(self.bend, u)], axis=-1)


def _grid(count, middle, half):
    steps = np.linspace(-1, 1, count)
    u, v = np.meshgrid(middle + steps * half[0], steps * half[1], indexing="ij")
    return np.stack([u.ravel(), v.ravel()], axis=-1)


def _rays(sky, offsets):
    """Directions at offsets in Lambert's plane about one, so that areas are solid angles."""
    square = (offsets**2).sum(axis=1, keepdims=True)
    return sky * (1 - square / 2) + offsets * np.sqrt(1 - square / 4)


def _passes(event, places, arrival, emitted, rays):
    """Distance of each ray from the ball's middle, in its frame, and g there."""
    a, r, theta, _ = event
    light = photon(event, rays.T)
    b, energy, horizon = light.b, light.camera_energy, 1 + math.sqrt(1 - a * a)
    start = np.stack([np.full_like(b, r), np.full_like(b, theta), 0 * b, 0 * b, light.p_r, light.p_theta])

    def rates(_, state, span=1.0):
        state = state.reshape(6, -1)
        # Rays that fall into the hole come to rest above its horizon, those that leave at some distance.
        held = np.clip((state[0] / horizon - 1.02) / 0.1, 0, 1) * np.clip(3 - state[0] / r, 0, 1)
        return -(span * held * forward_rates(a, b, state)).ravel()

    def older(_, state):
        # The median ray is at the ball's time.
        return np.median(state.reshape(6, -1)[3]) + (arrival - emitted)

    def states(begin, moments, span=1.0):
        path = solve_ivp(rates, (0, moments[-1]), begin.ravel(), args=(span,), t_eval=moments, **_ACCURACY)
        assert path.status == 0
        return np.moveaxis(path.y.reshape(6, len(b), -1), 2, 0)

    older.terminal = True
    path = solve_ivp(rates, (0, 10), start.ravel(), events=older, **_ACCURACY)
    assert path.status == 1
    pace = abs(np.median(rates(0, path.y[:, -1]).reshape(6, -1)[3]))
    moments = path.t[-1] + np.linspace(-1, 1, _MOMENTS) * min(6 / pace, 0.2 * path.t[-1])
    passing, closest = np.full_like(b, moments[0]), np.full_like(b, np.inf)
    for moment, state in zip(moments, states(start, moments), strict=True):
        body_r, body_theta, body_phi = places(arrival + state[3])
        cosine = np.cos(state[1]) * np.cos(body_theta)
        cosine += np.sin(state[1]) * np.sin(body_theta) * np.cos(state[2] - body_phi)
        away = state[0] ** 2 + body_r**2 - 2 * state[0] * body_r * cosine
        passing, closest = np.where(away < closest, moment, passing), np.minimum(away, closest)
    # Then about the pass of each ray, in its own steps.
    step = moments[1] - moments[0]
    for _ in range(3):
        early = states(start, np.array([1e-9, 1.0]), passing - step)[1]
        near = states(early, np.array([1e-9, 0.5, 1.0]), np.full_like(b, 2 * step))
        (before, here, after), ratio = zip(*(_separation(a, b, state, places, arrival) for state in near), strict=True)
        bend = before - 2 * here + after
        bend = np.where(bend > 0, bend, np.inf)
        shift = np.clip((before - after) / (2 * bend), -1, 1)
        passing, step = passing + shift * step, step / 12
    distance = np.sqrt(np.maximum(here - (before - after) ** 2 / (8 * bend), 0))
    return distance, energy / (ratio[1] + (ratio[2] - ratio[0]) / 2 * shift)


def _separation(a, b, states, places, arrival):
    """Square of the distance of the ray from the ball's middle in its frame, and the frequency there.

    The distance is that of events at the same time of the ball, in r times the direction as coordinates, with the
    metric halfway between: right but for (distance / r)^2, as it would not be with the metric at one of the ends.
    """
    r, theta, phi, ago, p_r, p_theta = states
    ray, axes = _cartesian(r, theta, phi)
    time, early, step = arrival + ago, 0.0, 1e-3
    for _ in range(3):
        before, body, after = (_body(places, time + early + late) for late in (-step, 0, step))
        velocity = np.concatenate([np.ones((1, len(r))), (after - before) / (2 * step)])
        away = np.concatenate([np.broadcast_to(-early, (1, len(r))), ray - body])
        halfway = (ray + body) / 2
        early = early + _at(a, halfway, away, velocity) / _at(a, halfway, velocity, velocity)
    speed = velocity / np.sqrt(-_at(a, body, velocity, velocity))
    momentum = p_r * axes[0] + p_theta / r * axes[1] + b / (r * np.sin(theta)) * axes[2]
    return _at(a, halfway, away, away), speed[0] - (momentum * speed[1:]).sum(axis=0)


def _body(places, time):
    r, theta, phi = places(time)
    return _cartesian(r + 0 * time, theta, phi)[0]


def _cartesian(r, theta, phi):
    """Place r times the direction, and unit vectors along r, theta and phi."""
    r, theta, phi = np.broadcast_arrays(r, theta, phi)
    sine, cosine, zero = np.sin(theta), np.cos(theta), np.zeros_like(phi)
    outward = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine])
    down = np.stack([cosine * np.cos(phi), cosine * np.sin(phi), -sine])
    return r * outward, (outward, down, np.stack([-np.sin(phi), np.cos(phi), zero]))


def _at(a, place, x, y):
    """Product of two vectors dt, dx, dy, dz in the metric at a place."""
    r = np.sqrt((place**2).sum(axis=0))
    theta, phi = np.arccos(place[2] / r), np.arctan2(place[1], place[0])
    scale = (1.0, r, r * np.sin(theta))
    _, axes = _cartesian(r, theta, phi)
    parts = [[v[0], *((v[1:] * e).sum(axis=0) / s for e, s in zip(axes, scale, strict=True))] for v in (x, y)]
    return _product(_metric(a, r, theta), *parts)


def _metric(a, r, theta):
    sine = np.sin(theta) ** 2
    sigma, delta = r * r + (a * np.cos(theta)) ** 2, r * r - 2 * r + a * a
    big = (r * r + a * a) ** 2 - a * a * delta * sine
    return -(1 - 2 * r / sigma), -2 * a * r * sine / sigma, sigma / delta, sigma, big * sine / sigma


def _product(g, x, y):
    tt, tp, rr, hh, pp = g
    return tt * x[0] * y[0] + tp * (x[0] * y[3] + x[3] * y[0]) + rr * x[1] * y[1] + hh * x[2] * y[2] + pp * x[3] * y[3]


def _shares_inside(level):
    """Part of each cell of a grid in which a function is negative, by its linear form through the corners."""
    corners = [level[:-1, :-1], level[:-1, 1:], level[1:, :-1], level[1:, 1:]]
    # The mean of the corners is not that of the level along the edge within a cell.
    bend = np.zeros_like(level)
    bend[1:-1, 1:-1] = (level[2:, 1:-1] + level[:-2, 1:-1] + level[1:-1, 2:] + level[1:-1, :-2]) / 4 - level[1:-1, 1:-1]
    middle = np.mean(corners, axis=0) - bend[:-1, :-1] / 3
    x = np.abs(level[:-1, 1:] + level[1:, 1:] - level[:-1, :-1] - level[1:, :-1]) / 2
    y = np.abs(level[1:, :-1] + level[1:, 1:] - level[:-1, :-1] - level[:-1, 1:]) / 2

    def ramp(z):
        return np.maximum(z, 0.0) ** 2 / 2

    both = np.maximum(x * y, 1e-30)
    h = -middle
    exact = (ramp(h + (x + y) / 2) - ramp(h + (x - y) / 2) - ramp(h - (x - y) / 2) + ramp(h - (x + y) / 2)) / both
    small = np.minimum(x, y) < 1e-6 * np.maximum(np.maximum(x, y), 1e-30)
    steep = np.maximum(np.maximum(x, y), 1e-30)
    return np.clip(np.where(small, h / steep + 0.5, exact), 0.0, 1.0)
