"""The one place where scenes are handed to the renderer, with what moves while a frame is exposed."""

from typing import Any

from kerrcaustics.results.declared import same
from kerrcaustics.scene_files.contents import LightTable
from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.motion import ShutterMotion
from kerrcaustics.scenes.motion_blur import Matter
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.render import Rendering, Sky, TracedView, blurred, render, trace_view
from kerrcaustics.spacetime.viewer import Viewer

# The last map, and all that it depends on.
_LAST: list[tuple[tuple[Any, ...], TracedView]] = []


def rendered(
    camera: Viewer,
    view: Raster,
    sky: Sky | None,
    matter: Matter,
    light: LightTable,
    time: float,
    motion: ShutterMotion | None,
    quality: str,
    sky_radius: float,
) -> Rendering:
    """A frame, linear light; time: in its middle."""
    options = {"beaming": light.beaming, "colour_shift": light.colour_shift, "delay": light.delay, "time": time}
    exposure = None if motion is None or not blurred(quality) else motion.about(camera, view, time)
    disk, volume = matter
    if exposure is not None and not (disk is None and volume is None and exposure.still):
        options |= {"quality": quality, "sky_radius": sky_radius}
        return render(camera, view, sky, disk=disk, volume=volume, motion=motion, **options)
    traced = _traced(camera, view, sky is not None, disk, light.delay, quality, sky_radius)
    if exposure is not None:
        options |= {"turn": exposure.turn, "turn_weight": exposure.weight.shape}
    return traced.show(sky, disk=disk, volume=volume, **options)


def _traced(
    camera: Viewer, view: Raster, sky: bool, disk: Disk | None, delay: bool, quality: str, sky_radius: float
) -> TracedView:
    """The map of a view; that of the frame before where it is the same, as to a camera on a circular orbit."""
    rims = disk and (disk.inner, disk.outer, disk.opaque)
    key = camera, view, sky, rims, delay, quality, sky_radius
    # Looked at once: another thread may put its own there.
    last = next(iter(_LAST), None)
    if last is None or not same(last[0], key):
        # Two at once would be too much memory.
        last = None
        _LAST.clear()
        options = {"disk": disk, "delay": delay, "quality": quality, "sky_radius": sky_radius}
        last = key, trace_view(camera, view, sky=sky, **options)
        _LAST[:] = [last]
    return last[1]
