"""Circles of the celestial sphere, along which stars move: small ones about the spin axis, great ones about any."""

import math
from dataclasses import dataclass

import numpy as np

from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.sphere import from_angles, polar_angle, polar_basis

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Circle:
    """All points at one angle from an axis.

    angle: from the axis, radians; axes (3, 3): unit vectors, rows: those from which and toward which longitude is
    counted, and the axis. Longitude is right-handed about the axis.
    """

    angle: float
    axes: Float[Array, "3 3"]

    @classmethod
    def about_spin_axis(cls, theta: float) -> "Circle":
        """The circle theta' = theta, with phi' as its longitude."""
        return cls(theta, np.eye(3))

    @classmethod
    def from_centre(cls, centre: Float[Array, " 3"], angle: float) -> "Circle":
        """The circle at an angle from a centre, a unit vector."""
        return cls(angle, np.stack([*polar_basis(centre), centre]))

    @classmethod
    def great(cls, theta: float, phi: float) -> "Circle":
        """The great circle with the normal (theta', phi'). Longitude begins at its ascending node on the equator.

        Where the circle is the equator it begins at phi' = 0.
        """
        normal = from_angles(theta, phi)
        # East of the normal, on the equator, lies the ascending node.
        node = polar_basis(normal)[1] if math.sin(theta) > 0 else np.array([1.0, 0.0, 0.0])
        return cls(math.pi / 2, np.stack([node, np.cross(normal, node), normal]))

    def place(self, longitude: Float[Array, "*batch"]) -> Float[Array, "*batch 3"]:
        """Points of the circle."""
        return from_angles(np.full(np.shape(longitude), self.angle), longitude) @ self.axes

    def longitude(self, direction: Float[Array, "*batch 3"]) -> Float[Array, "*batch"]:
        """Longitude of directions, in (-pi, pi]."""
        return np.arctan2(direction @ self.axes[1], direction @ self.axes[0])

    def height(self, direction: Float[Array, "*batch 3"]) -> Float[Array, "*batch"]:
        """Angle from the circle to directions, positive toward the axis, radians."""
        return self.angle - polar_angle(direction @ self.axes.T)

    def upward_and_east(
        self, direction: Float[Array, "*batch 3"]
    ) -> tuple[Float[Array, "*batch 3"], Float[Array, "*batch 3"]]:
        """Unit tangents at directions: along the gradients of the height and of the longitude."""
        e_theta, e_phi = polar_basis(direction @ self.axes.T)
        return -e_theta @ self.axes, e_phi @ self.axes
