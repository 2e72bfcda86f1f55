"""Rays and beams integrated in Mino time, in a form with no singular point.

The path is u = 1/r and a point m = (x, y, z) of the unit sphere that turns about the spin axis by psi:

    u'' = U'(u) / 2,   m'' = a^2 z e_z - (k + 2 a^2 z^2) m,   psi' = -a (2 u - a b u^2) / (1 - 2 u + a^2 u^2).

No first derivative stands on the right, so a Runge-Kutta-Nystroem pair of order 12(10) integrates it. A beam
is the same path with its first variation in two orthonormal directions of the camera sky, in the same steps.
Each ray takes its own steps, from a bound on how fast its solution can change; a batch runs until its slowest
ray has arrived, so batches want rays of similar work (see trace.py).

All functions work elementwise on JAX arrays of one shape, one entry a ray.
"""

import math
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.geometry import area, azimuth_step, changed_sign, dot, length, turned
from kerrcaustics.beams.nystroem import Path, nystroem_step
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.camera import Frame, photon
from kerrcaustics.spacetime.sphere import polar_basis, tangent_basis

Array = Any

MAX_STEPS = 3000
# The order 12 result is better than the order 10 one, whose local errors are summed, by a factor of 25 in the worst
# cases and by hundreds in most; its derivatives at the same steps are not. Measured: studies/error_estimates.py.
_DIRECTION_GAIN = 0.02
# Steps per radian of arc that bring the local error down to round-off.
_DENSEST = 3.6
# The remaining arc, in radians, below which the path is straight enough to land on infinity by one Taylor step.
_LANDING_ARC = 1e-8


class Constants(NamedTuple):
    """What stays the same along a ray: U = 1 + a2 u^2 + a1 u^3 + a0 u^4, k = q + b^2, and b."""

    a2: Array
    a1: Array
    a0: Array
    k: Array
    b: Array


class End(NamedTuple):
    """A ray at infinity. What was not asked for is None.

    direction (x, y, z) of n'; azimuth, unwrapped; error in radians, and noise, the part of it that is round-off;
    jacobian_error, relative; steps taken; captured; jacobian, rows e_theta', e_phi', columns the two camera-sky
    directions; conjugate_points passed (the Morse index); crossings of the equatorial plane.
    """

    direction: tuple[Array, Array, Array]
    azimuth: Array
    error: Array
    noise: Array
    jacobian_error: Array | None
    steps: Array
    captured: Array
    jacobian: tuple[tuple[Array, ...], ...] | None
    conjugate_points: Array | None = None
    crossings: Array | None = None


