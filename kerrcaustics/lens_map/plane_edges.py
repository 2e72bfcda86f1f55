"""Images of circles in the equatorial plane next to the shadow edge, the horizon and infinity included.

On a line across the shadow edge (sky_lines.py) the image of a circle lies where the Mino time to its radius is that to
a crossing of the plane. No ray is traced. The curves are analytic, and held at even steps of a parameter chi, in which
points are closer together where a viewer near the plane sees them change quickly:
edge phase = chi - (1 - |cos i|) sin(2 chi) / 2; in the plane, where it need not, with 1/2.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams import calls
from kerrcaustics.lens_map.sky_lines import Lines, lines_across
from kerrcaustics.numerics import fourier
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

CLOSEST = 1e-15
"""Distance from the shadow edge, radians, below which a direction has no digits left."""

MOST_NODES = 1024
"""Largest number of lines on which a curve is searched for."""

# The factor of sin(2 chi) / 2 for viewers in the plane.
_IN_PLANE = 0.5
# Number of lines at first.
_FIRST_NODES = 32
# Least half width in ln |distance| of a bracket about a value that is interpolated between fewer lines.
_BESIDE = 1e-9
# Part of a line, from the shadow edge to its end, that is searched.
_FARTHEST = 1 - 1e-9
# Error of ln |distance| at which a search ends, before a step of Newton's method.
_SEARCHED = 1e-8
# Error of the same where that step fails, and the gap of times that shows it.
_ABSOLUTE, _KINK = 2e-15, 5e-13
# The same, relative to the gap before the step.
_POOR = 1e-6
# Error of interpolation that is small enough, and the one below which it is rounding unless it falls with more lines.
_SMALL, _MAY_BE_ROUNDING = 1e-10, 1e-6
# Number of coefficients at the end of a Fourier series by which its error is judged.
_LAST = 8
# Ratio of the error of an interpolated distance to the largest of them: at most 11 over 2,112 curves of 384 viewers.
_OF_TAIL = 20.0
# Largest ratio of one quarter of the coefficients to the one before, and the least number that divides.
_SLOWEST, _TINY = 0.9, 1e-300
# Rounding of a sum of a Fourier series, relative.
_OF_SERIES = 4e-15
# Rounding of a Mino time, relative.
_OF_TIME = 2e-15
# Rounding of a direction, radians.
_OF_DIRECTION = 3e-16
# Ratio of the error by rounding to what a gap at a root shows of it.
_OF_GAP = 3.0
# Least and largest step of ln |distance| for slopes.
_STEP, _LARGEST_STEP = 1e-5, 0.1
# Least step over the rounding of a direction, relative to the distance.
_OVER_ROUNDING = 300.0


class CrossingCircles(NamedTuple):
    """Circles in the plane as rays see them at one of their crossings of it.

    crossing: number of the crossing of each, from 1.
    radius: radius of each, from that of the horizon to infinity.
    """

    crossing: Int[Array, " circles"]
    radius: Float[Array, " circles"]


class PlaneEdges(NamedTuple):
    """The images of circles at even steps of chi.

    distance: signed distance from the shadow edge, radians; NaN where a line meets none.
    error: error of the distance, radians.
    slope: derivative of the gap of Mino times by ln |distance|, in the sense of growing distance: negative.
    agrees: True for curves whose values on half as many lines agree with these.
    """

    distance: Float[Array, "lines circles"]
    error: Float[Array, "lines circles"]
    slope: Float[Array, "lines circles"]
    agrees: Bool[Array, " circles"]


def crossing_gap(
    camera: Viewer, sky: Float[Array, "*batch 3"], crossing: Int[Array, "*#batch"], radius: Float[Array, "*#batch"]
) -> Float[Array, "*batch"]:
    """Mino time by which the n-th crossing of the plane lies within a radius; negative if beyond it.

    Parameters: camera, at rest; sky, directions; radius, from that of the horizon to infinity. Rays that fall in before
    the crossing count as within, those that escape before it as beyond. Errors: see crossing_formulas.py.
    """
    batch = sky.shape[:-1]
    columns = [np.broadcast_to(np.asarray(part, float), batch).ravel() for part in (crossing, radius)]
    return calls.crossing_gap(camera, sky.reshape(-1, 3), *columns).reshape(batch)


def edge_phase_of(camera: Viewer, chi: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    """Edge phases at values of chi."""
    return chi - _bend(camera) * np.sin(2 * chi) / 2


def chi_of(camera: Viewer, edge_phase: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
    """The values of chi at edge phases: the inverse of `edge_phase_of`."""
    flat, bend = np.asarray(edge_phase, float).ravel(), _bend(camera)
    # Both are equal at the ends of each half turn.
    start = np.floor(flat / np.pi) * np.pi

    def excess(chi: Array, phase: Array) -> Array:
        return chi - bend * np.sin(2 * chi) / 2 - phase

    ends = np.full(len(flat), -0.1), np.full(len(flat), np.pi + 0.1)
    return (start + bracketed_roots(excess, ends, (flat - start,), absolute=1e-15).x).reshape(np.shape(edge_phase))


def _bend(camera: Viewer) -> float:
    # In the plane curves are smooth in the edge phase too, and next to 0 and pi rays have no digits.
    return _IN_PLANE if camera.on_equator else 1 - abs(camera.cos_theta)


def plane_edges(camera: Viewer, circles: CrossingCircles, most_nodes: int = MOST_NODES) -> PlaneEdges:
    """The images of circles on as many lines as they need, or on the most.

    Errors: of the distance, the sum of that of interpolation between the lines, by the end of its Fourier series, and
    of rounding. There are enough lines when the first one is small, or no longer falls.
    """
    count = _FIRST_NODES
    before = distances(camera, lines_on(camera, count), circles)
    while True:
        count *= 2
        lines = lines_on(camera, count)
        distance = distances(camera, lines, circles, before)
        tail = _tails(distance)
        more = (tail > _SMALL) & ((tail < _tails(before) / 2) | (tail > _MAY_BE_ROUNDING))
        if 2 * count > most_nodes or not more.any():
            break
        before = distance
    slope = _slopes(camera, lines, circles, distance)
    left = crossing_gap(camera, _directions(lines.start[:, None], lines.ahead[:, None], distance), *circles)
    rounding = _rounding(circles, distance, slope, left)
    off = np.abs(interpolated(before, fourier.nodes(count)) - distance)
    scale, coarse = _scale(distance), _tails(before) * _scale(before).max(axis=0)
    agrees = (off <= coarse + tail * scale + rounding).all(axis=0)
    return PlaneEdges(distance, tail * scale + rounding, slope, agrees)


def lines_on(camera: Viewer, count: int) -> Lines:
    """Lines across the shadow edge at even steps of chi."""
    return lines_across(camera, edge_phase_of(camera, fourier.nodes(count)))


def distances(
    camera: Viewer, lines: Lines, circles: CrossingCircles, fewer: Float[Array, "nodes circles"] | None = None
) -> Float[Array, "lines circles"]:
    """Signed distances from the shadow edge, radians, at which lines meet circles; NaN where they do not.

    Parameters: fewer, the distances on half as many lines, next to which those on all lines lie, as a guess.
    """
    shape = len(lines), len(circles.radius)
    row, column = (index.ravel() for index in np.indices(shape))
    start, ahead = lines.start[row], lines.ahead[row]
    crossing, radius = circles.crossing[column], circles.radius[column]
    # If the crossing is within the circle just outside the shadow edge, its image lies farther out.
    outside = crossing_gap(camera, _directions(start, ahead, np.full(len(row), CLOSEST)), crossing, radius) > 0
    side, farthest = np.where(outside, 1.0, -1.0), np.where(outside, lines.last[row], -lines.first[row])

    def gap(logarithm: Array, which: Array) -> Array:
        of = which.astype(int)
        return crossing_gap(
            camera, _directions(start[of], ahead[of], side[of] * np.exp(logarithm)), crossing[of], radius[of]
        )

    low, high = np.full(len(row), math.log(CLOSEST)), np.log(_FARTHEST * farthest)
    logarithm, rows = np.full(len(row), np.nan), np.arange(len(row), dtype=float)
    if fewer is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            guess = np.log(side * interpolated(fewer, fourier.nodes(len(lines))).ravel())
        width = np.broadcast_to(_BESIDE + _tails(fewer), shape).ravel()
        ends = np.fmax(guess - width, low), np.fmin(guess + width, high)
        logarithm = bracketed_roots(gap, ends, (rows,), absolute=_SEARCHED).x
    missing = np.flatnonzero(np.isnan(logarithm))
    if len(missing):
        ends = low[missing], high[missing]
        logarithm[missing] = bracketed_roots(gap, ends, (rows[missing],), absolute=_SEARCHED).x
    return (side * np.exp(_polished(gap, logarithm, rows))).reshape(shape)


def _polished(gap: Callable[[Array, Array], Array], logarithm: Array, rows: Array) -> Float[Array, " roots"]:
    """Roots in ln |distance| by a step of Newton's method, or where that fails by a longer search."""
    step = _steps(np.exp(logarithm))
    value, beyond, before = (gap(logarithm + move, rows) for move in (0.0, step, -step))
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = logarithm - np.clip(value * 2 * step / (beyond - before), -2 * _SEARCHED, 2 * _SEARCHED)
    # At a turning point the gap has a kink.
    bent = np.flatnonzero(np.abs(gap(moved, rows)) > _KINK + _POOR * np.abs(value))
    if len(bent):
        ends = logarithm[bent] - 2 * _SEARCHED, logarithm[bent] + 2 * _SEARCHED
        found = bracketed_roots(gap, ends, (rows[bent],), absolute=_ABSOLUTE)
        moved[bent] = np.where(found.found, found.x, moved[bent])
    return moved


