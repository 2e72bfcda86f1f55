"""The results of tracing: rays, and beams with their first variation."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.engine import Engine
from kerrcaustics.results.declared import derived, quantity, result
from kerrcaustics.results.shown import Shown
from kerrcaustics.spacetime.checks import numbers, quoted
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
    azimuth: np.ndarray = quantity(
        "ray...",
        "rad",
        "phi', continuous along the ray; rays with b = 0 pass the spin axis as those of small positive b",
    )
    azimuth_error: np.ndarray = quantity(
        "ray...",
        "rad",
        "estimated error of azimuth, infinite where it is known only modulo 2 pi (rays that pass the spin axis within "
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
    engine: str = quantity("", "", "engines that traced the rays, in words")
    closed_form: np.ndarray = quantity("ray...", "1", "True where the closed form was used")
    radius: np.ndarray = quantity("ray...", "GM/c^2", "radius of the end, infinite on the celestial sphere")
    outward: np.ndarray = quantity("ray...", "1", "True if the ray, followed backward, moves outward at its end")
    time: np.ndarray | None = quantity(
        "ray...",
        "GM/c^3",
        "coordinate time from the end to the camera, or for ends at infinity the limit of t - r - 2 ln r; for an "
        "Observer, minus r + 2 ln r of the observer",
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
    impact: np.ndarray | None = quantity(
        "ray...",
        "GM/c^2",
        "axial angular momentum b of the light per energy at infinity, also of captured rays; NaN where that energy "
        "is not positive",
        default=None,
    )
    impact_error: np.ndarray | None = quantity("ray...", "GM/c^2", "estimated error of impact", default=None)
    carter: np.ndarray | None = quantity(
        "ray...", "(GM/c^2)^2", "Carter constant q of the light per square of that energy, as impact", default=None
    )
    carter_error: np.ndarray | None = quantity("ray...", "(GM/c^2)^2", "estimated error of carter", default=None)
    emission_cosine: np.ndarray | None = quantity(
        "ray...",
        "1",
        "cosine of the angle, as the source measures it, between the light that it sends to the camera and the normal "
        "of the surface of the end on that side; NaN where nothing can shine",
        default=None,
    )
    emission_error: np.ndarray | None = quantity("ray...", "1", "estimated error of emission_cosine", default=None)

    def __repr__(self) -> str:
        """The class, the shape, and the number of rays that escaped, in one line."""
        return f"<{type(self).__name__} of shape {self.status.shape}, {self.escaped.sum()} escaped, {self.engine}>"

    @property
    def engines(self) -> tuple[Engine, ...]:
        """The engines that traced the rays that reach their ends."""
        return engines_used(self.error, self.closed_form)

    @property
    def escaped(self) -> np.ndarray:
        """True where the ray reaches its end, the celestial sphere or another one, (...,) bool."""
        return (self.status != Status.CAPTURED) & (self.status != Status.MISSED)


def engines_used(error: np.ndarray, closed_form: np.ndarray) -> tuple[Engine, ...]:
    """The engines that traced the rays that reach their ends, from the fields of `Rays`."""
    flags = ((Engine.CLOSED_FORM, closed_form), (Engine.INTEGRATED, np.isfinite(error) & ~closed_form))
    return tuple(engine for engine, used in flags if used.any())


class BeamEllipse(NamedTuple):
    """The ellipses that beams, ellipses at the camera, have become. Arrays of one shape.

    delta_plus: major diameter.
    delta_minus: minor diameter, with the sign of det J.
    position_angle: position angle of the major axis, in (-pi/2, pi/2], as that of the beams.
    error: error of both diameters.
    angle_error: error of the position angle, radians, pi / 2 where the ellipse is a circle.
    """

    delta_plus: np.ndarray
    delta_minus: np.ndarray
    position_angle: np.ndarray
    error: np.ndarray
    angle_error: np.ndarray


class Ellipses(Shown):
    """Beams, by the matrix that takes displacements on the camera sky to those across the beam."""

    jacobian: np.ndarray
    jacobian_error: np.ndarray
    diameter_error: np.ndarray

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
        return _diameters(*_rotations(self.jacobian))[0]

    @property
    @derived("ray...", "1")
    def delta_minus(self) -> np.ndarray:
        """Minor diameter (...,), with the sign of det J: it passes smoothly through zero at critical curves."""
        return _diameters(*_rotations(self.jacobian))[1]

    @property
    @derived("ray...", "rad")
    def position_angle(self) -> np.ndarray:
        """Angle (...,) in radians, in (-pi/2, pi/2], from e_theta' toward e_phi' to the major axis."""
        return _position_angle(*_rotations(self.jacobian))

    def from_ellipse(self, ratio: ArrayLike, angle: ArrayLike) -> BeamEllipse:
        """The ellipses at the ends of beams that are ellipses at the camera.

        Parameters
        ----------
        ratio : (...,) array
            Ratio of the diameters at the camera, 0 to 1; the major diameter is 1.
        angle : (...,) array
            Angle of the major axis on the camera sky, in radians, from the direction of the first column of `jacobian`
            toward that of the second.

        Returns
        -------
        BeamEllipse
            Arrays over the beams, broadcast with those of the arguments.

        Raises
        ------
        ValueError
            If an argument is invalid.

        Errors
        ------
        `BeamEllipse.error` from `diameter_error`, and `BeamEllipse.angle_error` from `jacobian_error`.

        Examples
        --------
        >>> import kerrcaustics as kc
        >>> beams = kc.trace_beams(kc.Camera(spin=0.9, radius=10), [-0.6, 0.5, 0.4])
        >>> circle = beams.from_ellipse(1.0, 0.3)
        >>> bool(abs(circle.delta_plus - beams.delta_plus) < circle.error)
        True
        """
        part, turn = numbers("ratio", ratio), numbers("angle", angle)
        if not ((part >= 0) & (part <= 1)).all():
            raise ValueError(f"Argument `ratio` must lie in [0, 1], but is {quoted(ratio)}.")
        if not np.isfinite(turn).all():
            raise ValueError(f"Argument `angle` must be finite, but is {quoted(angle)}.")
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._become(part, np.cos(turn), np.sin(turn))

    def _become(self, ratio: np.ndarray, c: np.ndarray, s: np.ndarray) -> BeamEllipse:
        """The ellipses from those of a ratio, whose major axis lies along (c, s)."""
        first, second = self.jacobian[..., 0], self.jacobian[..., 1]
        c, s, ratio = c[..., None], s[..., None], ratio[..., None]
        even, odd = _rotations(np.stack([c * first + s * second, ratio * (c * second - s * first)], axis=-1))
        plus, minus = _diameters(even, odd)
        error = self.diameter_error * self.delta_plus + 0 * plus
        turn = np.where(error < plus - np.abs(minus), error / (plus - np.abs(minus)), np.pi / 2)
        # The basis turns as well.
        open_turn = np.where(self.jacobian_error < 1, self.jacobian_error - self.diameter_error, np.pi / 2)
        turn = np.minimum(turn + open_turn, np.pi / 2)
        return BeamEllipse(plus, minus, _position_angle(even, odd), error, np.where(np.isnan(plus), np.nan, turn))


def _rotations(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (..., 2, 2) as z -> even z + odd conj(z): a circle becomes an ellipse of semi-axes |even| +- |odd|."""
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    return ((a + d) + 1j * (c - b)) / 2, ((a - d) + 1j * (c + b)) / 2


