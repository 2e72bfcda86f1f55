"""Isoradials: the images of circles round the hole in the equatorial plane, as curves on the sky of a viewer.

A circle that every line across the shadow edge meets once is seen as one closed curve, which winds once round that
edge; its azimuth runs on each part of the curve as the Morse index says, once round in all (images/circle_arcs.py).
Where that holds no image of anything on the circle is missing. Of others, and from within the plane, the points that
lines meet are joined to open curves.
"""

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.images.circle_arcs import circle_image
from kerrcaustics.lens_map.arguments import checked_radii
from kerrcaustics.lens_map.crossing_lines import CrossingLines
from kerrcaustics.lens_map.lens_map import LensMap
from kerrcaustics.lens_map.measured_light import measured_light, redshift_slope
from kerrcaustics.lens_map.plane_map import Crossings, PlaneMap
from kerrcaustics.lens_map.search_sky import TOLERANCE, search_camera
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.progress import Progress, in_steps, with_progress
from kerrcaustics.results.shown import Items, Shown
from kerrcaustics.shapes import Float, Int
from kerrcaustics.spacetime.checks import one_of, whole_number
from kerrcaustics.spacetime.shadow import even_phases
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Rounding of a direction on the search sky, radians.
_ROUNDING = 2e-16
# Largest distance of a point of an open curve from the circle, in ln r.
_CLOSE = 1e-6


@result(
    "isoradial/1",
    record="crossing radius closed",
    points="sky azimuth error redshift redshift_error width time time_error",
)
class Isoradial(Shown):
    """The image of a circle round the hole, at one crossing of its plane."""

    camera: Viewer = declared.viewer(json=None)
    crossing: int = quantity("", "1", "number of the crossing of the plane, counted from 1")
    radius: float = quantity("", "GM/c^2", "radius of the circle")
    sky: Array = quantity(
        "point axis", "1", "points N of the image, in order, the first one not repeated; of an Observer (alpha, beta)"
    )
    azimuth: Array = quantity("point", "rad", "phi of the circle's points that are seen there, unwrapped")
    error: Array = quantity("point", "sky", "estimated error of the points, across the curve")
    redshift: Array = quantity("point", "1", "nu_camera / nu_emitter of an emitter there; NaN if there can be none")
    redshift_error: Array = quantity("point", "1", "error of redshift")
    width: Array = quantity("point", "sky", "length on the sky, across the curve, for a unit of radius")
    edge_phase: Array = quantity("point", "rad", "parameter of the shadow edge from which the point's line starts")
    closed: bool = quantity("", "1", "True where every line across the shadow edge meets the image once")
    time: Array = quantity(
        "point",
        "GM/c^3",
        "travel time from the circle to the camera; for an Observer, that of a plane wave, minus r + 2 ln r of the "
        "observer",
    )
    time_error: Array = quantity("point", "GM/c^3", "estimated error of time")

    def __repr__(self) -> str:
        """Summary in one line."""
        what = "closed" if self.closed else "open"
        return f"<Isoradial r = {self.radius:g}, crossing {self.crossing}, {len(self.sky)} points, {what}>"


@result("isoradials/1", record="certified remarks isoradials")
class IsoradialSet(Items[Isoradial]):
    """The images of a disk's rims, crossing by crossing: a sequence of `Isoradial`, returned by `isoradials`."""

    isoradials: tuple[Isoradial, ...] = quantity("curve", "", "inner and outer rim of the first image, then the next")
    certified: bool = declared.certified(
        "True when every circle is seen at every crossing as one closed curve round the shadow, along which the "
        "azimuth runs as the Morse index says, once round in all"
    )
    remarks: tuple[str, ...] = declared.remarks()


@usual_warnings
@with_progress
def isoradials(
    camera: Viewer,
    radii: ArrayLike,
    crossings: int = 4,
    points: int = 360,
    motion: str = "circular",
    *,
    progress: Progress | bool | None = None,
) -> IsoradialSet:
    """Images of circles in the equatorial plane: the rims of a disk's images, or any isoradials.

    Parameters
    ----------
    camera : Camera or Observer
    radii : (k,) array
        Radii of the circles, outside the horizon: the rims of a disk.
    crossings : int
        Number of images of each circle, from the first crossing of the plane on.
    points : int
        Number of lines across the shadow edge on which each image is searched for.
    motion : str
        Motion of the emitter there, for the redshift; an emitter of `EquatorialPlane`.
    progress : callable or bool, optional
        As for `caustics`.

    Returns
    -------
    IsoradialSet
        For each crossing, the images of all circles. Circles that are not found at a crossing are left out and listed
        in the remarks.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Isoradial.error`: the errors of the ray, of the search and of the direction itself, across the curve; in M for
    an Observer. `Isoradial.time_error`: that of the travel time.

    References
    ----------
    Luminet 1979, A&A 75, 228, for the name and the first picture.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> [(curve.crossing, curve.radius, curve.closed) for curve in kc.isoradials(camera, [20.0], 2)]
    [(1, 20.0, True), (2, 20.0, True)]
    """
    circles = checked_radii(camera, "radii", radii)
    crossings = whole_number("crossings", crossings, 1, 12)
    one_of("motion", motion, EMITTERS)
    count = whole_number("points", points, 8, 100_000)
    # No line lies in the plane, where a viewer does: along it no ray crosses the plane.
    edge_phase = even_phases(camera, (np.arange(count) + 0.5 * camera.on_equator) / count)
    curves, remarks = [], []
    for crossing in in_steps("crossing", range(1, crossings + 1)):
        surface = EquatorialPlane(crossing, motion)
        for radius in in_steps("circle", circles.tolist()):
            images, doubts = _images(camera, surface, radius, edge_phase)
            curves += images
            remarks += [f"crossing {crossing}, r = {radius:.12g}: {doubt}" for doubt in doubts]
    return IsoradialSet(tuple(curves), not remarks, tuple(remarks))