def interpolated(
    distance: Float[Array, "lines circles"], chi: Float[Array, " places"]
) -> Float[Array, "places circles"]:
    """Distances at other values of chi, by their logarithms where they have one sign all round."""
    held, signs = _as_series(distance)
    values = fourier.values_at(fourier.coefficients(held), chi)
    with np.errstate(over="ignore"):
        return np.where(signs == 0, values, signs * np.exp(values))


def _as_series(distance: Float[Array, "lines circles"]) -> tuple[Array, Array]:
    """ln |distance| where it has one sign all round, else the distance itself; the signs, 0 for none."""
    signs = np.sign(distance[0]) * (np.sign(distance) == np.sign(distance[0])).all(axis=0)
    with np.errstate(divide="ignore"):
        return np.where(signs == 0, distance, np.log(np.abs(distance))), signs


def _tails(distance: Float[Array, "lines circles"]) -> Float[Array, " circles"]:
    """Errors of interpolation, relative to the distance, by the ends of the Fourier series."""
    held, signs = _as_series(distance)
    sizes = np.abs(fourier.coefficients(held))
    # What is left out, where coefficients go on to fall as they did over the last two quarters, counts twice.
    *_, third, fourth = (part.sum(axis=0) for part in np.array_split(sizes, 4))
    fall = np.minimum(fourth / np.maximum(third, _TINY), _SLOWEST)
    beyond = np.maximum(2 * fourth * fall / (1 - fall), fourth)
    ends = np.maximum(_OF_TAIL * sizes[-_LAST:].max(axis=0), beyond)
    return _OF_SERIES + ends / np.where(signs == 0, np.abs(distance).mean(axis=0), 1)


