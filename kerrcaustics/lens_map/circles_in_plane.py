"""The n-th crossing of the equatorial plane, circle by circle: the map from (edge phase, radius) to the azimuth.

On a line of sky_lines.py the radius of the n-th crossing grows from the horizon's, at the rim of the rays that fall
in before they cross, to infinity, at the rim of those that escape before. So each circle round the hole is seen once on
every line, as a closed curve on the camera sky between the rims; and where the azimuth, followed along that curve,
turns back, two images of a source on the circle meet: a point of a caustic.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicSpline

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.lens_map.crossing_lines import CrossingLines
from kerrcaustics.lens_map.sky_lines import line_reach, periodic
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import tangent_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_LINES, _MANY_LINES = 256, 1024
# Newton steps to a circle along a line; a step is no longer than this part of the way to the next known place.
_MOST_STEPS = 12
# Relative error of the radius at which a place on a line is taken as found, in errors of the beam.
_ERRORS = 4.0
# Step along a line that gives its direction, in parts of its reach.
_STEP = 1e-6


@dataclass(frozen=True)
class Crossings(Rows):
    """Rays that cross the plane, one entry each.

    edge_phase, distance: place on the sky, radians; sky: direction N; radius, azimuth (unwrapped along the ray) of the
    crossing; index: Morse index; ratio: delta_minus / delta_plus, and its error; minor: |delta_minus|; error: relative
    to the radius, or radians.
    """

    edge_phase: Float[Array, " points"]
    distance: Float[Array, " points"]
    sky: Float[Array, "points 3"]
    radius: Float[Array, " points"]
    azimuth: Float[Array, " points"]
    index: Int[Array, " points"]
    ratio: Float[Array, " points"]
    ratio_error: Float[Array, " points"]
    minor: Float[Array, " points"]
    error: Float[Array, " points"]


class Circles:
    """Circles in the plane as one camera, at rest, sees them at the n-th crossing."""

    def __init__(self, camera: Viewer, crossing: int, lines: int, engine: str, tolerance: float) -> None:
        """Look at all lines."""
        self.camera, self.end = camera, EquatorialPlane(crossing)
        self._engine, self._tolerance = engine, tolerance
        self.beams_traced, self.engines_used = 0, set[str]()
        # From below the plane circles are seen to run the other way round.
        self.side = 1 if camera.cos_theta > 0 else -1
        edge_phase = 2 * math.pi * (np.arange(lines) + 0.5) / lines
        self._lines = CrossingLines(camera, edge_phase, self.end, engine)

    def whole(self, radii: Float[Array, " radii"]) -> Bool[Array, " radii"]:
        """True for circles that every line meets once."""
        above = self._lines.level > 1 / radii[:, None, None]
        return ((above[..., 1:] != above[..., :-1]).sum(axis=2) == 1).all(axis=1)

    def around(self, radii: Float[Array, " radii"]) -> list[CubicSpline | None]:
        """Distances from the shadow edge at which lines meet circles, by edge phase; None unless each does once."""
        edge_phase, whole = self._lines.edge_phase, self.whole(radii)
        place = (self._lines.level > 1 / radii[whole, None, None]).argmin(axis=2)
        line = np.broadcast_to(np.arange(len(edge_phase)), place.shape)
        low, high = self._lines.distance[line, place - 1], self._lines.distance[line, place]
        every = np.repeat(radii[whole], len(edge_phase))
        distance = self._lines.places(every, edge_phase[line].ravel(), low.ravel(), high.ravel())[1].reshape(
            place.shape
        )
        known = iter(distance)
        return [periodic(edge_phase, next(known)) if one else None for one in whole.tolist()]

    def beams(
        self, edge_phase: Float[Array, " points"], distance: Float[Array, " points"], least: float = 0.0
    ) -> tuple[Array, Beams]:
        """Directions N and their beams; least, the tolerance where a larger one than usual will do."""
        sky, tolerance = self._lines.sky(edge_phase, distance), max(least, self._tolerance)
        beams = trace_beams(self.camera, sky, self._engine, tolerance, end=self.end, crossings=False, redshift=False)
        self.beams_traced += len(sky)
        self.engines_used.update(beams.engines)
        return sky, beams

    def on_circle(
        self, edge_phase: Float[Array, " points"], radius: Float[Array, " points"], distance: Float[Array, " points"]
    ) -> Crossings:
        """Crossings of lines with circles, from guesses of the distance; NaN where none is found."""
        reach, distance = line_reach(self.camera, edge_phase), distance.copy()
        active = np.arange(len(edge_phase))
        for _ in range(_MOST_STEPS):
            sky, beams = self.beams(edge_phase[active], distance[active])
            miss = np.log(beams.radius / radius[active])
            step = miss / self._slope(edge_phase[active], distance[active], reach[active], sky, beams)
            far = np.abs(miss) > _ERRORS * beams.error
            # Toward the rims the radius runs away: steps are held back.
            most = 0.3 * np.abs(distance[active]) + 1e-3
            distance[active] -= np.where(far, np.clip(step, -most, most), 0)
            active = active[far]
            if active.size == 0:
                break
        return self.points(edge_phase, distance)

    def searched(
        self, edge_phase: Float[Array, " points"], radius: float, distance: Float[Array, " points"]
    ) -> Crossings:
        """Crossings of lines with a circle, each searched from end to end; if it meets it more often, from guesses."""
        lines = CrossingLines(self.camera, edge_phase, self.end, self._engine)
        above = lines.level > 1 / radius
        once = (above[:, 1:] != above[:, :-1]).sum(axis=1) == 1
        row, place = np.flatnonzero(once), above[once].argmin(axis=1)
        distance = distance.copy()
        low, high = lines.distance[row, place - 1], lines.distance[row, place]
        distance[once] = lines.places(radius, edge_phase[once], low, high)[1]
        return self.on_circle(edge_phase, np.full(len(edge_phase), radius), distance)

    def _slope(
        self, edge_phase: Array, distance: Array, reach: Array, sky: Array, beams: Beams
    ) -> Float[Array, " points"]:
        """d ln r / d distance."""
        ahead = self._lines.sky(edge_phase, distance + _STEP * reach)
        along = (ahead - sky) / (_STEP * reach)[:, None]
        e_1, e_2 = tangent_basis(sky)
        j = beams.jacobian[:, 0]
        rate = j[:, 0] * np.einsum("ij,ij->i", e_1, along) + j[:, 1] * np.einsum("ij,ij->i", e_2, along)
        return rate / np.asarray(beams.radius)

    def points(self, edge_phase: Float[Array, " points"], distance: Float[Array, " points"]) -> Crossings:
        """The rays at places on lines."""
        sky, beams = self.beams(edge_phase, distance)
        return Crossings(
            edge_phase=edge_phase,
            distance=distance,
            sky=sky,
            radius=np.asarray(beams.radius),
            azimuth=beams.azimuth,
            index=np.asarray(beams.index),
            ratio=beams.delta_minus / beams.delta_plus,
            ratio_error=beams.jacobian_error,
            minor=np.abs(beams.delta_minus),
            error=beams.error,
        )


@lru_cache(maxsize=8)
def circles_of(camera: Viewer, crossing: int, many: bool, engine: str, tolerance: float) -> Circles:
    """The circles of a search camera, kept for the next source. many: on many lines."""
    return Circles(camera, crossing, _MANY_LINES if many else _LINES, engine, tolerance)
