"""The results of tracing: rays, and beams with their first variation."""

from enum import IntEnum

import numpy as np

from kerrcaustics.beams.engine import Engine
from kerrcaustics.results.declared import Shown, derived, quantity, result
from kerrcaustics.spacetime.sphere import tangent_basis


class Status(IntEnum):
    """The fate of a ray; `sentence` puts it in words."""

    ESCAPED = 0
    CAPTURED = 1
    INACCURATE = 2
    MISSED = 3

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.ESCAPED: (
        "The ray reaches its end (the celestial sphere, unless another is requested), and its estimated error is "
        "within the tolerance."
    ),
    Status.CAPTURED: (
        "The ray, followed backward, ends at the horizon before it reaches another end: the camera sees the shadow "
        "there."
    ),
    Status.INACCURATE: (
        "The ray reaches its end, but double precision cannot hold its error within the tolerance (it passes too "
        "close to the shadow edge, or only grazes its end); `error` says how large it is."
    ),
    Status.MISSED: "The ray, followed backward, leads to infinity and never reaches the requested finite end.",
}


@result("rays/1", kw_only=True)
class Rays(Shown):
    """The ends of rays, one for each direction on the camera sky. Arrays of one batch shape (ray...).

    Rays that do not reach their end hold NaN, False, and -1 for whole numbers. Quantities not requested are None.
    """

    direction: np.ndarray = quantity("ray... axis", "1", "unit vector n' of the end, in Boyer-Lindquist angles")
    azimuth: np.ndarray = quantity("ray...", "rad", "phi', continuous along the ray")
    azimuth_error: np.ndarray = quantity(
        "ray...",
        "rad",
        "estimated error of azimuth, infinite where it is known modulo 2 pi alone (rays that pass the spin axis within "
        "round-off) or not at all (ends that may lie on the axis)",
        json="azimuth_error_rad",
    )
    status: np.ndarray = quantity("ray...", "1", "`Status` values")
    status_certain: np.ndarray = quantity(
        "ray...", "1", "False where round-off may have decided whether the ray reaches its end"
    )
    error: np.ndarray = quantity(
        "ray...",
        "rad",
        "estimated error of n', and for an end in the equatorial plane also that of ln r",
        json="error_rad",
    )
    engine: str = quantity("", "", "the ones that traced the rays, in words")
    closed_form: np.ndarray = quantity("ray...", "1", "True where it was the closed form")
    radius: np.ndarray = quantity("ray...", "GM/c^2", "radius of the end, infinite on the celestial sphere")
    outward: np.ndarray = quantity("ray...", "1", "whether it moves outward at its end, followed backward")
    time: np.ndarray | None = quantity(
        "ray...",
        "GM/c^3",
        "coordinate time from the end to the camera, or for ends at infinity the limit of t - r - 2 ln r; to an "
        "Observer less r + 2 ln r of the observer",
        default=None,
    )
    time_error: np.ndarray | None = quantity("ray...", "GM/c^3", "estimated error of time", default=None)
    redshift: np.ndarray | None = quantity(
        "ray...",
        "1",
        "nu_camera / nu_source for a source at rest at infinity, for a static one at a finite radius (NaN where "
        "nothing can be static), for the plane's emitter (NaN where there is no such orbit)",
        default=None,
    )

    def __repr__(self) -> str:
        """The class, the shape, and the number of rays that escaped, in one line."""
        return f"<{type(self).__name__} of shape {self.status.shape}, {self.escaped.sum()} escaped, {self.engine}>"

    @property
    def engines(self) -> tuple[Engine, ...]:
        """The engines that traced the rays that reach their ends."""
        formula = self.closed_form
        other = np.isfinite(self.error) & ~formula
        flags = ((Engine.CLOSED_FORM, formula), (Engine.INTEGRATED, other))
        return tuple(engine for engine, used in flags if used.any())

    @property
    def escaped(self) -> np.ndarray:
        """True where the ray reaches its end, the celestial sphere or another one, (...,) bool."""
        return (self.status != Status.CAPTURED) & (self.status != Status.MISSED)


