"""Derivatives of caustics by the hole and the viewer: implicit differentiation of the lens map.

A caustic is the image of the curve det J = 0. Where that moves with a parameter p, motion along itself means nothing;
taken at right angles, the place s on the sky moves by -(d det J at fixed s) grad det J / |grad det J|^2, and with it
the caustic. So move its extremes, where the caustic has no motion of its own in that coordinate, and its cusps, where
it has none at all.
"""

import math
from dataclasses import dataclass
from functools import partial, singledispatch

import numpy as np
from numpy.polynomial import chebyshev

from kerrcaustics.beams.ends import End, Wherever
from kerrcaustics.curves.caustic_search import check_orders
from kerrcaustics.curves.critical_curves import curves_of
from kerrcaustics.curves.critical_points import Points, Search
from kerrcaustics.curves.features import extreme_places, find_features
from kerrcaustics.curves.plane_caustics import Extreme, section_extremes
from kerrcaustics.lens_map.circles_in_plane import Crossings
from kerrcaustics.lens_map.domains import Domain, Ring, search_surface
from kerrcaustics.lens_map.expansions import REFINED, expanded, inverse, with_errors
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.results import declared
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

_RADII = ("r_min", "r_max")
_NAMES = ("theta_min", "theta_max", *_RADII, "phi_min", "phi_max")
_NOT_REFINED = "could not be refined between the points"
_OF_SEARCH = "is the end of the curve toward {toward}, one of the radii that were searched: it has no derivative"
_ON_CIRCLE = "is the end of the curve toward {toward}: its derivative is that of the place on the circle there"


@result(
    "caustic-derivatives/1",
    record="order parameters theta_min theta_max r_min r_max phi_min phi_max cusps error remarks",
)
class CausticDerivatives(Shown):
    """Derivatives of the cusps and extremes of one caustic with respect to the viewer's parameters.

    In the plane a caustic is one piece of a section, whose cusps are not searched for.
    """

    order: int = quantity("", "1", "order of the caustic")
    parameters: tuple[str, ...] = quantity(
        "parameter",
        "",
        "parameters of the derivatives, angles in radians: spin, radius, inclination (no radius for an Observer at "
        "infinity)",
    )
    cusps: Array = quantity("cusp_number angle parameter", "1", "derivatives of (theta', unwrapped phi') of the cusps")
    theta_min: Array = quantity("parameter", "1", "derivatives of the least theta'; 0 in the plane")
    theta_max: Array = quantity("parameter", "1", "derivatives of the largest theta'; 0 in the plane")
    r_min: Array = quantity("parameter", "1", "derivatives of the least radius; 0 on a sphere")
    r_max: Array = quantity("parameter", "1", "derivatives of the largest radius; 0 on a sphere")
    phi_min: Array = quantity("parameter", "1", "derivatives of the least phi'")
    phi_max: Array = quantity("parameter", "1", "derivatives of the largest phi'")
    error: float = quantity("", "1", "estimated error of all derivatives, relative to the largest of each")
    surface: End = declared.surface()
    remarks: tuple[str, ...] = declared.remarks("remarks on what is unknown (NaN), and why", default=())

    @property
    @derived("parameter", "1")
    def theta_extent(self) -> Array:
        """The derivative of the width in theta'."""
        return self.theta_max - self.theta_min

    @property
    @derived("parameter", "1")
    def phi_extent(self) -> Array:
        """The derivative of the width in phi'."""
        return self.phi_max - self.phi_min


@dataclass(frozen=True)
class _CausticPoints:
    """Points of critical curves: places on the sky of the search camera and on the surface.

    second_arrival: True for rays that meet the surface for the second time.
    """

    sky: Float[Array, "spots axes"]
    place: Float[Array, "spots 2"]
    second_arrival: Bool[Array, " spots"]


@dataclass(frozen=True)
class _Curve:
    """The features of a caustic whose derivatives are requested.

    order: order of the caustic.
    cusps: its cusps.
    extremes: by name, points at Chebyshev nodes about each extreme, and its place among them, -1 to 1.
    ends: by name, extremes of phi that are ends of an open curve, on a circle in the plane.
    fixed: names of extremes that are those of the surface itself.
    unknown: names of extremes without a derivative.
    remarks: remarks on these extremes.
    """

    order: int
    cusps: _CausticPoints
    extremes: dict[str, tuple[_CausticPoints, float]]
    ends: dict[str, _CausticPoints]
    fixed: tuple[str, ...]
    unknown: tuple[str, ...]
    remarks: tuple[str, ...]


