"""The last stretch of a ray, one very short Taylor step onto its end, and everything that is read off there."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.ends import Aim, Goal, time_left
from kerrcaustics.beams.geometry import azimuth_step, dot, length, turned
from kerrcaustics.beams.integrator import clock
from kerrcaustics.beams.integrator.equations import Constants, polar_rapidity
from kerrcaustics.beams.integrator.nystroem import Path, Rates
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.camera import Frame
from kerrcaustics.spacetime.sphere import polar_basis

Array = Any
Jacobian = tuple[tuple[Array, ...], ...]

# The order 12 result is better than the order 10 one, whose local errors are summed, by a factor of 25 in the worst
# cases and by hundreds in most; its derivatives at the same steps are not. Measured: studies/error_estimates.py.
_DIRECTION_GAIN = 0.02


class End(NamedTuple):
    """A ray at its end. What was not asked for, or is none at such an end, is None.

    direction (x, y, z) of n'; azimuth, unwrapped; error in radians, and noise, the part of it that is round-off;
    jacobian_error, relative; steps taken; captured; jacobian, rows e_theta', e_phi', columns the two camera-sky
    directions; conjugate_points passed (the Morse index); crossings of the equatorial plane; missed, neither captured
    nor at the end; radius of the end; time, time_error, and time_noise, its round-off.
    """

    direction: tuple[Array, Array, Array]
    azimuth: Array
    error: Array
    noise: Array
    jacobian_error: Array | None
    steps: Array
    captured: Array
    jacobian: Jacobian | None
    conjugate_points: Array | None = None
    crossings: Array | None = None
    missed: Array | None = None
    radius: Array | None = None
    time: Array | None = None
    time_error: Array | None = None
    time_noise: Array | None = None


class Flight(NamedTuple):
    """A ray shortly before its end, and how it got there.

    start and paths: the ray, its variations or its instability, and its clock where there is one; local_error and
    clock_error summed over the steps; azimuth of m; stuck, out of steps.
    """

    start: tuple[Path, ...]
    paths: tuple[Path, ...]
    rates: Rates
    local_error: Array
    clock_error: Array | None
    azimuth: Array
    steps: Array
    stuck: Array


class _Touch(NamedTuple):
    """The paths at the end, and what the ray does there; psi_rate, 0 at infinity."""

    paths: list[Path]
    m: tuple[Array, ...]
    psi_rate: Array


def land(frame: Frame, goal: Goal, constants: Constants, aim: Aim, flight: Flight, beams: bool) -> End:
    """The end of each ray and beam."""
    before = flight.paths[0]
    touch = _touch_down(frame.spin, goal, constants, aim, flight)
    ray, m = touch.paths[0], touch.m
    c, s = jnp.cos(ray.psi), jnp.sin(ray.psi)
    n = (c * m[0] - s * m[1], s * m[0] + c * m[1], m[2])
    jacobian = _jacobian(goal, touch, n) if beams else None
    growth, spread = _growth(goal, constants, aim, flight, touch, jacobian)
    drift = flight.local_error * jnp.maximum(growth, 1)
    # Round-off of 1e-16 in N, or in a step, is seen magnified by the spread of the beam.
    noise = 1e-15 * (1 + spread) * (1 + 0.1 * flight.steps) + _horizon_noise(frame)
    lost = aim.lost
    if goal.kind == "plane":
        # Crossings that cannot be told from infinity, or from the horizon, are none.
        u = ray.position[0]
        lost = lost | (u <= 0) | (u * radial.horizon(frame.spin) >= 1)
    hidden = jnp.where(lost, jnp.nan, 0.0)
    turning = flight.azimuth + azimuth_step(constants.b, before.position, ray.position) + ray.psi
    error = jnp.where(flight.stuck, math.pi, jnp.minimum(_DIRECTION_GAIN * drift + noise, math.pi))
    jacobian_error = None
    if jacobian is not None:
        jacobian_error = drift + noise
        if goal.kind != "infinity":
            # Close to the camera the beam is still small; close to the horizon large turns of psi cancel in it.
            size = jnp.minimum(_widening(goal, constants, flight, touch, jacobian)[0], 1)
            jacobian_error = jacobian_error * (1 + jnp.abs(touch.psi_rate) / polar_rapidity(constants)) / size
        jacobian_error = jnp.where(flight.stuck, 1.0, jacobian_error) + hidden
    end = End(
        direction=tuple(p + hidden for p in n),
        azimuth=turning + hidden,
        error=error + hidden,
        noise=noise,
        jacobian_error=jacobian_error,
        steps=flight.steps,
        captured=aim.captured,
        jacobian=None if jacobian is None else tuple(tuple(e + hidden for e in row) for row in jacobian),
    )
    if goal.kind != "infinity":
        radius = goal.value + hidden if goal.kind == "sphere" else 1 / ray.position[0] + hidden
        end = end._replace(captured=aim.captured & lost, missed=lost & ~aim.captured, radius=radius)
    if flight.clock_error is not None:
        time = clock.reading(constants, flight.start[0], ray, touch.paths[-1], goal.kind == "infinity") + hidden
        drift, noise = _time_errors(frame, constants, goal, end, ray)
        drift = jnp.where(flight.stuck, jnp.inf, drift + _DIRECTION_GAIN * flight.clock_error)
        end = end._replace(time=time, time_error=drift + noise + hidden, time_noise=noise)
    return end


def _horizon_noise(frame: Frame) -> Array:
    """What rounding the horizon's radius does to psi for a camera next to it."""
    outer = radial.horizon(frame.spin)
    return 3e-16 * frame.spin / (outer - frame.spin**2 / outer) * frame.radius / (frame.radius - outer)


