"""Rendering: the beams of all pixels of a view, and the light of a sky and of a disk in them."""

import math
from collections.abc import Sequence
from functools import cached_property
from time import perf_counter as clock
from typing import Any

import numpy as np

from kerrcaustics.beams.ends import Spherical
from kerrcaustics.choices import ShutterShape
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, with_progress
from kerrcaustics.results.shown import Shown
from kerrcaustics.results.stages import stage, with_stages
from kerrcaustics.scenes.disk.crossings import DiskCells, DiskCrossings, Lattice, covered, crossings
from kerrcaustics.scenes.disk.disk import Disk, disk_about
from kerrcaustics.scenes.disk.lighting import Looks, disk_light
from kerrcaustics.scenes.disk.veil import Glowing, check_volume, veil_over
from kerrcaustics.scenes.motion import Exposure, ShutterMotion, ShutterWeight, shutter_weight
from kerrcaustics.scenes.motion_blur import Matter, blurred_matter, blurred_sky
from kerrcaustics.scenes.raster import Raster, check_picture
from kerrcaustics.scenes.scene_checks import check_uses, checked_moment, map_error
from kerrcaustics.scenes.seen_sky import seen_sky, sky_end
from kerrcaustics.scenes.sky import Shifts, Sky, check_sky
from kerrcaustics.scenes.sky_cells import SkyCells
from kerrcaustics.scenes.sky_light import Parts, sky_light
from kerrcaustics.scenes.star_search import StarSearch
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.checks import flags, instance_of
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

_VISIBLE = "part of each pixel that is not in the shadow; None without a sky"
_ERROR = "largest error of the map of the sky, in pixels; NaN without a sky"
_SKY_RADIUS = "radius of the sphere with the sky"
_STAGES = "seconds of each stage, by its name: disk_map, sky_map, shadow_edge, sky_light, stars, volume, disk_light"
_TRANSMISSION = "part of the light behind them that disk and volume let through; None without either"
_BEAMS = "beams traced for the map, without those that find stars next to the shadow edge"
_CROSSINGS = "beams traced to each crossing of the disk's plane, from the first one on"


@result("rendering/1")
class Rendering(Shown):
    """A sky, a disk and a volume, as a camera or an observer sees them."""

    camera: Viewer = quantity("", "", "the camera or the observer", json="", column="")
    view: Raster = quantity("", "", "the part of its sky that is seen")
    light: Array = quantity(
        "row column channel", "1", "linear sRGB intensity, float32, in the sky's unit; 0 for pixels that see nothing"
    )
    visible_fraction: Array | None = quantity("row column", "1", _VISIBLE)
    supersampled: int = quantity("", "1", "pixels that were supersampled")
    beams: int = quantity("", "1", _BEAMS)
    seconds: float = quantity("", "s", "time it took")
    crossings: tuple[int, ...] = quantity("crossing", "1", _CROSSINGS, default=())
    transmission: Array | None = quantity("row column", "1", _TRANSMISSION, default=None)
    error: float = quantity("", "1", _ERROR, default=math.nan)
    stages: dict[str, float] = quantity("", "s", _STAGES, default=dict)
    sky_radius: float = quantity("", "GM/c^2", _SKY_RADIUS, default=math.inf)

    @property
    def alpha(self) -> Float[Array, "height width"] | None:
        """Opacity (h, w) of disk and volume, for another program to put something behind them; None with a sky.

        The shadow of the hole is not matter, and is as transparent as its surroundings.
        """
        if self.transmission is None or self.visible_fraction is not None:
            return None
        return 1 - self.transmission

    def __repr__(self) -> str:
        """Return a line with size, camera and time."""
        size = f"{self.view.width} x {self.view.height}"
        return f"<Rendering {size} of {self.camera}, {self.beams} beams, {self.seconds:.1f} s>"


