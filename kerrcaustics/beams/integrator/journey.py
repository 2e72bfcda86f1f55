"""Rays on their way: the control of their steps, their progress, and one step."""

from typing import NamedTuple

import jax.numpy as jnp

from kerrcaustics.beams.geometry import area, azimuth_step, changed_sign, length
from kerrcaustics.beams.integrator import clock
from kerrcaustics.beams.integrator.equations import horizon_rapidity, polar_rapidity, rapidity, ray_rates
from kerrcaustics.beams.integrator.nystroem import Rates, nystroem_step
from kerrcaustics.beams.ray_state import Aim, Constants, Path
from kerrcaustics.beams.traced_ends import TracedEnd
from kerrcaustics.spacetime.arrays import Flags, Reals

MAX_STEPS = 3000
# Steps, at least, to where psi and the clock have their pole: in longer ones the two orders are equally far off.
_TO_HORIZON = 2
# The remaining arc, in radians, below which the path is straight enough to land on its end by one Taylor step.
_LANDING_ARC = 1e-8
# Most steps onto a finite end after the computed arrival, for rays close to the end: round-off keeps those that only
# graze it off for ever, by little.
_CORRECTIONS = 3
# Most such steps for other rays: if round-off decides how long a ray lingers above the hole, the computed arrival may
# be far off.
_MOST_CORRECTIONS = 300
# Rest of the arc, in radians, below which a ray is close to the end.
_CLOSE = 1e-6


class Journey(NamedTuple):
    """Numbers that steer the steps: the end, the time of arrival (0 for idle rays), steps per radian, the equations."""

    spin: Reals
    end: TracedEnd
    constants: Constants
    aim: Aim
    idle: Flags
    arrival: Reals
    density: Reals
    rates: Rates


class Progress(NamedTuple):
    """A ray on its way; quantities not requested are None.

    time: Mino time so far.
    steps: steps so far.
    paths: the ray, its variations if it is a beam, and its clock where there is one.
    local_error: local errors summed over the steps.
    azimuth: azimuth of m, unwrapped, radians.
    conjugate_points: conjugate points passed.
    area_sign: sign of the beam's area.
    crossings: crossings of the equatorial plane.
    side: side of the plane.
    clock_error: errors of the clock summed over the steps.
    corrections: steps after the computed arrival.
    """

    time: Reals
    steps: Reals
    paths: tuple[Path, ...]
    local_error: Reals
    azimuth: Reals
    conjugate_points: Reals | None
    area_sign: Reals | None
    crossings: Reals | None
    side: Reals | None
    clock_error: Reals | None
    corrections: Reals | None


def remaining(journey: Journey, now: Progress) -> Reals:
    """The rest of the Mino time, 0 for rays that are done."""
    end, path = journey.end, now.paths[0]
    rest = jnp.where(
        now.time < journey.arrival, journey.arrival - now.time, end.time_left(journey.constants, journey.aim, path)
    )
    pace = rapidity(journey.spin, journey.constants, path) if end.finite else polar_rapidity(journey.constants)
    off = jnp.abs(rest) * pace
    landing = (now.time >= journey.arrival) & ~(off > _LANDING_ARC)
    # The rest of a ray that double precision lost on its way is NaN.
    done = journey.idle | landing | (now.steps >= MAX_STEPS) | jnp.isnan(rest)
    if now.corrections is not None:
        done = done | (now.corrections >= jnp.where(off < _CLOSE, _CORRECTIONS, _MOST_CORRECTIONS))
    return jnp.where(done, 0.0, rest)


def step(journey: Journey, now: Progress) -> Progress:
    """Take one step of every ray that is not done."""
    rest = remaining(journey, now)
    state = journey.spin, journey.constants, now.paths[0]
    frequency = jnp.maximum(journey.density * rapidity(*state), _TO_HORIZON * horizon_rapidity(*state))
    count = jnp.ceil(jnp.abs(rest) * frequency)
    h = rest / jnp.maximum(count, 1)
    watched = (0,) if now.clock_error is None else (0, len(now.paths) - 1)
    paths, gaps = nystroem_step(journey.rates, now.paths, h, watched)
    # Beyond the end, a ray goes back.
    back = jnp.where(h < 0, -1.0, 1.0)
    turn = azimuth_step(back * journey.constants.b, now.paths[0].position, paths[0].position)
    arrived = now.time >= journey.arrival
    after = now._replace(
        time=jnp.where(arrived, now.time, jnp.where(count <= 1, journey.arrival, now.time + h)),
        steps=now.steps + (rest != 0),
        paths=paths,
        local_error=now.local_error + local_error(journey.constants, gaps[0], journey.end, journey.aim),
        azimuth=now.azimuth + turn,
    )
    if now.clock_error is not None:
        after = after._replace(clock_error=now.clock_error + clock.local_error(journey.constants, paths[-1], gaps[1]))
    if now.corrections is not None:
        after = after._replace(corrections=now.corrections + ((h != 0) & arrived))
    return _with_counts(journey, now, after, back)


def _with_counts(journey: Journey, before: Progress, after: Progress, back: Reals) -> Progress:
    """The conjugate points and the crossings of one step, if requested; those of a step back are subtracted."""
    if before.conjugate_points is not None and before.area_sign is not None:
        passed, sign = changed_sign(before.area_sign, beam_area(journey, after.paths))
        after = after._replace(conjugate_points=before.conjugate_points + back * passed, area_sign=sign)
    if before.crossings is not None and before.side is not None:
        passed, sign = changed_sign(before.side, after.paths[0].position[3])
        after = after._replace(crossings=before.crossings + back * passed, side=sign)
    return after


def beam_area(journey: Journey, paths: tuple[Path, ...]) -> Reals:
    """Signed area of the beam."""
    return area(ray_rates(journey.spin, journey.constants, paths[0].position)[1], paths[:3])


def local_error(constants: Constants, gap: Path, end: TracedEnd | None = None, aim: Aim | None = None) -> Reals:
    """The error of n', radians, by the gap between the orders; an end weighs the components that fix the arrival."""
    speed = polar_rapidity(constants)
    in_u = jnp.abs(gap.position[0]) + jnp.abs(gap.rate[0]) / speed
    in_m, in_m_rate = gap.position[1:], gap.rate[1:]
    if end is not None and aim is not None:
        in_m, in_m_rate = end.weighed(in_m, aim, speed), end.weighed(in_m_rate, aim, speed)
    return length(in_m) + length(in_m_rate) / speed + speed * in_u + jnp.abs(gap.psi)
