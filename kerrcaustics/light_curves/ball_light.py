"""The light of a ball: smooth images by their limb, others and those at pair events by slices."""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.light_curves.arrivals import Source
from kerrcaustics.light_curves.ball_passes import RayAims, axes_at
from kerrcaustics.light_curves.balls import MovingBall, SlicedImage
from kerrcaustics.light_curves.image_curves import ImageCurves
from kerrcaustics.light_curves.seen_images import SeenImages
from kerrcaustics.light_curves.smooth_light import smooth_light
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.sphere import lengths

Array = np.ndarray

# Distance of the middle from a fold, in radii of the ball, up to which the ball may reach it: more than 1 by errors.
_OUTSIDE = 1.1
# Distance of tips, over the length of the spine, below which two spines are the same.
_SAME = 1e-2
# Error of the light of images that cannot be measured, over that of a point.
_ROUGHLY = 0.3


@dataclass(frozen=True)
class BallShares:
    """Light of a ball by branch and time.

    flux: Flux.
    error: Error of the flux.
    sky: Mean direction on the search sky.
    remarks: One for each doubt.
    """

    flux: Float[Array, "branches times"]
    error: Float[Array, "branches times"]
    sky: Float[Array, "branches times 3"]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _Part:
    """A part of the image that is sliced at a time, next to an image of a branch or to a fold.

    turn: whose axes it takes; point: the light of the image as a point.
    """

    time: int
    branches: tuple[int, ...]
    sky: Float[Array, " 3"]
    emitted: float
    second: bool
    turn: int | None
    point: float


def ball_shares(
    ball: MovingBall,
    curves: ImageCurves,
    times: Float[Array, " t"],
    branch_times: list[Array],
    point_images: list[SeenImages],
) -> BallShares:
    """The light of a ball; branch_times: numbers of the times at which the point image of each branch exists."""
    shape = len(curves.branches), len(times)
    flux, error, sky = np.zeros(shape), np.zeros(shape), np.full((*shape, 3), np.nan)
    parts: list[_Part] = []
    turns = {turn: k for k, turn in enumerate(curves.turns)}
    for k, (branch, which, images) in enumerate(zip(curves.branches, branch_times, point_images, strict=True)):
        if not len(which):
            continue
        aims = _aims(ball.source, images.sky, images.emitted, times[which], images.second)
        light, off, smooth = smooth_light(ball, aims)
        flux[k, which[smooth]], error[k, which[smooth]] = light[smooth], off[smooth] + images.error[smooth]
        sky[k, which] = images.sky
        ends = [turn for turn in (branch.born, branch.dies) if turn is not None]
        for i in np.flatnonzero(~smooth).tolist():
            near = min(ends, key=lambda turn: abs(float(turn.point.arrival[0]) - times[which[i]]), default=None)
            parts.append(
                _Part(
                    int(which[i]),
                    (k,),
                    images.sky[i],
                    float(images.emitted[i]),
                    bool(images.second[i]),
                    None if near is None else turns[near],
                    float(images.flux[i]),
                )
            )
    folds = None
    if curves.turns:
        points = curves.turns[0].point.joined(*(turn.point for turn in curves.turns[1:]))
        folds = _aims(ball.source, points.sky, points.time, points.arrival, points.second)
        parts += _parts_beside_events(ball, curves, times, np.abs(ball.passes(folds).by_time[:, 1] / points.rate))
    return _with_parts(ball, curves, times, parts, (flux, error, sky), folds)


def _aims(source: Source, sky: Array, emitted: Array, arrival: Array, second: Array) -> RayAims:
    return RayAims(sky, emitted, arrival, second, axes_at(source.arrivals(sky, emitted, second)))


