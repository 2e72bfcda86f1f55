"""Motion while a picture is exposed: of the camera, of its view, and of time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import quoted, real_number, refuse_tracer

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class ShutterMotion:
    """Motion while a picture is exposed: its first and its last moment. The one between is an argument of `render`.

    Parameters
    ----------
    cameras : (Camera, Camera)
        When the shutter opens, and when it closes.
    views : (View, View)
        Then; as large as the picture, and of its projection.
    azimuths : (float, float)
        phi of the camera then, radians, from what it is in the middle.
    times : (float, float)
        Coordinate time then, from what it is in the middle, for the pattern of a disk.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    In between, places, velocities and axes are quadratic in time through the three moments.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> cameras = [kc.Camera(0.9, radius, velocity=(-0.3, 0, 0.2)) for radius in (6.1, 6.0)]
    >>> views = [kc.pictures.View.toward_hole(camera, 64, 36, 1.4) for camera in cameras]
    >>> motion = kc.pictures.ShutterMotion(cameras, views, azimuths=(-0.02, 0.02), times=(-0.2, 0.2))
    """

    cameras: tuple[Camera, Camera]
    views: tuple[View, View]
    azimuths: tuple[float, float] = (0.0, 0.0)
    times: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Raise ValueError unless the two moments are valid."""
        for name, kind in (("cameras", Camera), ("views", View)):
            value = getattr(self, name)
            if not _two(value) or not all(isinstance(one, kind) for one in value):
                raise ValueError(f"Argument `{name}` must be two objects of the class {kind.__name__}.")
        for name in ("azimuths", "times"):
            value = getattr(self, name)
            refuse_tracer(name, value)
            if not _two(value) or not all(math.isfinite(real_number(name, number)) for number in value):
                raise ValueError(f"Argument `{name}` must be two finite numbers, but is {quoted(value)}.")

    def about(self, camera: Camera, view: View, time: float) -> "Exposure":
        """The exposure with this moment in its middle."""
        if any(other.spin != camera.spin for other in self.cameras):
            raise ValueError(f"Argument `motion` must keep the spin of the hole, {camera.spin:g}.")
        if any(_form(other) != _form(view) for other in self.views):
            raise ValueError("Argument `motion` must keep width, height and projection of the view.")
        first, last = (
            ExposedMoment(*parts[:3], time + parts[3])
            for parts in zip(self.cameras, self.views, self.azimuths, self.times, strict=True)
        )
        return Exposure(first, ExposedMoment(camera, view, 0.0, time), last)


class ExposedMoment(NamedTuple):
    """A camera, its view, its azimuth (radians), and coordinate time."""

    camera: Camera
    view: View
    azimuth: float
    time: float

    @property
    def sight(self) -> tuple[Any, ...]:
        """All that a view of the hole depends on."""
        camera, view = self.camera, self.view
        place = camera.radius, camera.inclination, camera.fido_velocity()
        return *place, view.field_of_view, *view.forward.tolist(), *view.up.tolist()


class Exposure(NamedTuple):
    """Moments of an exposure, whose time goes from -1/2 to 1/2."""

    first: ExposedMoment
    middle: ExposedMoment
    last: ExposedMoment

    @property
    def still(self) -> bool:
        """True if the camera sees the hole alike all the time: it may go round, and time may pass."""
        return self.first.sight == self.middle.sight == self.last.sight

    @property
    def turn(self) -> float:
        """Angle by which the sky turns before the camera."""
        return self.first.azimuth - self.last.azimuth

    def at(self, moment: float) -> ExposedMoment:
        """The camera and the rest at a moment."""
        for end, place in zip(self, (-0.5, 0.0, 0.5), strict=True):
            if moment == place:
                return end
        azimuth, time = (float(self._between(moment, [one[k] for one in self])) for k in (2, 3))
        if self.still:
            return ExposedMoment(self.middle.camera, self.middle.view, azimuth, time)
        numbers = [(one.camera.radius, one.camera.inclination, *one.camera.fido_velocity()) for one in self]
        radius, inclination, *velocity = self._between(moment, numbers).tolist()
        camera = Camera(self.middle.camera.spin, radius, min(max(inclination, 0.0), math.pi), tuple(velocity))
        return ExposedMoment(camera, self._view(camera, moment), azimuth, time)

    def pieces(self, count: int) -> "list[Exposure]":
        """Divide it into so many parts, in order of time."""
        ends = np.linspace(-0.5, 0.5, 2 * count + 1).tolist()
        return [Exposure(*(self.at(moment) for moment in ends[k : k + 3])) for k in range(0, 2 * count, 2)]

    def _view(self, camera: Camera, moment: float) -> View:
        """The view: its axes move smoothly for the fiducial observer, who has axes of his own."""
        views = [one.view for one in self]
        field = float(self._between(moment, [view.field_of_view for view in views]))
        bases = [np.asarray(one.camera.frame().basis) for one in self]
        axes = [np.stack([view.forward, view.up]) @ basis for view, basis in zip(views, bases, strict=True)]
        forward, up = self._between(moment, axes) @ np.asarray(camera.frame().basis).T
        return View(views[1].width, views[1].height, field, views[1].projection, forward, up)

    def _between(self, moment: float, values: Sequence[Any]) -> Float[Array, "*shape"]:
        """Return values at a moment, quadratic in time."""
        first, middle, last = (np.asarray(value, float) for value in values)
        return np.asarray(middle + moment * (last - first) + 2 * moment**2 * (last - 2 * middle + first))


def _two(value: Any) -> bool:
    return isinstance(value, Sequence) and len(value) == 2


def _form(view: View) -> tuple[int, int, str]:
    return view.width, view.height, view.projection
