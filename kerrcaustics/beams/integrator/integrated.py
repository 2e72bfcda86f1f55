"""Rays and beams integrated in Mino time, in a form with no singular point.

The path is u = 1/r and a point m = (x, y, z) of the unit sphere that turns about the spin axis by psi:

    u'' = U'(u) / 2,   m'' = a^2 z e_z - (k + 2 a^2 z^2) m,   psi' = -a (2 u - a b u^2) / (1 - 2 u + a^2 u^2).

No first derivative stands on the right, so a Runge-Kutta-Nystroem pair of order 12(10) integrates it. A beam
is the same path with its first variation in two orthonormal directions of the camera sky, in the same steps.
Each ray takes its own steps, from a bound on how fast its solution can change; a batch runs until its slowest
ray has arrived, so batches want rays of similar work (see trace.py).

All functions work elementwise on JAX arrays of one shape, one entry a ray.
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from kerrcaustics.beams.ends import INFINITY, Aim, Goal, aim_at, time_left
from kerrcaustics.beams.geometry import area, azimuth_step, changed_sign, length
from kerrcaustics.beams.integrator import clock
from kerrcaustics.beams.integrator.equations import Constants, polar_rapidity, rapidity, rates_with_variation, ray_rates
from kerrcaustics.beams.integrator.landing import End, Flight, land
from kerrcaustics.beams.integrator.nystroem import Path, Rates, nystroem_step
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.camera import Frame, photon
from kerrcaustics.spacetime.sphere import tangent_basis

Array = Any

MAX_STEPS = 3000
# Steps per radian of arc that bring the local error down to round-off.
DENSEST = 3.6
# The remaining arc, in radians, below which the path is straight enough to land on its end by one Taylor step.
_LANDING_ARC = 1e-8
# Steps onto a finite end after the computed arrival: where the ray only grazes it, round-off keeps it off for ever.
_MOST_CORRECTIONS = 3


def survey(frame: Frame, sky: tuple[Array, Array, Array], goal: Goal = INFINITY) -> tuple[Array, Array]:
    """Which rays do not reach their end, and an estimate of the work of the others, without integrating."""
    constants, path, aim = start(frame, sky, goal)
    work = aim.mino_time * rapidity(frame.spin, constants, path) * _near_edge(constants, aim.mino_time)
    return aim.lost, jnp.where(aim.lost, 0, work)


def trace(
    frame: Frame,
    sky: tuple[Array, Array, Array],
    refinement: Array,
    tolerance: float,
    goal: Goal = INFINITY,
    *,
    beams: bool,
    index: bool = False,
    crossings: bool = False,
    time: bool = False,
) -> End:
    """Rays, or beams, followed from camera-sky directions to their end (infinity is u = 0 exactly).

    Parameters: sky, three arrays N_x, N_y, N_z; refinement, steps are shorter by this factor per ray, and 0 leaves
    a ray out; tolerance, the wanted error of n' in radians; goal, where rays end; beams, index, crossings, time: what
    to compute beside n'.
    """
    constants, ray, aim = start(frame, sky, goal)
    paths, variations = with_variations(frame, sky, ray) if beams else _with_instability(constants, ray)
    density = refinement * jnp.minimum(_density(tolerance, index) * _near_edge(constants, aim.mino_time), DENSEST)
    idle = aim.lost | (refinement <= 0)
    rates = partial(_all_rates, frame.spin, constants, variations)
    if time:
        rates = clock.with_clock(rates, frame.spin, constants)
        paths = (*paths, clock.started(constants, ray))
    arrival = jnp.where(idle, 0.0, aim.mino_time)
    course = _Course(frame.spin, goal, constants, aim, idle, arrival, density, rates)
    none = jnp.zeros_like(arrival)
    first = _Progress(
        time=none,
        steps=none,
        paths=paths,
        local_error=none,
        azimuth=_first_azimuth(frame, ray),
        conjugate_points=none if index else None,
        area_sign=jnp.sign(_beam_area(course, paths)) if index else None,
        crossings=none if crossings else None,
        side=jnp.where(ray.position[3] == 0, jnp.sign(ray.rate[3]), jnp.sign(ray.position[3])) if crossings else None,
        clock_error=none if time else None,
        corrections=None if goal.kind == "infinity" else none,
    )
    last = jax.lax.while_loop(lambda now: jnp.any(_remaining(course, now) != 0), partial(_step, course), first)
    flight = Flight(
        start=paths,
        paths=last.paths,
        rates=rates,
        local_error=last.local_error,
        clock_error=last.clock_error,
        azimuth=last.azimuth,
        steps=last.steps,
        stuck=last.steps >= MAX_STEPS,
    )
    end = land(frame, goal, constants, aim, flight, beams)
    # The end in the plane is a crossing itself, on whichever side of it round-off has left z.
    passed = jnp.full_like(none, goal.value) if crossings and goal.kind == "plane" else last.crossings
    return end._replace(conjugate_points=last.conjugate_points, crossings=passed)


class _Course(NamedTuple):
    """What steers the steps: the end, the time of arrival there (0 for idle rays), steps per radian, the equations."""

    spin: float
    goal: Goal
    constants: Constants
    aim: Aim
    idle: Array
    arrival: Array
    density: Array
    rates: Rates


class _Progress(NamedTuple):
    """A ray on its way; what was not asked for is None."""

    time: Array
    steps: Array
    paths: tuple[Path, ...]
    local_error: Array
    azimuth: Array
    conjugate_points: Array | None
    area_sign: Array | None
    crossings: Array | None
    side: Array | None
    clock_error: Array | None
    corrections: Array | None


def _remaining(course: _Course, now: _Progress) -> Array:
    """Mino time left, 0 for rays that are done."""
    path = now.paths[0]
    left = jnp.where(
        now.time < course.arrival,
        course.arrival - now.time,
        time_left(course.goal, course.constants, course.aim, path),
    )
    far_out = course.goal.kind == "infinity"
    pace = polar_rapidity(course.constants) if far_out else rapidity(course.spin, course.constants, path)
    landing = (now.time >= course.arrival) & ~(jnp.abs(left) * pace > _LANDING_ARC)
    done = course.idle | landing | (now.steps >= MAX_STEPS)
    if now.corrections is not None:
        done = done | (now.corrections >= _MOST_CORRECTIONS)
    return jnp.where(done, 0.0, left)


def _step(course: _Course, now: _Progress) -> _Progress:
    """One step of every ray that is not done."""
    left = _remaining(course, now)
    count = jnp.ceil(jnp.abs(left) * course.density * rapidity(course.spin, course.constants, now.paths[0]))
    h = left / jnp.maximum(count, 1)
    watched = (0,) if now.clock_error is None else (0, len(now.paths) - 1)
    paths, gaps = nystroem_step(course.rates, now.paths, h, watched)
    turn = azimuth_step(course.constants.b, now.paths[0].position, paths[0].position)
    after = now._replace(
        time=jnp.where(count <= 1, jnp.maximum(course.arrival, now.time), now.time + h),
        steps=now.steps + (h != 0),
        paths=paths,
        local_error=now.local_error + local_error(course.constants, course.aim, gaps[0]),
        azimuth=now.azimuth + turn,
    )
    if now.clock_error is not None:
        after = after._replace(clock_error=now.clock_error + clock.local_error(course.constants, paths[-1], gaps[1]))
    if now.corrections is not None:
        after = after._replace(corrections=now.corrections + ((h != 0) & (now.time >= course.arrival)))
    if now.conjugate_points is not None and now.area_sign is not None:
        passed, sign = changed_sign(now.area_sign, _beam_area(course, paths))
        after = after._replace(conjugate_points=now.conjugate_points + passed, area_sign=sign)
    if now.crossings is not None and now.side is not None:
        passed, sign = changed_sign(now.side, paths[0].position[3])
        after = after._replace(crossings=now.crossings + passed, side=sign)
    return after


def _beam_area(course: _Course, paths: tuple[Path, ...]) -> Array:
    return area(ray_rates(course.spin, course.constants, paths[0].position)[1], paths[:3])


def start(frame: Frame, sky: tuple[Array, ...], goal: Goal = INFINITY) -> tuple[Constants, Path, Aim]:
    """What stays the same along rays, the rays at the camera, and where they are going."""
    light = photon(frame, sky)
    a2, a1, a0 = radial.potential_coefficients(frame.spin, light)
    quartic = radial.factor(a2, a1, a0)
    aim = aim_at(goal, frame, light, quartic)
    return Constants(a2, a1, a0, light.k, light.b), Path(light.position, light.rate, 0 * light.b), aim


def with_variations(frame: Frame, sky: tuple[Array, ...], ray: Path) -> tuple[tuple[Path, ...], list[Constants]]:
    """The ray with its variations in two orthonormal directions of the camera sky, and those of its constants."""
    started = []
    for direction in tangent_basis(jnp.stack(sky, axis=-1), jnp):
        tangent = tuple(direction[..., i] for i in range(3))
        started.append(jax.jvp(lambda *s: start(frame, s)[:2], sky, tangent)[1])
    return (ray, *(path for _, path in started)), [variation for variation, _ in started]


def _with_instability(constants: Constants, ray: Path) -> tuple[tuple[Path, ...], list[Constants]]:
    """The ray with a variation of u alone, of unit slope in arc: how errors made on the way grow to the end."""
    zero = jnp.zeros_like(constants.b)
    return (ray, Path((zero,), (polar_rapidity(constants),), zero)), []


def _all_rates(
    spin: float, constants: Constants, variations: list[Constants], positions: list[tuple[Array, ...]]
) -> tuple[list[tuple[Array, ...]], list[Array]]:
    """Rates of the ray and of its variations; without variations, of the ray and of its instability."""
    if variations:
        pairs = list(zip(variations, positions[1:], strict=True))
        return rates_with_variation(spin, constants, positions[0], pairs)
    (accelerations, psi_rate), u = ray_rates(spin, constants, positions[0]), positions[0][0]
    slope = constants.a2 + (3 * constants.a1 + 6 * constants.a0 * u) * u
    return [accelerations, (slope * positions[1][0],)], [psi_rate, jnp.zeros_like(psi_rate)]


def local_error(constants: Constants, aim: Aim | None, gap: Path) -> Array:
    """What the gap between the orders means for n', in radians: what tells the arrival counts through its time."""
    speed = polar_rapidity(constants)
    in_u = jnp.abs(gap.position[0]) + jnp.abs(gap.rate[0]) / speed
    in_m, in_m_rate = gap.position[1:], gap.rate[1:]
    if aim is not None and aim.plane_rate is not None:
        late = jnp.maximum(speed / aim.plane_rate, 1)
        in_m, in_m_rate = ((x, y, late * z) for x, y, z in (in_m, in_m_rate))
    return length(in_m) + length(in_m_rate) / speed + speed * in_u + jnp.abs(gap.psi)


def _density(tolerance: float, index: bool) -> Array:
    """Steps per radian of arc for a wanted error of n'; the power is the order, the factor was measured."""
    density = 1.1 * (1e-10 / tolerance) ** (1 / 12)
    # Conjugate points lie about half a polar oscillation apart, pi radians of arc: no step may hold two.
    return jnp.maximum(density, 0.8) if index else density


def _near_edge(constants: Constants, mino_time: Array) -> Array:
    """Shorter steps for rays that circle the hole: their errors grow by about e for every radian of arc."""
    arc = mino_time * polar_rapidity(constants)
    return jnp.exp(jnp.clip(arc - 4, 0, 16) / 11)


def _first_azimuth(frame: Frame, ray: Path) -> Array:
    """Azimuth of m at the camera: 0, and on the spin axis the direction in which the ray leaves."""
    return jnp.where(frame.sin_theta == 0, jnp.arctan2(ray.rate[2], ray.rate[1]), 0.0)
