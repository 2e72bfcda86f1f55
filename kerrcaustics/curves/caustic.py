"""Caustics: what users keep of a critical curve and its image. The result types, and the function that makes them."""

import math
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import overload

import numpy as np

from kerrcaustics.beams.ends import EquatorialPlane, Spherical, Wherever
from kerrcaustics.beams.trace import check_request
from kerrcaustics.curves.critical_curves import CriticalCurve, critical_curves, steps
from kerrcaustics.curves.features import Features, find_features
from kerrcaustics.curves.plane_caustics import PlaneCausticSet, plane_caustics
from kerrcaustics.curves.search_sky import search_camera, shown_line_of_sight
from kerrcaustics.curves.source_map import spherical
from kerrcaustics.results.declared import Items, derived, quantity, result, usual_warnings
from kerrcaustics.spacetime.checks import whole_number
from kerrcaustics.spacetime.viewer import Viewer

HIGHEST_ORDER = 10
Progress = Callable[[str, float], None]


@result("cusp/1", record="celestial error sky")
class Cusp:
    """A cusp of a caustic."""

    sky: np.ndarray = quantity("axis", "1", "direction N on the camera sky; of an Observer (alpha, beta)")
    celestial: np.ndarray = quantity(
        "angle", "rad", "theta', phi' on the celestial sphere, phi' unwrapped", json="theta_deg phi_deg", column=""
    )
    error: float = quantity("", "rad", "error of celestial")


@result(
    "caustic/1",
    record="order theta_min theta_max theta_extent phi_min phi_max phi_extent circuits kind closed error residual "
    "remarks cusps",
    points="sky celestial",
)
class Caustic:
    """A critical curve on the camera sky and its image on the celestial sphere.

    The extremes are refined between the points. phi' is unwrapped: rays with b > 0 carry 2 pi order more, so that the
    curve closes.
    """

    order: int = quantity(
        "", "1", "1 primary, 2 secondary, 3 tertiary, and on: between Morse index order - 1 and order"
    )
    sky: np.ndarray = quantity(
        "point axis",
        "1",
        "directions N of the critical curve, in order along it, the first not repeated; of an Observer (alpha, beta)",
    )
    celestial: np.ndarray = quantity("point angle", "rad", "theta', unwrapped phi' of the caustic")
    cusps: tuple[Cusp, ...] = quantity("cusp_number", "", "cusps in the order of the curve")
    theta_min: float = quantity("", "rad", "least theta' of the caustic")
    theta_max: float = quantity("", "rad", "largest theta' of the caustic")
    phi_min: float = quantity("", "rad", "least phi' of the caustic, unwrapped")
    phi_max: float = quantity("", "rad", "largest phi' of the caustic, unwrapped")
    kind: str = quantity(
        "",
        "",
        '"astroid" (four cusps), "curve with N cusps", "point" (no larger than its error), or "unresolved" (not so '
        "much larger that its cusps could be told, or cusps lost)",
    )
    closed: bool = quantity("", "1", "True when the whole curve was found and its ends meet")
    error: float = quantity("", "rad", "estimated error of celestial and of the extremes")
    residual: float = quantity("", "1", "largest delta_minus / delta_plus on the critical curve")
    remarks: tuple[str, ...] = quantity(
        "", "", "what was missed or is unusual, in words; empty when there is nothing to say"
    )

    @property
    @derived("", "rad")
    def theta_extent(self) -> float:
        """Width in theta'."""
        return self.theta_max - self.theta_min

    @property
    @derived("", "rad")
    def phi_extent(self) -> float:
        """Width in phi'."""
        return self.phi_max - self.phi_min

    @property
    @derived("", "1")
    def circuits(self) -> float:
        """Circuits of the celestial sphere."""
        return self.phi_extent / (2 * math.pi)


@result("caustics/1", record="camera end engine tolerance seconds beams versions missing curves")
class CausticSet(Items[Caustic]):
    """The caustics of one camera, primary first: a sequence, with what produced it."""

    curves: tuple[Caustic, ...] = quantity("order", "", "the caustics", column="")
    camera: Viewer = quantity("", "", "the camera", json="", column="")
    engine: str = quantity("", "", "what traced the beams")
    tolerance: float = quantity("", "rad", "wanted error of a beam", json="tolerance_rad")
    seconds: float = quantity("", "s", "time it took")
    beams: int = quantity("", "1", "beams traced")
    versions: dict[str, str] = quantity("", "", "versions of the packages used")
    missing: tuple[int, ...] = quantity("", "1", "orders that were asked for and not found", json="missing_orders")
    end: float = quantity(
        "", "GM/c^2", "radius of the sphere of the sources, infinite", json="source_radius", default=math.inf
    )

    @property
    def lost(self) -> tuple[int, ...]:
        """Orders that exist and are missing: not the primary one where camera and sources both lie at infinity."""
        unbounded = math.isinf(self.camera.radius) and math.isinf(self.end)
        return tuple(order for order in self.missing if order > unbounded)

    def __repr__(self) -> str:
        """One line: the camera and the kinds of the caustics."""
        return f"<CausticSet of {self.camera}: {', '.join(f'{c.order} {c.kind}' for c in self) or 'none'}>"