def _images(
    viewer: Viewer, surface: EquatorialPlane, radius: float, edge_phase: Float[Array, " lines"]
) -> tuple[list[Isoradial], tuple[str, ...]]:
    """The image of a circle on lines: one closed curve, or an open one for each row of neighbours; and remarks."""
    if viewer.on_equator:
        remarks: tuple[str, ...] = ("the camera lies in the plane, along which rays run that never cross it",)
    else:
        arcs = circle_image(viewer, surface.crossing, radius)
        remarks = arcs.remarks
        points = None if arcs.distance is None else arcs.points_at(edge_phase)
        if points is not None and (points.index >= 0).all():
            return [_curve(viewer, surface, radius, points, closed=True)], remarks
    rows, lost = _open_rows(viewer, surface, radius, edge_phase)
    remarks = (*remarks, *_remarks(len(rows), lost))
    # In the plane, a curve that every line meets once.
    closed = len(rows) == 1 and len(rows[0]) == len(edge_phase) and viewer.on_equator
    return [_curve(viewer, surface, radius, row, closed=closed) for row in rows], remarks


def _remarks(pieces: int, lost: int) -> tuple[str, ...]:
    """Remarks about missing parts of an image."""
    if not pieces:
        return ("no image was found",)
    said = [f"{lost} of its points on lines could not be found"] if lost else []
    return (*said, *([f"the image was found in {pieces} pieces"] if pieces > 1 else []))


def _open_rows(
    viewer: Viewer, surface: EquatorialPlane, radius: float, edge_phase: Float[Array, " lines"]
) -> tuple[list[Crossings], int]:
    """The points at which lines meet the image of a circle, in rows of neighbours; the number of those not found."""
    plane_map = PlaneMap(search_camera(viewer), surface.bare(), "auto", TOLERANCE)
    line, points = CrossingLines(plane_map, edge_phase).meetings(radius)
    near = points.miss(radius) < _CLOSE
    line, points = line[near], points[near]
    return [points[row] for row in _rows(line, points.distance)], int((~near).sum())


def _curve(viewer: Viewer, surface: EquatorialPlane, radius: float, points: Crossings, *, closed: bool) -> Isoradial:
    lens_map = LensMap(viewer, surface)
    seen = lens_map.light_at(points.sky)
    # The light comes from separate rays, as places on the viewer's sky are rounded.
    own = np.abs(np.log(seen.beams.radius / radius)) + seen.beams.error
    residual = np.fmax(points.miss(radius) + points.error, own)
    error = residual / points.gradient + _ROUNDING
    light = measured_light(lens_map, seen, points.sky, error, residual=residual)
    by_radius = residual * redshift_slope(lens_map, surface.emitter, points.sky, points.radius)
    return Isoradial(
        camera=viewer,
        crossing=surface.crossing,
        radius=radius,
        sky=light.sky,
        azimuth=np.unwrap(light.azimuth),
        error=light.error,
        redshift=light.redshift,
        redshift_error=light.redshift_error + by_radius * np.abs(light.redshift),
        width=lens_map.sky.lengths(points.sky) / (radius * points.gradient),
        edge_phase=points.edge_phase,
        closed=closed,
        time=light.time,
        time_error=light.time_error,
    )


def _rows(line: Int[Array, " points"], distance: Float[Array, " points"]) -> list[Int[Array, " _"]]:
    """Points on lines, joined over neighbouring lines where each of them has one in reach; in order."""
    rows: list[list[int]] = []
    for point in range(len(line)):
        near = [row for row in rows if line[row[-1]] == line[point] - 1]
        near.sort(key=lambda row: abs(distance[row[-1]] - distance[point]))
        if near:
            near[0].append(point)
        else:
            rows.append([point])
    return [np.array(row) for row in rows]
