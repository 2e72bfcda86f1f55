"""Exposures of a scene's frames: as its file says, or by the light of the frames."""

from collections.abc import Callable
from typing import NamedTuple

import msgspec
import numpy as np
from jaxtyping import Float, UInt8

from kerrcaustics.scene_files.cameras import CameraPath, value_at, varied
from kerrcaustics.scene_files.contents import LightTable, ValueAt, Varied
from kerrcaustics.scene_files.expressions import Formula, Moment
from kerrcaustics.scene_files.validation import about, reject
from kerrcaustics.scenes.tones import AUTO, auto_exposure, clipped_fraction, tone_mapped

Array = np.ndarray
Light = Float[Array, "height width 3"]

_ENTRY = "light.exposure"
# A film has its exposures from so many frames, in small: the whole of it costs little beside its frames.
_KEYFRAMES = 9
# Beyond it single precision ends.
_BRIGHTEST = 1e30


class Development(NamedTuple):
    """A picture of bytes without overlays, its exposure, and the part of its pixels that are cut at white."""

    picture: UInt8[Array, "height width 3"]
    exposure: float
    clipped: float


class ExposureOverTime(NamedTuple):
    """An exposure that a file gives: a formula, or values at times, of which a spline joins the logarithms."""

    value: Varied
    path: CameraPath

    def at(self, moment: Moment) -> float:
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
    with about("light"):
        picture = tone_mapped(light, exposure, table.curve or "linear", table.softening)
        return Development(picture, exposure, clipped_fraction(light, exposure, table.curve or "linear"))


def exposure_of(light: Light, table: LightTable) -> float:
    """The exposure by the light of a picture."""
    with about("light"):
        return auto_exposure(light, table.curve or "linear", table.softening)


def keyframes(frames: int, light: Callable[[int], Light], moment: Callable[[int], float], table: LightTable) -> Varied:
    """The exposure of a film, from the light of some of its frames: values at their times; frames without light aside.

    light: of a frame, in small; moment: its time.
    """
    numbers = sorted({round(float(number)) for number in np.linspace(0, frames - 1, min(frames, _KEYFRAMES))})
    values = []
    for number in numbers:
        picture = light(number)
        if picture.any():
            values.append(ValueAt(time=moment(number), value=exposure_of(picture, table)))
    if len(values) < 2:
        return values[0].value if values else 1.0
    return tuple(values)


def is_auto(table: LightTable) -> bool:
    """True if the exposure is by the light."""
    return table.exposure == AUTO


def _logarithms(value: Varied) -> Varied:
    if not isinstance(value, tuple):
        return value
    for i, key in enumerate(value):
        if not key.value > 0:
            reject(f"{_ENTRY}[{i}].value", "be a positive number", key.value)
    return tuple(msgspec.structs.replace(key, value=float(np.log(key.value))) for key in value)
