"""Beams at places along rays: the separation of neighbouring rays, across the ray."""

from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.beam import Ellipses
from kerrcaustics.beams.bundles import Bundle, BundleState
from kerrcaustics.beams.ray_state import Path
from kerrcaustics.beams.vectors import dot, with_small_turn
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.spacetime.arrays import Reals
from kerrcaustics.spacetime.frame import Frame
from kerrcaustics.spacetime.sphere import polar_basis, polar_turn

Array = np.ndarray
Vector = tuple[Reals, Reals, Reals]

# Round-off of the separation across a ray, relative to its terms.
_ROUND_OFF = 2e-14
# Growth of that round-off with r^2 / Delta.
_AT_HORIZON = 0.5
# Error of the separation per error of the place, which winds up close to the shadow edge.
_OF_PLACE = 4.0
# Between two norms of matrices.
_HALF = 0.5**0.5


@result("path-beams/1", kw_only=True)
class PathBeams(Ellipses):
    """Beams that open from the viewer, at the places of `RayPaths`: their diameters, as angles at the radius.

    Rays of one beam are apart by the same length for whoever measures it: the diameters do not depend on his motion.
    Directions do, and are those of the fiducial observer there, along his e_r, e_theta, e_phi. The two directions
    s_1, s_2 of the screen across the ray, which docs/conventions.md defines, turn smoothly along every ray; on the
    celestial sphere they are e_theta' and e_phi'.
    """

    heading: Array = quantity(
        "ray... place local_axis", "1", "unit vector of the ray, followed backward, along e_r, e_theta, e_phi"
    )
    screen: Array = quantity(
        "ray... place end_axis local_axis", "1", "directions s_1, s_2 (rows) across the ray, along e_r, e_theta, e_phi"
    )
    jacobian: Array = quantity(
        "ray... place end_axis sky_axis",
        "1",
        "from camera-sky displacements (columns) as that of `Beams` to displacements across the ray, along s_1 and s_2 "
        "(rows), divided by the radius; on the celestial sphere that of `Beams`",
    )
    jacobian_error: Array = quantity(
        "ray... place",
        "1",
        "estimated error of the Jacobian's entries, relative to delta_plus: diameter_error, and the turn of e_theta, "
        "e_phi as the place moves by its error, which is large close to the spin axis",
    )
    diameter_error: Array = quantity(
        "ray... place",
        "1",
        "estimated error, relative to delta_plus, of the diameters, and of the Jacobian's columns as vectors in space",
    )

    @property
    @derived("ray... place", "1")
    def determinant(self) -> Array:
        """Product of the diameters, with the sign of det J."""
        return super().determinant

    @property
    @derived("ray... place", "1")
    def delta_plus(self) -> Array:
        """Major diameter over the radius, of a beam of unit diameter at the camera."""
        return super().delta_plus

    @property
    @derived("ray... place", "1")
    def delta_minus(self) -> Array:
        """Minor diameter over the radius, with the sign of det J: it passes through zero at conjugate points."""
        return super().delta_minus

    @property
    @derived("ray... place", "rad")
    def position_angle(self) -> Array:
        """Angle in (-pi/2, pi/2], from s_1 toward s_2 to the major axis."""
        return super().position_angle

    @property
    @derived("ray... place local_axis", "1")
    def major_axis(self) -> Array:
        """Unit vector of the major diameter along e_r, e_theta, e_phi of the fiducial observer; its sign is free."""
        angle = self.position_angle[..., None]
        return np.cos(angle) * self.screen[..., 0, :] + np.sin(angle) * self.screen[..., 1, :]


class _MetricFunctions(NamedTuple):
    """Metric functions at places, finite at infinity: h = Delta / r^2, sigma = Sigma / r^2, B = A / r^4 of JTFT A.1."""

    u: Reals
    sine: Reals
    h: Reals
    sigma: Reals
    big: Reals


