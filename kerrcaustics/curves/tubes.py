"""Caustic tubes: the caustics of a viewer's past light cone, from the celestial sphere down to the hole.

The tube of order k is the set of all k-th conjugate points. On a line of sky_lines.py the k-th conjugate point comes in
from infinity as the ray moves from the critical curve toward the shadow edge, passes the photon orbits where the ray is
on the edge, and falls to the horizon with the rays inside the shadow. Its 1 / r grows all the way, so a line and a
radius name a point of the tube. From infinity the primary tube has no critical curve: its lines begin infinitely far
out on the screen, at the point opposite to the observer.
"""

import math

import numpy as np

from kerrcaustics.beams.bundles import COORDINATES
from kerrcaustics.beams.ends import SKY
from kerrcaustics.beams.paths import RayPaths, SpacePoints, paths_of_directions
from kerrcaustics.curves.caustic_search import check_orders
from kerrcaustics.curves.critical_curves import CriticalCurve, curves_of, steps
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, in_steps, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import numbers, quoted
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.shadow import even_phases
from kerrcaustics.spacetime.sphere import angle_between, from_angles
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

# Steps along the caustic between neighbouring lines, in radians; fewest and most lines round a tube.
_STEP = math.radians(2.0)
_FEWEST, _MOST = 160, 900
# Every so many lines are searched for the rays whose conjugate points lie at the wanted radii.
_SPARSE = 4
# Distances outside the shadow edge at which conjugate points are searched for, over that of the critical curve, from 1
# downward.
_OUTSIDE = np.append(1 - np.geomspace(1e-3, 0.1, 6), np.linspace(0.8, 0.1, 8))
# The least distance outside, over the size of the shadow; over the curve's distance where that is smaller, as it is
# for all orders but the first seen from afar.
_SMALLEST = 0.01
# Distances per decade between the last of `_OUTSIDE` and the least one.
_PER_DECADE = 10
# Distances inside the shadow edge, over the same size, negative.
_INSIDE = -np.geomspace(0.01, 3, 26)
# Places at which a ray is looked at for its conjugate points.
_PLACES = 24
# The last radius, above the horizon, and the radius that lies halfway between hole and infinity in the usual rows.
_ABOVE_HORIZON = 0.4
_USUAL_SCALE, _USUAL_ROWS = 6.0, 48


@result("tube/1")
class CausticTube(Shown):
    """A caustic of the past light cone, in space: a surface of conjugate points.

    The first row is the caustic on the celestial sphere, at infinite radius; the others lie close to the requested
    radii. The lines go round the tube, which is closed: the first one is not repeated. A line that falls into the hole
    before the last radii holds its last point there.

    The first row of the primary tube seen from infinity is the point opposite to the observer, its limit far out: the
    rays would pass infinitely far from the hole, and `sky` and the times are NaN.
    """

    order: int = quantity("", "1", "1 primary, 2 secondary, and so on")
    points: SpacePoints = quantity("row line", "", "the surface", column="")
    sky: np.ndarray = quantity(
        "row line axis", "1", "camera-sky directions N of the rays through the points; of an Observer (alpha, beta)"
    )
    closed: bool = quantity("", "1", "True when the whole critical curve was found")
    remarks: tuple[str, ...] = declared.remarks("remarks on what was missed or is unusual; otherwise empty")

    def __repr__(self) -> str:
        """Summary in one line: order and size."""
        return f"<CausticTube of order {self.order}, {self.points.radius.shape} points>"


def usual_radii(spin: float) -> Float[Array, " rows"]:
    """Radii from infinity to just above the horizon, evenly spaced in r / (r + 6)."""
    low = kerr.horizon(spin) + _ABOVE_HORIZON
    part = np.linspace(1, low / (low + _USUAL_SCALE), _USUAL_ROWS)
    with np.errstate(divide="ignore"):
        return _USUAL_SCALE * part / (1 - part)


