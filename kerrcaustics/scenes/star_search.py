"""All images of stars on a picture: by its cells where these resolve the map, by charts of the sky elsewhere.

A pixel next to the shadow edge sees the whole celestial sphere many times over, and a pixel of a coarse picture much of
it: images there are searched for in charts (sky_charts.py), and drawn in the pixels in which they lie.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.ends import SKY, Spherical
from kerrcaustics.beams.trace import beams_of_directions
from kerrcaustics.scenes.cell_search import NEAREST, CellSearch, areas
from kerrcaustics.scenes.coons_patches import CORNERS
from kerrcaustics.scenes.footprint import inverse, longest, rotated_about_axis
from kerrcaustics.scenes.motion import Exposure
from kerrcaustics.scenes.points import Imaged, PointLights, displacements, distinct, steps_to
from kerrcaustics.scenes.quadtree import fill
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky_cells import SkyCells, resolved
from kerrcaustics.scenes.sky_charts import ROOT, CapChart, EdgeChart
from kerrcaustics.scenes.sky_map import TOLERANCE, Cut, chart_cells, ray_directions, slopes
from kerrcaustics.scenes.unresolved_stars import BRIGHTEST, pixel_solid_angles
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray
Picture = Float[Array, "h w"]

# Angle (radians) of the sky above which the charts take over the search in a pixel.
_RESOLVED = 0.05
# Ratio of the sizes of a cell's pixels below which the charts take over, as at the poles of a projection.
_UNEVEN = 0.25
# Largest error of the charts, pixels of the chart.
_CLOSE = 0.05
# Largest angle (radians) of the sky that a cell of a chart sees.
_WIDE = 1.0
# Width of the strip beside the shadow edge without charts, as a part of the shadow's size.
_STRIP = 3e-4
# Largest width of this strip, pixels of the picture.
_OF_STRIP = 0.01
# Side of the blocks in which charts are searched, pixels of the chart.
_BLOCK = 4
# Distance of the samples that select the blocks, pixels of the chart.
_SAMPLE = 4
# Margin by which charts are searched within pixels that cells cover, pixels of the picture.
_BESIDE = 0.25
# Rows of the edge chart beyond the border of both charts that are searched.
_ROWS = 2.0
# Distance below which images of both searches are one, pixels of the picture.
_SAME = 0.3
# The same for images in the cap chart, as a part of its widest angle.
_SAME_ANGLE = 0.05
# Points of the shadow edge, which no cell covers.
_EDGE_POINTS = 1440
# Newton steps by beams that refine images in charts.
_REFINEMENTS = 6
# Largest displacement by the refinement, pixels of the chart.
_LONGEST_MOVE = 0.5
# Length of the last Newton step below which a refinement has converged, pixels of the chart.
_MOVED_LAST = 0.02
# Margin of the search in neighbouring cells, cells: next to a critical curve small errors displace images far.
_OVER = 0.1
# Factor of the distance from a critical curve at which the brightness of refined images is cut.
_CLOSER = 0.02
# Longest trace, pixels of the picture, that charts resolve while the camera moves.
_LONGEST_IN_CHART = 8.0


class PictureImages(NamedTuple):
    """Images of stars on a picture, or next to it.

    place, star, area, steps, curving, rate: as of `Imaged`.
    sky: (m, 3) directions N.
    magnification: (m,) magnifications.
    """

    place: Array
    star: Array
    area: Array
    steps: Array
    curving: Array
    rate: Array
    sky: Array
    magnification: Array

    def solid_angles(self, camera: Viewer, view: Raster) -> Float[Array, " m"]:
        """The solid angles (m,) that pixels of the picture see about them."""
        return pixel_solid_angles(camera, view.pixel_angle).values(
            longest(self.steps[:, 0], self.steps[:, 1]), self.sky
        )

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
        same &= np.vecdot(_normals(self.steps[old]), _normals(more.steps[new])) >= 0
        fresh = np.ones(len(more.star), bool)
        fresh[new[same]] = False
        return PictureImages(*(np.concatenate(pair) for pair in zip(self, more.part(fresh), strict=True)))


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
        """fraction: visible part of each pixel; exposure: given if the camera moves; end: sphere with the stars."""
        self._camera, self._view, self._exposure, self._end = camera, view, exposure, end
        own = resolved(cells, _RESOLVED) & _even(view, cells)
        cells = SkyCells(*(part[own] for part in cells))
        self._uncovered = _uncovered(camera, view, cells, fraction)
        self._own = CellSearch(cells)
        self._charts: dict[float, list[_SearchedChart]] = {}

    def images(self, lights: PointLights, moment: Float[Array, " stars"], pool: Executor) -> PictureImages:
        """Images on the picture, and next to it, of each star at a moment of the exposure, from -1/2 to 1/2.

        Images that have faded away (unresolved_stars.py) are left out.
        """
        own = self._placed(self._own.images(lights, moment, pool))
        if not self._uncovered.any():
            return own
        azimuth = 0.0 if self._exposure is None else self._exposure.middle.azimuth
        if azimuth:
            lights = lights.some(np.arange(len(lights.direction)), -azimuth)
        for chart in self._charts_for(max(float(lights.limits.max()), BRIGHTEST)):
            images = chart.images(self._camera, lights, self._view, self._is_uncovered, pool)
            if azimuth:
                images = images._replace(steps=rotated_about_axis(images.steps, azimuth))
            if self._exposure is not None:
                images = self._moving(images, moment)
            own = own.merged_with(images, chart.same)
        return own

    def _placed(self, cell_images: Imaged) -> PictureImages:
        """Images in cells; those beyond a side of a closed picture move to their place in it."""
        sky, _ = self._view.directions(*cell_images.place.T)
        magnification = self._view.pixel_sizes(*cell_images.place.T) / cell_images.area
        images = PictureImages(*cell_images[:-1], sky, magnification)
        if not self._view.closed:
            return images
        place = self._view.pixels(sky)
        beyond = np.abs(place - cell_images.place).max(axis=1) > _BESIDE
        images = images._replace(place=place)
        return images.part(~beyond).merged_with(images.part(beyond), _SAME * self._view.pixel_angle)

    def _charts_for(self, limit: float) -> "list[_SearchedChart]":
        """The charts of the parts of the sky in which images are searched; limit: that of the stars that fade last."""
        if limit not in self._charts:
            edge = EdgeChart(self._camera, _STRIP, _OF_STRIP * self._view.pixel_angle)
            cap = CapChart(self._camera, edge)
            charts = (
                self._chart(edge, edge, _SAME * self._view.pixel_angle, limit),
                self._chart(cap, edge, _SAME_ANGLE * edge.widest, limit),
            )
            self._charts[limit] = [chart for chart in charts if chart is not None]
        return self._charts[limit]

    def _chart(
        self, plane: EdgeChart | CapChart, edge: EdgeChart, same: float, limit: float
    ) -> "_SearchedChart | None":
        pixels = self._chart_pixels(plane, limit)
        if not pixels.any():
            return None
        nearest = NEAREST * min(self._view.pixel_angle / plane.pixel, 1.0)
        cells = chart_cells(self._camera, plane, _CLOSE, ~pixels, Cut(ROOT, _WIDE), self._end)
        if plane is not edge:
            # Next to the edge, cells of the cap would cover the sky many times over.
            outside = _outside_border(plane, edge, cells)
            cells = SkyCells(*(part[outside] for part in cells))
        least = _least_seen(self._camera, self._view, plane, cells)
        return _SearchedChart(plane, edge, self._end, CellSearch(cells, nearest, _OVER), least, nearest, same)

    def _chart_pixels(self, chart: EdgeChart | CapChart, limit: float) -> Bool[Array, "h w"]:
        """Pixels of a chart that contain uncovered pixels of the picture, from samples of both."""
        x, y = (np.arange(_SAMPLE / 2 - 0.5, side, _SAMPLE) for side in (chart.width, chart.height))
        x, y = (part.ravel() for part in np.meshgrid(x, y))
        near = self._is_uncovered(self._view.pixels(chart.directions(x, y)[0]))
        places = chart.places(self._view.directions(*self._samples)[0])
        places = np.concatenate([np.stack([x, y], axis=-1)[near], places[np.isfinite(places).all(axis=1)]])
        block = np.floor((places + 0.5) / _BLOCK).astype(int)
        blocks = np.zeros((chart.height // _BLOCK, chart.width // _BLOCK), bool)
        inside = (block >= 0).all(axis=1) & (block[:, 0] < blocks.shape[1]) & (block[:, 1] < blocks.shape[0])
        blocks[block[inside, 1], block[inside, 0]] = True
        # A chart round the hole is periodic across its sides.
        blocks = _grown(np.pad(blocks, 1, mode="wrap"), 1, 1)[1:-1, 1:-1]
        if isinstance(chart, EdgeChart):
            row, column = np.nonzero(blocks)
            angle, distance = chart.distance(_BLOCK * (column + 0.5) - 0.5, _BLOCK * (row + 0.5) - 0.5)
            least = pixel_solid_angles(self._camera, self._view.pixel_angle).nearest(angle, limit)
            blocks[row, column] = distance > least
        return np.kron(blocks, np.ones((_BLOCK, _BLOCK), bool))

    @cached_property
    def _samples(self) -> tuple[Array, Array]:
        """Places in the uncovered pixels: their middles, and their corners."""
        middle = np.nonzero(self._uncovered)
        corner = np.nonzero(_grown(np.pad(self._uncovered, (0, 1)), 0, 1))
        y, x = (np.concatenate([first - 1, second - 1.5]) for first, second in zip(middle, corner, strict=True))
        return x, y

    def _is_uncovered(self, place: Float[Array, "n 2"]) -> Bool[Array, " n"]:
        """True for places (n, 2) of the picture in pixels that no cell covers, or within a margin of such pixels."""
        height, width = self._uncovered.shape
        mask = np.zeros(len(place), bool)
        for step in _BESIDE * np.array([[0, 0], [-1, -1], [-1, 1], [1, -1], [1, 1]]):
            x, y = (np.nan_to_num(np.round(along + 1 + by), nan=-1.0) for along, by in zip(place.T, step, strict=True))
            inside = np.flatnonzero((x >= 0) & (y >= 0) & (x < width) & (y < height))
            mask[inside] |= self._uncovered[y[inside].astype(int), x[inside].astype(int)]
        return mask

    def _moving(self, images: PictureImages, moment: Float[Array, " stars"]) -> PictureImages:
        """Images moved to moments of their own, no farther than the chart resolves."""
        assert self._exposure is not None
        x, y = images.place.T
        moments = self._exposure.first, self._exposure.last
        first, last = (ray_directions(end, x, y, self._end) for end in moments)
        rate = np.zeros_like(images.rate)
        rate[:, 0] = np.nan_to_num(last - first)
        trace = displacements(images, -rate[:, 0])
        slower = np.minimum(1, _LONGEST_IN_CHART / np.maximum(np.abs(trace).max(axis=1), 1e-300))[:, None]
        place = images.place + moment[images.star, None] * slower * trace
        sky, _ = self._view.directions(*place.T)
        return images._replace(place=place, rate=rate * slower[..., None], sky=sky)


class _SearchedChart(NamedTuple):
    """A chart in which images are searched.

    plane: the chart.
    edge: the chart of the shadow edge.
    end: the sphere with the stars.
    search: search in the cells of the chart.
    least: (n,) smallest solid angles that pixels of the picture see in the cells.
    nearest: distance from a critical curve at which the brightness is cut, pixels of the chart.
    same: angle below which images are one, radians.
    """

    plane: EdgeChart | CapChart
    edge: EdgeChart
    end: Spherical
    search: CellSearch
    least: Array
    nearest: float
    same: float

    def _refined(self, camera: Viewer, points: Imaged, lights: PointLights) -> Imaged:
        """Images refined by beams; images without a refined place of the same parity stay."""
        place, target, length = points.place.copy(), lights.direction[points.star], np.full(len(points.star), np.inf)
        for _ in range(_REFINEMENTS):
            unsolved = np.flatnonzero(length > _MOVED_LAST)
            value, columns = self._beams(camera, place[unsolved])
            move = steps_to(columns, target[unsolved] - value)
            length[unsolved] = np.sqrt((move**2).sum(axis=1))
            place[unsolved] += move * np.minimum(1, _LONGEST_MOVE / np.maximum(length[unsolved], 1e-300))[:, None]
        columns = self._beams(camera, place)[1]
        same = (np.vecdot(_normals(columns), target) > 0) == points.positive
        better = same & (length < _MOVED_LAST) & (np.abs(place - points.place).max(axis=1) < _LONGEST_MOVE)
        steps = np.where(better[:, None, None], columns, points.steps)
        area = np.where(better, areas(steps, points.curving, _CLOSER * self.nearest), points.area)
        return points._replace(place=np.where(better[:, None], place, points.place), steps=steps, area=area)

    def _beams(self, camera: Viewer, place: Float[Array, "m 2"]) -> tuple[Float[Array, "m 3"], Float[Array, "m 2 3"]]:
        """n' and its steps, by beams."""
        sky, steps = self.plane.directions(*place.T)
        options = {"index": False, "crossings": False, "redshift": False}
        beams = beams_of_directions(camera, sky, "auto", TOLERANCE, **options, end=self.end)
        return beams.direction, np.swapaxes(slopes(beams, sky, steps), 1, 2)

    def images(
        self, camera: Viewer, lights: PointLights, view: Raster, accepts: Callable[[Array], Array], pool: Executor
    ) -> PictureImages:
        """Images on a picture, at accepted places."""
        points = self.search.images(lights, np.zeros(len(lights.direction)), pool, self.least)
        points = self._refined(camera, points, lights)
        if self.plane is self.edge:
            points = _wrapped(points, self.plane.width)
        points = points.part(distinct(points.star, points.place, points.positive))
        sky, chart_steps = self.plane.directions(*points.place.T)
        place = view.pixels(sky)
        accepted = np.flatnonzero(accepts(place))
        points = points.part(accepted)
        sky, chart_steps, place = sky[accepted], chart_steps[accepted], place[accepted]
        magnification = view.solid_angle(chart_steps) * view.lengths(sky) ** 2 / points.area
        moving = _converted(chart_steps, points.steps, view.directions(*place.T)[1])
        area = view.pixel_sizes(*place.T) / magnification
        # A pixel sees too much of the chart for second derivatives and rates to be meaningful.
        unknown = np.zeros_like(points.curving), np.zeros_like(points.rate)
        images = PictureImages(place, points.star, area, moving, *unknown, sky, magnification)
        return images if self.plane is self.edge else images.part(self.edge.places(sky)[:, 1] < _ROWS)