@usual_warnings
def caustic_derivatives(
    camera: Viewer, orders: int = 3, *, end: Wherever | End = math.inf
) -> tuple[CausticDerivatives, ...]:
    """Derivatives of cusps and extents of the caustics of order 1 to `orders` with respect to the viewer's parameters.

    Parameters
    ----------
    camera : Camera or Observer
        Its velocity does not affect caustics.
    orders : int
        As for `caustics`.
    end : float, Sphere or EquatorialPlane
        Surface of the sources, as for `caustics`.

    Returns
    -------
    tuple of CausticDerivatives
        One for each caustic that `caustics` finds, in that order; the cusps in the order of its cusps.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `CausticDerivatives.error`: as for `image_derivatives`, plus the truncation error of the polynomials about the
    extremes.

    Notes
    -----
    If a section in the plane ends, toward the horizon or far out, its extreme radius is one of those that were
    searched, and has no derivative. The derivative of phi' there is the motion of the end on the circle of this radius.
    `remarks` lists the extremes that are ends.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> (primary,) = kc.caustic_derivatives(camera, orders=1)
    >>> primary.parameters, primary.cusps.shape
    (('spin', 'radius', 'inclination'), (4, 2, 3))
    """
    check_viewer(camera)
    check_orders(orders)
    search_map = SearchMap.for_viewer(camera, search_surface(camera, end), "auto")
    return tuple(_of_curve(search_map, curve) for curve in _curves_on(search_map.domain, search_map, int(orders)))


@singledispatch
def _curves_on(domain: Domain, search_map: SearchMap, orders: int) -> list[_Curve]:
    """The caustics on a surface: by lines across the shadow edge on spheres."""
    curves = curves_of(search_map, orders)
    search = curves.search()
    features, places = find_features(search, curves), extreme_places(search, curves)
    curves_on = []
    for order in (curve.order for curve in curves):
        known = {name: (_spots(search, nodes), at) for (k, name), (nodes, at) in places.items() if k == order}
        unknown = tuple(name for name in _NAMES if name not in known and name not in _RADII)
        cusps = _joined([_spots(search, point) for point, _ in features[order].cusps], search.camera)
        remarks = tuple(f"{name} {_NOT_REFINED}" for name in unknown)
        curves_on.append(_Curve(order, cusps, known, {}, _RADII, unknown, remarks))
    return curves_on


@_curves_on.register
def _sections_in_ring(domain: Ring, search_map: SearchMap, orders: int) -> list[_Curve]:
    camera = domain.camera
    return [_section(camera, order, extremes) for order, extremes in section_extremes(domain.circles, orders)]


def _section(camera: Viewer, order: int, extremes: dict[str, Extreme]) -> _Curve:
    """A curve in the plane."""
    known = {name: (_crossing_spots(camera, at.nodes), at.place) for name, at in extremes.items() if at.refined}
    at_ends = {name: at for name, at in extremes.items() if at.toward}
    ends = {name: _crossing_spots(camera, at.nodes) for name, at in at_ends.items() if name not in _RADII}
    remarks = [f"{name} {_ON_CIRCLE if name in ends else _OF_SEARCH}" for name, at in at_ends.items()]
    remarks = [remark.format(toward=at_ends[remark.split()[0]].toward) for remark in remarks]
    lost = [name for name, at in extremes.items() if not at.refined and not at.toward]
    remarks += [f"{name} {_NOT_REFINED}" for name in lost]
    unknown = (*lost, *(name for name in at_ends if name not in ends))
    return _Curve(order, _joined([], camera), known, ends, ("theta_min", "theta_max"), unknown, tuple(remarks))


def _spots(search: Search, points: Points) -> _CausticPoints:
    camera = search.camera
    sky = camera.places(sky_from_fido(camera.frame(), -points.line_of_sight))
    _, second_arrival = search.domain.line_of_sight(points.edge_phase, points.depth)
    return _CausticPoints(sky, np.stack([points.theta, points.azimuth], axis=-1), second_arrival)


