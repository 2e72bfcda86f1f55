"""Crossings of the images of a great circle with a line on the camera sky, counted twice."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.beams.beam import Beams
from kerrcaustics.images.sheets import Sheets, checked_sheets
from kerrcaustics.lens_map.lens_map import TRAVEL_TIME, LensMap
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.numerics.roots import bracketed_roots
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Bool, Float, Int
from kerrcaustics.spacetime.checks import instance_of, numbers, quoted
from kerrcaustics.spacetime.circles import Circle
from kerrcaustics.spacetime.rows import Rows
from kerrcaustics.spacetime.sphere import flattened, tangent_basis
from kerrcaustics.spacetime.viewer import Viewer
from kerrcaustics.tracks.circles import CircleImages

Array = np.ndarray

_NODES, _MOST_NODES = 65, 20_000
_MOST_HALVINGS = 40
# Distance (radians) from its ends within which a line ends on a curve.
_AT_END = 1e-12
# Step of differences along the line, and longest step of the line's image for which its speed at both ends holds.
_DIFFERENCE = 1e-6
_LONGEST = 0.3
# Largest ratio of the image's speed between two nodes to that at the nodes.
_SAFETY = 2.0


@result("crossings/1", record="per_index expected certified remarks", rows="sky index longitude time time_error error")
class LineCrossings(Shown):
    """Crossings of a line on the camera sky with the images of a great circle, in order along the line."""

    camera: Viewer = declared.viewer(json=None)
    sky: Array = quantity("crossing axis", "1", "directions N; of an Observer (alpha, beta)")
    index: Array = quantity("crossing", "1", "Morse index")
    longitude: Array = quantity("crossing", "rad", "longitude on the circle, in (-pi, pi]")
    time: Array = quantity("crossing", "GM/c^3", TRAVEL_TIME)
    time_error: Array = quantity("crossing", "GM/c^3", "error of time")
    error: Array = quantity("crossing", "sky", "error along the line")
    per_index: dict[int, int] = quantity("morse_index", "1", "number of crossings, by index")
    expected: dict[int, int] = quantity(
        "morse_index", "1", "number of crossings, by index, counted along the curves of `circle_images`"
    )
    certified: bool = declared.certified("True if both counts agree, and the first one left nothing undecided")
    remarks: tuple[str, ...] = declared.remarks(default=())


class _SkyLine:
    """A part of a great circle on the sky at rest, with places 0 to 1 along it."""

    def __init__(self, sheets: Sheets, images: CircleImages, line: float | ArrayLike) -> None:
        """The line that the argument `line` of a user gives."""
        self._sheets = sheets
        given = numbers("line", line)
        axes = 3 if images.camera.sky_unit == "rad" else 2
        if given.shape not in ((), (2, axes)):
            places = f"two {images.camera.sky_coordinates}, an array of shape (2, {axes})"
            raise ValueError(f"Argument `line` must be an angle in radians, or {places}.")
        self._edge_phase = float(given) if given.ndim == 0 else None
        if self._edge_phase is not None:
            phase = np.array(self._edge_phase)
            self._first, last = float(sheets.curves.domain.first(phase)), float(sheets.sheets[-1].inner(phase))
            self._depth = last - self._first
        else:
            size = np.linalg.norm(given, axis=1, keepdims=True)
            if axes == 3 and not (size > 0).all():
                raise ValueError("Argument `line` must have directions N that are not 0.")
            rest = search_sky(images.camera).to_search(given / size if axes == 3 else given)
            self._start, ahead = rest[0], rest[1] - (rest[0] @ rest[1]) * rest[0]
            across = float(np.linalg.norm(ahead))
            if across < 1e-12:
                raise ValueError("Argument `line` must have two ends that are neither the same nor opposite.")
            self._ahead, self._angle = ahead / across, math.atan2(across, float(rest[0] @ rest[1]))

    def sky(self, place: Float[Array, " places"]) -> Float[Array, "places 3"]:
        """Directions on the sky at rest."""
        if self._edge_phase is not None:
            edge_phase = np.full(len(place), self._edge_phase)
            return self._sheets.sky(self._sheets.line_of_sight(edge_phase, self._first + place * self._depth))
        angle = (place * self._angle)[:, None]
        return self._start * np.cos(angle) + self._ahead * np.sin(angle)

    def tangent(self, place: Float[Array, " places"]) -> Float[Array, "places 3"]:
        """Derivatives of these directions."""
        return (self.sky(place + _DIFFERENCE) - self.sky(place - _DIFFERENCE)) / (2 * _DIFFERENCE)

    def crossing_count(self, curve: Float[Array, "points 3"], closed: bool) -> int:
        """Number of times a curve of short steps on the sky at rest crosses the line."""
        if closed:
            curve = np.concatenate([curve, curve[:1]])
        start, end = self.sky(np.array([0.0, 1.0]))
        normal = np.cross(start, end)
        side = curve @ normal
        step = np.flatnonzero((side[1:] > 0) != (side[:-1] > 0))
        part = (side[step] / (side[step] - side[step + 1]))[:, None]
        point = curve[step] * (1 - part) + curve[step + 1] * part
        within = (np.cross(start, point) @ normal > -_AT_END) & (np.cross(point, end) @ normal > -_AT_END)
        return int(np.count_nonzero(within))


@dataclass(frozen=True)
class _Samples(Rows):
    """Places on the line; height above the circle there, its slope, the speed of the image, round-off of n'."""

    place: Float[Array, " places"]
    height: Float[Array, " places"]
    slope: Float[Array, " places"]
    speed: Float[Array, " places"]
    error: Float[Array, " places"]


