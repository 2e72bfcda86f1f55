"""Images as waves: amplitudes, times and Morse indices, and who lies beside whom round the hole."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.images.images import StarImages
from kerrcaustics.lens_map.search_sky import TOLERANCE, search_sky
from kerrcaustics.spacetime.frame import line_of_sight_from_sky
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.waves.wave_sources import WaveSource

Array = np.ndarray


@dataclass(frozen=True)
class WaveImages(Rows):
    """Images of one star, one entry each.

    index: Morse index; amplitude: g times the root of the magnification, at finite radii over that in empty space;
    time: of travel; around: position angle about the hole, radians.
    """

    index: Int[Array, " images"]
    amplitude: Float[Array, " images"]
    time: Float[Array, " images"]
    around: Float[Array, " images"]

    def field(self, omega: Float[Array, " frequencies"]) -> Float[Array, " frequencies"]:
        """The sum of the waves."""
        turned = self.amplitude * np.exp(-0.5j * math.pi * self.index)
        return np.exp(1j * omega[:, None] * self.time) @ turned

    def ring(self, order: int) -> "WaveImages":
        """Images on both sides of a critical curve, in the order of their position angles."""
        here = self[(self.index == order - 1) | (self.index == order)]
        return here[np.argsort(here.around, kind="stable")]


def wave_images(source: WaveSource, images: StarImages) -> WaveImages:
    """The waves of the images of a source."""
    viewer, sky = images.camera, search_sky(images.camera)
    camera, end = sky.search_camera, source.surface
    places = sky.searched(images.sky)
    beams = beams_of_directions(
        camera, places, "auto", TOLERANCE, end=end, time=True, index=False, crossings=False, constants=True
    )
    assert beams.time is not None
    time = sky.viewer_time(beams.time, np.zeros(len(places)))[0]
    own = viewer.directions(images.sky)
    amplitude = source.amplitudes(viewer, own, beams, images.magnification)
    line = line_of_sight_from_sky(camera.frame(), places)
    return WaveImages(images.index, amplitude, time, np.arctan2(line[:, 2], line[:, 1]))
