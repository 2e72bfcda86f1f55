"""Rendering: the beams of all pixels of a view, and the light of a sky in them."""

import math
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from kerrcaustics.beams.trace import cores, trace_beams
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.scenes.footprint import Footprint, bend_of, pixel_matrix, singular_values
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.spacetime.checks import whole_number
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


@runtime_checkable
class Sky(Protocol):
    """What a celestial sphere must do to be seen."""

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3), as intensity, that n pixels receive."""
        ...


@result("rendering/1")
class Rendering:
    """A sky as a camera sees it."""

    camera: Camera = quantity("", "", "the camera", json="", column="")
    view: View = quantity("", "", "the part of its sky that is seen")
    light: Array = quantity(
        "row column channel", "1", "linear sRGB intensity, float32, in the sky's unit; the shadow is 0"
    )
    open: Array = quantity("row column", "1", "part of each pixel that is not in the shadow")
    divided: int = quantity("", "1", "pixels that were divided")
    beams: int = quantity("", "1", "beams traced")
    seconds: float = quantity("", "s", "time it took")

    def __repr__(self) -> str:
        """One line: size, camera, time."""
        size = f"{self.view.width} x {self.view.height}"
        return f"<Rendering {size} of {self.camera}, {self.beams} beams, {self.seconds:.1f} s>"


@result("traced-view/1")
class TracedView:
    """The beams of a view, traced once for any sky: what `trace_view` returns."""

    camera: Camera = quantity("", "", "the camera", json="", column="")
    view: View = quantity("", "", "the part of its sky that is seen")
    open: Array = quantity("row column", "1", "part of each pixel that is not in the shadow")
    divided: int = quantity("", "1", "pixels that were divided")
    beams: int = quantity("", "1", "beams traced")
    seconds: float = quantity("", "s", "time it took")
    _whole: list[Part] = quantity("", "", "which pixels the footprints belong to, all of them")
    _parts: list[Part] = quantity("", "", "16 of each divided pixel, with its part of the pixel")

    def show(self, sky: Sky, *, beaming: bool = False, colour_shift: bool = False) -> Rendering:
        """A sky as it is seen in this view; parameters as for `render`."""
        began = time.perf_counter()
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
        light = light.reshape(self.view.height, self.view.width, 3)
        seconds = self.seconds + time.perf_counter() - began
        return Rendering(self.camera, self.view, light, self.open, self.divided, self.beams, seconds)


@usual_warnings
def render(camera: Camera, view: View, sky: Sky, *, beaming: bool = False, colour_shift: bool = False) -> Rendering:
    """A sky seen through the hole: each pixel holds the mean of the sky over the footprint of its beam.

    Parameters
    ----------
    camera : Camera
    view : View
    sky : Checkerboard, Panorama, StarField or anything else with their method `light`
    beaming : bool
        Intensity times the fourth power of nu_camera / nu_source.
    colour_shift : bool
        Spectra move with nu_camera / nu_source; see `shifted_light`.

    Returns
    -------
    Rendering
        Its light becomes a picture by `tone_mapped`.

    Errors
    ------
    Beams are good to 1e-7 rad. A footprint is the linear image of its pixel, filtered with a deviation of half a pixel;
    pixels at the shadow edge, and those whose footprint is longer than 0.5 rad, are divided into 16.

    References
    ----------
    JTFT section 2 and appendix A.3: beams in place of rays, so that nothing flickers or aliases.
    """
    traced = trace_view(camera, view, redshift=beaming or colour_shift)
    return traced.show(sky, beaming=beaming, colour_shift=colour_shift)


@usual_warnings
def trace_view(camera: Camera, view: View, *, redshift: bool = False) -> TracedView:
    """The beams of all pixels of a view, for `TracedView.show`: for films, where the sky moves and the camera does not.

    redshift: whether beaming and shift of colours will be wanted.
    """
    began = time.perf_counter()
    whole, reached, long = _whole_pixels(camera, view, redshift)
    opened = reached.astype(np.float32)
    divided = np.flatnonzero(_at_edge(reached) | long)
    parts = []
    for start in range(0, len(divided), _CHUNK // _DIVISIONS**2):
        which = divided[start : start + _CHUNK // _DIVISIONS**2]
        part, opened.flat[which] = _divided_pixels(camera, view, which, redshift)
        parts.append(part)
    beams = reached.size + len(divided) * _DIVISIONS**2
    return TracedView(camera, view, opened, len(divided), beams, time.perf_counter() - began, whole, parts)


def _whole_pixels(
    camera: Camera, view: View, redshift: bool
) -> tuple[list[Part], Bool[Array, "height width"], Bool[Array, "height width"]]:
    """Footprints of all pixels, some rows at a time; which pixels are not in the shadow, and which are too long."""
    reached, long = np.zeros((2, view.height, view.width), bool)
    rows = min(max(_CHUNK // view.width, 2), view.height)
    whole = []
    for top in range(0, view.height, rows):
        # The last ones overlap those before, so that there are always two rows to take differences of.
        first = max(min(top, view.height - rows), 0)
        x, y = np.meshgrid(np.arange(view.width), np.arange(first, first + rows))
        footprint, inside = _traced(camera, view, x[None], y[None], 1.0, redshift)
        part = slice(first, first + rows)
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
    camera: Camera, view: View, x: Array, y: Array, size: float, redshift: bool
) -> tuple[Footprint, Bool[Array, "k h w"]]:
    """Footprints of those pixels (k, h, w) of a size that are not in the shadow, and which those are (k, h, w)."""
    sky, steps = view.directions(x, y)
    beams = trace_beams(camera, sky, "auto", _TOLERANCE, index=False, crossings=False, redshift=redshift)
    matrix = pixel_matrix(beams, sky, size * steps)
    # Captured beams are NaN.
    inside = np.isfinite(matrix.sum(axis=(-2, -1)) + beams.direction.sum(axis=-1))
    bend = bend_of(beams.direction, matrix) if min(x.shape[1:]) > 1 else np.zeros(x.shape)
    ratio = beams.redshift[inside] if beams.redshift is not None else np.full(int(inside.sum()), np.nan)
    return Footprint(beams.direction[inside], matrix[inside], bend[inside], ratio), inside


def _lit(pool: ThreadPoolExecutor, sky: Sky, footprint: Footprint, **shifts: bool) -> Float[Array, "pixels 3"]:
    """Light (n, 3), on all cores."""
    parts = [footprint.part(slice(start, start + _LIT)) for start in range(0, len(footprint), _LIT)]
    lights = list(pool.map(lambda part: sky.light(part, **shifts), parts))
    return np.concatenate([np.zeros((0, 3)), *lights])


def _at_edge(reached: Bool[Array, "h w"]) -> Bool[Array, "h w"]:
    """Pixels (h, w) with a neighbour, also across a corner, on the other side of the shadow edge."""
    framed = np.pad(reached, 1, mode="edge")
    height, width = reached.shape
    around = [framed[i : i + height, j : j + width] for i in range(3) for j in range(3)]
    return np.logical_or.reduce(around) & ~np.logical_and.reduce(around)
