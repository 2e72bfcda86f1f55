"""The images of a uniform disc on any surface, with a certificate.

Their boundaries are contours on charts in which the map is smooth: the limb of the disc, the rim, where both arrivals
at a sphere meet, and the last critical curve.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from kerrcaustics.beams.ends import End
from kerrcaustics.curves.critical_curves import CriticalCurves
from kerrcaustics.extended_sources.arcs.area import (
    Weight,
    closed,
    flat_from_hole,
    turns_about,
    winding,
)
from kerrcaustics.extended_sources.arcs.boundary_arcs import with_ends
from kerrcaustics.extended_sources.arcs.image_areas import AREA_TOLERANCE, DiscImages, summed
from kerrcaustics.extended_sources.charts.chart_arcs import LIMB, ChartArcs, arcs_along, extremes, rim_arcs
from kerrcaustics.extended_sources.charts.charts import Disc, DiscChart, charts_in_plane, charts_on_sphere
from kerrcaustics.extended_sources.charts.contours import contours
from kerrcaustics.extended_sources.sheets.nearby_caustics import curves_near
from kerrcaustics.images.certificates import certificate_of
from kerrcaustics.images.circle_arcs import arcs_of
from kerrcaustics.images.sheets import bounding_curves
from kerrcaustics.lens_map.domains import Ring, leaves_of, ring_of
from kerrcaustics.lens_map.search_sky import search_camera, search_sky
from kerrcaustics.results.progress import in_steps
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.frame import sky_from_line_of_sight
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import angle_between, from_angles
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Places in the disc whose images are checked: distances from the centre, radii.
_INSIDE = np.array([0.0, 0.35, -0.35, 0.7, -0.7])
# Places beside the disc whose images are checked: distances from the centre, radii.
_BESIDE_IT = np.array([1.2, -1.2, 1.5, -1.5])
# Circles about the hole, in the plane, that hold such places: distances from the centre, radii.
_CIRCLES = np.array([0.0, 0.6, -0.6])
# Distance from the limb within which a place is not checked, radii.
_MARGIN = 0.02
# Most points of critical curves that are checked on each side of the limb.
_MOST_POINTS = 80
# Largest difference of a winding number from a whole number.
_ROUND = 1e-3


@dataclass(frozen=True)
class _Witnesses(Rows):
    """Directions of light from known places.

    sky: Directions on the search sky.
    inside: True if the place lies within the disc.
    second_arrival: True for second arrivals at a sphere.
    """

    sky: Float[Array, "n 3"]
    inside: Bool[Array, " n"]
    second_arrival: Bool[Array, " n"]


def disc_images_on_charts(
    viewer: Viewer,
    surface: End,
    centre: Float[Array, " axes"],
    size: float,
    max_index: int,
    weight: Weight | None = None,
    *,
    nested: bool = False,
    tolerance: float = AREA_TOLERANCE,
) -> DiscImages:
    """The images of a disc; parameters as for `disc_images`."""
    disc = Disc(surface, centre, size)
    charts, curves = _charts(viewer, disc, max_index)
    parts, doubts, faults = [], [], []
    for chart in in_steps("part of the sky", charts):
        outline = contours(chart)
        arcs = arcs_along(chart, outline, tolerance)
        first = 1 + max(arcs.last_node, outline.last_node)
        parts.append(arcs.joined(rim_arcs(chart, outline, first)))
        faults += outline.remarks
        if doubtful := int(arcs.doubtful.sum()):
            doubts.append(f"{doubtful} arcs of the boundary are in doubt")
    camera = search_camera(viewer)
    witnesses, unsure = _witnesses(viewer, disc, max_index, curves, _CIRCLES[: 1 if nested else None])
    faults += [*unsure, *_checked(camera, charts, parts, max_index, witnesses)]
    whole = _summed(viewer, disc, max_index, parts, weight)
    return whole.with_remarks(doubts, faults)


def _charts(viewer: Viewer, disc: Disc, max_index: int) -> tuple[list[DiscChart], CriticalCurves | None]:
    """The charts of a disc, and on spheres the critical curves."""
    camera = search_camera(viewer)
    surface = disc.surface.bare()
    if surface.in_plane:
        return charts_in_plane(ring_of(surface, camera), disc, max_index), None
    domain = leaves_of(surface, camera)
    curves = curves_near(bounding_curves(camera, max_index, domain.surface), Circle.from_centre(disc.centre, disc.size))
    return charts_on_sphere(domain, curves, disc, max_index), curves


def touching_radii_on_charts(
    viewer: Viewer, surface: End, centre: Float[Array, " axes"], size: float, max_index: int
) -> Float[Array, " radii"]:
    """Radii of smaller discs whose limb touches a caustic or passes a cusp; parameters as for `disc_images`."""
    charts, _ = _charts(viewer, Disc(surface, centre, size), max_index)
    return np.sort(np.concatenate([extremes(chart, contours(chart)) for chart in charts]))


def _signs(arcs: ChartArcs, index: int | None, max_index: int) -> Float[Array, " arcs"]:
    """1 where images of an index, or of all, lie to the left of arcs, -1 where to the right, and 0 beside others."""
    ordinary, of = arcs.order <= LIMB, arcs.arcs.index
    if index is None:
        return np.where(ordinary | (arcs.order == max_index + 1), arcs.sign, 0.0)
    sign = np.select([ordinary & (of == index), arcs.order == index + 1, arcs.order == index], [1.0, 1.0, -1.0], 0.0)
    # No critical curve has the order of the limb.
    return np.where(~ordinary | (of == index), sign, 0.0) * arcs.sign


def _summed(viewer: Viewer, disc: Disc, max_index: int, parts: list[ChartArcs], weight: Weight | None) -> DiscImages:
    """The areas within all arcs."""
    first, numbered = 0, []
    for part in parts:
        arcs = replace(part.arcs, left=part.arcs.left + first, right=part.arcs.right + first)
        numbered.append(replace(part, arcs=arcs))
        first = 1 + max(first, numbered[-1].last_node)
    whole = numbered[0].joined(*numbered[1:])
    return summed(
        search_sky(viewer),
        _hole(search_camera(viewer)),
        (disc.size, disc.area),
        whole.arcs,
        lambda index: _signs(whole, index, max_index),
        max_index,
        weight,
    )


def _hole(camera: Viewer) -> Float[Array, " 3"]:
    return sky_from_line_of_sight(camera.frame(), np.array([[-1.0, 0.0, 0.0]]))[0]


def _witnesses(
    viewer: Viewer, disc: Disc, max_index: int, curves: CriticalCurves | None, circles: Float[Array, " circles"]
) -> tuple[_Witnesses, list[str]]:
    """Images of places in the disc and beside it, points of critical curves, and remarks.

    circles: circles about the hole, in the plane, that hold the places: distances from the centre in radii.
    """
    surface = disc.surface
    certificate = certificate_of(surface, viewer, max_index)
    places = _probes(disc, circles)
    searched = certificate.images(places)
    vectors = surface.vectors(places)
    sure, height = searched.certified, disc.height(vectors)
    domain = certificate.domain
    if domain.level:
        # Light from the viewer's own place arrives all along the rim.
        sure = sure & (angle_between(vectors, from_angles(viewer.inclination, 0.0)) > _MARGIN * disc.size)
    remarks = []
    if not (sure & (height < 0)).any():
        remarks.append("no place within the disc has certified images")
    images = searched.images[sure[searched.images.star]]
    witnesses = _Witnesses(images.sky, height[images.star] < 0, images.second_arrival)
    if surface.in_plane:
        ring = ring_of(surface.bare(), search_camera(viewer))
        return witnesses.joined(_of_folds(ring, disc, max_index, circles)), remarks
    return witnesses.joined(_of_curves(disc, curves, max_index)), remarks


def _probes(disc: Disc, circles: Float[Array, " circles"]) -> Float[Array, "places 2"]:
    """Coordinates of places in and beside the disc: on few levels, as the search takes a time for each level."""
    x = disc.centre
    if len(x) == 2:
        radius, phi = math.hypot(*x), math.atan2(x[1], x[0])
        rows = []
        for part in circles.tolist():
            r, wide = radius + part * disc.size, math.sqrt(1 - part * part) * disc.size
            rows += [(r, phi + away * wide / r) for away in (*_INSIDE, *_BESIDE_IT)]
        places = np.array(rows)
    else:
        theta, phi = math.acos(np.clip(x[2], -1, 1)), math.atan2(x[1], x[0])
        sine = max(math.sin(theta), math.sin(disc.size / 2))
        parts = [away * disc.size / sine for away in (*_INSIDE, *_BESIDE_IT)]
        places = np.array([(theta, phi + part) for part in parts if abs(part) <= math.pi])
    height = disc.height(disc.surface.vectors(places))
    if len(x) == 3 and not (height > _MARGIN * disc.size).any():
        places = np.concatenate([places, [[math.pi - places[0, 0], places[0, 1] + math.pi]]])
        height = disc.height(disc.surface.vectors(places))
    return places[np.abs(height) > _MARGIN * disc.size]


def _of_curves(disc: Disc, curves: CriticalCurves | None, max_index: int) -> _Witnesses:
    """Points of critical curves: they lie within the images of the disc if their caustic points lie within the disc."""
    assert curves is not None
    parts = []
    for curve in curves.curves[:max_index]:
        points = curve.points
        second = curves.domain.line_of_sight(points.edge_phase, points.depth)[1]
        sky = sky_from_line_of_sight(curves.map.camera.frame(), points.line_of_sight)
        parts.append((sky, disc.height(points.direction), second))
    return _nearest_to_limb(disc, parts)


def _of_folds(domain: Ring, disc: Disc, max_index: int, circles: Float[Array, " circles"]) -> _Witnesses:
    """Points of critical curves in the plane, on some circles about the hole."""
    parts: list[tuple[Array, Array, Array]] = []
    radius = math.hypot(*disc.centre)
    for part in circles.tolist():
        arcs = arcs_of(domain, radius + part * disc.size)
        last = np.maximum(arcs.index, np.roll(arcs.index, 1))
        folds = arcs.low[arcs.folded & (last <= max_index)]
        places = np.stack([folds.radius, folds.azimuth], axis=-1)
        parts.append((folds.sky, disc.height(disc.surface.vectors(places)), np.zeros(len(folds), bool)))
    return _nearest_to_limb(disc, parts)


def _nearest_to_limb(disc: Disc, parts: list[tuple[Array, Array, Array]]) -> _Witnesses:
    """The points nearest to the limb, but not on it; parts: directions, heights and second arrivals."""
    if not parts:
        return _Witnesses(np.empty((0, 3)), np.empty(0, bool), np.empty(0, bool))
    sky, height, second = (np.concatenate(column) for column in zip(*parts, strict=True))
    clear = np.flatnonzero(np.abs(height) > _MARGIN * disc.size)
    chosen = []
    for side in (-1, 1):
        kept = clear[np.sign(height[clear]) == side]
        kept = kept[np.argsort(np.abs(height[kept]))]
        chosen.append(kept[:: max(1, len(kept) // _MOST_POINTS)] if side < 0 else kept[:_MOST_POINTS])
    which = np.concatenate(chosen)
    return _Witnesses(sky[which], height[which] < 0, second[which])


def _checked(
    camera: Viewer, charts: list[DiscChart], parts: list[ChartArcs], max_index: int, witnesses: _Witnesses
) -> list[str]:
    """Faults of the boundary of the images: ends of arcs, and windings about witnesses."""
    hole, remarks, wrong = _hole(camera), [], 0
    for chart, part in zip(charts, parts, strict=True):
        here = witnesses[witnesses.second_arrival == chart.second_arrival]
        for k in (None, *range(max_index + 1)):
            sign = _signs(part, k, max_index)
            chosen = sign != 0
            if chosen.any() and not closed(part.arcs[chosen], sign[chosen]):
                return ["the boundary of the images is not closed"]
        sign = _signs(part, None, max_index)
        chosen = sign != 0
        if not chosen.any():
            wrong += int(here.inside.sum())
            continue
        arcs, sign = part.arcs[chosen], sign[chosen]
        points = with_ends(arcs.start, arcs.points, arcs.stop)
        # The direction to the hole, at infinity in this plane, may belong to an image. Boundaries that run round it the
        # other way lie about the direction away from it.
        about = max(0, round(float(sign @ turns_about(hole, points))))
        about = about + winding(flat_from_hole(points, hole), sign, flat_from_hole(here.sky, hole))
        wrong += int((~(np.abs(about - here.inside) <= _ROUND)).sum())
    if wrong:
        count = len(witnesses.inside)
        remarks.append(f"{wrong} of {count} images of places in and beside the disc lie on the wrong side")
    return remarks
