"""Links: short pieces of a level curve on the camera sky, between images of a star at two longitudes of its circle.

Images at neighbouring longitudes are linked by their rates; those that are left over, to the events in between.
"""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.lens_map.sky_chart import Chart, chart_difference
from kerrcaustics.level_curves.path_events import PathEvents
from kerrcaustics.numerics.matching import best_matches
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.rows import Rows

Array = np.ndarray
# The nodes at one end of links; what there is of each column of images.
_Ends = Int[Array, " links"]
_Columns = Float[Array, " columns"]

DOUBT = 0.2
"""Misfit of a step to the rates at its ends, in parts of its length, above which it is not trusted."""
# The same misfit for links over a boundary.
_BOUNDARY_DOUBT = 0.05
# The same misfit for links to an event, whose rate is known at one end alone.
_EVENT_DOUBT = 0.4
_IMPOSSIBLE = 1e6
# Differences below so many errors are round-off.
_BLURS = 4.0


@dataclass(frozen=True)
class Nodes(Rows):
    """Points of the level curve, arrays of one length: images of the star, and the events.

    longitude: longitude of the star, radians.
    index: Morse index.
    sky: direction on the sky at rest.
    drift: change of the direction with longitude.
    error: error of the direction, radians.
    event: number of the event, or -1 for an image.
    """

    longitude: Float[Array, " nodes"]
    index: Int[Array, " nodes"]
    sky: Float[Array, "nodes 3"]
    drift: Float[Array, "nodes 3"]
    error: Float[Array, " nodes"]
    event: Int[Array, " nodes"]


@dataclass(frozen=True)
class Links(Rows):
    """Pieces of the level curve between two nodes, left and right in longitude; on the sheet of one index.

    low, width: of the gap between events that the piece lies in; p_0, p_1: its parameter at both ends, see `longitude`.
    Width 0 stands for pieces beside an event, whose parameter is the longitude.
    """

    left: Int[Array, " links"]
    right: Int[Array, " links"]
    index: Int[Array, " links"]
    low: Float[Array, " links"]
    width: Float[Array, " links"]
    p_0: Float[Array, " links"]
    p_1: Float[Array, " links"]

    def longitude(self, p: Float[Array, " links"]) -> Float[Array, " links"]:
        """The star's longitude at a parameter: next to an event it goes with the square, so that images are smooth."""
        return np.where(self.width == 0, p, self.low + self.width * np.sin(p / 2) ** 2)

    def parameter(self, longitude: Float[Array, " links"]) -> Float[Array, " links"]:
        """The inverse of `longitude`."""
        part = (longitude - self.low) / np.where(self.width == 0, 1, self.width)
        return np.where(self.width == 0, longitude, 2 * np.arcsin(np.sqrt(np.clip(part, 0, 1))))

    def rate(self, p: Float[Array, " links"]) -> Float[Array, " links"]:
        """d longitude / d parameter."""
        return np.where(self.width == 0, 1.0, self.width * np.sin(p) / 2)


# Left node, right node, index, low, width, p_0, p_1 of a link.
_Row = tuple[float, ...]


def links_of(rows: list[_Row]) -> Links:
    """Links from their fields, one row each."""
    table = np.array(rows, float).reshape(-1, 7)
    return Links(*(table[:, i].astype(int) for i in range(3)), *table[:, 3:].T)


def plain_cost(
    step: Float[Array, "*batch 3"],
    ahead: Float[Array, "*#batch 3"],
    behind: Float[Array, "*#batch 3"],
    blur: Float[Array, "*#batch"],
) -> Float[Array, "*batch"]:
    """The misfit of steps to the rates at their two ends, a part of their length.

    The part that the errors of the two ends explain (their sum is blur) does not count.
    """
    miss = np.maximum(np.linalg.norm(step - (ahead + behind) / 2, axis=-1) - _BLURS * blur, 0)
    sizes = [np.linalg.norm(v, axis=-1) for v in (step, ahead / 2, behind / 2)]
    return miss / np.maximum(np.maximum(*sizes[1:]), np.maximum(sizes[0], 1e-300))


