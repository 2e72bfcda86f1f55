"""Rendering: the beams of all pixels of a view, and the light of a sky and of a disk in them."""

import math
from time import perf_counter as clock
from typing import Any

from kerrcaustics.beams.ends import Spherical
from kerrcaustics.results.declared import usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.stages import with_stages
from kerrcaustics.scenes.blur import Blur, BlurKind, blur_of
from kerrcaustics.scenes.disk.disk import Disk, check_disk, disk_about, outer_rim
from kerrcaustics.scenes.disk.veil import Glowing, Matter, check_volume
from kerrcaustics.scenes.motion import ExposedMoment, ShutterMotion
from kerrcaustics.scenes.motion_blur import blurred_matter, blurred_sky, without_matter
from kerrcaustics.scenes.raster import Raster, check_picture
from kerrcaustics.scenes.rendering import Rendering
from kerrcaustics.scenes.scene_checks import check_uses, checked_moment, map_error
from kerrcaustics.scenes.seen_sky import sky_end
from kerrcaustics.scenes.sky import Shifts, Sky, check_sky
from kerrcaustics.scenes.traced_view import trace_view
from kerrcaustics.spacetime.checks import flags, instance_of
from kerrcaustics.spacetime.viewer import Viewer


@usual_warnings
@with_progress
def render(
    camera: Viewer,
    view: Raster,
    sky: Sky | None = None,
    *,
    disk: Disk | None = None,
    volume: Glowing | None = None,
    beaming: bool = False,
    colour_shift: bool = False,
    delay: bool = False,
    time: float = 0.0,
    quality: str = "normal",
    sky_radius: float = math.inf,
    motion: ShutterMotion | None = None,
    progress: Progress | bool | None = None,
) -> Rendering:
    """A sky seen through the hole, with a disk and matter in space round the hole.

    Each pixel holds the mean of the sky over the footprint of its beam, and of the disk over its own square.

    Parameters
    ----------
    camera : Camera or Observer
    view : View or Screen
        A `View` for a camera, a `Screen` for an observer.
    sky : Sky, optional
        If omitted, the sky is black, and no beam is traced to it.
    disk : Disk, optional
    volume : Volume or OrbitingSpots, optional
        In front of the disk, between its images and behind it, along the ray of each pixel; see `render_volume`.
    beaming : bool
        Multiply the intensity by the fourth power of nu_camera / nu_source.
    colour_shift : bool
        Shift spectra by nu_camera / nu_source: a black body has the colour of a black body hotter by this factor.
    delay : bool
        Show the pattern of the disk and orbiting spots at the times at which the light left them; else at `time`. It
        needs a disk or a volume.
    time : float
        Time of the camera, for that pattern; coordinate time, in units of the mass. For an observer it excludes the
        travel time from the hole, as for `Observer`.
    quality : str
        Largest error of the map of the sky: "draft" (0.1 pixels), "normal" (0.02), "high" (0.005); for a disk see
        Errors.
    sky_radius : float
        Boyer-Lindquist radius of the sphere with `sky`, beyond the camera, the disk and all photon orbits. Its
        sources are at rest; the flux of a star is its flux at the centre of the sphere in flat space.
    motion : ShutterMotion, optional
        Motion during the exposure; without it, and in drafts, the picture shows the moment in the middle.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    Rendering
        `tone_mapped` turns its light into a picture.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    Beams are good to 1e-7 rad. They are traced where the map of the sky is not smooth, and interpolated elsewhere. The
    interpolation is off by at most `error` pixels of the result, twice the deviation found by check rays. A pixel on a
    critical curve counts by the strip of the sky that it is folded over. A footprint is the linear image of its pixel,
    filtered with a deviation of half a pixel. Pixels at the shadow edge, and those that see more than 0.5 rad, are
    supersampled by 16 beams, and those that see more than 0.2 rad by 4. Stars are drawn where their images lie; in
    supersampled pixels, by the footprints of the parts. Disk: the mean over the pixel, to about 1 % or 1/255 of the
    brightest; beams are interpolated to a hundredth of a pixel, and images that contribute less than 1/255 to every
    pixel are left out; in a draft beams are interpolated to a tenth of a pixel, and images that cover no more than 1/30
    of any pixel are left out. If a disk that is not opaque lies over an edge of the sky, the mean of the product is
    taken as the product of the means; the same holds for a volume and edges of the disk. A volume: as for
    `render_volume` with the step 0.5; in a draft with the step 1.5, and edges are not refined.

    References
    ----------
    JTFT sections 2 and 4 and appendix A: beams in place of rays, so that nothing flickers or aliases.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> view = kc.pictures.View.toward_hole(camera, width=64, height=36, field_of_view=1.0)
    >>> rendering = kc.render(camera, view, kc.skies.Checkerboard())
    >>> rendering.light.shape, rendering.error < 0.1
    ((36, 64, 3), True)
    >>> observer, screen = kc.Observer(spin=0.9, inclination=1.2), kc.Screen(64, 36, size=24)
    >>> kc.render(observer, screen, kc.skies.Checkerboard()).view.pixel
    0.375
    """
    disk = disk_about(disk, camera)
    matter = Matter(disk, volume)
    check_picture(camera, view)
    check_sky(sky)
    flags(beaming=beaming, colour_shift=colour_shift, delay=delay)
    check_uses(matter.exists, delay, sky is not None, sky_radius)
    if motion is not None:
        instance_of("motion", motion, ShutterMotion)
    blur = blur_of(motion, ExposedMoment(camera, view, time=checked_moment(time)), quality, sky, matter.exists)
    if blur.kind is not BlurKind.SKY:
        ends = [sky_end(moment.camera, sky_radius, outer_rim(disk)) for moment in blur.exposure.moments]
        return _blurred(blur, sky, matter, Shifts(beaming, colour_shift), delay, map_error(quality), ends[1])
    check_volume(volume, camera)
    options = {"disk": disk, "delay": delay and disk is not None, "quality": quality, "sky_radius": sky_radius}
    traced = trace_view(camera, view, sky=sky is not None, **options)
    switches: dict[str, Any] = {"beaming": beaming, "colour_shift": colour_shift, "delay": delay}
    turn: dict[str, Any] = {"turn": blur.turn, "turn_weight": blur.exposure.weight.shape}
    return traced.show(sky, disk=disk, volume=volume, time=time, draft=quality == "draft", **switches, **turn)


@with_stages
def _blurred(
    blur: Blur, sky: Sky | None, matter: Matter, shifts: Shifts, delay: bool, close: float, end: Spherical
) -> Rendering:
    """The picture of an exposure that needs more than one map, or several moments of its matter."""
    began = clock()
    camera, view, _, _ = blur.exposure.middle
    if matter.disk is not None:
        check_disk(matter.disk, camera.spin)
    check_volume(matter.volume, camera)
    glow = blurred_matter(blur, matter, shifts, delay) if matter.exists else without_matter(view.shape)
    light, visible = glow.light, None
    if sky is not None:
        sky_part, visible = blurred_sky(blur, sky, shifts, close, glow.hidden, end)
        light = light + (sky_part if glow.transmission is None else sky_part * glow.transmission[..., None])
    return Rendering(
        camera=camera,
        view=view,
        light=light,
        visible_fraction=visible and visible.visible_fraction,
        supersampled=visible.supersampled if visible else 0,
        beams=sum(glow.beams) + (visible.beams if visible else 0),
        seconds=clock() - began,
        crossings=glow.beams,
        transmission=glow.transmission,
        error=visible.error if visible else math.nan,
        sky_radius=end.radius if visible else math.inf,
    )
