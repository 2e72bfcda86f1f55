"""A point source of waves, on the celestial sphere or at a finite radius, as the viewer has it."""

import math
from dataclasses import dataclass

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import SKY, CelestialSphere, Sphere
from kerrcaustics.images.sheets import Sheets, sheets_of
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import redshift
from kerrcaustics.spacetime.sphere import from_angles
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


@dataclass(frozen=True)
class WaveSource:
    """A source at a place (theta', phi') of a surface."""

    viewer: Viewer
    surface: CelestialSphere | Sphere
    place: tuple[float, float]

    def beyond_viewer(self) -> "WaveSource":
        """The same source; one that is nearer to the hole than the viewer changes places with it.

        The field of a source whose strength refers to coordinate time stays the same then: Kerr spacetime is the same
        with time and azimuth reversed together.
        """
        viewer, radius = self.viewer, float(self.surface.radius)
        if radius >= viewer.radius:
            return self
        source_viewer = Camera(viewer.spin, radius, self.place[0], "fiducial")
        outward = SKY if math.isinf(viewer.radius) else Sphere(viewer.radius)
        return WaveSource(source_viewer, outward, (viewer.inclination, self.place[1]))

    @property
    def star(self) -> Float[Array, " 3"]:
        """The direction of the place from the hole."""
        return from_angles(*self.place)

    @property
    def nearness(self) -> float:
        """Nearness to the hole of viewer and source: the sum of their inverse radii."""
        return 1 / self.viewer.radius + 1 / float(self.surface.radius)

    def sheets(self, max_index: int) -> Sheets:
        """The sheets of the viewer's sky, with the caustics of the source's surface."""
        return sheets_of(self.viewer, max_index, self.surface)

    def amplitudes(
        self, camera: Viewer, sky: Float[Array, "rays 3"], beams: Beams, area: Float[Array, " rays"]
    ) -> Float[Array, " rays"]:
        """Moduli of the waves along rays, divided by that without the hole.

        camera: the viewer of the directions `sky` and the beams; area: on the viewer's sky at rest per solid angle on
        the source's sphere. Light of energy 1 at infinity goes through the area sqrt(R) per that angle there, R its
        radial potential, and not through r^2.
        """
        intensity = redshift(camera.frame(), sky) ** 2 * area / unlensed(self.viewer) ** 2
        if self.surface.finite:
            assert beams.impact is not None
            assert beams.carter is not None
            radial = kerr.radial_potential(self.viewer.spin, float(self.surface.radius), beams.impact, beams.carter)
            intensity = intensity * self._distance**2 / np.sqrt(np.maximum(radial, 0))
        return np.sqrt(intensity)

    @property
    def _distance(self) -> float:
        """The distance of source and viewer, as in flat space; 1, in units of itself, for an observer at infinity."""
        if math.isinf(self.viewer.radius):
            return 1.0
        viewer = self.viewer.radius * from_angles(self.viewer.inclination, 0.0)
        return float(np.linalg.norm(viewer - float(self.surface.radius) * self.star))


def unlensed(viewer: Viewer) -> float:
    """A radian at the viewer in units of its sky; 1 at infinity, by convention."""
    return viewer.radius if viewer.sky_unit != "rad" and math.isfinite(viewer.radius) else 1.0
