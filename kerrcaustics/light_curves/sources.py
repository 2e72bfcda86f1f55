"""Sources of light curves that are more than a point: their properties, without their orbits."""

import math
from dataclasses import KW_ONLY, dataclass
from typing import get_args

from kerrcaustics.choices import SpotMotion
from kerrcaustics.spacetime.checks import one_of, quoted, real_number, whole_number

_FEWEST_POINTS, _MOST_POINTS = 16, 100_000
_MOST_CROSSINGS = 12


@dataclass(frozen=True)
class Ball:
    """A small ball that shines evenly, and equally in all directions in its own frame.

    Parameters
    ----------
    size : float
        Its radius in its own frame, in units of the mass; below a tenth of its distance from the hole.

    Raises
    ------
    ValueError
        If the size is not a positive, finite length.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=30, inclination=1.2)
    >>> kc.light_curve(camera, 8.0, 20, source=kc.Ball(0.1), max_index=1).size
    0.1
    """

    size: float = 0.1

    def __post_init__(self) -> None:
        """Raise ValueError unless the size is valid."""
        object.__setattr__(self, "size", _length("size", self.size))


@dataclass(frozen=True)
class Spot:
    """A small spot in a disk, on a circular orbit in the equatorial plane.

    Parameters
    ----------
    size : float
        Standard deviation of its Gaussian profile along its orbit, in units of the mass. Across the orbit it is small.
    motion : str
        "circular" (prograde) or "retrograde".
    crossings : int
        Number of crossings of the plane that contribute to the light, 1 to 12.
    power : float
        The intensity scales as the frequency ratio g to this power: 4 for the light of all frequencies, 3 + alpha in
        one band for a spectrum that falls as the frequency to the power of -alpha.
    points : int
        Initial number of points on each image of the orbit, 16 to 100,000. More follow where the azimuth changes fast
        along it.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=30, inclination=1.2)
    >>> light = kc.light_curve(camera, 8.0, 20, source=kc.Spot(0.2, motion="retrograde", crossings=1))
    >>> light.size, light.certified
    (0.2, True)
    """

    size: float = 0.1
    _: KW_ONLY
    motion: str = "circular"
    crossings: int = 4
    power: float = 4.0
    points: int = 720

    def __post_init__(self) -> None:
        """Raise ValueError unless all are valid."""
        one_of("motion", self.motion, get_args(SpotMotion))
        power = real_number("power", self.power)
        if not math.isfinite(power):
            raise ValueError(f"Argument `power` must be a finite number, but is {quoted(self.power)}.")
        checked = {
            "size": _length("size", self.size),
            "crossings": whole_number("crossings", self.crossings, 1, _MOST_CROSSINGS),
            "power": power,
            "points": whole_number("points", self.points, _FEWEST_POINTS, _MOST_POINTS),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)


def _length(name: str, value: object) -> float:
    """A positive, finite length; ValueError for anything else."""
    length = real_number(name, value)
    if not 0 < length < math.inf:
        raise ValueError(f"Argument `{name}` must be a positive, finite length, but is {quoted(value)}.")
    return length
