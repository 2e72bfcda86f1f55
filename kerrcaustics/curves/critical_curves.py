"""Whole critical curves: sampled so that the curve and its caustic are smooth to the eye, closed, and checked.

All that asks for the curves of one event shares them: caustics, sheets of star images, tubes, films. They are found
once, kept, and never change.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.beams.trace import check_request
from kerrcaustics.curves.critical_points import LABEL_STEP, Points, Search
from kerrcaustics.lens_map.domains import Domain, OneLeaf
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.numerics.parts import inner_parts
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.results.progress import report
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.shadow import even_phases
from kerrcaustics.spacetime.sphere import angle_between, from_angles, polar_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_LINES = 64
_CROWDING = 0.9
# Longest step between neighbours on either sphere, as an angle and as a part of the caustic's size.
_LONGEST_STEP = np.radians(2.0)
_LONGEST_PART = 1 / 80
_MOST_HALVINGS = 14
# A step is cut at once into so many parts at most; into one more where parts of equal length would be just too long.
_MOST_PARTS, _UNEQUAL = 8, 0.1
_MOST_POINTS = 40_000
# Curves whose points have larger errors than this, mostly, are not followed: steps from point to point would be noise.
_WORST_CURVE = 1e-3
# A caustic is called a point only if its error is below this, and its cusps are looked for only above that many errors.
_WORST_POINT = 1e-3
_RESOLVED = 300.0
BLUR_ERRORS = 10.0
"""Stars within so many errors of a caustic cannot be distinguished from it."""
# Points that stand for the ring at infinity, and the distance (radians) from its caustic within which rays are not
# followed to stars.
_RING_POINTS, _UNKNOWN = 64, 1e-6
# Depth by which a bracket reaches beyond the neighbours it is made from, at first and after a miss.
_REACH, _FAR_REACH = 1e-3, 0.6


@dataclass(frozen=True)
class CriticalCurve:
    """A critical curve: points in the order of `edge_phase` over one turn, the first not repeated.

    remarks: what was missed, in words; empty when the curve is whole.
    """

    order: int
    points: Points
    closed: bool
    remarks: tuple[str, ...]

    @cached_property
    def size_in_errors(self) -> float:
        """Size of the caustic in units of the error of its points."""
        direction = self.points.direction
        spread = np.linalg.norm(direction - direction.mean(axis=0), axis=1).max()
        return float(spread / self.points.error.max())

    @property
    def blur(self) -> float:
        """Distance from a caustic that is a point within which a star cannot be distinguished from it, radians."""
        direction = self.points.direction
        spread = np.linalg.norm(direction - direction.mean(axis=0), axis=1).max()
        return float(BLUR_ERRORS * (spread + self.points.error.max()))

    @property
    def is_point(self) -> bool:
        """True when the caustic is no larger than its error: a = 0, or a camera on the axis."""
        return bool(self.size_in_errors <= 3 and self.points.error.max() < _WORST_POINT)

    @property
    def is_resolved(self) -> bool:
        """True when the caustic is so much larger than its error that its cusps can be found."""
        return self.size_in_errors > _RESOLVED

    @property
    def on_axis(self) -> bool:
        """True when the caustic is a point on the spin axis, where phi' has no meaning."""
        return self.is_point and bool(np.sin(self.points.theta).max() <= 3 * self.points.error.max())

    def over_three_turns(self) -> Points:
        """The points with their neighbours across the ends, over three turns."""
        return self.points.shifted(-1).joined(self.points, self.points.shifted(1))


