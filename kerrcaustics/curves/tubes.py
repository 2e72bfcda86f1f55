"""Caustic tubes: the caustics of a camera's past light cone, from the celestial sphere down to the hole.

The tube of order k is the set of all k-th conjugate points. On a line of sky_lines.py the k-th conjugate point comes in
from infinity as the ray moves from the critical curve toward the shadow edge, passes the photon orbits where the ray is
on the edge, and falls to the horizon with the rays inside the shadow. Its 1 / r grows all the way, so a line and a
radius name a point of the tube.
"""

import math

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import PchipInterpolator

from kerrcaustics.beams.paths import SpacePoints, ray_paths
from kerrcaustics.curves.caustic_search import check_orders
from kerrcaustics.curves.critical_curves import CriticalCurve, critical_curves, steps
from kerrcaustics.curves.critical_points import Points
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import check_camera
from kerrcaustics.spacetime.checks import numbers
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Steps along the caustic between neighbouring lines, in radians; fewest and most lines round a tube.
_STEP = math.radians(2.0)
_FEWEST, _MOST = 160, 900
# Every so many lines are searched for the rays whose conjugate points lie at the wanted radii.
_SPARSE = 4
# Distances from the shadow edge of the search: outside it as parts of that of the critical curve, from 1 down to a
# hundredth of the size of the shadow; inside it as parts of the size of the shadow. Where the curve is closer to the
# edge than that size, as it is for all orders but the first seen from afar, the curve's distance takes its place.
_OUTSIDE, _SMALLEST, _PER_DECADE = np.append(1 - np.geomspace(1e-3, 0.1, 6), np.linspace(0.8, 0.1, 8)), 0.01, 10
_INSIDE = -np.geomspace(0.01, 3, 26)
# Places at which a ray is looked at for its conjugate points.
_PLACES = 24
# The last radius, above the horizon, and the radius that lies halfway between hole and infinity in the usual rows.
_ABOVE_HORIZON = 0.4
_USUAL_SCALE, _USUAL_ROWS = 6.0, 48


