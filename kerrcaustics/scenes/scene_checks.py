"""Checks of numbers and arrays of scenes, which raise ValueError."""

import math
import os
from collections.abc import Callable
from typing import Any, cast, get_args

import numpy as np

from kerrcaustics.choices import Quality
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import differing_digits, left_out, one_of, quoted, real_array, real_number

# Largest negative light that counts as round-off, as a part of the brightest.
_ROUND_OFF = 1e-6
_MAP_ERRORS: dict[Quality, float] = dict(zip(get_args(Quality), (0.05, 0.01, 0.0025), strict=True))


def check_number(name: str, value: Any, must: str, valid: Callable[[float], bool] = math.isfinite) -> float:
    """Return the argument `name` as a float; raise ValueError, with the words `must`, unless it is valid."""
    number = real_number(name, value)
    if not valid(number):
        raise ValueError(f"Argument `{name}` must {must}, but is {quoted(value)}.")
    return number


def positive(number: float) -> bool:
    """True for a positive, finite number."""
    return 0 < number < math.inf


def not_negative(number: float) -> bool:
    """True for a finite number that is 0 or larger."""
    return 0 <= number < math.inf


def not_light(values: np.ndarray) -> int:
    """The count of values that cannot be light: those that are negative or not finite."""
    return int(np.count_nonzero(~((values >= 0) & (values < math.inf))))


def map_error(quality: str) -> float:
    """The largest error of the map of the sky, in pixels, where it is checked."""
    one_of("quality", quality, _MAP_ERRORS)
    return _MAP_ERRORS[cast("Quality", quality)]


def checked_moment(time: Any) -> float:
    """Return a time of the camera; raise ValueError unless it is a finite number."""
    return check_number("time", time, "be a finite number")


def check_uses(matter: bool, delay: bool, sky: bool = True, sky_radius: float = math.inf) -> None:
    """Raise ValueError for a delay without a disk or a volume, and for a radius of the sky without a sky."""
    if not matter:
        left_out("delay", delay or None, "without a disk or a volume")
    if not sky:
        left_out("sky_radius", None if sky_radius == math.inf else sky_radius, "without a sky")


def check_light(name: str, values: np.ndarray) -> None:
    """Raise ValueError unless an array can be light."""
    if bad := not_light(values):
        more = f", but {bad} of {values.size} are not" if values.size > 1 else ""
        raise ValueError(f"Argument `{name}` must hold finite numbers that are not negative{more}.")


def check_light_function(function: Any, places: str, detail: Any, size: str) -> None:
    """Raise ValueError unless light is a function of `places` (words) whose detail is a positive `size`."""
    if not callable(function):
        raise ValueError(f"Argument `function` must be a function of {places}.")
    check_number("detail", detail, f"be a positive {size}", positive)


def checked_light(function: Callable[..., Any], *places: np.ndarray) -> np.ndarray:
    """The light (n, 3) that a user's function returns for n places; ValueError if it is invalid."""
    light = real_array("function", function(*places))
    if light.shape != (len(places[0]), 3):
        raise ValueError(
            f"Argument `function` must return light of the shape ({len(places[0])}, 3), but its has {light.shape}."
        )
    if bad := not_light(light):
        raise ValueError(
            f"Argument `function` must return finite numbers that are not negative, but {bad} of {light.size} are not."
        )
    return light


def checked_source_light(name: str, source: Any, values: Any, count: int) -> np.ndarray:
    """The light (n, 3) that the method `light` of the argument `name` returned; ValueError if it is invalid."""
    try:
        light = np.asarray(values)
    except (TypeError, ValueError):
        # Lists of different lengths make no array.
        light = np.array(None)
    if light.dtype.kind not in "fiu":
        returned = "no real numbers"
    elif light.shape != (count, 3):
        returned = f"the shape {light.shape}"
    elif not light.size or (light.min() >= -_ROUND_OFF * max(float(light.max()), 1.0) and light.max() < math.inf):
        return light
    else:
        returned = f"{not_light(light)} of {light.size} that are not"
    must = f"have a method `light` that returns finite numbers from 0 on, of the shape ({count}, 3)"
    raise ValueError(f"Argument `{name}` must {must}, but that of {type(source).__name__} returns {returned}.")


def check_light_of_file(path: str | os.PathLike[str], bad: int) -> None:
    """Raise ValueError if a file has values that cannot be light."""
    if bad:
        values = f"{bad} value{'s' * (bad > 1)}"
        raise ValueError(
            f"Argument `path` must name a picture whose light is finite and not negative, but {os.fspath(path)!r} has "
            f"{values} of NaN, infinity or below 0."
        )


def check_rims(inner: Any, outer: Any) -> None:
    """Raise ValueError unless the radii are valid and in order."""
    for name, value in (("inner", inner), ("outer", outer)):
        check_number(name, value, "be a positive, finite radius", positive)
    if not inner < outer:
        raise ValueError(f"Argument `inner` must be smaller than `outer` ({outer:g}), but is {inner:g}.")


def check_brightness(brightness: Any) -> None:
    """Raise ValueError unless the factor of light is valid."""
    check_number("brightness", brightness, "be a finite number from 0 on", not_negative)


def check_above_horizon(inner: float, spin: float) -> None:
    """Raise ValueError for an inner rim within the horizon of a hole."""
    horizon = kerr.horizon(spin)
    if not inner > horizon:
        shown, least = differing_digits(inner, horizon)
        raise ValueError(f"Argument `inner` must be larger than the horizon radius {least}, but is {shown}.")
