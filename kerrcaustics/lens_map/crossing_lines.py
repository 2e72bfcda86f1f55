"""Lines across the shadow edge, on which the radius of a crossing of the equatorial plane is known.

On each of them (sky_lines.py) the radius of the n-th crossing grows from that of the horizon, where rays fall in before
they cross, to infinity, where they escape before.
"""

import numpy as np

from kerrcaustics.lens_map.plane_map import Crossings, PlaneMap
from kerrcaustics.lens_map.sky_lines import lines_across
from kerrcaustics.shapes import Bool, Float, Int

Array = np.ndarray

# Places on a line at each side of the shadow edge, evenly spaced in the logarithm of their distance from it.
_PLACES = 60
# Distance of the first place from the shadow edge, radians.
_CLOSEST = 1e-13
# Distance of the last place, in parts of that of the line's end.
_FARTHEST = 0.999999


class CrossingLines:
    """Lines across the shadow edge, on which the radius of one crossing is known at some places.

    distance, level (lines, places): of these places from the shadow edge, and 1 / r there, as `PlaneMap.level` has it.
    """

    def __init__(self, plane_map: PlaneMap, edge_phase: Float[Array, " lines"]) -> None:
        """Look at all lines."""
        self.edge_phase, self._map = edge_phase, plane_map
        self._lines = lines_across(plane_map.camera, edge_phase)
        inward, outward = (
            np.geomspace(_CLOSEST, _FARTHEST * far, _PLACES, axis=1) for far in (-self._lines.first, self._lines.last)
        )
        self.distance = np.concatenate([-inward[:, ::-1], outward], axis=1)
        self.level = plane_map.level(self._lines, self.distance)

    def once(self, radii: Float[Array, " radii"]) -> Bool[Array, " radii"]:
        """True for circles that every line meets once."""
        above = self.level > 1 / radii[:, None, None]
        return ((above[..., 1:] != above[..., :-1]).sum(axis=2) == 1).all(axis=1)

    def meetings(self, radius: float) -> tuple[Int[Array, " points"], Crossings]:
        """The points at which lines meet a circle, and the number of the line of each."""
        above = self.level > 1 / radius
        line, place = np.nonzero(above[:, 1:] != above[:, :-1])
        low, high = self.distance[line, place], self.distance[line, place + 1]
        start, end = self.level[line, place], self.level[line, place + 1]
        part = (start - 1 / radius) / (start - end)
        with np.errstate(invalid="ignore"):
            guess = np.where(low * high > 0, low * np.abs(high / low) ** part, low + part * (high - low))
        # Where a line comes back to the circle the radius falls along it.
        sense = np.where(end > start, -1.0, 1.0)
        return line, self._map.on_circles(self._lines[line], np.full(len(line), radius), guess, (low, high), sense)
