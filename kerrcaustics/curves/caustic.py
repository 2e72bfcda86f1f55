"""Caustics: what users keep of critical curves and their images, whatever the surface of the sources."""

import math

import numpy as np

from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.lens_map.domains import domain_of
from kerrcaustics.results import declared
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.results.shown import Items, Shown
from kerrcaustics.spacetime.viewer import Viewer

# Curves that one line names.
_NAMED = 6


@result("cusp/1", record="celestial error sky")
class Cusp(Shown):
    """A cusp of a caustic."""

    sky: np.ndarray = quantity("axis", "1", "direction N on the camera sky; of an Observer (alpha, beta)")
    celestial: np.ndarray = quantity(
        "angle", "rad", "theta', phi' on the sphere, phi' unwrapped", json="theta_deg phi_deg", column=""
    )
    error: float = quantity("", "rad", "error of celestial")


@result(
    "caustic/1",
    record="order theta_min theta_max theta_extent r_min r_max phi_min phi_max phi_extent circuits kind ends closed "
    "lost error residual certified remarks cusps",
    points="sky place",
)
class Caustic(Shown):
    """A critical curve on the camera sky and its image on the surface of the sources.

    The extremes are refined between the points. On spheres phi' is unwrapped so that the curve closes: 2 pi times the
    order is added for rays with b > 0. In the plane a curve is one piece of the section of a caustic tube; cusps are
    not searched for there, and an order may have several pieces or none.
    """

    camera: Viewer = declared.viewer()
    order: int = quantity(
        "", "1", "1 primary, 2 secondary, 3 tertiary, and so on: between Morse index order - 1 and order"
    )
    sky: np.ndarray = quantity(
        "point axis",
        "1",
        "directions N of the critical curve, in order along it, the first not repeated; of an Observer (alpha, beta)",
    )
    place: np.ndarray = quantity(
        "point angle",
        "place",
        "theta', unwrapped phi' of the caustic; in the plane r, unwrapped phi",
        json="celestial place",
    )
    cusps: tuple[Cusp, ...] = quantity("cusp_number", "", "cusps in the order of the curve")
    theta_min: float = quantity("", "rad", "least theta' of the caustic; pi / 2 in the plane")
    theta_max: float = quantity("", "rad", "largest theta' of the caustic")
    phi_min: float = quantity("", "rad", "least phi' of the caustic, unwrapped")
    phi_max: float = quantity("", "rad", "largest phi' of the caustic, unwrapped")
    kind: str = quantity(
        "",
        "",
        '"astroid" (four cusps), "curve with N cusps", "point" (no larger than its error), or "unresolved" (too small '
        'for its error to count the cusps, or cusps lost); in the plane "section"',
    )
    closed: bool = quantity("", "1", "True when the whole curve was found and its ends meet")
    error: float = quantity("", "rad", "estimated error of place and of the extremes, relative in r")
    residual: float = quantity("", "1", "largest delta_minus / delta_plus on the critical curve")
    remarks: tuple[str, ...] = declared.remarks("remarks on what was missed or is unusual; otherwise empty")
    surface: End = declared.surface(default=SKY)
    r_min: float = quantity("", "GM/c^2", "least radius; that of the sphere", default=math.inf)
    r_max: float = quantity("", "GM/c^2", "largest radius; that of the sphere", default=math.inf)
    ends: tuple[str, ...] = quantity(
        "",
        "",
        'sides on which an open curve in the plane leaves the searched radii: "horizon" or "infinity"; else empty',
        default=(),
    )
    lost: int = quantity("", "1", "points of a curve in the plane that could not be found and are left out", default=0)
    certified: bool = declared.certified("True when the whole curve was found, with all its cusps", default=False)

    @property
    def celestial(self) -> np.ndarray:
        """theta', unwrapped phi' of the caustic on a sphere, (n, 2) radians: another name for `place` there."""
        return self.place

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
        """Circuits about the spin axis."""
        return self.phi_extent / (2 * math.pi)


@result("caustics/2", record="camera surface engine seconds beams versions missing certified remarks curves")
class CausticSet(Items[Caustic]):
    """The caustics of one camera, primary first: a sequence, with a record of the computation."""

    curves: tuple[Caustic, ...] = quantity("order", "", "the caustics", column="")
    camera: Viewer = declared.viewer()
    engine: str = quantity("", "", "engine that traced the beams")
    seconds: float = quantity("", "s", "time it took")
    beams: int = quantity("", "1", "beams traced")
    versions: dict[str, str] = quantity("", "", "versions of the packages used")
    missing: tuple[int, ...] = quantity(
        "",
        "1",
        "orders that were requested and not found; empty in the plane, where an order may have no curve",
        json="missing_orders",
    )
    surface: End = declared.surface(default=SKY)

    @property
    def lost(self) -> tuple[int, ...]:
        """Missing orders that exist: the primary one does not where camera and sources both lie at infinity."""
        first = int(domain_of(self.surface, self.camera).unbounded)
        return tuple(order for order in self.missing if order > first)

    @property
    @derived("", "1")
    def certified(self) -> bool:
        """True when no order is lost, and every curve is certified."""
        return not self.lost and all(curve.certified for curve in self)

    @property
    @derived("", "")
    def remarks(self) -> tuple[str, ...]:
        """Remarks of the curves, and the orders that are lost."""
        lines = [f"order {curve.order}: {remark}" for curve in self for remark in curve.remarks]
        return (*lines, *(f"order {order}: not found" for order in self.lost))

    def __repr__(self) -> str:
        """Summary in one line: the camera and the curves."""
        curves = ", ".join(f"{c.order} {c.kind}" for c in self[:_NAMED])
        curves += f" and {len(self) - _NAMED} more" if len(self) > _NAMED else ""
        return f"<CausticSet of {self.camera}, {self.surface.in_words()}: {curves or 'none'}>"
