"""The lens map: from a viewer's sky to a surface of sources, with all that is seen of what shines there."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import End
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.lens_map.search_map import on_leaves
from kerrcaustics.lens_map.search_sky import TOLERANCE, SearchSky, search_sky
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

TRAVEL_TIME = (
    "coordinate time from the source to the camera; r + 2 ln r is taken off at the end of a source at infinity, and at "
    "that of an Observer"
)
"""The meaning of `time` in results."""


@dataclass(frozen=True)
class SeenLight:
    """Light on the sky of a viewer: places, beams, magnification, redshift and travel times as the viewer has them.

    The beams belong to the viewer if that shares the engines' sky, else to the search camera; places of their ends are
    the viewer's too. azimuth: unwrapped second coordinate of the places on the surface. spread: major diameters of
    beams of unit size on the search sky.
    """

    sky: Float[Array, "n axes"]
    beams: Beams
    azimuth: Float[Array, " n"]
    magnification: Float[Array, " n"]
    redshift: Float[Array, " n"]
    time: Float[Array, " n"]
    time_error: Float[Array, " n"]
    spread: Float[Array, " n"]


@dataclass(frozen=True)
class LensMap:
    """A viewer and a surface of sources, with what shines on it."""

    viewer: Viewer
    surface: End

    @property
    def sky(self) -> SearchSky:
        """The sky that is searched for the viewer."""
        return search_sky(self.viewer)

    def seen(self, sky: Float[Array, "n 3"], second_arrival: Bool[Array, " n"] | None = None) -> SeenLight:
        """Directions on the search sky, as the viewer has them. The rays are those of the directions given."""
        searched = self.sky
        place = searched.shown(sky)
        size = searched.stretch(place)
        own = searched.shares_engines

        def traced(directions: Array, end: End) -> Beams:
            viewer = self.viewer if own else searched.search_camera
            return trace_beams(viewer, directions, "auto", TOLERANCE, end=end, time=True)

        beams = on_leaves(self.surface, place if own else sky, second_arrival, traced)
        _, azimuth = self.surface.angles(beams.direction, beams.azimuth)
        redshift = np.asarray(beams.redshift)
        times = searched.viewer_time(np.asarray(beams.time), np.asarray(beams.time_error))
        if own:
            return SeenLight(place, beams, azimuth, beams.magnification, redshift, *times, beams.delta_plus * size)
        magnification = beams.magnification * (searched.still_lengths(sky) * size) ** 2
        return SeenLight(place, beams, azimuth, magnification, redshift / size, *times, beams.delta_plus)

    def errors(self, sky: Float[Array, "n 3"], error: Float[Array, " n"]) -> Float[Array, " n"]:
        """Errors of directions on the search sky, radians, as the viewer has them."""
        return self.sky.errors(sky, error)
