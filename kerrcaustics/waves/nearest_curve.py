"""The curve on the camera sky that sums the waves of a ring of images: on each line, the ray nearest to the star.

On that curve the field is one integral of A exp(i omega Phi): its stationary points are the images, with their times
and amplitudes, and it stays finite at folds, cusps and on axial caustics. The representation is Maslov's mixed one:
position along lines, momentum across them.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.curves.critical_curves import CriticalCurves
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.lens_map.search_sky import SearchSky, search_sky
from kerrcaustics.lens_map.sky_lines import periodic
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.sphere import lengths, polar_basis, tangent_basis
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.waves.gaps import FADES, Gap, gap_of
from kerrcaustics.waves.ring_integral import NearestCurve, edge_phases, rate_of, roughness_of
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray

FARTHEST = 1.1
"""Farthest nearest places from the star, radians: the integral is asymptotic in that distance too."""

# Lines of a curve at first.
_LINES = 64
# Most lines of a curve.
_MOST_LINES = 1024
# The last Fourier coefficients over the largest, below which a curve is smooth.
_SMOOTH = 1e-7
# The same ratio below which a curve is still of use.
_ROUGH = 1e-5
# The same ratio above which the nearest place jumps.
_JUMPS = 1e-2
# Lines of a curve with a gap.
_BESIDE_GAPS = 512
# Change of depth from one line to the next that is a jump.
_JUMP = 0.2
# Least rate of the phase where the amplitude fades.
_LEAST_RATE = 0.1
# First step of the secant method along a line, in depth.
_FIRST = 1e-3
# Longest step, in depth.
_LONGEST = 0.3
# Most steps.
_MOST_STEPS = 30
# Step, in depth, below which the method has converged.
_LAST = 1e-8
# Samples on each line for the start of the search for the nearest place.
_SAMPLES = 24
# Depth of the outermost line on which samples lie, where no outer critical curve bounds them.
_OUTERMOST = 0.02
# Tolerance of the rays of samples, radians.
_OF_SAMPLES = 1e-8
# The growth of the error by the square of the farthest nearest place, radians, and by the inverse radius of the viewer,
# as partial waves show it.
_FAR_OFF = 6.5
# Differences along the sky's coordinates.
_DIFFERENCE = 1e-5


def nearest_curve(source: WaveSource, curves: CriticalCurves, order: int) -> NearestCurve:
    """The nearest curve of a source among the images beside the critical curve of an order.

    Where the nearest place jumps, and only there, the curve has a gap.
    """
    count = _LINES
    while True:
        curve = _nearest_places(source, curves, order, count).curve()
        if curve.is_smooth:
            return curve
        if 2 * count > _MOST_LINES or (count > _LINES and curve.roughness > _JUMPS):
            break
        count *= 2
    places = _nearest_places(source, curves, order, _BESIDE_GAPS)
    gap = gap_of(places.edge_phase, places.broken)
    return _first_smooth([places], gap)[0] if gap else curve


def curves_with_gap(sources: Sequence[WaveSource], curves: CriticalCurves, order: int) -> list[NearestCurve]:
    """The nearest curves of several sources, with one gap for all; none if they have none in common."""
    places = [_nearest_places(source, curves, order, _BESIDE_GAPS) for source in sources]
    gap = gap_of(places[0].edge_phase, np.any([at.broken for at in places], axis=0))
    return _first_smooth(places, gap) if gap else []


def _first_smooth(places: Sequence["_NearestPlaces"], gap: Gap) -> list[NearestCurve]:
    """Curves with a gap that fades out as slowly as images allow."""
    curves: list[NearestCurve] = []
    for fade in FADES:
        curves = [at.curve(replace(gap, fade=fade)) for at in places]
        if all(curve.is_smooth for curve in curves):
            break
    return curves


def _nearest_places(source: WaveSource, curves: CriticalCurves, order: int, count: int) -> "_NearestPlaces":
    """The places nearest to the star on `count` lines."""
    sky = search_sky(source.viewer)
    depth, first, last = _first_depths(sky, source, curves, order, count)
    lines = _RingLines(SearchMap(sky.search_camera, source.surface), edge_phases(count))
    depth, here, lost = _nearest(lines, source.star, depth)
    return _NearestPlaces(source, order, lines, depth, here, lost | (depth <= first) | (depth >= last))


def _first_depths(
    sky: SearchSky, source: WaveSource, curves: CriticalCurves, order: int, count: int
) -> tuple[Float[Array, " lines"], Float[Array, " lines"], Float[Array, " lines"]]:
    """Depths on lines next to the place that is nearest to the star, and the range in which they belong to the ring."""
    edge_phase = edge_phases(count)
    here = _depth(curves, order, edge_phase)
    inner = _depth(curves, order + 1, edge_phase) if order < len(curves.curves) else None
    outer = _depth(curves, order - 1, edge_phase) if order > 1 else None
    # Within a right angle of the caustic: farther off the same direction comes again.
    first = np.full(count, _OUTERMOST) if outer is None else (outer + here) / 2
    last = here + (here - first if inner is None else (inner - here) / 2)
    part = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    depth = first[:, None] + part * (last - first)[:, None]
    lines = _RingLines(SearchMap(sky.search_camera, source.surface), np.repeat(edge_phase, _SAMPLES))
    rays = lines.map.rays_of_sky(lines.sky(depth.ravel()), tolerance=_OF_SAMPLES)
    away = np.nan_to_num(lengths(rays.direction - source.star), nan=math.inf).reshape(depth.shape)
    return depth[np.arange(count), away.argmin(axis=1)], first, last


def _depth(curves: CriticalCurves, order: int, edge_phase: Float[Array, " lines"]) -> Float[Array, " lines"]:
    """Depths of a critical curve on lines."""
    points = curves.curves[order - 1].points
    phase, first = np.unique(points.edge_phase % (2 * math.pi), return_index=True)
    return periodic(phase, points.depth[first])(edge_phase)


@dataclass(frozen=True, eq=False)
class _NearestPlaces:
    """The places nearest to a star on lines. astray: lines whose place was not found, or belongs to another ring."""

    source: WaveSource
    order: int
    lines: "_RingLines"
    depth: Float[Array, " lines"]
    here: "_LinePoints"
    astray: Bool[Array, " lines"]

    @property
    def edge_phase(self) -> Float[Array, " lines"]:
        """Lines."""
        return self.lines.edge_phase

    @property
    def away(self) -> Float[Array, " lines"]:
        """Distances from the star, radians."""
        return 2 * np.arcsin(np.clip(lengths(self.here.beams.direction - self.source.star) / 2, 0, 1))

    @property
    def broken(self) -> Bool[Array, " lines"]:
        """Lines on which there is no place of use, and both beside a jump."""
        jump = np.abs(np.roll(self.depth, -1) - self.depth) > _JUMP
        return self.astray | (self.away >= FARTHEST) | jump | np.roll(jump, 1)

    def curve(self, gap: Gap | None = None) -> NearestCurve:
        """The curve through them, with a gap or without."""
        source, here, camera = self.source, self.here, self.lines.camera
        beams, along, n = here.beams, here.along, here.beams.direction
        sky = search_sky(source.viewer)

        def rate(values: Array) -> Array:
            return rate_of(values if gap is None else gap.joined(self.edge_phase, values))

        # Beside a gap series that are cut off ring, and differences are good enough for a sign.
        impact = _impact_vectors(self.lines, self.depth, here, rate_of if gap is None else _difference)
        ahead = np.cross(n, along) / lengths(along)[:, None]
        pushed = np.einsum("nx,nx->n", ahead, rate(impact))
        turned = (self.lines.sky(self.depth, _DIFFERENCE) - self.lines.sky(self.depth, -_DIFFERENCE)) / (
            2 * _DIFFERENCE
        )
        area = lengths(np.cross(turned, here.deeper)) * sky.radian_at_rest(here.sky) ** 2
        with np.errstate(invalid="ignore", divide="ignore"):
            amplitude = source.amplitudes(camera, here.sky, beams, np.abs(pushed) * area / lengths(along))
        time, time_error = sky.viewer_time(here.time, here.time_error)
        phase = time - impact @ source.star
        kept, short = np.ones(len(n), bool), None
        if gap is not None:
            share, faster = gap.share(self.edge_phase), gap.share(self.edge_phase, short=True)
            kept, phase = faster > 0, gap.joined(self.edge_phase, phase)
            amplitude, short = (np.where(kept, part * amplitude, 0.0) for part in (share, faster))
        is_whole = bool(np.isfinite(phase).all() and np.isfinite(amplitude).all())
        one_way = bool((pushed[kept] > 0).all() or (pushed[kept] < 0).all())
        tail = max(roughness_of(phase - phase.mean()), roughness_of(amplitude)) if is_whole else math.inf
        smooth = _SMOOTH if 2 * len(n) <= _MOST_LINES and gap is None else _ROUGH
        is_smooth = is_whole and one_way and not self.astray[kept].any() and tail < smooth
        is_smooth &= bool((self.away[kept] < FARTHEST).all())
        if is_smooth and gap is not None:
            # An image in the fade would be there in part.
            is_smooth = bool(np.abs(rate_of(phase)[gap.fades(self.edge_phase)]).min() > _LEAST_RATE)
        off_axis_factor = 1 + _FAR_OFF * source.nearness * float(self.away[kept].max()) ** 2
        time_error = float(time_error[kept].max())
        return NearestCurve(self.order, phase, time_error, amplitude, off_axis_factor, tail, is_smooth, gap, short)


@dataclass(frozen=True, eq=False)
class _LinePoints:
    """Places on lines, one on each.

    sky: directions N.
    deeper: derivatives of N by depth.
    beams: beams of these directions.
    along: derivatives of n' by depth.
    """

    sky: Float[Array, "lines 3"]
    deeper: Float[Array, "lines 3"]
    beams: Beams
    along: Float[Array, "lines 3"]

    @property
    def time(self) -> Float[Array, " lines"]:
        """Times of travel."""
        assert self.beams.time is not None
        return self.beams.time

    @property
    def time_error(self) -> Float[Array, " lines"]:
        """Their errors."""
        assert self.beams.time_error is not None
        return self.beams.time_error


@dataclass(frozen=True, eq=False)
class _RingLines:
    map: SearchMap
    edge_phase: Float[Array, " lines"]

    @property
    def camera(self) -> Viewer:
        return self.map.camera

    def sky(self, depth: Float[Array, "*sets lines"], turn: float = 0.0) -> Float[Array, "*sets lines 3"]:
        line_of_sight, _ = self.map.leaves.line_of_sight(self.edge_phase + turn, depth)
        return sky_from_line_of_sight(self.camera.frame(), line_of_sight)

    def points_at(self, depth: Float[Array, " lines"]) -> _LinePoints:
        step = _DIFFERENCE
        sky, inner, outer = self.sky(np.stack([depth, depth + step, depth - step]))
        deeper = (inner - outer) / (2 * step)
        beams = self.map.beams_of_sky(sky, time=True, index=False, constants=True)
        drift = np.einsum("nx,anx->na", deeper, np.array(tangent_basis(sky)))
        step_there = np.einsum("nij,nj->ni", beams.jacobian, drift)
        along = np.einsum("ni,inx->nx", step_there, np.array(polar_basis(beams.direction)))
        return _LinePoints(sky, deeper, beams, along)


def _nearest(
    lines: _RingLines, star: Float[Array, " 3"], depth: Float[Array, " lines"]
) -> tuple[Float[Array, " lines"], _LinePoints, Bool[Array, " lines"]]:
    """Depths at which n' comes nearest to the star, by the secant method, and whether they are still to be found."""
    last = depth - _FIRST
    before, here = lines.points_at(last).along @ star, lines.points_at(depth)
    moving = np.ones(len(depth), bool)
    for _ in range(_MOST_STEPS):
        value = here.along @ star
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -value * (depth - last) / (value - before)
        # Where a line is there, differences are round-off.
        step = np.where(moving, np.clip(np.nan_to_num(step), -_LONGEST, _LONGEST), 0.0)
        last, before, depth = depth, value, depth + step
        here = lines.points_at(depth)
        moving &= np.abs(step) > _LAST
        if not moving.any():
            break
    return depth, here, moving


