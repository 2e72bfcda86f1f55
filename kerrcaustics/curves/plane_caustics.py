"""Where caustics meet the equatorial plane: sections of the caustic tubes by the n-th crossing, as curves."""

import math
import time
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import chebyshev
from scipy.optimize import elementwise
from skimage.measure import find_contours

from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.curves.circles_in_plane import Circles, PlanePoints, circles_of
from kerrcaustics.curves.screens import shown
from kerrcaustics.results.declared import Items, derived, quantity, result
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera

Array = np.ndarray

_TURN = 2 * math.pi
# Radii of the grid: how far above the horizon they begin, where they end, and how many; lines across the shadow edge.
_LOWEST, _HIGHEST, _RADII, _LINES = 1e-3, 1e3, 256, 512
_NODES, _FEWEST, _WORST = 9, 8, 1e-3
_TIGHT = {"xatol": 1e-14, "xrtol": 1e-14}


@result(
    "plane-caustic/1",
    record="order crossing r_min r_max phi_min phi_max ends closed error lost residual",
    points="sky place",
)
class PlaneCaustic:
    """One connected piece of the section of a caustic tube by the equatorial plane, as a curve."""

    order: int = quantity("", "1", "1 primary, 2 secondary, and on")
    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    sky: Array = quantity(
        "point axis",
        "1",
        "directions N of the critical curve of the plane, in order along it; of an Observer (alpha, beta)",
    )
    place: Array = quantity("point place_axis", "1", "r in GM/c^2, unwrapped phi in radians")
    ends: tuple[str, ...] = quantity(
        "", "", 'where an open curve leaves the radii that were looked at: "horizon" or "infinity"; empty if closed'
    )
    r_min: float = quantity("", "GM/c^2", "least radius")
    r_max: float = quantity("", "GM/c^2", "largest radius")
    phi_min: float = quantity("", "rad", "least azimuth of the points, unwrapped")
    phi_max: float = quantity("", "rad", "largest azimuth of the points, unwrapped")
    error: float = quantity("", "rad", "largest error of place, relative in r")
    lost: int = quantity("", "1", "points that could not be pinned down, and are left out")
    residual: float = quantity("", "1", "largest delta_minus / delta_plus of the points")

    @property
    @derived("", "1")
    def closed(self) -> bool:
        """Whether the curve returns to its first point, which is not repeated."""
        return not self.ends


@result("plane-caustics/1", record="camera crossing seconds curves")
class PlaneCausticSet(Items[PlaneCaustic]):
    """Where the caustics of one camera meet the equatorial plane: a sequence of curves, by order."""

    curves: tuple[PlaneCaustic, ...] = quantity("curve", "", "the curves", column="")
    camera: Camera = quantity("", "", "the camera", json="", column="")
    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    seconds: float = quantity("", "s", "time it took")

    def __repr__(self) -> str:
        """One line: the camera and the curves."""
        curves = ", ".join(f"{c.order} from r = {c.r_min:.4g} to {c.r_max:.4g}" for c in self)
        return f"<PlaneCausticSet of {self.camera}, crossing {self.crossing}: {curves or 'none'}>"


def plane_caustics(camera: Camera, orders: int, end: EquatorialPlane) -> PlaneCausticSet:
    """The curves of order 1 to `orders` in which caustic tubes meet the n-th crossing of the plane."""
    began = time.perf_counter()
    radii = kerr.horizon(camera.spin) + np.geomspace(_LOWEST, _HIGHEST, _RADII)
    circles, points, rows = _grid(camera, end.crossing, radii, many=False)
    if not np.isfinite(points.ratio).all():
        circles, points, rows = _grid(camera, end.crossing, radii, many=True)
    found: list[PlaneCaustic] = []
    for order in range(1, orders + 1):
        found += _curves(circles, camera, points, rows, order)
    return PlaneCausticSet(tuple(found), camera=camera, crossing=end.crossing, seconds=time.perf_counter() - began)


def _grid(
    camera: Camera, crossing: int, radii: Float[Array, " radii"], *, many: bool
) -> tuple[Circles, PlanePoints, int]:
    """Points on lines and circles, circle by circle, and how many circles could be seen whole."""
    circles = circles_of(camera, crossing, many=many)
    turn = _TURN * (np.arange(_LINES) + 0.5) / _LINES
    splines = [(r, s) for r, s in zip(radii.tolist(), circles.around(radii), strict=True) if s is not None]
    distance = np.concatenate([np.empty(0), *(spline(turn) for _, spline in splines)])
    every = np.repeat([r for r, _ in splines], _LINES)
    return circles, circles.on_circle(np.tile(turn, len(splines)), every, distance), len(splines)


def _curves(circles: Circles, camera: Camera, points: PlanePoints, rows: int, order: int) -> list[PlaneCaustic]:
    """All curves of one order, on a grid of radii and lines."""
    if rows < 2:
        return []
    inside = (points.index >= order).reshape(rows, -1)
    around = np.concatenate([inside, inside[:, :1]], axis=1).astype(float)
    chains = _joined([np.round(2 * c).astype(int) for c in find_contours(around, 0.5)], 2 * inside.shape[1])
    curves = [_curve(circles, camera, points, chain, (rows, inside.shape[1]), order) for chain in chains]
    return [curve for curve in curves if curve is not None]


