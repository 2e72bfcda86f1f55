"""The field of one source at the viewer, by its images and the groups that they form, with remarks on doubts."""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.choices import WaveMethod
from kerrcaustics.images.images import StarImages, star_images
from kerrcaustics.images.sheets import Sheets
from kerrcaustics.lens_map.arguments import HIGHEST_INDEX
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.waves.image_groups import wave_field
from kerrcaustics.waves.wave_images import WaveImages, wave_images
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class SourceField:
    """The field of a source in units of its modulus without the hole, by frequency."""

    value: Complex[Array, " frequencies"]
    """The field, complex."""
    error: Float[Array, " frequencies"]
    """Its estimated error."""
    method: Array
    """The method for the brightest part, by its name."""
    images: WaveImages
    """The images with their phases."""
    certified: bool
    """True when no image is missing."""
    remarks: tuple[str, ...]
    """Doubts about images and phases."""


def source_field(asked: WaveSource, omega: Float[Array, " frequencies"], highest: int, how: WaveMethod) -> SourceField:
    """The field of a source at angular frequencies, by its images up to an index, with one method or the best."""
    source = asked.beyond_viewer()
    index = min(highest + 1, HIGHEST_INDEX)
    images = star_images(source.viewer, source.place, index, end=source.surface)
    waves = wave_images(source, images)
    field = wave_field(source, waves, highest, np.abs(omega), how)
    return SourceField(
        value=np.where(omega < 0, field.value.conj(), field.value),
        error=field.error,
        method=field.method,
        images=waves,
        certified=images.certified or _all_but_meeting(source.sheets(index), images, field.passed),
        remarks=(*images.remarks, *_remarks(waves, np.abs(omega))),
    )


def _all_but_meeting(sheets: Sheets, images: StarImages, passed: frozenset[int]) -> bool:
    """True if all images were found but those that meet on caustics, and the field needs no count of these."""
    on_caustic = set(images.on_caustic)
    if not on_caustic or not on_caustic <= passed:
        return False
    rings = {order for order in on_caustic if sheets.curves.curves[order - 1].is_point}
    beside = {index for order in rings for index in (order - 1, order)}
    return all(images.per_index[index] == count for index, count in images.expected.items() if index not in beside)


def _remarks(waves: WaveImages, omega: Float[Array, " frequencies"]) -> tuple[str, ...]:
    """A remark if frequencies are so high that the phases of images are not known."""
    time_error = float(waves.time_error.max(initial=0.0))
    if not time_error * float(omega.max()) > 1:
        return ()
    return (
        f"travel times of images are known to {time_error:.1g} M: at frequencies above {1 / time_error:.1g} the phases "
        "of some are not, which the error contains; their moduli are `image_amplitude`",
    )
