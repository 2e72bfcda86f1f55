"""Charts of the search sky on which light comes from a disc, however it arrives: the map is smooth in them.

On a sphere the charts are the lines of domains.py. One that rays reach once has one chart. Within the viewer's radius
each arrival has its own: they share the rim, where the sky is folded and the charts are not. In the equatorial plane
there is one: lines between two circles that hold the disc.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.curves.critical_curves import CriticalCurves
from kerrcaustics.lens_map.circles_in_plane import Circles
from kerrcaustics.lens_map.domains import OneLeaf, Ring
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.lens_map.sky_lines import lines_across, periodic
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import angle_between, lengths, unit
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Lines = Callable[[Array, Array], Array]
"""Directions N (n, 3) at edge phases and heights (n,)."""

_TURN = 2 * math.pi
FROM_RIM = 1e-5
"""Depth from the rim at which charts end: the sky between is at most 1e-10 of the rim's distance from the edge wide."""
# Depth beyond the last critical curve at which charts end.
_BEYOND = 0.3
# Edge phases of the first lines on which two circles are located.
_LINES = 256
# Rounds of more lines between them.
_MOST_ROUNDS = 10
# Error of a circle between lines above which a line is added, as a part of the distance between both circles.
_BENT = 0.02
# Distance of the circles about a disc in the plane from its centre, in its radii.
_AROUND = 1.25
# Least such distance, as a part of the distance from the horizon: circles between lines are less accurate than that.
_LEAST_AROUND = 0.02
# Least distance of the nearer circle from the horizon, as a part of the disc's distance from it.
_FROM_HORIZON = 0.5
# Steps that show the sense of a chart, radians of edge phase and parts of its height.
_STEP = 1e-4
# Edge phases at which sense and parity are taken, radians: the median is robust.
_SENSES = np.array([0.3, 1.7, 3.1, 4.4, 5.9])
# Height at which the parity is taken, as a part of the chart's.
_INSIDE = 0.3


@dataclass(frozen=True)
class Disc:
    """A disc on a surface.

    surface: The surface.
    centre: Vector of the surface.
    size: Radius, radians; in the plane a length.
    """

    surface: End
    centre: Float[Array, " axes"]
    size: float

    def height(self, places: Float[Array, "n axes"]) -> Float[Array, " n"]:
        """Distance of places from the limb, negative within the disc."""
        return self.distance(places) - self.size

    def distance(self, places: Float[Array, "n axes"]) -> Float[Array, " n"]:
        """Distance of places from the centre."""
        if len(self.centre) == 2:
            return lengths(places - self.centre)
        return np.asarray(angle_between(places, self.centre))

    @property
    def smaller(self) -> float:
        """The radius of the disc, or of the rest of its sphere where that is smaller."""
        return self.size if len(self.centre) == 2 else min(self.size, math.pi - self.size)

    @property
    def area(self) -> float:
        """The area: a solid angle about the centre of its sphere; in the plane, the area in r dr dphi."""
        return math.pi * self.size**2 if len(self.centre) == 2 else 4 * math.pi * math.sin(self.size / 2) ** 2


@dataclass(frozen=True)
class ChartRays(Rows):
    """Rays of a chart.

    sky: Directions on the search sky.
    place: Vectors of their ends.
    height: Distances from the limb, negative within the disc, radians; in the plane lengths.
    error: Errors of the heights.
    index: Morse index, at most one more than the highest requested.
    ratio: delta_minus / delta_plus of the beam.
    ratio_error: Errors of the ratios.
    """

    sky: Float[Array, "n 3"]
    place: Float[Array, "n axes"]
    height: Float[Array, " n"]
    error: Float[Array, " n"]
    index: Int[Array, " n"]
    ratio: Float[Array, " n"]
    ratio_error: Float[Array, " n"]


@dataclass(frozen=True)
class DiscChart:
    """A chart of directions by edge phase and height, on which light arrives from a disc.

    camera: The viewer at rest.
    disc: The disc.
    surface: The surface, with the arrival that the chart shows.
    max_index: Highest Morse index requested.
    lines: Directions by edge phase, radians, and height.
    low, high: Range of heights.
    rim: -1 if the lower end is the rim, 1 if the upper end is, 0 if neither is.
    open_ended: True if the chart continues beyond both ends.
    gap: Width of the sky between the chart and the rim, as a part of the rim's distance from the hole.
    """

    camera: Viewer
    disc: Disc
    surface: End
    max_index: int
    lines: Lines
    low: float
    high: float
    rim: int = 0
    open_ended: bool = False
    gap: float = FROM_RIM**2

    @property
    def second_arrival(self) -> bool:
        """True for second arrivals at a sphere."""
        return bool(getattr(self.surface, "second_arrival", False))

    @cached_property
    def parity(self) -> float:
        """1 where ratios of beams are positive for even index, -1 where they are negative."""
        rays = self.rays(_SENSES, np.full(len(_SENSES), self.low + _INSIDE * (self.high - self.low)))
        return float(np.sign(np.nanmedian(np.sign(rays.ratio) * (1 - 2 * (rays.index % 2)))))

    @cached_property
    def sense(self) -> float:
        """1 where the chart is right-handed on the sky, else -1."""
        middle = np.full(len(_SENSES), (self.low + self.high) / 2)
        step = _STEP * (self.high - self.low)
        here = self.lines(_SENSES, middle)
        along, up = self.lines(_SENSES + _STEP, middle) - here, self.lines(_SENSES, middle + step) - here
        return float(np.sign(np.median(np.einsum("ni,ni->n", np.cross(along, up), here))))

    def rays(self, phase: Float[Array, " n"], height: Float[Array, " n"]) -> ChartRays:
        """The rays at places of the chart."""
        sky = self.lines(phase, height if self.open_ended else np.clip(height, self.low, self.high))
        end = self.surface
        beams = beams_of_directions(self.camera, sky, "auto", TOLERANCE, end=end, crossings=False, redshift=False)
        place, index = end.ends(beams), np.asarray(beams.index)
        return ChartRays(
            sky=sky,
            place=place,
            height=self.disc.height(place),
            error=beams.error * end.scale(beams),
            index=np.minimum(index, self.max_index + 1),
            ratio=beams.delta_minus / beams.delta_plus,
            ratio_error=beams.diameter_error,
        )