def _impact_vectors(
    lines: _RingLines, depth: Float[Array, " lines"], here: _LinePoints, rate: Callable[[Array], Array]
) -> Float[Array, "lines 3"]:
    """Impact vectors of the rays' asymptotes, about the hole: dT = -B . dn' gives the sign of the polar part.

    rate: derivatives along the curve.
    """
    beams, n = here.beams, here.beams.direction
    assert beams.impact is not None
    assert beams.carter is not None
    south, east = polar_basis(n)
    sine = np.hypot(n[:, 0], n[:, 1])
    azimuthal = beams.impact / sine
    squared = beams.carter + (lines.camera.spin**2 - azimuthal**2) * n[:, 2] ** 2
    polar = np.sqrt(np.maximum(squared, 0))
    step = 10 * _DIFFERENCE
    slopes = [
        ((lines.points_at(depth + step).time - lines.points_at(depth - step).time) / (2 * step), here.along),
        (rate(here.time), rate(n)),
    ]
    miss = []
    for side in (1, -1):
        impact = side * polar[:, None] * south + azimuthal[:, None] * east
        miss.append(sum(np.abs(slope + _dot(step, impact)) for slope, step in slopes))
    sign = np.where(miss[0] <= miss[1], 1.0, -1.0)
    return (sign * polar)[:, None] * south + azimuthal[:, None] * east


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("nx,nx->n", a, b)


def _difference(values: Array) -> Array:
    """The derivative of a periodic function of 2 pi, by neighbours."""
    return (np.roll(values, -1, axis=0) - np.roll(values, 1, axis=0)) * (len(values) / (4 * math.pi))
