"""Rendering: the beams of all pixels of a view, and the light of a sky and of a disk in them."""

import math
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from time import perf_counter as clock
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int

from kerrcaustics.beams.trace import cores, trace_beams
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.stages import stage, with_stages
from kerrcaustics.scenes.disk.crossings import Lattice, PlaneCells, Seen, covered, crossings
from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.disk.lighting import Looks, lit
from kerrcaustics.scenes.footprint import Footprint
from kerrcaustics.scenes.points import ImageSearch, PointLights, drawn
from kerrcaustics.scenes.sky_cells import TOLERANCE, SkyCells, sky_map, slopes, undivided
from kerrcaustics.scenes.sky_light import Parts, Shifts, Sky, sky_light
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera, check_camera, redshift
from kerrcaustics.spacetime.checks import real_number, whole_number
from kerrcaustics.spacetime.sphere import from_angles, polar_angle

Array = np.ndarray

# Pixels that are divided together.
_CHUNK = 1 << 12
# Errors of a map are found at some places only: elsewhere they were seen to be 1.1 times larger at most.
_CAUTION = 2.0
# How far, in pixels, maps of the sky may be off where they are checked.
QUALITIES = {"draft": 0.05, "normal": 0.01, "high": 0.0025}

_OPEN = "part of each pixel that is not in the shadow; None where no sky was asked for"
_ERROR = "how far the map of the sky is off, in pixels, at most; NaN where no sky was asked for"
_STAGES = "seconds of each stage, by its name: disk_map, sky_map, shadow_edge, sky_light, stars, disk_light"
_CROSSINGS = "beams traced to each crossing of the disk's plane, from the first one on"


@result("rendering/1")
class Rendering:
    """A sky, and a disk, as a camera sees them."""

    camera: Camera = quantity("", "", "the camera", json="", column="")
    view: View = quantity("", "", "the part of its sky that is seen")
    light: Array = quantity(
        "row column channel", "1", "linear sRGB intensity, float32, in the sky's unit; what sees nothing is 0"
    )
    open: Array | None = quantity("row column", "1", _OPEN)
    divided: int = quantity("", "1", "pixels that were divided")
    beams: int = quantity("", "1", "beams traced")
    seconds: float = quantity("", "s", "time it took")
    crossings: tuple[int, ...] = quantity("crossing", "1", _CROSSINGS, default=())
    transmission: Array | None = quantity(
        "row column", "1", "part of the light behind it that the disk lets through; None without a disk", default=None
    )
    error: float = quantity("", "1", _ERROR, default=math.nan)
    stages: dict[str, float] = quantity("", "s", _STAGES, default=dict)

    def __repr__(self) -> str:
        """One line: size, camera, time."""
        size = f"{self.view.width} x {self.view.height}"
        return f"<Rendering {size} of {self.camera}, {self.beams} beams, {self.seconds:.1f} s>"


@result("traced-view/1")
class TracedView:
    """The map of a view to the sky, and to a disk, made once for any sky: what `trace_view` returns."""

    camera: Camera = quantity("", "", "the camera", json="", column="")
    view: View = quantity("", "", "the part of its sky that is seen")
    open: Array | None = quantity("row column", "1", _OPEN)
    divided: int = quantity("", "1", "pixels that were divided")
    beams: int = quantity("", "1", "beams traced")
    error: float = quantity("", "1", _ERROR)
    seconds: float = quantity("", "s", "time it took")
    crossings: tuple[int, ...] = quantity("crossing", "1", _CROSSINGS)
    _disk: tuple[Any, ...] | None = quantity("", "", "rims of the disk, whether it is opaque, whether with travel time")
    _cells: list[tuple[Array, ...]] = quantity("", "", "where it is seen, crossing by crossing")
    _sky: tuple[Array, ...] = quantity("", "", "cells that see the sky")
    _parts: list[tuple[Any, ...]] = quantity("", "", "those of divided pixels")
    stages: dict[str, float] = quantity("", "s", _STAGES, default=dict)

    @with_stages
    def show(
        self,
        sky: Sky | None = None,
        *,
        disk: Disk | None = None,
        beaming: bool = False,
        colour_shift: bool = False,
        delay: bool = False,
        time: float = 0.0,
    ) -> Rendering:
        """A sky and a disk as they are seen in this view; parameters as for `render`.

        disk: the one that the view was traced with, or another one between the same rims, and as opaque.
        """
        began = clock()
        shape = self.view.height, self.view.width
        light, through = np.zeros((*shape, 3), np.float32), None
        if sky is not None:
            light = self._sky_light(sky, Shifts(beaming, colour_shift))
        if disk is not None:
            self._check_disk(disk, delay)
            looks = Looks(self.camera.spin, beaming, colour_shift, delay, _moment(time))
            with stage("disk_light"):
                glow, through = lit(disk, tuple(PlaneCells(*parts) for parts in self._cells), shape, looks)
            light = light * through[..., None] + glow
        seconds = self.seconds + clock() - began
        counts = self.divided, self.beams, seconds, self.crossings
        return Rendering(self.camera, self.view, light, self.open, *counts, through, self.error, self.stages)

    def _check_disk(self, disk: Disk, delay: bool) -> None:
        if self._disk is None or not isinstance(disk, Disk) or (disk.inner, disk.outer, disk.opaque) != self._disk[:3]:
            raise ValueError("Argument `disk` must have the rims that the view was traced with, and be as opaque.")
        if delay and not self._disk[3]:
            raise ValueError("Argument `delay` needs a view that was traced with it.")

    @stage("sky_light")
    def _sky_light(self, sky: Sky, shifts: Shifts) -> Float[Array, "height width 3"]:
        if self.open is None:
            raise ValueError("Argument `sky` needs a view that was traced with it.")
        parts = [Parts(*part) for part in self._parts]
        cells = SkyCells(*self._sky)
        return sky_light(self.camera, self.view, sky, cells, parts, lambda: self._search, shifts)

    @cached_property
    def _search(self) -> ImageSearch:
        """For the images of stars, whichever they are."""
        return ImageSearch(undivided(SkyCells(*self._sky)))


