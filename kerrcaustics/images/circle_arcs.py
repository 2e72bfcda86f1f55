"""A circle in the plane, cut where its azimuth turns back: arcs on which every source is seen at most once a turn.

The images of a source at one crossing are those on the arcs of its circle: `search_arcs` finds them, `count_on_arcs`
counts them.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.images.search import ImageSearch, SkyImages, searched_together
from kerrcaustics.lens_map.circles_in_plane import Circles
from kerrcaustics.lens_map.domains import Ring
from kerrcaustics.lens_map.plane_map import Crossings
from kerrcaustics.lens_map.search_sky import TOLERANCE, search_camera
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.results.progress import in_steps
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.shadow import even_phases
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_TURN = 2 * math.pi
# Places on the circle that are sampled first.
_PLACES = 384
# Longest step in azimuth, radians.
_LONGEST = 0.3
# Parts into which a step is cut.
_PARTS = 4
# Rounds of cutting.
_ROUNDS = 7
# The first rounds, in which steps beside the thinnest beams are cut too.
_THIN_ROUNDS = 2
# The first rounds, in which steps whose azimuth may run a whole turn are cut too.
_TURN_ROUNDS = 4
# Most places on the circle.
_MOST_PLACES = 20_000
# Steps in azimuth, in errors, below which their sign is uncertain.
_ERRORS = 20.0
# Difference from the radius that counts as none, relative to it.
_ROUND_OFF = 1e-14
# At a fold the beam is flat: delta_minus is no larger than this part of delta_plus.
_FLAT = 1e-6
# The beam between places of one index is traced where a parabola through their ratios falls below this part of them.
_THINNER = 0.5
# Errors by which a ratio differs at least from that of a flat beam.
_CERTAIN = 10.0
# Step in ln r for the slope of the ratio.
_BESIDE = 1e-6
# Distance of a source from a fold, in errors, below which it may lie on the caustic.
_BLUR_ERRORS = 10.0
_NEAREST = {"xatol": 1e-9, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0}
_TIGHT = {"absolute": 1e-15, "relative": 1e-14}


@dataclass(frozen=True, eq=False)
class Arcs:
    """The image of one circle at one crossing.

    circles: the circles of the crossing.
    radius: radius of the circle.
    distance: distance of the image from the shadow edge, a function of edge phase; None if lines miss it.
    low: points at the starts of the arcs, in the order of edge phase.
    high: points at their ends, each the start of the next arc, the last one that of the first.
    index: Morse index of each arc.
    folds: points between arcs of different index, where the azimuth turns back.
    remarks: remarks on what is uncertain, empty where the arcs are the whole circle.
    """

    circles: Circles
    radius: float
    distance: Spline | None
    low: Crossings
    high: Crossings
    index: Int[Array, " arcs"]
    folds: Crossings
    remarks: tuple[str, ...]

    @property
    def folded(self) -> Bool[Array, " arcs"]:
        """True for arcs whose low end is a fold: the index changes there, and the beam is flat."""
        return (self.index != np.roll(self.index, 1)) & is_flat(self.low)

    @property
    def sense(self) -> Int[Array, " arcs"]:
        """1 where the azimuth grows with the edge phase, -1 where it falls, by the index."""
        return _sense(self.circles, self.index)

    def points_at(self, edge_phase: Float[Array, " points"]) -> Crossings:
        """Points of the circle, of index -1 where they could not be found."""
        assert self.distance is not None
        points = self.circles.on_circle(edge_phase, np.full(len(edge_phase), self.radius), self.distance(edge_phase))
        return replace(points, index=np.where(self._astray(points), -1, points.index))

    def where(
        self, value: Callable[[Crossings], Array], start: Float[Array, " steps"], width: Float[Array, " steps"]
    ) -> Float[Array, " steps"]:
        """Edge phases of steps along the circle at which a quantity of points vanishes; the middle where none does."""

        def value_at(step: Array, start: Array) -> Array:
            return value(self.points_at((start + step) % _TURN))

        root = bracketed_roots(value_at, (np.zeros(len(start)), width), (start,), **_TIGHT)
        return (start + np.where(np.isfinite(root.x), root.x, width / 2)) % _TURN

    def _astray(self, points: Crossings) -> Bool[Array, " points"]:
        """True for points that are not on the circle."""
        return ~(points.miss(self.radius) <= _ERRORS * points.error + _ROUND_OFF) | (points.index < 0)


def arcs_of(domain: Ring, radius: float) -> Arcs:
    """The arcs of a circle, on more lines if few do not suffice; kept for the next source on it."""
    domain.check()
    return _kept_arcs(Ring(domain.camera.at_rest(), domain.surface.bare()), float(radius))


@lru_cache(maxsize=8)
def _kept_arcs(domain: Ring, radius: float) -> Arcs:
    arcs = _arcs(domain.circles(), radius)
    return _arcs(domain.circles(many=True), radius) if arcs.remarks else arcs


def _arcs(circles: Circles, radius: float) -> Arcs:
    (distance,) = circles.distances(np.array([radius]))
    none = circles.on_circle(*np.empty((3, 0)))
    if distance is None:
        doubt = f"the circle r = {radius:.12g} is not seen once on every line across the shadow edge"
        return Arcs(circles, radius, None, none, none, np.empty(0, int), none, (doubt,))
    edge_phase = even_phases(circles.camera, (np.arange(_PLACES) + 0.5) / _PLACES)
    blank = Arcs(circles, radius, distance, none, none, np.empty(0, int), none, ())
    points, touching = _with_flattest_points(blank, _sampled(blank, blank.points_at(edge_phase)))
    known = points.index >= 0
    points, lost = points[known], int((~known).sum())
    if len(points) < 2:
        return replace(blank, remarks=(f"{lost} places on the circle could not be found",))
    following = points[np.roll(np.arange(len(points)), -1)]
    change = points.index != following.index
    folds = _folds(blank, points[change], following[change])
    remarks = (*_lost(lost, folds), *_unresolved(blank, points, following), *touching)
    low, high, index = points[~change], following[~change], points.index[~change]
    # Both halves of a step with a fold.
    first, second = points[change], following[change]
    low, high = low.joined(first, folds), high.joined(folds, second)
    index = np.concatenate([index, first.index, second.index])
    order = np.argsort(low.edge_phase, kind="stable")
    return Arcs(circles, radius, distance, low[order], high[order], index[order], folds, remarks)


def is_flat(points: Crossings) -> Bool[Array, " points"]:
    """True where beams are flat, to the accuracy with which folds are found."""
    return np.abs(points.ratio) <= _FLAT


def _lost(places: int, folds: Crossings) -> tuple[str, ...]:
    """Remarks about missing places and folds."""
    bent = int((~is_flat(folds)).sum())
    said = [f"{places} places on the circle could not be found"] if places else []
    return (*said, *([f"{bent} events could not be found: the index changes where no beam is flat"] if bent else []))


def _with_flattest_points(arcs: Arcs, points: Crossings) -> tuple[Crossings, tuple[str, ...]]:
    """The points and the flattest beams between points of one index, and remarks where their sign is uncertain.

    A circle that just reaches a caustic crosses it twice within a step. There delta_minus is followed to its least
    value, which shows whether its sign changes, unless it is too small for its error.
    """
    place = np.arange(len(points))
    before, after = points[np.roll(place, 1)], points[np.roll(place, -1)]
    back, ahead = -((points.edge_phase - before.edge_phase) % _TURN), (after.edge_phase - points.edge_phase) % _TURN
    size = np.abs(points.ratio)
    falling, rising = (np.abs(before.ratio) - size) / back, (np.abs(after.ratio) - size) / ahead
    least = (before.index == points.index) & (after.index == points.index) & (falling <= 0) & (rising >= 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = (rising - falling) / (ahead - back)
        bottom = size - (falling - bend * back) ** 2 / (4 * bend)
    chosen = least & (bottom < _THINNER * size)
    if not chosen.any():
        return points, ()

    from scipy.optimize import elementwise

    def depth(step: Array, start: Array, sign: Array) -> Array:
        return sign * arcs.points_at((start + step) % _TURN).ratio

    bracket = back[chosen], np.zeros(int(chosen.sum())), ahead[chosen]
    args = points.edge_phase[chosen], np.sign(points.ratio[chosen])
    step = elementwise.find_minimum(depth, bracket, args=args, tolerances=_NEAREST).x
    added = arcs.points_at((points.edge_phase[chosen] + np.where(np.isfinite(step), step, 0)) % _TURN)
    joined = points.joined(added)
    return joined[np.argsort(joined.edge_phase, kind="stable")], _touching(arcs, added)


def _touching(arcs: Arcs, points: Crossings) -> tuple[str, ...]:
    """Remarks about the points at which a flat beam cannot be distinguished from one that is not."""
    beside = arcs.circles.on_circle(points.edge_phase, points.radius * math.exp(_BESIDE), points.distance)
    slope = np.abs(beside.ratio - points.ratio) / _BESIDE
    unsure = ~(np.abs(points.ratio) > _CERTAIN * (points.ratio_error + slope * points.error))
    return tuple(
        f"next to phi = {phi % _TURN:.9g} the circle touches a caustic: a pair of events there cannot be distinguished "
        "from none"
        for phi in points.azimuth[unsure].tolist()
    )


def _sampled(arcs: Arcs, points: Crossings) -> Crossings:
    """Points so dense that every step between them is resolved."""
    for number in range(_ROUNDS):
        following = points[np.roll(np.arange(len(points)), -1)]
        coarse = ~_is_resolved(arcs, points, following)
        if number < _THIN_ROUNDS:
            size = np.abs(points.ratio)
            thin = (size <= np.roll(size, 1)) & (size <= np.roll(size, -1))
            coarse |= thin | np.roll(thin, -1)
        if number < _TURN_ROUNDS:
            # A whole turn, unless the ray passes the spin axis between both places.
            coarse |= np.abs(following.azimuth - points.azimuth) > math.pi
        if not coarse.any() or len(points) > _MOST_PLACES:
            break
        start, end = points.edge_phase[coarse], following.edge_phase[coarse]
        between = start + ((end - start) % _TURN) * np.arange(1, _PARTS)[:, None] / _PARTS
        points = points.joined(arcs.points_at(between.ravel() % _TURN))
        points = points[np.argsort(points.edge_phase, kind="stable")]
    return points


def _is_resolved(arcs: Arcs, first: Crossings, second: Crossings) -> Array:
    """True for short steps along which the azimuth changes with the sign of the index, or that hold one fold."""
    step = step_between(first, second)
    known = (first.index >= 0) & (second.index >= 0)
    same = first.index == second.index
    noise = _ERRORS * (first.error + second.error)
    along = (_sense(arcs.circles, first.index) * step >= -noise) | ~same
    return known & (np.abs(step) <= _LONGEST) & (np.abs(first.index - second.index) <= 1) & along


def _sense(circles: Circles, index: Int[Array, "*n"]) -> Int[Array, "*n"]:
    """Sign of the azimuth's growth with the edge phase: -1 for even index at the first crossing, 1 at the next ones."""
    return circles.side * (2 * ((index + circles.end.crossing - 1) % 2) - 1)