def _touch_down(spin: float, goal: Goal, constants: Constants, aim: Aim, flight: Flight) -> _Touch:
    rest = time_left(goal, constants, aim, flight.paths[0])
    timed = flight.clock_error is not None
    if goal.kind == "infinity":
        others = flight.paths[:-1] if timed else flight.paths
        paths, psi_rate = [_advanced_far_out(spin, path, rest) for path in others], 0.0
        if timed:
            paths += _advanced(flight.rates, flight.paths, rest)[0][-1:]
    else:
        paths, psi_rate = _advanced(flight.rates, flight.paths, rest)
    position = paths[0].position
    return _Touch(paths, tuple(p / length(position[1:]) for p in position[1:]), psi_rate)


def _advanced_far_out(spin: float, path: Path, time: Array) -> Path:
    """A path after a very short time close to infinity, where psi' = -2 a u."""
    position = tuple(p + time * r for p, r in zip(path.position, path.rate, strict=True))
    psi = path.psi - 2 * spin * time * (path.position[0] + time / 2 * path.rate[0])
    return Path(position, path.rate, psi)


def _advanced(rates: Rates, paths: Sequence[Path], time: Array) -> tuple[list[Path], Array]:
    """All paths after a very short time anywhere, and psi' of the ray."""
    accelerations, psi_rates = rates([path.position for path in paths])
    moved = []
    for path, pull, psi_rate in zip(paths, accelerations, psi_rates, strict=True):
        parts = list(zip(path.position, path.rate, pull, strict=True))
        position = tuple(p + time * (r + time / 2 * a) for p, r, a in parts)
        moved.append(Path(position, tuple(r + time * a for _, r, a in parts), path.psi + time * psi_rate))
    return moved, psi_rates[0]