@usual_warnings
@with_progress
def caustic_tubes(
    camera: Viewer,
    orders: int = 2,
    radii: Float[Array, " rows"] | None = None,
    *,
    progress: Progress | bool | None = None,
) -> tuple[CausticTube, ...]:
    """The caustics of a viewer's past light cone as surfaces in space, primary first.

    Parameters
    ----------
    camera : Camera or Observer
        Its velocity shifts the rays on its sky, and does not affect the tubes.
    orders : int
        Number of tubes, 1 to 10; those that cannot be found are left out.
    radii : (rows,) array, optional
        Radii of the rows, decreasing from math.inf. By default 48 radii down to 0.4 above the horizon.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    tuple of CausticTube

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `CausticTube.points.error`: every point is a conjugate point, like those of `ray_paths`; its radius misses the
    requested one by a few hundredths of it, and by more in the last rows.

    References
    ----------
    Rauch & Blandford 1994 (ApJ 421, 46) for the tube of astroid section.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> import math
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> tubes = kc.caustic_tubes(camera, orders=1, radii=[math.inf, 20.0, 5.0])
    >>> tubes[0].order, tubes[0].closed
    (1, True)
    """
    check_viewer(camera)
    check_orders(orders)
    places = usual_radii(camera.spin) if radii is None else numbers("radii", radii)
    falling = places.ndim == 1 and len(places) > 1 and np.all(places[1:] < places[:-1])
    if not (falling and places[0] == math.inf and places[-1] > kerr.horizon(camera.spin)):
        must = "fall from math.inf to a radius outside the horizon"
        raise ValueError(f"Argument `radii` must {must}, but is {quoted(radii)}.")
    search_map = SearchMap.for_viewer(camera, SKY)
    far = (_unbounded(search_map.camera),) if search_map.domain.unbounded else ()
    curves = (*far, *curves_of(search_map, int(orders)))
    return tuple(_tube(camera, search_map.camera, curve, places) for curve in in_steps("tube", curves))


def _unbounded(camera: Viewer) -> CriticalCurve:
    """The primary critical curve of an observer at infinity, which is a point: the begin of evenly many lines."""
    turn = even_phases(camera, np.arange(_FEWEST) / _FEWEST)
    none, theta, azimuth = np.zeros(_FEWEST), *(np.full(_FEWEST, x) for x in (math.pi - camera.inclination, math.pi))
    direction = from_angles(theta, azimuth)
    line_of_sight = sky_lines.line_of_sight(camera, turn, none)
    points = Points(turn, none, line_of_sight, direction, theta, azimuth, 0 * direction, none, none)
    return CriticalCurve(1, points, closed=True, remarks=("the tube ends in the point opposite to the observer",))


def _tube(camera: Viewer, searcher: Viewer, whole: CriticalCurve, radii: Float[Array, " rows"]) -> CausticTube:
    """The tube of a critical curve; searcher: the viewer who searches for the camera."""
    unbounded = bool(np.all(whole.points.depth == 0))
    curve = whole.points if unbounded else whole.points[_lines(whole.points)]
    parts = _parts_at(searcher, curve, whole.order, 1 / radii[1:])
    edge_phase = np.broadcast_to(curve.edge_phase, parts.shape)
    line_of_sight = sky_lines.beside_edge(searcher, edge_phase, parts * _reach(searcher, curve))
    conjugate, rim = _conjugate(searcher, line_of_sight, whole.order), _rim(searcher, curve, unbounded)
    place = {name: np.concatenate([rim[name][None], conjugate[name]]) for name in COORDINATES}
    line_of_sight = np.concatenate([curve.line_of_sight[None], line_of_sight])
    held = _hold([*place.values(), line_of_sight], ~np.isfinite(place["radius"]) & (radii < math.inf)[:, None])
    # The azimuth of the caustic is joined over b = 0, the others follow it.
    place["azimuth"][1:] += 2 * math.pi * np.round((place["azimuth"][:1] - place["azimuth"][1:2]) / (2 * math.pi))
    sky = search_sky(camera)
    place["time"], place["time_error"] = sky.viewer_time(place["time"], place["time_error"])
    shown = sky.to_viewer(sky_from_fido(searcher.frame(), -line_of_sight.reshape(-1, 3)))
    shown = shown.reshape(*line_of_sight.shape[:2], -1)
    if unbounded:
        shown[0] = math.nan
    remarks = (f"{held} of {parts.size} points hold the last one of their line, which falls in further out",)
    points = SpacePoints(spin=camera.spin, **place)
    return CausticTube(whole.order, points, shown, whole.closed, (*whole.remarks, *remarks[: held > 0]))


def _rim(searcher: Viewer, curve: Points, unbounded: bool) -> dict[str, Float[Array, " lines"]]:
    """The caustic on the celestial sphere, as the first row of a tube."""
    own = {
        "radius": np.full(len(curve), math.inf),
        "theta": curve.theta,
        "azimuth": curve.azimuth,
        "error": curve.error,
    }
    if unbounded:
        return dict.fromkeys(COORDINATES, np.full(len(curve), math.nan)) | own
    ends = _paths(searcher, curve.line_of_sight, 2)
    return {name: getattr(ends, name)[:, -1] for name in COORDINATES} | own


def _hold(tables: list[Array], lost: Bool[Array, "rows lines"]) -> int:
    """Fill the lost entries of tables (rows, lines, ...) from the rows above them, in place; how many there are."""
    for row in range(1, len(lost)):
        for table in tables:
            table[row, lost[row]] = table[row - 1, lost[row]]
    return int(lost.sum())


