"""Brightness profiles of round sources: intensity by the distance from the centre, in parts of the radius."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from kerrcaustics.choices import suggestion
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import numbers, quoted

Array = np.ndarray

Profile = str | tuple[str | float, ...] | Callable[[Array], Array]
"""A name, a name with coefficients, or a function of the distance from the centre."""

# Fewest panels, in each of which a profile is a polynomial.
_FEWEST = 16
# Most panels.
_MOST = 1000
# Most halvings of a panel: a step of the profile is then located to 1e-13.
_HALVINGS = 40
# Residual of a polynomial that is round-off, relative to the largest intensity.
_ROUNDING = 1e-13
# Nodes of the polynomials, in a panel from -1 to 1.
_NODES = legendre.leggauss(12)[0]
# Places between them at which the polynomials are checked.
_BETWEEN = np.cos(math.pi * np.arange(len(_NODES) + 2) / (len(_NODES) + 1))
_SERIES = np.linalg.inv(legendre.legvander(_NODES, len(_NODES) - 1))
# Nodes and weights of integrals over a panel.
_GAUSS, _WEIGHTS = legendre.leggauss(32)
# Narrowest Gaussian, in radii of the source.
_NARROWEST = 0.2
# Widest Gaussian, in radii of the source.
_WIDEST = 1e3


@dataclass(frozen=True)
class Brightness:
    """A profile as a function of the angle x, whose sine is the distance from the centre in parts of the radius.

    In x limb darkening is smooth at the limb, too. Panels are short next to steps of the profile.
    """

    words: str
    """The profile as users see it."""
    ends: Float[Array, " ends"]
    """Ends of the panels, from 0 to pi / 2."""
    series: Float[Array, "panels terms"]
    """Coefficients of Legendre's polynomials in each panel."""
    residual: Float[Array, " panels"]
    """Largest difference from the profile in each panel."""
    at_limb: float
    """Intensity at the limb."""

    @property
    def is_uniform(self) -> bool:
        """True where the intensity is the same everywhere."""
        return self.words == "uniform"

    def intensity(self, x: Float[Array, " places"]) -> Float[Array, " places"]:
        """Intensity at angles x."""
        panel = np.clip(np.searchsorted(self.ends, x, side="right") - 1, 0, len(self.series) - 1)
        low, high = self.ends[panel], self.ends[panel + 1]
        values = legendre.legvander((2 * x - low - high) / (high - low), self.series.shape[1] - 1)
        return np.einsum("pn,pn->p", values, self.series[panel])

    def integral(self, weight: Callable[[Array], Array]) -> float:
        """The integral of the intensity, times a weight, with dx."""
        half = np.diff(self.ends)[:, None] / 2
        x = (self.ends[:-1, None] + half + half * _GAUSS).ravel()
        return float((self.intensity(x) * weight(x)) @ (half * _WEIGHTS).ravel())


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
        return _of_function("uniform", np.ones_like)
    if callable(profile):
        return _of_function("a function", lambda x: profile(np.sin(x)))
    name, *rest = profile if isinstance(profile, tuple | list) and profile else (profile,)
    if not isinstance(name, str) or name not in _NAMED:
        end = suggestion(name, ["uniform", *_NAMED]) if isinstance(name, str) else ""
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
        has = ", ".join(f"{value:.12g}" for value in values.ravel()) or "none"
        raise ValueError(f'Argument `profile` must have {what} after "{name}", but has {has}.')
    return _of_function(" ".join([name, *(f"{value:.12g}" for value in values)]), make(*values.tolist()))


def _of_function(words: str, intensity: Callable[[Array], Array]) -> Brightness:
    """The brightness of a function of x: panels are halved until polynomials describe it to round-off."""
    ends = np.linspace(0, math.pi / 2, _FEWEST + 1)
    low, high, parts = ends[:-1], ends[1:], []
    largest, count = 0.0, 0
    for halving in range(_HALVINGS + 1):
        middle, half = (low + high)[:, None] / 2, (high - low)[:, None] / 2
        series = _values(intensity, middle + half * _NODES) @ _SERIES.T
        between = _values(intensity, middle + half * _BETWEEN)
        largest = max(largest, between.max(initial=0))
        residual = np.abs(between - series @ legendre.legvander(_BETWEEN, len(_NODES) - 1).T).max(axis=1)
        good = residual <= _ROUNDING * largest
        if halving == _HALVINGS or count + len(low) + (~good).sum() > _MOST:
            good[:] = True
        parts.append((low[good], high[good], series[good], residual[good]))
        count += int(good.sum())
        low, middle, high = low[~good], middle[~good, 0], high[~good]
        if not len(low):
            break
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    if not largest > 0:
        raise _no_profile()
    low, high, series, residual = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.argsort(low)
    at_limb = float(_values(intensity, np.array([math.pi / 2]))[0])
    return Brightness(words, np.append(low[order], math.pi / 2), series[order], residual[order], at_limb)


def _values(intensity: Callable[[Array], Array], x: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    """Intensities at angles x; ValueError unless they are finite and not negative."""
    values = np.asarray(intensity(x.ravel()), float) * np.ones(x.size)
    if not (np.isfinite(values).all() and (values >= 0).all()):
        raise _no_profile()
    return values.reshape(x.shape)


def _no_profile() -> ValueError:
    return ValueError(
        "Argument `profile` must give finite intensities from the centre (0) to the limb (1), none negative, and "
        "one that is not 0."
    )
