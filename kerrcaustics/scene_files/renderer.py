"""The one place where scenes are handed to the renderer, with their quality and exposure."""

import math
from typing import NamedTuple

from kerrcaustics.scene_files.contents import LightTable
from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.render import Rendering, Sky, render
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera


class Exposed(NamedTuple):
    """When a frame is exposed: the time in its middle, how long, and the turn of the camera meanwhile (radians)."""

    time: float
    length: float
    turn: float


def star_sweep(exposed: Exposed) -> float:
    """By how much stars are swept in the sky itself: the renderer does not blur what moves."""
    return float(f"{min(abs(exposed.turn), math.pi):.9g}")


def rendered(
    camera: Camera, view: View, sky: Sky | None, disk: Disk | None, light: LightTable, exposed: Exposed, quality: str
) -> Rendering:
    """A frame, linear light."""
    shifts = {"beaming": light.beaming, "colour_shift": light.colour_shift}
    return render(camera, view, sky, disk=disk, delay=light.delay, time=exposed.time, quality=quality, **shifts)
