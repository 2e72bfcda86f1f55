"""The n-th crossing of the equatorial plane, circle by circle: the map from (edge phase, radius) to the azimuth.

On a line of sky_lines.py the radius of the n-th crossing grows from the horizon's, at the rim of the rays that fall
in before they cross, to infinity, at the rim of those that escape before. So each circle round the hole is seen once on
every line, as a closed curve on the camera sky between the rims; and where the azimuth, followed along that curve,
turns back, two images of a source on the circle meet: a point of a caustic.
"""

from functools import lru_cache

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.lens_map.crossing_lines import CrossingLines
from kerrcaustics.lens_map.plane_map import Crossings, PlaneMap
from kerrcaustics.lens_map.sky_lines import lines_across, periodic
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.shadow import even_phases
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_LINES, _MANY_LINES = 256, 1024


class Circles(PlaneMap):
    """Circles in the plane as one camera, at rest, sees them at the n-th crossing."""

    def __init__(self, camera: Viewer, crossing: int, lines: int, engine: str, tolerance: float) -> None:
        """Look at all lines."""
        super().__init__(camera, EquatorialPlane(crossing), engine, tolerance)
        # From below the plane circles are seen to run the other way round.
        self.side = 1 if camera.cos_theta > 0 else -1
        self._lines = CrossingLines(self, even_phases(camera, (np.arange(lines) + 0.5) / lines))

    def whole(self, radii: Float[Array, " radii"]) -> Bool[Array, " radii"]:
        """True for circles that every line meets once."""
        return self._lines.once(radii)

    def distances(self, radii: Float[Array, " radii"]) -> list[Spline | None]:
        """Distances from the shadow edge at which lines meet circles, by edge phase; None unless each does once."""
        whole = self.whole(radii)
        return [self._distance(radius) if one else None for radius, one in zip(radii.tolist(), whole, strict=True)]

    def _distance(self, radius: float) -> Spline:
        _, points = self._lines.meetings(radius)
        return periodic(points.edge_phase, points.distance)

    def beams_at(
        self, edge_phase: Float[Array, " points"], distance: Float[Array, " points"], least: float = 0.0
    ) -> Beams:
        """Beams at places on lines; least, the tolerance where a larger one than usual will do."""
        return self.beams(lines_across(self.camera, edge_phase).sky(distance), least)

    def on_circle(
        self, edge_phase: Float[Array, " points"], radius: Float[Array, " points"], distance: Float[Array, " points"]
    ) -> Crossings:
        """Crossings of lines with circles, from guesses of the distance."""
        return self.on_circles(lines_across(self.camera, edge_phase), radius, distance)

    def crossings_at(self, edge_phase: Float[Array, " points"], distance: Float[Array, " points"]) -> Crossings:
        """The rays at places on lines."""
        return self.points(lines_across(self.camera, edge_phase), distance)


@lru_cache(maxsize=8)
def circles_of(camera: Viewer, crossing: int, many: bool, engine: str, tolerance: float) -> Circles:
    """The circles of a search camera, kept for the next source. many: on many lines."""
    return Circles(camera, crossing, _MANY_LINES if many else _LINES, engine, tolerance)
