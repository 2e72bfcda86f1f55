"""Rendering: the beams of all pixels of a view, and the light of a sky and of a disk in them."""

import math
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter as clock
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from kerrcaustics.beams.trace import cores, trace_beams
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.scenes.disk.crossings import Lattice, PlaneCells, Seen, covered, crossings
from kerrcaustics.scenes.disk.disk import Disk
from kerrcaustics.scenes.disk.lighting import Looks, lit
from kerrcaustics.scenes.footprint import Footprint, bend_of, pixel_matrix, singular_values
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera, check_camera
from kerrcaustics.spacetime.checks import real_number, whole_number
from kerrcaustics.spacetime.sphere import from_angles

Array = np.ndarray

# Of a pixel a hundredth is seen: its beam need not be better.
_TOLERANCE = 1e-7
# Pixels that are traced together, and that one core lights at a time: memory beside the picture is what these need.
_CHUNK, _LIT = 1 << 18, 1 << 14
# Pixels on the shadow edge are divided so many times in each direction, and so are those whose footprint is longer
# than this (radians), to which the linear map of a beam does not reach.
_DIVISIONS = 4
_LONG = 0.5


Part = tuple[Int[Array, " _"], Footprint]
"""Some pixels, by their numbers in reading order, and their footprints; a number for each footprint."""

_OPEN = "part of each pixel that is not in the shadow; None where no sky was asked for"
_CROSSINGS = "beams traced to each crossing of the disk's plane, from the first one on"


@runtime_checkable
class Sky(Protocol):
    """What a celestial sphere must do to be seen."""

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3), as intensity, that n pixels receive."""
        ...


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

    def __repr__(self) -> str:
        """One line: size, camera, time."""
        size = f"{self.view.width} x {self.view.height}"
        return f"<Rendering {size} of {self.camera}, {self.beams} beams, {self.seconds:.1f} s>"


@result("traced-view/1")
class TracedView:
    """The beams of a view, traced once for any sky: what `trace_view` returns."""

    camera: Camera = quantity("", "", "the camera", json="", column="")
    view: View = quantity("", "", "the part of its sky that is seen")
    open: Array | None = quantity("row column", "1", _OPEN)
    divided: int = quantity("", "1", "pixels that were divided")
    beams: int = quantity("", "1", "beams traced")
    seconds: float = quantity("", "s", "time it took")
    crossings: tuple[int, ...] = quantity("crossing", "1", _CROSSINGS)
    _disk: tuple[Any, ...] | None = quantity("", "", "rims of the disk, whether it is opaque, whether with travel time")
    _cells: list[tuple[Array, ...]] = quantity("", "", "where it is seen, crossing by crossing")
    _whole: list[Part] = quantity("", "", "which pixels the footprints belong to, all of them")
    _parts: list[Part] = quantity("", "", "16 of each divided pixel, with its part of the pixel")

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
            light = self._sky_light(sky, beaming, colour_shift)
        if disk is not None:
            self._check_disk(disk, delay)
            looks = Looks(self.camera.spin, beaming, colour_shift, delay, _moment(time))
            glow, through = lit(disk, tuple(PlaneCells(*parts) for parts in self._cells), shape, looks)
            light = light * through[..., None] + glow
        seconds = self.seconds + clock() - began
        counts = self.divided, self.beams, seconds, self.crossings
        return Rendering(self.camera, self.view, light, self.open, *counts, through)

    def _check_disk(self, disk: Disk, delay: bool) -> None:
        if self._disk is None or not isinstance(disk, Disk) or (disk.inner, disk.outer, disk.opaque) != self._disk[:3]:
            raise ValueError("Argument `disk` must have the rims that the view was traced with, and be as opaque.")
        if delay and not self._disk[3]:
            raise ValueError("Argument `delay` needs a view that was traced with it.")

    def _sky_light(self, sky: Sky, beaming: bool, colour_shift: bool) -> Float[Array, "height width 3"]:
        if self.open is None:
            raise ValueError("Argument `sky` needs a view that was traced with it.")
        if (beaming or colour_shift) and any(len(f) and np.isnan(f.redshift).all() for _, f in self._whole):
            raise ValueError("Arguments `beaming` and `colour_shift` need a view that was traced with its redshift.")
        light = np.zeros((self.view.height * self.view.width, 3), np.float32)
        shifts = {"beaming": beaming, "colour_shift": colour_shift}
        with ThreadPoolExecutor(cores()) as pool:
            for pixel, footprint in self._whole:
                light[pixel] = _lit(pool, sky, footprint, **shifts)
            for pixel, footprint in self._parts:
                parts = _lit(pool, sky, footprint, **shifts) / _DIVISIONS**2
                divided, place = np.unique(pixel, return_inverse=True)
                total = [np.bincount(place, parts[:, channel], minlength=len(divided)) for channel in range(3)]
                light[divided] = np.stack(total, axis=-1)
        return light.reshape(self.view.height, self.view.width, 3)


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

    Returns
    -------
    Rendering
        Its light becomes a picture by `tone_mapped`.

    Errors
    ------
    Beams are good to 1e-7 rad. Sky: a footprint is the linear image of its pixel, filtered with a deviation of half a
    pixel; pixels at the shadow edge, and those whose footprint is longer than 0.5 rad, are divided into 16. Disk: the
    mean over the pixel, to about 1 % or 1/255 of the brightest; beams are interpolated to a hundredth of a pixel, and
    images that no pixel shows by 1/255 are left out. Where a disk that is not opaque lies over an edge of the sky, the
    mean of the product is that of the means.

    References
    ----------
    JTFT section 2, 4 and appendix A: beams in place of rays, so that nothing flickers or aliases.
    """
    redshift = beaming or colour_shift
    traced = trace_view(camera, view, sky=sky is not None, disk=disk, redshift=redshift, delay=delay)
    return traced.show(sky, disk=disk, beaming=beaming, colour_shift=colour_shift, delay=delay, time=time)


