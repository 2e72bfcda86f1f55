"""A level curve on the camera sky, as short links between images of a star at neighbouring longitudes of its circle.

On a sheet the sky map has no fold: as the star's longitude grows, an image moves along a smooth branch, which ends only
where a caustic is crossed. So all images are searched for once in each gap between events, and followed from there to
both ends of the gap, in steps that their rates bear out. There they are linked to those of the next gap, and to the
events (links.py). Links that are too long for the eye are halved.
"""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from kerrcaustics.images.search import search
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.lens_map.sky_chart import Chart, chart_difference
from kerrcaustics.level_curves.links import DOUBT, Linker, Links, Nodes, links_of, plain_cost
from kerrcaustics.level_curves.path_events import STILL, path_events
from kerrcaustics.numerics.parts import inner_parts
from kerrcaustics.results.progress import report
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.cubic_curves import Cubics
from kerrcaustics.spacetime.frame import Frame
from kerrcaustics.spacetime.sphere import angle_between, flattened
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
# Of images, one entry each.
_Numbers = Int[Array, " images"]
_Reals = Float[Array, " images"]
_Directions = Float[Array, "images 3"]

# First step along a branch, in the parameter of a gap (0 to pi).
_FIRST_STEP = 0.2
# Longest step along a branch, in the same parameter.
_LONGEST_STEP = 0.5
# Shortest step along a branch, in the same parameter.
_SHORTEST_STEP = 1e-12
# Factor by which a step grows after a good one.
_GROWTH = 1.5
# Most rounds of steps, all branches at once.
_MOST_STEPS = 200
# How close to the ends of its gap a branch is followed at first, and how often that is halved where links are in doubt.
_REACH, _REACH_HALVINGS = 0.15, 16
# A link shorter than this, in the coordinates of the chart, is not judged.
_SHORT = 1e-8
# Newton steps to an image from a good guess, and from a bad one.
_FEW_STEPS, _MANY_STEPS = 8, 80
# Longest step of a track on either sphere, and in longitude; rounds of dividing, and most parts in each.
_LONGEST, _LONGEST_TURN = np.radians(2.0), np.radians(10.0)
_MOST_DIVISIONS, _MOST_PARTS = 12, 12
# Depth from which images of index 0 run along the shadow edge, too.
_CLOSE = 0.3


