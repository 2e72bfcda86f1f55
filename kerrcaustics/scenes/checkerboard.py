"""A celestial sphere of paint swatches: colours by latitude or longitude, alternating in brightness, with gaps."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from kerrcaustics.scenes.colour import from_srgb, shifted_light
from kerrcaustics.scenes.footprint import Footprint, averaged
from kerrcaustics.scenes.scene_checks import check_number
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import one_of, quoted, whole_number

Array = np.ndarray

# From the north pole to the south pole; distinct for colour-blind readers (after Okabe and Ito).
COLOURS = ("#B04000", "#E8821E", "#F5D547", "#A8DDB5", "#56B4E9", "#0072B2", "#3B2F80")
# Once round: the last colour is next to the first.
HUES = ("#D04A3A", "#E8A13A", "#B9C94A", "#3FA96B", "#3F9FC4", "#4A62C4", "#8A55B8", "#C8559A")
GAP_COLOUR = "#F4F4F0"
Along = Literal["latitude", "longitude"]
# Factor of every second swatch.
DARKER = 0.5
# Largest number of rows or columns.
_MOST = 720
# The smallest size (radians) over which it is averaged.
_FINEST = 1e-6


def check_pattern(pattern: Any, least_rows: int) -> None:
    """Raise ValueError unless rows, columns, gaps and colours make a pattern of swatches."""
    whole_number("rows", pattern.rows, least_rows, _MOST)
    if whole_number("columns", pattern.columns, 2, _MOST) % 2:
        raise ValueError(
            f"Argument `columns` must be an even whole number from 2 to {_MOST}, but is {pattern.columns}."
        )
    check_number("gap", pattern.gap, "lie in [0, 1)", lambda gap: 0 <= gap < 1)
    if not isinstance(pattern.colours, list | tuple) or not pattern.colours:
        raise ValueError(f"Argument `colours` must be a list of one colour or more, but is {quoted(pattern.colours)}.")
    for colour in pattern.colours:
        from_srgb(colour, "colours")
    from_srgb(pattern.gap_colour, "gap_colour")


def mixed(colours: tuple[str, ...], rows: int) -> Float[Array, "rows 3"]:
    """Linear light (rows, 3) of rows of swatches: from the first colour to the last one, mixed in between."""
    stops = np.stack([from_srgb(colour) for colour in colours])
    place = (np.arange(rows) + 0.5) / rows * (len(stops) - 1)
    return np.stack([np.interp(place, np.arange(len(stops)), channel) for channel in stops.T], axis=-1)


@dataclass(frozen=True, eq=False)
class Checkerboard(Sky):
    """A sky of swatches between circles of latitude and meridians, as in JTFT fig 10.

    Parameters
    ----------
    rows, columns : int
        Numbers of swatches from pole to pole, and once round; columns must be even.
    gap : float
        Part of a swatch's period, below 1, that the gap takes up, in either direction.
    colours : tuple of str
        "#rrggbb", north to south; rows between two of them are mixed in linear light.
    gap_colour : str
    along : str
        "latitude": `colours` go from pole to pole; "longitude": once round, from phi' = 0 on, as the hues of JTFT.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    Averages are exact for a box in theta' and phi': the pattern is a sum of products of a function of theta' and one of
    phi', whose integrals are piecewise linear. Near the poles the box covers all azimuths.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.skies.Checkerboard(rows=9, columns=18).gap
    0.16
    """

    rows: int = 15
    columns: int = 30
    gap: float = 0.16
    colours: tuple[str, ...] = COLOURS
    gap_colour: str = GAP_COLOUR
    along: str = "latitude"

    def __post_init__(self) -> None:
        """Raise ValueError unless the checkerboard is valid."""
        check_pattern(self, least_rows=2)
        one_of("along", self.along, get_args(Along))

    @cached_property
    def _background(self) -> Float[Array, "3"]:
        return from_srgb(self.gap_colour)

    @cached_property
    def _table(self) -> Float[Array, "swatches+1 12"]:
        """The table of swatches from pole to pole, or once round, as `Swatches` in sky_formulas.py describes it."""
        around = self.along == "longitude"
        bright = mixed((*self.colours, self.colours[0]), self.columns) if around else mixed(self.colours, self.rows)
        even, dark = (np.arange(len(bright)) % 2 == 0)[:, None], DARKER * bright
        patterns = np.where(even, bright, dark), np.where(even, dark, bright)
        swatches = np.hstack([pattern - self._background for pattern in patterns])
        before = np.cumsum(np.pad(swatches, ((1, 0), (0, 0))), axis=0) * (1 - self.gap)
        return np.hstack([before, np.pad(swatches, ((0, 1), (0, 0)))])

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels."""
        numbers = self.rows, self.columns, self.gap, self.along == "longitude", *self._background
        light = averaged("swatches", numbers, [self._table], footprint, _FINEST)
        return light * shifted_light(footprint.redshift, beaming, colour_shift) if beaming or colour_shift else light
