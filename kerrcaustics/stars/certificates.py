"""All images of sources on a surface, with the argument that none is missing: one certificate for each kind of surface.

Beyond the viewer the sky is cut into sheets, and the winding of the caustics counts the images on each (sheets.py,
search.py). Sources on a sphere within the viewer's radius change places with the viewer (reciprocal.py). In
the equatorial plane the image of the source's circle is cut into arcs (arc_images.py).
"""

from dataclasses import dataclass
from functools import singledispatch

import numpy as np
from jaxtyping import Bool, Float, Int

from kerrcaustics.beams.ends import CelestialSphere, End, EquatorialPlane, Sphere, Spherical
from kerrcaustics.curves.search_sky import search_sky
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.stars import arc_images
from kerrcaustics.stars.far_images import sharpened
from kerrcaustics.stars.reciprocal import search_within
from kerrcaustics.stars.search import ImageSearch, search
from kerrcaustics.stars.sheets import sheets_of

Array = np.ndarray


@dataclass(frozen=True)
class Counts:
    """How many images sources have, by index; the same as expected; who lies on a caustic, and who is certified."""

    found: Int[Array, "sources indices"]
    expected: Int[Array, "sources indices"]
    on_caustic: Bool[Array, " sources"]
    certified: Bool[Array, " sources"]


@dataclass(frozen=True)
class SheetsCertificate:
    """The degree of the sphere, sheet by sheet."""

    viewer: Viewer
    surface: Spherical
    max_index: int

    def searched(self, places: Float[Array, "sources 2"]) -> ImageSearch:
        """All images of sources."""
        vectors = self.surface.vectors(places)
        found = search(sheets_of(self.viewer, self.max_index, self.surface), vectors)
        return sharpened(search_sky(self.viewer), found, vectors, self.surface)

    def counted(self, places: Float[Array, "sources 2"], *, find: bool) -> Counts:
        """How many images there are; find: by a search too, which certifies them."""
        if find:
            found = self.searched(places)
            return Counts(found.counts, found.expected, np.asarray(found.touching.any(axis=1)), found.certified)
        told = sheets_of(self.viewer, self.max_index, self.surface).counted(self.surface.vectors(places))
        return Counts(told.expected, told.expected, told.on_caustic, np.zeros(len(places), bool))


@dataclass(frozen=True)
class ExchangeCertificate(SheetsCertificate):
    """The same of the viewer, as the source sees it."""

    def searched(self, places: Float[Array, "sources 2"]) -> ImageSearch:
        """All images of sources."""
        assert isinstance(self.surface, Sphere)
        return search_within(self.viewer, places, self.max_index, self.surface)


@dataclass(frozen=True)
class ArcsCertificate:
    """The degree of the circle: its azimuth runs once round."""

    viewer: Viewer
    surface: EquatorialPlane
    max_index: int

    def searched(self, places: Float[Array, "sources 2"]) -> ImageSearch:
        """All images of sources."""
        return arc_images.searched(self.viewer, places, self.max_index, self.surface)

    def counted(self, places: Float[Array, "sources 2"], *, find: bool) -> Counts:
        """How many images there are."""
        counts, near, certified = arc_images.counted(self.viewer, places, self.max_index, self.surface)
        return Counts(counts, counts, near, certified)


Certificate = SheetsCertificate | ArcsCertificate


@singledispatch
def certificate_of(surface: End, viewer: Viewer, max_index: int) -> Certificate:
    """The certificate of a surface: the one place that knows which surface it is."""
    raise TypeError(f"no certificate of {type(surface).__name__}")


@certificate_of.register
def _at_infinity(surface: CelestialSphere, viewer: Viewer, max_index: int) -> Certificate:
    return SheetsCertificate(viewer, surface, max_index)


@certificate_of.register
def _on_sphere(surface: Sphere, viewer: Viewer, max_index: int) -> Certificate:
    within = surface.radius < viewer.radius
    return (ExchangeCertificate if within else SheetsCertificate)(viewer, surface, max_index)


@certificate_of.register
def _in_plane(surface: EquatorialPlane, viewer: Viewer, max_index: int) -> Certificate:
    return ArcsCertificate(viewer, surface, max_index)