def _diameters(even: np.ndarray, odd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The major diameter, and the minor one with the sign of the determinant."""
    return np.abs(even) + np.abs(odd), np.abs(even) - np.abs(odd)


def _position_angle(even: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """The angle from the first row to the major axis, in (-pi/2, pi/2]."""
    angle = (np.angle(even) + np.angle(odd)) / 2
    return angle - np.pi * np.ceil(angle / np.pi - 0.5)


@result("beams/1", kw_only=True)
class Beams(Rays, Ellipses):
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
        "estimated error of the Jacobian's entries, relative to delta_plus: diameter_error, and the turn of e_theta', "
        "e_phi' as n' moves by its error, which is large close to the spin axis",
    )
    diameter_error: np.ndarray = quantity(
        "ray...",
        "1",
        "estimated error, relative to delta_plus, of the diameters, and of the Jacobian's columns as vectors in space",
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
        """Tangents (..., 3) of the camera sky at sky (..., 3) that beams take to displacements (..., 2) at the end."""
        (a, b), (c, d) = np.moveaxis(self.jacobian, (-2, -1), (0, 1))
        first, second = displacement[..., 0], displacement[..., 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = np.stack([d * first - b * second, a * second - c * first]) / (a * d - b * c)
            e_1, e_2 = tangent_basis(sky)
            return u[..., None] * e_1 + v[..., None] * e_2