@np.errstate(divide="ignore", invalid="ignore")
def beams_along(frame: Frame, bundle: Bundle, state: BundleState, error: Array) -> dict[str, Array]:
    """The fields of `PathBeams` at states, from the errors of their places. NaN for light of no positive energy."""
    ray, *variations = state.paths[:3]
    m: Vector = ray.position[1], ray.position[2], ray.position[3]
    e_theta, e_phi = (tuple(np.moveaxis(e, -1, 0)) for e in polar_basis(np.stack(m, axis=-1)))
    metric = _metric(frame.spin, np.abs(ray.position[0]), m)
    # Backward in time: -p_theta and -b / sin theta.
    aside = dot(ray.rate[1:], e_theta), dot(ray.rate[1:], e_phi)
    heading, tilt = _heading(frame.spin, bundle, metric, ray, aside)
    rows = _screen(heading)
    columns, sizes = [], []
    for by in variations:
        change = with_small_turn(m, by.position[1:], by.psi)
        moved = by.position[0], dot(change, e_theta), dot(change, e_phi)
        column, size = _transverse_displacement(frame.spin, metric, ray.rate[0], aside, (heading, tilt, rows), moved)
        columns.append(np.stack(column, axis=-1))
        sizes.append(size)
    jacobian = np.stack(columns, axis=-1)
    part = np.max(sizes, axis=0) / (np.linalg.norm(jacobian, axis=(-2, -1)) * _HALF)
    # At the viewer itself the beam has no size.
    noise = np.where(np.isnan(part), 1.0, part) * _ROUND_OFF * (1 + _AT_HORIZON / metric.h)
    of_columns = noise + _OF_PLACE * error
    return {
        "heading": np.stack(heading, axis=-1),
        "screen": np.stack([np.stack(row, axis=-1) for row in rows], axis=-2),
        "jacobian": jacobian,
        "jacobian_error": np.minimum(of_columns + polar_turn(m, error), 1.0),
        "diameter_error": np.minimum(of_columns, 1.0),
    }


def _metric(spin: float, u: Reals, m: Vector) -> _MetricFunctions:
    au, sine = spin * u, np.hypot(m[0], m[1])
    h = 1 - 2 * u + au * au
    return _MetricFunctions(u, sine, h, 1 + (au * m[2]) ** 2, (1 + au * au) ** 2 - au * au * h * sine * sine)


def _heading(
    spin: float, bundle: Bundle, at: _MetricFunctions, ray: Path, aside: tuple[Reals, Reals]
) -> tuple[Vector, tuple[Reals, Reals]]:
    """Components of the ray's direction for the fiducial observer, and the last two over u."""
    lapse, shift = np.sqrt(at.sigma * at.h / at.big), 2 * spin * at.u**3 / at.big
    energy = (1 - shift * bundle.constants.b) / lapse
    tilt = aside[0] / (np.sqrt(at.sigma) * energy), aside[1] / (np.sqrt(at.big / at.sigma) * energy)
    return (-ray.rate[0] / (np.sqrt(at.h * at.sigma) * energy), at.u * tilt[0], at.u * tilt[1]), tilt


def _screen(heading: Vector) -> tuple[Vector, Vector]:
    """The directions across the ray. The sign of e_phi in the ray, that of -b, is the same all along it."""
    x, y, z = heading
    sign, over = np.where(z >= 0, 1.0, -1.0), 1 / (1 + np.abs(z))
    first = -x * y * over, 1 - y * y * over, -sign * y
    return first, (-z - sign * y * y * over, sign * x * y * over, x)


def _transverse_displacement(
    spin: float,
    at: _MetricFunctions,
    u_rate: Reals,
    aside: tuple[Reals, Reals],
    sight: tuple[Vector, tuple[Reals, Reals], tuple[Vector, Vector]],
    moved: Vector,
) -> tuple[list[Reals], Reals]:
    """A displacement (du, dtheta, sin theta dphi) across the ray, over the radius, and the size of its terms.

    It comes with one in time, dt, for which it is at right angles to the ray in space-time, as are all rays that meet
    at the viewer: dt = p_r dr + p_theta dtheta + b dphi for unit energy. Far out the radial part, du / u over the
    radius, is as large as it is nearly along the ray: their product is finite.
    """
    (x, y, z), tilt, rows = sight
    du, d_theta, d_phi = moved
    radial = np.sqrt(at.sigma / at.h) * du
    # u^2 dt, and sin theta omega dt.
    delay = -u_rate * du / at.h - at.u**2 * (aside[0] * d_theta + aside[1] * d_phi)
    drag = at.sine * 2 * spin * at.u / at.big * delay
    along = np.sqrt(at.sigma) * d_theta, np.sqrt(at.big / at.sigma) * (d_phi - drag)
    sign, over = np.where(z >= 0, 1.0, -1.0), 1 / (1 + np.abs(z))
    # The first components of the rows over u, times -1.
    outward = x * tilt[0] * over, tilt[1] + sign * y * tilt[0] * over
    column: list[Reals] = [
        part * radial + row[1] * along[0] + row[2] * along[1] for part, row in zip(outward, rows, strict=True)
    ]
    size = np.sqrt(radial**2 * (outward[0] ** 2 + outward[1] ** 2) + along[0] ** 2 + along[1] ** 2)
    return column, size + np.sqrt(at.big / at.sigma) * np.abs(drag)
