"""Caustics: what users keep of a critical curve and its image. The result types, and the function that makes them."""

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from kerrcaustics.curves.critical_curves import CriticalCurve, Progress, critical_curves, steps
from kerrcaustics.curves.features import Features, find_features
from kerrcaustics.spacetime.camera import Camera, sky_from_fido
from kerrcaustics.spacetime.checks import whole_number

HIGHEST_ORDER = 10


@dataclass(frozen=True, eq=False)
class Cusp:
    """A cusp of a caustic.

    sky (3,): direction N on the camera sky; celestial (2,): (theta', phi') in radians, phi' unwrapped;
    error: of celestial, in radians.
    """

    sky: np.ndarray
    celestial: np.ndarray
    error: float

    def __eq__(self, other: object) -> bool:
        """True when every number is the same."""
        return isinstance(other, Cusp) and _same(vars(self), vars(other))


@dataclass(frozen=True, eq=False)
class Caustic:
    """A critical curve on the camera sky and its image on the celestial sphere.

    Attributes
    ----------
    order : int
        1 primary, 2 secondary, 3 tertiary, and on: between Morse index order - 1 and order.
    sky : (n, 3) array
        Points N of the critical curve, in order along it, the first not repeated.
    celestial : (n, 2) array
        Their images (theta', phi') in radians. phi' is unwrapped: rays with b > 0 carry 2 pi order more, so
        that the curve closes.
    cusps : tuple of Cusp
        In the order of the curve.
    theta_min, theta_max, phi_min, phi_max : float
        Extremes of the caustic in radians, refined between the points.
    kind : str
        "astroid" (four cusps), "curve with N cusps", "point" (no larger than its error), or "unresolved" (not so
        much larger that its cusps could be told, or cusps lost).
    closed : bool
        True when the whole curve was found and its ends meet.
    error : float
        Estimated error of celestial and of the extremes, in radians.
    residual : float
        Largest |delta_minus| / delta_plus on the critical curve.
    remarks : tuple of str
        What was missed or is unusual, in words; empty when there is nothing to say.
    """

    order: int
    sky: np.ndarray
    celestial: np.ndarray
    cusps: tuple[Cusp, ...]
    theta_min: float
    theta_max: float
    phi_min: float
    phi_max: float
    kind: str
    closed: bool
    error: float
    residual: float
    remarks: tuple[str, ...]

    @property
    def theta_extent(self) -> float:
        """Full width in theta', radians."""
        return self.theta_max - self.theta_min

    @property
    def phi_extent(self) -> float:
        """Full width in unwrapped phi', radians."""
        return self.phi_max - self.phi_min

    @property
    def circuits(self) -> float:
        """How many times the caustic goes round the celestial sphere: phi_extent / 2 pi."""
        return self.phi_extent / (2 * math.pi)

    def __eq__(self, other: object) -> bool:
        """True when every number is the same."""
        return isinstance(other, Caustic) and _same(vars(self), vars(other))


class CausticSet(tuple[Caustic, ...]):
    """The caustics of one camera, primary first: a tuple, with what produced it.

    camera, engine, tolerance (radians), seconds it took, beams traced, versions of the packages used, and
    missing: orders that were asked for and not found.
    """

    camera: Camera
    engine: str
    tolerance: float
    seconds: float
    beams: int
    versions: dict[str, str]
    missing: tuple[int, ...]

    def __new__(cls, curves: Iterable[Caustic], **made: Any) -> "CausticSet":
        """A set of the given caustics; `made` holds the attributes above."""
        self = super().__new__(cls, curves)
        for name in cls.__annotations__:
            setattr(self, name, made[name])
        return self

    def __repr__(self) -> str:
        """One line: the camera and the kinds of the caustics."""
        return f"<CausticSet of {self.camera}: {', '.join(f'{c.order} {c.kind}' for c in self) or 'none'}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """How to copy and to send the set to another process."""
        return _set_of, (list(self), vars(self))

    def __eq__(self, other: object) -> bool:
        """True when the caustics and all that produced them are the same."""
        return isinstance(other, CausticSet) and tuple.__eq__(self, other) and vars(self) == vars(other)

    def __ne__(self, other: object) -> bool:
        """The opposite of equal; a tuple would compare the curves alone."""
        return not self == other


def caustics(
    camera: Camera,
    orders: int = 3,
    engine: str = "auto",
    tolerance: float = 1e-12,
    progress: Progress | None = None,
) -> CausticSet:
    """Critical curves and caustics of order 1 to `orders` seen by a camera, primary first.

    Parameters
    ----------
    camera : Camera
        Its velocity moves the critical curves on the sky by aberration, and leaves the caustics alone.
    orders : int
        How many, 1 to 10. Double precision reaches order 7 or so on the retrograde side; orders beyond it are in
        `CausticSet.missing`.
    engine, tolerance
        As for `trace_beams`; tolerance is the wanted error of a beam in radians.
    progress : callable, optional
        Called with a word for what is being done and the part that is done, 0 to 1.

    Returns
    -------
    CausticSet
        A tuple of Caustic.

    Errors
    ------
    `Caustic.error`, dominated at high order by round-off of the camera-sky direction (about 1e-15 times the
    beam's major diameter). What was missed is in `Caustic.remarks` and `CausticSet.missing`.
    """
    check_orders(orders)
    began = time.perf_counter()
    report = progress or (lambda _what, _part: None)
    curves = critical_curves(camera, int(orders), engine, tolerance, report)
    report("cusps and extremes refined", 0.8)
    search = curves.search()
    features = find_features(search, curves)
    report("done", 1.0)
    return CausticSet(
        [_caustic(camera, curve, features[curve.order]) for curve in curves],
        camera=camera,
        engine=" and ".join(sorted(curves.engines | search.engines_used)),
        tolerance=float(tolerance),
        seconds=time.perf_counter() - began,
        beams=curves.beams + search.beams_traced,
        versions={name: version(name) for name in ("kerrcaustics", "jax", "numpy")},
        missing=curves.missing,
    )


def check_orders(orders: object) -> None:
    """Refuse what is no number of orders, with one clear ValueError."""
    whole_number("orders", orders, 1, HIGHEST_ORDER)


def _caustic(camera: Camera, curve: CriticalCurve, features: Features) -> Caustic:
    points = curve.points
    frame = camera.frame()

    def on_sky(looking: np.ndarray) -> np.ndarray:
        return sky_from_fido(frame, -looking)

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
    cusps = tuple(Cusp(on_sky(f.looking), np.array([f.theta, f.azimuth]), f.error) for f in features.cusps)
    kind, remark = _kind(curve, len(cusps), lost=features.lost_cusps)
    if remark:
        remarks.append(remark)
    if curve.on_axis:
        remarks.append("the point lies on the spin axis: phi' has no meaning and is given as 0")
        ends["phi_min"] = ends["phi_max"] = 0.0
        phi = np.zeros_like(phi)
    return Caustic(
        order=curve.order,
        sky=on_sky(points.looking),
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


def _set_of(curves: list[Caustic], made: dict[str, Any]) -> CausticSet:
    return CausticSet(curves, **made)


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and np.array_equal(one, other)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_same(one[k], other[k]) for k in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(_same(a, b) for a, b in zip(one, other, strict=True))
    return bool(one == other)