@result("tube/1")
class CausticTube:
    """A caustic of the past light cone, in space: a surface of conjugate points.

    The first row is the caustic on the celestial sphere, at infinite radius; the others are about at the radii asked
    for. Along the lines the tube closes: the first one is not repeated. A line that falls into the hole before the last
    radii holds its last point there.
    """

    order: int = quantity("", "1", "1 primary, 2 secondary, and on")
    points: SpacePoints = quantity("row line", "", "the surface", column="")
    sky: np.ndarray = quantity("row line axis", "1", "camera-sky directions N of the rays through the points")
    closed: bool = quantity("", "1", "True when the whole critical curve was found")

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
def caustic_tubes(
    camera: Viewer, orders: int = 2, radii: Float[Array, " rows"] | None = None
) -> tuple[CausticTube, ...]:
    """The caustics of a camera's past light cone as surfaces in space, primary first.

    Parameters
    ----------
    camera : Camera
        Its velocity moves the rays on its sky, and leaves the tubes alone.
    orders : int
        How many, 1 to 10; those that cannot be found are left out.
    radii : (rows,) array, optional
        Where the tube is wanted, falling from math.inf. Left out, 48 radii to 0.4 above the horizon.

    Returns
    -------
    tuple of CausticTube

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    Every point is a conjugate point, in error as `ray_paths` says; its radius misses the one asked for by a few
    hundredths of it, and more in the last rows.

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
    check_camera(camera)
    check_orders(orders)
    radii = usual_radii(camera.spin) if radii is None else numbers("radii", radii)
    falling = radii.ndim == 1 and len(radii) > 1 and np.all(radii[1:] < radii[:-1])
    if not (falling and radii[0] == math.inf and radii[-1] > kerr.horizon(camera.spin)):
        raise ValueError("Argument `radii` must fall from math.inf to a radius outside the horizon.")
    return tuple(_tube(camera, curve, radii) for curve in critical_curves(camera, int(orders)))


def _tube(camera: Viewer, whole: CriticalCurve, radii: Float[Array, " rows"]) -> CausticTube:
    curve = whole.points[_lines(whole.points)]
    reach = np.exp(-curve.depth)
    parts = _parts_at(camera, curve, whole.order, 1 / radii[1:])
    edge_phase = np.broadcast_to(curve.edge_phase, parts.shape)
    line_of_sight = sky_lines.beside_edge(camera.at_rest(), edge_phase, parts * reach)
    found = _conjugate(camera, line_of_sight, whole.order)
    # Filled from the row above where the ray has fallen in.
    place = np.stack([found.mino_time, found.radius, found.theta, found.azimuth])
    rim = np.stack([0 * reach, np.full(len(curve), math.inf), curve.theta, curve.azimuth])
    place = np.concatenate([rim[:, None], place], axis=1)
    line_of_sight = np.concatenate([curve.line_of_sight[None], line_of_sight])
    for row in range(1, len(radii)):
        lost = ~np.isfinite(place[1, row])
        place[:, row, lost], line_of_sight[row, lost] = place[:, row - 1, lost], line_of_sight[row - 1, lost]
    # The azimuth of the caustic is joined over b = 0, the others follow it.
    turns = np.round((place[3, :1] - place[3, 1:2]) / (2 * math.pi))
    place[3, 1:] += 2 * math.pi * turns
    place[0, 0] = math.nan
    names = ("mino_time", "radius", "theta", "azimuth")
    points = SpacePoints(spin=camera.spin, **dict(zip(names, place, strict=True)))
    return CausticTube(whole.order, points, sky_from_fido(camera.frame(), -line_of_sight), whole.closed)


def _lines(curve: Points) -> Int[Array, " lines"]:
    """The points of a critical curve that are kept: even steps along the caustic and along the curve together."""
    on_caustic, on_sky = steps(curve.joined(curve[:1].shifted(1)))
    count = int(np.clip(on_caustic.sum() / _STEP, _FEWEST, _MOST))
    whole = on_caustic / max(on_caustic.sum(), 1e-300) + on_sky / on_sky.sum()
    along = np.concatenate([[0.0], np.cumsum(whole)[:-1]])
    return np.unique(np.searchsorted(along, np.arange(count) / count * whole.sum()).clip(0, len(curve) - 1))


def _parts_at(camera: Viewer, curve: Points, order: int, inverse: Float[Array, " rows"]) -> Float[Array, "rows lines"]:
    """Parts of the distance from critical curve to edge of rays with conjugate points at given 1/r."""
    sparse = np.unique(np.append(np.arange(0, len(curve), _SPARSE), len(curve) - 1))
    part = _searched(camera, curve)
    edge_phase = np.broadcast_to(curve.edge_phase[sparse], (len(part), len(sparse)))
    line_of_sight = sky_lines.beside_edge(camera.at_rest(), edge_phase, part[:, None] * np.exp(-curve.depth[sparse]))
    found = 1 / _conjugate(camera, line_of_sight, order).radius
    parts = np.empty((len(inverse), len(sparse)))
    for column, known in enumerate(found.T):
        # To the first one that falls in, or has come round to the other side of the hole.
        rising = np.concatenate([[True], np.diff(known) > 0]) & np.isfinite(known)
        last = len(known) if rising.all() else int(np.argmin(rising))
        curve_of = PchipInterpolator(np.append(0.0, known[:last]), np.append(1.0, part[:last]))
        # A little further, where the radius may still be met: what is not found there is left out.
        step = part[last - 1] - part[last] if last < len(known) else 0.0
        beyond = np.clip((inverse - known[last - 1]) / max(known[last - 1] - known[last - 2], 1e-12), 0, 1)
        parts[:, column] = curve_of(np.minimum(inverse, known[last - 1])) - step * beyond
    return PchipInterpolator(sparse, parts, axis=1)(np.arange(len(curve)))


def _searched(camera: Viewer, curve: Points) -> Float[Array, " parts"]:
    """Parts of the distance from shadow edge to critical curve at which conjugate points are looked for, falling."""
    edge = sky_lines.beside_edge(camera.at_rest(), curve.edge_phase, np.zeros(len(curve)))
    size = np.arctan2(np.hypot(edge[:, 1], edge[:, 2]), -edge[:, 0])
    # The reach of a line is pi less this size.
    scale = min(1.0, float((size / ((math.pi - size) * np.exp(-curve.depth))).min()))
    count = math.ceil(_PER_DECADE * math.log10(_OUTSIDE[-1] / (_SMALLEST * scale)))
    between = np.geomspace(_OUTSIDE[-1], _SMALLEST * scale, count + 1)[1:]
    return np.concatenate([_OUTSIDE, between, scale * _INSIDE])


def _conjugate(camera: Viewer, line_of_sight: Float[Array, "rows lines 3"], order: int) -> SpacePoints:
    """The conjugate points of one order on rays, NaN where there is none."""
    still = camera.at_rest()
    points = ray_paths(still, sky_from_fido(still.frame(), -line_of_sight), _PLACES).conjugate
    names = ("mino_time", "radius", "theta", "azimuth")
    missing = points.radius.shape[-1] < order
    parts = [
        np.full(line_of_sight.shape[:-1], math.nan) if missing else getattr(points, n)[..., order - 1] for n in names
    ]
    return SpacePoints(spin=camera.spin, **dict(zip(names, parts, strict=True)))
