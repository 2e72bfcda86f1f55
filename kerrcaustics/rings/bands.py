"""Photon rings: the lensing bands of all orders about the shadow edge, with their errors and a certificate.

The band of order n holds the directions whose light comes from matter in the equatorial plane at crossing n + 1 of it,
counted backward along the ray. Its edges are images of the circles that bound the matter (lens_map/plane_edges.py); the
horizon and infinity are circles like others.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kerrcaustics.lens_map.plane_edges import CrossingCircles, PlaneEdges, edge_phase_of, plane_edges
from kerrcaustics.lens_map.search_sky import SearchSky, search_sky
from kerrcaustics.lens_map.sky_lines import lines_across
from kerrcaustics.numerics import fourier
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.rings.band_edge import BandEdge
from kerrcaustics.rings.certificate import met_once, wrong_rays
from kerrcaustics.rings.results import PhotonBand, PhotonRings, RingEdge
from kerrcaustics.rings.shape import Area, area_between, centroid_of
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import argument_named, quoted, real_number, whole_number
from kerrcaustics.spacetime.frame import photon_of
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.photon_shell import exponents
from kerrcaustics.spacetime.viewer import Viewer, check_viewer

Array = np.ndarray

# Highest order: without spin the distance of its edges from the shadow edge, 1e-12, has a few digits.
_MOST_ORDER = 9
# Angle from the plane, radians, below which edges run along it beside the middle of the hole.
_NEAR_PLANE = 1e-3


@usual_warnings
@argument_named("camera", "viewer")
def photon_rings(
    viewer: Viewer, *, max_order: int = 3, inner: float | str | None = None, outer: float = math.inf
) -> PhotonRings:
    """Lensing bands: the regions of the sky in which matter in the equatorial plane is seen, order by order.

    Parameters
    ----------
    viewer : Camera or Observer
    max_order : int
        Highest order n, 0 to 9. Order 0 is the direct image, at the first crossing of the plane.
    inner : float or "isco", optional
        Radius of the inner edge of the matter, outside the horizon; "isco" for the innermost stable orbit. If omitted,
        the horizon.
    outer : float
        Radius of the outer edge of the matter, which may be infinite.

    Returns
    -------
    PhotonRings
        The bands, and the shadow edge with the exponents by which one order follows from the other.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    Edges are good to about 1e-13 of their distance from the shadow edge, next to the plane and for spins close to 1 to
    1e-8 at worst; `BandEdge.error` says it, and `PhotonBand.solid_angle_error` what follows for the area.

    Notes
    -----
    No ray is traced to find the edges: they are roots of Mino time. The certificate does trace rays. A viewer in the
    plane sees the limit of one who comes from the north: the upper half of crossing n + 1 with the lower half of
    crossing n, joined along the plane. To a distant viewer an infinite plane has no outer edge at order 0.

    References
    ----------
    Gralla & Lupsasca 2020, arXiv:1910.12873, for lensing bands and the exponents; derived here: the equation.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> rings = kc.photon_rings(kc.Observer(spin=0.94, inclination=0.3), outer=50.0)
    >>> [round(band.solid_angle, 4) for band in rings[1:]]
    [46.268, 2.7282, 0.2087]
    """
    check_viewer(viewer)
    highest = whole_number("max_order", max_order, 0, _MOST_ORDER)
    radii = _checked_radii(viewer, inner, outer)
    sky = search_sky(viewer)
    images = _BandSearch.on_sky(sky, highest, radii)
    bands = tuple(images.band(order) for order in range(highest + 1))
    remarks = (*_remarks(viewer, images.count), *(f"order {b.order}: {text}" for b in bands for text in b.remarks))
    return PhotonRings(bands, viewer, *radii, _edge(sky, images.chi), remarks)


def _checked_radii(viewer: Viewer, inner: float | str | None, outer: float) -> tuple[float, float]:
    """The radii of the circles that bound the matter."""
    horizon = kerr.horizon(viewer.spin)
    if isinstance(inner, str):
        if inner != "isco":
            raise ValueError(f'Argument `inner` must be a radius, "isco" or None, but is {quoted(inner)}.')
        least = kerr.isco(viewer.spin)
    else:
        least = horizon if inner is None else real_number("inner", inner)
    if inner is not None and not horizon < least < math.inf:
        raise ValueError(
            f"Argument `inner` must be finite and larger than the horizon radius {horizon:.12g}, but is "
            f"{quoted(inner)}; None stands for the horizon."
        )
    most = real_number("outer", outer)
    if not most > least:
        raise ValueError(f"Argument `outer` must be larger than the inner radius {least:.12g}, but is {quoted(outer)}.")
    return least, most


@dataclass(frozen=True)
class _BandSearch:
    """Images of both circles at all crossings.

    sky: the sky that is searched.
    radii: radii of the circles.
    circles: all of them with their crossings.
    edges: their images.
    met_once: True for images that each line meets once.
    wrong: number of rays beside each image that end on the wrong side.
    """

    sky: SearchSky
    radii: tuple[float, float]
    circles: CrossingCircles
    edges: PlaneEdges
    met_once: Bool[Array, " circles"]
    wrong: Array

    @classmethod
    def on_sky(cls, sky: SearchSky, highest: int, radii: tuple[float, float]) -> "_BandSearch":
        """The images up to an order; those that a distant viewer sees at the end of its sky are left out."""
        camera = sky.search_camera
        crossing, side = (part.ravel() for part in np.indices((highest + 1, 2)))
        radius = np.array(radii)[side]
        far = isinstance(camera, Observer) & (crossing == 0) & (side == 1) & _is_far(camera, radii[1])
        circles = CrossingCircles(crossing[~far] + 1, radius[~far])
        edges = plane_edges(camera, circles)
        return cls(sky, radii, circles, edges, met_once(camera, circles), wrong_rays(camera, circles, edges))

    @property
    def count(self) -> int:
        """Number of lines."""
        return len(self.edges.distance)

    @property
    def chi(self) -> Float[Array, " lines"]:
        """The values of chi of lines."""
        return fourier.nodes(self.count)

    def band(self, order: int) -> PhotonBand:
        """The band of an order."""
        inner, outer = (self._edge(order, radius) for radius in self.radii)
        doubts = tuple(dict.fromkeys(text for radius in self.radii for text in self._doubts(order, radius)))
        edges = tuple(edge for edge in (inner, outer) if edge is not None and inner is not None)
        centroid, area = np.full(self.sky.to_viewer(np.eye(3)[:1]).shape[1], np.nan), Area(math.nan, math.nan)
        if inner is not None and outer is not None:
            centroid, area = centroid_of(inner, outer), area_between(inner, outer)
        elif inner is not None and self._endless(order) and isinstance(self.sky.viewer, Observer):
            area = Area(math.inf, math.nan)
        certified = not doubts and bool(edges)
        return PhotonBand(self.sky.viewer, order, edges, *area, centroid, certified, doubts)

    def _endless(self, order: int) -> bool:
        """True if the outer circle is at the end of the sky at this order."""
        return not len(self._columns(order, self.radii[1]))

    def _columns(self, order: int, radius: float) -> list[int]:
        """The images from which an edge is made: in the plane two, but for the direct image; none if one is missing."""
        crossings = [order + 1, order] if self.sky.viewer.on_equator and order else [order + 1]
        which = zip(self.circles.crossing.tolist(), self.circles.radius.tolist(), strict=True)
        places = {key: column for column, key in enumerate(which)}
        columns = [places[crossing, radius] for crossing in crossings if (crossing, radius) in places]
        return columns if len(columns) == len(crossings) else []

    def _doubts(self, order: int, radius: float) -> Iterator[str]:
        """What speaks against an edge."""
        columns, name = self._columns(order, radius), f"r = {radius:.9g}"
        if not columns:
            return
        if np.isnan(self.edges.distance[:, columns]).any():
            yield f"{name}: not every line meets the edge"
            return
        if not self.met_once[columns].all():
            yield f"{name}: some lines meet the edge more than once"
        if (self.edges.slope[:, columns] >= 0).any():
            yield f"{name}: the slope changes its sign along the edge"
        if not self.edges.agrees[columns].all():
            yield f"{name}: {self.count} lines and half as many do not agree"
        if wrong := int(self.wrong[columns].sum()):
            yield f"{name}: {wrong} rays beside the edge end on the wrong side"

    def _edge(self, order: int, radius: float) -> BandEdge | None:
        """An edge; None where it is not found, or lies at the end of the sky."""
        columns, camera = self._columns(order, radius), self.sky.search_camera
        if not columns or np.isnan(self.edges.distance[:, columns]).any():
            return None
        lines = lines_across(camera, edge_phase_of(camera, self.chi))
        distance, error = self.edges.distance[:, columns[0]].copy(), self.edges.error[:, columns[0]].copy()
        if camera.on_equator:
            lower = self.chi > np.pi
            beyond = lines.first if camera.radius > radius else lines.last
            distance[lower] = self.edges.distance[lower, columns[1]] if order else beyond[lower]
            error[lower] = self.edges.error[lower, columns[1]] if order else 0.0
        sky = lines.sky(distance)
        place, error = self.sky.to_viewer(sky), self.sky.errors(sky, error)
        return BandEdge(self.sky.viewer, order, radius, place, error, lines.edge_phase, distance)


def _is_far(camera: Viewer, radius: float) -> bool:
    """True for circles whose direct image lies at the end of the sky of a distant observer."""
    return radius == math.inf or (camera.on_equator and radius >= camera.radius)


def _edge(sky: SearchSky, chi: Float[Array, " lines"]) -> RingEdge:
    """The shadow edge with its exponents."""
    camera = sky.search_camera
    lines = lines_across(camera, edge_phase_of(camera, chi))
    b = np.asarray(photon_of(camera.frame(), tuple(lines.start.T)).b)
    orbit, _ = kerr.spherical_orbit_of_impact(camera.spin, b)
    along = exponents(camera.spin, b)
    return RingEdge(
        sky.viewer, sky.to_viewer(lines.start), lines.edge_phase, b, orbit, along.gamma, along.delta, along.tau
    )


def _remarks(viewer: Viewer, count: int) -> Iterator[str]:
    """Remarks on the place of the viewer."""
    off_plane = abs(viewer.inclination - math.pi / 2)
    if viewer.on_equator:
        yield "the viewer lies in the plane: the bands are the limit from the north"
    elif off_plane < _NEAR_PLANE:
        yield f"the viewer is within {off_plane:.1e} rad of the plane, along which edges run: {count} lines were used"
    if kerr.static_slowness(viewer.spin, min(viewer.radius, 1e9), viewer.cos_theta) <= 0:
        yield "the viewer is in the ergosphere: directions of light without positive energy belong to no band"
