"""The strip of edge phase by depth, on which photon rings and critical curves are one ladder; figures of photon rings.

Depth counts e-foldings of the distance from the shadow edge, which lies in the middle of the strip, at infinite depth;
the inside of the shadow is mirrored below it. From one order to the next both families go deeper by gamma.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from kerrcaustics.curves.caustic_search import caustics as caustics_of
from kerrcaustics.curves.critical_curves import CriticalCurve, critical_curves
from kerrcaustics.draw import style
from kerrcaustics.draw.ring_results import bands_on_sky, visibility_amplitude
from kerrcaustics.draw.sky_axes import caustics_on_sphere, name_sky_axes
from kerrcaustics.draw.titles import viewer_in_words
from kerrcaustics.interop.physical_scale import PhysicalScale
from kerrcaustics.lens_map.search_sky import search_camera
from kerrcaustics.lens_map.sky_lines import line_reach
from kerrcaustics.rings.band_edge import BandEdge
from kerrcaustics.rings.bands import photon_rings
from kerrcaustics.rings.results import PhotonRings
from kerrcaustics.rings.visibility import Visibilities
from kerrcaustics.shapes import Float
from kerrcaustics.spacetime.viewer import Viewer

Array = np.ndarray

# Part of a colour in the tint of a band.
_TINT = 0.35
# Depth that is shown beyond the last curve.
_BEYOND = 1.6
_MARK: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 4, "markeredgewidth": 0.9, "zorder": 5}
# Highest order of critical curves in a figure of both families.
_CURVES = 4


def ladder(ax: Axes, rings: PhotonRings, curves: Iterable[CriticalCurve] = ()) -> Axes:
    """Bands filled on the strip of edge phase by depth, and critical curves as lines, with their crossings marked."""
    deepest = max(float(_depth(edge).max()) for band in rings for edge in band.rims) + _BEYOND
    for band in rings:
        colour = style.crossing_colour(band.order + 1)
        tint = tuple(1 - _TINT * (1 - part) for part in to_rgb(colour))
        phase, below = _height(band.rims[0], deepest)
        above = _height(band.rims[1], deepest)[1] if band.outer is not None else np.full(len(phase), deepest)
        ax.fill_between(phase, below, above, color=tint, linewidth=0, label=f"band n = {band.order}")
        for edge in band.rims:
            ax.plot(*_height(edge, deepest), color=colour, linewidth=0.8)
    ax.axhline(0, color="black", linewidth=0.9)
    for curve in curves:
        phase = np.degrees(curve.points.edge_phase) % 360
        rows = np.argsort(phase)
        line = {"linewidth": 1.5, **style.order_line(curve.order)}
        ax.plot(phase[rows], deepest - curve.points.depth[rows], label=f"critical curve {curve.order}", **line)
        for place, _ in rim_crossings(curve):
            ax.plot(math.degrees(place[0]) % 360, deepest - place[1], **_mark(curve.order))
    _ladder_axes(ax, deepest)
    return ax


def rim_crossings(curve: CriticalCurve) -> list[tuple[Float[Array, " 2"], Float[Array, " 2"]]]:
    """Points where a caustic crosses the equator of the sky: (edge phase, depth), and (theta', phi')."""
    points = curve.points
    ahead = points.joined(points.shifted(1)[np.array([0])]) if curve.closed else points
    height = ahead.theta - np.pi / 2
    found = []
    for i in np.flatnonzero(height[1:] * height[:-1] < 0):
        part = height[i] / (height[i] - height[i + 1])
        columns = [column[i] + part * (column[i + 1] - column[i]) for column in (ahead.edge_phase, ahead.depth)]
        found.append((np.array(columns), np.array([np.pi / 2, ahead.azimuth[i] + part * np.diff(ahead.azimuth)[i]])))
    return found


def ladder_figure(viewer: Viewer, orders: int = _CURVES) -> Figure:
    """Bands and critical curves of a viewer on one strip, beside the celestial sphere with caustics and equator."""
    rings, curves = photon_rings(viewer, max_order=orders - 1), critical_curves(viewer, orders)
    with rc_context(style.RC):
        figure = Figure(figsize=(style.PAGE_WIDTH, 4.3), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.05))
        ladder(left, rings, curves)
        caustics_on_sphere(right, caustics_of(viewer, orders))
        right.axhline(90, color="black", linewidth=0.9, linestyle=(0, (5, 2)))
        low, high = right.get_xlim()
        for curve in curves:
            for _, (_, phi) in rim_crossings(curve):
                turned = (math.degrees(phi) - low) % 360 + low
                if turned <= high:
                    right.plot(turned, 90, **_mark(curve.order))
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        left.set_title("camera sky, along the shadow edge")
        right.set_title("celestial sphere; dashed: the rim of the plane")
        figure.suptitle(viewer_in_words(viewer))
    return figure


def rings_figure(
    rings: PhotonRings, visibilities: Visibilities | None = None, scale: PhysicalScale | None = None
) -> Figure:
    """Bands on the sky and on the strip, with visibilities below if there are any."""
    with rc_context(style.RC):
        height = 3.9 if visibilities is None else 6.4
        figure = Figure(figsize=(style.PAGE_WIDTH, height), layout="constrained")
        names: Any = [["sky", "strip"]] + ([["seen", "seen"]] if visibilities is not None else [])
        axes: Any = figure.subplot_mosaic(names, height_ratios=(1.6, 1)[: len(names)])
        bands_on_sky(axes["sky"], rings)
        name_sky_axes(axes["sky"], rings.camera.sky_unit, scale)
        ladder(axes["strip"], rings).set_title("along the shadow edge")
        if visibilities is not None:
            visibility_amplitude(axes["seen"], visibilities)
        figure.suptitle(viewer_in_words(rings.camera))
    return figure


def _depth(edge: BandEdge) -> Float[Array, " points"]:
    """Depth of an edge, on both sides of the shadow edge by the reach of the lines outside."""
    with np.errstate(divide="ignore"):
        return np.log(line_reach(search_camera(edge.camera), edge.edge_phase) / np.abs(edge.distance))


def _height(edge: BandEdge, deepest: float) -> tuple[Array, Array]:
    """Edge phases in degrees and heights on the strip."""
    phase, height = np.degrees(edge.edge_phase), np.sign(edge.distance) * np.clip(deepest - _depth(edge), 0, None)
    # From the last point of the turn before to the first one of the next.
    around = np.concatenate([[-1], np.arange(len(phase)), [0]])
    return phase[around] + 360 * np.repeat([-1, 0, 1], [1, len(phase), 1]), height[around]


def _mark(order: int) -> dict[str, Any]:
    return {**_MARK, "color": "black", "markerfacecolor": style.order_colour(order)}


def _ladder_axes(ax: Axes, deepest: float) -> None:
    """Names and ticks: the depth, which grows to the middle from above and from below."""
    step = 4 if deepest > 12 else 2
    depths = np.arange(0, deepest - step / 2, step)
    places = [*(deepest - depths), 0.0, *(depths - deepest)[::-1]]
    names = [style.number(depth) for depth in depths]
    ax.set_yticks(places, [*names, "∞", *names[::-1]])
    ax.set(xlim=(0, 360), ylim=(-deepest, deepest), xlabel="edge phase (deg; 0 prograde end)")
    ax.set_ylabel("depth: inside the shadow below, outside above")
    ax.set_xticks(range(0, 361, 90))