@usual_warnings
def crossings_of_line(images: CircleImages, line: float | ArrayLike) -> LineCrossings:
    """Crossings of the images of a great circle with a line on the camera sky.

    Parameters
    ----------
    images : CircleImages
        Result of `circle_images`.
    line : float or (2, 3) array
        Edge phase, radians, at which the line leaves the shadow edge, straight away from the shadow. The line runs from
        the direction opposite to the hole to the critical curve that bounds the highest index. For a camera on the
        equator, 0 is the prograde (flat) edge and pi the retrograde one; pi / 2 and 3 pi / 2 lie next to the poles.
        Alternatively, the two ends of the line, directions N; for an Observer (alpha, beta), shape (2, 2).
        The line between them is part of a great circle on the sky of a camera at rest at the same event.

    Returns
    -------
    LineCrossings

    Raises
    ------
    ValueError
        If an argument is invalid.

    Notes
    -----
    First count: the line is divided until, between neighbours, the image either runs one way with respect to the circle
    or is too slow to reach it. Second count: along the curves.

    Errors: `LineCrossings.error`.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> camera = kc.Camera(spin=0.9, radius=10)
    >>> circle = kc.circle_images(camera, normal=(0.3, 0.0), max_index=1)
    >>> kc.crossings_of_line(circle, 0.0).certified
    True
    """
    instance_of("images", images, CircleImages)
    if not np.isfinite(numbers("line", line)).all():
        raise ValueError(f"Argument `line` must be finite, but is {quoted(line)}.")
    sheets = checked_sheets(images.camera, max(images.per_index), images.surface)
    circle, path = Circle.great(*images.normal), _SkyLine(sheets, images, line)
    nodes, roots, doubt = _divided(sheets, circle, path)
    place = _polished(sheets, circle, path, nodes, roots)
    sky = path.sky(place)
    beams = _beams(sheets, sky)
    ends = _nodes(circle, path, place, sky, beams)
    index = np.asarray(beams.index)
    kept = index <= max(images.per_index)
    counts = {k: int(np.count_nonzero(index == k)) for k in images.per_index}
    expected = counts if roots is None else _along_curves(images, path)
    differ = (k for k, count in counts.items() if count != expected[k])
    doubt += [f"index {k}: {counts[k]} along the line, {expected[k]} along the curves" for k in differ]
    if not images.certified:
        doubt.append("the images of the circle are not certified themselves")
    off = (ends.error + np.abs(ends.height)) * np.linalg.norm(path.tangent(place), axis=1) / np.abs(ends.slope)
    lens_map = LensMap(images.camera, images.surface)
    light = lens_map.light_at(sky[kept])
    return LineCrossings(
        camera=images.camera,
        sky=light.sky,
        index=index[kept],
        longitude=circle.longitude(beams.direction)[kept],
        time=light.time,
        time_error=light.time_error,
        error=lens_map.errors(sky, off)[kept],
        per_index=counts,
        expected=expected,
        certified=not doubt,
        remarks=tuple(doubt),
    )


@usual_warnings
def places_on_line(images: CircleImages, line: float | ArrayLike, points: int = 200) -> Float[Array, "points axes"]:
    """Places on the viewer's sky along a line of `crossings_of_line`, from its start; parameters as there."""
    sheets = checked_sheets(images.camera, max(images.per_index), images.surface)
    return search_sky(images.camera).to_viewer(_SkyLine(sheets, images, line).sky(np.linspace(0, 1, points)))