@usual_warnings
def render(
    camera: Camera,
    view: View,
    sky: Sky | None = None,
    *,
    disk: Disk | None = None,
    beaming: bool = False,
    colour_shift: bool = False,
    delay: bool = False,
    time: float = 0.0,
    quality: str = "normal",
) -> Rendering:
    """A sky seen through the hole, and a disk round it.

    Each pixel holds the mean of the sky over the footprint of its beam, and of the disk over its own square.

    Parameters
    ----------
    camera : Camera
    view : View
    sky : Checkerboard, Panorama, StarField or anything else with their method `light`, optional
        Left out, it is black, and no beam is traced to it.
    disk : Disk, optional
    beaming : bool
        Intensity times the fourth power of nu_camera / nu_source.
    colour_shift : bool
        Spectra move with nu_camera / nu_source; see `shifted_light`.
    delay : bool
        Whether the disk's pattern, which circles with it, is seen as it was when the light left it, or as it is now.
    time : float
        Of the camera, for that pattern; as coordinate time, in units of the mass.
    quality : str
        How far the map of the sky may be off: "draft" (0.1 pixels), "normal" (0.02), "high" (0.005).

    Returns
    -------
    Rendering
        Its light becomes a picture by `tone_mapped`.

    Errors
    ------
    Beams are good to 1e-7 rad. They are traced where the map of the sky is not smooth, and interpolated elsewhere; that
    is off by `error` pixels of the result at most, twice what rays found that checked it. A pixel on a critical curve
    counts by the strip of the sky that it is folded over. A footprint is the linear image of its pixel, filtered with a
    deviation of half a pixel; pixels at the shadow edge, and those that see more than 0.5 rad, are divided into 16, and
    into 4 those that see more than 0.2. Stars are drawn where their images lie; in divided pixels, by the footprints of
    the parts. Disk: the mean over the pixel, to about 1 % or 1/255 of the brightest; beams are interpolated to a
    hundredth of a pixel, and images that no pixel shows by 1/255 are left out. Where a disk that is not opaque lies
    over an edge of the sky, the mean of the product is that of the means.

    References
    ----------
    JTFT section 2, 4 and appendix A: beams in place of rays, so that nothing flickers or aliases.
    """
    traced = trace_view(camera, view, sky=sky is not None, disk=disk, delay=delay, quality=quality)
    return traced.show(sky, disk=disk, beaming=beaming, colour_shift=colour_shift, delay=delay, time=time)


@usual_warnings
@with_stages
def trace_view(
    camera: Camera,
    view: View,
    *,
    sky: bool = True,
    disk: Disk | None = None,
    delay: bool = False,
    quality: str = "normal",
) -> TracedView:
    """The map of a view, for `TracedView.show`: for films, where the sky moves and the camera does not.

    sky: whether there will be one; disk: where one lies; delay: whether the travel time from it will be wanted;
    quality: as for `render`.
    """
    began = clock()
    check_camera(camera)
    if quality not in QUALITIES:
        raise ValueError(f"Argument `quality` must be one of {', '.join(QUALITIES)}, but is {quality!r}.")
    shape = view.height, view.width
    hidden, about, found = np.zeros(shape, bool), None, Seen((), ())
    if disk is not None:
        found = _crossings(camera, view, disk, delay)
        about = disk.inner, disk.outer, disk.opaque, delay
        if disk.opaque:
            hidden = covered(found.cells, shape, disk.inner, disk.outer)
    on_disk, cells = sum(found.beams), [tuple(part) for part in found.cells]
    if not sky:
        return TracedView(camera, view, None, 0, on_disk, math.nan, clock() - began, found.beams, about, cells, (), [])
    close = QUALITIES[quality]
    with stage("sky_map"):
        seen = sky_map(camera, view, close, hidden)
    opened = _covered(seen.cells, shape)
    chunks = [
        (same[start : start + _CHUNK], int(count))
        for count in np.unique(seen.parts)
        for same in (seen.left[seen.parts == count],)
        for start in range(0, len(same), _CHUNK)
    ]
    with ThreadPoolExecutor(cores()) as pool:
        divided = list(pool.map(lambda chunk: _divided_pixels(camera, view, *chunk), chunks))
    for (which, _), (_, share) in zip(chunks, divided, strict=True):
        opened.flat[which] = share
    parts = [tuple(part) for part, _ in divided]
    beams = on_disk + seen.beams + int((seen.parts**2).sum())
    error = max(_CAUTION * float(seen.cells.error.max(initial=0.0)), TOLERANCE / view.pixel)
    counts = len(seen.left), beams, error, clock() - began, found.beams
    return TracedView(camera, view, opened, *counts, about, cells, tuple(seen.cells), parts)


