"""The light of a sky in the pixels of a picture, from cells that see it (sky_cells.py) and parts of pixels beside them.

What is spread over the sky is averaged over footprints; what comes from points is drawn where their images lie.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from kerrcaustics.beams.trace import cores
from kerrcaustics.results.stages import stage
from kerrcaustics.scenes.colour import shifted_light
from kerrcaustics.scenes.footprint import ASPECT, Footprint, singular_values
from kerrcaustics.scenes.points import LONGEST, Imaged, ImageSearch, PointLights, drawn, images_in_parts, steps_to
from kerrcaustics.scenes.sky_cells import PARTS, Pixels, SkyCells, parts_of, places
from kerrcaustics.scenes.view import View
from kerrcaustics.spacetime.camera import Camera, redshift

Array = np.ndarray

# Parts of pixels that are lit together: they fit in a core's cache.
_TOGETHER = 1 << 15
# A trace that is longer, or farther from straight than this (pixels), is drawn from two halves of the exposure, each
# by its own images; at most so often.
_LONGEST_TRACE, _STRAIGHT, _HALVINGS = 64.0, 0.3, 4
# Images on a trace are no further apart than this part of a pixel.
_APART = 0.5


@runtime_checkable
class Sky(Protocol):
    """What a celestial sphere must do to be seen.

    One with points of light has two more: points, a `PointLights`, and sweep, the angle (radians) by which they turn
    about the spin axis while the picture is exposed.
    """

    def light(self, footprint: Footprint, beaming: bool, colour_shift: bool) -> Float[Array, "pixels 3"]:
        """Linear sRGB light (n, 3), as intensity, that n pixels receive of what is spread over the sky."""
        ...


class Parts(NamedTuple):
    """Squares of a picture that see the sky: places (m, 2), pixels; side; and their footprints."""

    place: Array
    side: float
    footprint: Footprint


class Shifts(NamedTuple):
    """Whether light is shifted: its intensity, its colours."""

    beaming: bool
    colour_shift: bool


def sky_light(
    camera: Camera,
    view: View,
    sky: Sky,
    cells: SkyCells,
    left: list[Parts],
    search: Callable[[], ImageSearch],
    shifts: Shifts,
) -> Float[Array, "h w 3"]:
    """Linear light (h, w, 3) of a picture; left: parts of pixels that no cell covers; search: for images of stars."""
    light = np.zeros((view.height * view.width, 3), np.float32)
    count = parts_of(cells)
    with ThreadPoolExecutor(cores()) as pool:
        pieces = [piece for n in (2, PARTS) for piece in places(cells, np.flatnonzero(count == n), n)]
        divided = [*left, *(_parts(camera, view, cells, piece, shifts) for piece in pieces)]
        whole = places(cells, np.flatnonzero(count == 1), 1)

        def store(part: Pixels) -> None:
            x, y = part.place
            inside = (x < view.width) & (y < view.height)
            footprint = _footprint(camera, view, cells, part, shifts)
            light[(y * view.width + x).astype(int)[inside]] = sky.light(footprint, *shifts)[inside]

        list(pool.map(store, whole))
        points: PointLights | None = getattr(sky, "points", None)
        for pixel, given in pool.map(lambda part: _given(sky, points, view, part, shifts), _pieces(divided)):
            for channel in range(3):
                np.add.at(light[:, channel], pixel, given[:, channel])
        light = light.reshape(view.height, view.width, 3)
        if points is not None and len(points.direction):
            _StarsSeen(camera, view, search(), divided, shifts, pool).draw(light, points, getattr(sky, "sweep", 0.0))
    return light


def _footprint(camera: Camera, view: View, cells: SkyCells, part: Pixels, shifts: Shifts) -> Footprint:
    side = part.side
    ratio = ratios(camera, view, part.place.T, shifts)
    return Footprint.of(part.direction, part.steps * side, cells.curving[part.cell] * side**2, ratio)


def _parts(camera: Camera, view: View, cells: SkyCells, part: Pixels, shifts: Shifts) -> Parts:
    return Parts(part.place.T, part.side, _footprint(camera, view, cells, part, shifts))


def ratios(camera: Camera, view: View, place: Float[Array, "m 2"], shifts: Shifts) -> Float[Array, " m"]:
    """nu_camera / nu_source (m,) at places of a picture; 1 where it is not asked for."""
    if not any(shifts):
        return np.ones(len(place))
    return redshift(camera, view.directions(*place.T)[0])


def _pieces(parts: list[Parts]) -> Iterator[Parts]:
    for place, side, footprint in parts:
        for start in range(0, len(place), _TOGETHER):
            piece = slice(start, start + _TOGETHER)
            yield Parts(place[piece], side, footprint.part(piece))


def _given(
    sky: Sky, points: PointLights | None, view: View, part: Parts, shifts: Shifts
) -> tuple[Int[Array, " m"], Float[Array, "m 3"]]:
    """Pixels, and what parts of them add to their light."""
    x, y = np.round(part.place).astype(int).T
    footprint = part.footprint.widened(ASPECT * part.side)
    light = sky.light(footprint, *shifts)
    if points is not None:
        unresolved = singular_values(part.footprint.matrix)[0] > LONGEST
        light[unresolved] += points.glow.light(footprint.part(unresolved), *shifts)
    return y * view.width + x, light * part.side**2


class _StarsSeen(NamedTuple):
    """Where points of light are drawn, and how."""

    camera: Camera
    view: View
    search: ImageSearch
    parts: list[Parts]
    shifts: Shifts
    pool: ThreadPoolExecutor

    @stage("stars")
    def draw(self, light: Float[Array, "h w 3"], points: PointLights, sweep: float) -> None:
        """Add stars to a picture while they turn about the spin axis by an angle.

        Traces that are not straight are drawn from two halves of the exposure, and these from their halves.
        """
        which, middle, share = np.arange(len(points.direction)), np.zeros(len(points.direction)), 1.0
        for halving in range(_HALVINGS + 1):
            some = points.some(which, middle) if sweep else points
            found = self._images(some)
            trace, strays = _trace(found, some, sweep)
            far = np.unique(found.star[strays]) if halving < _HALVINGS else np.zeros(0, int)
            here = ~np.isin(found.star, far)
            self._draw(light, Imaged(*(part[here] for part in found)), trace[here], some, share)
            if not len(far):
                return
            middle = np.concatenate([middle[far] - sweep / 4, middle[far] + sweep / 4])
            which, sweep, share = np.tile(which[far], 2), sweep / 2, share / 2

    def _images(self, points: PointLights) -> Imaged:
        found = [self.search.images(points, self.pool)]
        found += [images_in_parts(*part, points, self.pool) for part in self.parts]
        return Imaged(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

    def _draw(
        self, light: Float[Array, "h w 3"], found: Imaged, trace: Float[Array, "m 2"], points: PointLights, share: float
    ) -> None:
        if not len(found.star):
            return
        give = points.flux[found.star] * (share / found.area)[:, None]
        if any(self.shifts):
            ratio = ratios(self.camera, self.view, found.place, self.shifts)
            give *= shifted_light(ratio, *self.shifts, points.temperature[found.star], points.response)
        length = np.abs(trace).max(axis=1) / _APART
        doublings = np.ceil(np.log2(np.maximum(length, 1))).astype(int)
        for doubling in np.unique(doublings):
            same, count = doublings == doubling, 2 ** int(doubling)
            for moment in (np.arange(count) + 0.5) / count - 0.5:
                drawn(light, found.place[same] + moment * trace[same], give[same] / count)


def _trace(found: Imaged, points: PointLights, angle: float) -> tuple[Float[Array, "m 2"], Bool[Array, " m"]]:
    """How far (m, 2), in pixels, images move while their stars turn about the spin axis; which of them not straight."""
    if not angle:
        return np.zeros_like(found.place), np.zeros(len(found.star), bool)
    x, y, _ = points.direction[found.star].T
    motion = angle * np.stack([-y, x, np.zeros_like(x)], axis=-1)
    trace = _moved(found, motion)
    squares = np.stack([trace[:, 0] ** 2, 2 * trace[:, 0] * trace[:, 1], trace[:, 1] ** 2], axis=-1)
    strayed = _moved(found, (squares[..., None] * found.curving).sum(axis=1) / 8)
    return trace, (np.abs(strayed).max(axis=1) > _STRAIGHT) | (np.abs(trace).max(axis=1) > _LONGEST_TRACE)


def _moved(found: Imaged, motion: Float[Array, "m 3"]) -> Float[Array, "m 2"]:
    """How far images move, in pixels, as their stars do by (m, 3)."""
    # No steeper than where brightness is cut, too.
    return steps_to(found.steps, motion, found.area**2)