def _along_curves(images: CircleImages, path: _SkyLine) -> dict[int, int]:
    """Crossings of each index, counted along the curves of the circle."""
    total, sky = dict.fromkeys(images.per_index, 0), search_sky(images.camera)
    for curve in images.curves:
        total[curve.index] += path.crossing_count(sky.to_search(curve.sky), curve.closed)
    return total


def _beams(sheets: Sheets, sky: Float[Array, "places 3"]) -> Beams:
    beams = sheets.map.beams_of_sky(sky)
    if not beams.escaped.all():
        raise ValueError("Argument `line` must not touch the shadow.")
    return beams


def _nodes(
    circle: Circle, path: _SkyLine, place: Float[Array, " places"], sky: Float[Array, "places 3"], beams: Beams
) -> _Samples:
    tangent = path.tangent(place)
    flat = np.stack([np.einsum("ni,ni->n", e, tangent) for e in tangent_basis(sky)], axis=-1)
    image = np.einsum("nij,nj->ni", beams.jacobian, flat)
    upward = flattened(beams.direction, circle.upward_and_east(beams.direction)[0])
    slope, speed = np.einsum("ni,ni->n", upward, image), np.linalg.norm(image, axis=1)
    return _Samples(place, circle.height(beams.direction), slope, speed, np.asarray(beams.error))


def _divided(sheets: Sheets, circle: Circle, path: _SkyLine) -> tuple[_Samples, Int[Array, " roots"] | None, list[str]]:
    """Nodes on the line, the intervals between them that hold one crossing each, and what stays open, in words.

    No intervals, None, where the line lies on the image of the circle.
    """

    def samples_at(place: Float[Array, " places"]) -> _Samples:
        sky = path.sky(place)
        return _nodes(circle, path, place, sky, _beams(sheets, sky))

    nodes = samples_at(np.linspace(0, 1, _NODES))
    for _ in range(_MOST_HALVINGS):
        sure, roots = _sure_and_crossing(nodes)
        if sure.all():
            return nodes, roots, []
        nodes = nodes.joined(samples_at(((nodes.place[1:] + nodes.place[:-1]) / 2)[~sure]))
        nodes = nodes[np.argsort(nodes.place, kind="stable")]
        if len(nodes.place) > _MOST_NODES:
            break
    sure, roots = _sure_and_crossing(nodes)
    if (np.abs(nodes.height) < 1e3 * nodes.error).mean() > 0.5:
        return nodes, None, ["the line lies on the image of the circle: there is nothing to count"]
    opened = np.count_nonzero(~sure)
    return nodes, roots, [f"{opened} places where the line may touch a curve: move it a little"] if opened else []


def _sure_and_crossing(nodes: _Samples) -> tuple[Bool[Array, " intervals"], Int[Array, " roots"]]:
    """True for intervals that are sure, and indices of those that hold a crossing."""
    width = np.diff(nodes.place)
    first, last = nodes.slope[:-1], nodes.slope[1:]
    fastest = np.maximum(nodes.speed[:-1], nodes.speed[1:])
    steady = (fastest * width < _LONGEST) & (fastest < 2 * np.minimum(nodes.speed[:-1], nodes.speed[1:]))
    one_way = steady & (first * last > 0) & (np.abs(first - last) < 0.5 * np.maximum(np.abs(first), np.abs(last)))
    height = np.abs(nodes.height)
    far = steady & (height[:-1] + height[1:] > _SAFETY * fastest * width)
    above = nodes.height > 0
    # A line that ends on a curve crosses it.
    on_curve = np.abs(nodes.height[[0, -1]]) <= nodes.error[[0, -1]] + _AT_END
    above[[0, -1]] = np.where(on_curve, ~above[[1, -2]], above[[0, -1]])
    changes = above[:-1] != above[1:]
    return one_way | (far & ~changes), np.flatnonzero(changes)


def _polished(
    sheets: Sheets, circle: Circle, path: _SkyLine, nodes: _Samples, roots: Int[Array, " roots"] | None
) -> Float[Array, " roots"]:
    """Places of the crossings, each within its interval."""
    if roots is None or len(roots) == 0:
        return np.empty(0)

    def height(place: Float[Array, " places"]) -> Float[Array, " places"]:
        return circle.height(_beams(sheets, path.sky(place)).direction)

    low, high = nodes[roots], nodes[roots + 1]
    root = bracketed_roots(height, (low.place, high.place))
    # Where the line ends on a curve, an interval may hold no change of sign.
    end = np.where(np.abs(low.height) < np.abs(high.height), low.place, high.place)
    return np.where(root.found, root.x, end)
