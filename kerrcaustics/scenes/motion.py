"""The motion during an exposure: of the camera, of its view, and of time; and the weight of each moment."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.choices import ShutterShape
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import one_of, quoted, real_array, real_number, refuse_tracer
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Largest number of values of a user's curve.
_MOST_NUMBERS = 1000


@dataclass(frozen=True, eq=False)
class ShutterMotion:
    """The motion during an exposure, by its first and its last moment; the middle moment is an argument of `render`.

    Parameters
    ----------
    cameras : (Camera, Camera), or (Observer, Observer)
        When the shutter opens, and when it closes.
    views : (View, View), or (Screen, Screen)
        At these moments; as large as the picture, and of its projection.
    azimuths : (float, float)
        phi of the camera at these moments, radians, relative to the middle.
    times : (float, float)
        Coordinate time of these moments, relative to the middle, for the pattern of a disk.
    weight : str or sequence of float
        Weight of each moment: "box", constant; "triangle", growing from 0 to the middle and falling again;
        "cosine", 1 + cos(2 pi t), a smooth bell; or a curve of 2 to 1,000 numbers at equal steps from the first moment
        to the last, joined by straight lines. All let through the same amount of light.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    In between, places, velocities and axes are quadratic in time through the three moments; for observers, the inverse
    of the radius is. At each moment the picture is that of an observer at rest.

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
    weight: ShutterShape | Sequence[float] = "box"

    def __post_init__(self) -> None:
        """Raise ValueError unless the two moments are valid."""
        for name, kind, words in (("cameras", Viewer, "Camera or Observer"), ("views", Raster, "View or Screen")):
            value = getattr(self, name)
            if not _two(value) or not all(isinstance(part, kind) for part in value):
                raise ValueError(f"Argument `{name}` must be two objects of the class {words}.")
        for name in ("azimuths", "times"):
            value = getattr(self, name)
            refuse_tracer(name, value)
            if not _two(value) or not all(math.isfinite(real_number(name, number)) for number in value):
                raise ValueError(f"Argument `{name}` must be two finite numbers, but is {quoted(value)}.")
        shutter_weight("weight", self.weight)

    def exposure(self, middle: "ExposedMoment") -> "Exposure":
        """The exposure about a moment in its middle; ValueError unless the motion fits the camera and its view."""
        camera, view, _, time = middle
        if any(viewer.spin != camera.spin for viewer in self.cameras):
            raise ValueError(f"Argument `motion` must keep the spin of the hole, {camera.spin:g}.")
        if any(type(viewer) is not type(camera) for viewer in self.cameras):
            raise ValueError(f"Argument `motion` must have cameras of the class {type(camera).__name__}.")
        if any(raster.form != view.form for raster in self.views):
            raise ValueError("Argument `motion` must keep width, height and projection of the view.")
        first, last = (
            ExposedMoment(*parts[:3], time + parts[3])
            for parts in zip(self.cameras, self.views, self.azimuths, self.times, strict=True)
        )
        return Exposure(first, middle, last, shutter_weight("weight", self.weight))


class ExposedMoment(NamedTuple):
    """A moment of an exposure.

    camera: the viewer.
    view: its picture.
    azimuth: azimuth of the viewer relative to the middle of the exposure, radians.
    time: coordinate time, M.
    """

    camera: Viewer
    view: Raster
    azimuth: float = 0.0
    time: float = 0.0

    @property
    def view_numbers(self) -> list[float]:
        """All numbers on which the view of the hole depends."""
        return self.view.moving_numbers(self.camera)


class ShutterParts(NamedTuple):
    """Parts of an exposure.

    moment: mean moments, in units of the exposure, from -1/2 to 1/2.
    light: light relative to that of a box of the same length.
    spread: lengths of boxes with the variance of the parts.
    """

    moment: Array
    light: Array
    spread: Array


class ShutterWeight(NamedTuple):
    """The weight w(t) of the moments of an exposure; its integral is 1.

    shape: a name, or the numbers of a user's curve.
    low, high: ends of the part of the shutter's time, from -1/2 to 1/2, to which the weight is restricted.
    """

    shape: str | tuple[float, ...] = "box"
    low: float = -0.5
    high: float = 0.5

    def parts_about(self, middle: ArrayLike, length: float) -> ShutterParts:
        """Parts of the exposure of one length about moments; parts without light are those of a box."""
        middle = np.asarray(middle, float)
        if self.shape == "box":
            return ShutterParts(middle, np.ones(middle.shape), np.full(middle.shape, length))
        whole, centre = self.high - self.low, (self.low + self.high) / 2
        start, stop = (_sums(self.shape, centre + whole * (middle + side * length)) for side in (-0.5, 0.5))
        sums, all_light = stop - start, self._integral
        has_light = sums[0] > 0
        share = np.where(has_light, sums[0], 1.0)
        mean = np.where(has_light, sums[1] / share, centre + whole * middle)
        spread = np.sqrt(np.maximum(12 * (sums[2] / share - mean**2), 0)) / whole
        light = sums[0] / all_light / length if all_light > 0 else np.zeros(middle.shape)
        return ShutterParts((mean - centre) / whole, light, np.where(has_light, spread, length))

    def divided(self, count: int) -> ShutterParts:
        """Parts of the exposure of equal length, in order of time."""
        return self.parts_about((np.arange(count) + 0.5) / count - 0.5, 1 / count)

    def part(self, low: float, high: float) -> "ShutterWeight":
        """The weight in a part of the exposure, between two moments of it."""
        start, whole = (self.low + self.high) / 2, self.high - self.low
        return self._replace(low=start + low * whole, high=start + high * whole)

    @property
    def _integral(self) -> float:
        """The integral of the weight from `low` to `high`."""
        start, stop = _sums(self.shape, np.array([self.low, self.high]))[0]
        return float(stop - start)