@overload
def caustics(
    camera: Viewer,
    orders: int = ...,
    engine: str = ...,
    tolerance: float = ...,
    progress: Progress | None = ...,
    *,
    end: EquatorialPlane,
) -> PlaneCausticSet: ...
@overload
def caustics(
    camera: Viewer,
    orders: int = ...,
    engine: str = ...,
    tolerance: float = ...,
    progress: Progress | None = ...,
    *,
    end: float | Spherical = ...,
) -> CausticSet: ...
@usual_warnings
def caustics(
    camera: Viewer,
    orders: int = 3,
    engine: str = "auto",
    tolerance: float = 1e-12,
    progress: Progress | None = None,
    *,
    end: Wherever = math.inf,
) -> CausticSet | PlaneCausticSet:
    """Critical curves and caustics of order 1 to `orders` seen by a camera, primary first.

    Parameters
    ----------
    camera : Camera or Observer
        Its velocity moves the critical curves on the sky by aberration, and leaves the caustics alone.
    orders : int
        How many, 1 to 10. Double precision reaches order 7 or 8 on the retrograde side; orders beyond it are in
        `CausticSet.missing`.
    engine, tolerance
        As for `trace_beams`; tolerance is the wanted error of a beam in radians.
    progress : callable, optional
        Called with a word for what is being done and the part that is done, 0 to 1.
    end : float
        Where sources lie: math.inf, the celestial sphere, or the radius of a sphere, further out than the camera or
        further in: there the k-th conjugate points of rays lie, the section of a caustic tube. An `EquatorialPlane`
        is the section by one crossing of the plane, for cameras that do not lie in it.

    Returns
    -------
    CausticSet
        A sequence of Caustic; for the plane a `PlaneCausticSet` of curves with a `place` (r, phi).

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
    An Observer at infinity has no primary critical curve: that of one at the radius r has the size 2 sqrt(r).

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> primary, secondary = kc.caustics(camera, orders=2)
    >>> primary.kind, len(primary.cusps), primary.error < 1e-9
    ('astroid', 4, True)
    """
    check_orders(orders)
    asked, tolerance = check_request(camera, engine, tolerance)
    report = progress or (lambda _what, _part: None)
    if isinstance(end, EquatorialPlane):
        return plane_caustics(camera, int(orders), end, asked, tolerance, report)
    began = time.perf_counter()
    report("critical curves found", 0.1)
    surface = spherical(camera, end)
    curves = critical_curves(search_camera(camera), int(orders), engine, tolerance, surface)
    report("cusps and extremes refined", 0.8)
    search = curves.search()
    features = find_features(search, curves)
    report("done", 1.0)
    return CausticSet(
        tuple(_caustic(camera, curve, features[curve.order]) for curve in curves),
        camera=camera,
        engine=" and ".join(sorted(curves.engines | search.engines_used)),
        tolerance=float(tolerance),
        seconds=time.perf_counter() - began,
        beams=curves.beams + search.beams_traced,
        versions={name: version(name) for name in ("kerrcaustics", "jax", "numpy")},
        missing=curves.missing,
        end=float(surface.radius),
    )


def check_orders(orders: object) -> None:
    """Refuse what is no number of orders, with one clear ValueError."""
    whole_number("orders", orders, 1, HIGHEST_ORDER)


def _caustic(camera: Viewer, curve: CriticalCurve, features: Features) -> Caustic:
    points = curve.points
    theta, phi = points.theta, points.azimuth
    ends = {"theta_min": theta.min(), "theta_max": theta.max(), "phi_min": phi.min(), "phi_max": phi.max()}
    error = points.error.max() if curve.on_axis else points.angle_error.max()
    remarks = list(curve.remarks)
    for name in ends:
        extreme = features.extremes.get(name)
        if extreme is not None:
            ends[name], doubt = extreme
            error = max(error, doubt)
        elif curve.is_resolved:
            remarks.append(f"{name} could not be refined between the points")
            error += steps(points)[0].max()
    cusps = tuple(
        Cusp(shown_line_of_sight(camera, p.line_of_sight)[0], np.array([p.theta[0], p.azimuth[0]]), doubt)
        for p, doubt in features.cusps
    )
    kind, remark = _kind(curve, len(cusps), lost=features.lost_cusps)
    if remark:
        remarks.append(remark)
    if curve.on_axis:
        remarks.append("the point lies on the spin axis: phi' has no meaning and is given as 0")
        ends["phi_min"] = ends["phi_max"] = 0.0
        phi = np.zeros_like(phi)
    return Caustic(
        order=curve.order,
        sky=shown_line_of_sight(camera, points.line_of_sight),
        celestial=np.stack([theta, phi], axis=-1),
        cusps=cusps,
        **{name: float(value) for name, value in ends.items()},
        kind=kind,
        closed=curve.closed,
        error=float(error),
        residual=float(np.abs(points.ratio).max()),
        remarks=tuple(remarks),
    )


def _kind(curve: CriticalCurve, cusps: int, lost: int) -> tuple[str, str]:
    """What the caustic is, and a remark where that is not the usual astroid."""
    if curve.is_point:
        return "point", "the caustic is a point: it is not larger than its error"
    if not curve.is_resolved:
        return "unresolved", f"the caustic is only {curve.size_in_errors:.0f} times its error: cusps cannot be told"
    if lost:
        return "unresolved", f"{lost} cusps could not be traced"
    if cusps != 4:
        return f"curve with {cusps} cusps", f"{cusps} cusps instead of the four of an astroid"
    return "astroid", ""
