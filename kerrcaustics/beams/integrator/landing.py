"""The last stretch of a ray, one very short Taylor step onto its end, and the quantities at the end."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams import certainty, errors
from kerrcaustics.beams.geometry import azimuth_step, length
from kerrcaustics.beams.integrator import clock
from kerrcaustics.beams.integrator.equations import polar_rapidity
from kerrcaustics.beams.integrator.journey import MAX_STEPS, Journey, Progress
from kerrcaustics.beams.integrator.nystroem import Rates
from kerrcaustics.beams.integrator.spread import Ray, of_beam, size_alone
from kerrcaustics.beams.ray_end import RayEnd
from kerrcaustics.beams.ray_state import Arriving, Jacobian, Path
from kerrcaustics.beams.traced_results import stacked, status_of
from kerrcaustics.beams.vectors import dot, with_small_turn
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Flags, Reals
from kerrcaustics.spacetime.frame import Frame, frequency_ratio
from kerrcaustics.spacetime.sphere import polar_basis

# The order 12 result is better than the order 10 one, whose local errors are summed, by a factor of 25 in the worst
# cases and by hundreds in most; its derivatives at the same steps are not. Measured:
# studies/accuracy/error_estimates.py.
_DIRECTION_GAIN = 0.02
# Steps per radian of arc, or more, for which that was measured: in longer ones the two orders are less far apart.
_DENSE = 0.8
# Round-off of N, or of a step, as the spread of the beam magnifies it.
_ROUNDING = 1e-15
# Growth of that round-off with each step.
_PER_STEP = 0.1
# Round-off of the angles by which the path turns round the axis, relative to them.
OF_TURN = 4e-16
# Round-off of N as it enters the Jacobian through the angular momentum.
_IN_JACOBIAN = 4e-15


class _Doubt(NamedTuple):
    """Errors at the end.

    direction: error of the direction, with no upper limit.
    noise: round-off of the direction.
    bent: error of the Jacobian.
    """

    direction: Reals
    noise: Reals
    bent: Reals


class _Touch(NamedTuple):
    """The paths at the end, with m, n', the azimuth of m, psi' there; the arc of the Taylor step."""

    paths: list[Path]
    m: Components
    n: Components
    turn: Reals
    psi_rate: Reals
    at: Arriving
    stretch: Reals


def land(
    frame: Frame, journey: Journey, began: Ray, started: tuple[Path, ...], last: Progress, *, beams: bool
) -> RayEnd[Reals | Flags]:
    """The end of each ray, or beam, from the ray and the paths at the camera, and those shortly before the end."""
    touch = _touch_down(journey, last)
    ray, end = touch.paths[0], journey.end
    jacobian = _jacobian(journey, touch) if beams else None
    if jacobian is None:
        size = size_alone(frame, began, end, journey.aim, touch.at, ray.rate[0])
    else:
        size = of_beam(end, touch.at, jacobian)
    doubt = _doubt(frame, journey, started, last, touch, size)
    lost = end.lost(journey.aim, frame.spin, ray.position[0])
    hidden = jnp.where(lost, jnp.nan, 0.0)
    error, rate = jnp.minimum(doubt.direction, math.pi), started[0].rate
    n = _or(touch.n, (1.0, 0.0, 0.0))
    ends: RayEnd[Any] = RayEnd(
        direction=stacked(n, hidden),
        azimuth=_or((touch.turn + ray.psi,), (0.0,))[0] + hidden,
        azimuth_error=certainty.azimuth_error(frame, journey.constants, touch.n, doubt.direction, touch.turn, rate)
        + hidden,
        status=status_of(lost, journey.aim.captured),
        status_certain=journey.aim.certain,
        error=error + hidden,
        noise=doubt.noise,
        closed_form=jnp.zeros_like(lost),
        redshift=frequency_ratio(frame, began.sky, began.photon.energy_ratio) + hidden,
        radius=end.radius_at(ray.position[0]) + hidden if end.finite else None,
        outward=ray.rate[0] < 0 if end.finite else None,
        index=last.conjugate_points,
    )
    if last.crossings is not None:
        leaving = ray.position[3] * ray.rate[3]
        count, sure = certainty.crossings(frame, end, last.crossings, (touch.n[2], error), leaving, rate)
        ends = replace(ends, crossings=count, crossings_certain=sure)
    if jacobian is not None:
        rows = tuple(_or(row, (0.0, 0.0)) for row in jacobian)
        sure = None if last.conjugate_points is None else certainty.index_is_certain(rows, doubt.bent)
        entries = errors.of_entries((n[0], n[1], n[2]), doubt.bent, error)
        ends = replace(ends, jacobian=stacked(rows, hidden), jacobian_error=entries + hidden, index_certain=sure)
        ends = replace(ends, diameter_error=doubt.bent + hidden)
    if last.clock_error is None:
        return ends
    time, time_error, rounding = _timed(frame, journey, started[0], last, touch, doubt)
    return replace(ends, time=time + hidden, time_error=time_error + hidden, time_noise=rounding)


def horizon_noise(spin: Reals, u: Reals) -> Reals:
    """The noise in psi by rounding of the horizon's radius, for a camera or another place next to it at u = 1 / r."""
    outer = radial.horizon(spin)
    return 3e-16 * spin / (outer - spin**2 / outer) / jnp.maximum(1 - outer * u, 1e-16)


