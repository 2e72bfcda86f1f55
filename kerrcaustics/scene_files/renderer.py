"""The one place where scenes are handed to the renderer, with their quality and exposure."""

import math
from typing import Any, NamedTuple

from kerrcaustics.results.declared import same
from kerrcaustics.scene_files.contents import LightTable
from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.render import Rendering, Sky, TracedView, trace_view
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera

# The last map, and what it is of.
_LAST: list[tuple[tuple[Any, ...], TracedView]] = []


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
    traced = _traced(camera, view, sky is not None, disk, light.delay, quality)
    return traced.show(sky, disk=disk, delay=light.delay, time=exposed.time, **shifts)


def _traced(camera: Camera, view: View, sky: bool, disk: Disk | None, delay: bool, quality: str) -> TracedView:
    """The map of a view; that of the frame before where it is the same, as to a camera on a circular orbit."""
    rims = disk and (disk.inner, disk.outer, disk.opaque)
    of = camera, view, sky, rims, delay, quality
    if not (_LAST and same(_LAST[0][0], of)):
        # Two at once would be too much memory.
        _LAST.clear()
        _LAST.append((of, trace_view(camera, view, sky=sky, disk=disk, delay=delay, quality=quality)))
    return _LAST[0][1]
