"""Isoradials: the images of circles round the hole in the equatorial plane, as curves on the camera sky.

Points are sought on lines that cross the shadow edge (sky_lines.py): on each of them the radius of the n-th crossing
grows from that of the horizon, where rays fall in before they cross, to infinity, where they escape before.
"""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from kerrcaustics.beams.emitters import EMITTERS
from kerrcaustics.beams.ends import EquatorialPlane
from kerrcaustics.beams.trace import trace_beams
from kerrcaustics.lens_map.crossing_lines import CrossingLines
from kerrcaustics.lens_map.search_sky import TOLERANCE
from kerrcaustics.results.declared import Items, quantity, result, usual_warnings
from kerrcaustics.spacetime import kerr
from kerrcaustics.spacetime.camera import check_camera
from kerrcaustics.spacetime.checks import numbers, one_of, quoted, whole_number
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray


@result("isoradial/1", record="crossing radius closed", points="sky azimuth error redshift width time")
class Isoradial:
    """The image of a circle round the hole, at one crossing of its plane."""

    crossing: int = quantity("", "1", "which crossing of the plane, from 1")
    radius: float = quantity("", "GM/c^2", "of the circle")
    sky: Array = quantity("point axis", "1", "points N of the image, in order, the first one not repeated")
    azimuth: Array = quantity("point", "rad", "phi of the circle's points that are seen there, unwrapped")
    error: Array = quantity("point", "rad", "estimated error of the points, across the curve", json="error_rad")
    redshift: Array = quantity("point", "1", "nu_camera / nu_emitter on circular geodesics; NaN where there is none")
    width: Array = quantity("point", "1", "angle on the sky, across the curve, for a unit of radius", json="width_rad")
    edge_phase: Array = quantity("point", "rad", "parameter of the shadow edge from which the point's line starts")
    closed: bool = quantity("", "1", "True where every line across the shadow edge meets the image once")
    time: Array | None = quantity("point", "GM/c^3", "travel time to the camera; None if not asked for", default=None)

    def __repr__(self) -> str:
        """Summary in one line."""
        what = "closed" if self.closed else "open"
        return f"<Isoradial r = {self.radius:g}, crossing {self.crossing}, {len(self.sky)} points, {what}>"


@result("isoradials/1", record="isoradials")
class IsoradialSet(Items[Isoradial]):
    """The images of a disk's rims, crossing by crossing: what `isoradials` returns, a sequence of `Isoradial`."""

    isoradials: tuple[Isoradial, ...] = quantity("curve", "", "inner and outer rim of the first image, then the next")


@usual_warnings
def isoradials(
    camera: Viewer,
    radii: ArrayLike,
    crossings: int = 4,
    points: int = 360,
    motion: str = "circular",
    *,
    time: bool = False,
) -> IsoradialSet:
    """Images of circles in the equatorial plane: the rims of a disk's images, or any isoradials.

    Parameters
    ----------
    camera : Camera
    radii : (k,) array
        Of the circles, outside the horizon: the rims of a disk.
    crossings : int
        How many images of each, from the first crossing of the plane on.
    points : int
        Lines across the shadow edge on which each image is sought.
    motion : str
        Of what shines there, for the redshift; an emitter of `EquatorialPlane`.
    time : bool
        Whether to compute the travel times.

    Returns
    -------
    IsoradialSet
        For each crossing, the images of all circles. Circles that are not seen at a crossing are left out.

    Raises
    ------
    ValueError
        If an argument is invalid.

    Errors
    ------
    `Isoradial.error`: that of the ray, of what the search left and of the direction itself, across the curve.

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
    circles = check_circles(camera, "radii", radii)
    crossings = whole_number("crossings", crossings, 1, 12)
    one_of("motion", motion, EMITTERS)
    edge_phase = 2 * math.pi * np.arange(whole_number("points", points, 8, 100_000)) / points
    found = []
    for crossing in range(1, crossings + 1):
        lines = CrossingLines(camera, edge_phase, EquatorialPlane(crossing, motion))
        found += [curve for radius in circles for curve in curves_on(lines, float(radius), time=time)]
    return IsoradialSet(tuple(found))


def check_circles(camera: Viewer, name: str, radii: ArrayLike) -> Float[Array, " circles"]:
    """The radii of an argument, outside the horizon of the camera's hole."""
    check_camera(camera)
    circles, horizon = numbers(name, radii).ravel(), kerr.horizon(camera.spin)
    if not (len(circles) and np.isfinite(circles).all() and (circles > horizon).all()):
        raise ValueError(
            f"Argument `{name}` must be finite and larger than the horizon radius {horizon:.12g}, "
            f"but is {quoted(radii)}."
        )
    return circles


def curves_on(lines: CrossingLines, radius: float, *, time: bool) -> Sequence[Isoradial]:
    """The image of a circle, as one curve if it is closed, or as one for each row of neighbouring lines."""
    above = lines.level > 1 / radius
    line, place = np.nonzero(above[:, 1:] != above[:, :-1])
    if not len(line):
        return []
    once = len(line) == len(lines.edge_phase) and np.array_equal(line, np.arange(len(line)))
    points = lines.places(radius, lines.edge_phase[line], lines.distance[line, place], lines.distance[line, place + 1])
    if once:
        return [_curve(lines, radius, points, closed=True, time=time)]
    rows = _rows(line, points[1])
    return [_curve(lines, radius, [part[row] for part in points], closed=False, time=time) for row in rows]


def _curve(lines: CrossingLines, radius: float, points: list[Array], *, closed: bool, time: bool) -> Isoradial:
    sky = lines.sky(*points)
    without = {"index": False, "crossings": False}
    beams = trace_beams(lines.camera, sky, "auto", TOLERANCE, end=lines.end, time=time, **without)
    assert beams.radius is not None and beams.redshift is not None
    with np.errstate(divide="ignore", invalid="ignore"):
        width = 1 / np.linalg.norm(beams.jacobian[:, 0], axis=-1)
        error = (np.abs(beams.radius - radius) + radius * beams.error) * width + 2e-16
    of_points = sky, np.unwrap(beams.azimuth), error, beams.redshift, width, points[0]
    return Isoradial(lines.end.crossing, radius, *of_points, closed, beams.time)


def _rows(line: Array, distance: Array) -> list[Array]:
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
