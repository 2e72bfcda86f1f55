"""The light of a sky in the pixels of a picture, from cells that see it (sky_cells.py) and parts of pixels beside them.

Spread light is averaged over footprints; points of light are drawn at their images.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.ends import SKY, Spherical
from kerrcaustics.beams.trace import cores
from kerrcaustics.results.stages import stage
from kerrcaustics.scenes.blur import SkyTurn
from kerrcaustics.scenes.colour import shifted_light
from kerrcaustics.scenes.footprint import Footprint, singular_values
from kerrcaustics.scenes.points import PointLights, displacements, draw_points
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky import Shifts, Sky, light_of_sky
from kerrcaustics.scenes.sky_cells import (
    PARTS,
    CellPlaces,
    Patches,
    SkyCells,
    covered_pixels,
    covering_cells,
    parts_of,
    turning,
)
from kerrcaustics.scenes.star_search import PictureImages, StarSearch
from kerrcaustics.scenes.unresolved_stars import faded_fraction, pixel_solid_angles
from kerrcaustics.shapes import Bool, Float, Float32, Int
from kerrcaustics.spacetime.frame import redshift
from kerrcaustics.spacetime.sphere import polar_basis
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Light = Float[Array, "h w 3"]

# Parts of pixels that a core lights at a time: they fit in its cache.
_TOGETHER = 1 << 15
# Longest motion of a footprint in a part of the exposure, pixels.
_LONGEST_SWEEP = 1.5
# Largest number of such parts.
_MOST_SWEEPS = 32
# Longest trace that is drawn at once, pixels: longer traces are drawn from two halves of the exposure.
_LONGEST_TRACE = 64.0
# Largest distance of such a trace from a straight line, pixels.
_STRAIGHT = 0.3
# Largest number of halvings of an exposure.
_HALVINGS = 4
# Images on a trace are no further apart than this part of a pixel.
_APART = 0.5


class Parts(NamedTuple):
    """Squares of a picture that see the sky.

    place: (m, 2) places of their middles, pixels.
    side: length of their sides, pixels.
    footprint: their footprints.
    share: part of the exposure in which they see the sky.
    """

    place: Array
    side: float
    footprint: Footprint
    share: float = 1.0


@stage("sky_light")
def sky_light(
    camera: Viewer,
    view: Raster,
    sky: Sky,
    cells: SkyCells,
    uncovered: list[Parts],
    search: Callable[[], StarSearch],
    shifts: Shifts,
    turn: SkyTurn,
    end: Spherical = SKY,
) -> Float[Array, "h w 3"]:
    """Linear light (h, w, 3) of a picture.

    uncovered: parts of the pixels that no cell covers.
    search: function that returns the search for images of stars.
    turn: turn of the sky during the exposure.
    end: the sphere with the sky.
    """
    light, count = np.zeros((view.height * view.width, 3), np.float32), parts_of(cells)
    covering, points = covering_cells(cells, view.shape), sky.points
    lighting = _Lighting(camera, view, end, sky, points, shifts)
    with ThreadPoolExecutor(cores()) as pool:
        patches = Patches(cells)
        for which, moments in _sweeps(cells, count == 1, turn):
            some = _split(covered_pixels(covering, which), _TOGETHER)
            for times in moments:
                moved = _MovedPatches.at_times(cells, patches, turn.spread, times)
                list(pool.map(partial(lighting.add, light, covering, moved), some))
        moment, _, extent = (float(part) for part in turn.weight.parts_about(0.0, 1.0))
        part_light = partial(lighting.part_light, motion=(turn.spread * moment, turn.spread * extent))
        lights = [pool.map(part_light, _chunks(uncovered))]
        for n in (2, PARTS):
            some = _split(covered_pixels(covering, count == n), _TOGETHER // n**2)
            lights.append(pool.map(lambda pixel, n=n: part_light(lighting.divided(patches, covering, pixel, n)), some))
        for pixel, values in chain(*lights):
            _add(light, pixel, values)
        light = light.reshape(view.height, view.width, 3)
        if points is not None and len(points.direction):
            _StarDrawing(camera, view, end, search(), shifts, turn, pool).draw(light, points)
    return light


class _Times(NamedTuple):
    """A part of an exposure.

    moment: mean moment, from -1/2 to 1/2.
    share: share of the light.
    spread: length of a box with its variance, in units of the exposure.
    """

    moment: float
    share: float
    spread: float


class _MovedPatches(NamedTuple):
    """Patches of cells in a part of an exposure.

    patches: the patches at its mean moment.
    rates: their change over the whole exposure; None if they stay.
    drift: angle by which spread light turns in the whole exposure, radians.
    times: the part of the exposure.
    """

    patches: Patches
    rates: Patches | None
    drift: float
    times: _Times

    @classmethod
    def at_times(cls, cells: SkyCells, patches: Patches, drift: float, times: _Times) -> "_MovedPatches":
        """The patches of some cells in a part of an exposure; patches: those in the middle of the exposure."""
        if not cells.moving:
            return cls(patches, None, drift, times)
        return cls(Patches(cells.at_moment(times.moment)), Patches(cells, cells.rates), drift, times)

    def swept(self, footprint: Footprint, places: CellPlaces) -> Footprint:
        """The footprints of squares, as they move over the sky."""
        if self.rates is None and not self.drift:
            return footprint
        motion = -self.drift * turning(footprint.direction)
        if self.rates is not None:
            motion += self.rates.values(places)
        return _swept(footprint, self.times.spread * motion).turned_by(-self.drift * self.times.moment)


def _sweeps(
    cells: SkyCells, which: Bool[Array, " n"], turn: SkyTurn
) -> Iterator[tuple[Bool[Array, " n"], list[_Times]]]:
    """Groups of cells, each with parts of the exposure so short that their footprints move little in one."""
    if not cells.moving and not turn.spread:
        yield which, [_Times(0.0, 1.0, 1.0)]
        return
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.nan_to_num(cells.pixels_moved(turn.spread) / _LONGEST_SWEEP, nan=1.0, posinf=_MOST_SWEEPS)
    sweeps = 2 ** np.ceil(np.log2(np.clip(ratio, 1, _MOST_SWEEPS))).astype(int)
    for count in np.unique(sweeps[which]).tolist():
        parts = np.stack(turn.weight.divided(count), axis=-1).tolist()
        times = [_Times(moment, light / count, spread) for moment, light, spread in parts]
        yield which & (sweeps == count), times


def _swept(footprint: Footprint, motion: Float[Array, "m 3"]) -> Footprint:
    """Footprints that move over the sky by (m, 3): covariances of both add up.

    A pixel's Gaussian has the deviation of half its footprint, and a straight path of length d that of d / sqrt 12.
    """
    path = np.stack([(axis * motion).sum(axis=1) for axis in polar_basis(footprint.direction)], axis=-1)
    along = singular_values(footprint.matrix)[2]
    across = np.stack([-np.sin(along), np.cos(along)], axis=-1) * footprint.bend[:, None]
    square = footprint.matrix @ np.swapaxes(footprint.matrix, 1, 2)
    for scale, vector in ((1.0, across), (1 / 3, path)):
        square = square + scale * vector[:, :, None] * vector[:, None, :]
    return replace(footprint, matrix=_root(square), bend=np.zeros(len(path)))


def _root(square: Float[Array, "m 2 2"]) -> Float[Array, "m 2 2"]:
    """Symmetric roots of positive matrices."""
    root = np.sqrt(np.maximum(np.linalg.det(square), 0))
    trace = np.trace(square, axis1=1, axis2=2)
    return (square + root[:, None, None] * np.eye(2)) / np.sqrt(np.maximum(trace + 2 * root, 1e-300))[:, None, None]


class _Lighting(NamedTuple):
    """The light of pixels without the points of light that they resolve.

    camera, view: the viewer and its picture.
    end: the sphere with the sky.
    sky: the sky.
    points: its points of light; None without any.
    shifts: shifts of light.
    """

    camera: Viewer
    view: Raster
    end: Spherical
    sky: Sky
    points: PointLights | None
    shifts: Shifts

    def add(
        self,
        light: Float[Array, "pixels 3"],
        covering: Int[Array, "h w"],
        moved: _MovedPatches,
        pixel: Int[Array, " m"],
    ) -> None:
        """Add the light of pixels that cells cover to a picture, for a part of the exposure."""
        places = CellPlaces.pixel_parts(pixel, covering, 1)
        footprint = self._footprint(moved.patches, places)
        stars = self._unresolved(places.x, places.y, footprint, 1.0)
        received = light_of_sky(self.sky, moved.swept(footprint, places), self.shifts) + stars
        _add(light, pixel, moved.times.share * received)

    def divided(self, patches: Patches, covering: Int[Array, "h w"], pixel: Int[Array, " m"], count: int) -> Parts:
        """The count x count parts of pixels that cells cover."""
        places = CellPlaces.pixel_parts(pixel, covering, count)
        return Parts(np.stack(places[:2], axis=-1), places.side, self._footprint(patches, places))

    def part_light(self, part: Parts, motion: tuple[float, float]) -> tuple[Int[Array, " m"], Float[Array, "m 3"]]:
        """Pixels (m,), and the light (m, 3) of their parts; motion: mean and extent of the turn of the sky, radians."""
        footprint = part.footprint
        stars = self._unresolved(part.place[:, 0], part.place[:, 1], footprint, part.side)
        mean, extent = motion
        if extent:
            footprint = _swept(footprint, extent * turning(footprint.direction)).turned_by(-mean)
        light = (light_of_sky(self.sky, footprint, self.shifts) + stars) * (part.share * part.side**2)
        x, y = np.round(part.place).astype(int).T
        pixel = y * self.view.width + x
        # Parts of a pixel are consecutive.
        first = np.flatnonzero(np.diff(pixel, prepend=-1))
        return pixel[first], np.add.reduceat(light, first, axis=0)

    def _footprint(self, patches: Patches, places: CellPlaces) -> Footprint:
        ratio = np.ones(len(places.x))
        footprint = patches.footprint(places, ratio)
        if any(self.shifts):
            sky = self.view.directions(places.x, places.y)[0]
            ratio[:] = frequency_ratios(self.camera, self.end, sky, footprint.direction[:, 2])
        return footprint

    def _unresolved(
        self, x: Float[Array, " m"], y: Float[Array, " m"], footprint: Footprint, side: float
    ) -> Float[Array, "m 3"] | float:
        """The light (m, 3) of stars that pixels do not resolve, if the sky has any, in parts of pixels with a side."""
        if self.points is None or not len(footprint):
            return 0.0
        light = np.zeros((len(footprint), 3))
        # An upper limit of the solid angle that a part sees: the square of the longest axis of its footprint.
        square = np.square(footprint.matrix.reshape(-1, 4)) @ np.ones(4)
        some = np.flatnonzero(square > side**2 * self.points.limits.min(initial=np.inf))
        if len(some):
            sky = self.view.directions(x[some], y[some])[0]
            major = singular_values(footprint.matrix[some])[0] / side
            solid_angles = pixel_solid_angles(self.camera, self.view.pixel_angle).values(major, sky)
            light[some] = self.points.mean_light(solid_angles, footprint.part(some), *self.shifts)
        return light


def frequency_ratios(
    camera: Viewer, end: Spherical, sky: Float[Array, "m 3"], cosine: Float[Array, " m"] | float
) -> Float[Array, " m"]:
    """nu_camera / nu_source (m,) in directions N of sources at rest on a sphere, at cosines of theta'."""
    ratio, emitter = redshift(camera.frame(), sky), end.emitter_motion()
    return ratio if emitter is None else ratio * np.sqrt(emitter(camera.spin, end.radius, cosine).slowness)