class Branches:
    """All branches of the level curve of one star.

    nodes, links: the curve; remarks: what is in doubt.
    """

    def __init__(self, sheets: Sheets, camera: Viewer, circle: Circle, longest: float = _LONGEST) -> None:
        """Search, link, and halve the links until they look smooth on the sky of `camera`.

        longest: step on either sphere, radians.
        """
        report("images followed along the circle", 0.5)
        self.sheets, self.circle, self.events = sheets, circle, path_events(sheets, circle)
        self.chart = Chart(sheets.camera)
        self.remarks: list[str] = []
        self.nodes = self._events()
        if self.still:
            self.links = links_of([])
            self._search_gaps()
        else:
            self.links = self._grown()
            report("smaller steps along the images", 0.8)
            self._refine(camera.frame(), longest)

    @property
    def still(self) -> bool:
        """True for a star on the axis: its images do not move."""
        return math.sin(self.circle.angle) < STILL

    @cached_property
    def link_cubics(self) -> Cubics:
        """The cubic curves of all links."""
        return self.cubics(self.links)

    def cubics(self, links: Links) -> Cubics:
        """The cubic curves of links."""
        nodes, chart = self.nodes, self.chart
        kind = self.kinds(links)
        start, end = (chart.place(kind, nodes.sky[i]) for i in (links.left, links.right))
        step = chart_difference(kind, start, end)
        rates = []
        for i, p in ((links.left, links.p_0), (links.right, links.p_1)):
            scale = links.rate(p) * (links.p_1 - links.p_0)
            rates.append(chart.rate(kind, nodes.sky[i], nodes.drift[i]) * scale[:, None])
        # At an event the longitude stands still and the drift is infinite: a parabola gives their product.
        from_event, to_event = ((nodes.event[i] >= 0)[:, None] for i in (links.left, links.right))
        rate_0 = np.where(from_event, 2 * step - rates[1], rates[0])
        rate_1 = np.where(to_event, 2 * step - rates[0], rates[1])
        return Cubics(start, step, rate_0, rate_1)

    def kinds(self, links: Links) -> Int[Array, " links"]:
        """The coordinates of cubic curves, as an index for the chart: those of index 1 where both ends are close by."""
        ones = np.ones(len(links.index), int)
        close = [self.chart.place(ones, self.nodes.sky[i])[:, 1] > _CLOSE for i in (links.left, links.right)]
        return np.where(close[0] & close[1], np.maximum(links.index, 1), links.index)

    def _events(self) -> Nodes:
        events = self.events
        sky = self.sheets.sky(events.points.line_of_sight)
        return Nodes(events.longitude, events.order, sky, np.zeros_like(sky), np.zeros(len(sky)), np.arange(len(sky)))

    def _images(self, longitude: _Reals, index: _Numbers, sky: _Directions, error: _Reals) -> Nodes:
        beams = self.sheets.map.beams_of_sky(sky)
        east = math.sin(self.circle.angle) * self.circle.upward_and_east(beams.direction)[1]
        drift = beams.pulled_back(sky, flattened(beams.direction, east))
        return Nodes(longitude, index, sky, drift, error, np.full(len(sky), -1))

    def _roots(self, longitude: _Reals, index: _Numbers, guess: _Directions, steps: int) -> tuple[Array, Array, Array]:
        """Images of the star at some longitudes, from guesses, as `find_roots` returns them."""
        place = self.circle.place(longitude)
        return find_roots(self.sheets.camera, place, index, guess, steps, end=self.sheets.surface)

    def _search_gaps(self) -> tuple[_Numbers, _Numbers]:
        """Search for the images in the middle of each gap. Their nodes, and the gap of each."""
        events = self.events
        longitude = (events.gap_low + events.gap_high) / 2
        searched = search(self.sheets, self.circle.place(longitude))
        images = searched.images
        missed = ~searched.certified | (searched.counts != events.counts).any(axis=1)
        if missed.any():
            self.remarks.append(
                f"the images in {missed.sum()} of {len(missed)} spells between events are not certified"
            )
        return self._added(longitude[images.star], images.index, images.sky, images.error), images.star

    def _added(self, longitude: _Reals, index: _Numbers, sky: _Directions, error: _Reals) -> _Numbers:
        """New nodes: their numbers."""
        first = len(self.nodes.event)
        self.nodes = self.nodes.joined(self._images(longitude, index, sky, error))
        return first + np.arange(len(longitude))

    def _grown(self) -> Links:
        """Links along all branches, and over all boundaries between gaps."""
        events = self.events
        gaps, whole = len(events.gap_low), events.none
        # Without events the parameter is the longitude.
        low, width = (np.zeros(1), np.zeros(1)) if whole else (events.gap_low, events.gap_high - events.gap_low)
        full = 2 * np.pi if whole else np.pi
        middle, gap = self._search_gaps()
        tips, sides = np.tile(middle, 2), np.repeat([0, 1], len(middle))
        column = np.tile(gap, 2) + gaps * sides
        p = np.full(len(tips), full / 2)
        reach = np.full(gaps, _REACH)
        ends = np.empty(0)
        self.links = links_of([])
        doubtful = np.arange(gaps)
        rows: dict[int, list[tuple[float, ...]]] = {}
        for _ in range(_REACH_HALVINGS):
            ends = np.concatenate([reach, full - reach]) if whole else _ends(width, reach)
            tips, p = self._follow(tips, p, low[column % gaps], width[column % gaps], ends[column])
            members = [tips[column == i] for i in range(2 * gaps)]
            longitude = np.tile(low, 2) + np.tile(width, 2) * np.sin(ends / 2) ** 2 if not whole else ends
            linker = Linker(self.chart, events, self.nodes, members, ends, longitude)
            settled = []
            for i in doubtful.tolist():
                rows[i], sure = linker.linked(i)
                if sure:
                    settled.append(i)
            doubtful = np.setdiff1d(doubtful, settled)
            if len(doubtful) == 0:
                break
            reach[doubtful] /= 2
        # What becomes part of a ring is followed to the end of its gap.
        boundary, to_end = (column + sides) % gaps, np.pi * sides
        goal = np.where(events.ring[boundary, self.nodes.index[tips]], to_end, ends[column])
        p = self._follow(tips, p, low[column % gaps], width[column % gaps], goal)[1]
        if (p != goal).any():
            self.remarks.append(f"{(p != goal).sum()} images could not be followed to the next event")
        if len(doubtful):
            self.remarks.append(f"which images go on where is in doubt at {len(doubtful)} events")
        return self.links.joined(links_of([row for i in rows for row in rows[i]]))

    def _follow(self, tips: _Numbers, p: _Reals, low: _Reals, width: _Reals, ends: _Reals) -> tuple[_Numbers, _Reals]:
        """Follow branches from their tips at parameters p to the given ends; the new tips, and where they are."""
        tips, p = tips.copy(), p.copy()
        step = np.full(len(tips), _FIRST_STEP)
        for _ in range(_MOST_STEPS):
            active = np.flatnonzero((p != ends) & (step > _SHORTEST_STEP))
            if active.size == 0:
                break
            way = ends[active] - p[active]
            part = np.minimum(step[active] / np.abs(way), 1)
            target = np.where(part == 1, ends[active], p[active] + part * way)
            index = self.nodes.index[tips[active]]
            trial = Links(tips[active], tips[active], index, low[active], width[active], p[active], target)
            which, new = self._onward(trial)
            step[active] /= 2
            good = active[which]
            step[good] = np.minimum(2 * _GROWTH * step[good], _LONGEST_STEP)
            self._record(trial[which], new)
            tips[good], p[good] = new, target[which]
        return tips, p

    def _onward(self, trial: Links) -> tuple[_Numbers, _Numbers]:
        """Images a step further on: which of the trials hold, and their nodes."""
        nodes, index = self.nodes, trial.index
        place = self.chart.place(index, nodes.sky[trial.left])
        rate = self.chart.rate(index, nodes.sky[trial.left], nodes.drift[trial.left])
        way = (trial.p_1 - trial.p_0)[:, None]
        ahead = rate * trial.rate(trial.p_0)[:, None] * way
        longitude = trial.longitude(trial.p_1)
        guess = self.chart.sky(index, place + ahead)
        which, sky, error = self._roots(longitude, index, guess, _FEW_STEPS)
        images = self._images(longitude[which], index[which], sky, error)
        rate = self.chart.rate(index[which], images.sky, images.drift)
        behind = rate * (trial.rate(trial.p_1)[:, None] * way)[which]
        step = chart_difference(index[which], place[which], self.chart.place(index[which], images.sky))
        blur = self._blurs()[trial.left[which]] + self.chart.blur(index[which], images.sky, images.error)
        good = plain_cost(step, ahead[which], behind, blur) < DOUBT
        new = self._added(*(v[good] for v in (longitude[which], index[which], sky, error)))
        return which[good], new

    def _record(self, steps: Links, new: Int[Array, " steps"]) -> None:
        """Keep steps to new nodes as links, left end first."""
        back = steps.p_1 < steps.p_0
        left, right = np.where(back, new, steps.left), np.where(back, steps.left, new)
        p_0, p_1 = np.minimum(steps.p_0, steps.p_1), np.maximum(steps.p_0, steps.p_1)
        self.links = self.links.joined(replace(steps, left=left, right=right, p_0=p_0, p_1=p_1))

    def _refine(self, moving: Frame, longest: float) -> None:
        """Divide links that are longer than some angle, or in doubt."""
        tries = np.zeros(len(self.links.left), int)
        for _ in range(_MOST_DIVISIONS):
            parts = np.minimum(self._parts(moving, longest), np.array([_MOST_PARTS, 2, 1])[np.minimum(tries, 2)])
            if (parts == 1).all():
                break
            divided, pieces = self._divided(parts, _MANY_STEPS if (tries[parts > 1] > 0).any() else _FEW_STEPS)
            self.links = self.links[~divided].joined(pieces)
            tries = np.concatenate([(tries + (parts > 1))[~divided], np.zeros(len(pieces.left), int)])
        doubtful = self._costs() > DOUBT
        if doubtful.any():
            self.remarks.append(f"{doubtful.sum()} steps along tracks are in doubt")

    def _costs(self) -> Float[Array, " links"]:
        """The misfit of links to the rates at their ends."""
        curves = self.cubics(self.links)
        blur = self._blurs()
        cost = plain_cost(curves.step, curves.rate_0, curves.rate_1, blur[self.links.left] + blur[self.links.right])
        # The shortest ones are round-off.
        return np.where(np.linalg.norm(curves.step, axis=1) < _SHORT, 0, cost)

    def _blurs(self) -> Float[Array, " nodes"]:
        """Errors of the nodes' coordinates."""
        return self.chart.blur(self.nodes.index, self.nodes.sky, self.nodes.error)

    def _divided(self, parts: Int[Array, " links"], steps: int) -> tuple[Bool[Array, " links"], Links]:
        """Divide links into parts: which were, and their pieces. A link of which some part is not found stays.

        The images in between start from the cubic curve, and take so many Newton steps at most.
        """
        # One entry for every new node: which link, and how far along it.
        which, part = inner_parts(parts)
        links = self.links[which]
        p = links.p_0 + part * (links.p_1 - links.p_0)
        longitude = links.longitude(p)
        start = self.chart.sky(self.kinds(links), self.cubics(links).points(part))
        converged, sky, error = self._roots(longitude, links.index, start, steps)
        divided = (parts > 1) & (np.bincount(which[converged], minlength=len(parts)) == parts - 1)
        chosen = divided[which[converged]]
        kept = converged[chosen]
        new = self._added(longitude[kept], links.index[kept], sky[chosen], error[chosen])
        old, olds = self.links[divided], np.flatnonzero(divided)
        # In the order of the link, then along it: every piece begins where the one before ends.
        first = np.lexsort((np.append(old.p_0, p[kept]), np.append(olds, which[kept])))
        last = np.lexsort((np.append(p[kept], old.p_1), np.append(which[kept], olds)))
        pieces = replace(
            self.links[np.append(olds, which[kept])[first]],
            left=np.append(old.left, new)[first],
            right=np.append(new, old.right)[last],
            p_0=np.append(old.p_0, p[kept])[first],
            p_1=np.append(p[kept], old.p_1)[last],
        )
        return divided, pieces

    def _parts(self, moving: Frame, allowed: float) -> Int[Array, " links"]:
        """The number of parts into which each link should be divided."""
        links, nodes = self.links, self.nodes
        sky = as_seen(nodes.sky, self.sheets.frame, moving)
        turn = np.abs(links.longitude(links.p_1) - links.longitude(links.p_0))
        step = angle_between(sky[links.left], sky[links.right])
        longest = np.maximum.reduce([step, turn * math.sin(self.circle.angle), turn * _LONGEST / _LONGEST_TURN])
        return np.maximum(np.ceil(longest / allowed), 1 + (self._costs() > DOUBT)).astype(int)


def _ends(width: Float[Array, " gaps"], reach: Float[Array, " gaps"]) -> Float[Array, " columns"]:
    """Parameters next to the lower, then the upper ends of gaps, equally far in longitude on both sides of a boundary.

    reach: of each boundary, the parameter in the narrower of its two gaps.
    """
    span = np.minimum(width, np.roll(width, 1)) * np.sin(reach / 2) ** 2
    above, below = (2 * np.arcsin(np.sqrt(part)) for part in (span / width, np.roll(span, -1) / width))
    return np.concatenate([above, np.pi - below])