@result("beams/1", kw_only=True)
class Beams(Rays):
    """Rays with the first variation of their end point."""

    jacobian: np.ndarray = quantity(
        "ray... end_axis sky_axis",
        "1",
        "from camera-sky displacements along `kerrcaustics.tangent_basis(N)` (columns) to celestial-sphere "
        "displacements along e_theta', e_phi' (rows), both orthonormal (of an Observer "
        "along beta and alpha, per M); for an end at a finite radius the same at that "
        "radius, as angles; for one in the equatorial plane to (dr, r dphi) at z = 0 (rows)",
    )
    jacobian_error: np.ndarray = quantity(
        "ray...",
        "1",
        "estimated error, relative to delta_plus, of the Jacobian's columns as vectors in space, and of the diameters "
        "(close to a celestial pole e_theta' and e_phi' themselves turn by error / sin theta', and with them the "
        "entries and the position angle)",
    )
    index: np.ndarray | None = quantity(
        "ray...", "1", "Morse index, the number of conjugate points on the ray", default=None
    )
    index_certain: np.ndarray | None = quantity(
        "ray...", "1", "False where the index may be one off: the end is a conjugate point, within errors", default=None
    )
    crossings: np.ndarray | None = quantity(
        "ray...", "1", "of the equatorial plane, that of the end itself included", default=None
    )
    crossings_certain: np.ndarray | None = quantity(
        "ray...", "1", "False where crossings may be one off: the end lies in the plane, within errors", default=None
    )

    @property
    @derived("ray...", "1")
    def determinant(self) -> np.ndarray:
        """det J (...,): solid angle on the celestial sphere per solid angle on the camera sky, signed."""
        j = self.jacobian
        return j[..., 0, 0] * j[..., 1, 1] - j[..., 0, 1] * j[..., 1, 0]

    @property
    @derived("ray...", "1")
    def delta_plus(self) -> np.ndarray:
        """Major diameter (...,) of the image on the celestial sphere of a beam of unit diameter."""
        even, odd = self._rotations()
        return np.abs(even) + np.abs(odd)

    @property
    @derived("ray...", "1")
    def delta_minus(self) -> np.ndarray:
        """Minor diameter (...,), with the sign of det J: it passes smoothly through zero at critical curves."""
        even, odd = self._rotations()
        return np.abs(even) - np.abs(odd)

    @property
    @derived("ray...", "rad")
    def position_angle(self) -> np.ndarray:
        """Angle (...,) in radians, in (-pi/2, pi/2], from e_theta' toward e_phi' to the major axis."""
        even, odd = self._rotations()
        angle = (np.angle(even) + np.angle(odd)) / 2
        return angle - np.pi * np.ceil(angle / np.pi - 0.5)

    @property
    @derived("ray...", "1")
    def magnification(self) -> np.ndarray:
        """1 / |det J| (...,): how much brighter a small source is than in empty flat space, redshift aside."""
        with np.errstate(divide="ignore"):
            return 1 / np.abs(self.determinant)

    @property
    @derived("ray...", "1")
    def parity(self) -> np.ndarray:
        """Sign of det J (...,)."""
        return np.sign(self.determinant)

    def pulled_back(self, sky: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Tangents (n, 3) of the camera sky at sky (n, 3) that the beams take to displacements (n, 2) at their ends."""
        (a, b), (c, d) = np.moveaxis(self.jacobian, 0, -1)
        first, second = displacement.T
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = np.stack([d * first - b * second, a * second - c * first]) / (a * d - b * c)
            e_1, e_2 = tangent_basis(sky)
            return u[:, None] * e_1 + v[:, None] * e_2

    def _rotations(self) -> tuple[np.ndarray, np.ndarray]:
        """J as z -> even z + odd conj(z): a circle becomes an ellipse of semi-axes |even| +- |odd|."""
        j = self.jacobian
        even = (j[..., 0, 0] + j[..., 1, 1]) + 1j * (j[..., 1, 0] - j[..., 0, 1])
        odd = (j[..., 0, 0] - j[..., 1, 1]) + 1j * (j[..., 1, 0] + j[..., 0, 1])
        return even / 2, odd / 2