def step_between(first: Crossings, second: Crossings) -> Float[Array, " points"]:
    """Steps in azimuth, without whole turns."""
    return _away(second.azimuth, first.azimuth)


def _unresolved(arcs: Arcs, first: Crossings, second: Crossings) -> tuple[str, ...]:
    wrong = int((~_is_resolved(arcs, first, second)).sum())
    if wrong:
        return (f"{wrong} of {len(first)} steps along the circle could not be resolved",)
    turns = arcs.circles.side * step_between(first, second).sum() / _TURN
    return () if round(turns) == -1 else (f"the circle is seen {-turns:.3g} times round, not once",)


def _folds(arcs: Arcs, first: Crossings, second: Crossings) -> Crossings:
    """The points where the beams are flat, between others of different index."""
    if not len(first):
        return first
    width = (second.edge_phase - first.edge_phase) % _TURN
    return arcs.points_at(arcs.where(lambda points: points.flatness, first.edge_phase, width))


def search_arcs(domain: Ring, places: Float[Array, "sources 2"], max_index: int) -> ImageSearch:
    """All images of sources (r, phi), by rays at their n-th crossing."""
    return searched_together([_images_of_source(domain, radius, phi, max_index) for radius, phi in places.tolist()])


def _images_of_source(domain: Ring, radius: float, phi: float, max_index: int) -> ImageSearch:
    arcs = arcs_of(domain, radius)
    edge_phase, index = _edge_phases_of(arcs, phi)
    kept = index <= max_index
    edge_phase, index = edge_phase[kept], index[kept]
    places = arcs.points_at(edge_phase) if len(edge_phase) else arcs.low[:0]
    order = np.lexsort((edge_phase, index))
    places, index = places[order], index[order]
    miss = np.hypot(np.log(places.radius / radius), _away(places.azimuth, phi))
    counts = np.bincount(index, minlength=max_index + 1)[None]
    error = radius * (places.error + miss) / np.where(places.minor == 0, 1, places.minor)
    return ImageSearch(
        images=SkyImages.arriving(np.zeros(len(index), int), index, places.sky, error),
        counts=counts,
        expected=counts,
        on_caustic=_touched(arcs, phi, max_index)[None],
        ring=np.zeros((1, max_index + 1), bool),
        coarse=(0.0,) * (max_index + 1),
        remarks=(arcs.remarks,),
        certificate="arcs",
    )


