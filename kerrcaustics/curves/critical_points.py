"""Points of critical curves, refined to round-off on the lines of sky_lines.py.

The Morse index brackets a curve, the signed minor diameter pins it down: on a line, the curve of order k lies
where the index grows from k - 1 to k, and there delta_minus passes through zero.
"""

from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import End
from kerrcaustics.beams.ray_state import LEAST_K
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.frame import Photon, photon_of, sky_from_fido
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import polar_basis

Array = np.ndarray

# Spacing in depth of the first search along a line, and how far down it goes at once for each order.
_SEARCH_STEP = 0.5
_SEARCH_DEPTH = 3.5
# The bracketing search needs the topology, not the digits.
_COARSE_TOLERANCE = 1e-6
_COARSE_DEPTH = 1e-6
# Places at which a bracket is looked at, all at once: a part of it is then so short that few steps are left.
_SECTIONS = 9
# Steps to the root of a parabola, on the full beams: differences in depth, and what is added to them for e-foldings of
# the round-off of a direction; the longest step, most steps, and what an error may be that is left.
_DIFFERENCE, _DEEP_DIFFERENCE = 1e-5, 1e-11
_LONGEST_STEP = 0.2
_MOST_STEPS = 7
_LEFT = 1e-15
# Depths that differ by this part of the differences are one.
_SAME = 1e-5
# |delta_minus| / delta_plus of a point that is taken as found.
_RESIDUAL = 1e-10
# Stands for the index of a captured direction: more than any order.
_CAPTURED = 1 << 20
LABEL_STEP = 1e-3
"""Distance in depth at which the index on both sides of a curve is looked at."""


@dataclass(frozen=True)
class Points(Rows):
    """Points near critical curves.

    edge_phase: line across the shadow edge, radians.
    depth: place on that line.
    line_of_sight: FIDO components.
    direction: n' on the celestial sphere.
    theta: polar angle of n', radians.
    azimuth: azimuth of n', radians, joined over b = 0 (see `joined_azimuth`).
    major: unit vector along the image's major axis, of arbitrary sign.
    ratio: delta_minus / delta_plus.
    error: error of the direction, radians.
    """

    edge_phase: Float[Array, " points"]
    depth: Float[Array, " points"]
    line_of_sight: Float[Array, "points 3"]
    direction: Float[Array, "points 3"]
    theta: Float[Array, " points"]
    azimuth: Float[Array, " points"]
    major: Float[Array, "points 3"]
    ratio: Float[Array, " points"]
    error: Float[Array, " points"]

    @property
    def angle_error(self) -> Float[Array, " points"]:
        """Error of (theta, azimuth) in radians: close to the spin axis the azimuth is less certain than n'."""
        return self.error / np.maximum(np.sin(self.theta), self.error)

    def on_curve(self) -> Bool[Array, " points"]:
        """True where the minor diameter has vanished; False also where the beam is captured."""
        return np.abs(self.ratio) < _RESIDUAL

    def each(self) -> list["Points"]:
        """The points one by one."""
        return [self[i : i + 1] for i in range(len(self))]

    def shifted(self, turns: int) -> "Points":
        """The same points, with parameters that are whole turns larger."""
        return replace(self, edge_phase=self.edge_phase + 2 * np.pi * turns)

    def in_coordinates_of(self, surface: End) -> "Points":
        """The same points in the coordinates of a surface."""
        theta, azimuth = surface.angles(self.direction, self.azimuth)
        return replace(self, theta=theta, azimuth=azimuth)

    def mirrored(self) -> "Points":
        """The points reflected in the equatorial plane, phase -> 2 pi - phase, in the order of `edge_phase`."""
        flip = np.array([1.0, 1.0, -1.0])
        image = replace(
            self,
            edge_phase=2 * np.pi - self.edge_phase,
            line_of_sight=self.line_of_sight * np.array([1.0, -1.0, 1.0]),
            direction=self.direction * flip,
            theta=np.pi - self.theta,
            major=self.major * flip,
        )
        return image[::-1]