def _joined(pieces: list[Int[Array, "_ 2"]], width: int) -> list[Int[Array, "_ 2"]]:
    """Contours, in half steps of the grid, joined over the line from which turn is counted."""
    left = [piece for piece in pieces if len(piece) > 1]
    for _ in range(len(left) * 2):
        ends = [(n, end) for n, piece in enumerate(left) for end in (0, -1) if piece[end][1] in (0, width)]
        pair = next(
            (
                (one, other)
                for k, one in enumerate(ends)
                for other in ends[k + 1 :]
                if _meet(left[one[0]][one[1]], left[other[0]][other[1]], width) and one[0] != other[0]
            ),
            None,
        )
        if pair is None:
            break
        (n, end), (m, other) = pair
        first = left[n] if end == -1 else left[n][::-1]
        second = left[m] if other == 0 else left[m][::-1]
        left = [piece for k, piece in enumerate(left) if k not in (n, m)] + [np.concatenate([first, second[1:]])]
    return left


def _meet(one: Array, other: Array, width: int) -> bool:
    return bool(one[0] == other[0] and {int(one[1]), int(other[1])} == {0, width})


def _curve(
    circles: Circles, camera: Camera, grid: PlanePoints, chain: Array, shape: tuple[int, int], order: int
) -> PlaneCaustic | None:
    """The curve along one contour; None where the contour is noise of the index, and hardly a point is flat."""
    closed = bool((chain[0] == chain[-1]).all()) or _meet(chain[0], chain[-1], 2 * shape[1])
    chain = chain[:-1] if closed else chain
    low, high = chain // 2, (chain + 1) // 2
    start, stop = (grid[r * shape[1] + t % shape[1]] for r, t in (low.T, high.T))
    points = _flat(circles, start, stop)
    good = np.isfinite(points.radius) & (np.abs(points.ratio) < 1e-6) & (points.error < _WORST)
    if good.sum() < _FEWEST:
        return None
    points = points[good]
    ends = () if closed else tuple("horizon" if chain[i][0] == 0 else "infinity" for i in (0, -1))
    place = np.stack([points.radius, np.unwrap(points.azimuth)], axis=-1)
    extremes = [_extreme(circles, points, sign) for sign in (-1, 1)]
    return PlaneCaustic(
        order=order,
        crossing=circles.end.crossing,
        sky=shown(camera, points.sky),
        place=place,
        ends=ends,
        r_min=extremes[0],
        r_max=extremes[1],
        phi_min=float(place[:, 1].min()),
        phi_max=float(place[:, 1].max()),
        error=float(points.error.max()),
        lost=int((~good).sum()),
        residual=float(np.abs(points.ratio).max()),
    )


def _flat(circles: Circles, start: PlanePoints, stop: PlanePoints) -> PlanePoints:
    """Points of the caustic between neighbours on the grid, along a line or along a circle."""

    def at(part: Array, *ends: Array) -> PlanePoints:
        turn, width, ln_r, d_ln_r, distance, change = ends
        radius = np.exp(ln_r + part * d_ln_r)
        return circles.on_circle((turn + part * width) % _TURN, radius, distance + part * change)

    width = (stop.turn - start.turn + math.pi) % _TURN - math.pi
    ln_r = np.log(start.radius)
    ends = start.turn, width, ln_r, np.log(stop.radius) - ln_r, start.distance, stop.distance - start.distance
    bracket = np.zeros(len(start)), np.ones(len(start))
    root = elementwise.find_root(lambda part, *e: at(part, *e).ratio, bracket, args=ends, tolerances=_TIGHT)
    return at(np.where(np.isfinite(root.x), root.x, 0.5), *ends)


def _extreme(circles: Circles, points: PlanePoints, sign: int) -> float:
    """The least or largest radius, from a polynomial in turn through points around the best one."""
    best = int(np.argmax(sign * points.radius))
    if best in (0, len(points) - 1):
        return float(points.radius[best])
    near = points[np.clip(np.arange(best - 2, best + 3), 0, len(points) - 1)]
    turn = near.turn[2] + (near.turn - near.turn[2] + math.pi) % _TURN - math.pi
    half = np.abs(turn - turn[2]).max() / 2
    if half == 0:
        return float(points.radius[best])
    nodes = turn[2] + half * chebyshev.chebpts1(_NODES)
    middle = near[2:3]
    rows = np.full(_NODES, 0)
    one = replace(middle[rows], turn=nodes % _TURN, radius=middle.radius[rows] * np.exp(-0.05))
    other = replace(middle[rows], turn=nodes % _TURN, radius=middle.radius[rows] * np.exp(0.05))
    found = _flat(circles, *(circles.on_circle(p.turn, p.radius, p.distance) for p in (one, other)))
    if not (np.abs(found.ratio) < 1e-6).all():
        return float(points.radius[best])
    fit = chebyshev.chebfit(chebyshev.chebpts1(_NODES), found.radius, _NODES - 1)
    roots = chebyshev.chebroots(chebyshev.chebder(fit))
    places = roots.real[(np.abs(roots.imag) < 1e-7) & (np.abs(roots.real) <= 1)]
    values = chebyshev.chebval(np.append(places, 0.0), fit)
    return float(sign * (sign * values).max())
