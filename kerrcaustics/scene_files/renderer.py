"""Rendering of frames: the only place that hands scenes to the renderer, with the motion during their exposure."""

from typing import Any, NamedTuple

from kerrcaustics.results.declared import same
from kerrcaustics.scene_files.contents import LightTable
from kerrcaustics.scenes.blur import BlurKind, blur_of
from kerrcaustics.scenes.disk.veil import Matter
from kerrcaustics.scenes.motion import ExposedMoment, ShutterMotion
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.render import render
from kerrcaustics.scenes.rendering import Rendering
from kerrcaustics.scenes.sky import Sky
from kerrcaustics.scenes.traced_view import TracedView, trace_view
from kerrcaustics.spacetime.viewer import Viewer

# The last map, and everything that it depends on.
LAST: list[tuple[tuple[Any, ...], TracedView]] = []


class FrameContents(NamedTuple):
    """Contents of a frame.

    sky: the sky; None for a black one.
    sky_radius: radius of its sphere, M.
    matter: a disk and a volume.
    light: table of the physics of light.
    time: coordinate time, M.
    """

    sky: Sky | None
    sky_radius: float
    matter: Matter
    light: LightTable
    time: float


def rendered(
    camera: Viewer, view: Raster, contents: FrameContents, motion: ShutterMotion | None, quality: str
) -> Rendering:
    """A frame in linear light; motion: that about the time in its middle."""
    matter = contents.matter
    delay = contents.light.delay and matter.exists
    light = {"beaming": contents.light.beaming, "colour_shift": contents.light.colour_shift, "delay": delay}
    options = {**matter._asdict(), "time": contents.time, **light}
    middle = ExposedMoment(camera, view, time=contents.time)
    blur = blur_of(motion, middle, quality, contents.sky, matter.exists)
    if blur.kind is not BlurKind.SKY:
        options |= {"quality": quality, "sky_radius": contents.sky_radius}
        return render(camera, view, contents.sky, motion=motion, **options)
    options |= {"turn": blur.turn, "turn_weight": blur.exposure.weight.shape}
    return _traced_view(camera, view, contents, quality).show(contents.sky, **options)


def _traced_view(camera: Viewer, view: Raster, contents: FrameContents, quality: str) -> TracedView:
    """The map of a view: the map of the last frame if it is the same, as for a camera on a circular orbit."""
    disk = contents.matter.disk
    rims = disk and (disk.inner, disk.outer, disk.opaque)
    delay = contents.light.delay and disk is not None
    options = {"delay": delay, "quality": quality, "sky_radius": contents.sky_radius}
    key = camera, view, contents.sky is not None, rims, options
    # `LAST` is read once, as another thread may replace its item.
    last = next(iter(LAST), None)
    if last is None or not same(last[0], key):
        # The old map is freed first: two maps would need too much memory.
        last = None
        LAST.clear()
        last = key, trace_view(camera, view, sky=contents.sky is not None, disk=disk, **options)
        LAST[:] = [last]
    return last[1]