class Search:
    """Traces beams for the search on one map, and counts them."""

    def __init__(self, search_map: SearchMap) -> None:
        """Search on the map, which is one of a sphere."""
        self.map, self.domain, self.camera = search_map, search_map.leaves, search_map.camera
        self.engines_used: set[str] = set()
        self.beams_traced = 0
        self._frame = self.camera.frame()
        self._straight = self.camera.straight_ahead

    def index_and_ratio(
        self, edge_phase: Float[Array, "*#points"], depth: Float[Array, "*#points"]
    ) -> tuple[Int[Array, "*points"], Float[Array, "*points"]]:
        """Morse index (a large number where captured) and delta_minus / delta_plus at (edge phase, depth), broadcast.

        Beams that leave close to the principal null directions turn through less than half a circle and meet no
        conjugate point: they are not traced, and their ratio is given as 1. The same holds for those that never come
        down again to the camera's own radius, and for those far out on a screen.
        """
        line_of_sight, second_arrival = self.domain.line_of_sight(edge_phase, depth)
        index, ratio = np.zeros(line_of_sight.shape[:-1], int), np.ones(line_of_sight.shape[:-1])
        photon = self._photon(line_of_sight)
        bent = (photon.k >= LEAST_K) & (1 - line_of_sight[..., 0] > self._straight)
        if self.domain.level:
            bent &= photon.rate[0] > 0
        beams = self._trace(line_of_sight[bent], second_arrival[bent], _COARSE_TOLERANCE)
        captured = ~beams.escaped
        index[bent] = np.where(captured, _CAPTURED, np.asarray(beams.index))
        ratio[bent] = np.where(captured, -1.0, beams.delta_minus / beams.delta_plus)
        return index, ratio

    def points(
        self, edge_phase: Float[Array, " points"], depth: Float[Array, " points"], order: Int[Array, " points"]
    ) -> Points:
        """All numbers of beams at (edge phase, depth) that are taken to lie on the curve of the given order."""
        line_of_sight, second_arrival = self.domain.line_of_sight(edge_phase, depth)
        beams = self._trace(line_of_sight, second_arrival)
        e_theta, e_phi = polar_basis(beams.direction)
        angle = beams.position_angle[..., None]
        azimuth = joined_azimuth(beams.azimuth, self._photon(line_of_sight).b, order)
        theta, azimuth = self.map.surface.angles(beams.direction, azimuth)
        return Points(
            edge_phase=edge_phase,
            depth=depth,
            line_of_sight=line_of_sight,
            direction=beams.direction,
            theta=theta,
            azimuth=azimuth,
            major=np.cos(angle) * e_theta + np.sin(angle) * e_phi,
            ratio=beams.delta_minus / beams.delta_plus,
            error=beams.error,
        )

    def brackets(
        self, edge_phase: Float[Array, " lines"], orders: int
    ) -> tuple[Float[Array, "orders lines"], Float[Array, "orders lines"], dict[int, list[str]]]:
        """Depths above and below the curves of order 1 .. orders on each line, and remarks by order.

        The search goes down the lines by itself until every curve has been passed. NaN for a curve that was not.
        """
        depth = np.arange(0, _SEARCH_DEPTH * orders, _SEARCH_STEP)
        index = np.empty((0, len(edge_phase)), int)
        depths = np.empty(0)
        while True:
            node_index, _ = self.index_and_ratio(edge_phase, depth[:, None])
            index, depths = np.concatenate([index, node_index]), np.concatenate([depths, depth])
            passed = (index >= orders).all(axis=1)
            if passed.any() or depths[-1] >= sky_lines.DEEPEST + self.domain.sunk:
                break
            depth = depths[-1] + np.arange(1, 5) * _SEARCH_STEP
        if passed.any():
            index = index[: passed.argmax() + 1]
        low, high = np.full((2, orders, len(edge_phase)), np.nan)
        for k in range(1, orders + 1):
            passed = (index >= k) & (index < _CAPTURED)
            first = passed.argmax(axis=0)
            known = passed.any(axis=0) & (first > 0)
            low[k - 1, known] = depths[first[known] - 1]
            high[k - 1, known] = depths[first[known]]
        return low, high, _islands(index, orders)

    def refined(
        self,
        edge_phase: Float[Array, " lines"],
        order: Int[Array, " lines"],
        low: Float[Array, " lines"],
        high: Float[Array, " lines"],
    ) -> tuple[Points, Bool[Array, " lines"]]:
        """Points on the curves of the given orders, one on each line, between depths low and high.

        Brackets are first narrowed on coarse beams, all at once; then come steps on beams at the full tolerance, and a
        bracketing root-finder where these lead nowhere. Returns the points whose bracket held a root, and which of the
        requested ones they are.
        """
        depth, reach = self._narrowed(edge_phase, order, low, high)
        points = self.polished(edge_phase, order, depth)
        away = np.abs(points.depth - depth)
        converged = points.on_curve() & (away < reach)
        moved = np.flatnonzero(converged & (away > LABEL_STEP))
        converged[moved] = self.labelled(edge_phase[moved], points.depth[moved], order[moved])
        points, lost = points[converged], np.flatnonzero(~converged)
        if lost.size == 0:
            return points, converged
        bracket, requested = (low[lost], high[lost]), (edge_phase[lost], order[lost])
        root = bracketed_roots(self._side, bracket, requested, absolute=_COARSE_DEPTH)
        retried = lost[root.found]
        more = self.polished(edge_phase[retried], order[retried], root.x[root.found])
        sharp = more.on_curve()
        which = np.concatenate([np.flatnonzero(converged), retried[sharp]])
        converged[retried[sharp]] = True
        return points.joined(more[sharp])[np.argsort(which)], converged

    def _narrowed(
        self,
        edge_phase: Float[Array, " lines"],
        order: Int[Array, " lines"],
        low: Float[Array, " lines"],
        high: Float[Array, " lines"],
    ) -> tuple[Float[Array, " lines"], Float[Array, " lines"]]:
        """Depths close to the curves of the given orders, and how far off they may be; 0 where there is no such."""
        place = np.linspace(0, 1, _SECTIONS)[:, None]
        depth = low + (high - low) * place
        side = self._side(depth, edge_phase, order)
        after = (side < 0).argmax(axis=0)
        before, lines = np.maximum(after - 1, 0), np.arange(len(edge_phase))
        outer, inner = side[before, lines], side[after, lines]
        width = np.where(after > 0, (high - low) / (_SECTIONS - 1), 0)
        # With no root in between both are on one side.
        part = outer / np.where(outer == inner, 1, outer - inner)
        return depth[before, lines] + width * part, width

    def _side(
        self, depth: Float[Array, "*points"], edge_phase: Float[Array, "*#points"], order: Int[Array, "*#points"]
    ) -> Float[Array, "*points"]:
        """|delta_minus| / delta_plus next to the curves of the given orders, else 1; negative inside of them."""
        index, ratio = self.index_and_ratio(edge_phase, depth)
        near = (index == order) | (index == order - 1)
        size = np.where(near, np.abs(ratio), 1.0)
        return np.where(index >= order, -size, size)

    def polished(
        self, edge_phase: Float[Array, " points"], order: Int[Array, " points"], depth: Float[Array, " points"]
    ) -> Points:
        """Points on the curves, refined from depths that are already close, by steps down to round-off."""
        depth, active = depth.copy(), np.arange(len(edge_phase))
        for _ in range(_MOST_STEPS):
            step, difference = self._step(edge_phase[active], depth[active])
            depth[active] += step
            # What a step leaves is about its cube, and itself times the square of the differences.
            left = np.abs(step) * (step**2 + difference**2)
            active = active[(left > _LEFT) & (np.abs(step) > _SAME * difference)]
            if active.size == 0:
                break
        return self.points(edge_phase, depth, order)

    def _step(
        self, edge_phase: Float[Array, " points"], depth: Float[Array, " points"]
    ) -> tuple[Float[Array, " points"], Float[Array, " points"]]:
        """Steps in depth to where the ratio vanishes, by Halley's method from differences, and these: all in one call.

        No step where beams beyond double precision leave no slope.
        """
        difference = _DIFFERENCE + _DEEP_DIFFERENCE * np.exp(depth - self.domain.sunk)
        ratio, outer, inner = self._ratio(edge_phase, np.stack([depth, depth - difference, depth + difference]))
        slope, bend = (inner - outer) / (2 * difference), (inner + outer - 2 * ratio) / difference**2
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -ratio / slope
            bent = np.clip(step * bend / (2 * slope), -0.5, 0.5)
            step = np.clip(step / (1 + bent), -_LONGEST_STEP, _LONGEST_STEP)
        return np.where(np.isfinite(step), step, 0.0), difference

    def labels_hold(self, curves: dict[int, Points]) -> dict[int, bool]:
        """True for each order whose index is order - 1 on the outer side of all points, and order on the inner side."""
        if not curves:
            return {}
        order = np.concatenate([np.full(len(points), k) for k, points in curves.items()])
        edge_phase = np.concatenate([points.edge_phase for points in curves.values()])
        depth = np.concatenate([points.depth for points in curves.values()])
        good = self.labelled(edge_phase, depth, order)
        return {k: bool(good[order == k].all()) for k in curves}

    def labelled(
        self, edge_phase: Float[Array, " points"], depth: Float[Array, " points"], order: Int[Array, " points"]
    ) -> Bool[Array, " points"]:
        """True where the index is order - 1 on the outer side of a point, and order on the inner side."""
        if not len(depth):
            return np.zeros(0, bool)
        outer, inner = self.index_and_ratio(edge_phase, np.stack([depth - LABEL_STEP, depth + LABEL_STEP]))[0]
        return (outer == order - 1) & (inner == order)

    def _photon(self, line_of_sight: Float[Array, "*points 3"]) -> Photon:
        sky = sky_from_fido(self._frame, -line_of_sight)
        return photon_of(self._frame, (sky[..., 0], sky[..., 1], sky[..., 2]))

    def _ratio(self, edge_phase: Float[Array, " points"], depth: Float[Array, "3 points"]) -> Float[Array, "3 points"]:
        line_of_sight, second_arrival = self.domain.line_of_sight(edge_phase, depth)
        beams = self._trace(line_of_sight.reshape(-1, 3), second_arrival.ravel())
        return (beams.delta_minus / beams.delta_plus).reshape(depth.shape)

    def _trace(
        self,
        line_of_sight: Float[Array, "points 3"],
        second_arrival: Bool[Array, " points"],
        tolerance: float | None = None,
    ) -> Beams:
        self.beams_traced += line_of_sight.size // 3
        beams = self.map.beams(line_of_sight, second_arrival, tolerance)
        self.engines_used.update(beams.engines)
        return beams