class Linker:
    """Links the images on the two sides of each boundary between gaps.

    The columns are all images at the two ends of each gap: first those at the lower ends, then those at the upper ones.
    """

    def __init__(
        self,
        chart: Chart,
        events: PathEvents,
        nodes: Nodes,
        members: list[Array],
        p: _Columns,
        longitude: _Columns,
    ) -> None:
        """The first nodes are the events; members, p, longitude: of each column the nodes, and where it lies."""
        self._path_events, self._nodes = events, nodes
        self._members, self._p, self._longitude = members, p, longitude
        self._place = chart.place(nodes.index, nodes.sky)
        self._rate = chart.rate(nodes.index, nodes.sky, nodes.drift)
        self._blur = chart.blur(nodes.index, nodes.sky, nodes.error)
        self._width = events.gap_high - events.gap_low

    def linked(self, boundary: int) -> tuple[list[_Row], bool]:
        """Links over a boundary, whose number is that of the gap above it; and whether they are beyond doubt."""
        path_events = self._path_events
        gaps = len(self._width)
        first, second = gaps + (boundary - 1) % gaps, boundary
        events = np.flatnonzero(path_events.boundary == boundary)
        start, end = self._longitude[first], self._longitude[second]
        frame = (0.0, 0.0, start, end + 2 * np.pi * (end <= start))
        arms = [arm for event in events.tolist() for arm in self._arms(event, first, second)]
        rows: list[_Row] = []
        settled = True
        for k in np.flatnonzero(~path_events.ring[boundary]).tolist():
            # Arms of events are left ends where they lead right, and the other way round.
            lefts, rights = (
                np.concatenate(
                    [self._members_with(column, k), [event for event, index, s in arms if index == k and s == side]]
                )
                for column, side in ((first, 1), (second, -1))
            )
            if len(lefts) != len(rights):
                settled = False
                continue
            matches, sure = self._matched(k, lefts.astype(int), rights.astype(int), first, second, frame)
            rows += matches
            settled &= sure
        return rows, settled

    def _members_with(self, column: int, index: int) -> Int[Array, " members"]:
        members = self._members[column]
        return members[self._nodes.index[members] == index]

    def _matched(
        self, k: int, lefts: _Ends, rights: _Ends, first: int, second: int, frame: tuple[float, ...]
    ) -> tuple[list[_Row], bool]:
        """Links on sheet k between left and right nodes."""
        cost = np.full((len(lefts), len(rights)), _IMPOSSIBLE)
        for i, a in enumerate(lefts.tolist()):
            for j, b in enumerate(rights.tolist()):
                from_event, to_event = self._nodes.event[[a, b]] >= 0
                if from_event != to_event:
                    image, event, column = (b, a, second) if from_event else (a, b, first)
                    cost[i, j] = self._event_cost(k, image, event, column)
        image_left, image_right = (self._nodes.event[n] < 0 for n in (lefts, rights))
        plain = self._plain_costs(k, lefts[image_left], rights[image_right], frame)
        cost[np.ix_(image_left, image_right)] = plain
        fits = cost < np.where(image_left[:, None] & image_right, _BOUNDARY_DOUBT, _EVENT_DOUBT)
        rows: list[_Row] = []
        chosen = best_matches(cost)
        for i, j in zip(*chosen, strict=True):
            a, b = int(lefts[i]), int(rights[j])
            beside_event = not (image_left[i] and image_right[j])
            rows.append((a, b, k, *(self._event_frame(a, first, second) if beside_event else frame)))
        return rows, _unique(fits[np.ix_(*chosen)], lefts[chosen[0]], rights[chosen[1]])

    def _event_frame(self, left: int, first: int, second: int) -> tuple[float, ...]:
        """The frame of a link to an event: in the gap of its image, and reaching to the end of that."""
        from_event = self._nodes.event[left] >= 0
        column = second if from_event else first
        gap, p = column % len(self._width), float(self._p[column])
        ends = (0.0, p) if from_event else (p, np.pi)
        return float(self._path_events.gap_low[gap]), float(self._width[gap]), *ends

    def _plain_costs(
        self, k: int, lefts: Int[Array, " lefts"], rights: Int[Array, " rights"], frame: tuple[float, ...]
    ) -> Float[Array, "lefts rights"]:
        """The misfit of the rates of images to the way between them."""
        length = frame[3] - frame[2]
        ahead, behind = self._rate[lefts][:, None] * length, self._rate[rights][None] * length
        step = chart_difference(np.array(k), self._place[lefts][:, None], self._place[rights][None])
        return plain_cost(step, ahead, behind, self._blur[lefts][:, None] + self._blur[rights])

    def _event_cost(self, k: int, image: int, event: int, column: int) -> float:
        """The misfit of the rate of an image to the way to an event in sqrt(longitude), or in longitude at a cusp."""
        gap, p = column % len(self._width), self._p[column]
        place = self._nodes.sky[event] if k == 0 else self._place[event]
        step = chart_difference(np.array(k), self._place[image], place)
        # Toward the nearer end of the gap.
        way = np.pi - p if p > np.pi / 2 else -p
        onward = self._rate[image] * self._width[gap] * np.sin(p) / 2 * way
        miss = np.linalg.norm(step - onward)
        if self._path_events.at_cusp[self._nodes.event[event]]:
            miss = min(miss, np.linalg.norm(step - onward / 2))
        miss = max(miss - _BLURS * self._blur[image], 0)
        return float(miss / max(np.linalg.norm(step), np.linalg.norm(onward), 1e-300))

    def _arms(self, event: int, first: int, second: int) -> list[tuple[int, int, int]]:
        """The arms (event, index, side) of the level curve at an event between two columns."""
        path_events = self._path_events
        order, side = int(path_events.order[event]), int(path_events.side[event])
        arms = [(event, order - 1, side), (event, order, side)]
        if path_events.at_cusp[event]:
            # The third image comes from the other side, and its index is that of the two that leave it.
            outside = second if side < 0 else first
            costs = [
                (self._event_cost(k, image, event, outside), k)
                for k in (order - 1, order)
                for image in self._members_with(outside, k).tolist()
            ]
            # Of an index that is not looked at, where no image fits.
            cost, third = min(costs, default=(np.inf, order))
            third = third if cost < _EVENT_DOUBT or order < path_events.counts.shape[1] else order
            arms += [(event, third, side), (event, third, -side)]
        return arms


def _unique(fits: Bool[Array, "links links"], lefts: _Ends, rights: _Ends) -> bool:
    """True where link i, from left node i to right node i, fits for every i, and no two could as well be exchanged."""
    different = (lefts[:, None] != lefts) & (rights[:, None] != rights)
    return bool(fits.diagonal().all() and not (fits & fits.T & different).any())
