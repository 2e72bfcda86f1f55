"""The one place where scenes are handed to the renderer, with what moves while a frame is exposed."""

from typing import Any, NamedTuple

from kerrcaustics.results.declared import same
from kerrcaustics.scene_files.contents import LightTable
from kerrcaustics.scenes.motion import Exposure, ShutterMotion
from kerrcaustics.scenes.motion_blur import Matter
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.render import Rendering, TracedView, render, trace_view
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.spacetime.viewer import Viewer

# The last map, and all that it depends on.
LAST: list[tuple[tuple[Any, ...], TracedView]] = []


class FrameContents(NamedTuple):
    """Contents of a frame.

    sky: the sky; None for a black one.
    sky_radius: radius of its sphere, M.
    matter: a disk and a volume, each or None.
    light: table of the physics of light.
    time: coordinate time, M.
    """

    sky: Sky | None
    sky_radius: float
    matter: Matter
    light: LightTable
    time: float


def rendered(
    camera: Viewer, view: Raster, shown: FrameContents, motion: ShutterMotion | None, quality: str
) -> Rendering:
    """A frame, linear light; motion: about the time in its middle."""
    disk, volume = shown.matter
    delay = shown.light.delay and shown.matter != (None, None)
    light = {"beaming": shown.light.beaming, "colour_shift": shown.light.colour_shift, "delay": delay}
    options = {"disk": disk, "volume": volume, "time": shown.time, **light}
    exposure = Exposure.of(motion, camera, view, shown.time, quality)
    if not exposure.one_map(shown.matter):
        options |= {"quality": quality, "sky_radius": shown.sky_radius}
        return render(camera, view, shown.sky, motion=motion, **options)
    options |= {"turn": exposure.turn, "turn_weight": exposure.weight.shape}
    return _traced_view(camera, view, shown, quality).show(shown.sky, **options)


def _traced_view(camera: Viewer, view: Raster, shown: FrameContents, quality: str) -> TracedView:
    """The map of a view; that of the frame before where it is the same, as to a camera on a circular orbit."""
    disk = shown.matter[0]
    rims = disk and (disk.inner, disk.outer, disk.opaque)
    delay = shown.light.delay and disk is not None
    options = {"delay": delay, "quality": quality, "sky_radius": shown.sky_radius}
    key = camera, view, shown.sky is not None, rims, options
    # Looked at once: another thread may put its own there.
    last = next(iter(LAST), None)
    if last is None or not same(last[0], key):
        # Two at once would be too much memory.
        last = None
        LAST.clear()
        last = key, trace_view(camera, view, sky=shown.sky is not None, disk=disk, **options)
        LAST[:] = [last]
    return last[1]