def _islands(index: Int[Array, "depths lines"], orders: int) -> dict[int, list[str]]:
    """Remarks, by order, about curves beside those that are followed, as the Morse index on the grid shows them.

    The region where the index is k or more, and the one where it is less, must each be in one piece, and the index must
    pass k once on every line: anything else is bounded by another critical curve of order k.
    """
    remarks: dict[int, list[str]] = {k: [] for k in range(1, orders + 1)}
    for k in remarks:
        inside = index >= k
        if not inside[-1].all():
            # The search ended before it had passed this order on every line.
            continue
        # Where every line passes k once, only the part above may be in several pieces: all lines end below.
        above = ~inside[0]
        pieces = int(above[0]) + int((above[1:] & ~above[:-1]).sum())
        if pieces > 1 or (np.diff(inside.astype(int), axis=0) < 0).any():
            remarks[k].append(f"the Morse index shows more than one critical curve of order {k}")
    return remarks


def joined_azimuth(
    azimuth: Float[Array, " points"], b: Float[Array, " points"], order: Int[Array, " points"]
) -> Float[Array, " points"]:
    """Azimuth of critical points, joined over b = 0, where the ray meets the spin axis.

    A critical ray of order k meets the axis k times as b passes through zero, and each meeting takes its
    azimuth from one side of the axis to the other: rays with b > 0 get k turns more, and the curve closes.
    """
    return azimuth + 2 * np.pi * np.asarray(order) * (b > 0)
