"""The error model: the parts that both engines share, and their use.

An error of n' has two parts. Truncation, of the integrator alone, is reported by its steps and grows with the spread of
the beam. Round-off is that of N, 1e-16 magnified by the spread, and that of the engine: of its steps (landing.py), of
its formulas (closed_form/round_off.py). The end converts an error in the path to one in the surface where rays end.

All factors here and there were measured by studies/accuracy/error_estimates.py; the outcome is in docs/accuracy.md.
"""

import jax.numpy as jnp

from kerrcaustics.beams.ray_state import Arriving
from kerrcaustics.beams.traced_ends import TracedEnd
from kerrcaustics.spacetime import radial
from kerrcaustics.spacetime.arrays import Components, Reals
from kerrcaustics.spacetime.frame import Frame
from kerrcaustics.spacetime.sphere import polar_turn

# Of a place at a finite distance, as it enters the Jacobian: that of a beam which has opened far changes with it.
_OF_PLACE = 4.0
# Round-off of a radius, relative, as it enters the time; and the part of it at the camera, whose place is exact.
_TIME_ROUNDING, _AT_CAMERA = 2e-15, 0.3
# The radius whose rounding is in the time to an `Observer`, whose own radius is subtracted.
_FROM_SCREEN = 30.0


def depth(spin: Reals, u: Reals) -> Reals:
    """dt / d ln r of light that falls straight in, r^3 / Delta, at u = 1 / r: infinite at the horizon."""
    return 1 / (u * radial.horizon_function(spin, u))


def of_jacobian(end: TracedEnd, own: Reals, error: Reals, turning: Reals, spread: Reals) -> Reals:
    """Error of the Jacobian's columns in space, relative to delta_plus, from the engine's own and the error of the end.

    Close to the camera the beam is still small; close to the horizon large turns of psi cancel in it.
    """
    small = jnp.minimum(spread, 1)
    if end.finite:
        return (own + _OF_PLACE * error) * (1 + turning) / small
    return own / small + error


def of_entries(n: Components, of_columns: Reals, error: Reals) -> Reals:
    """Error of the Jacobian's entries, relative to delta_plus: that of its columns, and the turn of e_theta', e_phi'.

    Parameters: n, the direction of the end, and its error.
    """
    return jnp.minimum(of_columns + polar_turn(n, error, jnp), 1.0)


def of_time(frame: Frame, end: TracedEnd, at: Arriving, error: Reals, noise: Reals) -> tuple[Reals, Reals]:
    """Error of the time, from that of the end, and round-off of it: both with that of the radii and of the horizon."""
    # The radius of an observer is not in the time.
    radius = jnp.where(frame.start == 0, jnp.minimum(frame.radius, _FROM_SCREEN), frame.radius)
    reach = radius + _AT_CAMERA * depth(frame.spin, 1 / radius)
    lever = at.speed
    if end.finite:
        end_depth = depth(frame.spin, at.u)
        reach, lever = reach + end_depth, end.lever(at, end_depth)
    rounding = _TIME_ROUNDING * reach
    return lever * error + rounding, lever * noise + rounding