def count_on_arcs(
    domain: Ring, places: Float[Array, "sources 2"], max_index: int
) -> tuple[Int[Array, "sources indices"], Bool[Array, " sources"], Bool[Array, " sources"]]:
    """Counts of images, and flags: sources on a caustic, certified sources; fast for many sources on one circle."""
    counts = np.zeros((len(places), max_index + 1), int)
    near, certified = np.zeros((2, len(places)), bool)
    for radius in in_steps("circle", np.unique(places[:, 0]).tolist()):
        arcs = arcs_of(domain, radius)
        for i in np.flatnonzero(places[:, 0] == radius).tolist():
            holds = _arcs_containing(arcs, places[i, 1])
            counts[i] = np.bincount(arcs.index[holds], minlength=max_index + 1)[: max_index + 1]
            near[i] = _touched(arcs, places[i, 1], max_index).any()
            certified[i] = not (arcs.remarks or near[i])
    return counts, near, certified


def _touched(arcs: Arcs, phi: float, max_index: int) -> Bool[Array, " orders"]:
    """True, by order to max_index + 1, where a source cannot be distinguished from the caustic of that order."""
    which = np.flatnonzero(arcs.index != np.roll(arcs.index, 1))
    folds = arcs.low[which]
    close = np.abs(_away(folds.azimuth, phi)) <= _BLUR_ERRORS * (folds.error + TOLERANCE)
    orders = np.maximum(arcs.index, np.roll(arcs.index, 1))[which][close]
    return np.isin(np.arange(1, max_index + 2), orders)