def _covered(cells: SkyCells, shape: tuple[int, int]) -> Float32[Array, "h w"]:
    """1 in pixels that cells cover, 0 elsewhere."""
    opened = np.zeros(shape, np.float32)
    for x, y, size in zip(cells.x, cells.y, cells.size, strict=True):
        opened[y : y + size, x : x + size] = 1
    return opened


@stage("disk_map")
def _crossings(camera: Camera, view: View, disk: Disk, delay: bool) -> Seen:
    if not isinstance(disk, Disk):
        raise ValueError(f"Argument `disk` must be a Disk, but is {type(disk).__name__}.")
    disk.check(camera.spin)
    return crossings(Lattice(camera, view, delay), disk.inner, disk.outer, disk.opaque)


def _moment(time: float) -> float:
    if not math.isfinite(real_number("time", time)):
        raise ValueError(f"Argument `time` must be a number, but is {time!r}.")
    return float(time)


@stage("shadow_edge")
def _divided_pixels(
    camera: Camera, view: View, which: Int[Array, " pixels"], count: int
) -> tuple[Parts, Float[Array, " pixels"]]:
    """Parts of pixels that see the sky, and how much of each pixel does."""
    within = (np.arange(count) + 0.5) / count - 0.5
    y, x = (place[:, None, None] for place in np.divmod(which, view.width))
    x, y = np.broadcast_arrays(x + within, y + within[:, None])
    sky, steps = view.directions(x, y)
    beams = trace_beams(camera, sky, "auto", TOLERANCE, index=False, crossings=False, redshift=False)
    columns = slopes(beams, sky, steps) / count
    inside = np.isfinite(columns[..., 0, 0])
    some = columns[inside].transpose(2, 1, 0)
    curving = (_neighbours_curving(columns) if count > 1 else np.zeros((*columns.shape[:3], 3, 3)))[inside]
    footprint = Footprint.of(beams.direction[inside].T, some, curving, redshift(camera, sky[inside]))
    place = np.stack([x[inside], y[inside]], axis=-1)
    return Parts(place, 1 / count, footprint), inside.reshape(len(which), -1).mean(axis=1)


def _neighbours_curving(columns: Float[Array, "n h w 3 2"]) -> Float[Array, "n h w 3 3"]:
    """Second derivatives along xx, xy, yy from differences of neighbours; 0 beside those that see nothing."""
    along_y, along_x = np.gradient(columns, axis=(1, 2))
    second = np.stack([along_x[..., 0], (along_x[..., 1] + along_y[..., 0]) / 2, along_y[..., 1]], axis=-2)
    return np.nan_to_num(second, nan=0.0)


@usual_warnings
def celestial_picture(sky: Sky, height: int) -> Float[Array, "height 2*height 3"]:
    """Light (height, 2 height, 3) of a sky itself, with no hole: theta' downward, phi' from 0 to 2 pi to the right."""
    height = whole_number("height", height, 2, 8192)
    pixel = math.pi / height
    theta = (np.arange(height) + 0.5)[:, None] * pixel
    phi = (np.arange(2 * height) + 0.5) * pixel
    direction = from_angles(theta, phi).reshape(-1, 3)
    matrix = np.zeros((len(direction), 2, 2))
    matrix[:, 0, 0] = pixel
    matrix[:, 1, 1] = pixel * np.repeat(np.sin(theta[:, 0]), 2 * height)
    footprint = Footprint(direction, matrix, np.zeros(len(direction)), np.ones(len(direction)))
    light = sky.light(footprint, False, False).reshape(height, 2 * height, 3)
    points: PointLights | None = getattr(sky, "points", None)
    if points is not None:
        x, y, _ = points.direction.T
        turn, down = np.arctan2(y, x) % (2 * math.pi), polar_angle(points.direction)
        place = np.stack([turn, down], axis=-1) / pixel - 0.5
        drawn(light, place, points.flux / (pixel**2 * np.maximum(np.sin(down), pixel / 2))[:, None])
    return light