def _touch_down(journey: Journey, last: Progress) -> _Touch:
    end, spin, paths = journey.end, journey.spin, last.paths
    rest = end.time_left(journey.constants, journey.aim, paths[0])
    if end.finite:
        at_end, psi_rate = short_step(journey.rates, paths, rest)
    else:
        timed = last.clock_error is not None
        at_end = [_advanced_far_out(spin, path, rest) for path in (paths[:-1] if timed else paths)]
        psi_rate = jnp.zeros_like(rest)
        if timed:
            at_end += short_step(journey.rates, paths, rest)[0][-1:]
    position, rate, psi = at_end[0].position, at_end[0].rate, at_end[0].psi
    x, y, z = (p / length(position[1:]) for p in position[1:])
    c, s = jnp.cos(psi), jnp.sin(psi)
    n = (c * x - s * y, s * x + c * y, z)
    speed = polar_rapidity(journey.constants)
    at = Arriving(jnp.abs(position[0]), jnp.abs(rate[0]), jnp.abs(psi_rate), speed)
    turn = last.azimuth + azimuth_step(journey.constants.b, paths[0].position, position)
    return _Touch(at_end, (x, y, z), n, turn, psi_rate, at, jnp.abs(rest) * speed)


def _advanced_far_out(spin: Reals, path: Path, time: Reals) -> Path:
    """A path after a very short time close to infinity, where psi' = -2 a u."""
    position = tuple(p + time * r for p, r in zip(path.position, path.rate, strict=True))
    psi = path.psi - 2 * spin * time * (path.position[0] + time / 2 * path.rate[0])
    return Path(position, path.rate, psi)


def short_step(rates: Rates, paths: Sequence[Path], time: Reals) -> tuple[list[Path], Reals]:
    """All paths after a very short time anywhere, and psi' of the ray."""
    accelerations, psi_rates = rates([path.position for path in paths])
    moved = []
    for path, pull, psi_rate in zip(paths, accelerations, psi_rates, strict=True):
        parts = list(zip(path.position, path.rate, pull, strict=True))
        position = tuple(p + time * (r + time / 2 * a) for p, r, a in parts)
        moved.append(Path(position, tuple(r + time * a for _, r, a in parts), path.psi + time * psi_rate))
    return moved, psi_rates[0]


