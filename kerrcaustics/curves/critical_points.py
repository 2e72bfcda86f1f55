"""Points of critical curves, refined to round-off on the lines of sky_lines.py.

The Morse index brackets a curve, the signed minor diameter pins it down: on a line, the curve of order k lies
where the index grows from k - 1 to k, and there delta_minus passes through zero.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import elementwise
from skimage.measure import label

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.closed_form.formula import LEAST_K
from kerrcaustics.beams.trace import check_request, trace_beams
from kerrcaustics.curves import sky_lines
from kerrcaustics.spacetime.camera import Camera, Photon, photon, sky_from_fido
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import polar_angle, polar_basis

Array = np.ndarray

# Spacing in depth of the first search along a line.
_SEARCH_STEP = 0.5
# The bracketing search needs the topology, not the digits.
_COARSE_TOLERANCE = 1e-6
_COARSE_DEPTH = 1e-6
# Secant steps on the full beams: first difference in depth, longest and shortest step, most steps,
# and when to stop.
_SLOPE_STEP = 1e-4
_LONGEST_SECANT = 0.2
_SHORTEST_SECANT = 1e-8
_MOST_SECANTS = 7
_SECANT_PRODUCT = 1e-13
# |delta_minus| / delta_plus of a point that is taken as found.
_RESIDUAL = 1e-10
# Stands for the index of a captured direction: more than any order.
_CAPTURED = 1 << 20
# Distance in depth at which the index on both sides of a curve is looked at.
_LABEL_STEP = 1e-3


@dataclass(frozen=True)
class Points(Rows):
    """Points near critical curves.

    turn, depth: place on the sky; looking: FIDO components; direction, theta, azimuth: the celestial sphere, azimuth
    joined over b = 0 (see `joined_azimuth`); major: unit vector along the image's major axis, sign arbitrary; ratio:
    delta_minus / delta_plus; error: of direction, radians.
    """

    turn: Float[Array, " points"]
    depth: Float[Array, " points"]
    looking: Float[Array, "points 3"]
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
        """True where the minor diameter has vanished; false too where the beam is captured."""
        return np.abs(self.ratio) < _RESIDUAL

    def each(self) -> list["Points"]:
        """The points one by one."""
        return [self[i : i + 1] for i in range(len(self))]

    def shifted(self, turns: int) -> "Points":
        """The same points, named by parameters that are whole turns larger."""
        return replace(self, turn=self.turn + 2 * np.pi * turns)

    def mirrored(self) -> "Points":
        """The points reflected in the equatorial plane, turn -> 2 pi - turn, in the order of `turn`."""
        flip = np.array([1.0, 1.0, -1.0])
        image = replace(
            self,
            turn=2 * np.pi - self.turn,
            looking=self.looking * np.array([1.0, -1.0, 1.0]),
            direction=self.direction * flip,
            theta=np.pi - self.theta,
            major=self.major * flip,
        )
        return image[::-1]


class Search:
    """Traces beams for the search at one event, and counts them."""

    def __init__(self, camera: Camera, engine: str, tolerance: float) -> None:
        """Search with the camera at rest at the same event."""
        check_request(camera, engine, tolerance)
        self.camera = camera.at_rest()
        self.engine = engine
        self.tolerance = tolerance
        self.engines_used: set[str] = set()
        self.beams_traced = 0
        self._frame = self.camera.frame()

    def index_and_ratio(
        self, turn: Float[Array, " points"], depth: Float[Array, " points"]
    ) -> tuple[Int[Array, " points"], Float[Array, " points"]]:
        """Morse index (a large number where captured) and delta_minus / delta_plus at (turn, depth).

        Beams that leave close to the principal null directions turn through less than half a circle and meet no
        conjugate point: they are not traced, and their ratio is given as 1.
        """
        looking = sky_lines.looking(self.camera, turn, depth)
        index, ratio = np.zeros(looking.shape[:-1], int), np.ones(looking.shape[:-1])
        bent = self._photon(looking).k >= LEAST_K
        beams = self._trace(looking[bent], _COARSE_TOLERANCE)
        captured = ~beams.escaped
        index[bent] = np.where(captured, _CAPTURED, np.asarray(beams.index))
        ratio[bent] = np.where(captured, -1.0, beams.delta_minus / beams.delta_plus)
        return index, ratio

    def points(
        self, turn: Float[Array, " points"], depth: Float[Array, " points"], order: Int[Array, " points"]
    ) -> Points:
        """Everything about beams at (turn, depth) that are taken to lie on the curve of the given order."""
        looking = sky_lines.looking(self.camera, turn, depth)
        beams = self._trace(looking, self.tolerance)
        e_theta, e_phi = polar_basis(beams.direction)
        angle = beams.position_angle[..., None]
        return Points(
            turn=turn,
            depth=depth,
            looking=looking,
            direction=beams.direction,
            theta=polar_angle(beams.direction),
            azimuth=joined_azimuth(beams.azimuth, self._photon(looking).b, order),
            major=np.cos(angle) * e_theta + np.sin(angle) * e_phi,
            ratio=beams.delta_minus / beams.delta_plus,
            error=beams.error,
        )

    def brackets(
        self, turn: Float[Array, " lines"], orders: int
    ) -> tuple[Float[Array, "orders lines"], Float[Array, "orders lines"], dict[int, list[str]]]:
        """Depths above and below the curves of order 1 .. orders on each line, and remarks by order.

        The search goes down the lines by itself until every curve has been passed. NaN where it was not.
        """
        depth = np.arange(0, 4, _SEARCH_STEP)
        index = np.empty((0, len(turn)), int)
        depths = np.empty(0)
        while True:
            grid_turn, grid_depth = np.meshgrid(turn, depth)
            found = self.index_and_ratio(grid_turn.ravel(), grid_depth.ravel())[0].reshape(grid_turn.shape)
            index, depths = np.concatenate([index, found]), np.concatenate([depths, depth])
            if (index[-1] >= orders).all() or depths[-1] >= sky_lines.DEEPEST:
                break
            depth = depths[-1] + np.arange(1, 5) * _SEARCH_STEP
        low, high = np.full((2, orders, len(turn)), np.nan)
        for k in range(1, orders + 1):
            passed = (index >= k) & (index < _CAPTURED)
            first = passed.argmax(axis=0)
            known = passed.any(axis=0) & (first > 0)
            low[k - 1, known] = depths[first[known] - 1]
            high[k - 1, known] = depths[first[known]]
        return low, high, _islands(index, orders)

    def refined(
        self,
        turn: Float[Array, " lines"],
        order: Int[Array, " lines"],
        low: Float[Array, " lines"],
        high: Float[Array, " lines"],
    ) -> tuple[Points, Bool[Array, " lines"]]:
        """Points on the curves of the given orders, one on each line, between depths low and high.

        A bracketing root-finder on coarse beams first, then secant steps on beams at the full tolerance.
        Returns the points whose bracket held a root, and which of the requested ones they are.
        """

        def side(
            depth: Float[Array, " points"], turn: Float[Array, " points"], order: Int[Array, " points"]
        ) -> Float[Array, " points"]:
            index, ratio = self.index_and_ratio(turn, depth)
            near = (index == order) | (index == order - 1)
            size = np.where(near, np.abs(ratio), 1.0)
            return np.where(index >= order, -size, size)

        root = elementwise.find_root(side, (low, high), args=(turn, order), tolerances={"xatol": _COARSE_DEPTH})
        found = np.asarray(root.success)
        points = self.polished(turn[found], order[found], np.asarray(root.x)[found])
        sharp = points.on_curve()
        found[found] = sharp
        return points[sharp], found

    def polished(
        self, turn: Float[Array, " points"], order: Int[Array, " points"], depth: Float[Array, " points"]
    ) -> Points:
        """Points on the curves from depths that are close already: secant steps down to round-off."""
        depth = depth.copy()
        ratio = self._ratio(turn, depth)
        slope = (self._ratio(turn, depth + _SLOPE_STEP) - ratio) / _SLOPE_STEP
        step = _secant(ratio, slope)
        active = np.arange(len(turn))
        for _ in range(_MOST_SECANTS):
            depth[active] += step[active]
            new, last = self._ratio(turn[active], depth[active]), step[active]
            # A difference over a very short step is round-off: the last slope serves.
            long = np.abs(last) > _SHORTEST_SECANT
            slope[active[long]] = (new - ratio[active])[long] / last[long]
            ratio[active] = new
            step[active] = _secant(new, slope[active])
            # The next step misses by about the product of the last two: below this it lands on round-off.
            active = active[long & (np.abs(step[active] * last) > _SECANT_PRODUCT)]
            if active.size == 0:
                break
        return self.points(turn, depth + step, order)

    def labels_hold(self, points: Points, order: int) -> bool:
        """True when the index is order - 1 on the outer side of every point, and order on the inner side."""
        outer = self.index_and_ratio(points.turn, points.depth - _LABEL_STEP)[0]
        inner = self.index_and_ratio(points.turn, points.depth + _LABEL_STEP)[0]
        return bool((outer == order - 1).all() and (inner == order).all())

    def _photon(self, looking: Float[Array, "points 3"]) -> Photon:
        sky = sky_from_fido(self._frame, -looking)
        return photon(self._frame, (sky[..., 0], sky[..., 1], sky[..., 2]))

    def _ratio(self, turn: Float[Array, " points"], depth: Float[Array, " points"]) -> Float[Array, " points"]:
        beams = self._trace(sky_lines.looking(self.camera, turn, depth), self.tolerance)
        return beams.delta_minus / beams.delta_plus

    def _trace(self, looking: Float[Array, "points 3"], tolerance: float) -> Beams:
        sky = sky_from_fido(self._frame, -looking)
        self.beams_traced += sky.size // 3
        beams = trace_beams(self.camera, sky, self.engine, tolerance, crossings=False, redshift=False)
        self.engines_used.update(beams.engines)
        return beams


def _islands(index: Int[Array, "depths lines"], orders: int) -> dict[int, list[str]]:
    """What the Morse index on the grid says, by order, about curves beside those that are followed.

    The region where the index is k or more, and the one where it is less, must each be in one piece, and the index must
    pass k once on every line: anything else is bounded by another critical curve of order k.
    """
    remarks: dict[int, list[str]] = {k: [] for k in range(1, orders + 1)}
    for k in remarks:
        inside = index >= k
        if not inside[-1].all():
            # The search ended before it had passed this order on every line.
            continue
        pieces = [label(region, connectivity=1, return_num=True)[1] for region in (inside, ~inside)]
        if max(pieces) > 1 or (np.diff(inside.astype(int), axis=0) < 0).any():
            remarks[k].append(f"the Morse index shows more than one critical curve of order {k}")
    return remarks


def _secant(ratio: Float[Array, " points"], slope: Float[Array, " points"]) -> Float[Array, " points"]:
    """Step to the root of a straight line; none where beams beyond double precision leave no slope."""
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.clip(-ratio / slope, -_LONGEST_SECANT, _LONGEST_SECANT)
    return np.where(np.isfinite(step), step, 0.0)


def joined_azimuth(
    azimuth: Float[Array, " points"], b: Float[Array, " points"], order: Int[Array, " points"]
) -> Float[Array, " points"]:
    """Azimuth of critical points, joined over b = 0, where the ray meets the spin axis.

    A critical ray of order k meets the axis k times as b passes through zero, and each meeting takes its
    azimuth from one side of the axis to the other: rays with b > 0 get k turns more, and the curve closes.
    """
    return azimuth + 2 * np.pi * np.asarray(order) * (b > 0)