def survey(frame: Frame, sky: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """Which rays are captured, and an estimate of the work of the others, without integrating."""
    constants, path, aim = _start(frame, sky)
    work = aim.mino_time * _rapidity(frame.spin, constants, path) * _near_edge(constants, aim.mino_time)
    return aim.captured, jnp.where(aim.captured, 0, work)


def trace(
    frame: Frame,
    sky: tuple[Array, Array, Array],
    refinement: Array,
    tolerance: float,
    *,
    beams: bool,
    index: bool = False,
    crossings: bool = False,
) -> End:
    """Rays, or beams, followed from camera-sky directions to infinity (u = 0 exactly).

    Parameters: sky, three arrays N_x, N_y, N_z; refinement, steps are shorter by this factor per ray, and 0 leaves
    a ray out; tolerance, the wanted error of n' in radians; beams, index, crossings: what to compute beside n'.
    """
    constants, ray, aim = _start(frame, sky)
    paths, variations = _with_variations(frame, sky, ray) if beams else _with_instability(constants, ray)
    density = refinement * jnp.minimum(_density(tolerance, index) * _near_edge(constants, aim.mino_time), _DENSEST)
    idle = aim.captured | (refinement <= 0)
    goal = jnp.where(idle, 0.0, aim.mino_time)
    rates = partial(_all_rates, frame.spin, constants, variations)

    def beam_area(paths: tuple[Path, ...]) -> Array:
        return area(_rates(frame.spin, constants, paths[0].position)[1], paths)

    def remaining(now: _Progress) -> Array:
        u, w = now.paths[0].position[0], now.paths[0].rate[0]
        left = jnp.where(now.time < goal, goal - now.time, -u / w)
        arc = jnp.abs(left) * _polar_rapidity(constants)
        done = idle | ((now.time >= goal) & ~(arc > _LANDING_ARC)) | (now.steps >= MAX_STEPS)
        return jnp.where(done, 0.0, left)

    def step(now: _Progress) -> _Progress:
        left = remaining(now)
        count = jnp.ceil(jnp.abs(left) * density * _rapidity(frame.spin, constants, now.paths[0]))
        h = left / jnp.maximum(count, 1)
        paths, gap = nystroem_step(rates, now.paths, h)
        turn = azimuth_step(constants.b, now.paths[0].position, paths[0].position)
        after = now._replace(
            time=jnp.where(count <= 1, jnp.maximum(goal, now.time), now.time + h),
            steps=now.steps + (h != 0),
            paths=paths,
            local_error=now.local_error + _local_error(constants, gap),
            azimuth=now.azimuth + turn,
        )
        if index:
            passed, sign = changed_sign(now.area_sign, beam_area(paths))
            after = after._replace(conjugate_points=now.conjugate_points + passed, area_sign=sign)
        if crossings:
            passed, sign = changed_sign(now.side, paths[0].position[3])
            after = after._replace(crossings=now.crossings + passed, side=sign)
        return after

    none = jnp.zeros_like(goal)
    first = _Progress(
        time=none,
        steps=none,
        paths=paths,
        local_error=none,
        azimuth=_first_azimuth(frame, ray),
        conjugate_points=none,
        area_sign=jnp.sign(beam_area(paths)) if index else none,
        crossings=none,
        side=jnp.where(ray.position[3] == 0, jnp.sign(ray.rate[3]), jnp.sign(ray.position[3])),
    )
    last = jax.lax.while_loop(lambda now: jnp.any(remaining(now) != 0), step, first)
    end = _land(frame, constants, aim, paths, last, beams=beams)
    return end._replace(
        conjugate_points=last.conjugate_points if index else None, crossings=last.crossings if crossings else None
    )


class _Aim(NamedTuple):
    """Where a ray is going: captured or not, the Mino time to infinity, and how much it magnifies round-off in N.

    Deep in the field the energy at infinity is a small difference of large numbers.
    """

    captured: Array
    mino_time: Array
    conditioning: Array


class _Progress(NamedTuple):
    time: Array
    steps: Array
    paths: tuple[Path, ...]
    local_error: Array
    azimuth: Array
    conjugate_points: Array
    area_sign: Array
    crossings: Array
    side: Array


def _start(frame: Frame, sky: tuple[Array, Array, Array]) -> tuple[Constants, Path, _Aim]:
    light = photon(frame, sky)
    a2, a1, a0 = radial.potential_coefficients(frame.spin, light)
    quartic = radial.factor(a2, a1, a0)
    captured = radial.is_captured(frame, light, quartic)
    time = jnp.where(captured, 0.0, radial.mino_time(frame, light, quartic))
    terms = frame.lapse + jnp.abs(light.energy_ratio - frame.lapse)
    aim = _Aim(captured, time, terms / jnp.abs(light.energy_ratio))
    return Constants(a2, a1, a0, light.k, light.b), Path(light.position, light.rate, 0 * light.b), aim


def _rates(spin: float, constants: Constants, position: tuple[Array, ...]) -> tuple[tuple[Array, ...], Array]:
    """Second derivatives of (u, x, y, z), and the first derivative of psi."""
    a2, a1, a0, k, b = constants
    u, x, y, z = position
    pull = k + 2 * spin**2 * z * z
    psi_rate = -spin * u * (2 - spin * b * u) / _horizon_function(spin, u)
    return ((a2 + (1.5 * a1 + 2 * a0 * u) * u) * u, -pull * x, -pull * y, (spin**2 - pull) * z), psi_rate


def _horizon_function(spin: float, u: Array) -> Array:
    """Delta / r^2 = 1 - 2 u + a^2 u^2, in factors that keep their digits close to a nearly extremal hole."""
    outer = radial.horizon(spin)
    return (1 - outer * u) * (1 - spin**2 / outer * u)


def _rates_with_variation(
    spin: float,
    constants: Constants,
    position: tuple[Array, ...],
    variations: list[tuple[Constants, tuple[Array, ...]]],
) -> tuple[list[tuple[Array, ...]], list[Array]]:
    """`_rates`, followed by their derivatives along each variation (of the constants, of the position).

    Written out because XLA compiles it in half the time of the automatic derivative; the tests compare the two.
    """
    a2, a1, a0, k, b = constants
    u, x, y, z = position
    accelerations, psi_rate = _rates(spin, constants, position)
    pull = k + 2 * spin**2 * z * z
    slope = a2 + (3 * a1 + 6 * a0 * u) * u
    inverse = 1 / _horizon_function(spin, u)
    psi_by_u = (2 * inverse) * (psi_rate * (1 - spin**2 * u) - spin * (1 - spin * b * u))
    psi_by_b = spin**2 * u * u * inverse
    all_accelerations, all_psi_rates = [accelerations], [psi_rate]
    for dc, (du, dx, dy, dz) in variations:
        d_pull = dc.k + 4 * spin**2 * z * dz
        all_accelerations.append(
            (
                slope * du + (dc.a2 + (1.5 * dc.a1 + 2 * dc.a0 * u) * u) * u,
                -pull * dx - d_pull * x,
                -pull * dy - d_pull * y,
                (spin**2 - pull) * dz - d_pull * z,
            )
        )
        all_psi_rates.append(psi_by_u * du + psi_by_b * dc.b)
    return all_accelerations, all_psi_rates


def _with_variations(frame: Frame, sky: tuple[Array, ...], ray: Path) -> tuple[tuple[Path, ...], list[Constants]]:
    """The ray with its variations in two orthonormal directions of the camera sky, and those of its constants."""
    started = []
    for direction in tangent_basis(jnp.stack(sky, axis=-1), jnp):
        tangent = tuple(direction[..., i] for i in range(3))
        started.append(jax.jvp(lambda *s: _start(frame, s)[:2], sky, tangent)[1])
    return (ray, *(path for _, path in started)), [variation for variation, _ in started]


def _with_instability(constants: Constants, ray: Path) -> tuple[tuple[Path, ...], list[Constants]]:
    """The ray with a variation of u alone, of unit slope in arc: how errors made on the way grow to the end."""
    zero = jnp.zeros_like(constants.b)
    return (ray, Path((zero,), (_polar_rapidity(constants),), zero)), []


def _all_rates(
    spin: float, constants: Constants, variations: list[Constants], positions: list[tuple[Array, ...]]
) -> tuple[list[tuple[Array, ...]], list[Array]]:
    """Rates of the ray and of its variations; without variations, of the ray and of its instability."""
    if variations:
        pairs = list(zip(variations, positions[1:], strict=True))
        return _rates_with_variation(spin, constants, positions[0], pairs)
    (accelerations, psi_rate), u = _rates(spin, constants, positions[0]), positions[0][0]
    slope = constants.a2 + (3 * constants.a1 + 6 * constants.a0 * u) * u
    return [accelerations, (slope * positions[1][0],)], [psi_rate, jnp.zeros_like(psi_rate)]


def _local_error(constants: Constants, gap: Path) -> Array:
    """What the gap between the orders means for n', in radians: u counts through the time of arrival."""
    rapidity = _polar_rapidity(constants)
    in_u = jnp.abs(gap.position[0]) + jnp.abs(gap.rate[0]) / rapidity
    in_m = length(gap.position[1:]) + length(gap.rate[1:]) / rapidity
    return in_m + rapidity * in_u + jnp.abs(gap.psi)


def _polar_rapidity(constants: Constants) -> Array:
    """Radians of arc along the sphere of m in a unit of Mino time, never less than sqrt(3)."""
    return jnp.sqrt(jnp.maximum(constants.k, 0) + 3)


def _rapidity(spin: float, constants: Constants, path: Path) -> Array:
    """Rate in Mino time at which the solution changes: the polar oscillation, and the pole of psi' at the horizon.

    1 / (the second part) is the time the path would need, in the complex plane, to reach the horizon, where
    psi' is infinite: it matters for rays that graze the hole and for cameras close to it.
    """
    u, w = path.position[0], path.rate[0]
    u_horizon = 1 / radial.horizon(spin)
    acceleration = (constants.a2 + (1.5 * constants.a1 + 2 * constants.a0 * u) * u) * u
    gap = jnp.maximum(u_horizon - u, 1e-300)
    to_horizon = (jnp.abs(w) + jnp.sqrt(w * w + 2 * jnp.abs(acceleration) * gap)) / (2 * gap)
    return jnp.hypot(_polar_rapidity(constants), 1.3 * to_horizon)


def _density(tolerance: float, index: bool) -> Array:
    """Steps per radian of arc for a wanted error of n'; the power is the order, the factor was measured."""
    density = 1.1 * (1e-10 / tolerance) ** (1 / 12)
    # Conjugate points lie about half a polar oscillation apart, pi radians of arc: no step may hold two.
    return jnp.maximum(density, 0.8) if index else density


def _near_edge(constants: Constants, mino_time: Array) -> Array:
    """Shorter steps for rays that circle the hole: their errors grow by about e for every radian of arc."""
    arc = mino_time * _polar_rapidity(constants)
    return jnp.exp(jnp.clip(arc - 4, 0, 16) / 11)


def _first_azimuth(frame: Frame, ray: Path) -> Array:
    """Azimuth of m at the camera: 0, and on the spin axis the direction in which the ray leaves."""
    return jnp.where(frame.sin_theta == 0, jnp.arctan2(ray.rate[2], ray.rate[1]), 0.0)


def _advanced(spin: float, path: Path, time: Array) -> Path:
    """A path after a very short time close to infinity, where psi' = -2 a u."""
    position = tuple(p + time * r for p, r in zip(path.position, path.rate, strict=True))
    psi = path.psi - 2 * spin * time * (path.position[0] + time / 2 * path.rate[0])
    return Path(position, path.rate, psi)


def _land(
    frame: Frame,
    constants: Constants,
    aim: _Aim,
    start: tuple[Path, ...],
    last: _Progress,
    *,
    beams: bool,
) -> End:
    """The end at u = 0, by one short Taylor step of -u/u', and everything that is read off there."""
    before = last.paths[0]
    rest = -before.position[0] / before.rate[0]
    ray, *others = (_advanced(frame.spin, path, rest) for path in last.paths)
    m = tuple(p / length(ray.position[1:]) for p in ray.position[1:])
    c, s = jnp.cos(ray.psi), jnp.sin(ray.psi)
    n = (c * m[0] - s * m[1], s * m[0] + c * m[1], m[2])
    jacobian = None
    if beams:
        columns = []
        for path in others:
            shift = -path.position[0] / ray.rate[0]
            moved = [d + shift * r for d, r in zip(path.position[1:], ray.rate[1:], strict=True)]
            x, y, z = turned(m, moved, path.psi)
            columns.append((c * x - s * y, s * x + c * y, z))
        e_theta, e_phi = polar_basis(jnp.stack(n, axis=-1), jnp)
        rows = [tuple(e[..., i] for i in range(3)) for e in (e_theta, e_phi)]
        jacobian = tuple(tuple(dot(row, column) for column in columns) for row in rows)
        spread = length([entry for row in jacobian for entry in row])
        opening = length((*start[1].rate[1:], *start[2].rate[1:]))
        growth = spread * _polar_rapidity(constants) / opening
    else:
        growth = jnp.abs(others[0].position[0])
        spread = growth * aim.conditioning
    missed = last.steps >= MAX_STEPS
    drift = last.local_error * jnp.maximum(growth, 1)
    # Round-off of 1e-16 in N, or in a step, is seen magnified by the spread of the beam.
    noise = 1e-15 * (1 + spread) * (1 + 0.1 * last.steps)
    hidden = jnp.where(aim.captured, jnp.nan, 0.0)
    turning = last.azimuth + azimuth_step(constants.b, before.position, ray.position) + ray.psi
    return End(
        direction=tuple(p + hidden for p in n),
        azimuth=turning + hidden,
        error=jnp.where(missed, math.pi, jnp.minimum(_DIRECTION_GAIN * drift + noise, math.pi)) + hidden,
        noise=noise,
        jacobian_error=jnp.where(missed, 1.0, drift + noise) + hidden if beams else None,
        steps=last.steps,
        captured=aim.captured,
        jacobian=None if jacobian is None else tuple(tuple(e + hidden for e in row) for row in jacobian),
    )