@result("traced-view/1")
class TracedView(Shown):
    """The map of a view to the sky, and to a disk, made once for any sky: the result of `trace_view`."""

    camera: Viewer = quantity("", "", "the camera or the observer", json="", column="")
    view: Raster = quantity("", "", "the part of its sky that is seen")
    visible_fraction: Array | None = quantity("row column", "1", _VISIBLE)
    supersampled: int = quantity("", "1", "pixels that were supersampled")
    beams: int = quantity("", "1", _BEAMS)
    error: float = quantity("", "1", _ERROR)
    seconds: float = quantity("", "s", "time it took")
    crossings: tuple[int, ...] = quantity("crossing", "1", _CROSSINGS)
    _disk: tuple[Any, ...] | None = quantity("", "", "rims of the disk, whether it is opaque, whether with travel time")
    _cells: list[tuple[Array, ...]] = quantity("", "", "where it is seen, crossing by crossing")
    _sky_cells: tuple[Array, ...] = quantity("", "", "cells that see the sky, with what they see of it")
    _parts: list[tuple[Any, ...]] = quantity("", "", "those of supersampled pixels, widened")
    stages: dict[str, float] = quantity("", "s", _STAGES, default=dict)
    sky_radius: float = quantity("", "GM/c^2", _SKY_RADIUS, default=math.inf)

    @with_stages
    def show(
        self,
        sky: Sky | None = None,
        *,
        disk: Disk | None = None,
        volume: Glowing | None = None,
        beaming: bool = False,
        colour_shift: bool = False,
        delay: bool = False,
        time: float = 0.0,
        turn: float = 0.0,
        turn_weight: ShutterShape | Sequence[float] = "box",
        draft: bool = False,
    ) -> Rendering:
        """A sky, a disk and a volume as they are seen in this view; parameters as for `render`.

        disk: the one that the view was traced with, or another one between the same rims, and as opaque; turn: angle
        (radians) by which the sky turns about the spin axis while the picture is exposed, half of it on either side;
        turn_weight: of the moments meanwhile, as `weight` of `ShutterMotion`; draft: a volume as in one.
        """
        flags(beaming=beaming, colour_shift=colour_shift, delay=delay, draft=draft)
        began, disk = clock(), disk_about(disk, self.camera)
        check_uses(disk is not None or volume is not None, delay)
        shape = self.view.height, self.view.width
        light, transmission = np.zeros((*shape, 3), np.float32), None
        if sky is not None:
            weight = shutter_weight("turn_weight", turn_weight)
            light = self._sky_light(sky, Shifts(beaming, colour_shift), turn, weight)
        cells: tuple[DiskCells, ...] = ()
        if disk is not None:
            self._check_disk(disk, delay)
            cells = tuple(DiskCells(*parts) for parts in self._cells)
        if not (disk is None and volume is None):
            looks = Looks(self.camera.spin, beaming, colour_shift, delay, checked_moment(time))
            when = checked_moment(time), delay
            shifts = Shifts(beaming, colour_shift)
            veil = veil_over(self.camera, self.view, volume, shifts, len(cells), when, draft)
            with stage("disk_light"):
                glow, transmission = disk_light(disk, cells, shape, looks, veil)
            light = light * transmission[..., None] + glow
        counts = self.supersampled, self.beams, self.seconds + clock() - began, self.crossings
        more = transmission, self.error, self.stages, self.sky_radius
        return Rendering(self.camera, self.view, light, self.visible_fraction, *counts, *more)

    def _check_disk(self, disk: Disk, delay: bool) -> None:
        if self._disk is None or not isinstance(disk, Disk) or (disk.inner, disk.outer, disk.opaque) != self._disk[:3]:
            raise ValueError("Argument `disk` must have the rims that the view was traced with, and be as opaque.")
        if delay and not self._disk[3]:
            raise ValueError("Argument `delay` needs a view that was traced with it.")

    def _sky_light(
        self, sky: Sky, shifts: Shifts, turn: float, weight: ShutterWeight
    ) -> Float[Array, "height width 3"]:
        if self.visible_fraction is None:
            raise ValueError("Argument `sky` needs a view that was traced with it.")
        mapped, end = (self.sky_cells, self.sky_parts), sky_end(self.camera, self.sky_radius)
        return sky_light(self.camera, self.view, sky, *mapped, lambda: self.star_search, shifts, turn, end, weight)

    @property
    def sky_cells(self) -> SkyCells:
        """Cells of the picture that see the sky; of a view with a sky."""
        return SkyCells(*self._sky_cells)

    @property
    def sky_parts(self) -> list[Parts]:
        """Parts of supersampled pixels that see the sky."""
        return [Parts(*part) for part in self._parts]

    @cached_property
    def star_search(self) -> StarSearch:
        """The search for images of stars, for any catalogue; of a view with a sky."""
        assert self.visible_fraction is not None
        end = sky_end(self.camera, self.sky_radius)
        return StarSearch(self.camera, self.view, self.sky_cells, self.visible_fraction, end=end)


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
        Shift spectra by nu_camera / nu_source: a black body has the colour of one that is hotter by this factor.
    delay : bool
        Show the disk's pattern, which circles with it, and orbiting spots as they were when the light left them; else
        as they are now. It needs a disk or a volume.
    time : float
        Time of the camera, for that pattern; coordinate time, in units of the mass. For an observer it excludes the
        travel time from the hole, as for `Observer`.
    quality : str
        Largest error of the map of the sky: "draft" (0.1 pixels), "normal" (0.02), "high" (0.005); for a disk see
        Errors.
    sky_radius : float
        Boyer-Lindquist radius of the sphere with `sky`, beyond the camera, the disk and all photon orbits. Its
        sources are at rest there; the flux of a star is that at the centre of the sphere, in flat space.
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
    matter = disk, volume = disk_about(disk, camera), volume
    check_picture(camera, view)
    check_sky(sky)
    flags(beaming=beaming, colour_shift=colour_shift, delay=delay)
    check_uses(matter != (None, None), delay, sky is not None, sky_radius)
    if motion is not None:
        instance_of("motion", motion, ShutterMotion)
    exposure = Exposure.of(motion, camera, view, checked_moment(time), quality)
    if not exposure.one_map(matter):
        ends = [sky_end(one.camera, sky_radius, _rim(disk)) for one in exposure.moments]
        return _blurred(exposure, sky, matter, Shifts(beaming, colour_shift), delay, map_error(quality), ends[1])
    check_volume(volume, camera)
    options = {"disk": disk, "delay": delay and disk is not None, "quality": quality, "sky_radius": sky_radius}
    traced = trace_view(camera, view, sky=sky is not None, **options)
    switches: dict[str, Any] = {"beaming": beaming, "colour_shift": colour_shift, "delay": delay}
    turn: dict[str, Any] = {"turn": exposure.turn, "turn_weight": exposure.weight.shape}
    return traced.show(sky, disk=disk, volume=volume, time=time, draft=quality == "draft", **switches, **turn)