def _outside_border(cap: EdgeChart | CapChart, edge: EdgeChart, cells: SkyCells) -> Bool[Array, " n"]:
    """True for cells (n,) of the cap that reach beyond the border to the edge chart."""
    corners = [(cells.x + i * cells.size - 0.5, cells.y + j * cells.size - 0.5) for i, j in CORNERS]
    rows = [edge.places(cap.directions(*corner)[0])[:, 1] for corner in corners]
    return np.asarray(np.min(rows, axis=0) < _ROWS)


def _normals(steps: Float[Array, "m 2 3"]) -> Float[Array, "m 3"]:
    return np.cross(steps[:, 0], steps[:, 1])


def _least_seen(camera: Viewer, view: Raster, plane: EdgeChart | CapChart, cells: SkyCells) -> Float[Array, " n"]:
    """The smallest solid angle (n,) that pixels of a picture see at the corners of cells of a chart."""
    corner_angles = []
    for corner, (i, j) in enumerate(CORNERS):
        sky, chart_steps = plane.directions(cells.x + i * cells.size - 0.5, cells.y + j * cells.size - 0.5)
        columns = cells.data[:, [4 + corner, 8 + corner]] / cells.size[:, None, None]
        # Outside the projection of the picture the limit is 0.
        solid_angles, place = np.zeros(len(sky)), view.pixels(sky)
        projected = np.flatnonzero(np.isfinite(place).all(axis=1))
        steps = _converted(chart_steps[projected], columns[projected], view.directions(*place[projected].T)[1])
        solid_angles[projected] = pixel_solid_angles(camera, view.pixel_angle).values(
            longest(steps[:, 0], steps[:, 1]), sky[projected]
        )
        corner_angles.append(solid_angles)
    return np.nan_to_num(np.min(corner_angles, axis=0), nan=0.0)


