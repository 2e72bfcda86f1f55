"""The maps from a sky to a surface of sources: from the search sky, whoever looks, and from a viewer's own.

`SearchMap` is all that critical curves and sheets depend on; `LensMap` has all that is seen of what shines there.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from kerrcaustics.beams.beam import Beams, Rays
from kerrcaustics.beams.ends import SKY, End
from kerrcaustics.beams.trace import beams_of_directions, check_request, rays_of_directions
from kerrcaustics.lens_map.domains import Domain, OneLeaf, domain_of, leaves_of
from kerrcaustics.lens_map.search_sky import TOLERANCE, SearchSky, search_camera, search_sky
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.arrays import HostVectors
from kerrcaustics.spacetime.frame import sky_from_fido
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Kind = TypeVar("Kind", bound=Rays)


@dataclass(frozen=True)
class SearchMap:
    """The map of one camera at rest, or of the observer who searches for it: the key of all that is kept of a search.

    surface: as a first arrival; of those that are kept the bare one. engine, tolerance: of the beams.
    """

    camera: Viewer
    surface: End = SKY
    engine: str = "auto"
    tolerance: float = TOLERANCE

    @classmethod
    def for_viewer(
        cls, viewer: Viewer, surface: End, engine: str = "auto", tolerance: float = TOLERANCE
    ) -> "SearchMap":
        """The map that is searched for a viewer; ValueError unless engine and tolerance are valid."""
        _, tolerance = check_request(viewer, engine, tolerance)
        return cls(search_camera(viewer), surface, engine, tolerance)

    @cached_property
    def domain(self) -> Domain:
        """The part of the sky whose rays reach the surface."""
        return domain_of(self.surface, self.camera)

    @cached_property
    def leaves(self) -> OneLeaf:
        """The same for the map of a sphere; TypeError for another one."""
        return leaves_of(self.surface, self.camera)

    def beams(
        self, line_of_sight: Float[Array, "n 3"], second_arrival: Bool[Array, " n"], tolerance: float | None = None
    ) -> Beams:
        """Beams of directions of the FIDO, with their index."""
        return self.beams_of_sky(sky_from_fido(self.camera.frame(), -line_of_sight), second_arrival, tolerance)

    def beams_of_sky(
        self,
        sky: Float[Array, "n 3"],
        second_arrival: Bool[Array, " n"] | None = None,
        tolerance: float | None = None,
        *,
        time: bool = False,
        index: bool = True,
        constants: bool = False,
    ) -> Beams:
        """Beams of directions N; without crossings of the plane and redshifts."""
        accuracy = tolerance or self.tolerance

        def trace(sky: Array, end: End) -> Beams:
            return beams_of_directions(
                self.camera,
                sky,
                self.engine,
                accuracy,
                end=end,
                time=time,
                index=index,
                crossings=False,
                redshift=False,
                constants=constants,
            )

        return on_leaves(self.surface.bare(), sky, second_arrival, trace)

    def rays_of_sky(
        self, sky: Float[Array, "n 3"], second_arrival: Bool[Array, " n"] | None = None, tolerance: float | None = None
    ) -> Rays:
        """Rays of directions N."""
        accuracy = tolerance or self.tolerance

        def trace(sky: Array, end: End) -> Rays:
            return rays_of_directions(self.camera, sky, self.engine, accuracy, end=end)

        return on_leaves(self.surface.bare(), sky, second_arrival, trace)

    def directions(
        self, line_of_sight: HostVectors, second_arrival: Bool[Array, "*batch"], tolerance: float | None = None
    ) -> HostVectors:
        """Unit vectors n' (..., 3)."""
        sky = sky_from_fido(self.camera.frame(), -line_of_sight).reshape(-1, 3)
        rays = self.rays_of_sky(sky, second_arrival.ravel(), tolerance)
        return rays.direction.reshape(line_of_sight.shape)


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

    def light_at(self, sky: Float[Array, "n 3"], second_arrival: Bool[Array, " n"] | None = None) -> SeenLight:
        """Directions on the search sky, as the viewer has them. The rays are those of the directions given."""
        searched = self.sky
        place = searched.to_viewer(sky)
        size = searched.stretch(place)
        own = searched.shares_engines

        def beams_on_leaf(directions: Array, end: End) -> Beams:
            viewer = self.viewer if own else searched.search_camera
            return beams_of_directions(viewer, directions, "auto", TOLERANCE, end=end, time=True)

        beams = on_leaves(self.surface, place if own else sky, second_arrival, beams_on_leaf)
        _, azimuth = self.surface.angles(beams.direction, beams.azimuth)
        redshift = np.asarray(beams.redshift)
        times = searched.viewer_time(np.asarray(beams.time), np.asarray(beams.time_error))
        if own:
            return SeenLight(place, beams, azimuth, beams.magnification, redshift, *times, beams.delta_plus * size)
        magnification = beams.magnification * (searched.radian_at_rest(sky) * size) ** 2
        return SeenLight(place, beams, azimuth, magnification, redshift / size, *times, beams.delta_plus)

    def errors(self, sky: Float[Array, "n 3"], error: Float[Array, " n"]) -> Float[Array, " n"]:
        """Errors of directions on the search sky, radians, as the viewer has them."""
        return self.sky.errors(sky, error)


def on_leaves(
    surface: End,
    sky: Float[Array, "n 3"],
    second_arrival: Bool[Array, " n"] | None,
    traced: Callable[[Array, End], Kind],
) -> Kind:
    """Rays, or beams, of first and second arrivals, as `traced` returns them for directions N and a surface."""
    if second_arrival is None or not second_arrival.any():
        return traced(sky, surface)
    second = traced(sky[second_arrival], surface.at_second_arrival())
    return second if second_arrival.all() else _merged(traced(sky[~second_arrival], surface), second, second_arrival)


def _merged(first: Kind, second: Kind, second_arrival: Bool[Array, " n"]) -> Kind:
    """Rays of both arrivals in one order."""

    def joined(start: object, stop: object) -> object:
        if not isinstance(start, np.ndarray) or not isinstance(stop, np.ndarray):
            return start
        both = np.empty((len(second_arrival), *start.shape[1:]), start.dtype)
        both[~second_arrival], both[second_arrival] = start, stop
        return both

    return replace(first, **{f.name: joined(getattr(first, f.name), getattr(second, f.name)) for f in fields(first)})