@usual_warnings
@with_stages
@with_progress
def trace_view(
    camera: Viewer,
    view: Raster,
    *,
    sky: bool = True,
    disk: Disk | None = None,
    delay: bool = False,
    quality: str = "normal",
    sky_radius: float = math.inf,
    progress: Progress | bool | None = None,
) -> TracedView:
    """The map of a view, for `TracedView.show`: for films, where the sky moves and the camera does not.

    Parameters
    ----------
    camera : Camera or Observer
    view : View or Screen
        As for `render`.
    sky : bool
        Trace the sky.
    disk : Disk, optional
        Its rims and its opacity count.
    delay : bool
        Compute the travel time from the disk.
    quality : str
        As for `render`.
    sky_radius : float
        As for `render`.
    progress : callable or bool, optional
        As for `caustics`.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> view = kc.pictures.View.toward_hole(camera, width=64, height=36, field_of_view=1.0)
    >>> traced = kc.pictures.trace_view(camera, view)
    >>> traced.show(kc.skies.Checkerboard()).light.shape
    (36, 64, 3)
    """
    flags(sky=sky, delay=delay)
    began, disk = clock(), disk_about(disk, camera)
    check_picture(camera, view)
    check_uses(disk is not None, delay, sky, sky_radius)
    close, end = map_error(quality), sky_end(camera, sky_radius, _rim(disk))
    shape = view.height, view.width
    hidden, about, plane = np.zeros(shape, bool), None, DiskCrossings((), ())
    if disk is not None:
        plane = _crossings(camera, view, disk, delay, quality)
        about = disk.inner, disk.outer, disk.opaque, delay
        if disk.opaque:
            hidden = covered(plane.cells, shape, disk.inner, disk.outer)
    on_disk, cells = sum(plane.beams), [tuple(part) for part in plane.cells]
    if not sky:
        return TracedView(camera, view, None, 0, on_disk, math.nan, clock() - began, plane.beams, about, cells, (), [])
    visible = seen_sky(camera, view, close, hidden, end=end)
    counts = visible.supersampled, on_disk + visible.beams, visible.error, clock() - began, plane.beams
    parts = [tuple(part) for part in visible.parts]
    sky_cells = tuple(visible.cells), parts
    return TracedView(camera, view, visible.visible_fraction, *counts, about, cells, *sky_cells, sky_radius=end.radius)


@with_stages
def _blurred(
    exposure: Exposure, sky: Sky | None, matter: Matter, shifts: Shifts, delay: bool, close: float, end: Spherical
) -> Rendering:
    """The picture of an exposure."""
    began = clock()
    camera, view, _, _ = exposure.middle
    shape = view.height, view.width
    glow, transmission, hidden, beams = np.zeros((*shape, 3), np.float32), None, np.zeros(shape, bool), ()
    disk, volume = matter
    if disk is not None:
        _check_disk(disk, camera)
    check_volume(volume, camera)
    if not (disk is None and volume is None):
        glow, transmission, hidden, beams = blurred_matter(exposure, matter, shifts, delay)
    if sky is None:
        return Rendering(camera, view, glow, None, 0, sum(beams), clock() - began, beams, transmission)
    if sky.sweep:
        raise ValueError("Argument `sky` must have no `sweep` of its own where `motion` is given.")
    light, visible = blurred_sky(exposure, sky, shifts, close, hidden, end)
    light = glow + (light if transmission is None else light * transmission[..., None])
    counts = visible.supersampled, sum(beams) + visible.beams, clock() - began, beams
    more = transmission, visible.error
    return Rendering(camera, view, light, visible.visible_fraction, *counts, *more, sky_radius=end.radius)


def _check_disk(disk: Disk, camera: Viewer) -> None:
    instance_of("disk", disk, Disk)
    disk.check(camera.spin)


def _rim(disk: Any) -> float:
    """The radius of the outer rim; 0 for no disk."""
    return disk.outer if isinstance(disk, Disk) else 0.0


@stage("disk_map")
def _crossings(camera: Viewer, view: Raster, disk: Disk, delay: bool, quality: str) -> DiskCrossings:
    _check_disk(disk, camera)
    lattice = (Lattice.draft if quality == "draft" else Lattice)(camera, view, delay)
    return crossings(lattice, disk.inner, disk.outer, disk.opaque)
