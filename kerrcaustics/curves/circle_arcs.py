"""A circle in the plane, cut where its azimuth turns back: arcs on which every source is seen at most once a turn."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicSpline
from scipy.optimize import elementwise

from kerrcaustics.curves.circles_in_plane import Circles, PlanePoints, circles_of
from kerrcaustics.spacetime.camera import Camera

Array = np.ndarray

_TURN = 2 * math.pi
# Places looked at first; the longest step in azimuth; rounds of looking more closely, of which the first ones look
# around places, too, where the beam is thinnest; most places.
_PLACES, _LONGEST, _ROUNDS, _THIN_ROUNDS, _MOST_PLACES = 384, 0.3, 14, 5, 20_000
# Steps in azimuth below so many errors have no sense.
_ERRORS = 20.0


@dataclass(frozen=True, eq=False)
class Arcs:
    """The image of one circle at one crossing.

    low, high: the points at both ends of each arc, in the order of turn, each row followed by the next one and the last
    by the first; index of each arc; folds: the points between arcs of different index, where the azimuth turns back.
    doubts: what is not sure, in words; empty where the arcs are the whole circle.
    """

    circles: Circles
    radius: float
    distance: CubicSpline | None
    low: PlanePoints
    high: PlanePoints
    index: Int[Array, " arcs"]
    folds: PlanePoints
    doubts: tuple[str, ...]

    @property
    def folded(self) -> Bool[Array, " arcs"]:
        """True for arcs whose low end is a fold."""
        return self.index != np.roll(self.index, 1)

    @property
    def sense(self) -> Int[Array, " arcs"]:
        """1 where the azimuth grows with turn, -1 where it falls: as the index says."""
        return _sense(self.circles, self.index)

    def at(self, turn: Float[Array, " points"]) -> PlanePoints:
        """Points of the circle."""
        assert self.distance is not None
        return self.circles.on_circle(turn, np.full(len(turn), self.radius), self.distance(turn))


def arcs_of(camera: Camera, crossing: int, radius: float) -> Arcs:
    """The arcs of a circle, on more lines where few do not tell; kept for the next source on it."""
    circles_of(camera, crossing)
    return _arcs_at_rest(camera.at_rest(), crossing, float(radius))


@lru_cache(maxsize=8)
def _arcs_at_rest(camera: Camera, crossing: int, radius: float) -> Arcs:
    arcs = _arcs(circles_of(camera, crossing), radius)
    return _arcs(circles_of(camera, crossing, many=True), radius) if arcs.doubts else arcs


def _arcs(circles: Circles, radius: float) -> Arcs:
    (distance,) = circles.around(np.array([radius]))
    none = circles.on_circle(*np.empty((3, 0)))
    if distance is None:
        doubt = f"the circle r = {radius:.12g} is not seen once on every line across the shadow edge"
        return Arcs(circles, radius, None, none, none, np.empty(0, int), none, (doubt,))
    turn = _TURN * (np.arange(_PLACES) + 0.5) / _PLACES
    blank = Arcs(circles, radius, distance, none, none, np.empty(0, int), none, ())
    points = _sampled(blank, blank.at(turn))
    following = points[np.roll(np.arange(len(points)), -1)]
    doubts = _doubts(blank, points, following)
    change = points.index != following.index
    folds = _folds(blank, points[change], following[change])
    low, high, index = points[~change], following[~change], points.index[~change]
    # Both halves of a step with a fold.
    one, other = points[change], following[change]
    low, high = low.joined(one, folds), high.joined(folds, other)
    index = np.concatenate([index, one.index, other.index])
    order = np.argsort(low.turn, kind="stable")
    return Arcs(circles, radius, distance, low[order], high[order], index[order], folds, doubts)


def _sampled(arcs: Arcs, points: PlanePoints) -> PlanePoints:
    """Points so dense that what lies between them is known."""
    for number in range(_ROUNDS):
        following = points[np.roll(np.arange(len(points)), -1)]
        coarse = ~_plain(arcs, points, following)
        if number < _THIN_ROUNDS:
            size = np.abs(points.ratio)
            thin = (size <= np.roll(size, 1)) & (size <= np.roll(size, -1))
            coarse |= thin | np.roll(thin, -1)
        if not coarse.any() or len(points) > _MOST_PLACES:
            break
        start, end = points.turn[coarse], following.turn[coarse]
        middle = start + (end - start) % _TURN / 2
        points = points.joined(arcs.at(middle % _TURN))
        points = points[np.argsort(points.turn, kind="stable")]
    return points


def _plain(arcs: Arcs, one: PlanePoints, other: PlanePoints) -> Array:
    """True for short steps on which the azimuth runs as the index says, or that hold one fold."""
    step = step_between(one, other)
    known = (one.index >= 0) & (other.index >= 0)
    same = one.index == other.index
    noise = _ERRORS * (one.error + other.error)
    along = (_sense(arcs.circles, one.index) * step >= -noise) | ~same
    return known & (np.abs(step) <= _LONGEST) & (np.abs(one.index - other.index) <= 1) & along


def _sense(circles: Circles, index: Int[Array, "*n"]) -> Int[Array, "*n"]:
    """How the azimuth runs as turn grows: at the first crossing down for even index; at the next one the other way."""
    return circles.side * (2 * ((index + circles.end.crossing - 1) % 2) - 1)


def step_between(one: PlanePoints, other: PlanePoints) -> Float[Array, " points"]:
    """Steps in azimuth, without whole turns."""
    return (other.azimuth - one.azimuth + math.pi) % _TURN - math.pi


def _doubts(arcs: Arcs, one: PlanePoints, other: PlanePoints) -> tuple[str, ...]:
    wrong = int((~_plain(arcs, one, other)).sum())
    if wrong:
        return (f"{wrong} of {len(one)} steps along the circle could not be resolved",)
    turns = arcs.circles.side * step_between(one, other).sum() / _TURN
    return () if round(turns) == -1 else (f"the circle is seen {-turns:.3g} times round, not once",)


def _folds(arcs: Arcs, one: PlanePoints, other: PlanePoints) -> PlanePoints:
    """The points where the beams are flat, between others of different index."""
    if not len(one):
        return one

    def ratio(step: Array, start: Array) -> Array:
        return arcs.at((start + step) % _TURN).ratio

    width = (other.turn - one.turn) % _TURN
    found = elementwise.find_root(
        ratio, (np.zeros(len(one)), width), args=(one.turn,), tolerances={"xatol": 1e-15, "xrtol": 1e-14}
    )
    step = np.where(np.isfinite(found.x), found.x, width / 2)
    return arcs.at((one.turn + step) % _TURN)
