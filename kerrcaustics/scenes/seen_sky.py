"""The visible sky of a view: the cells of its map, and the pixels that no cell covers, supersampled.

These pixels lie on the shadow edge, next to it, and where a pixel sees much of the sky. Each of their parts has a beam
of its own, and beams at several moments while the camera moves.
"""

import math
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from kerrcaustics.beams.ends import SKY, Sphere, Spherical
from kerrcaustics.beams.kernels.library import kernel
from kerrcaustics.beams.trace import beams_of_directions, cores
from kerrcaustics.results.stages import stage
from kerrcaustics.scenes.footprint import Footprint, rotated_about_axis, widest_aspect
from kerrcaustics.scenes.motion import ExposedMoment, Exposure
from kerrcaustics.scenes.quadtree import fill, in_chunks
from kerrcaustics.scenes.raster import Raster
from kerrcaustics.scenes.sky_cells import SkyCells
from kerrcaustics.scenes.sky_light import Parts, frequency_ratios
from kerrcaustics.scenes.sky_map import TOLERANCE, sky_map, slopes
from kerrcaustics.shapes import Bool, Float, Float32, Int
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.checks import differing_digits, quoted, real_number
from kerrcaustics.spacetime.shadow import shadow_edge
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Pixels that are supersampled together.
_CHUNK = 1 << 12
# Factor of the errors of a map at the checked places: elsewhere they were at most 1.1 times larger.
_CAUTION = 2.0
# Moments per pixel by which the shadow edge moves, while the camera moves.
_PER_PIXEL = 2.0
# Smallest number of these moments, odd.
_FEWEST = 3
# Largest number of these moments, odd.
_MOST = 15
# Parts of a pixel each way at each of these moments.
_SUPERSAMPLED = 2
_EDGE_POINTS = 360


class SeenSky(NamedTuple):
    """The visible sky of a view.

    cells: cells of the picture that see the sky.
    parts: parts of the other pixels that see it.
    visible_fraction: part (h, w) of each pixel that sees it.
    supersampled: number of supersampled pixels.
    beams: number of traced beams.
    error: largest error of the map, pixels.
    """

    cells: SkyCells
    parts: list[Parts]
    visible_fraction: Float32[Array, "h w"]
    supersampled: int
    beams: int
    error: float


def sky_end(viewer: Viewer, radius: float, rim: float = 0.0) -> Spherical:
    """The sphere with the sky; ValueError unless the viewer, and a disk with an outer rim, are within."""
    number = real_number("sky_radius", radius)
    if number == math.inf:
        return SKY
    if math.isinf(viewer.radius):
        raise ValueError(f"Argument `sky_radius` must be inf for an observer at infinity, but is {quoted(radius)}.")
    within = {
        "the radius of the camera": viewer.radius,
        "that of the outermost photon orbit": kerr.photon_orbits(viewer.spin)[1],
        "that of the disk's outer rim": rim,
    }
    what, least = max(within.items(), key=lambda item: item[1])
    if not number > least:
        shown, limit = differing_digits(number, least)
        shown = quoted(radius) if math.isnan(number) else shown
        raise ValueError(f"Argument `sky_radius` must be larger than {what}, {limit}, but is {shown}.")
    return Sphere(number)


@stage("sky_map")
def seen_sky(
    camera: Viewer,
    view: Raster,
    close: float,
    hidden: Bool[Array, "h w"],
    exposure: Exposure | None = None,
    end: Spherical = SKY,
) -> SeenSky:
    """Return the visible sky of a view; parameters as for `sky_map`."""
    mapped = sky_map(camera, view, close, hidden, exposure, end)
    visible_fraction, parts = np.zeros(hidden.shape, np.float32), []
    fill(visible_fraction, mapped.cells.x, mapped.cells.y, mapped.cells.size, 1)
    moments, counts, shares = [ExposedMoment(camera, view, 0.0, 0.0)], mapped.parts, [1.0]
    if exposure is not None:
        times = exposure.weight.divided(_moments(exposure))
        moments, shares = [exposure.moment_at(float(moment)) for moment in times.moment], times.light.tolist()
        counts = np.full(len(mapped.uncovered), _SUPERSAMPLED)
    beams = mapped.beams + len(moments) * int((counts**2).sum())
    chunks = [(mapped.uncovered[part], int(counts[part[0]])) for part in in_chunks(counts, lambda _: _CHUNK)]

    def supersample(chunk: tuple[Array, int]) -> list[tuple[Parts, Array]]:
        return [_supersampled_pixels(moment, end, *chunk) for moment in moments]

    with stage("shadow_edge"), ThreadPoolExecutor(cores()) as pool:
        supersampled = list(pool.map(supersample, chunks))
    for (which, _), results in zip(chunks, supersampled, strict=True):
        inside = np.isfinite([direction[..., 0] for _, direction in results])
        visible_fraction.flat[which] = (np.reshape(shares, (-1, 1, 1, 1)) * inside).mean(axis=(0, 2, 3))
        parts += [part._replace(share=share / len(moments)) for (part, _), share in zip(results, shares, strict=True)]
    # The smallest angle of the sky in a pixel.
    least = float((mapped.cells.extent / mapped.cells.size).min(initial=view.pixel_angle))
    error = max(_CAUTION * float(mapped.cells.error.max(initial=0.0)), TOLERANCE / least)
    return SeenSky(mapped.cells, parts, visible_fraction, len(mapped.uncovered), beams, error)


def _moments(exposure: Exposure) -> int:
    """Number of moments at which pixels that no cell covers are supersampled: by the motion of the shadow edge."""
    edges = [moment.view.pixels(shadow_edge(moment.camera, _EDGE_POINTS)) for moment in exposure.moments]
    moved = np.abs(edges[2] - edges[0]).max(axis=1)
    reach = np.max(moved[np.isfinite(moved)], initial=0.0)
    return 2 * int(np.clip(_PER_PIXEL * reach, _FEWEST, _MOST) / 2) + 1


def _supersampled_pixels(
    moment: ExposedMoment, end: Spherical, which: Int[Array, " pixels"], count: int
) -> tuple[Parts, Float[Array, "pixels h w 3"]]:
    """Parts of pixels that see the sky; n' of all of them, NaN where they do not."""
    camera, view, azimuth, _ = moment
    within = (np.arange(count) + 0.5) / count - 0.5
    y, x = (place[:, None, None] for place in np.divmod(which, view.width))
    x, y = np.broadcast_arrays(x + within, y + within[:, None])
    sky, steps = view.directions(x, y)
    beams = beams_of_directions(camera, sky, "auto", TOLERANCE, index=False, crossings=False, redshift=False, end=end)
    columns = slopes(beams, sky, steps) / count
    inside = np.isfinite(columns[..., 0, 0])
    direction = rotated_about_axis(np.where(inside[..., None], beams.direction, np.nan), azimuth)
    middle, tables = beams.direction[inside], [columns.reshape(-1, 6)]
    numbers, own = (count, widest_aspect(1 / count)), np.flatnonzero(inside)
    matrix, bend = kernel("part_footprint").on_rays(numbers, (middle, own), tables=tables)
    footprint = Footprint(middle, matrix, bend, frequency_ratios(camera, end, sky[inside], middle[:, 2]))
    place = np.stack([x[inside], y[inside]], axis=-1)
    return Parts(place, 1 / count, footprint.turned_by(azimuth)), direction
