"""Motion while a picture is exposed: of the camera, of its view, and of time; and the weight of each moment."""

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

# Numbers of a curve of one's own.
_MOST_NUMBERS = 1000


@dataclass(frozen=True, eq=False)
class ShutterMotion:
    """Motion while a picture is exposed: its first and its last moment. The middle one is an argument of `render`.

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
        How much each moment counts: "box", all alike; "triangle", growing from 0 to the middle and falling again;
        "cosine", 1 + cos(2 pi t), a smooth bell; or a curve of one's own, 2 to 1,000 numbers at equal steps from the
        first moment to the last, joined by straight lines. All let through the same amount of light.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    In between, places, velocities and axes are quadratic in time through the three moments; for observers, the inverse
    of the radius is. An observer stays at rest: what changes is which one it is.

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
            if not _two(value) or not all(isinstance(one, kind) for one in value):
                raise ValueError(f"Argument `{name}` must be two objects of the class {words}.")
        for name in ("azimuths", "times"):
            value = getattr(self, name)
            refuse_tracer(name, value)
            if not _two(value) or not all(math.isfinite(real_number(name, number)) for number in value):
                raise ValueError(f"Argument `{name}` must be two finite numbers, but is {quoted(value)}.")
        shutter_weight("weight", self.weight)

    def exposure(self, camera: Viewer, view: Raster, time: float) -> "Exposure":
        """The exposure with this moment in its middle."""
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
        return Exposure(first, ExposedMoment(camera, view, 0.0, time), last, shutter_weight("weight", self.weight))


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


class ShutterParts(NamedTuple):
    """Parts of an exposure: their mean moments, their light relative to that of a box, and boxes of the same width.

    A part of weight w has the variance of a box of the length `spread`.
    """

    moment: Array
    light: Array
    spread: Array


class ShutterWeight(NamedTuple):
    """The weight w(t) of moments, whose integral is 1, and the part of a shutter's time, -1/2 to 1/2, that is meant.

    shape: a name, or the numbers of a curve of one's own.
    """

    shape: str | tuple[float, ...] = "box"
    low: float = -0.5
    high: float = 0.5

    def over(self, middle: ArrayLike, length: float) -> ShutterParts:
        """Parts of the exposure, each of this length, about moments; no light: as those of a box."""
        middle = np.asarray(middle, float)
        if self.shape == "box":
            return ShutterParts(middle, np.ones(middle.shape), np.full(middle.shape, length))
        whole, centre = self.high - self.low, (self.low + self.high) / 2
        start, stop = (_sums(self.shape, centre + whole * (middle + side * length)) for side in (-0.5, 0.5))
        sums, all_light = stop - start, self._integral
        lit = sums[0] > 0
        share = np.where(lit, sums[0], 1.0)
        mean = np.where(lit, sums[1] / share, centre + whole * middle)
        spread = np.sqrt(np.maximum(12 * (sums[2] / share - mean**2), 0)) / whole
        light = sums[0] / all_light / length if all_light > 0 else np.zeros(middle.shape)
        return ShutterParts((mean - centre) / whole, light, np.where(lit, spread, length))

    def divided(self, count: int) -> ShutterParts:
        """Parts of equal length, in order of time."""
        return self.over((np.arange(count) + 0.5) / count - 0.5, 1 / count)

    def part(self, low: float, high: float) -> "ShutterWeight":
        """The weight of a part of the exposure, between two moments of it."""
        start, whole = (self.low + self.high) / 2, self.high - self.low
        return self._replace(low=start + low * whole, high=start + high * whole)

    @property
    def _integral(self) -> float:
        """The integral of the weight over the part that is meant."""
        start, stop = _sums(self.shape, np.array([self.low, self.high]))[0]
        return float(stop - start)


BOX = ShutterWeight()
"""All moments count alike."""


def shutter_weight(name: str, value: Any) -> ShutterWeight:
    """The weight that an argument of that name describes; ValueError if it is none."""
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
    """Integrals (3, ...) from one moment to t of w, of w t and of w t^2."""
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
    """Times of numbers that straight lines join, and integrals of w, of w t and of w t^2 between them.

    As polynomials of the time since the last one, the highest power first.
    """
    times = np.linspace(-0.5, 0.5, len(curve))
    weight = np.array(curve) / np.trapezoid(curve, times)
    power = np.zeros((4, 3, len(times) - 1))
    power[2:, 0] = np.diff(weight) / np.diff(times), weight[:-1]
    for k in (1, 2):
        # The product with t, which is s beyond the beginning of a piece.
        power[:, k] = power[:, k - 1] * times[:-1]
        power[:-1, k] += power[1:, k - 1]
    integral = np.concatenate([power / np.array([4, 3, 2, 1])[:, None, None], np.zeros((1, 3, len(times) - 1))])
    whole = np.zeros((3, len(times) - 1))
    for coefficient in integral:
        whole = whole * np.diff(times) + coefficient
    integral[-1, :, 1:] = np.cumsum(whole, axis=-1)[:, :-1]
    return times, integral


class Exposure(NamedTuple):
    """Moments of an exposure, whose time goes from -1/2 to 1/2, and how much each counts."""

    first: ExposedMoment
    middle: ExposedMoment
    last: ExposedMoment
    weight: ShutterWeight = BOX

    @property
    def moments(self) -> tuple[ExposedMoment, ExposedMoment, ExposedMoment]:
        """The first moment, that in the middle, and the last."""
        return self.first, self.middle, self.last

    @classmethod
    def of(cls, motion: ShutterMotion | None, camera: Viewer, view: Raster, time: float, quality: str) -> "Exposure":
        """The exposure of a picture: of one moment without motion, and in a draft, whatever moves."""
        moment = ExposedMoment(camera, view, 0.0, time)
        exposure = cls(moment, moment, moment) if motion is None else motion.exposure(camera, view, time)
        return cls(moment, moment, moment) if quality == "draft" else exposure

    def one_map(self, matter: Sequence[Any]) -> bool:
        """True if a single map of the view serves a sky that turns, and matter that is None or does not move."""
        return self.first is self.last or (self.still and all(one is None for one in matter))

    @property
    def still(self) -> bool:
        """True if the camera sees the hole alike all the time: it may go round, and time may pass."""
        return self.first.sight == self.middle.sight == self.last.sight

    @property
    def turn(self) -> float:
        """Angle by which the sky turns before the camera."""
        return self.first.azimuth - self.last.azimuth

    def moment_at(self, moment: float) -> ExposedMoment:
        """The camera and the rest at a moment."""
        for end, place in zip(self.moments, (-0.5, 0.0, 0.5), strict=True):
            if moment == place:
                return end
        azimuth, time = (float(self._interpolated(moment, [one[k] for one in self.moments])) for k in (2, 3))
        middle = self.middle
        if self.still:
            return ExposedMoment(middle.camera, middle.view, azimuth, time)
        values = self._interpolated(moment, [one.sight for one in self.moments]).tolist()
        return ExposedMoment(*middle.view.with_moving_numbers(middle.camera.spin, values), azimuth, time)

    def pieces(self, count: int) -> "list[Exposure]":
        """Divide it into so many parts, in order of time."""
        ends = np.linspace(-0.5, 0.5, 2 * count + 1).tolist()
        return [self._piece(*ends[k : k + 3]) for k in range(0, 2 * count, 2)]

    def _piece(self, first: float, middle: float, last: float) -> "Exposure":
        return Exposure(*map(self.moment_at, (first, middle, last)), weight=self.weight.part(first, last))

    def _interpolated(self, moment: float, values: Sequence[Any]) -> Float[Array, "*shape"]:
        """Return values at a moment, quadratic in time."""
        first, middle, last = (np.asarray(value, float) for value in values)
        return np.asarray(middle + moment * (last - first) + 2 * moment**2 * (last - 2 * middle + first))


def _two(value: Any) -> bool:
    return isinstance(value, Sequence) and len(value) == 2
