"""Caustics in the equatorial plane: sections of the caustic tubes by the n-th crossing, as curves."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from kerrcaustics.beams.ends import End
from kerrcaustics.curves.caustic import Caustic
from kerrcaustics.lens_map.circles_in_plane import Circles
from kerrcaustics.lens_map.plane_map import Crossings
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.lens_map.sky_lines import periodic
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.numerics.splines import Spline
from kerrcaustics.results.progress import in_steps, report
from kerrcaustics.shapes import Bool, Float, Int, Shaped
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.shadow import even_phases
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_TURN = 2 * math.pi
# Height of the lowest circle above the horizon.
_LOWEST = 1e-3
# Height of the highest circle above the horizon.
_HIGHEST = 1e3
# Number of circles between both that are tried as ends of the grid.
_RADII = 256
# Places on each line between both ends, steps of the grid: every other one is traced first.
_PLACES = 257
# Ratio of the largest to the smallest spacing of these places, which lie closer toward both ends.
_RANGE = 1e3
# Lines across the shadow edge, steps of the grid: every other one is traced first.
_LINES = 512
# Tolerance of beams whose index alone is needed, radians.
_COARSE = 1e-6
# Ratio of diameters below which a beam may lie close to flat ones.
_THIN = 0.1
# Chebyshev nodes about an extreme.
_NODES = 9
# Fewest points of a curve.
_FEWEST = 8
# Largest error of a point of a curve, relative to its radius.
_WORST = 1e-3
# The extremes of a curve: a field of its points, and its sign.
_EXTREMES = {"r_min": ("radius", -1), "r_max": ("radius", 1), "phi_min": ("azimuth", -1), "phi_max": ("azimuth", 1)}
# A radius is that of the last circle within this part of it.
_EDGE = 1e-9
_TIGHT = {"absolute": 1e-14, "relative": 1e-14}


@dataclass(frozen=True, eq=False)
class _Grid:
    """Lines across the shadow edge, each cut into parts from the lowest circle to the highest one, 0 to 1.

    circles: the circles of the crossing.
    radii: radii of the lowest and the highest circle.
    rims: distances from the shadow edge at which a line meets both circles, as functions of its edge phase.
    edge_phase: parameters of the lines.
    part: places on each line, 0 to 1.
    index: Morse index at the places.
    """

    circles: Circles
    radii: tuple[float, float]
    rims: Spline
    edge_phase: Float[Array, " lines"]
    part: Float[Array, " places"]
    index: Int[Array, "places lines"]

    def distance(self, edge_phase: Float[Array, " points"], part: Float[Array, " points"]) -> Float[Array, " points"]:
        """Distance of places from the shadow edge."""
        low, high = self.rims(edge_phase).T
        return low + part * (high - low)

    def places(self, points: Crossings) -> "_Places":
        """Places of points."""
        low, high = self.rims(points.edge_phase).T
        return _Places(points.edge_phase, (points.distance - low) / (high - low))


@dataclass(frozen=True)
class _Places(Rows):
    """Places on the grid: on which line, and which part of the way."""

    edge_phase: Float[Array, " points"]
    part: Float[Array, " points"]


@dataclass(frozen=True)
class _Section:
    """A curve of one order.

    order: order of the caustic.
    points: its points, in order.
    closed: True if the last point is followed by the first one.
    ends: "horizon" or "infinity" at both ends of an open curve, where it leaves the radii that are searched.
    lost: number of points that were not found.
    """

    order: int
    points: Crossings
    closed: bool
    ends: tuple[str, ...]
    lost: int


@dataclass(frozen=True)
class Extreme:
    """An extreme of a curve: the points near it, and its place among them.

    nodes: points at Chebyshev nodes of the edge phase, and place, from -1 to 1, the extreme among them; or one point,
    the best one, if the extreme could not be refined or is an end of the curve. toward: the side on which the curve
    ends there, empty for others.
    """

    nodes: Crossings
    place: float = 0.0
    toward: str = ""

    @property
    def refined(self) -> bool:
        """True if there are nodes."""
        return len(self.nodes) > 1

    def value(self, field: str) -> float:
        """The value of a field there."""
        return float(chebyshev.chebval(self.place, _fitted(self.nodes, field)))


def plane_caustics(
    camera: Viewer, surface: End, circles: Callable[..., Circles], orders: int
) -> tuple[tuple[Caustic, ...], int, set[str]]:
    """Curves of order 1 to `orders` in which caustic tubes meet a crossing of the plane, and the beams traced.

    circles: the circles of the crossing, on many lines or few.
    """
    report("rays all over the sky", 0.0)
    grid, used = _grid_and_circles(circles)
    curves: list[Caustic] = []
    for order in in_steps("order", range(1, orders + 1)):
        curves += [_curve(camera, surface, grid, section) for section in _sections(grid, order)] if grid else []
    return tuple(curves), sum(each.beams_traced - before for each, before in used), used[-1][0].engines_used


def section_extremes(circles: Callable[..., Circles], orders: int) -> Iterator[tuple[int, dict[str, Extreme]]]:
    """The order of each curve of order 1 to `orders`, and its extremes by name."""
    grid, _ = _grid_and_circles(circles)
    if grid is None:
        return
    for order in range(1, orders + 1):
        for section in _sections(grid, order):
            yield order, {name: _extreme(grid, section, *what) for name, what in _EXTREMES.items()}


def _grid_and_circles(circles: Callable[..., Circles]) -> tuple[_Grid | None, list[tuple[Circles, int]]]:
    """The grid on few lines, or on many; the circles that were looked at, with the beams each had traced before."""
    used: list[tuple[Circles, int]] = []
    grid = None
    for many in (False, True):
        if grid is None:
            used.append((circles(many=many), circles(many=many).beams_traced))
            grid = _grid(used[-1][0])
    return grid, used


def _grid(circles: Circles) -> _Grid | None:
    """The lines between the lowest and the highest circle that is seen whole; None where a ray is lost between them."""
    radii = kerr.horizon(circles.camera.spin) + np.geomspace(_LOWEST, _HIGHEST, _RADII)
    whole = radii[circles.whole(radii)]
    if len(whole) < 2:
        return None
    edge_phase = even_phases(circles.camera, (np.arange(_LINES) + 0.5) / _LINES)
    ends = [
        circles.on_circle(edge_phase, np.full(_LINES, radius), spline(edge_phase)).distance
        for radius, spline in zip(whole[[0, -1]].tolist(), circles.distances(whole[[0, -1]]), strict=True)
        if spline is not None
    ]
    # Toward the circles r and 1 / r are about linear in the distance: so both are sampled evenly in their logarithms.
    part = 1 / (1 + np.geomspace(_RANGE, 1 / _RANGE, _PLACES))
    part = (part - part[0]) / (part[-1] - part[0])
    distance = ends[0] + part[:, None] * (ends[1] - ends[0])
    index = _indices(circles, edge_phase, distance)
    if index is None:
        return None
    rims = periodic(edge_phase, np.stack(ends, axis=-1))
    return _Grid(circles, (float(whole[0]), float(whole[-1])), rims, edge_phase, part, index)


def _indices(
    circles: Circles, edge_phase: Float[Array, " lines"], distance: Float[Array, "places lines"]
) -> Int[Array, "places lines"] | None:
    """The Morse index on a grid, of which only every other line is traced where nothing changes."""

    def index_and_ratio(places: Array, lines: Array) -> tuple[Array, Array]:
        beams = circles.beams_at(edge_phase[lines], distance[places, lines], _COARSE)
        return np.asarray(beams.index), np.abs(beams.delta_minus / beams.delta_plus)

    shape = distance[::2, ::2].shape
    places, lines = (2 * np.indices(shape)).reshape(2, -1)
    known, ratio = (values.reshape(shape) for values in index_and_ratio(places, lines))
    if not np.isfinite(ratio).all():
        return None
    closer = np.repeat(np.repeat(_uneven(known, ratio), 2, axis=0), 2, axis=1)[: distance.shape[0]]
    index = np.repeat(np.repeat(known, 2, axis=0), 2, axis=1)[: distance.shape[0]]
    closer[::2, ::2] = False
    places, lines = np.nonzero(closer)
    index[places, lines], _ = index_and_ratio(places, lines)
    return index


def _uneven(index: Int[Array, "places lines"], ratio: Float[Array, "places lines"]) -> Bool[Array, "places lines"]:
    """True for places at which, or next to which, the index changes or the beam is thinnest."""
    uneven = _of_neighbours(np.fmin, index) != _of_neighbours(np.fmax, index)
    uneven |= (ratio < _THIN) & (ratio == _of_neighbours(np.fmin, ratio))
    return _of_neighbours(np.fmax, uneven)


def _of_neighbours(least_or_most: np.ufunc, values: Shaped[Array, "places lines"]) -> Shaped[Array, "places lines"]:
    """The least or the largest value of each place and its eight neighbours."""
    # Of the first and the last circle, neighbours on one side only; lines go round.
    wider = np.pad(np.pad(values, ((1, 1), (0, 0)), "edge"), ((0, 0), (1, 1)), "wrap")
    return least_or_most.reduce(np.lib.stride_tricks.sliding_window_view(wider, (3, 3)), axis=(-2, -1))


def _sections(grid: _Grid, order: int) -> list[_Section]:
    """All curves of one order."""
    from skimage.measure import find_contours

    inside = grid.index >= order
    around = np.concatenate([inside, inside[:, :1]], axis=1).astype(float)
    chains = _joined([np.round(2 * c).astype(int) for c in find_contours(around, 0.5)], 2 * inside.shape[1])
    sections = [_section(grid, chain, order) for chain in chains]
    return [section for section in sections if section is not None]


def _joined(pieces: list[Int[Array, "_ 2"]], width: int) -> list[Int[Array, "_ 2"]]:
    """Contours, in half steps of the grid, joined over the line from which the edge phase is counted."""
    left = [piece for piece in pieces if len(piece) > 1]
    for _ in range(len(left) * 2):
        ends = [(n, end) for n, piece in enumerate(left) for end in (0, -1) if piece[end][1] in (0, width)]
        pair = next(
            (
                (start, stop)
                for k, start in enumerate(ends)
                for stop in ends[k + 1 :]
                if _meet(left[start[0]][start[1]], left[stop[0]][stop[1]], width) and start[0] != stop[0]
            ),
            None,
        )
        if pair is None:
            break
        (n, end), (m, stop) = pair
        first = left[n] if end == -1 else left[n][::-1]
        second = left[m] if stop == 0 else left[m][::-1]
        left = [piece for k, piece in enumerate(left) if k not in (n, m)] + [np.concatenate([first, second[1:]])]
    return left


def _meet(first: Array, second: Array, width: int) -> bool:
    return bool(first[0] == second[0] and {int(first[1]), int(second[1])} == {0, width})


def _section(grid: _Grid, chain: Int[Array, "_ 2"], order: int) -> _Section | None:
    """The curve along one contour; None where the contour is noise of the index, and hardly a point is flat."""
    closed = bool((chain[0] == chain[-1]).all()) or _meet(chain[0], chain[-1], 2 * len(grid.edge_phase))
    chain = chain[:-1] if closed else chain
    ends = () if closed else tuple("horizon" if chain[i][0] == 0 else "infinity" for i in (0, -1))
    points = _points(grid, chain, ends)
    least, most = np.array(grid.radii) * (1 - _EDGE, 1 + _EDGE)
    # Where circles bend sharply, the way between neighbours may lead beyond the last one.
    points = points[~((points.radius < least) | (points.radius > most))]
    good = np.isfinite(points.radius) & (np.abs(points.ratio) < 1e-6) & (points.error < _WORST)
    if good.sum() < _FEWEST:
        return None
    return _Section(order, points[good], closed, ends, lost=int((~good).sum()))


def _curve(camera: Viewer, surface: End, grid: _Grid, section: _Section) -> Caustic:
    """The curve as users get it."""
    points = section.points
    place = np.stack([points.radius, np.unwrap(points.azimuth)], axis=-1)
    extremes = {name: _value(grid, section, *what) for name, what in _EXTREMES.items()}
    return Caustic(
        camera=camera,
        order=section.order,
        surface=surface,
        sky=search_sky(camera).to_viewer(points.sky),
        place=place,
        cusps=(),
        kind="section",
        ends=section.ends,
        closed=section.closed,
        theta_min=math.pi / 2,
        theta_max=math.pi / 2,
        **extremes,
        error=float(points.error.max()),
        lost=section.lost,
        certified=not section.lost,
        residual=float(np.abs(points.ratio).max()),
        remarks=(f"{section.lost} points could not be found",) if section.lost else (),
    )


def _points(grid: _Grid, chain: Int[Array, "_ 2"], ends: tuple[str, ...]) -> Crossings:
    """Points of the caustic between neighbours on the grid, the first and the last one of an open curve on a circle."""
    shape = grid.index.shape
    start, stop = (
        _Places(grid.edge_phase[line], grid.part[place])
        for place, line in ((n % shape).T for n in (chain // 2, (chain + 1) // 2))
    )
    if not ends:
        return _flat(grid, start, stop)
    outer = np.array([0, -1])
    radius = np.array([grid.radii[end == "infinity"] for end in ends])
    at_ends = _flat(grid, start[outer], stop[outer], radius)
    return at_ends[:1].joined(_flat(grid, start[1:-1], stop[1:-1]), at_ends[1:])


def _flat(grid: _Grid, start: _Places, stop: _Places, radius: Float[Array, " points"] | None = None) -> Crossings:
    """The points between neighbours where the beams are flat; radius, of the circles on which they are to lie."""

    def point_at(step: Array, edge_phase: Array, width: Array, part: Array, change: Array, *radius: Array) -> Crossings:
        edge_phase = (edge_phase + step * width) % _TURN
        distance = grid.distance(edge_phase, part + step * change)
        return (
            grid.circles.on_circle(edge_phase, radius[0], distance)
            if radius
            else grid.circles.crossings_at(edge_phase, distance)
        )

    width = (stop.edge_phase - start.edge_phase + math.pi) % _TURN - math.pi
    ends = start.edge_phase, width, start.part, stop.part - start.part, *(() if radius is None else (radius,))
    bracket = np.zeros(len(start)), np.ones(len(start))
    root = bracketed_roots(lambda step, *e: point_at(step, *e).ratio, bracket, ends, **_TIGHT)
    return point_at(np.where(np.isfinite(root.x), root.x, 0.5), *ends)


def _extreme(grid: _Grid, section: _Section, field: str, sign: int) -> Extreme:
    """The least or largest value of a field, from a polynomial in the edge phase through points around the best one."""
    points = section.points
    best = int(np.argmax(sign * _unwrapped(points, field)))
    if section.closed:
        points, best = points[np.roll(np.arange(len(points)), len(points) // 2 - best)], len(points) // 2
    if best in (0, len(points) - 1):
        return Extreme(points[best : best + 1], toward=section.ends[-1 if best else 0])
    near = points[np.clip(np.arange(best - 2, best + 3), 0, len(points) - 1)]
    nodes = _extreme_nodes(grid, near)
    if nodes is None:
        return Extreme(points[best : best + 1])
    fit = _fitted(nodes, field)
    roots = chebyshev.chebroots(chebyshev.chebder(fit))
    places = np.append(roots.real[(np.abs(roots.imag) < 1e-7) & (np.abs(roots.real) <= 1)], 0.0)
    return Extreme(nodes, float(places[np.argmax(sign * chebyshev.chebval(places, fit))]))


def _extreme_nodes(grid: _Grid, near: Crossings) -> Crossings | None:
    """Points of a curve at Chebyshev nodes of the edge phase about the middle one of five; None if some are lost."""
    edge_phase = near.edge_phase[2] + (near.edge_phase - near.edge_phase[2] + math.pi) % _TURN - math.pi
    half = np.abs(edge_phase - edge_phase[2]).max() / 2
    if half == 0:
        return None
    nodes = edge_phase[2] + half * chebyshev.chebpts1(_NODES)
    beside = np.repeat(near.radius[2] * np.exp([-0.05, 0.05]), _NODES)
    around = grid.circles.on_circle(np.tile(nodes % _TURN, 2), beside, np.full(2 * _NODES, near.distance[2]))
    points = _flat(grid, grid.places(around[:_NODES]), grid.places(around[_NODES:]))
    return points if (np.abs(points.ratio) < 1e-6).all() else None


def _unwrapped(points: Crossings, field: str) -> Float[Array, " points"]:
    """Radii, or azimuths without jumps by a turn."""
    values = getattr(points, field)
    return np.unwrap(values) if field == "azimuth" else values


def _fitted(nodes: Crossings, field: str) -> Float[Array, " powers"]:
    return chebyshev.chebfit(chebyshev.chebpts1(len(nodes)), _unwrapped(nodes, field), len(nodes) - 1)


def _value(grid: _Grid, section: _Section, field: str, sign: int) -> float:
    """The value of an extreme, along the curve."""
    values = _unwrapped(section.points, field)
    best, value = float(values[np.argmax(sign * values)]), _extreme(grid, section, field, sign).value(field)
    # Azimuths along the curve may be whole turns off those of its rays.
    return value + _TURN * round((best - value) / _TURN) if field == "azimuth" else value