@dataclass(frozen=True, eq=False)
class CriticalCurves:
    """The critical curves of one map, primary first; those that could not be found are left out.

    map: the lens map that was searched.
    orders: number of orders requested.
    curves: the curves that were found.
    beams: number of beams traced.
    engines: names of the engines that traced them.
    """

    map: SearchMap
    orders: int
    curves: tuple[CriticalCurve, ...]
    beams: int
    engines: frozenset[str]

    def __iter__(self) -> Iterator[CriticalCurve]:
        """The curves one by one."""
        return iter(self.curves)

    @property
    def domain(self) -> OneLeaf:
        """The part of the sky whose rays reach the surface."""
        return self.map.leaves

    def in_coordinates_of(self, surface: End) -> "CriticalCurves":
        """The same curves, with their caustics in the coordinates of a surface of the same shape."""
        if surface == self.map.surface:
            return self
        curves = tuple(replace(curve, points=curve.points.in_coordinates_of(surface)) for curve in self.curves)
        return replace(self, map=replace(self.map, surface=surface), curves=curves)

    def search(self) -> Search:
        """A new search at the same event, for points between those of the curves."""
        return Search(self.map)

    @property
    def missing(self) -> tuple[int, ...]:
        """Orders that were asked for and not found."""
        known = {curve.order for curve in self.curves}
        return tuple(k for k in range(1, self.orders + 1) if k not in known)

    @property
    def unbroken(self) -> int:
        """Number of curves, from the primary on, that were followed all the way round."""
        closed = {curve.order for curve in self.curves if curve.closed}
        return next((k - 1 for k in range(1, self.orders + 1) if k not in closed), self.orders)


def critical_curves(
    camera: Viewer, orders: int, engine: str = "auto", tolerance: float = TOLERANCE, *, surface: End = SKY
) -> CriticalCurves:
    """Critical curves of order 1 .. orders of a camera at an event, as far as they can be found; kept for later calls.

    Parameters as for `caustics`; surface: a sphere, as a first arrival. The camera's velocity does not matter.
    """
    _, tolerance = check_request(camera, engine, tolerance)
    return curves_of(SearchMap(camera.at_rest(), surface, engine, tolerance), orders)


def curves_of(search_map: SearchMap, orders: int) -> CriticalCurves:
    """The critical curves of a map, as by `critical_curves`."""
    surface = search_map.surface
    return found_curves(replace(search_map, surface=surface.bare()), orders).in_coordinates_of(surface)


@lru_cache(maxsize=8)
def found_curves(search_map: SearchMap, orders: int) -> CriticalCurves:
    """The critical curves of a map, kept for the next call."""
    search = Search(search_map)
    search.domain.check()
    curves = tuple(_follow(search, orders))
    return CriticalCurves(search_map, orders, curves, search.beams_traced, frozenset(search.engines_used))


def forget() -> None:
    """Forget the curves that were found, so that a new search can be timed."""
    found_curves.cache_clear()


