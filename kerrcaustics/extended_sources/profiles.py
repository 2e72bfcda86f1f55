"""Brightness profiles of round sources: intensity by the distance from the centre, in parts of the radius."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.polynomial import Chebyshev

from kerrcaustics.choices import near
from kerrcaustics.spacetime.checks import numbers, quoted

Array = np.ndarray

Profile = str | tuple[str | float, ...] | Callable[[Array], Array]
"""A name, a name with coefficients, or a function of the distance from the centre."""

# Degree of the polynomial that stands for a profile, and samples through which it is fitted.
_DEGREE, _SAMPLES = 20, 241
# Widths of Gaussians, in radii of the source.
_NARROWEST, _WIDEST = 0.2, 1e3


@dataclass(frozen=True)
class Brightness:
    """A profile as a function of the angle x, whose sine is the distance from the centre in parts of the radius.

    words: as users see it; intensity: a polynomial in x, in which limb darkening is smooth at the limb, too.
    """

    words: str
    intensity: Chebyshev

    @property
    def is_uniform(self) -> bool:
        """True where the intensity is the same everywhere."""
        return self.words == "uniform"

    @property
    def at_limb(self) -> float:
        """Intensity at the limb."""
        return float(self.intensity(math.pi / 2))

    def slope(self, x: Float[Array, " places"]) -> Float[Array, " places"]:
        """Derivative of the intensity with respect to x."""
        return self.intensity.deriv()(x)


def _linear(one: float) -> Callable[[Array], Array]:
    return lambda x: 1 - one * (1 - np.cos(x))


def _quadratic(one: float, two: float) -> Callable[[Array], Array]:
    return lambda x: 1 - one * (1 - np.cos(x)) - two * (1 - np.cos(x)) ** 2


def _gaussian(width: float) -> Callable[[Array], Array]:
    return lambda x: np.exp(-((np.sin(x) / width) ** 2) / 2)


_NAMED: dict[str, tuple[int, Callable[..., Callable[[Array], Array]]]] = {
    "linear": (1, _linear),
    "quadratic": (2, _quadratic),
    "gaussian": (1, _gaussian),
}


def checked_profile(profile: Profile) -> Brightness:
    """The profile of an argument; raise ValueError if it is invalid."""
    if isinstance(profile, str) and profile == "uniform":
        return Brightness("uniform", Chebyshev([1.0], domain=[0, math.pi / 2]))
    if callable(profile):
        return _of_function("a function", lambda x: profile(np.sin(x)))
    name, *rest = profile if isinstance(profile, tuple | list) and profile else (profile,)
    if name not in _NAMED:
        end = near(name, ["uniform", *_NAMED]) if isinstance(name, str) else ""
        raise ValueError(
            'Argument `profile` must be "uniform", ("linear", u), ("quadratic", u1, u2), ("gaussian", width) or a '
            f"function, but is {quoted(profile)}{end}"
        )
    count, make = _NAMED[name]
    values = numbers("profile", rest)
    if (
        values.shape != (count,)
        or not np.isfinite(values).all()
        or (name == "gaussian" and not _NARROWEST <= values[0] <= _WIDEST)
    ):
        width = f"a width from {_NARROWEST} to {_WIDEST:g} radii of the source"
        what = width if name == "gaussian" else f"{count} finite coefficients"
        raise ValueError(f'Argument `profile` must have {what} after "{name}", but is {quoted(profile)}.')
    return _of_function(" ".join([name, *(f"{value:.12g}" for value in values)]), make(*values.tolist()))


def _of_function(words: str, intensity: Callable[[Array], Array]) -> Brightness:
    """The brightness of a function of x."""
    x = np.linspace(0, math.pi / 2, _SAMPLES)
    values = np.asarray(intensity(x), float) * np.ones_like(x)
    if not (np.isfinite(values).all() and (values >= 0).all() and values.max() > 0):
        raise ValueError(
            "Argument `profile` must give finite intensities from the centre (0) to the limb (1), none negative, and "
            "one that is not 0."
        )
    return Brightness(words, Chebyshev.fit(x, values, _DEGREE, domain=[0, math.pi / 2]))