def _add(light: Float32[Array, "pixels 3"], pixel: Int[Array, " m"], values: Float[Array, "m 3"]) -> None:
    """Add values to different pixels."""
    some = np.take(light, pixel, axis=0)
    some += values
    # Whole pixels as items are three times as fast.
    item = np.dtype((np.void, 12))
    light.view(item)[pixel] = some.view(item)


def _split(pixel: Int[Array, " n"], together: int) -> list[Int[Array, " _m"]]:
    return np.split(pixel, range(together, len(pixel), together))


def _chunks(parts: list[Parts]) -> Iterator[Parts]:
    for part in parts:
        for start in range(0, len(part.place), _TOGETHER):
            piece = slice(start, start + _TOGETHER)
            yield part._replace(place=part.place[piece], footprint=part.footprint.part(piece))


class _StarDrawing(NamedTuple):
    """The drawing of points of light on a picture.

    camera, view: the viewer and its picture.
    end: the sphere with the sky.
    search: search for images of stars.
    shifts: shifts of light.
    turn: turn of the sky during the exposure.
    pool: threads of the search.
    """

    camera: Viewer
    view: Raster
    end: Spherical
    search: StarSearch
    shifts: Shifts
    turn: SkyTurn
    pool: ThreadPoolExecutor

    @stage("stars")
    def draw(self, light: Float[Array, "h w 3"], points: PointLights) -> None:
        """Add stars to a picture while they turn about the spin axis and cells move.

        Traces that are not straight are drawn from two halves of the exposure, and these from their halves.
        """
        angle = self.turn.points
        which, middle, share = np.arange(len(points.direction)), np.zeros(len(points.direction)), 1.0
        for halving in range(_HALVINGS + 1):
            some = points.some(which, angle * middle) if halving or angle else points
            images = self.search.images(some, middle, self.pool)
            trace, strays = _trace(images, some, angle, share)
            far = np.unique(images.star[strays]) if halving < _HALVINGS else np.zeros(0, int)
            straight = ~np.isin(images.star, far)
            when = middle[images.star][straight], share
            self._draw(light, images.part(straight), trace[straight], some, when)
            if not len(far):
                return
            middle = np.concatenate([middle[far] - share / 4, middle[far] + share / 4])
            which, share = np.tile(which[far], 2), share / 2

    def _draw(
        self,
        light: Light,
        images: PictureImages,
        trace: Float[Array, "m 2"],
        points: PointLights,
        when: tuple[Float[Array, " m"], float],
    ) -> None:
        """Draw images along their traces; when: the middles of the traces in the exposure, and their share of it."""
        middle, share = when
        if not len(images.star):
            return
        share_of_images = 1 - faded_fraction(images.solid_angles(self.camera, self.view), points.limits[images.star])
        power = points.flux[images.star] * (share * share_of_images * images.magnification)[:, None]
        if any(self.shifts):
            cosine = points.direction[images.star, 2]
            ratio = frequency_ratios(self.camera, self.end, self.view.directions(*images.place.T)[0], cosine)
            power *= shifted_light(ratio, *self.shifts, points.temperature[images.star], points.response)
        length = np.abs(trace).max(axis=1) / _APART
        doublings = np.ceil(np.log2(np.maximum(length, 1))).astype(int)
        for doubling in np.unique(doublings):
            same, count = doublings == doubling, 2 ** int(doubling)
            moment = ((np.arange(count) + 0.5) / count - 0.5)[:, None]
            part = self.turn.weight.parts_about(middle[same] + share * moment, share / count)
            along = ((part.moment - middle[same]) / share)[..., None]
            place = images.place[same] + along * trace[same]
            powers = part.light[..., None] * power[same] / count
            draw_points(light, self.view, place.reshape(-1, 2), powers.reshape(-1, 3))


def _trace(
    images: PictureImages, points: PointLights, angle: float, share: float
) -> tuple[Float[Array, "m 2"], Bool[Array, " m"]]:
    """Displacements (m, 2), in pixels, of images in a share of the exposure, and the mask of bent traces.

    angle: by which stars turn about the spin axis in all of it.
    """
    trace = displacements(images, share * (angle * turning(points.direction[images.star]) - images.rate[:, 0]))
    squares = np.stack([trace[:, 0] ** 2, 2 * trace[:, 0] * trace[:, 1], trace[:, 1] ** 2], axis=-1)
    # Second derivative of a place of constant n': that of the map along the trace, and twice that of its motion.
    bending = (squares[..., None] * images.curving).sum(axis=1)
    bending += 2 * share * (trace[..., None] * images.rate[:, 1:]).sum(axis=1)
    strayed = displacements(images, bending / 8)
    return trace, (np.abs(strayed).max(axis=1) > _STRAIGHT) | (np.abs(trace).max(axis=1) > _LONGEST_TRACE)
