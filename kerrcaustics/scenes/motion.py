"""Motion while a picture is exposed: of the camera, of its view, and of time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from kerrcaustics.scenes.raster import Raster
from kerrcaustics.spacetime.checks import quoted, real_number, refuse_tracer
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class ShutterMotion:
    """Motion while a picture is exposed: its first and its last moment. The one between is an argument of `render`.

    Parameters
    ----------
    cameras : (Camera, Camera), or (Observer, Observer)
        When the shutter opens, and when it closes.
    views : (View, View), or (Screen, Screen)
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
    In between, places, velocities and axes are quadratic in time through the three moments; of observers the inverse of
    the radius is. An observer stays at rest: what changes is which one it is.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> cameras = [kc.Camera(0.9, radius, velocity=(-0.3, 0, 0.2)) for radius in (6.1, 6.0)]
    >>> views = [kc.pictures.View.toward_hole(camera, 64, 36, 1.4) for camera in cameras]
    >>> motion = kc.pictures.ShutterMotion(cameras, views, azimuths=(-0.02, 0.02), times=(-0.2, 0.2))
    """

    cameras: tuple[Viewer, Viewer]
    views: tuple[Raster, Raster]
    azimuths: tuple[float, float] = (0.0, 0.0)
    times: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Raise ValueError unless the two moments are valid."""
        for name, kind, words in (("cameras", Viewer, "Camera or Observer"), ("views", Raster, "View or Screen")):
            value = getattr(self, name)
            if not _two(value) or not all(isinstance(one, kind) for one in value):
                raise ValueError(f"Argument `{name}` must be two objects of the class {words}.")
        for name in ("azimuths", "times"):
            value = getattr(self, name)
            refuse_tracer(name, value)
            if not _two(value) or not all(math.isfinite(real_number(name, number)) for number in value):
                raise ValueError(f"Argument `{name}` must be two finite numbers, but is {quoted(value)}.")

    def about(self, camera: Viewer, view: Raster, time: float) -> "Exposure":
        """The exposure with this moment in its middle."""
        if any(other.spin != camera.spin for other in self.cameras):
            raise ValueError(f"Argument `motion` must keep the spin of the hole, {camera.spin:g}.")
        if any(type(other) is not type(camera) for other in self.cameras):
            raise ValueError(f"Argument `motion` must have cameras of the class {type(camera).__name__}.")
        if any(other.form != view.form for other in self.views):
            raise ValueError("Argument `motion` must keep width, height and projection of the view.")
        first, last = (
            ExposedMoment(*parts[:3], time + parts[3])
            for parts in zip(self.cameras, self.views, self.azimuths, self.times, strict=True)
        )
        return Exposure(first, ExposedMoment(camera, view, 0.0, time), last)


class ExposedMoment(NamedTuple):
    """A camera, its view, its azimuth (radians), and coordinate time."""

    camera: Viewer
    view: Raster
    azimuth: float
    time: float

    @property
    def sight(self) -> list[float]:
        """All numbers that a view of the hole depends on."""
        return self.view.moving_numbers(self.camera)


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
        middle = self.middle
        if self.still:
            return ExposedMoment(middle.camera, middle.view, azimuth, time)
        values = self._between(moment, [one.sight for one in self]).tolist()
        return ExposedMoment(*middle.view.with_moving_numbers(middle.camera.spin, values), azimuth, time)

    def pieces(self, count: int) -> "list[Exposure]":
        """Divide it into so many parts, in order of time."""
        ends = np.linspace(-0.5, 0.5, 2 * count + 1).tolist()
        return [Exposure(*(self.at(moment) for moment in ends[k : k + 3])) for k in range(0, 2 * count, 2)]

    def _between(self, moment: float, values: Sequence[Any]) -> Float[Array, "*shape"]:
        """Return values at a moment, quadratic in time."""
        first, middle, last = (np.asarray(value, float) for value in values)
        return np.asarray(middle + moment * (last - first) + 2 * moment**2 * (last - 2 * middle + first))


def _two(value: Any) -> bool:
    return isinstance(value, Sequence) and len(value) == 2
