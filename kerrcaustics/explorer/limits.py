"""Ranges of the explorer's numbers, as the physics and the time of a computation allow them."""

import math
from dataclasses import replace
from typing import Any

from kerrcaustics.explorer.state import (
    LEAST_RADIUS,
    MOST_FREQUENCY,
    MOST_ORDERS,
    MOST_RADIUS,
    MOST_SIZE,
    MOST_SPIN,
    ExplorerState,
)
from kerrcaustics.spacetime.camera import VELOCITY_NAMES
from kerrcaustics.spacetime.kerr import horizon

NEAREST = 1.01
"""The radius of the nearest camera, by that of the horizon."""

STEPS = 1e4
"""Its steps per unit of the mass."""

# Where the camera has not the velocity that is wanted: there is one at rest with the FIDO everywhere.
_ALWAYS = "fiducial"


def allowed(state: ExplorerState) -> dict[str, Any]:
    """Least and largest numbers beside the others of a state, and for each velocity why it cannot be, or no text."""
    return {
        "spin": [0.0, MOST_SPIN],
        "radius": [nearest_radius(state.spin), MOST_RADIUS],
        "inclination": [0.0, 180.0],
        "theta": [0.0, 180.0],
        "phi": [0.0, 360.0],
        "size": [0.0, MOST_SIZE],
        "frequency": [0.0, MOST_FREQUENCY],
        "orders": [1, MOST_ORDERS],
        "velocity": {name: _obstacle(state, name) for name in VELOCITY_NAMES},
    }


def nearest_radius(spin: float) -> float:
    """The least radius of a camera, rounded up to four digits behind the point."""
    return math.ceil(STEPS * NEAREST * float(horizon(spin))) / STEPS


def nearest(state: ExplorerState) -> ExplorerState:
    """The state with a camera that there is: not too near to the hole, and fiducial where its velocity cannot be."""
    if 0 <= state.spin <= MOST_SPIN and state.radius >= LEAST_RADIUS:
        state = replace(state, radius=max(state.radius, nearest_radius(state.spin)))
    if state.velocity != _ALWAYS and _obstacle(state, state.velocity):
        state = replace(state, velocity=_ALWAYS)
    return state


def _obstacle(state: ExplorerState, velocity: str) -> str:
    """The reason why a camera cannot have a velocity, after "it"; no text if it can."""
    try:
        replace(state, velocity=velocity).camera()
    except ValueError as error:
        return str(error).removeprefix("Argument `velocity` ")
    return ""
