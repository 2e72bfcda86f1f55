"""Patterns of a disk and of a volume turned about the spin axis, for a camera at another azimuth."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.disk.orbiting_spots import OrbitingSpots
from kerrcaustics.scenes.disk.samples import DiskSamples, Emission
from kerrcaustics.scenes.disk.texture import AlphaOpacity
from kerrcaustics.scenes.disk.volume import VolumeLaw
from kerrcaustics.shapes import Float, Int

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class TurnedEmission(Emission):
    """The emission of a disk turned by an angle (radians, toward larger phi)."""

    emission: Emission
    angle: float
    keeps_shape: bool = field(init=False)
    symmetric: bool = field(init=False)

    def __post_init__(self) -> None:
        """Copy the properties of the emission."""
        object.__setattr__(self, "keeps_shape", self.emission.keeps_shape)
        object.__setattr__(self, "symmetric", self.emission.symmetric)

    def light(self, samples: DiskSamples, beaming: bool, colour_shift: bool) -> Float[Array, "n 3"]:
        """Linear sRGB light (n, 3)."""
        return self.emission.light(samples._replace(azimuth=samples.azimuth - self.angle), beaming, colour_shift)

    def parts(self, low: Array, high: Array, size: Array) -> Int[Array, " n"]:
        """The number that the pattern itself needs."""
        back = np.array([0.0, self.angle])
        return self.emission.parts(low - back, high - back, size)


def turned_disk(disk: Disk, angle: float) -> Disk:
    """A disk with its pattern, opacity included, turned by an angle (radians, toward larger phi)."""
    # Whole turns change nothing; small angles keep their digits.
    angle = math.remainder(angle, 2 * math.pi)
    if angle == 0:
        return disk
    opacity: Any = disk.opacity
    if isinstance(opacity, AlphaOpacity):
        opacity = opacity.turned_by(angle)
    elif callable(opacity):
        opacity = lambda radius, azimuth: disk.opacity(radius, azimuth - angle)  # noqa: E731
    return replace(disk, emission=TurnedEmission(disk.emission, angle), opacity=opacity)


def turned_volume(volume: Any, angle: float) -> Any:
    """A volume, or spots in its place, turned by an angle (radians, toward larger phi); symmetric matter unchanged."""
    angle = math.remainder(angle, 2 * math.pi)
    if angle == 0 or volume.symmetric:
        return volume
    if isinstance(volume, OrbitingSpots):
        return volume.turned_by(angle)
    laws = {name: _turned_law(getattr(volume, name), angle) for name in ("density", "temperature", "colour")}
    return replace(volume, **laws)


def _turned_law(law: Any, angle: float) -> Any:
    """A number, a grid, or a function of radius, theta and azimuth, turned."""
    if isinstance(law, VolumeLaw):
        return law.turned_by(angle)
    if not callable(law):
        return law
    return lambda radius, theta, azimuth: law(radius, theta, azimuth - angle)
