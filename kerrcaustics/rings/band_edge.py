"""The edge of a lensing band: the image of a circle in the equatorial plane, a closed curve on the viewer's sky."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kerrcaustics.lens_map.plane_edges import chi_of, edge_phase_of, interpolated, lines_on
from kerrcaustics.lens_map.search_sky import search_sky
from kerrcaustics.lens_map.sky_lines import Lines, lines_across
from kerrcaustics.numerics import fourier
from kerrcaustics.results import declared
from kerrcaustics.results.declared import quantity, result, usual_warnings
from kerrcaustics.results.shown import Shown
from kerrcaustics.shapes import Complex, Float
from kerrcaustics.spacetime.checks import numbers
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Gauss-Legendre nodes on a panel of a curve.
_ON_PANEL = 24
# Distance of the end of a line, relative to it, where that end itself is meant.
_AT_END = 1e-12


@result("band-edge/1", record="radius", points="sky error edge_phase distance")
class BandEdge(Shown):
    """The image of a circle in the equatorial plane at one crossing of it: an edge of a lensing band.

    Its points lie on lines across the shadow edge, even in a parameter in which the curve is smooth.
    """

    camera: Viewer = declared.viewer(json=None)
    order: int = quantity("", "1", "order n of the band: the circle is seen at crossing n + 1 of the plane")
    radius: float = quantity("", "GM/c^2", "radius of the circle: from that of the horizon to infinity")
    sky: Array = quantity(
        "point axis", "1", "directions N of the curve, in order, the first not repeated; of an Observer (alpha, beta)"
    )
    error: Array = quantity("point", "sky", "estimated error of the points, across the curve")
    edge_phase: Array = quantity("point", "rad", "parameter of the shadow edge from which the point's line starts")
    distance: Array = quantity(
        "point", "rad", "distance from the shadow edge along the line, negative inside, on the sky of a viewer at rest"
    )

    @usual_warnings
    def at(self, edge_phase: ArrayLike) -> Array:
        """Points of the curve on the lines of given edge phases.

        Parameters
        ----------
        edge_phase : (...) array
            Parameters of the shadow edge, radians.

        Returns
        -------
        (..., axes) array
            Directions N; of an Observer (alpha, beta).

        Raises
        ------
        ValueError
            If `edge_phase` is no array of numbers.

        Errors
        ------
        As large as `error` at the points of the curve.
        """
        phase = numbers("edge_phase", edge_phase)
        sky = search_sky(self.camera)
        chi = chi_of(sky.search_camera, phase.ravel() % (2 * np.pi))
        return places_at(self, chi).reshape(*phase.shape, -1)


class Arc(NamedTuple):
    """A part of a smooth closed curve on the viewer's sky.

    series: Fourier coefficients of the places of the whole curve.
    first: value of chi at which the part begins.
    last: value of chi at which it ends.
    """

    series: Complex[Array, "waves axes"]
    first: float
    last: float


class EdgeNodes(NamedTuple):
    """Nodes along a closed curve: integrals along it are sums over them.

    place: places on the viewer's sky.
    step: differential of the place, with the weight of the node.
    """

    place: Float[Array, "nodes axes"]
    step: Float[Array, "nodes axes"]


def places_at(edge: BandEdge, chi: Float[Array, " places"]) -> Float[Array, "places axes"]:
    """Points of an edge at values of chi in [0, 2 pi]."""
    camera = search_sky(edge.camera).search_camera
    lines = lines_across(camera, edge_phase_of(camera, chi))
    upper, lower = (interpolated(whole[:, None], chi)[:, 0] for whole in _both_halves(edge))
    return _places(edge, lines, np.where(chi > np.pi, _at_once(edge, lines, lower), upper))


def lines_of(edge: BandEdge, count: int) -> Lines:
    """An even number of lines across the shadow edge, at even steps of chi."""
    return lines_on(search_sky(edge.camera).search_camera, count)


def turns(lines: Lines) -> tuple[Float[Array, " lines"], Float[Array, " lines"]]:
    """Position angles of such lines about the middle of the hole, and their changes from one line to the next."""
    turn = np.unwrap(np.arctan2(lines.start[:, 2], lines.start[:, 1]))
    # The shadow edge runs clockwise, as chi grows.
    count = len(lines)
    step = 1 - fourier.resampled(fourier.coefficients(turn + fourier.nodes(count)), count, 1)
    return turn, 2 * np.pi / count * step


def distances_on(edge: BandEdge, lines: Lines) -> Float[Array, " lines"]:
    """Distances of an edge on such lines."""
    upper, lower = (interpolated_evenly(whole, len(lines)) for whole in _both_halves(edge))
    below = fourier.nodes(len(lines)) > np.pi
    return np.where(below, _at_once(edge, lines, lower), upper)


def arcs(edge: BandEdge, count: int) -> list[Arc]:
    """The smooth parts of an edge, by at least so many nodes of the whole curves on which they lie."""
    nodes = max(count + count % 2, 2 * len(edge.distance))
    lines = lines_of(edge, nodes)
    halves = _both_halves(edge) if edge.camera.on_equator else [edge.distance]
    ends = [(0.0, np.pi), (np.pi, 2 * np.pi)] if edge.camera.on_equator else [(0.0, 2 * np.pi)]
    made = [
        Arc(fourier.coefficients(_places(edge, lines, interpolated_evenly(whole, nodes))), *span)
        for whole, span in zip(halves, ends, strict=True)
    ]
    return made[:1] if has_point(edge) else made


def edge_nodes(edge: BandEdge, count: int) -> EdgeNodes:
    """Nodes along an edge, at least so many on each smooth part."""
    parts = arcs(edge, count)
    if not edge.camera.on_equator:
        nodes = 2 * (len(parts[0].series) - 1)
        weight = 2 * np.pi / nodes
        return EdgeNodes(
            fourier.resampled(parts[0].series, nodes), weight * fourier.resampled(parts[0].series, nodes, 1)
        )
    pieces = [_on_arc(part, max(count, len(edge.distance))) for part in parts]
    pieces += [_on_join(edge, chi, count // 2) for chi in (np.pi, 2 * np.pi)]
    return EdgeNodes(*(np.concatenate(columns) for columns in zip(*pieces, strict=True)))


def interpolated_evenly(whole: Float[Array, " nodes"], count: int) -> Float[Array, " count"]:
    """Distances at more nodes, from those at even steps of chi."""
    sign = np.sign(whole[0])
    if sign == 0 or not (np.sign(whole) == sign).all():
        return fourier.resampled(fourier.coefficients(whole), count)
    return sign * np.exp(fourier.resampled(fourier.coefficients(np.log(np.abs(whole))), count))


def _both_halves(edge: BandEdge) -> list[Array]:
    """Distances all round of the smooth curves whose halves make the edge: in the plane two with mirror symmetry."""
    if not edge.camera.on_equator:
        return [edge.distance, edge.distance]
    upper, lower = np.split(edge.distance, 2)
    return [np.concatenate([upper, upper[::-1]]), np.concatenate([lower[::-1], lower])]


def has_point(edge: BandEdge) -> bool:
    """True if the lower half is one point, as the plane is crossed at once, at the viewer.

    It is the middle of the hole if the viewer is beyond the circle, else the direction opposite to it.
    """
    return edge.camera.on_equator and edge.order == 0


def _at_once(edge: BandEdge, lines: Lines, distance: Array) -> Array:
    """Distances on lines, or to the point that the lower half is."""
    if not has_point(edge):
        return distance
    return lines.first if edge.camera.radius > edge.radius else lines.last * (1 - _AT_END)


def _places(edge: BandEdge, lines: Lines, distance: Array) -> Float[Array, "lines axes"]:
    return search_sky(edge.camera).to_viewer(lines.sky(distance))


def _on_arc(arc: Arc, count: int) -> EdgeNodes:
    """Gauss-Legendre nodes on a part of a curve."""
    chi, weight = panels(np.linspace(arc.first, arc.last, 1 + -(-count // _ON_PANEL)))
    return EdgeNodes(fourier.values_at(arc.series, chi), weight[:, None] * fourier.values_at(arc.series, chi, 1))


def panels(ends: Float[Array, " ends"]) -> tuple[Float[Array, " nodes"], Float[Array, " nodes"]]:
    """Gauss-Legendre nodes and weights on panels between ends in order."""
    place, weight = np.polynomial.legendre.leggauss(_ON_PANEL)
    half = np.diff(ends)[:, None] / 2
    return (ends[:-1, None] + half * (1 + place)).ravel(), (half * weight).ravel()


def _on_join(edge: BandEdge, chi: float, count: int) -> EdgeNodes:
    """Nodes on the line in the plane from one half of an edge to the other one."""
    camera = search_sky(edge.camera).search_camera
    lines = lines_across(camera, np.array([chi]))
    upper, lower = (float(interpolated(whole[:, None], np.array([chi]))[0, 0]) for whole in _both_halves(edge))
    ends = upper, float(_at_once(edge, lines, np.array([lower]))[0])
    first, last = ends if chi == np.pi else ends[::-1]
    along, _ = panels(np.linspace(first, last, 1 + -(-count // _ON_PANEL)))
    sky = _places(edge, lines[np.zeros(len(along), int)], along)
    return EdgeNodes(sky, _differentials(sky))


def _differentials(sky: Float[Array, "nodes axes"]) -> Float[Array, "nodes axes"]:
    """Weighted differentials of places at the nodes of panels, by Legendre series in each."""
    place, weight = np.polynomial.legendre.leggauss(_ON_PANEL)
    columns = np.moveaxis(sky.reshape(-1, _ON_PANEL, sky.shape[1]), 1, 0)
    series = np.polynomial.legendre.legfit(place, columns.reshape(_ON_PANEL, -1), _ON_PANEL - 1)
    slope = np.polynomial.legendre.legval(place, np.polynomial.legendre.legder(series)).T
    return np.moveaxis((weight[:, None] * slope).reshape(columns.shape), 0, 1).reshape(sky.shape)
