"""All images of stars on a picture: by its cells where these resolve the map, by charts of the sky elsewhere.

A pixel next to the shadow edge sees all of the celestial sphere many times over, and one of a coarse picture much of
it: there images are looked for in charts (sky_charts.py), and drawn in the pixels in which they lie.
"""

import math
from collections.abc import Callable
from concurrent.futures import Executor
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.beam import Beams
from kerrcaustics.beams.ends import SKY, Spherical
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.lens_map.newton import find_roots
from kerrcaustics.scenes.coons_patches import CORNERS
from kerrcaustics.scenes.footprint import turned
from kerrcaustics.scenes.motion import Exposure
from kerrcaustics.scenes.points import CellSearch, Imaged, PointLights, moved, once
from kerrcaustics.scenes.quadtree import fill
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky_cells import SkyCells, resolved
from kerrcaustics.scenes.sky_charts import ROOT, CapChart, EdgeChart
from kerrcaustics.scenes.sky_map import TOLERANCE, Cut, chart_cells, ray_directions
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Picture = Float[Array, "h w"]

# Pixels that see more of the sky (radians) leave the search to the charts, and those of cells whose own pixels differ
# so much in size: at the poles of a projection.
_RESOLVED, _UNEVEN = 0.05, 0.25
# Charts are good to so much of one of their pixels, of a pixel of the picture, and at best; their cells see so much of
# the sky (radians) at most.
_CLOSE, _OF_PIXEL, _CLOSEST, _WIDE = 0.05, 0.1, 1e-4, 1.0
# Beside the shadow edge a strip, so wide for few stars and for many (parts of the shadow's size, and pixels), has their
# mean light. Many have it also within a wider strip where a pixel of the picture sees more of the sky (radians).
_FEW, _STRIPS, _BLENDED, _WIDER = 2000, {True: (3e-4, 0.05), False: (0.02, 1.5)}, 0.3, 0.05
# Cells of charts that are searched together: each may see much of the sky.
_AT_ONCE = 512
# Parts of a chart are searched by blocks of so many pixels, selected by samples so many of them apart.
_BLOCK, _SAMPLE = 4, 4
# Charts are searched so far into the pixels of cells (pixels), and to so many rows across the border of both charts:
# what is seen twice differs by less than this (pixels of the picture, radians), and is dropped.
_BESIDE, _ROWS, _SAME, _SAME_ANGLE = 0.25, 2.0, 0.3, 0.05
_EDGE_POINTS = 1440
# Images in charts are refined in so many steps at most.
_REFINEMENTS = 12
# Charts do not resolve longer traces (pixels) of a map that moves itself.
_LONGEST_IN_CHART = 8.0


class PictureImages(NamedTuple):
    """Images on a picture, or next to it: as `Imaged`, and directions N (m, 3), magnification (m,)."""

    place: Array
    star: Array
    area: Array
    steps: Array
    curving: Array
    rate: Array
    sky: Array
    magnification: Array

    def part(self, which: Array) -> "PictureImages":
        """The chosen images."""
        return PictureImages(*(part[which] for part in self))

    def merged_with(self, more: "PictureImages", angle: float) -> "PictureImages":
        """Add images, but for duplicates: of the same star and parity, and within an angle (radians)."""
        order = np.argsort(self.star, kind="stable")
        first, last = (np.searchsorted(self.star[order], more.star, side) for side in ("left", "right"))
        count = last - first
        new = np.repeat(np.arange(len(more.star)), count)
        old = order[np.arange(len(new)) - np.repeat(np.cumsum(count) - count, count) + first[new]]
        same = np.linalg.norm(self.sky[old] - more.sky[new], axis=1) < angle
        same &= np.vecdot(self._normals(old), more._normals(new)) >= 0
        fresh = np.ones(len(more.star), bool)
        fresh[new[same]] = False
        return PictureImages(*(np.concatenate(pair) for pair in zip(self, more.part(fresh), strict=True)))

    def _normals(self, which: Array) -> Float[Array, "m 3"]:
        return np.cross(self.steps[which, 0], self.steps[which, 1])


