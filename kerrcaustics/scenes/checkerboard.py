"""A celestial sphere of paint swatches: colours by latitude or longitude, alternating in brightness, with gaps."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from kerrcaustics.scenes.colour import from_srgb, shifted_light
from kerrcaustics.scenes.footprint import DEVIATION, Footprint, averaged
from kerrcaustics.scenes.scene_checks import check_number
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.checks import one_of, quoted, whole_number

Array = np.ndarray

# From the north pole to the south pole; distinct for colour-blind readers (after Okabe and Ito).
COLOURS = ("#B04000", "#E8821E", "#F5D547", "#A8DDB5", "#56B4E9", "#0072B2", "#3B2F80")
# Once round: the last one is next to the first.
HUES = ("#D04A3A", "#E8A13A", "#B9C94A", "#3FA96B", "#3F9FC4", "#4A62C4", "#8A55B8", "#C8559A")
GAP_COLOUR = "#F4F4F0"
Along = Literal["latitude", "longitude"]
# Every second swatch is so much darker.
DARKER = 0.5
# Rows or columns.
_MOST = 720
# A box of this half width, in units of a size, has the deviation that `averaged` asks for.
_HALF_WIDTH = DEVIATION * math.sqrt(3)
# The smallest size; and how far probes and their boxes reach at most, in major axes: along a meridian, and where that
# is a small part of the radius of the circle of latitude, along that too.
_FINEST, _REACH, _STRAIGHT = 1e-6, 2.1, 0.05


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
class Checkerboard:
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
    phi', whose integrals are piecewise linear. Near the poles the box goes all round, so nothing pinches there.

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
    def _swatches(self) -> Float[Array, "2 3 rows"]:
        """Colours (2, 3, rows), above the background, of the swatch that begins at phi' = 0 and of the one after it."""
        return self._alternating(mixed(self.colours, self.rows))

    @cached_property
    def _before(self) -> Float[Array, "2 3 rows"]:
        """Integrals (2, 3, rows) of the swatches over theta', in rows, from the pole to the start of each row."""
        return (np.cumsum(self._swatches, axis=-1) - self._swatches) * (1 - self.gap)

    @cached_property
    def _columns(self) -> Float[Array, "2 3 columns"]:
        """Colours (2, 3, columns), above the background, of the swatches of even and of odd rows, once round."""
        return self._alternating(mixed((*self.colours, self.colours[0]), self.columns))

    def _alternating(self, bright: Float[Array, "n 3"]) -> Float[Array, "2 3 n"]:
        """Colours (2, 3, n), above the background, of swatches that begin with a bright one, and with a dark one."""
        even, dark = (np.arange(len(bright)) % 2 == 0)[:, None], DARKER * bright
        patterns = np.where(even, bright, dark), np.where(even, dark, bright)
        return (np.stack(patterns) - self._background).swapaxes(1, 2)

    @cached_property
    def _rounds(self) -> Float[Array, "2 3 columns+1"]:
        """Integrals (2, 3, columns + 1) of those over phi', in columns, from 0 to the start of each, and once round."""
        return np.cumsum(np.pad(self._columns, ((0, 0), (0, 0), (1, 0))), axis=-1) * (1 - self.gap)

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3) of pixels."""
        plain, light = self._plain(footprint)
        mixed = np.flatnonzero(~plain)
        light[mixed] = averaged(self._average, footprint.part(mixed), finest=_FINEST)
        return light * shifted_light(footprint.redshift, beaming, colour_shift)

    def _plain(self, footprint: Footprint) -> tuple[Bool[Array, " pixels"], Float[Array, "pixels 3"]]:
        """True for pixels that see nothing but one swatch, or gaps; and the colours (n, 3) in the middles of pixels."""
        x, y, z = footprint.direction.T
        across = np.sqrt(x * x + y * y)
        reach = _REACH * np.maximum(footprint.axes[0], _FINEST)
        place = np.arctan2(across, z) * (self.rows / math.pi), np.arctan2(y, x) * (self.columns / (2 * math.pi))
        row, column = (np.floor(part).astype(int) for part in place)
        row = np.minimum(row, self.rows - 1)
        # How far inside the swatch, or the gap beyond it, in rows and columns.
        inside = [
            0.5 - self.gap / 2 - np.abs(at - number - 0.5) for at, number in zip(place, (row, column), strict=True)
        ]
        with np.errstate(divide="ignore"):
            far = reach * (self.rows / math.pi), reach * (self.columns / (2 * math.pi)) / across
        on_swatch, on_gap = ([sign * part > off for part, off in zip(inside, far, strict=True)] for sign in (1, -1))
        swatch, straight = on_swatch[0] & on_swatch[1], reach < _STRAIGHT * across
        if self.along == "latitude":
            colours = self._swatches[column % 2, :, row]
        else:
            colours = self._columns[row % 2, :, column % self.columns]
        light = np.maximum(self._background + swatch[:, None] * colours, 0.0)
        return straight & (swatch | on_gap[0] | on_gap[1]), light

    def _average(self, direction: Float[Array, "m 3"], size: Float[Array, " m"]) -> Float[Array, "m 3"]:
        """Colours (m, 3) over boxes about directions."""
        x, y, z = direction.T
        across = np.sqrt(x * x + y * y)
        theta, phi = np.arctan2(across, z), np.arctan2(y, x)
        half = np.maximum(_HALF_WIDTH * size, 1e-9)
        with np.errstate(divide="ignore"):
            half_phi = np.minimum(half / across, math.pi)
        # What a box reaches beyond a pole is left out: on the other side all meridians meet as well.
        low, high = np.maximum(theta - half, 0), np.minimum(theta + half, math.pi)
        if self.along == "longitude":
            return self._hues(low, high, phi, half_phi)
        down = (self._along_theta(high) - self._along_theta(low)) * (math.pi / self.rows / (high - low))
        turn = self.columns / (4 * math.pi)
        right, left = (phi + half_phi) * turn, (phi - half_phi) * turn
        colours = self._background[:, None]
        for parity in range(2):
            part = self._along_phi(right - parity / 2) - self._along_phi(left - parity / 2)
            colours = colours + down[parity] * (part / (right - left))
        # Round-off may take a black one below 0.
        return np.maximum(colours.T, 0.0)

    def _along_theta(self, theta: Float[Array, " m"]) -> Float[Array, "2 3 m"]:
        """Integral (2, 3, m) of the swatches of both parities from the pole to theta', in rows."""
        place = theta * (self.rows / math.pi)
        row = np.minimum(place.astype(int), self.rows - 1)
        inside = np.clip(place - row - self.gap / 2, 0, 1 - self.gap)
        return self._before.take(row, axis=-1) + self._swatches.take(row, axis=-1) * inside

    def _along_phi(self, turns: Float[Array, " m"]) -> Float[Array, " m"]:
        """Integral (m,) of the swatches of one parity, in periods of two swatches."""
        whole = np.floor(turns)
        return whole * (1 - self.gap) / 2 + np.clip(turns - whole - self.gap / 4, 0, (1 - self.gap) / 2)

    def _hues(
        self, low: Float[Array, " m"], high: Float[Array, " m"], phi: Float[Array, " m"], half_phi: Float[Array, " m"]
    ) -> Float[Array, "m 3"]:
        """Colours (m, 3) over boxes from `low` to `high` in theta', about phi, where they change along phi'."""
        turn = self.columns / (2 * math.pi)
        right, left = (phi + half_phi) * turn, (phi - half_phi) * turn
        round_about = (self._along_columns(right) - self._along_columns(left)) / (right - left)
        scale = math.pi / self.rows / (high - low)
        down = [(self._in_rows(high, parity) - self._in_rows(low, parity)) * scale for parity in range(2)]
        colours = self._background[:, None] + down[0] * round_about[0] + down[1] * round_about[1]
        return np.maximum(colours.T, 0.0)

    def _in_rows(self, theta: Float[Array, " m"], parity: int) -> Float[Array, " m"]:
        """Integral (m,) of the even or the odd rows from the pole to theta', in rows."""
        place = theta * (self.rows / math.pi) - parity
        whole = np.floor(place / 2)
        return whole * (1 - self.gap) + np.clip(place - 2 * whole - self.gap / 2, 0, 1 - self.gap)

    def _along_columns(self, place: Float[Array, " m"]) -> Float[Array, "2 3 m"]:
        """Integral (2, 3, m) of the swatches of both parities of rows, in columns, from phi' = 0 on."""
        turns = np.floor(place / self.columns)
        within = place - turns * self.columns
        column = np.minimum(within.astype(int), self.columns - 1)
        inside = np.clip(within - column - self.gap / 2, 0, 1 - self.gap)
        whole = self._rounds[..., -1:] * turns
        return whole + self._rounds.take(column, axis=-1) + self._columns.take(column, axis=-1) * inside
