"""The value of one M in seconds, in metres, and on the sky of an observer, for a hole of known mass and distance.

Everything else in the package has units G = c = M = 1.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal

from numpy.typing import ArrayLike

from kerrcaustics.extras import needed
from kerrcaustics.spacetime.checks import numbers, one_of, quoted, real_number

# SI and CODATA: exact by definition.
SPEED_OF_LIGHT = 299792458.0
# m^3/s^2, the nominal solar mass parameter of IAU 2015 Resolution B3: exact as a unit. The Sun's own, 1.32712440041e20
# (IAU 2009 system of constants), differs by 3e-10.
SOLAR_MASS_PARAMETER = 1.3271244e20
# Metres, IAU 2012 Resolution B2; and the parsec of IAU 2015 Resolution B2, note 4: both exact.
ASTRONOMICAL_UNIT = 149597870700.0
PARSEC = 648000 / math.pi * ASTRONOMICAL_UNIT

# The largest mass and distance, and the inverse of the smallest: one M is then a number in all units.
_LARGEST = 1e100
_MICROARCSECOND = math.pi / 648000e6
# Units of times, each for one M of a tenth of it or more, in seconds.
_TIMES = ("d", 86400.0), ("min", 60.0), ("s", 1.0), ("ms", 1e-3)
_UNITS = {"time": ("seconds", "s"), "length": ("metres", "m"), "angle": ("microarcseconds", "uarcsec")}


@dataclass(frozen=True)
class PhysicalScale:
    """The value of one M for a hole of known mass and distance.

    Parameters
    ----------
    mass : float
        Mass of the hole, in solar masses; or a Quantity of astropy.
    distance : float, optional
        Distance from the observer, in parsec; or a Quantity of astropy. Only angles need it. For a hole at a
        cosmological redshift z the angular diameter distance; received times are 1 + z times longer.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    Round-off: the constants are exact by definition (IAU 2012 B2, IAU 2015 B2 and B3, CODATA). The relative
    errors of mass and distance carry over unchanged. A mass in kilograms adds the error of G, 2.2e-5.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> round(kc.PhysicalScale(mass=4.3e6, distance=8180).seconds, 2)
    21.18
    """

    mass: float
    distance: float | None = None

    def __post_init__(self) -> None:
        """Raise ValueError unless mass and distance are valid; leave plain numbers."""
        object.__setattr__(self, "mass", _positive("mass", self.mass, "solMass", "solar masses"))
        if self.distance is not None:
            object.__setattr__(self, "distance", _positive("distance", self.distance, "pc", "parsec"))

    @property
    def seconds(self) -> float:
        """GM/c^3 in seconds: times of the package, times this, are seconds."""
        return self.metres / SPEED_OF_LIGHT

    @property
    def metres(self) -> float:
        """GM/c^2 in metres."""
        return self.mass * SOLAR_MASS_PARAMETER / SPEED_OF_LIGHT**2

    @property
    def astronomical_units(self) -> float:
        """GM/c^2 in astronomical units."""
        return self.metres / ASTRONOMICAL_UNIT

    @property
    def microarcseconds(self) -> float:
        """GM/c^2 across the line of sight, at the hole's distance, in microarcseconds on the observer's sky."""
        if self.distance is None:
            raise ValueError("Argument `distance` must be given for angles, but is None.")
        return self.metres / (self.distance * PARSEC) / _MICROARCSECOND

    @property
    def time_unit(self) -> tuple[str, float]:
        """Unit in which times of some M are neither tiny nor huge, and one M in it: min for Sagittarius A*."""
        name, seconds = next((each for each in _TIMES if self.seconds >= each[1] / 10), _TIMES[-1])
        return name, self.seconds / seconds

    def quantity(self, kind: Literal["time", "length", "angle"], values: ArrayLike = 1.0) -> Any:
        """Values in units of M as an astropy Quantity: times in s, lengths in m, angles in microarcseconds.

        Needs the package astropy.
        """
        one_of("kind", kind, _UNITS)
        name, unit = _UNITS[kind]
        return needed("astro", "astropy.units").Quantity(numbers("values", values) * getattr(self, name), unit)


def checked_scale(scale: object) -> PhysicalScale | None:
    """The argument `scale` of a plot or a table; raise ValueError unless it is a PhysicalScale or None."""
    if scale is None or isinstance(scale, PhysicalScale):
        return scale
    raise ValueError(f"Argument `scale` must be a PhysicalScale, but is {type(scale).__name__}.")


def _positive(name: str, value: Any, unit: str, units: str) -> float:
    """The argument `name` as a number in this unit."""
    try:
        plain = value.to_value(unit) if hasattr(value, "to_value") else value
    except ValueError:
        # An astropy Quantity of another kind.
        plain = math.nan
    number = real_number(name, plain)
    if not (math.isfinite(number) and number > 0):
        text = str(value) if hasattr(value, "to_value") else quoted(value)
        raise ValueError(f"Argument `{name}` must be a positive, finite number of {units}, but is {text}.")
    if not 1 / _LARGEST <= number <= _LARGEST:
        raise ValueError(
            f"Argument `{name}` must lie in [{1 / _LARGEST:g}, {_LARGEST:g}] {units}, but is {quoted(number)}."
        )
    return number