@usual_warnings
def trace_view(
    camera: Camera,
    view: View,
    *,
    sky: bool = True,
    disk: Disk | None = None,
    redshift: bool = False,
    delay: bool = False,
) -> TracedView:
    """The beams of all pixels of a view, for `TracedView.show`: for films, where the sky moves and the camera does not.

    sky: whether there will be one; disk: where one lies; redshift: whether beaming and shift of colours will be wanted;
    delay: whether the travel time from the disk will be.
    """
    began = clock()
    check_camera(camera)
    shape = view.height, view.width
    hidden, about, found = np.zeros(shape, bool), None, Seen((), ())
    if disk is not None:
        found = _crossings(camera, view, disk, delay)
        about = disk.inner, disk.outer, disk.opaque, delay
        if disk.opaque:
            hidden = covered(found.cells, shape, disk.inner, disk.outer)
    on_disk, cells = sum(found.beams), [tuple(part) for part in found.cells]
    if not sky:
        return TracedView(camera, view, None, 0, on_disk, clock() - began, found.beams, about, cells, [], [])
    untraced = _inner(hidden) if hidden.any() else hidden
    whole, reached, long = _whole_pixels(camera, view, redshift, untraced)
    opened = reached.astype(np.float32)
    divided = np.flatnonzero((_at_edge(reached) | long) & ~hidden)
    parts = []
    for start in range(0, len(divided), _CHUNK // _DIVISIONS**2):
        which = divided[start : start + _CHUNK // _DIVISIONS**2]
        part, opened.flat[which] = _divided_pixels(camera, view, which, redshift)
        parts.append(part)
    beams = on_disk + reached.size - int(untraced.sum()) + len(divided) * _DIVISIONS**2
    counts = len(divided), beams, clock() - began, found.beams
    return TracedView(camera, view, opened, *counts, about, cells, whole, parts)


def _crossings(camera: Camera, view: View, disk: Disk, delay: bool) -> Seen:
    if not isinstance(disk, Disk):
        raise ValueError(f"Argument `disk` must be a Disk, but is {type(disk).__name__}.")
    disk.check(camera.spin)
    return crossings(Lattice(camera, view, delay), disk.inner, disk.outer, disk.opaque)


def _moment(time: float) -> float:
    if not math.isfinite(real_number("time", time)):
        raise ValueError(f"Argument `time` must be a number, but is {time!r}.")
    return float(time)


def _whole_pixels(
    camera: Camera, view: View, redshift: bool, untraced: Bool[Array, "height width"]
) -> tuple[list[Part], Bool[Array, "height width"], Bool[Array, "height width"]]:
    """Footprints of all pixels, some rows at a time; which pixels are not in the shadow, and which are too long.

    untraced: pixels that the disk hides, as it does all around them; they are as if in the shadow.
    """
    reached, long = np.zeros((2, view.height, view.width), bool)
    rows = min(max(_CHUNK // view.width, 2), view.height)
    whole = []
    for top in range(0, view.height, rows):
        # The last ones overlap those before, so that there are always two rows to take differences of.
        first = max(min(top, view.height - rows), 0)
        x, y = np.meshgrid(np.arange(view.width), np.arange(first, first + rows))
        part = slice(first, first + rows)
        footprint, inside = _traced(camera, view, x[None], y[None], 1.0, redshift, untraced[None, part])
        reached[part] = inside.reshape(-1, view.width)
        long[part].flat[np.flatnonzero(inside)] = singular_values(footprint.matrix)[0] > _LONG
        whole.append((np.flatnonzero(inside) + first * view.width, footprint))
    return whole, reached, long


def _divided_pixels(
    camera: Camera, view: View, which: Int[Array, " pixels"], redshift: bool
) -> tuple[Part, Float[Array, " pixels"]]:
    """Footprints of the parts of pixels, and how much of each is not in the shadow."""
    within = (np.arange(_DIVISIONS) + 0.5) / _DIVISIONS - 0.5
    y, x = (place[:, None, None] for place in np.divmod(which, view.width))
    x, y = np.broadcast_arrays(x + within, y + within[:, None])
    footprint, inside = _traced(camera, view, x, y, 1 / _DIVISIONS, redshift)
    part = np.repeat(which, inside[0].size)[inside.ravel()], footprint
    return part, inside.reshape(len(which), -1).mean(axis=1)


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
    return sky.light(footprint, False, False).reshape(height, 2 * height, 3)


def _traced(
    camera: Camera, view: View, x: Array, y: Array, size: float, redshift: bool, untraced: Array | None = None
) -> tuple[Footprint, Bool[Array, "k h w"]]:
    """Footprints of those pixels (k, h, w) of a size that are not in the shadow, and which those are (k, h, w).

    untraced (k, h, w): which are not to be traced, and are none of them.
    """
    sky, steps = view.directions(x, y)
    some = np.s_[...] if untraced is None or not untraced.any() else ~untraced
    beams = trace_beams(camera, sky[some], "auto", _TOLERANCE, index=False, crossings=False, redshift=redshift)
    # Captured beams are NaN, and so are those that are not traced.
    direction, matrix = np.full(sky.shape, np.nan), np.full((*x.shape, 2, 2), np.nan)
    direction[some], matrix[some] = beams.direction, pixel_matrix(beams, sky[some], size * steps[some])
    inside = np.isfinite(matrix.sum(axis=(-2, -1)) + direction.sum(axis=-1))
    bend = bend_of(direction, matrix) if min(x.shape[1:]) > 1 else np.zeros(x.shape)
    ratio = np.full(x.shape, np.nan)
    if beams.redshift is not None:
        ratio[some] = beams.redshift
    return Footprint(direction[inside], matrix[inside], bend[inside], ratio[inside]), inside


def _lit(pool: ThreadPoolExecutor, sky: Sky, footprint: Footprint, **shifts: bool) -> Float[Array, "pixels 3"]:
    """Light (n, 3), on all cores."""
    parts = [footprint.part(slice(start, start + _LIT)) for start in range(0, len(footprint), _LIT)]
    lights = list(pool.map(lambda part: sky.light(part, **shifts), parts))
    return np.concatenate([np.zeros((0, 3)), *lights])


def _inner(mask: Bool[Array, "h w"]) -> Bool[Array, "h w"]:
    """Pixels of a mask that have no neighbour, also across a corner, outside of it."""
    return ~_spread(~mask)


def _spread(mask: Bool[Array, "h w"]) -> Bool[Array, "h w"]:
    """A mask with all neighbours of its pixels."""
    framed = np.pad(mask, 1, mode="edge")
    height, width = mask.shape
    return np.logical_or.reduce([framed[i : i + height, j : j + width] for i in range(3) for j in range(3)])


def _at_edge(reached: Bool[Array, "h w"]) -> Bool[Array, "h w"]:
    """Pixels (h, w) with a neighbour, also across a corner, on the other side of the shadow edge."""
    return _spread(reached) & _spread(~reached)
