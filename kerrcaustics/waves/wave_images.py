"""Images as waves: amplitudes, times and Morse indices with their errors, and their order round the hole."""

import math
from dataclasses import dataclass

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.images.images import StarImages
from kerrcaustics.lens_map.lens_map import SearchMap
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.shapes import Complex, Float, Int
from kerrcaustics.spacetime.frame import line_of_sight_from_sky
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray

# Largest error of a wave in units of its amplitude, for an unknown phase.
_OPPOSITE = 2.0
# Rounding of n', radians, and of times relative to the viewer's radius and to themselves.
_OF_END, _OF_TIME = 4e-15, 2e-15


@dataclass(frozen=True)
class WaveImages(Rows):
    """Images of one star, one entry each.

    index: Morse index.
    amplitude: g times the root of the magnification, at finite radii over that in empty space.
    time: travel time.
    around: position angle about the hole, radians.
    amplitude_error: error of the amplitude.
    time_error: error of the time.
    """

    index: Int[Array, " images"]
    amplitude: Float[Array, " images"]
    time: Float[Array, " images"]
    around: Float[Array, " images"]
    amplitude_error: Float[Array, " images"]
    time_error: Float[Array, " images"]

    def field(self, omega: Float[Array, " frequencies"]) -> Complex[Array, " frequencies"]:
        """The sum of the waves."""
        turned = self.amplitude * np.exp(-0.5j * math.pi * self.index)
        return np.exp(1j * omega[:, None] * self.time) @ turned

    def error(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The error of that sum by those of amplitudes and times."""
        off = np.minimum(omega[:, None] * self.time_error, _OPPOSITE)
        return off @ self.amplitude + self.amplitude_error.sum()

    def ring(self, order: int) -> "WaveImages":
        """Images on both sides of a critical curve, in the order of their position angles."""
        here = self[(self.index == order - 1) | (self.index == order)]
        return here[np.argsort(here.around, kind="stable")]


def wave_images(source: WaveSource, images: StarImages) -> WaveImages:
    """The waves of the images of a source."""
    viewer, sky = images.camera, search_sky(images.camera)
    camera = sky.search_camera
    places = sky.to_search(images.sky)
    beams = SearchMap(camera, source.surface).beams_of_sky(places, index=False, constants=True)
    amplitude = source.amplitudes(viewer, viewer.directions(images.sky), beams, images.magnification)
    line = line_of_sight_from_sky(camera.frame(), places)
    time_error = images.time_error
    with np.errstate(invalid="ignore"):
        off = images.redshift_error / images.redshift + images.magnification_error / images.magnification / 2
    return WaveImages(
        images.index,
        amplitude,
        images.time,
        np.arctan2(line[:, 2], line[:, 1]),
        np.where(np.isnan(off), math.inf, amplitude * off),
        np.where(images.index == 0, np.minimum(time_error, _direct_time_error(images, beams)), time_error),
    )


def _direct_time_error(images: StarImages, beams: Beams) -> Float[Array, " images"]:
    """Errors of the times of images whose rays are little bent.

    The rounding of a direction moves the end of its ray and changes its time, dT = -B . dn', B the impact vector: the
    time from the star itself is wrong by no more than what n' misses it by.
    """
    assert beams.impact is not None
    assert beams.carter is not None
    height = images.camera.spin * beams.direction[:, 2]
    lever = np.sqrt(np.maximum(beams.impact**2 + beams.carter + height**2, 0))
    far = images.camera.radius if math.isfinite(images.camera.radius) else 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        missed = images.error / np.sqrt(images.magnification)
    return lever * (missed + _OF_END) + _OF_TIME * (far + np.abs(images.time))