def _jacobian(journey: Journey, touch: _Touch) -> Jacobian:
    """The Jacobian in the surface of the end: columns the two variations, moved along to it."""
    ray, *variations = touch.paths[:3]
    c, s = jnp.cos(ray.psi), jnp.sin(ray.psi)
    fixed = journey.end.coordinate
    columns, in_radius = [], []
    for path in variations:
        shift = -path.position[fixed] / ray.rate[fixed]
        moved = [d + shift * r for d, r in zip(path.position[1:], ray.rate[1:], strict=True)]
        x, y, z = with_small_turn(touch.m, moved, path.psi + shift * touch.psi_rate)
        columns.append((c * x - s * y, s * x + c * y, z))
        in_radius.append(-(path.position[0] + shift * ray.rate[0]) / ray.position[0] ** 2)
    rows = [tuple(e[..., i] for i in range(3)) for e in polar_basis(jnp.stack(touch.n, axis=-1), jnp)]
    angles = tuple(tuple(dot(row, column) for column in columns) for row in rows)
    return journey.end.jacobian(angles, 1 / ray.position[0], tuple(in_radius))


def _doubt(
    frame: Frame, journey: Journey, started: tuple[Path, ...], last: Progress, touch: _Touch, size: Reals
) -> _Doubt:
    """The growth to the end of errors made on the way, and of round-off in N: in radians, in the plane also in ln r.

    It follows from the size of the beam, which opens by at least this many radians of arc for each in N.
    """
    end, at, ray = journey.end, touch.at, touch.paths[0]
    opening = length((*started[1].rate[1:], *started[2].rate[1:])) / at.speed
    growth, often = size / opening, 1 + _PER_STEP * last.steps
    drift = last.local_error * jnp.maximum(growth, end.least_growth(at))
    # Rays that could not be brought close to their end land by too long a step.
    unsettled, bending = end.unsettled(journey.constants, at)
    step_error = end.delayed(unsettled * at.speed + touch.stretch**2, at)
    rounded = OF_TURN * (jnp.abs(touch.turn) + jnp.abs(ray.psi)) + horizon_noise(frame.spin, 1 / frame.radius)
    noise = _ROUNDING * (1 + size + end.motion(at)) * often + rounded + step_error
    bent = errors.of_jacobian(end, _IN_JACOBIAN * opening * often, drift + noise, at.turning, growth)
    # A beam opens with the way, and the more the less its rays have of a radial motion at their end.
    bent = bent + unsettled * (bending + 1 / jnp.maximum(last.time, 1e-300))
    # Rounding of its place: of the height, if that fixes the arrival; of the distance from the horizon in psi.
    slip = end.slip(journey.aim, at) / growth + at.turning / radial.horizon_function(journey.spin, at.u)
    bent = jnp.minimum(bent + _ROUNDING * often * slip, 1.0)
    direction = _gain(journey) * drift + noise
    # If double precision could not follow the ray, its end is unknown.
    known = (last.steps < MAX_STEPS) & jnp.isfinite(direction + touch.turn + ray.psi)
    limited = ((direction, jnp.inf), (noise, math.pi), (bent, 1.0))
    return _Doubt(*(jnp.where(known, value, limit) for value, limit in limited))


def _gain(journey: Journey) -> Reals:
    """The part of the summed local errors that is one of the result, of the path and of the clock."""
    return _DIRECTION_GAIN * jnp.maximum(_DENSE / journey.density, 1) ** 2


def _or(values: tuple[Reals, ...], fallbacks: tuple[float, ...]) -> tuple[Reals, ...]:
    """The values, or the fallbacks if one of the values is no finite number."""
    known = jnp.isfinite(sum(values))
    return tuple(jnp.where(known, value, fallback) for value, fallback in zip(values, fallbacks, strict=True))


def _timed(
    frame: Frame, journey: Journey, start: Path, last: Progress, touch: _Touch, doubt: _Doubt
) -> tuple[Reals, Reals, Reals]:
    """The time, its error, and the part of it that is round-off."""
    at_infinity = not journey.end.finite
    time = clock.reading(
        journey.constants, start, touch.paths[0], touch.paths[-1], at_infinity=at_infinity, distant=frame.start == 0
    )
    # The clock is as uncertain as n' by round-off of the steps, beside the part of the end.
    time_error, rounding = errors.of_time(frame, journey.end, touch.at, doubt.direction + doubt.noise, doubt.noise)
    time_error = time_error + _gain(journey) * (0.0 if last.clock_error is None else last.clock_error)
    known = jnp.isfinite(time + time_error)
    return jnp.where(known, time, 0.0), jnp.where(known, time_error, jnp.inf), rounding