def _converted(
    chart_steps: Float[Array, "n 3 2"], columns: Float[Array, "n 2 3"], steps: Float[Array, "n 3 2"]
) -> Float[Array, "n 2 3"]:
    """Steps of n' for pixels of a picture, from those for pixels of a chart; by both steps on the viewer's sky."""
    return np.swapaxes(inverse(*np.moveaxis(chart_steps, -1, 0)) @ steps, 1, 2) @ columns


def _wrapped(images: Imaged, width: int) -> Imaged:
    """Images on a periodic chart, with places at both sides made equal."""
    x = (images.place[:, 0] + 0.5) % width
    x = np.where(x > width - 0.5, x - width, x) - 0.5
    return images._replace(place=np.stack([x, images.place[:, 1]], axis=-1))


def _even(view: Raster, cells: SkyCells) -> Bool[Array, " n"]:
    """True for cells (n,) whose corners have pixels of similar size."""
    if view.even:
        return np.ones(len(cells.x), bool)
    sizes = [view.pixel_sizes(cells.x + i * cells.size - 0.5, cells.y + j * cells.size - 0.5) for i, j in CORNERS]
    return np.asarray(np.min(sizes, axis=0) > _UNEVEN * np.max(sizes, axis=0))


def _grown(mask: Bool[Array, "h w"], before: int, after: int) -> Bool[Array, "h w"]:
    """The mask extended along both axes by `before` pixels toward 0 and `after` pixels away from it."""
    for _ in range(2):
        wide, rows = np.pad(mask, ((after, before), (0, 0))), len(mask)
        mask = np.logical_or.reduce([wide[k : k + rows] for k in range(before + after + 1)]).T
    return mask


def _uncovered(camera: Viewer, view: Raster, cells: SkyCells, fraction: Picture) -> Bool[Array, "h+2 w+2"]:
    """True for pixels, with a margin of one, that no cell covers and that may see the sky."""
    near = _grown(np.pad(fraction > 0, 1, mode="edge"), 1, 1)
    edge = np.round(view.pixels(shadow_edge(camera, _EDGE_POINTS)) + 1)
    edge = edge[np.isfinite(edge).all(axis=1)].astype(int)
    inside = (edge >= 0).all(axis=1) & (edge[:, 0] < near.shape[1]) & (edge[:, 1] < near.shape[0])
    near[edge[inside, 1], edge[inside, 0]] = True
    fill(near, cells.x + 1, cells.y + 1, cells.size, False)
    return near