def _parts_beside_events(
    ball: MovingBall, curves: ImageCurves, times: Float[Array, " t"], speeds: Float[Array, " turns"]
) -> list[_Part]:
    """Folds that the ball covers while its middle is outside: before a creation, after an annihilation.

    speeds: of the ball across each, by the viewer's time.
    """
    parts = []
    for k, (turn, speed) in enumerate(zip(curves.turns, speeds.tolist(), strict=True)):
        point = turn.point
        branches = tuple(b for b, branch in enumerate(curves.branches) if turn in (branch.born, branch.dies))
        delay = times - float(point.arrival[0])
        outside = delay < 0 if turn.creates else delay > 0
        for i in np.flatnonzero(outside & (np.abs(delay) * speed < _OUTSIDE * ball.size)).tolist():
            emitted = float(point.time[0] + delay[i] / point.rate[0])
            parts.append(_Part(i, branches, point.sky[0], emitted, bool(point.second[0]), k, 0.0))
    return parts


def _with_parts(
    ball: MovingBall,
    curves: ImageCurves,
    times: Float[Array, " t"],
    parts: list[_Part],
    shares: tuple[Array, Array, Array],
    folds: RayAims | None,
) -> BallShares:
    """The shares with those of sliced parts: parts that are the same count once, half for each branch.

    folds: next to which parts take the axes of these.
    """
    flux, error, sky = shares
    remarks: list[str] = []
    if parts:
        arrival = times[[part.time for part in parts]]
        places = np.array([part.sky for part in parts])
        emitted, second = np.array([part.emitted for part in parts]), np.array([part.second for part in parts])
        aims = _aims(ball.source, places, emitted, arrival, second)
        for i, turn in enumerate(_common_turns(curves, times, parts)):
            if turn is not None and folds is not None:
                aims.axes[i] = folds.axes[turn]
        images = ball.sliced_light(aims)
        # The light changes over the size of the ball.
        known = ball.source.motion.errors(emitted).place * ball.source.motion.places(emitted).radius / ball.size
        rough = 0
        for group in _groups(parts, images):
            image, part = images[group[0]], parts[group[0]]
            branches = sorted({branch for i in group for branch in parts[i].branches})
            if image is None:
                rough += part.point > 0
                flux[part.branches[0], part.time] += part.point
                error[part.branches[0], part.time] += _ROUGHLY * part.point
            elif image.flux > 0:
                for branch in branches:
                    flux[branch, part.time] += image.flux / len(branches)
                    error[branch, part.time] += (image.error + known[group[0]] * image.flux) / len(branches)
                    sky[branch, part.time] = image.sky
        if rough:
            remarks.append(f"{rough} images of the ball are known roughly")
    return BallShares(flux, error, sky, tuple(remarks))


def _common_turns(curves: ImageCurves, times: Float[Array, " t"], parts: list[_Part]) -> list[int | None]:
    """The turn whose axes each part takes: of parts of one time that share branches by turns, the nearest in time."""
    ends = [{k for k, turn in enumerate(curves.turns) if turn in (b.born, b.dies)} for b in curves.branches]
    chosen: list[int | None] = [part.turn for part in parts]
    by_time: dict[int, list[int]] = {}
    for i, part in enumerate(parts):
        by_time.setdefault(part.time, []).append(i)
    for time, members in by_time.items():
        away = {k: abs(float(turn.point.arrival[0]) - times[time]) for k, turn in enumerate(curves.turns)}
        for _ in members:
            for i in members:
                for j in members:
                    first, second = chosen[i], chosen[j]
                    linked = any(
                        first in ends[b] and second in ends[b] for b in (*parts[i].branches, *parts[j].branches)
                    )
                    if first is not None and second is not None and linked and away[second] < away[first]:
                        chosen[i] = second
    return chosen


def _groups(parts: list[_Part], images: list[SlicedImage | None]) -> list[list[int]]:
    """Parts of one time whose spines have the same tips."""
    groups: list[list[int]] = []
    for i, (part, image) in enumerate(zip(parts, images, strict=True)):
        for group in groups:
            member = images[group[0]]
            if parts[group[0]].time == part.time and image is not None and member is not None:
                length = max(lengths(np.diff(image.tips, axis=0))[0], 1e-300)
                apart = min(float(lengths(image.tips - tips).max()) for tips in (member.tips, member.tips[::-1]))
                if apart < _SAME * length:
                    group.append(i)
                    break
        else:
            groups.append([i])
    return groups