def _jacobian(goal: Goal, touch: _Touch, n: tuple[Array, ...]) -> Jacobian:
    """Rows (e_theta', e_phi'), or (dr, r dphi) in the plane; columns the two variations, moved along to the end."""
    ray, *variations = touch.paths[:3]
    c, s = jnp.cos(ray.psi), jnp.sin(ray.psi)
    fixed = 3 if goal.kind == "plane" else 0
    e_theta, e_phi = polar_basis(jnp.stack(n, axis=-1), jnp)
    columns, radial_row = [], []
    for path in variations:
        shift = -path.position[fixed] / ray.rate[fixed]
        moved = [d + shift * r for d, r in zip(path.position[1:], ray.rate[1:], strict=True)]
        turn = path.psi if goal.kind == "infinity" else path.psi + shift * touch.psi_rate
        x, y, z = turned(touch.m, moved, turn)
        columns.append((c * x - s * y, s * x + c * y, z))
        radial_row.append(-(path.position[0] + shift * ray.rate[0]) / ray.position[0] ** 2)
    rows = [tuple(e[..., i] for i in range(3)) for e in (e_theta, e_phi)]
    jacobian = tuple(tuple(dot(row, column) for column in columns) for row in rows)
    if goal.kind == "plane":
        return tuple(radial_row), tuple(entry / ray.position[0] for entry in jacobian[1])
    return jacobian


def _growth(
    goal: Goal, constants: Constants, aim: Aim, flight: Flight, touch: _Touch, jacobian: Jacobian | None
) -> tuple[Array, Array]:
    """How errors made on the way, and round-off in N, grow to the end: in radians, in the plane also in ln r."""
    ray = touch.paths[0]
    speed = polar_rapidity(constants)
    if jacobian is not None:
        growth, spread = _widening(goal, constants, flight, touch, jacobian)
    else:
        growth = jnp.abs(touch.paths[1].position[0])
        if goal.kind == "sphere":
            growth = growth * (1 + jnp.abs(touch.psi_rate) / speed) / jnp.abs(ray.rate[0])
        if goal.kind == "plane":
            growth = growth * (1 / jnp.abs(ray.position[0]) + jnp.abs(touch.psi_rate)) / speed
        spread = growth * aim.conditioning
    if goal.kind == "infinity":
        return growth, spread
    motion = 1 + jnp.abs(touch.psi_rate) / speed
    if goal.kind == "plane":
        motion = motion + jnp.abs(ray.rate[0] / ray.position[0]) / speed
        growth = jnp.maximum(growth, motion)
        if jacobian is None:
            # A ray that leaves off the plane at a small inclination is late by z0 dz0' / z'^2.
            late = jnp.abs(flight.start[0].position[3]) * (speed / ray.rate[3]) ** 2
            spread = spread + motion * late * aim.conditioning
    return growth, spread + motion


def _widening(
    goal: Goal, constants: Constants, flight: Flight, touch: _Touch, jacobian: Jacobian
) -> tuple[Array, Array]:
    """Size of the Jacobian, per radian of arc that the beam opens and per radian in N; in the plane relative to r."""
    spread = length([entry for row in jacobian for entry in row])
    if goal.kind == "plane":
        spread = spread * jnp.abs(touch.paths[0].position[0])
    opening = length((*flight.start[1].rate[1:], *flight.start[2].rate[1:]))
    return spread * polar_rapidity(constants) / opening, spread


def _time_errors(frame: Frame, constants: Constants, goal: Goal, end: End, ray: Path) -> tuple[Array, Array]:
    """Errors of the time that come with those of the end, and by round-off.

    An end displaced by some angle is late by at most sqrt(k) times that.
    """
    lever: Array = polar_rapidity(constants)
    start = 1 / frame.radius
    reach: Array = frame.radius + 0.3 / (start * radial.horizon_function(frame.spin, start))
    if goal.kind != "infinity":
        u = jnp.abs(ray.position[0])
        depth = 1 / (u * radial.horizon_function(frame.spin, u))
        reach = reach + depth
        if goal.kind == "plane":
            lever = lever + depth
    return lever * end.error, lever * end.noise + 1e-15 * reach
