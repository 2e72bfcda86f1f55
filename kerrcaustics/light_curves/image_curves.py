"""All images of a moving source over a span of emission times: branches, each one image while it lives, with events.

At some moments all images are searched for, with the certificate of sources at rest: a moving source and one at rest at
the same place have the same images. Images are followed from each moment to the next (curve_following.py), and those
that are not reached are followed backward, which finds the pairs that appear and vanish between moments.
"""

import math
from dataclasses import dataclass

import numpy as np

from kerrcaustics.beams.spheres import Sphere
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.search import ImageSearch, SkyImages
from kerrcaustics.light_curves.arrivals import Source
from kerrcaustics.light_curves.curve_following import CurvePoints, FollowedCurve, follow, turning_points
from kerrcaustics.results.progress import in_steps
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# Distance of images below which they count as equal, radians.
_SAME = 1e-8
# The same in their errors.
_SAME_ERRORS = 30.0
# Angle from the equatorial plane, radians, below which a source lies in it.
_IN_PLANE = 1e-9


@dataclass(frozen=True, eq=False)
class Turn:
    """A fold of an image curve: a pair of images appears there, or vanishes.

    point: one row.
    order: order of the caustic that the source meets.
    creates: True if two images appear.
    error: error of its emission time, GM/c^3.
    sky_error: error of its direction, radians.
    """

    point: CurvePoints
    order: int
    creates: bool
    error: float
    sky_error: float


@dataclass(frozen=True)
class Branch:
    """An image from its first to its last moment.

    index: Morse index.
    points: Points by time.
    born, dies: Its events, None at the ends of the span.
    """

    index: int
    points: CurvePoints
    born: Turn | None
    dies: Turn | None