def _away(azimuth: Float[Array, "*n"], phi: Float[Array, "*n"] | float) -> Float[Array, "*n"]:
    return (azimuth - phi + math.pi) % _TURN - math.pi


def _arcs_containing(arcs: Arcs, phi: float) -> Bool[Array, " arcs"]:
    """True for the arcs on which a source is seen; at a common end of two, for one of them."""
    start, end = _away(arcs.low.azimuth, phi), _away(arcs.high.azimuth, phi)
    step = step_between(arcs.low, arcs.high)
    # Steps are short: where both ends lie on both sides of the source's opposite, it is not between them.
    return ((start > 0) != (end > 0)) & (np.abs(end - start - step) < 1)


def _edge_phases_of(arcs: Arcs, phi: float) -> tuple[Float[Array, " images"], Int[Array, " images"]]:
    """Edge phases and indices of the images of a source on the circle."""
    holds = _arcs_containing(arcs, phi)
    low, index = arcs.low.edge_phase[holds], arcs.index[holds]
    if not holds.any():
        return low, index
    width = (arcs.high.edge_phase[holds] - low) % _TURN
    return arcs.where(lambda points: _away(points.azimuth, phi), low, width), index


def circle_image(viewer: Viewer, crossing: int, radius: float) -> Arcs:
    """The image of a circle, cut into arcs; ValueError for viewers in the plane."""
    return arcs_of(Ring(search_camera(viewer), EquatorialPlane(crossing)), radius)
