"""Exposures of a scene's frames: from its file, or from the light of the frames."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from kerrcaustics.scene_files.builders import brightness_of
from kerrcaustics.scene_files.cameras import CameraPath, value_at, varied
from kerrcaustics.scene_files.contents import LightTable
from kerrcaustics.scene_files.expressions import Formula, Moment
from kerrcaustics.scene_files.matter_tables import DiskTable
from kerrcaustics.scene_files.sky_tables import SkyTable
from kerrcaustics.scene_files.table_values import ValueAt, Varied
from kerrcaustics.scene_files.validation import reject, table_errors
from kerrcaustics.scenes.tones import AUTO, auto_exposure, clipped_fraction, tone_mapped
from kerrcaustics.shapes import Float, UInt8

Array = np.ndarray
Light = Float[Array, "height width 3"]

_ENTRY = "light.exposure"
# Number of small frames from which a film has its exposures: few, so that they cost little beside the film.
_KEYFRAMES = 9
# Transmission of a disk below which a pixel shows the disk alone.
_ALONE = 1e-3
# Part of these pixels that must be dark for a disk to count as nearly black.
_ALMOST_ALL = 0.99
# Value of a byte from which a pixel counts as visible.
_VISIBLE = 24
# Largest exposure: products with light stay within single precision.
_BRIGHTEST = 1e30


class Development(NamedTuple):
    """A picture of a frame without overlays.

    picture: (height, width, 3) sRGB bytes.
    exposure: factor of the light.
    clipped: part of its pixels that are clipped at white.
    """

    picture: UInt8[Array, "height width 3"]
    exposure: float
    clipped: float


class ExposureOverTime(NamedTuple):
    """The exposure that a scene file gives for every time.

    value: a number, an expression, or values at times whose logarithms a spline joins.
    path: the path of the camera, whose names the expression may use.
    """

    value: Varied
    path: CameraPath

    def exposure_at(self, moment: Moment) -> float:
        """The exposure at a time; ValueError unless it is positive and finite."""
        varying = varied(_ENTRY, _logarithms(self.value), self.path)
        value = value_at(varying, moment) if isinstance(varying, Formula) else float(np.exp(value_at(varying, moment)))
        if not value <= _BRIGHTEST:
            reject(_ENTRY, f"be at most {_BRIGHTEST:g}", value)
        if not value > 0:
            reject(_ENTRY, 'be a positive, finite number, or "auto"', value)
        return value


def developed(light: Light, table: LightTable, exposure: float) -> Development:
    """The picture of linear light at an exposure."""
    with table_errors("light"):
        picture = tone_mapped(light, exposure, table.curve or "linear", table.softening)
        return Development(picture, exposure, clipped_fraction(light, exposure, table.curve or "linear"))


def exposure_of(light: Light, table: LightTable) -> float:
    """The exposure from the light of a picture."""
    with table_errors("light"):
        return auto_exposure(light, table.curve or "linear", table.softening)


def keyframes(frames: int, light: Callable[[int], Light], moment: Callable[[int], float], table: LightTable) -> Varied:
    """The exposure of a film from the light of some of its frames: values at times, without dark frames.

    light: function of a frame's number that returns its light at low resolution.
    moment: function of a frame's number that returns its time.
    """
    numbers = sorted({round(float(number)) for number in np.linspace(0, frames - 1, min(frames, _KEYFRAMES))})
    pictures = ((moment(number), light(number)) for number in numbers)
    keys = [(time, exposure_of(picture, table)) for time, picture in pictures if picture.any()]
    if len(keys) < 2:
        return keys[0][1] if keys else 1.0
    times, values = zip(*keys, strict=True)
    # A flash of a star on a caustic must not darken the neighbouring seconds.
    return tuple(ValueAt(time=time, value=value) for time, value in zip(times, without_flashes(values), strict=True))


def without_flashes(values: Sequence[float]) -> list[float]:
    """Running medians of three; at each end of the end value, its neighbour, and an extrapolation of two neighbours.

    References: Tukey 1977, Exploratory Data Analysis, ch. 7.
    """
    if len(values) < 3:
        return list(values)
    inner = [float(np.median(values[i : i + 3])) for i in range(len(values) - 2)]
    if len(inner) < 2:
        inner = inner * 2
    first = float(np.median([values[0], inner[0], inner[0] ** 3 / inner[1] ** 2]))
    last = float(np.median([values[-1], inner[-1], inner[-1] ** 3 / inner[-2] ** 2]))
    return [first, *inner[: len(values) - 2], last]


def dark_disk(disk: DiskTable | None, sky: SkyTable, transmission: Array | None, picture: Array) -> tuple[str, ...]:
    """A line on an opaque disk with a given brightness that is nearly black in a picture without overlays.

    transmission: part (height, width) of the light behind that the disk lets through.
    """
    disk_only = np.zeros(picture.shape[:2], bool) if transmission is None else transmission < _ALONE
    if disk is None or disk.brightness is None or not disk_only.any():
        return ()
    usual = brightness_of(msgspec.structs.replace(disk, brightness=None), sky)
    if disk.brightness >= usual or np.quantile(picture[disk_only].max(axis=-1), _ALMOST_ALL) >= _VISIBLE:
        return ()
    hint = f"without that key it has {usual:g} (--set disk.brightness={usual:g})"
    return (f"The disk, with disk.brightness = {disk.brightness:g}, is nearly black beside its sky; {hint}",)


def is_auto(table: LightTable) -> bool:
    """True if the exposure comes from the light."""
    return table.exposure == AUTO


def _logarithms(value: Varied) -> Varied:
    if not isinstance(value, tuple):
        return value
    for i, key in enumerate(value):
        if not key.value > 0:
            reject(f"{_ENTRY}[{i}].value", "be a positive number", key.value)
    return tuple(msgspec.structs.replace(key, value=float(np.log(key.value))) for key in value)
