"""All images of sources on a surface, with the argument that none is missing: one certificate for each domain.

On one leaf, beyond the viewer, the sky is cut into sheets, and the winding of the caustics counts the images on each
(sheets.py, search.py). Sources on a sphere within the viewer's radius change places with the viewer (reciprocal.py). In
the equatorial plane the image of the source's circle is cut into arcs (circle_arcs.py).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.images import circle_arcs
from kerrcaustics.images.reciprocal import search_within
from kerrcaustics.images.search import ImageSearch, search, sharpened
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.lens_map.domains import Domain, OneLeaf, Ring, TwoLeaves, domain_of
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


@dataclass(frozen=True)
class Counts:
    """Numbers of images by index, found and expected, and flags: sources on a caustic, certified sources."""

    found: Int[Array, "sources indices"]
    expected: Int[Array, "sources indices"]
    on_caustic: Bool[Array, " sources"]
    certified: Bool[Array, " sources"]


@dataclass(frozen=True)
class SheetsCertificate:
    """The degree of the sphere, sheet by sheet.

    follows: True if images between the nodes of a level curve can be found from them.
    """

    viewer: Viewer
    domain: OneLeaf
    max_index: int
    follows: ClassVar[bool] = True

    def images(self, places: Float[Array, "sources 2"]) -> ImageSearch:
        """All images of sources."""
        surface = self.domain.surface
        vectors = surface.vectors(places)
        images = search(sheets_of(self.viewer, self.max_index, surface), vectors)
        return sharpened(search_sky(self.viewer), images, vectors, surface)

    def counts(self, places: Float[Array, "sources 2"], *, find: bool) -> Counts:
        """Numbers of images. find: also by a search, which certifies them."""
        if find:
            images = self.images(places)
            return Counts(images.counts, images.expected, np.any(images.on_caustic, axis=1), images.certified)
        surface = self.domain.surface
        counted = sheets_of(self.viewer, self.max_index, surface).expected_counts(surface.vectors(places))
        certified = np.zeros(len(places), bool)
        return Counts(counted.expected, counted.expected, np.any(counted.on_caustic, axis=1), certified)


@dataclass(frozen=True)
class ExchangeCertificate(SheetsCertificate):
    """The degree of the sphere, sheet by sheet, for the viewer as the source sees it."""

    domain: TwoLeaves
    follows: ClassVar[bool] = False

    def images(self, places: Float[Array, "sources 2"]) -> ImageSearch:
        """All images of sources."""
        return search_within(self.viewer, places, self.max_index, self.domain.surface)


@dataclass(frozen=True)
class ArcsCertificate:
    """The degree of the circle: the azimuth along its image grows by one turn."""

    viewer: Viewer
    domain: Ring
    max_index: int
    follows: ClassVar[bool] = False

    def images(self, places: Float[Array, "sources 2"]) -> ImageSearch:
        """All images of sources."""
        return circle_arcs.search_arcs(self.domain, places, self.max_index)

    def counts(self, places: Float[Array, "sources 2"], *, find: bool) -> Counts:
        """Numbers of images."""
        counts, near, certified = circle_arcs.count_on_arcs(self.domain, places, self.max_index)
        return Counts(counts, counts, near, certified)


Certificate = SheetsCertificate | ArcsCertificate

_CERTIFICATES: dict[type[Domain], Callable[..., Certificate]] = {
    OneLeaf: SheetsCertificate,
    TwoLeaves: ExchangeCertificate,
    Ring: ArcsCertificate,
}


def certificate_of(surface: End, viewer: Viewer, max_index: int) -> Certificate:
    """The certificate that belongs to the domain of a surface."""
    domain = domain_of(surface, viewer)
    return _CERTIFICATES[type(domain)](viewer, domain, max_index)