def _follow(search: Search, orders: int) -> list[CriticalCurve]:
    """The curves that can be found.

    On the equator half of each curve is computed and the other half is its mirror image.
    """
    report("critical curves")
    half = search.camera.on_equator
    line = np.linspace(0, np.pi, _LINES // 2 + 1) if half else np.linspace(0, 2 * np.pi, _LINES, endpoint=False)
    # The prograde side of a fast hole, where the caustics wind, asks for more lines.
    edge_phase = line - _CROWDING * search.camera.spin**4 * np.sin(line)
    low, high, remarks = search.brackets(edge_phase, orders)
    order = np.repeat(np.arange(1, orders + 1), len(edge_phase))
    start = np.isfinite(low.ravel())
    all_turn = np.tile(edge_phase, orders)
    points, converged = search.refined(all_turn[start], order[start], low.ravel()[start], high.ravel()[start])
    order = order[start][converged]
    curves = {k: points[order == k] for k in np.unique(order).tolist()}
    curves = {k: curve for k, curve in curves.items() if np.median(curve.error) < _WORST_CURVE}
    empty = {k: len(edge_phase) - len(curve) for k, curve in curves.items()}
    sampled = _sample(search, curves, half)
    found_curves = []
    holding = search.labels_hold(curves)
    for k, curve in curves.items():
        # A curve that does not separate the two indices is not the one it is taken for: its order counts as missing.
        if not holding[k]:
            continue
        gaps = list(sampled[k])
        if empty[k]:
            gaps.append(f"{empty[k]} of {len(edge_phase)} lines of the search hold no point")
        if half:
            curve = curve.joined(curve[(curve.edge_phase > 0) & (curve.edge_phase < np.pi)].mirrored())
        if len(curve) > 1 and not _closes(curve):
            gaps.append("the ends of the curve do not meet")
        found_curves.append(CriticalCurve(k, curve.frozen(), closed=not gaps, remarks=(*gaps, *remarks[k])))
    return found_curves


def _bracket(
    points: Points, edge_phase: Float[Array, " edge_phases"], reach: float = _REACH
) -> tuple[Float[Array, " edge_phases"], Float[Array, " edge_phases"]]:
    """Depths (low, high) that should enclose the curve at the given parameters, from the points around them."""
    right = np.clip(np.searchsorted(points.edge_phase, edge_phase), 1, len(points) - 1)
    near = points.depth[np.clip(np.arange(-2, 2)[:, None] + right, 0, len(points) - 1)]
    # Between neighbours the curve sags by no more than it changes in the steps around.
    margin = np.abs(np.diff(near, axis=0)).max(axis=0) + reach
    # Above depth 0 lies nothing: the line has come to the direction opposite to the hole.
    return np.maximum(near[1:3].min(axis=0) - margin, 0), near[1:3].max(axis=0) + margin


def points_between(
    search: Search, curves: dict[int, Points], edge_phases: dict[int, Float[Array, " _"]]
) -> dict[int, Points]:
    """Points at new parameters between those of the curves, all orders at once; missed ones are left out.

    `curves` must reach beyond the new parameters. The points are found by steps from a spline through the known points,
    and by a bracketing search where the steps fail.
    """
    order = np.concatenate([np.full(len(edge_phase), k) for k, edge_phase in edge_phases.items()])
    edge_phase = np.concatenate(list(edge_phases.values()))
    splines = {k: Spline(curves[k].edge_phase, curves[k].depth) for k in edge_phases}
    guess = np.concatenate([splines[k](edge_phase) for k, edge_phase in edge_phases.items()])
    new = search.polished(edge_phase, order, guess)
    # Where orders crowd, steps from a poor guess lead to the next curve.
    own, moved = np.ones(len(edge_phase), bool), np.abs(new.depth - guess) > LABEL_STEP
    own[moved] = search.labelled(edge_phase[moved], new.depth[moved], order[moved])
    new_points = {}
    for k in edge_phases:
        here = order == k
        # A search that wandered off, to another curve or nowhere, shows in the residual or in the distance.
        low, high = _bracket(curves[k], edge_phase[here])
        good = own[here] & new.on_curve()[here] & (new.depth[here] > low) & (new.depth[here] < high)
        points = new[here][good]
        lost = edge_phase[here][~good]
        if len(lost):
            low, high = _bracket(curves[k], lost, _FAR_REACH)
            points = points.joined(search.refined(lost, np.full(len(lost), k), low, high)[0])
        new_points[k] = points[np.argsort(points.edge_phase, kind="stable")]
    return new_points


def _sample(search: Search, curves: dict[int, Points], half: bool) -> dict[int, list[str]]:
    """Cut steps that are too long, in place, all curves at once; returns what stayed coarse, in words, by order."""
    missed = {k: np.empty(0) for k in curves}
    cut_phases: dict[int, Array] = {}
    for halving in range(_MOST_HALVINGS + 1):
        cut_phases = {k: np.setdiff1d(_cuts(curve, half), missed[k]) for k, curve in curves.items() if len(curve) > 3}
        cut_phases = {k: edge_phase for k, edge_phase in cut_phases.items() if len(edge_phase)}
        if halving == _MOST_HALVINGS or not any(len(curves[k]) < _MOST_POINTS for k in cut_phases):
            break
        cut_phases = {k: edge_phase for k, edge_phase in cut_phases.items() if len(curves[k]) < _MOST_POINTS}
        closed = {k: curves[k] if half else curves[k].joined(curves[k][:1].shifted(1)) for k in cut_phases}
        for k, new in points_between(search, closed, cut_phases).items():
            missed[k] = np.concatenate([missed[k], np.setdiff1d(cut_phases[k], new.edge_phase)])
            merged = curves[k].joined(new)
            curves[k] = merged[np.argsort(merged.edge_phase, kind="stable")]
    notes: dict[int, list[str]] = {k: [] for k in curves}
    for k in curves:
        if len(missed[k]):
            notes[k].append(f"{len(missed[k])} points between neighbours could not be found")
        if k in cut_phases:
            notes[k].append(f"{len(cut_phases[k])} steps between neighbours stayed longer than they should")
    return notes


def steps(points: Points) -> tuple[Float[Array, " steps"], Float[Array, " steps"]]:
    """Lengths (radians) of the steps from point to point, on the celestial sphere unrolled, and on the sky."""
    d_theta, d_azimuth = np.diff(points.theta), np.diff(points.azimuth)
    middle = (points.theta[1:] + points.theta[:-1]) / 2
    return np.hypot(d_theta, np.sin(middle) * d_azimuth), angle_between(
        points.line_of_sight[1:], points.line_of_sight[:-1]
    )


def _cuts(points: Points, half: bool) -> Float[Array, " cuts"]:
    """Parameters at which steps that are too long are cut into equal parts."""
    if not half:
        points = points.joined(points[:1].shifted(1))
    on_caustic, on_sky = steps(points)
    size = max(np.ptp(points.theta), np.sin(points.theta).max() * min(np.ptp(points.azimuth), 2 * np.pi))
    # A caustic smaller than its error is a point, and needs no finer sampling.
    longest = max(min(_LONGEST_STEP, size * _LONGEST_PART), 3 * points.angle_error.max())
    excess = np.maximum(on_caustic / longest, on_sky / _LONGEST_STEP)
    parts = np.where(excess > 1, np.minimum(np.ceil(excess + _UNEQUAL), _MOST_PARTS), 1).astype(int)
    which, part = inner_parts(parts)
    start, end = points.edge_phase[which], points.edge_phase[which + 1]
    return start + part * (end - start)


def _closes(points: Points) -> bool:
    """True when the step across the ends is as short as the others."""
    on_caustic = steps(points.joined(points[:1].shifted(1)))[0]
    return bool(on_caustic[-1] <= 3 * max(on_caustic[:-1].max(), points.angle_error.max()))


def check_index(domain: Domain, max_index: int) -> None:
    """Raise ValueError if only images at infinity are wanted."""
    if domain.unbounded and max_index == 0:
        raise ValueError(
            "Argument `max_index` must be at least 1 for an observer and stars at infinity (images of index 0 lie at "
            "infinite (alpha, beta)), but is 0."
        )


def with_ring_at_infinity(curves: CriticalCurves) -> CriticalCurves:
    """The curves, preceded by the ring at infinity, which is a point, if there is one.

    The primary critical curve of an observer for sources on the celestial sphere is, seen from the radius r, Einstein's
    ring, of radius 2 sqrt(r), and what is seen directly lies beyond it. At infinity the ring, with all beyond it, is
    the point at infinite (alpha, beta), and its caustic, whose size falls as 1 / r^2, is the direction opposite to the
    observer: rays with an impact parameter b end at the angle 4 / b from it.
    """
    domain, camera = curves.domain, curves.map.camera
    if not domain.unbounded:
        return curves
    edge_phase = even_phases(camera, np.arange(_RING_POINTS) / _RING_POINTS)
    depth, ones = domain.first(edge_phase), np.ones(_RING_POINTS)
    theta = np.pi - camera.inclination
    opposite = np.tile(from_angles(theta, np.pi), (_RING_POINTS, 1))
    ring = Points(
        edge_phase=edge_phase,
        depth=depth,
        line_of_sight=domain.line_of_sight(edge_phase, depth)[0],
        direction=opposite,
        theta=theta * ones,
        azimuth=np.pi * ones,
        major=polar_basis(opposite)[1],
        ratio=0 * ones,
        error=_UNKNOWN * ones,
    )
    later_curves = tuple(curve for curve in curves if curve.order > 1)
    return replace(curves, curves=(CriticalCurve(1, ring.frozen(), closed=True, remarks=()), *later_curves))
