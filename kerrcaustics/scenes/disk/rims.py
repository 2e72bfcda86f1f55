"""Checks of disks and volumes."""

import math
from typing import Any

from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import apart, quoted, real_number


def check_rims(inner: Any, outer: Any) -> None:
    """Raise ValueError unless the radii are valid and in order."""
    for name, value in (("inner", inner), ("outer", outer)):
        if not 0 < real_number(name, value) < math.inf:
            raise ValueError(f"Argument `{name}` must be a positive, finite radius, but is {quoted(value)}.")
    if not inner < outer:
        raise ValueError(f"Argument `inner` must be smaller than `outer` ({outer:g}), but is {inner:g}.")


def check_brightness(brightness: Any) -> None:
    """Raise ValueError unless the factor of light is valid."""
    if not 0 <= real_number("brightness", brightness) < math.inf:
        raise ValueError(f"Argument `brightness` must be a finite number from 0 on, but is {quoted(brightness)}.")


def check_above_horizon(inner: float, spin: float) -> None:
    """Raise ValueError for an inner rim within the horizon of a hole."""
    horizon = kerr.horizon(spin)
    if not inner > horizon:
        shown, least = apart(inner, horizon)
        raise ValueError(f"Argument `inner` must be larger than the horizon radius {least}, but is {shown}.")
