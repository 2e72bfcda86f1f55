"""The limb of a disc where all caustics are points: without spin, or from a place on the spin axis.

There the sky is symmetric about the direction to the hole, and space about the line through hole and viewer. One line
of rays across the sky gives the images of every point, and hence of the limb, however close it lies to a caustic.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.extended_sources.arcs.boundary_arcs import BoundaryArcs
from kerrcaustics.extended_sources.arcs.known_curves import arcs_of_parametric_curve, at_places
from kerrcaustics.extended_sources.sheets.limb import Limb
from kerrcaustics.images.sheet_grids import Sheet
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.sphere import from_angles, polar_angle, polar_basis

Array = np.ndarray

# Rays of a line between two critical curves.
_RAYS = 200
# Newton steps of places along the line.
_STEPS = 2
# Fewest arcs of an image.
_ARCS = 12
# Shortest arc next to a caustic, radians of longitude.
_SHORTEST = 1e-13


def symmetric(sheets: Sheets) -> bool:
    """True if all caustics are points."""
    return all(curve.is_point for curve in sheets.curves)


class AxialLimb:
    """The images of the limb of a disc on a sky where all caustics are points."""

    def __init__(self, sheets: Sheets, circle: Circle) -> None:
        """Trace a line of rays for each index when it is first needed."""
        toward = from_angles(sheets.camera.inclination, 0.0)
        axis = np.stack([*polar_basis(toward), toward])
        self._longitude = _longitudes(circle, axis)
        first = int(sheets.curves.domain.unbounded)
        self._images = [_SheetImages(sheets, sheet, axis, circle) for sheet in sheets.sheets[first:]]

    def arcs(self, tolerance: float) -> BoundaryArcs:
        """Arcs along all images; tolerance: error of the sum of their areas, square radians."""
        low, high = self._longitude[:-1], self._longitude[1:]
        count, parts = len(low), []
        for images in self._images:
            first = 1 + max((int(part.right.max()) for part in parts), default=-1)
            left, index = first + np.arange(count), np.full(count, images.sheet.index)
            arcs = arcs_of_parametric_curve(
                images.trace, index, low, high, left, np.roll(left, -1), first + count, tolerance
            )
            assert arcs is not None
            parts.append(arcs)
        return parts[0].joined(*parts[1:])


def _longitudes(circle: Circle, axis: Float[Array, "3 3"]) -> Float[Array, " longitudes"]:
    """Ends of arcs over one turn, closer to each other where the limb passes the axis."""
    first, steps = float(circle.longitude(axis[2:])[0]), [np.linspace(0, 2 * math.pi, _ARCS + 1)]
    for longitude, caustic in ((first, axis[2:]), (first + math.pi, -axis[2:])):
        nearest = max(abs(float(circle.height(caustic)[0])) / math.sin(circle.angle), _SHORTEST)
        away = nearest * 2.0 ** np.arange(max(0, math.ceil(math.log2(math.pi / _ARCS / nearest))))
        steps += [longitude + away, longitude - away]
    return np.append(np.unique(np.concatenate(steps) % (2 * math.pi)), 2 * math.pi)


@dataclass(frozen=True, eq=False)
class _SheetImages:
    """Images of the points of a circle with one Morse index.

    sheets: The sheets of the viewer's sky.
    sheet: The sheet of this index.
    axis: Rows: e_theta and e_phi at the viewer, and the direction from the hole to the viewer.
    circle: The circle.
    """

    sheets: Sheets
    sheet: Sheet
    axis: Float[Array, "3 3"]
    circle: Circle

    def trace(
        self, low: Float[Array, " arcs"], high: Float[Array, " arcs"]
    ) -> tuple[Float[Array, "arcs places 3"], Float[Array, " arcs"]]:
        """Directions at places of arcs between longitudes, and their errors across the limb."""
        longitude = at_places(low, high)
        swept, azimuth = self._swept(self.circle.place(longitude.ravel()))
        part_of, swept_of, turned_of, _ = self._line
        part, turn = part_of(swept), azimuth - turned_of(swept)
        for _ in range(_STEPS):
            beams = self._beams(self._sky(part, turn))
            part = part + (swept - self._swept(beams.direction)[0]) / swept_of(part, 1)
        sky = self._sky(part, turn)
        beams = self._beams(sky)
        offset = Limb(self.sheets.camera, self.sheets.surface, self.circle).offset(sky, beams)
        noise = np.abs(offset.length) + offset.error
        return sky.reshape(*longitude.shape, 3), noise.reshape(longitude.shape).max(axis=1)

    def _sky(self, part: Float[Array, " n"], turn: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """Directions by the part of the sheet and the position angle."""
        away = self._line[-1](part)
        across = np.sin(away)
        return self.sheets.sky(np.stack([-np.cos(away), across * np.cos(turn), across * np.sin(turn)], axis=-1))

    @cached_property
    def _line(self) -> tuple[Spline, Spline, Spline, Spline]:
        """Functions along a line of rays.

        The part of the sheet as a function of the angle swept, and its inverse; the azimuth of ends less the position
        angle, as a function of the angle swept; the angle from the hole as a function of the part.
        """
        part, phase = (1 - np.cos(np.linspace(0, math.pi, _RAYS))) / 2, np.zeros(_RAYS)
        sight = self.sheets.line_of_sight(phase, self.sheet.depth(phase, part))
        swept, azimuth = self._swept(self._beams(self.sheets.sky(sight)).direction)
        away = polar_angle(np.stack([sight[:, 1], sight[:, 2], -sight[:, 0]], axis=-1))
        # Both ends lie on caustics, where the azimuth is undefined.
        turned = np.unwrap(azimuth - np.arctan2(sight[:, 2], sight[:, 1]))[1:-1]
        swept[[0, -1]] = 0.0, math.pi
        return (
            Spline(swept, part),
            Spline(part, swept),
            Spline(swept[1:-1], turned),
            Spline(part, away),
        )

    def _swept(self, place: Float[Array, "n 3"]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """The angles by which rays have turned since the last caustic, and azimuths about the axis."""
        along = place @ self.axis.T
        angle = polar_angle(along)
        return math.pi - angle if self.sheet.index % 2 else angle, np.arctan2(along[:, 1], along[:, 0])

    def _beams(self, sky: Float[Array, "n 3"]) -> Beams:
        surface = self.sheets.surface.bare()
        return beams_of_directions(
            self.sheets.camera, sky, "auto", TOLERANCE, end=surface, crossings=False, redshift=False
        )