def _crossing_spots(camera: Viewer, points: Crossings) -> _CausticPoints:
    place = np.stack([points.radius, points.azimuth], axis=-1)
    return _CausticPoints(camera.places(points.sky), place, np.zeros(len(points), bool))


def _joined(parts: list[_CausticPoints], camera: Viewer) -> _CausticPoints:
    axes = camera.places(np.zeros((0, 3))).shape[-1]
    none = _CausticPoints(np.empty((0, axes)), np.empty((0, 2)), np.empty(0, bool))
    every = [none, *parts]
    return _CausticPoints(
        np.concatenate([part.sky for part in every]),
        np.concatenate([part.place for part in every]),
        np.concatenate([part.second_arrival for part in every]),
    )


def _of_curve(search_map: SearchMap, curve: _Curve) -> CausticDerivatives:
    """The derivatives of one caustic."""
    camera = search_map.camera
    count = len(camera.parameters)
    parts = [curve.cusps, *(nodes for nodes, _ in curve.extremes.values()), *curve.ends.values()]
    moved, on_circle, errors = _moved(search_map, _joined(parts, camera))
    cuts = np.cumsum([len(part.sky) for part in parts])[:-1]
    of_cusps, *pieces = np.split(moved, cuts)
    ends = len(moved) - len(curve.ends)
    values = dict.fromkeys(curve.unknown, np.full(count, np.nan)) | dict.fromkeys(curve.fixed, np.zeros(count))
    values |= dict(zip(curve.ends, on_circle[ends:], strict=True))
    error = max(errors[:ends, 0].max(initial=0.0), errors[ends:, 1].max(initial=0.0))
    for (name, (_, at)), piece in zip(curve.extremes.items(), pieces, strict=False):
        values[name], left = _at_extreme(piece[:, int(name.startswith("phi"))], at)
        error = max(error, left)
    return CausticDerivatives(
        order=curve.order,
        parameters=camera.parameters,
        cusps=of_cusps,
        **values,
        error=float(error),
        surface=search_map.surface,
        remarks=curve.remarks,
    )


def _at_extreme(piece: Float[Array, "nodes numbers"], at: float) -> tuple[Float[Array, " numbers"], float]:
    """Values at a place among Chebyshev nodes, and what the polynomial leaves open, relative to its largest."""
    coefficients = chebyshev.chebfit(chebyshev.chebpts1(len(piece)), piece, len(piece) - 1)
    return np.asarray(chebyshev.chebval(at, coefficients)), float(
        np.abs(coefficients[-3:]).max() / np.abs(coefficients).max()
    )


def _moved(search_map: SearchMap, spots: _CausticPoints) -> tuple[Array, Array, Float[Array, "spots 2"]]:
    """Motion of points of caustics as of `_of_points`, and errors relative to the largest part of each."""
    camera, error = search_map.camera, REFINED * np.linalg.norm(spots.sky, axis=1)
    (moved, on_circle), errors = with_errors(partial(_of_points, search_map, spots), camera, spots.sky, error)
    return moved, on_circle, errors


def _of_points(
    search_map: SearchMap,
    spots: _CausticPoints,
    sky: Float[Array, "rays axes"],
    number: Int[Array, " rays"],
    density: float,
) -> tuple[Float[Array, "rays 2 numbers"], Float[Array, "rays numbers"]]:
    """Motion of places on a caustic by the numbers, its critical curve moving at right angles to itself.

    Also that of the second coordinate where the first one stays, as the point glides along the caustic. number: of the
    point that each ray belongs to.
    """
    surface = search_map.surface
    at = expanded(search_map.camera, surface, sky, density, spots.second_arrival[number])
    gradient, tangents = at.sky[:, 4], surface.tangents(spots.place[number])
    to_places = inverse(tangents) @ at.sky[:, : tangents.shape[1]]
    pace = at.given[:, 4] / np.sum(gradient**2, axis=-1, keepdims=True)
    across = np.einsum("iaj,ij->ia", to_places, gradient)
    along = np.einsum("iaj,ij->ia", to_places, gradient[:, ::-1] * [-1, 1])
    moved = inverse(tangents) @ at.given[:, : tangents.shape[1]] - across[:, :, None] * pace[:, None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = along[:, 1:] / along[:, :1]
    return moved, moved[:, 1] - slope * moved[:, 0]
