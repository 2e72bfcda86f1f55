"""Viewers: the common base of a `Camera` at one event and an `Observer` far away."""

import math
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import differing_digits, if_degrees, quoted, real_number
from kerrcaustics.spacetime.frame import Frame
from kerrcaustics.spacetime.sphere import tangent_basis

# Beyond it the hole is too small on the sky for double precision.
LARGEST_RADIUS = 1e9

Vector = tuple[float, float, float]
_AT_REST = (0.0, 0.0, 0.0)
_FARTHER = "farther away, take an Observer at radius inf, whose sky is in units of M"


class Viewer(Shown):
    """A place outside the horizon, at azimuth 0, and the sky of that place.

    velocity: as of a `Camera`; sky_unit: of lengths and errors on that sky, "rad" or "GM/c^2"; sky_coordinates: of
    places on it.
    """

    spin: float
    radius: float
    inclination: float
    velocity: Any
    sky_unit: ClassVar[str]
    sky_coordinates: ClassVar[str]

    @property
    def cos_theta(self) -> float:
        """Cosine of the inclination, exactly 0 at math.pi / 2."""
        return 0.0 if self.inclination == math.pi / 2 else math.cos(self.inclination)

    @property
    def sin_theta(self) -> float:
        """Sine of the inclination, exactly 0 at math.pi as at 0."""
        return 0.0 if self.inclination == math.pi else math.sin(self.inclination)

    @property
    def on_equator(self) -> bool:
        """True in the equatorial plane, so that the sky has a mirror symmetry."""
        return self.cos_theta == 0

    @property
    def on_axis(self) -> bool:
        """True on the spin axis, so that the sky has an axial symmetry."""
        return self.sin_theta == 0

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the numbers that give the place."""
        return "spin", "radius", "inclination"

    @property
    def straight_ahead(self) -> float:
        """1 - cos of an angle, on the sphere of the engines, from the direction away from the hole.

        Within that angle the sphere has no digits left for rays; 0 where there is no such angle.
        """
        return 0.0

    def at_rest(self) -> "Viewer":
        """The fiducial viewer at the same event: same caustics, another sky."""
        raise NotImplementedError

    def frame(self) -> Frame:
        """The viewer's numbers for compiled code."""
        raise NotImplementedError

    def fido_velocity(self) -> Vector:
        """Velocity (v_r, v_theta, v_phi) as measured by the fiducial observer (FIDO)."""
        return _AT_REST

    def orbital_velocity(self) -> float:
        """Angular velocity (coordinate azimuth per coordinate time) about the spin axis."""
        raise NotImplementedError

    def directions(self, sky: Any) -> Any:
        """Directions (..., 3), as engines take them, of places on the viewer's own sky."""
        return sky

    def places(self, sky: np.ndarray) -> np.ndarray:
        """Places on the viewer's own sky, of directions (..., 3) as engines take them: the inverse of `directions`."""
        return sky

    def tangents(self, sky: np.ndarray) -> np.ndarray:
        """Two orthonormal tangents (..., axes, 2), as columns, of the viewer's own sky at places on it."""
        return np.stack(tangent_basis(sky), axis=-1)

    def by_places(self, sky: Any, jacobian: np.ndarray) -> np.ndarray:
        """Jacobians (..., 2, 2) by the coordinates of places `sky`, from those by tangents of the engines' sphere."""
        return jacobian


def check_viewer(viewer: object) -> None:
    """Raise ValueError unless `viewer` is a Camera or an Observer."""
    if not isinstance(viewer, Viewer):
        raise ValueError(f"Argument `camera` must be a Camera or an Observer, but is {type(viewer).__name__}.")


def check_place(spin: float, radius: float, inclination: float) -> None:
    """Raise ValueError unless there is such a place outside the horizon of a hole."""
    if not 0 <= spin < 1:
        raise ValueError(f"Argument `spin` must lie in [0, 1), but is {spin:g}{kerr.if_mirrored(spin)}")
    if not radius > kerr.horizon(spin):
        value, horizon = differing_digits(radius, kerr.horizon(spin))
        raise ValueError(f"Argument `radius` must be larger than the horizon radius {horizon}, but is {value}.")
    if radius > LARGEST_RADIUS:
        raise ValueError(f"Argument `radius` must be at most {LARGEST_RADIUS:g}, but is {radius:g}: {_FARTHER}.")
    if not 0 <= inclination <= math.pi:
        raise ValueError(
            f"Argument `inclination` must lie in [0, pi] radians, but is {inclination:g}{if_degrees(inclination)}"
        )


def finite_number(name: str, value: Any) -> float:
    """The argument `name` as a float; a ValueError unless it is a finite number."""
    number = real_number(name, value)
    if not math.isfinite(number):
        end = f": {_FARTHER}." if name == "radius" and number == math.inf else "."
        raise ValueError(f"Argument `{name}` must be a finite number, but is {quoted(value)}{end}")
    return number


def frame_at(viewer: Viewer, radius: float, velocity: Vector = _AT_REST, slowness: float | None = None) -> Frame:
    """The frame of a viewer at a radius, who moves with a velocity that the FIDO there measures.

    Parameters: slowness, 1 - beta^2 if it is known better than from the velocity, whose rounding leaves no digits of it
    close to the speed of light.
    """
    at = kerr.metric(viewer.spin, radius, viewer.cos_theta)
    speed, basis = _basis(velocity)
    return Frame(
        spin=viewer.spin,
        radius=radius,
        sin_theta=viewer.sin_theta,
        cos_theta=viewer.cos_theta,
        lapse=at.lapse,
        shift=at.shift,
        cylindrical_scale=at.cylindrical_scale,
        root_sigma=math.sqrt(at.sigma),
        root_sigma_delta=math.sqrt(at.sigma * at.delta),
        speed=speed,
        # Exact, for the velocity as it is.
        slowness=float(1 - sum(Fraction(v) ** 2 for v in velocity)) if slowness is None else slowness,
        basis=basis,
        zoom=1.0,
        start=radius + 2 * math.log(radius),
    )


def _basis(velocity: Vector) -> tuple[float, tuple[Vector, ...]]:
    """Speed and camera basis, rows (e_x, e_y, e_z), for a FIDO velocity (JTFT A.1)."""
    speed = math.hypot(*velocity)
    if speed == 0:
        return 0.0, ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    # Twice, so that the direction is a unit vector for the smallest numbers too.
    direction = [v / speed for v in velocity]
    b_r, b_theta, b_phi = (v / math.hypot(*direction) for v in direction)
    # Azimuthal motion keeps its sign in the speed, so that the basis does not turn over between the two senses.
    if b_r == 0 and b_theta == 0:
        return velocity[2], ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    kappa = math.hypot(b_r, b_phi)
    # Motion along e_theta alone leaves e_x undetermined: e_r is the limit of the azimuthal case.
    c, s = (b_phi / kappa, b_r / kappa) if kappa > 0 else (1.0, 0.0)
    return speed, ((c, 0.0, -s), (b_r, b_theta, b_phi), (b_theta * s, -kappa, b_theta * c))
