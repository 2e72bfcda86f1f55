"""The sky on which images are searched, and what the viewer makes of it: the own sky of a camera, or a screen.

A moving camera sees what one at rest sees at the same event, with aberration. Where the hole is tiny on the sky, an
observer at the same place searches instead, whose sky is magnified about the hole. All three skies map to each other
without distortion, so that one factor of length describes their beams.
"""

from dataclasses import dataclass
from functools import singledispatch
from typing import ClassVar

import numpy as np

from kerrcaustics.lens_map import newton_limits
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.frame import Frame, doppler, line_of_sight_from_sky, sky_from_line_of_sight
from kerrcaustics.spacetime.observer import Observer, on_screen, screen_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

TOLERANCE = newton_limits.TOLERANCE
"""Tolerance of the beams in all analyses of sources: radians, in the plane relative to the radius."""

# Radius from which on an observer searches for cameras.
_FAR = 1e5
# Of a direction that is moved from one sky to another.
_ROUNDING = 4e-16


@dataclass(frozen=True)
class SearchSky:
    """The sky of the viewer who searches, and how another viewer at the same event sees it."""

    viewer: Viewer
    search_camera: Viewer
    shares_engines: ClassVar[bool] = False
    """True if engines trace the places of the viewer as well as those of the search camera."""

    @property
    def plain_camera(self) -> Camera | None:
        """A camera at rest at the same place, if the search sky is magnified and the place is known."""
        viewer = self.viewer
        if self.shares_engines or viewer.radius == np.inf:
            return None
        return Camera(viewer.spin, viewer.radius, viewer.inclination, "fiducial")

    def to_viewer(self, sky: Float[Array, "n 3"]) -> Float[Array, "n axes"]:
        """Directions on the search sky, as places on the viewer's."""
        raise NotImplementedError

    def to_search(self, place: Float[Array, "n axes"]) -> Float[Array, "n 3"]:
        """Directions on the search sky of places on the viewer's: the inverse of `to_viewer`."""
        return as_seen(self.viewer.directions(place), self.viewer.frame(), self.search_camera.frame())

    def radian_at_rest(self, sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """The factor by which a radian on the search sky is longer for a viewer at rest."""
        return np.ones(len(sky))

    def stretch(self, place: Float[Array, "n axes"]) -> Float[Array, " n"]:
        """The factor by which aberration makes lengths longer at places on the viewer's sky."""
        return np.ones(len(place))

    def rounding(self, place: Float[Array, "n axes"]) -> Float[Array, " n"] | float:
        """Rounding of places, in their units, that comes with aberration."""
        return 0.0

    def circle_radius(self, ring: Float[Array, "n axes"], inside: Float[Array, " axes"]) -> tuple[float, float]:
        """Radius of a circle on the viewer's sky, about a place inside it, and its error."""
        raise NotImplementedError

    def lengths(self, sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Lengths of a radian on the search sky for the viewer, with aberration; in M on a screen."""
        return self.radian_at_rest(sky) * self.stretch(self.to_viewer(sky))

    def errors(self, sky: Float[Array, "n 3"], error: Float[Array, " n"]) -> Float[Array, " n"]:
        """Errors of directions on the search sky, radians, as the viewer has them; in M on a screen."""
        place = self.to_viewer(sky)
        return error * (self.radian_at_rest(sky) * self.stretch(place)) + self.rounding(place)

    @property
    def time_slope(self) -> float:
        """Derivative by the viewer's radius of what `viewer_time` adds."""
        return 0.0

    def viewer_time(
        self, time: Float[Array, "*batch"], error: Float[Array, "*batch"]
    ) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
        """Times to the search camera and their errors, as times to the viewer."""
        start = self.viewer.frame().start - self.search_camera.frame().start
        return time + start, error + np.spacing(start)


class CameraSky(SearchSky):
    """The sky of a camera, searched by one at rest."""

    shares_engines: ClassVar[bool] = True

    def to_viewer(self, sky: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
        """Directions with aberration."""
        return as_seen(sky, self.search_camera.frame(), self.viewer.frame())

    def stretch(self, place: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Aberration maps the sky without distortion, and shrinks what it shifts to the blue."""
        frame = self.viewer.frame()
        return doppler(frame, tuple(place.T))[0] / frame.slowness**0.5

    def rounding(self, place: Float[Array, "n 3"]) -> Float[Array, " n"] | float:
        """The rounding of both directions, which may be more where aberration shrinks the error."""
        return _ROUNDING * (1 + self.stretch(place)) if self.viewer.frame().speed else 0.0

    def circle_radius(self, ring: Float[Array, "n 3"], inside: Float[Array, " 3"]) -> tuple[float, float]:
        """Angular radius. Aberration takes circles to circles, about another centre."""
        one, two, three = ring[:: max(1, len(ring) // 3)][:3]
        centre = np.cross(two - one, three - one)
        centre *= np.copysign(1 / np.linalg.norm(centre), centre @ (inside - one))
        sizes = np.arctan2(np.linalg.norm(np.cross(ring, centre), axis=1), ring @ centre)
        return float(sizes.mean()), float(np.ptp(sizes) + _ROUNDING)


class FarCameraSky(CameraSky):
    """The sky of a camera far away, searched by an observer there."""

    shares_engines: ClassVar[bool] = False

    @property
    def time_slope(self) -> float:
        """The slope of r + 2 ln r."""
        return 1 + 2 / self.viewer.radius

    def radian_at_rest(self, sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Radians at a camera at rest."""
        return radians_of(self.viewer.radius, sky, _screen_lengths(sky))


class ScreenSky(SearchSky):
    """The screen of an observer, who searches."""

    def to_viewer(self, sky: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """Places (alpha, beta)."""
        return on_screen(sky)

    def radian_at_rest(self, sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Lengths in M."""
        return _screen_lengths(sky)

    def circle_radius(self, ring: Float[Array, "n 2"], inside: Float[Array, " 2"]) -> tuple[float, float]:
        """Radius of a circle about the hole, in M."""
        sizes = np.linalg.norm(ring, axis=1)
        return float(sizes.mean()), float(np.ptp(sizes) + _ROUNDING * sizes.max())


@singledispatch
def search_sky(viewer: Viewer) -> SearchSky:
    """The sky that is searched for a viewer: one method for each class of viewers."""
    raise TypeError(f"no sky of {type(viewer).__name__}")


@search_sky.register
def _of_camera(viewer: Camera) -> SearchSky:
    if viewer.radius < _FAR:
        return CameraSky(viewer, viewer.at_rest())
    return FarCameraSky(viewer, Observer(spin=viewer.spin, inclination=viewer.inclination, radius=viewer.radius))


@search_sky.register
def _of_observer(viewer: Observer) -> SearchSky:
    return ScreenSky(viewer, viewer)


def search_camera(viewer: Viewer) -> Viewer:
    """The camera at rest, or the observer, whose sky is searched for a viewer at the same event."""
    return search_sky(viewer).search_camera


def shown_line_of_sight(viewer: Viewer, line_of_sight: Float[Array, "n 3"]) -> Float[Array, "n axes"]:
    """Lines of sight on the search sky, as places on the viewer's."""
    sky = search_sky(viewer)
    return sky.to_viewer(sky_from_line_of_sight(sky.search_camera.frame(), line_of_sight))


def as_seen(sky: np.ndarray, first: Frame, second: Frame) -> np.ndarray:
    """The directions N (..., 3) on the sky of one viewer, as the other one sees them: viewers at the same event."""
    line_of_sight = line_of_sight_from_sky(first, sky)
    return sky_from_line_of_sight(
        second, line_of_sight if first.zoom == second.zoom else _zoomed_by(first.zoom / second.zoom, line_of_sight)
    )


def _zoomed_by(zoom: float, line_of_sight: np.ndarray) -> np.ndarray:
    """Lines of sight (..., 3) of the FIDO, tangents of half the angle from the hole multiplied by zoom."""
    inward = -line_of_sight[..., :1]
    across = (line_of_sight[..., 1:] ** 2).sum(axis=-1, keepdims=True)
    # 1 + cos and 1 - cos of the angle, of which one is small.
    near, far = np.where(inward > 0, 1 + inward, 0), np.where(inward > 0, 0, 1 - inward)
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = np.where(inward > 0, near, across / far), np.where(inward > 0, across / near, far)
    size = near + zoom**2 * far
    return np.concatenate([(zoom**2 * far - near) / size, 2 * zoom * line_of_sight[..., 1:] / size], axis=-1)


def _screen_lengths(sky: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """Lengths in M on a screen of a radian on the engines' sphere."""
    return 1 / np.linalg.norm(screen_basis(sky)[0], axis=-1)


def radians_of(radius: float, sky: Float[Array, "n 3"], size: Float[Array, " n"]) -> Float[Array, " n"]:
    """Lengths (M) beside places of a screen at some radius, as angles."""
    # A direction at the angle psi has the length 2 r tan(psi / 2).
    part = np.linalg.norm(on_screen(sky), axis=-1) / (2 * radius)
    return size / (radius * (1 + part**2))


def magnified(frame: Frame, motion: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Directions of photons (r, theta, phi), which move outward, on the sky as an observer's engines take it.

    The inverse of `zoomed`, for others the directions themselves. Tangents of half the angle from the direction to the
    hole are divided by the zoom.
    """
    if frame.zoom == 1:
        return motion
    across = motion[:, 1:] / (frame.zoom * (1 + motion[:, :1]))
    square = (across * across).sum(axis=1, keepdims=True)
    return np.concatenate([1 - square, 2 * across], axis=1) / (1 + square)