class StarSearch:
    """The search for images of stars on a picture, prepared once for all stars."""

    def __init__(
        self,
        camera: Viewer,
        view: Raster,
        cells: SkyCells,
        fraction: Picture,
        exposure: Exposure | None = None,
        end: Spherical = SKY,
    ) -> None:
        """fraction: visible part of each pixel; exposure: while the camera moves, if it does; end: with the stars."""
        self._camera, self._view, self._exposure, self._end = camera, view, exposure, end
        own = resolved(cells, _RESOLVED) & _even(view, cells)
        cells = SkyCells(*(part[own] for part in cells))
        self._uncovered = _uncovered(camera, view, cells, fraction)
        self._own = CellSearch(cells)
        # By whether the stars are few.
        self._charts_of: dict[bool, list[_SearchedChart]] = {}
        self._blended_of: dict[bool, tuple[Array, Array]] = {}

    def images(
        self, lights: PointLights, moment: Float[Array, " stars"], pool: Executor, count: int | None = None
    ) -> PictureImages:
        """All images on the picture, and next to it, of each star at a moment of the exposure, from -1/2 to 1/2.

        count: of the picture's stars, which sets how near to the shadow edge they are searched for; None: of these.
        """
        few = _few(lights, count)
        own = self._placed(self._own.images(lights, moment, pool))
        azimuth = 0.0 if self._exposure is None else self._exposure.middle.azimuth
        if azimuth:
            lights = lights.some(np.arange(len(lights.direction)), -azimuth)
        for chart in self._charts(few):
            images = chart.images(lights, self._view, self._is_uncovered, pool)
            if few:
                images = self._refined(images, lights)
            if azimuth:
                images = images._replace(steps=turned(images.steps, azimuth))
            if self._exposure is not None:
                images = self._moving(images, moment)
            own = own.merged_with(images, chart.same)
        return own

    def _placed(self, cell_images: Imaged) -> PictureImages:
        """Images in cells: those beyond a side of the picture that lie in it, too, belong there."""
        sky, steps = self._view.directions(*cell_images.place.T)
        magnification = _sizes(self._view, sky, steps) / cell_images.area
        images = PictureImages(*cell_images, sky, magnification)
        if not self._view.closed:
            return images
        place = self._view.pixels(sky)
        beyond = np.abs(place - cell_images.place).max(axis=1) > _BESIDE
        images = images._replace(place=place)
        return images.part(~beyond).merged_with(images.part(beyond), _SAME * self._view.pixel_angle)

    def blended(self, lights: PointLights) -> tuple[Float[Array, "n 2"], Float[Array, " n"]]:
        """Places (n, 2) on the picture of pieces of the viewer's sky beside the shadow edge that are not searched.

        Also the size (n,) of each, divided by 4 pi: the mean light there, relative to that of stars that may be
        anywhere.
        """
        few = _few(lights)
        if few not in self._blended_of:
            self._blended_of[few] = self._blended(few)
        return self._blended_of[few]

    def _blended(self, few: bool) -> tuple[Float[Array, "n 2"], Float[Array, " n"]]:
        pieces = [chart.blended(self._view.pixel_angle) for chart in self._charts(few)]
        sky, size = (np.concatenate(part) for part in zip((np.zeros((0, 3)), np.zeros(0)), *pieces, strict=True))
        place = self._view.pixels(sky)
        uncovered = self._is_uncovered(place)
        size = size * self._view.lengths(sky) ** 2
        return place[uncovered], size[uncovered] / (4 * math.pi)

    def _charts(self, few: bool) -> "list[_SearchedChart]":
        if few not in self._charts_of:
            self._charts_of[few] = self._make_charts(few) if self._uncovered.any() else []
        return self._charts_of[few]

    def _make_charts(self, few: bool) -> "list[_SearchedChart]":
        strip, pixels = _STRIPS[few]
        edge = EdgeChart(self._camera, strip, pixels * self._view.pixel_angle)
        most = math.inf if few else _BLENDED
        charts = [self._chart(edge, edge, _SAME * self._view.pixel_angle, most)]
        charts.append(self._chart(CapChart(self._camera, edge), edge, _SAME_ANGLE * edge.widest, most))
        return [chart for chart in charts if chart is not None]

    def _chart(self, plane: EdgeChart | CapChart, edge: EdgeChart, same: float, most: float) -> "_SearchedChart | None":
        pixels = self._chart_pixels(plane)
        if not pixels.any():
            return None
        close = float(np.clip(_OF_PIXEL * self._view.pixel_angle / plane.pixel, _CLOSEST, _CLOSE))
        cells = chart_cells(self._camera, plane, close, ~pixels, Cut(ROOT, _WIDE), self._end)
        if plane is edge:
            apart = _extent_in_pixels(plane, cells, self._view.pixel_angle) <= most
            apart |= cells.y + cells.size <= edge.row(_WIDER)
            rest = ~apart
        else:
            # Next to the edge cells of the cap would cover the sky many times over.
            apart, rest = _before(plane, edge, cells), np.zeros(len(cells.x), bool)
        searched, rest = (SkyCells(*(part[which] for part in cells)) for which in (apart, rest))
        return _SearchedChart(plane, edge, CellSearch(searched, _AT_ONCE), rest, same)

    def _chart_pixels(self, chart: EdgeChart | CapChart) -> Bool[Array, "h w"]:
        """Pixels of a chart in which uncovered ones of the picture lie: by samples of both."""
        x, y = (np.arange(_SAMPLE / 2 - 0.5, side, _SAMPLE) for side in (chart.width, chart.height))
        x, y = (part.ravel() for part in np.meshgrid(x, y))
        near = self._is_uncovered(self._view.pixels(chart.directions(x, y)[0]))
        places = chart.places(self._view.directions(*self._samples)[0])
        places = np.concatenate([np.stack([x, y], axis=-1)[near], places[np.isfinite(places).all(axis=1)]])
        block = np.floor((places + 0.5) / _BLOCK).astype(int)
        blocks = np.zeros((chart.height // _BLOCK, chart.width // _BLOCK), bool)
        inside = (block >= 0).all(axis=1) & (block[:, 0] < blocks.shape[1]) & (block[:, 1] < blocks.shape[0])
        blocks[block[inside, 1], block[inside, 0]] = True
        # A chart round the hole goes on across its side.
        blocks = _grown(np.pad(blocks, 1, mode="wrap"), 3)[1:-1, 1:-1]
        return np.kron(blocks, np.ones((_BLOCK, _BLOCK), bool))

    @cached_property
    def _samples(self) -> tuple[Array, Array]:
        """Places in the uncovered pixels: their middles, and their corners."""
        middle = np.nonzero(self._uncovered)
        corner = np.nonzero(_grown(np.pad(self._uncovered, (0, 1)), 2, -1))
        y, x = (np.concatenate([first - 1, second - 1.5]) for first, second in zip(middle, corner, strict=True))
        return x, y

    def _is_uncovered(self, place: Float[Array, "n 2"]) -> Bool[Array, " n"]:
        """True for places (n, 2) of the picture in pixels that no cell covers, or so close to one as errors."""
        height, width = self._uncovered.shape
        mask = np.zeros(len(place), bool)
        for step in _BESIDE * np.array([[0, 0], [-1, -1], [-1, 1], [1, -1], [1, 1]]):
            pixel = np.nan_to_num(np.round(place + 1 + step), nan=-1.0).astype(int)
            inside = (pixel >= 0).all(axis=1) & (pixel[:, 0] < width) & (pixel[:, 1] < height)
            mask[inside] |= self._uncovered[pixel[inside, 1], pixel[inside, 0]]
        return mask

    def _refined(self, images: PictureImages, lights: PointLights) -> PictureImages:
        """Refine images by the map itself: next to a critical curve the magnification in a chart is poor.

        Images stay as they are where the map has none close by, on the same side of the critical curve.
        """
        index = np.asarray(self._beams(images.sky).index)
        star, pixel = lights.direction[images.star], self._view.directions(*images.place.T)[1]
        turns = _handed(images.steps[:, 0], images.steps[:, 1], star)
        parity = np.sign(turns * _handed(pixel[..., 0], pixel[..., 1], images.sky))
        same = np.flatnonzero(parity == 1 - 2 * (index % 2))
        which, sky, _ = find_roots(self._camera, star[same], index[same], images.sky[same], _REFINEMENTS, end=self._end)
        near = np.linalg.norm(sky - images.sky[same[which]], axis=1) < _SAME * self._view.pixel_angle
        which, sky = same[which[near]], sky[near]
        magnification = self._beams(sky).magnification
        better = PictureImages(*(part.copy() for part in images))
        better.place[which], better.sky[which] = self._view.pixels(sky), sky
        better.area[which] *= images.magnification[which] / magnification
        better.magnification[which] = magnification
        return better

    def _beams(self, sky: Float[Array, "n 3"]) -> Beams:
        """Beams as the viewer has them on its own sky."""
        places, options = self._camera.places(sky), {"crossings": False, "redshift": False}
        return trace_beams(self._camera, places, "auto", TOLERANCE, **options, end=self._end)

    def _moving(self, images: PictureImages, moment: Float[Array, " stars"]) -> PictureImages:
        """Move images to moments of their own; none moves farther than the chart resolves."""
        assert self._exposure is not None
        x, y = images.place.T
        moments = self._exposure.first, self._exposure.last
        first, last = (ray_directions(one, x, y, self._end) for one in moments)
        rate = np.zeros_like(images.rate)
        rate[:, 0] = np.nan_to_num(last - first)
        trace = moved(images, -rate[:, 0])
        slower = np.minimum(1, _LONGEST_IN_CHART / np.maximum(np.abs(trace).max(axis=1), 1e-300))[:, None]
        place = images.place + moment[images.star, None] * slower * trace
        sky, _ = self._view.directions(*place.T)
        return images._replace(place=place, rate=rate * slower[..., None], sky=sky)


class _SearchedChart(NamedTuple):
    """A chart, and that of the shadow edge; the search in its cells; the cells that are not searched.

    same: angle within which images are the same.
    """

    plane: EdgeChart | CapChart
    edge: EdgeChart
    search: CellSearch
    rest: SkyCells
    same: float

    def blended(self, pixel: float) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Directions N (n, 3) of pieces of the sky that are not searched, and their solid angles (n,).

        pixel: angle that pieces are no longer than, wherever that is.
        """
        half = (self.rest.size - 1) / 2
        _, steps = self.plane.directions(self.rest.x + half, self.rest.y + half)
        parts = np.maximum(np.ceil(np.linalg.norm(steps, axis=1) * self.rest.size[:, None] / pixel), 1).astype(int)
        cell, at = _subdivisions(parts)
        size = self.rest.size[cell, None] / parts[cell]
        place = np.stack([self.rest.x, self.rest.y], axis=-1)[cell] - 0.5 + (at + 0.5) * size
        sky, steps = self.plane.directions(*place.T)
        area = np.linalg.norm(np.cross(steps[..., 0], steps[..., 1]), axis=-1) * size.prod(axis=1)
        if self.plane is not self.edge:
            return sky, area
        strip, width = self.edge.strip(pixel)
        return np.concatenate([sky, strip]), np.concatenate([area, width])

    def images(
        self, lights: PointLights, view: Raster, accepts: Callable[[Array], Array], pool: Executor
    ) -> PictureImages:
        """Images as a picture shows them, at places that are accepted."""
        points = self.search.images(lights, np.zeros(len(lights.direction)), pool)
        if self.plane is self.edge:
            points = _round_once(points, self.plane.width)
        accepted = accepts(view.pixels(self.plane.directions(*points.place.T)[0]))
        points = Imaged(*(part[accepted] for part in points))
        sky, chart_steps = self.plane.directions(*points.place.T)
        place = view.pixels(sky)
        _, steps = view.directions(*place.T)
        magnification = _sizes(view, sky, chart_steps) / points.area
        # Steps of the picture in those of the chart.
        matrix = np.linalg.pinv(chart_steps) @ steps
        moving = np.swapaxes(matrix, 1, 2) @ points.steps
        area = _sizes(view, sky, steps) / magnification
        # Pixels are so large before what a chart sees that neither curving nor rate would hold over one.
        unknown = np.zeros_like(points.curving), np.zeros_like(points.rate)
        images = PictureImages(place, points.star, area, moving, *unknown, sky, magnification)
        return images if self.plane is self.edge else images.part(self.edge.places(sky)[:, 1] < _ROWS)


def _few(lights: PointLights, count: int | None = None) -> bool:
    return (len(lights.direction) if count is None else count) <= _FEW


def _before(cap: EdgeChart | CapChart, edge: EdgeChart, cells: SkyCells) -> Bool[Array, " n"]:
    """True for cells (n,) of the cap that reach over the border to the other chart from without."""
    corners = [(cells.x + i * cells.size - 0.5, cells.y + j * cells.size - 0.5) for i, j in CORNERS]
    rows = [edge.places(cap.directions(*corner)[0])[:, 1] for corner in corners]
    return np.asarray(np.min(rows, axis=0) < _ROWS)


def _subdivisions(parts: Int[Array, "cells 2"]) -> tuple[Int[Array, " n"], Int[Array, "n 2"]]:
    """The cell (n,) of each part of cells that are divided both ways, and its place among the parts (n, 2)."""
    count = parts.prod(axis=1)
    cell = np.repeat(np.arange(len(parts)), count)
    number = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    return cell, np.stack(np.divmod(number, parts[cell, 1]), axis=-1)


def _handed(first: Float[Array, "n 3"], second: Float[Array, "n 3"], way: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """Positive where two steps beside a direction turn counter-clockwise, as seen from ahead."""
    return np.asarray(np.vecdot(np.cross(first, second), way))


def _extent_in_pixels(plane: EdgeChart | CapChart, cells: SkyCells, pixel: float) -> Float[Array, " n"]:
    """Radians of the celestial sphere (n,) that pixels of some angle see in cells of a chart, from row to row."""
    half = (cells.size - 1) / 2
    steps = plane.directions(cells.x + half, cells.y + half)[1][..., 1]
    extent = np.linalg.norm(cells.data[:, 8:], axis=-1).mean(axis=1) / cells.size
    return np.asarray(pixel * extent / np.linalg.norm(steps, axis=-1))


def _round_once(images: Imaged, width: int) -> Imaged:
    """Images on a chart that closes on itself, those at its sides once."""
    x = (images.place[:, 0] + 0.5) % width
    x = np.where(x > width - 0.5, x - width, x) - 0.5
    return once(images._replace(place=np.stack([x, images.place[:, 1]], axis=-1)))


def _even(view: Raster, cells: SkyCells) -> Bool[Array, " n"]:
    """True for cells (n,) whose corners have pixels of about one size."""
    if view.even:
        return np.ones(len(cells.x), bool)
    sizes = []
    for i, j in CORNERS:
        sizes.append(_sizes(view, *view.directions(cells.x + i * cells.size - 0.5, cells.y + j * cells.size - 0.5)))
    return np.asarray(np.min(sizes, axis=0) > _UNEVEN * np.max(sizes, axis=0))


def _sizes(view: Raster, sky: Float[Array, "n 3"], steps: Float[Array, "n 3 2"]) -> Float[Array, " n"]:
    """Sizes (n,) on the viewer's own sky of what lies between steps beside directions."""
    return view.solid_angle(steps) * view.lengths(sky) ** 2


def _grown(mask: Bool[Array, "h w"], width: int, origin: int = 0) -> Bool[Array, "h w"]:
    """True where a square about a pixel, so wide and moved by the origin, holds one that is True."""
    from scipy.ndimage import binary_dilation

    return binary_dilation(mask, np.ones((width, width)), origin=origin)


def _uncovered(camera: Viewer, view: Raster, cells: SkyCells, fraction: Picture) -> Bool[Array, "h+2 w+2"]:
    """Pixels, and those beside the picture, that cells do not cover and that may see the sky."""
    near = _grown(np.pad(fraction > 0, 1, mode="edge"), 3)
    edge = np.round(view.pixels(shadow_edge(camera, _EDGE_POINTS)) + 1)
    edge = edge[np.isfinite(edge).all(axis=1)].astype(int)
    inside = (edge >= 0).all(axis=1) & (edge[:, 0] < near.shape[1]) & (edge[:, 1] < near.shape[0])
    near[edge[inside, 1], edge[inside, 0]] = True
    fill(near, cells.x + 1, cells.y + 1, cells.size, False)
    return near
