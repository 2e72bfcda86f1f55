"""The caustics of a camera: critical curves and their images, with all that is measured on them."""

import math
import time
from collections.abc import Iterable
from functools import cache, partial, singledispatch
from importlib.metadata import version

import numpy as np

from kerrcaustics.beams.ends import End, Spherical, Wherever
from kerrcaustics.beams.trace import check_request
from kerrcaustics.curves.caustic import Caustic, CausticSet, Cusp
from kerrcaustics.curves.critical_curves import CriticalCurve, curves_of, steps
from kerrcaustics.curves.features import Features, find_features
from kerrcaustics.curves.plane_caustics import plane_caustics
from kerrcaustics.lens_map.domains import Domain, Ring, search_surface
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.lens_map.search_sky import TOLERANCE, shown_line_of_sight
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.results.progress import Progress, report, with_progress
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.viewer import Viewer

HIGHEST_ORDER = 10


@usual_warnings
@with_progress
def caustics(
    camera: Viewer,
    orders: int = 3,
    engine: str = "auto",
    *,
    end: Wherever | End = math.inf,
    progress: Progress | bool | None = None,
) -> CausticSet:
    """Critical curves and caustics of order 1 to `orders` seen by a camera, primary first.

    Parameters
    ----------
    camera : Camera or Observer
        Its velocity shifts the critical curves on the sky by aberration, and does not affect the caustics.
    orders : int
        Number of orders, 1 to 10. Double precision reaches order 7 or 8 on the retrograde side; orders beyond it are in
        `CausticSet.missing`.
    engine
        As for `trace_beams`. Beams are traced to 1e-12 rad: larger errors would save no time.
    end : float, Sphere or EquatorialPlane
        Surface of the sources: math.inf, the celestial sphere, or the radius of a sphere, further out than the camera
        or further in. The caustic on a sphere consists of the k-th conjugate points of rays there: it is the section of
        a caustic tube. An `EquatorialPlane` is the section by one crossing of the plane, for cameras outside the plane.
    progress : callable or bool, optional
        Called with a text on the current work and the fraction of all work that is done, 0 to 1, counted in steps of
        the method, not in seconds. True shows a bar. By default notebooks show a bar after a second; False shows none.

    Returns
    -------
    CausticSet
        A sequence of Caustic.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Caustic.error`, dominated at high order by round-off of the camera-sky direction (about 1e-15 times the
    beam's major diameter). What was missed is in `Caustic.remarks` and `CausticSet.missing`.

    Notes
    -----
    An Observer at infinity has no primary critical curve: that of an Observer at radius r has the size 2 sqrt(r).

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> primary, secondary = kc.caustics(camera, orders=2)
    >>> primary.kind, len(primary.cusps), primary.error < 1e-9
    ('astroid', 4, True)
    """
    check_request(camera, engine, TOLERANCE)
    check_orders(orders)
    surface = search_surface(camera, end)
    began = time.perf_counter()
    search_map = SearchMap.for_viewer(camera, surface, engine)
    curves, beams, engines, missing = _found_on(search_map.domain, camera, search_map, int(orders))
    return CausticSet(
        curves,
        camera=camera,
        engine=" and ".join(sorted(engines)),
        seconds=time.perf_counter() - began,
        beams=beams,
        versions={name: _version(name) for name in ("kerrcaustics", "numpy")},
        missing=missing,
        surface=surface,
    )


# Looked up in files.
_version = cache(version)

# The curves, the number of beams, the engines that traced them, and the orders that were not found.
_Found = tuple[tuple[Caustic, ...], int, Iterable[str], tuple[int, ...]]


@singledispatch
def _found_on(domain: Domain, camera: Viewer, search_map: SearchMap, orders: int) -> _Found:
    """Return the curves on a surface: by lines across the shadow edge on spheres."""
    report("critical curves", 0.0)
    curves = curves_of(search_map, orders)
    report("cusps and extremes", 0.7)
    search = curves.search()
    features = find_features(search, curves)
    caustics = tuple(_caustic(camera, curves.domain.surface, curve, features[curve.order]) for curve in curves)
    return caustics, curves.beams + search.beams_traced, curves.engines | search.engines_used, curves.missing


@_found_on.register
def _found_in_ring(domain: Ring, camera: Viewer, search_map: SearchMap, orders: int) -> _Found:
    circles = partial(domain.circles, engine=search_map.engine, tolerance=search_map.tolerance)
    return (*plane_caustics(camera, search_map.surface, circles, orders), ())


def check_orders(orders: object) -> None:
    """Raise ValueError unless `orders` is a number of orders."""
    whole_number("orders", orders, 1, HIGHEST_ORDER)


def _caustic(camera: Viewer, surface: Spherical, curve: CriticalCurve, features: Features) -> Caustic:
    points, tips = curve.points, [tip for tip, _ in features.cusps]
    theta, phi = points.theta, points.azimuth
    extremes = {"theta_min": theta.min(), "theta_max": theta.max(), "phi_min": phi.min(), "phi_max": phi.max()}
    error = points.error.max() if curve.on_axis else points.angle_error.max()
    remarks = list(curve.remarks)
    for name in extremes:
        extreme = features.extremes.get(name)
        if extreme is not None:
            extremes[name], doubt = extreme
            error = max(error, doubt)
        elif curve.is_resolved:
            remarks.append(f"{name} could not be refined between the points")
            error += steps(points)[0].max()
    sky = shown_line_of_sight(camera, np.concatenate([part.line_of_sight for part in (points, *tips)]))
    cusps = tuple(
        Cusp(place, np.array([tip.theta[0], tip.azimuth[0]]), doubt)
        for place, tip, (_, doubt) in zip(sky[len(points) :], tips, features.cusps, strict=True)
    )
    kind, remark = _kind(curve, len(cusps), lost=features.lost_cusps)
    if remark:
        remarks.append(remark)
    if curve.on_axis:
        remarks.append("the point lies on the spin axis: phi' has no meaning and is given as 0")
        extremes["phi_min"] = extremes["phi_max"] = 0.0
        phi = np.zeros_like(phi)
    return Caustic(
        camera=camera,
        order=curve.order,
        sky=sky[: len(points)],
        place=np.stack([theta, phi], axis=-1),
        cusps=cusps,
        **{name: float(value) for name, value in extremes.items()},  # pyright: ignore[reportArgumentType]
        kind=kind,
        closed=curve.closed,
        error=float(error),
        residual=float(np.abs(points.ratio).max()),
        remarks=tuple(remarks),
        surface=surface,
        r_min=surface.radius,
        r_max=surface.radius,
        certified=not curve.remarks and kind != "unresolved",
    )


def _kind(curve: CriticalCurve, cusps: int, lost: int) -> tuple[str, str]:
    """The kind of a caustic, and a remark unless that is the usual astroid."""
    if curve.is_point:
        return "point", "the caustic is a point: it is not larger than its error"
    if not curve.is_resolved:
        return "unresolved", f"the caustic is only {curve.size_in_errors:.0f} times its error: cusps cannot be counted"
    if lost:
        return "unresolved", f"{lost} cusps could not be traced"
    if cusps != 4:
        return f"curve with {cusps} cusps", f"{cusps} cusps instead of the four of an astroid"
    return "astroid", ""