BOX = ShutterWeight()
"""The weight of an exposure whose moments count alike."""


def shutter_weight(name: str, value: Any) -> ShutterWeight:
    """The weight that the argument `name` describes; ValueError unless it is valid."""
    if isinstance(value, str):
        one_of(name, value, get_args(ShutterShape))
        return ShutterWeight(value)
    with suppress(ValueError, TypeError):
        curve = real_array(name, value)
        if curve.ndim == 1 and 2 <= len(curve) <= _MOST_NUMBERS and (curve >= 0).all() and 0 < curve.sum() < math.inf:
            return ShutterWeight(tuple(curve.tolist()))
    names = ", ".join(get_args(ShutterShape))
    raise ValueError(
        f"Argument `{name}` must be one of {names}, or 2 to {_MOST_NUMBERS:,} finite numbers, none of them negative "
        f"and not all 0, but is {quoted(value)}."
    )


def _sums(shape: str | tuple[float, ...], t: Array) -> Array:
    """Integrals (3, ...) of w, w t and w t^2 from a fixed moment to t."""
    t = np.clip(t, -0.5, 0.5)
    if isinstance(shape, tuple):
        times, powers = _integrals(shape)
        piece = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        value = np.zeros((3, *t.shape))
        for coefficient in powers[..., piece]:
            value = value * (t - times[piece]) + coefficient
        return value
    if shape == "triangle":
        size = np.abs(t)
        return np.stack([2 * t * (1 - size), t**2 * (1 - 4 / 3 * size), t**3 * (2 / 3 - size)])
    k = 2 * math.pi
    s, c = np.sin(k * t) / k, np.cos(k * t) / k**2
    return np.stack([t + s, t**2 / 2 + t * s + c, t**3 / 3 + t**2 * s + 2 * t * c - 2 * s / k**2])


@lru_cache(maxsize=16)
def _integrals(curve: tuple[float, ...]) -> tuple[Float[Array, " n"], Float[Array, "5 3 n-1"]]:
    """Times (n,) of a curve's numbers, and the integrals of w, w t and w t^2 between them.

    The integrals are polynomials of the time since the last number, the highest power first.
    """
    times = np.linspace(-0.5, 0.5, len(curve))
    weight = np.array(curve) / np.trapezoid(curve, times)
    power = np.zeros((4, 3, len(times) - 1))
    power[2:, 0] = np.diff(weight) / np.diff(times), weight[:-1]
    for k in (1, 2):
        # The product with t = start of the piece + s, for powers of s.
        power[:, k] = power[:, k - 1] * times[:-1]
        power[:-1, k] += power[1:, k - 1]
    integral = np.concatenate([power / np.array([4, 3, 2, 1])[:, None, None], np.zeros((1, 3, len(times) - 1))])
    whole = np.zeros((3, len(times) - 1))
    for coefficient in integral:
        whole = whole * np.diff(times) + coefficient
    integral[-1, :, 1:] = np.cumsum(whole, axis=-1)[:, :-1]
    return times, integral


class Exposure(NamedTuple):
    """An exposure; its own time goes from -1/2 to 1/2.

    first, middle, last: moments at its start, in its middle and at its end.
    weight: weight of the moments.
    """

    first: ExposedMoment
    middle: ExposedMoment
    last: ExposedMoment
    weight: ShutterWeight = BOX

    @property
    def moments(self) -> tuple[ExposedMoment, ExposedMoment, ExposedMoment]:
        """The first moment, the middle one and the last."""
        return self.first, self.middle, self.last

    @property
    def keeps_view(self) -> bool:
        """True if the camera's view of the hole stays the same; its azimuth and time may change."""
        return self.first.view_numbers == self.middle.view_numbers == self.last.view_numbers

    @property
    def turn(self) -> float:
        """Angle by which the sky turns relative to the camera, radians."""
        return self.first.azimuth - self.last.azimuth

    def moment_at(self, moment: float) -> ExposedMoment:
        """The state at a moment, interpolated."""
        for known, place in zip(self.moments, (-0.5, 0.0, 0.5), strict=True):
            if moment == place:
                return known
        azimuth, time = (float(self._interpolated(moment, [known[k] for known in self.moments])) for k in (2, 3))
        middle = self.middle
        if self.keeps_view:
            return ExposedMoment(middle.camera, middle.view, azimuth, time)
        values = self._interpolated(moment, [known.view_numbers for known in self.moments]).tolist()
        return ExposedMoment(*middle.view.with_moving_numbers(middle.camera.spin, values), azimuth, time)

    def pieces(self, count: int) -> "list[Exposure]":
        """Equal parts of the exposure, in order of time."""
        ends = np.linspace(-0.5, 0.5, 2 * count + 1).tolist()
        return [self._piece(*ends[k : k + 3]) for k in range(0, 2 * count, 2)]

    def _piece(self, first: float, middle: float, last: float) -> "Exposure":
        return Exposure(*map(self.moment_at, (first, middle, last)), weight=self.weight.part(first, last))

    def _interpolated(self, moment: float, values: Sequence[Any]) -> Float[Array, "*shape"]:
        """Values at a moment, quadratic in time."""
        first, middle, last = (np.asarray(value, float) for value in values)
        return np.asarray(middle + moment * (last - first) + 2 * moment**2 * (last - 2 * middle + first))


def _two(value: Any) -> bool:
    return isinstance(value, Sequence) and len(value) == 2
