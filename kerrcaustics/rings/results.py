"""Photon rings as users keep them: lensing bands, the shadow edge with its exponents, masks, projected diameters."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.lens_map.plane_edges import crossing_gap
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.results import declared
from kerrcaustics.results.declared import derived, quantity, result, usual_warnings
from kerrcaustics.results.shown import Items, Shown
from kerrcaustics.rings.band_edge import BandEdge
from kerrcaustics.rings.shape import support
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.checks import numbers
from kerrcaustics.spacetime.frame import line_of_sight_from_sky, photon_of
from kerrcaustics.spacetime.observer import Observer
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


class Diameters(NamedTuple):
    """Projected diameters at angles, M.

    edge: of the shadow edge.
    inner: of the inner edges, order by order; NaN where there is none.
    outer: of the outer edges.
    """

    edge: Float[Array, "*batch"]
    inner: Float[Array, " order *batch"]
    outer: Float[Array, " order *batch"]


@result("ring-edge/1", points="sky edge_phase impact orbit lyapunov rotation delay")
class RingEdge(Shown):
    """The shadow edge, where photon rings of all orders lie in the limit, and what repeats from order to order.

    From one order to the next the distance from the edge shrinks by exp(lyapunov), the azimuth in the plane grows by
    `rotation`, and the light is later by `delay`.
    """

    camera: Viewer = declared.viewer(json=None)
    sky: Array = quantity("node axis", "1", "directions N of the shadow edge, in order; of an Observer (alpha, beta)")
    edge_phase: Array = quantity("node", "rad", "parameter of the shadow edge")
    impact: Array = quantity("node", "GM/c^2", "axial angular momentum b over energy of the photons")
    orbit: Array = quantity("node", "GM/c^2", "radius of their spherical orbits")
    lyapunov: Array = quantity("node", "1", "gamma: e-foldings by which the distance from the edge shrinks per order")
    rotation: Array = quantity(
        "node",
        "rad",
        "delta: azimuth gained backward along the ray per order, as phi'; minus that of Gralla & Lupsasca",
    )
    delay: Array = quantity("node", "GM/c^3", "tau: travel time gained per order")


@result("photon-band/1", record="order certified remarks solid_angle solid_angle_error centroid", points="rims")
class PhotonBand(Shown):
    """The lensing band of order n: all directions whose light comes from the matter at its crossing n + 1 of the plane.

    The matter lies between two circles in the equatorial plane, whose images are the edges of the band.
    """

    camera: Viewer = declared.viewer(json=None)
    order: int = quantity("", "1", "order n, from 0; crossing n + 1 of the plane")
    rims: tuple[BandEdge, ...] = quantity(
        "rim",
        "",
        "the images of the inner and of the outer circle; the outer one is left out where it is not found, or is as "
        "far as the sky of an Observer goes",
    )
    solid_angle: float = quantity("", "solid angle", "area between the edges; infinite without an outer edge")
    solid_angle_error: float = quantity("", "solid angle", "estimated error of solid_angle")
    centroid: Array = quantity(
        "axis", "1", "centroid of the band if it is uniformly bright: (alpha, beta), or a direction N; else NaN"
    )
    certified: bool = declared.certified(
        "True if each line across the shadow edge meets each edge once, nodes and half as many agree, and rays beside "
        "the edges end on the right sides of the circles"
    )
    remarks: tuple[str, ...] = declared.remarks()

    @property
    def inner(self) -> BandEdge | None:
        """The inner edge; None where it was not found."""
        return self.rims[0] if self.rims else None

    @property
    def outer(self) -> BandEdge | None:
        """The outer edge; None where it was not found, or is as far as the sky of an Observer goes."""
        return self.rims[1] if len(self.rims) > 1 else None

    def __repr__(self) -> str:
        """Summary in one line."""
        what = "certified" if self.certified else "not certified"
        return f"<PhotonBand of order {self.order}, solid angle {self.solid_angle:.9g}, {what}>"

    @usual_warnings
    def width(self, angle: ArrayLike) -> Array:
        """Width of the band across its edges, where their normal has an angle on the screen of an Observer.

        Parameters
        ----------
        angle : (...) array
            Angles from alpha toward beta, radians.

        Returns
        -------
        (...) array
            Difference of the largest projections of both edges, M.

        Raises
        ------
        ValueError
            If the viewer is a camera, or the band has no two edges.

        Errors
        ------
        The sum of the errors of both edges (`BandEdge.error`).
        """
        _check_screen(self.camera, "width")
        inner, outer = both_edges(self)
        angles = numbers("angle", angle)
        flat = angles.ravel()
        return (support(outer, flat) - support(inner, flat)).reshape(angles.shape)


@result("photon-rings/1", record="inner outer certified remarks bands", points="edge")
class PhotonRings(Items[PhotonBand]):
    """Lensing bands of one viewer, order by order, with the shadow edge: a sequence of `PhotonBand`."""

    bands: tuple[PhotonBand, ...] = quantity("order", "", "the bands, from order 0")
    camera: Viewer = declared.viewer(json=None)
    inner: float = quantity("", "GM/c^2", "radius of the inner circle of the matter")
    outer: float = quantity("", "GM/c^2", "radius of the outer circle of the matter")
    edge: RingEdge = quantity("", "", "the shadow edge", column="edge")
    remarks: tuple[str, ...] = declared.remarks("remarks on the viewer, and on what is in doubt")

    @property
    @derived("", "1")
    def certified(self) -> bool:
        """True if all bands are certified."""
        return all(band.certified for band in self.bands)

    @usual_warnings
    def diameter(self, angle: ArrayLike) -> Diameters:
        """Interferometric diameters: the full widths of curves when projected onto a direction of the screen.

        Parameters
        ----------
        angle : (...) array
            Angles of the direction from alpha toward beta, radians.

        Returns
        -------
        Diameters
            Of the shadow edge (...), and of both edges of each band (order, ...), M.

        Raises
        ------
        ValueError
            If the viewer is a camera.

        Errors
        ------
        Twice the error of each curve (`BandEdge.error`); that of the shadow edge 1e-14.
        """
        _check_screen(self.camera, "diameter")
        angles = numbers("angle", angle)
        flat = angles.ravel()

        def widths(edge: BandEdge | None) -> Array:
            if edge is None:
                return np.full(angles.shape, np.nan)
            return (support(edge, flat) + support(edge, flat + math.pi)).reshape(angles.shape)

        shadow = widths(shadow_curve(self.edge))
        return Diameters(
            shadow, *(np.stack([widths(getattr(b, side)) for b in self.bands]) for side in ("inner", "outer"))
        )

    @usual_warnings
    def mask(self, view: Any) -> Bool[Array, " order *batch"]:
        """True for directions in each band.

        Parameters
        ----------
        view : View, Screen or (..., axes) array
            Pixels, or directions N; of an Observer places (alpha, beta).

        Returns
        -------
        (order, ...) array of bool
            For each order, True where the light at that crossing comes from between both circles.

        Raises
        ------
        ValueError
            If `view` is neither, or belongs to another kind of viewer.
        """
        places = _places_of(self.camera, view)
        sky = search_sky(self.camera)
        directions = sky.to_search(places.reshape(-1, places.shape[-1]))
        camera = sky.search_camera
        photon = photon_of(camera.frame(), tuple(directions.T))
        made = [
            _within(camera, directions, band.order, self.outer) & ~_within(camera, directions, band.order, self.inner)
            for band in self.bands
        ]
        return np.stack([part & (photon.energy_ratio > 0) for part in made]).reshape(len(made), *places.shape[:-1])


def both_edges(band: PhotonBand) -> tuple[BandEdge, BandEdge]:
    """The edges of a band; ValueError if one of them is missing."""
    if band.inner is None or band.outer is None:
        raise ValueError(
            f"Argument `order` must be that of a band with two edges, but the outer edge of order {band.order} is "
            "missing: take photon_rings with a finite `outer`."
        )
    return band.inner, band.outer


def shadow_curve(edge: RingEdge) -> BandEdge:
    """The shadow edge in the form of the edge of a band."""
    # In the plane order 1 stands for a curve of two halves.
    return BandEdge(edge.camera, 1, math.nan, edge.sky, 0 * edge.impact, edge.edge_phase, 0 * edge.impact)


def _within(camera: Viewer, sky: Float[Array, "n 3"], order: int, radius: float) -> Bool[Array, " n"]:
    """True where the crossing of an order is closer to the hole than a circle, in the plane as seen from the north."""
    crossing = np.full(len(sky), order + 1)
    if not camera.on_equator:
        return crossing_gap(camera, sky, crossing, np.array(radius)) > 0
    # Below the plane the first crossing is at the viewer.
    below = line_of_sight_from_sky(camera.frame(), sky)[:, 1] > 0
    found = crossing_gap(camera, sky, np.maximum(crossing - below, 1), np.array(radius)) > 0
    return np.where(below & (order == 0), camera.radius < radius, found)


def _places_of(camera: Viewer, view: Any) -> Float[Array, "*batch axes"]:
    """Places on the viewer's sky of the pixels of a view, or those given."""
    kind = getattr(type(view), "viewer", None)
    if kind is not None:
        if not isinstance(camera, kind):
            raise ValueError(
                f"Argument `view` must be a raster for {type(camera).__name__}, but is one for {kind.__name__}."
            )
        rows, columns = np.indices(view.shape)
        return view.places(columns.astype(float), rows.astype(float))
    places = numbers("view", view)
    axes = 2 if isinstance(camera, Observer) else 3
    if places.ndim == 0 or places.shape[-1] != axes:
        raise ValueError(
            f"Argument `view` must be a View, a Screen, or {camera.sky_coordinates} in an array of shape (..., {axes})."
        )
    if axes == 2:
        return places
    size = np.linalg.norm(places, axis=-1, keepdims=True)
    if not (size > 0).all():
        raise ValueError("Argument `view` must hold directions N that are not 0.")
    return places / size


def _check_screen(camera: Viewer, what: str) -> None:
    """Raise ValueError unless the sky is a plane."""
    if not isinstance(camera, Observer):
        raise ValueError(
            f"Argument `viewer` of photon_rings must be an Observer for a {what}, but is a Camera, whose sky is no "
            "plane: take kc.Observer at the same place."
        )