@dataclass(frozen=True)
class ImageCurves:
    """The images of a moving source.

    branches: The images.
    turns: The folds between them.
    remarks: One for each doubt.
    """

    branches: tuple[Branch, ...]
    turns: tuple[Turn, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class SearchedMoment:
    """The images at one emission time."""

    time: float
    images: SkyImages
    certified: bool

    def which(self, point: CurvePoints) -> int | None:
        """The number of the image at the end of a curve; None if there is none."""
        away = lengths(self.images.sky - point.sky)
        away[self.images.index != point.index] = math.inf
        if not len(away):
            return None
        i = int(np.argmin(away))
        return i if away[i] < _SAME + _SAME_ERRORS * self.images.error[i] else None


def images_at_moments(source: Source, times: Float[Array, " moments"], max_index: int) -> list[SearchedMoment]:
    """All images at some emission times."""
    places = source.motion.places(times)
    angles = places.angles
    # Moments at one radius and theta, as on a circle, take one search together.
    keys = np.round(np.stack([places.radius, angles[:, 0]], axis=-1), 10)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    moments: dict[int, SearchedMoment] = {}
    for number in in_steps("search for images", list(range(int(group.max()) + 1))):
        group_rows = np.flatnonzero(group == number)
        sphere, rows = Sphere(float(places.radius[group_rows[0]])), angles[group_rows]
        rows[:, 0] = rows[0, 0]
        images: ImageSearch = certificate_of(sphere, source.searched.viewer, max_index).images(rows)
        for k, i in enumerate(group_rows.tolist()):
            some = images.images[images.images.star == k]
            moments[i] = SearchedMoment(float(times[i]), some, bool(images.certified[k]))
    return [moments[i] for i in range(len(times))]


def image_curves(source: Source, moments: list[SearchedMoment], max_index: int) -> ImageCurves:
    """The images followed from moment to moment."""
    remarks = [f"the images at t = {m.time:.6g} are not certified" for m in moments if not m.certified]
    ways = _links(source, moments, max_index, remarks)
    pieces, turns = _pieces(source, ways)
    kept = [piece for piece in pieces if piece.index <= max_index]
    return ImageCurves(tuple(_branches(kept)), tuple(turns), tuple(remarks))


Key = tuple[str, int, int]


@dataclass(frozen=True)
class _Link:
    """A curve between images of two moments; their keys: side, number of the moment, number of the image."""

    points: CurvePoints
    start: Key
    stop: Key


def _started(
    source: Source, moments: list[SearchedMoment], gaps: Int[Array, " n"], numbers: Int[Array, " n"], sense: float
) -> list[FollowedCurve]:
    """Curves followed in gaps between moments, from images at the start of a gap, or at its end for negative sense."""
    if not len(gaps):
        return []
    at = gaps if sense > 0 else gaps + 1
    pairs = list(zip(at.tolist(), numbers.tolist(), strict=True))
    sky = np.array([moments[j].images.sky[i] for j, i in pairs])
    second = np.array([moments[j].images.second_arrival[i] for j, i in pairs])
    time = np.array([m.time for m in moments])
    rays = source.arrivals(sky, time[at], second)
    start = CurvePoints.from_rays(rays, time[gaps + 1] - time[gaps], np.full(len(at), sense))
    return follow(source, start, time[gaps], time[gaps + 1])


def _links(source: Source, moments: list[SearchedMoment], max_index: int, remarks: list[str]) -> list[_Link]:
    """All curves between the moments: forward from all images, then backward from those that were not reached."""
    ways: list[_Link] = []
    reached: set[Key] = set()
    stops: list[tuple[int, float]] = []
    for sense in (1.0, -1.0):
        side = "after" if sense > 0 else "before"
        at = range(len(moments) - 1) if sense > 0 else range(1, len(moments))
        starts = [
            (j, i) for j in at for i in range(len(moments[j].images)) if sense > 0 or ("before", j, i) not in reached
        ]
        number = np.array(starts, int).reshape(-1, 2)
        gaps = number[:, 0] - (sense < 0)
        for (j, i), gap, way in zip(
            starts, gaps.tolist(), _started(source, moments, gaps, number[:, 1], sense), strict=True
        ):
            key = (side, j, i)
            if key in reached:
                continue
            reached.add(key)
            index = int(moments[j].images.index[i])
            if not way.landed:
                stops.append((index, float(way.points.time[-1])))
                continue
            last = way.points[-1:]
            middle = (moments[gap].time + moments[gap + 1].time) / 2
            end, end_side = (gap + 1, "before") if last.time[0] > middle else (gap, "after")
            which = moments[end].which(last)
            if which is None and last.index[0] <= max_index:
                remarks.append(
                    f"an image of index {last.index[0]} comes to t = {moments[end].time:.6g}, and is not found there"
                )
            stop = (end_side, end, -1 - len(ways) if which is None else which)
            if which is not None and stop in reached and stop != key:
                remarks.append(f"two images of index {last.index[0]} come to one at t = {moments[end].time:.6g}")
            reached.add(stop)
            ways.append(_Link(way.points, key, stop))
    remarks += _remarks_on_stops(source, stops)
    return ways


def _remarks_on_stops(source: Source, stops: list[tuple[int, float]]) -> list[str]:
    """Remarks on images, by index and emission time, that cannot be followed on."""
    if not stops:
        return []
    theta = source.motion.places(np.array([time for _, time in stops])).angles[:, 0]
    if source.searched.viewer.on_equator and (np.abs(theta - math.pi / 2) < _IN_PLANE).all():
        return [
            "viewer and source lie in the equatorial plane: there the source passes through cusps of caustics, where "
            f"one image becomes three, and images cannot be followed on ({len(stops)} times); incline the viewer by "
            "89.9999 degrees instead of 90"
        ]
    return [f"an image of index {index} cannot be followed on from t = {time:.6g}" for index, time in stops]


@dataclass(frozen=True)
class _BranchPart:
    """A part of a curve between two moments or events, by time; first, last: the image or event at its ends."""

    index: int
    points: CurvePoints
    first: Key
    last: Key
    born: Turn | None
    dies: Turn | None


def _pieces(source: Source, ways: list[_Link]) -> tuple[list[_BranchPart], list[Turn]]:
    """Curves cut at their folds."""
    folds = [
        (w, i)
        for w, way in enumerate(ways)
        for i in np.flatnonzero(way.points.along_time[1:] * way.points.along_time[:-1] < 0).tolist()
    ]
    turns: dict[tuple[int, int], Turn] = {}
    if folds:
        start = ways[0].points[:0].joined(*[ways[w].points[i : i + 1] for w, i in folds])
        stop = ways[0].points[:0].joined(*[ways[w].points[i + 1 : i + 2] for w, i in folds])
        turning, error, sky_error = turning_points(source, start, stop)
        for k, fold in enumerate(folds):
            # Time decreases along the curve before a fold at which images appear.
            creates = bool(start.along_time[k] < 0)
            order = int(max(start.index[k], stop.index[k]))
            turns[fold] = Turn(turning[k : k + 1], order, creates, float(error[k]), float(sky_error[k]))
    pieces: list[_BranchPart] = []
    for w, way in enumerate(ways):
        cuts = [i for v, i in folds if v == w]
        begin, first, here = 0, way.start, None
        for i in [*cuts, None]:
            turn = None if i is None else turns[w, i]
            parts = ([] if here is None else [here.point]) + [way.points[begin : None if i is None else i + 1]]
            parts += [] if turn is None else [turn.point]
            points = parts[0].joined(*parts[1:])
            last = way.stop if i is None else ("event", w, i)
            inner = way.points.index[begin : None if i is None else i + 1]
            pieces.append(_ordered(int(inner[0]), points, (first, last), (here, turn)))
            if i is not None:
                begin, first, here = i + 1, last, turn
    return pieces, list(turns.values())


def _ordered(
    index: int, points: CurvePoints, keys: tuple[Key, Key], turns: tuple[Turn | None, Turn | None]
) -> _BranchPart:
    """A piece with growing time."""
    sense = np.sign(points.time[-1] - points.time[0])
    if sense < 0:
        points, keys, turns = points[::-1], (keys[1], keys[0]), (turns[1], turns[0])
    return _BranchPart(index, _oriented_in_time(points), *keys, *turns)


def _oriented_in_time(points: CurvePoints) -> CurvePoints:
    """The points with directions along growing time; at a fold the sense of its neighbour."""
    sense = np.where(points.along_time < 0, -1.0, 1.0)
    if len(points) > 1:
        for end, beside in ((0, 1), (-1, -2)):
            if abs(points.along_time[end]) < 1e-6 * points.time_per_radian[end]:
                sense[end] = np.sign((points.along[end] * points.along[beside]).sum()) * sense[beside]
    values = vars(points) | {"along": points.along * sense[:, None], "along_time": points.along_time * sense}
    return CurvePoints(**values)


def _branches(pieces: list[_BranchPart]) -> list[Branch]:
    """Pieces joined at the moments between them."""
    by_first = {piece.first[1:]: piece for piece in pieces if piece.first[0] == "after"}
    ends = {piece.last[1:] for piece in pieces if piece.last[0] == "before"}
    branches = []
    for piece in pieces:
        if piece.first[0] == "after" and piece.first[1:] in ends:
            continue
        chain = [piece]
        while chain[-1].last[0] == "before" and chain[-1].last[1:] in by_first:
            chain.append(by_first[chain[-1].last[1:]])
        points = chain[0].points.joined(*[more.points[1:] for more in chain[1:]])
        branches.append(Branch(piece.index, points, chain[0].born, chain[-1].dies))
    return sorted(branches, key=lambda branch: (branch.index, float(branch.points.time[0])))