def charts_on_sphere(domain: OneLeaf, curves: CriticalCurves, disc: Disc, max_index: int) -> list[DiscChart]:
    """The charts of all arrivals, as far as the last of the curves."""
    camera, surface = domain.camera, domain.surface
    frame = camera.frame()
    phases = _TURN * np.arange(_LINES) / _LINES
    last = float(curves.curves[-1].points.depth.max()) + _BEYOND

    def sky(phase: Array, depth: Array) -> Array:
        return sky_from_line_of_sight(frame, domain.line_of_sight(phase, depth)[0])

    def falling(phase: Array, height: Array) -> Array:
        return sky(phase, height * domain.rim(phase))

    def rising(phase: Array, height: Array) -> Array:
        return sky(phase, height + domain.rim(phase))

    def single_arrival(phase: Array, height: Array) -> Array:
        return sky(phase, height + domain.first(phase))

    if not domain.has_rim:
        rim, deepest = -1 if domain.level else 0, last - float(domain.first(phases).min())
        return [DiscChart(camera, disc, surface, max_index, single_arrival, 0.0, deepest, rim, gap=domain.gap)]
    beyond = max(last - float(domain.rim(phases).min()), _BEYOND)
    second = surface.at_second_arrival()
    return [
        DiscChart(camera, disc, surface, max_index, falling, 0.0, 1 - FROM_RIM, 1),
        DiscChart(camera, disc, second, max_index, rising, FROM_RIM, beyond, -1),
    ]


def charts_in_plane(domain: Ring, disc: Disc, max_index: int) -> list[DiscChart]:
    """The chart of the lines between two circles about the hole that hold the disc; ValueError unless both are seen."""
    radius, horizon = float(lengths(disc.centre)), kerr.horizon(domain.camera.spin)
    nearest, around = radius - disc.size, max(_AROUND * disc.size, _LEAST_AROUND * (radius - horizon))
    radii = np.array([max(radius - around, horizon + _FROM_HORIZON * (nearest - horizon)), radius + around])
    for many in (False, True):
        circles = domain.circles(many=many)
        splines = circles.distances(radii)
        if all(spline is not None for spline in splines):
            break
    if any(spline is None for spline in splines):
        raise ValueError(
            "Arguments `source` and `size` must describe a disc between circles in the plane that are seen once on "
            f"every line across the shadow edge, but r = {radii[0]:.6g} or {radii[1]:.6g} is not."
        )
    camera = circles.camera
    rims = _circle_distances(circles, radii, [spline for spline in splines if spline is not None])

    def sky(phase: Array, height: Array) -> Array:
        low, high = rims(phase).T
        return unit(lines_across(camera, phase).sky(low + height * (high - low)))

    return [DiscChart(camera, disc, domain.surface.bare(), max_index, sky, 0.0, 1.0, open_ended=True)]


def _circle_distances(circles: Circles, radii: Float[Array, " 2"], guesses: list[Spline]) -> Spline:
    """Distances of two circles from the shadow edge by edge phase, located on more lines where they bend."""

    def looked_at(phases: Array) -> Array:
        columns = [
            circles.on_circle(phases, np.full(len(phases), r), guess(phases)).distance
            for r, guess in zip(radii.tolist(), guesses, strict=True)
        ]
        return np.stack(columns, axis=-1)

    phases = _TURN * (np.arange(_LINES) + 0.5) / _LINES
    ends = looked_at(phases)
    new = np.full(len(phases), True)
    for _ in range(_MOST_ROUNDS):
        spline = periodic(phases, ends)
        near = np.flatnonzero(new)
        middle = (phases[near] + np.append(phases[1:], phases[0] + _TURN)[near]) / 2
        new_ends = looked_at(middle)
        off = np.abs(spline(middle) - new_ends).max(axis=1) > _BENT * np.abs(new_ends[:, 1] - new_ends[:, 0])
        if not off.any():
            break
        phases, ends = np.append(phases, middle % _TURN), np.concatenate([ends, new_ends])
        order = np.argsort(phases)
        # Check both sides of a line at which a circle was off, and of the lines beside it.
        new = np.append(np.zeros(len(new), bool), off)
        new[near[off]] = True
        phases, ends, new = phases[order], ends[order], new[order]
        new |= np.roll(new, 1) | np.roll(new, -1)
    return periodic(phases, ends)