def _scale(distance: Float[Array, "lines circles"]) -> Float[Array, "lines circles"]:
    """Distances to which errors of interpolation are relative: the mean where they change their sign."""
    _, signs = _as_series(distance)
    return np.where(signs == 0, np.abs(distance).mean(axis=0), np.abs(distance))


def _slopes(camera: Viewer, lines: Lines, circles: CrossingCircles, distance: Array) -> Float[Array, "lines circles"]:
    """Derivatives of the gap by ln |distance|, in the sense of growing distance."""
    start, ahead = lines.start[:, None], lines.ahead[:, None]
    step = _steps(distance)
    beyond, before = (
        crossing_gap(camera, _directions(start, ahead, distance * np.exp(move)), *circles) for move in (step, -step)
    )
    return np.sign(distance) * (beyond - before) / (2 * step)


def _steps(distance: Array) -> Array:
    """Steps of ln |distance| for slopes, longer where a direction has few digits."""
    with np.errstate(divide="ignore"):
        return np.clip(_OVER_ROUNDING * _OF_DIRECTION / np.abs(distance), _STEP, _LARGEST_STEP)


def _rounding(circles: CrossingCircles, distance: Array, slope: Array, left: Array) -> Float[Array, "lines circles"]:
    """Rounding of distances, radians; left, the gaps there, which show more of it beside turning points."""
    # Times are at most about this long: to the crossing, which is half a period later for each further one.
    time = np.pi * (circles.crossing + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.abs(distance / slope)
        return _OF_TIME * time * change + _OF_GAP * (np.abs(left) * change).max(axis=0) + _OF_DIRECTION


def _directions(start: Array, ahead: Array, distance: Array) -> Float[Array, "*batch 3"]:
    """Directions at distances along lines."""
    sky = start * np.cos(distance)[..., None] + ahead * np.sin(distance)[..., None]
    return sky / np.sqrt(np.einsum("...i,...i", sky, sky))[..., None]