def _lines(curve: Points) -> Int[Array, " lines"]:
    """The points of a critical curve that are kept: even steps along the caustic and along the curve together."""
    on_caustic, on_sky = steps(curve.joined(curve[:1].shifted(1)))
    count = int(np.clip(on_caustic.sum() / _STEP, _FEWEST, _MOST))
    whole = on_caustic / max(on_caustic.sum(), 1e-300) + on_sky / on_sky.sum()
    along = np.concatenate([[0.0], np.cumsum(whole)[:-1]])
    return np.unique(np.searchsorted(along, np.arange(count) / count * whole.sum()).clip(0, len(curve) - 1))


def _parts_at(camera: Viewer, curve: Points, order: int, inverse: Float[Array, " rows"]) -> Float[Array, "rows lines"]:
    """Parts of the distance from critical curve to edge of rays with conjugate points at given 1/r."""
    from scipy.interpolate import PchipInterpolator

    sparse = np.unique(np.append(np.arange(0, len(curve), _SPARSE), len(curve) - 1))
    part = _search_parts(camera, curve)
    edge_phase = np.broadcast_to(curve.edge_phase[sparse], (len(part), len(sparse)))
    line_of_sight = sky_lines.beside_edge(camera, edge_phase, part[:, None] * _reach(camera, curve[sparse]))
    inverse_radius = 1 / _conjugate(camera, line_of_sight, order)["radius"]
    parts = np.stack([_part_at(inverse, part, known) for known in inverse_radius.T], axis=1)
    return PchipInterpolator(sparse, parts, axis=1)(np.arange(len(curve)))


def _part_at(
    inverse: Float[Array, " rows"], part: Float[Array, " parts"], known: Float[Array, " parts"]
) -> Float[Array, " rows"]:
    """Parts on one line, from 1/r of its conjugate points at some: close to the critical curve a power of 1 - part."""
    from scipy.interpolate import PchipInterpolator

    # Round-off may lose those next to the critical curve.
    start = np.isfinite(known).argmax()
    part, known = part[start:], known[start:]
    # To the first one that falls in, or has come round to the other side of the hole.
    rising = np.concatenate([[True], np.diff(known) > 0]) & np.isfinite(known)
    last = len(known) if rising.all() else int(np.argmin(rising))
    away, height = np.log(1 - part[:last]), np.log(known[:last])
    target = np.log(np.minimum(inverse, known[last - 1]))
    # Below the first one, on the straight line through the first two.
    low = np.minimum(target - height[0], 0) * (away[1] - away[0]) / (height[1] - height[0])
    met = 1 - np.exp(PchipInterpolator(height, away)(np.maximum(target, height[0])) + low)
    # A little further, where the radius may still be met: what is not found there is left out.
    step = part[last - 1] - part[last] if last < len(known) else 0.0
    beyond = np.clip((inverse - known[last - 1]) / max(known[last - 1] - known[last - 2], 1e-12), 0, 1)
    return met - step * beyond


def _search_parts(camera: Viewer, curve: Points) -> Float[Array, " parts"]:
    """Parts of the distance from shadow edge to critical curve at which conjugate points are looked for, falling."""
    edge = sky_lines.beside_edge(camera, curve.edge_phase, np.zeros(len(curve)))
    size = np.arctan2(np.hypot(edge[:, 1], edge[:, 2]), -edge[:, 0])
    # The reach of a line is pi less this size.
    scale = min(1.0, float((size / ((math.pi - size) * _reach(camera, curve))).min()))
    count = math.ceil(_PER_DECADE * math.log10(_OUTSIDE[-1] / (_SMALLEST * scale)))
    between = np.geomspace(_OUTSIDE[-1], _SMALLEST * scale, count + 1)[1:]
    return np.concatenate([_OUTSIDE, between, scale * _INSIDE])


def _reach(camera: Viewer, curve: Points) -> Float[Array, " lines"]:
    """Distances of a critical curve from the shadow edge, as parts of the length of the lines on the search sky."""
    edge = sky_lines.beside_edge(camera, curve.edge_phase, np.zeros(len(curve)))
    return angle_between(edge, curve.line_of_sight) / sky_lines.line_reach(camera, curve.edge_phase)


def _conjugate(
    camera: Viewer, line_of_sight: Float[Array, "rows lines 3"], order: int
) -> dict[str, Float[Array, "rows lines"]]:
    """The conjugate points of one order on rays, NaN where there is none."""
    points = _paths(camera, line_of_sight, _PLACES).conjugate
    if points.radius.shape[-1] < order:
        return dict.fromkeys(COORDINATES, np.full(line_of_sight.shape[:-1], math.nan))
    return {name: getattr(points, name)[..., order - 1] for name in COORDINATES}


def _paths(camera: Viewer, line_of_sight: Float[Array, "*batch 3"], places: int) -> RayPaths:
    return paths_of_directions(camera, sky_from_fido(camera.frame(), -line_of_sight), places)
